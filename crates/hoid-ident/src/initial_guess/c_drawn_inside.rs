//! Starts for a search that ended with a root of C on the unit circle: the loss often has a lower
//! minimum inside.

use hoid_model::{Complex64, Orders, polynomial};

/// Returns starts for a search that ended with a root of C on the unit circle: theta with the roots of C moved towards
/// the origin, `c_i rho^i`, and theta with all roots of C replaced by their mean.
pub(crate) fn starts_with_reduced_c_roots(o: &Orders, theta: &[f64]) -> Vec<Vec<f64>> {
    let block = o.na + o.nb..o.na + o.nb + o.nc;
    let c = &theta[block.clone()];
    let mut all = Vec::new();
    if c.is_empty() {
        return all;
    }
    let mut push = |c: &[f64]| {
        let mut start = theta.to_vec();
        start[block.clone()].copy_from_slice(c);
        all.push(start);
    };
    for rho in ROOT_SCALES {
        let drawn: Vec<f64> = c.iter().zip(1..).map(|(ci, i)| ci * f64::powi(rho, i)).collect();
        push(&drawn);
    }
    // C = (1 + x q^-1)^n has the same sum of roots as C.
    let x = (c[0] / c.len() as f64).clamp(-0.95, 0.95);
    let multiple = polynomial::from_roots(&vec![Complex64::new(-x, 0.0); c.len()]);
    if multiple.len() == c.len() + 1 {
        push(&multiple[1..]);
    }
    all
}

/// Factors by which the roots of C are moved inwards.
const ROOT_SCALES: [f64; 5] = [0.98, 0.95, 0.9, 0.8, 0.6];
