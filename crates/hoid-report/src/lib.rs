//! Figures and the report of an identification. Data in, text out: nothing here writes files or prints.
//!
//! | module | what it holds |
//! |---|---|
//! | [`Report`], [`ModelSection`] | one self-contained HTML page about one or several fitted models |
//! | [`figures`] | the figures of that page, each as an SVG text of its own |
//! | [`numbers`] | numbers with as many digits as their standard error allows |

mod error;
pub mod figures;
pub mod numbers;
mod report;
mod tables;

pub use error::ReportError;
pub use report::{ModelSection, Report};
