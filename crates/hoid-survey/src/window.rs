//! A batch fit over a sliding window.
//!
//! The last W samples are kept. Every k samples the batch estimator fits the kept samples, starting from the last
//! theta; between the fits theta stays constant. The estimate therefore has a rectangular memory of W samples, the
//! initial states, bounds and other properties of the estimator, and the covariance of the fit.
//!
//! **Wrong minima.** A search from the last theta may stay in a local minimum. The estimator therefore also searches
//! from its own starts if there is no last theta, if the search from the last theta does not converge, if the loss has
//! risen by a fraction [`LOSS_RISE_LIMIT`] since the last comparison, and otherwise at every [`COMPARISON_INTERVAL`]-th
//! fit. The lower of the two minima is used.
//!
//! **Failures.** If a fit fails, for example for a window without excitation, theta and its covariance are unchanged.

use hoid_core::state::{State, visit_all};
use std::collections::VecDeque;

use hoid_model::{Channel, Record, SampleTime, Structure};

use hoid_ident::{
    Estimator, Fit, IdentError, first_residual, settings,
    settings::{Bounds, Value},
};

use hoid_track::{
    Memory, Sample, StartSource,
    building::{
        MethodDescription, Predictor, Recursion, RecursiveMethod, Setup, StartState, StepOutcome, invalid_option,
        limit_magnitude, short_memory_for_b,
    },
};

/// Number of fits after which the search from the last theta is compared with searches from the estimator's own starts.
const COMPARISON_INTERVAL: usize = 8;
/// Relative rise in the loss since the last comparison that triggers another comparison.
const LOSS_RISE_LIMIT: f64 = 0.25;
/// Window length divided by the smallest number of samples for a first fit.
const FIRST_FIT_DIVISOR: usize = 4;
/// Number of residuals per unknown (coefficient or initial state) that the first fit needs.
const RESIDUALS_PER_UNKNOWN: usize = 5;

settings! {
    /// Options of the sliding window.
    pub struct WindowOptions {
        /// Window length, in samples or seconds
        pub window: Memory = Memory::Seconds(20.0),
        /// Samples between fits
        #[setting(bounds(Bounds::AtLeast(1.0)))]
        pub refit: usize = 25,
    }
}

impl RecursiveMethod for WindowOptions {
    fn description(&self) -> MethodDescription {
        MethodDescription {
            name: "window",
            help: "repeated batch fit of a moving window",
            source: "the thesis, section VII",
            structures: &Structure::ALL,
            defaults: &[],
        }
    }

    /// The method does not use these memory lengths: its memory is the window.
    fn default_memory(&self, parameter: &str) -> Memory {
        short_memory_for_b(parameter)
    }

    fn memory_as_text(&self) -> Option<String> {
        let window = self.window.text().unwrap_or_default();
        Some(format!("window of {window}, a fit every {} samples", self.refit))
    }

    fn check(&self, _setup: &Setup) -> Result<(), IdentError> {
        match (self.window, self.refit) {
            (Memory::Infinite, _) => Err(invalid_option("the window", "inf".to_owned(), "samples or seconds")),
            (_, 0) => Err(invalid_option(
                "the samples between two fits",
                "0".to_owned(),
                "1 or more",
            )),
            _ => Ok(()),
        }
    }

    fn check_at(&self, sample_time: SampleTime) -> Result<(), IdentError> {
        self.window.lambda(sample_time).map(|_| ())
    }

    fn refits_stored_samples(&self) -> bool {
        true
    }

    fn build(
        &self,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        let covariance: Vec<f64> = from.spread.iter().map(|s| s * from.variance).collect();
        let known = match setup.start {
            StartSource::Nothing => None,
            _ => Some((from.values.as_slice(), from.from_fit.then_some(covariance.as_slice()))),
        };
        let window = self.window.window_samples(sample_time)?;
        let recursion = WindowRecursion::new(setup.start_estimator(), sample_time, window, self.refit, known)?;
        Ok(Box::new(recursion))
    }
}

/// The recursion of the sliding window.
#[derive(Debug, Clone)]
pub(crate) struct WindowRecursion {
    estimator: Estimator,
    sample_time: SampleTime,
    window: usize,
    every: usize,
    /// Number of samples needed for the first fit.
    min_samples: usize,
    e: VecDeque<f64>,
    u: VecDeque<f64>,
    predictor: Predictor,
    theta: Vec<f64>,
    /// True if theta was estimated or given.
    has_theta: bool,
    covariance: Option<Vec<f64>>,
    variance: f64,
    /// Number of innovations so far, counted until the first successful fit.
    innovations: f64,
    samples_since_fit: usize,
    fits_since_comparison: usize,
    compared_loss: f64,
    fits: usize,
    failures: usize,
    last_failure: Option<IdentError>,
}

