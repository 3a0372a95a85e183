//! Responses of `s^i omega^2/((s + a)(s^2 + 2 zeta omega s + omega^2)) e^{-tau s}`, i = 0, 1, 2, with `a = 1/T_I`, to
//! an error that is interpolated linearly between samples, and their derivatives with respect to omega, zeta and tau.
//!
//! Let `Q = s^2 + 2 zeta omega s + omega^2`, and let z_i be the response of `s^i/((s + a) Q^2) e^{-tau s}`, i = 0 to 5.
//! Then
//!
//! `r_i = omega^2 (z_{i+2} + 2 zeta omega z_{i+1} + omega^2 z_i)`,
//! `dr_i/domega = 2 r_i/omega - 2 omega^2 (zeta z_{i+1} + omega z_i)`,
//! `dr_i/dzeta = -2 omega^3 z_{i+1}`,
//! `dr_i/dtau = -omega^2 (z_{i+3} + 2 zeta omega z_{i+2} + omega^2 z_{i+1})`.
//!
//! `z_0 .. z_4` are the states of one filter in controllable canonical form, `z' = A z + B e(t - tau)`, and z_5 is the
//! derivative of z_4. With `tau = l Ts + delta`, `0 <= delta < Ts`, the delayed error consists of two linear pieces
//! within a sample, before and after delta. With `G(h) = int e^{A(h-s)} B ds` and `R(h) = int e^{A(h-s)} B s ds`, both
//! columns of the exponential of `[A B 0; 0 0 1; 0 0 0] h`,
//!
//! `z(k+1) = Phi z(k) + T_0 e(k-l+1) + T_1 e(k-l) + T_2 e(k-l-1)`,
//! `T_0 = R(h)/Ts`,
//! `T_1 = Phi(h) (G(delta) (1 - delta/Ts) + R(delta)/Ts) + G(h) - R(h)/Ts`,
//! `T_2 = Phi(h) (G(delta) delta/Ts - R(delta)/Ts)`, `h = Ts - delta`
//!
//! (K. J. Åström and B. Wittenmark, *Computer-Controlled Systems*, 1997, section 3.2; the triangle hold of G. F.
//! Franklin, J. D. Powell and M. Workman, *Digital Control of Dynamic Systems*, 1998, section 6.3). The recursion is
//! exact for a piecewise linear error and any delay. Apart from aliasing, the response to a sampled sine is the
//! response of the operator multiplied by the response of the hold, `(sin(omega Ts/2)/(omega Ts/2))^2`.
//!
//! Each r_i is divided by its gain at [`REFERENCE_RAD_S`], so all gains of the numerator are in units of |Y| at that
//! frequency.

use super::{
    f64x2::F64x2,
    signal_history::{SignalPairs, to_pairs},
    sizes::{DYNAMICS_COUNT, GAIN_COUNT, SIGNAL_COUNT},
};

/// Frequency in rad/s at which each response is scaled to a gain of one.
pub const REFERENCE_RAD_S: f64 = 2.0;

/// Number of filter states.
const N: usize = SIGNAL_COUNT - 1;
/// Size of the matrix exponential: the filter states, plus one state for a step and one for a ramp.
const M: usize = N + 2;
type SquareMatrix = [[f64; M]; M];

/// Complex number, given by its real and imaginary parts.
pub type Complex = [f64; 2];
/// Signals `z_0 .. z_5` of the basis.
pub type Signals = [f64; SIGNAL_COUNT];

/// Dynamics of a person: delay, natural frequency and damping ratio of the neuromuscular system, and lag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Delay in s.
    pub tau: f64,
    /// Natural frequency in rad/s.
    pub omega: f64,
    /// Damping ratio.
    pub zeta: f64,
    /// Lag T_I in s.
    pub lag: f64,
}

crate::state!([] Point { tau, omega, zeta, lag });

impl Point {
    /// Returns the point with corrections of omega, zeta and tau added.
    pub fn moved(self, [omega, zeta, tau]: [f64; DYNAMICS_COUNT]) -> Self {
        Self {
            tau: self.tau + tau,
            omega: self.omega + omega,
            zeta: self.zeta + zeta,
            lag: self.lag,
        }
    }
}

/// Responses r_i at one sample, with their derivatives with respect to omega, zeta and tau.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regressors {
    /// Responses r_i.
    pub x: [f64; GAIN_COUNT],
    /// Derivatives of the r_i with respect to omega, zeta and tau.
    pub by: [[f64; GAIN_COUNT]; DYNAMICS_COUNT],
}

