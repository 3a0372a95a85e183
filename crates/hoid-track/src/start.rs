//! Start of a recursion: values, covariance and innovation variance.
//!
//! After a batch fit, P is the covariance of the fit divided by sigma^2, which is the inverse of the information
//! matrix; in physical parameters `P_eta = T^{-1} P_theta T^{-T}` with the Jacobian T of theta(eta). If the user
//! selects a multiple of the unit matrix instead (`0.1 I` in the thesis), it determines only the gain; the error bars
//! still start with the covariance of the fit.

use std::{collections::BTreeMap, ops::Range};

use hoid_core::{bounds::clamp, recursion::StablePolynomials, stability::roots_inside};
use hoid_model::{Record, SampleTime, operator::retrieval_jacobian};

use hoid_ident::{Constraint, Fit, GreyBox, IdentError};

use crate::{
    further_input::{TrackedInput, coefficient_names, submatrix},
    setup::{PHYSICAL_NAMES, Setup, StartSource},
    start_noise::StartNoise,
};

/// Variance in P for a start without knowledge, in units of the innovation variance.
const UNKNOWN_VARIANCE: f64 = 1e6;
/// Operator of a start without knowledge: K_e, K_e_dot (s), omega_nm (rad/s), zeta_nm, tau_e (s), of the same order of
/// magnitude as in the thesis.
const TYPICAL_OPERATOR: [f64; 5] = [0.1, 0.05, 10.0, 0.4, 0.25];
/// Coefficient d1 of a start without knowledge: a noise pole at 0.8.
const TYPICAL_D1: f64 = -0.8;
/// Bounds of omega_nm, the lower in rad/s and the upper as a share of the Nyquist frequency, and bounds of zeta_nm.
const MIN_OMEGA_RAD_S: f64 = 0.5;
const MAX_OMEGA_NYQUIST_SHARE: f64 = 0.5;
const DAMPING_RANGE: [f64; 2] = [0.02, 5.0];
/// Longest sample time of a tracker (in s): with a longer one, the upper bound of omega_nm would be below the lower
/// bound.
const LONGEST_SAMPLE_TIME_S: f64 = MAX_OMEGA_NYQUIST_SHARE * std::f64::consts::PI / MIN_OMEGA_RAD_S;
/// Shortest sample time of a tracker (in s): with a shorter one, the samples that a tracker stores would not fit in
/// memory.
const SHORTEST_SAMPLE_TIME_S: f64 = 1e-6;
/// Factor by which the roots of an unstable noise model are moved inwards until it is stable.
const ROOT_SHRINK_FACTOR: f64 = 0.99;

/// Checks that the upper bound of omega_nm at the sample time is above the lower bound, and that a few seconds are not
/// too many samples; the limits are the same for all methods.
///
/// # Errors
/// [`IdentError::BadOption`] from [`LONGEST_SAMPLE_TIME_S`] on, and below [`SHORTEST_SAMPLE_TIME_S`].
pub(crate) fn check_sample_time(sample_time: SampleTime) -> Result<(), IdentError> {
    let ts = sample_time.s();
    if ts < SHORTEST_SAMPLE_TIME_S {
        return Err(IdentError::BadOption {
            option: "the sample time of a tracker".to_owned(),
            found: format!("{ts:e} s"),
            expected: format!(
                "at least {SHORTEST_SAMPLE_TIME_S:e} s; a few thousand samples per second are enough for a person, so \
                 check the unit of the time, or decimate"
            ),
        });
    }
    if ts < LONGEST_SAMPLE_TIME_S {
        return Ok(());
    }
    Err(IdentError::BadOption {
        option: "the sample time of a tracker".to_owned(),
        found: format!("{ts} s"),
        expected: format!(
            "less than {LONGEST_SAMPLE_TIME_S:.2} s, since slower sampling cannot follow a person; if the time is in \
             ms, divide it by 1000 (a sample time of {} s) or name its unit",
            ts / 1000.0
        ),
    })
}

/// The start in the coordinates of the recursion.
#[derive(Debug, Clone, PartialEq)]
pub struct StartState {
    /// Values of theta, or of the physical parameters eta.
    pub values: Vec<f64>,
    /// P by rows, divided by the innovation variance.
    pub covariance: Vec<f64>,
    /// Covariance of the values by rows, divided by the innovation variance.
    pub spread: Vec<f64>,
    /// Innovation variance; zero if it is unknown.
    pub variance: f64,
    /// Number of residuals from which the innovation variance was estimated.
    pub residuals: f64,
    /// True if the start comes from a fit.
    pub from_fit: bool,
    /// The fit, if it is available.
    pub fit: Option<Fit>,
}

