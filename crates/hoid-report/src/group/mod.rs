//! The page about a group of recorded runs.
//!
//! | module | contents |
//! |---|---|
//! | `report`, `tables` | components of a page |
//! | `people` | the verdict, what was not read, the operator of each person |
//! | `estimates` | averages of the fits, chosen delays, what could not be estimated |
//! | `frequency` | describing functions with the fits over them, and where they agree |
//! | `over_time` | recursive estimates by condition and subject, and how fast they follow a change |
//! | `html` | the page of these sections |
//! | `pages` | the pages of a directory of tables, one for the group and one a subject |

mod estimates;
mod frequency;
mod html;
mod over_time;
mod pages;
mod people;
mod report;
mod tables;

pub use pages::{group_figures, write_group_pages};
pub use people::{PeopleTable, people_table};
pub use report::GroupReport;
pub use tables::{FrequencyTables, GroupTables};
