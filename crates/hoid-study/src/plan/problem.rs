//! Problems in a plan, and their positions.

/// Problems in a plan, and their positions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PlanProblem {
    pub line: Option<usize>,
    pub reason: String,
}
