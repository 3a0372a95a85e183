//! Sample rate at which recordings are used. If orders and delays count samples a high rate is kept, unless a factor
//! is named.

use hoid_io::Step;
use hoid_model::{Decimation, SampleTime};

use crate::{AnalysisError, recordings::Recordings};

impl Recordings {
    /// Decimates the recordings and records it in their accounts; for an estimator that counts samples, only if a
    /// factor was named; never if the rate was named in reading.
    ///
    /// # Errors
    /// The errors of the decimation.
    pub fn at_rate(mut self, decimation: Decimation, counts_samples: bool) -> Result<Self, AnalysisError> {
        if self.settles_the_rate() {
            return Ok(self);
        }
        let decimation = if counts_samples {
            decimation.when_named()
        } else {
            decimation
        };
        for (record, account) in self.records.iter_mut().zip(&mut self.accounts) {
            let (lower, done) = decimation.of(record.clone())?;
            *record = lower;
            account.steps.extend(done.map(Step::from));
        }
        Ok(self)
    }

    /// True if the rate was named in reading, and is not to be lowered again.
    pub(crate) fn settles_the_rate(&self) -> bool {
        let source = self.source.as_ref();
        source.is_some_and(|source| source.reading.settles_the_rate())
    }

    /// Time by which e was shifted in the decimation, for a hold that is longer than that of the recording, s.
    pub(crate) fn input_lead_s(&self) -> f64 {
        let mut steps = self.accounts.iter().flat_map(|account| &account.steps);
        let lead = steps.find_map(|step| match step {
            Step::Rate { input_lead_s, .. } => Some(*input_lead_s),
            _ => None,
        });
        lead.unwrap_or(0.0)
    }

    /// Message for a high rate that was kept because samples are counted.
    pub fn kept_rate(&self, decimation: Decimation, counts_samples: bool) -> Option<String> {
        let settled = self.settles_the_rate();
        let record = self.records.first().filter(|_| !settled)?;
        kept_rate(record.sample_time(), decimation, counts_samples)
    }
}

/// Message for a high rate that is kept because samples are counted.
pub fn kept_rate(sample_time: SampleTime, decimation: Decimation, counts_samples: bool) -> Option<String> {
    let factor = decimation.factor(sample_time);
    let kept = counts_samples && decimation == Decimation::Auto && factor > 1;
    let hz = (1e4 / sample_time.s()).round() / 1e4;
    kept.then(|| {
        format!(
            "{hz} Hz is kept, since orders and delays are in samples here; --decimate {factor} brings it near 100 Hz"
        )
    })
}
