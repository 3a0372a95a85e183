//! From records of a person to their operator: which form, its parameters, their errors, and what
//! they are worth. The steps are those of the [module](super).

use hoid_model::{
    Complex64, Detrend, FamilyOperator, Form, NotConvertible, PolynomialModel, Record, SampleTime, Structure, Verdict,
    operator_family::Coordinate, uncertainty::variance_along,
};
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

use super::{
    agreement::{Agreement, agreement},
    arx_response::arx_response,
    choice::{Candidate, FormFigures, choose},
    clusters::ClusterKind,
    covariances::{self, Covariances},
    judgement::{Judged, MOST_DAMPED, findings},
    line_fit::{LineFit, by_simplicity, line_fit},
    lines::LineData,
    noise::NoiseProducts,
    parameter::Known,
    prediction::{NoiseOrders, Prediction},
    prediction_fit::PredictionFit,
    prior::OperatorPrior,
    profile::profile_interval,
    response_fit::{MeasuredResponse, ResponseCriterion},
    result::{FamilyFit, FreeModel, OperatorOfRecord},
    sensitivity::rivals,
};
use crate::{
    Fit, IdentError, InitialState, SearchOptions,
    criterion::{Criterion, Data, Workspace, output_variance},
    fit::Physical,
    frequency::{DescribingFunction, DescriptionOptions, describe_runs},
    grey_box::parametrisation::Parametrisation,
    informative_data,
    judgement::residuals::ResidualMeasures,
    optimize::minimise,
};

/// Highest order of the noise model.
pub const HIGHEST_NOISE_ORDER: usize = 24;
/// Runs from which on each can be held out.
const FEWEST_HELD_OUT: usize = 3;
/// Most pairs (nc, nd) that are compared where there is an nc.
const MOST_NOISE_PAIRS: usize = 60;

/// What is to be estimated of a person, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct FamilyEstimator {
    /// The forms to choose from; one alone is fitted without a choice. Default all that are proper.
    pub forms: Vec<Form>,
    /// With the neuromuscular part. Default true.
    pub neuromuscular: bool,
    /// What is known before the data. Default [`OperatorPrior::population`].
    pub prior: OperatorPrior,
    /// Shortest and longest delay tau_e in s. Default 0.02 to 0.8.
    pub delay_range_s: (f64, f64),
    /// Orders nc of the noise model to choose from. Default 0.
    pub nc: std::ops::RangeInclusive<usize>,
    /// Orders nd of the noise model to choose from. Default 0 to 24.
    pub nd: std::ops::RangeInclusive<usize>,
    /// Channel of the recorded disturbance or target, for the fit at its lines.
    pub excitation: Option<String>,
    /// Period of the excitation in s; found from its lines where it is `None`.
    pub period_s: Option<f64>,
    /// Coordinates that each record has for itself; all others are common to the records.
    pub individual: Vec<Coordinate>,
    /// What the gain of a person varies by from one run to the next, as a part of it: it stands in
    /// the error bars of fewer than five records, whose blocks cannot show it. Default 0.06: between
    /// 4 and 9 % in repeated runs of three people, each left out in turn.
    pub run_to_run: f64,
    /// What is taken out of e and u of each record beforehand: an operator with a lag integrates an
    /// offset. Default their mean.
    pub detrend: Detrend,
    /// Initial states of each record. Default: estimated.
    pub initial_state: InitialState,
    /// Limits of the search.
    pub search: SearchOptions,
}

impl Default for FamilyEstimator {
    fn default() -> Self {
        Self {
            forms: Form::ALL.to_vec(),
            neuromuscular: true,
            prior: OperatorPrior::population(),
            delay_range_s: (0.02, 0.8),
            nc: 0..=0,
            nd: 0..=HIGHEST_NOISE_ORDER,
            excitation: None,
            period_s: None,
            individual: Vec::new(),
            run_to_run: 0.06,
            detrend: Detrend::Mean,
            initial_state: InitialState::Estimate,
            search: SearchOptions {
                tolerance: 1e-9,
                ..SearchOptions::default()
            },
        }
    }
}

