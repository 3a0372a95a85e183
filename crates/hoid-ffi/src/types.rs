//! The data passed on. Numbers that are not known are NaN.

use std::{ffi::c_char, ptr};

use hoid_model::uncertainty::Estimate;

/// Result of a sample.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoidOutcome {
    /// A-priori innovation; NaN at a sample that was skipped or held back, and during a warm-up.
    pub innovation: f64,
    /// 1 after the warm-up; always 1 for a method without one.
    pub ready: i32,
    /// 1 if e or u was faulty: not a finite number, or beyond `largest`.
    pub skipped: i32,
    /// 1 if the guard held back the sample.
    pub held: i32,
    /// 1 if the step was shortened to keep stability or a bound.
    pub shortened: i32,
    /// 1 if a change of the person was declared at this sample.
    pub changed: i32,
}

/// A number with its standard error.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoidEstimate {
    /// Its name; valid as long as the tracker.
    pub name: *const c_char,
    /// Its unit, empty if there is none; always valid.
    pub unit: *const c_char,
    /// The value.
    pub value: f64,
    /// Its standard error; NaN if there is none.
    pub standard_error: f64,
    /// 1 if the data determine it, 0 if they do not, -1 if that is not judged.
    pub determined: i32,
}

impl HoidEstimate {
    pub(crate) fn new(name: *const c_char, unit: *const c_char, estimate: Estimate) -> Self {
        Self {
            name,
            unit,
            value: estimate.value,
            standard_error: estimate.standard_error.unwrap_or(f64::NAN),
            determined: -1,
        }
    }
}

/// A quantity before and after a change.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoidShift {
    /// Its name; always valid.
    pub name: *const c_char,
    /// Value before the change.
    pub before: f64,
    /// Its standard error; NaN if there is none.
    pub before_standard_error: f64,
    /// Value after the change.
    pub after: f64,
    /// Its standard error; NaN if there is none.
    pub after_standard_error: f64,
    /// The change divided by its standard error; for the remnant, the change of the logarithm.
    pub z: f64,
}

/// Number of quantities of a change.
pub const HOID_SHIFTS: usize = 6;

/// A declared change of the person.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoidChange {
    /// Time from the change to its declaration, s.
    pub seconds_ago: f64,
    /// `adaptive`: -ln of the p-value of the change test; `multiple-model`: logarithm of the odds of
    /// a change within the last four seconds.
    pub log_odds: f64,
    /// 1/(1 + exp(-log_odds)); with `multiple-model` the probability of the change.
    pub probability: f64,
    /// K_e, K_e_dot (s), omega_nm (rad/s), zeta_nm, remnant (innovation variance), tau_e (s).
    pub shifts: [HoidShift; HOID_SHIFTS],
}

impl Default for HoidShift {
    fn default() -> Self {
        Self {
            name: ptr::null(),
            before: f64::NAN,
            before_standard_error: f64::NAN,
            after: f64::NAN,
            after_standard_error: f64::NAN,
            z: f64::NAN,
        }
    }
}

/// Counts since the start.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HoidCounts {
    /// Samples.
    pub samples: u64,
    /// Samples with a fault in e or u.
    pub skipped: u64,
    /// Samples that the guard held back.
    pub held: u64,
    /// Restarts of the estimate by the guard.
    pub restarts: u64,
    /// Steps shortened to keep stability or a bound.
    pub steps_shortened: u64,
}
