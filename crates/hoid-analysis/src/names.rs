//! Names of the batch estimators in the [registry](crate::registry); methods of instrumental variables have their own
//! names.

/// The operator of a person.
pub const OPERATOR: &str = "operator";
/// The operator with its remnant of order m as noise: a gain with a lead.
pub const REMNANT: &str = "operator noise=remnant";
/// The operator with gains that change once.
pub const CHANGE: &str = "operator change=sigmoid";
/// Polynomials by the prediction error method.
pub const PEM: &str = "pem";
