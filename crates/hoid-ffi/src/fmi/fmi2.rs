//! Functions of FMI 2.0 for co-simulation (Modelica Association, *Functional Mock-up Interface for Model Exchange and
//! Co-Simulation* 2.0.4, 2022, chapters 2 and 4).
//!
//! Names, types and order of arguments follow `fmi2Functions.h`. A component must have been created by
//! `fmi2Instantiate` and not freed by `fmi2FreeInstance`, and an array must have as many elements as the count passed
//! with it.
#![allow(missing_docs, non_snake_case, clippy::missing_safety_doc)]

use std::ffi::{c_char, c_int, c_uint, c_void};

use hoid_io::fmu::FmuStart;

use super::{
    component::{
        Component, ERROR, Fmi2Logger, Logger, create, folder_from_uri, free, slice_from_raw, slice_from_raw_mut,
        str_from_raw, with_instance,
    },
    instance::Instance,
    values::FmiResult,
};

/// Struct `fmi2CallbackFunctions`; its memory callbacks are not used, since Rust allocates the memory.
#[repr(C)]
pub struct Fmi2Callbacks {
    logger: Option<Fmi2Logger>,
    allocate_memory: *const c_void,
    free_memory: *const c_void,
    step_finished: *const c_void,
    environment: *mut c_void,
}

/// Value of `fmi2CoSimulation`, the type of an FMU for co-simulation.
const CO_SIMULATION: c_int = 1;

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    name: *const c_char,
    kind: c_int,
    guid: *const c_char,
    resources: *const c_char,
    callbacks: *const Fmi2Callbacks,
    _visible: c_int,
    _logging: c_int,
) -> *mut Component {
    // SAFETY: the pointer is null or refers to callbacks of the importer, which exist as long as the component.
    let callbacks = unsafe { callbacks.as_ref() };
    let logger = match callbacks.and_then(|c| Some((c.logger?, c.environment))) {
        Some((function, environment)) => Logger::Two { function, environment },
        None => Logger::Unset,
    };
    // SAFETY: the strings are supplied by the importer.
    let (name, guid, resources) = unsafe { three_strings(name, guid, resources) };
    let instance = || {
        if kind != CO_SIMULATION {
            return Err("the unit supports only co-simulation, not model exchange".to_owned());
        }
        Instance::new(guid, folder_from_uri(resources).as_deref())
    };
    // SAFETY: the logger is supplied by the importer.
    unsafe { create(name, logger, instance) }
}

