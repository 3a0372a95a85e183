//! Start of the recursion: the basis, its uncertainty, and the estimate of an earlier fit.
//!
//! **A fit** has coordinates x of an operator Y(x) with covariance C. The recursion has gains theta of the responses
//! h_i of a basis, which is computed for the delay, the neuromuscular system and the lag of the fit, and corrections of
//! delay and neuromuscular system. The gains are those whose response is nearest to Y at [`FIT_FREQUENCIES_RAD_S`]
//! rad/s,
//!
//! `theta = argmin sum_k |(sum_i theta_i h_i(w_k) - Y(w_k))/Y(w_k)|^2`,
//!
//! and the derivatives J of the state s = (theta, level, corrections) with respect to x follow from the same problem
//! for dY/dx, except for the derivatives of the corrections, which are known directly. The covariance of s is
//! `S = J C J'`. For the forms with a lag, and for a gain with a lead, the nearest operator is the operator itself.
//!
//! The remnant of the fit is `v = (C/D) eps`; with the impulse response g of C/D, the autocovariances of v divided by
//! the variance of eps are `r_k = sum_j g_j g_{j+k}`.

use hoid_core::adaptive::{
    DYNAMICS_COUNT, GAIN_COUNT, LINEAR_COUNT, MAX_NOISE_ORDER, STATE_COUNT,
    basis::{Basis, Point, REFERENCE_RAD_S},
    defaults::{DefaultOperator, GIVEN_DELAY_DEVIATION_S, LAG_S},
    initial_estimate::InitialEstimate,
    noise::Lags,
};
use hoid_ident::IdentError;
use hoid_model::{Complex64, FittedOperator, SampleTime, operator_family::Coordinate, uncertainty::variance_along};

use crate::person_prior::PersonPrior;

/// Standard deviations of the dynamics without prior knowledge: relative for omega and zeta, in s for tau.
const UNINFORMATIVE_DEVIATIONS: [f64; DYNAMICS_COUNT] = [0.45, 0.75, 0.15];
/// Frequencies at which the gains are fitted to the response of an earlier fit: range in rad/s, and number.
const FIT_FREQUENCIES_RAD_S: ([f64; 2], usize) = ([0.3, 8.0], 24);
/// Range of the lag of a basis, s. A lag beyond its upper end cannot be distinguished from an integration.
const LAG_RANGE_S: [f64; 2] = [0.05, 10.0];
/// Root mean square of the relative misfit beyond which the basis cannot approximate a form.
const MAX_MISFIT: f64 = 0.1;
/// Length of data, in s, that has the same weight as the remnant of a fit.
const REMNANT_WEIGHT_S: f64 = 20.0;
/// Longest impulse response of the remnant that is summed (in s), and the largest share of its power that may be in its
/// second half.
const MAX_IMPULSE_RESPONSE_S: f64 = 60.0;
const MAX_SECOND_HALF_SHARE: f64 = 1e-6;
/// Prior standard deviation of the level of u, in standard deviations of the remnant.
const LEVEL_DEVIATION: f64 = 3.0;

/// The point at which the basis is computed at the start, and the prior standard deviations of a person's dynamics
/// about it.
pub(super) struct StartingPoint {
    pub point: Point,
    /// Prior standard deviations: relative for omega and zeta, in s for the delay.
    pub spread: [f64; DYNAMICS_COUNT],
}

