//! Stability of the closed loop.

use std::f64::consts::PI;

use num_complex::Complex64;

use super::crossings::{MAX_TURN_RAD, total_phase_change};
use crate::{ContinuousTransferFunction, polynomial};

/// Maximum number of subdivisions of frequency intervals in the stability test; if more are needed, the loop is not
/// proven stable.
const MAX_EVALUATIONS: usize = 4_000_000;

/// True if unit negative feedback around the open loop gives a stable loop: all closed-loop poles are in the open left
/// half plane. Poles of the open loop may be anywhere, including the origin.
///
/// The result is true only if stability is proven. Three kinds of loop therefore count as unstable: a loop with a pole
/// so close to the imaginary axis that rounding matters; a biproper open loop with a delay whose gain at infinite
/// frequency is one or more (it has infinitely many poles in the right half plane); and a delay that turns the phase by
/// millions of radians over frequencies at which the gain exceeds 1/2.
pub fn closed_loop_is_stable(open_loop: &ContinuousTransferFunction) -> bool {
    CharacteristicFunction::new(open_loop).and_then(|f| f.zeros_in_right_half_plane()) == Some(0)
}

/// Lowest frequency at which a closed loop is evaluated, relative to the magnitude of the largest pole of the
/// controlled element or to 1 rad/s, whichever is lower.
const MIN_RELATIVE_FREQUENCY: f64 = 1e-4;
/// Deviation of the phase, in rad, from an integer number of half turns above which it is not attributed to rounding.
const HALF_TURN_TOLERANCE_RAD: f64 = 0.5;

/// Returns the number of closed-loop poles in the right half plane of a loop with unit negative feedback, which
/// consists of a stable operator, given by its frequency response, and a controlled element.
///
/// Returns `None` if this number cannot be determined: the response is not finite, `|L|` is not below one at
/// `highest_rad_s`, or a closed-loop pole is on the imaginary axis.
pub fn unstable_poles(
    operator: impl Fn(f64) -> Complex64,
    element: &ContinuousTransferFunction,
    highest_rad_s: f64,
) -> Option<usize> {
    let order = element.den().len() - 1;
    let scale = match max_root_magnitude(element.den()) {
        0.0 => 1.0,
        size => size,
    };
    let horner = |p: &[f64], s: Complex64| p.iter().fold(Complex64::new(0.0, 0.0), |sum, &c| sum * s + c);
    let characteristic = |omega: f64| {
        let s = Complex64::new(0.0, omega);
        let loop_part = horner(element.num(), s) * (-s * element.delay_s()).exp() * operator(omega);
        (horner(element.den(), s) + loop_part) / Complex64::new(scale, omega).powu(order as u32)
    };
    let low = MIN_RELATIVE_FREQUENCY * scale.min(1.0);
    // Beyond `highest_rad_s` the phase of D/(s + a)^n alone is followed, without the operator; this requires |L| < 1
    // there.
    if !(highest_rad_s > low && (operator(highest_rad_s) * element.response(highest_rad_s)).norm() < 1.0) {
        return None;
    }
    let (turned, first, last) = total_phase_change(characteristic, (low, highest_rad_s))?;
    let element_alone = |omega: f64| {
        let s = Complex64::new(0.0, omega);
        horner(element.den(), s) / Complex64::new(scale, omega).powu(order as u32)
    };
    let far = 1e3 * highest_rad_s.max(scale);
    let (beyond, from, to) = total_phase_change(element_alone, (highest_rad_s, far))?;
    // F(0) and the limit of F/(s + a)^n at infinite frequency are real; the argument of 1 + L is between -90 and 90 deg
    // from the last frequency on.
    let at_zero = if first.re >= 0.0 { first } else { -first }.arg();
    let total = at_zero + turned - (last / from).arg() + beyond - to.arg();
    let half_turns = (-total / PI).round();
    ((-total / PI - half_turns).abs() * PI < HALF_TURN_TOLERANCE_RAD && half_turns >= 0.0)
        .then_some(half_turns as usize)
}

/// Returns the magnitude of the largest root of a polynomial, estimated from its coefficients.
fn max_root_magnitude(p: &[f64]) -> f64 {
    let relative = (1..p.len()).map(|k| (p[k] / p[0]).abs().powf(1.0 / k as f64));
    relative.fold(0.0, f64::max)
}

/// Characteristic function `F(s) / (s + a)^n` on the imaginary axis.
pub(super) struct CharacteristicFunction<'a> {
    open_loop: &'a ContinuousTransferFunction,
    order: usize,
    /// The shift a, 1/s: the magnitude of the largest open-loop pole, or 1 if all poles are zero.
    scale: f64,
    /// Frequency above which `F/(s + a)^n` remains near its limit and does not encircle zero.
    last: f64,
}

impl<'a> CharacteristicFunction<'a> {
    /// Builds the characteristic function of an open loop. Returns `None` if the gain at infinite frequency makes the
    /// closed loop unstable.
    pub(super) fn new(open_loop: &'a ContinuousTransferFunction) -> Option<Self> {
        let (num, den, tau) = (open_loop.num(), open_loop.den(), open_loop.delay_s());
        let order = den.len() - 1;
        let biproper = num.len() == den.len();
        let at_infinity = if biproper { num[0].abs() } else { 0.0 };
        if biproper && (tau > 0.0 && at_infinity >= 1.0 || num[0] == -1.0) {
            return None;
        }
        let scale = match max_root_magnitude(den) {
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
            // The terms below s^n in D and in N: F/s^n differs from 1 + L(infinity) by at most the sum of these terms.
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

    /// Returns `F/(s + a)^n`, the magnitude below which it is zero up to rounding, and `|L|`.
    fn at(&self, omega: f64) -> (Complex64, f64, f64) {
        let s = Complex64::new(0.0, omega);
        let horner = |p: &[f64]| p.iter().fold(Complex64::new(0.0, 0.0), |sum, &c| sum * s + c);
        let (num, den) = (horner(self.open_loop.num()), horner(self.open_loop.den()));
        let shifted = Complex64::new(self.scale, omega).powu(self.order as u32);
        let f = den + num * (-s * self.open_loop.delay_s()).exp();
        let size = den.norm() + num.norm();
        (f / shifted, 1e-12 * size / shifted.norm(), num.norm() / den.norm())
    }

    /// Returns the number of zeros of F in the open right half plane; `None` if a zero is on the imaginary axis, within
    /// rounding, or if the delay turns the phase too many times to be followed.
    pub(super) fn zeros_in_right_half_plane(&self) -> Option<usize> {
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
                if turn.abs() > MAX_TURN_RAD || (delay_turn > MAX_TURN_RAD && loop_matters) {
                    evaluations += 1;
                    if depth > 60 || evaluations > MAX_EVALUATIONS {
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
        // From this frequency to infinity, the argument approaches its limit without another turn.
        let limit = if tau == 0.0 && self.open_loop.num().len() == self.order + 1 {
            Complex64::new(1.0 + self.open_loop.num()[0], 0.0)
        } else {
            Complex64::new(1.0, 0.0)
        };
        turned += (limit * here.1.0.conj()).arg();
        Some((-turned / PI).round().max(0.0) as usize)
    }
}
