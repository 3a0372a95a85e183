//! Operators and plants of the challenge, in continuous time.
//!
//! `Y(s) = K (T_L s + 1)^p/(T_I s + 1) H_nm(s) H_s(s) e^(-tau s)`, `H_nm = omega^2/((s^2 + 2 zeta omega s + omega^2)
//! (T_3 s + 1))`, `H_s = omega_s^2/(s^2 + 1.4 omega_s s + omega_s^2)`,
//!
//! where a factor is present only if the form contains it: the lag of people controlling `1/s` (D. T. McRuer and H. R.
//! Jex, IEEE Trans. Human Factors in Electronics 8 (1967) 231-249), the third-order neuromuscular system (R. E.
//! Magdaleno and D. T. McRuer, NASA CR-1757 (1971)), and the dynamics of a stick.
//!
//! The response in the record depends on the intersample behaviour. If each error is held over a sample, the response
//! from sampled e to sampled u at low frequencies is `Y(j omega)` times the hold `(1 - e^(-j omega Ts))/(j omega Ts)`;
//! for a continuous error it is `Y(j omega)`.

use hoid_model::{Complex64, ContinuousTransferFunction, ModelError, SampleTime, polynomial};

/// An operator. Times are in s and frequencies in rad/s; the time or frequency of a missing factor is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Operator {
    /// Gain K, control output per error.
    pub gain: f64,
    /// Time constant T_L of the lead.
    pub lead_s: f64,
    /// Number p of leads, 0 to 2.
    pub leads: usize,
    /// Time constant T_I of the lag.
    pub lag_s: f64,
    /// Natural frequency omega_nm of the neuromuscular system.
    pub omega_nm_rad_s: f64,
    /// Damping ratio zeta_nm of the neuromuscular system.
    pub zeta_nm: f64,
    /// Time constant T_3 of the third-order neuromuscular system.
    pub third_s: f64,
    /// Natural frequency omega_s of the stick.
    pub stick_rad_s: f64,
    /// Delay tau_e.
    pub tau_e_s: f64,
}

/// Parameter of an operator that can change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// K_e, the gain at low frequencies, with K_e_dot unchanged.
    KE,
    /// K_e_dot, by a change in the lead, with K_e unchanged.
    KEDot,
    /// The gain K, and with it K_e and K_e_dot.
    Gain,
    /// Natural frequency omega_nm.
    Omega,
    /// Damping ratio zeta_nm.
    Zeta,
    /// Delay tau_e.
    Delay,
}

/// Damping ratio of the stick.
const STICK_DAMPING: f64 = 0.7;

impl Operator {
    /// The operator with one parameter multiplied by a factor.
    #[must_use]
    pub fn with_scaled_parameter(mut self, parameter: Parameter, factor: f64) -> Self {
        match parameter {
            Parameter::KE => {
                self.gain *= factor;
                self.lead_s /= factor;
            }
            Parameter::KEDot => self.lead_s *= factor,
            Parameter::Gain => self.gain *= factor,
            Parameter::Omega => self.omega_nm_rad_s *= factor,
            Parameter::Zeta => self.zeta_nm *= factor,
            Parameter::Delay => self.tau_e_s *= factor,
        }
        self
    }

    /// Coefficients of the numerator in ascending powers of s.
    pub(super) fn numerator(&self) -> Vec<f64> {
        let mut all = vec![self.gain];
        for _ in 0..self.leads {
            all = polynomial::product(&all, &[1.0, self.lead_s]);
        }
        all
    }

    /// Coefficients of the denominator in ascending powers of s; the first is one.
    pub(super) fn denominator(&self) -> Vec<f64> {
        let second = |omega: f64, zeta: f64| [1.0, 2.0 * zeta / omega, 1.0 / (omega * omega)];
        let mut all = second(self.omega_nm_rad_s, self.zeta_nm).to_vec();
        for time_s in [self.lag_s, self.third_s] {
            if time_s > 0.0 {
                all = polynomial::product(&all, &[1.0, time_s]);
            }
        }
        if self.stick_rad_s > 0.0 {
            all = polynomial::product(&all, &second(self.stick_rad_s, STICK_DAMPING));
        }
        all
    }

