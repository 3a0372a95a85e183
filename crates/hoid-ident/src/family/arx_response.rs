//! A frequency response from a high-order ARX model, without an assumption on the form of the operator.
//!
//! In a closed loop the direct prediction error method needs a sufficiently flexible noise model but no knowledge of
//! the loop (L. Ljung, *System Identification*, 1999, section 13.4). A high-order ARX model is flexible enough and
//! requires only one linear regression. If no periodic excitation was recorded, the response of this model replaces the
//! describing function as the source of starts for all forms.
//!
//! **B must cover the delay.** At 200 Hz the highest number of coefficients covers 0.3 s, and a smooth error, such as a
//! sum of a few sinusoids, determines fewer coefficients than there are samples in the response of a person. The rate
//! is then lowered ([`Record::decimated`]), so fewer coefficients span the same time. The rate is lowered no further
//! than necessary: in a closed loop the decimation filter, which needs later samples, makes e depend on later noise.

use hoid_model::{Channel, Complex64, Orders, Record, SampleTime, Structure, resampling::PASS_BAND_EDGE};

use super::{prediction::ROUNDING_POWER, response_fit::MeasuredResponse};
use crate::{Estimator, Fit, IdentError, ResponsePoint};

/// Highest order of A.
const MAX_NA: usize = 16;
/// The orders are not reduced further if neither A nor B has more coefficients than this.
const MIN_COEFFICIENTS: usize = 4;
/// Maximum number of coefficients of B.
pub(super) const MAX_NB: usize = 60;
/// Innovation variance relative to the power of u below which the record may be free of noise.
const LOW_NOISE_RATIO: f64 = 1e-3;
/// Smallest ratio of the innovation variance to the power of rounding errors at which the residuals are noise. The
/// margin allows for different degrees of freedom and first samples.
const MIN_NOISE_TO_ROUNDING_RATIO: f64 = 4.0;
/// Lowest and highest order of A in the exact ARX model of an operator: the neuromuscular system and up to two lags.
const EXACT_NA_RANGE: (usize, usize) = (2, 4);
/// Number of B coefficients minus the order of A in the exact ARX model of an operator: one for the fractional part of
/// the delay and one for linear interpolation.
const EXTRA_NB: usize = 2;
/// Frequency range of the response, rad/s; its points are evenly spaced on a logarithmic scale.
const BAND_RAD_S: (f64, f64) = (0.5, 20.0);
const POINT_COUNT: usize = 24;
/// Duration of the impulse response that B can describe, s.
const IMPULSE_RESPONSE_S: f64 = 0.7;
/// Shortest duration of B, s: the duration of a typical delay.
const SHORTEST_RESPONSE_S: f64 = 0.2;

/// A frequency response without an assumption on the form of the operator.
#[derive(Debug, Clone)]
pub(super) struct ArxResponse {
    /// Points of the response with their variances.
    pub points: Vec<MeasuredResponse>,
    /// Innovation variance relative to the power of u.
    innovations: f64,
}

impl ArxResponse {
    /// Estimates the response from all records together. The orders are halved until the records determine the
    /// coefficients; a smooth record determines fewer of them. The sampling frequency is halved if B would need at
    /// least twice [`MAX_NB`] coefficients or if B has become shorter than [`SHORTEST_RESPONSE_S`], as long as the pass
    /// band still contains the band of the response.
    ///
    /// # Errors
    /// The errors of the regression with the lowest orders.
    pub fn of(records: &[Record]) -> Result<Self, IdentError> {
        let mut slower: Option<Vec<Record>> = None;
        let mut lead_s = 0.0;
        loop {
            let records = slower.as_deref().unwrap_or(records);
            let is_too_fast = nb_for_response(records) >= 2 * MAX_NB;
            let found = regress(records, false, MAX_NB);
            let covers = |orders: &Orders| orders.nb as f64 * records[0].sample_time().s() >= SHORTEST_RESPONSE_S;
            let is_short = found.as_ref().is_ok_and(|(_, orders)| !covers(orders));
            if (is_too_fast || is_short)
                && let Some((next, lead)) = halve_sampling_rate(records)
            {
                lead_s += lead;
                slower = Some(next);
                continue;
            }
            let (found, _) = found?;
            return Ok(found.without_lead(lead_s));
        }
    }

    /// Converts the response of u to an error that is ahead by this time into the response of u to e.
    fn without_lead(mut self, lead_s: f64) -> Self {
        for point in &mut self.points {
            point.response *= Complex64::from_polar(1.0, point.omega_rad_s * lead_s);
        }
        self
    }

