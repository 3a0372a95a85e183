//! The record in the form that an estimator uses: a span of the record, every n-th sample, with mean or linear trend
//! removed.

use std::borrow::Cow;

use hoid_model::{Channel, Detrend, Record, SampleTime};

use crate::plan::EstimatorCell;

/// Preparation of a record before an estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Preparation {
    /// Span of the record that is used (in s); `None` for the whole record.
    pub span_s: Option<(f64, f64)>,
    /// Number n if only every n-th sample is used.
    pub decimate: usize,
    /// Trend removed from e and u.
    pub detrend: Detrend,
}

impl Preparation {
    /// Returns the preparation that an estimator specifies.
    pub fn of(estimator: &EstimatorCell) -> Self {
        Self {
            span_s: estimator.span_s,
            decimate: estimator.decimate,
            detrend: estimator.detrend,
        }
    }

    /// True if the record is used unchanged.
    pub fn is_none(&self) -> bool {
        self.span_s.is_none() && self.decimate == 1 && self.detrend == Detrend::None
    }

    /// Returns the prepared record.
    pub fn apply<'r>(&self, record: &'r Record) -> Result<Cow<'r, Record>, String> {
        let mut record = match self.span_s {
            None => Cow::Borrowed(record),
            Some((from, to)) => Cow::Owned(record.span(from, to).map_err(|error| error.to_string())?),
        };
        if self.decimate > 1 {
            record = Cow::Owned(decimated(&record, self.decimate)?);
        }
        if self.detrend != Detrend::None {
            record = Cow::Owned(record.into_owned().detrended(self.detrend));
        }
        Ok(record)
    }
}

/// Returns every `n`-th sample of all channels, without a filter.
fn decimated(record: &Record, n: usize) -> Result<Record, String> {
    let text = |error: hoid_model::ModelError| error.to_string();
    let thinned = |channel: &Channel| {
        Channel::new(
            &channel.name,
            &channel.unit,
            channel.values.iter().step_by(n).copied().collect(),
        )
        .with_role(&channel.role)
    };
    let sample_time = SampleTime::new(record.sample_time().s() * n as f64).map_err(text)?;
    let input = record.input_channel().map(thinned).ok_or("the record has no input")?;
    let mut thin = Record::new(sample_time, input, thinned(record.output_channel()))
        .map_err(text)?
        .labelled(record.label())
        .starting_at(record.time_s(0));
    for channel in record
        .channels()
        .filter(|c| is_missing_from_thinned(&thin, c))
        .map(thinned)
        .collect::<Vec<_>>()
    {
        thin = thin.with_channel(channel).map_err(text)?;
    }
    Ok(thin)
}

fn is_missing_from_thinned(thin: &Record, channel: &Channel) -> bool {
    thin.channel(&channel.name).is_none()
}
