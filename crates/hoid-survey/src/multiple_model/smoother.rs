//! The two-sided estimate for a recorded run: the operator at each sample, from all samples of the run.
//!
//! After the whitening filter the model of [`crate::kernel::multiple_model`] has no dynamics:
//! `y(t) = K_e psi_1 + K_e_dot psi_2 + eps`, with signals that depend only on the record. The bank of hypotheses can
//! therefore process the record from either end. At time t the forward run gives
//! `p(eta_t | y_1..y_t) = sum_f P(f) N(m_f, P_f)`, where f is the time of the last change, and the backward run gives
//! `p(y_{t+1}..y_N | eta_t)`, proportional to `sum_b P(b) N(m_b, P_b)`, where b is the time of the next change. The
//! product is the two-filter smoother (D. C. Fraser and J. E. Potter, *IEEE Transactions on Automatic Control* 14
//! (1969) 387-390), here for two mixtures (G. Kitagawa, *Annals of the Institute of Statistical Mathematics* 46 (1994)
//! 605-623): with `S = P_f + P_b`,
//!
//! - `m = m_f + P_f S^-1 (m_b - m_f)`, `P = P_f - P_f S^-1 P_f`;
//! - `P(f, b) ~ P(f) P(b) N(m_b - m_f; 0, S)`: a past and a future that contradict each other are not combined.
//!
//! Each hypothesis has an innovation variance s2 from n residuals; the same equations hold for `ln s2`, whose variance
//! is 2/n. The mean and the covariance of the mixture of pairs are reported.
//!
//! The backward run starts from the estimate at the end of the forward run, with [`START_COVARIANCE_FACTOR`] times the
//! covariance of the start fit. The forward run starts with the same covariance, so the start fit is counted twice only
//! with this small weight. The filters are linearised about omega_nm and zeta_nm at the end of the causal estimate.
//!
//! Offline, more hypotheses can be computed: a hypothesis is born every 0.08 s, and the capacity is 64.

use crate::kernel::multiple_model::{
    bank::Bank,
    hypothesis::Hypothesis,
    prior::{ChangePrior, PARAMETER_COUNT},
    response::{Response, Signals},
    signal_ring::DelayedSignals,
};
use hoid_model::Record;
use hoid_numerics::{cholesky, products::dot};

use hoid_ident::IdentError;
use hoid_track::building::{CausalRun, ReportedModel, Setup, StartState, TwoSidedEstimate};

use super::prior::{change_prior, first_hypothesis, out_of_range_error};

/// Capacity for hypotheses; `BIRTH_INTERVAL_S` is the time between two births, s.
const MAX_HYPOTHESES: usize = 64;
const BIRTH_INTERVAL_S: f64 = 0.08;
/// Factor by which the covariance of the start fit is multiplied at the start of both runs.
const START_COVARIANCE_FACTOR: f64 = 100.0;
/// Time after which the effect of starting the filters at rest is negligible, in time constants of the neuromuscular
/// system.
const SETTLING_TIME_CONSTANTS: f64 = 6.0;
/// Smallest probability of a hypothesis that is combined with others, and smallest weight of a pair relative to the
/// largest weight.
const MIN_RELATIVE_PROBABILITY: f64 = 1e-3;
/// Limit of the signals beyond which their products would overflow.
const OVERFLOW_LIMIT: f64 = 1e60;

/// A forward or backward hypothesis in the form in which it is combined with others.
#[derive(Debug, Clone, Copy)]
struct OneSidedHypothesis {
    log_weight: f64,
    eta: [f64; PARAMETER_COUNT],
    covariance: [[f64; PARAMETER_COUNT]; PARAMETER_COUNT],
    /// Half the logarithm of the determinant of the joint covariance of eta and the log innovation variance.
    size: f64,
    /// Logarithm of the innovation variance, and the variance of this logarithm.
    level: [f64; 2],
}

impl OneSidedHypothesis {
    fn of(h: &Hypothesis) -> Self {
        let level = [
            h.innovation_variance.variance().max(f64::MIN_POSITIVE).ln(),
            2.0 / h.innovation_variance.residual_count().max(1.0),
        ];
        Self {
            log_weight: h.probability.ln(),
            eta: h.eta,
            covariance: h.covariance.matrix(),
            size: 0.5 * (h.covariance.determinant() * level[1]).ln(),
            level,
        }
    }
}

