//! Figures and HTML pages about identified models.
//!
//! A fit is a list of numbers; figures show how reliable it is: the frequency response with its bands, the residual
//! tests, the simulated and the measured output. A [`Report`] puts these figures on one page, which contains all styles
//! and figures:
//!
//! ```
//! use hoid_ident::Estimator;
//! use hoid_model::{Structure, scenario::{Condition, Scenario}};
//! use hoid_report::{ModelSection, Report, known_operator};
//! use hoid_sim::{RunSeed, Simulator};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let simulator = Simulator::new(&Scenario::condition(Condition::C1))?;
//! let records = [simulator.run(RunSeed::default(), false)?];
//! let fit = Estimator::new(Structure::Arx, Structure::Arx.operator_orders(29)).fit(&records)?;
//! let report = Report {
//!     title: "A simulated run of condition C1".to_owned(),
//!     settings: vec![("seed".to_owned(), "0".to_owned())],
//!     models: vec![ModelSection {
//!         name: fit.title(),
//!         fit: &fit,
//!         records: &records,
//!         candidates: None,
//!         truth: known_operator(&records),
//!         margins: None,
//!     }],
//!     notes: Vec::new(),
//!     fit_summary: None,
//!     pictures: Vec::new(),
//! };
//! let page = report.to_html()?;
//! assert!(page.contains("<svg"));
//! # Ok(())
//! # }
//! ```
//!
//! | module | contents |
//! |---|---|
//! | [`FitSummary`], [`sentence`] | the head of a page: verdict, the result as text, parameters with errors |
//! | [`Report`], [`ModelSection`], [`model_figure`] | one self-contained HTML page about one or several fitted models |
//! | [`Report::from_operator_fit`], [`operator_figure`], [`operator_sentence`] | the page of the operator of a person |
//! | [`TrackReport`], [`TraceSection`], [`BatchLine`], [`batch_fit`], [`default_batch_fits`] | one self-contained HTML page about recursive estimates over a record |
//! | [`GroupReport`], [`GroupTables`], [`write_group_pages`], [`group_figures`] | one self-contained HTML page about a group of recorded runs |
//! | [`comparison_figure`] | people by condition, with the means over people |
//! | [`design_figure`], [`runs_figure`] | a designed experiment: lines and response, errors by number of runs |
//! | [`PaperTable`] | a result as a table for a paper |
//! | [`settings_pairs`] | the table of settings on these pages |
//! | [`figures`] | the figures of these pages, each as separate SVG text |
//! | [`numbers`] | numbers with as many digits as their standard error allows |
//! | [`render_with`], [`write_page`], [`write_report`] | additional templates in the same style, and pages written to files |
//!
//! This crate prints nothing. Equal data give identical bytes.

mod cells;
mod comparison;
mod design;
mod error;
pub mod figures;
mod fit_summary;
mod group;
mod model_figure;
mod model_section;
mod operator;
mod page;
mod paper_table;
mod report;
mod settings_table;
mod tables;
mod track;

pub use comparison::comparison_figure;
pub use design::{design_figure, runs_figure};
pub use error::ReportError;
pub use fit_summary::{FitSummary, ParameterRow, sentence};
pub use group::{
    FrequencyTables, GroupReport, GroupTables, PeopleTable, group_figures, people_table, write_group_pages,
};
pub use hoid_model::numbers;
pub use model_figure::{model_figure, model_picture};
pub use model_section::{ModelSection, known_operator};
pub use operator::{operator_figure, operator_sentence, undetermined_remark};
pub use page::{render_with, write_page, write_report};
pub use paper_table::PaperTable;
pub use report::{Picture, Report};
pub use settings_table::settings_pairs;
pub use track::{BatchFit, BatchLine, TraceSection, TrackReport, batch_fit, default_batch_fits};