impl StartState {
    /// Returns the start of some of the parameters.
    pub(crate) fn part(&self, places: Range<usize>) -> Self {
        let (p, places) = (self.values.len(), places.collect::<Vec<_>>());
        Self {
            values: places.iter().map(|&i| self.values[i]).collect(),
            covariance: submatrix(&self.covariance, p, &places),
            spread: submatrix(&self.spread, p, &places),
            fit: None,
            ..*self
        }
    }

    /// Computes the start that the options select. If a fit is needed, it is `known` or is computed from the record of
    /// the start span.
    ///
    /// # Errors
    /// The errors of the batch fit; [`IdentError::BadStart`].
    pub fn new(
        setup: &Setup,
        span: Option<&Record>,
        known: Option<&Fit>,
        sample_time: SampleTime,
    ) -> Result<Self, IdentError> {
        match (&setup.start, span) {
            (StartSource::Theta(theta), _) => Self::from_theta(setup, theta, sample_time),
            (StartSource::Span(_), Some(record)) if !setup.starts_itself => Self::from_record(setup, record, known),
            _ => Self::without_knowledge(setup, sample_time),
        }
    }

    /// Computes the start from a given theta.
    fn from_theta(setup: &Setup, theta: &[f64], sample_time: SampleTime) -> Result<Self, IdentError> {
        let names = coefficient_names(&setup.orders, setup.further.as_ref());
        if theta.len() != names.len() || theta.iter().any(|t| !t.is_finite()) {
            return Err(IdentError::BadStart {
                reason: format!(
                    "found {theta:?}; expected one finite value for each of {}",
                    names.join(", ")
                ),
            });
        }
        let values = if setup.is_physical {
            physical_values(setup, theta, sample_time)?
        } else {
            theta.to_vec()
        };
        Ok(Self::without_fit(setup, values))
    }

    fn without_knowledge(setup: &Setup, sample_time: SampleTime) -> Result<Self, IdentError> {
        let o = &setup.orders;
        let mut values = vec![0.0; setup.parameter_names().len()];
        if setup.is_physical {
            let first = if setup.delay_parameter_s.is_some() { 5 } else { 4 };
            values[..first].copy_from_slice(&TYPICAL_OPERATOR[..first]);
            if let Some((low, high)) = setup.delay_parameter_s {
                values[4] = clamp(TYPICAL_OPERATOR[4], [low, high]);
            }
            let limits = parameter_bounds(setup, sample_time)?;
            for (value, limits) in values.iter_mut().zip(limits) {
                *value = clamp(*value, limits);
            }
            if o.nd > 0 {
                values[first + o.nc] = TYPICAL_D1;
            }
        }
        Ok(Self::without_fit(setup, values))
    }

    fn without_fit(setup: &Setup, values: Vec<f64>) -> Self {
        let size = setup.covariance.unwrap_or(UNKNOWN_VARIANCE);
        let covariance = scaled_identity(size, values.len());
        Self {
            spread: covariance.clone(),
            covariance,
            values,
            variance: 0.0,
            residuals: 0.0,
            from_fit: false,
            fit: None,
        }
    }

    /// Computes the start from the batch fit of a record.
    fn from_record(setup: &Setup, record: &Record, known: Option<&Fit>) -> Result<Self, IdentError> {
        let FittedStart {
            values,
            covariance,
            fit,
            variance,
            residuals,
        } = match &setup.further {
            Some(further) => FittedStart::from_several_inputs(setup, further, record)?,
            None if setup.is_physical => fit_physical(setup, record, known)?,
            None => {
                let fit = polynomial_fit(setup, record, known)?;
                let (values, covariance) = (fit.model().theta().to_vec(), fit.covariance().map(<[f64]>::to_vec));
                let variance = fit.innovation_variance();
                FittedStart::of(fit, values, covariance, variance)
            }
        };
        let values = stabilise(setup, values);
        let p = values.len();
        let spread = match &covariance {
            Some(c) if variance > 0.0 => c.iter().map(|c| c / variance).collect(),
            _ => scaled_identity(UNKNOWN_VARIANCE, p),
        };
        let covariance = match setup.covariance {
            None => spread.clone(),
            Some(size) => scaled_identity(size, p),
        };
        Ok(Self {
            values,
            covariance,
            spread,
            variance,
            residuals: residuals as f64,
            from_fit: true,
            fit,
        })
    }
}

