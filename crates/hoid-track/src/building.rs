//! Building blocks for methods in other crates: `hoid-survey` contains the methods with which the default method is
//! compared. A method is a struct of options (`hoid_ident::settings!`) with [`RecursiveMethod`], which builds a
//! [`Recursion`]; `Method::from(options)` is then used like any other method.

pub use crate::{
    gain::{Gain, ScaleCovariance, VARIANCE_GROWTH_WITHOUT_FIT, error_bars},
    history::{History, limit_magnitude, weighted_sum},
    kernel::{Kernel, Plan, too_many_parameters, write_scaled},
    method::{MethodDescription, MethodObject, RecursiveMethod, check_delay, check_operator_orders, invalid_option},
    methods::{DEFAULT_LIMIT, short_memory_for_b},
    predictor::Predictor,
    recursion::{Delay, Recursion, StepOutcome},
    reported::{OPERATOR_PARAMETER_COUNT, ReportedModel},
    setup::Setup,
    start::{StartState, physical_bounds},
    two_sided::{CausalRun, TwoSidedEstimate},
};
