//! The typical response of people to a displayed target, without a fit to their data.
//!
//! **Inverse of the machine.** People who see the target move their hand so that the machine follows it: `F P = g` near
//! 3 rad/s, with g somewhat below one (R. J. Wasicko, D. T. McRuer and R. E. Magdaleno, *Human Pilot Dynamic Response
//! in Single-Loop Systems with Compensatory and Pursuit Displays*, AFFDL-TR-66-137, 1966; M. Mulder et al., *IEEE
//! Trans. Human-Machine Systems* 48 (2018) 457-469). With `s = d ln|P|/d ln omega` at 3 rad/s ([`slope`]), F must have
//! the slope -s: it is a gain, the rate (`K_d s`), or the rate with a lead that adds the remaining slope. Typically, g
//! is .7 ([`FOLLOWED_FRACTION`]); virtual people have values of .4 to 1.
//!
//! **Delay.** Without preview, the delay is the same as in the response to the error. With preview, people respond to
//! the future target, and the delay is `-2 zeta_nm/omega_nm`, which compensates for the lag of the neuromuscular system
//! at low frequencies.

use super::{display::Display, state::FamilyState};
use crate::{ContinuousTransferFunction, FamilyOperator, Feedforward, Form, ModelError, operator_family::Coordinate};

/// Frequency at which slopes are evaluated, rad/s.
pub const SLOPE_FREQUENCY_RAD_S: f64 = 3.0;
/// Shortest time constant of people, s.
const MIN_TIME_CONSTANT_S: f64 = 0.1;
/// Longest lead time constant of people, s.
pub const LONGEST_LEAD_S: f64 = 2.0;
/// Fraction of the target that the machine follows.
pub const FOLLOWED_FRACTION: f64 = 0.7;
/// Preview in s, the default of a condition of `hoid lab`.
pub const PREVIEW_S: f64 = 1.0;
/// Largest absolute slope for which the form is a gain.
const MAX_GAIN_FORM_SLOPE: f64 = 0.5;

/// Returns the slope `d ln|P|/d ln omega` near the crossover.
pub fn slope(element: &ContinuousTransferFunction) -> f64 {
    let gain = |omega: f64| element.response(omega).norm().ln();
    let step = 0.01_f64;
    let (up, down) = (
        SLOPE_FREQUENCY_RAD_S * step.exp(),
        SLOPE_FREQUENCY_RAD_S * (-step).exp(),
    );
    (gain(up) - gain(down)) / (2.0 * step)
}

/// Returns the time constant of a lead that adds this slope at 3 rad/s, at least .1 s and at most `longest_s`.
pub fn time_constant(slope: f64, longest_s: f64) -> f64 {
    let x = (slope.max(0.0) / (1.0 - slope).max(1e-9)).sqrt();
    (x / SLOPE_FREQUENCY_RAD_S).clamp(MIN_TIME_CONSTANT_S, longest_s)
}

