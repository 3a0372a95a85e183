//! Selection of orders and delay.
//!
//! Every combination of the given ranges is fitted on the same samples: the residuals of all candidates start at the
//! first sample that is possible for every candidate. A criterion selects the best candidate. The loss is a valid
//! criterion only if the candidates differ only in the delay; BIC can also compare different numbers of parameters. The
//! selected model is fitted again on all samples available for its own orders, and its error bars include the
//! uncertainty of a delay found by the search (`searched_delay.rs`).

use std::{collections::BTreeMap, fmt, ops::RangeInclusive};

use hoid_model::{MAX_DELAY, MAX_ORDER, Orders, Record, Structure};
use rayon::prelude::*;

use crate::{Estimator, Fit, IdentError, SearchOptions, criterion::first_residual};

/// Maximum number of candidates in a search; the fit of each candidate takes a few milliseconds.
pub const MAX_CANDIDATES: usize = 100_000;

/// Ranges of the orders and of the delay.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OrderRanges {
    /// Number of coefficients of A.
    pub na: RangeInclusive<usize>,
    /// Number of coefficients of B.
    pub nb: RangeInclusive<usize>,
    /// Number of coefficients of C.
    pub nc: RangeInclusive<usize>,
    /// Number of coefficients of D.
    pub nd: RangeInclusive<usize>,
    /// Number of coefficients of F.
    pub nf: RangeInclusive<usize>,
    /// Delay of b0 in samples.
    pub nk: RangeInclusive<usize>,
}

/// Range of each order by its name: na, nb, nc, nd, nf or nk.
pub type NamedOrders = BTreeMap<String, RangeInclusive<usize>>;

/// Returns an error if no order has this name, or if the range exceeds the largest possible order or delay.
///
/// # Errors
/// [`IdentError::BadOption`].
pub fn check_order(name: &str, range: &RangeInclusive<usize>) -> Result<(), IdentError> {
    let bad = |found: String, expected: String| IdentError::BadOption {
        option: if name == "nk" { "nk" } else { "orders" }.to_owned(),
        found,
        expected,
    };
    let most = match name {
        "nk" => MAX_DELAY,
        "na" | "nb" | "nc" | "nd" | "nf" => MAX_ORDER,
        _ => return Err(bad(name.to_owned(), "na, nb, nc, nd, nf or nk".to_owned())),
    };
    match *range.end() <= most {
        true => Ok(()),
        false => Err(bad(
            format!("{name} = {}", range.end()),
            format!("at most {most}; give a smaller number or range"),
        )),
    }
}

/// Formats a range as on the command line: `2` or `1..4`.
pub(crate) fn range_text(range: &RangeInclusive<usize>) -> String {
    match (*range.start(), *range.end()) {
        (low, high) if low == high => low.to_string(),
        (low, high) => format!("{low}..{high}"),
    }
}

impl From<Orders> for OrderRanges {
    fn from(o: Orders) -> Self {
        let one = |n: usize| n..=n;
        Self {
            na: one(o.na),
            nb: one(o.nb),
            nc: one(o.nc),
            nd: one(o.nd),
            nf: one(o.nf),
            nk: one(o.nk),
        }
    }
}

impl fmt::Display for OrderRanges {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for (name, range) in self.named_ranges() {
            match (*range.start(), *range.end()) {
                (0, 0) if name != "nk" || *self.nb.end() == 0 => continue,
                _ => write!(f, "{separator}{name}={}", range_text(range))?,
            }
            separator = ", ";
        }
        Ok(())
    }
}

