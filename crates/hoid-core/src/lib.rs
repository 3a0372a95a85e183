//! Real-time kernel of hoid: what runs once per sample, beside a control loop.
//!
//! `no_std`, no allocation, no dependency: every routine works in memory that the caller owns and has a bounded number of
//! operations. The batch estimators and the simulator stand on the same routines, so that a recursion and its batch twin
//! cannot differ in their filters.
//!
//! | module | what it holds |
//! |---|---|
//! | [`delay`] | a delay line of fixed length |
//! | [`filter`] | rational filters `C(q^-1)/D(q^-1)` over slices |
//! | [`stability`] | Schur-Cohn test: are all roots inside a circle? |
#![no_std]

#[cfg(test)]
extern crate std;

pub mod delay;
pub mod filter;
pub mod stability;
