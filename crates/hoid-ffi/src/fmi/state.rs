//! Saved state of an instance. The instance can return to an earlier time, or another instance can continue, with
//! bit-identical results (FMI 2.0.4, section 2.1.8; FMI 3.0.1, section 2.2.10).
//!
//! The importer holds a state in its serialised form (`binary_format`). The description contains the token of the unit,
//! the phase and times of the experiment, and the values of all variables. The data are the bytes of the tracker, or
//! the numbers of the operator. 64-bit floating-point numbers are stored in the description as their bit patterns,
//! since JSON has no NaN.

#![allow(missing_docs, non_snake_case, clippy::missing_safety_doc)]

use std::ffi::{c_int, c_uchar};

use hoid_io::fmu::FmuStart;
use serde_json::{Value, json};

use super::{
    component::{Component, slice_from_raw, slice_from_raw_mut, with_instance},
    instance::{Instance, Phase},
    model::Model,
    values::{FmiResult, VariableValues},
};
use crate::binary_format::{pack, unpack};

const MAGIC: [u8; 8] = *b"hoidfmu\x01";

/// Saved state in serialised form, held by the importer.
pub struct State(Vec<u8>);

impl Instance {
    /// Returns the state as bytes, without changing the instance.
    fn save_state(&mut self) -> Vec<u8> {
        let phase = match self.phase {
            Phase::Setup => "setup",
            Phase::Running => "running",
            Phase::Ended => "ended",
        };
        let values: Vec<Value> = self.values.iter().map(value_to_json).collect();
        let (extra_numbers, bytes) = self.model.as_mut().map(Model::save_state).unwrap_or_default();
        let extra_numbers: Vec<u64> = extra_numbers.into_iter().map(f64::to_bits).collect();
        let description = json!({
            "unit": self.token,
            "phase": phase,
            "start": self.start_s.to_bits(),
            "k": self.k,
            "end": self.end_s.to_bits(),
            "values": values,
            "model": self.model.is_some().then_some(extra_numbers),
        });
        pack(MAGIC, &description, &bytes)
    }

    /// Restores a state of this unit. If this fails, the instance does not change.
    fn restore(&mut self, bytes: &[u8]) -> FmiResult {
        let wrong = || "the state is not from this unit, or was changed or truncated since it was saved".to_owned();
        let (description, bytes) = unpack(MAGIC, bytes).map_err(|_| wrong())?;
        if description["unit"] != json!(self.token) {
            return Err(wrong());
        }
        let phase = match description["phase"].as_str() {
            Some("setup") => Phase::Setup,
            Some("running") => Phase::Running,
            Some("ended") => Phase::Ended,
            _ => return Err(wrong()),
        };
        let number = |value: &Value| value.as_u64().map(f64::from_bits).ok_or_else(wrong);
        let listed = description["values"].as_array().ok_or_else(wrong)?;
        if listed.len() != self.variables.len() {
            return Err(wrong());
        }
        let typed = self.variables.iter().zip(listed);
        let values: Vec<FmuStart> = typed
            .map(|(variable, value)| to_value(&variable.start, value))
            .collect::<Option<_>>()
            .ok_or_else(wrong)?;
        let start_s = number(&description["start"])?;
        let end_s = number(&description["end"])?;
        let k = description["k"].as_u64().ok_or_else(wrong)?;
        let model = match &description["model"] {
            Value::Null if phase != Phase::Running => None,
            extra_numbers => {
                let extra_numbers = extra_numbers.as_array().ok_or_else(wrong)?;
                let extra_numbers: Vec<f64> = extra_numbers.iter().map(number).collect::<FmiResult<_>>()?;
                let given = VariableValues {
                    variables: &self.variables,
                    values: &values,
                };
                Some(Model::from_saved_state(
                    &self.settings,
                    &given,
                    start_s,
                    &extra_numbers,
                    bytes,
                )?)
            }
        };
        self.values = values;
        (0..self.values.len()).for_each(|reference| self.update_text(reference));
        (self.phase, self.start_s, self.k, self.end_s, self.model) = (phase, start_s, k, end_s, model);
        Ok(())
    }
}

fn value_to_json(value: &FmuStart) -> Value {
    match value {
        FmuStart::Real(value) => json!(value.to_bits()),
        FmuStart::Integer(value) => json!(value),
        FmuStart::Boolean(value) => json!(value),
        FmuStart::Text(text) => json!(text),
    }
}

/// Converts a JSON value to a value of the same type as `of`.
fn to_value(of: &FmuStart, value: &Value) -> Option<FmuStart> {
    Some(match of {
        FmuStart::Real(_) => FmuStart::Real(f64::from_bits(value.as_u64()?)),
        FmuStart::Integer(_) => FmuStart::Integer(i32::try_from(value.as_i64()?).ok()?),
        FmuStart::Boolean(_) => FmuStart::Boolean(value.as_bool()?),
        FmuStart::Text(_) => FmuStart::Text(value.as_str()?.to_owned()),
    })
}

/// Returns the memory that the importer supplies for the handle of a state.
///
/// # Safety
/// `place` is null, or points to null or to a state that came from [`into_handle`] and has not been freed.
unsafe fn handle_memory<'a>(place: *mut *mut State) -> FmiResult<&'a mut *mut State> {
    // SAFETY: guaranteed by the caller of this function.
    let place = unsafe { slice_from_raw_mut(place, 1) }?;
    place
        .first_mut()
        .ok_or_else(|| "there is no pointer for the state".to_owned())
}

