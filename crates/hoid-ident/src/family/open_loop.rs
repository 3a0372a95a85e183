//! Crossover frequency and phase margin of an operator of the family with a controlled element.
//!
//! The open loop is `L(omega) = Y(j omega) Z(omega) Y_c(j omega)`, where Z represents the intersample behaviour of the
//! error. The crossover is the lowest frequency at which `|L|` falls below one, as for a describing function
//! ([`crate::frequency`]); a neuromuscular resonance may raise `|L|` above one again. The effects of the coordinates x
//! on omega_c and phi_m follow from the condition `|L| = 1`:
//!
//! `d omega_c = -(d ln|L|/dx)/(d ln|L|/d omega)`,
//! `d phi_m = d arg L/dx + (d arg L/d omega) d omega_c`.

use std::f64::consts::{FRAC_PI_3, TAU};

use hoid_model::{Complex64, ContinuousTransferFunction, FamilyOperator, SampleTime, uncertainty::Estimate};

use super::{
    clusters::quantile,
    intersample::Intersample,
    known_response::KnownResponse,
    mixture::{Component, Mixture, widen_interval},
};

/// Frequency range in which crossovers are searched for, rad/s.
const SEARCH_RANGE_RAD_S: (f64, f64) = (0.05, 60.0);
/// 97.5 % quantile of the normal distribution.
const NORMAL_QUANTILE: f64 = 1.959_963_984_540_054;
/// Number of frequencies in the scan for a crossover.
const POINT_COUNT: usize = 150;

/// Crossover and phase margin with their standard errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopMeasures {
    /// Crossover frequency omega_c, rad/s.
    pub crossover_rad_s: Estimate,
    /// 95 % interval of the crossover frequency, rad/s.
    pub crossover_interval: Option<(f64, f64)>,
    /// Phase margin phi_m, deg, between -180 and 180.
    pub phase_margin_deg: Estimate,
    /// 95 % interval of the phase margin, deg.
    pub phase_margin_interval: Option<(f64, f64)>,
    /// Derivatives of the crossover frequency and the phase margin with respect to the logarithm of the gain,
    /// `d/d ln K`.
    by_gain: [f64; 2],
    /// Standard errors of the crossover frequency and the phase margin for the person, whose gain varies from run to
    /// run.
    pub of_person: [Option<f64>; 2],
}

impl LoopMeasures {
    /// Returns the crossover and the phase margin of a sampled response with this controlled element; `None` if `|L|`
    /// does not fall below one.
    pub(super) fn of_response(
        response: impl Fn(f64) -> KnownResponse,
        element: &ContinuousTransferFunction,
        sample_time: SampleTime,
    ) -> Option<Self> {
        let open_loop = |omega: f64| response(omega).value * element.response(omega);
        let found = Crossover::find_lowest(open_loop, sample_time)?;
        let at_crossover = response(found.omega_rad_s);
        let [by_gain, by_phase] = [Complex64::ONE, Complex64::I].map(|relative| found.shift_for(relative));
        let estimate = |value: f64, of: usize| at_crossover.estimate(value, [by_gain[of], by_phase[of]]);
        let both = [estimate(found.omega_rad_s, 0), estimate(found.margin_deg, 1)];
        Some(Self::of(both, by_gain))
    }

    fn of(both: [Estimate; 2], by_gain: [f64; 2]) -> Self {
        let [crossover_rad_s, phase_margin_deg] = both;
        Self {
            crossover_rad_s,
            crossover_interval: symmetric_interval(crossover_rad_s, NORMAL_QUANTILE),
            phase_margin_deg,
            phase_margin_interval: symmetric_interval(phase_margin_deg, NORMAL_QUANTILE),
            by_gain,
            of_person: both.map(|e| e.standard_error),
        }
    }

    /// Returns the measures with intervals from Student's distribution, for standard errors that are based on this
    /// number of clusters.
    pub(super) fn with_student_intervals(self, clusters: usize) -> Self {
        Self {
            crossover_interval: symmetric_interval(self.crossover_rad_s, quantile(clusters)),
            phase_margin_interval: symmetric_interval(self.phase_margin_deg, quantile(clusters)),
            ..self
        }
    }

