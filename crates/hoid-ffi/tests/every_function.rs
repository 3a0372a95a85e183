//! Calls every function that takes a pointer, as a C program would. Only a few samples are used, so that Miri can
//! interpret the program (`cargo xtask miri`) and check each read and write of memory.
#![cfg_attr(miri, allow(stable_features))]
#![cfg_attr(miri, feature(c_variadic))]
#![allow(clippy::unwrap_used)]

use std::{
    collections::BTreeSet,
    ffi::{CStr, CString, c_char, c_int, c_void},
    mem::MaybeUninit,
    ptr,
};

use hoid_ffi::{
    fmi::{fmi2::*, fmi3::*, state::*},
    *,
};
use hoid_io::fmu::{FmuKind, FmuStart, FmuVariable};

/// Options with which a method is created at once and starts with the first sample.
const NO_WARM_UP: &str = r#"{"nk": 3, "nd": 1, "start": {"b0": 0.04, "b1": -0.04, "d1": -0.8, "f1": -1.9, "f2": 0.92},
    "controlled_element": "90/(s(s+6))"}"#;
const SAMPLE_COUNT: usize = 2;

fn sample(k: usize) -> [f64; 2] {
    [(0.3 * k as f64).sin(), (0.2 * k as f64).cos()]
}

fn read(text: *const c_char) -> String {
    // SAFETY: the text belongs to the library and stays valid until the next call.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().unwrap().to_owned()
}

type ListFunction<T> = unsafe extern "C" fn(*const HoidTracker, *mut T, usize, *mut usize) -> HoidStatus;

/// Reads a list: first its length, and then its values into uninitialised memory of exactly this length.
fn read_list<T: Copy>(tracker: *const HoidTracker, of: ListFunction<T>) -> Vec<T> {
    let mut count = 0;
    // SAFETY: the tracker is valid, and only the count is requested.
    assert_eq!(unsafe { of(tracker, ptr::null_mut(), 0, &mut count) }, HOID_OK);
    let mut list = Vec::<T>::with_capacity(count);
    if count > 0 {
        let mut small = Vec::<T>::with_capacity(count - 1);
        // SAFETY: the tracker is valid, and the memory has the stated size, which is too small.
        let status = unsafe { of(tracker, small.as_mut_ptr(), count - 1, &mut count) };
        assert_eq!(status, HOID_TOO_SMALL);
    }
    // SAFETY: the tracker is valid, and the memory has the stated size.
    assert_eq!(unsafe { of(tracker, list.as_mut_ptr(), count, &mut count) }, HOID_OK);
    // SAFETY: this number of values was written.
    unsafe { list.set_len(count) };
    list
}

/// Reads a value into uninitialised memory.
fn read_value<T>(tracker: *const HoidTracker, of: unsafe extern "C" fn(*const HoidTracker, *mut T) -> HoidStatus) -> T {
    let mut place = MaybeUninit::uninit();
    // SAFETY: the tracker is valid, and the memory has room for one value.
    assert_eq!(unsafe { of(tracker, place.as_mut_ptr()) }, HOID_OK);
    // SAFETY: the value was written.
    unsafe { place.assume_init() }
}

fn new_tracker(method: &str, options: &str) -> *mut HoidTracker {
    let (method, options) = (CString::new(method).unwrap(), CString::new(options).unwrap());
    let mut tracker = ptr::null_mut();
    // SAFETY: the strings are null-terminated, and the pointer refers to the stack.
    let status = unsafe { hoid_tracker_new(method.as_ptr(), 0.01, options.as_ptr(), &mut tracker) };
    assert_eq!(status, HOID_OK, "{}", read(hoid_last_error()));
    tracker
}

