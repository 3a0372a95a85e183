//! Error bars that remain valid if the model is wrong, from the scores of runs or of blocks of runs.
//!
//! With `g_c = sum psi eps` and `G_c = sum psi psi'` over cluster c, G as the sum of all G_c and P as the curvature of
//! the prior, one Gauss-Newton step from the estimate of all data gives the estimate without this cluster:
//!
//! `eta_(c) = eta - (G + P - G_c)^-1 g_c`
//!
//! The covariance is the jackknife over n clusters, `(n-1)/n sum (eta_(c) - mean)^2` (the estimator CR3 of the
//! sandwich: R. M. Bell and D. F. McCaffrey, *Survey Methodology* 28 (2002) 169-181; J. G. MacKinnon, M. O. Nielsen and
//! M. D. Webb, *J. Econometrics* 232 (2023) 272-299). It is valid for any correlation of the residuals within a
//! cluster, and is not too small if there are few clusters. Intervals use Student's distribution with n - 1 degrees of
//! freedom.
//!
//! **The prior** P is a measurement that no cluster contains. Its contribution `kappa sigma^2 H^-1 P H^-1`, with
//! `H = G + P`, is added.

use hoid_model::{Complex64, FamilyOperator, uncertainty::variance_along};
use hoid_numerics::statistics::mean;
use nalgebra::DMatrix;

use super::{
    clusters::ClusterKind,
    jackknife::{add_prior_contribution, jackknife},
    layout::FamilyLayout,
    prediction_fit::PredictionFit,
};
use crate::{
    criterion::Workspace, grey_box::parametrisation::Parametrisation, linalg::least_squares::solve_symmetric,
    optimize::Linearisation,
};

/// Number of frequencies at which two responses are compared.
const POINT_COUNT: usize = 24;
/// Frequencies at which the errors of the response are averaged, rad/s.
pub(super) const BAND_FREQUENCIES_RAD_S: [f64; 5] = [0.7, 1.3, 2.4, 4.3, 8.0];

/// Covariances of eta: from clusters, including the contribution of the prior, and from the model.
#[derive(Debug, Clone)]
pub(super) struct Covariances {
    pub clustered: Vec<f64>,
    pub model_based: Vec<f64>,
    /// Additional variances of single elements. They are not part of the covariance, since the response is known more
    /// accurately than single elements, whose errors are correlated.
    pub extra_variance: Vec<f64>,
}

impl Covariances {
    /// Extracts the covariance of the operator coordinates in one record from the covariance of eta.
    pub fn of_operator(of_eta: &[f64], layout: &FamilyLayout, record: usize) -> Vec<f64> {
        let (p, places) = (
            layout.limits().len(),
            &layout.positions(record)[..layout.coordinate_count()],
        );
        let pairs = places.iter().flat_map(|&i| places.iter().map(move |&j| i * p + j));
        pairs.map(|at| of_eta[at]).collect()
    }

    /// Adds the squared bias `d d'`, where d is the difference from another estimate.
    ///
    /// The prediction error fit is biased if its noise model is wrong. The scatter between runs does not show this
    /// bias, but an estimate without that noise model does. The errors are then computed from the mean squared error,
    /// variance plus squared bias, with d as the bias. The full `d d'` is used, and not `d d'/3`, which would apply to
    /// a true value anywhere between the two estimates, since only one of them is biased. Elements at a bound remain
    /// unchanged.
    ///
    /// The errors are linearised, but the other estimate may be far along a ridge of the criterion, for example if gain
    /// and lag increase together. The linearised change `J d`, where J is the gradient of the response, is then not the
    /// difference of the responses. In this case d is replaced by the [least squares
    /// difference](differences_from_response) that explains the difference of the responses.
    pub fn add_bias(&mut self, fit: &PredictionFit<'_>, other: &[f64]) {
        let p = fit.parameter_count();
        let mut difference = vec![0.0; p];
        let elements = fit.layout().operator_element_count();
        let (found, of_channels): (Vec<_>, Vec<_>) =
            (differences(fit, other).into_iter()).partition(|(place, _)| *place < elements);
        let found = differences_from_response(fit, other, &found).unwrap_or(found);
        for (place, d) in found.into_iter().chain(of_channels) {
            difference[place] = d;
        }
        for i in 0..p {
            for j in 0..p {
                self.clustered[i * p + j] += difference[i] * difference[j];
            }
        }
    }

