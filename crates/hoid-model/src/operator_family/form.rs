//! The forms of the family, and the coordinates of an operator.

use super::dual::{Dual, PARTIAL_COUNT};

/// A form of the operator, without its delay and neuromuscular part; p is the power of the lead, q the power of the
/// lag.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Form {
    /// `K` (p = 0, q = 0).
    Gain,
    /// `K (T_L s + 1)` (p = 1, q = 0; eq. 2).
    Lead,
    /// `K (T_L s + 1)^2` (p = 2, q = 0).
    Lead2,
    /// `K / (T_I s + 1)` (p = 0, q = 1).
    Lag,
    /// `K (T_L s + 1) / (T_I s + 1)` (p = 1, q = 1; eq. 2.2).
    LeadLag,
    /// `K (T_L s + 1)^2 / (T_I s + 1)` (p = 2, q = 1).
    Lead2Lag,
    /// `K_I (1 + c_1 s + c_2 s^2) / s`: a free quadratic numerator over s. Here and in [`Form::LeadDroop`], the
    /// integration has a leak of 1e-4 1/s.
    QuadraticIntegral,
    /// `K (T_L s + 1) (1 + alpha/s)`: a lead with a phase droop at low frequencies; `1 + alpha/s` approximates
    /// `e^{-j alpha/omega}`.
    LeadDroop,
    /// `K_d s`: the response to the rate of a displayed target.
    Derivative,
    /// `K_d s (T_L s + 1)`: the response to the rate and the acceleration of a displayed target.
    DerivativeLead,
    /// `K_m s^2 (0.11 s + 1)/(5.9 s + 1)`: the response of the semicircular canals to rotation, for an input that is an
    /// angle. The canals respond to the angular acceleration with fixed time constants (R. J. A. W. Hosman, *Pilot's
    /// Perception and Control of Aircraft Motions*, 1996; P. M. T. Zaal et al., J. Guidance, Control, and Dynamics 32
    /// (2009) 1089-1099).
    Canals,
    /// `K_m s (0.11 s + 1)/(5.9 s + 1)`: as [`Form::Canals`], for an input that is an angular rate.
    CanalsRate,
}

crate::named_choice!(Form, "form of the operator", 12, {
    Gain => "gain",
    Lead => "lead",
    Lead2 => "lead2",
    Lag => "lag",
    LeadLag => "lead-lag",
    Lead2Lag => "lead2-lag",
    QuadraticIntegral => "quadratic-integral",
    LeadDroop => "lead-droop",
    Derivative => "derivative",
    DerivativeLead => "derivative-lead",
    Canals => "canals",
    CanalsRate => "canals-rate",
});

/// Leak rate of an integration, 1/s. It is too low to be visible in a record, but keeps the discrete model stable.
const LEAK_RATE_PER_S: f64 = 1e-4;

/// Time constants of the lead and the lag of the semicircular canals, s. Between 0.17 and 9 rad/s, the lag turns the
/// response to the angular acceleration into a response to the angular rate.
const CANAL_TIME_CONSTANTS_S: (f64, f64) = (0.11, 5.9);

/// Number of coefficients of the numerator, for powers of s from 0 to 3.
pub const POWER_COUNT: usize = 4;

/// A coordinate in which an operator is fitted. The lag and the neuromuscular part are fitted in coordinates whose
/// estimates are nearly normal even if the data carry little information.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum Coordinate {
    /// Gain of the form: K without a pole, `K/T_I` with a lag, K_I with an integration, K_d (in s) of a derivative, K_m
    /// of the semicircular canals.
    Gain,
    /// T_L, s.
    Lead,
    /// `1/T_I`, 1/s; zero gives a pure integration.
    LagRate,
    /// c_1 of the quadratic numerator, s.
    Linear,
    /// c_2 of the quadratic numerator, s^2.
    Quadratic,
    /// alpha of the droop, rad/s.
    Droop,
    /// `ln omega_nm`, omega_nm in rad/s.
    LogOmega,
    /// `ln zeta_nm`.
    LogZeta,
    /// tau_e, s.
    Delay,
}

impl Coordinate {
    /// All coordinates that occur in a form.
    pub const ALL: [Self; 9] = [
        Self::Gain,
        Self::Lead,
        Self::LagRate,
        Self::Linear,
        Self::Quadratic,
        Self::Droop,
        Self::LogOmega,
        Self::LogZeta,
        Self::Delay,
    ];

