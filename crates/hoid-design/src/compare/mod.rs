//! Comparison of conditions and of people.
//!
//! Each person has an estimate with its standard error in each condition (`hoid group`). Contrasts of the conditions
//! (`contrast`) are computed for each person, and their mean over people, or the difference of groups of people, by a
//! random-effects meta-analysis: people with precise estimates have more weight if people are similar.
//!
//! | module | contents |
//! |---|---|
//! | [`meta_regression`](fn@meta_regression) | estimates of people with their errors: restricted likelihood, interval by Hartung and Knapp |
//! | [`EffectSize`] | d_z, Hedges g, with intervals |
//! | [`bayes_factor`] | evidence for a difference against none |
//! | [`holm`] | probabilities of several tests |
//! | [`GroupEstimates`] | estimates of a group for each person, from its directory or its JSON |
//! | [`Quantity`] | quantities to compare |
//! | [`Factor`] | variables in which conditions or people differ; `contrast`: the weights of conditions |
//! | [`CommonForm`] | the form in which parameters of all people are compared; `recordings`: the analysis of recordings in it |
//! | [`Comparing`] | comparison of a group; `learning`: runs as a covariate |
//! | [`Comparison`] | the result, its JSON and back; `sentence`: each difference for a paper |

mod adjust;
mod bayes_factor;
mod common_form;
mod comparing;
mod comparison;
mod contrast;
mod effect_size;
mod error;
mod factor;
mod group_estimates;
mod learning;
mod meta_regression;
mod quantity;
mod recordings;
mod sentence;

pub use adjust::holm;
pub use bayes_factor::bayes_factor;
pub use common_form::CommonForm;
pub use comparing::{Adjustment, Comparing, Covariate};
pub use comparison::{Comparison, Difference, Learning, LeftOut, Mean, PersonEstimate};
pub use effect_size::{EffectSize, d_z, hedges_g};
pub use error::CompareError;
pub use factor::{Factor, Level, Variation};
pub use group_estimates::GroupEstimates;
pub use meta_regression::{
    Coefficient, MetaRegression, Observation, Weights, meta_mean, meta_regression, variance_between,
};
pub use quantity::Quantity;
