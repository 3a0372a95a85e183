//! Components of a method, for those in other crates: `hoid-survey` holds the methods that the default is compared
//! with. A method is a struct of options (`hoid_ident::settings!`) with [`RecursiveMethod`], which builds a
//! [`Recursion`]; then `Method::from(options)` is used as any other.

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
