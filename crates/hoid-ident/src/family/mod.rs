//! Operators of recorded people: the family of operators, with robust errors.
//!
//! `u = Y e + (C/D) eps`, where Y is an operator of the family ([`hoid_model::operator_family`]). Three differences
//! between people and a simulation affect the parameters. People integrate slow errors, so the operator needs a lag.
//! Their remnant does not have the spectrum of a first-order filter, so the noise model must be flexible. They also
//! vary, so error bars must be based on the scatter between runs. Parameters that the data do not determine are
//! reported as undetermined.
//!
//! 1. If a periodic excitation was recorded, the describing function is computed at its lines ([`crate::frequency`]),
//!    and each form is fitted to it ([`LineFit`]). Together with the response of a high-order ARX model this supplies
//!    the starts.
//! 2. Each form is fitted by prediction error, with an autoregressive (or ARMA) noise model whose order is selected by
//!    Akaike's criterion, and with a weak prior on parameters that a short tracking record does not determine
//!    ([`OperatorPrior`]).
//! 3. The forms are weighted by Akaike's criterion ([`FormFigures`]), and estimates are averaged over the forms that
//!    the data do not reject ([`WeighedForm`]).
//! 4. Errors are computed from the scatter of runs or blocks. Intervals are computed in coordinates that are nearly
//!    normally distributed, or by profile likelihood otherwise ([`Parameter`]).
//! 5. The operator is also estimated by refined instrumental variables if an excitation was recorded
//!    ([`InstrumentalFit`]). All methods are compared ([`Agreement`]), the form is tested against a free model of the
//!    same orders ([`FreeModel`]), and the [`Verdict`](hoid_model::Verdict) summarises the findings.
//!
//! | file | contents |
//! |---|---|
//! | `options` | [`FamilyEstimator`]: options as fields and by name |
//! | `estimator` | the fits of all forms |
//! | `starts` | the starts of the searches, and the orders of the noise model |
//! | `channel` | a further input: request, form, results |
//! | `channels` | inputs of a person in addition to the error; `choice`: selection of their forms |
//! | `channel_lines`, `channel_criterion` | means and variances of several inputs at the lines; the fit to them |
//! | `comparison` | comparison of the forms |
//! | `assembly` | assembly of the result from the fits of the forms |
//! | `estimated` | the operator of a record with its errors |
//! | `result` | [`FamilyFit`] |
//! | `parameter` | a parameter with its interval, its prior share, and whether the data determine it |
//! | `prior` | prior knowledge of people |
//! | `coordinates` | bounds and starting values of coordinates |
//! | `lines`, `line_fit` | the lines with their variances; the operator fitted to the lines |
//! | `response_fit` | least squares on a frequency response |
//! | `instrumental` | the operator by refined instrumental variables |
//! | `arx_response` | a frequency response without a form |
//! | `layout` | indices of coordinates and noise coefficients in eta |
//! | `noise` | autoregressions for starts and orders of the noise model |
//! | `prediction` | the prediction error fit of one form |
//! | `prediction_fit` | result of the prediction error search |
//! | `joint` | the prediction error fit that includes the lines |
//! | `clusters`, `covariances` | runs or blocks of runs; covariances from their scatter |
//! | `deviation` | smooth deviation of the response from the form |
//! | `jackknife` | covariances from estimates that omit one part of the data, and from a prior |
//! | `sensitivity` | effect of the noise model on the estimate |
//! | `profile` | intervals by profile likelihood |
//! | `choice` | weights of the forms, and the best form |
//! | `mixture` | estimates averaged over several forms |
//! | `agreement` | agreement of the estimation methods |
//! | `intersample` | intersample behaviour of the error |
//! | `low_noise` | starts by output error, for little or no noise |
//! | `open_loop` | crossover and phase margin |
//! | `known_response` | an operator at one frequency with the error of its response |
//! | `loop_shape` | all crossings of the open loop, and the stability of the closed loop |
//! | `of_polynomials`, `pole_reading` | conversion of polynomials to an operator; assignment of the poles |
//! | `diagnostics` | findings for and against a result |

mod agreement;
mod arx_response;
mod assembly;
mod channel;
mod channel_criterion;
mod channel_lines;
mod channels;
mod choice;
mod clusters;
mod comparison;
pub(crate) mod coordinates;
mod covariances;
mod deviation;
mod diagnostics;
mod estimated;
mod estimator;
mod instrumental;
mod intersample;
mod jackknife;
mod joint;
mod known_response;
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
#[cfg(test)]
#[allow(dead_code)]
#[path = "../../tests/common/simulated_operator.rs"]
mod simulated_operator;
mod starts;

pub use agreement::{Agreement, AgreementMethod, AgreementPair, AgreementRow};
pub use channel::{ChannelFit, ChannelForm, ChannelResponse, ChannelRole, SeenChannel};
pub use choice::{FormFigures, MIN_WEIGHT, NEGLIGIBLE_AIC_DIFFERENCE};
pub use clusters::ClusterKind;
pub use deviation::{Misfit, ResponseDeviation};
pub use instrumental::InstrumentalFit;
pub use intersample::Intersample;
pub use known_response::KnownResponse;
pub use line_fit::LineFit;
pub use loop_shape::LoopShape;
pub use of_polynomials::{FamilyConversion, family_from_polynomials};
pub use open_loop::{Crossover, LoopMeasures, loop_measures};
pub use options::{FamilyEstimator, HIGHEST_NOISE_ORDER};
pub use parameter::Parameter;
pub use pole_reading::{PoleRole, RealPole};
pub use prior::{OperatorPrior, ParameterPrior};
pub use result::{FamilyFit, FreeModel, OperatorInForm, OperatorOfRecord, WeighedForm};
