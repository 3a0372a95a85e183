//! Reported operator: its parameters and their covariance, computed from gains and corrections.
//!
//! K_e and K_e_dot describe the gain and lead nearest to the numerator at [`FIT_FREQUENCIES_RAD_S`], by least squares
//! in `K_e + K_e_dot j omega = Y e^{j tau omega} (1 - omega^2/omega_nm^2 + 2 j zeta omega/omega_nm)`; this is exact for
//! an operator with a gain and a lead. K_e and K_e_dot are linear in the state, so their covariance is `M P M'`, where
//! M maps the state to them and P is the covariance of the mixture ([`super::mixture`]). The scatter of other operators
//! that predict u about as well ([`super::alternatives`]) is added.

use hoid_numerics::products::congruence;

use super::{
    AdaptiveFilter,
    defaults::START_TIME_S,
    sizes::{GAIN_COUNT, PARAMETER_COUNT, correction_places, first_gain},
};

/// Time constant in s of a correction of the standard errors, which are too small in the first seconds because the
/// noise model is uncertain. After t seconds they are multiplied by `1 + SETTLING_S/t`. The value was chosen on virtual
/// people with a seed that the test does not use (`tests/first_seconds.rs` of `hoid-track`).
const SETTLING_S: f64 = 4.0;

impl<E: AsRef<[f64]> + AsMut<[f64]>, const I: usize, const S: usize, const M: usize, const P: usize>
    AdaptiveFilter<E, I, S, M, P>
{
    /// Returns K_e, K_e_dot, omega_nm in rad/s, zeta_nm, and tau_e in s.
    pub fn operator(&self) -> [f64; PARAMETER_COUNT] {
        self.operator_of(0)
    }

    /// Like [`AdaptiveFilter::operator`], for the response to an input.
    pub fn operator_of(&self, input: usize) -> [f64; PARAMETER_COUNT] {
        let [k_e, k_e_dot, omega, zeta, tau] = self.live_candidate().operators()[input];
        // The error is held over each sample; half a sample of the delay is due to this zero-order hold and is
        // subtracted.
        let hold = 0.5 * self.sample_time();
        [k_e, k_e_dot, omega, zeta, (tau - hold).max(0.0)]
    }

    /// Returns the covariance of [`AdaptiveFilter::operator`], including the scatter of other operators that predict u
    /// about as well as the estimate.
    pub fn operator_covariance(&self) -> [[f64; PARAMETER_COUNT]; PARAMETER_COUNT] {
        self.operator_covariance_of(0)
    }

    /// Like [`AdaptiveFilter::operator_covariance`], for the response to an input.
    pub fn operator_covariance_of(&self, input: usize) -> [[f64; PARAMETER_COUNT]; PARAMETER_COUNT] {
        let mut rows = [[0.0; S]; PARAMETER_COUNT];
        for (row, gains) in rows.iter_mut().zip(self.gain_and_lead_matrix_of(input)) {
            row[first_gain(input)..][..GAIN_COUNT].copy_from_slice(&gains);
        }
        for (row, place) in rows[2..].iter_mut().zip(correction_places(input)) {
            row[place] = 1.0;
        }
        let own = congruence(&rows, &self.state_covariance());
        let scatter = self.alternatives().scatter(
            input,
            &self.live_candidate().operators()[input],
            self.informative_samples(),
            self.max_replay_samples(),
        );
        core::array::from_fn(|i| core::array::from_fn(|j| own[i][j] + scatter[i][j]))
    }

    /// Returns T_L in s and its variance. Each hypothesis has the lead time T that minimises the expected value of
    /// `(K_e_dot - T K_e)^2`. T_L is the mean of these lead times, and its variance is computed from the variance of
    /// `K_e_dot - T_L K_e` with the covariance of the mixture. A single T for the mixture would be far too short if
    /// unlikely hypotheses, such as those born in the last second, leave K_e undetermined.
    pub fn lead_time(&self) -> [f64; 2] {
        let map = self.gain_and_lead_matrix();
        let pair = |state: &[f64; S]| map.map(|row| (0..GAIN_COUNT).map(|k| row[k] * state[k]).sum::<f64>());
        let product = |c: &[[f64; S]; S], i: usize, j: usize| -> f64 {
            let each = (0..GAIN_COUNT).map(|a| map[i][a] * (0..GAIN_COUNT).map(|b| c[a][b] * map[j][b]).sum::<f64>());
            each.sum()
        };
        let lead = self.live_candidate().mixture.weighted_mean(|state, c| {
            let [k, k_dot] = pair(state);
            let square = k * k + product(c, 0, 0);
            match square > 0.0 {
                true => (k * k_dot + product(c, 0, 1)) / square,
                false => 0.0,
            }
        });
        let (all, [k, ..]) = (self.operator_covariance(), self.operator());
        let square = k * k + all[0][0];
        let variance = all[1][1] - 2.0 * lead * all[0][1] + lead * lead * all[0][0];
        [lead, variance.max(0.0) / square]
    }

    /// Returns the matrix that maps the gains of the basis to K_e and K_e_dot.
    pub fn gain_and_lead_matrix(&self) -> [[f64; GAIN_COUNT]; 2] {
        self.gain_and_lead_matrix_of(0)
    }

    /// Like [`AdaptiveFilter::gain_and_lead_matrix`], for the gains of an input.
    pub fn gain_and_lead_matrix_of(&self, input: usize) -> [[f64; GAIN_COUNT]; 2] {
        self.live_candidate().gain_and_lead_matrix(input)
    }

    /// Returns the reported covariance of gains, level and corrections.
    pub fn state_covariance(&self) -> [[f64; S]; S] {
        let mut c = self.live_candidate().mixture.covariance();
        if !self.has_initial_estimate() {
            let seconds = self.update_count() as f64 * self.sample_time();
            let wider = 1.0 + SETTLING_S / seconds.max(START_TIME_S);
            c.iter_mut().flatten().for_each(|c| *c *= wider * wider);
        }
        c
    }
}
