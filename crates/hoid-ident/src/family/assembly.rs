//! Assembly of the result from the fits of all forms that have a weight: operators with their errors, averaged over
//! forms, the comparison of methods for the best form, and the verdict.
//!
//! The order matters: the methods are first compared with their own errors, and only then is the difference between
//! them added to the errors of the operator (`Covariances::add_bias`).

use hoid_model::{FamilyOperator, Finding, Form, Record, Verdict, operator_family::Coordinate};
use hoid_numerics::statistics::mean;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{
    agreement::{Agreement, AgreementMethod, MethodEstimate, agreement, coordinates_with_log_gain},
    channel::{ChannelFit, SeenChannel},
    channel_criterion::{ChannelInForm, ChannelLineFitter},
    channel_lines::have_separate_lines,
    channels::add_responses,
    choice::{FormFigures, evidence_for},
    covariances::response_errors,
    diagnostics::{DiagnosticInputs, LARGEST_RESPONSE_ERROR, findings},
    estimated::{EstimateErrors, EstimatedOperator, record_operator, weighed_form},
    instrumental::{InstrumentalFit, InstrumentalSearch},
    joint::{LineMeasurements, fit_with_lines},
    line_fit::LineFit,
    lines::LineData,
    parameter::is_dc_gain,
    prediction::PredictionProblem,
    prediction_fit::PredictionFit,
    result::{FamilyFit, FreeModel, OperatorInForm, WeighedForm},
    sensitivity::{
        EXTRA_DEVIATIONS_WITHOUT_LINES, EXTRA_WEIGHT_WITHOUT_LINES, LARGEST_PRIOR_SHARE_AT_LINES, alternative_fits,
    },
};
use crate::{
    IdentError, SearchOptions,
    criterion::{Criterion, Workspace},
    diagnostics::{
        constancy::{Constancy, Direction, physical_score_blocks},
        residuals::ResidualMeasures,
    },
    frequency::DescribingFunction,
    grey_box::parametrisation::Parametrisation,
    optimize::minimise,
};

/// The excitation data, and the fit of the best form at the lines.
pub(super) struct LineResults<'d> {
    pub describing: Option<&'d DescribingFunction>,
    /// Data for fits of several inputs at their lines; `None` if there is one input or if there are no lines.
    pub channels: Option<ChannelLineFitter<'d>>,
    /// Further inputs with a response, in the selected forms.
    pub in_form: Vec<ChannelInForm>,
    pub fit: Option<LineFit>,
    /// Reason why there is no fit, if one was requested.
    pub missing_reason: Option<String>,
}

/// The fit of a form other than the best one, with its weight in the averages.
pub(super) struct OtherForm<'a> {
    pub fit: PredictionFit<'a>,
    pub lines: Option<LineFit>,
    pub weight: f64,
}

/// The fit of the best form, and everything else that the result requires.
pub(super) struct ChosenForm<'p, 'a> {
    pub fit: PredictionFit<'a>,
    pub weight: f64,
    pub lines: LineResults<'p>,
    /// The other forms that have a weight.
    pub others: Vec<OtherForm<'a>>,
    /// Criteria of all compared forms.
    pub forms: Vec<FormFigures>,
    /// The forms with a gain at low frequency, and this gain in the first record.
    pub gains: Vec<(Form, f64)>,
    pub prediction: &'p PredictionProblem<'a>,
    /// Comparison of the forms of each further input.
    pub channels: Vec<ChannelFit>,
    /// The records, detrended.
    pub records: &'p [Record],
    /// Channel of the recorded excitation.
    pub excitation: Option<&'p str>,
    /// Relative variation of a person's gain from run to run; zero for records without noise, which are not from a
    /// person.
    pub run_to_run: f64,
    /// Highest order of the alternative noise models with which the estimate is compared.
    pub highest_order: usize,
}

