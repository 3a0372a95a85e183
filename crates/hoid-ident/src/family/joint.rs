//! The prediction error fit with the lines of the excitation as additional measurements of the response.
//!
//! In a closed loop an error in the noise model biases the prediction error fit; the fit at the lines has no such bias,
//! but larger errors. Let H_P and H_L be the responses of the two fits, and V_P and V_L the relative variances of these
//! responses. Without bias the difference `d = (H_L - H_P)/H_P` has the variance `V_L - V_P`, because an efficient
//! estimate is uncorrelated with d (J. A. Hausman, *Econometrica* 46 (1978) 1251-1271). If d also contains a bias of
//! variance `tau^2`, the estimate `H_P (1 + s d)` has the smallest mean squared error for
//!
//! `s = tau^2/(tau^2 + V_L - V_P)` with `tau^2 = max(0, D - (V_L - V_P))`, where D is the mean of |d|^2; hence
//! `s = max(0, 1 - 1/q)` with `q = mean of |d|^2/(V_L - V_P)`
//!
//! over the band of manual control (E. J. Green and W. E. Strawderman, *J. American Statistical Association* 86 (1991)
//! 1001-1006). The unbiased estimate is thus shrunk towards the biased estimate to the extent that the two agree.
//!
//! The fraction cannot be applied to the difference of the coordinates, since a gain, a lead and a lag compensate each
//! other along a curve. Instead, the lines are included in the criterion,
//!
//! `sum eps^2 + kappa sigma^2 w chi^2`, `w = s/(1 - s) V_L/V_P`.
//!
//! For a single coordinate the minimum of this criterion is at the fraction s of the difference. Parameters that the
//! lines do not determine are determined by the samples.

use std::{borrow::Cow, sync::Arc};

use hoid_numerics::statistics::mean;

use super::{
    channel_criterion::ChannelCriterion,
    covariances::{BAND_FREQUENCIES_RAD_S, Covariances, covariances, response_errors},
    layout::FamilyLayout,
    line_fit::LineFit,
    lines::LineData,
    prediction::PredictionProblem,
    prediction_fit::PredictionFit,
    prior::OperatorPrior,
    response_fit::{MeasuredResponse, ResponseCriterion},
};
use crate::{criterion::Workspace, grey_box::objective::AdditionalTerm, optimize::Objective};

/// Lower bound of `V_L - V_P` relative to V_L, needed because V_L and V_P are estimates.
const MIN_RELATIVE_DIFFERENCE: f64 = 0.25;
/// Minimum number of runs for a joint fit: the scatter of fewer runs does not determine the variances of the lines.
const MIN_RUNS: usize = 3;
/// Upper bound of the fraction s.
const MAX_LINE_SHARE: f64 = 0.9;

/// The measurements at the lines that are fitted together with the samples.
pub(super) enum LineMeasurements<'d> {
    /// Describing function: the response to the error as the only input.
    Response(LineData<'d>),
    /// The responses to several inputs.
    Channels(Box<ChannelCriterion>),
}

impl LineMeasurements<'_> {
    fn run_count(&self) -> usize {
        match self {
            Self::Response(data) => data.run_count(),
            Self::Channels(criterion) => criterion.run_count(),
        }
    }

    /// Returns chi^2 of the lines as a function of the elements of eta that precede the noise model, with all variances
    /// multiplied by `excess`.
    fn criterion(
        &self,
        layout: &FamilyLayout,
        excess: f64,
        delay_range_s: (f64, f64),
    ) -> Arc<dyn Objective + Send + Sync> {
        let data = match self {
            Self::Channels(criterion) => return Arc::new(criterion.as_ref().clone().without_prior(excess)),
            Self::Response(data) => data,
        };
        let points: Vec<MeasuredResponse> = (data.points.iter())
            .map(|point| MeasuredResponse {
                variance: point.variance * excess,
                ..*point
            })
            .collect();
        Arc::new(ResponseCriterion {
            points: Cow::Owned(points),
            ..ResponseCriterion::new(
                layout.form,
                layout.neuromuscular,
                &[],
                &OperatorPrior::none(),
                delay_range_s,
                (layout.sample_time, layout.intersample),
            )
        })
    }
}

/// Returns the fit that includes the lines; `None` if the two fits agree within their errors, if the search fails, or
/// with fewer than three runs.
pub(super) fn fit_with_lines<'a>(
    prediction: &PredictionProblem<'a>,
    fit: &PredictionFit<'a>,
    (lines, measured): (&LineFit, &LineMeasurements<'_>),
    workspace: &mut Workspace,
) -> Option<PredictionFit<'a>> {
    if measured.run_count() < MIN_RUNS {
        return None;
    }
    let layout = fit.layout();
    // If chi^2 of the best fit is larger than expected, the variances of the lines are too small.
    let excess = lines.reduced_chi_squared().unwrap_or(1.0).max(1.0);
    let weight = line_weight(fit, lines, excess)?;
    let mut criterion = fit.criterion.clone();
    criterion.additional = Some(AdditionalTerm {
        criterion: measured.criterion(layout, excess, prediction.delay_range_s),
        elements: layout.noise_offset(),
        weight: weight * fit.innovation_variance * fit.inflation,
    });
    let minimum = criterion.search(fit.eta().to_vec(), &prediction.search, None, workspace)?;
    let mut found = prediction.fit_at_minimum(criterion, minimum, workspace).ok()?;
    (found.inflation, found.weight_of_lines) = (fit.inflation, weight);
    Some(found)
}

