//! Sampling rate at which recordings are used. If orders and delays are numbers of samples, a high rate is kept unless
//! the user gave a decimation factor.

use hoid_io::Step;
use hoid_model::{Decimation, SampleTime};

use crate::{AnalysisError, recordings::Recordings};

impl Recordings {
    /// Decimates the recordings and adds this step to their accounts. For an estimator whose orders are numbers of
    /// samples, the recordings are decimated only if the user gave a factor. Nothing is decimated if the user gave a
    /// sampling frequency for reading.
    ///
    /// # Errors
    /// The errors of decimation.
    pub fn at_rate(mut self, decimation: Decimation, counts_samples: bool) -> Result<Self, AnalysisError> {
        if self.has_fixed_rate() {
            return Ok(self);
        }
        let decimation = if counts_samples {
            decimation.explicit_only()
        } else {
            decimation
        };
        for (record, account) in self.records.iter_mut().zip(&mut self.accounts) {
            let (lower, done) = decimation.apply(record.clone())?;
            *record = lower;
            account.steps.extend(done.map(Step::from));
        }
        Ok(self)
    }

    /// True if the user gave a sampling frequency for reading; the rate is then not reduced further.
    pub(crate) fn has_fixed_rate(&self) -> bool {
        let source = self.source.as_ref();
        source.is_some_and(|source| source.reading.has_fixed_rate())
    }

    /// Returns the time by which decimation shifted e to account for the longer hold, s.
    pub(crate) fn input_lead_s(&self) -> f64 {
        let mut steps = self.accounts.iter().flat_map(|account| &account.steps);
        let lead = steps.find_map(|step| match step {
            Step::Rate { input_lead_s, .. } => Some(*input_lead_s),
            _ => None,
        });
        lead.unwrap_or(0.0)
    }

    /// Returns a message if a high rate is kept because orders are numbers of samples.
    pub fn kept_rate_message(&self, decimation: Decimation, counts_samples: bool) -> Option<String> {
        let settled = self.has_fixed_rate();
        let record = self.records.first().filter(|_| !settled)?;
        kept_rate_message(record.sample_time(), decimation, counts_samples)
    }
}

/// Returns a message if a high rate is kept because orders are numbers of samples.
pub fn kept_rate_message(sample_time: SampleTime, decimation: Decimation, counts_samples: bool) -> Option<String> {
    let factor = decimation.factor(sample_time);
    let kept = counts_samples && decimation == Decimation::Auto && factor > 1;
    let hz = (1e4 / sample_time.s()).round() / 1e4;
    kept.then(|| {
        format!(
            "{hz} Hz is kept because orders and delays are in samples; use --decimate {factor} for a rate near 100 Hz"
        )
    })
}