/// A form with what was found of it.
struct Tried<'a> {
    form: Form,
    lines: Option<LineFit>,
    fit: Result<PredictionFit<'a>, IdentError>,
}

impl FamilyEstimator {
    /// Fits all records together.
    ///
    /// # Errors
    /// [`IdentError`] for records or options without meaning, and where no form could be fitted.
    /// What makes a result doubtful is part of it ([`FamilyFit::verdict`]).
    pub fn fit(&self, records: &[Record]) -> Result<FamilyFit, IdentError> {
        let described = self.excitation.as_ref().map(|channel| {
            let options = DescriptionOptions {
                excitation: Some(channel.clone()),
                period_s: self.period_s,
                ..DescriptionOptions::default()
            };
            describe_runs(records, &options).map(|found| found.function)
        });
        self.fit_beside(records, described)
    }

    /// As [`FamilyEstimator::fit`], with a describing function that was made elsewhere, or the
    /// reason why there is none: of other spans of the same runs, or with an offset that is no
    /// whole number of samples.
    ///
    /// # Errors
    /// As [`FamilyEstimator::fit`].
    pub fn fit_beside(
        &self,
        records: &[Record],
        describing: Option<Result<DescribingFunction, IdentError>>,
    ) -> Result<FamilyFit, IdentError> {
        let sample_time = informative_data::common_sample_time(records)?;
        let records: Vec<Record> = records.iter().map(|r| r.clone().detrended(self.detrend)).collect();
        let forms = self.sorted_forms()?;
        let highest = (*self.nc.end(), *self.nd.end());
        let pairs: Vec<(Form, bool)> = forms.iter().map(|form| (*form, self.neuromuscular)).collect();
        let first = Prediction::first_residual(&pairs, highest, self.delay_range_s, self.initial_state, sample_time)?;
        self.check(&records, first)?;

        let (describing, no_lines) = match describing {
            None => (None, None),
            Some(Ok(found)) => (Some(found), None),
            Some(Err(error)) => (None, Some(error.to_string())),
        };
        let lines = describing.as_ref().map(LineData::new);
        // It gives starts alone: the lines do as well.
        let response = match arx_response(&records) {
            Err(error) if lines.is_none() => return Err(error),
            found => found.unwrap_or_default(),
        };
        let prediction = Prediction {
            data: Data::of(&records),
            sample_time,
            initial: self.initial_state,
            first,
            delay_range_s: self.delay_range_s,
            prior: self.prior.clone(),
            individual: self.individual.clone(),
            search: self.search,
        };
        let mut workspace = Workspace::of_thread();
        let mut starts = Vec::new();
        for &form in &forms {
            starts.push(self.starts(form, lines.as_ref(), &response, sample_time)?);
        }
        let noise = self.noise_orders(&prediction, &forms, &starts, &mut workspace)?;
        let mut tried: Vec<Tried<'_>> = Vec::new();
        for (form, (line_fit, coordinates)) in forms.iter().zip(starts) {
            let fit = self.best_of(&prediction, *form, noise, &coordinates, &mut workspace);
            tried.push(Tried {
                form: *form,
                lines: line_fit,
                fit,
            });
        }
        let scale = CommonScale::of(&tried);
        let mut candidates: Vec<(usize, Candidate)> = tried
            .iter()
            .enumerate()
            .filter_map(|(i, t)| Some((i, candidate(t, lines.as_ref(), &scale, &mut workspace)?)))
            .collect();
        let figures: Vec<FormFigures> = tried.iter().map(|t| figures(t, &candidates)).collect();
        // A form that lacks a lag, where there is one, takes the neuromuscular poles for it.
        if candidates.iter().any(|(i, _)| !has_lost_its_muscles(&tried[*i])) {
            candidates.retain(|(i, _)| !has_lost_its_muscles(&tried[*i]));
        }
        let (places, only): (Vec<usize>, Vec<Candidate>) = candidates.into_iter().unzip();
        let chosen = choose(&only).and_then(|i| places.get(i).copied());
        let Some(chosen) = chosen else {
            return Err(tried
                .into_iter()
                .find_map(|t| t.fit.err())
                .unwrap_or(IdentError::NoFiniteLoss));
        };
        let Tried { form, lines, fit } = tried.swap_remove(chosen);
        let fit = fit?;
        self.result(
            form,
            &fit,
            lines,
            no_lines,
            describing.as_ref(),
            figures,
            &prediction,
            &mut workspace,
        )
    }

