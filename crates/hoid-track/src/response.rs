//! The response of an estimate at a frequency: the quantity that a few seconds of data determine best.
//!
//! For the polynomials, `H = B z^-nk/(A F)` at `z = e^{j omega Ts}`, with the derivatives
//!
//! `dH/db_j = z^-(nk+j)/(A F)`, `dH/da_j = -H z^-j/A`, `dH/df_j = -H z^-j/F`,
//!
//! so that the covariance of theta gives the covariance of the real and imaginary parts. The errors of gain and phase
//! follow to first order: `d ln H = dH/H`, whose real part is the relative change in the gain and whose imaginary part
//! is the change in the phase.

use hoid_model::{Orders, SampleTime, uncertainty::Estimate};

/// Decibels that correspond to a factor of e.
const DB: f64 = 8.685_889_638_065_037;

/// Response at a frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Real and imaginary parts.
    pub value: [f64; 2],
    /// Covariance of the real and imaginary parts; NaN if there is none.
    pub covariance: [[f64; 2]; 2],
}

impl Response {
    /// Number of values of a packed response.
    pub(crate) const PACKED_LEN: usize = 5;

    /// Packs the real and imaginary parts, and the upper triangle of their covariance.
    pub(crate) fn pack(&self) -> [f64; Self::PACKED_LEN] {
        let ([re, im], [[a, b], [_, c]]) = (self.value, self.covariance);
        [re, im, a, b, c]
    }

    /// Unpacks the numbers of [`Response::pack`]; `None` if there is no response.
    pub(crate) fn unpack(numbers: &[f64]) -> Option<Self> {
        let &[re, im, a, b, c] = numbers else { return None };
        let sound = re.is_finite() && im.is_finite();
        sound.then_some(Self {
            value: [re, im],
            covariance: [[a, b], [b, c]],
        })
    }

    /// Returns the response with its phase increased by an angle in rad.
    pub(crate) fn advanced(&self, angle_rad: f64) -> Self {
        let (sin, cos) = angle_rad.sin_cos();
        let turn = [[cos, -sin], [sin, cos]];
        let ([re, im], c) = (self.value, &self.covariance);
        let element = |i: usize, j: usize| -> f64 {
            let pairs = (0..2).flat_map(|k| (0..2).map(move |l| (k, l)));
            pairs.map(|(k, l)| turn[i][k] * c[k][l] * turn[j][l]).sum()
        };
        Self {
            value: turn.map(|row| row[0] * re + row[1] * im),
            covariance: [0, 1].map(|i| [0, 1].map(|j| element(i, j))),
        }
    }

    /// |H| in dB.
    pub fn gain_db(&self) -> Estimate {
        let [re, im] = self.value;
        Estimate::with_variance(DB * re.hypot(im).ln(), DB * DB * self.variance_along([re, im]))
    }

    /// Phase in degrees, between -180 and 180.
    pub fn phase_deg(&self) -> Estimate {
        let [re, im] = self.value;
        let degrees = 180.0 / std::f64::consts::PI;
        Estimate::with_variance(
            degrees * im.atan2(re),
            degrees * degrees * self.variance_along([-im, re]),
        )
    }

    /// Returns the variance of the response along the direction `[a, b]`, a vector with the magnitude of H, divided
    /// by |H|^4.
    fn variance_along(&self, [a, b]: [f64; 2]) -> f64 {
        let c = &self.covariance;
        let square = self.value[0] * self.value[0] + self.value[1] * self.value[1];
        (a * a * c[0][0] + 2.0 * a * b * c[0][1] + b * b * c[1][1]) / (square * square)
    }

    /// Covariance of the real and imaginary parts of `dH/H`; `None` if there is none.
    pub(crate) fn relative_covariance(&self) -> Option<[[f64; 2]; 2]> {
        let [re, im] = self.value;
        let (real, imaginary) = (self.variance_along([re, im]), self.variance_along([-im, re]));
        // The variance along the sum of both directions contains twice the covariance.
        let both = self.variance_along([re - im, im + re]);
        let cross = 0.5 * (both - real - imaginary);
        [real, imaginary, cross]
            .iter()
            .all(|v| v.is_finite())
            .then_some([[real, cross], [cross, imaginary]])
    }

