//! Crossover frequency, phase and gain margin, and the stability of a loop with delay.
//!
//! For the open loop L in a loop with unit negative feedback,
//!
//! - the gain crossovers are where `|L| = 1`; the phase margin there is `180 deg + arg L`, between -180 and 180 deg;
//! - the phase crossovers are where L crosses the negative real axis (`arg L = -180 deg` modulo 360 deg); the gain margin there
//!   is `-20 log10 |L|` dB.
//!
//! Where there are several, the phase margin nearest to 0 deg and the gain margin nearest to 0 dB are given, each with its
//! frequency. MATLAB's `margin` and python-control's `margin` choose in the same way. Margins say nothing about a loop that is
//! not stable, nor whether it is: [`closed_loop_is_stable`] does.
//!
//! **Scan.** A logarithmic grid, halved wherever the phase turns by more than 0.5 rad between neighbours, as seen from their
//! phases or from the slope of the phase at each (a whole round between two points would look like no turn), so that the phase
//! is followed however fast a delay turns it; sign changes are refined by bisection to rounding. A pair of crossings closer
//! than the grid (a curve that only touches) is not seen.
//!
//! **Stability.** With `L = N e^{-s tau} / D`, the closed loop is stable when `F(s) = D + N e^{-s tau}` has no zero in the closed
//! right half plane. `F/(s + a)^n`, n the degree of D, is analytic there and goes to 1, so that its argument turns by `-pi Z`
//! along s = j omega, omega from 0 to infinity, Z the number of zeros (Cauchy's argument principle; Mikhailov's form of the
//! Nyquist criterion). F has no poles, so that open-loop poles at the origin or on the axis need no detour, and common factors
//! of N and D in the right half plane count as they should.

use std::f64::consts::PI;

use num_complex::Complex64;

use crate::{ContinuousTransferFunction, polynomial};

/// Margins of an open loop. A quantity that does not exist within the range scanned is `None`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// Gain crossover frequency omega_c in rad/s.
    pub crossover_rad_s: Option<f64>,
    /// Phase margin phi_m at `crossover_rad_s`, in degrees.
    pub phase_margin_deg: Option<f64>,
    /// Phase crossover frequency in rad/s.
    pub phase_crossover_rad_s: Option<f64>,
    /// Gain margin at `phase_crossover_rad_s`, in dB.
    pub gain_margin_db: Option<f64>,
}

/// A range that holds every crossover of manual control, in rad/s.
pub const MANUAL_CONTROL_RANGE_RAD_S: (f64, f64) = (1e-3, 1e3);

const POINTS_PER_DECADE: f64 = 100.0;
const LARGEST_TURN_RAD: f64 = 0.5;
/// Bounds the work: 4096 points for a step of the grid follow a delay of 90 s at 1000 rad/s.
const DEEPEST_HALVING: u32 = 12;
/// Bounds the work of the stability test, which gives no proof beyond.
const MOST_EVALUATIONS: usize = 4_000_000;

/// Margins of any frequency response: continuous with delay, or discrete with a range that ends at pi/Ts (a response there on the
/// negative real axis counts as a phase crossover).
///
/// A range that is not `0 < low < high`, both finite, has no margins; where the response is not finite it is left out.
pub fn margins(open_loop: impl Fn(f64) -> Complex64, range_rad_s: (f64, f64)) -> Margins {
    let points = scan(&open_loop, range_rad_s);
    let (mut phase, mut gain) = (Nearest::default(), Nearest::default());
    let phase_margin_deg = |l: Complex64| (-l).arg().to_degrees();
    let gain_margin_db = |l: Complex64| -20.0 * l.norm().log10();

    for pair in points.windows(2) {
        let (low, high, l_low, l_high) = (pair[0].omega, pair[1].omega, pair[0].l, pair[1].l);
        if !(l_low.is_finite() && l_high.is_finite()) {
            continue;
        }
        let above = |l: Complex64| l.norm() >= 1.0;
        if above(l_low) != above(l_high) {
            let omega = bisect(low, high, |w| above(open_loop(w)) == above(l_low));
            phase.offer(omega, phase_margin_deg(open_loop(omega)));
        }
        // The turn between neighbours is small, so that a change of sign in the left half plane is a crossing of its axis.
        let upper = |l: Complex64| l.im >= 0.0;
        if upper(l_low) != upper(l_high) && l_low.re < 0.0 && l_high.re < 0.0 {
            let omega = bisect(low, high, |w| upper(open_loop(w)) == upper(l_low));
            gain.offer(omega, gain_margin_db(open_loop(omega)));
        }
    }
    let on_negative_axis = |l: Complex64| l.re < 0.0 && l.im.abs() <= 1e-9 * l.re.abs();
    if let [.., before, end] = &points[..]
        && on_negative_axis(end.l)
        && !on_negative_axis(before.l)
    {
        gain.offer(end.omega, gain_margin_db(end.l));
    }
    Margins {
        crossover_rad_s: phase.at,
        phase_margin_deg: phase.value,
        phase_crossover_rad_s: gain.at,
        gain_margin_db: gain.value,
    }
}

