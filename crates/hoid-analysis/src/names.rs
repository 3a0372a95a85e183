//! Names of the batch estimators in the [registry](crate::registry); the instrumental-variable methods define their own
//! names.

/// Operator of a person.
pub const OPERATOR: &str = "operator";
/// Operator with a gain and a lead, whose noise model is a remnant of order m.
pub const REMNANT: &str = "operator noise=remnant";
/// Operator whose gains change once.
pub const CHANGE: &str = "operator change=sigmoid";
/// Polynomials fitted by the prediction-error method.
pub const PEM: &str = "pem";
