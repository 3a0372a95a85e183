//! The responses of `s^i omega^2/((s + a)(s^2 + 2 zeta omega s + omega^2)) e^{-tau s}`, i = 0, 1, 2,
//! with `a = 1/T_I`, to an error that is straight between samples.
//!
//! In controllable canonical form `z' = A z + B e(t - tau)` all three are states of one filter,
//! `x_i = z_i`. With `tau = l Ts + delta`, `0 <= delta < Ts`, the delayed error is over a sample
//! straight in two pieces, up to delta and from there on. With `G(h) = int e^{A(h-s)} B ds` and
//! `R(h) = int e^{A(h-s)} B s ds`, both columns of the exponential of `[A B 0; 0 0 1; 0 0 0] h`,
//!
//! `z(k+1) = Phi z(k) + T_0 e(k-l+1) + T_1 e(k-l) + T_2 e(k-l-1)`,
//! `T_0 = R(h)/Ts`,
//! `T_1 = Phi(h) (G(delta) (1 - delta/Ts) + R(delta)/Ts) + G(h) - R(h)/Ts`,
//! `T_2 = Phi(h) (G(delta) delta/Ts - R(delta)/Ts)`, `h = Ts - delta`
//!
//! (K. J. Åström and B. Wittenmark, *Computer-Controlled Systems*, 1997, section 3.2; the triangle
//! hold of G. F. Franklin, J. D. Powell and M. Workman, *Digital Control of Dynamic Systems*, 1998,
//! section 6.3). Exact for a straight error and any delay.
//!
//! Each x_i is divided by its gain at [`REFERENCE`], so that all gains are in units of |Y| there.

use super::sizes::GAINS;

/// Frequency at which each response has a gain of one, rad/s.
pub const REFERENCE: f64 = 2.0;

/// Matrix of the exponential: three states, a step, a ramp.
type Square = [[f64; 5]; 5];

/// A complex number, real and imaginary part.
pub type Complex = [f64; 2];

/// What is held of a person: delay in s, natural frequency in rad/s and damping of the
/// neuromuscular system, lag in s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Delay, s.
    pub tau: f64,
    /// Natural frequency, rad/s.
    pub omega: f64,
    /// Damping ratio.
    pub zeta: f64,
    /// Lag T_I, s.
    pub lag: f64,
}

/// The filter of a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Basis {
    point: Point,
    sample_time: f64,
    phi: [[f64; GAINS]; GAINS],
    taps: [[f64; GAINS]; 3],
    delay: usize,
    scale: [f64; GAINS],
    z: [f64; GAINS],
}

crate::state!([] Basis { z });

impl Basis {
    /// At rest. Ts in s. `None` for numbers that are not positive (the delay: negative), or not
    /// finite, or poles so fast that nothing is left of them.
    pub fn new(point: Point, sample_time: f64) -> Option<Self> {
        let Point { tau, omega, zeta, lag } = point;
        let ts = sample_time;
        let positive = |x: f64| x > 0.0 && x < 1e6;
        if !([omega, zeta, lag, ts].into_iter().all(positive) && (0.0..1e3).contains(&tau)) {
            return None;
        }
        // A delay of whole samples must not become a sample less by rounding.
        let whole = libm::floor(tau / ts + 1e-9);
        let delta = (tau - whole * ts).max(0.0);
        let (a, square) = (1.0 / lag, omega * omega);
        let middle = 2.0 * zeta * omega;
        let monic = [a * square, square + middle * a, middle + a];
        let held = |h: f64| {
            let mut m = [[0.0; 5]; 5];
            (m[0][1], m[1][2]) = (h, h);
            for (entry, d) in m[2].iter_mut().zip(monic) {
                *entry = -d * h;
            }
            (m[2][3], m[3][4]) = (square * h, h);
            exponential(&m)
        };
        let (first, second) = (held(delta), held(ts - delta));
        let phi = product(&second, &first);
        let through = |v: [f64; GAINS]| -> [f64; GAINS] {
            core::array::from_fn(|i| (0..GAINS).map(|j| second[i][j] * v[j]).sum())
        };
        let part = delta / ts;
        let early = through(core::array::from_fn(|i| first[i][3] * (1.0 - part) + first[i][4] / ts));
        let late = through(core::array::from_fn(|i| first[i][3] * part - first[i][4] / ts));
        let mut basis = Self {
            point,
            sample_time,
            phi: core::array::from_fn(|i| core::array::from_fn(|j| phi[i][j])),
            taps: [
                core::array::from_fn(|i| second[i][4] / ts),
                core::array::from_fn(|i| early[i] + second[i][3] - second[i][4] / ts),
                late,
            ],
            delay: whole as usize,
            scale: [1.0; GAINS],
            z: [0.0; GAINS],
        };
        let at = basis.response(REFERENCE);
        basis.scale = at.map(|[re, im]| 1.0 / libm::hypot(re, im));
        basis.scale.iter().all(|s| s.is_finite()).then_some(basis)
    }