impl<'a> ChosenForm<'_, 'a> {
    /// Assembles the result.
    ///
    /// # Errors
    /// The errors of the discrete-time model of an operator.
    pub fn result(self, workspace: &mut Workspace) -> Result<FamilyFit, IdentError> {
        let (fit, layout) = (&self.fit, self.fit.layout());
        let separate = if self.prediction.individual.is_empty() {
            1
        } else {
            self.prediction.data.len()
        };
        let noise_free = self.prediction.noise_free_share();
        let unseen = self.prediction.little_noise.is_none();
        let mut errors = EstimateErrors::of(fit, self.run_to_run, workspace);
        let error_ratio = errors.largest_error_ratio(fit);
        // Estimates with other noise models: their differences enter the errors and the tolerated difference between
        // methods.
        let others = alternative_fits(self.prediction, fit, self.highest_order, workspace);
        let (instrumental, no_instrumental) = match self.fit_instrumental(separate, workspace) {
            None => (None, None),
            Some(Ok(found)) => (Some(found), None),
            Some(Err(error)) => (None, Some(error.to_string())),
        };
        let mut agreement = None;
        if noise_free.is_none() {
            agreement = compare_methods(
                fit,
                &EstimatedOperator::of(fit, &errors, 0)?,
                self.lines.fit.as_ref(),
                instrumental.as_ref().filter(|found| found.termination.converged()),
                &others,
            );
        }
        let joint = self.fit_jointly(fit, self.lines.fit.as_ref(), separate, workspace);
        if let Some(joint) = &joint {
            errors = EstimateErrors::of(joint, self.run_to_run, workspace);
        }
        let found = joint.as_ref().unwrap_or(fit);
        if noise_free.is_none() {
            add_bias(&mut errors, found, self.lines.fit.as_ref(), separate, (&others, unseen));
        }
        let mut weighed = vec![self.weighed_form(found, &errors, self.weight, separate, self.lines.fit.as_ref())?];
        for other in &self.others {
            let form = self.weigh_form(other, separate, workspace)?;
            if form.operators.first().is_some_and(response_is_determined) {
                weighed.push(form);
            }
        }
        let forms = self.normalise_weights(&mut weighed);
        let dc_gain_share = self.dc_gain_share(&forms, &weighed[0]);
        let mut operators = Vec::with_capacity(separate);
        for record in 0..separate {
            operators.push(record_operator(found, &errors, (&weighed, dc_gain_share), record)?);
        }
        let free_model = match noise_free {
            None => fit_free_model(fit, workspace),
            Some(_) => None,
        };
        let channels = add_responses(self.channels.clone(), self.prediction, found, &errors)?;
        let residuals = residual_measures(fit, workspace);
        let of_delay = layout.delay_indices().first().copied().unwrap_or(0);
        let all_parameters: Vec<_> = operators.iter().flat_map(|o| o.parameters.clone()).collect();
        let verdict = Verdict::of(findings(&DiagnosticInputs {
            termination: fit.minimum.termination,
            delay: (found.eta()[of_delay], layout.limits()[of_delay]),
            parameters: &all_parameters,
            prior: &self.prediction.prior,
            residuals,
            noise_free,
            not_constant: constancy_finding(fit, self.records, self.run_to_run, workspace),
            lines: self.lines.fit.as_ref(),
            no_lines: self.lines.missing_reason.as_deref(),
            agreement: agreement.as_ref(),
            instrumental: instrumental.as_ref(),
            no_instrumental: no_instrumental.as_deref(),
            free_model: free_model.as_ref(),
            loss: fit.loss,
            error_ratio,
            cluster_kind: fit.clusters.kind,
            clusters: fit.clusters.parts.len(),
            has_covariance: errors.covariances.is_some(),
            apart: self.channels.is_empty() || self.prediction.channels.is_empty() || self.have_separate_lines(),
            response_error: response_errors(&operators[0].operator, operators[0].covariance.as_deref())
                .and_then(|errors| errors.into_iter().min_by(f64::total_cmp)),
            weighed: &weighed,
            dc_gain_share,
        }));
        let noise = &found.eta()[layout.noise_offset()..];
        Ok(FamilyFit {
            form: layout.form,
            neuromuscular: layout.neuromuscular,
            noise_orders: (layout.nc, layout.nd),
            noise: (noise[..layout.nc].to_vec(), noise[layout.nc..].to_vec()),
            operators,
            prior: self.prediction.prior.clone(),
            forms,
            weighed,
            channels,
            run_to_run: errors.run_to_run,
            coherent_share: self.lines.describing.and_then(coherent_share),
            lines: self.lines.fit,
            no_lines: self.lines.missing_reason,
            instrumental,
            no_instrumental,
            agreement,
            free_model,
            cluster_kind: fit.clusters.kind,
            clusters: fit.clusters.parts.len(),
            inflation: fit.inflation,
            error_ratio,
            loss: fit.loss,
            innovation_variance: fit.innovation_variance,
            residuals: fit.residuals,
            termination: fit.minimum.termination,
            intersample: layout.intersample,
            course_is_known: self.prediction.course_is_known,
            lead_s: 0.0,
            noise_free,
            little_noise: self.prediction.little_noise.is_some(),
            sample_time: layout.sample_time,
            verdict,
        })
    }

    /// Returns the prediction error fit that includes the lines; `None` without lines, without noise, if the records
    /// have separate operators, or if [`fit_with_lines`] returns none.
    fn fit_jointly(
        &self,
        fit: &PredictionFit<'a>,
        lines: Option<&LineFit>,
        separate: usize,
        workspace: &mut Workspace,
    ) -> Option<PredictionFit<'a>> {
        if separate > 1 || self.prediction.noise_free_share().is_some() {
            return None;
        }
        let data = match (&self.lines.channels, self.lines.describing) {
            (Some(at), _) => LineMeasurements::Channels(Box::new(at.criterion(fit.layout().form, &self.lines.in_form))),
            (None, Some(describing)) => LineMeasurements::Response(LineData::new(describing)),
            (None, None) => return None,
        };
        fit_with_lines(self.prediction, fit, (lines?, &data), workspace)
    }

    /// Returns the evidence for the forms in which the gain K has the same meaning or the same value as in the best
    /// form. A form with a pure integration has no such gain. It is evidence against the K of a form with a lag, which
    /// is then infinite, but not against the K of a form without one.
    fn dc_gain_share(&self, forms: &[FormFigures], best: &WeighedForm) -> f64 {
        let has_lag = best.form.has_lag();
        let has_gain = |form: Form| has_lag || self.gains.iter().any(|(of, _)| *of == form);
        let counted = forms.iter().filter(|f| has_gain(f.form));
        evidence_for(counted, |form| {
            form.has_lag() == has_lag || self.has_same_gain(form, best)
        })
    }

    /// True if the gain of a form at low frequency is within one standard error of the gain of the best form. A form
    /// whose lag is at the end of its search range describes the same person as a form without it.
    fn has_same_gain(&self, form: Form, best: &WeighedForm) -> bool {
        let other = self.gains.iter().find(|(of, _)| *of == form);
        let own = best
            .of(0)
            .and_then(|found| found.parameters.iter().find(|p| is_dc_gain(&p.name)));
        let (Some((_, other)), Some(own)) = (other, own) else {
            return false;
        };
        own.standard_error.is_some_and(|s| (other - own.value).abs() <= s)
    }

    /// Same as [`have_separate_lines`].
    fn have_separate_lines(&self) -> bool {
        let asked = self
            .channels
            .iter()
            .map(|found| SeenChannel::new(found.name.clone(), found.role));
        let lines = self.lines.channels.as_ref().map(|at| at.lines.as_ref());
        have_separate_lines(lines, &asked.collect::<Vec<_>>())
    }

    /// Estimates one operator for all records by refined instrumental variables with the recorded excitation; `None`
    /// without an excitation, without noise, with separate operators, or with further inputs.
    fn fit_instrumental(
        &self,
        separate: usize,
        workspace: &mut Workspace,
    ) -> Option<Result<InstrumentalFit, IdentError>> {
        let channel = self
            .excitation
            .filter(|_| separate == 1 && self.prediction.noise_free_share().is_none() && self.channels.is_empty())?;
        let own = self.fit.layout().coordinates_of(self.fit.eta(), 0);
        let auxiliary = match &self.lines.fit {
            Some(lines) => {
                let at_lines = lines.operator.coordinates().to_vec();
                let middle = at_lines.iter().zip(&own).map(|(a, b)| 0.5 * (a + b)).collect();
                vec![at_lines, own, middle]
            }
            None => vec![own],
        };
        let found = InstrumentalSearch::new(self.prediction, &self.fit, self.records, channel);
        Some(found.and_then(|method| method.fit(&auxiliary, workspace)))
    }

    /// Normalises the weights of the remaining forms to a sum of one, and returns the criteria of all forms with these
    /// weights.
    fn normalise_weights(&self, weighed: &mut [WeighedForm]) -> Vec<FormFigures> {
        let total: f64 = weighed.iter().map(|form| form.weight).sum();
        weighed.iter_mut().for_each(|form| form.weight /= total);
        let weight = |of: Form| {
            weighed
                .iter()
                .find(|form| form.form == of)
                .map_or(0.0, |form| form.weight)
        };
        let figures = self.forms.iter().map(|figures| FormFigures {
            weight: weight(figures.form),
            ..figures.clone()
        });
        figures.collect()
    }

    /// Returns the operators of a form other than the best one, with errors computed in the same way as for the best
    /// form.
    fn weigh_form(
        &self,
        of: &OtherForm<'a>,
        separate: usize,
        workspace: &mut Workspace,
    ) -> Result<WeighedForm, IdentError> {
        let joint = self.fit_jointly(&of.fit, of.lines.as_ref(), separate, workspace);
        let found = joint.as_ref().unwrap_or(&of.fit);
        let mut errors = EstimateErrors::of(found, self.run_to_run, workspace);
        let others = alternative_fits(self.prediction, &of.fit, self.highest_order, workspace);
        if self.prediction.noise_free_share().is_none() {
            let unseen = self.prediction.little_noise.is_none();
            add_bias(&mut errors, found, of.lines.as_ref(), separate, (&others, unseen));
        }
        self.weighed_form(found, &errors, of.weight, separate, of.lines.as_ref())
    }

    /// Returns the form of a fit with its weight, its operators and the deviation of the lines from them.
    fn weighed_form(
        &self,
        found: &PredictionFit<'_>,
        errors: &EstimateErrors,
        weight: f64,
        separate: usize,
        lines: Option<&LineFit>,
    ) -> Result<WeighedForm, IdentError> {
        let sampling = (found.layout().sample_time, found.layout().intersample);
        weighed_form(found, errors, weight, separate, |operator| {
            let (misfit, describing) = (lines?.misfit.as_ref()?, self.lines.describing?);
            let is_common = separate == 1;
            is_common.then(|| misfit.deviation(&LineData::new(describing).points, operator, sampling))?
        })
    }
}

