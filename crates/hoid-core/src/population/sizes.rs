//! How many there are: of gains, forms, filters, and lags of the noise model.

/// Gains of the numerator.
pub const GAINS: usize = 3;
/// What is held but for small corrections: natural frequency, damping, delay.
pub const HELD: usize = 3;
/// Gains and level.
pub const LINEAR: usize = GAINS + 1;
/// Gains, level and corrections.
pub const STATES: usize = LINEAR + HELD;
/// Parameters of the operator that is told: K_e, K_e_dot and what is held.
pub const PARAMETERS: usize = 2 + HELD;
/// Signals of the basis: the states of its filter and their derivative.
pub const SIGNALS: usize = 6;
/// Forms of the numerator: any, and a gain with a lead.
pub const FORMS: usize = 2;
/// Filters with different drifts for each form.
pub const DRIFTS: usize = 3;
/// Filters for each form in which somebody has just changed.
pub const NEWBORNS: usize = 2;
/// Filters for each form.
pub const FILTERS: usize = DRIFTS + NEWBORNS;
/// Largest order of the noise model.
pub const LARGEST_ORDER: usize = 24;
/// Those who are followed beside.
pub const RIVALS: usize = 10;
