//! The extended Kalman filter, where F is the Jacobian of the transition and h the gradient of the output:
//!
//! `P <- F P F' + Q`, `g = P h/(h' P h + R)`, `X <- X + g eps`,
//! `P <- (I - g h') P (I - g h')' + R g g'`
//!
//! (A. H. Jazwinski, *Stochastic Processes and Filtering Theory*, 1970, section 8.3; the update of P is in the form of
//! P. D. Joseph).

use super::belief::{AugmentedState, Matrix, Model, N};

/// Processes a sample. Returns the innovation and its predicted variance.
pub(crate) fn step(model: &Model, belief: &mut AugmentedState, e: f64, u: f64) -> [f64; 2] {
    let f = model.jacobian(&belief.x, e);
    belief.x = model.transition(&belief.x, e);
    belief.p = congruence(&f, &belief.p);
    for (i, q) in model.drift.iter().enumerate() {
        belief.p[i][i] += q;
    }
    let h = Model::output_gradient(&belief.x);
    let innovation = u - Model::output(&belief.x);
    let ph: [f64; N] = std::array::from_fn(|i| dot(&belief.p[i], &h));
    let expected = dot(&h, &ph) + model.noise;
    if !(expected > 0.0 && expected.is_finite()) {
        return [innovation, model.noise];
    }
    let gain = ph.map(|p| p / expected);
    let rest: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j)) - gain[i] * h[j]));
    belief.p = congruence(&rest, &belief.p);
    for i in 0..N {
        belief.x[i] += gain[i] * innovation;
        for j in 0..N {
            belief.p[i][j] += model.noise * gain[i] * gain[j];
        }
    }
    [innovation, expected]
}

fn dot(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Returns the symmetric matrix `F P F'`.
fn congruence(f: &Matrix, p: &Matrix) -> Matrix {
    let fp: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| dot(&f[i], &p[j])));
    let mut product = [[0.0; N]; N];
    for i in 0..N {
        for j in 0..=i {
            product[i][j] = dot(&fp[i], &f[j]);
            product[j][i] = product[i][j];
        }
    }
    product
}
