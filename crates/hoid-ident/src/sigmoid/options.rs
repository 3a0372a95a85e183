//! Options of an operator that changes once: the fields of [`SigmoidChange`], and the names under which text input sets
//! them. Each option is declared only in this file.

use std::collections::BTreeMap;

use hoid_model::Form;

use super::noise_level::NoiseLevel;
use crate::{
    Constraint, IdentError, InitialState, SearchOptions,
    family::OperatorPrior,
    order_selection::{NamedOrders, range_text},
    settings::{BatchOption, BatchOptions},
    shared_options as shared,
};

/// Estimator for an operator that changes once, with its options.
#[derive(Debug, Clone, PartialEq)]
pub struct SigmoidChange {
    /// Form of the operator. The parameters of its numerator change (K, T_L, c_1, c_2, alpha; with a lag the gain is
    /// K/T_I); lag, neuromuscular part and delay do not change. Default: a gain and a lead.
    pub form: Form,
    /// True if the operator has a neuromuscular part. Default true.
    pub neuromuscular: bool,
    /// True if a level of u is estimated in each record, for recorded data
    /// ([`SigmoidFit::level`](crate::SigmoidFit::level)). Default false.
    pub level: bool,
    /// Prior knowledge about the person; the prior of T_L applies before and after the change. Default: none.
    pub prior: OperatorPrior,
    /// Order nd of D. If it is `None`, Schwarz's criterion chooses an order from 1 to 12 for the part of u that an
    /// operator without a change does not explain; with a given start the order is 1. Default `None`.
    pub nd: Option<usize>,
    /// Smallest and largest delay tau_e, s; the delay need not be a whole number of samples. Equal values fix the
    /// delay.
    pub delay_range_s: (f64, f64),
    /// Fixed and bounded parameters by name ([`SigmoidChange::names`]). By default t_M is in the middle nine tenths of
    /// the time span common to the records, and G is between 5/span and 2/Ts.
    pub constraints: BTreeMap<String, Constraint>,
    /// Model of the standard deviation of the innovations.
    pub noise_level: NoiseLevel,
    /// Start of the search, which replaces the automatic starts: the parameters of [`SigmoidChange::names`] in their
    /// units.
    pub start: Option<Vec<f64>>,
    /// Method and limits of each search.
    pub search: SearchOptions,
    /// True if likelihood intervals of t_M and G are computed, which takes about as long as the fit. Default true.
    pub likelihood_intervals: bool,
}

impl Default for SigmoidChange {
    /// Returns the default options: a noise order chosen from the records, a delay between 0.05 and 0.6 s, a changing
    /// noise level, and automatic starts. Searches have up to 200 steps and a tolerance of 1e-10 (a thousandth of a
    /// standard error), because the loss has many ripples in t_M if the change is small.
    fn default() -> Self {
        Self {
            form: Form::Lead,
            neuromuscular: true,
            level: false,
            prior: OperatorPrior::none(),
            nd: None,
            delay_range_s: (0.05, 0.6),
            constraints: BTreeMap::new(),
            noise_level: NoiseLevel::default(),
            start: None,
            search: SearchOptions {
                max_iterations: 200,
                tolerance: 1e-10,
                ..SearchOptions::default()
            },
            likelihood_intervals: true,
        }
    }
}

impl SigmoidChange {
    /// Sets the order nd of the noise model.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for an order other than nd, or for a range of orders.
    pub fn with_noise_orders(self, named: &NamedOrders) -> Result<Self, IdentError> {
        for (name, range) in named {
            if name != "nd" || range.start() != range.end() {
                return Err(IdentError::BadOption {
                    option: format!("order {name}"),
                    found: range_text(range),
                    expected: "a single number nd for an operator that changes, such as nd=2".to_owned(),
                });
            }
        }
        let nd = named.get("nd").map(|nd| *nd.start());
        Ok(Self {
            nd: nd.or(self.nd),
            ..self
        })
    }
}

impl BatchOptions for SigmoidChange {
    fn options() -> Vec<BatchOption<Self>> {
        let default = Self::default();
        let mut all = vec![
            shared::noise_option(|_: &mut Self, _, _| Ok(())),
            shared::change_option().with_formatter("change", |_, _| Some("sigmoid".to_owned())),
            shared::form_option(|how: &mut Self, form| how.form = form.unwrap_or(Self::default().form))
                .with_formatter("form", |how, _| Some(how.form.name().to_owned())),
            shared::neuromuscular_option(|how: &mut Self| &mut how.neuromuscular)
                .with_formatter("neuromuscular", |how, _| Some(shared::yes_no_text(how.neuromuscular))),
            shared::prior_option("none", |how: &mut Self| &mut how.prior)
                .with_formatter("prior", |how, _| Some(how.prior.to_string())),
            BatchOption::new(shared::orders_setting("nd=1..12"), |how: &mut Self, option, text| {
                *how = how.clone().with_noise_orders(&option.read(text)?)?;
                Ok(())
            })
            .with_formatter("orders", |how, _| {
                Some(how.nd.map_or("nd=1..12".to_owned(), |nd| format!("nd={nd}")))
            }),
            shared::delay_range_option(
                default.delay_range_s,
                |how: &mut Self| &mut how.delay_range_s,
                |how| how.delay_range_s,
            ),
            shared::initial_state_option(|_: &mut Self, option, rule| match rule {
                None | Some(InitialState::Estimate) => Ok(()),
                Some(other) => {
                    let expected = "auto or estimate: a fit with a change estimates the initial states";
                    Err(option.invalid_value(other.name(), expected))
                }
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
