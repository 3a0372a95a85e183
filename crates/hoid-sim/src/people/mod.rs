//! Virtual people: operators drawn from the family, and their runs.
//!
//! A person is an operator of the family with parameters from published ranges, a realistic remnant, and a stick that
//! drifts. The task is the same as in recorded experiments: to keep the output at zero against a multi-sine disturbance
//! at the input of `1/s`, `1/(s(s+1))` or `1/s^2`, with 5 s of run-in and 40 s of measurement at 60 Hz. All true values
//! are known. With [`Task::display`], people also respond to a displayed target.
//!
//! ```
//! use hoid_sim::people::{Person, Plant, Population, RemnantKind, Task};
//!
//! let task = Task::default();
//! let person = Person::draw(&Population::default(), &task, Plant::Integrator, None, RemnantKind::BroadBand, 7, 0)?;
//! let run = person.run(1)?;
//! assert_eq!(run.record.len(), 2400);
//! assert_eq!(run.record, person.run(1)?.record);
//! assert!((20.0..=65.0).contains(&person.phase_margin_deg));
//! # Ok::<(), hoid_sim::SimError>(())
//! ```
//!
//! | file | contents |
//! |---|---|
//! | `population` | [`Population`]: ranges of the parameters, with their sources; [`Plant`] |
//! | `remnants` | [`RemnantKind`]: realistic remnants |
//! | `person` | [`Person`], [`Task`], [`PersonRun`] |

mod person;
mod population;
mod remnants;

pub use person::{Person, PersonRun, Task};
pub use population::{Plant, Population, Range};
pub use remnants::RemnantKind;
