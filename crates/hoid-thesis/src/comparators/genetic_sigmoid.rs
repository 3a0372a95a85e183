//! Maximum-likelihood estimate, by a genetic search, of an operator whose gains follow a sigmoid (P. M. T. Zaal, D. M.
//! Pool, Q. P. Chu, M. M. van Paassen, M. Mulder and J. A. Mulder, *Modeling human multimodal perception and control
//! using genetic maximum likelihood estimation*, J. Guidance, Control, and Dynamics 32 (2009) 1089-1099; with a
//! sigmoid: P. M. T. Zaal and B. T. Sweet, AIAA 2011-6474).
//!
//! The likelihood has many maxima over t_M, G and the delay. The genetic search needs no start: the first population
//! consists of parameter vectors drawn from wide ranges. Each generation keeps the best members and replaces the others
//! by children of two parents, each of which is the best of three randomly drawn members (a *tournament*). Every gene
//! of a child is drawn from a range that extends half of the parents' distance beyond both parents (*blend crossover*,
//! L. J. Eshelman and J. D. Schaffer 1993), and with a given probability a normal deviate is added. The search
//! minimises the mean square of the one-step prediction error,
//!
//! `eps(k) = v(k) + d1 v(k-1)`, `v = u - K_e(t) y_0 - K_e_dot(t) y_1`, `K_e_dot = K_e T_L`,
//!
//! where y_0 and y_1 are the unit responses of [`super::unit_responses`], K_e and T_L follow the sigmoid
//! `1/(1 + e^(-G (t - t_M)))`, and d1 is the least-squares value for each v. The best member of the last generation is
//! the start of [`SigmoidChange`], which continues by Gauss-Newton steps to the maximum of the likelihood, as in the
//! source.

use std::f64::consts::TAU;

use hoid_ident::{SigmoidChange, SigmoidFit, settings, settings::Bounds};
use hoid_model::OperatorParameters;
use hoid_sim::RunSeed;

use super::{
    comparator::{Comparator, ComparatorDescription, Task, TrackingResult},
    unit_responses::unit_responses,
};
use crate::ThesisError;

const NAME: &str = "genetic-sigmoid";
/// Ranges of the genes: initial and final K_e, initial and final T_L, t_M, ln G, omega_nm, ln zeta_nm, tau_e. t_M lies
/// in the middle eight tenths of the record.
const RANGES: [(f64, f64); 9] = [
    (0.01, 0.3),
    (0.01, 0.3),
    (0.0, 3.0),
    (0.0, 3.0),
    (0.0, 1.0),
    (-2.0, 4.6),
    (4.0, 20.0),
    (-3.0, 0.7),
    (0.1, 0.5),
];
/// Number of genes.
const N: usize = RANGES.len();
/// Index of the gene for t_M.
const MIDPOINT_INDEX: usize = 4;
/// Number of members that are kept unchanged.
const ELITE_COUNT: usize = 2;
/// Number of members drawn in the tournament for each parent.
const TOURNAMENT_SIZE: usize = 3;
/// Distance beyond the parents within which a gene may lie, as a fraction of the distance between the parents.
const BLEND_EXTENSION: f64 = 0.5;

settings! {
    /// Options of the genetic search.
    pub struct GeneticSigmoid {
        /// Members of the population
        #[setting(bounds(Bounds::AtLeast(6.0)))]
        pub population: usize = 60,
        /// Generations
        #[setting(bounds(Bounds::AtLeast(1.0)))]
        pub generations: usize = 40,
        /// Mutation probability of a gene
        #[setting(bounds(Bounds::Between(0.0, 1.0)))]
        pub mutation: f64 = 0.15,
        /// Seed of the search
        pub seed: usize = 1,
    }
}

/// A member of the population: its genes, between 0 and 1, and its cost.
#[derive(Debug, Clone, Copy)]
struct Member {
    genes: [f64; N],
    cost: f64,
}

