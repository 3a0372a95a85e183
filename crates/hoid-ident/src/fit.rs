//! Result of an estimation: the model, its uncertainty, and the termination of the search.

use hoid_model::{
    NotConvertible, Orders, PolynomialModel, Record,
    polynomial::product,
    polynomial_model::monic,
    remnant::RemnantDiscretisation,
    uncertainty::{Estimate, OperatorEstimate, RemnantEstimate, operator_estimate, remnant_estimate, variance_along},
};
use hoid_numerics::statistics::mean;

use crate::{
    IdentError, InitialState, Termination,
    criterion::{Criterion, Data, Workspace, first_residual},
    linalg::vectors::dot,
};

/// A fitted model.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Fit {
    pub(crate) model: PolynomialModel,
    pub(crate) covariance: Option<Vec<f64>>,
    pub(crate) loss: f64,
    pub(crate) innovation_variance: f64,
    pub(crate) residuals: usize,
    pub(crate) states: usize,
    pub(crate) initial_state: InitialState,
    pub(crate) termination: Termination,
    pub(crate) start: String,
    /// True for each parameter that is fixed or at a bound.
    pub(crate) is_fixed_or_bounded: Vec<bool>,
    /// Variance of the output over the samples whose residuals count.
    pub(crate) output_variance: f64,
    /// True if the innovation variance is the square of a robust scale.
    pub(crate) robust: bool,
    /// True for an estimate by instrumental variables.
    pub(crate) instrumented: bool,
    /// For a grey box, the physical parameters from which theta was computed.
    pub(crate) physical: Option<Box<Physical>>,
    /// Variance of the delay and its effect on theta, if nk was found by a search.
    pub(crate) searched_delay: Option<SearchedDelay>,
}

/// Physical parameters of a grey-box fit; theta is a function of them.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Physical {
    /// Title of the fitted model, one line of text.
    pub title: String,
    /// Name and estimate of each parameter.
    pub parameters: Vec<(String, Estimate)>,
    /// Number of free parameters.
    pub free: usize,
    pub operator: Result<OperatorEstimate, NotConvertible>,
    pub remnant: Option<RemnantEstimate>,
}

/// Variance of a delay found by a search, and the derivative of theta with respect to the delay.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct SearchedDelay {
    /// Variance of the delay tau, s^2.
    pub variance_s2: f64,
    /// Derivative `d theta/d tau`, 1/s.
    pub slope: Vec<f64>,
}

/// Signal on the time axis of a record, from sample `first` on.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Index of the first sample that has a value.
    pub first: usize,
    /// One value per sample from `first` to the end of the record.
    pub values: Vec<f64>,
}

/// Frequency response from e to u at one frequency, with standard errors.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponsePoint {
    /// Frequency, rad/s.
    pub omega_rad_s: f64,
    /// Magnitude in dB.
    pub magnitude_db: Estimate,
    /// Phase in deg, principal value in (-180, 180]; the caller may unwrap it along the frequency axis.
    pub phase_deg: Estimate,
}

impl Fit {
    /// Returns the model with its coefficients.
    pub fn model(&self) -> &PolynomialModel {
        &self.model
    }

    /// Returns the orders of the model.
    pub fn orders(&self) -> Orders {
        self.model.orders()
    }

    /// Returns the covariance of theta by rows: `sigma^2 (psi' psi)^-1` with the initial states eliminated, plus the
    /// contribution of a delay found by a search if the model represents an operator (`searched_delay.rs`). `None` for
    /// an exact fit, whose residuals carry no information about the noise.
    pub fn covariance(&self) -> Option<&[f64]> {
        self.covariance.as_deref()
    }

