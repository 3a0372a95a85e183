//! Gain, lead and delay of `M = K (T_L s + 1) e^{-s tau}` from a describing function.
//!
//! The criterion is `sum_k w_k |M(j omega_k)/H_k - 1|^2`. Errors are relative to the describing function, since
//! otherwise its largest values would dominate. For a given tau the model is linear in K and K T_L, so the criterion
//! reduces to a function of tau (G. H. Golub and V. Pereyra, SIAM J. Numerical Analysis 10 (1973) 413-432); it is
//! scanned over the range of delays, and its lowest point is refined. Without a lead, and with a single integrator as
//! controlled element, this is the crossover model of McRuer and Jex (1967). The delay includes all phase lag for which
//! the model has no other term, such as the lag of the neuromuscular system.
//!
//! Standard errors come from the jackknife over runs, with fixed weights (`ratio.rs`).

use std::f64::consts::TAU;

use hoid_model::{Complex64, uncertainty::Estimate};

use super::{DescribingFunction, excitation::refuse, ratio::jackknife};
use crate::IdentError;

/// Weights of the lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LineWeights {
    /// `w_k` is the squared coherence; 1 for one run.
    #[default]
    Coherence,
    /// `w_k = |H_k|^2/sigma_k^2`, which gives the smallest variance if the model is true. These weights need several
    /// runs.
    Variance,
    /// Equal weights.
    Uniform,
}

/// Options of [`DescribingFunction::fit_gain_lead_delay`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainLeadDelayOptions {
    /// True if T_L is estimated; if false, T_L is 0. Default true.
    pub lead: bool,
    /// Weights of the lines. Default [`LineWeights::Coherence`].
    pub weights: LineWeights,
    /// Smallest and largest delay tau, s. Default 0 to 1.
    pub delay_range_s: (f64, f64),
}

impl Default for GainLeadDelayOptions {
    fn default() -> Self {
        Self {
            lead: true,
            weights: LineWeights::default(),
            delay_range_s: (0.0, 1.0),
        }
    }
}

/// Fitted gain, lead and delay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainLeadDelay {
    /// Gain K, unit of u per unit of e.
    pub gain: Estimate,
    /// Lead time constant T_L, s; 0 if no lead is fitted.
    pub lead_s: Estimate,
    /// Delay tau, s.
    pub delay_s: Estimate,
    /// Weighted root mean square of `|M/H - 1|`.
    pub misfit: f64,
}

impl GainLeadDelay {
    /// Returns M at a frequency in rad/s.
    pub fn response(&self, omega_rad_s: f64) -> Complex64 {
        let lead = Complex64::new(1.0, omega_rad_s * self.lead_s.value);
        self.gain.value * lead * Complex64::from_polar(1.0, -omega_rad_s * self.delay_s.value)
    }
}

/// Number of steps of the delay scan per turn of the phase at the highest line.
const STEPS_PER_TURN: f64 = 40.0;
/// Number of golden section steps, each of which multiplies the bracket by 0.618: from a fortieth of a turn down to the
/// rounding errors of the criterion.
const REFINEMENT_STEPS: usize = 60;
const MAX_STEPS: f64 = 1e5;

/// The best K and K T_L for one delay, and the criterion for them.
#[derive(Clone, Copy)]
struct Solution {
    gain: f64,
    gain_lead: f64,
    delay_s: f64,
    sum: f64,
}

impl DescribingFunction {
    /// Fits the gain, the lead and the delay by weighted least squares.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for an invalid range of delays, for variance weights with one run, or if there are too
    /// few lines for the number of parameters.
    pub fn fit_gain_lead_delay(&self, options: &GainLeadDelayOptions) -> Result<GainLeadDelay, IdentError> {
        let (shortest, longest) = options.delay_range_s;
        let omega: Vec<f64> = self.lines.iter().map(|l| l.omega_rad_s).collect();
        let highest = omega.iter().copied().fold(0.0, f64::max);
        let steps = (longest - shortest) * highest / TAU * STEPS_PER_TURN;
        if !(shortest < longest && steps < MAX_STEPS && shortest.is_finite()) {
            return refuse(
                "the range of delays in s",
                format!("{shortest} to {longest}"),
                format!(
                    "two finite numbers in ascending order, at most {:.0} s apart",
                    MAX_STEPS * TAU / (STEPS_PER_TURN * highest)
                ),
            );
        }
        // Each line gives two real equations.
        let needed = if options.lead { 2 } else { 1 };
        if omega.len() < needed {
            return refuse(
                "the lines of a fit of gain, lead and delay",
                omega.len(),
                format!("{needed} or more"),
            );
        }
        let weights = self.weights(options.weights)?;
        let solve = |response: &[Complex64]| {
            let problem = LeastSquaresProblem {
                omega: &omega,
                response,
                weights: &weights,
                lead: options.lead,
            };
            problem.best_solution(options.delay_range_s, steps.ceil().max(2.0) as usize)
        };
        let response: Vec<Complex64> = self.lines.iter().map(|l| l.response).collect();
        let best = solve(&response);
        let runs = if self.runs.len() > 1 { self.runs.len() } else { 0 };
        let without: Vec<Solution> = (0..runs)
            .map(|i| solve(&self.lines.iter().map(|l| l.ratio.value(Some(i))).collect::<Vec<_>>()))
            .collect();
        let estimate = |get: fn(&Solution) -> f64| {
            let others: Vec<Option<f64>> = without.iter().map(|s| Some(get(s))).collect();
            jackknife(get(&best), &others)
        };
        Ok(GainLeadDelay {
            gain: estimate(|s| s.gain),
            lead_s: if options.lead {
                estimate(|s| s.gain_lead / s.gain)
            } else {
                Estimate::fixed(0.0)
            },
            delay_s: estimate(|s| s.delay_s),
            misfit: (best.sum / weights.iter().sum::<f64>()).sqrt(),
        })
    }

