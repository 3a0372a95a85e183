//! Model structures and their orders (Table 5.1).
//!
//! The general family is `A(q^-1) u(t) = B(q^-1)/F(q^-1) e(t-nk) + C(q^-1)/D(q^-1) eps(t)` (eq. 5.1 times A). A structure says
//! which polynomials are there. Orders follow the field's software: nb counts the coefficients `b0 ... b_{nb-1}` of B, the
//! others count the coefficients behind the leading one, nk is the delay of b0 in samples.

use std::fmt;

use hoid_core::stability::MAX_ORDER;

use crate::ModelError;

/// Which polynomials a model has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Structure {
    /// `A u = B q^-nk e + eps`.
    Arx,
    /// `u = (B/F) q^-nk e + (C/D) eps`.
    BoxJenkins,
}

impl Structure {
    /// The polynomials of the structure, in the order of theta.
    pub fn polynomials(self) -> &'static str {
        match self {
            Self::Arx => "ab",
            Self::BoxJenkins => "bcdf",
        }
    }

    /// The structure of the human operator with n poles at its end: `ARX(na=2, nb=2)` or `BJ(nb=2, nc=0, nd=1, nf=2)`.
    pub fn operator_orders(self, nk: usize) -> Orders {
        let base = Orders {
            nb: 2,
            nk,
            ..Orders::default()
        };
        match self {
            Self::Arx => Orders { na: 2, ..base },
            Self::BoxJenkins => Orders { nd: 1, nf: 2, ..base },
        }
    }

    /// Short name as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Arx => "arx",
            Self::BoxJenkins => "bj",
        }
    }
}

impl fmt::Display for Structure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Arx => "ARX",
            Self::BoxJenkins => "BJ",
        })
    }
}

/// Numbers of coefficients and the delay.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Orders {
    /// Coefficients `a1 ... a_na` of A.
    pub na: usize,
    /// Coefficients `b0 ... b_{nb-1}` of B.
    pub nb: usize,
    /// Coefficients `c1 ... c_nc` of C.
    pub nc: usize,
    /// Coefficients `d1 ... d_nd` of D.
    pub nd: usize,
    /// Coefficients `f1 ... f_nf` of F.
    pub nf: usize,
    /// Delay of b0 in samples.
    pub nk: usize,
}

impl Orders {
    /// Number of coefficients, the length of theta.
    pub fn parameters(&self) -> usize {
        self.na + self.nb + self.nc + self.nd + self.nf
    }

    /// Names of the coefficients in the order of theta: `a1 .. b0 .. c1 .. d1 .. f1 ..`.
    pub fn parameter_names(&self) -> Vec<String> {
        let named = |letter: char, first: usize, n: usize| (first..first + n).map(move |i| format!("{letter}{i}"));
        named('a', 1, self.na)
            .chain(named('b', 0, self.nb))
            .chain(named('c', 1, self.nc))
            .chain(named('d', 1, self.nd))
            .chain(named('f', 1, self.nf))
            .collect()
    }

    /// First sample at which the undisturbed part can be computed without any input or output from before the record:
    /// `max(na, nk + nb - 1)`.
    pub fn first_regressed_sample(&self) -> usize {
        self.na.max(self.nk + self.nb.saturating_sub(1))
    }

    /// Checks the orders against the structure.
    ///
    /// # Errors
    /// [`ModelError::Orders`] with what is wrong.
    pub fn check(&self, structure: Structure) -> Result<(), ModelError> {
        let refuse = |expected: String| {
            Err(ModelError::Orders {
                found: self.to_string(),
                expected,
            })
        };
        let all = [
            ('a', self.na),
            ('b', self.nb),
            ('c', self.nc),
            ('d', self.nd),
            ('f', self.nf),
        ];
        for (letter, n) in all {
            if n > 0 && !structure.polynomials().contains(letter) {
                return refuse(format!(
                    "the structure {structure} has no polynomial {letter}; set n{letter} = 0"
                ));
            }
            if n > MAX_ORDER {
                return refuse(format!("n{letter} must not exceed {MAX_ORDER}"));
            }
        }
        if self.nb == 0 {
            return refuse(
                "B needs at least one coefficient (nb counts b0 ... b_{nb-1}); set nb = 1 or more".to_owned(),
            );
        }
        Ok(())
    }
}

impl fmt::Display for Orders {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = [
            ("na", self.na),
            ("nb", self.nb),
            ("nc", self.nc),
            ("nd", self.nd),
            ("nf", self.nf),
        ];
        for (name, n) in all {
            if n > 0 {
                write!(f, "{name}={n}, ")?;
            }
        }
        write!(f, "nk={}", self.nk)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operator_orders_are_those_of_the_reference() {
        let bj = Structure::BoxJenkins.operator_orders(29);
        assert_eq!(bj.to_string(), "nb=2, nd=1, nf=2, nk=29");
        assert_eq!(bj.parameter_names(), ["b0", "b1", "d1", "f1", "f2"]);
        assert_eq!(bj.parameters(), 5);
        let arx = Structure::Arx.operator_orders(29);
        assert_eq!(arx.parameter_names(), ["a1", "a2", "b0", "b1"]);
        // i0 of eq. 5.33, counted from 0.
        assert_eq!(arx.first_regressed_sample(), 30);
    }

    #[test]
    fn contradictions_are_refused() {
        let bj = Structure::BoxJenkins.operator_orders(29);
        assert!(bj.check(Structure::BoxJenkins).is_ok());
        assert!(
            bj.check(Structure::Arx)
                .unwrap_err()
                .to_string()
                .contains("no polynomial d")
        );
        assert!(Orders { nb: 0, ..bj }.check(Structure::BoxJenkins).is_err());
        assert!(Orders { nd: 1000, ..bj }.check(Structure::BoxJenkins).is_err());
    }
}