    fn sorted_forms(&self) -> Result<Vec<Form>, IdentError> {
        let mut forms: Vec<Form> = (self.forms.iter().copied())
            .filter(|form| form.is_proper(self.neuromuscular))
            .collect();
        by_simplicity(&mut forms);
        forms.dedup();
        if forms.is_empty() {
            return Err(IdentError::BadOption {
                option: "the forms of the operator".to_owned(),
                found: self.forms.iter().map(|f| f.name()).collect::<Vec<_>>().join(", "),
                expected: "a form that is no pure derivative without neuromuscular dynamics: gain, lag or lead-lag"
                    .to_owned(),
            });
        }
        Ok(forms)
    }

    fn check(&self, records: &[Record], first: usize) -> Result<(), IdentError> {
        let refuse = |option: &str, found: String, expected: &str| {
            Err(IdentError::BadOption {
                option: option.to_owned(),
                found,
                expected: expected.to_owned(),
            })
        };
        let (low, high) = self.delay_range_s;
        if !(low >= 0.0 && low <= high && high.is_finite()) {
            return refuse("the delay in s", format!("{low}..{high}"), "LO..HI with 0 <= LO <= HI");
        }
        if !(self.run_to_run.is_finite() && self.run_to_run >= 0.0) {
            let found = self.run_to_run.to_string();
            return refuse(
                "the variation from run to run",
                found,
                "a part of the gain, zero or more",
            );
        }
        let most = HIGHEST_NOISE_ORDER;
        for (name, range) in [("nc", &self.nc), ("nd", &self.nd)] {
            if range.is_empty() || *range.end() > most {
                let found = format!("{}..{}", range.start(), range.end());
                return refuse(
                    &format!("the noise order {name}"),
                    found,
                    "LO..HI within 0..24, LO <= HI",
                );
            }
        }
        let pairs = self.nc.clone().count() * self.nd.clone().count();
        if *self.nc.end() > 0 && pairs > MOST_NOISE_PAIRS {
            return refuse(
                "the noise orders",
                format!("{pairs} pairs of nc and nd"),
                "60 or fewer where nc is searched: narrow nc or nd",
            );
        }
        let orders = hoid_model::Orders {
            nb: 4,
            nd: *self.nd.end(),
            nf: 3,
            nk: 1,
            ..hoid_model::Orders::default()
        };
        for record in records {
            informative_data::check_record(
                Structure::BoxJenkins,
                &orders,
                record,
                first + 2 * (*self.nd.end() + 10),
            )?;
        }
        Ok(())
    }

    /// The fit at the lines, and coordinates to start from.
    #[allow(clippy::type_complexity)]
    fn starts(
        &self,
        form: Form,
        lines: Option<&LineData<'_>>,
        response: &[MeasuredResponse],
        sample_time: SampleTime,
    ) -> Result<(Option<LineFit>, Vec<Vec<f64>>), IdentError> {
        let of = |points| {
            ResponseCriterion::new(
                form,
                self.neuromuscular,
                points,
                &self.prior,
                self.delay_range_s,
                sample_time,
            )
        };
        let mut starts = Vec::new();
        let mut fitted = None;
        if let Some(lines) = lines {
            let (fit, found) = line_fit(lines, &of(&lines.points), &self.search, sample_time)?;
            starts.push(found.coordinates);
            fitted = Some(fit);
        }
        if !response.is_empty() {
            starts.push(of(response).fit(&self.search)?.coordinates);
        }
        Ok((fitted, starts))
    }

