//! Tracking plan whose orders may still be open: they are searched on the start span or the warm-up.

use std::{collections::BTreeMap, ops::RangeInclusive};

use hoid_model::{Orders, Record, SampleTime, Structure};

use crate::{
    forgetting::ForgettingRule, methods::Method, options::TrackOptions, person_prior::PersonPrior, setup::StartSource,
    shared_options::DEFAULT_DELAY_S,
};
use hoid_ident::{
    Choice, IdentError, NamedOrders, OrderRanges,
    order_selection::{Criterion, choose_orders_with, default_operator_ranges},
};

/// Plan of a recursion whose orders may still be ranges.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackPlan {
    options: TrackOptions,
    ranges: OrderRanges,
    criterion: Criterion,
    sample_time: SampleTime,
}

impl TrackPlan {
    /// Builds a plan and checks everything that does not depend on data. The orders of the options are replaced by the
    /// largest orders of the ranges.
    ///
    /// # Errors
    /// [`IdentError`] for options that contradict each other, for names that do not exist, or for start coefficients if
    /// the ranges contain more than one model.
    pub fn new(
        options: TrackOptions,
        ranges: OrderRanges,
        criterion: Criterion,
        sample_time: SampleTime,
    ) -> Result<Self, IdentError> {
        let ranges = match options.method.is_self_starting() {
            true => default_ranges(&options.method, &ranges, sample_time),
            false => ranges,
        };
        let combinations = ranges.combinations()?;
        if let Some(further) = &options.further
            && combinations.len() > 1
        {
            return Err(IdentError::BadOption {
                option: "the orders of a model with two inputs".to_owned(),
                found: format!("{} combinations of orders", combinations.len()),
                expected: format!(
                    "one number for each order, and one delay in samples for each input: the order search fits only \
                     models with one input, and so ignores {}",
                    further.channel
                ),
            });
        }
        if matches!(options.start, StartSource::Theta(_)) && combinations.len() > 1 {
            return Err(several_models_error());
        }
        let options = TrackOptions {
            // A name that is unknown for the largest orders is unknown for all orders.
            orders: combinations[combinations.len() - 1],
            ..options
        };
        check(&options, sample_time)?;
        Ok(Self {
            options,
            ranges,
            criterion,
            sample_time,
        })
    }

    /// True if no order has to be searched.
    pub fn has_fixed_orders(&self) -> bool {
        self.ranges.combinations().is_ok_and(|all| all.len() == 1)
    }

    /// Returns the options; before [`TrackPlan::choose`] their orders are the largest of the ranges.
    pub fn options(&self) -> &TrackOptions {
        &self.options
    }

    /// Returns the sample time of the plan.
    pub fn sample_time(&self) -> SampleTime {
        self.sample_time
    }

    /// Returns the ranges of orders that are searched.
    pub fn ranges(&self) -> &OrderRanges {
        &self.ranges
    }

    /// Searches the open orders on a record; returns the options with the chosen orders and the result of the search.
    /// If no order is open, nothing is searched. `each` is called after every candidate.
    ///
    /// # Errors
    /// The errors of the search.
    pub fn choose(
        &self,
        span: &Record,
        each: &(dyn Fn() + Sync),
    ) -> Result<(TrackOptions, Option<Choice>), IdentError> {
        if self.has_fixed_orders() {
            return Ok((self.options.clone(), None));
        }
        let template = self.options.start_estimator();
        let records = std::slice::from_ref(span);
        let choice = choose_orders_with(&template, &self.ranges, self.criterion, records, each)?;
        Ok((self.with_orders(choice.fit.orders()), Some(choice)))
    }

    /// Returns the options with orders within the ranges. Settings of coefficients that do not exist with these orders
    /// are removed.
    pub fn with_orders(&self, orders: Orders) -> TrackOptions {
        let mut options = TrackOptions {
            orders,
            ..self.options.clone()
        };
        let names = options.parameter_names();
        options.method.inner_mut().retain(&|key| is_known(&names, key));
        options
    }
}

