//! Compares the errors that a design predicts for recorded people from one run with the scatter of their other runs.
//!
//! ```sh
//! HOID_HUMAN_DATA=DIR HOID_PILOT_DATA=DIR cargo run --release -p hoid-evidence --example recorded_design
//! ```
//!
//! A cell is a person with an element (and an axis). Each run is identified alone, with one form for each element and
//! without a prior. One run provides the person, the lines (Fourier coefficients of the recorded disturbance or target)
//! and the share of the remnant in the variance of u, which is the share at non-excited frequencies; `hoid design`
//! predicts the errors of a run of this length. The scatter is the standard deviation of the estimates of the other
//! runs, divided by `c_4 = 1 - 1/(4 (n - 1))`. It contains the person's variation from run to run, so it is also
//! compared with the error for the person, which includes the default variation [`RUN_TO_RUN_DEVIATION`]. This default
//! is the median, over the people with a disturbance, of the variation in the crossover, `sqrt(scatter^2 - error^2)`;
//! the pilots are an independent test. Quantities with an error above half of their value are excluded.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::{env, fs, path::Path};

use hoid::design::experiment::{EntryPoint, Forcing, RUN_TO_RUN_DEVIATION, Remnant, Task, expected};
use hoid_evidence::{
    pilots::{self, MEASUREMENT_START_S},
    task::median,
};
use hoid_ident::family::{FamilyEstimator, OperatorPrior};
use hoid_model::{
    Channel, Complex64, FamilyOperator, FamilyState, Form, Record, SampleTime,
    forcing::{ForcingFunction, Sinusoid},
};

const QUANTITIES: [&str; 4] = ["crossover", "phase_margin", "K", "tau_e"];

/// A run with the lines of its excitation.
struct Run {
    record: Record,
    lines: Vec<Sinusoid>,
    /// Share of the variance of u at non-excited frequencies.
    off_lines: f64,
}

/// Runs of a person with an element.
struct Cell {
    name: String,
    element: &'static str,
    form: Form,
    enters: EntryPoint,
    runs: Vec<Run>,
}

impl Run {
    /// Creates a run from a record over whole periods of these frequencies.
    fn new(record: Record, exciting: &[f64], omegas: &[f64]) -> Self {
        let ts = record.sample_time().s();
        let coefficient = |values: &[f64], omega: f64| -> Complex64 {
            let turned = |(k, v): (usize, &f64)| Complex64::from_polar(*v, -omega * ts * k as f64);
            let sum: Complex64 = values.iter().enumerate().map(turned).sum();
            sum * 2.0 / values.len() as f64
        };
        let line = |&omega: &f64| Sinusoid {
            amplitude_deg: coefficient(exciting, omega).norm(),
            omega_rad_s: omega,
            phase_rad: 0.0,
        };
        let u = record.output();
        let mean = u.iter().sum::<f64>() / u.len() as f64;
        let whole = u.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / u.len() as f64;
        let on: f64 = omegas.iter().map(|w| 0.5 * coefficient(u, *w).norm_sqr()).sum();
        Self {
            lines: omegas.iter().map(line).collect(),
            off_lines: 1.0 - on / whole,
            record,
        }
    }

    fn operator(&self, form: Form) -> Option<FamilyOperator> {
        let estimator = FamilyEstimator {
            forms: vec![form],
            prior: OperatorPrior::none(),
            ..FamilyEstimator::default()
        };
        let fit = estimator.fit(std::slice::from_ref(&self.record)).ok()?;
        Some(fit.operator(0).operator.clone())
    }
}

impl Cell {
    fn task(&self, operator: FamilyOperator, share: f64) -> Task {
        Task {
            state: FamilyState {
                operator,
                controlled_element: self.element.parse().unwrap(),
            },
            feedforward: None,
            remnant: Remnant {
                share,
                ..Remnant::default()
            },
        }
    }

    /// Prints the medians for each quantity, and returns the ratios of the scatter to both predictions and the
    /// variation from run to run, for each quantity and each run.
    fn ratios(&self) -> Vec<Vec<[f64; 3]>> {
        let fitted: Vec<Option<FamilyOperator>> = self.runs.iter().map(|run| run.operator(self.form)).collect();
        let values: Vec<Option<[f64; 4]>> = fitted
            .iter()
            .map(|o| Some(quantities(&self.state(o.as_ref()?))))
            .collect();
        let mut all = vec![Vec::new(); QUANTITIES.len()];
        for (k, (run, operator)) in self.runs.iter().zip(&fitted).enumerate() {
            let Some(operator) = operator else { continue };
            let task = self.task(operator.clone(), run.off_lines.clamp(0.01, 0.95));
            let forcing = Forcing::of(self.enters, &ForcingFunction::new(run.lines.clone()).unwrap());
            let length_s = run.record.len() as f64 * run.record.sample_time().s();
            let Ok(found) = expected(&task, &forcing, length_s) else {
                continue;
            };
            let found = found.with_run_to_run(RUN_TO_RUN_DEVIATION, 1);
            let others = values
                .iter()
                .enumerate()
                .filter(|(j, _)| *j != k)
                .filter_map(|(_, v)| *v);
            let others: Vec<[f64; 4]> = others.collect();
            for (q, ratios) in all.iter_mut().enumerate() {
                let name = match QUANTITIES[q] {
                    "K" if self.form == Form::Lead => "K_e",
                    name => name,
                };
                let one = found.quantity(name).unwrap();
                let (Some(error), Some(person)) = (one.estimate.standard_error, one.standard_error_person) else {
                    continue;
                };
                if error > 0.5 * one.estimate.value.abs() {
                    continue;
                }
                let scatter = deviation(others.iter().map(|v| v[q]).filter(|v| v.is_finite()).collect());
                let excess = (scatter.powi(2) - error.powi(2)) / one.size.powi(2);
                ratios.push([scatter / error, scatter / person, excess.signum() * excess.abs().sqrt()]);
            }
        }
        let share = median(self.runs.iter().map(|run| run.off_lines));
        print!("{:18} share of the remnant {share:.2}:", self.name);
        print_medians(&all);
        all
    }

