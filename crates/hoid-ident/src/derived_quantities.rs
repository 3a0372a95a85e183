//! Poles, zeros, crossover and margins of a fit, with standard errors by the delta method.
//!
//! A simple root z of `p(z) = z^n + p_1 z^{n-1} + ... + p_n` has the derivative `dz/dp_j = -z^{n-j} / p'(z)` with
//! respect to the coefficient p_j; the same formula holds for B, which also has a leading coefficient b_0. At a
//! multiple root the derivative does not exist. Near a multiple root the standard error grows without bound, because
//! the root itself is ill determined.
//!
//! The open loop is `L(omega, theta) = H(omega, theta) Y_c(omega)` with a given controlled element Y_c. The effects of
//! theta on the crossover frequency omega_c and the phase margin phi_m follow from the condition `|L| = 1`:
//!
//! `d omega_c = -(d ln|L|/d theta) / (d ln|L|/d omega)`, `d phi_m = d arg L/d theta + (d arg L/d omega) d omega_c`.
//!
//! The effect on the gain margin follows in the same way from the condition `arg L = -180 deg`, with the roles of phase
//! and gain exchanged. A delay found by a search also changes the phase by `-omega d tau` (`searched_delay.rs`).

use hoid_model::{
    Complex64, margins::Margins, margins::margins, polynomial, polynomial_model::monic, uncertainty::Estimate,
    uncertainty::variance_along,
};

use crate::Fit;

/// A pole or a zero in the z plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Root {
    /// The polynomial to which the root belongs: `'a'`, `'b'`, `'c'`, `'d'` or `'f'`.
    pub polynomial: char,
    /// Value of the root.
    pub value: Complex64,
    /// Standard errors of the real and imaginary parts; `None` without a covariance or at a multiple root.
    pub standard_error: Option<(f64, f64)>,
}

impl Root {
    /// Returns the natural frequency in rad/s and the damping ratio of the continuous-time pole `ln(z)/Ts`; `None` if z
    /// is one, zero or a negative real number.
    pub fn frequency_and_damping(&self, sample_time_s: f64) -> Option<(f64, f64)> {
        if self.value.im == 0.0 && self.value.re <= 0.0 {
            return None;
        }
        let s = self.value.ln() / sample_time_s;
        let frequency = s.norm();
        (frequency.is_finite() && frequency > 0.0).then(|| (frequency, -s.re / frequency))
    }
}

/// Crossover frequencies and margins of an open loop with their standard errors; a value is `None` if the loop does not
/// have the crossing that defines it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarginEstimates {
    /// Gain crossover frequency omega_c in rad/s.
    pub crossover_rad_s: Option<Estimate>,
    /// Phase margin phi_m in deg.
    pub phase_margin_deg: Option<Estimate>,
    /// Phase crossover frequency in rad/s.
    pub phase_crossover_rad_s: Option<Estimate>,
    /// Gain margin in dB.
    pub gain_margin_db: Option<Estimate>,
}

impl From<Margins> for MarginEstimates {
    /// Converts computed margins, without standard errors.
    fn from(m: Margins) -> Self {
        Self {
            crossover_rad_s: m.crossover_rad_s.map(Estimate::fixed),
            phase_margin_deg: m.phase_margin_deg.map(Estimate::fixed),
            phase_crossover_rad_s: m.phase_crossover_rad_s.map(Estimate::fixed),
            gain_margin_db: m.gain_margin_db.map(Estimate::fixed),
        }
    }
}

impl Fit {
    /// Returns the roots of A, B, C, D and F, in this order, with their standard errors. The poles of the system are
    /// the roots of A and F, and its zeros are the roots of B (the delay is not counted). The poles of the noise filter
    /// are the roots of A and D, and its zeros are the roots of C.
    pub fn roots(&self) -> Vec<Root> {
        let m = self.model();
        let o = self.orders();
        let mut all = Vec::new();
        let mut at = 0;
        for (letter, count) in [('a', o.na), ('b', o.nb), ('c', o.nc), ('d', o.nd), ('f', o.nf)] {
            let part = &m.theta()[at..at + count];
            let p = if letter == 'b' { part.to_vec() } else { monic(part) };
            for value in polynomial::roots(&p).unwrap_or_default() {
                all.push(Root {
                    polynomial: letter,
                    value,
                    standard_error: self.root_error(&p, value, at, letter == 'b'),
                });
            }
            at += count;
        }
        all
    }

