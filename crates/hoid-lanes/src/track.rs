//! Recursions over many runs.
//!
//! Recursive least squares (C, D and F without coefficients) or the recursive prediction-error method, with one factor of forgetting and
//! without error bars ([`hoid_core::lanes`]). Runs are put into lanes in their order; lanes that are left over stay at rest.

use hoid_core::{
    lanes::{RlsLanes, RpemLanes},
    number::Number,
    predictor::{AnyShape, FixedShape, Shape},
    recursion::Stable,
};
use thiserror::Error;

use crate::{Path, SideBySide};

/// Why many runs could not be tracked.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LanesError {
    /// Runs of different length.
    #[error(
        "run {index} has {found} samples of {signal}, expected {expected} as the first run; cut the runs to one length"
    )]
    Length {
        /// Index of the run, from 0.
        index: usize,
        /// e or u.
        signal: &'static str,
        /// Samples found.
        found: usize,
        /// Samples expected.
        expected: usize,
    },
    /// A sample that is no number.
    #[error("{signal} of run {index} is not finite at sample {sample}; cut the run before it")]
    NotFinite {
        /// Index of the run, from 0.
        index: usize,
        /// e or u.
        signal: &'static str,
        /// Index of the sample, from 0.
        sample: usize,
    },
    /// A task that no recursion can take.
    #[error("{quantity} is {found}, expected {expected}")]
    BadTask {
        /// What is wrong.
        quantity: &'static str,
        /// What was found.
        found: String,
        /// What can be taken.
        expected: &'static str,
    },
    /// A path that this processor does not have.
    #[error("this processor has no registers for {path:?}; use Path::Best")]
    NoSuchPath {
        /// The path.
        path: Path,
    },
}

/// The recursion that is run over all runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Orders; at most 16 coefficients.
    pub orders: AnyShape,
    /// Delay nk of the input in samples.
    pub nk: usize,
    /// Factor of forgetting, above 0 and at most 1.
    pub lambda: f64,
    /// `[a.. b.. c.. d.. f..]` at the start, stable.
    pub theta: Vec<f64>,
    /// Variance of each coefficient at the start, over the innovation variance.
    pub variances: Vec<f64>,
    /// Polynomials that are kept stable.
    pub stable: Stable,
}

/// Input and output of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run<'a> {
    /// Tracking error e.
    pub e: &'a [f64],
    /// Control output u.
    pub u: &'a [f64],
}

/// The estimates of all runs after each sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimates {
    runs: usize,
    samples: usize,
    parameters: usize,
    lanes: usize,
    /// By group of runs, sample, coefficient, lane.
    values: Vec<f64>,
}

impl Estimates {
    /// Number of runs.
    pub fn runs(&self) -> usize {
        self.runs
    }

    /// Samples of each run.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// theta of a run after a sample, both from 0; `None` beyond the last.
    pub fn theta(&self, run: usize, sample: usize) -> Option<Vec<f64>> {
        let inside = run < self.runs && sample < self.samples;
        inside.then(|| {
            (0..self.parameters)
                .map(|i| self.values[self.at(run, sample) + i * self.lanes])
                .collect()
        })
    }

    /// One coefficient of a run after each sample; `None` where there is no such run or coefficient.
    pub fn coefficient(&self, run: usize, coefficient: usize) -> Option<Vec<f64>> {
        let inside = run < self.runs && coefficient < self.parameters;
        let at = |sample| self.values[self.at(run, sample) + coefficient * self.lanes];
        inside.then(|| (0..self.samples).map(at).collect())
    }

    fn at(&self, run: usize, sample: usize) -> usize {
        ((run / self.lanes) * self.samples + sample) * self.parameters * self.lanes + run % self.lanes
    }
}

