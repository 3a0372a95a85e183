//! Linear least squares by Householder QR with column pivoting.
//!
//! Solves `min |y - X theta|^2` for a tall X stored by columns. Columns are first scaled to unit length, so the rank
//! does not depend on units. At each step the column with the largest remainder is chosen. The rank is the number of
//! diagonal elements of R above `tolerance |R_11|`. Source: P. Businger and G. H. Golub, *Numer. Math.* 7 (1965)
//! 269-276.

use nalgebra::{DMatrix, DVector};

use super::vectors::dot;

/// A column counts as linearly dependent on previous columns if its diagonal element of R has less than this relative
/// size. Rounding alone leaves about 1e-15; regressors that determine their coefficients to a few digits are above
/// 1e-10.
pub(crate) const RANK_TOLERANCE: f64 = 1e-12;

/// The factors of `X P = Q R` and `Q' y`, from which all results are computed.
#[derive(Debug)]
pub(crate) struct LeastSquares {
    /// Upper triangular factor R of the scaled columns in pivoted order, stored by columns.
    r: Vec<f64>,
    qty: Vec<f64>,
    pivots: Vec<usize>,
    scales: Vec<f64>,
    /// Number of independent columns.
    pub rank: usize,
    /// Residual sum of squares of the least-squares fit; valid only for full rank.
    pub residual_sum_of_squares: f64,
}

impl LeastSquares {
    /// Factors the columns (each `rows` long, one after the other) together with the right-hand side. Columns and
    /// right-hand side are overwritten.
    pub fn factor(columns: &mut [f64], y: &mut [f64]) -> Self {
        let rows = y.len();
        let p = columns.len().checked_div(rows).unwrap_or(0);
        let mut scales = vec![1.0; p];
        for (column, scale) in columns.chunks_exact_mut(rows.max(1)).zip(&mut scales) {
            let norm = dot(column, column).sqrt();
            *scale = norm;
            if norm > 0.0 {
                column.iter_mut().for_each(|v| *v /= norm);
            }
        }
        let mut pivots: Vec<usize> = (0..p).collect();
        let mut r = vec![0.0; p * p];
        let mut rank = 0;
        let steps = p.min(rows);
        for k in 0..steps {
            // The residual norms of the columns are computed again at each step, because downdating loses digits
            // exactly where the rank is decided.
            let rest = |j: usize, columns: &[f64]| {
                let tail = &columns[j * rows + k..(j + 1) * rows];
                dot(tail, tail)
            };
            let mut best = (k, -1.0);
            for j in k..p {
                let size = rest(j, columns);
                if size > best.1 {
                    best = (j, size);
                }
            }
            if best.0 != k {
                for i in 0..rows {
                    columns.swap(k * rows + i, best.0 * rows + i);
                }
                for i in 0..k {
                    r.swap(k * p + i, best.0 * p + i);
                }
                pivots.swap(k, best.0);
            }
            let norm = best.1.max(0.0).sqrt();
            if norm <= RANK_TOLERANCE {
                break;
            }
            rank = k + 1;
            let (head, tail) = columns.split_at_mut((k + 1) * rows);
            let v = &mut head[k * rows + k..];
            let alpha = -norm.copysign(v[0]);
            v[0] -= alpha;
            let half_square = norm * (norm + (v[0] + alpha).abs());
            let reflect = |x: &mut [f64]| {
                let factor = dot(v, x) / half_square;
                for (xi, vi) in x.iter_mut().zip(v.iter()) {
                    *xi -= factor * vi;
                }
            };
            for column in tail.chunks_exact_mut(rows) {
                reflect(&mut column[k..]);
            }
            reflect(&mut y[k..]);
            r[k * p + k] = alpha;
            for (j, column) in tail.chunks_exact(rows).enumerate() {
                r[(k + 1 + j) * p + k] = column[k];
            }
        }
        let residual = &y[rank.min(rows)..];
        Self {
            residual_sum_of_squares: dot(residual, residual),
            qty: y[..steps].to_vec(),
            r,
            pivots,
            scales,
            rank,
        }
    }

