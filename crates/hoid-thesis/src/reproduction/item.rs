//! A table or figure of the thesis, made from the results of its study.

use std::{collections::BTreeMap, sync::Arc};

use hoid_io::OutputTable;
use hoid_study::Results;

use super::table_builder::TableBuilder;
use crate::ThesisError;

/// Name that selects the claims; it is used like the name of a table or figure.
pub const CLAIMS_NAME: &str = "claims";

/// Results of the named plans by the name of the plan.
pub type Studies = BTreeMap<String, Results>;

/// Function that makes an item from the results of its plan.
type MakeItem = Box<dyn Fn(&Item, Option<&Results>) -> ItemOutput + Send + Sync>;

/// Runs that several items share and that belong to no plan. Shared runs are made before any item is drawn. Otherwise a
/// thread that makes the runs for one item could, while waiting for some of these runs, start another item that waits
/// for all of them.
#[derive(Clone)]
pub(super) struct SharedRuns {
    /// Name of the runs; `title` is their title.
    pub name: &'static str,
    pub title: &'static str,
    /// Number of estimates in all runs.
    pub estimates: u64,
    /// Makes the runs and returns notes about failed runs, or an error if all runs fail.
    pub make_runs: MakeRuns,
}

/// Function that makes shared runs.
type MakeRuns = Arc<dyn Fn(&ProgressCallbacks<'_>) -> Result<Vec<String>, ThesisError> + Send + Sync>;

/// Callbacks with which a caller follows or cancels the making of shared runs.
pub(super) struct ProgressCallbacks<'a> {
    /// Called with the number of newly completed estimates.
    pub completed: &'a (dyn Fn(u64) + Sync),
    /// Returns true if the reproduction continues.
    pub should_continue: &'a (dyn Fn() -> bool + Sync),
}

impl ProgressCallbacks<'_> {
    /// Callbacks that report no progress and never cancel.
    pub const IGNORED: ProgressCallbacks<'static> = ProgressCallbacks {
        completed: &|_| (),
        should_continue: &|| true,
    };
}

/// One table or figure.
pub struct Item {
    /// Name of the item, such as `fig-5`, `C.1` or `table-2`.
    pub name: String,
    /// Title of the item in one line.
    pub title: String,
    /// Caption with notes for the reader.
    pub caption: String,
    /// Plan whose results the item shows; `None` if it shows no results of a plan.
    pub plan: Option<&'static str>,
    pub(super) shared: Option<SharedRuns>,
    make_item: MakeItem,
}

impl std::fmt::Debug for Item {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Item").field("name", &self.name).finish_non_exhaustive()
    }
}

/// Function that draws a grid of panels with a name and a title.
type DrawGrid<G> = fn(&str, &str, &G) -> String;

/// The figure and the numbers of an item.
#[derive(Debug, Clone, PartialEq)]
pub struct ItemOutput {
    /// The figure as SVG text; `None` for a table.
    pub svg: Option<String>,
    /// Data of the figure, or the table itself.
    pub data: OutputTable,
}

impl From<OutputTable> for ItemOutput {
    /// Creates the output of a table without a figure.
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
            make_item: Box::new(make),
        }
    }

    /// Adds runs that this item shares with other items.
    #[must_use]
    pub(super) fn with_shared_runs(mut self, runs: &SharedRuns) -> Self {
        self.shared = Some(runs.clone());
        self
    }

    /// Creates an item that is made from the results of a study.
    pub(super) fn from_study(
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

    /// Draws the figure of a grid and adds its data.
    pub(super) fn draw<G>(&self, draw: DrawGrid<G>, grid: &G, data: TableBuilder) -> ItemOutput {
        ItemOutput {
            svg: Some(draw(&self.name, &self.title, grid)),
            data: data.build(&self.title),
        }
    }

    /// Makes the item from the results of the studies; the output is empty if the results of its plan are missing.
    pub fn make(&self, studies: &Studies) -> ItemOutput {
        (self.make_item)(self, self.plan.and_then(|plan| studies.get(plan)))
    }
}
