//! Building blocks for methods in other crates: `hoid-survey` contains the methods with which the default method is
//! compared. A method is a struct of options (`hoid_ident::settings!`) with [`RecursiveMethod`], which builds a
//! [`Recursion`]; `Method::from(options)` is then used like any other method.

pub use crate::{
    gain::{Gain, ROOM_WITHOUT_FIT, Scaled, error_bars},
    history::{History, bounded, weighted},
    kernel::{Kernel, Plan, scaled, too_many},
    method::{About, Boxed, RecursiveMethod, bad, check_delay, check_operator_orders},
    methods::{DEFAULT_LIMIT, short_for_b},
    predictor::Predictor,
    recursion::{Delay, Recursion, StepOutcome},
    reported::{OPERATOR, Reported},
    setup::Setup,
    start::{StartState, physical_bounds},
    two_sided::{Causal, TwoSided},
};