impl State for WindowRecursion {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        // The lengths are visited first: the number of samples kept, and whether there is a covariance.
        for kept in [&mut self.e, &mut self.u] {
            let mut length = kept.len();
            length.visit(each);
            kept.resize(length.min(self.window.saturating_add(1)), 0.0);
            kept.make_contiguous().visit(each);
        }
        let mut there = self.covariance.is_some();
        there.visit(each);
        self.covariance = there.then(|| {
            let p = self.theta.len();
            self.covariance.take().unwrap_or_else(|| vec![0.0; p * p])
        });
        if let Some(covariance) = &mut self.covariance {
            covariance.as_mut_slice().visit(each);
        }
        let parts: &mut [&mut dyn State] = &mut [
            &mut self.predictor,
            &mut self.theta.as_mut_slice(),
            &mut self.has_theta,
            &mut self.variance,
            &mut self.innovations,
            &mut self.samples_since_fit,
            &mut self.fits_since_comparison,
            &mut self.compared_loss,
            &mut self.fits,
            &mut self.failures,
        ];
        visit_all(parts, each);
    }
}

impl WindowRecursion {
    /// Creates the recursion with a window of `window` samples, which is fitted every `every` samples. The recursion
    /// starts from theta and its covariance if these are known.
    ///
    /// # Errors
    /// [`IdentError`] if the options, the orders, the start or the window cannot be used.
    pub fn new(
        estimator: Estimator,
        sample_time: SampleTime,
        window: usize,
        every: usize,
        start: Option<(&[f64], Option<&[f64]>)>,
    ) -> Result<Self, IdentError> {
        let orders = estimator.orders;
        orders.check(estimator.structure)?;
        estimator.check()?;
        let p = orders.parameter_count();
        let unknowns = p + orders.nf + orders.nc;
        let least = first_residual(&orders, estimator.effective_initial_state()) + RESIDUALS_PER_UNKNOWN * unknowns;
        let refuse = |option: &str, found: String, expected: String| {
            Err(IdentError::BadOption {
                option: option.to_owned(),
                found,
                expected,
            })
        };
        if window < least {
            return refuse(
                "the window",
                format!("{window} samples"),
                format!("{least} or more for {orders}"),
            );
        }
        let Some(predictor) = Predictor::new(orders) else {
            return refuse(
                "the orders of a window",
                format!("{p} coefficients"),
                "at most 64".to_owned(),
            );
        };
        if every == 0 {
            return refuse("the samples between two fits", "0".to_owned(), "1 or more".to_owned());
        }
        let given = start.map(|(theta, _)| theta).or(estimator.start.as_deref());
        if let Some(theta) = given
            && (theta.len() != p || theta.iter().any(|v| !v.is_finite()))
        {
            return Err(IdentError::BadStart {
                reason: format!("it is {theta:?}, but the orders {orders} need {p} finite coefficients"),
            });
        }
        let covariance = start.and_then(|(_, covariance)| covariance);
        if let Some(c) = covariance
            && (c.len() != p * p || c.iter().any(|v| !v.is_finite()))
        {
            return Err(IdentError::BadStart {
                reason: format!("its covariance must have {} finite elements", p * p),
            });
        }
        Ok(Self {
            sample_time,
            window,
            every,
            min_samples: (window / FIRST_FIT_DIVISOR).max(least),
            e: VecDeque::with_capacity(window),
            u: VecDeque::with_capacity(window),
            predictor,
            theta: given.map_or_else(|| vec![0.0; p], <[f64]>::to_vec),
            has_theta: given.is_some(),
            covariance: covariance.map(<[f64]>::to_vec),
            variance: 0.0,
            innovations: 0.0,
            samples_since_fit: if given.is_some() { 0 } else { every },
            fits_since_comparison: COMPARISON_INTERVAL,
            compared_loss: f64::INFINITY,
            fits: 0,
            failures: 0,
            last_failure: None,
            estimator: Estimator {
                start: None,
                ..estimator
            },
        })
    }

    /// Number of successful fits.
    #[cfg(test)]
    pub fn fit_count(&self) -> usize {
        self.fits
    }

    /// Adds a sample to the window and updates the predictor. Returns the innovation.
    fn take(&mut self, sample: Sample) -> f64 {
        self.store_sample(sample.e, sample.u);
        self.predictor.step(&self.theta, sample.e, sample.u)
    }

    fn store_sample(&mut self, e: f64, u: f64) {
        for (kept, value) in [(&mut self.e, e), (&mut self.u, u)] {
            if kept.len() == self.window {
                kept.pop_front();
            }
            kept.push_back(limit_magnitude(value));
        }
    }

