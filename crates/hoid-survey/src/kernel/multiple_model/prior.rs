//! Prior of an operator: rate and size of its changes, and the parameters that change.
//!
//! Times are in samples. Changes of the gains are relative to
//! `g = sqrt(K_e^2 + omega_c^2 K_e_dot^2)`, the gain of the operator's lead term at the crossover frequency omega_c:
//! those of K_e in units of g, those of K_e_dot in units of `g/omega_c`. The same numbers are then valid for an
//! operator of any gain, also if K_e or K_e_dot is zero.

/// Number of the operator's parameters: K_e, K_e_dot, omega_nm, zeta_nm.
pub const OPERATOR: usize = 4;

/// Prior of changes of the operator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChangePrior {
    /// Sample time in s.
    pub sample_time: f64,
    /// Least and largest value of K_e, K_e_dot, omega_nm and zeta_nm.
    pub bounds: [[f64; 2]; OPERATOR],
    /// Crossover frequency omega_c at which the two gains are compared, rad/s.
    pub crossover: f64,
    /// Probability of a change in one sample.
    pub hazard: f64,
    /// Number of samples between two births of hypotheses.
    pub birth_interval: u32,
    /// Standard deviation of a change of K_e and of K_e_dot, relative to g.
    pub gain_jump: [f64; 2],
    /// Standard deviation of the drift of both gains in one sample, relative to g.
    pub gain_drift: f64,
    /// Standard deviations of the drift in one sample just after a change: of K_e and K_e_dot relative to g; of
    /// omega_nm and zeta_nm, if they changed, in units of
    /// [`ChangePrior::neuromuscular_jump`].
    pub transient_drift: [f64; OPERATOR],
    /// Time constant with which this drift decays, samples.
    pub transient_time_constant: f64,
    /// Standard deviation of a change of omega_nm and of zeta_nm, relative to their values.
    pub neuromuscular_jump: [f64; 2],
    /// Number of births per birth of a hypothesis that omega_nm and zeta_nm changed too; zero for never.
    pub neuromuscular_every: u32,
    /// Odds of a change of all four parameters against one of the gains alone.
    pub neuromuscular_odds: f64,
    /// Number of residuals of the innovation variance just after a change.
    pub residuals_after_change: f64,
    /// Limit of the innovations, in standard deviations.
    pub outlier_limit: f64,
    /// Age in samples from which a hypothesis may be pruned.
    pub pruning_age: u64,
    /// Samples within which a birth counts as a recent change.
    pub change_window: u64,
    /// Number of samples in which the estimates settle after a change; before, a hypothesis cannot identify the
    /// changed parameters.
    pub settling_time: u64,
    /// Logarithm of the posterior odds from which a change is declared.
    pub log_odds_threshold: f64,
    /// The delay.
    pub delay: DelayPrior,
}

impl ChangePrior {
    /// True if omega_nm and zeta_nm cannot become zero and every probability, time and interval is in its range.
    pub(super) fn is_valid(&self) -> bool {
        self.bounds[2][0] > 0.0
            && self.bounds[3][0] > 0.0
            && self.sample_time > 0.0
            && self.birth_interval > 0
            && (0.0..1.0).contains(&(self.hazard * f64::from(self.birth_interval)))
            && self.delay.is_valid()
    }
}

/// Prior of the delay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DelayPrior {
    /// Number of candidate delays, one sample apart; one for a known delay.
    pub count: usize,
    /// Number of births per proposal of other delays.
    pub propose_every: u32,
    /// Largest number of proposals of a changed delay at a time.
    pub proposals: usize,
    /// Odds of a change of the delay and the gains against one of the gains alone.
    pub change_odds: f64,
    /// Standard deviation of a change of the delay, samples.
    pub jump: f64,
    /// Prior probability of a delay one sample away from the likeliest.
    pub neighbour_probability: f64,
    /// Errors of the parameters that an error of the delay of one sample causes (standard deviations): K_e and K_e_dot
    /// relative to g, omega_nm and zeta_nm relative to their values.
    pub error_per_sample: [f64; OPERATOR],
}

impl DelayPrior {
    /// A delay that is known and constant.
    pub const KNOWN: Self = Self {
        count: 1,
        propose_every: u32::MAX,
        proposals: 1,
        change_odds: 0.0,
        jump: 1.0,
        neighbour_probability: 0.0,
        error_per_sample: [0.0; OPERATOR],
    };

    fn is_valid(&self) -> bool {
        self.propose_every > 0
            && self.proposals > 0
            && (0.0..0.5).contains(&self.neighbour_probability)
            && self.jump > 0.0
    }
}
