//! The open loop of an operator and its controlled element: all crossings with their errors, and the stability of the
//! closed loop.
//!
//! The open loop is `L = Y Y_c`, where Y is the sampled response of the estimate and Y_c is exact. The errors follow
//! from the covariance of the real and imaginary parts of `dL/L = dY/Y`. A crossing of `|L| = 1` and the phase at this
//! crossing change as in [`super::open_loop`]. A crossing of the negative real axis changes by
//! `d omega = -Im(dL/L)/Im(d ln L/d omega)`, so the gain margin changes by
//! `-(20/ln 10) (Re(dL/L) + Re(d ln L/d omega) d omega)` dB.
//!
//! An unstable closed loop can become stable only if L passes through -1 at some frequency. The squared distance of L
//! from -1, in standard errors, is the minimum of `(1 + L)' C_L^-1 (1 + L)` over frequency. If the true loop passes
//! through -1, the squared distance at that frequency has a chi-squared distribution with two degrees of freedom, and
//! the minimum does not exceed it.

use std::f64::consts::LN_10;

use hoid_model::{
    Complex64, ContinuousTransferFunction, Finding, SampleTime,
    margins::{Crossing, crossings, unstable_poles},
    uncertainty::Estimate,
};

use super::{
    known_response::KnownResponse,
    open_loop::{Crossover, unwrapped_margin_deg},
};

/// Frequency range in which crossings are searched for, rad/s.
const SEARCH_RANGE_RAD_S: (f64, f64) = (0.05, 60.0);
/// Largest plausible phase margin of a person, deg.
const LARGEST_MARGIN_DEG: f64 = 120.0;
/// 95 % quantile of chi-squared with two degrees of freedom.
const CHI_SQUARED_QUANTILE: f64 = 5.991_464_547_107_979;
/// Number of frequencies at which the distance from -1 is computed.
const POINT_COUNT: usize = 400;

/// All crossings of an open loop, and the stability of the closed loop.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopShape {
    /// All frequencies in rad/s at which `|L| = 1`, in ascending order, each with the phase margin in deg.
    pub crossovers: Vec<(Estimate, Estimate)>,
    /// Frequency in rad/s at which L crosses the negative real axis closest to -1, with the gain margin in dB; `None`
    /// if L does not cross this axis.
    pub gain_margin: Option<(Estimate, Estimate)>,
    /// Number of closed-loop poles in the right half plane; `None` if it cannot be determined.
    pub unstable_poles: Option<usize>,
    /// Smallest chi-squared of a change in the operator that brings the loop to the stability limit; `None` without a
    /// covariance or for a loop that is not unstable.
    distance: Option<f64>,
    /// Phase margin in deg at the lowest crossover, with the phase unwrapped from low frequencies.
    followed_deg: Option<f64>,
}

impl LoopShape {
    /// Computes the open loop of an operator and a controlled element: crossings, margins and stability.
    pub fn of(
        operator: impl Fn(f64) -> KnownResponse,
        element: &ContinuousTransferFunction,
        sample_time: SampleTime,
    ) -> Self {
        let highest = SEARCH_RANGE_RAD_S.1.min(0.9 * sample_time.nyquist_rad_s());
        let open_loop = |omega: f64| operator(omega).value * element.response(omega);
        let found = crossings(open_loop, (SEARCH_RANGE_RAD_S.0.min(0.5 * highest), highest));
        let with_error = |value: f64, omega: f64, along: [f64; 2]| operator(omega).estimate(value, along);
        let crossover = |c: &Crossing| {
            let there = Crossover::at(open_loop, c.omega_rad_s);
            let [re, im] = [Complex64::ONE, Complex64::I].map(|d| there.shift_for(d));
            let omega = c.omega_rad_s;
            (
                with_error(omega, omega, [re[0], im[0]]),
                with_error(c.margin, omega, [re[1], im[1]]),
            )
        };
        let nearest = (found.phase.iter()).min_by(|a, b| a.margin.abs().total_cmp(&b.margin.abs()));
        let gain_margin = nearest.map(|c| {
            let omega = c.omega_rad_s;
            let slope = Crossover::at(open_loop, omega).slope();
            let by_im = -1.0 / slope.im;
            let db = -20.0 / LN_10;
            (
                with_error(omega, omega, [0.0, by_im]),
                with_error(c.margin, omega, [db, db * slope.re * by_im]),
            )
        });
        let crossovers: Vec<_> = found.gain.iter().map(crossover).collect();
        let unstable = unstable_poles(|omega| operator(omega).value, element, highest);
        let first = found.gain.first().map(|c| c.omega_rad_s);
        Self {
            followed_deg: first.map(|omega| unwrapped_margin_deg(open_loop, omega)),
            distance: (unstable > Some(0))
                .then(|| distance_from_stability_limit(&operator, element, highest))
                .flatten(),
            crossovers,
            gain_margin,
            unstable_poles: unstable,
        }
    }