/// Returns the bounds of the parameters of a recursion with capacity for N parameters.
///
/// # Errors
/// [`IdentError::UnknownParameter`], [`IdentError::BadOption`].
pub fn physical_bounds<const N: usize>(setup: &Setup, sample_time: SampleTime) -> Result<[[f64; 2]; N], IdentError> {
    let limits = parameter_bounds(setup, sample_time)?;
    let free = [f64::NEG_INFINITY, f64::INFINITY];
    Ok(std::array::from_fn(|i| limits.get(i).copied().unwrap_or(free)))
}

/// Returns the lower and upper bounds of each physical parameter and of c and d.
///
/// # Errors
/// [`IdentError::UnknownParameter`], [`IdentError::BadOption`].
pub(crate) fn parameter_bounds(setup: &Setup, sample_time: SampleTime) -> Result<Vec<[f64; 2]>, IdentError> {
    let names = setup.parameter_names();
    if let Some(unknown) = setup.bounds.keys().find(|k| !names.contains(k)) {
        return Err(IdentError::UnknownParameter {
            name: unknown.clone(),
            available: names.join(", "),
        });
    }
    let default = |name: &str| match name {
        "omega_nm" => [MIN_OMEGA_RAD_S, MAX_OMEGA_NYQUIST_SHARE * sample_time.nyquist_rad_s()],
        "zeta_nm" => DAMPING_RANGE,
        "tau_e" => setup.delay_parameter_s.map_or([0.0, 0.0], |(low, high)| [low, high]),
        _ => [f64::NEG_INFINITY, f64::INFINITY],
    };
    names
        .iter()
        .map(|name| {
            let [low, high] = default(name);
            let Some(constraint) = setup.bounds.get(name) else {
                return Ok([low, high]);
            };
            let (a, b) = constraint.limits();
            let both = [a.max(low), b.min(high)];
            if constraint.is_valid() && both[0] <= both[1] {
                Ok(both)
            } else {
                Err(IdentError::BadOption {
                    option: format!("the bounds of {name}"),
                    found: format!("{a} to {b}"),
                    expected: format!("a range within {low} to {high}"),
                })
            }
        })
        .collect()
}

fn scaled_identity(size: f64, p: usize) -> Vec<f64> {
    let mut matrix = vec![0.0; p * p];
    matrix.iter_mut().step_by(p + 1).for_each(|m| *m = size);
    matrix
}

/// Moves the roots of the noise model inwards until it is as stable as the options require.
fn stabilise(setup: &Setup, mut values: Vec<f64>) -> Vec<f64> {
    let o = &setup.orders;
    if setup.stable == StablePolynomials::Predictor || o.nd == 0 {
        return values;
    }
    let first = match setup.is_physical {
        true => values.len() - o.nd,
        false => o.na + o.nb + o.nc,
    };
    let d = &mut values[first..first + o.nd];
    while d.iter().all(|v| v.is_finite()) && !roots_inside(d, 1.0) {
        let mut factor = 1.0;
        for v in d.iter_mut() {
            factor *= ROOT_SHRINK_FACTOR;
            *v *= factor;
        }
    }
    values
}

/// Computes eta from a theta `[b0, b1, c.., d.., f1, f2]`.
fn physical_values(setup: &Setup, theta: &[f64], sample_time: SampleTime) -> Result<Vec<f64>, IdentError> {
    let model = hoid_model::PolynomialModel::new(setup.structure, setup.orders, sample_time, theta.to_vec())?;
    let operator = model
        .discrete_operator()
        .and_then(|o| o.parameters())
        .map_err(|reason| IdentError::BadStart {
            reason: format!("it has no operator parameters: {reason}"),
        })?;
    let mut eta = vec![
        operator.k_e,
        operator.k_e_dot(),
        operator.omega_nm_rad_s,
        operator.zeta_nm,
    ];
    if setup.delay_parameter_s.is_some() {
        eta.push(operator.tau_e_s);
    }
    eta.extend_from_slice(model.c());
    eta.extend_from_slice(model.d());
    Ok(eta)
}

/// Result of a fit: the values, their covariance, the fit, and the innovation variance of the model with these values.
struct FittedStart {
    values: Vec<f64>,
    covariance: Option<Vec<f64>>,
    fit: Option<Fit>,
    variance: f64,
    /// Number of residuals minus the number of estimated values.
    residuals: usize,
}

impl FittedStart {
    /// Returns the start from a fit, with values and covariance in the coordinates of the recursion.
    fn of(fit: Fit, values: Vec<f64>, covariance: Option<Vec<f64>>, variance: f64) -> Self {
        Self {
            values,
            covariance,
            variance,
            residuals: fit.residual_count() - fit.free_count() - fit.state_count(),
            fit: Some(fit),
        }
    }

