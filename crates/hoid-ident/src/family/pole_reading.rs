//! Assignment of the poles of a discrete-time model to the lag and to the neuromuscular system.
//!
//! The continuous-time poles are `s_i = ln z_i / Ts`. A pair of complex poles is the neuromuscular system, and the
//! remaining real pole is the lag. Two real poles alone are an overdamped neuromuscular system. If there are three real
//! poles, each of them may be the lag; callers try all three assignments and report the one that they use
//! ([`RealPole`]).

use hoid_model::{
    NotConvertible, SampleTime, operator::has_pole_at_origin, operator_family::Coordinate, polynomial,
    polynomial_model::monic,
};

/// Interpretation of a real pole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PoleRole {
    /// The lag: `T_I = 1/rate`.
    Lag,
    /// One of the two poles of an overdamped neuromuscular system.
    Neuromuscular,
}

/// A real pole `s = -rate`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RealPole {
    /// Rate of the pole, 1/s.
    pub rate: f64,
    /// Interpretation of the pole.
    pub role: PoleRole,
}

/// One possible assignment of the poles.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PoleAssignment {
    /// Rate of the lag, 1/s; `None` without a lag.
    pub lag: Option<f64>,
    /// omega_nm in rad/s and zeta_nm; `None` without a neuromuscular system.
    pub neuromuscular: Option<(f64, f64)>,
    /// Rates of the neuromuscular poles if these are real, 1/s.
    real: Vec<f64>,
}

impl PoleAssignment {
    pub fn real_poles(&self) -> Vec<RealPole> {
        let lag = self.lag.iter().map(|&rate| RealPole {
            rate,
            role: PoleRole::Lag,
        });
        let others = self.real.iter().map(|&rate| RealPole {
            rate,
            role: PoleRole::Neuromuscular,
        });
        let mut all: Vec<RealPole> = lag.chain(others).collect();
        all.sort_by(|a, b| a.rate.total_cmp(&b.rate));
        all
    }

    /// Returns the value of a coordinate that the poles determine; zero for any other coordinate.
    pub fn coordinate(&self, wanted: Coordinate) -> f64 {
        let (omega, zeta) = self.neuromuscular.unwrap_or((1.0, 1.0));
        match wanted {
            Coordinate::LagRate => self.lag.unwrap_or(0.0),
            Coordinate::LogOmega => omega.ln(),
            Coordinate::LogZeta => zeta.ln(),
            _ => 0.0,
        }
    }
}

/// Returns all possible assignments of the poles, which are the roots of `1 + f_1 z^-1 + ...`.
pub(super) fn pole_assignments(f: &[f64], sample_time: SampleTime) -> Result<Vec<PoleAssignment>, NotConvertible> {
    let other = |reason: String| NotConvertible::NotOfTheFamily { reason };
    let roots = polynomial::roots(&monic(f)).unwrap_or_default();
    if roots.len() != f.len() || !(1..=3).contains(&roots.len()) {
        return Err(other(format!(
            "operators of the family have one to three poles, found {}",
            f.len()
        )));
    }
    if has_pole_at_origin(f) {
        return Err(other(
            "a pole at z = 1 integrates the error, so the operator has no finite gain".to_owned(),
        ));
    }
    let (mut rates, mut pair) = (Vec::new(), None);
    for z in roots {
        if z.norm() >= 1.0 {
            return Err(other(format!(
                "the pole at |z| = {:.6} is not stable, so it is neither a lag nor a neuromuscular pole",
                z.norm()
            )));
        }
        if z.im == 0.0 && z.re <= 0.0 {
            return Err(NotConvertible::NegativeRealPole { pole: z.re });
        }
        let s = z.ln() / sample_time.s();
        if z.im == 0.0 {
            rates.push(-s.re);
        } else {
            pair = Some((s.norm(), -s.re / s.norm()));
        }
    }
    let overdamped = |a: f64, b: f64| Some(((a * b).sqrt(), 0.5 * (a + b) / (a * b).sqrt()));
    Ok(match (pair, rates.as_slice()) {
        (neuromuscular, &[]) => vec![PoleAssignment {
            lag: None,
            neuromuscular,
            real: Vec::new(),
        }],
        (neuromuscular, &[rate]) => vec![PoleAssignment {
            lag: Some(rate),
            neuromuscular,
            real: Vec::new(),
        }],
        (_, &[a, b]) => vec![PoleAssignment {
            lag: None,
            neuromuscular: overdamped(a, b),
            real: vec![a, b],
        }],
        (_, three) => (0..three.len())
            .map(|i| {
                let rest: Vec<f64> = (0..three.len()).filter(|j| *j != i).map(|j| three[j]).collect();
                PoleAssignment {
                    lag: Some(three[i]),
                    neuromuscular: overdamped(rest[0], rest[1]),
                    real: rest,
                }
            })
            .collect(),
    })
}