impl OrderRanges {
    fn named_ranges(&self) -> [(&'static str, &RangeInclusive<usize>); 6] {
        [
            ("na", &self.na),
            ("nb", &self.nb),
            ("nc", &self.nc),
            ("nd", &self.nd),
            ("nf", &self.nf),
            ("nk", &self.nk),
        ]
    }

    /// Returns the ranges with the named orders replaced.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for a name that is not an order.
    pub fn with_named_orders(mut self, named: &NamedOrders) -> Result<Self, IdentError> {
        for (name, range) in named {
            let place = match name.as_str() {
                "na" => &mut self.na,
                "nb" => &mut self.nb,
                "nc" => &mut self.nc,
                "nd" => &mut self.nd,
                "nf" => &mut self.nf,
                "nk" => &mut self.nk,
                _ => {
                    return Err(IdentError::BadOption {
                        option: "orders".to_owned(),
                        found: name.clone(),
                        expected: "na, nb, nc, nd, nf or nk".to_owned(),
                    });
                }
            };
            *place = range.clone();
        }
        Ok(self)
    }

    /// Returns the number of combinations.
    ///
    /// # Errors
    /// [`IdentError::EmptyRange`] if a range is empty, [`IdentError::BadOption`] for more than [`MAX_CANDIDATES`].
    pub fn candidate_count(&self) -> Result<usize, IdentError> {
        if let Some((name, range)) = self.named_ranges().into_iter().find(|(_, r)| r.is_empty()) {
            return Err(IdentError::EmptyRange {
                range: format!("{name}={}..{}", range.start(), range.end()),
            });
        }
        let numbers = self
            .named_ranges()
            .map(|(_, range)| *range.end() as f64 - *range.start() as f64 + 1.0);
        let all: f64 = numbers.iter().product();
        if all > MAX_CANDIDATES as f64 {
            return Err(IdentError::BadOption {
                option: "the search over orders and delay".to_owned(),
                found: format!("{all} candidates ({self})"),
                expected: format!("at most {MAX_CANDIDATES} candidates: narrow --nk and --orders"),
            });
        }
        Ok(all as usize)
    }

    /// Returns all combinations, with the delay varying fastest.
    ///
    /// # Errors
    /// Same as [`OrderRanges::candidate_count`].
    pub fn combinations(&self) -> Result<Vec<Orders>, IdentError> {
        self.candidate_count()?;
        let mut all = vec![Orders::default()];
        let mut vary = |range: &RangeInclusive<usize>, set: fn(&mut Orders, usize)| {
            all = all
                .iter()
                .flat_map(|o| {
                    range.clone().map(move |n| {
                        let mut next = *o;
                        set(&mut next, n);
                        next
                    })
                })
                .collect();
        };
        vary(&self.na, |o, n| o.na = n);
        vary(&self.nb, |o, n| o.nb = n);
        vary(&self.nc, |o, n| o.nc = n);
        vary(&self.nd, |o, n| o.nd = n);
        vary(&self.nf, |o, n| o.nf = n);
        vary(&self.nk, |o, n| o.nk = n);
        Ok(all)
    }
}

/// Criterion that selects among candidates; the smallest value is best.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum Criterion {
    /// The loss, valid only for candidates with the same number of parameters.
    Loss,
    /// Akaike's criterion.
    Aic,
    /// Akaike's criterion with the correction for short records.
    Aicc,
    /// Schwarz's (Bayesian) criterion.
    #[default]
    Bic,
    /// Akaike's final prediction error.
    Fpe,
    /// Rissanen's minimum description length.
    Mdl,
    /// Young's criterion, which weighs the fit against the relative errors of the coefficients.
    Yic,
}

hoid_model::named_choice!(Criterion, "criterion", 7, {
    Loss => "loss", Aic => "aic", Aicc => "aicc", Bic => "bic", Fpe => "fpe", Mdl => "mdl", Yic => "yic",
});

impl Criterion {
    /// Returns the name of the criterion for printed output.
    pub fn label(self) -> &'static str {
        match self {
            Self::Loss => "loss",
            Self::Aic => "AIC",
            Self::Aicc => "AICc",
            Self::Bic => "BIC",
            Self::Fpe => "FPE",
            Self::Mdl => "MDL",
            Self::Yic => "YIC",
        }
    }
}

/// One candidate of a search.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Candidate {
    /// Orders of the candidate.
    pub orders: Orders,
    /// Criteria of the candidate, or the reason why it could not be fitted.
    pub outcome: Result<CandidateFigures, String>,
}

