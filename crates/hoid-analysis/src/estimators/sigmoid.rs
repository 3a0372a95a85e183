//! An operator whose gains change once, by a sigmoid. A level of u is an unknown of it: the mean of e is that
//! of two persons.

use hoid_ident::{InitialState, SearchOptions, SigmoidChange, SigmoidFit, judgement::second_opinion};
use hoid_model::{Detrend, FaultHandling, SampleTime};

use super::{BatchEstimator, Fitted, constraints, delay};
use crate::{
    AnalysisError,
    identification::Identification,
    level::{levels_into, may_have_level},
    recordings::Recordings,
    settings::Setting,
};

impl BatchEstimator for SigmoidChange {
    type Fit = SigmoidFit;

    fn search(&self) -> &SearchOptions {
        &self.search
    }

    fn initial_state(&self) -> &'static str {
        InitialState::Estimate.name()
    }

    fn by_default(&self) -> Self {
        Self::default()
    }

    fn settings(&self, _sample_time: SampleTime) -> Vec<Setting> {
        let mut settings = vec![
            Setting::new("structure", "operator"),
            Setting::new("change", "sigmoid"),
            Setting::new("form", self.form.name()),
            Setting::new("neuromuscular", if self.neuromuscular { "yes" } else { "no" }),
            Setting::new("prior", self.prior.to_string()),
            Setting::new("orders", format!("nd={}", self.nd)),
            delay(self.delay_range_s),
        ];
        settings.extend(constraints(&self.constraints));
        settings
    }

    fn fit(with: &Identification<Self>, data: &mut Recordings) -> Result<Fitted<SigmoidFit>, AnalysisError> {
        let estimator = Self {
            level: may_have_level(data, true, with.faults),
            ..with.estimator.clone()
        };
        let fit = estimator.fit(&data.records)?;
        let mut verdict = fit.verdict(&data.records)?;
        if with.faults != FaultHandling::Keep {
            verdict = verdict.and(second_opinion::of_sigmoid(&estimator, &fit, &data.records));
        }
        if estimator.level {
            levels_into(&mut data.accounts, &data.records, |_, record| fit.level(record));
        }
        Ok(Fitted {
            fit,
            verdict,
            described: None,
            taken_out: Detrend::None,
            used: estimator.settings(data.records[0].sample_time()),
            found: estimator.level.then(Setting::level).into_iter().collect(),
        })
    }
}