    /// Returns the name, value and standard error of each parameter: the coefficients of theta, or the physical
    /// parameters of a grey box.
    pub fn parameters(&self) -> Vec<(String, Estimate)> {
        if let Some(physical) = &self.physical {
            return physical.parameters.clone();
        }
        let theta = self.model.theta();
        let p = theta.len();
        self.orders()
            .parameter_names()
            .into_iter()
            .enumerate()
            .map(|(i, name)| {
                let estimate = match &self.covariance {
                    Some(c) if !self.is_fixed_or_bounded[i] => Estimate::with_variance(theta[i], c[i * p + i]),
                    _ => Estimate::fixed(theta[i]),
                };
                (name, estimate)
            })
            .collect()
    }

    /// Returns the loss `V = sum eps^2 / n` over the n residuals that count.
    pub fn loss(&self) -> f64 {
        self.loss
    }

    /// Returns the unbiased innovation variance `sum eps^2 / (n - p - s)` with p parameters and s estimated initial
    /// states. With a robust loss it is the square of the robust scale ([`Fit::is_robust`]).
    pub fn innovation_variance(&self) -> f64 {
        self.innovation_variance
    }

    /// Returns the number n of residuals.
    pub fn residual_count(&self) -> usize {
        self.residuals
    }

    /// Returns the number s of estimated initial states and levels in all records.
    pub fn state_count(&self) -> usize {
        self.states
    }

    /// Returns the assumption about the signals before the start of each record.
    pub fn initial_state(&self) -> InitialState {
        self.initial_state
    }

    /// Returns for each coefficient whether it is fixed or at a bound; such coefficients have no standard error.
    pub fn fixed_or_bounded_flags(&self) -> &[bool] {
        &self.is_fixed_or_bounded
    }

    /// Returns the termination of the search.
    pub fn termination(&self) -> Termination {
        self.termination
    }

    /// Returns the name of the start that led to the lowest minimum.
    pub fn start(&self) -> &str {
        &self.start
    }

    /// Akaike's criterion `n ln V + 2 p`.
    pub fn aic(&self) -> f64 {
        self.residuals as f64 * self.loss.ln() + 2.0 * self.parameter_count()
    }

    /// Schwarz's (Bayesian) criterion `n ln V + p ln n`.
    pub fn bic(&self) -> f64 {
        let n = self.residuals as f64;
        n * self.loss.ln() + self.parameter_count() * n.ln()
    }

    /// Akaike's final prediction error `V (1 + p/n) / (1 - p/n)`.
    pub fn fpe(&self) -> f64 {
        let ratio = self.parameter_count() / self.residuals as f64;
        self.loss * (1.0 + ratio) / (1.0 - ratio)
    }

    /// Akaike's criterion with the correction for short records, `AIC + 2 p (p + 1)/(n - p - 1)` (C. M. Hurvich and
    /// C.-L. Tsai, *Biometrika* 76 (1989) 297-307); infinite if n does not exceed p + 1.
    pub fn aicc(&self) -> f64 {
        let (n, p) = (self.residuals as f64, self.parameter_count());
        if n > p + 1.0 {
            self.aic() + 2.0 * p * (p + 1.0) / (n - p - 1.0)
        } else {
            f64::INFINITY
        }
    }

    /// Rissanen's minimum description length `V (1 + p ln n / n)`.
    pub fn mdl(&self) -> f64 {
        let (n, p) = (self.residuals as f64, self.parameter_count());
        self.loss * (1.0 + p * n.ln() / n)
    }

    /// Young's criterion `ln(V / var u) + ln( (1/p) sum_i var theta_i / theta_i^2 )` over the free coefficients of A, B
    /// and F (P. C. Young, *Recursive Estimation and Time-Series Analysis*, 2011, section 6.7). A more negative value
    /// means a closer fit with better-determined coefficients. `None` without standard errors or if a coefficient is
    /// zero.
    pub fn yic(&self) -> Option<f64> {
        let relative: Option<Vec<f64>> = self
            .parameters()
            .iter()
            .zip(&self.is_fixed_or_bounded)
            .filter(|((name, _), held)| !**held && name.starts_with(['a', 'b', 'f']))
            .map(|((_, e), _)| Some((e.standard_error? / e.value).powi(2)))
            .collect();
        let relative = relative.filter(|r| !r.is_empty())?;
        let yic = (self.loss / self.output_variance).ln() + mean(&relative).ln();
        yic.is_finite().then_some(yic)
    }