/// The candidate nearest to zero, the first one of equals.
#[derive(Default)]
struct Nearest {
    at: Option<f64>,
    value: Option<f64>,
}

impl Nearest {
    fn offer(&mut self, at: f64, value: f64) {
        if self.value.is_none_or(|held| value.abs() < held.abs()) {
            (self.at, self.value) = (Some(at), Some(value));
        }
    }
}

/// One frequency of the scan.
#[derive(Clone, Copy)]
struct Point {
    omega: f64,
    l: Complex64,
    /// Slope of the phase, rad/(rad/s).
    slope_s: f64,
}

impl Point {
    fn new(open_loop: &impl Fn(f64) -> Complex64, omega: f64) -> Self {
        let l = open_loop(omega);
        let step = 1e-6 * omega;
        let slope_s = (open_loop(omega - step).conj() * l).arg() / step;
        Self { omega, l, slope_s }
    }
}

/// The response on a logarithmic grid that follows its phase.
fn scan(open_loop: &impl Fn(f64) -> Complex64, (low, high): (f64, f64)) -> Vec<Point> {
    if !(low > 0.0 && high > low && high.is_finite()) {
        return Vec::new();
    }
    let steps = (((high / low).log10() * POINTS_PER_DECADE).ceil() as usize).max(2);
    let ratio = (high / low).ln() / steps as f64;
    let mut points = vec![Point::new(open_loop, low)];
    for i in 1..=steps {
        let omega = if i == steps {
            high
        } else {
            low * (ratio * i as f64).exp()
        };
        let before = points[points.len() - 1];
        let next = Point::new(open_loop, omega);
        halve(open_loop, before, next, DEEPEST_HALVING, &mut points);
    }
    points
}

/// Appends `high`, and before it as many points between as the phase needs.
fn halve(open_loop: &impl Fn(f64) -> Complex64, low: Point, high: Point, depth: u32, points: &mut Vec<Point>) {
    let turn = (high.l * low.l.conj()).arg().abs();
    let by_slope = low.slope_s.abs().max(high.slope_s.abs()) * (high.omega - low.omega);
    if depth > 0 && turn.max(by_slope) > LARGEST_TURN_RAD {
        let between = Point::new(open_loop, (low.omega * high.omega).sqrt());
        halve(open_loop, low, between, depth - 1, points);
        halve(open_loop, between, high, depth - 1, points);
    } else {
        points.push(high);
    }
}

/// Where `holds` turns from true (at `low`) to false, to rounding.
fn bisect(low: f64, high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (low, high);
    for _ in 0..60 {
        let middle = (low * high).sqrt();
        if middle <= low || middle >= high {
            break;
        }
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low * high).sqrt()
}

/// True when unit negative feedback around the open loop gives a stable loop: all closed-loop poles in the open left half
/// plane. Poles of the open loop may lie anywhere, also at the origin.
///
/// Stable means proven stable. A closed-loop pole nearer to the imaginary axis than rounding can tell counts as not stable, and
/// so do a biproper open loop with delay whose gain at infinite frequency is one or more (it has infinitely many poles in the
/// right half plane) and a delay of millions of radians at the frequencies where the gain exceeds 1/2.
pub fn closed_loop_is_stable(open_loop: &ContinuousTransferFunction) -> bool {
    Characteristic::new(open_loop).and_then(|f| f.zeros_in_right_half_plane()) == Some(0)
}

/// `F(s) / (s + a)^n` on the imaginary axis.
struct Characteristic<'a> {
    open_loop: &'a ContinuousTransferFunction,
    order: usize,
    /// The shift a, 1/s: the size of the open-loop poles.
    scale: f64,
    /// Beyond this frequency `F/(s + a)^n` stays near its limit and makes no round about zero.
    last: f64,
}