    /// The orders of the noise model, by Akaike's criterion, for the form that leaves least.
    fn noise_orders(
        &self,
        prediction: &Prediction<'_>,
        forms: &[Form],
        starts: &[(Option<LineFit>, Vec<Vec<f64>>)],
        workspace: &mut Workspace,
    ) -> Result<NoiseOrders, IdentError> {
        let highest = *self.nd.end();
        let mut best: Option<(f64, Form, Vec<f64>, NoiseProducts)> = None;
        for (&form, (_, coordinates)) in forms.iter().zip(starts) {
            for start in coordinates {
                let Ok(series) = prediction.unexplained((form, self.neuromuscular), start, workspace) else {
                    continue;
                };
                let products = NoiseProducts::new(&series, highest);
                let Some(loss) = products.fit(highest).map(|f| f.loss) else {
                    continue;
                };
                if best.as_ref().is_none_or(|(known, ..)| loss < *known) {
                    best = Some((loss, form, start.clone(), products));
                }
            }
        }
        let (_, form, start, products) = best.ok_or(IdentError::NoFiniteLoss)?;
        let autoregression = products.best_order(self.nd.clone()).ok_or(IdentError::NoFiniteLoss)?;
        if *self.nc.end() == 0 {
            return Ok((0, autoregression));
        }
        let mut least: Option<(f64, NoiseOrders)> = None;
        for nc in self.nc.clone() {
            for nd in self.nd.clone() {
                let Ok(fit) = prediction.fit((form, self.neuromuscular), (nc, nd), &start, workspace) else {
                    continue;
                };
                let value = fit.residuals as f64 * fit.loss.ln() + 2.0 * (nc + nd) as f64;
                if least.is_none_or(|(known, _)| value < known) {
                    least = Some((value, (nc, nd)));
                }
            }
        }
        least.map(|(_, orders)| orders).ok_or(IdentError::NoFiniteLoss)
    }

