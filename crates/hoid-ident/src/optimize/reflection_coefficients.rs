//! Coordinates in which the region of stable polynomials is a box.
//!
//! A monic polynomial of order n has all roots inside the unit circle if and only if its reflection coefficients
//! satisfy `|k_m| < 1`, m = 1 .. n, with the Levinson-Durbin recursion
//!
//! `p^(m)_i = p^(m-1)_i + k_m p^(m-1)_{m-i}` for i < m,  `p^(m)_m = k_m`
//!
//! (O. Barndorff-Nielsen and G. Schou, *J. Multivariate Analysis* 3 (1973) 408-419; J. F. Monahan, *Biometrika* 71
//! (1984) 403-404). In theta the border of stability is curved, and a search that reaches it stops although the loss
//! decreases along it. In k the border is a bound, along which the search can move. With `J = dp/dk` the derivatives
//! are `J' psi' eps` and `J' psi' psi J`.

use std::ops::Range;

use crate::criterion::Workspace;
use crate::optimize::objective::{Linearisation, Objective};

/// Largest absolute value of a reflection coefficient: at this value, a root is so close to the unit circle that it
/// counts as being on it for any record.
pub(crate) const MAX_REFLECTION_COEFFICIENT: f64 = 1.0 - 1e-8;

/// An objective in which the polynomials that must be stable are replaced by their reflection coefficients.
pub(crate) struct StableCoordinates<'o> {
    objective: &'o dyn Objective,
    blocks: Vec<Range<usize>>,
    limits: Vec<(f64, f64)>,
}

impl<'o> StableCoordinates<'o> {
    /// Returns the objective in coordinates with reflection coefficients, and the coordinates of theta. `None` if no
    /// polynomial must be stable.
    pub fn of(objective: &'o dyn Objective, theta: &[f64]) -> Option<(Self, Vec<f64>)> {
        let blocks = objective.stable_blocks();
        if blocks.is_empty() {
            return None;
        }
        let unlimited = (f64::NEG_INFINITY, f64::INFINITY);
        let mut limits = objective.limits().map_or(vec![unlimited; theta.len()], <[_]>::to_vec);
        let mut kappa = theta.to_vec();
        for block in &blocks {
            limits[block.clone()].fill((-MAX_REFLECTION_COEFFICIENT, MAX_REFLECTION_COEFFICIENT));
            let reflected = reflection_coefficients(&theta[block.clone()])?;
            for (k, value) in kappa[block.clone()].iter_mut().zip(reflected) {
                *k = value.clamp(-MAX_REFLECTION_COEFFICIENT, MAX_REFLECTION_COEFFICIENT);
            }
        }
        let coordinates = Self {
            objective,
            blocks,
            limits,
        };
        Some((coordinates, kappa))
    }

    /// Converts the coordinates back to theta.
    pub fn theta(&self, kappa: &[f64]) -> Vec<f64> {
        let mut theta = kappa.to_vec();
        for block in &self.blocks {
            theta[block.clone()].copy_from_slice(&polynomial(&kappa[block.clone()]));
        }
        theta
    }

    /// True if a reflection coefficient is at its bound.
    pub fn is_on_border(&self, kappa: &[f64]) -> bool {
        let mut coefficients = self.blocks.iter().flat_map(|block| &kappa[block.clone()]);
        coefficients.any(|k| k.abs() >= MAX_REFLECTION_COEFFICIENT)
    }
}

impl Objective for StableCoordinates<'_> {
    fn is_feasible(&self, kappa: &[f64]) -> bool {
        self.objective.is_feasible(&self.theta(kappa))
    }

    fn linearise(&self, kappa: &[f64], workspace: &mut Workspace) -> Linearisation {
        let at = self.objective.linearise(&self.theta(kappa), workspace);
        let p = kappa.len();
        let mut jacobian = vec![0.0; p * p];
        for i in 0..p {
            jacobian[i * p + i] = 1.0;
        }
        for block in &self.blocks {
            let rows = polynomial_jacobian(&kappa[block.clone()]);
            let n = block.len();
            for i in 0..n {
                for j in 0..n {
                    jacobian[(block.start + i) * p + block.start + j] = rows[i * n + j];
                }
            }
        }
        let column = |j: usize| (0..p).map(move |i| (i, j));
        let descent = (0..p)
            .map(|j| column(j).map(|(i, j)| jacobian[i * p + j] * at.descent[i]).sum())
            .collect();
        // G J is computed first, then J' (G J).
        let times: Vec<f64> = (0..p * p)
            .map(|place| {
                let (i, j) = (place / p, place % p);
                (0..p).map(|l| at.gram[i * p + l] * jacobian[l * p + j]).sum()
            })
            .collect();
        let gram = (0..p * p)
            .map(|place| {
                let (i, j) = (place / p, place % p);
                (0..p).map(|l| jacobian[l * p + i] * times[l * p + j]).sum()
            })
            .collect();
        Linearisation {
            sum_of_squares: at.sum_of_squares,
            descent,
            gram,
        }
    }

    fn output_power(&self) -> f64 {
        self.objective.output_power()
    }

    fn limits(&self) -> Option<&[(f64, f64)]> {
        Some(&self.limits)
    }
}

