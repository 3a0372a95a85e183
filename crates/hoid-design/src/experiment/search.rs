//! Search for the frequencies and amplitudes of the lines. It minimises `J = sum over wanted g' I^-1 g/s^2`,
//! `I = sum q_k M_k`, over the shares q of the lines in the response of u (`forcing_design`).
//!
//! - **Amplitudes.** J is convex in q. Starting from equal shares, `q_k <- q_k sqrt(d_k/sum q d)` with
//!   `d_k = sum g' I^-1 M_k I^-1 g/s^2` decreases J in every step (D. M. Titterington, *Applied Statistics* 27 (1978)
//!   227-234; Y. Yu, *Ann. Stat.* 38 (2010) 1593-1606). Each line keeps at least a fraction of an equal share, since
//!   people may differ from the assumed operator.
//! - **Frequencies.** Each line in turn is moved to nearby multiples, and the multiple with the smallest J is kept (V.
//!   V. Fedorov, *Theory of Optimal Experiments*, 1972), provided that no line is a harmonic of another.
//! - **Two forcing functions.** If the target is displayed, a person responds to both the target and the error. Lines
//!   of a target and of a disturbance, alternating in frequency, separate the two responses (`joint_coordinates`).
//!   Their shares are optimised together, and the limits apply to each forcing function.
//! - **Limits.** If a target has much power above the crossover frequency, people lower their crossover frequency (D.
//!   T. McRuer and H. R. Jex, *IEEE Trans. Human Factors in Electronics* 8 (1967) 231-249). The lines above it
//!   therefore form a shelf: their amplitudes are at most a given fraction of the geometric mean of the amplitudes
//!   below it. The amplitudes below it are between half and twice that mean. The overall amplitude is then the largest
//!   within the limits on the rms of e and u. Lines have a minimum distance (`spacing`) for two reasons: if a person
//!   varies during a run, part of the power moves from a line to nearby frequencies, and the remnant at a line is
//!   estimated from the neighbouring bins.

use std::f64::consts::TAU;

use hoid_model::forcing::Sinusoid;
use hoid_numerics::statistics::mean;
use nalgebra::{DMatrix, DVector};

use super::{
    DesignError, EntryPoint,
    information::{LoopQuantities, inverse},
};

/// Largest ratio of an amplitude below the crossover frequency to the geometric mean of these amplitudes; the inverse
/// is the smallest ratio.
const MAX_AMPLITUDE_RATIO: f64 = 2.0;
/// Smallest fraction of an equal share that each line keeps.
const MIN_LINE_SHARE: f64 = 0.1;
/// Number of iterations for the shares: in general, and when a line is moved on trial.
const ITERATIONS: usize = 400;
const TRIAL_ITERATIONS: usize = 60;
/// Numbers of multiples by which a line is moved on trial, and the number of rounds.
const MOVE_MULTIPLES: [i32; 10] = [-16, -8, -4, -2, -1, 1, 2, 4, 8, 16];
const ROUND_COUNT: usize = 3;
/// Smallest relative improvement of J for which a line is moved.
const MIN_IMPROVEMENT: f64 = 1e-3;

/// A line, given by its multiple of the fundamental and its point of entry.
pub(super) type CandidateLine = (u32, EntryPoint);

pub(super) struct Search<'a> {
    pub quantities: &'a LoopQuantities<'a>,
    pub gradients: Vec<DVector<f64>>,
    pub period_s: f64,
    pub shelf: f64,
}