    fn best_of<'a>(
        &self,
        prediction: &Prediction<'a>,
        form: Form,
        noise: NoiseOrders,
        starts: &[Vec<f64>],
        workspace: &mut Workspace,
    ) -> Result<PredictionFit<'a>, IdentError> {
        let mut best: Option<PredictionFit<'a>> = None;
        let mut refusal = IdentError::NoFiniteLoss;
        for start in starts {
            match prediction.fit((form, self.neuromuscular), noise, start, workspace) {
                Ok(fit) if best.as_ref().is_none_or(|known| fit.objective() < known.objective()) => best = Some(fit),
                Ok(_) => {}
                Err(error) => refusal = error,
            }
        }
        best.ok_or(refusal)
    }

    #[allow(clippy::too_many_arguments)]
    fn result(
        &self,
        form: Form,
        fit: &PredictionFit<'_>,
        lines: Option<LineFit>,
        no_lines: Option<String>,
        describing: Option<&DescribingFunction>,
        forms: Vec<FormFigures>,
        prediction: &Prediction<'_>,
        workspace: &mut Workspace,
    ) -> Result<FamilyFit, IdentError> {
        let layout = fit.layout();
        let mut covariances = covariances::covariances(fit);
        if let Some(covariances) = &mut covariances {
            covariances.add_run_to_run(fit, self.run_to_run);
        }
        let quantile = quantile(fit.clusters.parts.len());
        let separate = if self.individual.is_empty() {
            1
        } else {
            prediction.data.len()
        };
        let error_ratio = covariances.as_ref().and_then(|c| largest_error_ratio(fit, c));
        let mut profiles = self.profiles(fit, covariances.as_ref(), quantile, workspace);
        let mut operators = Vec::with_capacity(separate);
        for record in 0..separate {
            operators.push(self.operator_of(fit, covariances.as_ref(), &profiles, quantile, record)?);
        }
        let agreement = lines.as_ref().and_then(|lines| agreement_of(&operators[0], lines));
        if let Some(covariances) = &mut covariances {
            match &lines {
                Some(lines) if separate == 1 => covariances.add_bias(fit, lines.operator.coordinates()),
                _ => {
                    for rival in rivals(prediction, fit, *self.nd.end(), workspace) {
                        covariances.add_bias(fit, &rival);
                    }
                }
            }
            covariances.widen(fit, &mut profiles);
            for (record, operator) in operators.iter_mut().enumerate() {
                *operator = self.operator_of(fit, Some(covariances), &profiles, quantile, record)?;
            }
        }
        let free_model = free_model(fit, workspace);
        let residuals = residuals(fit, workspace);
        let of_delay = layout.delays().first().copied().unwrap_or(0);
        let all_parameters: Vec<_> = operators.iter().flat_map(|o| o.parameters.clone()).collect();
        let verdict = Verdict::of(findings(&Judged {
            termination: fit.minimum.termination,
            delay: (fit.eta()[of_delay], layout.limits()[of_delay]),
            parameters: &all_parameters,
            residuals,
            lines: lines.as_ref(),
            no_lines: no_lines.as_deref(),
            agreement: agreement.as_ref(),
            free_model: free_model.as_ref(),
            loss: fit.loss,
            error_ratio,
            cluster_kind: fit.clusters.kind,
            clusters: fit.clusters.parts.len(),
            has_covariance: covariances.is_some(),
            response_error: response_error(&operators[0]),
        }));
        let noise = &fit.eta()[layout.operator_elements()..];
        Ok(FamilyFit {
            form,
            neuromuscular: self.neuromuscular,
            noise_orders: (layout.nc, layout.nd),
            noise: (noise[..layout.nc].to_vec(), noise[layout.nc..].to_vec()),
            operators,
            prior: self.prior.clone(),
            forms,
            coherent_share: describing.and_then(coherent_share),
            lines,
            no_lines,
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
            sample_time: layout.sample_time,
            verdict,
        })
    }

    /// Intervals by profile likelihood of the elements whose interval reaches the end of what is
    /// sought: there the criterion is no parabola.
    fn profiles(
        &self,
        fit: &PredictionFit<'_>,
        covariances: Option<&Covariances>,
        quantile: f64,
        workspace: &mut Workspace,
    ) -> Vec<Option<(f64, f64)>> {
        let p = fit.parameters();
        let elements = fit.layout().operator_elements();
        let mut profiles = vec![None; elements];
        let Some(covariances) = covariances else {
            return profiles;
        };
        for (i, profile) in profiles.iter_mut().enumerate() {
            let (coordinate, _) = fit.layout().elements[i];
            if !matches!(coordinate, Coordinate::LagRate | Coordinate::Lead | Coordinate::Droop) {
                continue;
            }
            let (low, _) = fit.criterion.limits[i];
            let x = fit.eta()[i];
            let s = covariances.clustered[i * p + i].max(0.0).sqrt();
            if x - quantile * s <= low {
                let step = if s > 0.0 { 0.5 * s } else { 0.05 };
                *profile = profile_interval(fit, i, step, quantile, workspace);
            }
        }
        profiles
    }

    fn operator_of(
        &self,
        fit: &PredictionFit<'_>,
        covariances: Option<&Covariances>,
        profiles: &[Option<(f64, f64)>],
        quantile: f64,
        record: usize,
    ) -> Result<OperatorOfRecord, IdentError> {
        let layout = fit.layout();
        let operator = layout.operator(fit.eta(), record)?;
        let k = layout.coordinates();
        let p = fit.parameters();
        let places = &layout.positions(record)[..k];
        let part = |c: &[f64]| -> Vec<f64> {
            places
                .iter()
                .flat_map(|&i| places.iter().map(move |&j| i * p + j))
                .map(|at| c[at])
                .collect()
        };
        let covariance = covariances.map(|c| part(&c.clustered));
        let model_based = covariances.map(|c| part(&c.model_based));
        let limits: Vec<(f64, f64)> = places.iter().map(|&i| layout.limits()[i]).collect();
        let known = Known {
            operator: &operator,
            covariance: covariance.as_deref(),
            prior_share: &places
                .iter()
                .map(|&i| prior_share(fit, model_based.as_deref(), places, i))
                .collect::<Vec<_>>(),
            limits: &limits,
            profile: &places.iter().map(|&i| profiles[i]).collect::<Vec<_>>(),
            quantile,
        };
        let parameters = known.parameters();
        let mapped = fit.criterion.model_of(fit.eta(), record)?;
        let of_theta = covariances.map(|c| {
            let all = layout.positions(record);
            let rows = 0..mapped.theta.len();
            let of = |row: usize, other: usize| -> f64 {
                let pairs = all.iter().enumerate().flat_map(|(i, &a)| {
                    let columns = &mapped.columns;
                    all.iter()
                        .enumerate()
                        .map(move |(j, &b)| columns[i][row] * c.clustered[a * p + b] * columns[j][other])
                });
                pairs.sum()
            };
            rows.clone()
                .flat_map(|row| rows.clone().map(move |other| (row, other)))
                .map(|(r, o)| of(r, o))
                .collect()
        });
        let held = vec![false; mapped.theta.len()];
        let estimates = parameters
            .iter()
            .map(|q| {
                let estimate = hoid_model::uncertainty::Estimate {
                    value: q.value,
                    standard_error: q.standard_error,
                };
                (q.name.clone(), estimate)
            })
            .collect();
        let polynomial_fit = Fit {
            model: PolynomialModel::new(Structure::BoxJenkins, mapped.orders, layout.sample_time, mapped.theta)?,
            covariance: of_theta,
            loss: fit.loss,
            innovation_variance: fit.innovation_variance,
            residuals: fit.residuals,
            states: fit.states,
            initial_state: self.initial_state,
            termination: fit.minimum.termination,
            start: "own".to_owned(),
            held,
            output_variance: output_variance(&fit.criterion.data, fit.criterion.first),
            robust: false,
            instrumented: false,
            physical: Some(Box::new(Physical {
                parameters: estimates,
                free: p,
                operator: Err(NotConvertible::OtherForm {
                    form: operator.form().to_string(),
                }),
                remnant: None,
            })),
        };
        Ok(OperatorOfRecord {
            operator,
            covariance,
            model_based,
            parameters,
            polynomial_fit,
        })
    }
}

