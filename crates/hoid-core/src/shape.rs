//! Orders of the general model, stored as values or in the type.
//!
//! The parameters of `A u = (B/F) q^-nk e + (C/D) eps` form one vector, `theta = [a.. b.. c.. d.. f..]`. A [`Shape`]
//! contains the number of coefficients of each polynomial, and therefore the position of each polynomial in theta.

/// Numbers of coefficients of A, B, C, D and F.
///
/// [`AnyShape`] stores these numbers as values. [`FixedShape`] has them in its type, so the compiler unrolls every loop
/// over coefficients: the operations and their order are the same, but take half the time.
pub trait Shape: Copy {
    /// Number of coefficients `a_1 ...`.
    fn na(&self) -> usize;
    /// Number of coefficients `b_0 ...`.
    fn nb(&self) -> usize;
    /// Number of coefficients `c_1 ...`.
    fn nc(&self) -> usize;
    /// Number of coefficients `d_1 ...`.
    fn nd(&self) -> usize;
    /// Number of coefficients `f_1 ...`.
    fn nf(&self) -> usize;

    /// Returns the length of `theta = [a.. b.. c.. d.. f..]`.
    #[inline]
    fn parameter_count(&self) -> usize {
        self.na() + self.nb() + self.nc() + self.nd() + self.nf()
    }

    /// Splits theta into `[a, b, c, d, f]`.
    #[inline]
    fn split<'t, R>(&self, theta: &'t [R]) -> [&'t [R]; 5] {
        let (a, rest) = theta.split_at(self.na());
        let (b, rest) = rest.split_at(self.nb());
        let (c, rest) = rest.split_at(self.nc());
        let (d, rest) = rest.split_at(self.nd());
        [a, b, c, d, &rest[..self.nf()]]
    }
}

/// Orders stored as values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AnyShape {
    /// Number of coefficients `a_1 ...`.
    pub na: usize,
    /// Number of coefficients `b_0 ...`.
    pub nb: usize,
    /// Number of coefficients `c_1 ...`.
    pub nc: usize,
    /// Number of coefficients `d_1 ...`.
    pub nd: usize,
    /// Number of coefficients `f_1 ...`.
    pub nf: usize,
}

impl Shape for AnyShape {
    #[inline]
    fn na(&self) -> usize {
        self.na
    }

    #[inline]
    fn nb(&self) -> usize {
        self.nb
    }

    #[inline]
    fn nc(&self) -> usize {
        self.nc
    }

    #[inline]
    fn nd(&self) -> usize {
        self.nd
    }

    #[inline]
    fn nf(&self) -> usize {
        self.nf
    }
}

/// Orders given as parameters of the type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FixedShape<const NA: usize, const NB: usize, const NC: usize, const ND: usize, const NF: usize>;

impl<const NA: usize, const NB: usize, const NC: usize, const ND: usize, const NF: usize> Shape
    for FixedShape<NA, NB, NC, ND, NF>
{
    #[inline]
    fn na(&self) -> usize {
        NA
    }

    #[inline]
    fn nb(&self) -> usize {
        NB
    }

    #[inline]
    fn nc(&self) -> usize {
        NC
    }

    #[inline]
    fn nd(&self) -> usize {
        ND
    }

    #[inline]
    fn nf(&self) -> usize {
        NF
    }
}
