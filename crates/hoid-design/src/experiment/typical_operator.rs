//! The operator that people typically adopt with a controlled element, without a fit to their data.
//!
//! **Crossover model** (D. T. McRuer and H. R. Jex, *IEEE Trans. Human Factors in Electronics* 8 (1967) 231-249):
//! people adapt lead and lag so that `|H P|` falls by 20 dB per decade near the crossover frequency. With
//! `s = d ln|P|/d ln omega` at 3 rad/s, the operator has to add the slope `p = -1 - s`; a lead adds `x^2/(1 + x^2)`,
//! `x = T_L omega`, and a lag subtracts as much. Unless a form is given, the form is a lead for p above .3, a lag for p
//! below -.3, and otherwise a gain. Time constants are limited to the range found in people.
//!
//! **Gain**: the gain gives the largest crossover frequency up to 5 rad/s with a phase margin of at least 40 deg (the
//! middle of the range of 20 to 65 deg in the same source). If the delay does not allow this margin, the gain gives the
//! crossover frequency with the largest margin, which must be at least 15 deg.
//!
//! **Neuromuscular system and delay**: the medians of [`OperatorPrior::population`]; for people who differ from the
//! typical person, one parameter is a spread above or below its median. The gain is adapted separately for each of
//! these people.

use hoid_ident::family::OperatorPrior;
use hoid_model::{
    ContinuousTransferFunction, FamilyOperator, FamilyState, Form, ModelError,
    family_scenario::{LONGEST_LEAD_S, SLOPE_FREQUENCY_RAD_S, slope, time_constant},
    operator_family::Coordinate,
};

use super::{DesignError, design_people::NamedState};

/// Largest slope to be added for which the form has neither lead nor lag.
const MAX_GAIN_FORM_SLOPE: f64 = 0.3;
/// Longest lag, in s.
const MAX_LAG_S: f64 = 3.0;
/// Desired and smallest phase margin, in deg.
const TARGET_MARGIN_DEG: f64 = 40.0;
const MIN_MARGIN_DEG: f64 = 15.0;
/// Range of the crossover frequencies to try, in rad/s, and their number.
const CROSSOVER_RANGE_RAD_S: (f64, f64) = (0.3, 5.0);
const TRIAL_COUNT: usize = 300;

/// Neuromuscular system and delay of a person.
#[derive(Debug, Clone, Copy, PartialEq)]
struct NeuromuscularValues {
    omega_nm_rad_s: f64,
    zeta_nm: f64,
    tau_e_s: f64,
}

impl NeuromuscularValues {
    /// Returns the medians of the population, except for one parameter with a given value.
    fn with_replacement(other: Option<(&str, f64)>) -> Self {
        let prior = OperatorPrior::population();
        let of = |name: &str| match other {
            Some((changed, value)) if changed == name => value,
            _ => {
                let entry = prior.entries().iter().find(|e| e.parameter == name);
                entry.map_or(f64::NAN, |e| e.centre)
            }
        };
        Self {
            omega_nm_rad_s: of("omega_nm"),
            zeta_nm: of("zeta_nm"),
            tau_e_s: of("tau_e"),
        }
    }
}

/// Returns the typical person with this element, and people who differ from them in one parameter.
pub(super) fn population(
    element: &ContinuousTransferFunction,
    form: Option<Form>,
) -> Result<(NamedState, Vec<NamedState>), DesignError> {
    let form = form.unwrap_or_else(|| form_of(element));
    let named = |name: String, muscles: NeuromuscularValues| {
        adapted_state(element, form, muscles).map(|state| NamedState { name, state })
    };
    let typical = named(
        "typical of the population".to_owned(),
        NeuromuscularValues::with_replacement(None),
    )?;
    let mut others = Vec::new();
    for entry in OperatorPrior::population().entries() {
        for sign in [-1.0, 1.0] {
            let value = entry.centre * (sign * entry.spread).exp();
            let name = format!("{} = {value:.2}", entry.parameter);
            // A person who cannot control this element, for example because of a long delay, is omitted.
            others.extend(
                named(
                    name,
                    NeuromuscularValues::with_replacement(Some((&entry.parameter, value))),
                )
                .ok(),
            );
        }
    }
    Ok((typical, others))
}

/// Returns the form that people typically adopt with an element.
fn form_of(element: &ContinuousTransferFunction) -> Form {
    match -1.0 - slope(element) {
        added if added > MAX_GAIN_FORM_SLOPE => Form::Lead,
        added if added < -MAX_GAIN_FORM_SLOPE => Form::Lag,
        _ => Form::Gain,
    }
}

fn adapted_state(
    element: &ContinuousTransferFunction,
    form: Form,
    muscles: NeuromuscularValues,
) -> Result<FamilyState, DesignError> {
    let operator = unit_operator(element, form, muscles)?;
    let (low, high) = CROSSOVER_RANGE_RAD_S;
    let crossover = |k: usize| high * (low / high).powf(k as f64 / (TRIAL_COUNT - 1) as f64);
    let margin = |omega: f64| {
        (-(operator.response(omega) * element.response(omega)))
            .arg()
            .to_degrees()
    };
    let all: Vec<(f64, f64)> = (0..TRIAL_COUNT).map(|k| (crossover(k), margin(crossover(k)))).collect();
    let mut falling: Vec<(f64, f64)> = all
        .iter()
        .copied()
        .filter(|(_, m)| *m < TARGET_MARGIN_DEG && *m >= MIN_MARGIN_DEG)
        .collect();
    falling.sort_by(|a, b| b.1.total_cmp(&a.1));
    let wide = all.into_iter().filter(|(_, m)| *m >= TARGET_MARGIN_DEG);
    for (omega, _) in wide.chain(falling) {
        let state = with_crossover(&operator, element, omega)?;
        let found = state.margins().ok().and_then(|m| m.crossover_rad_s);
        if found.is_some_and(|found| (found / omega - 1.0).abs() < 1e-3) {
            return Ok(state);
        }
    }
    Err(DesignError::NotControlled {
        element: element.to_string(),
        form,
    })
}

