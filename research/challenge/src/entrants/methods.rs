//! The methods of `hoid_track` with their default options.
//!
//! If the delay is given, it is used; otherwise it is selected on the start span over the default range of hoid, with
//! the other orders unchanged. The response H comes from a row of the trace or from the tracker.

use hoid_ident::{
    OrderRanges,
    order_selection::{Criterion, default_operator_ranges},
};
use hoid_model::{Complex64, uncertainty::OperatorEstimate};
use hoid_track::{Change, Method, Response, Sample, StartSource, TrackOptions, TrackPlan, Tracker, track};

use super::super::entrant::{Alarm, Entrant, EntrantResult, ReportedResponse, Task};

/// A method of `hoid_track` as an entrant.
pub(super) struct MethodEntrant(pub Method);

impl Entrant for MethodEntrant {
    fn name(&self) -> String {
        self.0.name().to_owned()
    }

    fn follow(&self, task: &Task) -> Result<EntrantResult, String> {
        let options = self.options(task)?;
        match task.record() {
            Some(record) if task.seam.is_none() => {
                // There is a row every half second, so the rows include all requested times.
                let every = (0.5 / task.sample_time.s()).round() as usize;
                let trace = track(&record, &options, every).map_err(|e| e.to_string())?;
                let row = |t_s: &f64| ((t_s / task.sample_time.s() / every as f64 + 1e-6) as usize).max(1) - 1;
                let rows = task.asked_s.iter().map(|t_s| row(t_s).min(trace.len() - 1));
                let said = rows.map(|row| {
                    let each = (0..task.lines_rad_s.len()).map(|place| trace.response(row, place));
                    reported_response(each.collect(), trace.operator(row).ok().as_ref())
                });
                let verdict = trace.verdict(&record, None).map_err(|e| e.to_string())?;
                Ok(EntrantResult {
                    estimates: said.collect(),
                    alarms: (!trace.change_odds().is_empty()).then(|| alarms(trace.changes())),
                    findings: verdict.findings().iter().map(|f| f.kind.to_owned()).collect(),
                })
            }
            _ => track_samplewise(task, &options),
        }
    }
}

impl MethodEntrant {
    fn options(&self, task: &Task) -> Result<TrackOptions, String> {
        let with = |nk| TrackOptions {
            start: StartSource::Span(Some(task.start_s)),
            at_rad_s: task.lines_rad_s.clone(),
            ..TrackOptions::default_for(self.0.clone(), nk)
        };
        if let Some(nk) = task.nk {
            return Ok(with(nk));
        }
        let default = with(1);
        let ranges = OrderRanges {
            nk: default_operator_ranges(default.structure, task.sample_time).nk,
            ..OrderRanges::from(default.orders)
        };
        let span = task.start_record().ok_or("the start span is not all there")?;
        let chosen = TrackPlan::new(default, ranges, Criterion::Bic, task.sample_time)
            .and_then(|plan| plan.choose(&span, &|| ()))
            .map_err(|e| e.to_string())?;
        Ok(chosen.0)
    }
}

fn alarms(changes: &[(f64, Change)]) -> Vec<Alarm> {
    let of = |(t_s, change): &(f64, Change)| Alarm {
        t_s: *t_s,
        of_remnant: change.changed_quantities() == ["remnant"],
    };
    changes.iter().map(of).collect()
}

/// Tracks sample by sample, for data that a record cannot contain: missing samples, and the history of a second
/// recording.
fn track_samplewise(task: &Task, options: &TrackOptions) -> Result<EntrantResult, String> {
    let span = task.start_record().ok_or("the start span is not all there")?;
    let mut tracker = Tracker::new(options, Some(&span), task.sample_time).map_err(|e| e.to_string())?;
    let moves_from = if options.method.initial_covariance().is_none() && !options.method.is_self_starting() {
        task.start_s.1
    } else {
        f64::NEG_INFINITY
    };
    let (mut answer, mut changes, mut next) = (EntrantResult::default(), Vec::new(), 0);
    for (k, e, u) in task.samples() {
        let sample = Sample { e, u, reference: None };
        let Some(k) = k else {
            tracker.update(sample, false);
            continue;
        };
        let t_s = task.time_s(k);
        tracker.update(sample, t_s >= moves_from - task.sample_time.s() / 2.0);
        changes.extend(tracker.change().map(|change| (t_s, change)));
        // The last sample before the requested time, as in the rows of a trace.
        while task.asked_s.get(next).is_some_and(|t| task.sample_index(*t) <= k + 1) {
            let each = task.lines_rad_s.iter().map(|omega| tracker.response(*omega));
            answer
                .estimates
                .push(reported_response(each.collect(), tracker.operator().ok().as_ref()));
            next += 1;
        }
    }
    answer.alarms = tracker.change_odds().map(|_| alarms(&changes));
    Ok(answer)
}

