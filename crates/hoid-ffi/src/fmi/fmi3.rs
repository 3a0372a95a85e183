//! Functions of FMI 3.0 for co-simulation (Modelica Association, *Functional Mock-up Interface Specification* 3.0.1,
//! 2023, chapters 2 and 4).
//!
//! Names, types and order of arguments follow `fmi3FunctionTypes.h`. An instance must have been created by
//! `fmi3InstantiateCoSimulation` and not freed by `fmi3FreeInstance`, and an array must have as many elements as the
//! count passed with it.
#![allow(missing_docs, non_snake_case, clippy::missing_safety_doc)]

use std::{
    ffi::{c_char, c_int, c_uint, c_void},
    path::PathBuf,
};

use hoid_io::fmu::FmuStart;

use super::{
    component::{Component, ERROR, Fmi3Logger, Logger, create, free, with_instance},
    fmi2::{as_text, boolean, get, integer, not_served, real, set, text, three_strings},
    instance::Instance,
};

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: bool,
    _logging: bool,
    _event_mode: bool,
    _early_return: bool,
    _required: *const c_uint,
    _count: usize,
    environment: *mut c_void,
    logger: Option<Fmi3Logger>,
    _intermediate: *const c_void,
) -> *mut Component {
    let logger = match logger {
        Some(function) => Logger::Three { function, environment },
        None => Logger::Unset,
    };
    // SAFETY: the strings are supplied by the importer.
    let (name, token, resources) = unsafe { three_strings(name, token, resources) };
    // FMI 3.0 passes the resources as a path, whereas FMI 2.0 passes a URI.
    let folder = Some(PathBuf::from(resources)).filter(|path| !path.as_os_str().is_empty());
    // SAFETY: the logger is supplied by the importer.
    unsafe { create(name, logger, || Instance::new(token, folder.as_deref())) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(instance: *mut Component) {
    // SAFETY: guaranteed by the FMI standard.
    unsafe { free(instance) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetDebugLogging(
    instance: *mut Component,
    _on: bool,
    _count: usize,
    _categories: *const *const c_char,
) -> c_int {
    // SAFETY: guaranteed by the FMI standard.
    unsafe { with_instance(instance, |_| Ok(())) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterInitializationMode(
    instance: *mut Component,
    _has_tolerance: bool,
    _tolerance: f64,
    start: f64,
    _has_stop: bool,
    _stop: f64,
) -> c_int {
    // SAFETY: guaranteed by the FMI standard.
    unsafe { with_instance(instance, |instance| instance.set_start_time(start)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3ExitInitializationMode(instance: *mut Component) -> c_int {
    // SAFETY: guaranteed by the FMI standard.
    unsafe { with_instance(instance, Instance::start) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Terminate(instance: *mut Component) -> c_int {
    let end = |instance: &mut Instance| {
        instance.end();
        Ok(())
    };
    // SAFETY: guaranteed by the FMI standard.
    unsafe { with_instance(instance, end) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Reset(instance: *mut Component) -> c_int {
    let reset = |instance: &mut Instance| {
        instance.reset();
        Ok(())
    };
    // SAFETY: guaranteed by the FMI standard.
    unsafe { with_instance(instance, reset) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    instance: *mut Component,
    t: f64,
    step: f64,
    _no_set_before: bool,
    event: *mut bool,
    terminate: *mut bool,
    early: *mut bool,
    last: *mut f64,
) -> c_int {
    let go = |instance: &mut Instance| {
        instance.step(t, step)?;
        for flag in [event, terminate, early] {
            if !flag.is_null() {
                // SAFETY: the pointer is not null; the FMI standard guarantees memory for a flag.
                unsafe { flag.write(false) };
            }
        }
        if !last.is_null() {
            // SAFETY: the pointer is not null; the FMI standard guarantees memory for a number.
            unsafe { last.write_unaligned(t + step) };
        }
        Ok(())
    };
    // SAFETY: guaranteed by the FMI standard.
    unsafe { with_instance(instance, go) }
}

macro_rules! getters_and_setters {
    ($($get:ident, $set:ident, $type:ty: $read:expr, $write:expr;)+) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(
            instance: *mut Component,
            references: *const c_uint,
            _: usize,
            values: *mut $type,
            count: usize,
        ) -> c_int {
            // SAFETY: guaranteed by the FMI standard; every variable has one value.
            unsafe { get(instance, references, count, values, $read) }
        }

        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set(
            instance: *mut Component,
            references: *const c_uint,
            _: usize,
            values: *const $type,
            count: usize,
        ) -> c_int {
            // SAFETY: guaranteed by the FMI standard; every variable has one value.
            unsafe { set(instance, references, count, values, $write) }
        }
    )+};
}

getters_and_setters! {
    fmi3GetFloat64, fmi3SetFloat64, f64: real, FmuStart::Real;
    fmi3GetInt32, fmi3SetInt32, i32: integer, FmuStart::Integer;
    fmi3GetBoolean, fmi3SetBoolean, bool: boolean, FmuStart::Boolean;
    fmi3GetString, fmi3SetString, *const c_char: text, as_text;
}

/// Defines instantiation functions that are not supported: each returns null.
macro_rules! not_made {
    ($($name:ident),+ $(,)?) => {$(
        #[unsafe(no_mangle)]
        pub extern "C" fn $name() -> *mut Component {
            std::ptr::null_mut()
        }
    )+};
}

not_made!(fmi3InstantiateModelExchange, fmi3InstantiateScheduledExecution);

not_served!(
    fmi3EnterEventMode,
    fmi3EnterStepMode,
    fmi3EnterConfigurationMode,
    fmi3ExitConfigurationMode,
    fmi3EnterContinuousTimeMode,
    fmi3GetFloat32,
    fmi3SetFloat32,
    fmi3GetInt8,
    fmi3SetInt8,
    fmi3GetUInt8,
    fmi3SetUInt8,
    fmi3GetInt16,
    fmi3SetInt16,
    fmi3GetUInt16,
    fmi3SetUInt16,
    fmi3GetUInt32,
    fmi3SetUInt32,
    fmi3GetInt64,
    fmi3SetInt64,
    fmi3GetUInt64,
    fmi3SetUInt64,
    fmi3GetBinary,
    fmi3SetBinary,
    fmi3GetClock,
    fmi3SetClock,
    fmi3GetNumberOfVariableDependencies,
    fmi3GetVariableDependencies,
    fmi3GetDirectionalDerivative,
    fmi3GetAdjointDerivative,
    fmi3GetIntervalDecimal,
    fmi3GetIntervalFraction,
    fmi3GetShiftDecimal,
    fmi3GetShiftFraction,
    fmi3SetIntervalDecimal,
    fmi3SetIntervalFraction,
    fmi3SetShiftDecimal,
    fmi3SetShiftFraction,
    fmi3EvaluateDiscreteStates,
    fmi3UpdateDiscreteStates,
    fmi3CompletedIntegratorStep,
    fmi3SetTime,
    fmi3SetContinuousStates,
    fmi3GetContinuousStateDerivatives,
    fmi3GetEventIndicators,
    fmi3GetContinuousStates,
    fmi3GetNominalsOfContinuousStates,
    fmi3GetNumberOfEventIndicators,
    fmi3GetNumberOfContinuousStates,
    fmi3GetOutputDerivatives,
    fmi3ActivateModelPartition,
);
