//! Tests whether the lag of the basis, which the method keeps constant, is that of the person.
//!
//! Gains, poles and delay are tracked, but the lag is not: with a lag of 3 s in the basis, the phase at .5 rad/s of a
//! person with a lag of 8 s is wrong by about 15 deg. If the response at low frequencies has a lag, the operator of the
//! form `lag` is therefore fitted to the data since the last change, at most to the last [`MAX_SPAN_S`], and its
//! response at [`COMPARED_RAD_S`] is compared with the response of the last row.

use hoid_ident::family::FamilyEstimator;
use hoid_model::{Finding, Form, Record, operator_family::Coordinate};

use crate::trace::Trace;

/// Frequencies at which the responses are compared, rad/s.
pub(crate) const COMPARED_RAD_S: [f64; 2] = [0.5, 1.0];
/// Longest and shortest span of the batch fit, s.
const MAX_SPAN_S: f64 = 60.0;
const MIN_SPAN_S: f64 = 20.0;
/// Phase in deg, at the first frequency and without the contribution of the delay; the response counts as having a lag
/// if its phase is significantly below this value.
const LAG_PHASE_DEG: f64 = -15.0;
/// Difference of the phases that is reported, in standard errors of the batch fit and in deg. If the lag is that of the
/// person, the variance of the difference is that of the batch fit less that of the trace (J. A. Hausman,
/// *Econometrica* 46 (1978) 1251-1271).
const MAX_DISTANCE: f64 = 2.0;
const MAX_DIFFERENCE_DEG: f64 = 5.0;
/// Smallest and largest lag that the finding proposes, s.
const PROPOSED_LAGS_S: (f64, f64) = (0.5, 10.0);

impl Trace {
    /// Finding that the lag of the basis is not that of the person.
    pub(super) fn held_lag_finding(&self, record: &Record) -> Option<Finding> {
        let lag_s = self.options().basis_lag_of_one_input_s()?;
        let tau_s = self.operator(self.len().checked_sub(1)?).ok()?.tau_e_s.value;
        let [first, _] = COMPARED_RAD_S;
        let phase = self.low_responses.first()?.phase_deg();
        let without_delay = phase.value + (first * tau_s).to_degrees();
        if without_delay + 2.0 * phase.standard_error? > LAG_PHASE_DEG {
            return None;
        }
        let end = record.time_s(record.len());
        let changed = self.changes().last().map(|(t, change)| t - change.seconds_ago);
        let from = (self.settled_from_s(record, 0.0))
            .max(changed.unwrap_or(f64::MIN))
            .max(end - MAX_SPAN_S);
        if end - from < MIN_SPAN_S {
            return None;
        }
        let estimator = FamilyEstimator {
            forms: vec![Form::Lag],
            ..FamilyEstimator::default()
        };
        let fit = estimator.fit(&[record.span(from, end).ok()?]).ok()?;
        let points = fit.frequency_response(0, &COMPARED_RAD_S);
        let (point, own) = points.iter().zip(&self.low_responses).find(|(point, own)| {
            let (batch, own) = (point.phase_deg, own.phase_deg());
            let difference = ((batch.value - own.value + 180.0).rem_euclid(360.0) - 180.0).abs();
            let limit = MAX_DISTANCE * batch.standard_error.unwrap_or(f64::INFINITY);
            difference > limit.max(MAX_DIFFERENCE_DEG)
        })?;
        let lag = 1.0 / fit.coordinate(0, Coordinate::LagRate)?.value.max(f64::MIN_POSITIVE);
        let lag = lag.clamp(PROPOSED_LAGS_S.0, PROPOSED_LAGS_S.1);
        let finding = Finding::warning(
            "held-lag",
            format!(
                "an operator with a lag, fitted to the last {:.0} s, has a phase of {:.0} deg at {} rad/s, but the \
                 last row has {:.0} deg: the lag T_I, held at {lag_s:.1} s, is not that of the person; use --prior \
                 T_I={lag:.1}:0.1",
                end - from,
                point.phase_deg.value,
                point.omega_rad_s,
                own.phase_deg().value
            ),
        );
        Some(finding.over(from, end))
    }
}