/// Filter that generates the responses for one [`Point`].
#[derive(Debug, Clone, PartialEq)]
pub struct Basis {
    point: Point,
    sample_time: f64,
    /// Columns of Phi, and T_0 to T_2, each padded with a zero to the number of signals.
    columns: [SignalPairs; N],
    taps: [SignalPairs; 3],
    monic: [f64; N],
    delay: usize,
    part: f64,
    scale: [f64; GAIN_COUNT],
    z: [f64; N],
}

crate::state!([] Basis { point, columns, taps, monic, delay, part, scale, z });

impl Basis {
    /// Builds the filter at rest, with Ts in s. Returns `None` if a number is not finite or not positive (the delay may
    /// be zero), or if the poles are so fast that their response vanishes.
    pub fn new(point: Point, sample_time: f64) -> Option<Self> {
        let positive = |x: f64| x > 0.0 && x < 1e6;
        let Point { tau, omega, zeta, lag } = point;
        if !([omega, zeta, lag, sample_time].into_iter().all(positive) && (0.0..1e3).contains(&tau)) {
            return None;
        }
        let mut basis = Self {
            point,
            sample_time,
            columns: [[F64x2::ZERO; SIGNAL_COUNT / 2]; N],
            taps: [[F64x2::ZERO; SIGNAL_COUNT / 2]; 3],
            monic: [0.0; N],
            delay: 0,
            part: 0.0,
            scale: [1.0; GAIN_COUNT],
            z: [0.0; N],
        };
        basis.discretise();
        let at = basis.response(REFERENCE_RAD_S, point);
        basis.scale = at.map(|[re, im]| 1.0 / libm::hypot(re, im));
        let sound = basis
            .scale
            .iter()
            .chain(basis.columns.iter().flatten().flat_map(|pair| &pair.0))
            .all(|s| s.is_finite());
        sound.then_some(basis)
    }

    fn discretise(&mut self) {
        let Point { tau, omega, zeta, lag } = self.point;
        let ts = self.sample_time;
        // The small offset prevents rounding from shortening a delay of whole samples by one sample.
        let whole = libm::floor(tau / ts + 1e-9);
        let delta = (tau - whole * ts).max(0.0);
        let (a, p, q) = (1.0 / lag, 2.0 * zeta * omega, omega * omega);
        // Coefficients of Q^2 without the leading s^4.
        let square = [q * q, 2.0 * p * q, p * p + 2.0 * q, 2.0 * p];
        self.monic = [
            a * square[0],
            a * square[1] + square[0],
            a * square[2] + square[1],
            a * square[3] + square[2],
            a + square[3],
        ];
        let held = |h: f64| {
            let mut m = [[0.0; M]; M];
            for i in 0..N - 1 {
                m[i][i + 1] = h;
            }
            for (entry, d) in m[N - 1].iter_mut().zip(self.monic) {
                *entry = -d * h;
            }
            (m[N - 1][N], m[N][N + 1]) = (h, h);
            matrix_exponential(&m)
        };
        let (first, second) = (held(delta), held(ts - delta));
        let phi = matrix_product(&second, &first);
        let through = |v: [f64; N]| -> [f64; N] { core::array::from_fn(|i| (0..N).map(|j| second[i][j] * v[j]).sum()) };
        let part = delta / ts;
        let early = through(core::array::from_fn(|i| {
            first[i][N] * (1.0 - part) + first[i][N + 1] / ts
        }));
        let late = through(core::array::from_fn(|i| first[i][N] * part - first[i][N + 1] / ts));
        let column = |of: &dyn Fn(usize) -> f64| -> SignalPairs {
            to_pairs(&core::array::from_fn(|i| if i < N { of(i) } else { 0.0 }))
        };
        self.columns = core::array::from_fn(|j| column(&|i| phi[i][j]));
        self.taps = [
            column(&|i| second[i][N + 1] / ts),
            column(&|i| early[i] + second[i][N] - second[i][N + 1] / ts),
            column(&|i| late[i]),
        ];
        (self.delay, self.part) = (whole as usize, part);
    }

