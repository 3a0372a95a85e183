//! Fit of an operator of the family to a measured frequency response.
//!
//! For the measured response `H_j` at omega_j with the variance `v_j = E|dH_j|^2` (half in the real and half in the
//! imaginary part), the fit minimises
//!
//! `chi^2 = sum_j 2 |H_j - Y(j omega_j) Z(omega_j)|^2 / v_j + sum_i (g_i - m_i)^2 / s_i^2`
//!
//! where Z represents the intersample behaviour of the error and the second sum is the prior. Source: R. Pintelon and
//! J. Schoukens, *System Identification: A Frequency Domain Approach*, 2012, chapter 9 (the sample maximum likelihood
//! estimator; here the errors of input and output are combined into the error of their ratio).

use std::borrow::Cow;

use hoid_model::{
    Complex64, FamilyOperator, SampleTime,
    operator_family::{Coordinate, Form},
};

use super::{
    coordinates::{self, GridDensity},
    intersample::Intersample,
    prior::OperatorPrior,
};
use crate::{
    IdentError, SearchOptions, Termination,
    criterion::Workspace,
    grey_box::objective::Penalty,
    linalg::least_squares::covariance_of_free,
    optimize::{Linearisation, Minimum, Objective, minimise},
};

/// Number of searches for a response that is known exactly, whose criterion has more minima with small values.
const EXACT_RESPONSE_SEARCH_COUNT: usize = 30;
/// Relative difference of chi^2 up to which two searches have ended in the same minimum.
const SAME_MINIMUM_TOLERANCE: f64 = 1e-4;

/// A measured response at one frequency, with its variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredResponse {
    /// Frequency, rad/s.
    pub omega_rad_s: f64,
    /// Sampled response H from e to u.
    pub response: Complex64,
    /// Variance `E|dH|^2` of the response.
    pub variance: f64,
}

/// The criterion as a function of the coordinates of a form.
#[derive(Debug, Clone)]
pub(super) struct ResponseCriterion<'p> {
    pub form: Form,
    pub neuromuscular: bool,
    pub sample_time: SampleTime,
    /// Intersample behaviour of the error.
    pub intersample: Intersample,
    pub points: Cow<'p, [MeasuredResponse]>,
    pub limits: Vec<(f64, f64)>,
    pub penalty: Vec<Penalty>,
}

/// Result of a search.
#[derive(Debug, Clone)]
pub(super) struct ResponseMinimum {
    pub coordinates: Vec<f64>,
    /// Value of chi^2 without the prior.
    pub chi_squared: f64,
    /// Half the Gauss-Newton Hessian of chi^2 with the prior, by rows: the inverse covariance.
    pub information: Vec<f64>,
    pub termination: Termination,
}

impl<'p> ResponseCriterion<'p> {
    pub fn new(
        form: Form,
        neuromuscular: bool,
        points: &'p [MeasuredResponse],
        prior: &OperatorPrior,
        delay_range_s: (f64, f64),
        (sample_time, intersample): (SampleTime, Intersample),
    ) -> Self {
        Self {
            form,
            neuromuscular,
            sample_time,
            intersample,
            points: Cow::Borrowed(points),
            limits: coordinates::limits(form, neuromuscular, delay_range_s, sample_time),
            penalty: prior.penalties(form, neuromuscular),
        }
    }

