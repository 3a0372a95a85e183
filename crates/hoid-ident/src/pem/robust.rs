//! A loss that outliers cannot dominate.
//!
//! Huber's loss ([`Loss`](crate::Loss)) with the threshold k is minimised by iteratively reweighted least squares (P.
//! J. Huber, *Robust Statistics*, 1981, section 7.8): the weights `w = min(1, k/|r|)` of a search are computed from the
//! residuals r of the previous search, in units of the scale s. Each round lowers the loss. The scale is the median
//! absolute residual of the previous round divided by 0.6745; it is kept constant after [`SCALE_ROUNDS`] rounds, so the
//! rounds converge.
//!
//! A bounded loss bounds the weight of a residual but not the effect of a sample on the regressors. A single wrong
//! sample of e remains in the response of the operator for seconds: its residuals are large although theta is correct,
//! so theta becomes biased (F. R. Hampel, E. M. Ronchetti, P. J. Rousseeuw and W. A. Stahel, *Robust Statistics*, 1986,
//! section 6.3: the influence is the product of the influence of the residual and the influence of position). To bound
//! the influence of position as well, the estimator first limits each sample of e and u by its neighbours
//! ([`crate::faults::limited_record`]); in a normally distributed channel one sample in 16 000 is changed, so the
//! efficiency of the loss is retained.
//!
//! The covariance is `s^2 kappa (psi' psi)^-1`, `kappa = mean(rho'^2) / mean(rho'')^2`, with the unweighted psi (Huber,
//! eq. 7.6.8, for residuals that are independent of the gradient).

use hoid_model::SampleTime;
use hoid_numerics::statistics::upper_median;

use crate::{
    Fit, IdentError, Reason, Termination,
    assembled_fit::{Solution, assemble_fit, fixed_or_bounded_flags},
    criterion::{Criterion, Workspace},
    linalg::{information::inverse_information_of_free, vectors::dot},
    optimize::{Minimum, Objective, free_parameters, minimise},
    pem::{constraints::ConstrainedCriterion, fit_settings::FitSettings},
};

/// Number of rounds in which the scale is estimated; in later rounds it is constant.
const SCALE_ROUNDS: usize = 10;

/// Largest number of rounds of reweighting.
const MAX_ROUNDS: usize = 50;

/// The rounds end when theta changes by less than this number of standard errors.
const CONVERGENCE_TOLERANCE: f64 = 1e-5;

/// State of the reweighting: threshold, scale and number of rounds.
#[derive(Debug)]
struct Reweighting {
    threshold: f64,
    pub scale: f64,
    round: usize,
}

impl Reweighting {
    /// Returns the state of the reweighting before the first round.
    pub fn new(threshold: f64) -> Self {
        Self {
            threshold,
            scale: f64::NAN,
            round: 0,
        }
    }

    /// Returns the square roots of the weights for the next round, from the residuals of each record. `None` if the
    /// scale is zero because half of the residuals are zero.
    pub fn next(&mut self, residuals: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
        // If the scale is estimated in every round, it can alternate with the weights; with a fixed scale each round
        // decreases Huber's loss.
        if self.round < SCALE_ROUNDS {
            self.scale = median_absolute_residual(residuals) / 0.674_489_750_196_081_7;
        }
        self.round += 1;
        let bound = self.threshold * self.scale;
        let weight = |r: &f64| (bound / r.abs()).min(1.0).sqrt();
        (bound > 0.0).then(|| residuals.iter().map(|r| r.iter().map(weight).collect()).collect())
    }

    /// Returns the factor `s^2 kappa` of `(psi' psi)^-1` in the covariance, with n - p degrees of freedom.
    pub fn variance(&self, residuals: &[Vec<f64>], unknowns: usize) -> f64 {
        let (mut n, mut inside, mut square) = (0_usize, 0_usize, 0.0);
        for r in residuals.iter().flatten().map(|r| r / self.scale) {
            n += 1;
            inside += usize::from(r.abs() <= self.threshold);
            square += r.clamp(-self.threshold, self.threshold).powi(2);
        }
        let (n, inside) = (n as f64, inside as f64);
        self.scale * self.scale * (square / (n - unknowns as f64)) / (inside / n).powi(2)
    }
}

