//! The functions of FMI 2.0 for co-simulation (Modelica Association, *Functional Mock-up Interface for
//! Model Exchange and Co-Simulation* 2.0.4, 2022, chapters 2 and 4).
//!
//! Names, types and order are those of `fmi2Functions.h`; a component is one that `fmi2Instantiate` has made and
//! `fmi2FreeInstance` has not freed, and a list has as many elements as the call reports.
#![allow(missing_docs, non_snake_case, clippy::missing_safety_doc)]

use std::ffi::{c_char, c_int, c_uint, c_void};

use hoid_io::fmu::FmuStart;

use super::{
    component::{Component, ERROR, Fmi2Logger, Logger, folder, free, list, list_mut, made, with, words},
    instance::Instance,
    values::Done,
};

/// `fmi2CallbackFunctions`; memory is allocated by Rust.
#[repr(C)]
pub struct Fmi2Callbacks {
    logger: Option<Fmi2Logger>,
    allocate_memory: *const c_void,
    free_memory: *const c_void,
    step_finished: *const c_void,
    environment: *mut c_void,
}

/// `fmi2CoSimulation`.
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
    // SAFETY: null or that of the importer, which stays for the life of the component.
    let callbacks = unsafe { callbacks.as_ref() };
    let logger = match callbacks.and_then(|c| Some((c.logger?, c.environment))) {
        Some((function, environment)) => Logger::Two { function, environment },
        None => Logger::Nobody,
    };
    // SAFETY: the texts are supplied by the importer.
    let (name, guid, resources) = unsafe { three(name, guid, resources) };
    let instance = || {
        if kind != CO_SIMULATION {
            return Err("the unit is for co-simulation, not for model exchange".to_owned());
        }
        Instance::new(guid, folder(resources).as_deref())
    };
    // SAFETY: the logger is supplied by the importer.
    unsafe { made(name, logger, instance) }
}

/// Three texts supplied by the importer.
///
/// # Safety
/// As [`words`].
pub(super) unsafe fn three<'a>(a: *const c_char, b: *const c_char, c: *const c_char) -> (&'a str, &'a str, &'a str) {
    // SAFETY: by the contract of this function.
    let a = unsafe { words(a) };
    // SAFETY: by the contract of this function.
    let b = unsafe { words(b) };
    // SAFETY: by the contract of this function.
    (a, b, unsafe { words(c) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(component: *mut Component) {
    // SAFETY: by the contract of the interface.
    unsafe { free(component) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetDebugLogging(
    component: *mut Component,
    _on: c_int,
    _count: usize,
    _categories: *const *const c_char,
) -> c_int {
    // SAFETY: by the contract of the interface.
    unsafe { with(component, |_| Ok(())) }
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
    // SAFETY: by the contract of the interface.
    unsafe { with(component, |instance| instance.begins_at(start)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2EnterInitializationMode(component: *mut Component) -> c_int {
    // SAFETY: by the contract of the interface.
    unsafe { with(component, |_| Ok(())) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2ExitInitializationMode(component: *mut Component) -> c_int {
    // SAFETY: by the contract of the interface.
    unsafe { with(component, Instance::start) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Terminate(component: *mut Component) -> c_int {
    let end = |instance: &mut Instance| {
        instance.end();
        Ok(())
    };
    // SAFETY: by the contract of the interface.
    unsafe { with(component, end) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Reset(component: *mut Component) -> c_int {
    let reset = |instance: &mut Instance| {
        instance.reset();
        Ok(())
    };
    // SAFETY: by the contract of the interface.
    unsafe { with(component, reset) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DoStep(component: *mut Component, t: f64, step: f64, _no_set_before: c_int) -> c_int {
    // SAFETY: by the contract of the interface.
    unsafe { with(component, |instance| instance.step(t, step)) }
}

/// Reads variables.
///
/// # Safety
/// As the functions of the interface.
pub(super) unsafe fn get<T>(
    component: *mut Component,
    references: *const c_uint,
    count: usize,
    values: *mut T,
    of: impl Fn(&Instance, u32) -> Done<T>,
) -> c_int {
    let read = |instance: &mut Instance| {
        // SAFETY: by the contract of this function.
        let references = unsafe { list(references, count) }?;
        // SAFETY: by the contract of this function.
        let values = unsafe { list_mut(values, count) }?;
        for (value, reference) in values.iter_mut().zip(references) {
            *value = of(instance, *reference)?;
        }
        Ok(())
    };
    // SAFETY: by the contract of this function.
    unsafe { with(component, read) }
}

/// Sets variables.
///
/// # Safety
/// As the functions of the interface.
pub(super) unsafe fn set<T: Copy>(
    component: *mut Component,
    references: *const c_uint,
    count: usize,
    values: *const T,
    of: impl Fn(T) -> FmuStart,
) -> c_int {
    let write = |instance: &mut Instance| {
        // SAFETY: by the contract of this function.
        let references = unsafe { list(references, count) }?;
        // SAFETY: by the contract of this function.
        let values = unsafe { list(values, count) }?;
        let mut each = references.iter().zip(values);
        each.try_for_each(|(reference, value)| instance.set(*reference, of(*value)))
    };
    // SAFETY: by the contract of this function.
    unsafe { with(component, write) }
}

pub(super) fn real(instance: &Instance, reference: u32) -> Done<f64> {
    match instance.value(reference)? {
        FmuStart::Real(value) => Ok(*value),
        _ => Err(instance.other_type(reference)),
    }
}

pub(super) fn integer(instance: &Instance, reference: u32) -> Done<i32> {
    match instance.value(reference)? {
        FmuStart::Integer(value) => Ok(*value),
        _ => Err(instance.other_type(reference)),
    }
}

pub(super) fn boolean(instance: &Instance, reference: u32) -> Done<bool> {
    match instance.value(reference)? {
        FmuStart::Boolean(value) => Ok(*value),
        _ => Err(instance.other_type(reference)),
    }
}

pub(super) fn text(instance: &Instance, reference: u32) -> Done<*const c_char> {
    Ok(instance.text(reference)?.as_ptr())
}

/// Reads a text from the importer as a value.
pub(super) fn as_text(pointer: *const c_char) -> FmuStart {
    // SAFETY: an element of a list of texts, by the contract of the interface.
    FmuStart::Text(unsafe { words(pointer) }.to_owned())
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
            // SAFETY: by the contract of the interface.
            unsafe { get(component, references, count, values, $read) }
        }

        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set(
            component: *mut Component,
            references: *const c_uint,
            count: usize,
            values: *const $type,
        ) -> c_int {
            // SAFETY: by the contract of the interface.
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

/// Functions that the description states are not served: each answers with an error, whatever it is
/// given. In the calling conventions of C the caller clears its own arguments away.
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
