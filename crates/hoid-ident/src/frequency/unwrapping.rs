//! Phase without jumps by whole turns.
//!
//! At each line the phase is known except for whole turns. The smaller change from one line to the next is chosen after
//! the phase of a delay, which changes fastest, has been removed. If the error of tau is less than
//! `pi/(omega_{k+1} - omega_k)`, `phi + omega tau` changes by less than half a turn from line to line.

use std::f64::consts::PI;

/// Returns phases in deg without jumps, for pairs of frequency in rad/s and phase in deg. The phase of the delay
/// `delay_s` is removed before the unwrapping and added afterwards. The first value, before the phase of the delay is
/// added, is the principal value. Values that are not finite remain unchanged.
pub fn unwrapped_deg(phases: &[(f64, f64)], delay_s: f64) -> Vec<f64> {
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
    fn unwrapped_phase_of_a_delay_is_linear() {
        // With a delay of 0.9 s and steps of 1 rad/s, the phase changes by 52 deg per step, and by many turns in total.
        let phases: Vec<(f64, f64)> = (1..200)
            .map(|k| {
                let omega = f64::from(k);
                (omega, Complex64::from_polar(1.0, -0.9 * omega).arg().to_degrees())
            })
            .collect();
        for (phase, (omega, _)) in unwrapped_deg(&phases, 0.9).iter().zip(&phases) {
            assert!((phase + (0.9 * omega).to_degrees()).abs() < 1e-9);
        }
        // A step of 8 rad/s changes the phase by 413 deg; the unwrapping remains right with an error of 0.3 s in the
        // delay.
        let coarse: Vec<(f64, f64)> = phases.iter().copied().step_by(8).collect();
        for (phase, (omega, _)) in unwrapped_deg(&coarse, 0.6).iter().zip(&coarse) {
            assert!((phase + (0.9 * omega).to_degrees()).abs() < 1e-9);
        }
        assert!(unwrapped_deg(&[], 0.1).is_empty());
        let broken = unwrapped_deg(&[(1.0, 170.0), (2.0, f64::NAN), (3.0, -170.0)], 0.0);
        assert!(broken[1].is_nan() && broken[2] == 190.0);
    }
}