#[test]
fn every_tracker_function_works() {
    assert_eq!(hoid_abi_version(), HOID_ABI_VERSION);
    assert_eq!(read(hoid_version()), env!("CARGO_PKG_VERSION"));
    let tracker = new_tracker("rpem", NO_WARM_UP);
    let mut outcome = MaybeUninit::<HoidOutcome>::uninit();
    for k in 0..SAMPLE_COUNT {
        let [e, u] = sample(k);
        // SAFETY: the tracker is valid, and the outcome may be null.
        assert_eq!(unsafe { hoid_tracker_step(tracker, e, u, ptr::null_mut()) }, HOID_OK);
        // SAFETY: the tracker is valid, and the pointer refers to the stack.
        let status = unsafe { hoid_tracker_update(tracker, e, u, 0.1, (k % 2) as i32, outcome.as_mut_ptr()) };
        assert_eq!(status, HOID_OK);
    }
    // SAFETY: the value was written.
    assert_eq!(unsafe { outcome.assume_init() }.ready, 1);

    // SAFETY: the tracker is valid.
    assert_eq!(unsafe { hoid_tracker_ready(tracker) }, HOID_OK);
    let parameters = read_list(tracker, hoid_tracker_parameters);
    let names: Vec<String> = parameters.iter().map(|one| read(one.name) + &read(one.unit)).collect();
    assert_eq!(names, ["b0", "b1", "d1", "f1", "f2"]);
    assert_eq!(read_list(tracker, hoid_tracker_covariance).len(), 25);
    let mut list = [MaybeUninit::<HoidEstimate>::uninit(); 6];
    let (mut count, place) = (0, list.as_mut_ptr().cast());
    // SAFETY: the tracker is valid, and the memory has the stated size.
    let status = unsafe { hoid_tracker_operator(tracker, place, 6, &mut count) };
    assert!([HOID_OK, HOID_NOTHING].contains(&status));
    // SAFETY: the tracker is valid, and the memory has the stated size.
    let status = unsafe { hoid_tracker_open_loop(tracker, place, 6, &mut count) };
    assert!([HOID_OK, HOID_NOTHING].contains(&status));
    // SAFETY: the tracker is valid, and the memory has the stated size.
    let status = unsafe { hoid_tracker_response(tracker, 2.5, place, 6, &mut count) };
    assert_eq!((status, count), (HOID_OK, 2));
    // SAFETY: two values were written.
    assert_eq!(read(unsafe { list[1].assume_init() }.name), "phase_deg");
    assert_eq!(
        read(hoid_level_name(read_value(tracker, hoid_tracker_level))),
        "doubtful"
    );
    assert_eq!(
        read_value(tracker, hoid_tracker_counts).samples,
        2 * SAMPLE_COUNT as u64
    );
    assert_eq!(read_value(tracker, hoid_tracker_sample_time), 0.01);
    let mut change = MaybeUninit::uninit();
    // SAFETY: the tracker is valid, and the pointer refers to the stack.
    assert_eq!(
        // SAFETY: the tracker is valid, and the memory has room for a change.
        unsafe { hoid_tracker_change(tracker, change.as_mut_ptr()) },
        HOID_NOTHING
    );
    let mut odds = 0.0;
    // SAFETY: the tracker is valid, and the pointer refers to the stack.
    let status = unsafe { hoid_tracker_change_log_odds(tracker, &mut odds) };
    assert_eq!(status, HOID_NOTHING);
    assert!(read(hoid_last_error()).contains("multiple-model"));

    let mut length = 0;
    // SAFETY: the tracker is valid, and only the length is requested.
    let status = unsafe { hoid_tracker_save(tracker, ptr::null_mut(), 0, &mut length) };
    assert_eq!(status, HOID_OK);
    let mut bytes = Vec::<u8>::with_capacity(length);
    // SAFETY: the tracker is valid, and the memory has room for this number of bytes.
    let status = unsafe { hoid_tracker_save(tracker, bytes.as_mut_ptr(), length, &mut length) };
    assert_eq!(status, HOID_OK);
    // SAFETY: this number of values was written.
    unsafe { bytes.set_len(length) };
    let mut second = ptr::null_mut();
    // SAFETY: the bytes are a slice, and the pointer refers to the stack.
    let status = unsafe { hoid_tracker_restore(bytes.as_ptr(), length, &mut second) };
    assert_eq!(status, HOID_OK);
    drop(bytes);
    for t in [tracker, second] {
        // SAFETY: the tracker is valid, and the outcome may be null.
        assert_eq!(unsafe { hoid_tracker_step(t, 0.5, 0.5, ptr::null_mut()) }, HOID_OK);
    }
    let digits = |tracker| {
        read_list(tracker, hoid_tracker_covariance)
            .into_iter()
            .map(f64::to_bits)
    };
    assert!(digits(tracker).eq(digits(second)));
    for t in [tracker, second, ptr::null_mut()] {
        // SAFETY: the handle was created above and is freed once; null is allowed.
        unsafe { hoid_tracker_free(t) };
    }
}