    /// Computes the start of a model with a further input from the batch fit of that model.
    fn from_several_inputs(setup: &Setup, further: &TrackedInput, record: &Record) -> Result<Self, IdentError> {
        let model = further.batch_model(setup.structure, &setup.orders, setup.search);
        let fit = model.fit(std::slice::from_ref(record))?;
        let values: Vec<f64> = fit
            .parameters()
            .into_iter()
            .map(|(_, estimate)| estimate.value)
            .collect();
        Ok(Self {
            covariance: fit.covariance().map(<[f64]>::to_vec),
            fit: None,
            variance: fit.innovation_variance,
            residuals: fit.residuals.saturating_sub(values.len()),
            values,
        })
    }
}

/// Returns the fit of the start span; computes it if it is not known.
fn polynomial_fit(setup: &Setup, record: &Record, known: Option<&Fit>) -> Result<Fit, IdentError> {
    match known {
        Some(fit) => Ok(fit.clone()),
        None => setup.start_estimator().fit(std::slice::from_ref(record)),
    }
}

/// Returns the Box-Jenkins fit if its physical parameters exist and are within the bounds; otherwise the grey-box fit,
/// whose parameters always exist and are limited to the bounds, with a noise model of the requested order.
fn fit_physical(setup: &Setup, record: &Record, known: Option<&Fit>) -> Result<FittedStart, IdentError> {
    if setup.delay_parameter_s.is_none()
        && let Some(start) = from_box_jenkins(setup, record, known)?
    {
        return Ok(start);
    }
    from_grey_box(setup, record)
}

fn from_box_jenkins(setup: &Setup, record: &Record, known: Option<&Fit>) -> Result<Option<FittedStart>, IdentError> {
    let sample_time = record.sample_time();
    let Ok(fit) = polynomial_fit(setup, record, known) else {
        return Ok(None);
    };
    let Ok(eta) = physical_values(setup, fit.model().theta(), sample_time) else {
        return Ok(None);
    };
    let limits = parameter_bounds(setup, sample_time)?;
    let inside = eta.iter().zip(&limits).all(|(e, [low, high])| low < e && e < high);
    let operator = fit.model().discrete_operator().and_then(|o| o.parameters());
    let inverse = operator.ok().and_then(|o| retrieval_jacobian(&o, sample_time));
    let Some(inverse) = inverse.filter(|_| inside) else {
        return Ok(None);
    };
    let covariance = fit.covariance().map(|c| {
        let p = eta.len();
        let (noise, places) = (p - 4, fit.model().operator_positions());
        let row = |i: usize| -> Vec<(usize, f64)> {
            if i < 4 {
                (0..4).map(|j| (places[j], inverse[i][j])).collect()
            } else {
                // c and d follow b.
                vec![(2 + i - 4, 1.0)]
            }
        };
        debug_assert_eq!(noise, setup.orders.nc + setup.orders.nd);
        congruence(&(0..p).map(row).collect::<Vec<_>>(), c, p)
    });
    let variance = fit.innovation_variance();
    Ok(Some(FittedStart::of(fit, eta, covariance, variance)))
}

/// Returns `T C T'` for a matrix T with sparse rows.
fn congruence(rows: &[Vec<(usize, f64)>], c: &[f64], width: usize) -> Vec<f64> {
    let product = |a: &[(usize, f64)], b: &[(usize, f64)]| -> f64 {
        let pairs = a.iter().flat_map(|x| b.iter().map(move |y| (x, y)));
        pairs.map(|((k, x), (l, y))| x * c[k * width + l] * y).sum()
    };
    rows.iter()
        .flat_map(|a| rows.iter().map(move |b| product(a, b)))
        .collect()
}

