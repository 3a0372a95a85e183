//! Divided differences of the exponential at two poles, from which the hold of every second-order system follows.
//!
//! Two poles multiplied by the time, `z1, z2`, enter through their sum `s = z1 + z2` and product `q = z1 z2`. With the
//! complete symmetric polynomials `h_k = s h_{k-1} - q h_{k-2}`, `h_0 = 1`,
//!
//! `Phi_j = sum over k of h_k/(k+j)!`: `Phi_1 = exp[z1, z2]`, `Phi_2 = exp[0, z1, z2]`, and
//! `Phi_j = 1/j! + s Phi_{j+1} - q Phi_{j+2}`.
//!
//! All Phi_j are entire functions of (s, q), so the same functions apply to complex, real and double poles and to poles
//! at the origin. To avoid cancellation they are evaluated in different ways:
//!
//! - small poles: backward recursion for the Phi_j from `Phi_j = 1/j!` (Clenshaw's summation), and the corresponding
//!   recursion for the slopes `D_j = dPhi_j/ds`, `D_j = Phi_{j+1} + s D_{j+1} - q D_{j+2}`, with no division and no
//!   elementary function;
//! - other poles: with `h = s/2`, `x = h^2 - q`, `E = e^h`, `C = cosh sqrt x`, `S = sinh sqrt x/sqrt x`,
//!   `G = dS/dx = (C - S)/(2x)`, the formulas `Phi_1 = E S`, `q Phi_2 = 1 - E C + h E S`, `D_2 = E G`; real poles that
//!   are far apart use the divided differences directly.
//!
//! Sources: N. J. Higham, *Functions of Matrices*, 2008, sections 2.4 and B.16; C. W. Clenshaw,
//! *Mathematical Tables and Other Aids to Computation* 9, 1955, 118-120.

/// Divided differences of the exponential at a pair of poles; all are NaN if the pair is not finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DividedDifferences {
    /// `s = z1 + z2`.
    pub sum: f64,
    /// `q = z1 z2`.
    pub product: f64,
    /// `(e^z1 + e^z2)/2 = E C`.
    pub mean: f64,
    /// `Phi_1 = exp[z1, z2] = E S`.
    pub phi1: f64,
    /// `Phi_2 = exp[0, z1, z2]`.
    pub phi2: f64,
    /// `D_2 = dPhi_2/ds = E G`.
    pub phi2_slope: f64,
}

/// Reciprocal factorials `1/n!`.
const RECIPROCALS: [f64; 24] = reciprocal_factorials();

const fn reciprocal_factorials() -> [f64; 24] {
    let mut all = [1.0; 24];
    let (mut n, mut factorial) = (1, 1.0);
    while n < all.len() {
        // The factorial is exact up to 22!.
        factorial *= n as f64;
        all[n] = 1.0 / factorial;
        n += 1;
    }
    all
}

impl DividedDifferences {
    /// Evaluates the divided differences at the poles with this sum and product.
    pub fn at(sum: f64, product: f64) -> Self {
        let half = sum / 2.0;
        let x = half * half - product;
        // Upper bound on |z|^2 of both poles: (|h| + sqrt x)^2 is at most 2 (h^2 + x).
        let size = if x < 0.0 { product } else { 2.0 * (half * half + x) };
        // The relative size |z|^N/N! of the first omitted term is below 3e-17.
        if size <= 1.0 / 64.0 {
            Self::from_series::<11>(sum, product)
        } else if size <= 0.25 {
            Self::from_series::<15>(sum, product)
        } else if size <= 2.0 {
            Self::from_series::<21>(sum, product)
        } else {
            Self::from_exponentials(sum, product)
        }
    }

    /// `Phi_0 = E C + h E S`.
    pub fn phi0(&self) -> f64 {
        self.mean + self.sum / 2.0 * self.phi1
    }

    /// `dPhi_1/ds = D_1`.
    pub fn phi1_slope(&self) -> f64 {
        (self.phi1 + self.sum * self.phi2_slope) / 2.0
    }