/// Variance after the data over that before, of an element of eta.
fn prior_share(fit: &PredictionFit<'_>, model_based: Option<&[f64]>, places: &[usize], place: usize) -> f64 {
    let Some(penalty) = fit.criterion.penalty.iter().find(|p| p.place == place) else {
        return 0.0;
    };
    let Some((i, c)) = places.iter().position(|&q| q == place).zip(model_based) else {
        return 1.0;
    };
    let slope = if penalty.logarithmic {
        1.0 / fit.eta()[place]
    } else {
        1.0
    };
    // The weight is kappa sigma^2/s^2, the covariance sigma^2 H^-1: both inflated by kappa.
    let precision = penalty.weight * slope * slope / fit.innovation_variance;
    let variance = c[i * places.len() + i];
    // At a bound nothing is known of it but the bound.
    if variance > 0.0 {
        (variance * precision).min(1.0)
    } else {
        1.0
    }
}

/// Quantile of Student's distribution for 95 % with n clusters.
fn quantile(clusters: usize) -> f64 {
    let freedom = clusters.saturating_sub(1).max(1) as f64;
    StudentsT::new(0.0, 1.0, freedom).map_or(1.96, |t| t.inverse_cdf(0.975))
}

fn largest_error_ratio(fit: &PredictionFit<'_>, c: &Covariances) -> Option<f64> {
    let p = fit.parameters();
    let ratios = (0..fit.layout().operator_elements())
        .map(|i| (c.clustered[i * p + i] / c.model_based[i * p + i]).sqrt())
        .filter(|r| r.is_finite());
    ratios.max_by(f64::total_cmp)
}