impl Search<'_> {
    fn omega(&self, multiple: u32) -> f64 {
        f64::from(multiple) * TAU / self.period_s
    }

    fn line(&self, (multiple, enters): CandidateLine) -> (EntryPoint, f64) {
        (enters, self.omega(multiple))
    }

    /// Moves one line at a time to an admissible multiple, as long as J decreases, and returns the lines with their
    /// shares.
    pub fn optimise_lines(
        &self,
        mut places: Vec<CandidateLine>,
        admissible: impl Fn(&[CandidateLine], usize, u32) -> bool,
    ) -> Result<(Vec<CandidateLine>, Vec<f64>), DesignError> {
        let (mut shares, mut best) = self.shares(&places, ITERATIONS)?;
        for _ in 0..ROUND_COUNT {
            let before = best;
            for k in 0..places.len() {
                for by in MOVE_MULTIPLES {
                    let Some(moved) = places[k].0.checked_add_signed(by) else {
                        continue;
                    };
                    if !admissible(&places, k, moved) {
                        continue;
                    }
                    let mut trial = places.clone();
                    trial[k].0 = moved;
                    if let Ok((found, criterion)) = self.shares(&trial, TRIAL_ITERATIONS)
                        && criterion < best * (1.0 - MIN_IMPROVEMENT)
                    {
                        (places, shares, best) = (trial, found, criterion);
                    }
                }
            }
            if best >= before {
                break;
            }
        }
        let (found, _) = self.shares(&places, ITERATIONS).unwrap_or((shares, best));
        Ok((places, found))
    }

    /// Returns the optimal shares of lines at these frequencies, and J.
    fn shares(&self, places: &[CandidateLine], steps: usize) -> Result<(Vec<f64>, f64), DesignError> {
        let by_share: Vec<DMatrix<f64>> = places
            .iter()
            .map(|place| self.quantities.information_by_share(self.line(*place)))
            .collect();
        let n = places.len();
        let mut shares = vec![1.0 / n as f64; n];
        let mut last = f64::INFINITY;
        for step in 0..steps {
            let information = by_share.iter().zip(&shares).fold(
                DMatrix::zeros(by_share[0].nrows(), by_share[0].ncols()),
                |sum, (m, q)| sum + m * *q,
            );
            let covariance = inverse(&information).ok_or(DesignError::NotIdentifiable {
                lines: n,
                coordinates: information.nrows(),
            })?;
            let directions: Vec<DVector<f64>> = self.gradients.iter().map(|g| &covariance * g).collect();
            let criterion: f64 = directions.iter().zip(&self.gradients).map(|(c, g)| c.dot(g)).sum();
            last = criterion;
            if step + 1 == steps {
                break;
            }
            let slope = |m: &DMatrix<f64>| -> f64 { directions.iter().map(|c| (m * c).dot(c)).sum() };
            let moved: Vec<f64> = by_share
                .iter()
                .zip(&shares)
                .map(|(m, q)| q * (slope(m) / criterion).sqrt())
                .collect();
            let whole: f64 = moved.iter().sum();
            let least = MIN_LINE_SHARE / n as f64;
            shares = moved.iter().map(|q| (q / whole).max(least)).collect();
            self.limit_amplitudes(places, &mut shares);
        }
        Ok((shares, last))
    }

    /// Limits the amplitudes of the lines of each forcing function, and scales the shares so that their sum is one.
    fn limit_amplitudes(&self, places: &[CandidateLine], shares: &mut [f64]) {
        for enters in [EntryPoint::Target, EntryPoint::Disturbance] {
            let mut lines: Vec<(f64, bool, &mut f64)> = (places.iter().zip(shares.iter_mut()))
                .filter(|((_, at), _)| *at == enters)
                .map(|(place, q)| {
                    let line = self.line(*place);
                    (
                        self.quantities.control_by_power(line),
                        line.1 > self.quantities.crossover_rad_s,
                        q,
                    )
                })
                .collect();
            let below = lines.iter().filter(|(_, beyond, _)| !beyond);
            let logarithms: Vec<f64> = below.map(|(control, _, q)| (**q / control).ln()).collect();
            if logarithms.is_empty() {
                continue;
            }
            let level = mean(&logarithms).exp();
            for (control, beyond, q) in &mut lines {
                let power = **q / *control;
                **q = *control
                    * match beyond {
                        true => power.min(self.shelf * self.shelf * level),
                        false => power.clamp(
                            level / (MAX_AMPLITUDE_RATIO * MAX_AMPLITUDE_RATIO),
                            level * MAX_AMPLITUDE_RATIO * MAX_AMPLITUDE_RATIO,
                        ),
                    };
            }
        }
        let whole: f64 = shares.iter().sum();
        shares.iter_mut().for_each(|q| *q /= whole);
    }

    /// Returns lines with these shares, scaled so that the first forcing function has an rms of one.
    pub fn lines(&self, places: &[CandidateLine], shares: &[f64]) -> Vec<(EntryPoint, Sinusoid)> {
        let power = |(place, q): (&CandidateLine, &f64)| q / self.quantities.control_by_power(self.line(*place));
        let powers: Vec<f64> = places.iter().zip(shares).map(power).collect();
        let first = places.first().map(|(_, enters)| *enters);
        let own = places.iter().zip(&powers).filter(|((_, at), _)| Some(*at) == first);
        let whole: f64 = own.map(|(_, p)| p).sum();
        let line = |((m, enters), p): (&CandidateLine, &f64)| {
            let line = Sinusoid {
                amplitude_deg: (2.0 * p / whole).sqrt(),
                omega_rad_s: self.omega(*m),
                phase_rad: 0.0,
            };
            (*enters, line)
        };
        places.iter().zip(&powers).map(line).collect()
    }
}
