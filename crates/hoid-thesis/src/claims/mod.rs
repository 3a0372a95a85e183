//! Statements of the reference text, tested by the data of studies.
//!
//! A claim names what the text says and where, which plans measure it and how. Its verdict comes from the data by the rules of the
//! module [`rules`], the same for all claims. A claim whose plan was not run, or which asks for something that the results do not have, cannot
//! be tested and says why; so does one on experiments with people, for which there are no data here.
//!
//! | module | theme |
//! |---|---|
//! | `batch_arx` | batch fits of ARX models |
//! | `batch_bj`, `bj_against_arx` | batch fits of Box-Jenkins models |
//! | `remnant_order` | the order of the noise model |
//! | `initial_conditions` | where searches start |
//! | `recursive_arx`, `recursive_bj` | RLS, and RPEM against RLS |
//! | `noise` | noise level, remnant time constant, sample time |
//! | `elsewhere` | what is not tested here |
//!
//! ```no_run
//! use hoid_study::{Results, claims::{Evidence, findings}};
//!
//! let bias = Results::read("results/bias".as_ref())?;
//! let mut evidence = Evidence::new();
//! evidence.add(&bias);
//! for (claim, finding) in findings(&evidence) {
//!     println!("{}: {}", claim.id, finding.verdict);
//! }
//! # Ok::<(), hoid_study::StudyError>(())
//! ```

mod batch_arx;
mod batch_bj;
mod bj_against_arx;
mod elsewhere;
mod initial_conditions;
mod measure;
mod noise;
mod recursive_arx;
mod recursive_bj;
mod remnant_order;
pub mod rules;
mod table;

pub use measure::Evidence;
pub use rules::{Bound, CellOutcome, CellTest, Part, Value, Verdict};
pub use table::claims_table;

use hoid_study::{Query, Statistics};

/// A statement of the text.
#[derive(Debug, Clone)]
pub struct Claim {
    /// Its name, of which there is one.
    pub id: &'static str,
    /// What it is about.
    pub theme: Theme,
    /// The statement, quoted or put shortly.
    pub statement: &'static str,
    /// Section and figures.
    pub place: &'static str,
    /// How it is measured here.
    pub measure: &'static str,
    /// The plans that it needs.
    pub plans: &'static [&'static str],
    source: Source,
}

/// What a claim is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Theme {
    /// Batch fits of ARX models.
    BatchArx,
    /// Batch fits of Box-Jenkins models.
    BatchBj,
    /// The order of the noise model.
    RemnantOrder,
    /// Where searches start.
    InitialConditions,
    /// Recursive estimates.
    Recursive,
    /// Noise level, remnant time constant, sample time.
    Noise,
    /// Experiments with people.
    Experiment,
}

impl Theme {
    /// A heading.
    pub fn title(self) -> &'static str {
        match self {
            Self::BatchArx => "Batch fits of ARX models",
            Self::BatchBj => "Batch fits of Box-Jenkins models",
            Self::RemnantOrder => "Order of the noise model",
            Self::InitialConditions => "Where searches start",
            Self::Recursive => "Recursive estimates",
            Self::Noise => "Noise level, remnant and sample time",
            Self::Experiment => "Experiments",
        }
    }
}