    /// Returns the response `Y(j omega)`.
    pub fn response(&self, omega_rad_s: f64) -> Complex64 {
        let s = Complex64::new(0.0, omega_rad_s);
        polynomial::value(&self.numerator(), s) / polynomial::value(&self.denominator(), s) * (-s * self.tau_e_s).exp()
    }

    /// Names and values of the parameters as in the operator of the thesis: K_e, K_e_dot in s, omega_nm in rad/s,
    /// zeta_nm, tau_e in s.
    pub fn named_parameters(&self) -> [(&'static str, f64); 5] {
        [
            ("K_e", self.gain),
            ("K_e_dot", self.gain * self.lead_s),
            ("omega_nm", self.omega_nm_rad_s),
            ("zeta_nm", self.zeta_nm),
            ("tau_e", self.tau_e_s),
        ]
    }

    /// True if the operator has the form of the thesis: gain, lead, neuromuscular system, delay.
    pub fn is_lead(&self) -> bool {
        self.leads == 1 && self.lag_s == 0.0 && self.third_s == 0.0 && self.stick_rad_s == 0.0
    }

    /// Returns the open loop `Y P`.
    ///
    /// # Errors
    /// [`ModelError`] if the parameters do not give a transfer function.
    pub(super) fn open_loop(&self, plant: Plant) -> Result<ContinuousTransferFunction, ModelError> {
        let descending = |ascending: Vec<f64>| ascending.into_iter().rev().collect::<Vec<_>>();
        let own = ContinuousTransferFunction::new(&descending(self.numerator()), &descending(self.denominator()))?;
        let element = ContinuousTransferFunction::new(&[1.0], &descending(plant.denominator().to_vec()))?;
        own.series(&element).with_delay(self.tau_e_s)
    }
}

/// The controlled element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plant {
    /// Single integrator, `1/s`.
    Integrator,
    /// Double integrator, `1/s^2`.
    DoubleIntegrator,
    /// Integrator with a lag, `1/(s(s+1))`.
    Lagged,
    /// Unstable first-order plant, `1/(s-1)`.
    Unstable,
}

impl Plant {
    /// Coefficients of the denominator in ascending powers of s; the numerator is one.
    pub(super) fn denominator(self) -> &'static [f64] {
        match self {
            Self::Integrator => &[0.0, 1.0],
            Self::DoubleIntegrator => &[0.0, 0.0, 1.0],
            Self::Lagged => &[0.0, 1.0, 1.0],
            Self::Unstable => &[-1.0, 1.0],
        }
    }

    /// Returns the response `P(j omega)`.
    pub(super) fn response(self, omega_rad_s: f64) -> Complex64 {
        Complex64::from(1.0) / polynomial::value(self.denominator(), Complex64::new(0.0, omega_rad_s))
    }
}

/// Response of the hold over a sample, `(1 - e^(-j omega Ts))/(j omega Ts)`.
pub fn hold(omega_rad_s: f64, sample_time: SampleTime) -> Complex64 {
    let turn = omega_rad_s * sample_time.s();
    if turn == 0.0 {
        return Complex64::from(1.0);
    }
    let j = Complex64::new(0.0, turn);
    (Complex64::from(1.0) - (-j).exp()) / j
}

/// Largest order of a system.
pub(super) const MAX_STATES: usize = 6;

/// A system without zeros, `x = v/(a_0 + a_1 s + ... + a_n s^n)`, whose states are x and its derivatives. Outputs are
/// weighted sums of the states, so a change in the gain acts at once.
#[derive(Debug, Clone, Copy)]
pub(super) struct Canonical {
    /// The state: x, its first derivative, and so on.
    pub x: [f64; MAX_STATES],
}

