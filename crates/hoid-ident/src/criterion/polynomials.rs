//! The polynomials A, B, C, D and F as parts of theta.

use std::ops::Range;

use hoid_model::Orders;

/// The polynomials of theta.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polynomials<'t> {
    pub a: &'t [f64],
    pub b: &'t [f64],
    pub c: &'t [f64],
    pub d: &'t [f64],
    pub f: &'t [f64],
}

impl<'t> Polynomials<'t> {
    /// Splits theta in the order of [`Orders::parameter_names`]; the remaining elements belong to further inputs.
    pub fn split(orders: &Orders, theta: &'t [f64]) -> Self {
        let (a, rest) = theta.split_at(orders.na);
        let (b, rest) = rest.split_at(orders.nb);
        let (c, rest) = rest.split_at(orders.nc);
        let (d, rest) = rest.split_at(orders.nd);
        let f = &rest[..orders.nf];
        Self { a, b, c, d, f }
    }
}

/// The polynomials as blocks of theta; the number is the place of their signal in the workspace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Block {
    A,
    B,
    C,
    D,
    F,
    /// B and F of all further inputs, in their order.
    Further,
}

impl Block {
    pub(super) const ALL: [Self; 6] = [Self::A, Self::B, Self::C, Self::D, Self::F, Self::Further];

    /// Returns the indices of its coefficients in theta.
    pub fn place(self, o: &Orders) -> Range<usize> {
        let counts = [o.na, o.nb, o.nc, o.nd, o.nf, 0];
        let from = counts[..self as usize].iter().sum();
        from..from + counts[self as usize]
    }

    /// Returns first shift, number of shifts, and sign of psi.
    pub(super) fn shifts(self, o: &Orders) -> (usize, usize, f64) {
        match self {
            Self::A => (1, o.na, -1.0),
            Self::B => (0, o.nb, 1.0),
            Self::C => (1, o.nc, 1.0),
            Self::D => (1, o.nd, -1.0),
            Self::F => (1, o.nf, -1.0),
            // Their columns are computed for one input after the other.
            Self::Further => (0, 0, 1.0),
        }
    }
}