impl<'a> Characteristic<'a> {
    /// `None` when the gain at infinite frequency alone makes the loop unstable.
    fn new(open_loop: &'a ContinuousTransferFunction) -> Option<Self> {
        let (num, den, tau) = (open_loop.num(), open_loop.den(), open_loop.delay_s());
        let order = den.len() - 1;
        let biproper = num.len() == den.len();
        let at_infinity = if biproper { num[0].abs() } else { 0.0 };
        if biproper && (tau > 0.0 && at_infinity >= 1.0 || num[0] == -1.0) {
            return None;
        }
        let root_size = |p: &[f64]| {
            let relative = (1..p.len()).map(|k| (p[k] / p[0]).abs().powf(1.0 / k as f64));
            relative.fold(0.0, f64::max)
        };
        let scale = match root_size(den) {
            0.0 => 1.0,
            size => size,
        };
        // Smallest distance of 1 + L from zero at infinite frequency.
        let clearance = if tau > 0.0 || !biproper {
            1.0 - at_infinity
        } else {
            (1.0 + num[0]).abs()
        };
        let mut last = scale;
        for _ in 0..400 {
            let below = |p: &[f64], degree: usize| -> f64 {
                let powers = p.iter().rev().enumerate().take(degree);
                powers.map(|(k, c)| c.abs() / last.powi((degree - k) as i32)).sum()
            };
            // Terms below s^n in D and in N: F/s^n is 1 + L(infinity) up to these.
            let rest = below(den, order) + below(num, order);
            if rest < 0.3 * clearance && scale * (order as f64) < 0.1 * last {
                return Some(Self {
                    open_loop,
                    order,
                    scale,
                    last,
                });
            }
            last *= 2.0;
        }
        None
    }

    /// `F/(s + a)^n`, its smallest meaningful size (what rounding can make of a zero), and `|L|`.
    fn at(&self, omega: f64) -> (Complex64, f64, f64) {
        let s = Complex64::new(0.0, omega);
        let horner = |p: &[f64]| p.iter().fold(Complex64::new(0.0, 0.0), |sum, &c| sum * s + c);
        let (num, den) = (horner(self.open_loop.num()), horner(self.open_loop.den()));
        let shifted = Complex64::new(self.scale, omega).powu(self.order as u32);
        let f = den + num * (-s * self.open_loop.delay_s()).exp();
        let size = den.norm() + num.norm();
        (f / shifted, 1e-12 * size / shifted.norm(), num.norm() / den.norm())
    }

