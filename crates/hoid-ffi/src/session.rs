//! Tracker built from a request, including its warm-up. The module is independent of C except for the C strings of the
//! names, which must remain valid for a C caller.

use std::ffi::{CStr, CString};

use hoid_model::{Orders, VerdictLevel, uncertainty::Estimate};
use hoid_track::{Change, Live, Outcome, Sample, Stage, Tracker};

use crate::{
    options::TrackerRequest,
    status::Failure,
    types::{HOID_SHIFTS, HoidChange, HoidCounts, HoidEstimate, HoidOutcome, HoidShift},
};

/// Names and units of the parameters of the operator, in the order in which they are reported.
const OPERATOR: [(&CStr, &CStr); 6] = [
    (c"K_e", c""),
    (c"T_L", c"s"),
    (c"K_e_dot", c"s"),
    (c"omega_nm", c"rad/s"),
    (c"zeta_nm", c""),
    (c"tau_e", c"s"),
];
/// Quantities for which a change is reported.
const SHIFT_NAMES: [&CStr; HOID_SHIFTS] = [c"K_e", c"K_e_dot", c"omega_nm", c"zeta_nm", c"remnant", c"tau_e"];

/// Tracker with the request from which it was built.
pub(crate) struct Session {
    request: TrackerRequest,
    live: Live,
    /// Names of the coefficients; empty until the structure is known.
    names: Vec<CString>,
}

impl Session {
    /// Builds a tracker from the name of the method, the sample time in s, options in JSON, and a fit in JSON.
    pub fn new(
        method: Option<&str>,
        sample_time_s: f64,
        options: Option<&str>,
        fit: Option<&str>,
    ) -> Result<Self, Failure> {
        let asked = TrackerRequest {
            method: method.map(str::to_owned),
            sample_time_s,
            options: options.map(str::to_owned),
            fit: fit.map(str::to_owned),
        };
        Self::of(asked)
    }

    /// Builds the requested tracker in its initial state.
    pub fn of(asked: TrackerRequest) -> Result<Self, Failure> {
        let mut session = Self {
            live: asked.live()?,
            request: asked,
            names: Vec::new(),
        };
        session.update_parameter_names();
        Ok(session)
    }

    /// Restores the recursion from its saved state.
    pub fn restore(&mut self, orders: Option<Orders>, numbers: &[f64]) -> Result<(), Failure> {
        self.live.restore(orders, numbers)?;
        self.update_parameter_names();
        Ok(())
    }

    /// Returns the request and the recursion, for saving.
    pub fn request_and_recursion(&mut self) -> (&TrackerRequest, &mut Live) {
        (&self.request, &mut self.live)
    }

    fn update_parameter_names(&mut self) {
        if let Some(tracker) = self.live.tracker() {
            let names = tracker.parameter_names();
            self.names = names.into_iter().filter_map(|name| CString::new(name).ok()).collect();
        }
    }

    /// Returns the tracker, or an error with the progress of the warm-up if there is no tracker yet.
    pub fn tracker(&self) -> Result<&Tracker, Failure> {
        match self.live.stage() {
            Stage::Tracking(tracker) => Ok(tracker),
            Stage::Collecting(warm_up) => {
                let trouble = warm_up.trouble.as_deref().map_or(String::new(), |t| format!("; {t}"));
                Err(Failure::no_result(format!(
                    "the tracker is warming up: it has {} of {} samples{trouble}",
                    warm_up.collected, warm_up.needed
                )))
            }
        }
    }

    /// Takes a sample and returns its outcome. If `moves` is false, the filters are updated but the estimate stays
    /// constant.
    pub fn take(&mut self, sample: Sample, moves: bool) -> HoidOutcome {
        let taken = (self.live).update(sample, moves, &|plan, record| plan.choose(record, &|| {}));
        if taken.started.is_some() {
            self.update_parameter_names();
        }
        let outcome = taken.outcome;
        let tracker = self.tracker().ok();
        let flag = |of: fn(&Outcome) -> bool| i32::from(outcome.as_ref().is_some_and(of));
        HoidOutcome {
            innovation: outcome.and_then(|o| o.innovation).unwrap_or(f64::NAN),
            ready: i32::from(tracker.is_some()),
            skipped: flag(|o| o.skipped),
            held: flag(|o| o.held),
            shortened: flag(|o| o.shortened),
            changed: i32::from(!taken.between && tracker.is_some_and(|tracker| tracker.change().is_some())),
        }
    }

    /// Returns the coefficients in the order of theta.
    pub fn parameters(&self) -> Result<Vec<HoidEstimate>, Failure> {
        let estimates = self.tracker()?.parameters();
        let of = |(name, estimate): (&CString, Estimate)| HoidEstimate::new(name.as_ptr(), c"".as_ptr(), estimate);
        Ok(self.names.iter().zip(estimates).map(of).collect())
    }

    /// Returns the parameters of the operator.
    pub fn operator(&self) -> Result<Vec<HoidEstimate>, Failure> {
        let tracker = self.tracker()?;
        let operator = tracker
            .operator()
            .map_err(|reason| Failure::no_result(reason.to_string()))?;
        let judged = tracker.determinations(&operator);
        let rows = operator.rows().into_iter().zip(OPERATOR);
        Ok(rows
            .map(|((name, _, estimate), (name_c, unit))| HoidEstimate {
                determined: judged
                    .iter()
                    .find(|(known, _)| *known == name)
                    .map_or(-1, |(_, yes)| i32::from(*yes)),
                ..HoidEstimate::new(name_c.as_ptr(), unit.as_ptr(), estimate)
            })
            .collect())
    }