/// Mean, covariance and innovation variance of a mixture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mixture {
    pub eta: [f64; PARAMETER_COUNT],
    pub covariance: [[f64; PARAMETER_COUNT]; PARAMETER_COUNT],
    pub variance: f64,
}

/// The output and the signals after the whitening filter; `None` if they are unknown.
type WhitenedSample = Option<(f64, Signals)>;

/// Returns the two-sided estimates for the rows of a causal run.
///
/// # Errors
/// [`IdentError::BadStart`] if the start cannot be used.
pub(super) fn two_sided_estimates(
    alarm: f64,
    record: &Record,
    causal: &CausalRun,
    from: &StartState,
) -> Result<Vec<TwoSidedEstimate>, IdentError> {
    let about = causal.last.map_or([from.values[2], from.values[3]], |o| {
        [o.omega_nm_rad_s.value, o.zeta_nm.value]
    });
    let joined = pair_mixtures(record, alarm, &causal.setup, causal.largest, from, about, &causal.rows)?;
    let mut reported = ReportedModel::new(from, causal.setup.orders.nk, record.sample_time());
    let p = reported.theta().len();
    let mut row = |of: &Mixture| {
        let mut covariance = vec![0.0; p * p];
        reported.set_operator(of.eta);
        reported.covariance(&of.covariance, &mut covariance);
        TwoSidedEstimate {
            theta: reported.theta().to_vec(),
            covariance,
            operator: reported.operator(of.eta, &of.covariance, lead_time(of)),
            innovation_variance: of.variance,
        }
    };
    Ok(joined.iter().map(&mut row).collect())
}

/// Returns the mixtures of pairs at the requested samples; `rows` must be in ascending order.
fn pair_mixtures(
    record: &Record,
    alarm: f64,
    setup: &Setup,
    largest: f64,
    from: &StartState,
    about: [f64; 2],
    rows: &[usize],
) -> Result<Vec<Mixture>, IdentError> {
    let sample_time = record.sample_time();
    let spacing = (BIRTH_INTERVAL_S / sample_time.s()).round().max(1.0);
    let default = change_prior(alarm, setup, sample_time)?;
    let supposed = ChangePrior {
        birth_interval: spacing as u32,
        hazard: default.hazard.min(0.5 / spacing),
        neuromuscular_every: 0,
        ..default
    };
    let first = first_hypothesis(from, START_COVARIANCE_FACTOR, sample_time)?;
    let bank = |first: Hypothesis| -> Result<Box<Bank<MAX_HYPOTHESES>>, IdentError> {
        Ok(Box::new(Bank::new(first, supposed).ok_or_else(out_of_range_error)?))
    };
    let d = &from.values[PARAMETER_COUNT..];
    let seen = whitened_samples(record, setup.orders.nk, largest, d, about);
    let mut front = bank(first)?;
    let mut before: Vec<Vec<OneSidedHypothesis>> = Vec::with_capacity(rows.len());
    for (k, seen) in seen.iter().enumerate() {
        front.update_hypotheses(
            seen.as_ref().map(|(y, r)| (*y, DelayedSignals::from_known_delay(r))),
            about,
        );
        if rows.get(before.len()) == Some(&k) {
            before.push(likely_hypotheses(&front));
        }
    }
    let mut last = first;
    last.eta = front.mixture().eta;
    let mut back = bank(last)?;
    let mut joined = Vec::with_capacity(rows.len());
    for (k, seen) in seen.iter().enumerate().rev() {
        if before.len().checked_sub(1).and_then(|last| rows.get(last)) == Some(&k)
            && let Some(before) = before.pop()
        {
            joined.push(mixture_product(&before, &likely_hypotheses(&back)));
        }
        back.update_hypotheses(
            seen.as_ref().map(|(y, r)| (*y, DelayedSignals::from_known_delay(r))),
            about,
        );
    }
    joined.reverse();
    Ok(joined)
}

