//! Phase without jumps.

use std::f64::consts::PI;

/// Phase without jumps, in deg. The first value is the principal one with the delay taken out.
pub fn unwrap(phases: &[(f64, f64)], delay_s: f64) -> Vec<f64> {
    let mut before: Option<f64> = None;
    phases
        .iter()
        .map(|&(omega, phase)| {
            let by_delay = omega * delay_s * 180.0 / PI;
            let rest = phase + by_delay;
            let turns = match before {
                None => (rest / 360.0).round(),
                Some(last) => ((rest - last) / 360.0).round(),
            };
            let rest = rest - 360.0 * turns;
            if rest.is_finite() {
                before = Some(rest);
            }
            rest - by_delay
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use hoid_model::Complex64;

    use super::*;

    #[test]
    fn unwrapped_phase_of_a_delay_is_a_line() {
        // 0.9 s of delay and 1 rad/s steps: 52 deg a step, far beyond one round.
        let phases: Vec<(f64, f64)> = (1..200)
            .map(|k| {
                let omega = f64::from(k);
                (omega, Complex64::from_polar(1.0, -0.9 * omega).arg().to_degrees())
            })
            .collect();
        for (phase, (omega, _)) in unwrap(&phases, 0.9).iter().zip(&phases) {
            assert!((phase + (0.9 * omega).to_degrees()).abs() < 1e-9);
        }
    }
}
