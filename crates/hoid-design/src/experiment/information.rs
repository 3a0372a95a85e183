//! Standard errors of an experiment before it is done.
//!
//! A person H(s; theta) answers the error of a loop with the controlled element P, `u = H e + n`, and a line of the forcing function of
//! amplitude A at omega makes one of e of amplitude `a = A |S|` (a target), or `A |P S|` (a disturbance at the input of P), with `S = 1/(1 + H P)`.
//! Over T seconds of whole periods the Fourier coefficients of e and u obey `U = H E + N`, `E|N|^2 = 4 S_n/T` with the power
//! density `S_n(f)` of the remnant, of both signs of f: `var n = int S_n df`. So `var H^ = 4 S_n/(T a^2)`, half of it in the
//! real and half in the imaginary part, and the information of the lines on theta is
//!
//! `I = sum over lines of T a^2/(2 S_n) Re[(dH/dtheta)* (dH/dtheta)']`,
//!
//! whose inverse is the least covariance that an unbiased estimate can have (H. Cramér, *Mathematical Methods of Statistics*, 1946, section
//! 32.6). The part of the loop signals that the remnant itself excites is not counted: with a free noise model this
//! information is lost to it (U. Forssell and L. Ljung, *Automatica* 35 (1999) 1215-1241, section 5). Errors of
//! functions of theta, such as crossover and margin, are to first order.
//!
//! The lines have to exceed the remnant in e: at a line that does not, the estimate of H is drawn to -1/P, and the
//! predicted error is too small.
//!
//! **The remnant** is a lag of order m, `S_n = K^2/(1 + (T_n omega)^2)^m`, whose share p of the variance of u, through the loop,
//! sets K: `K^2 = p/(1 - p) sum a^2 |H|^2/2 / int |S|^2/(1 + (T_n omega)^2)^m df`. It is proportional to the forcing
//! function, as it is for people, so that errors do not depend on the amplitude but on the distribution of power over
//! frequency, and on T.

use std::f64::consts::TAU;

use hoid_model::{
    Complex64, FamilyOperator,
    family_scenario::FamilyState,
    forcing::{ForcingFunction, Sinusoid},
    uncertainty::Estimate,
};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::{DesignError, Expected, ExpectedParameter};

/// Point at which the forcing function enters the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Enters {
    /// It is the target signal.
    #[default]
    Target,
    /// It is added at the input of the controlled element.
    Disturbance,
}

hoid_model::named_choice!(Enters, "point of entry of the forcing function", 2, {
    Target => "target",
    Disturbance => "disturbance",
});

/// The remnant of a person.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Remnant {
    /// Its share of the variance of u.
    pub share: f64,
    /// Time constant T_n in s; zero for white noise.
    pub time_constant_s: f64,
    /// Order m.
    pub order: i32,
}

impl Default for Remnant {
    /// A fifth of the variance of u, of first order with a time constant of .06 s.
    fn default() -> Self {
        Self {
            share: 0.2,
            time_constant_s: 0.06,
            order: 1,
        }
    }
}

/// The loop of an experiment: person, controlled element, forcing function and remnant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// The person and the controlled element.
    pub state: FamilyState,
    /// Point at which the forcing function enters.
    pub enters: Enters,
    /// Remnant of the person.
    pub remnant: Remnant,
}

/// Power and information of a line, for unit amplitude.
struct Worth {
    /// `|e|^2` divided by `A^2`.
    error: f64,
    /// `|u|^2` divided by `A^2`.
    control: f64,
    /// `Re[conj(dH) dH']` divided by the density of the remnant of unit gain.
    information: DMatrix<f64>,
}

/// Quantities of a task that do not depend on the forcing function.
pub(super) struct Loop<'a> {
    pub task: &'a Task,
    /// `int |S|^2 density df`, and the same through P, for a remnant of unit gain.
    noise: [f64; 2],
    pub crossover_rad_s: f64,
}

/// Range of the integrals over frequency in rad/s, and number of points.
const RANGE: (f64, f64) = (1e-3, 1e3);
const POINTS: usize = 6000;

impl<'a> Loop<'a> {
    pub fn of(task: &'a Task) -> Result<Self, DesignError> {
        let share = task.remnant.share;
        if !(share > 0.0 && share < 1.0) {
            return Err(DesignError::OutOfRange {
                quantity: "share of the remnant in the variance of u",
                found: share,
                expected: "above 0 and below 1",
            });
        }
        let margins = task.state.margins()?;
        let crossover_rad_s = margins.crossover_rad_s.ok_or(DesignError::NoCrossover)?;
        let mut all = Self {
            task,
            noise: [0.0; 2],
            crossover_rad_s,
        };
        // Trapezoidal rule over log omega; both signs of f.
        let ratio = (RANGE.1 / RANGE.0).ln() / (POINTS - 1) as f64;
        for k in 0..POINTS {
            let omega = RANGE.0 * (ratio * k as f64).exp();
            let weight = if k == 0 || k == POINTS - 1 { 0.5 } else { 1.0 };
            let width = 2.0 * omega * ratio * weight / TAU;
            let (s, p) = all.sensitivity(omega);
            let density = all.density(omega);
            all.noise[0] += width * density * s.norm_sqr();
            all.noise[1] += width * density * (s * p).norm_sqr();
        }
        Ok(all)
    }

