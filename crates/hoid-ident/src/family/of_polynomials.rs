//! Conversion of polynomials to an operator of the family: `q^-nk B/F` (or `B/A`) to K, T_L, T_I, omega_nm, zeta_nm and
//! tau_e.
//!
//! The poles determine the lag and the neuromuscular system ([`super::pole_reading`]).
//!
//! Apart from its poles, the exact model of an operator ([`FamilyOperator::zoh`]) has only a gain, leads and a delay,
//! which are often fewer parameters than B has coefficients, so estimated polynomials do not exactly correspond to an
//! operator. The conversion finds the operator whose exact model M(x) is closest to the response H of the polynomials
//! over the band of manual control,
//!
//! `min_x sum_j |H(omega_j) - M(omega_j, x)|^2 / |H(omega_j)|^2`.
//!
//! For the exact model of an operator this returns the operator itself. The covariance of x follows from the covariance
//! of theta to first order, `dx = (J'J)^-1 J' dH`, where J contains the derivatives of M divided by |H| (the implicit
//! function theorem without the second derivative, which vanishes if M equals H). The largest relative deviation,
//! [`FamilyConversion::mismatch`], shows how far the polynomials are from the form; if it is large, they do not have
//! this form.

use hoid_model::{
    Complex64, FamilyOperator, Form, NotConvertible, PolynomialModel, SampleTime,
    operator_family::{Coordinate, ZohFamilyOperator},
    uncertainty::Estimate,
};

use super::{
    coordinates,
    pole_reading::{PoleAssignment, RealPole, pole_assignments},
};
use crate::{
    Fit, SearchOptions,
    criterion::Workspace,
    linalg::least_squares::solve_symmetric,
    optimize::{Linearisation, Minimum, Objective, minimise},
};

/// Candidate forms, in the order from the simplest.
const CANDIDATE_FORMS: [Form; 6] = [
    Form::Gain,
    Form::Lag,
    Form::Lead,
    Form::LeadLag,
    Form::Lead2,
    Form::Lead2Lag,
];
/// Frequency range in which responses are compared, rad/s; the points are evenly spaced on a logarithmic scale.
const BAND_RAD_S: (f64, f64) = (0.2, 30.0);
const POINT_COUNT: usize = 30;
/// Largest accepted relative deviation of an operator's response from the response of the polynomials.
const LARGEST_MISMATCH: f64 = 0.1;
/// Relative deviation up to which a form counts as exact.
const EXACT_MISMATCH: f64 = 1e-6;
/// Delays from which searches start, in samples relative to nk - 1.
const DELAY_OFFSETS: [f64; 6] = [0.02, 0.5, 0.98, 2.5, 5.0, 10.0];
/// Lead times from which searches start, s.
const LEADS_S: [f64; 3] = [0.1, 0.5, 2.0];

/// An operator of the family that represents polynomials.
#[derive(Debug, Clone, PartialEq)]
pub struct FamilyConversion {
    /// The operator.
    pub operator: FamilyOperator,
    /// Covariance of the coordinates by rows; `None` if the covariance of the coefficients is unknown or the conversion
    /// fails.
    pub covariance: Option<Vec<f64>>,
    /// Real poles, in ascending order of their rate.
    pub real_poles: Vec<RealPole>,
    /// Largest `|H - M|/|H|` from 0.2 rad/s to 30 rad/s or, if lower, 0.8 times the Nyquist frequency.
    pub mismatch: f64,
}

impl FamilyConversion {
    /// Returns the names, units, values and first-order standard errors of the parameters.
    pub fn parameters(&self) -> Vec<(&'static str, &'static str, Estimate)> {
        let all = self.operator.named_estimates(self.covariance.as_deref());
        all.into_iter()
            .map(|(named, estimate)| (named.name, named.unit, estimate))
            .collect()
    }
}