    fn column_count(&self) -> usize {
        self.pivots.len()
    }

    /// True if all columns are linearly independent.
    pub fn has_full_rank(&self) -> bool {
        self.rank == self.column_count()
    }

    /// Returns the least-squares solution, which is valid only if the rank is full.
    pub fn solution(&self) -> Vec<f64> {
        let p = self.column_count();
        let scaled = self.back_substitute(&self.qty[..p]);
        let mut theta = vec![0.0; p];
        for (k, &j) in self.pivots.iter().enumerate() {
            theta[j] = scaled[k] / self.scales[j];
        }
        theta
    }

    /// Returns `(X' X)^-1` by rows, which is valid only if the rank is full.
    pub fn inverse_gram(&self) -> Vec<f64> {
        let p = self.column_count();
        // First the columns of R^-1, then R^-1 R^-T.
        let inverse: Vec<Vec<f64>> = (0..p)
            .map(|i| {
                let mut unit = vec![0.0; p];
                unit[i] = 1.0;
                self.back_substitute(&unit)
            })
            .collect();
        let mut result = vec![0.0; p * p];
        for (i, &pi) in self.pivots.iter().enumerate() {
            for (j, &pj) in self.pivots.iter().enumerate() {
                let product: f64 = (0..p).map(|k| inverse[k][i] * inverse[k][j]).sum();
                result[pi * p + pj] = product / (self.scales[pi] * self.scales[pj]);
            }
        }
        result
    }

    fn back_substitute(&self, rhs: &[f64]) -> Vec<f64> {
        let p = self.column_count();
        let mut x = rhs.to_vec();
        for i in (0..p).rev() {
            for j in i + 1..p {
                x[i] -= self.r[j * p + i] * x[j];
            }
            x[i] /= self.r[i * p + i];
        }
        x
    }

    /// Returns a description of the linearly dependent columns by name, each with the columns that it is a combination
    /// of.
    pub fn describe_dependence(&self, names: &[String]) -> String {
        let p = self.column_count();
        let sentences: Vec<String> = (self.rank..p)
            .map(|k| {
                let name = &names[self.pivots[k]];
                if self.scales[self.pivots[k]] == 0.0 {
                    return format!("the column of {name} is zero");
                }
                // Solves R11 x = r12 for the combination of columns that gives the dependent column.
                let mut x: Vec<f64> = (0..self.rank).map(|i| self.r[k * p + i]).collect();
                for i in (0..self.rank).rev() {
                    for j in i + 1..self.rank {
                        x[i] -= self.r[j * p + i] * x[j];
                    }
                    x[i] /= self.r[i * p + i];
                }
                let largest = x.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                let others: Vec<&str> = (0..self.rank)
                    .filter(|&i| x[i].abs() > 1e-3 * largest)
                    .map(|i| names[self.pivots[i]].as_str())
                    .collect();
                format!("the column of {name} is a combination of {}", others.join(", "))
            })
            .collect();
        sentences.join("; ")
    }
}

/// Solves the positive definite system `gram x = rhs` (gram by rows) by a Cholesky factorisation, after scaling to a
/// unit diagonal. `None` if the matrix is not positive definite.
pub(crate) fn solve_symmetric(gram: &[f64], rhs: &[f64]) -> Option<Vec<f64>> {
    let p = rhs.len();
    let scale: Vec<f64> = (0..p).map(|i| gram[i * p + i].sqrt()).collect();
    if scale.iter().any(|s| s.is_nan() || *s <= 0.0) {
        return None;
    }
    let scaled = DMatrix::from_fn(p, p, |i, j| gram[i * p + j] / (scale[i] * scale[j]));
    let y = scaled.cholesky()?.solve(&DVector::from_fn(p, |i, _| rhs[i] / scale[i]));
    Some(y.iter().zip(&scale).map(|(v, s)| v / s).collect())
}

