//! Dependence of the errors in the filters of the predictor on those of the parameters.
//!
//! A wrong estimate leaves errors in the memory of the filters of the [`crate::predictor`]. With theta~ and the past
//! errors in a vector X, the new ones are linear functions of X;
//! [`crate::error_bars`] has the equations.

use crate::shape::Shape;

/// The layout of X: the parameters that belong to A, and to C and D, and the number of past errors of the filters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ErrorLayout {
    /// Number of coefficients of A, which come first.
    pub na: usize,
    /// Index of the first coefficient of C and D, and their number.
    pub noise: (usize, usize),
    /// Index of the first dw among the errors of the filters, and their number.
    pub w: (usize, usize),
    /// Index of the first dv, and their number; none without A, for which dv is dw.
    pub v: (usize, usize),
    /// Index of the first de, and their number.
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

    /// No errors of filters: the default error bars, with `h = psi`.
    pub const NONE: Self = Self {
        na: 0,
        noise: (0, 0),
        w: (0, 0),
        v: (0, 0),
        e: (0, 0),
    };

    /// Returns the layout for a shape, or [`ErrorLayout::NONE`] for K = 0.
    #[inline(always)]
    pub fn for_capacity<S: Shape, const K: usize>(shape: &S) -> Self {
        if K == 0 { Self::NONE } else { Self::of(shape) }
    }

    /// Returns the number of past errors of the filters.
    #[inline(always)]
    pub fn filter_errors(&self) -> usize {
        self.e.0 + self.e.1
    }
}

/// A linear function of X: its coefficients for the parameters and for the errors of the filters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearForm<const N: usize, const K: usize> {
    /// For theta~.
    pub theta: [f64; N],
    /// For the past dw, dv and de.
    pub filters: [f64; K],
}

/// Dependence of the new dw, dv and de on X; the last is also the sensitivity h of the innovation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitivities<const N: usize, const K: usize> {
    /// Of dw.
    pub w: LinearForm<N, K>,
    /// Of dv.
    pub v: LinearForm<N, K>,
    /// Of de.
    pub e: LinearForm<N, K>,
}

impl<const N: usize, const K: usize> Sensitivities<N, K> {
    /// Returns the sensitivities of an estimate that does not change within the memory of its filters: `h = psi`, and
    /// no errors in the filters.
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