/// The message of a status belongs to its thread; each of two threads has its own tracker.
#[test]
fn each_thread_has_its_own_error_message() {
    let tracked = |names: &'static str| {
        let tracker = new_tracker("rpem", NO_WARM_UP);
        let mut odds = 0.0;
        // SAFETY: the tracker belongs to this thread.
        let status = unsafe { hoid_tracker_change_log_odds(tracker, &mut odds) };
        assert_eq!(status, HOID_NOTHING);
        let wrong = CString::new(names).unwrap();
        let mut place = ptr::null_mut();
        // SAFETY: the strings are null or null-terminated, and the pointer refers to the stack.
        let status = unsafe { hoid_tracker_new(wrong.as_ptr(), 0.01, ptr::null(), &mut place) };
        assert_eq!((status, place.is_null()), (HOID_BAD_OPTION, true));
        assert!(read(hoid_last_error()).contains(names));
        // SAFETY: the tracker was created above and is freed once.
        unsafe { hoid_tracker_free(tracker) };
    };
    std::thread::scope(|scope| {
        for name in ["kalman", "observer"] {
            scope.spawn(move || tracked(name));
        }
    });
}

#[test]
fn invalid_fit_is_refused() {
    let mut tracker = ptr::null_mut();
    // SAFETY: the strings are null-terminated, and the pointer refers to the stack.
    let status = unsafe { hoid_tracker_from_fit(c"{}".as_ptr(), 0.01, c"{}".as_ptr(), &mut tracker) };
    assert_eq!((status, tracker.is_null()), (HOID_BAD_OPTION, true));
}

/// A unit, used through one of the interfaces: the functions have different arguments, but the same effect.
struct Unit {
    variables: Vec<FmuVariable>,
}

impl Unit {
    fn reference(&self, name: &str) -> u32 {
        u32::try_from(self.variables.iter().position(|v| v.name == name).unwrap()).unwrap()
    }

    /// Returns the references of the variables of a type.
    fn references_of_type(&self, like: &FmuStart) -> Vec<u32> {
        let same = |v: &FmuVariable| std::mem::discriminant(&v.start) == std::mem::discriminant(like);
        let each = (0..).zip(&self.variables).filter(|(_, v)| same(v));
        each.map(|(reference, _)| reference).collect()
    }
}

fn unit() -> Unit {
    Unit {
        variables: FmuKind::Tracker.variables(),
    }
}

macro_rules! with_a_count {
    ($function:ident, $component:expr, $references:expr, $n:expr, $values:expr) => {
        // SAFETY: the component is valid, and the lists have the stated length.
        unsafe { $function($component, $references.as_ptr(), $n, $values) }
    };
}

macro_rules! with_two_counts {
    ($function:ident, $component:expr, $references:expr, $n:expr, $values:expr) => {
        // SAFETY: the component is valid, and the lists have the stated length.
        unsafe { $function($component, $references.as_ptr(), $n, $values, $n) }
    };
}