/// Returns the weight w; `None` if it is zero or a variance is unknown.
fn line_weight(fit: &PredictionFit<'_>, lines: &LineFit, excess: f64) -> Option<f64> {
    let operator = fit.layout().operator(fit.eta(), 0).ok()?;
    let own = Covariances::of_operator(&covariances(fit)?.clustered, fit.layout(), 0);
    let of_prediction = response_errors(&operator, Some(&own))?.map(|error| error * error);
    let of_lines = response_errors(&lines.operator, lines.by_lines.as_deref())?.map(|error| excess * error * error);
    let q: Vec<f64> = (0..BAND_FREQUENCIES_RAD_S.len())
        .map(|i| {
            let [here, there] = [&operator, &lines.operator].map(|of| of.response(BAND_FREQUENCIES_RAD_S[i]));
            let expected = (of_lines[i] - of_prediction[i]).max(MIN_RELATIVE_DIFFERENCE * of_lines[i]);
            ((there - here) / here).norm_sqr() / expected
        })
        .collect();
    let share = (1.0 - 1.0 / mean(&q)).min(MAX_LINE_SHARE);
    let weight = share / (1.0 - share) * mean(&of_lines) / mean(&of_prediction);
    (weight.is_finite() && weight > 0.0).then_some(weight)
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        Detrend, FamilyOperator, Form, Record,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use super::*;
    use crate::{
        family::{FamilyEstimator, Intersample, layout::FamilyLayout},
        grey_box::objective::PhysicalCriterion,
        optimize::Objective,
    };

    const TRUTH: [f64; 5] = [0.09, 0.4, 2.420_368, -1.049_822, 0.28];

    /// Runs of C1 with a slow and strong remnant.
    fn runs(n: u64) -> Vec<Record> {
        let mut scenario = Scenario::condition(Condition::C1);
        scenario.remnant.time_constant_s = 0.3;
        scenario.remnant.strength = scenario.remnant.strength.with_level(Some(0.3), None).unwrap();
        let simulator = Simulator::new(&scenario).unwrap();
        let run = |replication| {
            let seed = RunSeed {
                seed: 11,
                replication,
                ..RunSeed::default()
            };
            simulator.run(seed, false).unwrap()
        };
        (0..n).map(run).collect()
    }

    #[test]
    fn lines_reduce_the_bias_of_a_wrong_noise_model() {
        let truth = FamilyOperator::new(Form::Lead, true, &TRUTH).unwrap();
        // If the remnant is modelled as white (nd = 0), the prediction error fit in the closed loop is biased.
        let fitted = |excitation: Option<&str>, nd: usize| {
            let estimator = FamilyEstimator {
                forms: vec![Form::Lead],
                excitation: excitation.map(str::to_owned),
                nd: Some(nd..=nd),
                prior: OperatorPrior::none(),
                ..FamilyEstimator::default()
            };
            let fit = estimator.fit(&runs(8)).unwrap();
            let found = &fit.operator(0).operator;
            let off = BAND_FREQUENCIES_RAD_S.map(|omega| (found.response(omega) / truth.response(omega) - 1.0).norm());
            off.into_iter().fold(0.0, f64::max)
        };
        let (biased, with_lines) = (fitted(None, 0), fitted(Some("f_t"), 0));
        assert!(with_lines < 0.7 * biased, "{with_lines} {biased}");
        // With the right noise model there is no bias to remove.
        let (alone, with_lines) = (fitted(None, 6), fitted(Some("f_t"), 6));
        assert!(with_lines < 1.3 * alone + 0.01, "{with_lines} {alone}");
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        let record = runs(1).remove(0).detrended(Detrend::Mean);
        let truth = FamilyOperator::new(Form::Lead, true, &TRUTH).unwrap();
        let ts = record.sample_time();
        let points = [0.8, 2.0, 5.0, 12.0].map(|omega_rad_s| MeasuredResponse {
            omega_rad_s,
            response: truth.response(omega_rad_s) * 1.1,
            variance: 1e-4,
        });
        let limits = [(-10.0, 10.0); 5];
        let layout = FamilyLayout::new((Form::Lead, true), (0, 2), 1, &[], &limits, (ts, Intersample::Auto));
        let data = crate::criterion::Data::of(std::slice::from_ref(&record));
        let mut criterion = PhysicalCriterion::new(layout, data, crate::InitialState::Estimate, 40);
        let measured = ResponseCriterion::new(
            Form::Lead,
            true,
            &points,
            &OperatorPrior::none(),
            (0.0, 1.0),
            (ts, Intersample::Auto),
        );
        criterion.additional = Some(AdditionalTerm {
            criterion: Arc::new(measured),
            elements: 5,
            weight: 0.3,
        });
        let eta = [&TRUTH[..4], &[0.2837, -0.9, 0.1]].concat();
        let mut workspace = Workspace::default();
        let at = criterion.linearise(&eta, &mut workspace);
        let additional = criterion.linearise_additional(&eta, &mut workspace);
        assert!(additional.sum_of_squares > 0.0 && additional.sum_of_squares < at.sum_of_squares);
        assert_eq!((additional.descent[5], additional.descent[6]), (0.0, 0.0));
        for i in 0..eta.len() {
            let mut value = |by: f64| {
                let mut moved = eta.clone();
                moved[i] += by;
                criterion.linearise(&moved, &mut workspace).sum_of_squares
            };
            let difference = -(value(1e-6) - value(-1e-6)) / 4e-6;
            let size = (at.gram[i * eta.len() + i] * at.sum_of_squares).sqrt();
            assert!(
                (at.descent[i] - difference).abs() < 1e-5 * size,
                "{i}: {} {difference}",
                at.descent[i]
            );
        }
    }
}
