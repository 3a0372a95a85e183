//! Array sizes: gains, states, signals, hypotheses, and lags of the noise model.

/// Number of gains of the numerator.
pub const GAIN_COUNT: usize = 3;
/// Number of parameters that change only by small corrections: natural frequency, damping, delay.
pub const DYNAMICS_COUNT: usize = 3;
/// Number of gains plus the level.
pub const LINEAR_COUNT: usize = GAIN_COUNT + 1;
/// Number of states: gains, level and corrections.
pub const STATE_COUNT: usize = LINEAR_COUNT + DYNAMICS_COUNT;
/// Number of parameters of the reported operator: K_e, K_e_dot and the dynamics.
pub const PARAMETER_COUNT: usize = 2 + DYNAMICS_COUNT;
/// Number of signals of the basis: the states of its filter and the derivative of the last state.
pub const SIGNAL_COUNT: usize = 6;
/// Number of signals plus the level.
pub const INPUT_COUNT: usize = SIGNAL_COUNT + 1;
/// Maximum number of hypotheses in the mixture.
pub const MAX_HYPOTHESES: usize = 28;
/// Number of classes of hypotheses: two forms of the numerator, each with two rates of drift of the gains.
pub const CLASS_COUNT: usize = 4;
/// Maximum number of past changes that a hypothesis stores.
pub const MAX_SEGMENTS: usize = 6;
/// Largest order of the noise model.
pub const MAX_NOISE_ORDER: usize = 24;
/// Number of starting points of the first estimate.
pub const START_COUNT: usize = 8;
