//! Problems in a plan, and where.

/// Problems in a plan, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PlanProblem {
    pub line: Option<usize>,
    pub reason: String,
}
