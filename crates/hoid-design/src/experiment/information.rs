//! Expected standard errors of an experiment before it is carried out.
//!
//! In a loop with the controlled element P, a person responds to the error and, if it is displayed, to the target f:
//! `u = B e + F f + n` (`task`), with the parameters theta. With `S = 1/(1 + B P)`, a line of amplitude A at omega
//! contributes `E = S (1 - P F) A` to e if it belongs to the target, and `E = -S P A` if it belongs to the disturbance.
//! Over T seconds of whole periods the Fourier coefficients obey `U = B E + F X + N`, where X is the coefficient of f
//! and `E|N|^2 = 4 S_n/T`, with the two-sided power density `S_n(f)` of the remnant, `var n = int S_n df`. Half of this
//! variance is in the real part and half in the imaginary part, so the information of the lines on theta is
//!
//! `I = sum over lines of T/(2 S_n) Re[g* g']`, `g = dB/dtheta E + dF/dtheta X` (`joint_coordinates`),
//!
//! whose inverse is the smallest covariance that an unbiased estimate can have (H. Cramér, *Mathematical Methods of
//! Statistics*, 1946, section 32.6). The part of the loop signals that the remnant itself excites is not included,
//! because a free noise model uses up this information (U. Forssell and L. Ljung, *Automatica* 35 (1999) 1215-1241,
//! section 5). The errors of functions of theta, such as the crossover and the margin, are computed to first order.
//!
//! The lines have to exceed the remnant in e. At a line that does not, the estimate of B is biased towards -1/P, and
//! the predicted error is too small.
//!
//! **The remnant** is white noise through a lag of order m, `S_n = K^2/(1 + (T_n omega)^2)^m`. K follows from the share
//! p of the variance of u that the remnant has through the loop:
//! `K^2 = p/(1 - p) sum |U|^2/2 / int |S|^2/(1 + (T_n omega)^2)^m df`. The remnant is proportional to the forcing
//! function, as it is for people, so the errors do not depend on the amplitude, but on the distribution of power over
//! frequency and on T. The integral ends at half the sampling rate; for white noise (`T_n = 0`) this limit affects the
//! density that corresponds to a given share.

use std::f64::consts::TAU;

use hoid_model::{Complex64, FamilyOperator, forcing::Sinusoid, uncertainty::Estimate};
use nalgebra::{DMatrix, DVector};

use super::{
    DesignError, EntryPoint, Expected, ExpectedQuantity, Forcing, Remnant, Task,
    joint_coordinates::{JointCoordinates, Quantity},
    task::SAMPLE_TIME_S,
};

/// Power and information of a line of unit amplitude.
struct LineInformation {
    /// `|e|^2/A^2` at the line.
    error: f64,
    /// `|u|^2/A^2` at the line.
    control: f64,
    /// `Re[conj(g) g']` divided by the power density of a remnant of unit gain.
    information: DMatrix<f64>,
}

/// Quantities of a task that do not depend on the forcing function.
pub(super) struct LoopQuantities<'a> {
    pub task: &'a Task,
    pub joint: JointCoordinates,
    /// Variances of u and of e due to a remnant of unit gain: `int |S|^2 density df` and `int |S P|^2 density df`.
    noise: [f64; 2],
    pub crossover_rad_s: f64,
}

/// Range of the integrals over frequency in rad/s, up to half the sampling rate, and the number of points.
const FREQUENCY_RANGE_RAD_S: (f64, f64) = (1e-3, std::f64::consts::PI / SAMPLE_TIME_S);
const POINT_COUNT: usize = 6000;

impl<'a> LoopQuantities<'a> {
    pub fn of(task: &'a Task) -> Result<Self, DesignError> {
        let share = task.remnant.share;
        if !(share > 0.0 && share < 1.0) {
            return Err(DesignError::OutOfRange {
                quantity: "share of the variance of u due to the remnant",
                found: share,
                expected: "above 0 and below 1",
            });
        }
        let margins = task.state.margins()?;
        let crossover_rad_s = margins.crossover_rad_s.ok_or(DesignError::NoCrossover)?;
        let mut all = Self {
            joint: JointCoordinates::of(task),
            task,
            noise: [0.0; 2],
            crossover_rad_s,
        };
        // Trapezoidal rule over log omega; the factor 2 accounts for negative frequencies.
        let ratio = (FREQUENCY_RANGE_RAD_S.1 / FREQUENCY_RANGE_RAD_S.0).ln() / (POINT_COUNT - 1) as f64;
        for k in 0..POINT_COUNT {
            let omega = FREQUENCY_RANGE_RAD_S.0 * (ratio * k as f64).exp();
            let weight = if k == 0 || k == POINT_COUNT - 1 { 0.5 } else { 1.0 };
            let width = 2.0 * omega * ratio * weight / TAU;
            let (s, p) = all.sensitivity(omega);
            let density = all.remnant_density(omega);
            all.noise[0] += width * density * s.norm_sqr();
            all.noise[1] += width * density * (s * p).norm_sqr();
        }
        Ok(all)
    }