impl Fit {
    /// Returns the operator of the family that the polynomials of this fit represent, in the given form or, for `None`,
    /// in the simplest exact or else the closest form.
    ///
    /// # Errors
    /// Same as [`family_from_polynomials`].
    pub fn family_operator(&self, form: Option<Form>) -> Result<FamilyConversion, NotConvertible> {
        family_from_polynomials(self.model(), self.covariance(), form)
    }
}

/// Returns the operator of the family that the polynomials represent, in the given form. For `None` this is the
/// simplest form that is exact, or else the closest form. `covariance` is the covariance of theta by rows.
///
/// # Errors
/// [`NotConvertible`] for a nonfinite coefficient, poles in both A and F, no poles or more than three, an unstable
/// pole, a pole on the negative real axis of z, nk = 0, a given form that does not have these poles, or if the response
/// of the closest operator deviates by more than a tenth.
pub fn family_from_polynomials(
    model: &PolynomialModel,
    covariance: Option<&[f64]>,
    form: Option<Form>,
) -> Result<FamilyConversion, NotConvertible> {
    let orders = model.orders();
    if let Some((i, value)) = model.theta().iter().enumerate().find(|(_, v)| !v.is_finite()) {
        let name = orders.parameter_names().get(i).cloned().unwrap_or_default();
        return Err(NotConvertible::NotFinite { name, value: *value });
    }
    if orders.na > 0 && orders.nf > 0 {
        return Err(NotConvertible::PolesInBoth {
            na: orders.na,
            nf: orders.nf,
        });
    }
    if orders.nk == 0 {
        return Err(NotConvertible::NoDelay);
    }
    let sample_time = model.sample_time();
    let pole_assignments = pole_assignments(if orders.na > 0 { model.a() } else { model.f() }, sample_time)?;
    let points = points(model);
    let forms: Vec<Form> = match form {
        Some(form) => vec![form],
        None => CANDIDATE_FORMS.to_vec(),
    };
    let mut best: Option<(f64, Minimum, Form, &PoleAssignment)> = None;
    for form in forms {
        for reading in &pole_assignments {
            let Some((mismatch, found)) = fit_form(form, reading, &points, orders.nk, sample_time) else {
                continue;
            };
            // Rounding must not replace a simple exact form by a more complex one.
            if best
                .as_ref()
                .is_none_or(|known| known.0 > EXACT_MISMATCH && mismatch < known.0)
            {
                best = Some((mismatch, found, form, reading));
            }
        }
    }
    let poles = orders.na + orders.nf;
    let Some((mismatch, found, form, reading)) = best else {
        return Err(NotConvertible::NotOfTheFamily {
            reason: match form {
                Some(form) => format!("the form {form} does not match the number of poles found, {poles}"),
                None => "no operator with these poles was found".to_owned(),
            },
        });
    };
    if mismatch > LARGEST_MISMATCH {
        return Err(NotConvertible::NotOfTheFamily {
            reason: format!(
                "the response of the nearest operator, of the form {form}, is off by {:.0} % between {} and {} rad/s",
                100.0 * mismatch,
                BAND_RAD_S.0,
                points.last().map_or(BAND_RAD_S.1, |p| p.omega_rad_s).round()
            ),
        });
    }
    let criterion = ConversionCriterion::new(form, reading, &points, orders.nk, sample_time);
    let operator = FamilyOperator::new(form, reading.neuromuscular.is_some(), &found.theta).map_err(|error| {
        NotConvertible::NotOfTheFamily {
            reason: error.to_string(),
        }
    })?;
    Ok(FamilyConversion {
        covariance: covariance.and_then(|c| criterion.covariance(&found, c)),
        operator,
        real_poles: reading.real_poles(),
        mismatch,
    })
}

/// The response of the polynomials at one frequency.
struct Point {
    omega_rad_s: f64,
    response: Complex64,
    /// Derivatives of the response with respect to theta.
    gradient: Vec<Complex64>,
}