    /// Returns a filter at another point, with the same lag and scale, which continues the slow mode `g = 1/(s + a) e`
    /// of this filter; in the states of either filter, g is `Q^2 z_0`. The fast modes start at rest and settle within a
    /// few multiples of `1/(zeta omega)`. `error` is the current delayed error. Returns `None` for an invalid point.
    pub fn moved(&self, point: Point, error: f64) -> Option<Self> {
        let sound = point.omega > 0.0 && point.zeta > 0.0 && point.tau >= 0.0 && point.lag == self.point.lag;
        if !sound {
            return None;
        }
        let mut other = Self { point, ..self.clone() };
        other.discretise();
        let (a, p, q) = (
            1.0 / point.lag,
            2.0 * self.point.zeta * self.point.omega,
            self.point.omega * self.point.omega,
        );
        let square = [q * q, 2.0 * p * q, p * p + 2.0 * q, 2.0 * p, 1.0];
        let g: f64 = square.iter().zip(self.z).map(|(c, z)| c * z).sum();
        let g = g - (point.tau - self.point.tau) * (error - a * g);
        let at_pole = a * a - 2.0 * point.zeta * point.omega * a + point.omega * point.omega;
        let mut z = g / (at_pole * at_pole);
        for state in &mut other.z {
            *state = z;
            z *= -a;
        }
        other
            .columns
            .iter()
            .flatten()
            .flat_map(|pair| &pair.0)
            .chain(&other.z)
            .all(|x| x.is_finite())
            .then_some(other)
    }

    /// Returns the point at which the filter was built.
    pub fn point(&self) -> Point {
        self.point
    }

    /// Returns the delay in whole samples. [`Basis::step`] needs the errors of `delay`, `delay + 1` and `delay + 2`
    /// samples ago.
    pub fn delay(&self) -> usize {
        self.delay
    }

    /// Returns the scale factor of each response: the reciprocal of its unscaled gain at [`REFERENCE_RAD_S`].
    pub fn scale_factors(&self) -> [f64; GAIN_COUNT] {
        self.scale
    }

    /// Returns the delayed error, interpolated between the errors of `delay` and `delay + 1` samples ago.
    #[inline(always)]
    pub fn delayed(&self, [now, before]: [f64; 2]) -> f64 {
        now * (1.0 - self.part) + before * self.part
    }

    /// Advances the filter by one sample and returns its signals. `errors` are the errors of `delay`, `delay + 1` and
    /// `delay + 2` samples ago.
    #[inline(always)]
    pub fn step(&mut self, errors: [f64; 3]) -> Signals {
        let mut sums = [F64x2::ZERO; SIGNAL_COUNT / 2];
        for i in 0..sums.len() {
            for j in 0..N {
                sums[i] += self.columns[j][i] * F64x2::splat(self.z[j]);
            }
            for j in 0..3 {
                sums[i] += self.taps[j][i] * F64x2::splat(errors[j]);
            }
        }
        let mut signals: Signals = core::array::from_fn(|i| sums[i / 2].0[i % 2]);
        let mut last = self.delayed([errors[0], errors[1]]);
        for i in 0..N {
            self.z[i] = signals[i];
            last -= self.monic[i] * signals[i];
        }
        signals[N] = last;
        signals
    }

    /// Returns the responses and their derivatives, computed from the signals.
    #[inline(always)]
    pub fn regressors(&self, z: &Signals) -> Regressors {
        let Point { omega, zeta, .. } = self.point;
        let (p, q) = (2.0 * zeta * omega, omega * omega);
        let through: [f64; PRODUCT_COUNT] = core::array::from_fn(|i| z[i + 2] + p * z[i + 1] + q * z[i]);
        let mut r = Regressors {
            x: [0.0; GAIN_COUNT],
            by: [[0.0; GAIN_COUNT]; DYNAMICS_COUNT],
        };
        for i in 0..GAIN_COUNT {
            let s = self.scale[i] * q;
            r.x[i] = s * through[i];
            r.by[0][i] = 2.0 / omega * r.x[i] - 2.0 * s * (zeta * z[i + 1] + omega * z[i]);
            r.by[1][i] = -2.0 * omega * s * z[i + 1];
            r.by[2][i] = -s * through[i + 1];
        }
        r
    }

    /// Returns the weights of the signals in the response `sum_i theta_i (r_i + sum_j c_j dr_i/dj)` with the gains
    /// theta and the corrections c.
    pub fn weights(&self, gains: &[f64; GAIN_COUNT], corrections: &[f64; DYNAMICS_COUNT]) -> Signals {
        let Point { omega, zeta, .. } = self.point;
        let (p, q) = (2.0 * zeta * omega, omega * omega);
        let [of_omega, of_zeta, of_tau] = *corrections;
        let mut weights = [0.0; SIGNAL_COUNT];
        for i in 0..GAIN_COUNT {
            let a = gains[i] * self.scale[i] * q;
            let b = a * (1.0 + 2.0 * of_omega / omega);
            weights[i] += b * q - 2.0 * a * omega * of_omega;
            weights[i + 1] += b * p - 2.0 * a * (zeta * of_omega + omega * of_zeta) - a * of_tau * q;
            weights[i + 2] += b - a * of_tau * p;
            weights[i + 3] -= a * of_tau;
        }
        weights
    }

