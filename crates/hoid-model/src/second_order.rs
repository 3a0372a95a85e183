//! Exact zero-order hold of second-order systems, and its inverse.
//!
//! The continuous system `(b0 s + b1) / (s^2 + a1 s + a2)` (eq. 12) driven by an input that is held
//! over each sample Ts is, at the samples, `(b0 + b1 q^-1) q^-1 / (1 + f1 q^-1 + f2 q^-2)` exactly.
//! With the poles `p1, p2` of the continuous system, `z_i = p_i Ts`, `s = z1 + z2 = -a1 Ts` and
//! `q = z1 z2 = a2 Ts^2`:
//!
//! - `f1 = -(e^z1 + e^z2)`, `f2 = e^s`;
//! - the impulse response of `1/(s^2 + a1 s + a2)` at Ts is `Ts phi1`, and the step response at Ts is `Ts^2 phi2`, with
//!   the divided differences of the exponential `phi1 = exp[z1, z2]` and `phi2 = exp[0, z1, z2]`;
//! - `b0_d = b0 Ts phi1 + b1 Ts^2 phi2` is the step response after one sample, and the gain at zero
//!   frequency gives `b0_d + b1_d = b1 Ts^2 chi`,
//!   `chi = (1 + f1 + f2) / q = exp[0, z1] exp[0, z2]`.
//!
//! These quantities are symmetric in the poles and entire functions of (s, q): the same formulas hold for complex, real
//! and double poles and for poles at the origin of the s plane ([`hoid_core::divided_differences`]). They replace the
//! matrix exponential and logarithm of the extended matrix (eq. B.7) and give the same results. The inverse exists if
//! no pole in z is on the closed negative real axis; the logarithm is then the principal one. Sources: N. J. Higham,
//! *Functions of Matrices*, 2008, sections 2.4 and B.16 (divided differences); eq. B.3-B.10 of the thesis.

use hoid_core::divided_differences::DividedDifferences;

use crate::{ModelError, NotConvertible, SampleTime};

/// Continuous system `(b0 s + b1) / (s^2 + a1 s + a2)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondOrder {
    /// Coefficient of s in the numerator.
    pub b0: f64,
    /// Constant coefficient of the numerator.
    pub b1: f64,
    /// Coefficient of s in the denominator.
    pub a1: f64,
    /// Constant coefficient of the denominator.
    pub a2: f64,
}

/// `(b0 + b1 q^-1) q^-1 / (1 + f1 q^-1 + f2 q^-2)`: a second-order system after a zero-order hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZohSecondOrder {
    /// First coefficient of B.
    pub b0: f64,
    /// Second coefficient of B.
    pub b1: f64,
    /// First coefficient of F.
    pub f1: f64,
    /// Second coefficient of F.
    pub f2: f64,
}

impl SecondOrder {
    /// Returns the exact discrete model for an input held over each sample.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if the result is not finite (an unstable pole so fast that its exponential overflows,
    /// or a coefficient that is not finite).
    pub fn zoh(self, sample_time: SampleTime) -> Result<ZohSecondOrder, ModelError> {
        let ts = sample_time.s();
        let poles = DividedDifferences::at(-self.a1 * ts, self.a2 * ts * ts);
        let b0 = self.b0 * ts * poles.phi1 + self.b1 * ts * ts * poles.phi2;
        ZohSecondOrder {
            b0,
            b1: self.b1 * ts * ts * poles.chi() - b0,
            f1: -2.0 * poles.mean,
            f2: poles.sum.exp(),
        }
        .check_finite()
    }
}

impl ZohSecondOrder {
    /// Returns the model if its coefficients are finite, that is, if no exponential has overflowed; otherwise an error.
    pub(crate) fn check_finite(self) -> Result<Self, ModelError> {
        for (quantity, found) in [("b0", self.b0), ("b1", self.b1), ("f1", self.f1), ("f2", self.f2)] {
            if !found.is_finite() {
                return Err(ModelError::OutOfRange {
                    quantity,
                    found,
                    expected: "a finite number; check the poles against the sample time",
                });
            }
        }
        Ok(self)
    }

    /// Returns the continuous system that has this exact discrete model.
    ///
    /// # Errors
    /// [`NotConvertible::NegativeRealPole`], [`NotConvertible::NotFinite`].
    pub fn inverse_zoh(self, sample_time: SampleTime) -> Result<SecondOrder, NotConvertible> {
        for (name, value) in [("f1", self.f1), ("f2", self.f2), ("b0", self.b0), ("b1", self.b1)] {
            if !value.is_finite() {
                return Err(NotConvertible::NotFinite {
                    name: name.to_owned(),
                    value,
                });
            }
        }
        let ts = sample_time.s();
        let (sum, product) = continuous_poles(self.f1, self.f2)?;
        let poles = DividedDifferences::at(sum, product);
        let b1 = (self.b0 + self.b1) / (ts * ts * poles.chi());
        let b0 = (self.b0 - b1 * ts * ts * poles.phi2) / (ts * poles.phi1);
        Ok(SecondOrder {
            b0,
            b1,
            a1: -sum / ts,
            a2: product / (ts * ts),
        })
    }
}

