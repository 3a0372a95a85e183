//! Array sizes: gains, states, signals, hypotheses, and lags of the noise model.

/// Gains of the numerator.
pub const GAINS: usize = 3;
/// Dynamics that change only by small corrections: natural frequency, damping, delay.
pub const DYNAMICS: usize = 3;
/// Gains and level.
pub const LINEAR: usize = GAINS + 1;
/// Gains, level and corrections.
pub const STATES: usize = LINEAR + DYNAMICS;
/// Parameters of the reported operator: K_e, K_e_dot and the dynamics.
pub const PARAMETERS: usize = 2 + DYNAMICS;
/// Signals of the basis: the states of its filter and their derivative.
pub const SIGNALS: usize = 6;
/// Signals and level.
pub const INPUTS: usize = SIGNALS + 1;
/// Hypotheses of the mixture.
pub const HYPOTHESES: usize = 28;
/// Classes of hypotheses: two forms of the numerator, each with two drifts of the gains.
pub const CLASSES: usize = 4;
/// Changes that a hypothesis stores.
pub const SEGMENTS: usize = 6;
/// Largest order of the noise model.
pub const LARGEST_ORDER: usize = 24;
/// Starting points of the first estimate.
pub const STARTS: usize = 8;