    /// Adds `weight d^2` to the variances of the elements for which `counts` is true; d is the difference from another
    /// estimate.
    pub fn add_extra_variance(
        &mut self,
        fit: &PredictionFit<'_>,
        other: &[f64],
        weight: f64,
        counts: impl Fn(usize) -> bool,
    ) {
        for (place, d) in differences(fit, other) {
            if counts(place) {
                self.extra_variance[place] += weight * d * d;
            }
        }
    }

    /// Widens the profile likelihood intervals, which account only for the inflation kappa. If the variance of an
    /// element exceeds the inflated model-based variance, the distances of the interval ends from the estimate are
    /// multiplied by the ratio of the two standard errors.
    pub fn widen(&self, fit: &PredictionFit<'_>, profiles: &mut [Option<(f64, f64)>]) {
        let p = fit.parameter_count();
        for (i, profile) in profiles.iter_mut().enumerate() {
            let Some((low, high)) = profile else { continue };
            let ratio =
                (self.clustered[i * p + i] + self.extra_variance[i]) / (fit.inflation * self.model_based[i * p + i]);
            if ratio.is_finite() && ratio > 1.0 {
                let (x, (least, most)) = (fit.eta()[i], fit.criterion.limits[i]);
                *low = (x - (x - *low) * ratio.sqrt()).max(least);
                *high = (x + (*high - x) * ratio.sqrt()).min(most);
            }
        }
    }
}

/// Returns the relative standard errors of the response at [`BAND_FREQUENCIES_RAD_S`], the band of manual control.
pub(super) fn response_errors(
    operator: &FamilyOperator,
    covariance: Option<&[f64]>,
) -> Option<[f64; BAND_FREQUENCIES_RAD_S.len()]> {
    let covariance = covariance?;
    Some(BAND_FREQUENCIES_RAD_S.map(|omega| {
        let [[gain, _], [_, phase]] = operator.response_and_gradient(omega).relative_covariance(covariance);
        (gain + phase).sqrt()
    }))
}

/// Returns the index and the difference from another estimate for each element of the operator and of its channels that
/// is not at a bound and that the other estimate contains.
fn differences(fit: &PredictionFit<'_>, other: &[f64]) -> Vec<(usize, f64)> {
    let elements = fit.layout().noise_offset();
    let free = fit.free_elements().into_iter().filter(|place| *place < elements);
    free.filter_map(|place| Some((place, fit.eta()[place] - other.get(place)?)))
        .collect()
}

/// Largest ratio of `J d` to the difference of two responses for which d is not replaced.
const MAX_LINEARISATION_RATIO: f64 = 2.0;
/// Relative increase in the diagonal of `J' J`, which makes it regular.
const RELATIVE_RIDGE: f64 = 1e-9;

/// Returns the least squares solution of `J d = H - H_other`, relative to |H|, over the band of manual control and an
/// octave on each side. `None` if the given differences already explain the difference of the responses, or if some
/// elements belong to single records.
fn differences_from_response(
    fit: &PredictionFit<'_>,
    other: &[f64],
    differences: &[(usize, f64)],
) -> Option<Vec<(usize, f64)>> {
    let layout = fit.layout();
    let places = &layout.positions(0)[..layout.coordinate_count()];
    if layout.operator_element_count() != places.len() {
        return None;
    }
    let (here, there) = (layout.operator(fit.eta(), 0).ok()?, layout.operator(other, 0).ok()?);
    let at = |place: &usize| places.iter().position(|p| p == place);
    let coordinates: Vec<usize> = differences.iter().filter_map(|(place, _)| at(place)).collect();
    let d: Vec<f64> = differences.iter().map(|(_, d)| *d).collect();
    let found = solve_differences(&here, &there, &coordinates, &d)?;
    Some(
        differences
            .iter()
            .zip(found)
            .map(|((place, _), d)| (*place, d))
            .collect(),
    )
}