    /// Estimates the response from records with almost no noise; `None` if there is more noise. A high-order model has
    /// two problems here: a noise-free u does not determine the coefficients of A, and B must cover the delay, which
    /// takes many samples at high sampling frequencies. However, an operator without noise is exactly an ARX model of
    /// the order of the operator, with its delay in whole samples. The high-order model and all models of this kind are
    /// fitted, and the one with the smallest innovation variance is used.
    pub fn from_noise_free(records: &[Record], longest_delay_s: f64) -> Option<Self> {
        let (high, of_high) = regress(records, true, MAX_NB).ok()?;
        if high.innovations > LOW_NOISE_RATIO {
            return None;
        }
        // If there is noise, models that use only a subset of the regressors of the high-order model are skipped, since
        // their innovation variance cannot be smaller.
        let is_noise = high.innovations > MIN_NOISE_TO_ROUNDING_RATIO * ROUNDING_POWER;
        let contained = |orders: &Orders| {
            let last = |orders: &Orders| orders.nk + orders.nb;
            orders.na <= of_high.na && orders.nk >= of_high.nk && last(orders) <= last(&of_high)
        };
        let longest = (longest_delay_s / records[0].sample_time().s()).ceil() as usize;
        let own = (EXACT_NA_RANGE.0..=EXACT_NA_RANGE.1)
            .flat_map(|na| (0..=longest).map(move |nk| (na, nk)))
            .map(|(na, nk)| {
                let mut orders = Structure::Arx.operator_orders(nk);
                (orders.na, orders.nb) = (na, na + EXTRA_NB);
                orders
            })
            .filter(|orders| !(is_noise && contained(orders)))
            .filter_map(|orders| estimator_with_level(orders).fit(records).ok())
            .map(|fit| Self::from_fit(records, &fit));
        let least = own.fold(high, |least, own| {
            if own.innovations < least.innovations {
                own
            } else {
                least
            }
        });
        (least.innovations < ROUNDING_POWER).then_some(least)
    }

    fn from_fit(records: &[Record], fit: &Fit) -> Self {
        let ts = records[0].sample_time();
        let squares: f64 = records.iter().flat_map(Record::output).map(|u| u * u).sum();
        let samples: usize = records.iter().map(Record::len).sum();
        Self {
            points: fit
                .frequency_response(&frequencies(ts))
                .iter()
                .map(measured_response)
                .collect(),
            innovations: fit.innovation_variance() * samples as f64 / squares,
        }
    }
}

/// Returns the frequencies in rad/s at which the response of an ARX model is computed.
pub(super) fn frequencies(ts: SampleTime) -> Vec<f64> {
    let highest = BAND_RAD_S.1.min(0.8 * ts.nyquist_rad_s());
    (0..POINT_COUNT)
        .map(|i| BAND_RAD_S.0 * (highest / BAND_RAD_S.0).powf(i as f64 / (POINT_COUNT as f64 - 1.0)))
        .collect()
}

/// Returns (na, nb) of the first regression; nb applies to each of the inputs.
pub(super) fn initial_orders(records: &[Record], inputs: usize, max_gains: usize) -> (usize, usize) {
    let shortest = records.iter().map(Record::len).min().unwrap_or(0);
    let nb = nb_for_response(records)
        .clamp(MIN_COEFFICIENTS, max_gains)
        .min(shortest / (8 * inputs));
    (MAX_NA.min(shortest / 12).max(2), nb.max(2))
}

/// Returns both orders halved; `None` if neither order exceeds [`MIN_COEFFICIENTS`].
pub(super) fn halve_orders((na, nb): (usize, usize)) -> Option<(usize, usize)> {
    (na.max(nb) > MIN_COEFFICIENTS).then(|| (na.div_ceil(2).max(2), nb.div_ceil(2).max(2)))
}

/// Returns an ARX estimator that also estimates a level: without noise, an error in the removed means would be visible.
fn estimator_with_level(orders: Orders) -> Estimator {
    Estimator {
        level: true,
        ..Estimator::new(Structure::Arx, orders)
    }
}

/// Returns the records at half the sampling frequency, and the time in s by which e is then ahead. `None` if the pass
/// band would not contain the band of the response, or if a record is too short.
fn halve_sampling_rate(records: &[Record]) -> Option<(Vec<Record>, f64)> {
    if 0.5 * PASS_BAND_EDGE * records[0].sample_time().nyquist_rad_s() < BAND_RAD_S.1 {
        return None;
    }
    let mut lead_s = 0.0;
    let halved = records.iter().map(|record| {
        let (input, output) = (record.input().to_vec(), record.output().to_vec());
        let both = Record::new(
            record.sample_time(),
            Channel::new("e", "", input),
            Channel::new("u", "", output),
        );
        let (halved, done) = both.ok()?.decimated(2).ok()?;
        lead_s = done.lead_s;
        Some(halved)
    });
    let halved: Option<Vec<Record>> = halved.collect();
    Some((halved?, lead_s))
}

