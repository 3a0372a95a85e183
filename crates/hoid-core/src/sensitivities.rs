//! Dependence of the errors in the filters of the predictor on the errors of the parameters.
//!
//! A wrong estimate leaves errors in the memory of the filters of the [`crate::predictor`]. The new errors are linear
//! functions of a vector X that contains theta~ and the past filter errors. The equations are in [`crate::error_bars`].

use crate::shape::Shape;

/// Layout of X: the positions of the parameters of A, of C and D, and of the past filter errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ErrorLayout {
    /// Number of coefficients of A, which come first in theta.
    pub na: usize,
    /// Index of the first coefficient of C and D, and number of coefficients of C and D.
    pub noise: (usize, usize),
    /// Index of the first dw among the filter errors, and number of stored dw.
    pub w: (usize, usize),
    /// Index of the first dv, and number of stored dv, which is zero without A, since dv then equals dw.
    pub v: (usize, usize),
    /// Index of the first de, and number of stored de.
    pub e: (usize, usize),
}

impl ErrorLayout {
    /// Returns the layout for a shape, with the parameters in the order of theta.
    #[inline(always)]
    pub fn of<S: Shape>(shape: &S) -> Self {
        let w = if shape.na() == 0 {
            shape.nf().max(shape.nd())
        } else {
            shape.nf()
        };
        let v = if shape.na() == 0 { 0 } else { shape.nd() };
        Self {
            na: shape.na(),
            noise: (shape.na() + shape.nb(), shape.nc() + shape.nd()),
            w: (0, w),
            v: (w, v),
            e: (w + v, shape.nc()),
        }
    }

    /// Layout without filter errors, for the default error bars with `h = psi`.
    pub const NO_FILTER_ERRORS: Self = Self {
        na: 0,
        noise: (0, 0),
        w: (0, 0),
        v: (0, 0),
        e: (0, 0),
    };

    /// Returns the layout for a shape, or [`ErrorLayout::NO_FILTER_ERRORS`] for K = 0.
    #[inline(always)]
    pub fn for_capacity<S: Shape, const K: usize>(shape: &S) -> Self {
        if K == 0 {
            Self::NO_FILTER_ERRORS
        } else {
            Self::of(shape)
        }
    }

    /// Returns the number of past filter errors.
    #[inline(always)]
    pub fn filter_error_count(&self) -> usize {
        self.e.0 + self.e.1
    }
}

/// Linear function of X: its coefficients for the parameters and for the filter errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearForm<const N: usize, const K: usize> {
    /// Coefficients for theta~.
    pub theta: [f64; N],
    /// Coefficients for the past dw, dv and de.
    pub filters: [f64; K],
}

/// Dependence of the new dw, dv and de on X. The dependence of de is also the sensitivity h of the innovation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitivities<const N: usize, const K: usize> {
    /// Dependence of dw on X.
    pub w: LinearForm<N, K>,
    /// Dependence of dv on X.
    pub v: LinearForm<N, K>,
    /// Dependence of de on X.
    pub e: LinearForm<N, K>,
}

impl<const N: usize, const K: usize> Sensitivities<N, K> {
    /// Returns the sensitivities for an estimate that does not change within the memory of its filters: h equals psi,
    /// and there are no filter errors.
    #[inline(always)]
    pub fn from_gradient(psi: &[f64; N]) -> Self {
        let form = LinearForm {
            theta: *psi,
            filters: [0.0; K],
        };
        Self {
            w: form,
            v: form,
            e: form,
        }
    }
}
