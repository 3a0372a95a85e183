//! The unscented Kalman filter: 2 N points `X ± sqrt(N) L_i` of equal weight, where `L L' = P`, are propagated through
//! the transition and the output; the propagated points give the means and covariances (S. J. Julier and J. K. Uhlmann,
//! *Proceedings of the IEEE* 92 (2004) 401-422, with kappa = 0). The points are drawn again after the noise of the
//! transition has been added. The update is `X <- X + c/s eps`, `P <- P - c c'/s`, where c is the covariance of X with
//! the output and s the variance of the output.

use super::belief::{AugmentedState, Matrix, Model, N};

/// Processes a sample. Returns the innovation and its predicted variance.
pub(crate) fn step(model: &Model, belief: &mut AugmentedState, e: f64, u: f64) -> [f64; 2] {
    let moved = sigma_points(belief).map(|x| model.transition(&x, e));
    belief.x = mean(&moved);
    belief.p = [[0.0; N]; N];
    for x in &moved {
        for i in 0..N {
            for j in 0..N {
                belief.p[i][j] += (x[i] - belief.x[i]) * (x[j] - belief.x[j]) / POINT_COUNT as f64;
            }
        }
    }
    for (i, q) in model.drift.iter().enumerate() {
        belief.p[i][i] += q;
    }
    let drawn = sigma_points(belief);
    let outputs = drawn.map(|x| Model::output(&x));
    let output = outputs.iter().sum::<f64>() / POINT_COUNT as f64;
    let (mut expected, mut with) = (model.noise, [0.0; N]);
    for (x, y) in drawn.iter().zip(outputs) {
        let away = (y - output) / POINT_COUNT as f64;
        expected += away * (y - output);
        for i in 0..N {
            with[i] += away * (x[i] - belief.x[i]);
        }
    }
    let innovation = u - output;
    if !(expected > 0.0 && expected.is_finite()) {
        return [innovation, model.noise];
    }
    for i in 0..N {
        belief.x[i] += with[i] / expected * innovation;
        for j in 0..N {
            belief.p[i][j] -= with[i] * with[j] / expected;
        }
    }
    [innovation, expected]
}

/// Number of sigma points.
const POINT_COUNT: usize = 2 * N;

fn sigma_points(belief: &AugmentedState) -> [[f64; N]; POINT_COUNT] {
    let root = root(&belief.p);
    let reach = (N as f64).sqrt();
    std::array::from_fn(|k| {
        let side = if k < N { reach } else { -reach };
        std::array::from_fn(|i| belief.x[i] + side * root[i][k % N])
    })
}

fn mean(points: &[[f64; N]; POINT_COUNT]) -> [f64; N] {
    std::array::from_fn(|i| points.iter().map(|x| x[i]).sum::<f64>() / POINT_COUNT as f64)
}

/// Returns L with `L L' = P`; a direction whose variance has become negative by rounding is omitted.
fn root(p: &Matrix) -> Matrix {
    let mut l = [[0.0; N]; N];
    for j in 0..N {
        let rest = p[j][j] - (0..j).map(|k| l[j][k] * l[j][k]).sum::<f64>();
        // A remainder below this fraction of the variance is a rounding error.
        if rest > 1e-14 * p[j][j] {
            l[j][j] = rest.sqrt();
            for i in j + 1..N {
                l[i][j] = (p[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>()) / l[j][j];
            }
        }
    }
    l
}