/// Adds the bias of the fit to its errors. With a fit at the lines, the bias is the difference between the two fits.
/// For coordinates that the lines do not determine, and without lines, it is taken from the differences from fits with
/// other noise models ([`super::sensitivity`]). If `unseen` is false, as with little noise, the additional variances
/// for fits without lines are omitted.
fn add_bias(
    errors: &mut EstimateErrors,
    fit: &PredictionFit<'_>,
    lines: Option<&LineFit>,
    separate: usize,
    (others, unseen): (&[Vec<f64>], bool),
) {
    let Some(covariances) = &mut errors.covariances else {
        return;
    };
    match lines {
        Some(lines) if separate == 1 => {
            let is_from_prior: Vec<bool> = (lines.prior_shares.iter())
                .map(|share| *share > LARGEST_PRIOR_SHARE_AT_LINES)
                .collect();
            covariances.add_bias(fit, &lines.elements());
            if let Some(misfit) = &lines.misfit {
                let places = fit.layout().positions(0);
                for (variance, place) in misfit.of_coordinates.iter().zip(places) {
                    covariances.extra_variance[*place] += variance;
                }
            }
            if is_from_prior.contains(&true) {
                for other in others {
                    covariances.add_extra_variance(fit, other, 1.0, |place| is_from_prior.get(place) == Some(&true));
                }
            }
        }
        _ => {
            for other in others {
                covariances.add_bias(fit, other);
                covariances.add_extra_variance(fit, other, EXTRA_WEIGHT_WITHOUT_LINES, |_| true);
            }
            let elements = fit.layout().elements.iter().enumerate().filter(|_| unseen);
            for (place, (coordinate, _)) in elements {
                let unseen = EXTRA_DEVIATIONS_WITHOUT_LINES.iter().find(|(of, _)| of == coordinate);
                covariances.extra_variance[place] += unseen.map_or(0.0, |(_, deviation)| deviation * deviation);
            }
        }
    }
    covariances.widen(fit, &mut errors.profiles);
}