    /// What is held.
    pub fn point(&self) -> Point {
        self.point
    }

    /// Whole samples of the delay: the responses of a sample need the error of so many samples ago,
    /// and the two before it.
    pub fn delay(&self) -> usize {
        self.delay
    }

    /// What each response was divided by is one over this.
    pub fn scale(&self) -> [f64; GAINS] {
        self.scale
    }

    /// The responses of a sample from the errors of `delay`, `delay + 1` and `delay + 2` samples ago.
    #[inline(always)]
    pub fn step(&mut self, errors: [f64; 3]) -> [f64; GAINS] {
        let z = self.z;
        for i in 0..GAINS {
            let mut sum = 0.0;
            for j in 0..GAINS {
                sum += self.phi[i][j] * z[j] + self.taps[j][i] * errors[j];
            }
            self.z[i] = sum;
        }
        core::array::from_fn(|i| self.scale[i] * self.z[i])
    }

    /// Brings the filter to rest.
    pub fn reset(&mut self) {
        self.z = [0.0; GAINS];
    }

    /// Response of each x_i to sampled errors at a frequency in rad/s: with `z = e^{j omega Ts}`,
    /// `(z I - Phi)^-1 (T_0 z + T_1 + T_2/z) z^-l`, by Cramer's rule.
    pub fn response(&self, omega: f64) -> [Complex; GAINS] {
        let angle = omega * self.sample_time;
        let (sin, cos) = libm::sincos(angle);
        let (p, t) = (&self.phi, &self.taps);
        let mut m = [[[0.0; 2]; GAINS]; GAINS];
        for i in 0..GAINS {
            for j in 0..GAINS {
                m[i][j][0] = -p[i][j];
            }
            m[i][i] = [cos - p[i][i], sin];
        }
        let right: [Complex; GAINS] =
            core::array::from_fn(|i| [(t[0][i] + t[2][i]) * cos + t[1][i], (t[0][i] - t[2][i]) * sin]);
        let whole = determinant(&m);
        let (late_sin, late_cos) = libm::sincos(-angle * self.delay as f64);
        core::array::from_fn(|i| {
            let mut with = m;
            for (row, r) in with.iter_mut().zip(right) {
                row[i] = r;
            }
            let [re, im] = times(over(determinant(&with), whole), [late_cos, late_sin]);
            [self.scale[i] * re, self.scale[i] * im]
        })
    }
}

