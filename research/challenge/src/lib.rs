//! The challenge: cases that can reveal the weaknesses of a tracker, and the performance of its estimates in these
//! cases.
//!
//! A tracker that is evaluated only on loops like those for which it was developed is not tested independently. Here
//! the loop is different ([`simulate()`] shares only the random streams with the simulators of the methods), every run
//! has a different person, the remnant need not be of constant strength, normally distributed or small, and the
//! operator need not have the assumed form. The figures of merit concern the response of a person and are compared with
//! two bounds: the likelihood ratio of the true models, and a batch fit with known changes. There are two sets of
//! seeds, one for the development of a method and one for its evaluation, which is used only once.
//!
//! | file | contents |
//! |---|---|
//! | `case`, `cases` | [`Case`]: definition of a case; [`cases()`]: all cases |
//! | `operator` | [`Operator`], [`Plant`]: operators and controlled elements in continuous time |
//! | `draw` | [`Seeds`]: open and sealed seeds; the person of a run; [`Portion`] |
//! | `noise` | remnants, and the filters that whiten them |
//! | `driving`, `world` | excitation and strength of the remnant; operator and plant between samples |
//! | `simulate` | [`simulate()`]: simulation of the loop of a case |
//! | `entrant`, `entrants` | [`Entrant`]: interface of a participant; the methods and some simple participants |
//! | `oracle` | bounds from the available information |
//! | `measure` | [`Line`]: results of an entrant in a run |
//! | `run` | [`challenge()`]: all runs, with results stored on disk |
//! | `people` | [`challenge_people`]: the same evaluation with recorded people |
//! | `tables`, `page` | [`tables()`], [`page()`]: tables of the results, and the page that contains them |
//! | `error` | [`ChallengeError`] |

mod case;
mod cases;
mod draw;
mod driving;
mod entrant;
mod entrants;
mod error;
mod measure;
mod noise;
mod operator;
mod oracle;
mod page;
mod people;
mod run;
mod simulate;
mod tables;
mod world;

pub use case::{Case, Course, DelayKnown, Forcing, Form, Imperfection, OperatorChange, Sampling, Spectrum, Theme};
pub use cases::cases;
pub use draw::{CaseRun, Portion, Seeds};
pub use entrant::{Alarm, Entrant, EntrantResult, ReportedResponse, Seam, Task};
pub use entrants::entrants;
pub use error::ChallengeError;
pub use measure::{ChangeOutcome, EvaluationRun, Line, Moment};
pub use operator::{Operator, Parameter, Plant, hold};
pub use page::page;
pub use people::{PeopleOptions, challenge_people};
pub use run::{ChallengeOptions, challenge, chosen_cases};
pub use simulate::{OracleData, Run, Truth, simulate};
pub use tables::tables;
