//! Search ranges of the coordinates of an operator.

use hoid_model::{
    FamilyOperator, SampleTime,
    operator_family::{Coordinate, Form},
};

/// Longest lead time, s. In records of people a longer lead cannot be distinguished from a pure derivative.
const LONGEST_LEAD_S: f64 = 30.0;
/// Largest `c_1` and `c_2` of the quadratic form: the sum and the product of two longest leads.
const LARGEST_LINEAR_S: f64 = 2.0 * LONGEST_LEAD_S;
const LARGEST_QUADRATIC_S2: f64 = LONGEST_LEAD_S * LONGEST_LEAD_S;
/// Bounds of `1/T_I`, 1/s: a lag at the lower bound is practically an integration, a lag at the upper bound has hardly
/// any effect.
pub(super) const LAG_RATE_LIMITS: (f64, f64) = (1e-3, 30.0);
/// Largest droop frequency, rad/s.
const MAX_DROOP_RAD_S: f64 = 10.0;
/// Bounds of the damping ratio: almost no damping at the lower bound, two separate lags at the upper bound.
const DAMPING_LIMITS: (f64, f64) = (0.02, 5.0);
/// Lowest neuromuscular frequency, rad/s; a lower frequency would not describe a muscle.
const MIN_NEUROMUSCULAR_RAD_S: f64 = 2.0;
/// Largest omega_nm relative to the Nyquist frequency pi/Ts.
const MAX_NYQUIST_SHARE: f64 = 0.95;

/// Returns the lower and upper bound of each coordinate.
pub(crate) fn limits(
    form: Form,
    neuromuscular: bool,
    delay_range_s: (f64, f64),
    sample_time: SampleTime,
) -> Vec<(f64, f64)> {
    let highest = MAX_NYQUIST_SHARE * sample_time.nyquist_rad_s();
    let of = |coordinate: &Coordinate| match coordinate {
        Coordinate::Gain => (f64::NEG_INFINITY, f64::INFINITY),
        Coordinate::Lead => (0.0, LONGEST_LEAD_S),
        // Without a bound, the search for an integration that the operator does not have would follow its gain to zero.
        Coordinate::Linear => (-LARGEST_LINEAR_S, LARGEST_LINEAR_S),
        Coordinate::Quadratic => (-LARGEST_QUADRATIC_S2, LARGEST_QUADRATIC_S2),
        Coordinate::LagRate => LAG_RATE_LIMITS,
        Coordinate::Droop => (0.0, MAX_DROOP_RAD_S),
        Coordinate::LogOmega => (MIN_NEUROMUSCULAR_RAD_S.min(0.5 * highest).ln(), highest.ln()),
        Coordinate::LogZeta => (DAMPING_LIMITS.0.ln(), DAMPING_LIMITS.1.ln()),
        Coordinate::Delay => delay_range_s,
    };
    form.coordinates(neuromuscular).iter().map(of).collect()
}

/// True if a zero of an integration is at its bound, so that the integration has no visible effect: its gain is the
/// smallest that the bounds allow.
pub(super) fn integration_vanishes(operator: &FamilyOperator) -> bool {
    let coordinates = operator.form().coordinates(false);
    coordinates
        .iter()
        .zip(operator.coordinates())
        .any(|(coordinate, x)| match coordinate {
            Coordinate::Linear => x.abs() >= LARGEST_LINEAR_S,
            Coordinate::Quadratic => x.abs() >= LARGEST_QUADRATIC_S2,
            _ => false,
        })
}

/// Exchanges the two zeros of a lead with a droop if the lead is slower than the droop, and returns whether it did.
///
/// `K (1 + T_L s)(1 + alpha/s)` does not change if K, T_L and alpha are replaced by `K T_L alpha`, `1/alpha` and
/// `1/T_L`. The droop is the zero at the lower frequency: `T_L alpha <= 1`.
pub(super) fn order_zeros(form: Form, coordinates: &mut [f64]) -> bool {
    let [gain, lead, droop, ..] = coordinates else {
        return false;
    };
    let product = *lead * *droop;
    if form != Form::LeadDroop || product.is_nan() || product <= 1.0 {
        return false;
    }
    (*gain, *lead, *droop) = (*gain * product, 1.0 / *droop, 1.0 / *lead);
    true
}

