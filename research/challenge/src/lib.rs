//! The challenge: cases that can refute a tracker, and the performance of its estimates in them.
//!
//! A tracker that is only evaluated on loops like those it was developed on is not tested independently. Here the loop
//! is different ([`simulate()`] shares nothing with the simulators of the methods), every run has a different person,
//! the remnant need not be steady, normal or small, the operator need not have the assumed form, and the figures of
//! merit are those of the response of a person, compared with bounds: the likelihood ratio of the true models, and a
//! batch fit with known changes. There are two sets of seeds, one for the development of a method and one for its
//! evaluation, used once.
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
