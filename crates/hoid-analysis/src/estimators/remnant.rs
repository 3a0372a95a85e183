//! Operator with a gain and a lead, and a remnant of order m, in physical parameters.

use hoid_ident::{GreyBox, GreyBoxFit, SearchOptions, diagnostics::second_opinion, settings::MethodSpec};
use hoid_model::{FaultHandling, Structure};

use super::{BatchEstimator, FittedModel, registry_settings};
use crate::{
    AnalysisError,
    identification::Identification,
    level::Level,
    names::REMNANT,
    options::{self, AnalysisOption},
    recordings::Recordings,
};

impl BatchEstimator for GreyBox {
    type Fit = GreyBoxFit;

    fn specs() -> Vec<MethodSpec> {
        vec![MethodSpec {
            name: REMNANT,
            help: "operator and remnant in physical parameters, with a real delay",
            source: "Ljung 1999, section 4.3; the thesis, equation 4",
            structures: &[Structure::BoxJenkins],
            settings: registry_settings(Self::options_of_analysis()),
        }]
    }

    fn options_of_analysis() -> Vec<AnalysisOption<Self>> {
        let mut all = options::estimator_options();
        all.extend([options::controlled_element_option(), options::answers_option()]);
        all
    }

    fn search(&self) -> &SearchOptions {
        &self.search
    }

    fn initial_state(&self) -> &'static str {
        self.initial_state.name()
    }

    fn with_defaults(&self) -> Self {
        Self::default()
    }

    fn fit(with: &Identification<Self>, data: &mut Recordings) -> Result<FittedModel<GreyBoxFit>, AnalysisError> {
        let estimator = &with.estimator;
        let level = Level::remove(data, true, with.faults);
        let fit = estimator.fit(&data.records)?;
        let mut verdict = fit.verdict(&data.records)?;
        if with.faults != FaultHandling::Keep {
            let element = with.controlled_element.as_ref();
            verdict = verdict.append(second_opinion::grey_box_findings(
                estimator,
                &fit,
                &data.records,
                element,
            ));
        }
        let found = level.report(data, |k, record| fit.polynomial_fit(k).level(record));
        Ok(FittedModel {
            fit,
            verdict,
            described: None,
            removed_trend: level.detrend(),
            settings: with.settings(data.records[0].sample_time()),
            found: found.into_iter().collect(),
        })
    }
}
