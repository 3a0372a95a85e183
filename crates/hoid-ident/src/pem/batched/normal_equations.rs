//! Result of a pass: the normal equations of the record in each lane.

/// Sums over one record in each lane.
#[derive(Debug, Default)]
pub(super) struct NormalEquations {
    /// Products of eps and the columns of psi without their signs, `[eps, x_b.., v.., x_f..]` by
    /// rows, the initial states projected out.
    pub products: Vec<f64>,
    /// Lanes whose responses to the initial states are linearly dependent: their products are not valid.
    pub dependent: Vec<bool>,
}
