//! The operator's responses to the error and the error rate with unit gain.
//!
//! With a known neuromuscular part, `u = K_e y_0 + K_e_dot y_1 + n`. The signal y_0 is the exact response of
//! `omega^2/(s^2 + 2 zeta omega s + omega^2)` to the held error, delayed by nk - 1 samples, and y_1 is its rate. This
//! model of u has the form of [`hoid_ident::SigmoidChange`] for a delay of whole samples.

use hoid_model::{SampleTime, second_order::ZohStates};

/// Returns y_0 and y_1, starting from rest.
pub(super) fn unit_responses(
    e: &[f64],
    omega_rad_s: f64,
    zeta: f64,
    nk: usize,
    sample_time: SampleTime,
) -> [Vec<f64>; 2] {
    let square = omega_rad_s * omega_rad_s;
    let held = ZohStates::new(2.0 * zeta * omega_rad_s, square, sample_time);
    let mut state = [0.0; 2];
    let (mut y_0, mut y_1) = (Vec::with_capacity(e.len()), Vec::with_capacity(e.len()));
    for k in 0..e.len() {
        // The response to e(k - nk) starts at sample k.
        let before = if k >= nk { e[k - nk] } else { 0.0 };
        state = held.step(state, before);
        y_0.push(square * state[0]);
        y_1.push(square * state[1]);
    }
    [y_0, y_1]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::OperatorParameters;

    use super::*;

    #[test]
    fn weighted_responses_sum_to_the_held_operator() {
        let ts = SampleTime::new(0.01).unwrap();
        let operator = OperatorParameters {
            k_e: 0.07,
            t_l_s: 1.2,
            omega_nm_rad_s: 11.25,
            zeta_nm: 0.35,
            tau_e_s: 0.28,
        };
        let discrete = operator.discretise(ts).unwrap();
        let e: Vec<f64> = (0..300)
            .map(|k| (0.07 * f64::from(k)).sin() + f64::from(k % 7))
            .collect();
        let [y_0, y_1] = unit_responses(&e, 11.25, 0.35, discrete.nk, ts);
        let held = discrete.zoh;
        let mut u = vec![0.0; e.len()];
        for k in 0..e.len() {
            let at = |signal: &[f64], lag: usize| if k >= lag { signal[k - lag] } else { 0.0 };
            u[k] = held.b0 * at(&e, 29) + held.b1 * at(&e, 30) - held.f1 * at(&u, 1) - held.f2 * at(&u, 2);
            let found = operator.k_e * y_0[k] + operator.k_e_dot() * y_1[k];
            assert!((u[k] - found).abs() < 1e-12, "{k}: {} {found}", u[k]);
        }
    }
}
