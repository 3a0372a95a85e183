//! Exact zero-order hold of the human operator with an arbitrary delay, and its Jacobian.
//!
//! The operator is `H(s) = (K_e + K_e_dot s) omega^2/(s^2 + 2 zeta omega s + omega^2) e^{-tau s}` with
//! `tau = l Ts + delta`, `0 <= delta <= Ts`. An error that is held over each sample reaches the states in two parts,
//!
//! `x_{k+1} = Phi(Ts) x_k + Phi(Ts - delta) Gamma(delta) e_{k-l-1} + Gamma(Ts - delta) e_{k-l}`,
//!
//! so that the discrete model is `q^-nk (b0 + b1 q^-1 + b2 q^-2)/(1 + f1 q^-1 + f2 q^-2)` with `nk = l + 1` (K. J.
//! Åström and B. Wittenmark, *Computer-Controlled Systems*, 1997, section 2.3; E. I. Jury, *Theory and Application of
//! the z-Transform Method*, 1964: the modified z-transform). Let `K_e A(t) + K_e_dot R(t)` be the step response of the
//! operator without its delay, continued analytically to negative t, where it obeys the same difference equation. Then
//!
//! - `b0 = K_e A(Ts - delta) + K_e_dot R(Ts - delta)`,
//!   `b2 = f2 (K_e A(-delta) + K_e_dot R(-delta))`;
//! - `b0 + b1 + b2 = K_e (1 + f1 + f2)`, the gain at zero frequency.
//!
//! In terms of the [`DividedDifferences`] at the poles multiplied by the time t, with `s = -2 zeta omega t` and
//! `q = omega^2 t^2`:
//!
//! - `A = q Phi_2`, `R = omega^2 t Phi_1`; at Ts, `f1 = -2 E C`, `f2 = e^s`, `1 + f1 + f2 = q chi`;
//! - A and `R/omega` are functions of (omega t, zeta), so `dA/dt = R` and `dR/dt = omega^2 Phi_0` give their
//!   derivatives with respect to omega: `omega t^2 Phi_1` for A and `omega t (Phi_0 + Phi_1)` for R. The derivatives
//!   with respect to zeta follow by the chain rule through s: `dA/ds = q D_2`, `dR/ds = omega^2 t D_1`;
//! - `df1/domega = 2 Ts (omega Ts Phi_1 + zeta Phi_0)`, `df1/dzeta = 2 omega Ts Phi_0`. The derivatives of
//!   `1 + f1 + f2` have `Phi_0 - f2 = -q dchi/ds` in place of `Phi_0`.
//!
//! No terms cancel if omega Ts is small. For delta = 0, b2 is zero and the model is that of eq. 11. The response is
//! continuous in tau and has a kink where tau is a whole number of samples, because the step response starts with the
//! slope `omega^2 K_e_dot`. At delta = 0 and delta = Ts the derivatives with respect to tau are therefore one-sided,
//! from within the sample.
//!
//! The parameters are not checked here. If a parameter is not finite, or if the poles are so fast that an exponential
//! overflows, the coefficients are not finite.

use crate::divided_differences::DividedDifferences;

/// Returns `[b0, b1, f1, f2]` for the parameters `[K_e, K_e_dot, omega_nm, zeta_nm]` (deg/deg, s, rad/s, 1) and a delay
/// of whole samples, with the Jacobian (rows: coefficients, columns: parameters). Ts is in s.
pub fn zoh_operator(parameters: [f64; 4], ts: f64) -> ([f64; 4], [[f64; 4]; 4]) {
    let [k_e, k_e_dot, omega, zeta] = parameters;
    let at_ts = DividedDifferences::at(-2.0 * zeta * omega * ts, omega * omega * ts * ts);
    let poles = Poles::new(&at_ts, ts, omega, zeta);
    let gains = Gains::new(&at_ts, ts, omega);
    let b0 = gains.response(k_e, k_e_dot);
    let [_, _, b0_omega, b0_zeta, _] = gains.row(k_e, k_e_dot);
    (
        [b0, k_e * poles.sum - b0, poles.f1, poles.f2],
        [
            [gains.step, gains.rate, b0_omega, b0_zeta],
            [
                poles.sum - gains.step,
                -gains.rate,
                k_e * poles.sum_omega - b0_omega,
                k_e * poles.sum_zeta - b0_zeta,
            ],
            [0.0, 0.0, poles.f1_omega, poles.f1_zeta],
            [0.0, 0.0, poles.f2_omega, poles.f2_zeta],
        ],
    )
}

