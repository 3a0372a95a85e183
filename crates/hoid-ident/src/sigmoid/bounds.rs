//! Search ranges for the parameters of a change.

use std::collections::BTreeMap;

use hoid_model::{Form, SampleTime, operator_family::Coordinate};

use super::layout::{Layout, ThetaElement};
use crate::{Constraint, IdentError, family::coordinates};

/// Bounds of zeta_nm: almost no damping at the lower bound, two effectively independent poles at the upper bound.
const ZETA_LIMITS: (f64, f64) = (1e-4, 100.0);
/// Admissible range of T_I, s: a shorter lag is equivalent to no lag, a longer lag to an integration.
const LAG_LIMITS_S: (f64, f64) = (1e-3, 1e6);
/// Largest omega_nm as a share of pi/Ts.
const MAX_NYQUIST_SHARE: f64 = 0.999;
/// Share of the time span at each end in which t_M is not searched for by default: so short a part of a record does not
/// determine two gains.
const END_SHARE: f64 = 0.05;
/// Largest default rate times the sample time: the change from 10 to 90 % takes about two samples (2 ln 9 = 4.4). A
/// faster change cannot be distinguished from this one, and its likelihood would be a staircase in t_M with a step for
/// each sample (at this rate the slope varies by 2 % with the position of t_M between two samples, at twice the rate by
/// 50 %).
pub(crate) const MAX_DEFAULT_RATE_TIMES_TS: f64 = 2.0;
/// Largest admissible rate times the sample time.
const MAX_RATE_TIMES_TS: f64 = 10.0;
/// Smallest rate times the time span: the change from 8 to 92 % fills the span (2 ln 12 = 5.0), so the change can
/// hardly be distinguished from a line.
const MIN_RATE_TIMES_SPAN: f64 = 5.0;

/// Quantities that determine the bounds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BoundInputs {
    pub ts_s: f64,
    /// Time span common to all records, s.
    pub span_s: (f64, f64),
    pub delay_range_s: (f64, f64),
}

/// Returns the bounds of the elements of theta (ln G and 1/T_I, not G and T_I).
///
/// # Errors
/// [`IdentError::UnknownParameter`] for a constraint on an unknown name, [`IdentError::BadOption`] for an invalid
/// constraint.
pub(crate) fn limits(
    layout: &Layout,
    frame: &BoundInputs,
    constraints: &BTreeMap<String, Constraint>,
) -> Result<Vec<(f64, f64)>, IdentError> {
    let names = layout.names();
    if let Some(name) = constraints.keys().find(|name| !names.contains(name)) {
        return Err(IdentError::UnknownParameter {
            name: name.clone(),
            available: names.join(", "),
        });
    }
    let mut result = Vec::with_capacity(names.len());
    for (index, (name, element)) in names.iter().zip(layout.elements()).enumerate() {
        let (widest, default) = ranges(layout, frame, element)?;
        let asked = constraints.get(name).copied();
        let (low, high) = asked.map_or(default, Constraint::limits);
        let within = (low.max(widest.0), high.min(widest.1));
        let moved = low == high && within != (low, high);
        if asked.is_some_and(|c| !c.is_valid()) || within.0 > within.1 || moved {
            return Err(IdentError::BadOption {
                option: format!("the constraint on {name}"),
                found: format!("{low} to {high}"),
                expected: format!("a value or a range within {:.6} to {:.6}", widest.0, widest.1),
            });
        }
        let ends = [within.0, within.1].map(|end| layout.theta_from_user_value(index, end));
        result.push((ends[0].min(ends[1]), ends[0].max(ends[1])));
    }
    Ok(result)
}

type Range = (f64, f64);