/// Compares all methods over the gain and those determined coordinates whose prior shares are small both at the lines
/// and with instrumental variables; `None` if fewer than two methods have errors.
fn compare_methods(
    fit: &PredictionFit<'_>,
    operator: &EstimatedOperator,
    lines: Option<&LineFit>,
    instrumental: Option<&InstrumentalFit>,
    others: &[Vec<f64>],
) -> Option<Agreement> {
    let layout = fit.layout();
    let all = layout.form.coordinates(layout.neuromuscular);
    let model_based = operator.model_based.as_ref()?;
    let inflated: Vec<f64> = model_based.iter().map(|c| c * fit.inflation).collect();
    let reported = operator.covariance.as_deref()?;
    let mut sides = vec![MethodEstimate::of(
        AgreementMethod::PredictionError,
        &operator.operator,
        &inflated,
        reported,
    )];
    let mut shares = vec![0.0_f64; all.len()];
    let mut owe = |of: &[f64]| shares.iter_mut().zip(of).for_each(|(most, own)| *most = most.max(*own));
    if let Some(lines) = lines
        && let (Some(by_lines), Some(reported)) = (&lines.by_lines, &lines.covariance)
    {
        owe(&lines.prior_shares);
        sides.push(MethodEstimate::of(
            AgreementMethod::Lines,
            &lines.operator,
            by_lines,
            reported,
        ));
    }
    if let Some(instrumental) = instrumental
        && let Some(covariance) = &instrumental.covariance
    {
        owe(&instrumental.prior_shares);
        sides.push(MethodEstimate::of(
            AgreementMethod::Instrumental,
            &instrumental.operator,
            covariance,
            covariance,
        ));
    }
    let (p, places) = (all.len(), layout.positions(0));
    let mut bias = vec![0.0; p * p];
    for other in others {
        let x: Vec<f64> = places[..p].iter().map(|&at| other[at]).collect();
        let Ok(rival) = FamilyOperator::new(layout.form, layout.neuromuscular, &x) else {
            continue;
        };
        let d: Vec<f64> = (coordinates_with_log_gain(&rival).iter().zip(&sides[0].coordinates))
            .map(|(there, here)| there - here)
            .collect();
        for i in 0..p {
            (0..p).for_each(|j| bias[i * p + j] += d[i] * d[j]);
        }
    }
    let determined = |wanted: Coordinate| {
        let mut all = operator.parameters.iter();
        all.any(|p| p.name == wanted.parameter() && p.determined)
    };
    agreement(&all, &sides, &bias, |i| {
        shares[i] <= LARGEST_PRIOR_SHARE_AT_LINES && (all[i] == Coordinate::Gain || determined(all[i]))
    })
}