/// State space of `1/(s^2 + a1 s + a2)` in controllable canonical form (the states are the output and its rate) over
/// one sample with a held input: `x(t + Ts) = transition x(t) + input u(t)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZohStates {
    /// Transition matrix `e^{A Ts}` by rows.
    pub transition: [[f64; 2]; 2],
    /// Input vector `integral of e^{A s} B ds` over one sample.
    pub input: [f64; 2],
}

impl ZohStates {
    /// Computes, with `h = Ts phi1` and `g = Ts^2 phi2`, the transition `[[1 - a2 g, h], [-a2 h, 1 - a2 g - a1 h]]` and
    /// the input `[g, h]`.
    pub fn new(a1: f64, a2: f64, sample_time: SampleTime) -> Self {
        let ts = sample_time.s();
        let poles = DividedDifferences::at(-a1 * ts, a2 * ts * ts);
        let (h, g) = (ts * poles.phi1, ts * ts * poles.phi2);
        let kept = 1.0 - a2 * g;
        Self {
            transition: [[kept, h], [-a2 * h, kept - a1 * h]],
            input: [g, h],
        }
    }

    /// Returns the state one sample after the state x, with the input u held in between.
    #[inline]
    pub fn step(&self, x: [f64; 2], u: f64) -> [f64; 2] {
        let [[a, b], [c, d]] = self.transition;
        [
            a * x[0] + b * x[1] + self.input[0] * u,
            c * x[0] + d * x[1] + self.input[1] * u,
        ]
    }
}

/// Returns the zero-order hold of a system with a direct feedthrough d in addition to its strictly proper part,
/// `d + (b0 s + b1)/(s^2 + a1 s + a2)`. `num` and `den` are in descending powers of s.
///
/// The held system has the numerator `d + (d f1 + b0_d) q^-1 + (d f2 + b1_d) q^-2`.
///
/// # Errors
/// As [`SecondOrder::zoh`]; [`ModelError::TransferFunction`] if the leading coefficient of `den` is zero.
pub fn zoh_biproper(num: [f64; 3], den: [f64; 3], sample_time: SampleTime) -> Result<([f64; 3], [f64; 2]), ModelError> {
    if den[0] == 0.0 {
        return Err(ModelError::TransferFunction {
            found: format!("{num:?} / {den:?}"),
            expected: "expected a denominator of second order, with a nonzero leading coefficient".to_owned(),
        });
    }
    let [d, n1, n2] = num.map(|c| c / den[0]);
    let (a1, a2) = (den[1] / den[0], den[2] / den[0]);
    let proper = SecondOrder {
        b0: n1 - d * a1,
        b1: n2 - d * a2,
        a1,
        a2,
    };
    let held = proper.zoh(sample_time)?;
    Ok(([d, d * held.f1 + held.b0, d * held.f2 + held.b1], [held.f1, held.f2]))
}

/// Inverse of [`zoh_biproper`]: returns the numerator and the monic denominator in descending powers of s.
///
/// # Errors
/// As [`ZohSecondOrder::inverse_zoh`].
pub fn inverse_zoh_biproper(
    num: [f64; 3],
    f: [f64; 2],
    sample_time: SampleTime,
) -> Result<([f64; 3], [f64; 3]), NotConvertible> {
    let d = num[0];
    let held = ZohSecondOrder {
        b0: num[1] - d * f[0],
        b1: num[2] - d * f[1],
        f1: f[0],
        f2: f[1],
    };
    let proper = held.inverse_zoh(sample_time)?;
    Ok((
        [d, proper.b0 + d * proper.a1, proper.b1 + d * proper.a2],
        [1.0, proper.a1, proper.a2],
    ))
}