impl Canonical {
    pub fn at_rest() -> Self {
        Self { x: [0.0; MAX_STATES] }
    }

    /// Advances the state by a fourth-order Runge-Kutta step of length h; `v` is the input at the start, the middle and
    /// the end of the step.
    pub fn advance(&mut self, denominator: &[f64], v: [f64; 3], h: f64) {
        let n = denominator.len() - 1;
        let slope = |x: &[f64; MAX_STATES], v: f64| {
            let mut d = [0.0; MAX_STATES];
            d[..n - 1].copy_from_slice(&x[1..n]);
            let known: f64 = denominator[..n].iter().zip(x).map(|(a, x)| a * x).sum();
            d[n - 1] = (v - known) / denominator[n];
            d
        };
        let moved = |x: &[f64; MAX_STATES], d: &[f64; MAX_STATES], by: f64| {
            let mut to = *x;
            to.iter_mut().zip(d).for_each(|(x, d)| *x += by * d);
            to
        };
        let a = slope(&self.x, v[0]);
        let b = slope(&moved(&self.x, &a, h / 2.0), v[1]);
        let c = slope(&moved(&self.x, &b, h / 2.0), v[1]);
        let d = slope(&moved(&self.x, &c, h), v[2]);
        for i in 0..n {
            self.x[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
        }
    }

    /// Returns the sum of the states weighted by these coefficients.
    pub fn output(&self, numerator: &[f64]) -> f64 {
        numerator.iter().zip(&self.x).map(|(b, x)| b * x).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn typical() -> Operator {
        Operator {
            gain: 1.5,
            lead_s: 0.6,
            leads: 1,
            lag_s: 4.0,
            omega_nm_rad_s: 11.0,
            zeta_nm: 0.3,
            third_s: 0.05,
            stick_rad_s: 25.0,
            tau_e_s: 0.2,
        }
    }

    #[test]
    fn response_matches_the_transfer_function() {
        let operator = typical();
        let open_loop = operator.open_loop(Plant::Lagged).unwrap();
        for omega in [0.1, 1.0, 5.0, 20.0] {
            let here = operator.response(omega) * Plant::Lagged.response(omega);
            assert!((here - open_loop.response(omega)).norm() < 1e-12 * here.norm());
        }
    }

    #[test]
    fn integrated_sine_response_matches_the_frequency_response() {
        let operator = Operator {
            tau_e_s: 0.0,
            ..typical()
        };
        let (num, den, h, omega) = (operator.numerator(), operator.denominator(), 0.001, 3.0);
        let mut system = Canonical::at_rest();
        let mut worst = 0.0_f64;
        let expected = operator.response(omega);
        for k in 0..60_000 {
            let t = f64::from(k) * h;
            system.advance(&den, [0.0, h / 2.0, h].map(|x| (omega * (t + x)).sin()), h);
            if k > 50_000 {
                let j = Complex64::new(0.0, omega * (t + h)).exp() * expected;
                worst = worst.max((system.output(&num) - j.im).abs());
            }
        }
        assert!(worst < 1e-5 * expected.norm(), "{worst}");
    }

    #[test]
    fn change_of_one_parameter_keeps_the_others() {
        let lead = Operator {
            lag_s: 0.0,
            third_s: 0.0,
            stick_rad_s: 0.0,
            ..typical()
        };
        assert!(lead.is_lead() && !typical().is_lead());
        let parameters = [
            Parameter::KE,
            Parameter::KEDot,
            Parameter::Omega,
            Parameter::Zeta,
            Parameter::Delay,
        ];
        for (i, parameter) in parameters.into_iter().enumerate() {
            let (before, after) = (
                lead.named_parameters(),
                lead.with_scaled_parameter(parameter, 2.0).named_parameters(),
            );
            for k in 0..5 {
                let factor = if k == i { 2.0 } else { 1.0 };
                assert!((after[k].1 / before[k].1 - factor).abs() < 1e-14, "{}", before[k].0);
            }
        }
    }
}
