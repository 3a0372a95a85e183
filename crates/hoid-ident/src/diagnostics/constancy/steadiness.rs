//! Test of whether a response is constant: jumps, drifts and periodic changes of its gain and of its delay.
//!
//! The response is `u = sum b_i z_i + v` with columns `z_{i+1} = dz_i/dt`. A change of the gain has the direction b; a
//! change of the delay has the direction `-db/dt`, i.e. `-b_i` at `z_{i+1}`. To first order, an increase of the lead is
//! equivalent to a decrease of the delay by the same amount.
//!
//! The scores come from least squares with known columns ([`crate::diagnostics::whitened`]); the test is the same as
//! for fits. For a drift the regressor is multiplied by `t/T - 1/2`, for a periodic change by a sine with one of
//! several periods in four phases. The p-value is corrected for the number of all these candidates (Bonferroni).

use std::ops::Range;

use super::{
    blocks::{BLOCK_S, ScoreBlock},
    search::{Change, Constancy, Course, Direction, drifts, periodic_changes, sets, strongest_among},
};
use crate::diagnostics::whitened::{LIMIT, NOISE, Whitened, thinning};

/// Minimum number of 2 s blocks for the test.
const FEWEST: usize = 8;

/// A change of a response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unsteady {
    /// Time course of the change.
    pub course: Course,
    /// Name of the property that changes: `gain` or `delay`. A change of a lead is reported as `delay`.
    pub name: &'static str,
    /// First sample after a jump; 0 for a drift or a periodic change.
    pub at: usize,
    /// Size of the change (amplitude of a periodic change) and its standard error: for the gain as a share of the gain,
    /// for the delay in s.
    pub by: [f64; 2],
    /// Probability that chance alone gives a change at least as significant, among all candidates with the same kind of
    /// time course.
    pub p_value: f64,
}

/// Returns the most significant jump, drift and periodic change of a response over `samples`. The `columns` span the
/// response; each column is the derivative of the previous column. Empty if there are too few data or a value is not a
/// number.
pub fn unsteady(columns: &[Vec<f64>], u: &[f64], samples: Range<usize>, sample_time_s: f64) -> Vec<Unsteady> {
    found(columns, u, samples, sample_time_s).unwrap_or_default()
}

fn found(columns: &[Vec<f64>], u: &[f64], samples: Range<usize>, sample_time_s: f64) -> Option<Vec<Unsteady>> {
    let thin = thinning(sample_time_s);
    let rows: Vec<usize> = samples.step_by(thin).collect();
    let block = (BLOCK_S / (thin as f64 * sample_time_s)).round().max(1.0) as usize;
    let count = rows.len().saturating_sub(NOISE) / block;
    if count < FEWEST || rows.last()? >= &u.len() || columns.iter().any(|c| c.len() != u.len()) {
        return None;
    }
    let fit = Whitened::of(columns, u, &rows, LIMIT)?;
    let (p, last) = (columns.len() + 1, columns.len() - 1);
    let blocks: Vec<ScoreBlock> = (0..count)
        .map(|k| {
            let (from, length) = (k * block, block);
            let x = fit.x.rows(from, length);
            let eps = fit.eps.rows(from, length);
            ScoreBlock {
                record: 0,
                from: rows[from + NOISE],
                score: (x.transpose() * eps).iter().copied().collect(),
                information: (x.transpose() * x).iter().copied().collect(),
            }
        })
        .collect();
    // The level is not part of the response, and the derivative of the last column is not available.
    let gain = (0..p).map(|j| if j <= last { fit.b[j] } else { 0.0 }).collect();
    let delay = (0..p)
        .map(|j| if j > 0 && j <= last { -fit.b[j - 1] } else { 0.0 })
        .collect();
    let direction = |name: &str, vector: Vec<f64>| Direction {
        name: name.to_owned(),
        unit: "",
        vector,
        delay: name == NAMES[1],
        size: 0.0,
    };
    let directions = [direction(NAMES[0], gain), direction(NAMES[1], delay)];
    let of = Constancy {
        blocks: &blocks,
        directions: &directions,
        variance: fit.eps.norm_squared() / (fit.eps.len() - p - NOISE) as f64,
        run_to_run: 0.0,
        sample_time_s,
    };
    let all: Vec<&Direction> = directions.iter().collect();
    let courses = [sets(&blocks), drifts(&blocks), periodic_changes(&blocks, BLOCK_S)];
    let told = |change: Change| {
        let name = NAMES.into_iter().find(|name| *name == change.name)?;
        Some(Unsteady {
            course: change.course,
            name,
            at: change.at,
            by: [change.by, change.error],
            p_value: change.p_value,
        })
    };
    let strongest = courses.iter().filter_map(|sets| strongest_among(&of, &all, sets));
    Some(strongest.filter_map(told).collect())
}