/// Returns the sum of the poles in s of `1 + f1 q^-1 + f2 q^-2`, times Ts, and their product, times Ts^2, by the
/// principal logarithm.
fn continuous_poles(f1: f64, f2: f64) -> Result<(f64, f64), NotConvertible> {
    let half = -f1 / 2.0;
    let x = half * half - f2;
    if x < 0.0 {
        let beta = (-x).sqrt().atan2(half);
        let alpha = f2.ln() / 2.0;
        return Ok((2.0 * alpha, alpha * alpha + beta * beta));
    }
    let outer = half + x.sqrt().copysign(half);
    let inner = if outer == 0.0 { 0.0 } else { f2 / outer };
    let lowest = outer.min(inner);
    if lowest <= 0.0 {
        return Err(NotConvertible::NegativeRealPole { pole: lowest });
    }
    // A pole near z = 1 corresponds to a pole near the origin of the s plane. Its distance from 1 is computed from the
    // value of the polynomial at 1, which the coefficients give more accurately than the difference of the roots.
    let at_one = 1.0 + f1 + f2;
    let (far_z, near_z) = if (outer - 1.0).abs() > (inner - 1.0).abs() {
        (outer, inner)
    } else {
        (inner, outer)
    };
    let near = if far_z == 1.0 || (near_z - 1.0).abs() > 0.1 {
        near_z.ln()
    } else {
        (-at_one / (1.0 - far_z)).ln_1p()
    };
    Ok((f2.ln(), near * far_z.ln()))
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;
    use num_complex::Complex64;

    use super::*;
    use crate::{
        discretise::{Method, discretise},
        transfer_function::ContinuousTransferFunction,
    };

    fn ts() -> SampleTime {
        SampleTime::new(0.01).unwrap()
    }

    fn with_poles(p1: Complex64, p2: Complex64) -> SecondOrder {
        SecondOrder {
            b0: 1.3,
            b1: -2.1,
            a1: -(p1 + p2).re,
            a2: (p1 * p2).re,
        }
    }

    /// Returns systems with poles that are complex, real, nearly equal, double, at or near the origin, unstable, or
    /// fast.
    fn cases() -> Vec<SecondOrder> {
        let c = Complex64::new;
        let r = |a: f64, b: f64| (c(a, 0.0), c(b, 0.0));
        let pair = |re: f64, im: f64| (c(re, im), c(re, -im));
        [
            pair(-3.9, 10.5),
            pair(-3.9, 1e-4),
            pair(-80.0, 250.0),
            pair(-0.001, 300.0),
            pair(0.0, 5.0),
            r(-4.0, -7.0),
            r(-4.0, -4.0),
            r(-4.0, -4.000_001),
            r(-120.0, -119.9),
            r(-150.0, -150.0),
            r(0.0, -6.0),
            r(0.0, 0.0),
            r(-1e-7, -6.0),
            r(-1e-7, -400.0),
            r(1.5, -3.0),
            r(2.0, 3.0),
            r(-900.0, -2.0),
        ]
        .into_iter()
        .map(|(a, b)| with_poles(a, b))
        .collect()
    }

    /// The zero-order hold by the extended-matrix exponential of eq. B.7.
    fn zoh_by_matrix_exponential(c: SecondOrder, ts: f64) -> ZohSecondOrder {
        let m = DMatrix::from_row_slice(3, 3, &[0.0, 1.0, 0.0, -c.a2, -c.a1, 1.0, 0.0, 0.0, 0.0]) * ts;
        let e = m.exp();
        let (a, b) = (e.view((0, 0), (2, 2)).into_owned(), e.view((0, 2), (2, 1)).into_owned());
        let row = DMatrix::from_row_slice(1, 2, &[c.b1, c.b0]);
        let f1 = -a.trace();
        let first = (&row * &b)[(0, 0)];
        let second = (&row * &a * &b)[(0, 0)];
        ZohSecondOrder {
            b0: first,
            b1: second + f1 * first,
            f1,
            f2: a[(0, 0)] * a[(1, 1)] - a[(0, 1)] * a[(1, 0)],
        }
    }

    #[test]
    fn zoh_agrees_with_the_matrix_exponential_for_all_pole_cases() {
        for case in cases() {
            let exact = case.zoh(ts()).unwrap();
            let matrix = zoh_by_matrix_exponential(case, 0.01);
            // The matrix exponential loses digits in b1 and f2 by cancellation, up to 1e-13 of the largest coefficient.
            for (name, a, b) in [
                ("b0", exact.b0, matrix.b0),
                ("b1", exact.b1, matrix.b1),
                ("f1", exact.f1, matrix.f1),
                ("f2", exact.f2, matrix.f2),
            ] {
                assert!(
                    (a - b).abs() < 4e-13 * (1.0 + b.abs()),
                    "{name} of {case:?}: {a} and {b}"
                );
            }
        }
    }

    #[test]
    fn inverse_zoh_inverts_zoh_for_all_pole_cases() {
        for case in cases() {
            let back = case.zoh(ts()).unwrap().inverse_zoh(ts()).unwrap();
            // The poles of a held system are determined to eps/(Ts |p1 - p2|), and double poles to sqrt(eps)/Ts. The
            // coefficients a1 and a2, which are symmetric in the poles, are more accurate. Fast poles are less
            // accurate, because e^{p Ts} is small.
            for (name, a, b) in [
                ("b0", back.b0, case.b0),
                ("b1", back.b1, case.b1),
                ("a1", back.a1, case.a1),
                ("a2", back.a2, case.a2),
            ] {
                let scale = 1.0 + b.abs() + if name.starts_with('a') { case.a1.abs() } else { 0.0 };
                assert!((a - b).abs() < 2e-8 * scale, "{name} of {case:?}: {a} and {b}");
            }
        }
    }

    #[test]
    fn zoh_agrees_with_the_general_hold() {
        for case in cases() {
            let general = ContinuousTransferFunction::new(&[case.b0, case.b1], &[1.0, case.a1, case.a2]).unwrap();
            let general = discretise(&general, ts(), Method::ZeroOrderHold).unwrap();
            let exact = case.zoh(ts()).unwrap();
            let size = exact.b0.abs() + exact.b1.abs();
            for (a, b) in [(exact.b0, general.num()[1]), (exact.b1, general.num()[2])] {
                assert!((a - b).abs() < 1e-12 * size, "{case:?}: {a} and {b}");
            }
            for (a, b) in [(exact.f1, general.den()[1]), (exact.f2, general.den()[2])] {
                assert!((a - b).abs() < 1e-13 * (1.0 + b.abs()), "{case:?}: {a} and {b}");
            }
        }
    }

    #[test]
    fn held_states_match_the_matrix_exponential() {
        for case in cases() {
            let ours = ZohStates::new(case.a1, case.a2, ts());
            let m = DMatrix::from_row_slice(3, 3, &[0.0, 1.0, 0.0, -case.a2, -case.a1, 1.0, 0.0, 0.0, 0.0]) * 0.01;
            let e = m.exp();
            for i in 0..2 {
                for j in 0..2 {
                    let scale = 1.0 + e[(i, j)].abs();
                    assert!(
                        (ours.transition[i][j] - e[(i, j)]).abs() < 1e-12 * scale,
                        "{case:?} {i}{j}"
                    );
                }
                assert!((ours.input[i] - e[(i, 2)]).abs() < 1e-14, "{case:?} input {i}");
            }
        }
    }

    #[test]
    fn integrator_pole_is_preserved() {
        let integrator = with_poles(Complex64::new(0.0, 0.0), Complex64::new(-6.0, 0.0));
        let held = integrator.zoh(ts()).unwrap();
        assert!((1.0 + held.f1 + held.f2).abs() < 1e-15);
        assert!(held.inverse_zoh(ts()).unwrap().a2.abs() < 1e-9);
    }

    #[test]
    fn poles_on_the_closed_negative_axis_are_refused() {
        let held = |f1, f2| ZohSecondOrder {
            b0: 1.0,
            b1: 0.0,
            f1,
            f2,
        };
        assert!(matches!(
            held(-0.4, -0.05).inverse_zoh(ts()),
            Err(NotConvertible::NegativeRealPole { pole }) if (pole + 0.1).abs() < 1e-12
        ));
        assert!(held(0.9, 0.2).inverse_zoh(ts()).is_err());
        assert!(held(-0.5, 0.0).inverse_zoh(ts()).is_err());
        assert!(held(0.0, 0.0).inverse_zoh(ts()).is_err());
        assert!(matches!(
            held(f64::NAN, 0.2).inverse_zoh(ts()),
            Err(NotConvertible::NotFinite { .. })
        ));
        // A complex pair can always be converted, even with f1 > 0.
        assert!(held(0.5, 0.9).inverse_zoh(ts()).is_ok());
    }

    #[test]
    fn feedthrough_round_trip() {
        let (num, f) = zoh_biproper([0.7, 3.0, 11.0], [2.0, 4.0, 30.0], ts()).unwrap();
        let (back, den) = inverse_zoh_biproper(num, f, ts()).unwrap();
        for (a, b) in back.iter().zip([0.35, 1.5, 5.5]) {
            assert!((a - b).abs() < 1e-10);
        }
        assert!((den[1] - 2.0).abs() < 1e-10 && (den[2] - 15.0).abs() < 1e-9);
        assert!(zoh_biproper([0.0, 1.0, 1.0], [0.0, 1.0, 1.0], ts()).is_err());
    }

    #[test]
    fn overflow_is_an_error() {
        let absurd = with_poles(Complex64::new(1e6, 0.0), Complex64::new(1e6, 0.0));
        assert!(absurd.zoh(ts()).is_err());
    }
}