/// Returns the typical response to the target for a person with this response to the error. `followed` is the fraction
/// g of the target that the machine follows. With a display of the future target, the preview is `shown_s`. `None` for
/// an element whose gain rises with frequency, or falls so steeply that its inverse is proper only with a neuromuscular
/// system, for a person without one.
///
/// # Errors
/// As [`FamilyOperator::new`].
pub fn typical_feedforward(
    state: &FamilyState,
    display: Display,
    followed: f64,
    shown_s: f64,
) -> Result<Option<Feedforward>, ModelError> {
    let (operator, element) = (&state.operator, &state.controlled_element);
    let rise = -slope(element);
    let (form, lead_s) = match rise {
        r if r.abs() <= MAX_GAIN_FORM_SLOPE => (Form::Gain, None),
        r if r > MAX_GAIN_FORM_SLOPE && r <= 1.0 => (Form::Derivative, None),
        r if r > 1.0 && operator.has_neuromuscular() => {
            (Form::DerivativeLead, Some(time_constant(r - 1.0, LONGEST_LEAD_S)))
        }
        _ => return Ok(None),
    };
    let preview_s = if display == Display::Preview { shown_s } else { 0.0 };
    let muscles = operator.neuromuscular_parameters();
    let delay_s = match (display, muscles) {
        (Display::Preview, Some((omega, zeta))) => (preview_s - 2.0 * zeta / omega).max(0.0),
        (Display::Preview, None) => preview_s,
        _ => operator.tau_e_s(),
    };
    let value = |coordinate: &Coordinate| match coordinate {
        Coordinate::Gain => Some(1.0),
        Coordinate::Lead => lead_s,
        Coordinate::LogOmega => muscles.map(|(omega, _)| omega.ln()),
        Coordinate::LogZeta => muscles.map(|(_, zeta)| zeta.ln()),
        Coordinate::Delay => Some(delay_s),
        _ => None,
    };
    let neuromuscular = operator.has_neuromuscular();
    let coordinates: Option<Vec<f64>> = form.coordinates(neuromuscular).iter().map(value).collect();
    let Some(mut coordinates) = coordinates else {
        return Ok(None);
    };
    // The gain refers to the intended motion of the hand, before the neuromuscular system.
    let omega = SLOPE_FREQUENCY_RAD_S;
    let ([a, b, c, _], _) = form.shape(&lead_s.into_iter().collect::<Vec<_>>());
    let shape = (a - c * omega * omega).hypot(b * omega);
    coordinates[0] = followed / (shape * element.response(omega).norm());
    Ok(Some(Feedforward::new(
        FamilyOperator::new(form, neuromuscular, &coordinates)?,
        preview_s,
    )))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// A gain with a typical neuromuscular system and delay.
    fn person(element: &str) -> FamilyState {
        FamilyState {
            operator: FamilyOperator::new(Form::Gain, true, &[1.0, 11.0_f64.ln(), 0.25_f64.ln(), 0.2]).unwrap(),
            controlled_element: element.parse().unwrap(),
        }
    }

    #[test]
    fn controlled_element_follows_the_target() {
        for (element, form) in [
            ("2", Form::Gain),
            ("4/s", Form::Derivative),
            ("4/(s(s+1))", Form::DerivativeLead),
            ("90/(s(s+6))", Form::DerivativeLead),
            ("3/s^2", Form::DerivativeLead),
        ] {
            let state = person(element);
            for display in [Display::Pursuit, Display::Preview] {
                let seen = typical_feedforward(&state, display, FOLLOWED_FRACTION, PREVIEW_S)
                    .unwrap()
                    .unwrap();
                assert_eq!(seen.operator.form(), form, "{element}");
                // Apart from the dynamics of the arm, the machine follows the fraction g of the target; with a preview
                // it follows in phase.
                let omega = 3.0_f64;
                let (nm, zeta) = state.operator.neuromuscular_parameters().unwrap();
                let z = omega / nm;
                let arm = num_complex::Complex64::new(1.0 - z * z, 2.0 * zeta * z).inv();
                let moved = seen.operator.response(omega) * state.controlled_element.response(omega);
                assert!(
                    (moved.norm() / arm.norm() - FOLLOWED_FRACTION).abs() < 1e-9,
                    "{element}: {moved}"
                );
                let shown = num_complex::Complex64::from_polar(1.0, omega * seen.preview_s);
                let phase = (moved * shown).arg();
                if display == Display::Preview {
                    assert!(phase.abs() < 0.5, "{element}: {phase}");
                } else {
                    assert!(phase < -omega * state.operator.tau_e_s() + 0.3, "{element}: {phase}");
                }
            }
        }
    }

    #[test]
    fn some_elements_have_no_typical_response() {
        let of = |state: &FamilyState| typical_feedforward(state, Display::Pursuit, 0.7, 0.0).unwrap();
        // There is no response for an element whose gain rises with frequency, or whose inverse is improper without a
        // neuromuscular system.
        let rising = FamilyState {
            controlled_element: "(s+1)/(s+9)".parse().unwrap(),
            ..person("1/s")
        };
        assert!(of(&rising).is_none());
        let bare = FamilyState {
            operator: FamilyOperator::new(Form::Gain, false, &[1.0, 0.2]).unwrap(),
            ..person("3/s^2")
        };
        assert!(of(&bare).is_none());
        // If the preview is shorter than the neuromuscular lag, the delay relative to the end of the preview is zero.
        let short = typical_feedforward(&person("1/s"), Display::Preview, 0.7, 0.02)
            .unwrap()
            .unwrap();
        assert_eq!((short.operator.tau_e_s(), short.preview_s), (0.0, 0.02));
    }
}