/// Calls all functions of one interface, from the creation of a unit to its end.
macro_rules! life_of_a_unit {
    (
        $unit:expr, $component:expr, $boolean:ty, $call:ident,
        $set_text:ident $get_text:ident $set_number:ident $get_number:ident $set_flag:ident $get_flag:ident
        $set_count:ident $get_count:ident,
        $begin:expr, $end_of_setup:ident, $step:expr, $reset:ident, $terminate:ident, $free:ident,
        $get_state:ident $set_state:ident $free_state:ident $size:ident $serialise:ident $deserialise:ident
    ) => {{
        let (unit, component): (Unit, _) = ($unit, $component);
        macro_rules! counted {
            ($function:ident, $references:expr, $n:expr, $values:expr) => {
                $call!($function, component, $references, $n, $values)
            };
        }
        let set_up = || {
            let texts = [c"rpem".to_owned(), CString::new(NO_WARM_UP).unwrap()];
            let references = ["method", "options"].map(|name| unit.reference(name));
            let pointers = texts.each_ref().map(|text| text.as_ptr());
            assert_eq!(counted!($set_text, references, 2, pointers.as_ptr()), 0);
            let flag = [<$boolean>::from(true)];
            assert_eq!(
                counted!($set_flag, [unit.reference("with_excitation")], 1, flag.as_ptr()),
                0
            );
            assert_eq!($begin(component), 0);
            // SAFETY: the component is valid.
            assert_eq!(unsafe { $end_of_setup(component) }, 0);
        };
        let stepped = |from: usize, to: usize| {
            for k in from..to {
                let references = ["e", "u"].map(|name| unit.reference(name));
                assert_eq!(counted!($set_number, references, 2, sample(k).as_ptr()), 0);
                assert_eq!($step(component, 0.01 * k as f64), 0);
            }
        };
        let numbers = || {
            let references = unit.references_of_type(&FmuStart::Real(0.0));
            let mut values = vec![0.0; references.len()];
            assert_eq!(
                counted!($get_number, references, references.len(), values.as_mut_ptr()),
                0
            );
            values.into_iter().map(f64::to_bits).collect::<Vec<_>>()
        };

        set_up();
        stepped(0, SAMPLE_COUNT);
        let references = [unit.reference("samples"), unit.reference("skipped")];
        let mut counts = [-1; 2];
        assert_eq!(counted!($get_count, references, 2, counts.as_mut_ptr()), 0);
        assert_eq!(counts, [SAMPLE_COUNT as c_int, 0]);
        // An output cannot be set, a null list is not read, and a list without elements is empty.
        assert_eq!(counted!($set_count, references, 2, counts.as_ptr()), 3);
        assert_eq!(counted!($get_count, references, 2, ptr::null_mut()), 3);
        assert_eq!(counted!($get_count, references, 0, ptr::null_mut()), 0);
        let mut ready = [<$boolean>::from(false)];
        assert_eq!(counted!($get_flag, [unit.reference("ready")], 1, ready.as_mut_ptr()), 0);
        assert_eq!(ready, [<$boolean>::from(true)]);
        let mut texts = [ptr::null(); 1];
        assert_eq!(
            counted!($get_text, [unit.reference("method")], 1, texts.as_mut_ptr()),
            0
        );
        assert_eq!(read(texts[0]), "rpem");

        // A state is restored, written over an existing state, and restored from bytes, each time with the same digits.
        let [mut state, mut again] = [ptr::null_mut::<State>(); 2];
        for _ in 0..2 {
            // SAFETY: the component is valid, and the place contains null or a state.
            assert_eq!(unsafe { $get_state(component, &mut state) }, 0);
        }
        stepped(SAMPLE_COUNT, 2 * SAMPLE_COUNT);
        let expected = numbers();
        let mut size = 0;
        // SAFETY: the component and the state are valid, and the pointer refers to the stack.
        assert_eq!(unsafe { $size(component, state, &mut size) }, 0);
        let mut bytes = vec![0_u8; size];
        // SAFETY: the component and the state are valid, and the stated size of the memory is too small.
        assert_eq!(unsafe { $serialise(component, state, bytes.as_mut_ptr(), size - 1) }, 3);
        // SAFETY: the component and the state are valid, and the memory has room for the state.
        assert_eq!(unsafe { $serialise(component, state, bytes.as_mut_ptr(), size) }, 0);
        // SAFETY: the component and the bytes are valid, and the place contains null.
        assert_eq!(unsafe { $deserialise(component, bytes.as_ptr(), size, &mut again) }, 0);
        // SAFETY: the component and the bytes are valid, and the place contains a state.
        assert_eq!(
            // SAFETY: as above, but with one byte fewer.
            unsafe { $deserialise(component, bytes.as_ptr(), size - 1, &mut again) },
            3
        );
        for one in [&mut state, &mut again] {
            // SAFETY: the component and the state are valid.
            assert_eq!(unsafe { $set_state(component, *one) }, 0);
            stepped(SAMPLE_COUNT, 2 * SAMPLE_COUNT);
            assert_eq!(numbers(), expected);
            for _ in 0..2 {
                // SAFETY: the component is valid, and the place contains a state and then null.
                assert_eq!(unsafe { $free_state(component, one) }, 0);
                assert!(one.is_null());
            }
        }
        // SAFETY: null is rejected.
        assert_eq!(unsafe { $set_state(component, ptr::null_mut()) }, 3);

        // SAFETY: the component is valid.
        assert_eq!(unsafe { $terminate(component) }, 0);
        assert_eq!($step(component, 1.0), 3);
        // SAFETY: the component is valid.
        assert_eq!(unsafe { $reset(component) }, 0);
        set_up();
        for one in [component, ptr::null_mut()] {
            // SAFETY: the handle was created above and is freed once; null is allowed.
            unsafe { $free(one) };
        }
        // SAFETY: null is rejected.
        assert_eq!(unsafe { $reset(ptr::null_mut()) }, 3);
    }};
}

