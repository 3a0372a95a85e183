//! Small matrices of dual numbers: the exponential and the characteristic polynomial.

use super::dual::Dual;

/// Highest order of the dynamics.
pub(super) const MAX_ORDER: usize = 3;
/// Number of rows of the extended matrices: states, input, and slope of the input.
pub(super) const MATRIX_SIZE: usize = MAX_ORDER + 2;
/// Number of terms of the series for a norm of at most one: 1/20! is 4e-19.
const TERM_COUNT: usize = 20;

pub(super) type Matrix = [[Dual; MATRIX_SIZE]; MATRIX_SIZE];
pub(super) type Vector = [Dual; MATRIX_SIZE];

/// Returns `[A B 0; 0 0 1; 0 0 0]` of the controllable canonical form, with time in samples; the last state is the
/// slope of the input.
pub(super) fn companion_matrix(denominator: &Vector, order: usize) -> Matrix {
    let mut m = [[Dual::constant(0.0); MATRIX_SIZE]; MATRIX_SIZE];
    for i in 0..=order {
        m[i][i + 1] = Dual::constant(1.0);
    }
    for (entry, d) in m[order - 1].iter_mut().zip(denominator).take(order) {
        *entry = -*d;
    }
    m
}

/// Returns `exp(M h)`.
pub(super) fn exponential(m: &Matrix, h: Dual) -> Matrix {
    let m: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| m[i][j] * h));
    let row = |r: &[Dual; MATRIX_SIZE]| r.iter().map(|c| c.value.abs()).sum::<f64>();
    let norm = m.iter().map(row).fold(0.0, f64::max);
    // If the norm is very large, the result overflows regardless of the number of halvings.
    let halvings = if norm > 1.0 {
        norm.log2().ceil().min(60.0) as i32
    } else {
        0
    };
    let small = 0.5_f64.powi(halvings);
    let m: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| m[i][j].scaled(small)));
    let mut sum = identity();
    let mut term = identity();
    for k in 1..=TERM_COUNT {
        term = product(&term, &m, MATRIX_SIZE);
        for i in 0..MATRIX_SIZE {
            for j in 0..MATRIX_SIZE {
                term[i][j] = term[i][j].scaled(1.0 / k as f64);
                sum[i][j] = sum[i][j] + term[i][j];
            }
        }
    }
    for _ in 0..halvings {
        sum = product(&sum, &sum, MATRIX_SIZE);
    }
    sum
}

fn identity() -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| Dual::constant(f64::from(u8::from(i == j)))))
}

pub(super) fn product(a: &Matrix, b: &Matrix, size: usize) -> Matrix {
    let zero = Dual::constant(0.0);
    let mut c = [[zero; MATRIX_SIZE]; MATRIX_SIZE];
    for i in 0..size {
        for j in 0..size {
            c[i][j] = (0..size).fold(zero, |sum, k| sum + a[i][k] * b[k][j]);
        }
    }
    c
}

pub(super) fn matrix_vector_product(a: &Matrix, x: &Vector, size: usize) -> Vector {
    let zero = Dual::constant(0.0);
    let mut y = [zero; MATRIX_SIZE];
    for i in 0..size {
        y[i] = (0..size).fold(zero, |sum, j| sum + a[i][j] * x[j]);
    }
    y
}

/// Returns the coefficients of `det(I - q^-1 Phi)` without the leading 1, by the method of Faddeev and LeVerrier.
pub(super) fn characteristic_polynomial(phi: &Matrix, order: usize) -> Vec<Dual> {
    let mut coefficients = Vec::with_capacity(order);
    let mut m = identity();
    for k in 1..=order {
        let next = product(phi, &m, order);
        let trace = (0..order).fold(Dual::constant(0.0), |sum, i| sum + next[i][i]);
        let c = trace.scaled(-1.0 / k as f64);
        coefficients.push(c);
        m = next;
        for (i, row) in m.iter_mut().enumerate().take(order) {
            row[i] = row[i] + c;
        }
    }
    coefficients
}
