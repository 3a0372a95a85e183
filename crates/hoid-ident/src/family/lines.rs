//! The describing function at the lines of a periodic excitation, with variances that are reliable even for few runs.
//!
//! The scatter of n runs gives the variance v_j of the response H_j at each line, with 2(n - 1) degrees of freedom. For
//! small n the smallest of these variances would dominate the fit. The relative variances `r_j = v_j/|H_j|^2` are
//! therefore shrunk towards the relative variance b_j of the remnant near the line, which is computed from many bins:
//! `r_j <- (nu r_j + nu_0 c b_j)/(nu + nu_0)` with `nu = 2(n - 1)`. The factor c is the median of `r_j/b_j`, at least
//! one, and represents differences between runs in excess of the remnant (shrunk variances; G. K. Smyth, *Statistical
//! Applications in Genetics and Molecular Biology* 3 (2004), article 3).

use hoid_model::Complex64;
use hoid_numerics::statistics::upper_median;

use super::response_fit::MeasuredResponse;
use crate::frequency::DescribingFunction;

/// Degrees of freedom nu_0 of the variance from neighbouring bins.
const PRIOR_DEGREES_OF_FREEDOM: f64 = 8.0;
/// Minimum number of runs whose scatter is used.
pub(super) const MIN_RUNS: usize = 3;

/// Returns the variance of a line: the variance from the scatter of the runs, shrunk towards the variance of the
/// remnant in neighbouring bins times `excess`. For fewer than three runs this is the variance of the remnant alone.
pub(super) fn shrunk_variance(runs: usize, of_runs: Option<f64>, neighbour_variance: f64, excess: f64) -> f64 {
    let nu = 2.0 * (runs as f64 - 1.0);
    match of_runs {
        Some(v) if runs >= MIN_RUNS => {
            (nu * v + PRIOR_DEGREES_OF_FREEDOM * excess * neighbour_variance) / (nu + PRIOR_DEGREES_OF_FREEDOM)
        }
        _ => neighbour_variance,
    }
}

/// The describing function at the lines, with the variances used in the fit.
#[derive(Debug, Clone)]
pub(super) struct LineData<'d> {
    pub describing: &'d DescribingFunction,
    pub points: Vec<MeasuredResponse>,
}

impl<'d> LineData<'d> {
    pub fn new(describing: &'d DescribingFunction) -> Self {
        let runs = describing.runs.len();
        let lines = &describing.lines;
        let neighbour_variance = |i: usize| lines[i].neighbour_error.powi(2);
        let mut ratios: Vec<f64> = (0..lines.len())
            .filter_map(|i| Some(lines[i].standard_error?.powi(2) / neighbour_variance(i)))
            .filter(|r| r.is_finite())
            .collect();
        // The factor is at least one: a scatter between runs that is smaller than the remnant explains is due to
        // chance.
        let excess = match upper_median(&mut ratios) {
            Some(median) if runs >= MIN_RUNS => median.max(1.0),
            _ => 1.0,
        };
        let of_runs = |i: usize| lines[i].standard_error.map(|s| s * s);
        let variance = |i: usize| shrunk_variance(runs, of_runs(i), neighbour_variance(i), excess);
        let point = |i: usize| MeasuredResponse {
            omega_rad_s: lines[i].omega_rad_s,
            response: lines[i].response,
            variance: variance(i),
        };
        Self {
            points: (0..lines.len()).map(point).collect(),
            describing,
        }
    }

    pub fn run_count(&self) -> usize {
        self.describing.runs.len()
    }

    /// Returns the points averaged over all runs except one, with the variances for this smaller number of runs.
    pub fn without_run(&self, run: usize) -> Vec<MeasuredResponse> {
        let n = self.run_count() as f64;
        let fewer = |(point, line): (&MeasuredResponse, &crate::frequency::Line)| MeasuredResponse {
            response: line.response_without(run),
            variance: point.variance * n / (n - 1.0),
            ..*point
        };
        self.points.iter().zip(&self.describing.lines).map(fewer).collect()
    }

    /// Returns chi^2 of one run for an operator that was fitted without this run; `sampled` returns the sampled
    /// response of this operator.
    pub fn chi_squared_of_run(&self, run: usize, sampled: impl Fn(f64) -> Complex64) -> f64 {
        let n = self.run_count() as f64;
        let of = |(point, line): (&MeasuredResponse, &crate::frequency::Line)| {
            let (a, b) = line.ratio.0[run];
            let whole: Complex64 = line.ratio.0.iter().map(|(_, b)| b).sum();
            let model = sampled(point.omega_rad_s);
            // The error of a single run has n times the variance of the mean over n runs.
            2.0 * ((a - model * b) * n / whole).norm_sqr() / (n * point.variance)
        };
        self.points.iter().zip(&self.describing.lines).map(of).sum()
    }
}