/// Returns the coefficients `[p_1, ..., p_n]` of the polynomial with these reflection coefficients.
fn polynomial(k: &[f64]) -> Vec<f64> {
    let mut p: Vec<f64> = Vec::with_capacity(k.len());
    for &km in k {
        let before = p.clone();
        for (pi, reflected) in p.iter_mut().zip(before.iter().rev()) {
            *pi += km * reflected;
        }
        p.push(km);
    }
    p
}

/// Returns `dp_i/dk_j` by rows.
fn polynomial_jacobian(k: &[f64]) -> Vec<f64> {
    let n = k.len();
    let mut jacobian = vec![0.0; n * n];
    for j in 0..n {
        // The recursion is linear in each k_j, whose derivative enters at step j.
        let (mut p, mut slope): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
        for (m, &km) in k.iter().enumerate() {
            let (before, slope_before) = (p.clone(), slope.clone());
            let own = f64::from(u8::from(m == j));
            for i in 0..m {
                p[i] += km * before[m - 1 - i];
                slope[i] += km * slope_before[m - 1 - i] + own * before[m - 1 - i];
            }
            p.push(km);
            slope.push(own);
        }
        for i in 0..n {
            jacobian[i * n + j] = slope[i];
        }
    }
    jacobian
}

/// Returns the reflection coefficients, computed by the backward recursion; `None` if the polynomial is not stable.
fn reflection_coefficients(p: &[f64]) -> Option<Vec<f64>> {
    let mut p = p.to_vec();
    let mut k = vec![0.0; p.len()];
    while let Some(km) = p.pop() {
        let m = p.len();
        k[m] = km;
        if km.is_nan() || km.abs() >= 1.0 {
            return None;
        }
        let before = p.clone();
        for (pi, reflected) in p.iter_mut().zip(before.iter().rev()) {
            *pi = (*pi - km * reflected) / (1.0 - km * km);
        }
    }
    Some(k)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reflection_coefficients_and_polynomials_convert_both_ways() {
        for p in [
            vec![],
            vec![-0.9],
            vec![-1.912, 0.924],
            vec![-2.3, 1.85, -0.511],
            vec![0.1, -0.2, 0.3, -0.2],
        ] {
            let k = reflection_coefficients(&p).unwrap();
            for (a, b) in polynomial(&k).iter().zip(&p) {
                assert!((a - b).abs() < 1e-12, "{p:?}");
            }
        }
        // Computed by hand: k2 = f2, k1 = f1/(1 + f2).
        let k = reflection_coefficients(&[-1.5, 0.7]).unwrap();
        assert!((k[0] + 1.5 / 1.7).abs() < 1e-15 && k[1] == 0.7);
        for unstable in [vec![1.0], vec![-2.1, 1.2], vec![0.0, -1.0], vec![f64::NAN]] {
            assert!(reflection_coefficients(&unstable).is_none(), "{unstable:?}");
        }
    }

    #[test]
    fn unit_box_is_the_region_of_stability() {
        let mut state = 7_u64;
        let mut draw = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            2.0 * (state >> 11) as f64 / (1_u64 << 53) as f64 - 1.0
        };
        for _ in 0..500 {
            let k: Vec<f64> = (0..4).map(|_| 0.999 * draw()).collect();
            assert!(hoid_core::stability::roots_inside(&polynomial(&k), 1.0));
            let p: Vec<f64> = (0..3).map(|_| 3.0 * draw()).collect();
            let stable = hoid_core::stability::roots_inside(&p, 1.0);
            assert_eq!(stable, reflection_coefficients(&p).is_some(), "{p:?}");
        }
    }

    #[test]
    fn jacobian_matches_finite_differences() {
        let k = [0.3, -0.7, 0.5, 0.9];
        let jacobian = polynomial_jacobian(&k);
        for j in 0..4 {
            let h = 1e-6;
            let (mut up, mut down) = (k, k);
            up[j] += h;
            down[j] -= h;
            for (i, (a, b)) in polynomial(&up).iter().zip(polynomial(&down)).enumerate() {
                assert!(((a - b) / (2.0 * h) - jacobian[i * 4 + j]).abs() < 1e-9);
            }
        }
    }
}