impl GeneticSigmoid {
    /// Returns the member of the last generation with the lowest cost.
    fn search(&self, cost: &dyn Fn(&[f64; N]) -> f64) -> Member {
        let member = |genes: [f64; N]| {
            let found = cost(&genes);
            // A member without a finite cost is never preferred.
            let cost = if found.is_finite() { found } else { f64::INFINITY };
            Member { genes, cost }
        };
        let drawn = |generation: usize, n: usize| {
            let seed = RunSeed {
                seed: self.seed as u64,
                cell: generation as u64,
                replication: 0,
            };
            seed.uniform_numbers(n).into_iter()
        };
        let mut numbers = drawn(0, self.population * N);
        let mut next = || numbers.next().unwrap_or_default();
        let mut all: Vec<Member> = (0..self.population)
            .map(|_| member(std::array::from_fn(|_| next())))
            .collect();
        for generation in 1..=self.generations {
            all.sort_by(|a, b| a.cost.total_cmp(&b.cost));
            let mut numbers = drawn(generation, self.population * (2 * TOURNAMENT_SIZE + 4 * N));
            let mut next = || numbers.next().unwrap_or_default();
            // The population contracts around the optimum, and the mutations become smaller accordingly.
            let size = 0.3 * (1.0 - generation as f64 / (self.generations + 1) as f64);
            let mut children = all[..ELITE_COUNT.min(all.len())].to_vec();
            while children.len() < all.len() {
                // The members are sorted, so the smallest index denotes the best member.
                let mut parent = || {
                    let places = (0..TOURNAMENT_SIZE).map(|_| (next() * all.len() as f64) as usize);
                    all[places.min().unwrap_or(0).min(all.len() - 1)]
                };
                let (a, b) = (parent(), parent());
                let genes = std::array::from_fn(|i| {
                    let (low, high) = (a.genes[i].min(b.genes[i]), a.genes[i].max(b.genes[i]));
                    let beyond = BLEND_EXTENSION * (high - low);
                    let mut gene = low - beyond + next() * (high - low + 2.0 * beyond);
                    let (moved, one, two) = (next(), next(), next());
                    if moved < self.mutation {
                        // A normal deviate (G. E. P. Box and M. E. Muller 1958).
                        gene += size * (-2.0 * (1.0 - one).ln()).sqrt() * (TAU * two).cos();
                    }
                    gene.clamp(0.0, 1.0)
                });
                children.push(member(genes));
            }
            all = children;
        }
        all.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        all[0]
    }

    /// Converts genes to parameters: initial and final K_e, initial and final T_L, t_M, G, omega_nm, zeta_nm, tau_e.
    fn parameters(genes: &[f64; N], span_s: (f64, f64)) -> [f64; N] {
        let length = span_s.1 - span_s.0;
        std::array::from_fn(|i| {
            let (low, high) = RANGES[i];
            let value = low + genes[i] * (high - low);
            match i {
                MIDPOINT_INDEX => span_s.0 + length * (0.1 + 0.8 * genes[i]),
                5 | 7 => value.exp(),
                _ => value,
            }
        })
    }

    /// Returns the mean square of eps, and d1.
    fn criterion(task: &Task<'_>, e: &[f64], u: &[f64], of: &[f64; N]) -> (f64, f64) {
        let [k_1, k_2, t_1, t_2, midpoint_s, rate, omega, zeta, tau_s] = *of;
        let ts = task.record.sample_time();
        let nk = (tau_s / ts.s()).round() as usize + 1;
        let [y_0, y_1] = unit_responses(e, omega, zeta, nk, ts);
        let [mut squares, mut products, mut before, mut last] = [0.0; 4];
        for k in nk..e.len() {
            let share = 1.0 / (1.0 + (-rate * (task.record.time_s(k) - midpoint_s)).exp());
            let k_e = k_1 + (k_2 - k_1) * share;
            let t_l = t_1 + (t_2 - t_1) * share;
            let v = u[k] - k_e * (y_0[k] + t_l * y_1[k]);
            squares += v * v;
            products += v * last;
            before += last * last;
            last = v;
        }
        let d1 = if before > 0.0 { -products / before } else { 0.0 };
        // This is the sum of (v + d1 v')^2 for the least-squares d1.
        let loss = (squares + d1 * products) / (e.len() - nk) as f64;
        (loss, d1.clamp(-0.999, 0.999))
    }

    /// Returns the start found by the genetic search, in the order of [`SigmoidChange::names`].
    fn genetic_start(&self, task: &Task<'_>, e: &[f64], u: &[f64]) -> Vec<f64> {
        let span_s = (task.record.time_s(0), task.record.time_s(e.len() - 1));
        let cost = |genes: &[f64; N]| Self::criterion(task, e, u, &Self::parameters(genes, span_s)).0;
        let best = Self::parameters(&self.search(&cost).genes, span_s);
        let (_, d1) = Self::criterion(task, e, u, &best);
        best.into_iter().chain([d1]).collect()
    }

    fn fit(&self, task: &Task<'_>) -> Result<SigmoidFit, ThesisError> {
        let (e, u) = task.signals(NAME, 1000)?;
        let estimator = SigmoidChange {
            nd: Some(1),
            start: Some(self.genetic_start(task, e, u)),
            likelihood_intervals: false,
            ..SigmoidChange::default()
        };
        Ok(estimator.fit(std::slice::from_ref(task.record))?)
    }
}

