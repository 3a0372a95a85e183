//! Do conditions differ, and people?
//!
//! Each person has an estimate with its error in each condition (`hoid group`). What is compared of them are contrasts of
//! their conditions (`contrast`), and the mean of those over people, or the difference of groups of people, is a
//! random-effects meta-analysis: people who are known well count more, as far as people are alike.
//!
//! | module | contents |
//! |---|---|
//! | [`meta_regression`](fn@meta_regression) | estimates of people with their errors: restricted likelihood, interval by Hartung and Knapp |
//! | [`EffectSize`] | d_z, Hedges g, with intervals |
//! | [`holm`] | probabilities of several tests |
//! | [`GroupEstimates`] | what a group reports about each person, from its directory or its JSON |
//! | [`Quantity`] | what is compared |
//! | [`Factor`] | what conditions, or people, differ in; `contrast`: the weights of conditions |
//! | [`Comparing`] | from a group to a comparison; `learning`: runs as a covariate |
//! | [`Comparison`] | the result, its JSON and back; `sentence`: each difference for a paper |

mod adjust;
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
mod sentence;

pub use adjust::holm;
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