fn agreement_of(operator: &OperatorOfRecord, lines: &LineFit) -> Option<Agreement> {
    let (one, other) = (operator.covariance.as_deref()?, lines.covariance.as_deref()?);
    let all = operator
        .operator
        .form()
        .coordinates(operator.operator.has_neuromuscular());
    let counts = |i: usize| {
        let of = |name: &str| operator.parameters.iter().any(|p| p.name == name && p.determined);
        match all[i] {
            Coordinate::Gain => true,
            Coordinate::Lead => of("T_L"),
            Coordinate::LagRate => of("T_I"),
            Coordinate::LogOmega => of("omega_nm"),
            Coordinate::LogZeta => of("zeta_nm"),
            Coordinate::Delay => of("tau_e"),
            Coordinate::Linear => of("c_1"),
            Coordinate::Quadratic => of("c_2"),
            Coordinate::Droop => of("alpha"),
        }
    };
    agreement(
        operator.operator.form(),
        operator.operator.has_neuromuscular(),
        (operator.operator.coordinates(), one),
        (lines.operator.coordinates(), other),
        counts,
    )
}

/// Box-Jenkins of the same orders and delay from the polynomials of the fit, for one operator.
fn free_model(fit: &PredictionFit<'_>, workspace: &mut Workspace) -> Option<FreeModel> {
    let layout = fit.layout();
    if layout.elements.iter().any(|(_, record)| record.is_some()) {
        return None;
    }
    let mapped = fit.criterion.model_of(fit.eta(), 0).ok()?;
    let criterion = Criterion {
        orders: mapped.orders,
        data: fit.criterion.data.clone(),
        initial: fit.criterion.initial,
        first: fit.criterion.first,
        weights: None,
    };
    let search = SearchOptions {
        tolerance: 1e-8,
        ..SearchOptions::default()
    };
    let found = minimise(&criterion, mapped.theta.clone(), &search, None, workspace)?;
    let n = fit.residuals as f64;
    let loss = found.at.sum_of_squares / n;
    let freedom = mapped.theta.len().checked_sub(fit.parameters()).filter(|f| *f > 0)?;
    let ratio = (n * (fit.loss / loss).ln() / fit.inflation).max(0.0);
    let distribution = ChiSquared::new(freedom as f64).ok()?;
    loss.is_finite().then(|| FreeModel {
        loss,
        likelihood_ratio: ratio,
        degrees_of_freedom: freedom,
        p_value: distribution.sf(ratio),
    })
}

