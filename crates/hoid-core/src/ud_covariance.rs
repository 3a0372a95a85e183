//! Covariance matrix in factored form: `P = U D U'`, U unit upper triangular, D diagonal.
//!
//! P stays symmetric and positive semidefinite despite rounding as long as D stays nonnegative. The forgetting rules
//! need three operations:
//!
//! - **measurement** with the regressor psi and the variance R: `g = P psi/(R + psi' P psi)`,
//!   `P <- P - g psi' P`. With `f = U' psi`, `v = D f` and the partial sums
//!   `alpha_j = R + sum_{i<=j} f_i v_i`: `d_j <- d_j alpha_{j-1}/alpha_j`, and the columns of U
//!   follow (G. J. Bierman, *Factorization Methods for Discrete Sequential Estimation*, 1977,
//!   section V.3). A negative R, with all alpha negative, undoes a measurement by the same
//!   equations.
//! - **scaling** `P <- S P S` with a diagonal S: `U_ij <- U_ij s_i/s_j`, `d_j <- d_j s_j^2`. It is exact and implements
//!   the forgetting matrix.
//! - **rank-one update** `P <- P + c a a'` with `c >= 0` (W. S. Agee and R. H. Turner, 1972; Bierman, section III.4).
//!
//! N is the capacity for parameters. If there are fewer parameters, the d of the unused parameters are zero and stay
//! zero.

/// Factors `U D U'` of an N x N matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct UdCovariance<const N: usize> {
    /// Column j holds `U_ij`, i < j, and `d_j` in place of the unit diagonal element; the other elements are not used.
    /// The d_j are not contiguous, so no compiler loads them as a vector, in which the first element would wait for the
    /// last.
    u: [[f64; N]; N],
}

crate::state!([const N: usize] UdCovariance<N> { u });

impl<const N: usize> UdCovariance<N> {
    /// Returns the factors of a diagonal matrix.
    pub fn diagonal(d: [f64; N]) -> Self {
        let mut u = [[0.0; N]; N];
        for j in 0..N {
            u[j][j] = d[j];
        }
        Self { u }
    }

    /// Returns the factors of a symmetric matrix, or `None` unless it is positive semidefinite up to rounding. Rows and
    /// columns of zeros belong to parameters that stay constant.
    pub fn from_matrix(p: &[[f64; N]; N]) -> Option<Self> {
        let mut rest = *p;
        let mut factored = Self::diagonal([0.0; N]);
        for j in (0..N).rev() {
            let d = rest[j][j];
            if !(d >= 0.0 && d.is_finite()) {
                return None;
            }
            factored.u[j][j] = d;
            if d == 0.0 {
                // A parameter that stays constant cannot be correlated with other parameters.
                if (0..j).any(|i| rest[i][j] != 0.0) {
                    return None;
                }
                continue;
            }
            for i in 0..j {
                factored.u[j][i] = rest[i][j] / d;
            }
            for i in 0..j {
                for k in 0..=i {
                    rest[k][i] -= factored.u[j][i] * factored.u[j][k] * d;
                    rest[i][k] = rest[k][i];
                }
            }
        }
        Some(factored)
    }

    /// Performs the measurement described in the module documentation: updates P and returns the gain g.
    #[inline]
    pub fn measurement_update(&mut self, psi: &[f64; N], variance: f64) -> [f64; N] {
        self.inflate_and_update(1.0, psi, variance)
    }

    /// Performs `P <- growth P` and then the measurement, in one pass.
    #[inline(always)]
    pub fn inflate_and_update(&mut self, growth: f64, psi: &[f64; N], variance: f64) -> [f64; N] {
        let (mut f, mut v, mut grown) = ([0.0; N], [0.0; N], [0.0; N]);
        for j in 0..N {
            let mut sum = psi[j];
            for i in 0..j {
                sum += self.u[j][i] * psi[i];
            }
            grown[j] = self.u[j][j] * growth;
            f[j] = sum;
            v[j] = grown[j] * sum;
        }
        self.update_grown(grown, f, v, variance)
    }