    /// Returns the factors that convert gains from the units of this basis to the units of the basis `to`.
    pub(super) fn gain_conversion(&self, to: &Self) -> [f64; GAIN_COUNT] {
        core::array::from_fn(|i| self.scale[i] / to.scale[i])
    }

    /// Resets the filter to rest.
    pub fn reset(&mut self) {
        self.z = [0.0; N];
    }

    /// Returns the frequency response of each r_i at a frequency in rad/s, with the natural frequency, damping and
    /// delay of the point `at`.
    pub fn response(&self, omega_rad_s: f64, at: Point) -> [Complex; GAIN_COUNT] {
        let w = omega_rad_s;
        let square = at.omega * at.omega;
        let poles = complex_product(
            [1.0 / self.point.lag, w],
            [square - w * w, 2.0 * at.zeta * at.omega * w],
        );
        let half = 0.5 * w * self.sample_time;
        let hold = if half == 0.0 { 1.0 } else { libm::sin(half) / half };
        let (sin, cos) = libm::sincos(-at.tau * w);
        let size = square * hold * hold;
        let common = complex_quotient([size * cos, size * sin], poles);
        let mut power = [1.0, 0.0];
        core::array::from_fn(|i| {
            let h = complex_product(common, power).map(|h| h * self.scale[i]);
            power = complex_product(power, [0.0, w]);
            h
        })
    }

    /// Returns the matrix that maps the gains to K_e and K_e_dot of the gain and lead nearest to `N(s)/(s + a)`, where
    /// N is the numerator, at the given frequencies in rad/s. The fit is by least squares in `K_e + K_e_dot j omega`;
    /// it is linear in the gains and independent of poles and delay.
    pub fn gain_and_lead_matrix(&self, at_rad_s: &[f64]) -> [[f64; GAIN_COUNT]; 2] {
        let (a, count) = (1.0 / self.point.lag, at_rad_s.len() as f64);
        let squares: f64 = at_rad_s.iter().map(|w| w * w).sum();
        let mut map = [[0.0; GAIN_COUNT]; 2];
        for w in at_rad_s {
            let mut power = [1.0, 0.0];
            for i in 0..GAIN_COUNT {
                let [re, im] = complex_quotient(power, [a, *w]);
                map[0][i] += self.scale[i] * re / count;
                map[1][i] += self.scale[i] * w * im / squares;
                power = complex_product(power, [0.0, *w]);
            }
        }
        map
    }
}

/// Number of products `Q z_i` in the responses and their derivatives with respect to the delay.
const PRODUCT_COUNT: usize = SIGNAL_COUNT - 2;

pub(super) fn complex_product(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

pub(super) fn complex_quotient(a: Complex, b: Complex) -> Complex {
    let square = b[0] * b[0] + b[1] * b[1];
    let [re, im] = complex_product(a, [b[0], -b[1]]);
    [re / square, im / square]
}

fn matrix_product(a: &SquareMatrix, b: &SquareMatrix) -> SquareMatrix {
    core::array::from_fn(|i| core::array::from_fn(|j| (0..M).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Returns the matrix exponential. The matrix is scaled to a norm below 1/4, its Taylor series is summed to order 14,
/// and the result is squared repeatedly. The truncation error is below 1e-20 (C. Moler and C. Van Loan, *SIAM Review*
/// 45 (2003) 3-49).
fn matrix_exponential(m: &SquareMatrix) -> SquareMatrix {
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
    let scaled: SquareMatrix = m.map(|row| row.map(|x| x * scale));
    let mut sum = [[0.0; M]; M];
    (0..M).for_each(|i| sum[i][i] = 1.0);
    let mut term = sum;
    for k in 1..=14 {
        term = matrix_product(&term, &scaled).map(|row| row.map(|x| x / f64::from(k)));
        for (row, t) in sum.iter_mut().zip(&term) {
            for (s, t) in row.iter_mut().zip(t) {
                *s += t;
            }
        }
    }
    for _ in 0..halvings {
        sum = matrix_product(&sum, &sum);
    }
    sum
}

#[cfg(test)]
mod tests;