/// Density of the grid of starting points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum GridDensity {
    /// Grid for people, whose neuromuscular system is kept near the default by the prior.
    Default,
    /// Grid for a response that is known exactly and may belong to any operator.
    Dense,
}

/// Returns the starting values of a coordinate.
fn start_values(coordinate: Coordinate, (low, high): (f64, f64), grid: GridDensity) -> Vec<f64> {
    let values: &[f64] = match coordinate {
        // The gain is computed from the other coordinates.
        Coordinate::Gain => &[1.0],
        Coordinate::Lead => &[0.15, 0.5, 1.2, 3.0],
        Coordinate::LagRate => &[0.03, 0.2, 1.0],
        Coordinate::Linear => &[0.5, 1.5],
        Coordinate::Quadratic => &[0.05, 0.4],
        Coordinate::Droop => &[0.1, 0.6],
        Coordinate::LogOmega if grid == GridDensity::Dense => &[1.9, 2.4, 2.9],
        Coordinate::LogOmega => &[2.35],
        Coordinate::LogZeta if grid == GridDensity::Dense => &[-2.0, -1.2, -0.4],
        Coordinate::LogZeta => &[-1.2],
        Coordinate::Delay => {
            let steps = if grid == GridDensity::Dense { 8 } else { 4 };
            return (0..=steps)
                .map(|i| low + (high - low) * (i as f64 + 0.5) / (steps as f64 + 1.0))
                .map(|tau| tau.min(high))
                .collect();
        }
    };
    values.iter().map(|v| v.clamp(low, high)).collect()
}

/// Returns all combinations of the starting values for the coordinates of a form.
pub(super) fn start_grid(
    form: Form,
    neuromuscular: bool,
    limits: &[(f64, f64)],
    density: GridDensity,
) -> Vec<Vec<f64>> {
    let mut grid: Vec<Vec<f64>> = vec![Vec::new()];
    for (coordinate, bounds) in form.coordinates(neuromuscular).into_iter().zip(limits) {
        let values = start_values(coordinate, *bounds, density);
        grid = grid
            .into_iter()
            .flat_map(|head| {
                values.iter().map(move |v| {
                    let mut next = head.clone();
                    next.push(*v);
                    next
                })
            })
            .collect();
    }
    grid
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ordered_zeros_leave_the_response_unchanged() {
        let exchanged = [0.02, 2.5, 1.6, 2.4, -1.2, 0.2];
        let mut ordered = exchanged;
        assert!(order_zeros(Form::LeadDroop, &mut ordered));
        assert!((ordered[1] - 0.625).abs() < 1e-12 && (ordered[2] - 0.4).abs() < 1e-12);
        let operator = |x: &[f64]| FamilyOperator::new(Form::LeadDroop, true, x).unwrap();
        for omega in [0.1, 1.0, 9.0] {
            let (a, b) = (operator(&exchanged).response(omega), operator(&ordered).response(omega));
            assert!((a / b - 1.0).norm() < 1e-12, "{a} {b}");
        }
        assert!(!order_zeros(Form::LeadDroop, &mut ordered));
        assert!(!order_zeros(Form::Lead2Lag, &mut [0.02, 2.5, 1.6, 2.4, -1.2, 0.2]));
    }

    #[test]
    fn starts_lie_within_the_limits() {
        for form in Form::ALL {
            for neuromuscular in [true, false] {
                let limits = limits(form, neuromuscular, (0.05, 0.6), SampleTime::AT_100_HZ);
                let grid = start_grid(form, neuromuscular, &limits, GridDensity::Default);
                assert!(!grid.is_empty());
                for start in grid {
                    assert_eq!(start.len(), limits.len());
                    assert!(start.iter().zip(&limits).all(|(x, (low, high))| low <= x && x <= high));
                }
            }
        }
    }
}