const NAMES: [&str; 2] = ["gain", "delay"];

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::diagnostics::whitened::stream;

    const TS: f64 = 0.02;

    /// Faults found for this course of the gain of u, in 80 s.
    fn of(seed: u64, gain: impl Fn(f64) -> f64) -> Vec<Unsteady> {
        let mut seed = seed;
        let n = 4000;
        let (mut z, mut u) = ([vec![0.0; n], vec![0.0; n]], vec![0.0; n]);
        let (mut w, mut v) = (0.0, 0.0);
        for t in 1..n {
            w = 0.9 * w + stream(&mut seed);
            v = 0.9 * v + stream(&mut seed);
            z[0][t] = z[0][t - 1] + TS * w;
            z[1][t] = w;
            u[t] = gain(t as f64 * TS) * (3.0 * z[0][t] + z[1][t]) + 0.5 * v;
        }
        unsteady(&z, &u, 0..n, TS)
    }

    fn p_value(found: &[Unsteady], is: impl Fn(Course) -> bool) -> f64 {
        let of_course = found.iter().filter(|found| is(found.course));
        of_course.map(|found| found.p_value).fold(1.0, f64::min)
    }

    #[test]
    fn jumps_drifts_and_sways_are_told_apart() {
        let step = |c| c == Course::Step;
        let drift = |c| c == Course::Drift;
        let sway = |c| matches!(c, Course::Sway(_));
        for seed in 1..6 {
            let jumps = of(seed, |t| if t < 40.0 { 1.0 } else { 0.6 });
            assert!(p_value(&jumps, step) < 1e-4 && p_value(&jumps, sway) > 1e-3);
            let found = jumps.iter().find(|found| found.course == Course::Step).unwrap();
            assert!((found.at as f64 * TS - 40.0).abs() <= 10.0, "{found:?}");
            assert!(p_value(&of(seed, |t| 1.0 - 0.5 * t / 80.0), drift) < 1e-4);
            let periodic_changes = of(seed, |t| 1.0 + 0.3 * (TAU * t / 16.0).sin());
            assert!(p_value(&periodic_changes, sway) < 1e-4);
            let found = periodic_changes.iter().find(|found| sway(found.course)).unwrap();
            let Course::Sway(period) = found.course else {
                unreachable!()
            };
            assert!((period - 16.0).abs() < 2.5, "{period}");
        }
    }

    #[test]
    fn who_is_steady_is_called_so() {
        // For three courses and 100 people, each below its limit in less than one of a hundred.
        let told = (0..100)
            .map(|seed| of(1000 + seed, |_| 1.0))
            .filter(|found| found.iter().any(|found| found.p_value < 0.01))
            .count();
        assert!(told <= 5, "{told} of 100");
    }

    #[test]
    fn too_little_says_nothing() {
        let columns = [vec![0.0; 4000], vec![0.0; 4000]];
        assert!(unsteady(&columns, &vec![1.0; 4000], 0..4000, TS).is_empty());
        assert!(unsteady(&columns, &vec![1.0; 4000], 0..500, TS).is_empty());
    }
}
