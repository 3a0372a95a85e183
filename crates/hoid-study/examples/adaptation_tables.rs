//! The tables of the page "A person who changes, compared" of the book, from the results of the study:
//!
//! `hoid study run adaptation --out adaptation` and `cargo run --release -p hoid-study --example adaptation_tables -- adaptation`
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::path::Path;

use hoid_study::{Query, Results, Statistics, SummaryRow};

const OPERATOR: [&str; 5] = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm"];
const CHANGING: [&str; 4] = ["C3", "C4", "C5", "C6"];
const STEADY: [&str; 2] = ["C1", "C2"];

struct Tables {
    results: Results,
    names: Vec<String>,
}

fn main() {
    let directory = std::env::args().nth(1).unwrap_or_else(|| "adaptation".to_owned());
    let results = Results::read(Path::new(&directory)).unwrap();
    let names = results.plan.estimators.iter().map(|e| e.name.clone()).collect();
    let tables = Tables { results, names };
    println!("{} replications\n", tables.results.plan.replications);
    for (title, conditions) in [("C3 to C6", &CHANGING[..]), ("C1 and C2", &STEADY[..])] {
        tables.ratios(title, conditions);
    }
    tables.bias();
    tables.settling();
    tables.coverage();
    tables.declared("all", &STEADY);
    tables.declared("all", &CHANGING);
    for scenario in ["slow", "lead alone", "again and again", "neuromuscular", "other delay"] {
        tables.elsewhere(scenario);
    }
    tables.above_one();
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

    /// Median errors over the better of RLS and RPEM, cell by cell.
    fn relative(&self, quantity: &str, conditions: &[&str], name: &str) -> Vec<f64> {
        let of = |name: &str| self.medians(quantity, "all", conditions, name);
        // A method without a single convertible estimate is no number, which min leaves out.
        let better: Vec<f64> = of("RLS").iter().zip(of("RPEM")).map(|(a, b)| a.min(b)).collect();
        of(name)
            .iter()
            .zip(better)
            .map(|(error, better)| error / better)
            .collect()
    }

    fn ratios(&self, title: &str, conditions: &[&str]) {
        println!("Error over the better of RLS and RPEM, {title}: median cell (worst cell; cells above 1)\n");
        header("method", &OPERATOR);
        for name in &self.names {
            let cell = |p: &&str| {
                let all = self.relative(&format!("rms_{p}"), conditions, name);
                let worst = all.iter().copied().fold(f64::NAN, f64::max);
                // Rounding of a ratio of equal numbers.
                let above = all.iter().filter(|r| **r > 1.0 + 1e-9).count();
                format!("{} ({}; {above})", short(median(&all)), short(worst))
            };
            line(name, OPERATOR.iter().map(cell));
        }
        println!();
    }

    fn bias(&self) {
        println!(
            "Bias before and after the change, and spread over the replications, C3 to C6, %: median cell of the sizes\n"
        );
        for what in ["before", "after"] {
            header(what, &OPERATOR);
            for name in &self.names {
                let cell = |p: &&str| {
                    let rows = self.rows(&format!("{what}_{p}"), "all", &CHANGING, name);
                    let bias: Vec<f64> = rows.iter().map(|row| row.statistics.median.abs()).collect();
                    let spread = |row: &&SummaryRow| {
                        // Of a normal sample the standard deviation; a few that diverged do not count.
                        (row.statistics.upper_quartile - row.statistics.lower_quartile) / 1.349
                    };
                    let spread: Vec<f64> = rows.iter().map(spread).collect();
                    format!("{} ± {}", short(median(&bias)), short(median(&spread)))
                };
                line(name, OPERATOR.iter().map(cell));
            }
            println!();
        }
    }

    fn settling(&self) {
        println!(
            "Seconds after t_M until half, and nine tenths, of the step of K_e_dot are covered: median run, median cell (worst cell)\n"
        );
        let groups: [(&str, &[&str], f64); 4] = [
            ("C4, C6, P_n up to .1", &["C4", "C6"], 0.1),
            ("C4, C6, all", &["C4", "C6"], 1.0),
            ("C3, C5, P_n up to .1", &["C3", "C5"], 0.1),
            ("C3, C5, all", &["C3", "C5"], 1.0),
        ];
        header("method", &groups.map(|g| g.0));
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
            line(name, groups.iter().map(cell));
        }
        println!();
    }

    fn coverage(&self) {
        for (title, quantity, conditions) in [
            (
                "after the start fit, all conditions",
                "covered",
                &["C1", "C2", "C3", "C4", "C5", "C6"][..],
            ),
            ("within 5 s after t_M, C3 to C6", "covered_through", &CHANGING[..]),
        ] {
            println!("Covered by 1.96 standard errors, {title}, %: median cell (least cell)\n");
            header("method", &OPERATOR);
            for name in &self.names {
                let cell = |p: &&str| {
                    let rows = self.rows(&format!("{quantity}_{p}"), "all", conditions, name);
                    let means: Vec<f64> = rows.iter().map(|row| row.statistics.mean).collect();
                    let least = means.iter().copied().fold(f64::NAN, f64::min);
                    format!("{:.0} ({least:.0})", median(&means))
                };
                line(name, OPERATOR.iter().map(cell));
            }
            println!();
        }
    }

    /// False alarms an hour, found in %, lag in s, by adaptive.
    fn declared(&self, scenario: &str, conditions: &[&str]) {
        for condition in conditions {
            let total = |quantity: &str| -> f64 {
                let query = Query::of(quantity)
                    .scenario(scenario)
                    .condition(condition)
                    .name("adaptive");
                self.results.values(&query).iter().filter(|v| v.is_finite()).sum()
            };
            let of = |quantity: &str| {
                let query = Query::of(quantity)
                    .scenario(scenario)
                    .condition(condition)
                    .name("adaptive");
                self.results.values(&query)
            };
            let found: Vec<f64> = of("found").into_iter().filter(|v| v.is_finite()).collect();
            println!(
                "{scenario} {condition}: {} false alarms in {:.1} h; found {:.1} %, median lag {:.2} s",
                total("false_alarms"),
                total("hours"),
                found.iter().sum::<f64>() / found.len() as f64,
                median(&of("lag")),
            );
        }
        println!();
    }

    fn elsewhere(&self, scenario: &str) {
        let conditions = ["C1", "C2", "C3", "C4", "C5", "C6"];
        println!("{scenario}: RMS relative error, %, median run, median cell\n");
        header("method", &OPERATOR);
        for name in &self.names {
            let cell = |p: &&str| short(median(&self.medians(&format!("rms_{p}"), scenario, &conditions, name)));
            line(name, OPERATOR.iter().map(cell));
        }
        println!();
        let there = |condition: &&str| {
            let query = Query::of("found")
                .scenario(scenario)
                .condition(condition)
                .name("adaptive");
            !self.results.values(&query).is_empty()
        };
        let conditions: Vec<&str> = conditions.into_iter().filter(there).collect();
        self.declared(scenario, &conditions);
    }

    /// Cells in which adaptive is worse than the better of RLS and RPEM.
    fn above_one(&self) {
        for p in OPERATOR {
            let quantity = format!("rms_{p}");
            let ratios = self.relative(&quantity, &CHANGING, "adaptive");
            let rows = self.rows(&quantity, "all", &CHANGING, "adaptive");
            for (row, ratio) in rows.iter().zip(ratios).filter(|(_, ratio)| *ratio > 1.0) {
                println!(
                    "adaptive, {p}, {} m0={} P_n={}: {ratio:.2}",
                    row.condition, row.remnant_order, row.noise_level
                );
            }
        }
    }
}

fn median(values: &[f64]) -> f64 {
    Statistics::of(values).median
}

fn header(first: &str, columns: &[&str]) {
    println!("| {first} | {} |", columns.join(" | "));
    println!("|---{}|", "|---".repeat(columns.len()));
}

fn line(name: &str, cells: impl Iterator<Item = String>) {
    println!("| {name} | {} |", cells.collect::<Vec<_>>().join(" | "));
}

/// Two digits behind the point below ten, none above a hundred.
fn short(value: f64) -> String {
    match value.abs() {
        v if v > 999.0 => ">999".to_owned(),
        v if v >= 100.0 => format!("{value:.0}"),
        v if v >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}
