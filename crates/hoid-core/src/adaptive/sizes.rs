//! How many there are: of gains, states, signals, hypotheses, and lags of the noise model.

/// Gains of the numerator.
pub const GAINS: usize = 3;
/// What is held except for small corrections: natural frequency, damping, delay.
pub const DYNAMICS: usize = 3;
/// Gains and level.
pub const LINEAR: usize = GAINS + 1;
/// Gains, level and corrections.
pub const STATES: usize = LINEAR + DYNAMICS;
/// Parameters of the operator that is reported: K_e, K_e_dot and what is held.
pub const PARAMETERS: usize = 2 + DYNAMICS;
/// Signals of the basis: the states of its filter and their derivative.
pub const SIGNALS: usize = 6;
/// Signals and level.
pub const INPUTS: usize = SIGNALS + 1;
/// Hypotheses of the mixture.
pub const HYPOTHESES: usize = 28;
/// Classes of hypotheses: two forms of the numerator, each with two drifts of the gains.
pub const CLASSES: usize = 4;
/// Changes that a hypothesis remembers.
pub const SEGMENTS: usize = 6;
/// Largest order of the noise model.
pub const LARGEST_ORDER: usize = 24;
/// Points at which a first estimate starts.
pub const STARTS: usize = 8;
