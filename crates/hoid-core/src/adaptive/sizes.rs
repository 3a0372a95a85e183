//! Array sizes: gains, states, signals, hypotheses, and lags of the noise model.

/// Number of gains of the numerator.
pub const GAINS: usize = 3;
/// Number of parameters that change only by small corrections: natural frequency, damping, delay.
pub const DYNAMICS: usize = 3;
/// Number of gains plus the level.
pub const LINEAR: usize = GAINS + 1;
/// Number of states: gains, level and corrections.
pub const STATES: usize = LINEAR + DYNAMICS;
/// Number of parameters of the reported operator: K_e, K_e_dot and the dynamics.
pub const PARAMETERS: usize = 2 + DYNAMICS;
/// Number of signals of the basis: the states of its filter and the derivative of the last state.
pub const SIGNALS: usize = 6;
/// Number of signals plus the level.
pub const INPUTS: usize = SIGNALS + 1;
/// Maximum number of hypotheses in the mixture.
pub const HYPOTHESES: usize = 28;
/// Number of classes of hypotheses: two forms of the numerator, each with two rates of drift of the gains.
pub const CLASSES: usize = 4;
/// Maximum number of past changes that a hypothesis stores.
pub const SEGMENTS: usize = 6;
/// Largest order of the noise model.
pub const LARGEST_ORDER: usize = 24;
/// Number of starting points of the first estimate.
pub const STARTS: usize = 8;