    /// Returns the same criterion for other measured points.
    pub fn with_points<'q>(&self, points: &'q [MeasuredResponse]) -> ResponseCriterion<'q> {
        ResponseCriterion {
            points: Cow::Borrowed(points),
            form: self.form,
            neuromuscular: self.neuromuscular,
            sample_time: self.sample_time,
            intersample: self.intersample,
            limits: self.limits.clone(),
            penalty: self.penalty.clone(),
        }
    }

    /// Returns the best of the [`minima`](Self::minima) from the default grid.
    ///
    /// # Errors
    /// [`IdentError::NoFiniteLoss`].
    pub fn fit(&self, search: &SearchOptions) -> Result<ResponseMinimum, IdentError> {
        let found = self.minima(search, GridDensity::Default);
        found.into_iter().next().ok_or(IdentError::NoFiniteLoss)
    }

    /// Returns the different minima in which searches from the points of a grid end, best first; empty if all searches
    /// fail. chi^2 has local minima in delay and poles, so the search runs from the best point of each delay, with its
    /// best gain.
    pub fn minima(&self, search: &SearchOptions, grid: GridDensity) -> Vec<ResponseMinimum> {
        let mut starts: Vec<(f64, Vec<f64>)> =
            coordinates::start_grid(self.form, self.neuromuscular, &self.limits, grid)
                .into_iter()
                .filter_map(|mut start| Some((self.optimise_gain(&mut start)?, start)))
                .collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        match grid {
            GridDensity::Default => {
                let mut delays = Vec::new();
                starts.retain(|(_, start)| {
                    let delay = start.last().copied();
                    let is_first = !delays.contains(&delay);
                    delays.push(delay);
                    is_first
                });
            }
            GridDensity::Dense => starts.truncate(EXACT_RESPONSE_SEARCH_COUNT),
        }
        let mut found: Vec<Minimum> = starts
            .into_iter()
            .filter_map(|(_, start)| minimise(self, start, search, None, &mut Workspace::default()))
            .collect();
        found.sort_by(|a, b| {
            a.linearisation
                .sum_of_squares
                .total_cmp(&b.linearisation.sum_of_squares)
        });
        found.dedup_by(|a, b| {
            a.linearisation.sum_of_squares - b.linearisation.sum_of_squares
                <= SAME_MINIMUM_TOLERANCE * b.linearisation.sum_of_squares
        });
        found.into_iter().map(|minimum| self.result(minimum)).collect()
    }

    /// Searches from one starting point; `None` if the search fails.
    pub fn fit_from(&self, start: &[f64], search: &SearchOptions) -> Option<ResponseMinimum> {
        minimise(self, start.to_vec(), search, None, &mut Workspace::default()).map(|minimum| self.result(minimum))
    }

    /// Returns the covariance of the coordinates, `information^-1`; zero for coordinates at a bound. `None` if the
    /// information matrix is singular.
    pub fn covariance(&self, minimum: &ResponseMinimum) -> Option<Vec<f64>> {
        let p = minimum.coordinates.len();
        let free = self.free_coordinates(&minimum.coordinates);
        covariance_of_free(&minimum.information, &free, p)
    }

    /// Returns the ratio of the posterior to the prior variance of each coordinate: 0 without a prior, 1 at a bound or
    /// without a covariance.
    pub fn prior_shares(&self, minimum: &ResponseMinimum) -> Vec<f64> {
        let x = &minimum.coordinates;
        let (p, inner, covariance) = (x.len(), self.free_coordinates(x), self.covariance(minimum));
        let mut shares = vec![0.0; p];
        for penalty in &self.penalty {
            let i = penalty.index;
            shares[i] = match &covariance {
                Some(c) if inner.contains(&i) => (c[i * p + i] * penalty.curvature(x)).min(1.0),
                _ => 1.0,
            };
        }
        shares
    }

    /// Returns the indices of the coordinates that are not at a bound.
    fn free_coordinates(&self, x: &[f64]) -> Vec<usize> {
        (0..x.len())
            .filter(|&i| self.limits[i].0 < x[i] && x[i] < self.limits[i].1)
            .collect()
    }

    /// Returns the sampled response of an operator.
    pub fn sampled_response(&self, operator: &FamilyOperator, omega_rad_s: f64) -> Complex64 {
        operator.response(omega_rad_s) * self.intersample.response(omega_rad_s, self.sample_time)
    }

    /// Returns the root mean square, over the points, of the relative difference between the responses at two places;
    /// infinite if one of them is not an operator.
    pub fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let of = |x: &[f64]| FamilyOperator::new(self.form, self.neuromuscular, x);
        let (Ok(a), Ok(b)) = (of(a), of(b)) else {
            return f64::INFINITY;
        };
        let of = |point: &MeasuredResponse| {
            let (a, b) = (a.response(point.omega_rad_s), b.response(point.omega_rad_s));
            (a - b).norm_sqr() / (a.norm() * b.norm())
        };
        (self.points.iter().map(of).sum::<f64>() / self.points.len() as f64).sqrt()
    }

    /// Returns chi^2 at these coordinates, without the prior.
    pub fn chi_squared(&self, x: &[f64]) -> Option<f64> {
        let operator = FamilyOperator::new(self.form, self.neuromuscular, x).ok()?;
        let of = |point: &MeasuredResponse| {
            let model = self.sampled_response(&operator, point.omega_rad_s);
            2.0 * (point.response - model).norm_sqr() / point.variance
        };
        Some(self.points.iter().map(of).sum())
    }

    fn result(&self, minimum: Minimum) -> ResponseMinimum {
        let (mut coordinates, mut information) = (minimum.theta, minimum.linearisation.gram);
        if coordinates::order_zeros(self.form, &mut coordinates) {
            information = self.linearise(&coordinates, &mut Workspace::default()).gram;
        }
        ResponseMinimum {
            chi_squared: self.chi_squared(&coordinates).unwrap_or(f64::NAN),
            coordinates,
            information,
            termination: minimum.termination,
        }
    }

    /// Sets the gain to its best value for the other coordinates, and returns the value of the criterion.
    fn optimise_gain(&self, x: &mut [f64]) -> Option<f64> {
        debug_assert_eq!(self.form.coordinates(self.neuromuscular)[0], Coordinate::Gain);
        x[0] = 1.0;
        let operator = FamilyOperator::new(self.form, self.neuromuscular, x).ok()?;
        let (mut cross, mut power) = (0.0, 0.0);
        for point in self.points.iter() {
            let model = self.sampled_response(&operator, point.omega_rad_s);
            cross += (model.conj() * point.response).re / point.variance;
            power += model.norm_sqr() / point.variance;
        }
        // The response is linear in the gain: weighted least squares with one unknown.
        x[0] = cross / power;
        let value = self.linearise(x, &mut Workspace::default()).sum_of_squares;
        (value.is_finite() && x[0] != 0.0).then_some(value)
    }
}

