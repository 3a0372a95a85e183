//! Tasks of people: any operator of the family around any proper controlled element, with a remnant
//! of several parts and a stick that drifts.
//!
//! `e = f - y`, `u = Y e + F f + n`, `y = P (u + d)`: a target f, which the person may see (F, [`Feedforward`]), and a
//! disturbance d at the input of the controlled element P. Changes follow the sigmoid of eq. 5 as in
//! [`Scenario`](crate::scenario::Scenario), which is the task of the thesis and remains separate: its operator has the
//! form of the lead, and its element is `K_c/(s(s + omega_b))`.
//!
//! | file | contents |
//! |---|---|
//! | `state` | [`FamilyState`]: operator and controlled element at one instant |
//! | `display` | [`Display`]: what the person sees |
//! | `multi_sine` | [`MultiSine`], [`Excitation`]: targets and disturbances as in recorded tasks |
//! | `remnant` | [`RemnantPart`], [`Stick`]: components of u other than the response |
//! | `scenario` | [`FamilyScenario`] and its quantities for a simulation |

mod display;
mod multi_sine;
mod remnant;
mod scenario;
mod state;

pub use display::Display;
pub use multi_sine::{Excitation, Interleaved, MultiSine};
pub use remnant::{Followed, Intermittence, PartStrength, Pulses, RemnantPart, RemnantShape, SignalDependence, Stick};
pub use scenario::{FamilyScenario, Feedforward, ResolvedFamilyScenario};
pub use state::FamilyState;