/// Runs rounds of reweighted searches, starting from a least-squares minimum; `start` is the label of the start that
/// led to this minimum.
///
/// # Errors
/// [`IdentError::NoFiniteLoss`] if a search fails, [`IdentError::SingularInformation`] if the data do not determine all
/// parameters.
pub(crate) fn fit(
    settings: &FitSettings,
    threshold: f64,
    constrained: &ConstrainedCriterion<'_, '_>,
    sample_time: SampleTime,
    mut minimum: Minimum,
    start: String,
    workspace: &mut Workspace,
) -> Result<Fit, IdentError> {
    let criterion = constrained.criterion;
    let mut rounds = Reweighting::new(threshold);
    let mut residuals = all_residuals(criterion, &minimum.theta, workspace);
    let (mut iterations, mut settled) = (minimum.termination.iterations, false);
    for _ in 0..MAX_ROUNDS {
        let Some(weights) = rounds.next(&residuals) else { break };
        let weighted = Criterion {
            weights: Some(&weights),
            ..criterion.clone()
        };
        let objective = ConstrainedCriterion {
            criterion: &weighted,
            limits: constrained.limits.clone(),
            prior: constrained.prior.clone(),
            stable: constrained.stable,
        };
        let next = minimise(&objective, minimum.theta.clone(), &settings.search, None, workspace)
            .ok_or(IdentError::NoFiniteLoss)?;
        iterations += next.termination.iterations;
        // step' G step/(S/n) is the squared step length in standard errors.
        let step: Vec<f64> = next.theta.iter().zip(&minimum.theta).map(|(a, b)| a - b).collect();
        let p = step.len();
        let curvature: f64 = (0..p)
            .map(|i| step[i] * dot(&next.linearisation.gram[i * p..(i + 1) * p], &step))
            .sum();
        settled = curvature * criterion.residual_count() as f64
            <= CONVERGENCE_TOLERANCE * CONVERGENCE_TOLERANCE * next.linearisation.sum_of_squares;
        minimum = next;
        residuals = all_residuals(&weighted, &minimum.theta, workspace);
        if settled {
            break;
        }
    }
    let reason = match minimum.termination.reason {
        Reason::SmallDecrease if !settled => Reason::IterationLimit,
        reason => reason,
    };
    let free = free_parameters(constrained, &minimum.theta, &minimum.linearisation.descent);
    let names = criterion.orders.parameter_names();
    // The covariance uses the unweighted psi (Huber 1981, eq. 7.6.8); the weights enter through `variance`.
    let plain = constrained.linearise(&minimum.theta, workspace);
    let inverse = inverse_information_of_free(&plain.gram, &free, &names)?;
    let variance = rounds.variance(&residuals, names.len() + criterion.state_count());
    let sum_of_squares = residuals.iter().map(|r| dot(r, r)).sum();
    let solution = Solution {
        is_fixed_or_bounded: fixed_or_bounded_flags(&free, names.len()),
        theta: minimum.theta,
        sum_of_squares,
        termination: Termination { reason, iterations },
        start,
    };
    let fit = assemble_fit(criterion, settings.structure, sample_time, solution)?;
    Ok(Fit {
        innovation_variance: rounds.scale * rounds.scale,
        robust: true,
        ..fit.with_covariance(variance, &inverse)
    })
}

fn all_residuals(criterion: &Criterion<'_>, theta: &[f64], workspace: &mut Workspace) -> Vec<Vec<f64>> {
    (0..criterion.data.len())
        .map(|record| criterion.residuals_of(theta, record, workspace))
        .collect()
}

