//! Response of the neuromuscular system to a held error and to its rate, with derivatives with respect to omega_nm and
//! zeta_nm.
//!
//! With the coefficients of the exact hold of [`hoid_core::zoh_operator`] for the gains `[1, 0]` and `[0, 1]`,
//!
//! `x(t) = b0 e(t) + b1 e(t-1) - f1 x(t-1) - f2 x(t-2)`,
//! `x'(t) = b0' e(t) + b1' e(t-1) - f1' x(t-1) - f2' x(t-2) - f1 x'(t-1) - f2 x'(t-2)`,
//!
//! where `'` is the derivative with respect to omega_nm or zeta_nm. The filters are linearised about a point
//! `[omega, zeta]`. When this point moves, the states of the filters are moved along their derivatives. A filter with
//! states that belong to another point would have a kink there, which the whitening filter, a difference of high order,
//! amplifies above the noise.

use hoid_core::zoh_operator::zoh_operator;

/// The signals x1 and x2, their derivatives with respect to omega_nm, and their derivatives with respect to zeta_nm.
pub type Signals = [f64; 6];

/// The filters of the neuromuscular system and their past signals.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// Linearisation point `[omega_nm, zeta_nm]`.
    point: [f64; 2],
    sample_time: f64,
    /// Coefficients `b[gain][lag]` and `f[lag - 1]`, each with its derivatives with respect to omega_nm and zeta_nm.
    b: [[[f64; 3]; 2]; 2],
    f: [[f64; 3]; 2],
    input: f64,
    past: [Signals; 2],
}

hoid_core::state!([] Response { point, b, f, input, past });

impl Response {
    /// Creates filters at rest that are linearised about the point `[omega_nm, zeta_nm]` (rad/s, 1). The sample time is
    /// in s.
    pub fn new(point: [f64; 2], sample_time: f64) -> Self {
        let mut response = Self {
            point,
            sample_time,
            b: [[[0.0; 3]; 2]; 2],
            f: [[0.0; 3]; 2],
            input: 0.0,
            past: [[0.0; 6]; 2],
        };
        response.set(point);
        response
    }

    fn set(&mut self, point: [f64; 2]) {
        self.point = point;
        for (gain, gains) in [[1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
            let (value, by) = zoh_operator([gains[0], gains[1], point[0], point[1]], self.sample_time);
            for lag in 0..2 {
                self.b[gain][lag] = [value[lag], by[lag][2], by[lag][3]];
                self.f[lag] = [value[2 + lag], by[2 + lag][2], by[2 + lag][3]];
            }
        }
    }

    /// Processes one sample of the delayed error and returns the signals at that sample.
    #[inline(always)]
    pub fn step(&mut self, e: f64) -> Signals {
        let ([f1, f2], [x1, x2]) = (&self.f, &self.past);
        let mut x = [0.0; 6];
        for gain in 0..2 {
            let [b0, b1] = &self.b[gain];
            x[gain] = b0[0] * e + b1[0] * self.input - f1[0] * x1[gain] - f2[0] * x2[gain];
            for by in 1..3 {
                let i = 2 * by + gain;
                x[i] = b0[by] * e + b1[by] * self.input
                    - f1[by] * x1[gain]
                    - f2[by] * x2[gain]
                    - f1[0] * x1[i]
                    - f2[0] * x2[i];
            }
        }
        self.input = e;
        self.past = [x, *x1];
        x
    }

    /// Moves the linearisation point. The past signals of these filters and of `elsewhere` are moved along their first
    /// derivatives.
    pub fn move_to<'a>(&mut self, point: [f64; 2], elsewhere: impl IntoIterator<Item = &'a mut Signals>) {
        let by = [point[0] - self.point[0], point[1] - self.point[1]];
        if by == [0.0; 2] || !point.iter().all(|a| a.is_finite()) {
            return;
        }
        let along = |x: &mut Signals| {
            for gain in 0..2 {
                x[gain] += by[0] * x[2 + gain] + by[1] * x[4 + gain];
            }
        };
        elsewhere.into_iter().for_each(along);
        self.past.iter_mut().for_each(along);
        self.set(point);
    }

    /// Resets the filters to rest.
    pub fn reset(&mut self) {
        self.input = 0.0;
        self.past = [[0.0; 6]; 2];
    }

    /// Returns the linearisation point `[omega_nm, zeta_nm]`.
    #[inline(always)]
    pub fn point(&self) -> [f64; 2] {
        self.point
    }
}