    /// Returns the phase margin in deg that is closest to zero, preceded by its crossover frequency in rad/s.
    pub fn smallest_margin(&self) -> Option<(Estimate, Estimate)> {
        let nearest = |held: &(Estimate, Estimate), next: &(Estimate, Estimate)| {
            held.1.value.abs().total_cmp(&next.1.value.abs())
        };
        self.crossovers.iter().copied().min_by(nearest)
    }

    /// True if the closed loop is stable; `None` if its stability cannot be determined.
    pub fn is_stable(&self) -> Option<bool> {
        self.unstable_poles.map(|count| count == 0)
    }

    /// Returns evidence against the operator; `None` if there is no such evidence. A record that remains bounded must
    /// come from a stable loop, which has a crossover and a positive phase margin, and a person's phase margin is at
    /// most 120 deg. `reach_deg` is half the width of the 95 % interval of the margin at the lowest crossover.
    pub fn finding(&self, reach_deg: f64) -> Option<Finding> {
        let remedy = "check the controlled element, the signs and units of e and u, and the time shift between e and u";
        let (Some((crossover, _)), Some(margin)) = (self.crossovers.first(), self.followed_deg) else {
            return Some(Finding::warning(
                "no-crossover",
                format!("with this controlled element, the loop gain does not cross 1 from above: {remedy}"),
            ));
        };
        if margin + reach_deg <= 0.0 || margin > LARGEST_MARGIN_DEG {
            return Some(Finding::warning(
                "unstable-loop",
                format!(
                    "the loop with this controlled element has a phase margin of {margin:.0} deg at {:.1} rad/s, \
                     which is impossible in a stable loop with a person: {remedy}",
                    crossover.value
                ),
            ));
        }
        if self.is_stable() != Some(false) {
            return None;
        }
        let at = self.as_text();
        Some(
            if self.distance.is_some_and(|distance| distance < CHI_SQUARED_QUANTILE) {
                Finding::note(
                    "unstable-loop",
                    format!(
                        "the loop with this controlled element is not stable at the estimates ({at}), but may be stable \
                     within their errors"
                    ),
                )
            } else {
                Finding::warning(
                    "unstable-loop",
                    format!(
                        "the loop with this controlled element is not stable ({at}), but a record of an unstable loop \
                     would not remain bounded: {remedy}"
                    ),
                )
            },
        )
    }

    /// Formats every crossover with its phase margin.
    fn as_text(&self) -> String {
        let each = self.crossovers.iter();
        let each =
            each.map(|(omega, margin)| format!("{:.1} rad/s, phase margin {:.0} deg", omega.value, margin.value));
        format!("gain one at {}", each.collect::<Vec<_>>().join("; "))
    }
}

