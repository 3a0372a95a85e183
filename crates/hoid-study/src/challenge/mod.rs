//! The challenge: cases that can refute a tracker.
//!
//! | file | what it holds |
//! |---|---|
//! | `case`, `cases` | [`Case`]: what a case is; [`cases()`]: all of them |
//! | `operator` | [`Operator`], [`Plant`]: who acts on what, in continuous time |
//! | `draw` | [`Seeds`]: open and sealed; the person of a run |
//! | `noise` | remnants, and the filters that whiten them |
//! | `simulate` | [`simulate()`]: the loop of a case |

mod case;
mod cases;
mod draw;
mod noise;
mod operator;
mod simulate;

pub use case::{Blemish, Case, Course, DelayKnown, Forcing, Form, Shift, Sight, Spectrum, Theme};
pub use cases::cases;
pub use draw::{Portion, RunOf, Seeds};
pub use operator::{Operator, Parameter, Plant, hold};
pub use simulate::{Hidden, Run, Truth, simulate};
