//! Options of the operator with a remnant of order m: the fields of [`GreyBox`], and the names under which text input
//! sets them. Each option is declared only in this file.

use std::{collections::BTreeMap, ops::RangeInclusive};

use crate::{
    Constraint, InitialState, SearchOptions,
    settings::{BatchOption, BatchOptions, Kind, Setting},
    shared_options as shared,
};

/// Default range of the remnant orders m that are tried.
const DEFAULT_ORDERS: RangeInclusive<usize> = 1..=4;

/// Estimator in physical parameters, with its options.
#[derive(Debug, Clone, PartialEq)]
pub struct GreyBox {
    /// Candidate orders m of the remnant filter, 0 (white) to 4.
    pub order: RangeInclusive<usize>,
    /// Smallest and largest delay tau_e in s. Default 0.05 to 0.6.
    pub delay_range_s: (f64, f64),
    /// Fixed and bounded parameters by name ([`GREY_BOX_PARAMETER_NAMES`](super::GREY_BOX_PARAMETER_NAMES)). Either T_L
    /// or K_e_dot can be constrained, not both.
    pub constraints: BTreeMap<String, Constraint>,
    /// Names of the parameters that differ between records; all others are common to the records.
    pub individual: Vec<String>,
    /// Treatment of the initial states of each record. Default: estimated.
    pub initial_state: InitialState,
    /// Limits of the search.
    pub search: SearchOptions,
    /// Number of grid points from which searches are made. Default 2.
    pub starts: usize,
}

impl Default for GreyBox {
    /// Returns the default options, with the orders 1 to 4 of the remnant.
    fn default() -> Self {
        Self::new(DEFAULT_ORDERS)
    }
}

impl GreyBox {
    /// Creates a grey box with these orders of the remnant and otherwise the default options.
    pub fn new(order: RangeInclusive<usize>) -> Self {
        Self {
            order,
            delay_range_s: (0.05, 0.6),
            constraints: BTreeMap::new(),
            individual: Vec::new(),
            initial_state: InitialState::default(),
            search: SearchOptions::default(),
            starts: 2,
        }
    }
}

impl BatchOptions for GreyBox {
    fn options() -> Vec<BatchOption<Self>> {
        let default = Self::default();
        let mut all = vec![
            shared::noise_option(|_: &mut Self, _, _| Ok(()))
                .with_formatter("noise", |_, _| Some("remnant".to_owned())),
            shared::change_option(),
            BatchOption::new(remnant_order_setting(), |how: &mut Self, option, text| {
                how.order = option.read(text)?;
                Ok(())
            })
            .with_formatter("remnant order m", |how, _| {
                let order = shared::order_range_text(&how.order);
                let one = how.order.start() == how.order.end();
                Some(if one { order } else { format!("{order}, by BIC") })
            }),
            shared::delay_range_option(
                default.delay_range_s,
                |how: &mut Self| &mut how.delay_range_s,
                |how| how.delay_range_s,
            ),
            shared::individual_parameters_option(|how: &mut Self, _, names| {
                how.individual = names;
                Ok(())
            })
            .with_formatter("individual", |how, _| {
                (!how.individual.is_empty()).then(|| how.individual.join(", "))
            }),
            shared::initial_state_option(|how: &mut Self, _, rule| {
                how.initial_state = rule.unwrap_or_default();
                Ok(())
            }),
        ];
        all.extend(shared::constraint_options(
            |how: &mut Self| &mut how.constraints,
            |how| &how.constraints,
        ));
        all.extend(shared::search_options(default.search, |how: &mut Self| &mut how.search));
        all
    }
}

fn remnant_order_setting() -> Setting {
    let help = "Order m of the remnant, or a range to search";
    Setting::new("remnant_order", Kind::Counts, help).default(&shared::order_range_text(&DEFAULT_ORDERS))
}
