//! Options of an operator that changes once: the fields of [`SigmoidChange`], and the names under which texts set them.
//! Each option is declared only here.

use std::collections::BTreeMap;

use hoid_model::Form;

use super::noise_level::NoiseLevel;
use crate::{
    Constraint, IdentError, InitialState, SearchOptions,
    family::OperatorPrior,
    order_selection::{NamedOrders, written},
    settings::{BatchOption, BatchOptions},
    shared_options as shared,
};

/// Estimator of an operator that changes once, with its options.
#[derive(Debug, Clone, PartialEq)]
pub struct SigmoidChange {
    /// Form of the operator: its numerator changes (K, T_L, c_1, c_2, alpha; with a lag the gain is K/T_I). Lag,
    /// neuromuscular part and delay do not change. Default: a gain and a lead.
    pub form: Form,
    /// True with the neuromuscular part. Default true.
    pub neuromuscular: bool,
    /// True if a level of u is estimated in each record, for recorded data
    /// ([`SigmoidFit::level`](crate::SigmoidFit::level)). Default false.
    pub level: bool,
    /// Prior knowledge of the person; that of T_L is used before and after the change. Default: none.
    pub prior: OperatorPrior,
    /// Order nd of D; `None` for the best by Schwarz's criterion, from 1 to 12, for the part of u that one operator
    /// leaves; 1 with a given start. Default `None`.
    pub nd: Option<usize>,
    /// Shortest and longest delay tau_e, s; any fraction of a sample. Equal ends fix it.
    pub delay_range_s: (f64, f64),
    /// Fixed and bounded parameters by name ([`SigmoidChange::names`]). By default t_M is within the middle nine tenths
    /// of the time span common to the records, and G between 5/span and 2/Ts.
    pub constraints: BTreeMap<String, Constraint>,
    /// Standard deviation of the innovations over the record.
    pub noise_level: NoiseLevel,
    /// Start of the search, instead of the estimator's own starts: the parameters of [`SigmoidChange::names`] in their
    /// units.
    pub start: Option<Vec<f64>>,
    /// Method and limits of each search.
    pub search: SearchOptions,
    /// True if likelihood intervals of t_M and G are computed; they take about as long as the fit. Default true.
    pub likelihood_intervals: bool,
}

impl Default for SigmoidChange {
    /// Noise of the order that the records show, delay between 0.05 and 0.6 s, a noise level that changes, and the
    /// default starts; searches of up to 200 steps to a relative decrease of 1e-10 (a thousandth of a standard error):
    /// with a small change the loss has many ripples in t_M.
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
    /// Sets the given order nd of the noise.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for other orders, and for a range.
    pub fn with_noise_orders(self, named: &NamedOrders) -> Result<Self, IdentError> {
        for (name, range) in named {
            if name != "nd" || range.start() != range.end() {
                return Err(IdentError::BadOption {
                    option: format!("order {name}"),
                    found: written(range),
                    expected: "a single number nd of an operator that changes, such as nd=2".to_owned(),
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
            shared::noise(|_: &mut Self, _, _| Ok(())),
            shared::change().printed("change", |_, _| Some("sigmoid".to_owned())),
            shared::form(|how: &mut Self, form| how.form = form.unwrap_or(Self::default().form))
                .printed("form", |how, _| Some(how.form.name().to_owned())),
            shared::neuromuscular(|how: &mut Self| &mut how.neuromuscular)
                .printed("neuromuscular", |how, _| Some(shared::yes_words(how.neuromuscular))),
            shared::prior("none", |how: &mut Self| &mut how.prior)
                .printed("prior", |how, _| Some(how.prior.to_string())),
            BatchOption::new(shared::orders("nd=1..12"), |how: &mut Self, option, text| {
                *how = how.clone().with_noise_orders(&option.read(text)?)?;
                Ok(())
            })
            .printed("orders", |how, _| {
                Some(how.nd.map_or("nd=1..12".to_owned(), |nd| format!("nd={nd}")))
            }),
            shared::delay_range(
                default.delay_range_s,
                |how: &mut Self| &mut how.delay_range_s,
                |how| how.delay_range_s,
            ),
            shared::initial_state(|_: &mut Self, option, rule| match rule {
                None | Some(InitialState::Estimate) => Ok(()),
                Some(other) => {
                    let expected = "auto or estimate: a fit with a change estimates the initial states";
                    Err(option.refused(other.name(), expected))
                }
            }),
        ];
        all.extend(shared::constraints(
            |how: &mut Self| &mut how.constraints,
            |how| &how.constraints,
        ));
        all.extend(shared::search(default.search, |how: &mut Self| &mut how.search));
        all
    }
}