    /// Returns the measures with standard errors for the person, which include the relative variation `share` of the
    /// gain that the scatter of these runs does not show.
    pub(super) fn with_run_to_run(self, share: f64) -> Self {
        let both = [self.crossover_rad_s, self.phase_margin_deg];
        let wider = |k: usize| {
            let own = both[k].standard_error?;
            Some(own.hypot(share * self.by_gain[k]))
        };
        Self {
            of_person: [wider(0), wider(1)],
            ..self
        }
    }

    /// Returns the measures with the standard errors and intervals for the person instead of for these runs.
    #[must_use]
    pub fn as_of_person(self) -> Self {
        let [crossover, margin] = self.of_person;
        let (crossover_rad_s, crossover_interval) =
            widen_interval(self.crossover_rad_s, self.crossover_interval, crossover);
        let (phase_margin_deg, phase_margin_interval) =
            widen_interval(self.phase_margin_deg, self.phase_margin_interval, margin);
        Self {
            crossover_rad_s,
            crossover_interval,
            phase_margin_deg,
            phase_margin_interval,
            ..self
        }
    }

    /// Returns the measures as a weighted average over forms; `None` without forms.
    pub(super) fn average(each: &[(f64, Self)], clusters: usize) -> Option<Self> {
        let [_, _, ..] = each else {
            return each.first().map(|(_, only)| *only);
        };
        let over = |estimate: &dyn Fn(&Self) -> Estimate, interval: &dyn Fn(&Self) -> Option<(f64, f64)>| {
            let component = |(weight, of): &(f64, Self)| Component {
                weight: *weight,
                estimate: estimate(of),
                interval: interval(of),
            };
            Mixture::of(&each.iter().map(component).collect::<Vec<_>>(), clusters)
        };
        let crossover = over(&|m| m.crossover_rad_s, &|m| m.crossover_interval)?;
        let margin = over(&|m| m.phase_margin_deg, &|m| m.phase_margin_interval)?;
        let person = |k: usize| {
            let own = |m: &Self| Estimate {
                value: [m.crossover_rad_s, m.phase_margin_deg][k].value,
                standard_error: m.of_person[k],
            };
            over(&own, &|_| None).and_then(|mixture| mixture.estimate.standard_error)
        };
        Some(Self {
            crossover_rad_s: crossover.estimate,
            crossover_interval: crossover.interval,
            phase_margin_deg: margin.estimate,
            phase_margin_interval: margin.interval,
            by_gain: each[0].1.by_gain,
            of_person: [person(0), person(1)],
        })
    }
}

/// Returns the interval that extends `quantile` standard errors to each side of an estimate.
fn symmetric_interval(of: Estimate, quantile: f64) -> Option<(f64, f64)> {
    let reach = quantile * of.standard_error?;
    Some((of.value - reach, of.value + reach))
}

/// Crossover: a frequency at which the gain of an open loop is one, with the phase margin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossover {
    /// Crossover frequency, rad/s.
    pub omega_rad_s: f64,
    /// Phase margin, deg, between -180 and 180.
    pub margin_deg: f64,
    /// The derivative `d ln L/d omega` at the crossover.
    slope: Complex64,
}

impl Crossover {
    /// Returns the lowest crossover of a sampled open loop at which `|L|` falls below one; `None` if there is no such
    /// crossover.
    pub fn find_lowest(open_loop: impl Fn(f64) -> Complex64, sample_time: SampleTime) -> Option<Self> {
        let highest = SEARCH_RANGE_RAD_S.1.min(0.9 * sample_time.nyquist_rad_s());
        let at = |i: usize| {
            SEARCH_RANGE_RAD_S.0 * (highest / SEARCH_RANGE_RAD_S.0).powf(i as f64 / (POINT_COUNT as f64 - 1.0))
        };
        let gain = |omega: f64| open_loop(omega).norm_sqr().ln();
        let mut low = (at(0), gain(at(0)));
        let mut bracket = None;
        for i in 1..POINT_COUNT {
            let high = (at(i), gain(at(i)));
            if low.1 >= 0.0 && high.1 < 0.0 {
                bracket = Some((low, high));
                break;
            }
            low = high;
        }
        let (low, high) = bracket?;
        Some(Self::at(&open_loop, find_root(gain, low, high)))
    }