/// Returns the error for start coefficients that are given while orders are searched.
pub fn several_models_error() -> IdentError {
    IdentError::BadStart {
        reason: "a start applies to a single model, but a range of orders or delays is searched; give nk and the \
                 orders as single numbers"
            .to_owned(),
    }
}

/// Returns ranges of one value each, for a method that does not search: the default orders, or those nearest to them
/// within `ranges`.
fn default_ranges(method: &Method, ranges: &OrderRanges, sample_time: SampleTime) -> OrderRanges {
    let known = method.person_prior().and_then(PersonPrior::delay_s);
    let nk = sample_time.nk(known.unwrap_or(DEFAULT_DELAY_S));
    let default = method.default_orders(nk);
    let only = |default: usize, range: &RangeInclusive<usize>| {
        let one = default.clamp(*range.start(), (*range.end()).max(*range.start()));
        one..=one
    };
    OrderRanges {
        na: only(default.na, &ranges.na),
        nb: only(default.nb, &ranges.nb),
        nc: only(default.nc, &ranges.nc),
        nd: only(default.nd, &ranges.nd),
        nf: only(default.nf, &ranges.nf),
        nk: only(nk, &ranges.nk),
    }
}

/// Returns the search ranges: the defaults of structure and method, replaced by the named orders. If nk is not named,
/// it lies within the range of the tracked delay, if there is one. If no order other than nk is named, the open orders
/// follow from the names of the start coefficients, such as f1 or b0.
///
/// # Errors
/// [`IdentError::BadOption`] for a name that is not an order.
pub fn search_ranges(
    method: &Method,
    structure: Structure,
    named: &NamedOrders,
    start_names: &[String],
    sample_time: SampleTime,
) -> Result<OrderRanges, IdentError> {
    let mut default = default_operator_ranges(structure, sample_time);
    if let Some(nd) = method.default_nd() {
        default.nd = nd..=nd;
    }
    let delay = method.track_delay_s().filter(|_| !named.contains_key("nk"));
    let of_start = if named.keys().all(|name| name == "nk") {
        start_names
    } else {
        &[]
    };
    Ok(narrow_ranges(
        default.with_named_orders(named)?,
        delay,
        of_start,
        sample_time,
    ))
}

/// Narrows the ranges to the tracked delay and to the orders that follow from the names of the start coefficients.
fn narrow_ranges(
    mut ranges: OrderRanges,
    track_delay_s: Option<(f64, f64)>,
    start_names: &[String],
    sample_time: SampleTime,
) -> OrderRanges {
    if let Some((low, high)) = track_delay_s {
        ranges.nk = sample_time.nk(low)..=sample_time.nk(high);
    }
    if start_names.is_empty() {
        return ranges;
    }
    let count = |letter: char| start_names.iter().filter(|name| name.starts_with(letter)).count();
    for (range, letter) in [
        (&mut ranges.na, 'a'),
        (&mut ranges.nb, 'b'),
        (&mut ranges.nc, 'c'),
        (&mut ranges.nd, 'd'),
        (&mut ranges.nf, 'f'),
    ] {
        if range.start() != range.end() {
            *range = count(letter)..=count(letter);
        }
    }
    ranges
}

/// Checks the start of the recursion before data are read or orders are searched.
fn check(options: &TrackOptions, sample_time: SampleTime) -> Result<(), IdentError> {
    options.check_at(sample_time)?;
    for memory in options.memories()? {
        memory.lambda(sample_time)?;
    }
    let names = options.parameter_names();
    let setup = options.setup()?;
    let drift = match &setup.forgetting {
        ForgettingRule::RandomWalk(drift) => Some(drift),
        _ => None,
    };
    let named = drift.into_iter().flat_map(BTreeMap::keys).chain(setup.bounds.keys());
    for name in named {
        if !names.contains(name) {
            return Err(IdentError::UnknownParameter {
                name: name.clone(),
                available: names.join(", "),
            });
        }
    }
    Ok(())
}