    /// Returns the number p of free parameters.
    pub fn free_count(&self) -> usize {
        if let Some(physical) = &self.physical {
            return physical.free;
        }
        self.is_fixed_or_bounded.iter().filter(|held| !**held).count()
    }

    fn parameter_count(&self) -> f64 {
        self.free_count() as f64
    }

    /// Returns the parameters of the operator with standard errors.
    ///
    /// # Errors
    /// [`NotConvertible`] if the model represents no operator, with the reason.
    pub fn operator(&self) -> Result<OperatorEstimate, NotConvertible> {
        if let Some(physical) = &self.physical {
            return physical.operator.clone();
        }
        let p = self.model.theta().len();
        let mut found = match &self.covariance {
            Some(covariance) => operator_estimate(&self.model, covariance),
            None => operator_estimate(&self.model, &vec![f64::NAN; p * p]),
        }?;
        if let Some(delay) = &self.searched_delay {
            found.tau_e_s = Estimate::with_variance(found.tau_e_s.value, delay.variance_s2);
        }
        Ok(found)
    }

    /// True if a robust loss was used.
    pub fn is_robust(&self) -> bool {
        self.robust
    }

    /// True for a grey-box fit, whose theta is a function of physical parameters.
    pub fn is_grey_box(&self) -> bool {
        self.physical.is_some()
    }

    /// Returns the title for printed output: structure and orders, or the title of a grey box or an operator of the
    /// family.
    pub fn title(&self) -> String {
        match &self.physical {
            Some(physical) => physical.title.clone(),
            None => format!("{}({})", self.model.structure().label(), self.orders()),
        }
    }

    /// Returns T_n and K_n of the remnant filter that the noise model represents. For a grey box both were fitted with
    /// a remnant held over each sample, regardless of `how`.
    ///
    /// # Errors
    /// [`NotConvertible`] if the noise model represents no remnant filter, with the reason.
    pub fn remnant(&self, how: RemnantDiscretisation) -> Result<RemnantEstimate, NotConvertible> {
        if let Some(physical) = &self.physical {
            return physical.remnant.ok_or_else(|| NotConvertible::NotARemnantFilter {
                order: 0,
                reason: "with m = 0 the remnant is white".to_owned(),
            });
        }
        let variance_of_sd = self.innovation_variance / (2.0 * self.residuals as f64);
        remnant_estimate(
            &self.model,
            self.covariance.as_deref(),
            self.innovation_variance.sqrt(),
            variance_of_sd,
            how,
        )
    }

    /// Returns the one-step-ahead residuals for a record, with initial states treated as in the fit.
    ///
    /// # Errors
    /// [`IdentError::MixedSampling`], [`IdentError::TooFewSamples`].
    pub fn residuals(&self, record: &Record) -> Result<Series, IdentError> {
        self.residual_series(self.orders(), self.model.theta(), record)
    }

    /// Returns the one-step-ahead prediction of the output.
    ///
    /// # Errors
    /// Same as [`Fit::residuals`].
    pub fn predict(&self, record: &Record) -> Result<Series, IdentError> {
        Ok(subtract_from_output(record, self.residuals(record)?))
    }

    /// Returns the simulated output: the response of `B/(A F)` to the input alone, without the noise model. If the fit
    /// estimated initial states, the initial states of the simulation are also estimated, by least squares of the
    /// simulation error. For a model without an input the simulated output is zero.
    ///
    /// # Errors
    /// Same as [`Fit::residuals`].
    pub fn simulate(&self, record: &Record) -> Result<Series, IdentError> {
        if !self.model.structure().has_input() {
            return Ok(Series {
                first: 0,
                values: vec![0.0; record.len()],
            });
        }
        let (orders, theta) = output_error_form(&self.model);
        Ok(subtract_from_output(
            record,
            self.residual_series(orders, &theta, record)?,
        ))
    }