/// Fits a Box-Jenkins model with the orders and the delay of the fit, starting from the polynomials of the fit. `None`
/// with several operators or several inputs, if the search fails, or if the model has no additional parameters.
fn fit_free_model(fit: &PredictionFit<'_>, workspace: &mut Workspace) -> Option<FreeModel> {
    let layout = fit.layout();
    if layout.elements.iter().any(|(_, record)| record.is_some()) || !layout.channels.is_empty() {
        return None;
    }
    let mapped = fit.criterion.model_of(fit.eta(), 0).ok()?;
    let criterion = Criterion {
        orders: mapped.orders,
        data: fit.criterion.data.clone(),
        initial: fit.criterion.initial,
        first: fit.criterion.first,
        weights: None,
        further: Vec::new(),
    };
    let search = SearchOptions {
        tolerance: 1e-8,
        ..SearchOptions::default()
    };
    let found = minimise(&criterion, mapped.theta.clone(), &search, None, workspace)?;
    let n = fit.residuals as f64;
    let loss = found.linearisation.sum_of_squares / n;
    let freedom = mapped
        .theta
        .len()
        .checked_sub(fit.parameter_count())
        .filter(|f| *f > 0)?;
    let ratio = (n * (fit.loss / loss).ln() / fit.inflation).max(0.0);
    let distribution = ChiSquared::new(freedom as f64).ok()?;
    loss.is_finite().then(|| FreeModel {
        loss,
        likelihood_ratio: ratio,
        degrees_of_freedom: freedom,
        p_value: distribution.sf(ratio),
    })
}