pub(super) fn times(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

pub(super) fn over(a: Complex, b: Complex) -> Complex {
    let square = b[0] * b[0] + b[1] * b[1];
    let [re, im] = times(a, [b[0], -b[1]]);
    [re / square, im / square]
}

fn determinant(m: &[[Complex; GAINS]; GAINS]) -> Complex {
    let minor = |i: usize, j: usize| {
        let (a, b) = (times(m[1][i], m[2][j]), times(m[1][j], m[2][i]));
        [a[0] - b[0], a[1] - b[1]]
    };
    let (a, b, c) = (
        times(m[0][0], minor(1, 2)),
        times(m[0][1], minor(0, 2)),
        times(m[0][2], minor(0, 1)),
    );
    [a[0] - b[0] + c[0], a[1] - b[1] + c[1]]
}

fn product(a: &Square, b: &Square) -> Square {
    core::array::from_fn(|i| core::array::from_fn(|j| (0..5).map(|k| a[i][k] * b[k][j]).sum()))
}

/// By scaling to a norm below 1/4, the series of Taylor to the 14th power, and squaring: the rest of
/// the series is below 1e-20.
fn exponential(m: &Square) -> Square {
    let norm = m
        .iter()
        .map(|row| row.iter().map(|x| x.abs()).sum::<f64>())
        .fold(0.0, f64::max);
    let mut halvings = 0;
    let mut scale = 1.0;
    while norm * scale > 0.25 && halvings < 64 {
        scale *= 0.5;
        halvings += 1;
    }
    let scaled: Square = m.map(|row| row.map(|x| x * scale));
    let mut sum = [[0.0; 5]; 5];
    (0..5).for_each(|i| sum[i][i] = 1.0);
    let mut term = sum;
    for k in 1..=14 {
        term = product(&term, &scaled).map(|row| row.map(|x| x / f64::from(k)));
        for (row, t) in sum.iter_mut().zip(&term) {
            for (s, t) in row.iter_mut().zip(t) {
                *s += t;
            }
        }
    }
    for _ in 0..halvings {
        sum = product(&sum, &sum);
    }
    sum
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use std::vec::Vec;

    fn point() -> Point {
        Point {
            tau: 0.213,
            omega: 11.0,
            zeta: 0.25,
            lag: 3.0,
        }
    }

    /// The transfer function itself, divided by its gain at the reference.
    fn continuous(i: usize, omega: f64) -> Complex {
        let p = point();
        let raw = |w: f64| {
            let s = [0.0, w];
            let numerator = match i {
                0 => [p.omega * p.omega, 0.0],
                1 => [0.0, w * p.omega * p.omega],
                _ => [-w * w * p.omega * p.omega, 0.0],
            };
            let second = [p.omega * p.omega - w * w, 2.0 * p.zeta * p.omega * w];
            let delay = libm::sincos(-p.tau * w);
            times(over(numerator, times([1.0 / p.lag, s[1]], second)), [delay.1, delay.0])
        };
        let at = raw(REFERENCE);
        let size = libm::hypot(at[0], at[1]);
        raw(omega).map(|x| x / size)
    }

    #[test]
    fn response_is_that_of_the_operator() {
        for ts in [1.0 / 60.0, 0.01, 0.001] {
            let basis = Basis::new(point(), ts).unwrap();
            for omega in [0.3, 1.0, 4.0, 9.0] {
                for (i, h) in basis.response(omega).into_iter().enumerate() {
                    let expected = continuous(i, omega);
                    let error = libm::hypot(h[0] - expected[0], h[1] - expected[1]);
                    let size = libm::hypot(expected[0], expected[1]);
                    // A straight line between samples loses (omega Ts)^2/12 of a sine, as at the
                    // reference.
                    let line = ((omega * ts).powi(2) + (REFERENCE * ts).powi(2)) / 10.0;
                    assert!(error < (line + 1e-9) * size, "{ts} {omega} {i}: {error} of {size}");
                }
            }
        }
    }

    #[test]
    fn filter_and_response_agree() {
        let ts = 0.01;
        let mut basis = Basis::new(point(), ts).unwrap();
        let omega = 3.0;
        let h = basis.response(omega);
        let e = |k: i64| libm::sin(omega * k as f64 * ts);
        let delay = basis.delay() as i64;
        for k in 1..20_000_i64 {
            let errors = core::array::from_fn(|j| e(k - 1 - (delay - 1 + j as i64)));
            let x = basis.step(errors);
            if k > 15_000 {
                let (sin, cos) = libm::sincos(omega * k as f64 * ts);
                for i in 0..GAINS {
                    assert!((x[i] - (h[i][0] * sin + h[i][1] * cos)).abs() < 1e-7, "{i} at {k}");
                }
            }
        }
    }

    #[test]
    fn delay_is_continuous_and_what_makes_no_sense_is_refused() {
        let at = |tau: f64| Basis::new(Point { tau, ..point() }, 0.01).unwrap().response(5.0);
        for (a, b) in at(0.21 - 1e-11).iter().flatten().zip(at(0.21 + 1e-11).iter().flatten()) {
            assert!((a - b).abs() < 1e-8);
        }
        let bad: Vec<Point> = [
            Point { tau: -0.1, ..point() },
            Point { omega: 0.0, ..point() },
            Point {
                zeta: f64::NAN,
                ..point()
            },
            Point {
                lag: f64::INFINITY,
                ..point()
            },
        ]
        .to_vec();
        assert!(bad.into_iter().all(|p| Basis::new(p, 0.01).is_none()));
        assert!(Basis::new(point(), 0.0).is_none());
        let mut still = Basis::new(point(), 0.01).unwrap();
        assert_eq!(still.step([0.0; 3]), [0.0; 3]);
    }
}
