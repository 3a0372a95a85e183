//! The published baseline: a change is declared if the error or its rate exceeds three times its standard deviation in
//! the start span (R. A. Hess, J. Guidance, Control, and Dynamics 32 (2009); [`ErrorThreshold`]). After an alarm there
//! is no further alarm within 8 s. The method does not estimate a response.

use hoid_track::ErrorThreshold;

use super::super::entrant::{Alarm, Entrant, EntrantResult, ReportedResponse, Task};

const THRESHOLD_DEVIATIONS: f64 = 3.0;
const MIN_ALARM_INTERVAL_S: f64 = 8.0;

pub(super) struct Threshold;

impl Entrant for Threshold {
    fn name(&self) -> String {
        "error-threshold".to_owned()
    }

    fn follow(&self, task: &Task) -> Result<EntrantResult, String> {
        let start = task.start_record().ok_or("the start span is not all there")?;
        let mut baseline = ErrorThreshold::new(start.input(), task.sample_time).ok_or("the start span is too short")?;
        let mut alarms: Vec<Alarm> = Vec::new();
        for (k, e, _) in task.samples() {
            let distance = baseline.step(e);
            let Some(t_s) = k.map(|k| task.time_s(k)).filter(|t| *t >= task.start_s.1) else {
                continue;
            };
            let silent = alarms.last().is_some_and(|last| t_s < last.t_s + MIN_ALARM_INTERVAL_S);
            if distance > THRESHOLD_DEVIATIONS && !silent {
                alarms.push(Alarm { t_s, of_remnant: false });
            }
        }
        Ok(EntrantResult {
            estimates: vec![ReportedResponse::default(); task.asked_s.len()],
            alarms: Some(alarms),
            findings: Vec::new(),
        })
    }
}
