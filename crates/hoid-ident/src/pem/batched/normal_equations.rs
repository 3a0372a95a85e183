//! Result of a pass: normal equations for the record in each lane.

/// Sums over one record in each lane.
#[derive(Debug, Default)]
pub(super) struct NormalEquations {
    /// Products of eps and the columns of psi without their signs, `[eps, x_b.., v.., x_f..]` by rows, with the initial
    /// states projected out.
    pub products: Vec<f64>,
    /// True for a lane in which the responses to the initial states are linearly dependent, so its products are not
    /// valid.
    pub dependent: Vec<bool>,
}