fn from_grey_box(setup: &Setup, record: &Record) -> Result<FittedStart, IdentError> {
    let ts = record.sample_time().s();
    let o = &setup.orders;
    let names = setup.parameter_names();
    let limits = parameter_bounds(setup, record.sample_time())?;
    let mut constraints: BTreeMap<String, Constraint> = BTreeMap::new();
    for (name, [low, high]) in names.iter().zip(&limits).take(4) {
        if low.is_finite() || high.is_finite() {
            constraints.insert(name.clone(), Constraint::Between(*low, *high));
        }
    }
    let order = usize::from(o.nd > 0);
    let mut grey = GreyBox {
        search: setup.search,
        ..GreyBox::new(order..=order)
    };
    match setup.delay_parameter_s {
        Some(range) => grey.delay_range_s = range,
        None => {
            let tau = (o.nk as f64 - 1.0) * ts;
            grey.delay_range_s = (tau, tau);
            constraints.insert(PHYSICAL_NAMES[4].to_owned(), Constraint::Fixed(tau));
        }
    }
    grey.constraints = constraints;
    let found = grey.fit(std::slice::from_ref(record))?;
    let parameters = found.parameters();
    let value = |name: &str| parameters.iter().position(|(n, _)| n == name);
    let operator = if setup.delay_parameter_s.is_some() { 5 } else { 4 };
    let fit = found.polynomial_fit(0).clone();
    // The remnant of the grey box has one pole. If D must have more poles, it is fitted to the residual of the
    // operator: a D of too low an order leaves the innovations coloured, and a bank of hypotheses mistakes coloured
    // innovations for changes.
    let noise = if o.nd > 1 {
        StartNoise::of(&fit, record, o.nd)
    } else {
        None
    };
    let variance = noise
        .as_ref()
        .map_or(found.innovation_variance(), |noise| noise.variance);
    let width = parameters.len();
    let (mut eta, mut rows) = (Vec::new(), Vec::new());
    for (name, limits) in PHYSICAL_NAMES[..operator].iter().zip(&limits) {
        let Some(place) = value(name) else {
            return Err(IdentError::BadStart {
                reason: format!("the grey-box fit has no {name}"),
            });
        };
        eta.push(clamp(parameters[place].1.value, *limits));
        rows.push(vec![(place, 1.0)]);
    }
    for i in 0..o.nc + o.nd {
        let of_noise = noise.as_ref().filter(|_| i >= o.nc);
        match value("T_n") {
            _ if of_noise.is_some() => {
                eta.push(of_noise.map_or(0.0, |noise| noise.d[i - o.nc]));
                rows.push(Vec::new());
            }
            // d1 = -exp(-Ts/T_n).
            Some(place) if i == o.nc => {
                let t_n = parameters[place].1.value;
                let pole = (-ts / t_n).exp();
                eta.push(-pole);
                rows.push(vec![(place, -pole * ts / (t_n * t_n))]);
            }
            _ => {
                eta.push(0.0);
                rows.push(Vec::new());
            }
        }
    }
    let p = eta.len();
    let mut covariance = found.covariance().map(|c| congruence(&rows, c, width));
    if let Some(covariance) = &mut covariance {
        if let Some(noise) = &noise {
            let first = operator + o.nc;
            for i in 0..o.nd {
                for j in 0..o.nd {
                    covariance[(first + i) * p + first + j] = noise.covariance[i * o.nd + j];
                }
            }
        }
        for i in 0..p {
            // Parameters that the grey box did not have, or kept fixed, are unknown: the standard deviation of a
            // coefficient is set to at least 1, and the standard deviation of a physical parameter to at least the
            // magnitude of the parameter.
            if covariance[i * p + i] == 0.0 {
                let size = if i < operator { eta[i] * eta[i] } else { 1.0 };
                covariance[i * p + i] = size.max(variance);
            }
        }
    }
    Ok(FittedStart::of(fit, eta, covariance, variance))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::{Method, TrackOptions, Tracker};

    fn refusal_message(method: Method, with: &[(&str, &str)], ts_s: f64) -> String {
        let options = TrackOptions::default_for(method, 29).with(with).unwrap();
        let start = StartSource::Theta(vec![0.0; options.parameter_names().len()]);
        let options = TrackOptions { start, ..options }.with(&[("covariance", "1")]).unwrap();
        let made = Tracker::new(&options, None, SampleTime::new(ts_s).unwrap());
        made.unwrap_err().to_string()
    }

    #[test]
    fn requests_that_exceed_the_memory_are_refused() {
        for ts_s in [1e-7, 1e-12, f64::MIN_POSITIVE] {
            for guard in ["yes", "no"] {
                let error = refusal_message(Method::rpem(), &[("guard", guard)], ts_s);
                assert!(error.contains("at least 1e-6 s"), "{error}");
            }
            let options = TrackOptions::default_for(Method::adaptive(), 29);
            let made = Tracker::new(&options, None, SampleTime::new(ts_s).unwrap());
            assert!(made.is_err(), "{ts_s}");
        }
        for range in ["1e5..1e5", "1e15..1e15", "1e300..1e300"] {
            let error = refusal_message(Method::rpem(), &[("track_delay", range)], 0.01);
            assert!(error.contains("at most 1000000 samples"), "{error}");
        }
        for memory in ["1e9", "inf"] {
            let error = refusal_message(Method::rpem(), &[("forgetting", "window"), ("memory", memory)], 0.01);
            assert!(error.contains("at most 10 million samples"), "{error}");
        }
    }
}