    /// Creates the crossover at a frequency where `|L| = 1`.
    pub(super) fn at(open_loop: impl Fn(f64) -> Complex64, omega_rad_s: f64) -> Self {
        // d ln L / d omega by a central difference; L is smooth.
        let h = 1e-5 * omega_rad_s;
        Self {
            omega_rad_s,
            margin_deg: (-open_loop(omega_rad_s)).arg().to_degrees(),
            slope: (open_loop(omega_rad_s + h) / open_loop(omega_rad_s - h)).ln() / (2.0 * h),
        }
    }

    /// Returns `d ln L/d omega` at the crossover.
    pub(super) fn slope(&self) -> Complex64 {
        self.slope
    }

    /// Returns the changes in the crossover frequency (in rad/s) and in the phase margin (in deg) for a relative change
    /// `dL/L` of the open loop.
    pub fn shift_for(&self, relative: Complex64) -> [f64; 2] {
        let by_crossover = -relative.re / self.slope.re;
        [by_crossover, (relative.im + self.slope.im * by_crossover).to_degrees()]
    }
}

/// Returns the phase margin in deg at a crossover, with the phase unwrapped from low frequencies. The margin is not
/// limited to a range of 360 deg; a negative value means an unstable loop.
pub fn unwrapped_margin_deg(open_loop: impl Fn(f64) -> Complex64, crossover_rad_s: f64) -> f64 {
    let at =
        |i: usize| SEARCH_RANGE_RAD_S.0 * (crossover_rad_s / SEARCH_RANGE_RAD_S.0).powf(i as f64 / POINT_COUNT as f64);
    let mut last = open_loop(SEARCH_RANGE_RAD_S.0.min(crossover_rad_s));
    // The phase of a double integrator starts at -180 deg, where its principal value may have either sign.
    let mut phase = last.arg();
    if phase > FRAC_PI_3 {
        phase -= TAU;
    }
    for i in 1..=POINT_COUNT {
        let next = open_loop(at(i));
        phase += (next / last).arg();
        last = next;
    }
    180.0 + phase.to_degrees()
}

/// Returns the root of a function that is positive at `low` and negative at `high`, to rounding accuracy. The method is
/// regula falsi with halving of the function value at a retained end (M. Dowell and P. Jarratt, *BIT* 11 (1971)
/// 168-174).
fn find_root(of: impl Fn(f64) -> f64, mut low: (f64, f64), mut high: (f64, f64)) -> f64 {
    let (mut last, mut was_positive) = (low.0, None);
    for _ in 0..80 {
        let chord = (high.0 * low.1 - low.0 * high.1) / (low.1 - high.1);
        let x = if chord > low.0 && chord < high.0 {
            chord
        } else {
            0.5 * (low.0 + high.0)
        };
        if (x - last).abs() < 4.0 * f64::EPSILON * x {
            break;
        }
        let y = of(x);
        let positive = y >= 0.0;
        let stays = was_positive == Some(positive);
        if positive {
            low = (x, y);
            high.1 *= if stays { 0.5 } else { 1.0 };
        } else {
            high = (x, y);
            low.1 *= if stays { 0.5 } else { 1.0 };
        }
        (last, was_positive) = (x, Some(positive));
    }
    last
}

