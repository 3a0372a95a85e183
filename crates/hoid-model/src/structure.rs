//! Model structures and their orders (Table 5.1).
//!
//! The general family is `A(q^-1) u(t) = B(q^-1)/F(q^-1) e(t-nk) + C(q^-1)/D(q^-1) eps(t)` (eq. 5.1 times A). A
//! structure defines which polynomials are present. Orders follow the convention of common identification software: nb
//! is the number of coefficients `b0 ... b_{nb-1}` of B, each other order is the number of coefficients after the
//! leading 1, and nk is the delay of b0 in samples.
//!
//! This module contains the only list of structures: the command line, plans and Python use the names in it.
//!
//! ```
//! use hoid_model::Structure;
//!
//! let structure: Structure = "bj".parse()?;
//! assert_eq!(structure, Structure::BoxJenkins);
//! assert_eq!(structure.operator_orders(29).to_string(), "nb=2, nd=1, nf=2, nk=29");
//! assert_eq!((structure.to_string(), structure.label()), ("bj".to_owned(), "BJ".to_owned()));
//! # Ok::<(), hoid_model::UnknownName>(())
//! ```

use std::{collections::BTreeMap, fmt};

pub use hoid_core::stability::MAX_ORDER;

use crate::ModelError;

/// Structure of a model: the polynomials that are present (Table 5.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum Structure {
    /// `u = B q^-nk e + eps`: finite impulse response.
    Fir,
    /// `A u = eps`: autoregression of the output alone.
    Ar,
    /// `u = C eps`: moving average of the output alone.
    Ma,
    /// `A u = B q^-nk e + eps`.
    Arx,
    /// `A u = C eps`: the output alone.
    Arma,
    /// `A u = B q^-nk e + C eps`.
    Armax,
    /// `A u = B q^-nk e + (1/D) eps`.
    Ararx,
    /// `A u = B q^-nk e + (C/D) eps`.
    Ararmax,
    /// `u = (B/F) q^-nk e + eps`.
    OutputError,
    /// `u = (B/F) q^-nk e + (C/D) eps`.
    BoxJenkins,
    /// `A u = (B/F) q^-nk e + (C/D) eps`: all polynomials.
    General,
}

impl Structure {
    /// Returns the letters of the polynomials that the structure has, in the order of theta.
    pub fn polynomials(self) -> &'static str {
        match self {
            Self::Fir => "b",
            Self::Ar => "a",
            Self::Ma => "c",
            Self::Arx => "ab",
            Self::Arma => "ac",
            Self::Armax => "abc",
            Self::Ararx => "abd",
            Self::Ararmax => "abcd",
            Self::OutputError => "bf",
            Self::BoxJenkins => "bcdf",
            Self::General => "abcdf",
        }
    }

    /// True if the structure describes the response of the output to an input; AR, MA and ARMA describe the output
    /// alone.
    pub fn has_input(self) -> bool {
        self.polynomials().contains('b')
    }

    /// True if the residual is linear in theta (FIR, AR, ARX); least squares then gives the fit in one step.
    pub fn is_linear(self) -> bool {
        matches!(self, Self::Fir | Self::Ar | Self::Arx)
    }

    /// Returns the orders at which the structure is nearest to the human operator (two poles, b0 and b1) with a remnant
    /// of first order: `ARX(na=2, nb=2)`, `BJ(nb=2, nc=0, nd=1, nf=2)`. If the structure has no poles or no input, the
    /// orders are typical values.
    pub fn operator_orders(self, nk: usize) -> Orders {
        let base = Orders {
            nb: 2,
            nk,
            ..Orders::default()
        };
        match self {
            // 20 coefficients cover 0.2 s at 100 Hz, about one time constant `1/(zeta omega)` of the neuromuscular
            // system.
            Self::Fir => Orders { nb: 20, ..base },
            Self::Ar => Orders {
                na: 2,
                ..Orders::default()
            },
            Self::Ma => Orders {
                nc: 2,
                ..Orders::default()
            },
            Self::Arma => Orders {
                na: 2,
                nc: 1,
                ..Orders::default()
            },
            Self::Arx => Orders { na: 2, ..base },
            Self::Armax => Orders { na: 2, nc: 1, ..base },
            Self::Ararx => Orders { na: 2, nd: 1, ..base },
            Self::Ararmax => Orders {
                na: 2,
                nc: 1,
                nd: 1,
                ..base
            },
            Self::OutputError => Orders { nf: 2, ..base },
            Self::BoxJenkins | Self::General => Orders { nd: 1, nf: 2, ..base },
        }
    }

    /// Returns the name of the structure in tables and figures, such as `ARX` or `BJ`.
    pub fn label(self) -> String {
        match self {
            Self::General => self.name().to_owned(),
            named => named.name().to_uppercase(),
        }
    }
}