/// Tracks many runs of one length side by side: the estimate of each after each sample, with the bits that
/// [`hoid_core::rls::Rls`] or [`hoid_core::rpem::Rpem`] without error bars gives for the run alone.
///
/// ```
/// use hoid_lanes::{Path, Run, Task, track_many};
/// let e: Vec<Vec<f64>> = (1..=5).map(|k| (0..400).map(|t| (0.1 * (k * t) as f64).sin()).collect()).collect();
/// let u: Vec<Vec<f64>> = e.iter().map(|e| e.iter().map(|e| 0.5 * e).collect()).collect();
/// let runs: Vec<Run> = e.iter().zip(&u).map(|(e, u)| Run { e, u }).collect();
/// let task = Task {
///     orders: hoid_core::predictor::AnyShape { nb: 1, ..Default::default() },
///     nk: 0,
///     lambda: 0.9,
///     theta: vec![0.0],
///     variances: vec![100.0],
///     stable: Default::default(),
/// };
/// let estimates = track_many(&runs, &task, Path::Best)?;
/// assert!((estimates.theta(4, 399).unwrap()[0] - 0.5).abs() < 1e-6);
/// # Ok::<(), hoid_lanes::LanesError>(())
/// ```
///
/// # Errors
/// [`LanesError`] when runs differ in length or hold what is no number, the task fits no recursion, or the processor has no such path.
pub fn track_many(runs: &[Run], task: &Task, path: Path) -> Result<Estimates, LanesError> {
    check(runs, task)?;
    path.do_with(Track { runs, task })
        .ok_or(LanesError::NoSuchPath { path })?
}

fn check(runs: &[Run], task: &Task) -> Result<(), LanesError> {
    let expected = runs.first().map_or(0, |run| run.e.len());
    for (index, run) in runs.iter().enumerate() {
        for (signal, values) in [("e", run.e), ("u", run.u)] {
            if values.len() != expected {
                return Err(LanesError::Length {
                    index,
                    signal,
                    found: values.len(),
                    expected,
                });
            }
            if let Some(sample) = values.iter().position(|v| !v.is_finite()) {
                return Err(LanesError::NotFinite { index, signal, sample });
            }
        }
    }
    let p = task.orders.parameters();
    let bad = |quantity, found: String, expected| {
        Err(LanesError::BadTask {
            quantity,
            found,
            expected,
        })
    };
    if !(1..=16).contains(&p) {
        return bad("number of coefficients", p.to_string(), "1 to 16");
    }
    if task.theta.len() != p || task.variances.len() != p {
        let found = format!("{} and {}", task.theta.len(), task.variances.len());
        return bad(
            "length of theta and of the variances",
            found,
            "one for each coefficient",
        );
    }
    if !(task.lambda > 0.0 && task.lambda <= 1.0) {
        return bad("lambda", task.lambda.to_string(), "a number above 0 and at most 1");
    }
    if !task.variances.iter().all(|v| *v >= 0.0 && v.is_finite()) {
        return bad(
            "a variance of the start",
            format!("{:?}", task.variances),
            "finite and not negative",
        );
    }
    Ok(())
}

struct Track<'a> {
    runs: &'a [Run<'a>],
    task: &'a Task,
}

impl SideBySide for Track<'_> {
    type Output = Result<Estimates, LanesError>;

    #[inline(always)]
    fn run<R: Number>(self, zero: R) -> Self::Output {
        let o = self.task.orders;
        let linear = (o.nc, o.nd, o.nf) == (0, 0, 0);
        // Orders of the operator in the type: half the time.
        match (o.na, o.nb, o.nc, o.nd, o.nf) {
            (2, 2, 0, 0, 0) => self.linear::<R, _, 4>(FixedShape::<2, 2, 0, 0, 0>, zero),
            (0, 2, 0, 1, 2) => self.polynomials::<R, _, 5>(FixedShape::<0, 2, 0, 1, 2>, zero),
            _ if linear && o.parameters() <= 8 => self.linear::<R, _, 8>(o, zero),
            _ if linear => self.linear::<R, _, 16>(o, zero),
            _ if o.parameters() <= 8 => self.polynomials::<R, _, 8>(o, zero),
            _ => self.polynomials::<R, _, 16>(o, zero),
        }
    }
}