/// Returns the inverse of a p x p information matrix (by rows) for the free parameters; the rows and columns of all
/// other parameters are zero. `None` if the matrix of the free parameters is not positive definite.
pub(crate) fn covariance_of_free(information: &[f64], free: &[usize], p: usize) -> Option<Vec<f64>> {
    let part: Vec<f64> = (free.iter())
        .flat_map(|&i| free.iter().map(move |&j| information[i * p + j]))
        .collect();
    let mut covariance = vec![0.0; p * p];
    for (k, &i) in free.iter().enumerate() {
        let mut unit = vec![0.0; free.len()];
        unit[k] = 1.0;
        let column = solve_symmetric(&part, &unit)?;
        free.iter().zip(column).for_each(|(&j, v)| covariance[j * p + i] = v);
    }
    Some(covariance)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> (Vec<f64>, Vec<f64>) {
        let rows = 60;
        let column = |f: &dyn Fn(f64) -> f64| (0..rows).map(|t| f(f64::from(t))).collect::<Vec<f64>>();
        let x = [
            column(&|t| 1e3 * (0.3 * t).sin()),
            column(&|t| 1e-3 * (0.11 * t).cos()),
            column(&|t| 1.0 + 0.01 * t),
        ]
        .concat();
        let y = column(&|t| 2.0 * (0.3 * t).sin() - 5.0 * (0.11 * t).cos() + 0.5 * (1.0 + 0.01 * t));
        (x, y)
    }

    #[test]
    fn exact_coefficients_of_any_scale_are_recovered() {
        let (mut x, mut y) = example();
        let ls = LeastSquares::factor(&mut x, &mut y);
        assert!(ls.has_full_rank());
        for (a, b) in ls.solution().iter().zip([2e-3, -5e3, 0.5]) {
            assert!((a - b).abs() < 1e-12 * b.abs());
        }
        assert!(ls.residual_sum_of_squares < 1e-18);
    }

    #[test]
    fn residual_is_orthogonal_and_inverse_gram_is_the_inverse() {
        let (x, mut y) = example();
        y.iter_mut().enumerate().for_each(|(t, v)| *v += (1.7 * t as f64).sin());
        let (mut qx, mut qy) = (x.clone(), y.clone());
        let ls = LeastSquares::factor(&mut qx, &mut qy);
        let theta = ls.solution();
        let columns: Vec<&[f64]> = x.chunks_exact(y.len()).collect();
        let residual: Vec<f64> = (0..y.len())
            .map(|t| y[t] - (0..3).map(|j| theta[j] * columns[j][t]).sum::<f64>())
            .collect();
        for column in &columns {
            let cosine = dot(column, &residual) / (dot(column, column) * dot(&residual, &residual)).sqrt();
            assert!(cosine.abs() < 1e-13);
        }
        assert!((dot(&residual, &residual) - ls.residual_sum_of_squares).abs() < 1e-10);
        let inverse = ls.inverse_gram();
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| dot(columns[i], columns[k]) * inverse[k * 3 + j]).sum();
                // The units of the columns differ by 1e6; relative to these units the identity holds to rounding.
                let scale = (dot(columns[i], columns[i]) / dot(columns[j], columns[j])).sqrt();
                assert!((product / scale - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn dependent_columns_are_reported() {
        let (mut x, mut y) = example();
        let rows = y.len();
        let double: Vec<f64> = x[..rows].iter().map(|v| -2.0 * v).collect();
        x.extend(double);
        x.extend(vec![0.0; rows]);
        let names: Vec<String> = ["a1", "b0", "b1", "b2", "c1"].map(String::from).to_vec();
        let ls = LeastSquares::factor(&mut x, &mut y);
        assert_eq!(ls.rank, 3);
        let text = ls.describe_dependence(&names);
        assert!(text.contains("c1 is zero"), "{text}");
        assert!(
            text.contains("b2 is a combination of a1") || text.contains("a1 is a combination of b2"),
            "{text}"
        );
    }

    #[test]
    fn fewer_rows_than_columns_are_rank_deficient() {
        let ls = LeastSquares::factor(&mut [1.0, 2.0, 3.0], &mut [1.0]);
        assert!(!ls.has_full_rank());
        let none = LeastSquares::factor(&mut [], &mut []);
        assert!(none.has_full_rank());
        assert!(none.solution().is_empty());
    }
}