/// Returns the output and the signals of every sample after the whitening filter D, with filters linearised about
/// `about` and started at rest.
fn whitened_samples(record: &Record, nk: usize, largest: f64, d: &[f64], about: [f64; 2]) -> Vec<WhitenedSample> {
    let (e, u) = (record.input(), record.output());
    let sound = |v: f64| v.abs() <= largest;
    let mut response = Response::new(about, record.sample_time().s());
    let settled = SETTLING_TIME_CONSTANTS / (about[0] * about[1] * record.sample_time().s());
    let first_row = nk + d.len() + settled.min(record.len() as f64 / 4.0) as usize;
    let mut signals: Vec<Signals> = Vec::with_capacity(e.len());
    let (mut last, mut held) = (0.0, vec![0.0; e.len()]);
    for (held, e) in held.iter_mut().zip(e) {
        if sound(*e) {
            last = *e;
        }
        *held = last;
    }
    (0..u.len())
        .map(|t| {
            let x = t.checked_sub(nk).map_or(0.0, |s| held[s]);
            signals.push(response.step(x));
            let known = t >= first_row && sound(e[t]) && (0..=d.len()).all(|j| sound(u[t - j]));
            if !known {
                return None;
            }
            let (mut y, mut r) = (u[t], signals[t]);
            for (j, d) in d.iter().enumerate() {
                y += d * u[t - 1 - j];
                for (r, past) in r.iter_mut().zip(&signals[t - 1 - j]) {
                    *r += d * past;
                }
            }
            let finite = y.abs() < OVERFLOW_LIMIT && r.iter().all(|r| r.abs() < OVERFLOW_LIMIT);
            finite.then_some((y, r))
        })
        .collect()
}

/// Returns the likely hypotheses with the likeliest first, because a pair of likely hypotheses allows most other pairs
/// to be skipped.
fn likely_hypotheses(bank: &Bank<MAX_HYPOTHESES>) -> Vec<OneSidedHypothesis> {
    let likely = bank.hypotheses().filter(|h| h.probability >= MIN_RELATIVE_PROBABILITY);
    let mut sides: Vec<OneSidedHypothesis> = likely.map(OneSidedHypothesis::of).collect();
    sides.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
    sides
}

/// Returns the product of two mixtures.
fn mixture_product(before: &[OneSidedHypothesis], after: &[OneSidedHypothesis]) -> Mixture {
    let mut pairs: Vec<(f64, ForwardBackward)> = Vec::with_capacity(before.len() + after.len());
    let (mut most, least) = (f64::NEG_INFINITY, MIN_RELATIVE_PROBABILITY.ln());
    for f in before {
        for b in after {
            // The comparison is written so that a pair is not skipped if this bound is NaN.
            let highest = f.log_weight + b.log_weight - f.size.max(b.size);
            if highest < most + least || highest - ForwardBackward::half_squared_distance(f, b) < most + least {
                continue;
            }
            if let Some((log, pair)) = ForwardBackward::of(f, b) {
                most = most.max(log);
                pairs.push((log, pair));
            }
        }
    }
    pairs.retain(|(log, _)| *log >= most + least);
    let each: Vec<(f64, Mixture)> = if pairs.is_empty() {
        // If no pair can be combined, the causal estimate is used.
        let shares = before.iter().map(|f| (f.log_weight.exp(), unpaired_mixture(f)));
        shares.collect()
    } else {
        let shares = pairs.iter().map(|(log, pair)| ((log - most).exp(), pair.product()));
        shares.collect()
    };
    mixture_moments(&each)
}

/// Returns the mean and the covariance of a mixture.
fn mixture_moments(each: &[(f64, Mixture)]) -> Mixture {
    let total: f64 = each.iter().map(|(share, _)| share).sum();
    let mut mixture = Mixture {
        eta: [0.0; PARAMETER_COUNT],
        covariance: [[0.0; PARAMETER_COUNT]; PARAMETER_COUNT],
        variance: 0.0,
    };
    for (share, of) in each {
        for i in 0..PARAMETER_COUNT {
            mixture.eta[i] += share / total * of.eta[i];
        }
        mixture.variance += share / total * of.variance;
    }
    for (share, of) in each {
        let away: [f64; PARAMETER_COUNT] = std::array::from_fn(|i| of.eta[i] - mixture.eta[i]);
        for i in 0..PARAMETER_COUNT {
            for j in 0..PARAMETER_COUNT {
                mixture.covariance[i][j] += share / total * (of.covariance[i][j] + away[i] * away[j]);
            }
        }
    }
    mixture
}

fn unpaired_mixture(f: &OneSidedHypothesis) -> Mixture {
    Mixture {
        eta: f.eta,
        covariance: f.covariance,
        variance: f.level[0].exp(),
    }
}

