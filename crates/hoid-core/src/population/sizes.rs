//! How many there are: of gains, points, drifts, and lags of the noise model.

/// Gains of a point of the basis.
pub const GAINS: usize = 3;
/// Gains and level.
pub const STATES: usize = GAINS + 1;
/// Points of the basis.
pub const POINTS: usize = 7;
/// Filters with different drifts at each point.
pub const DRIFTS: usize = 3;
/// Largest order of the noise model.
pub const LARGEST_ORDER: usize = 24;