fn residuals(fit: &PredictionFit<'_>, workspace: &mut Workspace) -> ResidualMeasures {
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

/// Mean squared coherence of the lines.
fn coherent_share(describing: &DescribingFunction) -> Option<f64> {
    let all: Option<Vec<f64>> = describing.lines.iter().map(|line| line.coherence).collect();
    let all = all.filter(|all| !all.is_empty())?;
    Some(all.iter().sum::<f64>() / all.len() as f64)
}

/// Smallest relative standard error of the response over the band of manual control.
fn response_error(of: &OperatorOfRecord) -> Option<f64> {
    let covariance = of.covariance.as_deref()?;
    let error = |omega: f64| {
        let response = of.operator.response_and_gradient(omega);
        let along = |part: fn(Complex64) -> f64| -> f64 {
            let gradient: Vec<f64> = response.gradient.iter().map(|g| part(g / response.value)).collect();
            variance_along(&gradient, covariance)
        };
        (along(|z| z.re) + along(|z| z.im)).sqrt()
    };
    covariances::BAND_RAD_S
        .iter()
        .map(|omega| error(*omega))
        .min_by(f64::total_cmp)
}

/// True where the neuromuscular poles have become two lags, by prediction error or at the lines.
fn has_lost_its_muscles(tried: &Tried<'_>) -> bool {
    let lags = |operator: &FamilyOperator| operator.neuromuscular().is_some_and(|(_, zeta)| zeta > MOST_DAMPED);
    let of_fit = tried
        .fit
        .as_ref()
        .ok()
        .and_then(|fit| fit.layout().operator(fit.eta(), 0).ok());
    of_fit.is_some_and(|operator| lags(&operator)) || tried.lines.as_ref().is_some_and(|l| lags(&l.operator))
}

/// One kappa and one innovation variance for all forms, so that their figures can be compared: the
/// median of the one, the least of the other.
struct CommonScale {
    inflation: f64,
    innovation_variance: f64,
}

impl CommonScale {
    fn of(tried: &[Tried<'_>]) -> Self {
        let fits = || tried.iter().filter_map(|t| t.fit.as_ref().ok());
        let mut all: Vec<f64> = fits().map(|fit| fit.inflation).collect();
        all.sort_by(f64::total_cmp);
        Self {
            inflation: all.get(all.len() / 2).copied().unwrap_or(1.0),
            innovation_variance: fits().map(|fit| fit.innovation_variance).fold(f64::INFINITY, f64::min),
        }
    }
}

/// What a parameter costs: Schwarz's `ln n`, and Akaike's 2 where there are too few runs to hold
/// any out. The form is then chosen to predict, since one that is too simple bends the response.
fn cost(n: f64, runs: usize) -> f64 {
    if runs >= FEWEST_HELD_OUT { n.ln() } else { 2.0 }
}

fn candidate(
    tried: &Tried<'_>,
    lines: Option<&LineData<'_>>,
    scale: &CommonScale,
    workspace: &mut Workspace,
) -> Option<Candidate> {
    let fit = tried.fit.as_ref().ok()?;
    let elements = fit.layout().operator_elements() as f64;
    let (held_out, criterion) = match (&tried.lines, lines) {
        (Some(of_lines), Some(lines)) => {
            let equations = (2 * lines.points.len() * lines.runs()) as f64;
            (
                of_lines.held_out.clone(),
                of_lines.chi_squared + elements * cost(equations, lines.runs()),
            )
        }
        _ => {
            let n = fit.residuals as f64;
            let held_out = held_out(fit, scale, workspace);
            let runs = held_out.as_ref().map_or(1, Vec::len);
            (held_out, n * fit.loss.ln() / scale.inflation + elements * cost(n, runs))
        }
    };
    Some(Candidate {
        form: tried.form,
        held_out,
        criterion,
    })
}

/// Squared prediction errors of each run under the fit without it, in units of the innovation
/// variance; for clusters that are runs.
fn held_out(fit: &PredictionFit<'_>, scale: &CommonScale, workspace: &mut Workspace) -> Option<Vec<f64>> {
    if fit.clusters.kind != ClusterKind::Runs {
        return None;
    }
    let others = covariances::without_each(fit)?;
    let of = |(run, eta): (usize, &Vec<f64>)| Some(fit.squares_of(eta, run, workspace)? / scale.innovation_variance);
    others.iter().enumerate().map(of).collect()
}

fn figures(tried: &Tried<'_>, candidates: &[(usize, Candidate)]) -> FormFigures {
    let own = candidates.iter().find(|(_, c)| c.form == tried.form).map(|(_, c)| c);
    FormFigures {
        form: tried.form,
        loss: tried.fit.as_ref().ok().map(|f| f.loss),
        criterion: own.map(|c| c.criterion),
        held_out: own.and_then(|c| c.held_out.as_ref()).map(|h| h.iter().sum()),
        chi_squared: tried.lines.as_ref().map(|l| l.chi_squared),
        degrees_of_freedom: tried.lines.as_ref().map(|l| l.degrees_of_freedom),
        converged: tried.fit.as_ref().is_ok_and(|f| f.minimum.termination.converged()),
    }
}