/// Samples whose inputs are laid side by side at a time.
const BLOCK: usize = 64;

/// Either recursion. No closure: it would be a function of its own, for registers of the smallest width.
trait Lanes<const N: usize, R>: Clone {
    /// theta after the next sample.
    fn next(&mut self, x: R, u: R) -> &[R; N];
}

impl<S: Shape, const N: usize, R: Number> Lanes<N, R> for RlsLanes<S, N, R> {
    #[inline(always)]
    fn next(&mut self, x: R, u: R) -> &[R; N] {
        self.step(x, u);
        self.theta()
    }
}

impl<S: Shape, const N: usize, R: Number> Lanes<N, R> for RpemLanes<S, N, R> {
    #[inline(always)]
    fn next(&mut self, x: R, u: R) -> &[R; N] {
        self.step(x, u);
        self.theta()
    }
}

impl Track<'_> {
    #[inline(always)]
    fn start<R: Number, const N: usize>(&self, zero: R) -> ([R; N], [R; N]) {
        let at = |values: &[f64], i: usize| zero.like(values.get(i).copied().unwrap_or(0.0));
        let theta = std::array::from_fn(|i| at(&self.task.theta, i));
        (theta, std::array::from_fn(|i| at(&self.task.variances, i)))
    }

    #[inline(always)]
    fn linear<R: Number, S: Shape, const N: usize>(self, shape: S, zero: R) -> Result<Estimates, LanesError> {
        let (theta, variances) = self.start::<R, N>(zero);
        let first = RlsLanes::new(shape, theta, variances, self.task.lambda).ok_or_else(not_taken)?;
        Ok(self.over_groups::<R, _, N>(zero, &first))
    }

    #[inline(always)]
    fn polynomials<R: Number, S: Shape, const N: usize>(self, shape: S, zero: R) -> Result<Estimates, LanesError> {
        let (theta, variances) = self.start::<R, N>(zero);
        let first =
            RpemLanes::new(shape, self.task.stable, theta, variances, self.task.lambda).ok_or_else(not_taken)?;
        Ok(self.over_groups::<R, _, N>(zero, &first))
    }

    #[inline(always)]
    fn over_groups<R: Number, T: Lanes<N, R>, const N: usize>(&self, zero: R, first: &T) -> Estimates {
        let width = zero.lanes();
        let samples = self.runs.first().map_or(0, |run| run.e.len());
        let parameters = self.task.orders.parameters();
        let row = parameters * width;
        let mut values = Vec::with_capacity(self.runs.len().div_ceil(width) * samples * row);
        // The inputs of all lanes of a sample beside each other, for as many samples as stay in the nearest memory.
        let mut inputs = vec![0.0; 2 * width * BLOCK];
        for runs in self.runs.chunks(width) {
            inputs.fill(0.0);
            let mut lanes = first.clone();
            for begin in (0..samples).step_by(BLOCK) {
                let end = (begin + BLOCK).min(samples);
                for (lane, run) in runs.iter().enumerate() {
                    for t in begin..end {
                        let at = (t - begin) * 2 * width + lane;
                        inputs[at] = if t < self.task.nk { 0.0 } else { run.e[t - self.task.nk] };
                        inputs[at + width] = run.u[t];
                    }
                }
                let written = values.len();
                values.resize(written + (end - begin) * row, 0.0);
                let rows = values[written..].chunks_exact_mut(row);
                for (to, from) in rows.zip(inputs.chunks_exact(2 * width)) {
                    let theta = lanes.next(zero.load(from), zero.load(&from[width..]));
                    for i in 0..parameters {
                        theta[i].store(&mut to[i * width..]);
                    }
                }
            }
        }
        Estimates {
            runs: self.runs.len(),
            samples,
            parameters,
            lanes: width,
            values,
        }
    }
}

fn not_taken() -> LanesError {
    LanesError::BadTask {
        quantity: "the start",
        found: "a theta that is not stable".to_owned(),
        expected: "roots of C and F (and D, if asked for) inside the unit circle",
    }
}
