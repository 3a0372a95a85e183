//! Prior of an operator: rate and size of its changes, and selection of the parameters that change.
//!
//! Times are in samples. Changes in the gains are relative to `g = sqrt(K_e^2 + omega_c^2 K_e_dot^2)`, the gain of the
//! operator's lead term at the crossover frequency omega_c: changes in K_e are in units of g, changes in K_e_dot in
//! units of `g/omega_c`. The same numbers are therefore valid for an operator of any gain, even if K_e or K_e_dot is
//! zero.

/// Number of the operator's parameters: K_e, K_e_dot, omega_nm, zeta_nm.
pub const PARAMETER_COUNT: usize = 4;

/// Prior of changes in the operator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChangePrior {
    /// Sample time in s.
    pub sample_time: f64,
    /// Smallest and largest value of K_e, K_e_dot, omega_nm and zeta_nm.
    pub bounds: [[f64; 2]; PARAMETER_COUNT],
    /// Crossover frequency omega_c, which scales K_e_dot relative to K_e, rad/s.
    pub crossover: f64,
    /// Probability of a change in one sample.
    pub hazard: f64,
    /// Number of samples between two births of hypotheses.
    pub birth_interval: u32,
    /// Standard deviations of a change in K_e and in K_e_dot, relative to g and `g/omega_c`.
    pub gain_jump: [f64; 2],
    /// Standard deviation of the drift of each gain in one sample, relative to g and `g/omega_c`.
    pub gain_drift: f64,
    /// Standard deviations of the drift in one sample just after a change: K_e and K_e_dot relative to g and
    /// `g/omega_c`; omega_nm and zeta_nm, if they changed, in units of [`ChangePrior::neuromuscular_jump`].
    pub transient_drift: [f64; PARAMETER_COUNT],
    /// Time constant with which the drift after a change decays, samples.
    pub transient_time_constant: f64,
    /// Standard deviations of a change in omega_nm and in zeta_nm, relative to their values.
    pub neuromuscular_jump: [f64; 2],
    /// Interval, in births, between hypotheses in which omega_nm and zeta_nm changed too; zero for no such hypotheses.
    pub neuromuscular_every: u32,
    /// Odds of a change in all four parameters against a change in the gains alone.
    pub neuromuscular_odds: f64,
    /// Number of residuals to which the innovation variance is reduced just after a change.
    pub residuals_after_change: f64,
    /// Limit of the innovations, in standard deviations.
    pub outlier_limit: f64,
    /// Age in samples from which a hypothesis may be pruned.
    pub pruning_age: u64,
    /// Time after its birth during which a hypothesis counts as a recent change, samples.
    pub change_window: u64,
    /// Number of samples in which the estimates settle after a change. A hypothesis that is younger than the settling
    /// time cannot identify the changed parameters.
    pub settling_time: u64,
    /// Logarithm of the posterior odds above which a change is declared.
    pub log_odds_threshold: f64,
    /// Prior of the delay.
    pub delay: DelayPrior,
}

impl ChangePrior {
    /// True if omega_nm and zeta_nm cannot become zero, sample time and birth interval are positive, the probability of
    /// a change between two births is below one, and the prior of the delay is valid.
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
    /// Interval, in births, between proposals of other delays.
    pub propose_every: u32,
    /// Largest number of changed delays proposed at a time.
    pub proposals: usize,
    /// Odds of a change in the delay and the gains against a change in the gains alone.
    pub change_odds: f64,
    /// Standard deviation of a change in the delay, samples.
    pub jump: f64,
    /// Prior probability of a delay that differs by one sample from the likeliest delay.
    pub neighbour_probability: f64,
    /// Standard deviations of the errors of the parameters caused by a delay error of one sample: K_e and K_e_dot
    /// relative to g and `g/omega_c`, omega_nm and zeta_nm relative to their values.
    pub error_per_sample: [f64; PARAMETER_COUNT],
}

impl DelayPrior {
    /// Prior for a delay that is known and constant.
    pub const KNOWN_DELAY: Self = Self {
        count: 1,
        propose_every: u32::MAX,
        proposals: 1,
        change_odds: 0.0,
        jump: 1.0,
        neighbour_probability: 0.0,
        error_per_sample: [0.0; PARAMETER_COUNT],
    };

    fn is_valid(&self) -> bool {
        self.propose_every > 0
            && self.proposals > 0
            && (0.0..0.5).contains(&self.neighbour_probability)
            && self.jump > 0.0
    }
}