/// Like [`differences_from_response`], for two operators and the differences `d` of these coordinates.
fn solve_differences(
    here: &FamilyOperator,
    there: &FamilyOperator,
    coordinates: &[usize],
    d: &[f64],
) -> Option<Vec<f64>> {
    let q = coordinates.len();
    let (mut total, mut linear) = (Linearisation::empty(q), 0.0);
    let (low, high) = (0.5 * BAND_FREQUENCIES_RAD_S[0], 2.0 * BAND_FREQUENCIES_RAD_S[4]);
    for k in 0..POINT_COUNT {
        let omega = low * (high / low).powf(k as f64 / (POINT_COUNT - 1) as f64);
        let response = here.response_and_gradient(omega);
        let slopes: Vec<Complex64> = (coordinates.iter())
            .map(|&i| response.gradient[i] / response.value)
            .collect();
        let off = (response.value - there.response(omega)) / response.value;
        linear += slopes.iter().zip(d).map(|(g, d)| g * d).sum::<Complex64>().norm_sqr();
        total.add_complex(1.0, off, &slopes);
    }
    if linear <= MAX_LINEARISATION_RATIO * MAX_LINEARISATION_RATIO * total.sum_of_squares {
        return None;
    }
    (0..q).for_each(|i| total.gram[i * q + i] *= 1.0 + RELATIVE_RIDGE);
    solve_symmetric(&total.gram, &total.descent)
}

/// Returns the inverse of `G + P` by rows, over all elements that are not fixed.
///
/// Elements at a bound, such as `1/T_I = 0`, are included. Holding them there would make the errors of the other
/// elements too small, since the true value may be off the bound, and lead and gain depend on it.
fn inverse(fit: &PredictionFit<'_>) -> Option<Vec<f64>> {
    let p = fit.parameter_count();
    let sought = fit.unfixed_elements();
    let mut inverse = vec![0.0; p * p];
    for &i in &sought {
        let mut unit = vec![0.0; p];
        unit[i] = 1.0;
        let column = fit.solve(&sought, None, &unit)?;
        (0..p).for_each(|j| inverse[j * p + i] = column[j]);
    }
    Some(inverse)
}

/// True if the data and the prior determine all parameters.
pub(super) fn is_regular(fit: &PredictionFit<'_>) -> bool {
    inverse(fit).is_some()
}

/// Returns the covariances of a fit; `None` if its information matrix is singular.
pub(super) fn covariances(fit: &PredictionFit<'_>) -> Option<Covariances> {
    let p = fit.parameter_count();
    let inverse = inverse(fit)?;
    let model_based: Vec<f64> = inverse.iter().map(|g| g * fit.innovation_variance).collect();
    let scale = fit.innovation_variance * fit.inflation;
    let mut clustered: Vec<f64> = match fit.clusters.kind {
        ClusterKind::Runs => {
            // The contribution of the prior, H^-1 P H^-1; it is multiplied by the same inflated variance as the data.
            let mut open = vec![0.0; p * p];
            add_prior_contribution(&mut open, 1.0, &fit.criterion.penalty, fit.eta(), &inverse);
            match cluster_covariance(fit) {
                Some(by_runs) => by_runs.iter().zip(&open).map(|(j, open)| j + scale * open).collect(),
                // Only one run determines some combination of elements; the scatter of this combination is unknown.
                None => inverse.iter().map(|g| scale * g).collect(),
            }
        }
        // H^-1 G H^-1 + H^-1 P H^-1 = H^-1, with both terms inflated.
        ClusterKind::Blocks => inverse.iter().map(|g| scale * g).collect(),
    };
    // The lines contribute w H^-1 L H^-1, where w is their weight and L their part of H. The scatter between runs does
    // not include this term; for blocks, H^-1 includes it once with w = 1.
    let counted = if fit.clusters.kind == ClusterKind::Runs {
        0.0
    } else {
        1.0
    };
    let factor = scale * (fit.weight_of_lines - counted);
    if fit.weight_of_lines > 0.0 {
        add_line_contribution(&mut clustered, factor, fit, &inverse);
    }
    Some(Covariances {
        clustered,
        model_based,
        extra_variance: vec![0.0; p],
    })
}

/// Adds `factor H^-1 L H^-1`, where L is the information of the lines.
fn add_line_contribution(covariance: &mut [f64], factor: f64, fit: &PredictionFit<'_>, inverse: &[f64]) {
    let p = fit.parameter_count();
    let l = fit
        .criterion
        .linearise_additional(fit.eta(), &mut Workspace::default())
        .gram;
    let (inverse, l) = (
        DMatrix::from_row_slice(p, p, inverse),
        DMatrix::from_row_slice(p, p, &l),
    );
    // The product is symmetric, so the storage order does not matter.
    let part = &inverse * l * &inverse;
    covariance
        .iter_mut()
        .zip(&part)
        .for_each(|(c, part)| *c += factor * part);
}

