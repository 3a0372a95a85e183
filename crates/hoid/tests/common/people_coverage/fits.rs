//! The fits of a person, and their results for each quantity.

use std::time::Instant;

use hoid::{
    ident::family::{FamilyEstimator, FamilyFit, loop_measures},
    model::{FamilyOperator, Form, VerdictLevel, uncertainty::Estimate},
    sim::{SimError, people::Person},
};

use super::people::{Cell, Spread, simulate_person};

/// Frequencies at which the response is compared (rad/s): the band of manual control.
const BAND_RAD_S: [f64; 5] = [0.7, 1.3, 2.4, 4.3, 8.0];

/// Variant of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Variant {
    /// True if the recorded disturbance is used, which gives a fit at its lines.
    pub excitation: bool,
    /// True if the true form is given instead of selected.
    pub form_given: bool,
}

impl Variant {
    /// All four variants.
    pub const ALL: [Self; 4] = [
        Self::new(true, false),
        Self::new(false, false),
        Self::new(true, true),
        Self::new(false, true),
    ];

    const fn new(excitation: bool, form_given: bool) -> Self {
        Self { excitation, form_given }
    }

    pub fn name(self) -> &'static str {
        match (self.excitation, self.form_given) {
            (true, false) => "lines, form chosen",
            (false, false) => "no lines, form chosen",
            (true, true) => "lines, form given",
            (false, true) => "no lines, form given",
        }
    }
}

/// A quantity and its true value.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    pub name: String,
    pub truth: f64,
    pub value: f64,
    pub standard_error: Option<f64>,
    pub interval: Option<(f64, f64)>,
    pub prior_share: f64,
    pub determined: bool,
}

impl Quantity {
    /// True if the interval contains the true value; `None` without an interval.
    pub fn contains_truth(&self) -> Option<bool> {
        self.interval.map(|(low, high)| low <= self.truth && self.truth <= high)
    }
}

/// Result of a fit.
#[derive(Debug, Clone)]
pub struct FitOutcome {
    pub form: Form,
    pub level: VerdictLevel,
    /// Kinds of the findings.
    pub kinds: Vec<String>,
    /// Mean of |dY|/|Y| over the band.
    pub response_error: f64,
    pub inflation: f64,
    pub noise_order: usize,
    pub quantities: Vec<Quantity>,
}

/// A fit of a person.
#[derive(Debug, Clone)]
pub struct Outcome {
    pub person: u64,
    pub cell: Cell,
    pub variant: Variant,
    pub true_form: Form,
    pub seconds: f64,
    pub found: Result<FitOutcome, String>,
}

/// Returns the fits of one person.
///
/// # Errors
/// The errors of the simulation.
pub fn fit_person(seed: u64, number: u64, variants: &[Variant]) -> Result<Vec<Outcome>, SimError> {
    let (cell, person, records) = simulate_person(seed, number)?;
    let true_form = person.state.operator.form();
    let of = |&variant: &Variant| {
        let mut estimator = FamilyEstimator {
            excitation: variant.excitation.then(|| "d".to_owned()),
            ..FamilyEstimator::default()
        };
        if variant.form_given {
            estimator.forms = vec![true_form];
        }
        let start_time = Instant::now();
        let fit = estimator.fit(&records);
        Outcome {
            person: number,
            cell,
            variant,
            true_form,
            seconds: start_time.elapsed().as_secs_f64(),
            found: fit
                .map(|fit| fit_outcome(&fit, &person, cell))
                .map_err(|e| e.to_string()),
        }
    };
    Ok(variants.iter().map(of).collect())
}

fn fit_outcome(fit: &FamilyFit, person: &Person, cell: Cell) -> FitOutcome {
    let truth = &person.state.operator;
    let of = fit.operator(0);
    let named = truth.named_parameters();
    // The true values are those of the person. If the runs of a person differ, the standard errors for the person are
    // used.
    let of_person = cell.spread != Spread::None;
    let parameters = of.parameters.iter();
    let mut quantities: Vec<Quantity> = parameters
        .map(|p| if of_person { p.as_of_person() } else { p.clone() })
        .filter_map(|p| {
            let true_value = named.iter().find(|n| n.name == p.name)?.value;
            Some(Quantity {
                truth: true_value,
                value: p.value,
                standard_error: p.standard_error,
                interval: p.interval,
                prior_share: p.prior_share,
                determined: p.determined,
                name: p.name,
            })
        })
        .collect();
    let element = &person.state.controlled_element;
    let true_loop = loop_measures(truth, None, element, (fit.sample_time, fit.intersample));
    let own_loop = fit.loop_measures(0, element);
    let own_loop = own_loop.map(|own| if of_person { own.as_of_person() } else { own });
    if let (Some(true_loop), Some(own)) = (true_loop, own_loop) {
        let mut put = |name: &str, truth: Estimate, own: Estimate, interval: Option<(f64, f64)>| {
            let normal = own.standard_error.map(|s| (own.value - 1.96 * s, own.value + 1.96 * s));
            for (suffix, interval) in [("", interval), (" (1.96)", normal)] {
                quantities.push(Quantity {
                    name: format!("{name}{suffix}"),
                    truth: truth.value,
                    value: own.value,
                    standard_error: own.standard_error,
                    interval,
                    prior_share: 0.0,
                    determined: own.standard_error.is_some(),
                });
            }
        };
        put(
            "crossover",
            true_loop.crossover_rad_s,
            own.crossover_rad_s,
            own.crossover_interval,
        );
        put(
            "phase margin",
            true_loop.phase_margin_deg,
            own.phase_margin_deg,
            own.phase_margin_interval,
        );
    }
    FitOutcome {
        form: fit.form,
        level: fit.verdict.level,
        kinds: fit.verdict.findings().iter().map(|f| f.kind.to_string()).collect(),
        response_error: response_error(&of.operator, truth),
        inflation: fit.inflation,
        noise_order: fit.noise_orders.1,
        quantities,
    }
}

fn response_error(found: &FamilyOperator, truth: &FamilyOperator) -> f64 {
    let of = |omega: f64| {
        let own = truth.response(omega);
        (found.response(omega) - own).norm() / own.norm()
    };
    BAND_RAD_S.map(of).iter().sum::<f64>() / BAND_RAD_S.len() as f64
}