#[derive(Debug, Clone, Copy)]
enum Source {
    Data(fn(&Evidence<'_>) -> Result<Vec<Part>, String>),
    Nowhere(&'static str),
}

/// What the data say of a claim.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Whether it holds.
    pub verdict: Verdict,
    /// Its parts with all cells.
    pub parts: Vec<Part>,
    /// The numbers, a few for each part.
    pub measured: Vec<Measured>,
    /// Cells that pass.
    pub passed: usize,
    /// Cells that fail.
    pub failed: usize,
    /// Cells in all; those that neither pass nor fail are undecided.
    pub of: usize,
    /// What was found, in words.
    pub text: String,
}

/// A number that was measured, over the cells of a part.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// What it is.
    pub label: String,
    /// Median over the cells that have a value.
    pub value: f64,
    /// Monte Carlo error of one cell, the median over the cells.
    pub error: f64,
    /// Smallest value of a cell.
    pub least: f64,
    /// Largest value of a cell.
    pub most: f64,
    /// Cells with a value.
    pub cells: usize,
}

/// All claims, theme by theme.
pub fn claims() -> Vec<Claim> {
    [
        batch_arx::CLAIMS,
        batch_bj::CLAIMS,
        bj_against_arx::CLAIMS,
        remnant_order::CLAIMS,
        initial_conditions::CLAIMS,
        recursive_arx::CLAIMS,
        recursive_bj::CLAIMS,
        noise::CLAIMS,
        elsewhere::CLAIMS,
    ]
    .concat()
}

/// All claims with what the data say of them.
pub fn findings(evidence: &Evidence<'_>) -> Vec<(Claim, Finding)> {
    let with_finding = |claim: Claim| {
        let finding = claim.evaluate(evidence);
        (claim, finding)
    };
    claims().into_iter().map(with_finding).collect()
}

impl Claim {
    /// What the data say of it.
    pub fn evaluate(&self, evidence: &Evidence<'_>) -> Finding {
        let found = match self.source {
            Source::Data(measure) => measure(evidence),
            Source::Nowhere(reason) => Err(reason.to_owned()),
        };
        let (verdict, parts) = match found {
            Ok(parts) => (rules::verdict(&parts), parts),
            Err(reason) => (Verdict::CannotBeTested(reason), Vec::new()),
        };
        let count = |outcome| parts.iter().map(|part| part.count(outcome)).sum();
        Finding {
            passed: count(CellOutcome::Passes),
            failed: count(CellOutcome::Fails),
            of: parts.iter().map(|part| part.tests.len()).sum(),
            measured: parts.iter().flat_map(measured).collect(),
            text: in_words(&verdict, &parts),
            verdict,
            parts,
        }
    }
}

fn measured(part: &Part) -> Vec<Measured> {
    let of = |figure: fn(&CellTest) -> f64| Statistics::of(&part.tests.iter().map(figure).collect::<Vec<_>>());
    let values = of(|test| test.measured.value);
    let over_cells = Measured {
        label: part.label.clone(),
        value: values.median,
        error: of(|test| test.measured.error).median,
        least: values.least,
        most: values.most,
        cells: values.count,
    };
    let shown = part.shown.iter().map(|(label, value)| Measured {
        label: label.clone(),
        value: value.value,
        error: value.error,
        least: value.value,
        most: value.value,
        cells: 1,
    });
    std::iter::once(over_cells).chain(shown).collect()
}

fn in_words(verdict: &Verdict, parts: &[Part]) -> String {
    let of_part = |part: &Part| {
        let (above, below) = part.beyond();
        let open = part.count(CellOutcome::Undecided);
        let mut text = format!(
            "{}: {} of {} cells pass",
            part.label,
            part.count(CellOutcome::Passes),
            part.tests.len()
        );
        for (count, what) in [(above, "above"), (below, "below"), (open, "undecided")] {
            if count > 0 {
                text.push_str(&format!(", {count} {what}"));
            }
        }
        text
    };
    let parts: Vec<String> = parts.iter().map(of_part).collect();
    match verdict {
        Verdict::CannotBeTested(reason) if parts.is_empty() => reason.clone(),
        _ => parts.join("; "),
    }
}

/// Noise levels of the batch plans but 0.
const LEVELS: [f64; 3] = [0.1, 0.2, 0.3];
/// Orders of the simulated remnant.
const ORDERS: [usize; 4] = [1, 2, 3, 4];
/// Orders of which ARX has poles enough.
const HIGHER: [usize; 3] = [2, 3, 4];
/// Delays of the batch plans, samples.
const DELAYS: [usize; 6] = [25, 26, 27, 28, 29, 30];
/// The simulated delay, samples.
const TRUE_DELAY: usize = 29;
/// Coefficients by the names of the text.
const DISCRETE: [&str; 4] = ["a1", "a2", "b0", "b1"];
/// Neuromuscular parameters.
const NMS: [&str; 2] = ["omega_nm", "zeta_nm"];

/// Cells of a plan: condition, order of the remnant, noise level.
#[derive(Debug, Clone, Copy)]
struct At {
    condition: &'static str,
    m0: usize,
    level: f64,
}

fn each(conditions: &[&'static str], orders: &[usize], levels: &[f64]) -> Vec<At> {
    let mut all = Vec::new();
    for condition in conditions {
        for m0 in orders {
            all.extend(levels.iter().map(|level| At {
                condition,
                m0: *m0,
                level: *level,
            }));
        }
    }
    all
}

/// The name of a quantity of models with F: what the text calls a1 and a2 is f1 and f2 there.
fn with_f(quantity: &str) -> String {
    match quantity
        .strip_suffix("a1")
        .map(|stem| (stem, "f1"))
        .or_else(|| quantity.strip_suffix("a2").map(|stem| (stem, "f2")))
    {
        Some((stem, coefficient)) => format!("{stem}{coefficient}"),
        None => quantity.to_owned(),
    }
}

impl At {
    fn query(self, quantity: &str) -> Query {
        Query::of(quantity)
            .condition(self.condition)
            .remnant_order(self.m0)
            .noise_level(self.level)
    }

    /// The batch fit of an ARX model.
    fn arx(self, quantity: &str, nk: usize) -> Query {
        self.query(quantity).name("ARX").nk(nk)
    }

    /// The batch fit of a Box-Jenkins model with m* and nk*.
    fn bj(self, quantity: &str, nd: usize, nk: usize) -> Query {
        self.query(&with_f(quantity)).name("BJ").nd(nd).nk(nk)
    }

    /// Recursive least squares.
    fn rls(self, quantity: &str) -> Query {
        self.query(quantity).name("RLS")
    }

    /// The recursive prediction-error method.
    fn rpem(self, quantity: &str) -> Query {
        self.query(&with_f(quantity)).name("RPEM")
    }

    fn label(self, more: &str) -> String {
        let comma = if more.is_empty() { "" } else { ", " };
        format!(
            "{}, m0 = {}, P_n = {}{comma}{more}",
            self.condition, self.m0, self.level
        )
    }
}

/// The relative bias of a parameter.
fn bias_of(parameter: &str) -> String {
    format!("bias_{parameter}")
}

#[cfg(test)]
mod tests;
