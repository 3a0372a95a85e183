//! The preparation steps, and their application to a record in a fixed order.

use std::collections::BTreeMap;

use hoid_model::{Detrend, Record};

use super::offset::Offset;
use super::rate::NewRate;
use super::record_parts::RecordParts;
use super::scaling::Scaling;
use super::step::Step;
use crate::IoError;

/// Preparation steps of a record. By default there are none.
///
/// Channels are given by name; `e` and `u` denote the input and the output regardless of their column names.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Preparation {
    /// Unit by channel, for channels whose unit the file does not give.
    pub units: BTreeMap<String, String>,
    /// Factor or unit conversion by channel.
    pub scale: BTreeMap<String, Scaling>,
    /// Recording delay by channel.
    pub offset: BTreeMap<String, Offset>,
    /// New sampling rate.
    pub rate: NewRate,
    /// Length of the initial part of the record that is dropped, s. It includes the samples cut by filters at the
    /// start.
    pub run_in_s: f64,
    /// Trend removed from the input and the output, as the last step.
    pub detrend: Detrend,
    /// True if rows that equal an earlier row, including the time, are dropped when the file is read.
    pub drop_repeated: bool,
}

impl Preparation {
    /// Returns the prepared record and the applied steps. [`Preparation::drop_repeated`] takes effect when the file is
    /// read and is ignored here.
    ///
    /// # Errors
    /// [`IoError::Preparation`] with the step, the value found and the expected value; [`IoError::Model`] if values
    /// exceed the floating-point range.
    pub fn apply(&self, record: Record) -> Result<(Record, Vec<Step>), IoError> {
        let begin_s = record.time_s(0);
        let mut parts = RecordParts::new(record);
        parts.declare_units(&self.units)?;
        parts.scale(&self.scale)?;
        parts.apply_offsets(&self.offset)?;
        let mut parts = parts.change_rate(self.rate)?;
        parts.drop_run_in(begin_s, self.run_in_s)?;
        parts.detrended(self.detrend)
    }
}
