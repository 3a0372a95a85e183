//! Any data from a caller give a status, without a panic or an invalid value.
#![allow(clippy::unwrap_used)]

use std::{
    ffi::{CStr, CString},
    ptr,
};

use hoid_ffi::*;
use proptest::prelude::*;

/// A tracker that is freed when it is dropped.
struct OwnedTracker(*mut HoidTracker);

impl Drop for OwnedTracker {
    fn drop(&mut self) {
        // SAFETY: the tracker was created by this library and is freed once.
        unsafe { hoid_tracker_free(self.0) };
    }
}

fn new_tracker(method: &str, sample_time: f64, options: &str) -> Result<OwnedTracker, (HoidStatus, String)> {
    let (method, options) = (CString::new(method).unwrap(), CString::new(options).unwrap());
    let mut tracker = ptr::null_mut();
    // SAFETY: the strings are null-terminated, and the pointer refers to the stack.
    let status = unsafe { hoid_tracker_new(method.as_ptr(), sample_time, options.as_ptr(), &mut tracker) };
    tracker_or_error(status, tracker)
}

fn tracker_or_error(status: HoidStatus, tracker: *mut HoidTracker) -> Result<OwnedTracker, (HoidStatus, String)> {
    if status == HOID_OK {
        return Ok(OwnedTracker(tracker));
    }
    assert!(tracker.is_null());
    // SAFETY: the text belongs to this thread.
    let text = unsafe { CStr::from_ptr(hoid_last_error()) };
    Err((status, text.to_str().unwrap().to_owned()))
}

fn save_tracker(tracker: &OwnedTracker) -> Vec<u8> {
    let mut length = 0;
    // SAFETY: the tracker is valid, and only the length is requested.
    let status = unsafe { hoid_tracker_save(tracker.0, ptr::null_mut(), 0, &mut length) };
    assert_eq!(status, HOID_OK);
    let mut bytes = vec![0; length];
    // SAFETY: the tracker is valid, and the memory has room for this number of bytes.
    let status = unsafe { hoid_tracker_save(tracker.0, bytes.as_mut_ptr(), length, &mut length) };
    assert_eq!(status, HOID_OK);
    bytes
}

fn restore_tracker(bytes: &[u8]) -> Result<OwnedTracker, (HoidStatus, String)> {
    let mut tracker = ptr::null_mut();
    // SAFETY: the bytes are a slice, and the pointer refers to the stack.
    let status = unsafe { hoid_tracker_restore(bytes.as_ptr(), bytes.len(), &mut tracker) };
    tracker_or_error(status, tracker)
}

const EMPTY_ESTIMATE: HoidEstimate = HoidEstimate {
    name: ptr::null(),
    unit: ptr::null(),
    value: 0.0,
    standard_error: 0.0,
    determined: 0,
};

/// Requests all results of a tracker; no call may return an error.
fn request_all(tracker: &OwnedTracker) -> Vec<HoidStatus> {
    let t = tracker.0;
    let mut list = [EMPTY_ESTIMATE; 64];
    let (room, list) = (list.len(), list.as_mut_ptr());
    let mut count = 0;
    let mut numbers = vec![0.0; 4096];
    let (mut odds, mut level, mut ts) = (0.0, 0, 0.0);
    let mut change = HoidChange {
        seconds_ago: 0.0,
        log_odds: 0.0,
        probability: 0.0,
        shifts: [HoidShift::default(); HOID_SHIFTS],
    };
    let mut counts = HoidCounts {
        samples: 0,
        skipped: 0,
        held: 0,
        restarts: 0,
        steps_shortened: 0,
    };
    vec![
        // SAFETY: the tracker is valid.
        unsafe { hoid_tracker_ready(t) },
        // SAFETY: the tracker is valid, and the memory has the stated size.
        unsafe { hoid_tracker_operator(t, list, room, &mut count) },
        // SAFETY: the tracker is valid, and the memory has the stated size.
        unsafe { hoid_tracker_parameters(t, list, room, &mut count) },
        // SAFETY: the tracker is valid, and the memory has the stated size.
        unsafe { hoid_tracker_open_loop(t, list, room, &mut count) },
        // SAFETY: the tracker is valid, and the memory has the stated size.
        unsafe { hoid_tracker_response(t, 2.5, list, room, &mut count) },
        // SAFETY: the tracker is valid, and the memory has the stated size.
        unsafe { hoid_tracker_covariance(t, numbers.as_mut_ptr(), numbers.len(), &mut count) },
        // SAFETY: the tracker is valid, and the pointer refers to the stack.
        unsafe { hoid_tracker_change(t, &mut change) },
        // SAFETY: the tracker is valid, and the pointer refers to the stack.
        unsafe { hoid_tracker_change_log_odds(t, &mut odds) },
        // SAFETY: the tracker is valid, and the pointer refers to the stack.
        unsafe { hoid_tracker_level(t, &mut level) },
        // SAFETY: the tracker is valid, and the pointer refers to the stack.
        unsafe { hoid_tracker_counts(t, &mut counts) },
        // SAFETY: the tracker is valid, and the pointer refers to the stack.
        unsafe { hoid_tracker_sample_time(t, &mut ts) },
    ]
}