    /// Returns the standard errors of the real and imaginary parts of the root `z` of `p`; `None` if they are unknown.
    /// The coefficients of `p` are in theta from index `at`; `leading` is true if they include the leading coefficient.
    fn root_error(&self, p: &[f64], z: Complex64, at: usize, leading: bool) -> Option<(f64, f64)> {
        let covariance = self.covariance()?;
        let n = p.len() - 1;
        let slope = (0..n).fold(Complex64::new(0.0, 0.0), |sum, j| sum * z + p[j] * (n - j) as f64);
        let (mut by_re, mut by_im) = (
            vec![0.0; self.model().theta().len()],
            vec![0.0; self.model().theta().len()],
        );
        for j in usize::from(!leading)..=n {
            let gradient = -z.powu((n - j) as u32) / slope;
            let index = at + j - usize::from(!leading);
            (by_re[index], by_im[index]) = (gradient.re, gradient.im);
        }
        let error =
            |gradient: &[f64]| Estimate::with_variance(0.0, variance_along(gradient, covariance)).standard_error;
        let (re, im) = (error(&by_re)?, if z.im == 0.0 { 0.0 } else { error(&by_im)? });
        // A root that depends only on fixed coefficients has no standard error.
        (re > 0.0 || im > 0.0).then_some((re, im))
    }

