//! The tables of `research/notes/comparison-tables.md`, from the results of the study:
//!
//! `hoid study run adaptation --out adaptation` and
//! `cargo run --release -p hoid-evidence --example adaptation_tables -- adaptation`
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::path::Path;

use hoid_study::{Query, Results, Statistics, SummaryRow};

const OPERATOR: [&str; 5] = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm"];
const LABELS: [&str; 5] = ["K_e", "T_L", "K_ė", "ω_nm", "ζ_nm"];
const ALL_CONDITIONS: [&str; 6] = ["C1", "C2", "C3", "C4", "C5", "C6"];
/// Other changes: name in the plan, heading on the page.
const OTHER_CHANGES: [(&str, &str); 4] = [
    ("slow", "slow: G = .2 1/s"),
    ("lead alone", "T_L alone: 1.2 to .8 s"),
    ("again and again", "C4, C6, and back every 10.24 s"),
    ("neuromuscular", "ω_nm to 8 rad/s, ζ_nm to .5"),
];
/// Delays that differ from the prior.
const DELAY_CHANGES: [(&str, &str); 3] = [
    ("delay alone", "C1, C2, τ_e to .34 s"),
    ("delay too", "C4, C6, τ_e to .34 s"),
    ("other delay", "C4, C6, τ_e .25 or .31 s"),
];
const PARAMETERS_WITH_DELAY: [&str; 6] = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm", "tau_e"];
/// Methods whose cells are all shown.
const SHOWN_METHODS: [&str; 5] = ["RLS", "RPEM", "physical", "multiple-model", "two-sided"];
const CHANGING_CONDITIONS: [&str; 4] = ["C3", "C4", "C5", "C6"];
const STEADY_CONDITIONS: [&str; 2] = ["C1", "C2"];

struct Tables {
    results: Results,
    names: Vec<String>,
}

fn main() {
    let directory = std::env::args().nth(1).unwrap_or_else(|| "adaptation".to_owned());
    let results = Results::read(Path::new(&directory)).unwrap();
    let mut tables = Tables {
        results,
        names: Vec::new(),
    };
    let every: Vec<String> = tables.results.plan.estimators.iter().map(|e| e.name.clone()).collect();
    let is_in_all = |name: &&String| !tables.rows("rms_K_e", "all", &ALL_CONDITIONS, name).is_empty();
    tables.names = every.iter().filter(is_in_all).cloned().collect();
    println!(
        "{} replications, seed {}\n",
        tables.results.plan.replications, tables.results.plan.seed
    );
    println!("## Errors\n");
    println!("Over the better of RLS and RPEM, C3 to C6: median cell (worst cell; cells above 1).\n");
    tables.print_ratios(&CHANGING_CONDITIONS);
    println!("C1 and C2, where nothing changes.\n");
    tables.print_ratios(&STEADY_CONDITIONS);
    tables.print_ratios_above_one();
    println!("## Bias and spread\n");
    tables.print_bias();
    println!("## Settling\n");
    tables.print_settling();
    println!("## Bands\n");
    tables.print_coverage();
    println!("## Detection\n");
    tables.print_detection();
    println!("## Other changes\n");
    tables.print_other_cases(&OTHER_CHANGES, &OPERATOR, &["multiple-model"]);
    println!("## Delays\n");
    let without_delay = std::mem::replace(&mut tables.names, every);
    tables.print_other_cases(
        &DELAY_CHANGES,
        &PARAMETERS_WITH_DELAY,
        &["multiple-model", "multiple-model, delay"],
    );
    tables.names = without_delay;
    println!("## All cells\n");
    tables.print_cells();
}

impl Tables {
    fn rows(&self, quantity: &str, scenario: &str, conditions: &[&str], name: &str) -> Vec<&SummaryRow> {
        let of = |condition: &&str| {
            let query = Query::of(quantity).scenario(scenario).condition(condition).name(name);
            self.results.find(&query)
        };
        conditions.iter().flat_map(of).collect()
    }

    fn medians(&self, quantity: &str, scenario: &str, conditions: &[&str], name: &str) -> Vec<f64> {
        let rows = self.rows(quantity, scenario, conditions, name);
        rows.iter().map(|row| row.statistics.median).collect()
    }

    /// Returns the ratios of median errors to those of the better of RLS and RPEM, cell by cell.
    fn relative_errors(&self, quantity: &str, conditions: &[&str], name: &str) -> Vec<f64> {
        let of = |name: &str| self.medians(quantity, "all", conditions, name);
        // A method without any convertible estimate is NaN, which min ignores.
        let better: Vec<f64> = of("RLS").iter().zip(of("RPEM")).map(|(a, b)| a.min(b)).collect();
        of(name)
            .iter()
            .zip(better)
            .map(|(error, better)| error / better)
            .collect()
    }