/// Passes a state to the importer: overwrites the existing state, or creates a new one if there is none.
///
/// # Safety
/// As for [`handle_memory`].
unsafe fn into_handle(bytes: Vec<u8>, place: *mut *mut State) -> FmiResult {
    // SAFETY: guaranteed by the caller of this function.
    let place = unsafe { handle_memory(place) }?;
    if place.is_null() {
        *place = Box::into_raw(Box::new(State(bytes)));
        return Ok(());
    }
    // SAFETY: the pointer is not null; the caller guarantees that it is a state of this library.
    let there = unsafe { slice_from_raw_mut(*place, 1) }?;
    there.iter_mut().for_each(|state| state.0.clone_from(&bytes));
    Ok(())
}

/// Returns the bytes of a state.
///
/// # Safety
/// `state` is null, or came from [`into_handle`] and has not been freed.
unsafe fn state_bytes<'a>(state: *const State) -> FmiResult<&'a [u8]> {
    // SAFETY: guaranteed by the caller of this function.
    let states = unsafe { slice_from_raw(state, 1) }?;
    states
        .first()
        .map(|state| state.0.as_slice())
        .ok_or_else(|| "there is no state".to_owned())
}

macro_rules! states {
    ($get:ident, $set:ident, $free:ident, $size:ident, $serialise:ident, $deserialise:ident) => {
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(component: *mut Component, state: *mut *mut State) -> c_int {
            let take = |instance: &mut Instance| {
                let bytes = instance.save_state();
                // SAFETY: guaranteed by the FMI standard.
                unsafe { into_handle(bytes, state) }
            };
            // SAFETY: guaranteed by the FMI standard.
            unsafe { with_instance(component, take) }
        }

        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set(component: *mut Component, state: *mut State) -> c_int {
            let go = |instance: &mut Instance| {
                // SAFETY: guaranteed by the FMI standard.
                let bytes = unsafe { state_bytes(state) }?;
                instance.restore(bytes)
            };
            // SAFETY: guaranteed by the FMI standard.
            unsafe { with_instance(component, go) }
        }

        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $free(component: *mut Component, state: *mut *mut State) -> c_int {
            let free = |_: &mut Instance| {
                // SAFETY: guaranteed by the FMI standard.
                let place = unsafe { handle_memory(state) }?;
                if !place.is_null() {
                    // SAFETY: the pointer came from `into_handle`, and is replaced by null.
                    drop(unsafe { Box::from_raw(std::mem::replace(place, std::ptr::null_mut())) });
                }
                Ok(())
            };
            // SAFETY: guaranteed by the FMI standard.
            unsafe { with_instance(component, free) }
        }

        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $size(component: *mut Component, state: *mut State, size: *mut usize) -> c_int {
            let read = |_: &mut Instance| {
                // SAFETY: guaranteed by the FMI standard.
                let bytes = unsafe { state_bytes(state) }?;
                // SAFETY: guaranteed by the FMI standard.
                let size = unsafe { slice_from_raw_mut(size, 1) }?;
                size.fill(bytes.len());
                Ok(())
            };
            // SAFETY: guaranteed by the FMI standard.
            unsafe { with_instance(component, read) }
        }

        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $serialise(
            component: *mut Component,
            state: *mut State,
            room: *mut c_uchar,
            size: usize,
        ) -> c_int {
            let write = |_: &mut Instance| {
                // SAFETY: guaranteed by the FMI standard.
                let bytes = unsafe { state_bytes(state) }?;
                if size < bytes.len() {
                    return Err(format!(
                        "there is room for {size} bytes, but the state has {}",
                        bytes.len()
                    ));
                }
                // SAFETY: the FMI standard guarantees memory of this size, and no more is used.
                let room = unsafe { slice_from_raw_mut(room, bytes.len()) }?;
                room.copy_from_slice(bytes);
                Ok(())
            };
            // SAFETY: guaranteed by the FMI standard.
            unsafe { with_instance(component, write) }
        }

        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $deserialise(
            component: *mut Component,
            bytes: *const c_uchar,
            size: usize,
            state: *mut *mut State,
        ) -> c_int {
            let read = |_: &mut Instance| {
                // SAFETY: guaranteed by the FMI standard.
                let bytes = unsafe { slice_from_raw(bytes, size) }?;
                unpack(MAGIC, bytes)
                    .map_err(|_| "the bytes are not a state, or were changed or truncated".to_owned())?;
                // SAFETY: guaranteed by the FMI standard.
                unsafe { into_handle(bytes.to_vec(), state) }
            };
            // SAFETY: guaranteed by the FMI standard.
            unsafe { with_instance(component, read) }
        }
    };
}

states!(
    fmi2GetFMUstate,
    fmi2SetFMUstate,
    fmi2FreeFMUstate,
    fmi2SerializedFMUstateSize,
    fmi2SerializeFMUstate,
    fmi2DeSerializeFMUstate
);
states!(
    fmi3GetFMUState,
    fmi3SetFMUState,
    fmi3FreeFMUState,
    fmi3SerializedFMUStateSize,
    fmi3SerializeFMUState,
    fmi3DeserializeFMUState
);