/// Returns the operator with a gain of one.
fn unit_operator(
    element: &ContinuousTransferFunction,
    form: Form,
    muscles: NeuromuscularValues,
) -> Result<FamilyOperator, DesignError> {
    let with_both = form.degree() > 0 && form.has_lag();
    let lag_s = match with_both {
        true => MAX_LAG_S,
        false => time_constant(slope(element) + 1.0, MAX_LAG_S),
    };
    let of_lag = if with_both {
        let x = lag_s * SLOPE_FREQUENCY_RAD_S;
        x * x / (1.0 + x * x)
    } else {
        0.0
    };
    let lead_s = time_constant(
        (of_lag - 1.0 - slope(element)) / form.degree().max(1) as f64,
        LONGEST_LEAD_S,
    );
    let value = |coordinate: &Coordinate| match coordinate {
        Coordinate::Gain => Some(1.0),
        Coordinate::Lead => Some(lead_s),
        Coordinate::LagRate => Some(1.0 / lag_s),
        Coordinate::LogOmega => Some(muscles.omega_nm_rad_s.ln()),
        Coordinate::LogZeta => Some(muscles.zeta_nm.ln()),
        Coordinate::Delay => Some(muscles.tau_e_s),
        Coordinate::Linear | Coordinate::Quadratic | Coordinate::Droop => None,
    };
    let known = !form.is_derivative();
    let coordinates: Option<Vec<f64>> = form.coordinates(true).iter().map(value).collect();
    let coordinates = coordinates
        .filter(|_| known)
        .ok_or(DesignError::NoTypicalPerson { form })?;
    Ok(FamilyOperator::new(form, true, &coordinates)?)
}

fn with_crossover(
    unit: &FamilyOperator,
    element: &ContinuousTransferFunction,
    omega: f64,
) -> Result<FamilyState, ModelError> {
    let mut coordinates = unit.coordinates().to_vec();
    coordinates[0] /= (unit.response(omega) * element.response(omega)).norm();
    Ok(FamilyState {
        operator: FamilyOperator::new(unit.form(), unit.has_neuromuscular(), &coordinates)?,
        controlled_element: element.clone(),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn typical(element: &str, form: Option<Form>) -> FamilyState {
        population(&element.parse().unwrap(), form).unwrap().0.state
    }

    #[test]
    fn typical_loop_falls_by_20_db_per_decade() {
        for (element, form) in [
            ("4", Form::Lag),
            ("4/s", Form::Gain),
            ("4/(s(s+1))", Form::Lead),
            ("90/(s(s+6))", Form::Gain),
            ("4/s^2", Form::Lead),
            ("2/(s+0.1)", Form::Gain),
        ] {
            let state = typical(element, None);
            assert_eq!(state.operator.form(), form, "{element}");
            let margins = state.margins().unwrap();
            let (omega, margin) = (margins.crossover_rad_s.unwrap(), margins.phase_margin_deg.unwrap());
            println!("{element}: {form}, crossover {omega:.2} rad/s, margin {margin:.1} deg");
            assert!(
                (1.0..=5.0).contains(&omega) && (35.0..66.0).contains(&margin),
                "{element}: {omega} {margin}"
            );
            let gain = |w: f64| {
                let h = state.operator.response(w) * state.controlled_element.response(w);
                h.norm().ln()
            };
            let found = (gain(1.05 * omega) - gain(omega / 1.05)) / (2.0 * 1.05_f64.ln());
            assert!((found + 1.0).abs() < 0.4, "{element}: slope {found}");
        }
    }

    #[test]
    fn every_form_with_time_constants_has_a_typical_person() {
        for form in [Form::Gain, Form::Lead, Form::Lead2, Form::LeadLag, Form::Lead2Lag] {
            assert_eq!(typical("4/(s(s+1))", Some(form)).operator.form(), form);
        }
        let element = "4/s".parse().unwrap();
        let error = population(&element, Some(Form::QuadraticIntegral)).unwrap_err();
        assert!(matches!(error, DesignError::NoTypicalPerson { .. }));
        let error = population(&"1/s^4".parse().unwrap(), None).unwrap_err();
        assert!(matches!(error, DesignError::NotControlled { .. }), "{error}");
    }

    #[test]
    fn people_differ_from_the_typical_one_by_one_spread() {
        let (typical, others) = population(&"4/s".parse().unwrap(), None).unwrap();
        assert_eq!(others.len(), 6);
        let slow = others.iter().find(|p| p.name == "tau_e = 0.40").unwrap();
        let crossover = |p: &NamedState| p.state.margins().unwrap().crossover_rad_s.unwrap();
        assert!(crossover(slow) < crossover(&typical));
    }
}