/// Returns the operator of a fit at a time.
fn operator_at(fit: &SigmoidFit, time_s: f64) -> Option<OperatorParameters> {
    if !fit.has_change() {
        return Some(fit.constant_operator().operator_estimate()?.parameters());
    }
    let gains = fit.gains_at(time_s);
    let constant = |name: &str| fit.last_operator().get(name).map(|estimate| estimate.value);
    Some(OperatorParameters {
        k_e: gains.get("K_e")?.value,
        t_l_s: gains.get("T_L")?.value,
        omega_nm_rad_s: constant("omega_nm")?,
        zeta_nm: constant("zeta_nm")?,
        tau_e_s: constant("tau_e")?,
    })
}

impl Comparator for GeneticSigmoid {
    fn description(&self) -> ComparatorDescription {
        ComparatorDescription {
            name: NAME,
            help: "maximum-likelihood fit of gains that follow a sigmoid, by a genetic search",
            source: "Zaal et al. 2009; Zaal and Sweet 2011",
            extra_information: "the assumption of a single sigmoid change, and the whole record (but not the delay)",
        }
    }

    fn track(&self, task: &Task<'_>) -> Result<TrackingResult, ThesisError> {
        let fit = self.fit(task)?;
        let mut found = TrackingResult::default();
        for at in task.requested_samples {
            found.push(task, operator_at(&fit, task.record.time_s(*at)))?;
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::Condition;

    use super::{super::tests::*, *};

    #[test]
    fn search_finds_the_global_minimum() {
        // Rastrigin's function of three genes, independent of the other genes: its minima are a tenth apart, and the
        // lowest minimum is at 0.3, 0.5, 0.7.
        let cost = |genes: &[f64; N]| {
            let along = |x: f64| 100.0 * x * x + 0.3 * (1.0 - (TAU * 10.0 * x).cos());
            along(genes[0] - 0.3) + along(genes[1] - 0.5) + along(genes[2] - 0.7)
        };
        for seed in 1..=4 {
            let method = GeneticSigmoid {
                seed,
                ..GeneticSigmoid::default()
            };
            let best = method.search(&cost);
            let off = [0.3, 0.5, 0.7].iter().zip(best.genes).map(|(x, y)| (x - y).abs());
            assert!(off.fold(0.0, f64::max) < 0.05, "{seed}: {best:?}");
        }
        // A member whose cost is NaN is never the best.
        let best = GeneticSigmoid::default().search(&|genes| if genes[0] < 0.9 { f64::NAN } else { 1.0 });
        assert!(best.genes[0] >= 0.9);
    }

    /// At the true parameters, the criterion is the innovation variance of an AR(1) process with d1 = -e^(-Ts/Tn).
    #[test]
    fn criterion_at_the_truth_is_the_remnant_variance() {
        let run = Run::of(Condition::C4, 1, 0.1);
        let task = run.task();
        let truth = [0.09, 0.07, 0.4, 1.2, 40.96, 100.0, 11.25, 0.35, 0.28];
        let (loss, d1) = GeneticSigmoid::criterion(&task, run.record.input(), run.record.output(), &truth);
        // The standard error of d1 is 0.006. The standard error of the mean square is 1.6 %; its values in the two
        // states are 1.37e-4 and 4.6e-4. The transient at the start is additional.
        assert!((d1 + 0.8465).abs() < 0.03, "{d1}");
        assert!((1.3e-4..4.6e-4).contains(&loss), "{loss}");
        let mut other = truth;
        other[6] = 8.0;
        assert!(GeneticSigmoid::criterion(&task, run.record.input(), run.record.output(), &other).0 > loss);
    }

    /// From the genetic start, the search ends in the same minimum as from the estimator's own starts.
    #[test]
    fn genetic_start_reaches_the_same_minimum() {
        let run = Run::of(Condition::C4, 1, 0.1);
        let genetic = GeneticSigmoid::default().fit(&run.task()).unwrap();
        let own = SigmoidChange {
            nd: Some(1),
            likelihood_intervals: false,
            ..SigmoidChange::default()
        };
        let own = own.fit(std::slice::from_ref(&run.record)).unwrap();
        assert!(genetic.has_change() && own.has_change());
        assert!(
            genetic.loss() < own.loss() * (1.0 + 1e-4),
            "{} {}",
            genetic.loss(),
            own.loss()
        );
    }

    #[test]
    fn zero_input_is_refused() {
        let silent = test_record(&[0.0; 4000], &[1.0; 4000]);
        assert!(
            GeneticSigmoid::default()
                .track(&test_task(&silent, &[3999], &[1.0]))
                .is_err()
        );
    }
}
