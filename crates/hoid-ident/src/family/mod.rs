//! Operators of recorded people: the family of operators with reliable errors.
//!
//! `u = Y e + (C/D) eps` with Y an operator of the family ([`hoid_model::operator_family`]). People differ from a
//! simulation in three ways that are decisive for their parameters: they integrate slow errors (the operator needs a
//! lag), their remnant is not a filter of first order (the noise model must be rich), and they vary (error bars must be
//! based on the scatter between runs). Parameters that the data do not determine are reported as such.
//!
//! 1. The describing function at the lines of a periodic excitation, if one was recorded ([`crate::frequency`]); each
//!    form is fitted to it ([`LineFit`]). Without one, the response of an ARX model of high order gives the starts.
//! 2. Each form by prediction error, with an autoregressive (or ARMA) noise model whose order Akaike's criterion
//!    chooses, and a weak prior on parameters that seconds of tracking do not determine ([`OperatorPrior`]).
//! 3. Forms have weights by Akaike's criterion ([`FormFigures`]), and estimates are averaged over those that the data
//!    do not reject ([`WeighedForm`]).
//! 4. Errors from the scatter of runs or blocks; intervals in coordinates that are nearly normal, and by profile
//!    likelihood if they are not ([`Parameter`]).
//! 5. The operator by refined instrumental variables, if an excitation was recorded ([`InstrumentalFit`]); the
//!    comparison of all methods ([`Agreement`]), a free model of the same orders ([`FreeModel`]), and the
//!    [`Verdict`](hoid_model::Verdict) on all of it.
//!
//! | file | contents |
//! |---|---|
//! | `options` | [`FamilyEstimator`]: the options, by fields and by names |
//! | `estimator` | the searches of all forms |
//! | `channel` | a further input: the request, its form, the results |
//! | `channels` | further inputs of a person in addition to the error; `choice`: their forms |
//! | `channel_lines` | the responses to all inputs at the lines |
//! | `comparison` | comparison of the forms |
//! | `assembly` | from the searches of the forms that count to the result |
//! | `estimated` | the operator of a record with its errors |
//! | `result` | [`FamilyFit`] |
//! | `parameter` | a parameter with its interval, its prior share, and whether it is determined |
//! | `prior` | prior knowledge |
//! | `coordinates` | bounds and starting values of the coordinates |
//! | `lines`, `line_fit` | the lines with their variances; the operator through them |
//! | `response_fit` | least squares on a frequency response |
//! | `instrumental` | the operator by refined instrumental variables |
//! | `arx_response` | a response without a form |
//! | `layout` | places of coordinates and noise coefficients |
//! | `noise` | autoregressions: starts and orders of the noise model |
//! | `prediction` | the prediction error fit of one form |
//! | `prediction_fit` | the result of its search |
//! | `joint` | the prediction error fit that includes the lines |
//! | `clusters`, `covariances` | runs or blocks; the covariance from them |
//! | `jackknife` | covariances from estimates without each part, and from a prior |
//! | `sensitivity` | effect of the noise model on the estimate |
//! | `profile` | intervals by profile likelihood |
//! | `choice` | the weights of the forms, and the best form |
//! | `mixture` | an estimate over several forms |
//! | `agreement` | agreement of the methods |
//! | `intersample` | intersample behaviour of the error |
//! | `low_noise` | starts by output error, for little or no noise |
//! | `open_loop` | crossover and phase margin |
//! | `loop_shape` | every crossing, and the stability of the closed loop |
//! | `of_polynomials`, `pole_reading` | conversion of polynomials to an operator; interpretation of poles |
//! | `diagnostics` | reasons to doubt a result |

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
pub use choice::{FormFigures, LEAST_WEIGHT, NO_EVIDENCE};
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