/// A pair of a forward and a backward hypothesis, with `L L' = S` and `z = L^-1 (m_b - m_f)`.
struct ForwardBackward<'a> {
    f: &'a OneSidedHypothesis,
    b: &'a OneSidedHypothesis,
    root: [[f64; PARAMETER_COUNT]; PARAMETER_COUNT],
    z: [f64; PARAMETER_COUNT],
}

impl<'a> ForwardBackward<'a> {
    /// Lower bound on the decrease in the log weight due to the differences between f and b: `z'z` is not smaller than
    /// the squared difference of a single parameter divided by its variance. The constant 0.01 allows for rounding
    /// errors.
    fn half_squared_distance(f: &OneSidedHypothesis, b: &OneSidedHypothesis) -> f64 {
        let apart = b.level[0] - f.level[0];
        let mut square = 0.0_f64;
        for i in 0..PARAMETER_COUNT {
            let away = b.eta[i] - f.eta[i];
            square = square.max(away * away / (f.covariance[i][i] + b.covariance[i][i]));
        }
        0.5 * (square + apart * apart / (f.level[1] + b.level[1])) - 0.01
    }

    /// Returns the logarithm of the weight of the pair, up to a constant, and the pair. `None` if S is not positive
    /// definite.
    fn of(f: &'a OneSidedHypothesis, b: &'a OneSidedHypothesis) -> Option<(f64, Self)> {
        let sum = std::array::from_fn(|i| std::array::from_fn(|j| f.covariance[i][j] + b.covariance[i][j]));
        let root = cholesky_factor(&sum)?;
        let mut z = std::array::from_fn(|i| b.eta[i] - f.eta[i]);
        cholesky::substitute_forward(&root, PARAMETER_COUNT, &mut z);
        let determinant: f64 = (0..PARAMETER_COUNT).map(|i| root[i][i]).product();
        let spread = f.level[1] + b.level[1];
        let apart = b.level[0] - f.level[0];
        let square = dot(&z, &z) + apart * apart / spread;
        let log = f.log_weight + b.log_weight - (determinant * spread.sqrt()).ln() - 0.5 * square;
        log.is_finite().then_some((log, Self { f, b, root, z }))
    }

    /// Returns the combined estimate of the pair, by `P_f S^-1 x = (L^-1 P_f)' L^-1 x`.
    fn product(&self) -> Mixture {
        let (f, b) = (self.f, self.b);
        let mut columns = f.covariance;
        columns
            .iter_mut()
            .for_each(|column| cholesky::substitute_forward(&self.root, PARAMETER_COUNT, column));
        let taken = |i: usize, j: usize| f.covariance[i][j] - dot(&columns[i], &columns[j]);
        let level = (f.level[0] * b.level[1] + b.level[0] * f.level[1]) / (f.level[1] + b.level[1]);
        Mixture {
            eta: std::array::from_fn(|i| f.eta[i] + dot(&columns[i], &self.z)),
            covariance: std::array::from_fn(|i| std::array::from_fn(|j| taken(i, j))),
            variance: level.exp(),
        }
    }
}

/// Returns L with `L L' = s`. The known products are summed before they are subtracted, as in
/// [`cholesky::substitute_forward`];
/// [`cholesky::cholesky_factor`] gives the same result except for rounding errors.
fn cholesky_factor(s: &[[f64; PARAMETER_COUNT]; PARAMETER_COUNT]) -> Option<[[f64; PARAMETER_COUNT]; PARAMETER_COUNT]> {
    let mut l = [[0.0; PARAMETER_COUNT]; PARAMETER_COUNT];
    for i in 0..PARAMETER_COUNT {
        for j in 0..=i {
            let rest = s[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            if i == j {
                if !(rest > 0.0 && rest.is_finite()) {
                    return None;
                }
                l[i][i] = rest.sqrt();
            } else {
                l[i][j] = rest / l[j][j];
            }
        }
    }
    Some(l)
}

/// Returns T_L in s and its variance, from `E[K_e K_e_dot]/E[K_e^2]`.
fn lead_time(row: &Mixture) -> [f64; 2] {
    let ([k_e, k_e_dot, ..], c) = (row.eta, &row.covariance);
    let square = k_e * k_e + c[0][0];
    let lead = (k_e * k_e_dot + c[0][1]) / square;
    let of_ratio = c[1][1] - 2.0 * lead * c[0][1] + lead * lead * c[0][0];
    [lead, of_ratio.max(0.0) / square]
}

#[cfg(test)]
mod tests;