fn median_absolute_residual(residuals: &[Vec<f64>]) -> f64 {
    let mut sizes: Vec<f64> = residuals.iter().flatten().map(|r| r.abs()).collect();
    upper_median(&mut sizes).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        Channel, Record, Structure,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use super::*;
    use crate::{Estimator, Loss};

    #[test]
    fn weights_decrease_only_beyond_the_threshold() {
        let mut rounds = Reweighting::new(1.345);
        let residuals = vec![vec![0.5, -1.0, 1.5], vec![100.0, -0.2]];
        let weights = rounds.next(&residuals).unwrap();
        assert!((rounds.scale - 1.0 / 0.674_489_750_196_081_7).abs() < 1e-12);
        assert_eq!(weights[0], [1.0, 1.0, 1.0]);
        assert!((weights[1][0].powi(2) - 1.345 * rounds.scale / 100.0).abs() < 1e-12);
        assert!(Reweighting::new(1.345).next(&[vec![0.0; 5]]).is_none());
    }

    #[test]
    fn gaussian_residuals_lose_five_per_cent_of_efficiency() {
        // Sums of twelve uniform numbers are normal to within 1 %.
        let mut state = 3_u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let r: Vec<f64> = (0..200_000)
            .map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0)
            .collect();
        let mut rounds = Reweighting::new(1.345);
        rounds.next(std::slice::from_ref(&r));
        let variance = rounds.variance(&[r], 0);
        assert!((variance - 1.0 / 0.95).abs() < 0.02, "{variance}");
    }

    fn simulated_record(replication: u64) -> Record {
        let streams = RunSeed {
            seed: 4711,
            replication,
            ..RunSeed::default()
        };
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        simulator.run(streams, false).unwrap()
    }

    fn box_jenkins(loss: Loss) -> Estimator {
        let orders = Structure::BoxJenkins.operator_orders(29);
        Estimator {
            loss,
            ..Estimator::new(Structure::BoxJenkins, orders)
        }
    }

    const HUBER: Loss = Loss::Huber { threshold: 1.345 };

    fn with_sample(record: &Record, of_input: bool, value: f64) -> Record {
        let (mut e, mut u) = (record.input().to_vec(), record.output().to_vec());
        (if of_input { &mut e } else { &mut u })[4000] = value;
        let u = Channel::new("u", "", u);
        Record::new(record.sample_time(), Channel::new("e", "", e), u).unwrap()
    }

    #[test]
    fn one_outlier_moves_estimates_less_than_half_an_error() {
        let clean = simulated_record(1);
        let fit = |record: Record| box_jenkins(HUBER).fit(&[record]).unwrap().operator().unwrap();
        let before = fit(clean.clone());
        for of_input in [true, false] {
            // The influence is bounded for any size of the error.
            for value in [3.0, 30.0, 3e4] {
                let after = fit(with_sample(&clean, of_input, value));
                for ((name, _, a), (_, _, b)) in before.rows().iter().zip(after.rows()) {
                    let off = (a.value - b.value).abs();
                    let most = 0.5 * a.standard_error.unwrap_or(1e-9);
                    assert!(off < most, "e {of_input}, {value}: {name} {} and {}", a.value, b.value);
                }
            }
        }
        let plain = box_jenkins(Loss::Quadratic)
            .fit(&[with_sample(&clean, true, 30.0)])
            .unwrap();
        let off = plain.operator().unwrap().t_l_s.value - before.t_l_s.value;
        assert!(off.abs() > 4.0 * before.t_l_s.standard_error.unwrap(), "{off}");
    }

    #[test]
    fn clean_records_lose_five_per_cent_of_efficiency() {
        // Least squares is efficient, so var(robust) = var(squares) + var(difference) (J. A. Hausman, Econometrica 46
        // (1978) 1251-1271).
        let (mut squares, mut count) = (0.0, 0.0);
        for replication in 10..26 {
            let record = [simulated_record(replication)];
            let plain = box_jenkins(Loss::Quadratic).fit(&record).unwrap();
            let robust = box_jenkins(HUBER).fit(&record).unwrap();
            for ((_, a), (_, b)) in plain.parameters().into_iter().zip(robust.parameters()) {
                squares += ((a.value - b.value) / a.standard_error.unwrap()).powi(2);
                count += 1.0;
            }
        }
        let efficiency = 1.0 / (1.0 + squares / count);
        // 16 runs with about three independent directions each: the standard error is 0.011.
        assert!((efficiency - 0.95).abs() < 0.033, "{efficiency}");
    }

    #[test]
    fn data_that_cannot_be_limited_are_fitted_unchanged() {
        // The neighbours of a sample carry no information about a constant error, and there is no response to find.
        let clean = simulated_record(2);
        let e = Channel::new("e", "", vec![1.0; clean.len()]);
        let u = Channel::new("u", "", clean.output().to_vec());
        let record = [Record::new(clean.sample_time(), e, u).unwrap()];
        let (plain, robust) = (
            box_jenkins(Loss::Quadratic).fit(&record),
            box_jenkins(HUBER).fit(&record),
        );
        assert_eq!(plain.is_err(), robust.is_err(), "{plain:?} {robust:?}");
    }
}