impl StartingPoint {
    /// Computes the starting point from the prior. `tau_s` is the delay for an error that is linear between samples;
    /// `is_given` is true if the user gave this delay.
    pub fn of(prior: &PersonPrior, tau_s: f64, is_given: bool, sample_time: SampleTime) -> Result<Self, IdentError> {
        let DefaultOperator {
            mut point, mut spread, ..
        } = DefaultOperator::with_delay(tau_s);
        // An error that is held between samples is half a sample later than an error that is linear between samples.
        let hold = 0.5 * sample_time.s();
        let of_delay = |otherwise: f64| if is_given { GIVEN_DELAY_DEVIATION_S } else { otherwise };
        spread[2] = of_delay(spread[2]);
        match prior {
            PersonPrior::Population => {}
            PersonPrior::Nothing => {
                spread = [
                    UNINFORMATIVE_DEVIATIONS[0],
                    UNINFORMATIVE_DEVIATIONS[1],
                    of_delay(UNINFORMATIVE_DEVIATIONS[2]),
                ]
            }
            PersonPrior::Named(_) => {
                let places = [&mut point.omega, &mut point.zeta];
                for ((name, place), spread) in ["omega_nm", "zeta_nm"].into_iter().zip(places).zip(&mut spread) {
                    if let Some((centre, relative)) = prior.named_parameter(name) {
                        (*place, *spread) = (centre, relative);
                    }
                }
                if let Some((centre, relative)) = prior.named_parameter("tau_e") {
                    (point.tau, spread[2]) = (centre + hold, centre * relative);
                }
                if let Some((centre, _)) = prior.named_parameter("T_I") {
                    point.lag = centre.clamp(LAG_RANGE_S[0], LAG_RANGE_S[1]);
                }
            }
            PersonPrior::Fit(fit) => {
                let Some((omega, zeta)) = fit.operator.neuromuscular_parameters() else {
                    return Err(unsupported_fit(
                        fit,
                        "it has no neuromuscular system, which the basis of this method requires; identify the person \
                         with --neuromuscular yes",
                    ));
                };
                let all = fit.operator.form().coordinates(true);
                let rate = all.iter().position(|c| *c == Coordinate::LagRate);
                let lag = match rate.map(|i| fit.operator.coordinates()[i]) {
                    Some(rate) => 1.0 / rate.max(1.0 / LAG_RANGE_S[1]),
                    None if fit.operator.form().has_pole() => LAG_RANGE_S[1],
                    // A form with a squared lead and without a lag is best approximated with a short lag of the basis.
                    None if fit.operator.form().degree() == 2 => LAG_RANGE_S[0],
                    None => LAG_S,
                };
                point = Point {
                    tau: fit.operator.tau_e_s() + hold,
                    omega,
                    zeta,
                    lag: lag.max(LAG_RANGE_S[0]),
                };
            }
        }
        Ok(Self { point, spread })
    }
}

fn unsupported_fit(fit: &FittedOperator, why: &str) -> IdentError {
    IdentError::BadStart {
        reason: format!("{}: {why}, or start with --prior population", fit.source),
    }
}

/// Returns the estimate of a fit in the basis that `StartingPoint::of` selected for this fit.
///
/// # Errors
/// [`IdentError::BadStart`] for a form that the basis cannot approximate.
pub(super) fn initial_estimate(
    fit: &FittedOperator,
    basis: &Basis,
    sample_time: SampleTime,
) -> Result<InitialEstimate, IdentError> {
    let nearest = NearestGains::new(fit, basis, sample_time);
    let (value, misfit) = nearest.gains(|k| nearest.responses[k].value);
    if misfit > MAX_MISFIT {
        return Err(unsupported_fit(
            fit,
            &format!(
                "the response of the form {} differs by {:.0} % from the nearest operator of the basis; identify the \
                 person with a form that has a lag, such as --form lead-lag",
                fit.operator.form(),
                100.0 * misfit
            ),
        ));
    }
    let mut state = [0.0; STATE_COUNT];
    state[..GAIN_COUNT].copy_from_slice(&value);
    let coordinates = fit.operator.form().coordinates(true);
    let p = coordinates.len();
    let point = basis.point();
    // Rows of J for the coordinates, then S = J C J'.
    let columns: Vec<[f64; STATE_COUNT]> = (0..p)
        .map(|j| {
            let mut column = [0.0; STATE_COUNT];
            match coordinates[j] {
                Coordinate::LogOmega => column[LINEAR_COUNT] = point.omega,
                Coordinate::LogZeta => column[LINEAR_COUNT + 1] = point.zeta,
                Coordinate::Delay => column[LINEAR_COUNT + 2] = 1.0,
                _ => column[..GAIN_COUNT].copy_from_slice(&nearest.gains(|k| nearest.responses[k].gradient[j]).0),
            }
            column
        })
        .collect();
    let mut covariance = [[0.0; STATE_COUNT]; STATE_COUNT];
    for (i, a) in columns.iter().enumerate() {
        for (j, b) in columns.iter().enumerate() {
            for (row, a) in covariance.iter_mut().zip(a) {
                for (c, b) in row.iter_mut().zip(b) {
                    *c += a * fit.covariance[i * p + j] * b;
                }
            }
        }
    }
    let widened = nearest.covariance_factor(fit, &coordinates, &columns);
    covariance.iter_mut().flatten().for_each(|c| *c *= widened);
    let lags = remnant_autocovariances(fit, sample_time);
    let power = lags.map_or(1.0, |lags| lags[0]) * fit.innovation_variance;
    covariance[GAIN_COUNT][GAIN_COUNT] = LEVEL_DEVIATION * LEVEL_DEVIATION * power;
    Ok(InitialEstimate {
        state,
        covariance: symmetrise(&covariance),
        variance: fit.innovation_variance,
        units: [fit.operator.response_and_gradient(REFERENCE_RAD_S).value.norm()],
        remnant: lags.map(|lags| (lags, REMNANT_WEIGHT_S)),
    })
}