/// Criteria of a candidate, computed on the samples common to all candidates.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CandidateFigures {
    /// Loss V.
    pub loss: f64,
    /// Akaike's criterion.
    pub aic: f64,
    /// Akaike's criterion with the correction for short records.
    pub aicc: f64,
    /// Schwarz's (Bayesian) criterion.
    pub bic: f64,
    /// Akaike's final prediction error.
    pub fpe: f64,
    /// Rissanen's minimum description length.
    pub mdl: f64,
    /// Young's criterion; `None` without standard errors.
    pub yic: Option<f64>,
    /// Number of residuals, the same for all candidates.
    pub residuals: usize,
    /// True if the search reached a minimum.
    pub converged: bool,
}

impl CandidateFigures {
    fn of(fit: &Fit) -> Self {
        Self {
            loss: fit.loss(),
            aic: fit.aic(),
            aicc: fit.aicc(),
            bic: fit.bic(),
            fpe: fit.fpe(),
            mdl: fit.mdl(),
            yic: fit.yic(),
            residuals: fit.residual_count(),
            converged: fit.termination().converged(),
        }
    }

    /// Returns the value of a criterion for the candidate.
    pub fn value(&self, criterion: Criterion) -> f64 {
        match criterion {
            Criterion::Loss => self.loss,
            Criterion::Aic => self.aic,
            Criterion::Aicc => self.aicc,
            Criterion::Bic => self.bic,
            Criterion::Fpe => self.fpe,
            Criterion::Mdl => self.mdl,
            Criterion::Yic => self.yic.unwrap_or(f64::INFINITY),
        }
    }
}

/// The fit of the selected model, with a table of all candidates.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Choice {
    /// The selected model, fitted on all samples available for its orders.
    pub fit: Fit,
    /// All candidates in the order of [`OrderRanges::combinations`].
    pub candidates: Vec<Candidate>,
    /// Criterion that selected the model.
    pub criterion: Criterion,
}

/// Identifies a person with a Box-Jenkins model, like `hoid identify --structure bj`: the delay is searched over 0.05
/// to 0.6 s and nd over 1 to 4, and BIC selects among the candidates.
///
/// # Errors
/// Same as [`choose_orders`]; [`IdentError::NoRecords`] without a record.
pub fn identify_box_jenkins(records: &[Record]) -> Result<Choice, IdentError> {
    let structure = Structure::BoxJenkins;
    let first = records.first().ok_or(IdentError::NoRecords)?;
    let ranges = default_operator_ranges(structure, first.sample_time());
    let template = Estimator::new(structure, structure.operator_orders(1));
    choose_orders(&template, &ranges, Criterion::Bic, records)
}

/// Fits every combination of orders and returns the best fit. `template` contains the options; its orders and its start
/// are not used.
///
/// # Errors
/// [`IdentError::EmptyRange`]; the error of the first candidate if none could be fitted.
pub fn choose_orders(
    template: &Estimator,
    ranges: &OrderRanges,
    criterion: Criterion,
    records: &[Record],
) -> Result<Choice, IdentError> {
    choose_orders_with(template, ranges, criterion, records, &|| {})
}

