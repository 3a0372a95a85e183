//! Problems in a plan, with their position.

/// A problem in a plan, and the line where it occurs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PlanProblem {
    pub line: Option<usize>,
    pub reason: String,
}
