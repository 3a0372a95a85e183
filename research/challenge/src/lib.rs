//! The challenge: cases that can refute a tracker, and how its estimates fare in them.
//!
//! A tracker that is judged on loops like those it was made on is judged by its maker. Here the loop is another one
//! ([`simulate()`] shares nothing with the simulators of the methods), every run has a person of its own, the remnant
//! need not be steady, normal or small, the operator need not have the form that is supposed, and the numbers of merit
//! are those of the response that a person has, next to what could be known: the likelihood ratio of the true models,
//! and a batch fit that knows the change. There are two sets of seeds, one for making a method and one for its
//! judgement, run once.
//!
//! | file | contents |
//! |---|---|
//! | `case`, `cases` | [`Case`]: what a case is; [`cases()`]: all of them |
//! | `operator` | [`Operator`], [`Plant`]: who acts on what, in continuous time |
//! | `draw` | [`Seeds`]: open and sealed; the person of a run; [`Portion`] |
//! | `noise` | remnants, and the filters that whiten them |
//! | `driving`, `world` | excitation and strength of the remnant; operator and plant between two samples |
//! | `simulate` | [`simulate()`]: the loop of a case |
//! | `entrant`, `entrants` | [`Entrant`]: one who takes part; the methods, and plain ones |
//! | `oracle` | what could be known |
//! | `measure` | [`Line`]: what an entrant was worth in a run |
//! | `run` | [`challenge()`]: all of it, kept on disk |
//! | `people` | [`challenge_people`]: the same on recorded people |
//! | `tables`, `page` | [`tables()`], [`page()`] |
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

pub use case::{Blemish, Case, Course, DelayKnown, Forcing, Form, Shift, Sight, Spectrum, Theme};
pub use cases::cases;
pub use draw::{Portion, RunOf, Seeds};
pub use entrant::{Alarm, Entrant, EntrantResult, ReportedResponse, Seam, Task};
pub use entrants::entrants;
pub use error::ChallengeError;
pub use measure::{ChangeOutcome, Line, Moment, Posed};
pub use operator::{Operator, Parameter, Plant, hold};
pub use page::page;
pub use people::{PeopleOptions, challenge_people};
pub use run::{ChallengeOptions, challenge, chosen_cases};
pub use simulate::{Hidden, Run, Truth, simulate};
pub use tables::tables;