    /// Returns the crossover frequency and the phase margin.
    pub fn open_loop(&self) -> Result<Vec<HoidEstimate>, Failure> {
        let found = self.tracker()?.open_loop().ok_or_else(|| {
            Failure::no_result("there is no controlled element; give it in the options as \"controlled_element\"")
        })?;
        let found = found.map_err(|reason| Failure::no_result(reason.as_text()))?;
        Ok(vec![
            HoidEstimate::new(c"crossover_rad_s".as_ptr(), c"rad/s".as_ptr(), found.crossover_rad_s),
            HoidEstimate::new(c"phase_margin_deg".as_ptr(), c"deg".as_ptr(), found.phase_margin_deg),
        ])
    }

    /// Returns the gain and the phase at a frequency in rad/s.
    pub fn response(&self, omega_rad_s: f64) -> Result<Vec<HoidEstimate>, Failure> {
        if !(omega_rad_s > 0.0 && omega_rad_s.is_finite()) {
            return Err(Failure::bad_option(format!(
                "the frequency is {omega_rad_s} rad/s, expected a positive frequency"
            )));
        }
        let found = self.tracker()?.response(omega_rad_s);
        let found = found.ok_or_else(|| Failure::no_result("there is no estimate yet"))?;
        Ok(vec![
            HoidEstimate::new(c"gain_db".as_ptr(), c"dB".as_ptr(), found.gain_db()),
            HoidEstimate::new(c"phase_deg".as_ptr(), c"deg".as_ptr(), found.phase_deg()),
        ])
    }

    /// Returns the covariance of the coefficients, row by row.
    pub fn covariance(&self) -> Result<Vec<f64>, Failure> {
        let covariance = self.tracker()?.covariance();
        covariance.ok_or_else(|| Failure::no_result("the estimate has no covariance yet"))
    }

    /// Returns the change that was declared at the last sample.
    pub fn change(&self) -> Result<HoidChange, Failure> {
        let change = self.tracker()?.change();
        let change = change.ok_or_else(|| Failure::no_result("no change was declared at the last sample"))?;
        Ok(reported_change(&change))
    }

    /// Returns the current evidence of a change (`log_odds` of [`HoidChange`]).
    pub fn change_log_odds(&self) -> Result<f64, Failure> {
        let odds = self.tracker()?.change_odds();
        odds.ok_or_else(|| Failure::no_result("the method does not report changes; adaptive and multiple-model do"))
    }

    /// Returns the verdict on the current estimate.
    pub fn level(&self) -> VerdictLevel {
        self.tracker().map_or(VerdictLevel::NotDetermined, |tracker| {
            tracker.verdict_level(&tracker.operator())
        })
    }

    /// Returns the numbers of samples and events since the start.
    pub fn counts(&self) -> HoidCounts {
        let counts = self.live.counts();
        HoidCounts {
            samples: counts.samples,
            skipped: counts.skipped,
            held: counts.held,
            restarts: counts.restarts,
            steps_shortened: counts.shortened,
        }
    }

    /// Returns the sample time in s.
    pub fn sample_time_s(&self) -> f64 {
        self.live.sample_time().s()
    }
}

fn reported_change(change: &Change) -> HoidChange {
    let [before, after] = change.innovation_variance.map(Estimate::fixed);
    let pairs = [
        change.k_e,
        change.k_e_dot,
        change.omega_nm_rad_s,
        change.zeta_nm,
        [before, after],
        change.tau_e_s,
    ];
    let mut shifts = [HoidShift::default(); HOID_SHIFTS];
    for (shift, ((name, [before, after]), z)) in shifts.iter_mut().zip(SHIFT_NAMES.into_iter().zip(pairs).zip(change.z))
    {
        *shift = HoidShift {
            name: name.as_ptr(),
            before: before.value,
            before_standard_error: before.standard_error.unwrap_or(f64::NAN),
            after: after.value,
            after_standard_error: after.standard_error.unwrap_or(f64::NAN),
            z,
        };
    }
    HoidChange {
        seconds_ago: change.seconds_ago,
        log_odds: change.odds,
        probability: change.probability(),
        shifts,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::{OperatorParameters, uncertainty::OperatorEstimate};

    use super::*;

    #[test]
    fn names_and_units_match_the_tables() {
        let operator = OperatorParameters {
            k_e: 0.09,
            t_l_s: 0.4,
            omega_nm_rad_s: 11.25,
            zeta_nm: 0.35,
            tau_e_s: 0.28,
        };
        let rows = OperatorEstimate::from(operator).rows();
        for ((name, unit, _), (name_c, unit_c)) in rows.into_iter().zip(OPERATOR) {
            assert_eq!((name, unit), (name_c.to_str().unwrap(), unit_c.to_str().unwrap()));
        }
        // If only one quantity changes, it is reported as the one that changed.
        for (i, name) in SHIFT_NAMES.into_iter().enumerate() {
            let fixed = [Estimate::fixed(1.0); 2];
            let mut change = Change {
                seconds_ago: 0.5,
                odds: 3.0,
                k_e: fixed,
                k_e_dot: fixed,
                omega_nm_rad_s: fixed,
                zeta_nm: fixed,
                tau_e_s: fixed,
                t_l_s: [1.0; 2],
                innovation_variance: [1.0; 2],
                z: [0.0; 6],
                of_operator: false,
                further: None,
            };
            change.z[i] = 5.0;
            assert_eq!(change.changed_quantities(), [name.to_str().unwrap()]);
            assert_eq!(reported_change(&change).shifts[i].z, 5.0);
        }
    }
}