#[test]
fn null_pointers_are_refused_everywhere() {
    let nothing = OwnedTracker(ptr::null_mut());
    assert!(request_all(&nothing).iter().all(|status| *status == HOID_BAD_POINTER));
    // SAFETY: null is allowed.
    let status = unsafe { hoid_tracker_step(ptr::null_mut(), 0.0, 0.0, ptr::null_mut()) };
    assert_eq!(status, HOID_BAD_POINTER);
    // The default method, or under Miri a method that starts without a warm-up.
    let (method, options) = if cfg!(miri) {
        (c"rpem".as_ptr(), c"{\"nk\": 9}".as_ptr())
    } else {
        (ptr::null(), ptr::null())
    };
    // SAFETY: null is allowed.
    let status = unsafe { hoid_tracker_new(method, 0.01, options, ptr::null_mut()) };
    assert_eq!(status, HOID_BAD_POINTER);
    let mut tracker = ptr::null_mut();
    // SAFETY: null is allowed.
    let status = unsafe { hoid_tracker_from_fit(ptr::null(), 0.01, ptr::null(), &mut tracker) };
    assert_eq!((status, tracker.is_null()), (HOID_BAD_POINTER, true));
    // SAFETY: null is allowed.
    let status = unsafe { hoid_tracker_restore(ptr::null(), 9, &mut tracker) };
    assert_eq!(status, HOID_BAD_POINTER);
    let tracker = new_tracker("rpem", 0.01, r#"{"nk": 9}"#).ok().unwrap();
    // SAFETY: null is allowed.
    let status = unsafe { hoid_tracker_operator(tracker.0, ptr::null_mut(), 6, ptr::null_mut()) };
    assert!([HOID_BAD_POINTER, HOID_NOTHING].contains(&status));
    // SAFETY: null is allowed.
    let status = unsafe { hoid_tracker_counts(tracker.0, ptr::null_mut()) };
    assert_eq!(status, HOID_BAD_POINTER);
    // SAFETY: the outcome may be null.
    let status = unsafe { hoid_tracker_step(tracker.0, 0.0, 0.0, ptr::null_mut()) };
    assert_eq!(status, HOID_OK);
}

#[test]
#[cfg_attr(miri, ignore = "the filters of the method adaptive take minutes there")]
fn tracker_starts_from_a_fit() {
    let fit = r#"{"structure": "grey-box", "form": "gain", "neuromuscular": true, "verdict": {"level": "trustworthy"},
        "records": [{"sample_time": 0.01, "units": {"input": "", "output": ""}}], "parameters": [],
        "noise": {"c": [], "d": [-0.9]}, "innovation_variance": 0.1,
        "covariance": {"coordinates": ["gain", "ln omega_nm", "ln zeta_nm", "tau_e"], "values": [2.0, 2.4, -1.2, 0.2],
                       "matrix": [[0.01, 0, 0, 0], [0, 0.01, 0, 0], [0, 0, 0.01, 0], [0, 0, 0, 0.0001]]}}"#;
    let of = |sample_time: f64, fit: &str| {
        let text = CString::new(fit).unwrap();
        let mut tracker = ptr::null_mut();
        // SAFETY: the string is null-terminated, and the pointer refers to the stack.
        let status = unsafe { hoid_tracker_from_fit(text.as_ptr(), sample_time, ptr::null(), &mut tracker) };
        tracker_or_error(status, tracker)
    };
    let tracker = of(0.01, fit).ok().unwrap();
    let options = format!("{{\"prior\": {fit}}}");
    let same = new_tracker("adaptive", 0.01, &options).ok().unwrap();
    for tracker in [&tracker, &same] {
        // SAFETY: the tracker is valid.
        unsafe { hoid_tracker_step(tracker.0, 0.1, 0.2, ptr::null_mut()) };
    }
    let first = |tracker: &OwnedTracker| {
        let mut list = [EMPTY_ESTIMATE; 6];
        let mut count = 0;
        // SAFETY: the tracker is valid, and the memory has the stated size.
        let status = unsafe { hoid_tracker_operator(tracker.0, list.as_mut_ptr(), 6, &mut count) };
        assert_eq!((status, count), (HOID_OK, 6));
        list.map(|e| (e.value.to_bits(), e.standard_error.to_bits()))
    };
    assert_eq!(first(&tracker), first(&same));
    let value = f64::from_bits(first(&tracker)[0].0);
    assert!((value - 2.0).abs() < 0.2, "the gain of the fit: {value}");
    // The restored tracker continues from its bytes, which contain the fit.
    assert_eq!(
        first(&restore_tracker(&save_tracker(&tracker)).ok().unwrap()),
        first(&tracker)
    );
    // The sample time must equal the sample time of the fit.
    let (status, message) = of(0.02, fit).err().unwrap();
    assert_eq!(status, HOID_BAD_OPTION);
    assert!(message.contains("these samples are at"), "{message}");
    assert!(of(0.01, "{}").is_err());
}