/// Like [`choose_orders`], but also calls `each` after every candidate, possibly from other threads, to report the
/// progress of a long search.
///
/// # Errors
/// Same as [`choose_orders`].
pub fn choose_orders_with(
    template: &Estimator,
    ranges: &OrderRanges,
    criterion: Criterion,
    records: &[Record],
    each: &(dyn Fn() + Sync),
) -> Result<Choice, IdentError> {
    let combinations = ranges.combinations()?;
    for orders in &combinations {
        orders.check(template.structure)?;
    }
    let first = combinations
        .iter()
        .map(|o| first_residual(o, template.effective_initial_state()))
        .max()
        .unwrap_or(0);
    // A ranking of candidates does not need the full accuracy of the loss; the selected model is fitted again with full
    // accuracy.
    let quick = Estimator {
        search: SearchOptions {
            tolerance: template.search.tolerance.max(1e-8),
            max_iterations: template.search.max_iterations.min(50),
            ..template.search
        },
        starts: 1,
        ..template.clone()
    };
    // Candidates that differ only in the delay are fitted in blocks of consecutive delays: each fit starts from the
    // result for the previous delay in the block. The blocks do not depend on the number of threads and the results are
    // collected by index, so the table does not depend on the number of threads either.
    let delays = ranges.nk.clone().count();
    let blocks: Vec<&[Orders]> = combinations
        .chunks(delays)
        .flat_map(|row| row.chunks(DELAYS_PER_BLOCK))
        .collect();
    let (candidates, errors): (Vec<Candidate>, Vec<Option<IdentError>>) = blocks
        .into_par_iter()
        .flat_map_iter(|block| fit_neighbours(&quick, block, records, first, each))
        .unzip();
    let best = candidates
        .iter()
        .filter_map(|c| c.outcome.as_ref().ok().map(|f| (c.orders, f.value(criterion))))
        .min_by(|a, b| a.1.total_cmp(&b.1));
    let orders = match best {
        Some((orders, _)) => orders,
        None => {
            let reason = errors.into_iter().flatten().next();
            return Err(reason.unwrap_or(IdentError::NoFiniteLoss));
        }
    };
    Ok(Choice {
        fit: template
            .with_orders(orders)
            .fit(records)?
            .with_searched_delay(records, delays),
        candidates,
        criterion,
    })
}

/// Number of delays in a block; within a block, each fit starts from the result for the previous delay.
const DELAYS_PER_BLOCK: usize = 12;

/// Fits candidates that differ only in the delay. Each search starts from the coefficients of the previous fit; if it
/// does not converge, it is repeated with automatic starts.
fn fit_neighbours(
    quick: &Estimator,
    block: &[Orders],
    records: &[Record],
    first: usize,
    each: &(dyn Fn() + Sync),
) -> Vec<(Candidate, Option<IdentError>)> {
    let mut neighbour: Option<Vec<f64>> = None;
    block
        .iter()
        .map(|&orders| {
            let own = quick.with_orders(orders);
            let from_neighbour = neighbour.take().and_then(|theta| {
                let fit = Estimator {
                    start: Some(theta),
                    ..own.clone()
                }
                .fit_from(records, first);
                fit.ok().filter(|fit| fit.termination().converged())
            });
            let fit = from_neighbour.map_or_else(|| own.fit_from(records, first), Ok);
            neighbour = fit.as_ref().ok().map(|fit| fit.model().theta().to_vec());
            each();
            let outcome = fit.as_ref().map(CandidateFigures::of).map_err(IdentError::to_string);
            (Candidate { orders, outcome }, fit.err())
        })
        .collect()
}

/// Returns the fit if the ranges contain only one model; otherwise the best fit with the table of candidates.
/// `template` contains the options; its start is used only for a single model.
///
/// # Errors
/// The errors of [`Estimator::fit`] and [`choose_orders`]; [`IdentError::BadStart`] if `template` has a start but
/// several models are compared.
pub fn fit_or_choose(
    template: &Estimator,
    ranges: &OrderRanges,
    criterion: Criterion,
    records: &[Record],
    each: &(dyn Fn() + Sync),
) -> Result<(Fit, Option<Choice>), IdentError> {
    let combinations = ranges.combinations()?;
    if let [orders] = combinations.as_slice() {
        let estimator = Estimator {
            orders: *orders,
            ..template.clone()
        };
        return Ok((estimator.fit(records)?, None));
    }
    if template.start.is_some() {
        return Err(IdentError::BadStart {
            reason: "a start applies to a single model, but a range of orders or delays is searched; give nk and the \
                     orders as single numbers"
                .to_owned(),
        });
    }
    let choice = choose_orders_with(template, ranges, criterion, records, each)?;
    Ok((choice.fit.clone(), Some(choice)))
}

