//! Tests whether all roots of a monic polynomial lie inside a circle.
//!
//! The Schur-Cohn test uses the step-down (Levinson) recursion: with `k = d_n`, the polynomial of degree n has its
//! roots inside the unit circle if and only if `|k| < 1` and the polynomial of degree n - 1 with coefficients
//! `(d_i - k d_{n-i}) / (1 - k^2)` has its roots there. For a circle of radius r the test is applied to `d_i / r^i`.
//! Sources: E. I. Jury, *Theory and Application of the z-Transform Method*, 1964; S. Kay, *Modern Spectral Estimation*,
//! 1988, eq. 6.51.

/// Highest order that [`roots_inside`] tests; its work space is on the stack.
pub const MAX_ORDER: usize = 64;

/// True if all roots of `z^n + d_1 z^{n-1} + ... + d_n` lie strictly inside the circle of the given radius.
///
/// Returns `false` for coefficients that are not finite and for an order above [`MAX_ORDER`], so stability is never
/// reported without proof.
#[inline]
pub fn roots_inside(d: &[f64], radius: f64) -> bool {
    // Most polynomials of an operator have a low order, and a recursion tests them at every sample.
    match *d {
        [] if radius > 0.0 => true,
        [d1] if radius > 0.0 => d1.abs() < radius,
        [d1, d2] if radius == 1.0 => d2.abs() < 1.0 && d1.abs() < 1.0 + d2,
        _ => step_down(d, radius),
    }
}

/// Step-down test for any order.
#[inline(never)]
fn step_down(d: &[f64], radius: f64) -> bool {
    let order = d.len();
    if order > MAX_ORDER || radius.is_nan() || radius <= 0.0 {
        return false;
    }
    let mut work = [0.0; MAX_ORDER];
    let mut scale = 1.0;
    for (w, &di) in work.iter_mut().zip(d) {
        scale /= radius;
        *w = di * scale;
    }
    for n in (1..=order).rev() {
        let k = work[n - 1];
        // The condition is written so that NaN counts as unstable.
        if !(k > -1.0 && k < 1.0) {
            return false;
        }
        let gain = 1.0 / ((1.0 - k) * (1.0 + k));
        // d_i and d_{n-i} are updated as a pair, each from the old values.
        let m = n - 1;
        for i in 0..m.div_ceil(2) {
            let (low, high) = (work[i], work[m - 1 - i]);
            work[i] = (low - k * high) * gain;
            work[m - 1 - i] = (high - k * low) * gain;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{vec, vec::Vec};

    /// Coefficients of the polynomial with these real roots and complex pairs (radius, angle).
    fn polynomial(real: &[f64], pairs: &[(f64, f64)]) -> Vec<f64> {
        let mut p = vec![1.0];
        let mut times = |factor: &[f64]| {
            let mut product = vec![0.0; p.len() + factor.len() - 1];
            for (i, a) in p.iter().enumerate() {
                for (j, b) in factor.iter().enumerate() {
                    product[i + j] += a * b;
                }
            }
            p = product;
        };
        real.iter().for_each(|&r| times(&[1.0, -r]));
        pairs
            .iter()
            .for_each(|&(r, angle)| times(&[1.0, -2.0 * r * angle.cos(), r * r]));
        p[1..].to_vec()
    }

    #[test]
    fn stability_agrees_with_known_roots() {
        for &largest in &[0.6, 0.9, 0.999, 1.001, 1.2, 3.0] {
            for &angle in &[0.05, 1.0, 2.5] {
                let p = polynomial(&[0.5, -0.2], &[(largest, angle), (0.4, 0.7)]);
                assert_eq!(roots_inside(&p, 1.0), largest < 1.0, "radius {largest} angle {angle}");
                assert!(roots_inside(&p, largest * 1.01));
                assert!(!roots_inside(&p, largest * 0.99));
            }
        }
    }

    #[test]
    fn pole_on_the_unit_circle_is_not_inside() {
        assert!(!roots_inside(&[-1.0], 1.0));
        assert!(!roots_inside(&[0.0, 1.0], 1.0));
        assert!(!roots_inside(&[-2.0, 1.0], 1.0));
    }

    #[test]
    fn degenerate_polynomials_are_handled() {
        assert!(roots_inside(&[], 1.0));
        assert!(roots_inside(&[0.0, 0.0, 0.0], 1.0));
        assert!(!roots_inside(&[f64::NAN], 1.0));
        assert!(!roots_inside(&[0.1, f64::INFINITY], 1.0));
        assert!(!roots_inside(&[0.1], f64::NAN));
        assert!(!roots_inside(&[0.0; MAX_ORDER + 1], 1.0));
    }
}
