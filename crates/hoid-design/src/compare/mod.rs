//! Comparison of conditions and of people.
//!
//! Each person has an estimate with its standard error in each condition (`hoid group`). Contrasts of the conditions
//! (`contrast`) are computed for each person. A random-effects meta-analysis then gives their mean over people, or the
//! difference between groups of people; if people are similar, those with precise estimates have more weight.
//!
//! | module | contents |
//! |---|---|
//! | [`meta_regression`](fn@meta_regression) | regression of the estimates of people with their errors: restricted maximum likelihood (REML), Hartung-Knapp intervals |
//! | [`EffectSize`] | d_z and Hedges' g, with intervals |
//! | [`bayes_factor`] | evidence for a difference against no difference |
//! | [`holm`] | adjustment of the p-values of several tests |
//! | [`GroupEstimates`] | estimates for each person of a group, from its directory or its JSON; `run_to_run`: their variation between runs |
//! | [`Quantity`] | quantities to compare |
//! | [`Factor`] | variables in which conditions or people differ; `contrast`: weights of the conditions |
//! | [`CommonForm`] | form in which the parameters of all people are compared; `recordings`: analysis of recordings in this form |
//! | [`ComparisonOptions`] | comparison of a group; `learning`: runs as a covariate |
//! | [`Comparison`] | result of a comparison, written to and read from JSON; `sentence`: description of each difference for a paper |

mod adjust;
mod bayes_factor;
mod common_form;
mod comparison;
mod contrast;
mod effect_size;
mod error;
mod factor;
mod group_comparison;
mod group_estimates;
mod learning;
mod meta_regression;
mod quantity;
mod recordings;
mod run_to_run;
mod sentence;

pub use adjust::holm;
pub use bayes_factor::bayes_factor;
pub use common_form::CommonForm;
pub use comparison::{Comparison, Difference, Learning, Mean, MissingEstimate, PersonEstimate};
pub use effect_size::{EffectSize, d_z, hedges_g};
pub use error::CompareError;
pub use factor::{Factor, Level, Variation};
pub use group_comparison::{Adjustment, ComparisonOptions, Covariate};
pub use group_estimates::GroupEstimates;
pub use meta_regression::{
    Coefficient, MetaRegression, Observation, Weights, meta_mean, meta_regression, variance_between_people,
};
pub use quantity::Quantity;
