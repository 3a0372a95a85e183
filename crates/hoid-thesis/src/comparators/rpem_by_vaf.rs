//! The recursive prediction-error method for BJ(nb = 2, nd = 1, nf = 2), with a covariance that is updated by the VAF
//! of a validation set, as the discussion of the thesis proposes (VII: *the covariance matrix could be updated based on
//! VAF from a validation data set, in order to reduce the strong oscillations that are given in state s2*).
//!
//! This comparator is the method `rpem` of `hoid_track` with the settings of the thesis and with [`track_validated`],
//! which contains the update rule. The validation set is a second run of the same person in the same task, with a
//! different remnant.

use hoid_ident::{settings, settings::Bounds};
use hoid_model::{PolynomialModel, Structure};
use hoid_track::{CovarianceUpdates, Method, StartSource, TrackOptions, track_validated};

use super::comparator::{Comparator, ComparatorDescription, Task, TrackingResult};
use crate::ThesisError;

const NAME: &str = "rpem-by-vaf";

settings! {
    /// Options of the recursion with a validation set.
    pub struct RpemByVaf {
        /// Memory 1/(1 - lambda)
        #[setting(unit("samples"), bounds(Bounds::AtLeast(2.0)))]
        pub memory: f64 = 256.0,
        /// Initial P, as a multiple of the unit matrix
        #[setting(bounds(Bounds::PositiveFinite))]
        pub covariance: f64 = 0.1,
        /// Time between validations
        #[setting(unit("s"), bounds(Bounds::PositiveFinite))]
        pub interval: f64 = 0.5,
        /// Length of the validation set that is examined
        #[setting(unit("s"), bounds(Bounds::PositiveFinite))]
        pub window: f64 = 5.12,
        /// Smallest factor of P
        #[setting(bounds(Bounds::UpTo(0.0, 1.0)))]
        pub least: f64 = 0.1,
        /// Power of the ratio of the unexplained parts; 0 leaves P unchanged
        #[setting(bounds(Bounds::NonNegative))]
        pub power: f64 = 4.0,
    }
}

impl Comparator for RpemByVaf {
    fn description(&self) -> ComparatorDescription {
        ComparatorDescription {
            name: NAME,
            help: "recursive prediction-error method with a covariance update from the VAF of a validation set",
            source: "the thesis, section VII",
            extra_information: "a second run of the same person in the same task",
        }
    }

    fn track(&self, task: &Task<'_>) -> Result<TrackingResult, ThesisError> {
        let (e, _) = task.signals(NAME, task.nk)?;
        let unsuited = |found: String| ThesisError::Unsuited {
            method: NAME,
            quantity: "the validation set".to_owned(),
            found,
            expected: format!("a second run of {} samples", e.len()),
        };
        let validation = task.validation.ok_or_else(|| unsuited("missing".to_owned()))?;
        if validation.len() != e.len() || validation.input().len() != e.len() {
            return Err(unsuited(format!("a run of {} samples", validation.len())));
        }
        let structure = Structure::BoxJenkins;
        let orders = structure.operator_orders(task.nk);
        let (memory, covariance) = (self.memory.to_string(), self.covariance.to_string());
        let of_the_text = [
            ("memory", memory.as_str()),
            ("covariance", covariance.as_str()),
            ("limit", "inf"),
            ("stable", "noise"),
        ];
        let options = TrackOptions {
            start: StartSource::Span(Some(task.start_s)),
            ..TrackOptions::new(Method::rpem(), structure, orders)
        };
        let updates = CovarianceUpdates {
            interval_s: self.interval,
            window_s: self.window,
            least: self.least,
            power: self.power,
        };
        let trace = track_validated(task.record, validation, &options.with(&of_the_text)?, &updates, 1)?;
        let mut found = TrackingResult::default();
        for at in task.requested_samples {
            let theta = trace.theta(*at).to_vec();
            let model = PolynomialModel::new(structure, orders, task.record.sample_time(), theta)?;
            let operator = model.discrete_operator().and_then(|of| of.parameters());
            found
                .response
                .push(task.omega_rad_s.iter().map(|omega| model.response(*omega)).collect());
            found.operator.push(operator.ok());
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::Condition;

    use super::{super::tests::*, *};

    #[test]
    fn only_nonzero_power_changes_the_covariance() {
        let run = Run::of(Condition::C4, 2, 0.2);
        let of = |power: f64| {
            let method = RpemByVaf {
                power,
                ..RpemByVaf::default()
            };
            method.track(&run.task()).unwrap().response
        };
        assert_ne!(of(0.0), of(4.0));
        let without = Task {
            validation: None,
            ..run.task()
        };
        let refused = RpemByVaf::default().track(&without).unwrap_err().to_string();
        assert!(refused.contains("validation set"), "{refused}");
    }
}
