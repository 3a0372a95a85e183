//! Data types of the interface. Numbers that are not known are NaN.

use std::{ffi::c_char, ptr};

use hoid_model::uncertainty::Estimate;

/// Outcome of an update with one sample.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoidOutcome {
    /// A-priori innovation; NaN if the sample was skipped or held back, and during the warm-up.
    pub innovation: f64,
    /// 1 after the warm-up, and always for a method without a warm-up; otherwise 0.
    pub ready: i32,
    /// 1 if e or u was faulty: not finite, or larger in magnitude than `largest`.
    pub skipped: i32,
    /// 1 if the guard held back the sample.
    pub held: i32,
    /// 1 if the step of the estimate was shortened to ensure stability or to respect a bound.
    pub shortened: i32,
    /// 1 if a change in the person was declared at this sample.
    pub changed: i32,
}

/// Estimate with its standard error.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoidEstimate {
    /// Name of the quantity; the pointer is valid as long as the tracker.
    pub name: *const c_char,
    /// Unit of the quantity, empty if there is none; the pointer is always valid.
    pub unit: *const c_char,
    /// Estimated value.
    pub value: f64,
    /// Standard error of the value; NaN if there is none.
    pub standard_error: f64,
    /// 1 if the data determine the quantity, 0 if they do not, -1 if this is not assessed.
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

/// Quantity before and after a change.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoidShift {
    /// Name of the quantity; the pointer is always valid.
    pub name: *const c_char,
    /// Value before the change.
    pub before: f64,
    /// Standard error of the value before the change; NaN if there is none.
    pub before_standard_error: f64,
    /// Value after the change.
    pub after: f64,
    /// Standard error of the value after the change; NaN if there is none.
    pub after_standard_error: f64,
    /// Change divided by its standard error; for the remnant, the change in the logarithm divided by its standard
    /// error.
    pub z: f64,
}

/// Number of quantities in a change.
pub const HOID_SHIFTS: usize = 6;

/// Declared change in the person.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoidChange {
    /// Time in s from the change to its declaration.
    pub seconds_ago: f64,
    /// With the method `adaptive`, -ln of the p-value of the change test; with `multiple-model`, log odds of a change
    /// within the last four seconds.
    pub log_odds: f64,
    /// 1/(1 + exp(-log_odds)); with `multiple-model`, the probability of the change.
    pub probability: f64,
    /// K_e, K_e_dot (s), omega_nm (rad/s), zeta_nm, remnant (innovation variance) and tau_e (s), in this order.
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
    /// Number of samples.
    pub samples: u64,
    /// Number of samples with a fault in e or u.
    pub skipped: u64,
    /// Number of samples that the guard held back.
    pub held: u64,
    /// Number of restarts of the estimate by the guard.
    pub restarts: u64,
    /// Number of steps that were shortened to ensure stability or to respect a bound.
    pub steps_shortened: u64,
}