    fn print_ratios(&self, conditions: &[&str]) {
        print_header("method", &LABELS);
        for name in &self.names {
            let cell = |p: &&str| {
                let all = self.relative_errors(&format!("rms_{p}"), conditions, name);
                let worst = all.iter().copied().fold(f64::NAN, f64::max);
                // Tolerance for the rounding error of a ratio of equal numbers.
                let above = all.iter().filter(|r| **r > 1.0 + 1e-9).count();
                format!("{} ({}; {above})", format_short(median(&all)), format_short(worst))
            };
            print_line(name, OPERATOR.iter().map(cell));
        }
        println!();
    }

    fn print_bias(&self) {
        println!(
            "Median size over the cells of C3 to C6 of the median error before t_M ± its spread over the runs (interquartile range/1.349), %; then the same for the last ten seconds.\n"
        );
        for what in ["before", "after"] {
            print_header(what, &LABELS);
            for name in &self.names {
                let cell = |p: &&str| {
                    let rows = self.rows(&format!("{what}_{p}"), "all", &CHANGING_CONDITIONS, name);
                    let bias: Vec<f64> = rows.iter().map(|row| row.statistics.median.abs()).collect();
                    let spread = |row: &&SummaryRow| {
                        // Standard deviation of a normal sample, from its quartiles; a few diverged runs do not affect
                        // it.
                        (row.statistics.upper_quartile - row.statistics.lower_quartile) / 1.349
                    };
                    let spread: Vec<f64> = rows.iter().map(spread).collect();
                    format!("{} ± {}", format_short(median(&bias)), format_short(median(&spread)))
                };
                print_line(name, OPERATOR.iter().map(cell));
            }
            println!();
        }
    }

    fn print_settling(&self) {
        println!(
            "Seconds after t_M until half, and nine tenths, of the step of K_ė are covered: median run, median cell (worst cell).\n"
        );
        let groups: [(&str, &[&str], f64); 4] = [
            ("C4, C6, P_n ≤ .1", &["C4", "C6"], 0.1),
            ("C4, C6, all", &["C4", "C6"], 1.0),
            ("C3, C5, P_n ≤ .1", &["C3", "C5"], 0.1),
            ("C3, C5, all", &["C3", "C5"], 1.0),
        ];
        print_header("method", &groups.map(|g| g.0));
        for name in &self.names {
            let cell = |(_, conditions, most): &(&str, &[&str], f64)| {
                let of = |quantity: &str| -> (f64, f64) {
                    let rows = self.rows(quantity, "all", conditions, name);
                    let all: Vec<f64> = rows
                        .iter()
                        .filter(|row| row.noise_level <= *most)
                        .map(|row| row.statistics.median)
                        .collect();
                    (median(&all), all.iter().copied().fold(f64::NAN, f64::max))
                };
                let (half, most_of_it) = (of("settle50_K_e_dot"), of("settle90_K_e_dot"));
                format!("{:.2}, {:.2} ({:.2})", half.0, most_of_it.0, most_of_it.1)
            };
            print_line(name, groups.iter().map(cell));
        }
        println!();
    }

    fn print_coverage(&self) {
        println!(
            "Samples covered by 1.96 standard errors, %, median cell (least cell): after the start fit in all conditions; then within 5 s after t_M, C3 to C6.\n"
        );
        for (title, quantity, conditions) in [
            ("all", "covered", &ALL_CONDITIONS[..]),
            ("through the change", "covered_through", &CHANGING_CONDITIONS[..]),
        ] {
            print_header(title, &LABELS);
            for name in &self.names {
                let cell = |p: &&str| {
                    let rows = self.rows(&format!("{quantity}_{p}"), "all", conditions, name);
                    let means: Vec<f64> = rows.iter().map(|row| row.statistics.mean).collect();
                    let least = means.iter().copied().fold(f64::NAN, f64::min);
                    format!("{:.0} ({least:.0})", median(&means))
                };
                print_line(name, OPERATOR.iter().map(cell));
            }
            println!();
        }
    }

    /// Returns the declared changes of a method: false alarms, hours, detected changes in %, median delay in s.
    fn declared_changes(&self, name: &str, scenario: &str, conditions: &[&str]) -> [f64; 4] {
        let all = |quantity: &str| -> Vec<f64> {
            let of = |condition: &&str| {
                let query = Query::of(quantity).scenario(scenario).condition(condition).name(name);
                self.results.values(&query)
            };
            conditions.iter().flat_map(of).filter(|v| v.is_finite()).collect()
        };
        let found = all("found");
        [
            all("false_alarms").iter().sum(),
            all("hours").iter().sum(),
            found.iter().sum::<f64>() / found.len() as f64,
            median(&all("lag")),
        ]
    }

    fn print_detection(&self) {
        print_header(
            "condition",
            &["hours", "false alarms", "found within 5 s, %", "median lag, s"],
        );
        for conditions in [&STEADY_CONDITIONS[..], &["C4"], &["C6"], &["C3"], &["C5"]] {
            let [alarms, hours, found, lag] = self.declared_changes("multiple-model", "all", conditions);
            let cells = [
                format!("{hours:.2}"),
                format!("{alarms}"),
                format_if_finite(found, 0),
                format_if_finite(lag, 2),
            ];
            print_line(&conditions.join(", "), cells.into_iter());
        }
        println!();
    }