/// Returns the estimate at a time; it is empty if one of the responses is missing.
fn reported_response(responses: Option<Vec<Response>>, operator: Option<&OperatorEstimate>) -> ReportedResponse {
    let Some(responses) = responses else {
        return ReportedResponse::default();
    };
    let covariance = responses.iter().map(|r| {
        let [[re, both], [_, im]] = r.covariance;
        re.is_finite().then_some([re, im, both])
    });
    let parameters = operator.map_or_else(Vec::new, |o| {
        [
            ("K_e", o.k_e),
            ("K_e_dot", o.k_e_dot),
            ("omega_nm", o.omega_nm_rad_s),
            ("zeta_nm", o.zeta_nm),
            ("tau_e", o.tau_e_s),
        ]
        .map(|(name, e)| (name, e.value, e.standard_error))
        .into()
    });
    ReportedResponse {
        response: responses
            .iter()
            .map(|r| Complex64::new(r.value[0], r.value[1]))
            .collect(),
        covariance: covariance.collect(),
        parameters,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        CaseRun, Seeds, cases,
        measure::{EvaluationRun, test_task},
    };

    fn task(name: &str) -> Task {
        let case = cases().into_iter().find(|case| case.name == name).unwrap();
        test_task(
            &case,
            CaseRun {
                seeds: Seeds::Open,
                number: 2,
            },
        )
    }

    /// Processing sample by sample gives the same result as processing a record.
    #[test]
    fn samplewise_and_batch_processing_agree() {
        let task = task("change-K_e_dot-100");
        for method in [
            Method::rls(),
            hoid_survey::physical(),
            hoid_survey::multiple_model(),
            Method::adaptive(),
        ] {
            let own = MethodEntrant(method);
            let (over_record, options) = (own.follow(&task).unwrap(), own.options(&task).unwrap());
            let by_sample = track_samplewise(&task, &options).unwrap();
            assert_eq!(over_record.alarms, by_sample.alarms, "{}", own.name());
            assert_eq!(over_record.estimates.len(), task.asked_s.len());
            for (a, b) in over_record.estimates.iter().zip(&by_sample.estimates) {
                assert_eq!(a.response, b.response, "{}", own.name());
            }
        }
    }

    /// In a loop with a small margin the error is nearly a sine, and drifting gains fit its phase as well as any delay
    /// does: a method whose gains drift from the start converges far from the operator.
    #[test]
    fn adaptive_converges_in_a_loop_with_a_small_margin() {
        let case = cases().into_iter().find(|case| case.name == "change-omega-30").unwrap();
        let of = CaseRun {
            seeds: Seeds::Open,
            number: 1,
        };
        let line = EvaluationRun::new(&case, of)
            .unwrap()
            .line(&MethodEntrant(Method::adaptive()));
        let errors: Vec<f64> = line.moments.iter().map(|m| m.error).collect();
        assert!(errors.iter().all(|e| *e < 0.3), "{errors:?}");
    }

    #[test]
    fn estimates_continue_after_missing_samples() {
        let task = task("none-missing");
        let answer = MethodEntrant(hoid_survey::physical()).follow(&task).unwrap();
        assert_eq!(answer.estimates.len(), task.asked_s.len());
        assert!(
            answer
                .estimates
                .iter()
                .flat_map(|said| &said.response)
                .all(|h| h.norm().is_finite())
        );
    }
}
