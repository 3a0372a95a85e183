//! Figures and the report of an identification. Data in, text out: nothing here writes files or prints.
//!
//! | module | what it holds |
//! |---|---|
//! | [`Report`], [`ModelSection`] | one self-contained HTML page about one or several fitted models |
//! | [`TrackReport`], [`TraceSection`], [`BatchLine`] | one such page about recursive estimates over a record |
//! | [`figures`] | the figures of these pages, each as an SVG text of its own |
//! | [`numbers`] | numbers with as many digits as their standard error allows |

mod error;
pub mod figures;
pub mod numbers;
mod page;
mod report;
mod tables;
mod track;

pub use error::ReportError;
pub use report::{ModelSection, Report};
pub use track::{BatchLine, TraceSection, TrackReport};
