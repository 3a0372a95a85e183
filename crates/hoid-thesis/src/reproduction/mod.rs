//! The tables and figures of the thesis, made from the results of the named plans.
//!
//! | module | output | study |
//! |---|---|---|
//! | `simulation_setup` | Tables 1, 2 (4.2, 4.3), 4.4, 6.1; Figs. 3, 4, A.1 | `noise-level` |
//! | `bias` | Figs. 5, 6, 9, C.1 to C.16: box plots of relative biases | `bias` |
//! | `orders` | Figs. 7, 8, E.1 to E.16: maps against n_k* and m* | `bias` |
//! | `responses` | Figs. 10, D.1 to D.18: Bode plots of averaged models | `bias` |
//! | `starts` | Figs. F.1 to F.8: fits from other starts compared with fits from the base start | `initial-conditions` |
//! | `traces` | Figs. 11, 12, G.1 to G.8, H.1 to H.12: recursive estimates | `recursive`, `recursive-arx` |
//! | `averages` | Figs. H.1 to H.12 as in the thesis: averages, with the medians | `recursive` |
//! | `experiment` | Table 3, Figs. 13, 14, I.1 to I.18 with virtual or recorded people | its own |
//! | `extensions` | topics that the thesis leaves for future work | the other plans |
//! | `catalogue` | all tables and figures in the order of the thesis | |
//! | `item`, `table_builder`, `axes` | components of these outputs | |
//! | `index` | the page with all tables, figures and claims | all |
//! | `run` | the whole reproduction in a directory | |
//!
//! Axes, cells and grouping follow the captions. The hue represents the method (ARX blue, Box-Jenkins vermillion) and
//! the shade the noise level or the delay; dashed black lines are the true values. The data of each figure are
//! available as a table.

mod averages;
mod axes;
mod bias;
mod catalogue;
mod experiment;
mod extensions;
mod index;
mod item;
mod orders;
mod responses;
mod run;
mod simulation_setup;
mod starts;
mod table_builder;
mod traces;

pub use catalogue::items;
pub use index::{IndexPage, StudyEntry};
pub use item::{CLAIMS_NAME, Item, ItemOutput, Studies};
pub use run::{Reproduction, ReproductionEvent, ReproductionSummary, reproduce};
