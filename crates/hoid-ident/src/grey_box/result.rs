//! Result of a grey-box fit.

use hoid_model::{
    NotConvertible, OperatorParameters,
    remnant::RemnantDiscretisation,
    remnant_noise::remnant_noise,
    uncertainty::{Estimate, OperatorEstimate, RemnantEstimate, variance_along},
};

use crate::{Fit, Termination};

use super::layout::{DELAY_SLOT, LEAD_SLOT, Layout, Lead, TIME_CONSTANT_SLOT};

/// A candidate order m of the remnant filter.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct OrderCandidate {
    /// Order m.
    pub order: usize,
    /// Criteria of the fit of this order, computed from the same samples for all orders, or the reason why the order
    /// could not be fitted.
    pub outcome: Result<OrderFigures, String>,
}

/// Criteria of a candidate order.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct OrderFigures {
    /// Loss V.
    pub loss: f64,
    /// Akaike's criterion.
    pub aic: f64,
    /// Schwarz's criterion, by which the order is chosen.
    pub bic: f64,
    /// True if the search converged.
    pub converged: bool,
}

/// A fit of an operator and its remnant in physical parameters.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct GreyBoxFit {
    pub(crate) layout: Layout,
    pub(crate) eta: Vec<f64>,
    /// Covariance of eta by rows, with zeros for parameters that are fixed or at a bound; `None` for an exact fit.
    pub(crate) covariance: Option<Vec<f64>>,
    /// Indices of the elements of eta that have a variance.
    pub(crate) free: Vec<usize>,
    /// Number of parameters that were not fixed.
    pub(crate) parameters: usize,
    pub(crate) fits: Vec<Fit>,
    pub(crate) candidates: Vec<OrderCandidate>,
}

impl GreyBoxFit {
    /// Returns the order m of the remnant filter; 0 is white noise.
    pub fn order(&self) -> usize {
        self.layout.order
    }

    /// Returns all orders that were tried, including the order of this fit.
    pub fn candidates(&self) -> &[OrderCandidate] {
        &self.candidates
    }

    /// Returns the name, value and standard error of each fitted parameter in the coordinates of the fit: K_e, K_e_dot
    /// (s) or T_L (s), omega_nm (rad/s), zeta_nm, tau_e (s), T_n (s). The name of an individual parameter contains the
    /// number of its record.
    pub fn parameters(&self) -> Vec<(String, Estimate)> {
        self.layout
            .names
            .iter()
            .enumerate()
            .map(|(i, name)| (name.clone(), self.estimate(i)))
            .collect()
    }

    /// Returns the covariance of [`GreyBoxFit::parameters`] by rows, with zeros for parameters that are fixed or at a
    /// bound; `None` for an exact fit.
    pub fn covariance(&self) -> Option<&[f64]> {
        self.covariance.as_deref()
    }

    fn estimate(&self, i: usize) -> Estimate {
        let p = self.eta.len();
        match &self.covariance {
            Some(c) if self.free.contains(&i) => Estimate::with_variance(self.eta[i], c[i * p + i]),
            _ => Estimate::fixed(self.eta[i]),
        }
    }

    /// Returns the estimate of a quantity that depends on the gain and the lead. `by_gain` is its derivative with
    /// respect to K_e, `by_lead` its derivative with respect to the coordinate of the lead.
    fn gain_quantity_estimate(&self, record: usize, value: f64, by_gain: f64, by_lead: f64) -> Estimate {
        let places = &self.layout.positions[record];
        let used = |index: usize, by: f64| by != 0.0 && self.free.contains(&index);
        match &self.covariance {
            Some(c) if used(places[0], by_gain) || used(places[LEAD_SLOT], by_lead) => {
                let mut gradient = vec![0.0; self.eta.len()];
                gradient[places[0]] += by_gain;
                gradient[places[LEAD_SLOT]] += by_lead;
                Estimate::with_variance(value, variance_along(&gradient, c))
            }
            _ => Estimate::fixed(value),
        }
    }