/// Returns `[b0, b1, b2, f1, f2]` for a delay of whole samples plus delta, `0 <= delta <= Ts`, with the Jacobian with
/// respect to `[K_e, K_e_dot, omega_nm, zeta_nm, tau]` for a fixed number of whole samples. delta and Ts are in s.
pub fn zoh_operator_delayed(parameters: [f64; 4], delta: f64, ts: f64) -> ([f64; 5], [[f64; 5]; 5]) {
    let [k_e, k_e_dot, omega, zeta] = parameters;
    let at = |t: f64| DividedDifferences::at(-2.0 * zeta * omega * t, omega * omega * t * t);
    let poles = Poles::new(&at(ts), ts, omega, zeta);
    let early = Gains::new(&at(ts - delta), ts - delta, omega);
    let late = Gains::new(&at(-delta), -delta, omega);

    let b0 = early.response(k_e, k_e_dot);
    let late_response = late.response(k_e, k_e_dot);
    let b2 = poles.f2 * late_response;
    let b0_row = early.row(k_e, k_e_dot);
    let mut b2_row = late.row(k_e, k_e_dot).map(|d| poles.f2 * d);
    b2_row[2] += poles.f2_omega * late_response;
    b2_row[3] += poles.f2_zeta * late_response;
    let total = [poles.sum, 0.0, k_e * poles.sum_omega, k_e * poles.sum_zeta, 0.0];
    (
        [b0, k_e * poles.sum - b0 - b2, b2, poles.f1, poles.f2],
        [
            b0_row,
            core::array::from_fn(|j| total[j] - b0_row[j] - b2_row[j]),
            b2_row,
            [0.0, 0.0, poles.f1_omega, poles.f1_zeta, 0.0],
            [0.0, 0.0, poles.f2_omega, poles.f2_zeta, 0.0],
        ],
    )
}

/// Coefficients f1 and f2 and the sum `1 + f1 + f2`, with their derivatives.
#[derive(Debug, Clone, Copy)]
struct Poles {
    f1: f64,
    f1_omega: f64,
    f1_zeta: f64,
    f2: f64,
    f2_omega: f64,
    f2_zeta: f64,
    sum: f64,
    sum_omega: f64,
    sum_zeta: f64,
}

impl Poles {
    #[inline]
    fn new(d: &DividedDifferences, ts: f64, omega: f64, zeta: f64) -> Self {
        let f2 = libm::exp(d.sum);
        let phi0 = d.phi0();
        let sum_slope = d.product * d.chi_slope();
        Self {
            f1: -2.0 * d.mean,
            f1_omega: 2.0 * ts * (omega * ts * d.phi1 + zeta * phi0),
            f1_zeta: 2.0 * omega * ts * phi0,
            f2,
            f2_omega: -2.0 * zeta * ts * f2,
            f2_zeta: -2.0 * omega * ts * f2,
            sum: d.product * d.chi(),
            sum_omega: 2.0 * ts * (omega * ts * d.phi1 - zeta * sum_slope),
            sum_zeta: -2.0 * omega * ts * sum_slope,
        }
    }
}

/// Contributions A of K_e and R of K_e_dot to the step response at one time, with their derivatives; `dA/dt` equals R.
#[derive(Debug, Clone, Copy)]
struct Gains {
    step: f64,
    step_omega: f64,
    step_zeta: f64,
    rate: f64,
    rate_omega: f64,
    rate_zeta: f64,
    rate_t: f64,
}

impl Gains {
    #[inline]
    fn new(d: &DividedDifferences, t: f64, omega: f64) -> Self {
        let w2 = omega * omega;
        let phi0 = d.phi0();
        let s_zeta = -2.0 * omega * t;
        Self {
            step: d.product * d.phi2,
            step_omega: omega * t * t * d.phi1,
            step_zeta: d.product * d.phi2_slope * s_zeta,
            rate: w2 * t * d.phi1,
            rate_omega: omega * t * (phi0 + d.phi1),
            rate_zeta: w2 * t * d.phi1_slope() * s_zeta,
            rate_t: w2 * phi0,
        }
    }

    fn response(&self, k_e: f64, k_e_dot: f64) -> f64 {
        k_e * self.step + k_e_dot * self.rate
    }

    /// Derivatives of the step response with respect to K_e, K_e_dot, omega, zeta and tau. The derivative with respect
    /// to tau is minus that with respect to t.
    fn row(&self, k_e: f64, k_e_dot: f64) -> [f64; 5] {
        [
            self.step,
            self.rate,
            k_e * self.step_omega + k_e_dot * self.rate_omega,
            k_e * self.step_zeta + k_e_dot * self.rate_zeta,
            -(k_e * self.rate + k_e_dot * self.rate_t),
        ]
    }
}

#[cfg(test)]
mod tests;