fn points(model: &PolynomialModel) -> Vec<Point> {
    let highest = BAND_RAD_S.1.min(0.8 * model.sample_time().nyquist_rad_s());
    (0..POINT_COUNT)
        .map(|i| {
            let omega_rad_s = BAND_RAD_S.0 * (highest / BAND_RAD_S.0).powf(i as f64 / (POINT_COUNT as f64 - 1.0));
            let (response, gradient) = model.response_and_gradient(omega_rad_s);
            Point {
                omega_rad_s,
                response,
                gradient,
            }
        })
        .collect()
}

/// Returns the operator of a form that is closest to the polynomials with these poles, and its mismatch; `None` if the
/// form does not have these poles.
fn fit_form(
    form: Form,
    reading: &PoleAssignment,
    points: &[Point],
    nk: usize,
    sample_time: SampleTime,
) -> Option<(f64, Minimum)> {
    let neuromuscular = reading.neuromuscular.is_some();
    // The form must have a lag if and only if the polynomials have one, and must not be a pure derivative.
    if form.has_pole() != reading.lag.is_some() || !form.is_proper(neuromuscular) {
        return None;
    }
    let criterion = ConversionCriterion::new(form, reading, points, nk, sample_time);
    let found = criterion
        .starts()
        .into_iter()
        .filter_map(|start| {
            minimise(
                &criterion,
                start,
                &SearchOptions::default(),
                None,
                &mut Workspace::default(),
            )
        })
        .min_by(|a, b| {
            a.linearisation
                .sum_of_squares
                .total_cmp(&b.linearisation.sum_of_squares)
        })?;
    Some((criterion.mismatch(&found.theta)?, found))
}

/// The criterion as a function of the coordinates of a form.
struct ConversionCriterion<'a> {
    form: Form,
    reading: &'a PoleAssignment,
    points: &'a [Point],
    nk: usize,
    sample_time: SampleTime,
    limits: Vec<(f64, f64)>,
}

impl<'a> ConversionCriterion<'a> {
    fn new(form: Form, reading: &'a PoleAssignment, points: &'a [Point], nk: usize, sample_time: SampleTime) -> Self {
        let neuromuscular = reading.neuromuscular.is_some();
        let ts = sample_time.s();
        let reach = (nk as f64 + 2.0 * DELAY_OFFSETS[DELAY_OFFSETS.len() - 1]) * ts;
        let mut limits = coordinates::limits(form, neuromuscular, (0.0, reach), sample_time);
        // The poles are known approximately; the search may change them only within these bounds.
        for (limit, coordinate) in limits.iter_mut().zip(form.coordinates(neuromuscular)) {
            match coordinate {
                Coordinate::LagRate | Coordinate::LogOmega | Coordinate::LogZeta => {
                    let x = reading.coordinate(coordinate);
                    let reach = if coordinate == Coordinate::LagRate {
                        x.abs()
                    } else {
                        1.0
                    };
                    *limit = (x - 0.99 * reach, x + 2.0 * reach);
                }
                _ => {}
            }
        }
        Self {
            form,
            reading,
            points,
            nk,
            sample_time,
            limits,
        }
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        let coordinates = self.form.coordinates(self.reading.neuromuscular.is_some());
        let has_lead = coordinates.contains(&Coordinate::Lead);
        let leads: &[f64] = if has_lead { &LEADS_S } else { &LEADS_S[..1] };
        let before = (self.nk as f64 - 1.0) * self.sample_time.s();
        let each = leads
            .iter()
            .flat_map(|&lead| DELAY_OFFSETS.iter().map(move |&later| (lead, later)));
        each.filter_map(|(lead, later)| {
            let mut start: Vec<f64> = coordinates
                .iter()
                .map(|c| match c {
                    Coordinate::Gain => 1.0,
                    Coordinate::Lead => lead,
                    Coordinate::Delay => before + later * self.sample_time.s(),
                    other => self.reading.coordinate(*other),
                })
                .collect();
            // The response is linear in the gain, so the best gain is computed directly.
            let (mut cross, mut power) = (0.0, 0.0);
            for (point, m) in self.points.iter().zip(self.responses(&start)?) {
                let weight = point.response.norm_sqr().recip();
                cross += weight * (m.0.conj() * point.response).re;
                power += weight * m.0.norm_sqr();
            }
            start[0] = cross / power;
            (start[0].is_finite() && start[0] != 0.0).then_some(start)
        })
        .collect()
    }