/// Makes the matrix exactly symmetric.
fn symmetrise(c: &[[f64; STATE_COUNT]; STATE_COUNT]) -> [[f64; STATE_COUNT]; STATE_COUNT] {
    std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (c[i][j] + c[j][i])))
}

/// Autocovariances of `(C/D) eps` divided by the variance of eps; `None` if the impulse response does not decay.
fn remnant_autocovariances(fit: &FittedOperator, sample_time: SampleTime) -> Option<Lags> {
    let (c, d) = &fit.noise;
    let longest = (MAX_IMPULSE_RESPONSE_S / sample_time.s()) as usize;
    let mut g = vec![0.0; longest];
    for k in 0..longest {
        let moving = if k == 0 {
            1.0
        } else {
            c.get(k - 1).copied().unwrap_or(0.0)
        };
        let past: f64 = d.iter().take(k).enumerate().map(|(i, d)| d * g[k - 1 - i]).sum();
        g[k] = moving - past;
    }
    let power = |g: &[f64]| g.iter().map(|x| x * x).sum::<f64>();
    let all = power(&g);
    if !all.is_finite() || power(&g[longest / 2..]) > MAX_SECOND_HALF_SHARE * all {
        return None;
    }
    let of = |k: usize| g.iter().zip(&g[k.min(longest)..]).map(|(a, b)| a * b).sum();
    let lags: Lags = std::array::from_fn(of);
    debug_assert_eq!(lags.len(), MAX_NOISE_ORDER + 1);
    Some(lags)
}

/// The least-squares problem of the nearest gains.
struct NearestGains {
    /// Responses of the operator, after a zero-order hold, at each frequency.
    responses: Vec<hoid_model::operator_family::FamilyResponse>,
    /// Responses of the basis at each frequency, divided by the response of the operator.
    basis: Vec<[Complex64; GAIN_COUNT]>,
}

impl NearestGains {
    /// Returns the factor by which the covariance of the state must be increased so that at no frequency the response
    /// is known better than from the fit. The factor exceeds one because gains with a fixed lag cannot represent the
    /// uncertainty of the response that an unknown lag causes.
    fn covariance_factor(
        &self,
        fit: &FittedOperator,
        coordinates: &[Coordinate],
        columns: &[[f64; STATE_COUNT]],
    ) -> f64 {
        let p = coordinates.len();
        let sizes = |g: &[Complex64]| -> [f64; 2] {
            let of = |part: fn(&Complex64) -> f64| {
                let gradient: Vec<f64> = g.iter().map(part).collect();
                variance_along(&gradient, &fit.covariance)
            };
            [of(|g| g.re), of(|g| g.im)]
        };
        let ratio = |k: usize| {
            let response = &self.responses[k];
            let whole: Vec<Complex64> = response.gradient.iter().map(|g| g / response.value).collect();
            let kept: Vec<Complex64> = (0..p)
                .map(|j| match coordinates[j] {
                    Coordinate::LogOmega | Coordinate::LogZeta | Coordinate::Delay => whole[j],
                    _ => self.basis[k].iter().zip(&columns[j]).map(|(h, c)| h * c).sum(),
                })
                .collect();
            let (whole, kept) = (sizes(&whole), sizes(&kept));
            (whole[0] + whole[1]) / (kept[0] + kept[1])
        };
        let ratios = (0..self.responses.len()).map(ratio);
        ratios.filter(|ratio| ratio.is_finite()).fold(1.0, f64::max)
    }

    fn new(fit: &FittedOperator, basis: &Basis, sample_time: SampleTime) -> Self {
        let ([low, high], count) = FIT_FREQUENCIES_RAD_S;
        let high = high.min(0.9 * sample_time.nyquist_rad_s());
        let at = |k: usize| low * (high / low).powf(k as f64 / (count as f64 - 1.0));
        let held = |omega: f64| {
            let half = 0.5 * omega * sample_time.s();
            Complex64::from_polar(half.sin() / half, -half)
        };
        let responses: Vec<_> = (0..count)
            .map(|k| {
                let mut found = fit.operator.response_and_gradient(at(k));
                let hold = held(at(k));
                found.value *= hold;
                found.gradient.iter_mut().for_each(|g| *g *= hold);
                found
            })
            .collect();
        let over = |k: usize| {
            let h = basis.response(at(k), basis.point());
            h.map(|[re, im]| Complex64::new(re, im) / responses[k].value)
        };
        Self {
            basis: (0..count).map(over).collect(),
            responses,
        }
    }

