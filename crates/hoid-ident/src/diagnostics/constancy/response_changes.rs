//! Tests whether a response is constant: jumps, drifts and periodic changes of its gain and of its delay.
//!
//! The response is `u = sum b_i z_i + v` with columns `z_{i+1} = dz_i/dt`. A change in the gain has the direction b; a
//! change in the delay has the direction `-db/dt`, i.e. `-b_i` at `z_{i+1}`. To first order, an increase in the lead is
//! equivalent to a decrease in the delay by the same amount. The columns are nearly collinear, so the individual b_i
//! are too uncertain to define a direction; for the directions, b is a combination of a few terms of a numerator.
//!
//! The scores come from least squares with known columns ([`crate::diagnostics::whitened`]); the test is the same as
//! for fits. For a drift the regressor is multiplied by `t/T - 1/2`, for a periodic change by a sine with one of
//! several periods in four phases. The p-value is corrected for the number of all these candidates (Bonferroni).

use std::ops::Range;

use nalgebra::DMatrix;

use super::{
    blocks::{BLOCK_S, ScoreBlock},
    critical::student_p_value,
    search::{Change, Constancy, Direction, TimeCourse, candidate_steps, drifts, periodic_changes, strongest_change},
};
use crate::diagnostics::whitened::{NOISE_ORDER, OUTLIER_LIMIT, WhitenedFit, decimation_factor, solution};

/// Minimum number of 2 s blocks for the test.
const MIN_BLOCKS: usize = 8;

/// A change in a response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponseChange {
    /// Time course of the change.
    pub time_course: TimeCourse,
    /// Name of the property that changes: `gain` or `delay`. A change in a lead is reported as `delay`.
    pub name: &'static str,
    /// First sample after a jump; 0 for a drift or a periodic change.
    pub first_sample: usize,
    /// Size of the change (amplitude of a periodic change) and its standard error: for the gain as a share of the gain,
    /// for the delay in s.
    pub size: [f64; 2],
    /// Probability of a change at least as significant among all candidates with the same kind of time course, if the
    /// response is constant.
    pub p_value: f64,
}

/// A response to the error, as signals and as the terms of its numerator.
#[derive(Debug, Clone, Copy)]
pub struct ResponseBasis<'a> {
    /// Signals z_1, z_2, .. that span the response and its corrections; each is the derivative of the one before.
    pub columns: &'a [Vec<f64>],
    /// Terms of the numerator, each as its coefficients of the signals. The direction of a change in the delay is the
    /// derivative of the response, without the derivative of the last signal, which is not available.
    pub terms: &'a [Vec<f64>],
    /// Time constant of the slowest mode, s. The transient of this mode at the start of a stretch is estimated.
    pub lag_s: f64,
}