// The structures are in the order of Table 5.1, followed by the general form.
crate::named_choice!(Structure, "structure", 11, {
    Fir => "fir",
    Ar => "ar",
    Ma => "ma",
    Arx => "arx",
    Arma => "arma",
    Armax => "armax",
    Ararx => "ararx",
    Ararmax => "ararmax",
    OutputError => "oe",
    BoxJenkins => "bj",
    General => "general",
});

/// Longest delay of a model in samples: a hundred seconds at 10 kHz.
pub const MAX_DELAY: usize = 1_000_000;

/// Orders of a model: the numbers of coefficients of its polynomials, and the delay.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize)]
pub struct Orders {
    /// Number of coefficients `a1 ... a_na` of A.
    pub na: usize,
    /// Number of coefficients `b0 ... b_{nb-1}` of B.
    pub nb: usize,
    /// Number of coefficients `c1 ... c_nc` of C.
    pub nc: usize,
    /// Number of coefficients `d1 ... d_nd` of D.
    pub nd: usize,
    /// Number of coefficients `f1 ... f_nf` of F.
    pub nf: usize,
    /// Delay of b0 in samples.
    pub nk: usize,
}

impl Orders {
    /// Returns each order with its name.
    pub fn named_orders(&self) -> [(&'static str, usize); 6] {
        [
            ("na", self.na),
            ("nb", self.nb),
            ("nc", self.nc),
            ("nd", self.nd),
            ("nf", self.nf),
            ("nk", self.nk),
        ]
    }

    /// Returns the number of coefficients, which is the length of theta.
    pub fn parameter_count(&self) -> usize {
        self.na + self.nb + self.nc + self.nd + self.nf
    }

    /// Returns the names of the coefficients in the order of theta: `a1 .. b0 .. c1 .. d1 .. f1 ..`.
    pub fn parameter_names(&self) -> Vec<String> {
        let named = |letter: char, first: usize, n: usize| (first..first + n).map(move |i| format!("{letter}{i}"));
        named('a', 1, self.na)
            .chain(named('b', 0, self.nb))
            .chain(named('c', 1, self.nc))
            .chain(named('d', 1, self.nd))
            .chain(named('f', 1, self.nf))
            .collect()
    }

    /// Returns the index of the first sample whose regression needs no input or output from before the record:
    /// `max(na, nk + nb - 1)`.
    pub fn first_regressed_sample(&self) -> usize {
        self.na.max(self.nk.saturating_add(self.nb.saturating_sub(1)))
    }

    /// Checks that the orders are valid for the structure.
    ///
    /// # Errors
    /// [`ModelError::Orders`], which describes the problem.
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
        if self.nk > MAX_DELAY {
            return refuse(format!("nk must not exceed {MAX_DELAY} samples"));
        }
        if structure.has_input() && self.nb == 0 {
            return refuse(
                "B needs at least one coefficient (nb counts b0 ... b_{nb-1}); set nb = 1 or more, or use ar, ma or \
                 arma, which describe the output alone"
                    .to_owned(),
            );
        }
        if !structure.has_input() && self.nk > 0 {
            return refuse(format!(
                "the structure {structure} has no input, so a delay has no meaning; set nk = 0"
            ));
        }
        if self.parameter_count() == 0 {
            return refuse(format!(
                "the structure {structure} needs at least one coefficient in {}",
                structure.polynomials()
            ));
        }
        Ok(())
    }
}