fn residual_measures(fit: &PredictionFit<'_>, workspace: &mut Workspace) -> ResidualMeasures {
    let data = &fit.criterion.data;
    let first = fit.criterion.first;
    let all: Vec<Vec<f64>> = (0..data.len())
        .map(|record| fit.residuals_of(record, workspace).unwrap_or_default())
        .collect();
    let pairs: Vec<(&[f64], &[f64])> = all
        .iter()
        .zip(data)
        .map(|(eps, d)| (eps.as_slice(), &d.e[first..first + eps.len()]))
        .collect();
    ResidualMeasures::of(&pairs, fit.layout().sample_time.s())
}

/// Returns a warning if the person changes over the records.
fn constancy_finding(
    fit: &PredictionFit<'_>,
    records: &[Record],
    run_to_run: f64,
    workspace: &mut Workspace,
) -> Option<Finding> {
    let (layout, eta, free) = (fit.layout(), fit.eta(), fit.free_elements());
    let blocks = physical_score_blocks(&fit.criterion, eta, &free, workspace)?;
    let direction = |(place, (coordinate, record)): (usize, &(Coordinate, Option<usize>))| {
        let logarithm = matches!(coordinate, Coordinate::LogOmega | Coordinate::LogZeta);
        let mut vector = vec![0.0; eta.len()];
        vector[place] = 1.0;
        Direction {
            name: coordinate.name().to_owned(),
            unit: if *coordinate == Coordinate::Delay { " s" } else { "" },
            vector,
            delay: *coordinate == Coordinate::Delay,
            size: match record {
                Some(_) => 0.0,
                None if logarithm => 1.0,
                None => eta[place].abs(),
            },
        }
    };
    let elements = layout
        .elements
        .iter()
        .enumerate()
        .filter(|(place, _)| free.contains(place));
    Constancy {
        blocks: &blocks,
        directions: &elements.map(direction).collect::<Vec<_>>(),
        variance: fit.innovation_variance,
        run_to_run,
        sample_time_s: layout.sample_time.s(),
    }
    .change_finding(records)
}

/// Returns the mean of the squared coherence over the lines; `None` if the coherence is unknown.
fn coherent_share(describing: &DescribingFunction) -> Option<f64> {
    let all: Option<Vec<f64>> = describing.lines.iter().map(|line| line.coherence).collect();
    all.filter(|all| !all.is_empty()).map(|all| mean(&all))
}

/// True if the frequency response in a form other than the best one has small errors. If the parameters of a form
/// compensate each other, its response may be undetermined, and its errors are then meaningless.
fn response_is_determined(of: &OperatorInForm) -> bool {
    let errors = response_errors(&of.operator, of.covariance.as_deref());
    errors.is_some_and(|all| all.iter().sum::<f64>() < LARGEST_RESPONSE_ERROR * all.len() as f64)
}
