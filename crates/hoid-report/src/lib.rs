//! Figures and the report of an identification. Data in, text out, but for [`write_group_pages`], which works in a directory. Nothing
//! here prints.
//!
//! | module | what it holds |
//! |---|---|
//! | [`Report`], [`ModelSection`] | one self-contained HTML page about one or several fitted models |
//! | [`TrackReport`], [`TraceSection`], [`BatchLine`], [`batch_fit`], [`usual_batch_fits`] | one such page about recursive estimates over a record |
//! | [`GroupReport`], [`GroupTables`] | one such page about a group of recorded runs |
//! | [`figures`] | the figures of these pages, each as an SVG text of its own |
//! | [`numbers`] | numbers with as many digits as their standard error allows |

mod error;
pub mod figures;
mod group;
mod page;
mod report;
mod tables;
mod track;

pub use error::ReportError;
pub use group::{FrequencyTables, GroupReport, GroupTables, write_group_pages};
pub use hoid_model::numbers;
pub use page::{render_with, write_page, write_report};
pub use report::{ModelSection, Report, known_operator};
pub use track::{BatchFit, BatchLine, TraceSection, TrackReport, batch_fit, usual_batch_fits};