/// Returns the smallest chi-squared of a change in the operator for which L passes through -1.
fn distance_from_stability_limit(
    operator: &impl Fn(f64) -> KnownResponse,
    element: &ContinuousTransferFunction,
    highest: f64,
) -> Option<f64> {
    let at =
        |i: usize| SEARCH_RANGE_RAD_S.0 * (highest / SEARCH_RANGE_RAD_S.0).powf(i as f64 / (POINT_COUNT as f64 - 1.0));
    let distances = (0..POINT_COUNT).filter_map(|i| {
        let omega = at(i);
        let known = operator(omega);
        let [[a, b], [_, c]] = known.relative?;
        // Relative change in Y that moves L to -1, except for its sign: (1 + L)/L.
        let open_loop = known.value * element.response(omega);
        let d = (Complex64::new(1.0, 0.0) + open_loop) / open_loop;
        // For a single parameter the covariance has rank one; the increased diagonal makes it regular.
        let (a, c) = (a + 1e-9 * (a + c), c + 1e-9 * (a + c));
        let distance = (c * d.re * d.re - 2.0 * b * d.re * d.im + a * d.im * d.im) / (a * c - b * b);
        distance.is_finite().then_some(distance)
    });
    distances.reduce(f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The element 2.5/s with a gain and a neuromuscular resonance at 9 rad/s: |L| is one at three frequencies.
    fn resonant_loop(omega: f64) -> Complex64 {
        let s = Complex64::new(0.0, omega);
        Complex64::from_polar(1.0, -0.15 * omega) * 81.0 / (s * s + s + 81.0)
    }

    fn shape(of: impl Fn(f64) -> Complex64, variance: Option<f64>) -> LoopShape {
        let element = ContinuousTransferFunction::new(&[2.5], &[1.0, 0.0]).unwrap();
        let known = |omega: f64| KnownResponse {
            value: of(omega),
            relative: variance.map(|v| [[v, 0.0], [0.0, v]]),
        };
        LoopShape::of(known, &element, SampleTime::AT_100_HZ)
    }

    #[test]
    fn loop_with_three_crossovers_is_unstable() {
        let found = shape(resonant_loop, Some(1e-4));
        assert_eq!((found.crossovers.len(), found.unstable_poles), (3, Some(2)));
        let [low, middle, high] = [0, 1, 2].map(|k| found.crossovers[k]);
        assert!(
            low.1.value > 60.0 && high.1.value < 0.0 && middle.0.value > low.0.value,
            "{found:?}"
        );
        assert!(found.gain_margin.unwrap().1.value < 0.0);
        let doubt = found.finding(1.0).unwrap();
        assert_eq!(
            (doubt.kind, doubt.severity),
            ("unstable-loop", hoid_model::Severity::Doubt)
        );
        assert!(
            doubt.message.contains("is not stable (gain one at"),
            "{}",
            doubt.message
        );
        // If the errors are large, the loop may be stable.
        let note = shape(resonant_loop, Some(0.3)).finding(1.0).unwrap();
        assert_eq!(note.severity, hoid_model::Severity::Note);
        // Without standard errors the estimates alone decide.
        assert_eq!(
            shape(resonant_loop, None).finding(1.0).unwrap().severity,
            hoid_model::Severity::Doubt
        );
    }

    #[test]
    fn errors_match_finite_differences() {
        let l = |gain: f64, turn: f64| move |w: f64| Complex64::from_polar(gain, turn - 0.15 * w);
        let found = shape(l(1.0, 0.0), Some(1e-6));
        let moved = |gain: f64, turn: f64| shape(l(gain, turn), None);
        let h = 1e-5;
        let ends = [
            (moved(1.0 + h, 0.0), moved(1.0 - h, 0.0)),
            (moved(1.0, h), moved(1.0, -h)),
        ];
        let expected = |of: fn(&LoopShape) -> f64| {
            let slopes = (ends.iter()).map(|(up, down)| (of(up) - of(down)) / (2.0 * h));
            1e-3 * slopes.map(|s| s * s).sum::<f64>().sqrt()
        };
        let ((omega, margin), (at, gain)) = (found.crossovers[0], found.gain_margin.unwrap());
        for (estimate, expected) in [
            (omega, expected(|f| f.crossovers[0].0.value)),
            (margin, expected(|f| f.crossovers[0].1.value)),
            (at, expected(|f| f.gain_margin.unwrap().0.value)),
            (gain, expected(|f| f.gain_margin.unwrap().1.value)),
        ] {
            let error = estimate.standard_error.unwrap();
            assert!((error / expected - 1.0).abs() < 1e-5, "{error} {expected}");
        }
        assert_eq!((found.is_stable(), found.finding(0.1)), (Some(true), None));
        assert_eq!(found.smallest_margin(), Some((omega, margin)));
    }

    #[test]
    fn missing_crossover_and_reversed_sign_are_reported() {
        for of in [1e-6, f64::NAN] {
            let found = shape(|_| Complex64::new(of, 0.0), Some(1e-6));
            assert_eq!(found.finding(0.0).unwrap().kind, "no-crossover");
            assert_eq!(found.gain_margin, None);
        }
        // The loop has the wrong sign.
        let found = shape(|w| Complex64::from_polar(-1.0, -0.15 * w), Some(1e-6));
        assert_eq!(found.finding(1.0).unwrap().kind, "unstable-loop");
    }
}
