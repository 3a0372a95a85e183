//! Polynomials and their roots.
//!
//! Coefficients are stored in one order, `p[0] + p[1] x + ... + p[n] x^n` with `x = q^-1` for discrete time; transfer
//! functions in s store descending powers, as their documentation states. Roots are computed as the eigenvalues of the
//! balanced companion matrix (Edelman and Murakami, 1995), with one Newton step for each root.

use hoid_core::stability::roots_inside;
use nalgebra::DMatrix;
use num_complex::Complex64;

/// Returns the product of two polynomials, whose coefficients may be in ascending or descending powers, but in the same
/// order for both.
pub fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    if a.is_empty() || b.is_empty() {
        return Vec::new();
    }
    let mut p = vec![0.0; a.len() + b.len() - 1];
    for (i, ai) in a.iter().enumerate() {
        for (j, bj) in b.iter().enumerate() {
            p[i + j] += ai * bj;
        }
    }
    p
}

/// Returns the value at `x` of `p[0] + p[1] x + ... + p[n] x^n`.
pub fn value(p: &[f64], x: Complex64) -> Complex64 {
    p.iter().rev().fold(Complex64::new(0.0, 0.0), |sum, &c| sum * x + c)
}

/// Returns the monic polynomial `z^n + p[1] z^{n-1} + ... + p[n]` with the given roots, `p[0] = 1`. Complex roots must
/// occur in conjugate pairs; the imaginary remainder due to rounding is dropped.
pub fn from_roots(roots: &[Complex64]) -> Vec<f64> {
    let mut p = vec![Complex64::new(1.0, 0.0)];
    for root in roots {
        p.push(Complex64::new(0.0, 0.0));
        for i in (1..p.len()).rev() {
            let lower = p[i - 1];
            p[i] -= root * lower;
        }
    }
    p.into_iter().map(|c| c.re).collect()
}

/// Returns the roots z of `p[0] z^n + p[1] z^{n-1} + ... + p[n]`, the root of largest modulus first, with conjugates
/// adjacent.
///
/// For a polynomial in `q^-1` with `p[0] = 1` these roots are its zeros in z. Leading zero coefficients lower the
/// degree; the zero polynomial and constants have no roots. `None` if a coefficient is not finite or the eigenvalue
/// iteration fails.
pub fn roots(p: &[f64]) -> Option<Vec<Complex64>> {
    if p.iter().any(|c| !c.is_finite()) {
        return None;
    }
    let leading = p.iter().position(|&c| c != 0.0);
    let Some(leading) = leading else {
        return Some(Vec::new());
    };
    let trailing = p.len() - p.iter().rposition(|&c| c != 0.0)? - 1;
    let core = &p[leading..p.len() - trailing];
    let degree = core.len() - 1;
    let mut found = match degree {
        0 => Vec::new(),
        1 => vec![Complex64::new(-core[1] / core[0], 0.0)],
        2 => quadratic(core[1] / core[0], core[2] / core[0]).to_vec(),
        _ => roots_by_companion_matrix(core)?,
    };
    found.extend(std::iter::repeat_n(Complex64::new(0.0, 0.0), trailing));
    found.sort_by(|a, b| {
        (b.norm().total_cmp(&a.norm()))
            .then(b.re.total_cmp(&a.re))
            .then(b.im.total_cmp(&a.im))
    });
    Some(found)
}

/// Returns the roots of `z^2 + p z + q`, computed without cancellation.
fn quadratic(p: f64, q: f64) -> [Complex64; 2] {
    let half = -p / 2.0;
    let discriminant = half * half - q;
    if discriminant < 0.0 {
        let im = (-discriminant).sqrt();
        [Complex64::new(half, im), Complex64::new(half, -im)]
    } else {
        let larger = half + discriminant.sqrt().copysign(half);
        let smaller = if larger == 0.0 { 0.0 } else { q / larger };
        [Complex64::new(larger, 0.0), Complex64::new(smaller, 0.0)]
    }
}

fn roots_by_companion_matrix(p: &[f64]) -> Option<Vec<Complex64>> {
    let n = p.len() - 1;
    let mut companion = DMatrix::zeros(n, n);
    for j in 0..n {
        companion[(0, j)] = -p[j + 1] / p[0];
    }
    for i in 1..n {
        companion[(i, i - 1)] = 1.0;
    }
    nalgebra::linalg::balancing::balance_parlett_reinsch(&mut companion);
    let schur = nalgebra::linalg::Schur::try_new(companion, f64::EPSILON, 10_000)?;
    let polished = schur.complex_eigenvalues().iter().map(|&z| newton_step(p, z)).collect();
    Some(polished)
}