    fn state(&self, operator: &FamilyOperator) -> FamilyState {
        self.task(operator.clone(), 0.2).state
    }
}

fn print_medians(all: &[Vec<[f64; 3]>]) {
    for (name, ratios) in QUANTITIES.iter().zip(all) {
        let [runs, person, variation] = [0, 1, 2].map(|part| median(ratios.iter().map(|r| r[part])));
        print!(
            "  {name} {runs:.2} ({person:.2}, variation {variation:.2}, n = {})",
            ratios.len()
        );
    }
    println!();
}

fn quantities(state: &FamilyState) -> [f64; 4] {
    let margins = state.margins().ok();
    let operator = &state.operator;
    [
        margins.as_ref().and_then(|m| m.crossover_rad_s).unwrap_or(f64::NAN),
        margins.as_ref().and_then(|m| m.phase_margin_deg).unwrap_or(f64::NAN),
        operator.coordinates()[0],
        operator.tau_e_s(),
    ]
}

fn deviation(values: Vec<f64>) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    square.sqrt() / (1.0 - 0.25 / (n - 1.0))
}

/// Returns the cells of the people with a disturbance: two periods of 20 s at 60 Hz, with u taken one row later.
fn people_cells(folder: &Path) -> Vec<Cell> {
    const PRIMES: [f64; 11] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0];
    let mut cells = Vec::new();
    for (kind, element, form, lines) in [("fo", "1/s", Form::Gain, 11), ("so", "1/(s(s+1))", Form::Lead, 7)] {
        for person in ["P03", "P05", "P09"] {
            let omegas: Vec<f64> = PRIMES[..lines]
                .iter()
                .map(|p| p * std::f64::consts::TAU / 20.0)
                .collect();
            let files = (3..=12).map(|k| folder.join(format!("{person}_{kind}_{k:02}_d_only.csv")));
            let runs = files.filter(|path| path.exists()).map(|path| {
                let text = fs::read_to_string(path).unwrap();
                let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
                let column = |name: &str, from: usize| -> Vec<f64> {
                    let index = header.iter().position(|h| *h == name).unwrap();
                    let rows = text.lines().skip(1 + from).take(2400);
                    rows.map(|row| row.split(',').nth(index).unwrap().parse().unwrap())
                        .collect()
                };
                let e: Vec<f64> = column("r", 300)
                    .iter()
                    .zip(column("y", 300))
                    .map(|(r, y)| r - y)
                    .collect();
                let signals = [("e", e), ("u", column("u", 301))];
                let [e, u] = signals.map(|(name, values)| Channel::new(name, "", values));
                let record = Record::new(SampleTime::new(1.0 / 60.0).unwrap(), e, u).unwrap();
                Run::new(record, &column("d", 300), &omegas)
            });
            cells.push(Cell {
                name: format!("{person} {kind}"),
                element,
                form,
                enters: EntryPoint::Disturbance,
                runs: runs.collect(),
            });
        }
    }
    cells
}

/// Returns the cells of the pilots without a change: one period of 81.92 s of a target, with the elements as
/// implemented.
fn pilot_cells(folder: &Path) -> Vec<Cell> {
    const LINES: [f64; 10] = [3.0, 5.0, 8.0, 13.0, 22.0, 34.0, 53.0, 86.0, 139.0, 229.0];
    let omegas = LINES.map(|m| m * std::f64::consts::TAU / 81.92);
    let mut cells = Vec::new();
    for (condition, element) in [("C1", "67.788/(s(s+5.423))"), ("C2", "20.886/(s(s+0.1671))")] {
        for pilot in ["A1", "A2", "A3"] {
            for axis in ["roll", "pitch"] {
                let runs = (1..=6).map(|k| {
                    let (record, first) = pilots::read(folder, &format!("{pilot}_{condition}_{axis}_{k}"));
                    assert!((record.time_s(first) - MEASUREMENT_START_S).abs() < 1e-6);
                    let record = record.span(record.time_s(first), record.time_s(first) + 81.92).unwrap();
                    let target = record.channel("r").unwrap().to_vec();
                    Run::new(record, &target, &omegas)
                });
                cells.push(Cell {
                    name: format!("{pilot} {condition} {axis}"),
                    element,
                    form: Form::Lead,
                    enters: EntryPoint::Target,
                    runs: runs.collect(),
                });
            }
        }
    }
    cells
}

fn main() {
    let human = env::var_os("HOID_HUMAN_DATA");
    if human.is_none() {
        println!("HOID_HUMAN_DATA does not name the folder of the recorded people");
    }
    let groups = [
        ("people", human.map(|folder| people_cells(Path::new(&folder)))),
        ("pilots", pilots::folder().map(|folder| pilot_cells(&folder))),
    ];
    println!("medians of scatter/error of the run (scatter/error for the person, variation from run to run)");
    for (name, cells) in groups {
        let mut all = vec![Vec::new(); QUANTITIES.len()];
        for cell in cells.into_iter().flatten() {
            for (all, own) in all.iter_mut().zip(cell.ratios()) {
                all.extend(own);
            }
        }
        print!("{name}, all runs:  ");
        print_medians(&all);
        let [runs, person] = [0, 1].map(|part| median(all.iter().flatten().map(|r| r[part])));
        println!("{name}, all quantities: {runs:.2} ({person:.2})");
    }
}