    /// Prints the errors of all methods in other cases, and the changes declared there.
    fn print_other_cases(&self, cases: &[(&str, &str)], quantities: &[&str], telling: &[&str]) {
        let titles: Vec<&str> = cases.iter().map(|(_, title)| *title).collect();
        println!(
            "RMS relative error in %, median cell of the median run: {}.\n",
            quantities.join(" / ")
        );
        print_header("method", &titles);
        for name in &self.names {
            let cell = |(scenario, _): &(&str, &str)| {
                let error = |p: &&str| {
                    format_short(median(&self.medians(
                        &format!("rms_{p}"),
                        scenario,
                        &ALL_CONDITIONS,
                        name,
                    )))
                };
                quantities.iter().map(error).collect::<Vec<_>>().join(" / ")
            };
            print_line(name, cases.iter().map(cell));
        }
        for name in telling {
            let cell = |(scenario, _): &(&str, &str)| {
                let [alarms, hours, found, lag] = self.declared_changes(name, scenario, &ALL_CONDITIONS);
                format!(
                    "{}, {} ({alarms} in {hours:.2} h)",
                    format_if_finite(found, 0),
                    format_if_finite(lag, 1)
                )
            };
            print_line(
                &format!("{name} declares: found, %, lag, s (false alarms)"),
                cases.iter().map(cell),
            );
        }
        println!();
        println!("Samples covered by 1.96 standard errors, %, median cell:\n");
        print_header("", &titles);
        for name in telling {
            let cell = |(scenario, _): &(&str, &str)| {
                let covered = |p: &&str| {
                    let rows = self.rows(&format!("covered_{p}"), scenario, &ALL_CONDITIONS, name);
                    let means: Vec<f64> = rows.iter().map(|row| row.statistics.mean).collect();
                    format_if_finite(median(&means), 0)
                };
                quantities.iter().map(covered).collect::<Vec<_>>().join(" / ")
            };
            print_line(name, cases.iter().map(cell));
        }
        println!();
    }

    /// Prints the errors of every cell of C1 to C6.
    fn print_cells(&self) {
        println!("RMS relative error in %, median run: K_e / T_L / K_ė / ω_nm / ζ_nm.\n");
        print_header("cell", &SHOWN_METHODS);
        for condition in ALL_CONDITIONS {
            let errors = SHOWN_METHODS
                .map(|name| OPERATOR.map(|p| self.medians(&format!("rms_{p}"), "all", &[condition], name)));
            let rows = self.rows("rms_K_e", "all", &[condition], "multiple-model");
            for (i, row) in rows.iter().enumerate() {
                let cell = |of: &[Vec<f64>; 5]| {
                    let each = of.iter().map(|e| e.get(i).map_or("-".to_owned(), |e| format_short(*e)));
                    each.collect::<Vec<_>>().join(" / ")
                };
                let name = format!("{condition} m₀ = {} P_n = {}", row.remnant_order, row.noise_level);
                print_line(&name, errors.iter().map(cell));
            }
        }
        println!();
    }

    /// Prints the cells in which multiple-model is worse than the better of RLS and RPEM.
    fn print_ratios_above_one(&self) {
        let mut cells = Vec::new();
        for (p, label) in OPERATOR.iter().zip(LABELS) {
            let quantity = format!("rms_{p}");
            let ratios = self.relative_errors(&quantity, &CHANGING_CONDITIONS, "multiple-model");
            let rows = self.rows(&quantity, "all", &CHANGING_CONDITIONS, "multiple-model");
            for (row, ratio) in rows.iter().zip(ratios).filter(|(_, ratio)| *ratio > 1.0) {
                let (m, p_n) = (row.remnant_order, row.noise_level);
                cells.push(format!(
                    "{label} in {} m₀ = {m} P_n = {p_n} ({ratio:.2})",
                    row.condition
                ));
            }
        }
        let cells = if cells.is_empty() {
            "none".to_owned()
        } else {
            cells.join("; ")
        };
        println!("Cells of C3 to C6 in which `multiple-model` is above 1: {cells}.\n");
    }
}

fn median(values: &[f64]) -> f64 {
    Statistics::of(values).median
}

fn print_header(first: &str, columns: &[&str]) {
    println!("| {first} | {} |", columns.join(" | "));
    println!("|---{}|", "|---".repeat(columns.len()));
}

fn print_line(name: &str, cells: impl Iterator<Item = String>) {
    println!("| {name} | {} |", cells.collect::<Vec<_>>().join(" | "));
}

/// Formats a number with two decimals below ten and none above a hundred.
fn format_short(value: f64) -> String {
    match value.abs() {
        v if v > 999.0 => ">999".to_owned(),
        v if v >= 100.0 => format!("{value:.0}"),
        v if v >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}

fn format_if_finite(value: f64, digits: usize) -> String {
    if value.is_finite() {
        format!("{value:.digits$}")
    } else {
        String::new()
    }
}