impl Objective for ResponseCriterion<'_> {
    fn is_feasible(&self, x: &[f64]) -> bool {
        FamilyOperator::new(self.form, self.neuromuscular, x).is_ok()
    }

    fn linearise(&self, x: &[f64], _: &mut Workspace) -> Linearisation {
        let mut total = Linearisation::empty(x.len());
        let Ok(operator) = FamilyOperator::new(self.form, self.neuromuscular, x) else {
            total.sum_of_squares = f64::NAN;
            return total;
        };
        for point in self.points.iter() {
            let hold = self.intersample.response(point.omega_rad_s, self.sample_time);
            let model = operator.response_and_gradient(point.omega_rad_s);
            // `variance` is E|dH|^2, half in the real and half in the imaginary part; the weight gives both parts unit
            // variance.
            let weight = 2.0 / point.variance;
            let off = point.response - model.value * hold;
            let slopes: Vec<Complex64> = model.gradient.iter().map(|g| g * hold).collect();
            total.add_complex(weight, off, &slopes);
        }
        for penalty in &self.penalty {
            penalty.add_to(x, &mut total);
        }
        total
    }

    fn output_power(&self) -> f64 {
        self.points
            .iter()
            .map(|p| 2.0 * p.response.norm_sqr() / p.variance)
            .sum()
    }

    fn limits(&self) -> Option<&[(f64, f64)]> {
        Some(&self.limits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OMEGA: [f64; 11] = [0.63, 0.94, 1.57, 2.2, 3.46, 4.08, 5.34, 5.97, 7.23, 9.11, 9.74];

    fn points(truth: &FamilyOperator, ts: SampleTime) -> Vec<MeasuredResponse> {
        OMEGA
            .iter()
            .map(|&omega| {
                let response = truth.response(omega) * Intersample::Auto.response(omega, ts);
                MeasuredResponse {
                    omega_rad_s: omega,
                    response,
                    variance: 0.01 * response.norm_sqr(),
                }
            })
            .collect()
    }

    fn truth(form: Form) -> FamilyOperator {
        let tail = [11.0_f64.ln(), 0.25_f64.ln(), 0.19];
        let head: &[f64] = match form {
            Form::Gain => &[3.0],
            Form::Lead | Form::Lead2 => &[1.5, 0.5],
            Form::Lag => &[4.0, 0.4],
            Form::LeadLag | Form::Lead2Lag => &[4.0, 0.6, 0.2],
            Form::QuadraticIntegral => &[2.0, 0.9, 0.3],
            Form::LeadDroop => &[1.5, 0.5, 0.4],
            Form::Derivative | Form::Canals | Form::CanalsRate => &[1.5],
            Form::DerivativeLead => &[1.5, 0.4],
        };
        FamilyOperator::new(form, true, &[head, &tail].concat()).unwrap()
    }

    #[test]
    fn search_from_exchanged_zeros_ends_with_the_droop_at_the_lower_frequency() {
        let ts = SampleTime::AT_100_HZ;
        let truth = truth(Form::LeadDroop);
        let points = points(&truth, ts);
        let none = OperatorPrior::none();
        let criterion = ResponseCriterion::new(
            Form::LeadDroop,
            true,
            &points,
            &none,
            (0.02, 0.8),
            (ts, Intersample::Auto),
        );
        let x = truth.coordinates();
        let exchanged = [&[x[0] * x[1] * x[2], 1.0 / x[2], 1.0 / x[1]], &x[3..]].concat();
        let found = criterion.fit_from(&exchanged, &SearchOptions::default()).unwrap();
        assert!(
            found.coordinates.iter().zip(x).all(|(a, b)| (a - b).abs() < 1e-6),
            "{found:?}"
        );
        let direct = criterion.fit_from(x, &SearchOptions::default()).unwrap();
        let pairs = found.information.iter().zip(&direct.information);
        let mut pairs = pairs.map(|(a, b)| (a - b).abs() / (1.0 + b.abs()));
        assert!(pairs.all(|d| d < 1e-4), "{found:?} {direct:?}");
    }

    /// An operator with a lead and no integration is the limit of the quadratic integration for a gain of zero.
    #[test]
    fn search_for_an_integration_that_is_missing_ends_at_its_bound() {
        let ts = SampleTime::AT_100_HZ;
        let points = points(&truth(Form::Lead), ts);
        let none = OperatorPrior::none();
        let form = Form::QuadraticIntegral;
        let criterion = ResponseCriterion::new(form, true, &points, &none, (0.02, 0.8), (ts, Intersample::Auto));
        let found = criterion.fit(&SearchOptions::default()).unwrap();
        assert!(found.termination.converged(), "{:?}", found.termination);
        let (c_1, bound) = (found.coordinates[1], criterion.limits[1].1);
        assert!(c_1.abs() <= bound && c_1.abs() > 0.99 * bound, "{c_1}");
    }

    #[test]
    fn exact_response_returns_its_operator() {
        let ts = SampleTime::new(1.0 / 60.0).unwrap();
        for form in Form::ALL {
            let truth = truth(form);
            let points = points(&truth, ts);
            let none = OperatorPrior::none();
            let criterion = ResponseCriterion::new(form, true, &points, &none, (0.0, 0.6), (ts, Intersample::Auto));
            let found = criterion.fit(&SearchOptions::default()).unwrap();
            for (a, b) in found.coordinates.iter().zip(truth.coordinates()) {
                assert!((a - b).abs() < 1e-6 * (1.0 + b.abs()), "{form}: {a} {b}");
            }
            assert!(found.chi_squared < 1e-9, "{form}");
        }
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        let ts = SampleTime::new(1.0 / 60.0).unwrap();
        let points = points(&truth(Form::LeadLag), ts);
        let prior = OperatorPrior::population();
        let criterion = ResponseCriterion::new(
            Form::LeadLag,
            true,
            &points,
            &prior,
            (0.0, 0.6),
            (ts, Intersample::Auto),
        );
        let x = [3.0, 0.8, 0.3, 2.2, -1.0, 0.25];
        let at = criterion.linearise(&x, &mut Workspace::default());
        for i in 0..x.len() {
            let value = |by: f64| {
                let mut moved = x;
                moved[i] += by;
                criterion.linearise(&moved, &mut Workspace::default()).sum_of_squares
            };
            let difference = -(value(1e-6) - value(-1e-6)) / 4e-6;
            assert!(
                (at.descent[i] - difference).abs() < 1e-6 * at.descent[i].abs().max(1.0),
                "{i}"
            );
        }
    }

    #[test]
    fn errors_match_the_scatter_of_repeated_measurements() {
        // With 400 simulated measurements the standard deviations are accurate to 3.5 %.
        let mut state = 5_u64;
        let mut uniform = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let ts = SampleTime::new(1.0 / 60.0).unwrap();
        let truth = truth(Form::LeadLag);
        let exact: Vec<MeasuredResponse> = points(&truth, ts)
            .into_iter()
            .map(|p| MeasuredResponse {
                variance: 0.0004 * p.response.norm_sqr(),
                ..p
            })
            .collect();
        let none = OperatorPrior::none();
        let mut all = Vec::new();
        let mut covariance = Vec::new();
        for _ in 0..400 {
            // The sum of twelve uniform deviates has a variance of 1.
            let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
            let noisy: Vec<MeasuredResponse> = exact
                .iter()
                .map(|p| MeasuredResponse {
                    response: p.response + Complex64::new(normal(), normal()) * (p.variance / 2.0).sqrt(),
                    ..*p
                })
                .collect();
            let criterion =
                ResponseCriterion::new(Form::LeadLag, true, &noisy, &none, (0.0, 0.6), (ts, Intersample::Auto));
            let found = criterion
                .fit_from(truth.coordinates(), &SearchOptions::default())
                .unwrap();
            covariance = criterion.covariance(&found).unwrap();
            all.push(found.coordinates);
        }
        for i in 0..6 {
            let mean = all.iter().map(|x| x[i]).sum::<f64>() / 400.0;
            let deviation = (all.iter().map(|x| (x[i] - mean).powi(2)).sum::<f64>() / 399.0).sqrt();
            let ratio = deviation / covariance[i * 7].sqrt();
            assert!((ratio - 1.0).abs() < 0.2, "{i}: {ratio}");
        }
    }
}
