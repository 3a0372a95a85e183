//! Crossover frequency and phase margin of an estimate with the controlled element of the run.
//!
//! `L(omega) = Y(omega) Y_c(j omega)`, where Y is the sampled response of the estimate. The crossover and its
//! sensitivity to `dL/L` are computed as for batch fits ([`Crossover`]); `dL/L = dY/Y`, whose covariance follows from
//! the covariance of the real and imaginary parts of the response at the crossover.
//!
//! Nothing is reported if |L| does not fall through one, or if the standard error of the crossover is more than half of
//! the crossover: the first-order error is then meaningless.

use hoid_ident::family::Crossover;
use hoid_model::{Complex64, ContinuousTransferFunction, SampleTime, uncertainty::Estimate};

use crate::response::Response;

/// Largest standard error of the crossover, relative to the crossover.
const MAX_CROSSOVER_ERROR: f64 = 0.5;

/// Crossover frequency and phase margin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpenLoop {
    /// Crossover frequency, rad/s.
    pub crossover_rad_s: Estimate,
    /// Phase margin (in deg), between -180 and 180.
    pub phase_margin_deg: Estimate,
}

/// Reason why an estimate has no crossover.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum NoCrossover {
    /// There is no estimate yet.
    NoEstimate,
    /// The gain of the open loop does not fall through one.
    NeverFalls,
    /// The standard error of the crossover is more than half of the crossover.
    NotDetermined,
}

impl NoCrossover {
    /// Returns the reason as text.
    pub fn as_text(self) -> &'static str {
        match self {
            Self::NoEstimate => "there is no estimate yet",
            Self::NeverFalls => "the gain of the open loop does not cross 1 from above between .05 and 60 rad/s",
            Self::NotDetermined => "the standard error of the crossover frequency exceeds half of its value",
        }
    }
}

impl OpenLoop {
    /// Number of values in a packed crossover and margin.
    pub(crate) const PACKED_LEN: usize = 4;

    /// Computes the crossover and phase margin of an estimate; `value` returns its response at a frequency, and `whole`
    /// the response with its covariance.
    pub(crate) fn of(
        value: impl Fn(f64) -> Option<[f64; 2]>,
        whole: impl Fn(f64) -> Option<Response>,
        element: &ContinuousTransferFunction,
        sample_time: SampleTime,
    ) -> Result<Self, NoCrossover> {
        let response = |omega: f64| {
            let [re, im] = value(omega).unwrap_or([f64::NAN; 2]);
            Complex64::new(re, im)
        };
        if !response(1.0).is_finite() {
            return Err(NoCrossover::NoEstimate);
        }
        let open_loop = |omega: f64| response(omega) * element.response(omega);
        let found = Crossover::find_lowest(open_loop, sample_time).ok_or(NoCrossover::NeverFalls)?;
        let there = whole(found.omega_rad_s).ok_or(NoCrossover::NoEstimate)?;
        let [re, im] = there.value;
        // dY/Y for a unit change in the real part of Y, and for one in the imaginary part.
        let moved =
            [Complex64::new(1.0, 0.0), Complex64::new(0.0, 1.0)].map(|d| found.shift_for(d / Complex64::new(re, im)));
        let estimate = |value: f64, of: usize| {
            let [a, b] = [moved[0][of], moved[1][of]];
            let c = &there.covariance;
            Estimate::with_variance(value, a * a * c[0][0] + 2.0 * a * b * c[0][1] + b * b * c[1][1])
        };
        let crossover_rad_s = estimate(found.omega_rad_s, 0);
        match crossover_rad_s.standard_error {
            Some(error) if error > MAX_CROSSOVER_ERROR * found.omega_rad_s => Err(NoCrossover::NotDetermined),
            _ => Ok(Self {
                crossover_rad_s,
                phase_margin_deg: estimate(found.margin_deg, 1),
            }),
        }
    }

    /// Packs the values and variances of crossover and margin, for averaging; NaN if there is no crossover.
    pub(crate) fn pack(found: Result<Self, NoCrossover>) -> [f64; Self::PACKED_LEN] {
        let Ok(found) = found else {
            return [f64::NAN; Self::PACKED_LEN];
        };
        let pair = |e: Estimate| [e.value, e.standard_error.map_or(f64::NAN, |s| s * s)];
        let ([a, b], [c, d]) = (pair(found.crossover_rad_s), pair(found.phase_margin_deg));
        [a, b, c, d]
    }