    /// Returns the real and imaginary parts of the response of polynomials with the coefficients theta and these
    /// orders.
    pub(crate) fn polynomial_response_value(
        orders: &Orders,
        theta: &[f64],
        omega_rad_s: f64,
        sample_time: SampleTime,
    ) -> [f64; 2] {
        let o = orders;
        let (sin, cos) = (-omega_rad_s * sample_time.s()).sin_cos();
        let sum = |first: [f64; 2], of: &[f64]| {
            // Horner's scheme in q^-1, with the constant coefficient `first`.
            let inner = of.iter().rev().fold([0.0; 2], |sum, c| {
                let [re, im] = complex_product(sum, [cos, sin]);
                [re + c, im]
            });
            let [re, im] = complex_product(inner, [cos, sin]);
            [first[0] + re, first[1] + im]
        };
        let (first_b, first_f) = (o.na, o.na + o.nb + o.nc + o.nd);
        let (a, f) = (
            sum([1.0, 0.0], &theta[..o.na]),
            sum([1.0, 0.0], &theta[first_f..first_f + o.nf]),
        );
        // B has no constant coefficient: b_0 is multiplied by q^-nk.
        let b = sum([0.0; 2], &theta[first_b..first_b + o.nb]);
        let (sin, cos) = (-omega_rad_s * sample_time.s() * (o.nk as f64 - 1.0)).sin_cos();
        complex_quotient(complex_product(b, [cos, sin]), complex_product(a, f))
    }

    /// Returns the response of polynomials with the coefficients theta and these orders; `covariance` is the covariance
    /// of theta by rows.
    pub(crate) fn from_polynomials(
        orders: &Orders,
        theta: &[f64],
        covariance: Option<&[f64]>,
        omega_rad_s: f64,
        sample_time: SampleTime,
    ) -> Self {
        let angle = -omega_rad_s * sample_time.s();
        let power = |k: usize| {
            let (sin, cos) = (angle * k as f64).sin_cos();
            [cos, sin]
        };
        let o = orders;
        let (first_b, first_f) = (o.na, o.na + o.nb + o.nc + o.nd);
        let monic = |from: usize, n: usize| {
            (0..n).fold([1.0, 0.0], |[re, im], j| {
                let [c, s] = power(j + 1);
                [re + theta[from + j] * c, im + theta[from + j] * s]
            })
        };
        let (a, f) = (monic(0, o.na), monic(first_f, o.nf));
        let poles = complex_product(a, f);
        let b = (0..o.nb).fold([0.0; 2], |[re, im], j| {
            let [c, s] = power(o.nk + j);
            [re + theta[first_b + j] * c, im + theta[first_b + j] * s]
        });
        let value = complex_quotient(b, poles);
        let mut gradient = vec![[0.0; 2]; theta.len()];
        let minus = [-value[0], -value[1]];
        for j in 0..o.nb {
            gradient[first_b + j] = complex_quotient(power(o.nk + j), poles);
        }
        for j in 0..o.na {
            gradient[j] = complex_quotient(complex_product(minus, power(j + 1)), a);
        }
        for j in 0..o.nf {
            gradient[first_f + j] = complex_quotient(complex_product(minus, power(j + 1)), f);
        }
        let mut spread = [[f64::NAN; 2]; 2];
        if let Some(c) = covariance {
            spread = [[0.0; 2]; 2];
            for (i, gi) in gradient.iter().enumerate() {
                for (j, gj) in gradient.iter().enumerate() {
                    for (row, a) in spread.iter_mut().zip(gi) {
                        for (s, b) in row.iter_mut().zip(gj) {
                            *s += a * c[i * theta.len() + j] * b;
                        }
                    }
                }
            }
        }
        Self {
            value,
            covariance: spread,
        }
    }
}