    /// Returns the response of the exact model at each point, with its derivatives with respect to the coordinates.
    fn responses(&self, x: &[f64]) -> Option<Vec<(Complex64, Vec<Complex64>)>> {
        let operator = FamilyOperator::new(self.form, self.reading.neuromuscular.is_some(), x).ok()?;
        let held = operator.zoh(self.sample_time).ok()?;
        let of = |point: &Point| response(&held, point.omega_rad_s * self.sample_time.s(), x.len());
        Some(self.points.iter().map(of).collect())
    }

    fn mismatch(&self, x: &[f64]) -> Option<f64> {
        let all = self.responses(x)?;
        let off = |(p, m): (&Point, (Complex64, Vec<Complex64>))| (p.response - m.0).norm() / p.response.norm();
        Some(self.points.iter().zip(all).map(off).fold(0.0, f64::max))
    }

    /// Returns the covariance of the coordinates, `S C S'` with `S = (J'J)^-1 J' dH/dtheta` and C the covariance of
    /// theta; zero for coordinates at a bound.
    fn covariance(&self, found: &Minimum, of_theta: &[f64]) -> Option<Vec<f64>> {
        let p = found.theta.len();
        let n = self.points.first()?.gradient.len();
        let free: Vec<usize> = (0..p)
            .filter(|&i| self.limits[i].0 < found.theta[i] && found.theta[i] < self.limits[i].1)
            .collect();
        let gram: Vec<f64> = free
            .iter()
            .flat_map(|&i| free.iter().map(move |&j| i * p + j))
            .map(|at| found.linearisation.gram[at])
            .collect();
        let responses = self.responses(&found.theta)?;
        // S = dx/dtheta, one column per coefficient.
        let mut slopes = vec![0.0; p * n];
        for k in 0..n {
            let right: Vec<f64> = free
                .iter()
                .map(|&i| {
                    let each = self.points.iter().zip(&responses);
                    each.map(|(q, m)| (m.1[i].conj() * q.gradient[k]).re / q.response.norm_sqr())
                        .sum()
                })
                .collect();
            for (&i, value) in free.iter().zip(solve_symmetric(&gram, &right)?) {
                slopes[i * n + k] = value;
            }
        }
        let mut covariance = vec![0.0; p * p];
        for i in 0..p {
            for j in 0..p {
                covariance[i * p + j] = (0..n)
                    .flat_map(|k| (0..n).map(move |l| (k, l)))
                    .map(|(k, l)| slopes[i * n + k] * of_theta[k * n + l] * slopes[j * n + l])
                    .sum();
            }
        }
        covariance.iter().all(|c| c.is_finite()).then_some(covariance)
    }
}

/// Returns `z^-nk B/F` at `z = e^{j angle}`, and its derivatives with respect to the first `p` coordinates.
fn response(held: &ZohFamilyOperator, angle: f64, p: usize) -> (Complex64, Vec<Complex64>) {
    let back = |k: usize| Complex64::from_polar(1.0, -angle * k as f64);
    let (mut b, mut f) = (Complex64::new(0.0, 0.0), Complex64::new(1.0, 0.0));
    let (mut of_b, mut of_f) = (vec![Complex64::new(0.0, 0.0); p], vec![Complex64::new(0.0, 0.0); p]);
    for (k, &value) in held.b.iter().enumerate() {
        let turn = back(held.nk + k);
        b += turn * value;
        (0..p).for_each(|i| of_b[i] += turn * held.jacobian[k][i]);
    }
    for (k, &value) in held.f.iter().enumerate() {
        let turn = back(k + 1);
        f += turn * value;
        (0..p).for_each(|i| of_f[i] += turn * held.jacobian[held.b.len() + k][i]);
    }
    let value = b / f;
    (
        value,
        of_b.iter().zip(of_f).map(|(b, of_f)| (b - value * of_f) / f).collect(),
    )
}