/// `fmi2CallbackFunctions`, as in a C program.
#[repr(C)]
struct Callbacks {
    logger: *const c_void,
    allocate_memory: *const c_void,
    free_memory: *const c_void,
    step_finished: *const c_void,
    environment: *mut c_void,
}

/// Stores the reported messages. Rust can define variadic functions only with Miri's compiler; elsewhere they are
/// defined in C.
#[cfg(miri)]
unsafe extern "C" fn logger_2(
    environment: *mut c_void,
    name: *const c_char,
    status: c_int,
    _category: *const c_char,
    format: *const c_char,
    mut rest: ...
) {
    assert_eq!((read(name).as_str(), read(format).as_str()), ("one", "%s"));
    // SAFETY: the format consumes one string.
    let text: *const c_char = unsafe { rest.next_arg() };
    record_message(environment, status, text);
}

unsafe extern "C" fn logger_3(environment: *mut c_void, status: c_int, _category: *const c_char, text: *const c_char) {
    record_message(environment, status, text);
}

fn record_message(environment: *mut c_void, status: c_int, text: *const c_char) {
    // SAFETY: the list belongs to the test, which reads it only when no call is in progress.
    let notes = unsafe { &mut *environment.cast::<Vec<(c_int, String)>>() };
    notes.push((status, read(text)));
}

#[test]
fn every_fmi_2_function_works() {
    assert_eq!(
        (read(fmi2GetTypesPlatform()), read(fmi2GetVersion())),
        ("default".into(), "2.0".into())
    );
    let mut notes = Box::new(Vec::<(c_int, String)>::new());
    let environment: *mut Vec<_> = &mut *notes;
    #[cfg(miri)]
    let logger = logger_2 as unsafe extern "C" fn(_, _, _, _, _, ...) as *const c_void;
    #[cfg(not(miri))]
    let logger = ptr::null();
    let callbacks = Callbacks {
        logger,
        allocate_memory: ptr::null(),
        free_memory: ptr::null(),
        step_finished: ptr::null(),
        environment: environment.cast(),
    };
    let made = |kind: c_int, token: &str| {
        let token = CString::new(token).unwrap();
        let callbacks = ptr::from_ref(&callbacks).cast();
        // SAFETY: the strings are null-terminated, and the callbacks stay valid for the life of the component.
        unsafe { fmi2Instantiate(c"one".as_ptr(), kind, token.as_ptr(), ptr::null(), callbacks, 0, 0) }
    };
    assert!(made(0, &FmuKind::Tracker.token()).is_null() && made(1, "another").is_null());
    let component = made(1, &FmuKind::Tracker.token());
    // SAFETY: the component is valid.
    assert_eq!(unsafe { fmi2SetDebugLogging(component, 1, 0, ptr::null()) }, 0);
    life_of_a_unit!(
        unit(), component, c_int, with_a_count,
        fmi2SetString fmi2GetString fmi2SetReal fmi2GetReal fmi2SetBoolean fmi2GetBoolean fmi2SetInteger fmi2GetInteger,
        |component| {
            // SAFETY: the component is valid.
            let done = unsafe { fmi2SetupExperiment(component, 0, 0.0, 0.0, 0, 0.0) };
            // SAFETY: the component is valid.
            done + unsafe { fmi2EnterInitializationMode(component) }
        },
        fmi2ExitInitializationMode,
        // SAFETY: the component is valid.
        |component, t| unsafe { fmi2DoStep(component, t, 0.01, 1) },
        fmi2Reset, fmi2Terminate, fmi2FreeInstance,
        fmi2GetFMUstate fmi2SetFMUstate fmi2FreeFMUstate fmi2SerializedFMUstateSize fmi2SerializeFMUstate
        fmi2DeSerializeFMUstate
    );
    // SAFETY: the list was created above, and no call is in progress.
    let log = unsafe { &*environment };
    assert_eq!(log.len() > 5, cfg!(miri));
}