    /// Returns the gains with which the response of the basis is nearest to a target, and the root mean square of the
    /// relative misfit.
    fn gains(&self, target: impl Fn(usize) -> Complex64) -> ([f64; GAIN_COUNT], f64) {
        let count = self.basis.len();
        let relative = |k: usize| target(k) / self.responses[k].value;
        let (mut a, mut b) = ([[0.0; GAIN_COUNT]; GAIN_COUNT], [0.0; GAIN_COUNT]);
        for (k, h) in self.basis.iter().enumerate() {
            for i in 0..GAIN_COUNT {
                b[i] += (h[i].conj() * relative(k)).re;
                for j in 0..GAIN_COUNT {
                    a[i][j] += (h[i].conj() * h[j]).re;
                }
            }
        }
        let gains = solve_by_cramer(a, b);
        let left = |k: usize| {
            let sum: Complex64 = gains.iter().zip(&self.basis[k]).map(|(g, h)| h * *g).sum();
            (sum - relative(k)).norm_sqr()
        };
        let misfit = ((0..count).map(left).sum::<f64>() / count as f64).sqrt();
        (gains, misfit)
    }
}

/// Solves three equations by Cramer's rule: the responses of the basis are far from linearly dependent.
fn solve_by_cramer(a: [[f64; GAIN_COUNT]; GAIN_COUNT], b: [f64; GAIN_COUNT]) -> [f64; GAIN_COUNT] {
    let determinant = |m: &[[f64; GAIN_COUNT]; GAIN_COUNT]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let whole = determinant(&a);
    std::array::from_fn(|j| {
        let mut with = a;
        for (row, b) in with.iter_mut().zip(b) {
            row[j] = b;
        }
        determinant(&with) / whole
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_core::adaptive::defaults;
    use hoid_model::{FamilyOperator, Form, uncertainty::variance_along};

    use super::*;
    use crate::{Method, TrackOptions, Tracker};

    /// Returns a fit of a form, with correlated errors of a few percent.
    fn fitted(form: Form, x: &[f64]) -> FittedOperator {
        let p = x.len();
        let size = |i: usize| 0.03 * x[i].abs().max(0.3);
        FittedOperator {
            operator: FamilyOperator::new(form, true, x).unwrap(),
            covariance: (0..p * p)
                .map(|k| size(k / p) * size(k % p) * if k / p == k % p { 1.0 } else { 0.2 })
                .collect(),
            noise: (vec![0.4], vec![-1.5, 0.56]),
            innovation_variance: 0.01,
            sample_time: SampleTime::AT_100_HZ,
            units: [String::new(), String::new()],
            source: "fit.json".to_owned(),
        }
    }

    fn tracker(fit: FittedOperator) -> Result<Tracker, IdentError> {
        let mut options = TrackOptions::default_for(Method::adaptive(), 21);
        options.method.start_from(fit).unwrap();
        Tracker::new(&options, None, SampleTime::AT_100_HZ)
    }

    /// Before the first sample, gain and phase and their errors equal those of the fit.
    #[test]
    fn initial_estimate_matches_the_fit_and_its_errors() {
        for (form, x, near) in [
            (Form::Lead, vec![2.0, 0.4, 2.3, -1.2, 0.18], 0.001),
            (Form::LeadLag, vec![1.4, 0.5, 0.25, 2.4, -1.4, 0.153], 0.01),
            (Form::Lead2Lag, vec![1.4, 0.3, 0.4, 2.4, -1.4, 0.2], 0.01),
            // A lag of 50 s, nearly an integration: the basis has the longest lag allowed.
            (Form::LeadLag, vec![1.4, 0.5, 0.02, 2.4, -1.4, 0.2], 0.15),
            (Form::Lag, vec![1.4, 5.0, 2.4, -1.4, 0.2], 0.01),
        ] {
            let fit = fitted(form, &x);
            let told = tracker(fit.clone()).unwrap();
            for omega in [0.5, 1.0, 2.5, 5.0] {
                let expected = fit.operator.response_and_gradient(omega);
                let half = 0.005 * omega;
                let value = expected.value * Complex64::from_polar(half.sin() / half, -half);
                let response = told.response(omega).unwrap();
                let [re, im] = response.value;
                let off = (Complex64::new(re, im) - value).norm() / value.norm();
                assert!(off < near, "{form} {omega}: {off}");
                let relative: Vec<Complex64> = expected.gradient.iter().map(|g| g / expected.value).collect();
                let along = |part: fn(&Complex64) -> f64| {
                    let gradient: Vec<f64> = relative.iter().map(part).collect();
                    variance_along(&gradient, &fit.covariance).sqrt()
                };
                let db = 20.0 / std::f64::consts::LN_10;
                for (found, expected) in [
                    (response.gain_db(), db * along(|r| r.re)),
                    (response.phase_deg(), along(|r| r.im).to_degrees()),
                ] {
                    let ratio = found.standard_error.unwrap() / expected;
                    // At low frequencies the gains cannot represent the uncertainty of the phase that an unknown lag
                    // causes, which is small there compared with the uncertainty of the gain; at other frequencies they
                    // carry slightly more information than the fit.
                    assert!((ratio > 0.9 || omega < 1.0) && ratio < 1.5, "{form} {omega}: {ratio}");
                }
            }
        }
    }

    #[test]
    fn unsupported_starting_fits_are_refused() {
        let none = fitted(Form::LeadDroop, &[1.4, 0.9, 6.0, 2.4, -1.4, 0.2]);
        let refused = tracker(none).err().map(|e| e.to_string());
        assert!(refused.is_none_or(|words| words.contains("--form")));
        let mut still = fitted(Form::LeadLag, &[1.4, 0.5, 0.25, 2.4, -1.4, 0.153]);
        still.operator = FamilyOperator::new(Form::LeadLag, false, &[1.4, 0.5, 0.25, 0.153]).unwrap();
        still.covariance = vec![0.0; 16];
        let words = tracker(still).unwrap_err().to_string();
        assert!(words.contains("--neuromuscular yes"), "{words}");
        let other = FittedOperator {
            sample_time: SampleTime::new(0.02).unwrap(),
            ..fitted(Form::Lead, &[2.0, 0.4, 2.3, -1.2, 0.18])
        };
        assert!(tracker(other).unwrap_err().to_string().contains("50.000000 Hz"));
        assert!(
            Method::rpem()
                .start_from(fitted(Form::Lead, &[2.0, 0.4, 2.3, -1.2, 0.18]))
                .is_err()
        );
    }

    #[test]
    fn remnant_autocovariances_of_a_fit_are_summed() {
        // For an autoregression of order 1 with the pole .8, `r_k = .8^k/(1 - .64)`.
        let fit = FittedOperator {
            noise: (Vec::new(), vec![-0.8]),
            ..fitted(Form::Lead, &[2.0, 0.4, 2.3, -1.2, 0.18])
        };
        let lags = remnant_autocovariances(&fit, SampleTime::AT_100_HZ).unwrap();
        for (k, lag) in lags.iter().enumerate() {
            assert!((lag - 0.8_f64.powi(k as i32) / 0.36).abs() < 1e-9);
        }
        let endless = FittedOperator {
            noise: (Vec::new(), vec![-1.0]),
            ..fit
        };
        assert!(remnant_autocovariances(&endless, SampleTime::AT_100_HZ).is_none());
    }

    #[test]
    fn named_prior_values_replace_the_defaults() {
        let named = Method::adaptive()
            .with("prior", "omega_nm=9:0.2,tau_e=0.25:0.1")
            .unwrap();
        let prior = named.person_prior().unwrap();
        let found = StartingPoint::of(prior, 0.205, false, SampleTime::AT_100_HZ).unwrap();
        assert_eq!(
            (found.point.omega, found.point.zeta, found.point.lag),
            (9.0, defaults::ZETA, LAG_S)
        );
        assert!((found.point.tau - 0.255).abs() < 1e-12);
        assert_eq!(found.spread, [0.2, defaults::PRIOR_DEVIATIONS[1], 0.025]);
        let wide = StartingPoint::of(&PersonPrior::Nothing, 0.205, false, SampleTime::AT_100_HZ).unwrap();
        assert!(wide.spread.iter().zip(defaults::PRIOR_DEVIATIONS).all(|(a, b)| *a > b));
    }
}