/// Returns the admissible range of a parameter and its default search range, in the units in which users give it.
fn ranges(layout: &Layout, frame: &BoundInputs, element: ThetaElement) -> Result<(Range, Range), IdentError> {
    let (from, to) = frame.span_s;
    let span = to - from;
    let sample_time = SampleTime::new(frame.ts_s)?;
    // Search range of a coordinate in a fit of the operator family without a change.
    let of_family = |coordinate: Coordinate| {
        let all = coordinates::limits(layout.form, layout.neuromuscular, frame.delay_range_s, sample_time);
        let index = layout.coordinates().iter().position(|c| *c == coordinate);
        index.map(|i| all[i])
    };
    let known = layout.form == Form::Lead;
    let all = (f64::NEG_INFINITY, f64::INFINITY);
    Ok(match element {
        ThetaElement::Midpoint => ((from, to), (from + END_SHARE * span, to - END_SHARE * span)),
        ThetaElement::LogRate => {
            let slowest = (MIN_RATE_TIMES_SPAN / span).min(MAX_DEFAULT_RATE_TIMES_TS / frame.ts_s);
            (
                (slowest, MAX_RATE_TIMES_TS / frame.ts_s),
                (slowest, MAX_DEFAULT_RATE_TIMES_TS / frame.ts_s),
            )
        }
        ThetaElement::Constant(Coordinate::LagRate) => {
            let (low, high) = of_family(Coordinate::LagRate).unwrap_or(all);
            (LAG_LIMITS_S, (1.0 / high, 1.0 / low))
        }
        ThetaElement::Constant(coordinate @ (Coordinate::LogOmega | Coordinate::LogZeta)) => {
            let widest = if coordinate == Coordinate::LogOmega {
                (1e-3, MAX_NYQUIST_SHARE * std::f64::consts::PI / frame.ts_s)
            } else {
                ZETA_LIMITS
            };
            let of_family = of_family(coordinate).map(|(low, high)| (low.exp(), high.exp()));
            (widest, if known { widest } else { of_family.unwrap_or(widest) })
        }
        ThetaElement::Constant(Coordinate::Delay) => (frame.delay_range_s, frame.delay_range_s),
        ThetaElement::Varying(..) | ThetaElement::Constant(_) | ThetaElement::Noise(_) => (all, all),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> BoundInputs {
        BoundInputs {
            ts_s: 0.01,
            span_s: (0.0, 80.0),
            delay_range_s: (0.05, 0.6),
        }
    }

    #[test]
    fn limits_are_checked_and_invalid_constraints_refused() {
        let none = BTreeMap::new();
        let layout = Layout::new(Form::Lead, true, 1);
        let default = limits(&layout, &frame(), &none).unwrap();
        assert_eq!(default.len(), 10);
        assert_eq!(default[layout.midpoint], (4.0, 76.0));
        assert_eq!(default[layout.delay], (0.05, 0.6));
        assert!((default[layout.log_rate].1.exp() - 200.0).abs() < 1e-9);
        let with = |name: &str, c: Constraint| limits(&layout, &frame(), &BTreeMap::from([(name.to_owned(), c)]));
        assert_eq!(
            with("t_M", Constraint::Fixed(79.0)).unwrap()[layout.midpoint],
            (79.0, 79.0)
        );
        assert_eq!(
            with("G", Constraint::Fixed(0.5)).unwrap()[layout.log_rate],
            (0.5f64.ln(), 0.5f64.ln())
        );
        for (name, c) in [
            ("t_M", Constraint::Fixed(81.0)),
            ("G", Constraint::Fixed(-1.0)),
            ("G", Constraint::Between(2000.0, 3000.0)),
            ("tau_e", Constraint::Fixed(0.7)),
            ("K_e1", Constraint::Fixed(f64::NAN)),
            ("zeta_nm", Constraint::Between(2.0, 1.0)),
        ] {
            assert!(matches!(with(name, c), Err(IdentError::BadOption { .. })), "{name}");
        }
        assert!(matches!(
            with("K_n", Constraint::Fixed(1.0)),
            Err(IdentError::UnknownParameter { .. })
        ));
    }

    #[test]
    fn lag_limits_follow_from_its_time_constant() {
        let layout = Layout::new(Form::LeadLag, true, 0);
        let with = |c: Constraint| limits(&layout, &frame(), &BTreeMap::from([("T_I".to_owned(), c)]));
        let index = layout.lag.unwrap();
        assert_eq!(with(Constraint::Fixed(5.0)).unwrap()[index], (0.2, 0.2));
        assert_eq!(with(Constraint::Between(2.0, 8.0)).unwrap()[index], (0.125, 0.5));
        assert!(with(Constraint::Fixed(-5.0)).is_err());
        let default = limits(&layout, &frame(), &BTreeMap::new()).unwrap();
        let (low, high) = default[index];
        assert!((low - 1e-3).abs() < 1e-15 && (high - 30.0).abs() < 1e-12);
    }
}
