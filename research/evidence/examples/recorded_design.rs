//! Errors that a design predicts for recorded people from one run, compared with the scatter of their other runs.
//!
//! ```sh
//! HOID_HUMAN_DATA=DIR HOID_PILOT_DATA=DIR cargo run --release -p hoid-evidence --example recorded_design
//! ```
//!
//! A cell is a person with an element (and an axis). Each run is identified alone, with one form for each element. One
//! run gives the operator, the lines (Fourier coefficients of the recorded disturbance or target) and the remnant, its
//! share of the variance of u at non-excited frequencies; from these `hoid design` predicts the errors of a run of this
//! length. The scatter is the standard deviation of the estimates of the other runs, which contains the person's
//! variation from run to run. It is therefore also compared with `sqrt(error^2 + w^2)`, where w is 13 % of each
//! quantity (for the margin, as if the gain varied). This is the median variation of the gain of the people with a
//! disturbance, so the pilots are an independent test. The standard deviation of n values is divided by its expectation
//! relative to the true value, `c_4 = 1 - 1/(4 (n - 1))`.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::{env, fs, path::Path};

use hoid::design::experiment::{Enters, Expected, Forcing, Remnant, Task, expected};
use hoid_evidence::{
    pilots::{self, FROM_S},
    task::median,
};
use hoid_ident::family::FamilyEstimator;
use hoid_model::{
    Channel, Complex64, FamilyOperator, FamilyState, Form, Record, SampleTime,
    forcing::{ForcingFunction, Sinusoid},
};

const QUANTITIES: [&str; 4] = ["crossover", "phase_margin", "K", "tau_e"];

/// Variation from run to run, relative to the quantity.
const RUN_TO_RUN: f64 = 0.13;

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
    enters: Enters,
    runs: Vec<Run>,
}

impl Run {
    /// Builds the run from a record, over whole periods of these frequencies.
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

    /// Prints ratios of scatter to prediction, and returns the ratios of all quantities, without and with the variation
    /// from run to run.
    fn ratios(&self) -> Vec<[f64; 2]> {
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
            let others = values
                .iter()
                .enumerate()
                .filter(|(j, _)| *j != k)
                .filter_map(|(_, v)| *v);
            let others: Vec<[f64; 4]> = others.collect();
            let varied = self.run_to_run(operator);
            for (q, ratios) in all.iter_mut().enumerate() {
                let error = error_of(&found, QUANTITIES[q], self.form);
                let scatter = deviation(others.iter().map(|v| v[q]).filter(|v| v.is_finite()).collect());
                ratios.push([scatter / error, scatter / error.hypot(varied[q])]);
            }
        }
        let share = median(self.runs.iter().map(|run| run.off_lines));
        print!(
            "{:18} {:2} runs, share of the remnant {share:.2}:",
            self.name,
            all[0].len()
        );
        for (name, ratios) in QUANTITIES.iter().zip(&all) {
            let of = |part: usize| median(ratios.iter().map(|r| r[part]));
            print!("  {name} {:.2} ({:.2})", of(0), of(1));
        }
        println!();
        all.concat()
    }

    fn state(&self, operator: &FamilyOperator) -> FamilyState {
        self.task(operator.clone(), 0.2).state
    }

    /// Returns the standard deviations caused by the variation of gain and delay from run to run.
    fn run_to_run(&self, operator: &FamilyOperator) -> [f64; 4] {
        let own = quantities(&self.state(operator));
        let mut coordinates = operator.coordinates().to_vec();
        coordinates[0] *= 1.0 + RUN_TO_RUN;
        let more = FamilyOperator::new(operator.form(), operator.has_neuromuscular(), &coordinates).unwrap();
        let more = quantities(&self.state(&more));
        [
            RUN_TO_RUN * own[0],
            (more[1] - own[1]).abs(),
            RUN_TO_RUN * own[2],
            RUN_TO_RUN * own[3],
        ]
    }
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

fn error_of(found: &Expected, name: &str, form: Form) -> f64 {
    let name = if name == "K" && form == Form::Lead { "K_e" } else { name };
    found.estimate(name).and_then(|e| e.standard_error).unwrap_or(f64::NAN)
}

fn deviation(values: Vec<f64>) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    square.sqrt() / (1.0 - 0.25 / (n - 1.0))
}

/// Returns the people with a disturbance: two periods of 20 s at 60 Hz, u one row later.
fn people(folder: &Path) -> Vec<Cell> {
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
                    let place = header.iter().position(|h| *h == name).unwrap();
                    let rows = text.lines().skip(1 + from).take(2400);
                    rows.map(|row| row.split(',').nth(place).unwrap().parse().unwrap())
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
                enters: Enters::Disturbance,
                runs: runs.collect(),
            });
        }
    }
    cells
}

/// Returns the pilots without a change: one period of 81.92 s of a target, with the elements as they ran.
fn pilots_of(folder: &Path) -> Vec<Cell> {
    const LINES: [f64; 10] = [3.0, 5.0, 8.0, 13.0, 22.0, 34.0, 53.0, 86.0, 139.0, 229.0];
    let omegas = LINES.map(|m| m * std::f64::consts::TAU / 81.92);
    let mut cells = Vec::new();
    for (condition, element) in [("C1", "67.788/(s(s+5.423))"), ("C2", "20.886/(s(s+0.1671))")] {
        for pilot in ["A1", "A2", "A3"] {
            for axis in ["roll", "pitch"] {
                let runs = (1..=6).map(|k| {
                    let (record, first) = pilots::read(folder, &format!("{pilot}_{condition}_{axis}_{k}"));
                    assert!((record.time_s(first) - FROM_S).abs() < 1e-6);
                    let record = record.span(record.time_s(first), record.time_s(first) + 81.92).unwrap();
                    let target = record.channel("r").unwrap().to_vec();
                    Run::new(record, &target, &omegas)
                });
                cells.push(Cell {
                    name: format!("{pilot} {condition} {axis}"),
                    element,
                    form: Form::Lead,
                    enters: Enters::Target,
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
        ("people", human.map(|folder| people(Path::new(&folder)))),
        ("pilots", pilots::folder().map(|folder| pilots_of(&folder))),
    ];
    for (name, cells) in groups {
        let all: Vec<[f64; 2]> = cells.into_iter().flatten().flat_map(|cell| cell.ratios()).collect();
        let of = |part: usize| median(all.iter().map(|r| r[part]));
        println!(
            "{name}: scatter/predicted {:.2} in the median, {:.2} with the variation from run to run",
            of(0),
            of(1)
        );
    }
}