    /// Returns the operator of a record with standard errors. `record` is the index of the record in the fit; as in all
    /// methods of the fit, a larger index refers to the last record.
    ///
    /// # Errors
    /// [`NotConvertible::ZeroGain`] if K_e is zero, so there is no T_L.
    pub fn operator(&self, record: usize) -> Result<OperatorEstimate, NotConvertible> {
        let record = self.record_index(record);
        let slots = self.layout.record_slots(&self.eta, record);
        let [k_e, k_e_dot, ..] = self.layout.operator(&slots);
        if k_e == 0.0 {
            return Err(NotConvertible::ZeroGain);
        }
        let t_l = k_e_dot / k_e;
        let places = self.layout.positions[record];
        let (t_l_s, k_e_dot) = match self.layout.lead {
            Lead::RateGain => (
                self.gain_quantity_estimate(record, t_l, -t_l / k_e, 1.0 / k_e),
                self.estimate(places[LEAD_SLOT]),
            ),
            Lead::Time => (
                self.estimate(places[LEAD_SLOT]),
                self.gain_quantity_estimate(record, k_e_dot, t_l, k_e),
            ),
        };
        Ok(OperatorEstimate {
            k_e: self.estimate(places[0]),
            t_l_s,
            k_e_dot,
            omega_nm_rad_s: self.estimate(places[2]),
            zeta_nm: self.estimate(places[3]),
            tau_e_s: self.estimate(places[DELAY_SLOT]),
        })
    }

    /// Returns the operator of a record without standard errors.
    ///
    /// # Errors
    /// The errors of [`GreyBoxFit::operator`].
    pub fn operator_parameters(&self, record: usize) -> Result<OperatorParameters, NotConvertible> {
        Ok(self.operator(record)?.parameters())
    }

    /// Returns T_n and K_n of a record, with a remnant that is held over each sample; `None` for m = 0, where the
    /// remnant is white with the standard deviation of the innovation.
    ///
    /// `K_n = sigma/g(T_n)`; sigma has the variance `sigma^2/(2 n)` and is uncorrelated with T_n (for Gaussian
    /// innovations).
    pub fn remnant(&self, record: usize) -> Option<RemnantEstimate> {
        if self.layout.order == 0 {
            return None;
        }
        let index = self.layout.positions[self.record_index(record)][TIME_CONSTANT_SLOT];
        let noise = remnant_noise(self.eta[index], self.layout.order, self.layout.sample_time).ok()?;
        let sigma = self.innovation_variance().sqrt();
        let k_n = sigma / noise.gain;
        let t_n_s = self.estimate(index);
        let of_time = t_n_s.standard_error.unwrap_or(0.0) * noise.log_gain_slope;
        let relative = of_time * of_time + 1.0 / (2.0 * self.residual_count() as f64);
        let k_n = match self.covariance {
            Some(_) => Estimate::with_variance(k_n, k_n * k_n * relative),
            None => Estimate::fixed(k_n),
        };
        Some(RemnantEstimate {
            order: self.layout.order,
            discretisation: RemnantDiscretisation::ZeroOrderHold,
            t_n_s,
            k_n,
        })
    }

    /// Returns the model of a record as a Box-Jenkins model with three coefficients in B, for prediction, simulation
    /// and the frequency response with its confidence bands. Its covariance `J P J'` is singular, since theta has more
    /// elements than eta. Use the methods of [`GreyBoxFit`] for parameters, criteria, operator and remnant.
    pub fn polynomial_fit(&self, record: usize) -> &Fit {
        &self.fits[self.record_index(record)]
    }

    fn record_index(&self, record: usize) -> usize {
        record.min(self.fits.len() - 1)
    }

    /// Returns the fit that contains the results common to all records.
    fn common_fit(&self) -> &Fit {
        &self.fits[0]
    }

    /// Returns the loss `V = sum eps^2 / n` over the n residuals that count.
    pub fn loss(&self) -> f64 {
        self.common_fit().loss()
    }

    /// Returns the unbiased innovation variance `sum eps^2 / (n - p - s)` with p parameters and s estimated initial
    /// states.
    pub fn innovation_variance(&self) -> f64 {
        self.common_fit().innovation_variance()
    }

    /// Returns the number n of residuals.
    pub fn residual_count(&self) -> usize {
        self.common_fit().residual_count()
    }

    /// Returns the number s of estimated initial states, over all records.
    pub fn state_count(&self) -> usize {
        self.common_fit().state_count()
    }

    /// Returns the number p of parameters that were not fixed.
    pub fn parameter_count(&self) -> usize {
        self.parameters
    }

    /// Returns how the search ended.
    pub fn termination(&self) -> Termination {
        self.common_fit().termination()
    }

    /// Returns the name of the start that led to this minimum.
    pub fn start(&self) -> &str {
        self.common_fit().start()
    }

    /// Returns Akaike's criterion `n ln V + 2 p`.
    pub fn aic(&self) -> f64 {
        self.common_fit().aic()
    }

    /// Returns Schwarz's (Bayesian) criterion `n ln V + p ln n`.
    pub fn bic(&self) -> f64 {
        self.common_fit().bic()
    }
}