    /// Zeros of F in the open right half plane; `None` when one lies on the imaginary axis, as far as rounding can tell, or
    /// the delay turns too often to follow.
    fn zeros_in_right_half_plane(&self) -> Option<usize> {
        let tau = self.open_loop.delay_s();
        let mut grid = vec![0.0];
        let first = 1e-6 * self.last.min(self.scale);
        let steps = ((self.last / first).log10() * 30.0).ceil();
        grid.extend((0..=steps as usize).map(|i| first * (self.last / first).powf(i as f64 / steps)));
        // A lightly damped pole turns the phase within a band narrower than the grid.
        for p in [self.open_loop.num(), self.open_loop.den()] {
            for root in polynomial::roots(p)? {
                let (centre, width) = (root.im, root.re.abs());
                let around = [centre - width, centre, centre + width];
                grid.extend(around.into_iter().filter(|w| *w > 0.0 && *w < self.last));
            }
        }
        grid.sort_by(f64::total_cmp);

        let (mut turned, mut evaluations) = (0.0, 0);
        let mut pending = Vec::new();
        let mut here = (0.0, self.at(0.0));
        for &omega in &grid[1..] {
            pending.push((omega, self.at(omega), 0));
            while let Some((omega, next, depth)) = pending.pop() {
                let (f, smallest, gain) = here.1;
                if !(f.norm() > smallest && next.0.norm() > next.1) {
                    return None;
                }
                let turn = (next.0 * f.conj()).arg();
                let delay_turn = tau * (omega - here.0);
                let loop_matters = gain.max(next.2) > 0.5;
                if turn.abs() > LARGEST_TURN_RAD || (delay_turn > LARGEST_TURN_RAD && loop_matters) {
                    evaluations += 1;
                    if depth > 60 || evaluations > MOST_EVALUATIONS {
                        return None;
                    }
                    let middle = 0.5 * (here.0 + omega);
                    pending.push((omega, next, depth + 1));
                    pending.push((middle, self.at(middle), depth + 1));
                } else {
                    turned += turn;
                    here = (omega, next);
                }
            }
        }
        // From here to infinity the argument goes back to that of the limit without another round.
        let limit = if tau == 0.0 && self.open_loop.num().len() == self.order + 1 {
            Complex64::new(1.0 + self.open_loop.num()[0], 0.0)
        } else {
            Complex64::new(1.0, 0.0)
        };
        turned += (limit * here.1.0.conj()).arg();
        Some((-turned / PI).round().max(0.0) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DiscreteTransferFunction, SampleTime, scenario::OperatingState};

    fn tf(num: &[f64], den: &[f64]) -> ContinuousTransferFunction {
        ContinuousTransferFunction::new(num, den).unwrap()
    }

    fn delayed(num: &[f64], den: &[f64], delay_s: f64) -> ContinuousTransferFunction {
        tf(num, den).with_delay(delay_s).unwrap()
    }

    fn scaled(h: &ContinuousTransferFunction, gain: f64) -> ContinuousTransferFunction {
        h.series(&tf(&[gain], &[1.0]))
    }

    fn open_loop(state: OperatingState) -> ContinuousTransferFunction {
        let element = state.controlled_element.transfer_function().unwrap();
        state.operator.transfer_function().unwrap().series(&element)
    }

    fn s1() -> ContinuousTransferFunction {
        open_loop(OperatingState::s1())
    }

    fn s2() -> ContinuousTransferFunction {
        open_loop(OperatingState::s2())
    }

    fn continuous(h: &ContinuousTransferFunction) -> Margins {
        margins(|w| h.response(w), MANUAL_CONTROL_RANGE_RAD_S)
    }

    fn assert_margins(found: Margins, expected: [(f64, f64); 4]) {
        let found = [
            found.crossover_rad_s,
            found.phase_margin_deg,
            found.phase_crossover_rad_s,
            found.gain_margin_db,
        ];
        for (found, (expected, tolerance)) in found.iter().zip(expected) {
            let found = found.unwrap();
            assert!((found - expected).abs() <= tolerance, "{found} and {expected}");
        }
    }

    #[test]
    fn both_states_of_the_reference() {
        // scipy.optimize.brentq on |L| - 1 and on Im L; expected-values gives the same, shorter (its 5.52 rad/s is 5.525 cut off).
        let tolerance = 1e-9;
        let expected = |values: [f64; 4]| values.map(|v| (v, tolerance));
        let first = [
            1.5634851408630523,
            76.66834431239965,
            5.525188773275959,
            5.623557013781441,
        ];
        let second = [
            2.7479645785248255,
            22.901743526385303,
            4.0542340213785195,
            3.1031729189944683,
        ];
        assert_margins(continuous(&s1()), expected(first));
        assert_margins(continuous(&s2()), expected(second));
    }

    #[test]
    fn crossover_model_in_closed_form() {
        // K e^{-s tau}/s: omega_c = K, phase margin 90 deg - K tau, phase crossover pi/(2 tau).
        for (k, tau) in [(1.0, 0.3), (3.0, 0.2), (0.05, 12.0), (2.0, 0.785)] {
            let h = delayed(&[k], &[1.0, 0.0], tau);
            let phase_crossover = PI / (2.0 * tau);
            assert_margins(
                continuous(&h),
                [
                    (k, 1e-12 * k),
                    (90.0 - (k * tau).to_degrees(), 1e-9),
                    (phase_crossover, 1e-12 * phase_crossover),
                    (20.0 * (phase_crossover / k).log10(), 1e-9),
                ],
            );
        }
    }

    #[test]
    fn the_margins_nearest_to_zero_govern() {
        // e^{-0.1 s}/s with a lightly damped mode at 9 rad/s crosses gain one at 1.013, 8.482 and 9.428 rad/s with phase margins of
        // 83.94, 22.75 and -120.7 deg, and the negative real axis at 8.786 and 47.2 rad/s with -5.392 and 61.95 dB. By numpy on two
        // million frequencies; python-control 0.10.2 `stability_margins` chooses the same two.
        let h = delayed(&[1.0], &[1.0, 0.0], 0.1).series(&tf(&[81.0], &[1.0, 0.36, 81.0]));
        assert_margins(
            continuous(&h),
            [(8.48246, 3e-5), (22.749, 1e-3), (8.78549, 3e-5), (-5.3923, 1e-3)],
        );
        assert!(!closed_loop_is_stable(&h));
    }

    #[test]
    fn fast_turning_phase_is_followed() {
        // |L| rises towards 0.9, so that the phase crossover next to the end of the range governs. The delay turns four whole
        // rounds over the last step of the grid, from 977.2 to 1000 rad/s: seen from its ends it does not turn.
        let tau = 4.0 * 2.0 * PI / (1000.0 * -(-0.01 * 10f64.ln()).exp_m1());
        let h = delayed(&[0.9, 0.0], &[1.0, 500.0], tau);
        let found = continuous(&h);
        let omega = found.phase_crossover_rad_s.unwrap();
        assert!(omega > 1000.0 - 2.0 * PI / tau, "{omega}");
        assert!(h.response(omega).im.abs() < 1e-12 && h.response(omega).re < 0.0);
        assert_eq!(found.crossover_rad_s, None);
    }

    #[test]
    fn discrete_loops_end_at_half_the_sampling_frequency() {
        // L = k/(z + 0.5): at z = -1, L = -2 k; with k = 0.2 the gain margin is 1/0.4.
        let sample_time = SampleTime::new(0.1).unwrap();
        let h = DiscreteTransferFunction::new(&[0.0, 0.2], &[1.0, 0.5], sample_time).unwrap();
        let found = margins(|w| h.response(w), (1e-3, sample_time.nyquist_rad_s()));
        assert_eq!((found.crossover_rad_s, found.phase_margin_deg), (None, None));
        assert!((found.gain_margin_db.unwrap() + 20.0 * 0.4f64.log10()).abs() < 1e-9);
        assert!((found.phase_crossover_rad_s.unwrap() - sample_time.nyquist_rad_s()).abs() < 1e-6);
    }

    #[test]
    fn no_range_no_margins() {
        let none = Margins {
            crossover_rad_s: None,
            phase_margin_deg: None,
            phase_crossover_rad_s: None,
            gain_margin_db: None,
        };
        let h = s1();
        for range in [
            (0.0, 1.0),
            (1.0, 1.0),
            (2.0, 1.0),
            (f64::NAN, 1.0),
            (1.0, f64::INFINITY),
        ] {
            assert_eq!(margins(|w| h.response(w), range), none);
        }
        assert_eq!(margins(|_| Complex64::new(f64::NAN, 0.0), (0.1, 10.0)), none);
        // A double integrator lies on the negative real axis: it crosses nothing, and its phase margin is zero.
        let double = continuous(&tf(&[4.0], &[1.0, 0.0, 0.0]));
        assert_eq!(double.phase_crossover_rad_s, None);
        assert!((double.crossover_rad_s.unwrap() - 2.0).abs() < 1e-12 && double.phase_margin_deg.unwrap().abs() < 1e-9);
    }

    #[test]
    fn stability_turns_at_the_gain_margin() {
        for h in [s1(), s2()] {
            let gain = 10f64.powf(continuous(&h).gain_margin_db.unwrap() / 20.0);
            assert!(closed_loop_is_stable(&h));
            for (factor, stable) in [
                (1e-6, true),
                (0.999_999, true),
                (1.000_001, false),
                (10.0, false),
                (1e4, false),
            ] {
                assert_eq!(closed_loop_is_stable(&scaled(&h, gain * factor)), stable, "{factor}");
            }
            assert!(!closed_loop_is_stable(&scaled(&h, -1.0)));
        }
    }

    #[test]
    fn stability_with_delay_in_closed_form() {
        // K e^{-s tau}/s is stable for K tau < pi/2.
        for tau in [1e-3, 0.28, 40.0] {
            for (product, stable) in [(1e-4, true), (1.57, true), (1.5709, false), (4.0, false), (60.0, false)] {
                assert_eq!(
                    closed_loop_is_stable(&delayed(&[product / tau], &[1.0, 0.0], tau)),
                    stable
                );
            }
        }
        // A pair of zeros enters at K tau = pi/2 + 2 pi k; for 5000 each step of the grid hides many rounds.
        for product in [1.5, 1.6, 60.0, 5000.0] {
            let h = delayed(&[product / 0.28], &[1.0, 0.0], 0.28);
            let pairs = ((product - PI / 2.0) / (2.0 * PI)).ceil().max(0.0) as usize;
            let found = Characteristic::new(&h).unwrap().zeros_in_right_half_plane();
            assert_eq!(found, Some(2 * pairs), "{product}");
        }
        // k e^{-s tau}/(s - 1), tau = 0.5: stable for 1 < k < sqrt(1 + w^2) with atan w = w/2 (w = 2.331122370414423).
        let limit = (1.0 + 2.331122370414423f64.powi(2)).sqrt();
        for (k, stable) in [(0.9, false), (1.001, true), (limit - 1e-3, true), (limit + 1e-3, false)] {
            assert_eq!(closed_loop_is_stable(&delayed(&[k], &[1.0, -1.0], 0.5)), stable, "{k}");
        }
        // A delay in the wrong unit ends in time.
        assert!(!closed_loop_is_stable(&delayed(&[5.0], &[1.0, 0.0], 1e9)));
        // At most as much gain at infinite frequency as one, for any delay.
        assert!(closed_loop_is_stable(&delayed(&[0.5], &[1.0], 1.0)));
        assert!(!closed_loop_is_stable(&delayed(&[1.5], &[1.0], 1.0)));
        assert!(closed_loop_is_stable(&delayed(&[0.6, 0.2], &[1.0, 2.0], 0.7)));
        assert!(!closed_loop_is_stable(&delayed(&[-0.6, -2.1], &[1.0, 2.0], 0.7)));
    }

    #[test]
    fn stability_without_delay_agrees_with_the_roots() {
        // Pseudo-random loops of order 1 to 5, some biproper, some with poles at the origin.
        let mut state = 1u64;
        let mut random = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let (mut stable, mut unstable) = (0, 0);
        for case in 0..400 {
            let order = 1 + case % 5;
            let den: Vec<f64> = (0..=order)
                .map(|k| match k {
                    0 => 1.0,
                    k if k == order && case % 3 == 0 => 0.0,
                    k => 4.0 * (random() - 0.2) * (order - k + 1) as f64 * 3f64.powi(k as i32),
                })
                .collect();
            let degree = if case % 4 == 0 { order } else { order - 1 };
            let num: Vec<f64> = (0..=degree)
                .map(|k| 3.0 * (random() - 0.25) * 2f64.powi(k as i32))
                .collect();
            let mut sum = den.clone();
            for (k, b) in num.iter().enumerate() {
                sum[order - degree + k] += b;
            }
            let expected = polynomial::roots(&sum).unwrap().iter().all(|s| s.re < 0.0);
            assert_eq!(closed_loop_is_stable(&tf(&num, &den)), expected, "{num:?} / {den:?}");
            if expected { stable += 1 } else { unstable += 1 }
        }
        assert!(stable > 50 && unstable > 50, "{stable} {unstable}");
    }

    #[test]
    fn marginal_and_hidden_modes_are_not_stable() {
        assert!(!closed_loop_is_stable(&tf(&[1.0], &[1.0, 0.0, 0.0])));
        assert!(closed_loop_is_stable(&tf(&[1.0, 1.0], &[1.0, 0.0, 0.0])));
        assert!(!closed_loop_is_stable(&tf(&[1.0, -1.0], &[1.0, 0.0, 0.0])));
        assert!(!closed_loop_is_stable(&tf(&[0.0], &[1.0, 0.0])));
        assert!(closed_loop_is_stable(&tf(&[0.0], &[1.0, 2.0])));
        assert!(!closed_loop_is_stable(&tf(&[-1.0], &[1.0])));
        // (s - 1)/((s - 1)(s + 2)): the unstable mode is in the loop though not in its transfer function.
        assert!(!closed_loop_is_stable(&tf(&[1.0, -1.0], &[1.0, 1.0, -2.0])));
        // Two modes within one step of the grid, which together turn the phase by whole rounds.
        for (damping, stable) in [(1e-6, true), (-1e-6, false)] {
            let modes = polynomial::product(&[1.0, damping, 7.3], &[1.0, damping, 7.4]);
            assert_eq!(closed_loop_is_stable(&tf(&[1e-12], &modes)), stable);
        }
        // Damping of 1e-6 each way, at a frequency that no grid hits.
        for (damping, stable) in [(1e-6, true), (-1e-6, false)] {
            assert_eq!(closed_loop_is_stable(&tf(&[1e-12], &[1.0, damping, 7.3])), stable);
        }
    }
}