    fn refit(&mut self) {
        self.samples_since_fit = 0;
        let found = self.window_record().and_then(|record| self.fit(&record));
        match found {
            Ok(fit) => {
                self.fits += 1;
                self.has_theta = true;
                self.theta.copy_from_slice(fit.model().theta());
                self.covariance = fit.covariance().map(<[f64]>::to_vec);
                self.variance = fit.innovation_variance();
                // The filters still contain the effect of the previous theta, which must not enter the innovations of
                // later samples.
                self.predictor.reset();
                for (e, u) in self.e.iter().zip(&self.u) {
                    self.predictor.step(&self.theta, *e, *u);
                }
            }
            Err(failure) => {
                self.failures += 1;
                // After a failure the next fit also searches from the estimator's own starts.
                self.fits_since_comparison = COMPARISON_INTERVAL;
                self.last_failure = Some(failure);
            }
        }
    }

    fn window_record(&mut self) -> Result<Record, IdentError> {
        let output = Channel::new("u", "", self.u.make_contiguous().to_vec());
        let record = if self.estimator.structure.has_input() {
            let input = Channel::new("e", "", self.e.make_contiguous().to_vec());
            Record::new(self.sample_time, input, output)?
        } else {
            Record::from_output(self.sample_time, output)?
        };
        Ok(record.labelled("of the window"))
    }

    /// Returns the fit with the lowest loss found from the last theta and, if a comparison is due, from the estimator's
    /// own starts.
    fn fit(&mut self, record: &Record) -> Result<Fit, IdentError> {
        let records = std::slice::from_ref(record);
        let own = |estimator: &Estimator| estimator.fit(records).and_then(require_convergence);
        if !self.has_theta {
            let fit = own(&self.estimator)?;
            self.mark_compared(&fit);
            return Ok(fit);
        }
        self.estimator.start = Some(self.theta.clone());
        let warm = own(&self.estimator);
        self.estimator.start = None;
        self.fits_since_comparison += 1;
        if let Ok(fit) = &warm
            && self.fits_since_comparison < COMPARISON_INTERVAL
            && fit.loss() <= (1.0 + LOSS_RISE_LIMIT) * self.compared_loss
        {
            return warm;
        }
        let cold = own(&self.estimator);
        let fit = match (warm, cold) {
            (Ok(warm), Ok(cold)) => {
                if cold.loss() < warm.loss() {
                    cold
                } else {
                    warm
                }
            }
            (Ok(fit), Err(_)) | (Err(_), Ok(fit)) => fit,
            (Err(_), Err(failure)) => return Err(failure),
        };
        self.mark_compared(&fit);
        Ok(fit)
    }

    fn mark_compared(&mut self, fit: &Fit) {
        self.fits_since_comparison = 0;
        self.compared_loss = fit.loss();
    }
}

/// Returns the fit if its search converged. A fit that did not converge reflects the limit of iterations rather than
/// the data of the window.
fn require_convergence(fit: Fit) -> Result<Fit, IdentError> {
    if fit.termination().converged() {
        Ok(fit)
    } else {
        Err(IdentError::NotSettled {
            reason: fit.termination().reason.to_string(),
        })
    }
}

impl Recursion for WindowRecursion {
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let innovation = self.take(sample);
        self.samples_since_fit = self.samples_since_fit.saturating_add(1);
        if self.fits == 0 {
            self.innovations += 1.0;
            self.variance =
                limit_magnitude(self.variance + (innovation * innovation - self.variance) / self.innovations);
        }
        if self.u.len() >= self.min_samples && self.samples_since_fit >= self.every {
            self.refit();
        }
        StepOutcome {
            innovation,
            shortened: false,
        }
    }

    fn step_without_update(&mut self, sample: Sample) -> StepOutcome {
        StepOutcome {
            innovation: self.take(sample),
            shortened: false,
        }
    }

    fn bridge(&mut self, sample: Sample) {
        let predicted = self.predictor.bridge(&self.theta, sample.e);
        self.store_sample(sample.e, predicted);
    }

    fn theta(&self) -> &[f64] {
        &self.theta
    }

    fn covariance(&self, into: &mut [f64]) -> bool {
        let Some(covariance) = &self.covariance else {
            return false;
        };
        into.copy_from_slice(covariance);
        true
    }

    fn innovation_variance(&self) -> f64 {
        self.variance
    }

    fn failures(&self) -> Option<(usize, String)> {
        let why = self.last_failure.as_ref().map(IdentError::to_string);
        Some((self.failures, why.unwrap_or_default()))
    }
}

#[cfg(test)]
mod tests;