/// Returns the most significant jump, drift and periodic change in a response in each of these stretches, and the most
/// significant drift that all stretches have in common. Among several bases, the one that explains u best is used in
/// each stretch. Stretches with too few data, or in which a value is not a number, are omitted.
pub fn response_changes(
    bases: &[ResponseBasis<'_>],
    u: &[f64],
    stretches: &[Range<usize>],
    sample_time_s: f64,
) -> Vec<ResponseChange> {
    let all: Vec<StretchTests> = stretches
        .iter()
        .filter_map(|stretch| {
            let fits = bases
                .iter()
                .filter_map(|basis| ScoredStretch::of(basis, u, stretch, sample_time_s));
            let best = fits.min_by(|a, b| a.residual.total_cmp(&b.residual))?;
            Some(best.test(sample_time_s))
        })
        .collect();
    let common = if all.len() > 1 { common_drift(&all) } else { None };
    let each = all.iter().flat_map(|stretch| &stretch.strongest);
    each.map(|found| ResponseChange {
        p_value: (found.p_value * all.len() as f64).min(1.0),
        ..*found
    })
    .chain(common)
    .collect()
}

/// The whitened fit of a stretch, by blocks.
struct ScoredStretch {
    blocks: Vec<ScoreBlock>,
    directions: [Direction; 2],
    variance: f64,
    /// Sum of squared residuals.
    residual: f64,
}

/// Results of the tests of a stretch.
struct StretchTests {
    strongest: Vec<ResponseChange>,
    /// Drift of the gain and of the delay over the stretch, and the length of the stretch in blocks.
    drifts: [Option<Change>; 2],
    blocks: usize,
}

impl ScoredStretch {
    fn of(basis: &ResponseBasis<'_>, u: &[f64], stretch: &Range<usize>, sample_time_s: f64) -> Option<Self> {
        let thin = decimation_factor(sample_time_s);
        let rows: Vec<usize> = stretch.clone().step_by(thin).collect();
        let block = (BLOCK_S / (thin as f64 * sample_time_s)).round().max(1.0) as usize;
        let count = rows.len().saturating_sub(NOISE_ORDER) / block;
        if count < MIN_BLOCKS || rows.last()? >= &u.len() || basis.columns.iter().any(|c| c.len() != u.len()) {
            return None;
        }
        let start = *rows.first()?;
        let ago = |k: usize| k.saturating_sub(start) as f64 * sample_time_s;
        let transient: Vec<f64> = (0..u.len()).map(|k| (-ago(k) / basis.lag_s).exp()).collect();
        let mut columns = basis.columns.to_vec();
        columns.push(transient);
        let fit = WhitenedFit::of(&columns, u, &rows, OUTLIER_LIMIT)?;
        let p = columns.len() + 1;
        // The directions use the gains of the numerator terms, because the coefficients of the individual signals are
        // too uncertain.
        let terms = DMatrix::from_fn(columns.len() + 1, basis.terms.len() + 2, |i, j| {
            match basis.terms.get(j) {
                Some(term) => term.get(i).copied().unwrap_or(0.0),
                None => f64::from(u8::from(i == basis.columns.len() + j - basis.terms.len())),
            }
        });
        let whitened_u = &fit.x * &fit.b + &fit.eps;
        let gains = solution(&(&fit.x * &terms), &whitened_u)?;
        let kept = terms.columns(0, basis.terms.len()) * gains.rows(0, basis.terms.len());
        let gain: Vec<f64> = kept.iter().copied().collect();
        let delay = (0..p)
            .map(|j| {
                if j > 0 && j < basis.columns.len() {
                    -gain[j - 1]
                } else {
                    0.0
                }
            })
            .collect();
        let direction = |name: &str, vector: Vec<f64>| Direction {
            name: name.to_owned(),
            unit: "",
            vector,
            delay: name == PARAMETER_NAMES[1],
            size: 0.0,
        };
        let blocks = (0..count)
            .map(|k| {
                let (from, length) = (k * block, block);
                let x = fit.x.rows(from, length);
                let eps = fit.eps.rows(from, length);
                ScoreBlock {
                    record: 0,
                    from: rows[from + NOISE_ORDER],
                    score: (x.transpose() * eps).iter().copied().collect(),
                    information: (x.transpose() * x).iter().copied().collect(),
                }
            })
            .collect();
        Some(Self {
            blocks,
            directions: [
                direction(PARAMETER_NAMES[0], gain),
                direction(PARAMETER_NAMES[1], delay),
            ],
            variance: fit.eps.norm_squared() / (fit.eps.len() - p - NOISE_ORDER) as f64,
            residual: fit.eps.norm_squared(),
        })
    }

    fn test(&self, sample_time_s: f64) -> StretchTests {
        let of = Constancy {
            blocks: &self.blocks,
            directions: &self.directions,
            variance: self.variance,
            run_to_run: 0.0,
            sample_time_s,
        };
        let all: Vec<&Direction> = self.directions.iter().collect();
        let courses = [
            candidate_steps(&self.blocks),
            drifts(&self.blocks),
            periodic_changes(&self.blocks, BLOCK_S),
        ];
        let drift = |direction: &Direction| strongest_change(&of, &[direction], &courses[1]);
        StretchTests {
            strongest: courses
                .iter()
                .filter_map(|sets| strongest_change(&of, &all, sets))
                .filter_map(|change| {
                    Some(ResponseChange {
                        time_course: change.time_course,
                        name: PARAMETER_NAMES.into_iter().find(|name| *name == change.name)?,
                        first_sample: change.first_sample,
                        size: [change.size, change.error],
                        p_value: change.p_value,
                    })
                })
                .collect(),
            drifts: self.directions.each_ref().map(drift),
            blocks: self.blocks.len(),
        }
    }
}

/// Returns the more significant of the two drifts (of gain and delay) that several stretches have in common: the mean
/// rate of the stretches, weighted by their precision, as a change over all of them. Each stretch has its own response,
/// so changes between stretches are not part of the drift.
fn common_drift(all: &[StretchTests]) -> Option<ResponseChange> {
    let blocks: usize = all.iter().map(|stretch| stretch.blocks).sum();
    let of = |i: usize| {
        let (mut information, mut weighted) = (0.0, 0.0);
        for stretch in all {
            let Some(drift) = &stretch.drifts[i] else { continue };
            let (rate, error) = (drift.size / stretch.blocks as f64, drift.error / stretch.blocks as f64);
            information += error.powi(-2);
            weighted += rate * error.powi(-2);
        }
        let z = weighted / information.sqrt();
        (information > 0.0).then(|| ResponseChange {
            time_course: TimeCourse::Drift,
            name: PARAMETER_NAMES[i],
            first_sample: 0,
            size: [weighted / information, information.sqrt().recip()].map(|rate| rate * blocks as f64),
            p_value: (student_p_value(z, (blocks - 2 * all.len()) as f64) * PARAMETER_NAMES.len() as f64).min(1.0),
        })
    };
    (0..PARAMETER_NAMES.len())
        .filter_map(of)
        .min_by(|a, b| a.p_value.total_cmp(&b.p_value))
}

const PARAMETER_NAMES: [&str; 2] = ["gain", "delay"];

#[cfg(test)]
mod tests {
    use std::{f64::consts::TAU, slice, sync::LazyLock};

    use super::*;
    use crate::diagnostics::whitened::random_number;

    const TS: f64 = 0.02;
    const N: usize = 4000;
    const WHOLE_RECORD: Range<usize> = 0..N;
    static TERMS: LazyLock<Vec<Vec<f64>>> = LazyLock::new(|| vec![vec![1.0, 0.0], vec![0.0, 1.0]]);

    /// The basis of a response `b_1 z_1 + b_2 z_2`.
    fn basis(columns: &[Vec<f64>]) -> ResponseBasis<'_> {
        ResponseBasis {
            columns,
            terms: &TERMS,
            lag_s: 1.0,
        }
    }

    /// Returns z_1, z_2 and u over 80 s, for this time course of the gain.
    fn run(seed: u64, gain: impl Fn(f64) -> f64) -> ([Vec<f64>; 2], Vec<f64>) {
        let mut seed = seed;
        let (mut z, mut u) = ([vec![0.0; N], vec![0.0; N]], vec![0.0; N]);
        let (mut w, mut v) = (0.0, 0.0);
        for t in 1..N {
            w = 0.9 * w + random_number(&mut seed);
            v = 0.9 * v + random_number(&mut seed);
            z[0][t] = z[0][t - 1] + TS * w;
            z[1][t] = w;
            u[t] = gain(t as f64 * TS) * (3.0 * z[0][t] + z[1][t]) + 0.5 * v;
        }
        (z, u)
    }

    /// Returns the changes found for this time course of the gain.
    fn of(seed: u64, gain: impl Fn(f64) -> f64) -> Vec<ResponseChange> {
        let (z, u) = run(seed, gain);
        response_changes(&[basis(&z)], &u, slice::from_ref(&WHOLE_RECORD), TS)
    }

    fn p_value(found: &[ResponseChange], is: impl Fn(TimeCourse) -> bool) -> f64 {
        let of_course = found.iter().filter(|found| is(found.time_course));
        of_course.map(|found| found.p_value).fold(1.0, f64::min)
    }

    #[test]
    fn jumps_drifts_and_oscillations_are_distinguished() {
        let step = |c| c == TimeCourse::Step;
        let drift = |c| c == TimeCourse::Drift;
        let sway = |c| matches!(c, TimeCourse::Oscillation(_));
        for seed in 1..6 {
            let jumps = of(seed, |t| if t < 40.0 { 1.0 } else { 0.6 });
            assert!(p_value(&jumps, step) < 1e-4 && p_value(&jumps, sway) > 1e-3);
            let found = jumps
                .iter()
                .find(|found| found.time_course == TimeCourse::Step)
                .unwrap();
            assert!((found.first_sample as f64 * TS - 40.0).abs() <= 10.0, "{found:?}");
            assert!(p_value(&of(seed, |t| 1.0 - 0.5 * t / 80.0), drift) < 1e-4);
            let periodic_changes = of(seed, |t| 1.0 + 0.3 * (TAU * t / 16.0).sin());
            assert!(p_value(&periodic_changes, sway) < 1e-4);
            let found = periodic_changes.iter().find(|found| sway(found.time_course)).unwrap();
            let TimeCourse::Oscillation(period) = found.time_course else {
                unreachable!()
            };
            assert!((period - 16.0).abs() < 2.5, "{period}");
        }
    }

    #[test]
    fn constant_response_is_not_reported() {
        // Each of the three p-values is below 0.01 for one person in a hundred at most, so three of 100 people at most
        // are expected.
        let reported = (0..100)
            .map(|seed| of(1000 + seed, |_| 1.0))
            .filter(|found| found.iter().any(|found| found.p_value < 0.01))
            .count();
        assert!(reported <= 5, "{reported} of 100");
    }

    #[test]
    fn common_drift_is_found_and_jumps_between_stretches_are_not() {
        let halves = [0..N / 2, N / 2..N];
        let drift = |gain: &dyn Fn(f64) -> f64, seed| {
            let (z, u) = run(seed, gain);
            p_value(&response_changes(&[basis(&z)], &u, &halves, TS), |course| {
                course == TimeCourse::Drift
            })
        };
        let (mut shared, mut one) = (0, 0);
        for seed in 1..21 {
            // The gain falls by 15 % in each half and returns to its initial value between the halves.
            let falls = |t: f64| 1.0 - 0.15 * (t / 40.0).fract();
            shared += usize::from(drift(&falls, seed) < 1e-3);
            let (z, u) = run(seed, falls);
            let first = response_changes(&[basis(&z)], &u, &halves[..1], TS);
            one += usize::from(p_value(&first, |course| course == TimeCourse::Drift) < 1e-3);
            assert!(drift(&|t| if t < 40.0 { 1.0 } else { 0.6 }, seed) > 1e-3);
        }
        assert!(shared >= 15 && one < shared, "{shared} {one}");
    }

    #[test]
    fn best_fitting_basis_is_used() {
        let (z, u) = run(7, |t| 1.0 - 0.3 * t / 80.0);
        let (other, _) = run(8, |_| 1.0);
        let alone = response_changes(&[basis(&z)], &u, slice::from_ref(&WHOLE_RECORD), TS);
        assert_eq!(
            response_changes(&[basis(&other), basis(&z)], &u, slice::from_ref(&WHOLE_RECORD), TS),
            alone
        );
        // A transient of the lag that started before the stretch does not affect the result.
        let early = |t: usize| 5.0 * (-(t as f64) * TS).exp();
        let decaying: Vec<f64> = u.iter().enumerate().map(|(t, u)| u + early(t)).collect();
        let with = response_changes(&[basis(&z)], &decaying, slice::from_ref(&WHOLE_RECORD), TS);
        for (with, alone) in with.iter().zip(&alone) {
            assert!(
                (with.size[0] - alone.size[0]).abs() < 1e-3 * alone.size[1],
                "{with:?} {alone:?}"
            );
        }
    }

    #[test]
    fn zero_columns_and_short_records_give_no_result() {
        let columns = [vec![0.0; N], vec![0.0; N]];
        assert!(response_changes(&[basis(&columns)], &vec![1.0; N], slice::from_ref(&WHOLE_RECORD), TS).is_empty());
        assert!(response_changes(&[basis(&columns)], &vec![1.0; N], slice::from_ref(&(0..500)), TS).is_empty());
    }
}