fn complex_product(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

fn complex_quotient(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let square = b[0] * b[0] + b[1] * b[1];
    let [re, im] = complex_product(a, [b[0], -b[1]]);
    [re / square, im / square]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const ORDERS: Orders = Orders {
        na: 1,
        nb: 2,
        nc: 0,
        nd: 1,
        nf: 2,
        nk: 3,
    };
    const THETA: [f64; 6] = [-0.3, 0.05, -0.04, -0.8, -1.7, 0.74];

    fn at(theta: &[f64], covariance: Option<&[f64]>) -> Response {
        Response::from_polynomials(&ORDERS, theta, covariance, 4.0, SampleTime::AT_100_HZ)
    }

    #[test]
    fn covariance_agrees_with_finite_differences() {
        let p = THETA.len();
        let mut covariance = vec![0.0; p * p];
        for i in 0..p {
            for j in 0..p {
                covariance[i * p + j] = if i == j { 1e-4 * (1.0 + i as f64) } else { 1e-5 };
            }
        }
        let exact = at(&THETA, Some(&covariance));
        let columns: Vec<[f64; 2]> = (0..p)
            .map(|i| {
                let moved = |h: f64| {
                    let mut theta = THETA;
                    theta[i] += h;
                    at(&theta, None).value
                };
                let (up, down) = (moved(1e-6), moved(-1e-6));
                [(up[0] - down[0]) / 2e-6, (up[1] - down[1]) / 2e-6]
            })
            .collect();
        for a in 0..2 {
            for b in 0..2 {
                let mut expected = 0.0;
                for i in 0..p {
                    for j in 0..p {
                        expected += columns[i][a] * covariance[i * p + j] * columns[j][b];
                    }
                }
                let size = (exact.covariance[0][0] * exact.covariance[1][1]).sqrt();
                assert!((exact.covariance[a][b] - expected).abs() < 1e-6 * size);
            }
        }
    }

    #[test]
    fn value_without_covariance_is_the_same() {
        let whole = at(&THETA, None).value;
        let alone = Response::polynomial_response_value(&ORDERS, &THETA, 4.0, SampleTime::AT_100_HZ);
        assert!(
            (0..2).all(|i| (whole[i] - alone[i]).abs() < 1e-14),
            "{whole:?} {alone:?}"
        );
    }

    #[test]
    fn gain_and_phase_match_the_complex_value() {
        let response = Response {
            value: [0.0, -10.0],
            covariance: [[0.04, 0.0], [0.0, 0.01]],
        };
        let (gain, phase) = (response.gain_db(), response.phase_deg());
        assert!((gain.value - 20.0).abs() < 1e-12 && (phase.value + 90.0).abs() < 1e-12);
        // The imaginary part is along H, the real part is perpendicular to H.
        assert!((gain.standard_error.unwrap() - DB * 0.01).abs() < 1e-12);
        assert!((phase.standard_error.unwrap() - 0.02_f64.to_degrees()).abs() < 1e-12);
        assert!(at(&THETA, None).gain_db().standard_error.is_none());
        // dH/H = dH/(-10 j): the imaginary part is along H.
        let [[a, b], [_, c]] = response.relative_covariance().unwrap();
        assert!((a - 1e-4).abs() < 1e-15 && b.abs() < 1e-15 && (c - 4e-4).abs() < 1e-15);
        let oblique = Response {
            value: [3.0, 4.0],
            covariance: [[0.04, 0.01], [0.01, 0.09]],
        };
        // The expected covariance is M C M' with M = [[3, 4], [-4, 3]]/25.
        let [[a, b], [_, c]] = oblique.relative_covariance().unwrap();
        for (found, expected) in [(a, 2.04), (b, 0.53), (c, 1.21)] {
            assert!((found - expected / 625.0).abs() < 1e-15, "{found} {expected}");
        }
        assert_eq!(at(&THETA, None).relative_covariance(), None);
    }
}