    /// Returns the name of the parameter to which the coordinate is related: T_I for `1/T_I`, and K for every gain,
    /// although the gain is `K/T_I`, K_I or K_e in some forms.
    pub fn parameter(self) -> &'static str {
        match self {
            Self::Gain => "K",
            Self::Lead => "T_L",
            Self::LagRate => "T_I",
            Self::Linear => "c_1",
            Self::Quadratic => "c_2",
            Self::Droop => "alpha",
            Self::LogOmega => "omega_nm",
            Self::LogZeta => "zeta_nm",
            Self::Delay => "tau_e",
        }
    }

    /// Returns the coordinate that belongs to a parameter name; `None` for K_e_dot, which is a product of two
    /// coordinates, and for unknown names.
    pub fn from_parameter(name: &str) -> Option<Self> {
        match name {
            "K_over_T_I" | "K_I" | "K_e" | "K_d" | "K_m" | "K_m_rate" => Some(Self::Gain),
            _ => Self::ALL.into_iter().find(|coordinate| coordinate.parameter() == name),
        }
    }

    /// Returns the name of the coordinate: the name of its parameter, or of the transformed parameter.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gain => "gain",
            Self::Lead => "T_L",
            Self::LagRate => "1/T_I",
            Self::Linear => "c_1",
            Self::Quadratic => "c_2",
            Self::Droop => "alpha",
            Self::LogOmega => "ln omega_nm",
            Self::LogZeta => "ln zeta_nm",
            Self::Delay => "tau_e",
        }
    }
}

/// Numerator `n_0 + n_1 s + n_2 s^2 + n_3 s^3` of an operator, and its pole `-a`, if it has one.
pub(super) struct Rational {
    pub numerator: [Dual; POWER_COUNT],
    pub pole: Option<Dual>,
}

impl Form {
    /// Forms of the response to the error. Derivative forms are excluded, because people respond to a constant error.
    pub const ERROR_FORMS: [Self; 8] = [
        Self::Gain,
        Self::Lead,
        Self::Lead2,
        Self::Lag,
        Self::LeadLag,
        Self::Lead2Lag,
        Self::QuadraticIntegral,
        Self::LeadDroop,
    ];

    /// Forms of the response to a displayed target: to its value, rate and acceleration.
    pub const TARGET_FORMS: [Self; 5] = [
        Self::Gain,
        Self::Lead,
        Self::Lag,
        Self::Derivative,
        Self::DerivativeLead,
    ];

    /// Forms of the response to motion, for an input that is an angle: to the angle, to its rate, and by the
    /// semicircular canals (R. A. Hess, J. Guidance, Control, and Dynamics 13 (1990) 131-140, for the rate; D. M. Pool,
    /// *Objective Evaluation of Flight Simulator Motion Cueing Fidelity*, 2012, for the canals).
    pub const MOTION_FORMS: [Self; 4] = [Self::Gain, Self::Lag, Self::Derivative, Self::Canals];

    /// True if the steady response of the form to a constant input is zero.
    pub fn is_derivative(self) -> bool {
        matches!(
            self,
            Self::Derivative | Self::DerivativeLead | Self::Canals | Self::CanalsRate
        )
    }

    /// Returns the name and the unit of the parameter by which a gain of this form is given: `K`, `K_I`, `K_d` or
    /// `K_m`.
    pub fn gain_name_and_unit(self) -> (&'static str, &'static str) {
        match self {
            Self::QuadraticIntegral => ("K_I", "1/s"),
            Self::Derivative | Self::DerivativeLead => ("K_d", "s"),
            Self::Canals => ("K_m", "s^2"),
            Self::CanalsRate => ("K_m_rate", "s"),
            _ => ("K", ""),
        }
    }

    /// Returns the degree of the numerator, which is the power p of the lead in forms that consist of a lead and a lag.
    pub fn degree(self) -> usize {
        match self {
            Self::Gain | Self::Lag => 0,
            Self::Lead | Self::LeadLag | Self::Derivative => 1,
            Self::Lead2 | Self::Lead2Lag | Self::QuadraticIntegral | Self::LeadDroop | Self::DerivativeLead => 2,
            Self::CanalsRate => 2,
            Self::Canals => 3,
        }
    }

