//! Operators of recorded people: the family of operators with errors that hold.
//!
//! `u = Y e + (C/D) eps` with Y an operator of the family ([`hoid_model::operator_family`]). People differ from a
//! simulation in three ways that decide whether their parameters mean anything: they integrate slow errors (a lag that
//! the operator must have), their remnant is not a filter of first order (the noise model must be rich), and they vary
//! (error bars must come from the scatter between runs). What the data do not determine is reported to be so.
//!
//! 1. The describing function at the lines of a periodic excitation, where one was recorded
//!    ([`crate::frequency`]); each form is fitted to it ([`LineFit`]). Without one, the response of
//!    an ARX model of high order gives the starts.
//! 2. Each form by prediction error, with an autoregressive (or ARMA) noise model whose order Akaike's criterion
//!    chooses, and a weak prior on what seconds of tracking do not determine ([`OperatorPrior`]).
//! 3. Forms are weighed by Akaike's criterion ([`FormFigures`]), and estimates averaged over those that the data
//!    leave ([`WeighedForm`]).
//! 4. Errors by the scatter of runs or blocks; intervals in coordinates that are nearly normal, by
//!    profile likelihood where they are not ([`Parameter`]).
//! 5. The operator by refined instrumental variables, where an excitation was recorded ([`InstrumentalFit`]); all
//!    methods next to each other ([`Agreement`]), a free model of the same orders ([`FreeModel`]), and the
//!    [`Verdict`](hoid_model::Verdict) on all of it.
//!
//! | file | contents |
//! |---|---|
//! | `options` | [`FamilyEstimator`]: what may be chosen, by fields and by names |
//! | `estimator` | the searches of all forms |
//! | `channel` | a further input: as requested, in a form, its results |
//! | `channels` | what a person sees besides the error |
//! | `channel_lines` | the responses to all of it at the lines |
//! | `comparison` | what each form is worth next to the others |
//! | `assembly` | from the searches of the forms that count to the result |
//! | `estimated` | the operator of a record with its errors |
//! | `result` | [`FamilyFit`] |
//! | `parameter` | a parameter with its interval, its prior share, and whether it is determined |
//! | `prior` | what is known before the data |
//! | `coordinates` | bounds and starting values of the coordinates |
//! | `lines`, `line_fit` | the lines with their variances; the operator through them |
//! | `response_fit` | least squares on a frequency response |
//! | `instrumental` | the operator by refined instrumental variables |
//! | `arx_response` | a response without a form |
//! | `layout` | places of coordinates and noise coefficients |
//! | `noise` | autoregressions: starts and orders of the noise model |
//! | `prediction` | the prediction error fit of one form |
//! | `prediction_fit` | what its search found |
//! | `joint` | the prediction error fit with the lines next to it |
//! | `clusters`, `covariances` | runs or blocks; the covariance by them |
//! | `jackknife` | covariances from estimates without each part, and from a prior |
//! | `sensitivity` | what the estimate owes to the choice of a noise model |
//! | `profile` | intervals by profile likelihood |
//! | `choice` | the weights of the forms, and which of them is in front |
//! | `mixture` | an estimate over several forms |
//! | `agreement` | do methods agree |
//! | `intersample` | what the error does between its samples |
//! | `low_noise` | starts by output error, where there is little noise or none |
//! | `open_loop` | crossover and phase margin |
//! | `loop_shape` | every crossing, and whether the closed loop is stable |
//! | `of_polynomials`, `pole_reading` | polynomials back to an operator; interpretation of poles |
//! | `diagnostics` | what makes a result doubtful |

mod agreement;
mod arx_response;
mod assembly;
mod channel;
mod channel_lines;
mod channels;
mod choice;
mod clusters;
mod comparison;
pub(crate) mod coordinates;
mod covariances;
mod diagnostics;
mod estimated;
mod estimator;
mod instrumental;
mod intersample;
mod jackknife;
mod joint;
mod layout;
mod line_fit;
mod lines;
mod loop_shape;
mod low_noise;
mod mixture;
pub(crate) mod noise;
mod of_polynomials;
mod open_loop;
mod options;
mod parameter;
mod pole_reading;
mod prediction;
mod prediction_fit;
mod prior;
mod profile;
mod response_fit;
mod result;
mod sensitivity;

pub use agreement::{Agreement, AgreementMethod, AgreementPair, AgreementRow};
pub use channel::{ChannelFit, ChannelForm, ChannelResponse, ChannelRole, SeenChannel};
pub use choice::FormFigures;
pub use clusters::ClusterKind;
pub use instrumental::InstrumentalFit;
pub use intersample::Intersample;
pub use line_fit::LineFit;
pub use loop_shape::{KnownResponse, LoopShape};
pub use of_polynomials::{FamilyConversion, family_of_polynomials};
pub use open_loop::{Crossover, LoopMeasures, loop_measures};
pub use options::{FamilyEstimator, HIGHEST_NOISE_ORDER};
pub use parameter::Parameter;
pub use pole_reading::{PoleRole, RealPole};
pub use prior::{OperatorPrior, ParameterPrior};
pub use result::{FamilyFit, FreeModel, OperatorInForm, OperatorOfRecord, WeighedForm};