/// Returns the jackknife covariance over clusters.
fn cluster_covariance(fit: &PredictionFit<'_>) -> Option<Vec<f64>> {
    let (parts, sought) = (&fit.clusters.parts, fit.unfixed_elements());
    let steps: Option<Vec<Vec<f64>>> = (parts.iter())
        .map(|(g, big)| fit.solve(&sought, Some(big), g))
        .collect();
    jackknife(&steps?)
}

/// Returns kappa: the ratio of the variance from clusters to the model-based variance of gain and phase, averaged over
/// the band of manual control, at least one. `None` for fewer than two clusters.
///
/// The data determine the response but hardly determine some coordinates. The ratio for single coordinates would depend
/// on the poorly determined ones, and on the chance scatter of a few clusters.
pub(super) fn inflation(fit: &PredictionFit<'_>) -> Option<f64> {
    let p = fit.parameter_count();
    let (clustered, inverse) = (cluster_covariance(fit)?, inverse(fit)?);
    // The model-based variance without the contribution of the prior: H^-1 G H^-1.
    let mut by_model = inverse.clone();
    add_prior_contribution(&mut by_model, -1.0, &fit.criterion.penalty, fit.eta(), &inverse);
    let operator = fit.layout().operator(fit.eta(), 0).ok()?;
    let places = &fit.layout().positions(0)[..fit.layout().coordinate_count()];
    let mut ratios = Vec::new();
    for omega in BAND_FREQUENCIES_RAD_S {
        let response = operator.response_and_gradient(omega);
        let parts: [fn(Complex64) -> f64; 2] = [|z| z.re, |z| z.im];
        for part in parts {
            let mut gradient = vec![0.0; p];
            for (&place, g) in places.iter().zip(&response.gradient) {
                gradient[place] += part(g / response.value);
            }
            let ratio = variance_along(&gradient, &clustered)
                / (variance_along(&gradient, &by_model) * fit.innovation_variance);
            if ratio.is_finite() {
                ratios.push(ratio);
            }
        }
    }
    let mean = mean(&ratios);
    mean.is_finite().then(|| mean.max(1.0))
}

#[cfg(test)]
mod tests {
    use hoid_model::{Form, operator_family::Coordinate};

    use super::*;

    #[test]
    fn bias_along_a_ridge_matches_the_response_difference() {
        // Two leads and a lag, for which only K T_L^2/T_I is well known in the band: a pilot who controls an
        // integrator.
        let coordinates = Form::Lead2Lag.coordinates(true);
        let of = |gain: f64, lead_s: f64, lag_rate: f64| {
            let x: Vec<f64> = (coordinates.iter())
                .map(|c| match c {
                    Coordinate::Gain => gain,
                    Coordinate::Lead => lead_s,
                    Coordinate::LagRate => lag_rate,
                    Coordinate::LogOmega => 11.0_f64.ln(),
                    Coordinate::LogZeta => 0.3_f64.ln(),
                    _ => 0.25,
                })
                .collect();
            FamilyOperator::new(Form::Lead2Lag, true, &x).unwrap()
        };
        let here = of(0.043, 1.27, 0.8);
        let all: Vec<usize> = (0..coordinates.len()).collect();
        let d = |there: &FamilyOperator| -> Vec<f64> {
            (here.coordinates().iter().zip(there.coordinates()))
                .map(|(a, b)| a - b)
                .collect()
        };
        let there = of(0.0094, 2.72, 0.001);
        let found = solve_differences(&here, &there, &all, &d(&there)).unwrap();
        // Sums of squares over the band, relative to the response: explained, linear and actual.
        let (mut explained, mut linear, mut actual) = (0.0, 0.0, 0.0);
        for k in 0..200 {
            let omega = 0.35 * (16.0_f64 / 0.35).powf(f64::from(k) / 199.0);
            let at = here.response_and_gradient(omega);
            let along = |d: &[f64]| at.gradient.iter().zip(d).map(|(g, d)| g * d).sum::<Complex64>();
            let size = at.value.norm_sqr();
            explained += along(&found).norm_sqr() / size;
            linear += along(&d(&there)).norm_sqr() / size;
            actual += (at.value - there.response(omega)).norm_sqr() / size;
        }
        assert!(
            explained <= 1.01 * actual && explained > 0.5 * actual,
            "{explained} {actual}"
        );
        assert!(linear > 25.0 * actual, "{linear} {actual}");
        // A small difference is not changed.
        let near = of(0.045, 1.27, 0.8);
        assert_eq!(solve_differences(&here, &near, &all, &d(&near)), None);
    }
}
