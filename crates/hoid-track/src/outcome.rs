//! Outcome of a sample, and counts of faulty samples.

/// Counts of faulty samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Number of samples.
    pub samples: u64,
    /// Number of samples with a fault in e or u, at which the estimate stayed constant.
    pub skipped: u64,
    /// Number of samples that the guard held back, or during which it kept the estimate constant; samples with a fault
    /// in e or u are not included.
    pub held: u64,
    /// Number of restarts by the guard.
    pub restarts: u64,
    /// Number of steps of the estimate that stability or a bound shortened.
    pub shortened: u64,
}

/// Outcome of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// A-priori innovation; `None` for a sample that was skipped or held back.
    pub innovation: Option<f64>,
    /// True if e or u was faulty.
    pub skipped: bool,
    /// True if the guard held the sample back, or kept the estimate constant at it.
    pub held: bool,
    /// True if stability or a bound shortened the step of the estimate.
    pub shortened: bool,
}