/// True if `key` is the name of a parameter, or the letter of its polynomial.
fn is_known(names: &[String], key: &str) -> bool {
    let is = |rest: &str| rest.bytes().all(|b| b.is_ascii_digit());
    names.iter().any(|n| n.strip_prefix(key).is_some_and(is))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::Structure;

    use super::*;
    use crate::Method;

    #[test]
    fn known_names_and_letters_are_recognised() {
        let names: Vec<String> = ["K_e", "K_e_dot", "b0", "b1", "f2"].map(str::to_owned).to_vec();
        for known in ["K_e", "K_e_dot", "b", "b1", "f"] {
            assert!(is_known(&names, known), "{known}");
        }
        for unknown in ["K", "d", "b2", "f1", "x"] {
            assert!(!is_known(&names, unknown), "{unknown}");
        }
    }

    #[test]
    fn start_and_delay_range_narrow_the_orders() {
        let ts = SampleTime::AT_100_HZ;
        let default = default_operator_ranges(Structure::BoxJenkins, ts);
        let start: Vec<String> = ["b0", "b1", "d1", "d2", "f1", "f2"].map(str::to_owned).to_vec();
        let found = narrow_ranges(default.clone(), Some((0.2, 0.3)), &start, ts);
        assert_eq!((found.nd.clone(), found.nk.clone()), (2..=2, 21..=31));
        assert_eq!(narrow_ranges(default.clone(), None, &[], ts), default);
    }

    #[test]
    fn named_orders_replace_the_defaults() {
        let ts = SampleTime::AT_100_HZ;
        let of = |method: &Method, named: &[(&str, RangeInclusive<usize>)], start: &[&str]| {
            let named = named.iter().map(|(name, range)| ((*name).to_owned(), range.clone()));
            let start: Vec<String> = start.iter().map(|name| (*name).to_owned()).collect();
            search_ranges(method, Structure::BoxJenkins, &named.collect(), &start, ts)
        };
        let tracked = Method::rpem().with("track_delay", "0.2..0.3").unwrap();
        let found = of(&tracked, &[], &[]).unwrap();
        assert_eq!(found.nk, 21..=31);
        let found = of(&tracked, &[("nk", 29..=29), ("nd", 1..=2)], &[]).unwrap();
        assert_eq!((found.nd, found.nk), (1..=2, 29..=29));
        let start = ["b0", "b1", "d1", "d2", "f1", "f2"];
        let nd = |named: &[(&str, RangeInclusive<usize>)]| of(&Method::rpem(), named, &start).unwrap().nd;
        assert_eq!((nd(&[("nk", 29..=29)]), nd(&[("nf", 2..=2)])), (2..=2, 1..=4));
        assert!(
            of(&tracked, &[("nx", 1..=1)], &[])
                .unwrap_err()
                .to_string()
                .contains("nx")
        );
    }

    #[test]
    fn self_starting_method_needs_no_search() {
        let ts = SampleTime::AT_100_HZ;
        let ranges = OrderRanges {
            nd: 16..=16,
            ..default_operator_ranges(Structure::BoxJenkins, ts)
        };
        let options = TrackOptions::default_for(Method::adaptive(), 29);
        let plan = TrackPlan::new(options.clone(), ranges.clone(), Criterion::Bic, ts).unwrap();
        assert!(plan.has_fixed_orders());
        assert_eq!((plan.options().orders.nk, plan.options().orders.nd), (21, 16));
        let known = OrderRanges { nk: 29..=29, ..ranges };
        let plan = TrackPlan::new(options, known, Criterion::Bic, ts).unwrap();
        assert_eq!(plan.options().orders.nk, 29);
    }

    #[test]
    fn start_is_refused_for_several_models() {
        let ts = SampleTime::AT_100_HZ;
        let default = default_operator_ranges(Structure::BoxJenkins, ts);
        let options = TrackOptions {
            start: StartSource::Theta(vec![0.0; 5]),
            ..TrackOptions::new(
                Method::rpem(),
                Structure::BoxJenkins,
                Structure::BoxJenkins.operator_orders(29),
            )
        };
        let refused = TrackPlan::new(options, default, Criterion::Bic, ts).unwrap_err();
        assert!(refused.to_string().contains("single model"), "{refused}");
    }
}