    /// True if the form has a pole, without the neuromuscular part: a lag, an integration, or the pole of the canals.
    pub fn has_pole(self) -> bool {
        !matches!(
            self,
            Self::Gain | Self::Lead | Self::Lead2 | Self::Derivative | Self::DerivativeLead
        )
    }

    /// True if the pole is a lag with a time constant T_I.
    pub fn has_lag(self) -> bool {
        matches!(self, Self::Lag | Self::LeadLag | Self::Lead2Lag)
    }

    /// True if the degree of the numerator does not exceed that of the denominator; the operator then does not
    /// differentiate its input.
    pub fn is_proper(self, neuromuscular: bool) -> bool {
        self.degree() <= usize::from(self.has_pole()) + if neuromuscular { 2 } else { 0 }
    }

    /// Returns the number of coordinates of the form without the neuromuscular part; a form with fewer coordinates is
    /// simpler.
    pub fn coordinate_count(self) -> usize {
        self.coordinates(false).len()
    }

    /// Returns the coordinates of the form, in the order in which they are fitted.
    pub fn coordinates(self, neuromuscular: bool) -> Vec<Coordinate> {
        let mut all = vec![Coordinate::Gain];
        match self {
            Self::Gain | Self::Derivative | Self::Canals | Self::CanalsRate => {}
            Self::Lead | Self::Lead2 | Self::DerivativeLead => all.push(Coordinate::Lead),
            Self::Lag => all.push(Coordinate::LagRate),
            Self::LeadLag | Self::Lead2Lag => all.extend([Coordinate::Lead, Coordinate::LagRate]),
            Self::QuadraticIntegral => all.extend([Coordinate::Linear, Coordinate::Quadratic]),
            Self::LeadDroop => all.extend([Coordinate::Lead, Coordinate::Droop]),
        }
        if neuromuscular {
            all.extend([Coordinate::LogOmega, Coordinate::LogZeta]);
        }
        all.push(Coordinate::Delay);
        all
    }

    /// Number of coordinates of the numerator other than the gain: T_L, or c_1 and c_2, or T_L and alpha. These
    /// coordinates follow the gain in [`Form::coordinates`] and precede the coordinates of the poles.
    pub fn shape_coordinate_count(self) -> usize {
        match self {
            Self::Gain | Self::Lag | Self::Derivative | Self::Canals | Self::CanalsRate => 0,
            Self::Lead | Self::Lead2 | Self::LeadLag | Self::Lead2Lag | Self::DerivativeLead => 1,
            Self::QuadraticIntegral | Self::LeadDroop => 2,
        }
    }

    /// Returns the numerator divided by its gain, `m_0 + m_1 s + m_2 s^2 + m_3 s^3`, and the derivatives of these
    /// coefficients with respect to x. Here x contains the coordinates of the numerator that follow the gain.
    pub fn shape(self, x: &[f64]) -> ([f64; POWER_COUNT], [[f64; POWER_COUNT]; 2]) {
        let none = [0.0; POWER_COUNT];
        let (lead, lag) = CANAL_TIME_CONSTANTS_S;
        match self {
            Self::Gain | Self::Lag => ([1.0, 0.0, 0.0, 0.0], [none; 2]),
            Self::Lead | Self::LeadLag => ([1.0, x[0], 0.0, 0.0], [[0.0, 1.0, 0.0, 0.0], none]),
            Self::Lead2 | Self::Lead2Lag => {
                let t = x[0];
                ([1.0, 2.0 * t, t * t, 0.0], [[0.0, 2.0, 2.0 * t, 0.0], none])
            }
            Self::QuadraticIntegral => ([1.0, x[0], x[1], 0.0], [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]),
            Self::LeadDroop => {
                let (t, alpha) = (x[0], x[1]);
                (
                    [alpha, 1.0 + t * alpha, t, 0.0],
                    [[0.0, alpha, 1.0, 0.0], [1.0, t, 0.0, 0.0]],
                )
            }
            Self::Derivative => ([0.0, 1.0, 0.0, 0.0], [none; 2]),
            Self::DerivativeLead => ([0.0, 1.0, x[0], 0.0], [[0.0, 0.0, 1.0, 0.0], none]),
            // The denominator is s + 1/5.9, so the numerator is divided by 5.9.
            Self::Canals => ([0.0, 0.0, 1.0 / lag, lead / lag], [none; 2]),
            Self::CanalsRate => ([0.0, 1.0 / lag, lead / lag, 0.0], [none; 2]),
        }
    }