impl fmt::Display for Orders {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts: Vec<String> = self
            .named_orders()
            .iter()
            .filter(|(name, n)| *n > 0 && *name != "nk")
            .map(|(name, n)| format!("{name}={n}"))
            .collect();
        // Without an input there is no delay.
        if self.nb > 0 || parts.is_empty() {
            parts.push(format!("nk={}", self.nk));
        }
        f.write_str(&parts.join(", "))
    }
}

/// Returns theta in the order of `names`, with the coefficients from `start`. Each coefficient must be given.
///
/// # Errors
/// A description of the problem, as the end of a sentence that starts with the name of the option.
pub fn theta_from_start(names: &[String], start: &BTreeMap<String, f64>) -> Result<Vec<f64>, String> {
    if let Some(unknown) = start.keys().find(|name| !names.contains(name)) {
        return Err(format!(
            "contains {unknown}, which is not a parameter of the model; expected {}",
            names.join(", ")
        ));
    }
    let missing: Vec<&str> = (names.iter())
        .filter(|name| !start.contains_key(*name))
        .map(String::as_str)
        .collect();
    if !missing.is_empty() {
        return Err(format!(
            "lacks {}; give all coefficients, or none to let the program choose the start",
            missing.join(", ")
        ));
    }
    if let Some((name, value)) = start.iter().find(|(_, v)| !v.is_finite()) {
        return Err(format!("has {name} = {value}, expected a finite number"));
    }
    Ok(names.iter().map(|name| start[name]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operator_orders_match_the_reference() {
        let bj = Structure::BoxJenkins.operator_orders(29);
        assert_eq!(bj.to_string(), "nb=2, nd=1, nf=2, nk=29");
        assert_eq!(
            Structure::Arma.operator_orders(29).to_string(),
            "na=2, nc=1",
            "no input, no delay"
        );
        assert_eq!(bj.parameter_names(), ["b0", "b1", "d1", "f1", "f2"]);
        assert_eq!(bj.parameter_count(), 5);
        let arx = Structure::Arx.operator_orders(29);
        assert_eq!(arx.parameter_names(), ["a1", "a2", "b0", "b1"]);
        // This is i0 of eq. 5.33, counted from 0.
        assert_eq!(arx.first_regressed_sample(), 30);
    }

    #[test]
    fn structure_accepts_only_its_own_orders() {
        for structure in Structure::ALL {
            let orders = structure.operator_orders(if structure.has_input() { 5 } else { 0 });
            assert!(orders.check(structure).is_ok(), "{structure}");
            for other in Structure::ALL {
                let fits = other
                    .polynomials()
                    .chars()
                    .all(|letter| structure.polynomials().contains(letter));
                if !fits && other != Structure::General {
                    assert!(
                        other.operator_orders(0).check(structure).is_err(),
                        "{other} as {structure}"
                    );
                }
            }
        }
        let delayed = Orders {
            na: 2,
            nk: 3,
            ..Orders::default()
        };
        assert!(
            delayed
                .check(Structure::Ar)
                .unwrap_err()
                .to_string()
                .contains("no input")
        );
        assert!(Orders::default().check(Structure::Ma).is_err());
    }

    #[test]
    fn contradictory_orders_are_refused() {
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

    #[test]
    fn incomplete_theta_is_refused() {
        let names: Vec<String> = ["b0", "f1"].map(str::to_owned).to_vec();
        let of = |start: &[(&str, f64)]| {
            theta_from_start(&names, &start.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect())
        };
        assert_eq!(of(&[("f1", -1.9), ("b0", 0.04)]), Ok(vec![0.04, -1.9]));
        for (start, reason) in [
            (&[("f1", 1.0)][..], "lacks b0"),
            (&[("a1", 1.0)], "contains a1"),
            (&[("b0", f64::NAN), ("f1", 1.0)], "b0 = NaN"),
        ] {
            assert!(of(start).unwrap_err().contains(reason), "{reason}");
        }
    }
}