/// Returns three strings passed by the importer.
///
/// # Safety
/// As for [`str_from_raw`].
pub(super) unsafe fn three_strings<'a>(
    a: *const c_char,
    b: *const c_char,
    c: *const c_char,
) -> (&'a str, &'a str, &'a str) {
    // SAFETY: guaranteed by the caller of this function.
    let a = unsafe { str_from_raw(a) };
    // SAFETY: guaranteed by the caller of this function.
    let b = unsafe { str_from_raw(b) };
    // SAFETY: guaranteed by the caller of this function.
    (a, b, unsafe { str_from_raw(c) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(component: *mut Component) {
    // SAFETY: guaranteed by the FMI standard.
    unsafe { free(component) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetDebugLogging(
    component: *mut Component,
    _on: c_int,
    _count: usize,
    _categories: *const *const c_char,
) -> c_int {
    // SAFETY: guaranteed by the FMI standard.
    unsafe { with_instance(component, |_| Ok(())) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetupExperiment(
    component: *mut Component,
    _has_tolerance: c_int,
    _tolerance: f64,
    start: f64,
    _has_stop: c_int,
    _stop: f64,
) -> c_int {
    // SAFETY: guaranteed by the FMI standard.
    unsafe { with_instance(component, |instance| instance.set_start_time(start)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2EnterInitializationMode(component: *mut Component) -> c_int {
    // SAFETY: guaranteed by the FMI standard.
    unsafe { with_instance(component, |_| Ok(())) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2ExitInitializationMode(component: *mut Component) -> c_int {
    // SAFETY: guaranteed by the FMI standard.
    unsafe { with_instance(component, Instance::start) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Terminate(component: *mut Component) -> c_int {
    let end = |instance: &mut Instance| {
        instance.end();
        Ok(())
    };
    // SAFETY: guaranteed by the FMI standard.
    unsafe { with_instance(component, end) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Reset(component: *mut Component) -> c_int {
    let reset = |instance: &mut Instance| {
        instance.reset();
        Ok(())
    };
    // SAFETY: guaranteed by the FMI standard.
    unsafe { with_instance(component, reset) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DoStep(component: *mut Component, t: f64, step: f64, _no_set_before: c_int) -> c_int {
    // SAFETY: guaranteed by the FMI standard.
    unsafe { with_instance(component, |instance| instance.step(t, step)) }
}

/// Reads the values of variables.
///
/// # Safety
/// As for the functions of the FMI standard.
pub(super) unsafe fn get<T>(
    component: *mut Component,
    references: *const c_uint,
    count: usize,
    values: *mut T,
    of: impl Fn(&Instance, u32) -> FmiResult<T>,
) -> c_int {
    let read = |instance: &mut Instance| {
        // SAFETY: guaranteed by the caller of this function.
        let references = unsafe { slice_from_raw(references, count) }?;
        // SAFETY: guaranteed by the caller of this function.
        let values = unsafe { slice_from_raw_mut(values, count) }?;
        for (value, reference) in values.iter_mut().zip(references) {
            *value = of(instance, *reference)?;
        }
        Ok(())
    };
    // SAFETY: guaranteed by the caller of this function.
    unsafe { with_instance(component, read) }
}

/// Sets the values of variables.
///
/// # Safety
/// As for the functions of the FMI standard.
pub(super) unsafe fn set<T: Copy>(
    component: *mut Component,
    references: *const c_uint,
    count: usize,
    values: *const T,
    of: impl Fn(T) -> FmuStart,
) -> c_int {
    let write = |instance: &mut Instance| {
        // SAFETY: guaranteed by the caller of this function.
        let references = unsafe { slice_from_raw(references, count) }?;
        // SAFETY: guaranteed by the caller of this function.
        let values = unsafe { slice_from_raw(values, count) }?;
        let mut each = references.iter().zip(values);
        each.try_for_each(|(reference, value)| instance.set(*reference, of(*value)))
    };
    // SAFETY: guaranteed by the caller of this function.
    unsafe { with_instance(component, write) }
}

pub(super) fn real(instance: &Instance, reference: u32) -> FmiResult<f64> {
    match instance.value(reference)? {
        FmuStart::Real(value) => Ok(*value),
        _ => Err(instance.wrong_type_message(reference)),
    }
}

pub(super) fn integer(instance: &Instance, reference: u32) -> FmiResult<i32> {
    match instance.value(reference)? {
        FmuStart::Integer(value) => Ok(*value),
        _ => Err(instance.wrong_type_message(reference)),
    }
}

pub(super) fn boolean(instance: &Instance, reference: u32) -> FmiResult<bool> {
    match instance.value(reference)? {
        FmuStart::Boolean(value) => Ok(*value),
        _ => Err(instance.wrong_type_message(reference)),
    }
}

pub(super) fn text(instance: &Instance, reference: u32) -> FmiResult<*const c_char> {
    Ok(instance.text(reference)?.as_ptr())
}

/// Converts a string passed by the importer to a value.
pub(super) fn as_text(pointer: *const c_char) -> FmuStart {
    // SAFETY: the FMI standard guarantees that the pointer is an element of an array of strings.
    FmuStart::Text(unsafe { str_from_raw(pointer) }.to_owned())
}

macro_rules! getters_and_setters {
    ($($get:ident, $set:ident, $type:ty: $read:expr, $write:expr;)+) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(
            component: *mut Component,
            references: *const c_uint,
            count: usize,
            values: *mut $type,
        ) -> c_int {
            // SAFETY: guaranteed by the FMI standard.
            unsafe { get(component, references, count, values, $read) }
        }

        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set(
            component: *mut Component,
            references: *const c_uint,
            count: usize,
            values: *const $type,
        ) -> c_int {
            // SAFETY: guaranteed by the FMI standard.
            unsafe { set(component, references, count, values, $write) }
        }
    )+};
}

getters_and_setters! {
    fmi2GetReal, fmi2SetReal, f64: real, FmuStart::Real;
    fmi2GetInteger, fmi2SetInteger, c_int: integer, FmuStart::Integer;
    fmi2GetBoolean, fmi2SetBoolean, c_int:
        |instance, reference| boolean(instance, reference).map(c_int::from), |value| FmuStart::Boolean(value != 0);
    fmi2GetString, fmi2SetString, *const c_char: text, as_text;
}

/// Defines functions that the model description declares as not supported: each returns an error, regardless of its
/// arguments. The arguments can be omitted here because in the C calling conventions the caller removes them from the
/// stack.
macro_rules! not_served {
    ($($name:ident),+ $(,)?) => {$(
        #[unsafe(no_mangle)]
        pub extern "C" fn $name() -> c_int {
            ERROR
        }
    )+};
}
pub(super) use not_served;

not_served!(
    fmi2GetDirectionalDerivative,
    fmi2SetRealInputDerivatives,
    fmi2GetRealOutputDerivatives,
    fmi2CancelStep,
    fmi2GetStatus,
    fmi2GetRealStatus,
    fmi2GetIntegerStatus,
    fmi2GetBooleanStatus,
    fmi2GetStringStatus,
);
