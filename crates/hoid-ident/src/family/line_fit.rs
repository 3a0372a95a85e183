//! Fit of the operator to the lines of the excitation, with errors from a jackknife over runs.

use hoid_model::{FamilyOperator, Form, uncertainty::Estimate};

use super::{
    channel_criterion::ChannelMinimum,
    deviation::Misfit,
    jackknife::{add_prior_contribution, jackknife},
    lines::LineData,
    response_fit::{ResponseCriterion, ResponseMinimum},
};
use crate::{IdentError, SearchOptions, Termination, grey_box::objective::Penalty};

/// Minimum number of runs for a covariance from the jackknife over runs.
const MIN_RUNS: usize = 5;

/// Fit of one form at the lines of the excitation.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LineFit {
    /// The operator.
    pub operator: FamilyOperator,
    /// Covariance of the coordinates by rows, with the contribution of the prior: from the jackknife over runs if there
    /// are at least five runs and a single input, otherwise from the variances of the lines.
    pub covariance: Option<Vec<f64>>,
    /// Ratio of the posterior to the prior variance of each coordinate: 0 without a prior, 1 at a bound.
    pub prior_shares: Vec<f64>,
    /// chi^2 of the lines.
    pub chi_squared: f64,
    /// Number of real equations (two per line) minus the number of coordinates; with a single input, coordinates at a
    /// bound are not subtracted.
    pub degrees_of_freedom: usize,
    /// chi^2 of each run for the fit to the other runs; `None` for fewer than three runs, for several inputs, or if one
    /// of these fits fails.
    pub held_out: Option<Vec<f64>>,
    /// Termination of the search.
    pub termination: Termination,
    /// Deviation of the lines from the form that their errors do not explain; `None` if there is none, and for several
    /// inputs.
    #[serde(default)]
    pub misfit: Option<Misfit>,
    /// Covariance from the variances of the lines.
    pub(super) by_lines: Option<Vec<f64>>,
    /// Coordinates of the further inputs.
    #[serde(default)]
    pub(super) of_channels: Vec<f64>,
}

impl LineFit {
    /// Returns chi^2 per degree of freedom; `None` for zero degrees of freedom.
    pub fn reduced_chi_squared(&self) -> Option<f64> {
        (self.degrees_of_freedom > 0).then(|| self.chi_squared / self.degrees_of_freedom as f64)
    }

    /// Returns the sum of chi^2 over the held-out runs.
    pub fn held_out_total(&self) -> Option<f64> {
        self.held_out.as_ref().map(|runs| runs.iter().sum())
    }

    /// Creates the fit of the operator from a fit with several inputs.
    pub(super) fn from_channels(operator: FamilyOperator, found: &ChannelMinimum, penalty: &[Penalty]) -> Self {
        let (p, q) = (operator.coordinates().len(), found.coordinates.len());
        let by_lines = found.covariance.as_ref().map(|c| -> Vec<f64> {
            let pairs = (0..p).flat_map(|i| (0..p).map(move |j| i * q + j));
            pairs.map(|at| c[at]).collect()
        });
        let mut prior_shares = vec![0.0; p];
        for penalty in penalty {
            let variance = by_lines.as_ref().map(|c| c[penalty.index * (p + 1)]);
            prior_shares[penalty.index] = match variance {
                Some(v) if v > 0.0 => (v * penalty.curvature(&found.coordinates)).min(1.0),
                _ => 1.0,
            };
        }
        let excess = found.excess();
        Self {
            covariance: by_lines.as_ref().map(|c| c.iter().map(|v| v * excess).collect()),
            prior_shares,
            chi_squared: found.chi_squared,
            degrees_of_freedom: found.degrees_of_freedom(),
            held_out: None,
            termination: found.minimum.termination,
            misfit: None,
            by_lines,
            of_channels: found.coordinates[p..].to_vec(),
            operator,
        }
    }

    /// Returns the coordinates of the operator and of the further inputs, in the order of eta.
    pub(super) fn elements(&self) -> Vec<f64> {
        [self.operator.coordinates(), &self.of_channels].concat()
    }

    /// Returns the names, values and first-order standard errors of the parameters; infinite values have no standard
    /// error.
    pub fn parameters(&self) -> Vec<(&'static str, Estimate)> {
        let all = self.operator.named_estimates(self.covariance.as_deref());
        all.into_iter()
            .map(|(named, estimate)| (named.name, estimate))
            .collect()
    }
}

/// Fits one form to the lines.
///
/// # Errors
/// [`IdentError::NoFiniteLoss`].
pub(super) fn line_fit(
    lines: &LineData<'_>,
    criterion: &ResponseCriterion<'_>,
    search: &SearchOptions,
) -> Result<(LineFit, ResponseMinimum), IdentError> {
    let found = criterion.fit(search)?;
    let (form, neuromuscular) = (criterion.form, criterion.neuromuscular);
    let operator_of = |x: &[f64]| FamilyOperator::new(form, neuromuscular, x);
    let runs = lines.run_count();
    let (mut others, mut held_out) = (Vec::new(), Vec::new());
    if runs >= 3 {
        // Each fit without one run serves as a held-out prediction and as a replication of the jackknife.
        for run in 0..runs {
            let points = lines.without_run(run);
            let Some(without) = criterion.with_points(&points).fit_from(&found.coordinates, search) else {
                continue;
            };
            let operator = operator_of(&without.coordinates)?;
            held_out.push(lines.chi_squared_of_run(run, |omega| criterion.sampled_response(&operator, omega)));
            others.push(without.coordinates);
        }
    }
    let prior_shares = criterion.prior_shares(&found);
    let by_runs = (runs >= MIN_RUNS && others.len() == runs)
        .then(|| jackknife(&others))
        .flatten();
    let by_lines = criterion.covariance(&found);
    let covariance = by_lines.clone().map(|by_lines| match by_runs {
        // All replications use the same prior, so their scatter does not include its contribution.
        Some(mut covariance) => {
            add_prior_contribution(&mut covariance, 1.0, &criterion.penalty, &found.coordinates, &by_lines);
            covariance
        }
        None => by_lines,
    });
    let free = (found.coordinates.iter().zip(&criterion.limits))
        .filter(|(x, (low, high))| low < *x && *x < high)
        .count();
    let operator = operator_of(&found.coordinates)?;
    let degrees_of_freedom = (2 * lines.points.len()).saturating_sub(free);
    let misfit = by_lines.as_ref().and_then(|covariance| {
        let sampling = (criterion.sample_time, criterion.intersample);
        let fitted = (found.chi_squared, degrees_of_freedom);
        Misfit::of(&lines.points, &operator, sampling, fitted, covariance)
    });
    let fit = LineFit {
        operator,
        covariance,
        prior_shares,
        chi_squared: found.chi_squared,
        degrees_of_freedom,
        held_out: (held_out.len() == runs && runs >= 3).then_some(held_out),
        termination: found.termination,
        misfit,
        by_lines,
        of_channels: Vec::new(),
    };
    Ok((fit, found))
}

/// Sorts the forms in the order of preference for equal fits: forms with fewer coordinates first; for the same number
/// of coordinates, the forms of the family before alternative forms.
pub(super) fn sort_by_simplicity(forms: &mut [Form]) {
    forms.sort_by_key(|form| (form.coordinate_count(), *form));
}