/// Returns the crossover and the phase margin of an operator with this controlled element, given the covariance of its
/// coordinates and the sample time and intersample behaviour of the error. `None` if `|L|` does not fall below one.
pub fn loop_measures(
    operator: &FamilyOperator,
    covariance: Option<&[f64]>,
    element: &ContinuousTransferFunction,
    (sample_time, intersample): (SampleTime, Intersample),
) -> Option<LoopMeasures> {
    let known = |omega: f64| KnownResponse::of(operator, (covariance, None), (sample_time, intersample), omega);
    LoopMeasures::of_response(known, element, sample_time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hoid_model::Form;

    fn operator(x: &[f64]) -> FamilyOperator {
        FamilyOperator::new(Form::LeadLag, true, x).unwrap()
    }

    const AUTO: Intersample = Intersample::Auto;
    const X: [f64; 6] = [5.6, 0.6, 0.1, 2.7, -1.7, 0.14];

    #[test]
    fn gain_and_integrator_cross_over_at_the_gain() {
        let gain = FamilyOperator::new(Form::Gain, true, &[2.0, 100.0_f64.ln(), 0.7_f64.ln(), 0.1]).unwrap();
        let element = ContinuousTransferFunction::new(&[1.0], &[1.0, 0.0]).unwrap();
        let found = loop_measures(&gain, None, &element, (SampleTime::new(1e-4).unwrap(), AUTO)).unwrap();
        assert!((found.crossover_rad_s.value - 2.0).abs() < 1e-3);
        // The margin is 90 deg minus the phase lags of the delay and of the neuromuscular part (2 zeta/omega).
        let expected = 90.0 - (2.0_f64 * (0.1 + 0.014)).to_degrees();
        assert!((found.phase_margin_deg.value - expected).abs() < 0.1);
    }

    /// 20 e^{-.2 j omega}/(j omega) crosses over at 20 rad/s with a margin of 90 - 229 = -139 deg. A loop with a delay
    /// of .6 s crosses over at 10 rad/s with 90 - 344 = -254 deg. The principal values of both margins are within 180
    /// deg.
    #[test]
    fn margin_below_minus_180_degrees_is_unwrapped() {
        for (gain, delay) in [(20.0, 0.2), (10.0, 0.6), (2.0, 0.1)] {
            let open_loop = |w: f64| Complex64::new(0.0, -gain / w) * Complex64::from_polar(1.0, -delay * w);
            let expected = 90.0 - (gain * delay).to_degrees();
            assert!((unwrapped_margin_deg(open_loop, gain) - expected).abs() < 1e-9);
        }
        let double = |w: f64| Complex64::new(-4.0 / (w * w), 0.0);
        assert!(unwrapped_margin_deg(double, 2.0).abs() < 1e-9);
    }

    #[test]
    fn errors_agree_with_finite_differences() {
        let element = ContinuousTransferFunction::new(&[1.0], &[1.0, 0.0]).unwrap();
        let ts = SampleTime::new(1.0 / 60.0).unwrap();
        for i in 0..6 {
            let mut covariance = vec![0.0; 36];
            covariance[i * 7] = 1e-8;
            let found = loop_measures(&operator(&X), Some(&covariance), &element, (ts, AUTO)).unwrap();
            let at = |by: f64| {
                let mut x = X;
                x[i] += by;
                loop_measures(&operator(&x), None, &element, (ts, AUTO)).unwrap()
            };
            let (up, down) = (at(1e-4), at(-1e-4));
            let slope = |get: fn(&LoopMeasures) -> f64| ((get(&up) - get(&down)) / 2e-4).abs();
            let error = |e: Estimate| e.standard_error.unwrap() / 1e-4;
            let crossover = slope(|m| m.crossover_rad_s.value);
            assert!((error(found.crossover_rad_s) - crossover).abs() < 1e-4 * (1.0 + crossover));
            let margin = slope(|m| m.phase_margin_deg.value);
            assert!(
                (error(found.phase_margin_deg) - margin).abs() < 1e-3 * (1.0 + margin),
                "{i}"
            );
        }
    }

    #[test]
    fn open_loop_gain_is_one_at_the_crossover() {
        let element = ContinuousTransferFunction::new(&[90.0], &[1.0, 6.0, 0.0]).unwrap();
        for scale in [0.02, 0.1, 0.5] {
            let of = FamilyOperator::new(Form::LeadLag, true, &[scale * X[0], X[1], X[2], X[3], X[4], X[5]]).unwrap();
            let open_loop = |w: f64| of.response(w) * AUTO.response(w, SampleTime::AT_100_HZ) * element.response(w);
            let found = Crossover::find_lowest(open_loop, SampleTime::AT_100_HZ).unwrap();
            assert!(
                (open_loop(found.omega_rad_s).norm() - 1.0).abs() < 1e-12,
                "{scale}: {found:?}"
            );
        }
        // For a step the root is still between the ends.
        let step = find_root(|x| if x < 0.3 { 1.0 } else { -3.0 }, (0.0, 1.0), (1.0, -3.0));
        assert!((step - 0.3).abs() < 1e-6, "{step}");
    }

    #[test]
    fn missing_crossover_gives_none() {
        let small = FamilyOperator::new(Form::Gain, true, &[1e-6, 2.4, -1.0, 0.1]).unwrap();
        let element = ContinuousTransferFunction::new(&[1.0], &[1.0, 1.0]).unwrap();
        assert_eq!(
            loop_measures(&small, None, &element, (SampleTime::AT_100_HZ, AUTO)),
            None
        );
    }
}
