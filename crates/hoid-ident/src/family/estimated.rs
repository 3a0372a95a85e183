//! The operator of a record with its errors, out of eta and the prior knowledge of it.

use hoid_model::{FamilyOperator, NotConvertible, PolynomialModel, Structure, operator_family::Coordinate};

use super::{
    clusters::{ClusterKind, quantile},
    covariances::{self, Covariances},
    parameter::{CoordinateEstimate, Parameter},
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

/// How well eta is known.
pub(super) struct Errors {
    /// `None` if the information is singular.
    pub covariances: Option<Covariances>,
    /// Intervals by profile likelihood, where there are such.
    pub profiles: Vec<Option<(f64, f64)>>,
    /// Quantile of Student's distribution for 95 %.
    quantile: f64,
    /// Variation of the gain of the person beyond the runs, as a part of it.
    pub run_to_run: f64,
}

impl Errors {
    pub fn of(fit: &PredictionFit<'_>, run_to_run: f64, workspace: &mut Workspace) -> Self {
        let covariances = covariances::covariances(fit);
        let quantile = quantile(fit.clusters.parts.len());
        // The scatter between runs holds what they vary by; blocks of few runs cannot show it.
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

    /// Quantile of Student's distribution for 95 %.
    pub fn quantile(&self) -> f64 {
        self.quantile
    }

    /// Largest ratio of a clustered to a model-based standard error.
    pub fn largest_ratio(&self, fit: &PredictionFit<'_>) -> Option<f64> {
        let (c, p) = (self.covariances.as_ref()?, fit.parameters());
        let ratios = (0..fit.layout().operator_elements())
            .map(|i| (c.clustered[i * p + i] / c.model_based[i * p + i]).sqrt())
            .filter(|r| r.is_finite());
        ratios.max_by(f64::total_cmp)
    }
}

/// Intervals by profile likelihood of the elements whose interval reaches the end of the search
/// range: there the criterion is not a parabola.
fn profiles(
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

/// The operator of a record with its errors, its coordinates taken out of eta.
pub(super) struct Estimated {
    pub operator: FamilyOperator,
    pub covariance: Option<Vec<f64>>,
    pub model_based: Option<Vec<f64>>,
    pub parameters: Vec<Parameter>,
}

impl Estimated {
    pub fn of(fit: &PredictionFit<'_>, errors: &Errors, record: usize) -> Result<Self, IdentError> {
        let layout = fit.layout();
        let operator = layout.operator(fit.eta(), record)?;
        let places = &layout.positions(record)[..layout.coordinates()];
        let part = |c: &[f64]| Covariances::of_operator(c, layout, record);
        let covariances = errors.covariances.as_ref();
        let covariance = covariances.map(|c| part(&c.clustered));
        let model_based = covariances.map(|c| part(&c.model_based));
        // Errors of single parameters, with their additional uncertainty.
        let of_parameters = covariances.zip(covariance.clone()).map(|(c, mut of_all)| {
            for (i, &place) in places.iter().enumerate() {
                of_all[i * places.len() + i] += c.extra_variance[place];
            }
            of_all
        });
        let limits: Vec<(f64, f64)> = places.iter().map(|&i| layout.limits()[i]).collect();
        let known = CoordinateEstimate {
            operator: &operator,
            covariance: of_parameters.as_deref(),
            prior_share: &places
                .iter()
                .map(|&i| prior_share(fit, model_based.as_deref(), places, i))
                .collect::<Vec<_>>(),
            limits: &limits,
            profile: &places.iter().map(|&i| errors.profiles[i]).collect::<Vec<_>>(),
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

/// Variance after the data over that before, of an element of eta.
fn prior_share(fit: &PredictionFit<'_>, model_based: Option<&[f64]>, places: &[usize], place: usize) -> f64 {
    let Some(penalty) = fit.criterion.penalty.iter().find(|p| p.place == place) else {
        return 0.0;
    };
    let Some((i, c)) = places.iter().position(|&q| q == place).zip(model_based) else {
        return 1.0;
    };
    // The weight is kappa sigma^2/s^2, the covariance sigma^2 H^-1: both inflated by kappa.
    let precision = penalty.curvature(fit.eta()) / fit.innovation_variance;
    let variance = c[i * places.len() + i];
    let ((low, high), x) = (fit.criterion.limits[place], fit.eta()[place]);
    // At a bound nothing is known about it but the bound.
    if variance > 0.0 && low < x && x < high {
        (variance * precision).min(1.0)
    } else {
        1.0
    }
}

/// The operator of a record, as one and as polynomials, with its parameters averaged over the forms.
pub(super) fn operator_of(
    fit: &PredictionFit<'_>,
    errors: &Errors,
    weighed: &[WeighedForm],
    record: usize,
) -> Result<OperatorOfRecord, IdentError> {
    let Estimated {
        operator,
        covariance,
        model_based,
        parameters,
    } = Estimated::of(fit, errors, record)?;
    let parameters: Vec<Parameter> = (parameters.into_iter())
        .map(|own| averaged(&own, weighed, record, fit.clusters.parts.len()).unwrap_or(own))
        .collect();
    let layout = fit.layout();
    let p = fit.parameters();
    let mut mapped = fit.criterion.model_of(fit.eta(), record)?;
    // From e to u: without the coefficients of channels in addition to it.
    mapped.theta.truncate(mapped.orders.parameters());
    let of_theta =
        (errors.covariances.as_ref()).map(|c| mapped.covariance_of_theta(&c.clustered, p, layout.positions(record)));
    let polynomial_fit = Fit {
        held: vec![false; mapped.theta.len()],
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

/// Average over the forms of the parameter with the same name.
fn averaged(own: &Parameter, weighed: &[WeighedForm], record: usize, clusters: usize) -> Option<Parameter> {
    let each = weighed.iter().filter_map(|form| {
        let mut all = form.of(record)?.parameters.iter();
        Some((form.form, form.weight, all.find(|p| p.name == own.name)?))
    });
    Parameter::averaged(&each.collect::<Vec<_>>(), clusters)
}

/// The operators of a fit, by its form alone.
pub(super) fn in_form(
    fit: &PredictionFit<'_>,
    errors: &Errors,
    weight: f64,
    separate: usize,
) -> Result<WeighedForm, IdentError> {
    let of = |record| {
        Estimated::of(fit, errors, record).map(|found| OperatorInForm {
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