    /// Returns S and P.
    pub fn sensitivity(&self, omega: f64) -> (Complex64, Complex64) {
        let p = self.task.state.controlled_element.response(omega);
        let h = self.task.state.operator.response(omega);
        (1.0 / (1.0 + h * p), p)
    }

    /// Density of the remnant of unit gain.
    pub fn density(&self, omega: f64) -> f64 {
        let Remnant {
            time_constant_s, order, ..
        } = self.task.remnant;
        (1.0 + (time_constant_s * omega).powi(2)).powi(-order)
    }

    fn worth(&self, omega: f64) -> Worth {
        let (s, p) = self.sensitivity(omega);
        let error = match self.task.enters {
            Enters::Target => s.norm_sqr(),
            Enters::Disturbance => (s * p).norm_sqr(),
        };
        let response = self.task.state.operator.response_and_gradient(omega);
        let n = response.gradient.len();
        let density = self.density(omega);
        Worth {
            error,
            control: error * response.value.norm_sqr(),
            information: DMatrix::from_fn(n, n, |a, b| {
                (response.gradient[a].conj() * response.gradient[b]).re / density
            }),
        }
    }

    /// Returns the rms of e and u, and K^2 of the remnant, for a forcing function.
    fn powers(&self, worths: &[Worth], lines: &[Sinusoid]) -> [f64; 3] {
        let sum = |of: fn(&Worth) -> f64| -> f64 {
            let one = |(w, line): (&Worth, &Sinusoid)| 0.5 * line.amplitude_deg.powi(2) * of(w);
            worths.iter().zip(lines).map(one).sum()
        };
        let (e, u) = (sum(|w| w.error), sum(|w| w.control));
        let share = self.task.remnant.share;
        let gain = share / (1.0 - share) * u / self.noise[0];
        [
            (e + gain * self.noise[1]).sqrt(),
            (u + gain * self.noise[0]).sqrt(),
            gain,
        ]
    }

    /// Computes the expected errors of a forcing function over a given number of seconds of whole periods.
    pub fn expected(&self, forcing: &ForcingFunction, length_s: f64) -> Result<Expected, DesignError> {
        if !(length_s.is_finite() && length_s > 0.0) {
            return Err(DesignError::OutOfRange {
                quantity: "length of all runs in s",
                found: length_s,
                expected: "a positive number",
            });
        }
        let lines = forcing.sinusoids();
        let [rms_e, rms_u, _] = self.powers(&self.worths(lines), lines);
        let covariance = self.covariance(lines, length_s)?;
        let rows: Vec<f64> = covariance.transpose().iter().copied().collect();
        let operator = &self.task.state.operator;
        let parameters = operator.named_estimates(Some(&rows)).into_iter();
        let [crossover_rad_s, phase_margin_deg] = self.margins(operator, &covariance);
        Ok(Expected {
            parameters: parameters
                .map(|(p, estimate)| ExpectedParameter {
                    name: p.name,
                    unit: p.unit,
                    estimate,
                })
                .collect(),
            crossover_rad_s,
            phase_margin_deg,
            rms_e,
            rms_u,
        })
    }

    fn worths(&self, lines: &[Sinusoid]) -> Vec<Worth> {
        lines.iter().map(|line| self.worth(line.omega_rad_s)).collect()
    }

    /// Returns K^2 of the remnant with these lines.
    pub fn remnant_gain(&self, lines: &[Sinusoid]) -> f64 {
        let [_, _, gain] = self.powers(&self.worths(lines), lines);
        gain
    }

    /// Returns the least covariance of the coordinates.
    pub fn covariance(&self, lines: &[Sinusoid], length_s: f64) -> Result<DMatrix<f64>, DesignError> {
        let worths = self.worths(lines);
        let [_, _, gain] = self.powers(&worths, lines);
        let n = self.task.state.operator.coordinates().len();
        let mut information = DMatrix::zeros(n, n);
        for (worth, line) in worths.iter().zip(lines) {
            let scale = 0.5 * length_s * line.amplitude_deg.powi(2) * worth.error / gain;
            information += &worth.information * scale;
        }
        inverse(&information).ok_or(DesignError::NotIdentifiable {
            lines: lines.len(),
            coordinates: n,
        })
    }

