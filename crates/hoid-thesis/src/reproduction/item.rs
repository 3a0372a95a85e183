//! A table or figure of the text, and how it is made from the results of its study.

use std::{collections::BTreeMap, sync::Arc};

use hoid_io::OutputTable;
use hoid_study::Results;

use super::table_builder::TableBuilder;
use crate::ThesisError;

/// Name that selects the claims, among those of the tables and figures.
pub const CLAIMS: &str = "claims";

/// Results of the named plans, by name.
pub type Studies = BTreeMap<String, Results>;

/// Makes an item from the results of its plan.
type Maker = Box<dyn Fn(&Item, Option<&Results>) -> ItemOutput + Send + Sync>;

/// Runs that several items share and no plan describes. They are made before the items are drawn:
/// otherwise a thread that makes the runs for one item could, while it waits for a part of them, be
/// given another item that waits for all of them.
#[derive(Clone)]
pub(super) struct SharedRuns {
    /// Their name and title.
    pub name: &'static str,
    pub title: &'static str,
    /// Number of estimates.
    pub estimates: u64,
    /// Makes the runs; notes on those that failed, or the error of all of them.
    pub make: MakeRuns,
}

/// Makes shared runs.
type MakeRuns = Arc<dyn Fn(&Watch<'_>) -> Result<Vec<String>, ThesisError> + Send + Sync>;

/// Steps after the runs are made.
pub(super) struct Watch<'a> {
    /// Called with a number of completed estimates.
    pub done: &'a (dyn Fn(u64) + Sync),
    /// Whether the reproduction continues.
    pub goes_on: &'a (dyn Fn() -> bool + Sync),
}

impl Watch<'_> {
    /// No output, and the reproduction continues.
    pub const NONE: Watch<'static> = Watch {
        done: &|_| (),
        goes_on: &|| true,
    };
}

/// One table or figure.
pub struct Item {
    /// Its name, such as `fig-5`, `C.1` or `table-2`.
    pub name: String,
    /// Its title, one line.
    pub title: String,
    /// Notes for the reader.
    pub caption: String,
    /// The plan whose results it shows; `None` if nothing is simulated.
    pub plan: Option<&'static str>,
    pub(super) shared: Option<SharedRuns>,
    make: Maker,
}

impl std::fmt::Debug for Item {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Item").field("name", &self.name).finish_non_exhaustive()
    }
}

/// Draws a grid of panels under a name and a title.
type Drawing<G> = fn(&str, &str, &G) -> String;

/// The figure and the numbers of an item.
#[derive(Debug, Clone, PartialEq)]
pub struct ItemOutput {
    /// The figure; `None` for a table.
    pub svg: Option<String>,
    /// Its numbers, or the table itself.
    pub data: OutputTable,
}

impl From<OutputTable> for ItemOutput {
    /// A table without a figure.
    fn from(data: OutputTable) -> Self {
        Self { svg: None, data }
    }
}

impl Item {
    pub(super) fn new(
        name: impl Into<String>,
        title: impl Into<String>,
        caption: impl Into<String>,
        plan: Option<&'static str>,
        make: impl Fn(&Self, Option<&Results>) -> ItemOutput + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            title: title.into(),
            caption: caption.into(),
            plan,
            shared: None,
            make: Box::new(make),
        }
    }

    /// Adds runs that it shares with other items.
    #[must_use]
    pub(super) fn sharing(mut self, runs: &SharedRuns) -> Self {
        self.shared = Some(runs.clone());
        self
    }

    /// A figure of a study.
    pub(super) fn of_study(
        name: impl Into<String>,
        title: impl Into<String>,
        caption: impl Into<String>,
        plan: &'static str,
        make: impl Fn(&Self, &Results) -> ItemOutput + Send + Sync + 'static,
    ) -> Self {
        Self::new(name, title, caption, Some(plan), move |item, results| match results {
            Some(results) => make(item, results),
            None => OutputTable::default().into(),
        })
    }

    /// The figure of a grid, and its numbers.
    pub(super) fn drawn<G>(&self, draw: Drawing<G>, grid: &G, data: TableBuilder) -> ItemOutput {
        ItemOutput {
            svg: Some(draw(&self.name, &self.title, grid)),
            data: data.table(&self.title),
        }
    }

    /// Makes the item from the results of the studies; without those of its plan it is empty.
    pub fn make(&self, studies: &Studies) -> ItemOutput {
        (self.make)(self, self.plan.and_then(|plan| studies.get(plan)))
    }
}