    /// Returns the sensitivity S and the response of the controlled element P.
    pub fn sensitivity(&self, omega: f64) -> (Complex64, Complex64) {
        let p = self.task.state.controlled_element.response(omega);
        let h = self.task.state.operator.response(omega);
        (1.0 / (1.0 + h * p), p)
    }

    /// Returns the power density of a remnant of unit gain.
    pub fn remnant_density(&self, omega: f64) -> f64 {
        let Remnant {
            time_constant_s, order, ..
        } = self.task.remnant;
        (1.0 + (time_constant_s * omega).powi(2)).powi(-order)
    }

    /// Returns the response F to the target; zero if the target is not displayed.
    pub fn feedforward(&self, omega: f64) -> Complex64 {
        let seen = self.task.feedforward.as_ref();
        seen.map_or_else(Complex64::default, |seen| {
            // The operator's delay is counted from the end of the preview.
            seen.operator.response(omega) * preview_response(seen.preview_s, omega)
        })
    }

    /// Returns the Fourier coefficients of e and of the target for a line of unit amplitude.
    pub fn line_coefficients(&self, (enters, omega): (EntryPoint, f64)) -> [Complex64; 2] {
        let (s, p) = self.sensitivity(omega);
        match enters {
            EntryPoint::Target => [s * (1.0 - p * self.feedforward(omega)), Complex64::new(1.0, 0.0)],
            EntryPoint::Disturbance => [-s * p, Complex64::default()],
        }
    }

    fn line_information(&self, (enters, omega): (EntryPoint, f64)) -> LineInformation {
        let [error, target] = self.line_coefficients((enters, omega));
        let feedback = self.task.state.operator.response_and_gradient(omega);
        let seen = self.task.feedforward.as_ref();
        let feedforward = seen.map(|seen| {
            let found = seen.operator.response_and_gradient(omega);
            (found, target * preview_response(seen.preview_s, omega))
        });
        let (gradient, answer) = match &feedforward {
            Some((found, shown)) => (
                self.joint
                    .derivatives((&feedback.gradient, error), (&found.gradient, *shown)),
                found.value * shown,
            ),
            None => (
                self.joint
                    .derivatives((&feedback.gradient, error), (&[], Complex64::default())),
                Complex64::default(),
            ),
        };
        let density = self.remnant_density(omega);
        let n = self.joint.count;
        LineInformation {
            error: error.norm_sqr(),
            control: (feedback.value * error + answer).norm_sqr(),
            information: DMatrix::from_fn(n, n, |a, b| (gradient[a].conj() * gradient[b]).re / density),
        }
    }

    /// Returns the rms of e and u, and K^2 of the remnant, for a forcing function.
    fn powers(&self, lines: &[(LineInformation, f64)]) -> [f64; 3] {
        let sum =
            |of: fn(&LineInformation) -> f64| -> f64 { lines.iter().map(|(w, square)| 0.5 * square * of(w)).sum() };
        let (e, u) = (sum(|w| w.error), sum(|w| w.control));
        let share = self.task.remnant.share;
        let gain = share / (1.0 - share) * u / self.noise[0];
        [
            (e + gain * self.noise[1]).sqrt(),
            (u + gain * self.noise[0]).sqrt(),
            gain,
        ]
    }