    fn weights(&self, kind: LineWeights) -> Result<Vec<f64>, IdentError> {
        match kind {
            LineWeights::Uniform => Ok(vec![1.0; self.lines.len()]),
            LineWeights::Coherence => Ok(self.lines.iter().map(|l| l.coherence.unwrap_or(1.0)).collect()),
            LineWeights::Variance => {
                let weight = |l: &super::Line| l.standard_error.map(|s| l.response.norm_sqr() / (s * s));
                let weights: Option<Vec<f64>> = self.lines.iter().map(weight).collect();
                match weights.filter(|w| w.iter().all(|v| v.is_finite())) {
                    Some(weights) => Ok(weights),
                    None => refuse(
                        "the weights of the lines",
                        "variance, although not every line has a standard error above zero",
                        "several runs that differ, or other weights",
                    ),
                }
            }
        }
    }
}

struct LeastSquaresProblem<'a> {
    omega: &'a [f64],
    response: &'a [Complex64],
    weights: &'a [f64],
    lead: bool,
}

impl LeastSquaresProblem<'_> {
    /// Returns the best K and K T_L for a delay, from the normal equations of two unknowns with the columns `c` and
    /// `j omega c`, where `c = e^{-j omega tau}/H`. Since the product of the two columns is imaginary, they are
    /// orthogonal.
    fn at(&self, delay_s: f64) -> Solution {
        let lines = || self.omega.iter().zip(self.response).zip(self.weights);
        let column = |w: f64, h: Complex64| Complex64::from_polar(1.0, -w * delay_s) / h;
        let (mut gram, mut gram_lead, mut right, mut right_lead) = (0.0, 0.0, 0.0, 0.0);
        for ((&w, &h), &weight) in lines() {
            let c = column(w, h);
            gram += weight * c.norm_sqr();
            gram_lead += weight * w * w * c.norm_sqr();
            right += weight * c.re;
            // The right-hand side of the lead is Re(j omega c).
            right_lead -= weight * w * c.im;
        }
        let gain = right / gram;
        let gain_lead = if self.lead { right_lead / gram_lead } else { 0.0 };
        let sum = lines()
            .map(|((&w, &h), &weight)| weight * (Complex64::new(gain, gain_lead * w) * column(w, h) - 1.0).norm_sqr())
            .sum();
        Solution {
            gain,
            gain_lead,
            delay_s,
            sum,
        }
    }

    /// Returns the solution at the best delay of a scan, refined by golden section search.
    fn best_solution(&self, (shortest, longest): (f64, f64), steps: usize) -> Solution {
        let step = (longest - shortest) / steps as f64;
        let mut best = self.at(shortest);
        for i in 1..=steps {
            let next = self.at(shortest + i as f64 * step);
            if next.sum < best.sum {
                best = next;
            }
        }
        let (mut low, mut high) = ((best.delay_s - step).max(shortest), (best.delay_s + step).min(longest));
        let part = 0.5 * (5.0_f64.sqrt() - 1.0);
        for _ in 0..REFINEMENT_STEPS {
            let (a, b) = (high - part * (high - low), low + part * (high - low));
            let (at_a, at_b) = (self.at(a), self.at(b));
            for candidate in [at_a, at_b] {
                if candidate.sum < best.sum {
                    best = candidate;
                }
            }
            if at_a.sum <= at_b.sum {
                high = b;
            } else {
                low = a;
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_gain_lead_and_delay_are_recovered() {
        let omega: Vec<f64> = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0].map(|n| n * TAU / 20.0).to_vec();
        let weights = [1.0, 0.9, 0.8, 0.7, 0.4, 0.3, 0.2];
        for (gain, lead, delay) in [(6.9, 0.31, 0.28), (-2.0, 0.0, 0.05), (1.5, -0.4, 0.6)] {
            let model = GainLeadDelay {
                gain: Estimate::fixed(gain),
                lead_s: Estimate::fixed(lead),
                delay_s: Estimate::fixed(delay),
                misfit: 0.0,
            };
            let response: Vec<Complex64> = omega.iter().map(|w| model.response(*w)).collect();
            let problem = LeastSquaresProblem {
                omega: &omega,
                response: &response,
                weights: &weights,
                lead: true,
            };
            let found = problem.best_solution((0.0, 1.0), 40);
            // The criterion is flat to rounding within 1e-8 of its lowest point.
            assert!((found.delay_s - delay).abs() < 1e-7, "{}", found.delay_s);
            assert!((found.gain - gain).abs() < 1e-6 && (found.gain_lead / found.gain - lead).abs() < 1e-6);
        }
    }
}