impl Objective for ConversionCriterion<'_> {
    fn is_feasible(&self, x: &[f64]) -> bool {
        FamilyOperator::new(self.form, self.reading.neuromuscular.is_some(), x).is_ok()
    }

    fn linearise(&self, x: &[f64], _: &mut Workspace) -> Linearisation {
        let mut total = Linearisation::empty(x.len());
        let Some(responses) = self.responses(x) else {
            total.sum_of_squares = f64::NAN;
            return total;
        };
        for (point, (m, slopes)) in self.points.iter().zip(responses) {
            total.add_complex(point.response.norm_sqr().recip(), point.response - m, &slopes);
        }
        total
    }

    fn output_power(&self) -> f64 {
        self.points.len() as f64
    }

    fn limits(&self) -> Option<&[(f64, f64)]> {
        Some(&self.limits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::PoleRole;
    use hoid_model::{Orders, Structure};

    fn ts() -> SampleTime {
        SampleTime::new(1.0 / 60.0).unwrap()
    }

    fn polynomials(nk: usize, b: &[f64], f: &[f64]) -> PolynomialModel {
        let orders = Orders {
            nb: b.len(),
            nf: f.len(),
            nk,
            ..Orders::default()
        };
        PolynomialModel::new(Structure::OutputError, orders, ts(), [b, f].concat()).unwrap()
    }

    fn exact_polynomials(operator: &FamilyOperator) -> PolynomialModel {
        let held = operator.zoh(ts()).unwrap();
        polynomials(held.nk, &held.b, &held.f)
    }

    const LEAD_LAG: [f64; 6] = [5.0, 0.6, 0.12, 2.5, -1.4, 0.137];

    fn operators() -> Vec<FamilyOperator> {
        let of = |form, nm, x: &[f64]| FamilyOperator::new(form, nm, x).unwrap();
        vec![
            of(Form::Gain, true, &[2.0, 2.4, -1.2, 0.2]),
            of(Form::Lead, true, &[1.5, 0.4, 2.4, -1.2, 0.25]),
            of(Form::Lag, true, &[4.0, 0.3, 2.4, -1.2, 0.21]),
            of(Form::LeadLag, true, &LEAD_LAG),
            of(Form::Lead2Lag, true, &[6.0, 0.7, 0.3, 2.4, -1.2, 0.26]),
            of(Form::Lag, false, &[4.0, 0.3, 0.21]),
        ]
    }

    #[test]
    fn exact_model_returns_its_operator() {
        for operator in operators() {
            let found = family_from_polynomials(&exact_polynomials(&operator), None, None).unwrap();
            assert_eq!(found.operator.form(), operator.form());
            assert!(found.mismatch < 1e-8, "{}: {}", operator.form(), found.mismatch);
            for (a, b) in found.operator.coordinates().iter().zip(operator.coordinates()) {
                assert!((a - b).abs() < 1e-6 * (1.0 + b.abs()), "{}: {a} {b}", operator.form());
            }
            assert_eq!(found.covariance, None);
        }
    }

    #[test]
    fn pole_at_one_is_refused() {
        for f in [
            &[-1.0][..],
            &[-1.9, 0.9],
            &[-2.0, 1.0],
            &[-2.9, 2.8, -0.9],
            &[-3.0, 3.0, -1.0],
        ] {
            for b in [&[1.0][..], &[1.0, 1.0], &[1.0, -0.5, 0.2]] {
                let found = family_from_polynomials(&polynomials(1, b, f), None, None);
                assert!(found.is_err(), "{f:?} {b:?}: {found:?}");
            }
        }
        let found = family_from_polynomials(&polynomials(1, &[1.0], &[-1.9, 0.9]), None, None).unwrap_err();
        assert!(found.to_string().contains("pole at z = 1"), "{found}");
        // A slow pole that is not at 1 remains a lag.
        assert!(family_from_polynomials(&polynomials(1, &[1.0], &[-0.999]), None, None).is_ok());
    }

    #[test]
    fn lag_is_assigned_to_the_real_pole_that_fits() {
        let found = family_from_polynomials(&exact_polynomials(&operators()[3]), None, None).unwrap();
        assert_eq!(found.real_poles.len(), 1);
        assert_eq!(found.real_poles[0].role, PoleRole::Lag);
        assert!((found.real_poles[0].rate - 0.12).abs() < 1e-6);
        // An overdamped neuromuscular system has three real poles; with a lead of .6 s next to a slow lag, one
        // assignment is exact. Any exact assignment has the same response, and the first one is used.
        let x = [5.0, 0.6, 0.12, 11.0_f64.ln(), 1.3_f64.ln(), 0.137];
        let overdamped = FamilyOperator::new(Form::LeadLag, true, &x).unwrap();
        let found = family_from_polynomials(&exact_polynomials(&overdamped), None, None).unwrap();
        assert_eq!(found.real_poles.len(), 3);
        assert!(found.mismatch < 1e-7);
        let lags = found.real_poles.iter().filter(|p| p.role == PoleRole::Lag).count();
        assert_eq!(lags, 1);
    }

    #[test]
    fn covariance_matches_finite_differences_of_the_coefficients() {
        // Each coefficient is changed by a small step; the coordinates change as dx/dtheta predicts.
        let operator = FamilyOperator::new(Form::LeadLag, true, &LEAD_LAG).unwrap();
        let model = exact_polynomials(&operator);
        let n = model.theta().len();
        for k in 0..n {
            let mut covariance = vec![0.0; n * n];
            covariance[k * n + k] = 1.0;
            let found = family_from_polynomials(&model, Some(&covariance), Some(Form::LeadLag)).unwrap();
            let by_covariance = found.covariance.unwrap();
            let h = 1e-8;
            let at = |by: f64| {
                let mut theta = model.theta().to_vec();
                theta[k] += by;
                let moved = PolynomialModel::new(model.structure(), model.orders(), ts(), theta).unwrap();
                family_from_polynomials(&moved, None, Some(Form::LeadLag))
                    .unwrap()
                    .operator
            };
            let (up, down) = (at(h), at(-h));
            for i in 0..6 {
                let slope = (up.coordinates()[i] - down.coordinates()[i]) / (2.0 * h);
                let expected = by_covariance[i * 6 + i].sqrt();
                assert!(
                    (slope.abs() - expected).abs() < 2e-3 * expected.max(1.0),
                    "theta {k}, coordinate {i}: {slope} {expected}"
                );
            }
        }
    }

    #[test]
    fn polynomials_without_an_operator_are_refused() {
        let refused = |m: &PolynomialModel, form| family_from_polynomials(m, None, form).unwrap_err().to_string();
        // Four poles, an unstable pole, a negative real pole and a missing delay are rejected.
        let four = polynomials(9, &[0.1, 0.1], &[-0.5, 0.2, 0.0, 0.01]);
        assert!(refused(&four, None).contains("one to three poles, found 4"));
        assert!(refused(&polynomials(9, &[0.1], &[-1.2]), None).contains("not stable"));
        assert!(refused(&polynomials(9, &[0.1], &[0.5]), None).contains("negative real axis"));
        assert!(refused(&polynomials(0, &[0.1], &[-0.5]), None).contains("nk = 0"));
        // B has lightly damped zeros, which no form has.
        let notch = polynomials(9, &[1.0, -1.98, 0.995], &[-1.7, 0.75]);
        assert!(refused(&notch, None).contains("the response of the nearest operator"));
        let lead_lag = exact_polynomials(&operators()[3]);
        assert!(refused(&lead_lag, Some(Form::Lead)).contains("does not match"));
    }
}