/// Returns the number of B coefficients that cover a response with the duration [`IMPULSE_RESPONSE_S`].
fn nb_for_response(records: &[Record]) -> usize {
    (IMPULSE_RESPONSE_S / records[0].sample_time().s()).ceil() as usize
}

/// Repeats the regression until the records determine the coefficients, each time with half the order of A or with half
/// of both orders. Returns the response and the orders.
fn regress(records: &[Record], of_a_alone: bool, max_gains: usize) -> Result<(ArxResponse, Orders), IdentError> {
    let mut orders = Structure::Arx.operator_orders(1);
    (orders.na, orders.nb) = initial_orders(records, 1, max_gains);
    loop {
        let estimator = if of_a_alone {
            estimator_with_level(orders)
        } else {
            Estimator::new(Structure::Arx, orders)
        };
        let found = estimator.fit(records);
        let fewer = if of_a_alone {
            (orders.na > 2).then(|| (orders.na.div_ceil(2).max(2), orders.nb))
        } else {
            halve_orders((orders.na, orders.nb))
        };
        match fewer {
            Some(fewer) if found.is_err() => (orders.na, orders.nb) = fewer,
            _ => return found.map(|fit| (ArxResponse::from_fit(records, &fit), orders)),
        }
    }
}

/// Converts a point of the frequency response of a fit.
pub(super) fn measured_response(point: &ResponsePoint) -> MeasuredResponse {
    let gain = 10f64.powf(point.magnitude_db.value / 20.0);
    let error = |e: Option<f64>| e.unwrap_or(0.0);
    let relative = error(point.magnitude_db.standard_error) * std::f64::consts::LN_10 / 20.0;
    let turn = error(point.phase_deg.standard_error).to_radians();
    MeasuredResponse {
        omega_rad_s: point.omega_rad_s,
        response: Complex64::from_polar(gain, point.phase_deg.value.to_radians()),
        // The relative error is set to at least 1e-3, because an exact fit has no variance.
        variance: gain * gain * (relative * relative + turn * turn).max(1e-6),
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::{FamilyOperator, Form};

    use super::*;
    use crate::family::{
        Intersample,
        simulated_operator::{Uniform, response_to},
    };

    /// Returns a record of 60 s: a person with a long delay, an error that is a sum of twelve sinusoids, and 10 %
    /// noise.
    fn record(truth: &FamilyOperator, ts: SampleTime) -> Record {
        let model = truth.zoh(ts).unwrap();
        let n = (60.0 / ts.s()) as usize;
        let mut random = Uniform(7);
        let mut uniform = || random.between(-0.5, 0.5);
        let lines: Vec<(f64, f64)> = (0..12)
            .map(|i| (0.3 * 40f64.powf(f64::from(i) / 11.0), 6.0 * uniform()))
            .collect();
        let sum = |t: f64| -> f64 { lines.iter().map(|(w, p)| (w * t + p).sin() / (1.0 + 0.2 * w)).sum() };
        let e: Vec<f64> = (0..n).map(|k| sum(k as f64 * ts.s())).collect();
        let w = response_to(&model, &e);
        let (pole, mut noise) = ((-ts.s() / 0.1).exp(), 0.0);
        let u = w.iter().map(|w| {
            noise = pole * noise + (1.0 - pole * pole).sqrt() * uniform();
            w + 2.0 * noise
        });
        let u: Vec<f64> = u.collect();
        Record::new(ts, Channel::new("e", "", e), Channel::new("u", "", u)).unwrap()
    }

    #[test]
    fn arx_response_includes_the_delay_at_every_sampling_rate() {
        let truth = FamilyOperator::new(Form::Lead, true, &[2.0, 0.5, 2.3, -1.2, 0.35]).unwrap();
        for rate_hz in [20.0, 50.0, 100.0, 200.0] {
            let ts = SampleTime::new(1.0 / rate_hz).unwrap();
            let found = ArxResponse::of(&[record(&truth, ts)]).unwrap();
            let inside = found.points.iter().filter(|p| (0.7..8.0).contains(&p.omega_rad_s));
            for point in inside {
                let omega = point.omega_rad_s;
                let expected = truth.response(omega) * Intersample::Zoh.response(omega, ts);
                let off = (point.response / expected - 1.0).norm();
                assert!(off < 0.4, "{rate_hz} {omega} {off}");
            }
        }
    }
}
