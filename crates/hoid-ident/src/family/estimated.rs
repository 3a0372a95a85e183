//! The operator of a record with its errors, from the estimate of eta and the prior.

use hoid_model::{FamilyOperator, NotConvertible, PolynomialModel, Structure, operator_family::Coordinate};

use super::{
    clusters::{ClusterKind, quantile},
    covariances::{self, Covariances},
    deviation::ResponseDeviation,
    parameter::{CoordinateEstimate, DC_GAIN_NAME, Parameter, is_dc_gain, min_weight},
    prediction_fit::PredictionFit,
    profile::profile_interval,
    result::{OperatorInForm, OperatorOfRecord, WeighedForm, title},
};
use crate::{
    Fit, IdentError,
    criterion::{Workspace, output_variance},
    fit::Physical,
    grey_box::parametrisation::Parametrisation,
};

/// Errors of the estimate of eta.
pub(super) struct EstimateErrors {
    /// Covariances of eta; `None` if the information matrix is singular.
    pub covariances: Option<Covariances>,
    /// Interval by profile likelihood of each element of the operator; `None` if it was not computed.
    pub profiles: Vec<Option<(f64, f64)>>,
    /// 97.5 % quantile of Student's distribution, for 95 % intervals.
    quantile: f64,
    /// Relative standard deviation of the mean gain of these runs due to the person's variation from run to run; zero
    /// if the scatter between the runs already includes this variation.
    pub run_to_run: f64,
}

impl EstimateErrors {
    pub fn of(fit: &PredictionFit<'_>, run_to_run: f64, workspace: &mut Workspace) -> Self {
        let covariances = covariances::covariances(fit);
        let quantile = quantile(fit.clusters.parts.len());
        // The scatter between runs includes the variation of the gain; blocks of few runs cannot show it.
        let gain = fit.layout().elements.iter().find(|(c, _)| *c == Coordinate::Gain);
        let runs = match gain {
            Some((_, Some(_))) => 1,
            _ => fit.criterion.data.len(),
        };
        Self {
            profiles: profiles(fit, covariances.as_ref(), quantile, workspace),
            covariances,
            quantile,
            run_to_run: match fit.clusters.kind {
                ClusterKind::Runs => 0.0,
                ClusterKind::Blocks => run_to_run / (runs as f64).sqrt(),
            },
        }
    }

    /// Returns the 97.5 % quantile of Student's distribution, for 95 % intervals.
    pub fn quantile(&self) -> f64 {
        self.quantile
    }

    /// Returns the largest ratio of a standard error from clusters to a model-based standard error.
    pub fn largest_error_ratio(&self, fit: &PredictionFit<'_>) -> Option<f64> {
        let (c, p) = (self.covariances.as_ref()?, fit.parameter_count());
        let ratios = (0..fit.layout().operator_element_count())
            .map(|i| (c.clustered[i * p + i] / c.model_based[i * p + i]).sqrt())
            .filter(|r| r.is_finite());
        ratios.max_by(f64::total_cmp)
    }
}

/// Returns the interval of the delay if the interval of the lead reaches its lower bound, zero; `None` otherwise, or
/// for other elements.
///
/// Near `T_L = 0` a lead and a delay change the response in the same way, so the information matrix determines only
/// `tau_e - k T_L`, with k = 1 for one lead. The interval of T_L from the profile likelihood therefore extends the
/// interval of tau_e by `k T_L`. With T_L fixed, the delay has the conditional variance `c_tt - c_tL^2/c_LL`, and
/// `k = c_tL/c_LL`.
fn delay_interval(
    fit: &PredictionFit<'_>,
    errors: &EstimateErrors,
    places: &[usize],
    place: usize,
) -> Option<(f64, f64)> {
    let (elements, p) = (&fit.layout().elements, fit.parameter_count());
    let is = |i: usize, coordinate: Coordinate| elements.get(i).is_some_and(|(c, _)| *c == coordinate);
    let lead = places.iter().copied().find(|&i| is(i, Coordinate::Lead))?;
    let x = fit.eta();
    let (shortest, longest) = errors.profiles[lead].filter(|_| is(place, Coordinate::Delay))?;
    let covariances = errors.covariances.as_ref()?;
    let c = |i: usize, j: usize| covariances.clustered[i * p + j];
    let per_lead = c(place, lead) / c(lead, lead);
    let conditional = c(place, place) - per_lead * c(place, lead) + covariances.extra_variance[place];
    let own = errors.quantile * conditional.max(0.0).sqrt();
    let (below, above) = (per_lead * (x[lead] - shortest), per_lead * (longest - x[lead]));
    let (low, high) = fit.criterion.limits[place];
    let found = (
        (x[place] - own.hypot(below)).max(low),
        (x[place] + own.hypot(above)).min(high),
    );
    (found.0.is_finite() && found.1.is_finite()).then_some(found)
}

