//! The steps in their order.

use std::collections::BTreeMap;

use hoid_model::{Detrend, Record};

use super::offset::Offset;
use super::rate::NewRate;
use super::record_parts::RecordParts;
use super::scaling::Scaling;
use super::step::Step;
use crate::IoError;

/// Repairs that are applied to a record. By default nothing is.
///
/// A channel is meant by its name; `e` and `u` are the input and the output, whatever their columns
/// are called.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Preparation {
    /// Units by channel that the file does not report.
    pub units: BTreeMap<String, String>,
    /// Factors and units by channel.
    pub scale: BTreeMap<String, Scaling>,
    /// Amount by which channels were recorded later than they happened.
    pub offset: BTreeMap<String, Offset>,
    /// Another sampling rate.
    pub rate: NewRate,
    /// Time from the first sample that is dropped, s. What the filters cut lies within it.
    pub run_in_s: f64,
    /// Trend removed from input and output, last.
    pub detrend: Detrend,
    /// Whether rows that are duplicated, time included, are dropped before anything is read.
    pub drop_repeated: bool,
}

impl Preparation {
    /// The record as it goes to the estimator, and the actions taken.
    /// [`Preparation::drop_repeated`] belongs to reading and is not examined.
    ///
    /// # Errors
    /// [`IoError::Preparation`] naming the step, what was found, and the expected value;
    /// [`IoError::Model`] where the numbers leave the range of floating point.
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
