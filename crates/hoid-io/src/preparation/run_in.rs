//! Removal of the run-in at the start of a record.

use super::record_parts::RecordParts;
use super::step::Step;
use crate::IoError;
use crate::wording::format_decimal;

impl RecordParts {
    /// Drops all samples before the end of the run-in.
    pub(super) fn drop_run_in(&mut self, file_start_s: f64, run_in_s: f64) -> Result<(), IoError> {
        const STEP_NAME: &str = "run-in";
        if run_in_s == 0.0 {
            return Ok(());
        }
        if !(run_in_s > 0.0 && run_in_s.is_finite()) {
            return Err(self.error(STEP_NAME, format!("{run_in_s} s"), "a positive time in s"));
        }
        let ts = self.sample_time.s();
        // A sample at the end of the run-in, up to rounding, is kept.
        let first = ((file_start_s + run_in_s - self.start_s) / ts - 1e-6).ceil().max(0.0);
        if first >= self.len() as f64 {
            return Err(self.error(
                STEP_NAME,
                format!(
                    "{run_in_s} s in a record of {} s",
                    format_decimal(self.start_s + self.len() as f64 * ts - file_start_s)
                ),
                "a run-in shorter than the record",
            ));
        }
        let first = first as usize;
        self.steps.push(Step::RunIn {
            seconds: run_in_s,
            samples: first,
        });
        self.keep(first..self.len());
        Ok(())
    }
}
