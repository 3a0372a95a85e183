//! Division of theta into the polynomials A, B, C, D and F.

use std::ops::Range;

use hoid_model::Orders;

/// The coefficients of each polynomial, as slices of theta.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polynomials<'t> {
    pub a: &'t [f64],
    pub b: &'t [f64],
    pub c: &'t [f64],
    pub d: &'t [f64],
    pub f: &'t [f64],
}

impl<'t> Polynomials<'t> {
    /// Splits theta in the order of [`Orders::parameter_names`]; the remaining elements belong to further inputs and
    /// are ignored.
    pub fn split(orders: &Orders, theta: &'t [f64]) -> Self {
        let (a, rest) = theta.split_at(orders.na);
        let (b, rest) = rest.split_at(orders.nb);
        let (c, rest) = rest.split_at(orders.nc);
        let (d, rest) = rest.split_at(orders.nd);
        let f = &rest[..orders.nf];
        Self { a, b, c, d, f }
    }
}

/// The polynomials as blocks of theta; the discriminant is the index of the filtered signal of the polynomial in the
/// workspace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Block {
    A,
    B,
    C,
    D,
    F,
    /// B and F of all further inputs, in the order of the inputs.
    Further,
}

impl Block {
    pub(super) const ALL: [Self; 6] = [Self::A, Self::B, Self::C, Self::D, Self::F, Self::Further];

    /// Returns the indices of the coefficients of this block in theta.
    pub fn range(self, o: &Orders) -> Range<usize> {
        let counts = [o.na, o.nb, o.nc, o.nd, o.nf, 0];
        let from = counts[..self as usize].iter().sum();
        from..from + counts[self as usize]
    }

    /// Returns the first shift, the number of shifts, and the sign of the columns of psi for this block.
    pub(super) fn shifts(self, o: &Orders) -> (usize, usize, f64) {
        match self {
            Self::A => (1, o.na, -1.0),
            Self::B => (0, o.nb, 1.0),
            Self::C => (1, o.nc, 1.0),
            Self::D => (1, o.nd, -1.0),
            Self::F => (1, o.nf, -1.0),
            // The columns of further inputs are computed separately, input by input.
            Self::Further => (0, 0, 1.0),
        }
    }
}
