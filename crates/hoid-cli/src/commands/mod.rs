//! One file per command. A command converts its arguments, calls the library, and prints the result.

pub mod compare;
pub mod convert;
pub mod demo;
pub mod describe;
pub mod design;
pub mod figure;
pub mod fmu;
pub mod group;
pub mod identify;
pub mod info;
pub mod lab;
pub mod margins;
mod output_paths;
mod paper_table;
pub mod reading;
pub mod reproduce;
mod scenario;
pub mod shell;
pub mod simulate;
pub mod stream;
pub mod study;
mod study_answer;
pub mod track;
