//! An operator with a gain and a lead, and its remnant of order m, in physical parameters.

use std::ops::RangeInclusive;

use hoid_ident::{GreyBox, GreyBoxFit, SearchOptions, judgement::second_opinion};
use hoid_model::{FaultHandling, SampleTime};

use super::{BatchEstimator, Fitted, constraints, delay, range};
use crate::{AnalysisError, identification::Identification, level::Level, recordings::Recordings, settings::Setting};

/// Orders m of the remnant that are tried.
pub(crate) const ORDERS: RangeInclusive<usize> = 1..=4;

impl BatchEstimator for GreyBox {
    type Fit = GreyBoxFit;

    fn search(&self) -> &SearchOptions {
        &self.search
    }

    fn initial_state(&self) -> &'static str {
        self.initial_state.name()
    }

    fn by_default(&self) -> Self {
        Self::new(ORDERS)
    }

    fn settings(&self, _sample_time: SampleTime) -> Vec<Setting> {
        let order = range(&self.order);
        let one = self.order.start() == self.order.end();
        let mut settings = vec![
            Setting::new("structure", "operator"),
            Setting::new("noise", "remnant"),
            Setting::new("remnant order m", if one { order } else { format!("{order}, by BIC") }),
            delay(self.delay_range_s),
        ];
        if !self.individual.is_empty() {
            settings.push(Setting::new("individual", self.individual.join(", ")));
        }
        settings.extend(constraints(&self.constraints));
        settings
    }

    fn fit(with: &Identification<Self>, data: &mut Recordings) -> Result<Fitted<GreyBoxFit>, AnalysisError> {
        let estimator = &with.estimator;
        let level = Level::taken_out(data, true, with.faults);
        let fit = estimator.fit(&data.records)?;
        let mut verdict = fit.verdict(&data.records)?;
        if with.faults != FaultHandling::Keep {
            let element = with.controlled_element.as_ref();
            verdict = verdict.and(second_opinion::of_grey_box(estimator, &fit, &data.records, element));
        }
        let found = level.told(data, |k, record| fit.polynomial_fit(k).level(record));
        Ok(Fitted {
            fit,
            verdict,
            described: None,
            taken_out: level.detrend(),
            used: estimator.settings(data.records[0].sample_time()),
            found: found.into_iter().collect(),
        })
    }
}