/// Returns the root after one Newton step, or the given root if the step does not reduce the residual (as at a multiple
/// root).
fn newton_step(p: &[f64], z: Complex64) -> Complex64 {
    let horner = |z: Complex64| {
        let mut f = Complex64::new(0.0, 0.0);
        let mut slope = Complex64::new(0.0, 0.0);
        for &c in p {
            slope = slope * z + f;
            f = f * z + c;
        }
        (f, slope)
    };
    let (f, slope) = horner(z);
    if slope.norm() == 0.0 {
        return z;
    }
    let mut better = z - f / slope;
    if z.im == 0.0 {
        better.im = 0.0;
    }
    if horner(better).0.norm() < f.norm() { better } else { z }
}

/// Returns the coefficients `[p_1, ..., p_n]` of the monic polynomial with each root outside the unit circle replaced
/// by the inverse of its conjugate, which preserves the shape of the spectrum. `None` if the roots cannot be found.
pub fn reflect_roots_inside(coefficients: &[f64]) -> Option<Vec<f64>> {
    if roots_inside(coefficients, 1.0) {
        return Some(coefficients.to_vec());
    }
    let roots: Vec<Complex64> = roots(&[&[1.0], coefficients].concat())?
        .into_iter()
        .map(|z| match z.norm() {
            r if r > 1.0 => 1.0 / z.conj(),
            // A root on the circle is moved inwards slightly; otherwise the transient of the filter would never decay.
            r if r > 0.999 => z * (0.999 / r),
            _ => z,
        })
        .collect();
    let mut inside = from_roots(&roots)[1..].to_vec();
    inside.resize(coefficients.len(), 0.0);
    roots_inside(&inside, 1.0).then_some(inside)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn c(re: f64, im: f64) -> Complex64 {
        Complex64::new(re, im)
    }

    #[test]
    fn roots_inverts_from_roots() {
        let sets = [
            vec![c(0.9, 0.2), c(0.9, -0.2)],
            vec![c(0.95, 0.0), c(-0.4, 0.0), c(0.1, 0.0)],
            vec![
                c(1.2, 0.0),
                c(0.97, 0.03),
                c(0.97, -0.03),
                c(0.5, 0.0),
                c(0.0, 0.7),
                c(0.0, -0.7),
            ],
        ];
        for set in sets {
            let p = from_roots(&set);
            let found = roots(&p).unwrap();
            assert_eq!(found.len(), set.len());
            for root in &set {
                let nearest = found.iter().map(|f| (f - root).norm()).fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-11, "{root} is off by {nearest}");
            }
        }
    }

    #[test]
    fn multiple_roots_are_found_approximately() {
        // A root of multiplicity m has an accuracy of only eps^(1/m).
        let found = roots(&from_roots(&[c(0.85, 0.0); 4])).unwrap();
        assert!(found.iter().all(|z| (z - 0.85).norm() < 5e-4));
    }

    #[test]
    fn degenerate_polynomials_are_handled() {
        assert_eq!(roots(&[]), Some(vec![]));
        assert_eq!(roots(&[0.0, 0.0]), Some(vec![]));
        assert_eq!(roots(&[2.0]), Some(vec![]));
        assert_eq!(roots(&[0.0, 2.0, -1.0]).unwrap(), vec![c(0.5, 0.0)]);
        assert_eq!(roots(&[1.0, -0.5, 0.0]).unwrap(), vec![c(0.5, 0.0), c(0.0, 0.0)]);
        assert_eq!(roots(&[1.0, f64::NAN]), None);
        assert_eq!(roots(&[1.0, 0.0, 0.0, 0.0]).unwrap().len(), 3);
    }

    #[test]
    fn quadratic_avoids_cancellation() {
        let found = roots(&[1.0, -1e8, 1.0]).unwrap();
        assert!((found[1].re - 1e-8).abs() < 1e-22);
    }

    #[test]
    fn products_and_values_are_exact() {
        assert_eq!(product(&[1.0, -0.5], &[1.0, 2.0, 3.0]), vec![1.0, 1.5, 2.0, -1.5]);
        assert!(product(&[], &[1.0]).is_empty());
        assert!((value(&[1.0, 2.0, 3.0], c(2.0, 0.0)) - 17.0).norm() < 1e-12);
    }
}