    /// Computes the expected errors for a forcing function. `length_s` is the total duration of all runs, in whole
    /// periods.
    pub fn expected(&self, forcing: &Forcing, length_s: f64) -> Result<Expected, DesignError> {
        if !(length_s.is_finite() && length_s > 0.0) {
            return Err(DesignError::OutOfRange {
                quantity: "length of all runs in s",
                found: length_s,
                expected: "a positive number",
            });
        }
        let [rms_e, rms_u, _] = self.powers(&self.lines(forcing));
        let covariance = self.covariance(forcing, length_s)?;
        let estimate = |q: &Quantity| match q.value.is_finite() {
            true => Estimate::with_variance(q.value, (&covariance * &q.gradient).dot(&q.gradient)),
            false => Estimate::fixed(q.value),
        };
        let quantity = |q: &Quantity| {
            let estimate = estimate(q);
            ExpectedQuantity {
                name: q.name,
                unit: q.unit,
                estimate,
                size: q.size,
                standard_error_person: estimate.standard_error,
            }
        };
        Ok(Expected {
            quantities: self.all_quantities().iter().map(quantity).collect(),
            rms_e,
            rms_u,
        })
    }

    /// Returns the power and information of each line for unit amplitude, with the square of its amplitude.
    fn lines(&self, forcing: &Forcing) -> Vec<(LineInformation, f64)> {
        let of = |(enters, line): &(EntryPoint, Sinusoid)| {
            (
                self.line_information((*enters, line.omega_rad_s)),
                line.amplitude_deg.powi(2),
            )
        };
        forcing.lines().iter().map(of).collect()
    }

    /// Returns the squared gain K^2 of the remnant with this forcing function.
    pub fn remnant_gain(&self, forcing: &Forcing) -> f64 {
        let [_, _, gain] = self.powers(&self.lines(forcing));
        gain
    }

    /// Returns the smallest covariance of the coordinates that an unbiased estimate can have.
    pub fn covariance(&self, forcing: &Forcing, length_s: f64) -> Result<DMatrix<f64>, DesignError> {
        let lines = self.lines(forcing);
        let [_, _, gain] = self.powers(&lines);
        let n = self.joint.count;
        let mut information = DMatrix::zeros(n, n);
        for (worth, square) in &lines {
            information += &worth.information * (0.5 * length_s * square / gain);
        }
        inverse(&information).ok_or(DesignError::NotIdentifiable {
            lines: lines.len(),
            coordinates: n,
        })
    }

    /// Returns the information per second of a line that alone excites u, with the given share of the remnant.
    pub fn information_by_share(&self, line: (EntryPoint, f64)) -> DMatrix<f64> {
        let worth = self.line_information(line);
        let share = self.task.remnant.share;
        // K^2 = p/(1 - p) U/noise: A^2/(2 K^2) = (A^2/2/U) (1 - p)/p noise.
        worth.information * ((1.0 - share) / share * self.noise[0] / worth.control)
    }

    /// Returns the variance of u due to a line, divided by the variance of the line itself.
    pub fn control_by_power(&self, line: (EntryPoint, f64)) -> f64 {
        self.line_information(line).control
    }

    /// Returns the quantities that can be requested.
    pub fn quantities(&self) -> Vec<Quantity> {
        let mut all = self.all_quantities();
        all.retain(|q| q.value.is_finite() && q.size != 0.0);
        all
    }

    /// Returns the crossover, the margin and all parameters, one of which may be infinite.
    fn all_quantities(&self) -> Vec<Quantity> {
        let parameters = self.joint.parameters(self.task);
        self.margins().into_iter().chain(parameters).collect()
    }

    /// Returns the crossover frequency and the phase margin.
    fn margins(&self) -> [Quantity; 2] {
        let [(crossover, of_crossover), (margin, of_margin)] = self.margin_gradients(&self.task.state.operator);
        let quantity = |name, unit, value: f64, gradient: &DVector<f64>, [scale, size]: [f64; 2]| Quantity {
            name,
            unit,
            value,
            gradient: self.joint.feedback(gradient.as_slice()),
            scale,
            size,
        };
        // The first coordinate is the gain.
        let gain = self.task.state.operator.coordinates().first();
        let by_gain_deg = gain.map_or(f64::NAN, |gain| (of_margin[0] * gain).abs());
        [
            quantity("crossover", "rad/s", crossover, &of_crossover, [crossover; 2]),
            quantity("phase_margin", "deg", margin, &of_margin, [1.0, by_gain_deg]),
        ]
    }

