//! The tables and figures of the reference text, made from the results of the named plans.
//!
//! | module | what it makes | study |
//! |---|---|---|
//! | `setting` | Tables 1, 2 (4.2, 4.3), 4.4, 6.1; Figs. 3, 4, A.1 | `noise-level` |
//! | `bias` | Figs. 5, 6, 9, C.1 to C.16: box plots of relative biases | `bias` |
//! | `orders` | Figs. 7, 8, E.1 to E.16: maps over nk* and m* | `bias` |
//! | `responses` | Figs. 10, D.1 to D.18: Bode plots of averaged models | `bias` |
//! | `starts` | Figs. F.1 to F.8: other starts against the base | `initial-conditions` |
//! | `traces` | Figs. 11, 12, G.1 to G.8, H.1 to H.12: recursive estimates | `recursive`, `recursive-arx` |
//! | `further` | what the text leaves for later | the other plans |
//! | `index` | the page that shows it all, with the claims | all |
//! | `run` | all of this in a directory | |
//!
//! Axes, cells and grouping are those of the captions. The hue tells the method (ARX blue, Box-Jenkins vermillion), its shade the noise level or the
//! delay, black dashes the truth. Each figure comes with its data as a table.

mod bias;
mod further;
mod index;
mod orders;
mod responses;
mod run;
mod setting;
mod starts;
mod traces;

use std::collections::BTreeMap;

use hoid_io::{ColumnValues, OutputColumn, OutputTable};
use hoid_study::Results;

pub use index::{IndexPage, StudyEntry};
pub use run::{CLAIMS, Reproduced, Reproduction, Told, reproduce};

/// Results of the named plans, by name.
pub type Studies = BTreeMap<String, Results>;

/// Remnant orders of all figures.
const REMNANT_ORDERS: [usize; 4] = [1, 2, 3, 4];

/// Makes an item from the results of its plan.
type Maker = Box<dyn Fn(&Item, Option<&Results>) -> Made + Send + Sync>;

/// One table or figure.
pub struct Item {
    /// Its name, as `fig-5`, `C.1` or `table-2`.
    pub name: String,
    /// What it is, one line.
    pub title: String,
    /// What to know to read it.
    pub caption: String,
    /// The plan whose results it shows; none where nothing is simulated.
    pub plan: Option<&'static str>,
    make: Maker,
}

impl std::fmt::Debug for Item {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Item").field("name", &self.name).finish_non_exhaustive()
    }
}

/// What has been made of an item.
#[derive(Debug, Clone, PartialEq)]
pub struct Made {
    /// The figure; none for a table.
    pub svg: Option<String>,
    /// Its numbers, or the table itself.
    pub data: OutputTable,
}

impl Item {
    fn new(
        name: impl Into<String>,
        title: impl Into<String>,
        caption: impl Into<String>,
        plan: Option<&'static str>,
        make: impl Fn(&Self, Option<&Results>) -> Made + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            title: title.into(),
            caption: caption.into(),
            plan,
            make: Box::new(make),
        }
    }

    /// A figure of a study.
    fn of_study(
        name: impl Into<String>,
        title: impl Into<String>,
        caption: impl Into<String>,
        plan: &'static str,
        make: impl Fn(&Self, &Results) -> Made + Send + Sync + 'static,
    ) -> Self {
        Self::new(name, title, caption, Some(plan), move |item, results| match results {
            Some(results) => make(item, results),
            None => Made {
                svg: None,
                data: OutputTable::default(),
            },
        })
    }

    /// Makes it from the results of the studies; without those of its plan it is empty.
    pub fn make(&self, studies: &Studies) -> Made {
        (self.make)(self, self.plan.and_then(|plan| studies.get(plan)))
    }
}

/// All tables and figures, in the order of the text.
pub fn items() -> Vec<Item> {
    let mut all = setting::items();
    all.extend(bias::items());
    all.extend(orders::items());
    all.extend(responses::items());
    all.extend(starts::items());
    all.extend(traces::items());
    all.extend(further::items());
    all.sort_by_cached_key(|item| place(&item.name));
    all
}

/// Tables, the figures of the article, those of the appendices by number, the rest.
fn place(name: &str) -> (u8, String, u32, String) {
    let number = |text: &str| text.parse::<f64>().map_or(0, |n| (10.0 * n) as u32);
    if let Some(n) = name.strip_prefix("table-") {
        return (0, String::new(), number(n), String::new());
    }
    if let Some(n) = name.strip_prefix("fig-") {
        return (1, String::new(), number(n), String::new());
    }
    match name.split_once('.') {
        Some((letter, n)) => (2, letter.to_owned(), n.parse().unwrap_or(0), String::new()),
        None => (3, String::new(), 0, name.to_owned()),
    }
}

/// A table that grows row by row: texts and numbers under fixed names.
struct Data {
    texts: Vec<(&'static str, Vec<String>)>,
    numbers: Vec<(&'static str, Vec<f64>)>,
}

impl Data {
    fn new(texts: &[&'static str], numbers: &[&'static str]) -> Self {
        Self {
            texts: texts.iter().map(|name| (*name, Vec::new())).collect(),
            numbers: numbers.iter().map(|name| (*name, Vec::new())).collect(),
        }
    }

    fn row(&mut self, texts: &[&str], numbers: &[f64]) {
        for ((_, column), text) in self.texts.iter_mut().zip(texts) {
            column.push((*text).to_owned());
        }
        for ((_, column), number) in self.numbers.iter_mut().zip(numbers) {
            column.push(*number);
        }
    }

    fn table(self, comment: &str) -> OutputTable {
        let texts = self.texts.into_iter().map(|(name, values)| OutputColumn {
            name: name.to_owned(),
            values: ColumnValues::Text(values),
        });
        let numbers = self.numbers.into_iter().map(|(name, values)| OutputColumn {
            name: name.to_owned(),
            values: ColumnValues::Real(values),
        });
        OutputTable {
            comments: vec![comment.to_owned()],
            columns: texts.chain(numbers).collect(),
        }
    }
}

/// `m^0 = 1` to `m^0 = 4`.
fn order_titles() -> Vec<String> {
    REMNANT_ORDERS.iter().map(|m| format!("m^0 = {m}")).collect()
}

/// `P_n = 0.1`.
fn level_name(level: f64) -> String {
    format!("P_n = {level}")
}