    /// Computes the numerator and the pole from the coordinates, without the neuromuscular part and the delay.
    pub(super) fn rational(self, x: &[Dual]) -> Rational {
        let zero = Dual::constant(0.0);
        let k = x[0];
        let (lead, lag) = CANAL_TIME_CONSTANTS_S;
        let canals = Some(Dual::constant(1.0 / lag));
        let (numerator, pole) = match self {
            Self::Gain => ([k, zero, zero, zero], None),
            Self::Lead => ([k, k * x[1], zero, zero], None),
            Self::Lead2 => ([k, (k * x[1]).scaled(2.0), k * x[1] * x[1], zero], None),
            Self::Lag => ([k, zero, zero, zero], Some(x[1])),
            Self::LeadLag => ([k, k * x[1], zero, zero], Some(x[2])),
            Self::Lead2Lag => ([k, (k * x[1]).scaled(2.0), k * x[1] * x[1], zero], Some(x[2])),
            Self::QuadraticIntegral => ([k, k * x[1], k * x[2], zero], Some(Dual::constant(LEAK_RATE_PER_S))),
            Self::LeadDroop => (
                [k * x[2], k + k * x[1] * x[2], k * x[1], zero],
                Some(Dual::constant(LEAK_RATE_PER_S)),
            ),
            Self::Derivative => ([zero, k, zero, zero], None),
            Self::DerivativeLead => ([zero, k, k * x[1], zero], None),
            Self::Canals => ([zero, zero, k.scaled(1.0 / lag), k.scaled(lead / lag)], canals),
            Self::CanalsRate => ([zero, k.scaled(1.0 / lag), k.scaled(lead / lag), zero], canals),
        };
        Rational { numerator, pole }
    }
}

const _: () = assert!(PARTIAL_COUNT >= 6);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shape_is_the_numerator_over_its_gain() {
        for form in Form::ALL {
            let x = [3.0, 0.6, 0.4];
            let variables: Vec<Dual> = x.iter().enumerate().map(|(i, v)| Dual::variable(*v, i)).collect();
            let Rational { numerator, .. } = form.rational(&variables);
            let (shape, slopes) = form.shape(&x[1..]);
            for (i, n) in numerator.iter().enumerate() {
                assert!((n.value - 3.0 * shape[i]).abs() < 1e-14, "{form} {i}");
                assert!((n.partials[0] - shape[i]).abs() < 1e-14, "{form} {i}");
                for j in 0..form.shape_coordinate_count() {
                    assert!((n.partials[1 + j] - 3.0 * slopes[j][i]).abs() < 1e-14, "{form} {i} {j}");
                }
            }
        }
    }

    #[test]
    fn canal_models_match_the_literature() {
        use crate::FamilyOperator;
        let (nm, zeta): (f64, f64) = (11.0, 0.3);
        let x = [-0.4, nm.ln(), zeta.ln(), 0.18];
        for (form, power) in [(Form::Canals, 2), (Form::CanalsRate, 1)] {
            let operator = FamilyOperator::new(form, true, &x).unwrap();
            for omega in [0.05, 0.7, 3.0, 20.0] {
                let s = num_complex::Complex64::new(0.0, omega);
                let canals = (0.11 * s + 1.0) / (5.9 * s + 1.0);
                let muscles = nm * nm / (s * s + 2.0 * zeta * nm * s + nm * nm);
                let expected = -0.4 * s.powi(power) * canals * muscles * (-0.18 * s).exp();
                assert!(
                    (operator.response(omega) / expected - 1.0).norm() < 1e-13,
                    "{form} {omega}"
                );
            }
            assert!(form.is_derivative() && form.is_proper(true) && !form.is_proper(false));
            assert!(FamilyOperator::new(form, false, &[1.0, 0.2]).is_err());
        }
        // Near 1 rad/s the canals respond to the rate.
        let rate = FamilyOperator::new(Form::Canals, true, &x)
            .unwrap()
            .response(1.0)
            .norm();
        assert!((rate / (0.4 / 5.9) - 1.0).abs() < 0.02, "{rate}");
    }
}
