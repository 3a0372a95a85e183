//! A frequency response without a form: from an ARX model of high order.
//!
//! In a closed loop the direct prediction error method needs a noise model that is rich enough and
//! no knowledge of the loop (L. Ljung, *System Identification*, 1999, section 13.4). An ARX model
//! of high order has that, is one linear regression, and its response stands for the describing
//! function where no periodic excitation was recorded: for the starts of all forms.

use hoid_model::{Complex64, Record, Structure};

use super::response_fit::MeasuredResponse;
use crate::{Estimator, IdentError};

/// Order of A.
const POLES: usize = 16;
/// Coefficients of A or B below which no other model is tried.
const FEWEST: usize = 4;
/// Most coefficients of B.
const MOST_GAINS: usize = 60;
/// Frequencies of the response, rad/s, evenly over their logarithm.
const BAND_RAD_S: (f64, f64) = (0.5, 20.0);
const POINTS: usize = 24;
/// Longest part of the response to an error that B holds, s.
const RESPONSE_S: f64 = 0.7;

/// The response with its variances.
///
/// # Errors
/// Those of the regression with the fewest coefficients.
pub(super) fn arx_response(records: &[Record]) -> Result<Vec<MeasuredResponse>, IdentError> {
    let ts = records[0].sample_time();
    let shortest = records.iter().map(Record::len).min().unwrap_or(0);
    let gains = ((RESPONSE_S / ts.s()).ceil() as usize)
        .clamp(4, MOST_GAINS)
        .min(shortest / 8);
    let mut orders = Structure::Arx.operator_orders(1);
    orders.na = POLES.min(shortest / 12).max(2);
    orders.nb = gains.max(2);
    let mut found = Estimator::new(Structure::Arx, orders).fit(records);
    // A smooth record does not determine so many coefficients: as many as it does.
    while found.is_err() && orders.na.max(orders.nb) > FEWEST {
        orders.na = orders.na.div_ceil(2).max(2);
        orders.nb = orders.nb.div_ceil(2).max(2);
        found = Estimator::new(Structure::Arx, orders).fit(records);
    }
    let fit = found?;
    let highest = BAND_RAD_S.1.min(0.8 * ts.nyquist_rad_s());
    let omega: Vec<f64> = (0..POINTS)
        .map(|i| BAND_RAD_S.0 * (highest / BAND_RAD_S.0).powf(i as f64 / (POINTS as f64 - 1.0)))
        .collect();
    let of = |point: &crate::ResponsePoint| {
        let gain = 10f64.powf(point.magnitude_db.value / 20.0);
        let error = |e: Option<f64>| e.unwrap_or(0.0);
        let relative = error(point.magnitude_db.standard_error) * std::f64::consts::LN_10 / 20.0;
        let turn = error(point.phase_deg.standard_error).to_radians();
        MeasuredResponse {
            omega_rad_s: point.omega_rad_s,
            response: Complex64::from_polar(gain, point.phase_deg.value.to_radians()),
            // Never better known than to a thousandth: an exact fit has no variance.
            variance: gain * gain * (relative * relative + turn * turn).max(1e-6),
        }
    };
    Ok(fit.frequency_response(&omega).iter().map(of).collect())
}
