//! Expected results of an experiment, computed before it is carried out.
//!
//! | module | contents |
//! |---|---|
//! | [`DesignRequest`] | a question about an experiment, and its answer, an [`ExperimentDesign`] with its JSON and its files (`files`) |
//! | [`People`] | people for whom the experiment is designed: the population (`typical_operator`), one person, or a group (`group_people`) |
//! | [`Task`], [`Forcing`] | person, controlled element and remnant; lines with their points of entry |
//! | [`expected`](fn@expected) | standard errors from the information of the lines (`information`) and the variation from run to run, for the responses to the error and the target (`joint_coordinates`, `feedforward`) |
//! | [`DesignOptions`] | most informative amplitudes and frequencies of the lines within limits (`search`) |
//! | [`crest_factor`] | lines without common harmonics, and their phases (`lines`) |
//! | [`OtherForcing`] | another forcing function for comparison |
//! | [`DifferenceRequest`] | number of people and runs needed to find a difference between conditions, from the [`power`](fn@power) of the test and the spread between people |
//! | [`SpreadSource`] | source of the spread between people and of the variation from run to run |
//! | [`RequestedQuantity`] | requested quantities, and the number of runs needed for their accepted errors |

mod answer;
mod design_people;
mod difference;
mod error;
mod expected_errors;
mod feedforward;
mod files;
mod forcing_design;
mod group_people;
mod information;
mod joint_coordinates;
mod lines;
mod other_forcing;
mod people;
mod power;
mod request;
mod requested_quantities;
mod response;
mod search;
mod spread;
mod task;
mod typical_operator;

pub use answer::{ExperimentDesign, NamedExpected};
pub use difference::{
    DEFAULT_ALPHA, DEFAULT_BETWEEN_PEOPLE, DEFAULT_POWER, DifferencePlan, DifferenceRequest, RunsAndPeople,
    TargetDifference,
};
pub use error::DesignError;
pub use expected_errors::{Expected, ExpectedQuantity, has_absolute_error};
pub use forcing_design::{DesignOptions, DesignedForcing};
pub use hoid_ident::diagnostics::RUN_TO_RUN_DEVIATION;
pub use information::expected;
pub use lines::crest_factor;
pub use other_forcing::OtherForcing;
pub use people::People;
pub use power::{noncentral_t_cdf, people_needed, power};
pub use request::DesignRequest;
pub use requested_quantities::{RequestedQuantity, period_count};
pub use response::{DesignedLine, ExpectedResponse};
pub use spread::SpreadSource;
pub use task::{EntryPoint, Forcing, Remnant, Task};
