//! Report of a tracker on its samples.

/// Samples that were not as they should be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Samples given.
    pub samples: u64,
    /// Samples with a fault in e or u, at which the estimate stayed.
    pub skipped: u64,
    /// Samples that the guard held back, or during which it let the estimate stay constant; those
    /// with a fault in e or u are not among them.
    pub held: u64,
    /// How often the guard started the estimate again.
    pub restarts: u64,
    /// Steps that stability or a bound made shorter.
    pub shortened: u64,
}

/// Report of a tracker on a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// A-priori innovation; `None` at a sample that was skipped or held back.
    pub innovation: Option<f64>,
    /// True when e or u was a fault.
    pub skipped: bool,
    /// True when the guard held it back, or let the estimate stay constant.
    pub held: bool,
    /// True when stability or a bound made the step shorter.
    pub shortened: bool,
}
