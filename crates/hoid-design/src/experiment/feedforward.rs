//! The typical response of people to a displayed target, without a fit to their data.
//!
//! **Inverse of the machine.** People who see the target move the hand so that the machine follows it: `F P = g` near 3
//! rad/s, with g somewhat below one (R. J. Wasicko, D. T. McRuer and R. E. Magdaleno, *Human Pilot Dynamic Response in
//! Single-Loop Systems with Compensatory and Pursuit Displays*, AFFDL-TR-66-137, 1966; M. Mulder et al., *IEEE Trans.
//! Human-Machine Systems* 48 (2018) 457-469). With `s = d ln|P|/d ln omega` at 3 rad/s, F must have the slope -s: it is
//! a gain, the rate (`K_d s`), or the rate with a lead that adds the remaining slope. g is .7; the virtual people of
//! `cargo xtask slow inputs-coverage` have values of .4 to 1.
//!
//! **Delay.** Without preview, the delay is the same as in the response to the error. With preview, people respond to
//! the future target, and the delay is `-2 zeta_nm/omega_nm`, which compensates the lag of the neuromuscular system at
//! low frequencies.

use hoid_model::{
    FamilyOperator, FamilyState, Form,
    family_scenario::{Display, Feedforward},
    operator_family::Coordinate,
};

use super::{
    DesignError,
    adapted::{LONGEST_LEAD_S, NEAR_CROSSOVER_RAD_S, slope, time_constant},
};

/// Fraction of the target that the machine follows.
const FOLLOWED_FRACTION: f64 = 0.7;
/// Preview in s, the default of a condition of `hoid lab`.
pub(super) const PREVIEW_S: f64 = 1.0;
/// Largest absolute slope for which the form is a gain.
const HALF: f64 = 0.5;

/// Returns the typical response to the target for a person with this response to the error.
pub(super) fn typical(state: &FamilyState, display: Display) -> Result<Feedforward, DesignError> {
    let unknown = || DesignError::NoFeedforward {
        element: state.controlled_element.to_string(),
    };
    let (operator, element) = (&state.operator, &state.controlled_element);
    let rise = -slope(element);
    let (form, lead_s) = match rise {
        r if r.abs() <= HALF => (Form::Gain, None),
        r if r > HALF && r <= 1.0 => (Form::Derivative, None),
        r if r > 1.0 && operator.has_neuromuscular() => {
            (Form::DerivativeLead, Some(time_constant(r - 1.0, LONGEST_LEAD_S)))
        }
        _ => return Err(unknown()),
    };
    let preview_s = if display == Display::Preview { PREVIEW_S } else { 0.0 };
    let muscles = operator.neuromuscular();
    let delay_s = match (display, muscles) {
        (Display::Preview, Some((omega, zeta))) => preview_s - 2.0 * zeta / omega,
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
    let mut coordinates = coordinates.ok_or_else(unknown)?;
    // The gain is set for the intended motion of the hand, which excludes the neuromuscular system.
    let omega = NEAR_CROSSOVER_RAD_S;
    let ([a, b, c], _) = form.shape(&lead_s.into_iter().collect::<Vec<_>>());
    let shape = (a - c * omega * omega).hypot(b * omega);
    coordinates[0] = FOLLOWED_FRACTION / (shape * element.response(omega).norm());
    Ok(Feedforward::new(FamilyOperator::new(form, neuromuscular, &coordinates)?, preview_s))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::experiment::adapted::population;

    #[test]
    fn the_machine_moves_along_with_the_target() {
        for (element, form) in [
            ("2", Form::Gain),
            ("4/s", Form::Derivative),
            ("4/(s(s+1))", Form::DerivativeLead),
            ("90/(s(s+6))", Form::DerivativeLead),
            ("3/s^2", Form::DerivativeLead),
        ] {
            let state = population(&element.parse().unwrap(), None).unwrap().0.state;
            for display in [Display::Pursuit, Display::Preview] {
                let seen = typical(&state, display).unwrap();
                assert_eq!(seen.operator.form(), form, "{element}");
                // Below the frequency of the arm the part is g, and for a preview in phase.
                let omega = 3.0_f64;
                let (nm, zeta) = state.operator.neuromuscular().unwrap();
                let z = omega / nm;
                let arm = hoid_model::Complex64::new(1.0 - z * z, 2.0 * zeta * z).inv();
                let moved = seen.operator.response(omega) * state.controlled_element.response(omega);
                assert!(
                    (moved.norm() / arm.norm() - FOLLOWED_FRACTION).abs() < 1e-9,
                    "{element}: {moved}"
                );
                let shown = super::super::information::ahead(seen.preview_s, omega);
                let phase = (moved * shown).arg();
                if display == Display::Preview {
                    assert!(phase.abs() < 0.5, "{element}: {phase}");
                } else {
                    assert!(phase < -omega * state.operator.tau_e_s() + 0.3, "{element}: {phase}");
                }
            }
        }
    }
}