    /// Returns the variance of a quantity with the gradient `by_theta` with respect to theta and the derivative
    /// `by_delay` (1/s) with respect to the delay; `None` without a covariance.
    pub(crate) fn variance_of(&self, by_theta: &[f64], by_delay: f64) -> Option<f64> {
        let covariance = self.covariance.as_ref()?;
        // The covariance already contains the term (g's)^2 var tau, where s is the slope d theta/d tau.
        let with_delay = self.searched_delay.as_ref().map_or(0.0, |delay| {
            let moved = dot(by_theta, &delay.slope);
            delay.variance_s2 * by_delay * (2.0 * moved + by_delay)
        });
        Some(variance_along(by_theta, covariance) + with_delay)
    }

    fn residual_series(&self, orders: Orders, theta: &[f64], record: &Record) -> Result<Series, IdentError> {
        let (ours, theirs) = (self.model.sample_time(), record.sample_time());
        if !ours.matches(theirs) {
            return Err(IdentError::MixedSampling {
                label: record.label().to_owned(),
                found: theirs.s(),
                expected: ours.s(),
            });
        }
        let first = first_residual(&orders, self.initial_state);
        let needed = first + orders.nf + orders.nc;
        if record.len() <= needed {
            return Err(IdentError::TooFewSamples {
                label: record.label().to_owned(),
                samples: record.len(),
                orders: orders.to_string(),
                needed,
            });
        }
        let data = Data::new(record.input(), record.output());
        let criterion = Criterion::for_record(orders, data, self.initial_state, first);
        Ok(Series {
            first,
            values: criterion.residuals_of(theta, 0, &mut Workspace::borrow_from_thread()),
        })
    }

    /// Returns the frequency response with standard errors by the delta method: `d ln|H| = Re(dH/H)` and
    /// `d arg H = Im(dH/H) - omega d tau`, where dH is the gradient with respect to theta.
    pub fn frequency_response(&self, omega_rad_s: &[f64]) -> Vec<ResponsePoint> {
        let to_db = 20.0 / std::f64::consts::LN_10;
        omega_rad_s
            .iter()
            .map(|&omega| {
                let (h, gradient) = self.model.response_and_gradient(omega);
                let relative: Vec<_> = gradient.iter().map(|g| g / h).collect();
                let estimate = |value: f64, by_theta: Vec<f64>, by_delay: f64| {
                    let variance = self.variance_of(&by_theta, by_delay);
                    variance.map_or(Estimate::fixed(value), |v| Estimate::with_variance(value, v))
                };
                ResponsePoint {
                    omega_rad_s: omega,
                    magnitude_db: estimate(
                        to_db * h.norm().ln(),
                        relative.iter().map(|r| to_db * r.re).collect(),
                        0.0,
                    ),
                    phase_deg: estimate(
                        h.arg().to_degrees(),
                        relative.iter().map(|r| r.im.to_degrees()).collect(),
                        -omega.to_degrees(),
                    ),
                }
            })
            .collect()
    }
}

fn subtract_from_output(record: &Record, mut errors: Series) -> Series {
    let output = &record.output()[errors.first..];
    errors.values.iter_mut().zip(output).for_each(|(e, u)| *e = u - *e);
    errors
}

/// Returns the orders and theta of the output-error model `u = B/(A F) q^-nk e + eps` that responds to e as `model`
/// does. The residual of this output-error model is the simulation error.
fn output_error_form(model: &PolynomialModel) -> (Orders, Vec<f64>) {
    let orders = model.orders();
    let den = product(&monic(model.a()), &monic(model.f()));
    let theta = model.b().iter().chain(&den[1..]).copied().collect();
    let form = Orders {
        nb: orders.nb,
        nf: orders.na + orders.nf,
        nk: orders.nk,
        ..Orders::default()
    };
    (form, theta)
}
