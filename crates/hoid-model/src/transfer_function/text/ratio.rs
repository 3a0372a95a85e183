//! Quotients of polynomials with a delay, during parsing.

use crate::polynomial;

/// `num/den e^{-s tau}` during parsing: it may be improper, and its delay may be negative.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ratio {
    pub num: Vec<f64>,
    pub den: Vec<f64>,
    pub delay_s: f64,
}

impl Ratio {
    pub fn of(num: &[f64]) -> Self {
        Self {
            num: num.to_vec(),
            den: vec![1.0],
            delay_s: 0.0,
        }
    }

    pub fn is_zero(&self) -> bool {
        self.num.iter().all(|c| *c == 0.0)
    }

    pub fn times(&self, other: &Self) -> Self {
        Self {
            num: polynomial::product(&self.num, &other.num),
            den: polynomial::product(&self.den, &other.den),
            delay_s: self.delay_s + other.delay_s,
        }
    }

    pub fn inverse(&self) -> Self {
        Self {
            num: self.den.clone(),
            den: self.num.clone(),
            delay_s: -self.delay_s,
        }
    }

    /// Returns `self + sign * other`; `None` if the delays of the two terms differ.
    pub fn plus(&self, other: &Self, sign: f64) -> Option<Self> {
        if self.delay_s != other.delay_s {
            return None;
        }
        let (a, mut b, den) = if self.den == other.den {
            (self.num.clone(), other.num.clone(), self.den.clone())
        } else {
            (
                polynomial::product(&self.num, &other.den),
                polynomial::product(&other.num, &self.den),
                polynomial::product(&self.den, &other.den),
            )
        };
        b.iter_mut().for_each(|c| *c *= sign);
        let n = a.len().max(b.len());
        let at = |p: &[f64], i: usize| (i + p.len()).checked_sub(n).map_or(0.0, |k| p[k]);
        Some(Self {
            num: (0..n).map(|i| at(&a, i) + at(&b, i)).collect(),
            den,
            delay_s: self.delay_s,
        })
    }
}