    /// Returns crossover frequencies and margins, with standard errors, of the open loop of the model and a controlled
    /// element with the given frequency response. Crossings are searched for in the given range.
    pub fn margins(&self, controlled_element: impl Fn(f64) -> Complex64, range_rad_s: (f64, f64)) -> MarginEstimates {
        let open_loop = |omega: f64| self.model().response(omega) * controlled_element(omega);
        let found = margins(open_loop, range_rad_s);
        let mut estimates = MarginEstimates::from(found);
        if self.covariance().is_none() {
            return estimates;
        }
        // d ln L / d omega by a central difference: L is smooth, and the relative error is about 1e-10.
        let slope = |omega: f64| {
            let h = 1e-5 * omega;
            let ratio = open_loop(omega + h) / open_loop(omega - h);
            ratio.ln() / (2.0 * h)
        };
        let relative = |omega: f64| -> Vec<Complex64> {
            let (response, gradient) = self.model().response_and_gradient(omega);
            gradient.iter().map(|g| g / response).collect()
        };
        let with = |value: Option<f64>, by_theta: Vec<f64>, by_delay: f64| {
            Some(Estimate::with_variance(value?, self.variance_of(&by_theta, by_delay)?))
        };
        if let Some(omega) = found.crossover_rad_s {
            let (along, by_theta) = (slope(omega), relative(omega));
            let moved: Vec<f64> = by_theta.iter().map(|g| -g.re / along.re).collect();
            let phase = by_theta
                .iter()
                .zip(&moved)
                .map(|(g, d)| (g.im + along.im * d).to_degrees())
                .collect();
            // The delay changes the phase of L, not its magnitude.
            estimates.crossover_rad_s = with(found.crossover_rad_s, moved, 0.0);
            estimates.phase_margin_deg = with(found.phase_margin_deg, phase, -omega.to_degrees());
        }
        if let Some(omega) = found.phase_crossover_rad_s {
            let (along, by_theta) = (slope(omega), relative(omega));
            let moved: Vec<f64> = by_theta.iter().map(|g| -g.im / along.im).collect();
            let by_delay = omega / along.im;
            let to_db = 20.0 / std::f64::consts::LN_10;
            let gain = by_theta
                .iter()
                .zip(&moved)
                .map(|(g, d)| -to_db * (g.re + along.re * d))
                .collect();
            estimates.phase_crossover_rad_s = with(found.phase_crossover_rad_s, moved, by_delay);
            estimates.gain_margin_db = with(found.gain_margin_db, gain, -to_db * along.re * by_delay);
        }
        estimates
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::{Orders, PolynomialModel, SampleTime, Structure};

    use super::*;
    use crate::{InitialState, Reason, Termination};

    fn fit(theta: Vec<f64>, covariance: Vec<f64>) -> Fit {
        let orders = Orders {
            nb: 3,
            nc: 1,
            nd: 1,
            nf: 2,
            nk: 20,
            ..Orders::default()
        };
        Fit {
            is_fixed_or_bounded: vec![false; theta.len()],
            model: PolynomialModel::new(Structure::BoxJenkins, orders, SampleTime::AT_100_HZ, theta).unwrap(),
            covariance: Some(covariance),
            loss: 1.0,
            innovation_variance: 1.0,
            residuals: 100,
            states: 0,
            initial_state: InitialState::Estimate,
            termination: Termination {
                reason: Reason::SmallDecrease,
                iterations: 1,
            },
            start: String::new(),
            output_variance: 1.0,
            robust: false,
            instrumented: false,
            physical: None,
            searched_delay: None,
        }
    }

    fn theta() -> Vec<f64> {
        vec![0.0442765923, -0.041, -0.002, 0.4, -0.8465, -1.9121130548, 0.9242709633]
    }

    fn element(omega: f64) -> Complex64 {
        let s = Complex64::new(0.0, omega);
        90.0 / (s * (s + 6.0))
    }

    /// Covariance in which only this parameter is uncertain; the standard error is then the derivative.
    fn single_parameter_covariance(i: usize) -> Vec<f64> {
        let mut covariance = vec![0.0; 49];
        covariance[i * 7 + i] = 1.0;
        covariance
    }

    #[test]
    fn standard_errors_match_finite_differences() {
        let (h, range) = (1e-7, (1e-3, 300.0));
        for i in 0..7 {
            let shifted = |sign: f64| {
                let mut theta = theta();
                theta[i] += sign * h;
                fit(theta, single_parameter_covariance(i))
            };
            let (up, down, here) = (
                shifted(1.0),
                shifted(-1.0),
                fit(theta(), single_parameter_covariance(i)),
            );
            for ((a, b), root) in up.roots().iter().zip(down.roots()).zip(here.roots()) {
                let slope = (a.value - b.value) / (2.0 * h);
                // A root that does not depend on this parameter has no error.
                let (re, im) = root.standard_error.unwrap_or((0.0, 0.0));
                // The two poles are close together: second differences of the root are about 1e3.
                assert!((slope.re.abs() - re).abs() < 1e-5 * (1.0 + re), "{i} {root:?} {slope}");
                assert!((slope.im.abs() - im).abs() < 1e-5 * (1.0 + im), "{i} {root:?} {slope}");
            }
            let all = |fit: &Fit| {
                let m = fit.margins(element, range);
                [
                    m.crossover_rad_s,
                    m.phase_margin_deg,
                    m.phase_crossover_rad_s,
                    m.gain_margin_db,
                ]
                .map(Option::unwrap)
            };
            for ((a, b), e) in all(&up).iter().zip(all(&down)).zip(all(&here)) {
                let slope = (a.value - b.value) / (2.0 * h);
                let ours = e.standard_error.unwrap();
                assert!((slope.abs() - ours).abs() < 1e-4 * (1.0 + ours), "{i}: {slope} {ours}");
            }
        }
    }

    #[test]
    fn double_roots_have_no_error_and_no_crossover_gives_no_margins() {
        let mut double = theta();
        (double[5], double[6]) = (-1.0, 0.25);
        let roots = fit(double, single_parameter_covariance(5)).roots();
        let f: Vec<&Root> = roots.iter().filter(|r| r.polynomial == 'f').collect();
        assert_eq!(f.len(), 2);
        assert!(
            f.iter().all(|r| r.standard_error.is_none_or(|(re, _)| re > 1e4)),
            "{f:?}"
        );
        let none = fit(theta(), single_parameter_covariance(0)).margins(|omega| 1e-9 * element(omega), (1.0, 300.0));
        assert!(none.crossover_rad_s.is_none() && none.phase_margin_deg.is_none());
    }

    #[test]
    fn root_gives_frequency_and_damping() {
        let s = Complex64::new(-0.35, (1.0_f64 - 0.35 * 0.35).sqrt()) * 11.25;
        let root = Root {
            polynomial: 'f',
            value: (s * 0.01).exp(),
            standard_error: None,
        };
        let (frequency, damping) = root.frequency_and_damping(0.01).unwrap();
        assert!((frequency - 11.25).abs() < 1e-10 && (damping - 0.35).abs() < 1e-10);
        for without in [0.0, -0.3] {
            let root = Root {
                value: Complex64::new(without, 0.0),
                ..root
            };
            assert!(root.frequency_and_damping(0.01).is_none());
        }
    }
}