    /// `chi = exp[0, z1] exp[0, z2] = (1 - e^z1)(1 - e^z2)/q`.
    ///
    /// chi is the determinant of `I - e^A` divided by q, where A is the companion matrix. For stable poles it is a sum
    /// of positive terms.
    pub fn chi(&self) -> f64 {
        self.phi1 * (self.phi1 - self.sum * self.phi2) + self.product * self.phi2 * self.phi2
    }

    /// `dchi/ds = Phi_1^2 - Phi_0 Phi_2`.
    pub fn chi_slope(&self) -> f64 {
        self.phi1 * self.phi1 - self.phi0() * self.phi2
    }

    /// Evaluates the series by Clenshaw's summation, downwards from `Phi_{N+1}`.
    #[inline]
    fn from_series<const N: usize>(s: f64, q: f64) -> Self {
        let (mut phi, mut phi_above) = (RECIPROCALS[N + 1], RECIPROCALS[N + 2]);
        let (mut slope, mut slope_above) = (RECIPROCALS[N + 2], 0.0);
        for j in (2..=N).rev() {
            (slope, slope_above) = (phi - q * slope_above + s * slope, slope);
            (phi, phi_above) = (RECIPROCALS[j] - q * phi_above + s * phi, phi);
        }
        let phi1 = 1.0 - q * phi_above + s * phi;
        Self {
            sum: s,
            product: q,
            mean: 1.0 - (q * phi - s / 2.0 * phi1),
            phi1,
            phi2: phi,
            phi2_slope: slope,
        }
    }

    #[cold]
    fn from_exponentials(s: f64, q: f64) -> Self {
        if !(s.is_finite() && q.is_finite()) {
            return Self {
                sum: s,
                product: q,
                mean: f64::NAN,
                phi1: f64::NAN,
                phi2: f64::NAN,
                phi2_slope: f64::NAN,
            };
        }
        let h = s / 2.0;
        let x = h * h - q;
        let [mean, phi1, phi2_slope, phi2] = if x < 0.0 {
            complex_poles(h, q, x)
        } else {
            real_poles(h, q, x)
        };
        Self {
            sum: s,
            product: q,
            mean,
            phi1,
            phi2,
            phi2_slope,
        }
    }
}

/// Returns `[E C, Phi_1, D_2, Phi_2]` for complex poles, `x = h^2 - q < 0`.
fn complex_poles(h: f64, q: f64, x: f64) -> [f64; 4] {
    let r = libm::sqrt(-x);
    let e = libm::exp(h);
    let (sin, cos) = libm::sincos(r);
    let mean = e * cos;
    let (phi1, phi2_slope) = if x > -1.0 {
        near_double_pole(e, x)
    } else {
        let phi1 = e * sin / r;
        (phi1, (mean - phi1) / (2.0 * x))
    };
    // In this branch q > 2.
    [mean, phi1, phi2_slope, (1.0 - mean + h * phi1) / q]
}

/// Returns `[E C, Phi_1, D_2, Phi_2]` for real poles, `x = h^2 - q >= 0`.
fn real_poles(h: f64, q: f64, x: f64) -> [f64; 4] {
    let r = libm::sqrt(x);
    let far = h + libm::copysign(r, h);
    // The poles h + r and h - r have the product q; the pole nearer to the origin is computed from q, since the
    // difference of h and r would cancel.
    let near = q / far;
    let (near_exp, near_expm1) = exp_and_expm1(near);
    let (far_exp, far_expm1) = exp_and_expm1(far);
    let mean = (near_exp + far_exp) / 2.0;
    let (phi1, phi2_slope) = if x < 1.0 {
        near_double_pole(libm::exp(h), x)
    } else {
        let phi1 = (far_exp - near_exp) / (far - near);
        (phi1, (mean - phi1) / (2.0 * x))
    };
    // If the poles are farther apart than this, their differences are used, because q may be zero; for closer poles q
    // is above 0.5.
    let phi2 = if r > 0.25 {
        let near_ratio = if near == 0.0 { 1.0 } else { near_expm1 / near };
        (far_expm1 / far - near_ratio) / (far - near)
    } else {
        (1.0 - mean + h * phi1) / q
    };
    [mean, phi1, phi2_slope, phi2]
}