    /// Information in one second of a line that makes the whole response of u, with the share of the remnant.
    pub fn information_by_share(&self, omega: f64) -> DMatrix<f64> {
        let worth = self.worth(omega);
        let share = self.task.remnant.share;
        // a^2/2 = E, K^2 = p/(1 - p) U/noise: a^2/(2 K^2) = (E/U) (1 - p)/p noise.
        let scale = worth.error / worth.control * (1.0 - share) / share * self.noise[0];
        worth.information * scale
    }

    /// Variance of u divided by that of a line of the forcing function.
    pub fn control_by_power(&self, omega: f64) -> f64 {
        self.worth(omega).control
    }

    /// Variance of e divided by that of a line of the forcing function.
    pub fn error_by_power(&self, omega: f64) -> f64 {
        self.worth(omega).error
    }

    /// Quantities that can be requested: name, gradient with respect to the coordinates, and the scale of the error: 1
    /// deg, or the value.
    pub fn gradients(&self) -> Vec<(&'static str, DVector<f64>, f64)> {
        let [(crossover, of_crossover), (_, of_margin)] = self.margin_gradients(&self.task.state.operator);
        let parameters = self.task.state.operator.named_gradients().into_iter();
        let parameters = parameters.filter(|(p, _)| p.value.is_finite() && p.value != 0.0);
        [("crossover", of_crossover, crossover), ("phase_margin", of_margin, 1.0)]
            .into_iter()
            .chain(parameters.map(|(p, gradient)| (p.name, DVector::from_vec(gradient), p.value.abs())))
            .collect()
    }

    /// Change of the phase margin in deg with the logarithm of the gain, without its sign.
    pub fn margin_by_gain_deg(&self) -> f64 {
        let operator = &self.task.state.operator;
        let [_, (_, gradient)] = self.margin_gradients(operator);
        // The first coordinate is the gain.
        let gain = operator.coordinates().first();
        gain.map_or(f64::NAN, |gain| (gradient[0] * gain).abs())
    }

    fn margins(&self, operator: &FamilyOperator, covariance: &DMatrix<f64>) -> [Estimate; 2] {
        self.margin_gradients(operator)
            .map(|(value, gradient)| Estimate::with_variance(value, (covariance * &gradient).dot(&gradient)))
    }

    /// Crossover and margin with their gradients: `L = H P`, `d ln|L|/d omega domega = -Re dlnH`, and
    /// `dphi = Im dlnH + d arg L/d omega domega`.
    fn margin_gradients(&self, operator: &FamilyOperator) -> [(f64, DVector<f64>); 2] {
        let omega = self.crossover_rad_s;
        let response = operator.response_and_gradient(omega);
        let logarithm = |w: f64| (operator.response(w) * self.task.state.controlled_element.response(w)).ln();
        let step = 1e-5 * omega;
        // The phase may differ by a whole turn between the two.
        let slope = {
            let difference = logarithm(omega + step) - logarithm(omega - step);
            let turn = difference.im - TAU * (difference.im / TAU).round();
            Complex64::new(difference.re, turn) / (2.0 * step)
        };
        let n = response.gradient.len();
        let of = |k: usize| response.gradient[k] / response.value;
        let shift = DVector::from_fn(n, |k, _| -of(k).re / slope.re);
        let margin = DVector::from_fn(n, |k, _| (of(k).im + slope.im * shift[k]).to_degrees());
        let phase = 180.0 + logarithm(omega).im.to_degrees();
        let phase = phase - 360.0 * (phase / 360.0).round();
        [(omega, shift), (phase, margin)]
    }
}

/// Computes the expected errors of an experiment; `length_s` is the duration of all runs together, in whole periods.
///
/// # Errors
/// [`DesignError`] for numbers out of range, a loop that is unstable or without a crossover, and lines that do not
/// determine the parameters.
pub fn expected(task: &Task, forcing: &ForcingFunction, length_s: f64) -> Result<Expected, DesignError> {
    Loop::of(task)?.expected(forcing, length_s)
}

/// Inverse, after scaling to a unit diagonal; `None` if the matrix is singular.
pub(super) fn inverse(information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = information.nrows();
    let scale: Vec<f64> = (0..n).map(|k| information[(k, k)].sqrt()).collect();
    if scale.iter().any(|s| !(s.is_finite() && *s > 0.0)) {
        return None;
    }
    let scaled = DMatrix::from_fn(n, n, |a, b| information[(a, b)] / (scale[a] * scale[b]));
    if scaled.clone().symmetric_eigenvalues().min() < 1e-12 {
        return None;
    }
    let inverse = scaled.cholesky()?.inverse();
    Some(DMatrix::from_fn(n, n, |a, b| inverse[(a, b)] / (scale[a] * scale[b])))
}

