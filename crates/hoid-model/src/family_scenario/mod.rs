//! Tasks of people: any operator of the family in a loop with any proper controlled element, with a remnant of several
//! parts and a drifting stick.
//!
//! `e = f - y`, `u = Y e + F f + M y + n`, `y = P (u + d)`, where f is a target that the person may see (F,
//! [`Feedforward`]), y is the output of the controlled element, a motion that the person may feel (M), and d is a
//! disturbance at the input of the controlled element P. Changes follow the sigmoid of eq. 5, as in
//! [`Scenario`](crate::scenario::Scenario). `Scenario` is the task of the thesis and remains a separate type: its
//! operator is a gain with a lead, and its controlled element is `K_c/(s(s + omega_b))`.
//!
//! | file | contents |
//! |---|---|
//! | `state` | [`FamilyState`]: operator and controlled element at one instant |
//! | `display` | [`Display`]: the signals that the person sees |
//! | `multi_sine` | [`MultiSine`], [`Excitation`]: targets and disturbances as used in experiments with people |
//! | `remnant` | [`RemnantPart`], [`Stick`]: components of u other than the responses to e, f and y |
//! | `typical_feedforward` | [`typical_feedforward`](typical_feedforward()): response to a target, based on the inverse of the machine |
//! | `scenario` | [`FamilyScenario`] and the quantities that a simulation derives from it |

mod display;
mod multi_sine;
mod remnant;
mod scenario;
mod state;
mod typical_feedforward;

pub use crate::feedforward::Feedforward;
pub use display::Display;
pub use multi_sine::{Excitation, Interleaved, MultiSine};
pub use remnant::{
    DependenceSignal, Intermittence, PartStrength, Pulses, RemnantPart, RemnantShape, SignalDependence, Stick,
};
pub use scenario::{FamilyScenario, ResolvedFamilyScenario};
pub use state::FamilyState;
pub use typical_feedforward::{
    FOLLOWED_FRACTION, LONGEST_LEAD_S, PREVIEW_S, SLOPE_FREQUENCY_RAD_S, slope, time_constant, typical_feedforward,
};