fn hostile_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -2.0..2.0,
        1 => any::<f64>(),
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-f64::MAX), Just(5e-324), Just(1e6)],
    ]
}

fn hostile_value() -> impl Strategy<Value = String> {
    prop_oneof![
        Just("null".to_owned()),
        Just("true".to_owned()),
        any::<i32>().prop_map(|n| n.to_string()),
        (-1e3..1e3).prop_map(|x: f64| x.to_string()),
        "[a-z0-9=:.,/()s -]{0,12}".prop_map(|text| format!("\"{text}\"")),
        (any::<u16>(), any::<u16>()).prop_map(|(a, b)| format!("[{a}, {b}]")),
        (0_u8..40, 0_u8..40).prop_map(|(a, b)| format!("[{a}, {b}]")),
        "[a-z_]{1,8}".prop_map(|name| format!("{{\"{name}\": 1}}")),
        Just("\"1e999\"".to_owned()),
        Just("[[], []]".to_owned()),
    ]
}

const OPTION_NAMES: [&str; 24] = [
    "structure",
    "na",
    "nb",
    "nc",
    "nd",
    "nf",
    "nk",
    "criterion",
    "start",
    "largest",
    "at",
    "controlled_element",
    "warm_up",
    "prior",
    "memory",
    "memory_of",
    "forgetting",
    "covariance",
    "limit",
    "guard",
    "track_delay",
    "drift",
    "smooth",
    "false_alarms",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: if cfg!(miri) { 4 } else { 200 }, failure_persistence: None, ..ProptestConfig::default() })]

    /// Arbitrary samples leave the tracker in a valid state.
    #[test]
    #[cfg_attr(miri, ignore = "the filters of the method adaptive take minutes there; tests/every_function.rs has few samples")]
    fn arbitrary_samples_are_accepted(
        samples in prop::collection::vec((hostile_number(), hostile_number(), hostile_number(), any::<i32>()), 1..60),
        method in prop_oneof![Just("adaptive"), Just("rpem"), Just("multiple-model")],
    ) {
        let options = if method == "adaptive" { "" } else {
            r#"{"nk": 9, "nd": 1, "start": "nothing"}"#
        };
        // Methods that require a start fit have a short warm-up.
        let tracker = new_tracker(method, 0.01, options).or_else(|_| new_tracker(method, 0.01, r#"{"nk": 9, "nd": 1, "warm_up": 0.2}"#));
        let tracker = tracker.map_err(|(_, message)| TestCaseError::fail(message))?;
        let mut outcome = HoidOutcome { innovation: 0.0, ready: 0, skipped: 0, held: 0, shortened: 0, changed: 0 };
        for (e, u, f_t, moves) in samples {
            // SAFETY: the tracker is valid, and the pointer refers to the stack.
            let status = unsafe { hoid_tracker_update(tracker.0, e, u, f_t, moves, &mut outcome) };
            prop_assert_eq!(status, HOID_OK);
        }
        for status in request_all(&tracker) {
            prop_assert!([HOID_OK, HOID_NOTHING].contains(&status), "{}", status);
        }
        let again = restore_tracker(&save_tracker(&tracker)).map_err(|(_, message)| TestCaseError::fail(message))?;
        prop_assert_eq!(save_tracker(&again), save_tracker(&tracker));
    }

    /// Arbitrary options create a tracker or give a reason for the refusal.
    #[test]
    #[cfg_attr(miri, ignore = "the filters of the method adaptive take minutes there; tests/every_function.rs has few samples")]
    fn arbitrary_options_work_or_give_a_reason(
        method in prop_oneof![Just("adaptive"), Just("rpem"), Just("multiple-model"), Just("rls"), Just("window"), Just("ekf")],
        sample_time in prop_oneof![4 => Just(0.01), 1 => hostile_number()],
        given in prop::collection::btree_map(prop::sample::select(&OPTION_NAMES[..]), hostile_value(), 0..5),
    ) {
        let each: Vec<String> = given.iter().map(|(name, value)| format!("\"{name}\": {value}")).collect();
        let options = format!("{{{}}}", each.join(", "));
        match new_tracker(method, sample_time, &options) {
            Ok(tracker) => {
                for status in request_all(&tracker) {
                    prop_assert!([HOID_OK, HOID_NOTHING, HOID_TOO_SMALL].contains(&status), "{}: {}", options, status);
                }
            }
            Err((status, message)) => {
                prop_assert_eq!(status, HOID_BAD_OPTION, "{}: {}", options, message);
                prop_assert!(!message.is_empty());
            }
        }
    }

    /// Arbitrary bytes are rejected.
    #[test]
    fn arbitrary_bytes_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..200), magic in any::<bool>()) {
        let bytes = if magic { [b"hoid\x01\0\0\0".as_slice(), &bytes].concat() } else { bytes };
        let status = restore_tracker(&bytes).err().map(|(status, _)| status);
        prop_assert_eq!(status, Some(HOID_BAD_STATE));
    }
}