#[cfg(test)]
pub(super) mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::Form;

    use super::*;

    pub fn task(share: f64) -> Task {
        let pairs = [
            ("K_e", 1.0),
            ("T_L", 0.4),
            ("omega_nm", 10.0),
            ("zeta_nm", 0.3),
            ("tau_e", 0.25),
        ];
        let pairs = pairs.map(|(name, value)| (name.to_owned(), value));
        Task {
            state: FamilyState {
                operator: FamilyOperator::of_names(Form::Lead, &pairs).unwrap(),
                controlled_element: "4/(s(s+1))".parse().unwrap(),
            },
            enters: Enters::Target,
            remnant: Remnant {
                share,
                ..Remnant::default()
            },
        }
    }

    #[test]
    fn errors_fall_with_time_and_do_not_depend_on_size() {
        let forcing = ForcingFunction::reference();
        let of = |task: &Task, length| expected(task, &forcing, length).unwrap();
        let (one, four) = (of(&task(0.2), 81.92), of(&task(0.2), 4.0 * 81.92));
        let error = |e: &Estimate| e.standard_error.unwrap();
        for (a, b) in one.parameters.iter().zip(&four.parameters) {
            assert!(
                (error(&a.estimate) / error(&b.estimate) - 2.0).abs() < 1e-9,
                "{}",
                a.name
            );
        }
        let tenth: Vec<Sinusoid> = forcing
            .sinusoids()
            .iter()
            .map(|line| Sinusoid {
                amplitude_deg: 0.1 * line.amplitude_deg,
                ..*line
            })
            .collect();
        let tenth = expected(&task(0.2), &ForcingFunction::new(tenth).unwrap(), 81.92).unwrap();
        assert!((error(&tenth.crossover_rad_s) / error(&one.crossover_rad_s) - 1.0).abs() < 1e-9);
        assert!((one.rms_e / tenth.rms_e - 10.0).abs() < 1e-9);
        // p/(1 - p): .5 is four times .2, twice the error.
        let louder = of(&task(0.5), 81.92);
        assert!((error(&louder.phase_margin_deg) / error(&one.phase_margin_deg) - 2.0).abs() < 1e-9);
    }

    #[test]
    fn crossover_and_margin_move_with_the_parameters() {
        // Finite differences of the margins of an operator with another gain: d omega/d ln K.
        let task = task(0.2);
        let all = Loop::of(&task).unwrap();
        let n = task.state.operator.coordinates().len();
        let mut only_gain = DMatrix::zeros(n, n);
        only_gain[(0, 0)] = 1.0;
        let [crossover, margin] = all.margins(&task.state.operator, &only_gain);
        let with = |k: f64| {
            let mut coordinates = task.state.operator.coordinates().to_vec();
            coordinates[0] = k;
            let operator = FamilyOperator::new(Form::Lead, true, &coordinates).unwrap();
            let state = FamilyState {
                operator,
                ..task.state.clone()
            };
            let margins = state.margins().unwrap();
            (margins.crossover_rad_s.unwrap(), margins.phase_margin_deg.unwrap())
        };
        let (up, down) = (with(1.0 + 1e-4), with(1.0 - 1e-4));
        let slope = |a: f64, b: f64| ((a - b) / 2e-4).abs();
        assert!((crossover.standard_error.unwrap() / slope(up.0, down.0) - 1.0).abs() < 1e-3);
        assert!((margin.standard_error.unwrap() / slope(up.1, down.1) - 1.0).abs() < 1e-3);
        assert!((margin.value - with(1.0).1).abs() < 1e-3);
    }

    #[test]
    fn what_says_nothing_is_refused() {
        let one = Sinusoid {
            amplitude_deg: 1.0,
            omega_rad_s: 1.0,
            phase_rad: 0.0,
        };
        let few = ForcingFunction::new(vec![one]).unwrap();
        assert!(matches!(
            expected(&task(0.2), &few, 80.0),
            Err(DesignError::NotIdentifiable { lines: 1, .. })
        ));
        let reference = ForcingFunction::reference();
        assert!(matches!(
            expected(&task(1.0), &reference, 80.0),
            Err(DesignError::OutOfRange { .. })
        ));
        assert!(matches!(
            expected(&task(0.2), &reference, f64::NAN),
            Err(DesignError::OutOfRange { .. })
        ));
        let mut wild = task(0.2);
        wild.state.controlled_element = "400/(s(s+1))".parse().unwrap();
        assert!(matches!(expected(&wild, &reference, 80.0), Err(DesignError::Model(_))));
        let mut weak = task(0.2);
        weak.state.controlled_element = "0.01/(s+1)".parse().unwrap();
        assert!(matches!(
            expected(&weak, &reference, 80.0),
            Err(DesignError::NoCrossover)
        ));
    }
}