    /// Returns the crossover and the margin with their gradients: with `L = B P`, `d ln|L|/d omega domega = -Re dlnB`
    /// and `dphi = Im dlnB + d arg L/d omega domega`.
    fn margin_gradients(&self, operator: &FamilyOperator) -> [(f64, DVector<f64>); 2] {
        let omega = self.crossover_rad_s;
        let response = operator.response_and_gradient(omega);
        let logarithm = |w: f64| (operator.response(w) * self.task.state.controlled_element.response(w)).ln();
        let step = 1e-5 * omega;
        // The two phases may differ by a whole turn.
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

/// Computes the expected errors of an experiment; `length_s` is the total duration of all runs, in whole periods.
///
/// # Errors
/// [`DesignError`] if a number is out of range, the loop is unstable or has no crossover, or the lines do not determine
/// the parameters.
pub fn expected(task: &Task, forcing: &Forcing, length_s: f64) -> Result<Expected, DesignError> {
    LoopQuantities::of(task)?.expected(forcing, length_s)
}

/// Returns the phase advance of a preview.
pub(super) fn preview_response(preview_s: f64, omega: f64) -> Complex64 {
    Complex64::from_polar(1.0, omega * preview_s)
}

/// Returns the inverse, computed after scaling to a unit diagonal; `None` if the matrix is singular.
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
    use hoid_model::{FamilyState, Form, forcing::ForcingFunction};

    use super::*;

    pub fn reference() -> Forcing {
        Forcing::of(EntryPoint::Target, &ForcingFunction::reference())
    }

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
                operator: FamilyOperator::from_names(Form::Lead, &pairs).unwrap(),
                controlled_element: "4/(s(s+1))".parse().unwrap(),
            },
            feedforward: None,
            remnant: Remnant {
                share,
                ..Remnant::default()
            },
        }
    }

    #[test]
    fn errors_decrease_with_time_and_not_with_amplitude() {
        let forcing = reference();
        let of = |task: &Task, length| expected(task, &forcing, length).unwrap();
        let (one, four) = (of(&task(0.2), 81.92), of(&task(0.2), 4.0 * 81.92));
        let error = |e: &Estimate| e.standard_error.unwrap();
        for (a, b) in one.quantities.iter().zip(&four.quantities) {
            assert!(
                (error(&a.estimate) / error(&b.estimate) - 2.0).abs() < 1e-9,
                "{}",
                a.name
            );
        }
        let smaller = |(enters, line): &(EntryPoint, Sinusoid)| {
            let amplitude_deg = 0.1 * line.amplitude_deg;
            (*enters, Sinusoid { amplitude_deg, ..*line })
        };
        let tenth = Forcing::new(forcing.lines().iter().map(smaller).collect()).unwrap();
        let tenth = expected(&task(0.2), &tenth, 81.92).unwrap();
        let error_of = |of: &Expected, name| error(&of.estimate(name).unwrap());
        assert!((error_of(&tenth, "crossover") / error_of(&one, "crossover") - 1.0).abs() < 1e-9);
        assert!((one.rms_e / tenth.rms_e - 10.0).abs() < 1e-9);
        // For a share of .5, p/(1 - p) is four times that for a share of .2, so the error is twice as large.
        let louder = of(&task(0.5), 81.92);
        assert!((error_of(&louder, "phase_margin") / error_of(&one, "phase_margin") - 2.0).abs() < 1e-9);
    }

    #[test]
    fn crossover_and_margin_gradients_match_finite_differences() {
        // Finite differences of the margins of an operator with another gain: d omega/d ln K.
        let task = task(0.2);
        let all = LoopQuantities::of(&task).unwrap();
        let [crossover, margin] = all.margins();
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
        assert!((crossover.gradient[0].abs() / slope(up.0, down.0) - 1.0).abs() < 1e-3);
        assert!((margin.gradient[0].abs() / slope(up.1, down.1) - 1.0).abs() < 1e-3);
        assert!((margin.value - with(1.0).1).abs() < 1e-3);
    }

    #[test]
    fn uninformative_experiments_are_refused() {
        let one = Sinusoid {
            amplitude_deg: 1.0,
            omega_rad_s: 1.0,
            phase_rad: 0.0,
        };
        let few = Forcing::new(vec![(EntryPoint::Target, one)]).unwrap();
        assert!(matches!(
            expected(&task(0.2), &few, 80.0),
            Err(DesignError::NotIdentifiable { lines: 1, .. })
        ));
        let reference = reference();
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