impl Choice {
    /// Returns the smallest and the largest delay nk that the data do not distinguish from the best delay at the
    /// selected orders: `n ln(V/V_min) <= 3.84`, the 95 % point of chi-square with one degree of freedom. This profile
    /// likelihood interval is coarse if one sample of delay changes the loss much, since nk is an integer. `None` if
    /// fewer than two delays were fitted.
    pub fn delay_interval(&self) -> Option<(usize, usize)> {
        let chosen = self.fit.orders();
        let profile: Vec<(usize, f64, usize)> = self
            .candidates
            .iter()
            .filter(|c| {
                Orders {
                    nk: chosen.nk,
                    ..c.orders
                } == chosen
            })
            .filter_map(|c| c.outcome.as_ref().ok().map(|f| (c.orders.nk, f.loss, f.residuals)))
            .collect();
        let smallest = profile.iter().map(|p| p.1).reduce(f64::min)?;
        let inside = || {
            profile
                .iter()
                .filter(|(_, loss, n)| *n as f64 * (loss / smallest).ln() <= CHI_SQUARE_95)
                .map(|p| p.0)
        };
        (profile.len() > 1).then_some((inside().min()?, inside().max()?))
    }
}

/// 95 % point of chi-square with one degree of freedom.
const CHI_SQUARE_95: f64 = 3.841_458_820_694_124;

/// Returns the default range of nk in samples, which covers the delays of human operators, 0.05 to 0.6 s.
pub fn default_delay_range(sample_time: hoid_model::SampleTime) -> RangeInclusive<usize> {
    // tau_e = (nk - 1) Ts.
    sample_time.nk(0.05)..=sample_time.nk(0.6)
}

/// Returns the orders that represent an operator, with the default ranges of the command line: nk is searched if there
/// is an input, and for Box-Jenkins also nd from 1 to 4.
pub fn default_operator_ranges(structure: Structure, sample_time: hoid_model::SampleTime) -> OrderRanges {
    let mut ranges = OrderRanges::from(structure.operator_orders(1));
    if structure.has_input() {
        ranges.nk = default_delay_range(sample_time);
    }
    if structure == Structure::BoxJenkins {
        ranges.nd = 1..=4;
    }
    ranges
}

#[cfg(test)]
mod tests {
    use hoid_model::SampleTime;

    use super::*;

    #[test]
    fn number_of_order_combinations_is_limited() {
        let one = OrderRanges::from(Structure::BoxJenkins.operator_orders(29));
        for ranges in [
            OrderRanges {
                nk: 0..=usize::MAX,
                ..one.clone()
            },
            OrderRanges {
                na: 0..=64,
                nb: 0..=64,
                nc: 0..=64,
                nd: 0..=64,
                nf: 0..=64,
                nk: 0..=64,
            },
        ] {
            let message = ranges.combinations().unwrap_err().to_string();
            assert!(message.contains("at most 100000"), "{message}");
        }
        let most = OrderRanges { nk: 1..=100_000, ..one };
        assert_eq!(most.candidate_count(), Ok(100_000));
    }

    #[test]
    fn all_combinations_are_listed_and_empty_ranges_refused() {
        let mut ranges = OrderRanges::from(Structure::BoxJenkins.operator_orders(29));
        assert_eq!(
            ranges.combinations().unwrap(),
            [Structure::BoxJenkins.operator_orders(29)]
        );
        ranges.nk = 27..=30;
        ranges.nd = 1..=3;
        let all = ranges.combinations().unwrap();
        assert_eq!(all.len(), 12);
        assert_eq!(
            (all[0].nd, all[0].nk, all[1].nk, all[11].nd, all[11].nk),
            (1, 27, 28, 3, 30)
        );
        ranges.nk = RangeInclusive::new(5, 4);
        assert!(matches!(ranges.combinations(), Err(IdentError::EmptyRange { range }) if range == "nk=5..4"));
    }

    #[test]
    fn default_delay_range_covers_human_delays() {
        assert_eq!(default_delay_range(SampleTime::new(0.01).unwrap()), 6..=61);
        assert_eq!(default_delay_range(SampleTime::new(1.0 / 60.0).unwrap()), 4..=37);
    }
}