    /// Unpacks the numbers of [`OpenLoop::pack`]; `None` if there is no crossover.
    pub(crate) fn unpack(numbers: &[f64]) -> Option<Self> {
        let &[a, b, c, d] = numbers else { return None };
        a.is_finite().then_some(Self {
            crossover_rad_s: Estimate::with_variance(a, b),
            phase_margin_deg: Estimate::with_variance(c, d),
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_ident::family::{Intersample, loop_measures};
    use hoid_model::{FamilyOperator, Form, uncertainty::variance_along};

    use super::*;

    const TS: SampleTime = SampleTime::AT_100_HZ;

    fn held_response(operator: &FamilyOperator, omega: f64) -> Complex64 {
        let half = 0.5 * omega * TS.s();
        operator.response(omega) * Complex64::from_polar((half.sin() / half).powi(2), -half)
    }

    /// Crossover and margin are the same as for a batch fit of the family with the same operator and covariance.
    #[test]
    fn loop_measures_match_a_batch_fit() {
        let element = ContinuousTransferFunction::new(&[90.0], &[1.0, 6.0, 0.0]).unwrap();
        let operator = FamilyOperator::new(Form::LeadLag, true, &[0.4, 0.5, 0.25, 2.4, -1.4, 0.15]).unwrap();
        let sizes = [0.02, 0.03, 0.02, 0.05, 0.1, 0.01];
        let covariance: Vec<f64> = (0..36)
            .map(|k| sizes[k / 6] * sizes[k % 6] * if k / 6 == k % 6 { 1.0 } else { 0.3 })
            .collect();
        let expected = loop_measures(&operator, Some(&covariance), &element, (TS, Intersample::Auto)).unwrap();
        let parts = |h: Complex64| [h.re, h.im];
        let whole = |omega: f64| {
            let found = operator.response_and_gradient(omega);
            let hold = held_response(&operator, omega) / found.value;
            let rows = [0, 1].map(|part| -> Vec<f64> {
                let along = found.gradient.iter().map(|g| parts(g * hold)[part]);
                along.collect()
            });
            let sum: Vec<f64> = rows[0].iter().zip(&rows[1]).map(|(a, b)| a + b).collect();
            let [a, b, both] = [&rows[0], &rows[1], &sum].map(|row| variance_along(row, &covariance));
            let cross = 0.5 * (both - a - b);
            Some(Response {
                value: parts(held_response(&operator, omega)),
                covariance: [[a, cross], [cross, b]],
            })
        };
        let value = |omega: f64| Some(parts(held_response(&operator, omega)));
        let found = OpenLoop::of(value, whole, &element, TS).unwrap();
        for (found, expected) in [
            (found.crossover_rad_s, expected.crossover_rad_s),
            (found.phase_margin_deg, expected.phase_margin_deg),
        ] {
            assert!(
                (found.value - expected.value).abs() < 1e-10 * expected.value.abs(),
                "{} {}",
                found.value,
                expected.value
            );
            let (a, b) = (found.standard_error.unwrap(), expected.standard_error.unwrap());
            assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
        }
        assert_eq!(
            OpenLoop::unpack(&OpenLoop::pack(Ok(found)))
                .unwrap()
                .crossover_rad_s
                .value,
            found.crossover_rad_s.value
        );
    }

    #[test]
    fn missing_crossover_has_a_reason() {
        let element = ContinuousTransferFunction::new(&[1.0], &[1.0, 0.0]).unwrap();
        let with = |gain: f64, variance: f64| {
            let whole = |_: f64| {
                Some(Response {
                    value: [gain, 0.0],
                    covariance: [[variance, 0.0], [0.0, variance]],
                })
            };
            OpenLoop::of(|_| Some([gain, 0.0]), whole, &element, TS)
        };
        // With a gain and an integrator, the crossover in rad/s equals the gain, and so does its error.
        let found = with(2.0, 0.01).unwrap();
        assert!((found.crossover_rad_s.value - 2.0).abs() < 1e-9);
        assert!((found.crossover_rad_s.standard_error.unwrap() - 0.1).abs() < 1e-6);
        assert!((found.phase_margin_deg.value - 90.0).abs() < 1e-6);
        assert_eq!(with(2.0, 1.1), Err(NoCrossover::NotDetermined));
        assert_eq!(with(0.01, 0.0), Err(NoCrossover::NeverFalls));
        assert_eq!(
            OpenLoop::of(|_| None, |_| None, &element, TS),
            Err(NoCrossover::NoEstimate)
        );
        assert!(OpenLoop::unpack(&OpenLoop::pack(Err(NoCrossover::NeverFalls))).is_none());
        // Without a covariance, the crossover has a value but no standard error.
        assert_eq!(with(2.0, f64::NAN).unwrap().crossover_rad_s.standard_error, None);
    }
}
