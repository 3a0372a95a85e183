//! The preparation steps in their order.

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
/// A channel is given by its name; `e` and `u` are the input and the output, regardless of their
/// column names.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Preparation {
    /// Units by channel, where the file gives none.
    pub units: BTreeMap<String, String>,
    /// Factors and units by channel.
    pub scale: BTreeMap<String, Scaling>,
    /// Recording delay by channel.
    pub offset: BTreeMap<String, Offset>,
    /// New sampling rate.
    pub rate: NewRate,
    /// Time from the first sample that is dropped, s. The samples cut by the filters are part of it.
    pub run_in_s: f64,
    /// Trend removed from input and output, as the last step.
    pub detrend: Detrend,
    /// True if duplicated rows, including the time, are dropped before anything is read.
    pub drop_repeated: bool,
}

impl Preparation {
    /// Returns the prepared record and the applied steps. [`Preparation::drop_repeated`] is applied in reading and is
    /// ignored here.
    ///
    /// # Errors
    /// [`IoError::Preparation`] with the step, the value found and the expected value;
    /// [`IoError::Model`] if the numbers leave the range of floating point.
    pub fn apply(&self, record: Record) -> Result<(Record, Vec<Step>), IoError> {
        let begin_s = record.time_s(0);
        let mut parts = RecordParts::new(record);
        parts.declare_units(&self.units)?;
        parts.scale(&self.scale)?;
        parts.offset(&self.offset)?;
        let mut parts = parts.rate(self.rate)?;
        parts.run_in(begin_s, self.run_in_s)?;
        parts.detrended(self.detrend)
    }
}