/// Returns intervals by profile likelihood for each lag rate, lead and droop whose interval reaches the lower end of
/// the search range, where the criterion is not parabolic; `None` for other elements.
fn profiles(
    fit: &PredictionFit<'_>,
    covariances: Option<&Covariances>,
    quantile: f64,
    workspace: &mut Workspace,
) -> Vec<Option<(f64, f64)>> {
    let p = fit.parameter_count();
    let elements = fit.layout().operator_element_count();
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

/// The estimated operator of a record with its errors, extracted from the estimate of eta.
pub(super) struct EstimatedOperator {
    pub operator: FamilyOperator,
    pub covariance: Option<Vec<f64>>,
    pub model_based: Option<Vec<f64>>,
    pub parameters: Vec<Parameter>,
}

impl EstimatedOperator {
    pub fn of(fit: &PredictionFit<'_>, errors: &EstimateErrors, record: usize) -> Result<Self, IdentError> {
        let layout = fit.layout();
        let operator = layout.operator(fit.eta(), record)?;
        let places = &layout.positions(record)[..layout.coordinate_count()];
        let part = |c: &[f64]| Covariances::of_operator(c, layout, record);
        let covariances = errors.covariances.as_ref();
        let covariance = covariances.map(|c| part(&c.clustered));
        let model_based = covariances.map(|c| part(&c.model_based));
        // The errors of single parameters include the additional variances.
        let of_parameters = covariances.zip(covariance.clone()).map(|(c, mut of_all)| {
            for (i, &place) in places.iter().enumerate() {
                of_all[i * places.len() + i] += c.extra_variance[place];
            }
            of_all
        });
        let limits: Vec<(f64, f64)> = places.iter().map(|&i| layout.limits()[i]).collect();
        let delay_intervals: Vec<Option<(f64, f64)>> =
            places.iter().map(|&i| delay_interval(fit, errors, places, i)).collect();
        let prior_share = |(&i, interval): (&usize, &Option<(f64, f64)>)| match interval {
            Some((low, high)) => {
                let s = 0.5 * (high - low) / errors.quantile;
                prior_precision(fit, i).map_or(0.0, |precision| (s * s * precision / fit.inflation).min(1.0))
            }
            None => prior_share(fit, model_based.as_deref(), places, i),
        };
        let known = CoordinateEstimate {
            operator: &operator,
            covariance: of_parameters.as_deref(),
            prior_share: &places.iter().zip(&delay_intervals).map(prior_share).collect::<Vec<_>>(),
            limits: &limits,
            profile: &(places.iter().zip(&delay_intervals))
                .map(|(&i, interval)| interval.or(errors.profiles[i]))
                .collect::<Vec<_>>(),
            quantile: errors.quantile,
            run_to_run: errors.run_to_run,
        };
        let parameters = known.parameters();
        Ok(Self {
            operator,
            covariance,
            model_based,
            parameters,
        })
    }
}

/// Returns the curvature of the prior of an element of eta, relative to the innovation variance; `None` without a
/// prior.
fn prior_precision(fit: &PredictionFit<'_>, place: usize) -> Option<f64> {
    let penalty = fit.criterion.penalty.iter().find(|p| p.index == place)?;
    Some(penalty.curvature(fit.eta()) / fit.innovation_variance)
}

/// Returns the ratio of the posterior to the prior variance of an element of eta; zero without a prior.
fn prior_share(fit: &PredictionFit<'_>, model_based: Option<&[f64]>, places: &[usize], place: usize) -> f64 {
    let Some(precision) = prior_precision(fit, place) else {
        return 0.0;
    };
    let Some((i, c)) = places.iter().position(|&q| q == place).zip(model_based) else {
        return 1.0;
    };
    // The curvature of the prior is kappa sigma^2/s^2. The model-based covariance is sigma^2 H^-1; multiplied by kappa,
    // it is the posterior covariance.
    let variance = c[i * places.len() + i];
    let ((low, high), x) = (fit.criterion.limits[place], fit.eta()[place]);
    // An element at a bound has no variance; its share is set to one.
    if variance > 0.0 && low < x && x < high {
        (variance * precision).min(1.0)
    } else {
        1.0
    }
}

/// Returns the operator of a record, also in polynomial form, with its parameters averaged over the forms.
pub(super) fn record_operator(
    fit: &PredictionFit<'_>,
    errors: &EstimateErrors,
    (weighed, dc_gain_share): (&[WeighedForm], f64),
    record: usize,
) -> Result<OperatorOfRecord, IdentError> {
    let EstimatedOperator {
        operator,
        covariance,
        model_based,
        parameters,
    } = EstimatedOperator::of(fit, errors, record)?;
    let parameters: Vec<Parameter> = (parameters.into_iter())
        .map(|own| averaged_parameter(&own, (weighed, dc_gain_share), record, fit.clusters.parts.len()).unwrap_or(own))
        .collect();
    let layout = fit.layout();
    let p = fit.parameter_count();
    let mut mapped = fit.criterion.model_of(fit.eta(), record)?;
    // The polynomials describe the response from e to u, without the coefficients of further inputs.
    mapped.theta.truncate(mapped.orders.parameter_count());
    let of_theta =
        (errors.covariances.as_ref()).map(|c| mapped.covariance_of_theta(&c.clustered, p, layout.positions(record)));
    let polynomial_fit = Fit {
        is_fixed_or_bounded: vec![false; mapped.theta.len()],
        model: PolynomialModel::new(Structure::BoxJenkins, mapped.orders, layout.sample_time, mapped.theta)?,
        covariance: of_theta,
        loss: fit.loss,
        innovation_variance: fit.innovation_variance,
        residuals: fit.residuals,
        states: fit.states,
        initial_state: fit.criterion.initial,
        termination: fit.minimum.termination,
        start: "own".to_owned(),
        output_variance: output_variance(&fit.criterion.data, fit.criterion.first),
        robust: false,
        instrumented: false,
        searched_delay: None,
        physical: Some(Box::new(Physical {
            title: title(layout.form, layout.neuromuscular, (layout.nc, layout.nd)),
            parameters: parameters.iter().map(|q| (q.name.clone(), q.estimate())).collect(),
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

/// Returns the average of a parameter over the forms in which it has the same meaning. In a form with a lag, K is the
/// gain at zero frequency, far below the band; in other forms K (`K_e` in the form with one lead) is the gain in the
/// band. K is not determined if forms with the other meaning are likely; `dc_gain_share` is the evidence for the forms
/// in which it has the same meaning as in the best form.
fn averaged_parameter(
    own: &Parameter,
    (weighed, dc_gain_share): (&[WeighedForm], f64),
    record: usize,
    clusters: usize,
) -> Option<Parameter> {
    let lags = weighed.first()?.form.has_lag();
    let gain = is_dc_gain(&own.name);
    let alike = weighed.iter().filter(|form| !gain || form.form.has_lag() == lags);
    let each = alike.filter_map(|form| {
        let mut all = form.of(record)?.parameters.iter();
        let same = |name: &str| if gain { is_dc_gain(name) } else { name == own.name };
        Some((form.form, form.weight, all.find(|p| same(&p.name))?))
    });
    let found = Parameter::average(&each.collect::<Vec<_>>(), clusters)?;
    Some(Parameter {
        determined: found.determined && (own.name != DC_GAIN_NAME || dc_gain_share > min_weight(DC_GAIN_NAME)),
        ..found
    })
}

/// Returns the form of a fit with its weight and its operators as fitted, without averaging over forms.
pub(super) fn weighed_form(
    fit: &PredictionFit<'_>,
    errors: &EstimateErrors,
    weight: f64,
    separate: usize,
    deviation: impl Fn(&FamilyOperator) -> Option<ResponseDeviation>,
) -> Result<WeighedForm, IdentError> {
    let of = |record| {
        EstimatedOperator::of(fit, errors, record).map(|found| OperatorInForm {
            deviation: deviation(&found.operator),
            operator: found.operator,
            covariance: found.covariance,
            parameters: found.parameters,
        })
    };
    Ok(WeighedForm {
        form: fit.layout().form,
        weight,
        operators: (0..separate).map(of).collect::<Result<_, _>>()?,
    })
}
