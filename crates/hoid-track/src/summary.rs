//! A summary of a trace in a few lines.

use std::fmt;

use hoid_model::numbers::format_plain;

use crate::trace::Trace;

/// Prints the method, its memory, its start, the operator at the end, and the declared changes.
impl fmt::Display for Trace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let options = self.options();
        writeln!(
            f,
            "{} of {}({}), {} rows",
            options.method,
            options.structure.label(),
            options.orders,
            self.len()
        )?;
        writeln!(f, "memory  {}", options.memory_as_text(self.sample_time()))?;
        writeln!(f, "start   {}", options.start_as_text())?;
        let counts = self.counts();
        writeln!(
            f,
            "samples {} ({} faulty), steps shortened: {}",
            counts.samples, counts.skipped, counts.shortened
        )?;
        let Some(last) = self.len().checked_sub(1) else {
            return write!(f, "no rows");
        };
        for (t, change) in self.changes() {
            writeln!(
                f,
                "change declared at {} s, log odds {}",
                format_plain(*t),
                format_plain(change.odds)
            )?;
        }
        writeln!(f, "at {} s", format_plain(self.times_s()[last]))?;
        match self.operator(last) {
            Ok(operator) => write!(f, "{operator}"),
            Err(reason) => write!(f, "not convertible: {reason}"),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::{Condition, Scenario};
    use hoid_sim::{RunSeed, Simulator};

    use crate::{Method, TrackOptions, track};

    #[test]
    fn trace_summary_contains_method_and_final_estimate() {
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        let record = simulator.run(RunSeed::default(), false).unwrap();
        let trace = track(&record, &TrackOptions::default_for(Method::rpem(), 29), 64).unwrap();
        let text = trace.to_string();
        for part in [
            "rpem of BJ",
            "128 rows",
            "memory  exponential forgetting",
            "batch fit of",
            "at 81.91 s",
            "K_e",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
    }
}
