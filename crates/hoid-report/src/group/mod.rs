//! The page about a group of recorded runs.
//!
//! | module | contents |
//! |---|---|
//! | `report`, `tables` | components of a page |
//! | `people` | the verdict, the runs that could not be read, the operator of each person |
//! | `estimates` | averages of the fits, selected delays, failed estimates |
//! | `frequency` | describing functions with the fits, and the agreement between them |
//! | `time_courses` | recursive estimates by condition and subject, and their settling times after a change |
//! | `html` | rendering of the page from these sections |
//! | `pages` | the pages made from a directory of tables: one for the group and one for each subject |

mod estimates;
mod frequency;
mod html;
mod pages;
mod people;
mod report;
mod tables;
mod time_courses;

pub use pages::{group_figures, write_group_pages};
pub use people::{PeopleTable, people_table};
pub use report::GroupReport;
pub use tables::{FrequencyTables, GroupTables};