/// Returns `E S` and `E G` for `|x| < 1`, from `S = sum x^k/(2k+1)!`, `G = sum (k+1) x^k/(2k+3)!`.
fn near_double_pole(e: f64, x: f64) -> (f64, f64) {
    let (mut s, mut g) = (0.0, 0.0);
    for k in (0..10).rev() {
        s = RECIPROCALS[2 * k + 1] + x * s;
        g = (k + 1) as f64 * RECIPROCALS[2 * k + 3] + x * g;
    }
    (e * s, e * g)
}

/// Returns `e^z` and `e^z - 1`, both with full relative precision.
fn exp_and_expm1(z: f64) -> (f64, f64) {
    if z.abs() < 0.5 {
        let m = libm::expm1(z);
        (1.0 + m, m)
    } else {
        let e = libm::exp(z);
        (e, e - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const NAMES: [&str; 8] = [
        "mean",
        "phi1",
        "phi2",
        "phi2_slope",
        "phi0",
        "phi1_slope",
        "chi",
        "chi_slope",
    ];

    fn values(d: &DividedDifferences) -> [f64; 8] {
        let (phi0, phi1_slope) = (d.phi0(), d.phi1_slope());
        [
            d.mean,
            d.phi1,
            d.phi2,
            d.phi2_slope,
            phi0,
            phi1_slope,
            d.chi(),
            d.chi_slope(),
        ]
    }

    /// Returns the scale of the rounding error of each value: the value itself; near a zero crossing, as for fast
    /// complex poles, the amplitude of sine and cosine; for a sum, the sum of the magnitudes.
    fn scales(s: f64, q: f64, values: &[f64; 8]) -> [f64; 8] {
        let [mut mean, mut phi1, phi2, mut phi2_slope, ..] = values.map(f64::abs);
        let x = s * s / 4.0 - q;
        if x < -1.0 {
            mean = (s / 2.0).exp();
            phi1 = mean / (-x).sqrt();
            phi2_slope = (mean + phi1) / (-2.0 * x);
        }
        let (s, q) = (s.abs(), q.abs());
        let phi0 = mean + s / 2.0 * phi1;
        [
            mean,
            phi1,
            phi2,
            phi2_slope,
            phi0,
            (phi1 + s * phi2_slope) / 2.0,
            phi1 * (phi1 + s * phi2) + q * phi2 * phi2,
            phi1 * phi1 + phi0 * phi2,
        ]
    }

    fn assert_close(s: f64, q: f64, found: &[f64; 8], expected: &[f64; 8], tolerance: f64) {
        let scales = scales(s, q, expected);
        for i in 0..8 {
            let error = (found[i] - expected[i]).abs() / scales[i];
            assert!(
                error <= tolerance * f64::EPSILON,
                "{} at s = {s}, q = {q}: {} and {}, {:.1} eps",
                NAMES[i],
                found[i],
                expected[i],
                error / f64::EPSILON
            );
        }
    }

    #[test]
    fn values_agree_with_60_digit_reference() {
        // From fixtures/hold/make.py.
        let lines = include_str!("../../../fixtures/hold/divided_differences.csv").lines();
        for line in lines.skip(1) {
            let number: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
            let (s, q) = (number[0], number[1]);
            let expected = core::array::from_fn(|i| number[i + 2]);
            // One ulp each from exponential, root, sine and quotient, and |z|/2 more from their argument, with |z| up
            // to 6 for complex poles. The largest errors are 2.1 for |z| < 1.4, 2.9 for all values except phi2, and 8.7
            // for phi2, a difference, at |z| = 6.
            assert_close(s, q, &values(&DividedDifferences::at(s, q)), &expected, 16.0);
        }
    }

    /// Returns pairs of every kind with this size: complex, double and real poles, and one pole at the origin, with
    /// both signs.
    fn pairs_of_size(size: f64) -> Vec<(f64, f64)> {
        let mut all = Vec::new();
        for sign in [-1.0, 1.0] {
            for zeta in [0.0, 0.05, 0.35, 0.9] {
                all.push((sign * 2.0 * zeta * size.sqrt(), size));
            }
            for zeta in [1.0, 1.0 + 1e-9, 1.7, 4.0] {
                // size = 4 h^2 - 2 q.
                let q = size / (4.0 * zeta * zeta - 2.0);
                all.push((sign * 2.0 * zeta * q.sqrt(), q));
            }
            all.push((sign * size.sqrt(), 0.0));
            all.push((sign * 0.1, (0.01 - size) / 2.0));
        }
        all
    }

    #[test]
    fn evaluation_methods_agree_at_their_boundaries() {
        let meet = |size: f64, one: fn(f64, f64) -> DividedDifferences, other: fn(f64, f64) -> DividedDifferences| {
            for (s, q) in pairs_of_size(size) {
                // Each value is within 16 eps of the exact value.
                assert_close(s, q, &values(&one(s, q)), &values(&other(s, q)), 32.0);
            }
        };
        meet(
            1.0 / 64.0,
            DividedDifferences::from_series::<11>,
            DividedDifferences::from_series::<15>,
        );
        meet(
            0.25,
            DividedDifferences::from_series::<15>,
            DividedDifferences::from_series::<21>,
        );
        meet(
            2.0,
            DividedDifferences::from_series::<21>,
            DividedDifferences::from_exponentials,
        );
    }

    #[test]
    fn exponential_branches_agree_at_their_boundaries() {
        for h in [-6.0, -1.5, 1.5] {
            // x = h^2 - q at -1, 0, 1 and where sqrt x = 0.25.
            for x in [-1.0, 0.0, 0.0625, 1.0] {
                assert_branches_agree(2.0 * h, h * h - x);
            }
        }
        // The pole nearer to the origin is at -0.5 and at 0.5.
        assert_branches_agree(-3.5, 1.5);
        assert_branches_agree(3.5, 1.5);
    }

    fn assert_branches_agree(s: f64, q: f64) {
        let at = |q: f64| values(&DividedDifferences::at(s, q));
        for neighbour in [q.next_down(), q.next_up()] {
            // Each value is within 16 eps of the exact value, which itself changes by less than one eps.
            assert_close(s, q, &at(neighbour), &at(q), 33.0);
        }
    }

    #[test]
    fn slopes_agree_with_finite_differences() {
        for (s, q) in [
            (-0.07, 0.01),
            (-0.5, 0.2),
            (-1.5, 1.2),
            (-2.0, 1.0),
            (-4.0, 4.0),
            (-4.0, 3.97),
            (-5.0, 2.0),
            (-1.0, 7.0),
            (-2.0, 0.0),
            (0.6, 4.0),
        ] {
            let h = 1e-5;
            let exact = values(&DividedDifferences::at(s, q));
            let (up, down) = (
                values(&DividedDifferences::at(s + h, q)),
                values(&DividedDifferences::at(s - h, q)),
            );
            for (value, slope) in [(1, 5), (2, 3), (6, 7)] {
                let difference = (up[value] - down[value]) / (2.0 * h);
                // Rounding error eps/h = 2e-11 of the value; the truncation error, h^2/6 of the third derivative, is
                // smaller.
                assert!(
                    (exact[slope] - difference).abs() < 2e-10 * exact[value].abs(),
                    "{} at s = {s}, q = {q}: {} and {difference}",
                    NAMES[slope],
                    exact[slope]
                );
            }
        }
    }

    #[test]
    fn values_at_the_origin_are_exact() {
        let d = DividedDifferences::at(0.0, 0.0);
        assert_eq!(values(&d), [1.0, 1.0, 0.5, 1.0 / 6.0, 1.0, 0.5, 1.0, 0.5]);
    }

    #[test]
    fn non_finite_arguments_give_nan() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for (s, q) in [(bad, 0.01), (bad, 0.0), (-0.1, bad), (0.0, bad), (bad, bad)] {
                let found = values(&DividedDifferences::at(s, q));
                assert!(found.iter().all(|v| v.is_nan()), "{s}, {q}: {found:?}");
            }
        }
    }
}
