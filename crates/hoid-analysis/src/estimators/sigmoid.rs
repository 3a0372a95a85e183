//! Operator whose gains change once, as a sigmoid function of time. The level of u is one of the unknowns, because the
//! mean of e is filtered by two different operators.

use hoid_ident::{
    InitialState, SearchOptions, SigmoidChange, SigmoidFit, diagnostics::second_opinion, settings::MethodSpec,
};
use hoid_model::{Detrend, FaultHandling, Structure};

use super::{BatchEstimator, FittedModel, registry_settings};
use crate::{
    AnalysisError,
    identification::Identification,
    level::{may_have_level, write_levels},
    names::CHANGE,
    options::{self, AnalysisOption},
    recordings::Recordings,
    settings::Setting,
};

impl BatchEstimator for SigmoidChange {
    type Fit = SigmoidFit;

    fn specs() -> Vec<MethodSpec> {
        vec![MethodSpec {
            name: CHANGE,
            help: "an operator of any form whose gains change once, along a sigmoid",
            source: "Zaal 2016; the thesis, section II",
            structures: &[Structure::BoxJenkins],
            settings: registry_settings(Self::options_of_analysis()),
        }]
    }

    fn options_of_analysis() -> Vec<AnalysisOption<Self>> {
        let mut all = options::with_prior_of_fits(options::estimator_options(), |how: &mut Self| &mut how.prior);
        all.push(options::answers_option());
        all
    }

    fn search(&self) -> &SearchOptions {
        &self.search
    }

    fn initial_state(&self) -> &'static str {
        InitialState::Estimate.name()
    }

    fn with_defaults(&self) -> Self {
        Self::default()
    }

    fn fit(with: &Identification<Self>, data: &mut Recordings) -> Result<FittedModel<SigmoidFit>, AnalysisError> {
        let estimator = Self {
            level: may_have_level(data, true, with.faults),
            ..with.estimator.clone()
        };
        let fit = estimator.fit(&data.records)?;
        let mut verdict = fit.verdict(&data.records)?;
        if with.faults != FaultHandling::Keep {
            verdict = verdict.append(second_opinion::sigmoid_finding(&estimator, &fit, &data.records));
        }
        if estimator.level {
            write_levels(&mut data.accounts, &data.records, |_, record| fit.level(record));
        }
        Ok(FittedModel {
            fit,
            verdict,
            described: None,
            removed_trend: Detrend::None,
            settings: with.settings(data.records[0].sample_time()),
            found: estimator.level.then(Setting::level).into_iter().collect(),
        })
    }
}