    /// Performs the measurement with the given d_j (in `grown`) and projections f and v.
    #[inline(always)]
    fn update_grown(&mut self, grown: [f64; N], f: [f64; N], v: [f64; N], variance: f64) -> [f64; N] {
        // Bierman's recursion: alpha_j = R + sum_{i<=j} f_i v_i. All d_j are multiplied by positive ratios, so P stays
        // positive regardless of rounding. `gain` accumulates P psi.
        let mut gain = [0.0; N];
        let (mut before, mut inverse_before) = (variance, 1.0 / variance);
        for j in 0..N {
            let alpha = before + f[j] * v[j];
            let inverse = 1.0 / alpha;
            self.u[j][j] = grown[j] * (before * inverse);
            let along = f[j] * inverse_before;
            for i in 0..j {
                let old = self.u[j][i];
                self.u[j][i] = old - gain[i] * along;
                gain[i] += old * v[j];
            }
            gain[j] = v[j];
            (before, inverse_before) = (alpha, inverse);
        }
        for g in &mut gain {
            *g *= inverse_before;
        }
        gain
    }

    /// Returns `psi' P psi`.
    #[inline]
    pub fn quadratic_form(&self, psi: &[f64; N]) -> f64 {
        let (f, v) = self.projections(psi);
        f.iter().zip(&v).map(|(f, v)| f * v).sum()
    }

    /// Like [`UdCovariance::measurement_update`], given the result of [`UdCovariance::projections`] for psi.
    #[inline(always)]
    pub fn update_with_projections(&mut self, (f, v): ([f64; N], [f64; N]), variance: f64) -> [f64; N] {
        let grown = core::array::from_fn(|j| self.u[j][j]);
        self.update_grown(grown, f, v, variance)
    }

    /// Returns `f = U' psi` and `v = D f`, for which `psi' P psi = f' v`.
    #[inline(always)]
    pub fn projections(&self, psi: &[f64; N]) -> ([f64; N], [f64; N]) {
        let (mut f, mut v) = ([0.0; N], [0.0; N]);
        for j in 0..N {
            let mut sum = psi[j];
            for i in 0..j {
                sum += self.u[j][i] * psi[i];
            }
            f[j] = sum;
            v[j] = self.u[j][j] * sum;
        }
        (f, v)
    }

    /// Returns `P psi`.
    #[inline]
    pub fn times(&self, psi: &[f64; N]) -> [f64; N] {
        let (_, v) = self.projections(psi);
        let mut product = v;
        for j in 0..N {
            for i in 0..j {
                product[i] += self.u[j][i] * v[j];
            }
        }
        product
    }

    /// Performs `P <- squared P`.
    #[inline]
    pub fn scale_all(&mut self, squared: f64) {
        for j in 0..N {
            self.u[j][j] *= squared;
        }
    }

    /// Performs `P <- S P S` with `S = diag(s)`; `inverse` contains `1/s_j`.
    #[inline]
    pub fn scale(&mut self, s: &[f64; N], inverse: &[f64; N]) {
        for j in 0..N {
            self.u[j][j] *= s[j] * s[j];
            for i in 0..j {
                self.u[j][i] *= s[i] * inverse[j];
            }
        }
    }

    /// Performs `P <- P + c a a'` for nonnegative c.
    #[inline]
    pub fn rank_one_update(&mut self, mut c: f64, mut a: [f64; N]) {
        for j in (0..N).rev() {
            let s = a[j];
            let d = self.u[j][j] + c * s * s;
            // d is zero only if both of its terms are zero; the vector then has no component along this column.
            if d > 0.0 {
                let share = c / d;
                c = share * self.u[j][j];
                self.u[j][j] = d;
                let along = s * share;
                for i in 0..j {
                    a[i] -= s * self.u[j][i];
                    self.u[j][i] += along * a[i];
                }
            }
        }
    }

    /// Returns element (i, j) of P.
    pub fn element(&self, i: usize, j: usize) -> f64 {
        let of = |row: usize, column: usize| if row == column { 1.0 } else { self.u[column][row] };
        (i.max(j)..N).map(|k| of(i, k) * self.u[k][k] * of(j, k)).sum()
    }

    /// Returns the determinant of P.
    pub fn determinant(&self) -> f64 {
        (0..N).map(|j| self.u[j][j]).product()
    }

    /// Returns P.
    pub fn matrix(&self) -> [[f64; N]; N] {
        core::array::from_fn(|i| core::array::from_fn(|j| self.element(i, j)))
    }

    /// True if every number is finite and no variance is negative.
    #[inline(always)]
    pub fn is_valid(&self) -> bool {
        let mut sum = 0.0;
        let mut positive = true;
        for j in 0..N {
            positive &= self.u[j][j] >= 0.0;
            // Zero times infinity or NaN is NaN.
            for i in 0..=j {
                sum += 0.0 * self.u[j][i];
            }
        }
        positive && sum == 0.0
    }
}
