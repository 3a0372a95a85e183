//! The data passed on. Numbers that are not known are NaN.

use std::{ffi::c_char, ptr};

use hoid_model::uncertainty::Estimate;

/// Result of a sample.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoidOutcome {
    /// A-priori innovation; NaN at a sample that was skipped or held back, and during a warm-up.
    pub innovation: f64,
    /// 1 once there is an estimate.
    pub ready: i32,
    /// 1 when e or u was faulty: not a finite number, or beyond `largest`.
    pub skipped: i32,
    /// 1 when the guard held it back.
    pub held: i32,
    /// 1 when stability or a bound made the step shorter.
    pub shortened: i32,
    /// 1 when a change of the person was declared at this sample.
    pub changed: i32,
}

/// A number with its standard error.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoidEstimate {
    /// Its name; it stays as long as the tracker.
    pub name: *const c_char,
    /// Its unit, empty if there is none; it stays.
    pub unit: *const c_char,
    /// The value.
    pub value: f64,
    /// Its standard error; NaN if there is none.
    pub standard_error: f64,
    /// 1 where the data determine it, 0 where they do not, -1 where that is not judged.
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
    /// Its name; it stays.
    pub name: *const c_char,
    /// Value before the change.
    pub before: f64,
    /// Its standard error; NaN if there is none.
    pub before_standard_error: f64,
    /// Value after the change.
    pub after: f64,
    /// Its standard error; NaN if there is none.
    pub after_standard_error: f64,
    /// The change over its standard error; for the remnant that of the logarithm.
    pub z: f64,
}

/// Quantities of a change.
pub const HOID_SHIFTS: usize = 6;

/// A change of the person that was declared.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoidChange {
    /// How long ago the person changed when it was declared, s.
    pub seconds_ago: f64,
    /// Logarithm of the odds of a change within the last few seconds.
    pub log_odds: f64,
    /// Its probability.
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

/// Samples so far.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HoidCounts {
    /// Samples given.
    pub samples: u64,
    /// Samples with a fault in e or u.
    pub skipped: u64,
    /// Samples that the guard held back.
    pub held: u64,
    /// How often the guard started the estimate again.
    pub restarts: u64,
    /// Steps that stability or a bound made shorter.
    pub steps_shortened: u64,
}
