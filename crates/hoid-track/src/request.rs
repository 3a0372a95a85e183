//! A requested recursion, before the sample time is known: a delay in seconds is not yet an order, and the coefficients
//! of a start are given by name.

use std::collections::BTreeMap;

use hoid_ident::{IdentError, NamedOrders, order_selection::Criterion, settings::DelayRange};
use hoid_model::{ContinuousTransferFunction, SampleTime, Structure, theta_from_start};

use crate::{
    further_input::{RequestedInput, coefficient_names},
    methods::Method,
    options::TrackOptions,
    plan::{TrackPlan, search_ranges, several_models_error},
    setup::StartSource,
};

/// Requested start of the recursion.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum RequestedStart {
    /// The default start of the method: a batch fit, or prior knowledge of people.
    #[default]
    Default,
    /// Without knowledge of the operator.
    Nothing,
    /// All coefficients, by name.
    Coefficients(BTreeMap<String, f64>),
}

/// A requested recursion.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackRequest {
    /// The recursive method, with its options.
    pub method: Method,
    /// The structure; `None` for the default structure of the method.
    pub structure: Option<Structure>,
    /// Orders by name, each a range.
    pub orders: NamedOrders,
    /// The delay, in samples or in s.
    pub delay: Option<DelayRange>,
    /// A further input, for the methods `adaptive`, `rls` and `rpem`.
    pub further: Option<RequestedInput>,
    /// The start.
    pub start: RequestedStart,
    /// Criterion that chooses between the searched orders.
    pub criterion: Criterion,
    /// Magnitude of e or u beyond which a sample counts as faulty.
    pub largest: f64,
    /// Frequencies at which the response is reported, rad/s.
    pub at_rad_s: Vec<f64>,
    /// The controlled element.
    pub controlled_element: Option<ContinuousTransferFunction>,
}

impl Default for TrackRequest {
    fn default() -> Self {
        Self::of(Method::default())
    }
}

impl TrackRequest {
    /// Requests a method, with defaults for everything else.
    pub fn of(method: Method) -> Self {
        Self {
            method,
            structure: None,
            orders: NamedOrders::new(),
            delay: None,
            further: None,
            start: RequestedStart::Default,
            criterion: Criterion::Bic,
            largest: TrackOptions::DEFAULT_MAX_MAGNITUDE,
            at_rad_s: Vec::new(),
            controlled_element: None,
        }
    }

    /// Returns the requested structure or, if there is none, the default structure of the method.
    pub fn structure(&self) -> Structure {
        self.structure.unwrap_or_else(|| self.method.default_structure())
    }

    /// True for a recursion of polynomials, or if the delay is in samples: the sampling rate is then kept.
    pub fn counts_samples(&self) -> bool {
        let in_samples = matches!(self.delay, Some(DelayRange::Samples(_))) || self.orders.contains_key("nk");
        in_samples || self.further.as_ref().is_some_and(|further| further.nk.is_some()) || self.method.counts_samples()
    }

    /// Returns the plan for a sample time, after a check of everything that does not depend on data.
    ///
    /// # Errors
    /// [`IdentError`] for options that contradict each other, or for names that do not exist.
    pub fn plan(&self, sample_time: SampleTime) -> Result<TrackPlan, IdentError> {
        let mut orders = self.orders.clone();
        if let Some(delay) = &self.delay {
            if orders.contains_key("nk") {
                return Err(IdentError::BadOption {
                    option: "nk".to_owned(),
                    found: "both nk and the delay in s".to_owned(),
                    expected: "one of them: they are the same quantity in samples and in s".to_owned(),
                });
            }
            if let DelayRange::Seconds(low, _) = delay
                && *low < 0.0
            {
                return Err(IdentError::BadOption {
                    option: "delay".to_owned(),
                    found: delay.to_string(),
                    expected: "0 s or more".to_owned(),
                });
            }
            orders.insert("nk".to_owned(), delay.nk_range(sample_time));
        }
        let names: Vec<String> = match &self.start {
            // The coefficients of a further input do not count for the orders of the first.
            RequestedStart::Coefficients(named) => named.keys().filter(|name| !name.contains('[')).cloned().collect(),
            _ => Vec::new(),
        };
        let structure = self.structure();
        let ranges = search_ranges(&self.method, structure, &orders, &names, sample_time)?;
        let combinations = ranges.combinations()?;
        // These are the largest values of each order: a name that is unknown for them is unknown for all orders.
        let largest = combinations[combinations.len() - 1];
        let further = self.further.as_ref().map(|further| further.tracked(sample_time));
        let start = match &self.start {
            RequestedStart::Default => StartSource::Span(None),
            RequestedStart::Nothing => StartSource::Nothing,
            RequestedStart::Coefficients(_) if combinations.len() > 1 => return Err(several_models_error()),
            RequestedStart::Coefficients(named) => StartSource::Theta(
                theta_from_start(&coefficient_names(&largest, further.as_ref()), named).map_err(|reason| {
                    IdentError::BadStart {
                        reason: format!("it {reason}"),
                    }
                })?,
            ),
        };
        let options = TrackOptions {
            start,
            largest: self.largest,
            at_rad_s: self.at_rad_s.clone(),
            controlled_element: self.controlled_element.clone(),
            further,
            ..TrackOptions::new(self.method.clone(), structure, largest)
        };
        TrackPlan::new(options, ranges, self.criterion, sample_time)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn delay_in_seconds_is_converted_to_samples() {
        let asked = TrackRequest {
            delay: Some(DelayRange::Seconds(0.28, 0.28)),
            ..TrackRequest::of(Method::rpem())
        };
        assert!(!asked.clone().counts_samples() || Method::rpem().counts_samples());
        for (hz, nk) in [(100.0, 29), (50.0, 15)] {
            let plan = asked.plan(SampleTime::new(1.0 / hz).unwrap()).unwrap();
            assert_eq!(plan.options().orders.nk, nk);
        }
        let twice = TrackRequest {
            orders: [("nk".to_owned(), 29..=29)].into(),
            ..asked
        };
        let refused = twice.plan(SampleTime::AT_100_HZ).unwrap_err().to_string();
        assert!(refused.contains("one of them"), "{refused}");
    }

    #[test]
    fn named_start_is_converted_to_theta() {
        let orders: NamedOrders = [("nk", 29), ("nd", 1)].map(|(name, n)| (name.to_owned(), n..=n)).into();
        let named: BTreeMap<String, f64> = [("b0", 0.1), ("b1", 0.0), ("d1", -0.5), ("f1", -1.5), ("f2", 0.6)]
            .map(|(name, value)| (name.to_owned(), value))
            .into();
        let of = |named: BTreeMap<String, f64>| TrackRequest {
            orders: orders.clone(),
            start: RequestedStart::Coefficients(named),
            ..TrackRequest::of(Method::rpem())
        };
        let plan = of(named.clone()).plan(SampleTime::AT_100_HZ).unwrap();
        let names = plan.options().parameter_names();
        let StartSource::Theta(theta) = &plan.options().start else {
            panic!("{:?}", plan.options().start)
        };
        assert!(names.iter().zip(theta).all(|(name, value)| named[name] == *value));
        let lacking: BTreeMap<String, f64> = named.into_iter().filter(|(name, _)| name != "f2").collect();
        let refused = of(lacking).plan(SampleTime::AT_100_HZ).unwrap_err().to_string();
        assert!(refused.contains("lacks f2"), "{refused}");
    }
}