#[test]
fn every_fmi_3_function_works() {
    assert_eq!(read(fmi3GetVersion()), "3.0");
    let mut notes = Box::new(Vec::<(c_int, String)>::new());
    let environment: *mut Vec<_> = &mut *notes;
    let made = |token: &str, logger| {
        let token = CString::new(token).unwrap();
        // SAFETY: the strings are null-terminated, and the list of the logger stays valid for the life of the
        // component.
        unsafe {
            fmi3InstantiateCoSimulation(
                c"one".as_ptr(),
                token.as_ptr(),
                ptr::null(),
                false,
                false,
                false,
                false,
                ptr::null(),
                0,
                environment.cast(),
                logger,
                ptr::null(),
            )
        }
    };
    assert!(made("another", Some(logger_3)).is_null() && made("another", None).is_null());
    let component = made(&FmuKind::Tracker.token(), Some(logger_3));
    // SAFETY: the component is valid.
    assert_eq!(unsafe { fmi3SetDebugLogging(component, true, 0, ptr::null()) }, 0);
    let step = |component, t: f64| {
        let (mut flags, mut last) = ([true; 3], f64::NAN);
        let [event, terminate, early] = flags.each_mut();
        // SAFETY: the component is valid, and the pointers refer to the stack.
        let done = unsafe { fmi3DoStep(component, t, 0.01, true, event, terminate, early, &mut last) };
        assert_eq!((flags, last.is_nan()), ([done != 0; 3], done != 0));
        done
    };
    life_of_a_unit!(
        unit(), component, bool, with_two_counts,
        fmi3SetString fmi3GetString fmi3SetFloat64 fmi3GetFloat64 fmi3SetBoolean fmi3GetBoolean fmi3SetInt32 fmi3GetInt32,
        // SAFETY: the component is valid.
        |component| unsafe { fmi3EnterInitializationMode(component, false, 0.0, 0.0, false, 0.0) },
        fmi3ExitInitializationMode,
        step, fmi3Reset, fmi3Terminate, fmi3FreeInstance,
        fmi3GetFMUState fmi3SetFMUState fmi3FreeFMUState fmi3SerializedFMUStateSize fmi3SerializeFMUState
        fmi3DeserializeFMUState
    );
    // SAFETY: the list was created above, and no call is in progress.
    let log = unsafe { &*environment };
    assert!(log.iter().all(|(status, text)| *status == 3 && !text.is_empty()) && log.len() > 4);
}

/// All exported functions are called above, except for those that always return an error.
#[test]
#[cfg_attr(miri, ignore = "it reads sources, not memory of a caller")]
fn every_exported_function_is_called() {
    let words = |text: &'static str| {
        text.split(|c: char| !c.is_alphanumeric() && c != '_')
            .collect::<BTreeSet<_>>()
    };
    let lists = ["not_served!(", "not_made!("];
    let not_served: BTreeSet<&str> = [include_str!("../src/fmi/fmi2.rs"), include_str!("../src/fmi/fmi3.rs")]
        .into_iter()
        .flat_map(|source| lists.into_iter().flat_map(|list| source.split(list).skip(1)))
        .flat_map(|rest| words(rest.split(')').next().unwrap_or_default()))
        .collect();
    let called = words(include_str!("every_function.rs"));
    let listed = include_str!("../abi/symbols-1.txt")
        .lines()
        .filter(|line| !line.starts_with('#'));
    let left_out: Vec<&str> = listed
        .filter(|name| !called.contains(name) && !not_served.contains(name))
        .collect();
    assert_eq!(left_out, Vec::<&str>::new());
}
