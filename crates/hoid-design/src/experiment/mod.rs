//! Expected results of an experiment before it is carried out.
//!
//! | module | contents |
//! |---|---|
//! | [`DesignRequest`] | from the question to the answer, an [`ExperimentDesign`] with its JSON and its files (`files`) |
//! | [`People`] | for whom: the population (`adapted`), a person, a group (`group_people`) |
//! | [`Task`], [`Forcing`] | person, element and remnant; the lines, and where they enter |
//! | [`expected`](fn@expected) | standard errors of a person from the information of the lines (`information`), of both responses to error and target (`joint`, `seen`) |
//! | [`Designing`] | most informative amplitudes and frequencies of the lines (`search`), under limits |
//! | [`crest_factor`] | lines without common harmonics (`lines`), and their phases |
//! | [`Against`] | another forcing function for comparison |
//! | [`DifferenceRequest`] | people and runs to find a difference between conditions, by the [`power`](fn@power) of the test and the spread [`Between`] people |
//! | [`Wanted`] | requested quantities, and the number of runs that they need |

mod adapted;
mod against;
mod answer;
mod between;
mod chosen;
mod designing;
mod difference;
mod error;
mod expected;
mod files;
mod group_people;
mod information;
mod joint;
mod lines;
mod people;
mod power;
mod request;
mod response;
mod search;
mod seen;
mod task;
mod wanted;

pub use against::Against;
pub use answer::{ExperimentDesign, NamedExpected};
pub use between::Between;
pub use designing::{Designed, Designing};
pub use difference::{
    ALPHA, BETWEEN_PEOPLE, DifferencePlan, DifferenceRequest, POWER, RUN_TO_RUN, RunsAndPeople, Sought,
};
pub use error::DesignError;
pub use expected::{Expected, ExpectedParameter};
pub use information::expected;
pub use lines::crest_factor;
pub use people::People;
pub use power::{noncentral_t_cdf, people_needed, power};
pub use request::DesignRequest;
pub use response::{DesignedLine, ExpectedResponse};
pub use task::{Enters, Forcing, Remnant, Task};
pub use wanted::{Wanted, periods};
