//! Checks the error bars of operators of people. The program prints the numbers of `research/notes/people-coverage.md`.
//!
//! `cargo xtask slow people-coverage [PEOPLE] [FIRST] [--given] [--lines] [--no-lines] [--rows FILE]`: evaluates 2000
//! people by default, from the number FIRST on. `--given` omits the fits that select the form, which take about ten
//! times as long; `--lines` omits the fits without the recorded disturbance, `--no-lines` the fits with it. `--rows`
//! writes each quantity of each fit as a row of a CSV file.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr)]

#[path = "../tests/common/people_coverage/mod.rs"]
mod people_coverage;

use std::{collections::BTreeSet, fmt::Write as _, path::PathBuf};

use hoid::model::VerdictLevel;
use people_coverage::{
    fits::{Outcome, Variant, fit_person},
    people::Spread,
    tables::{Proportion, QUANTITIES, coverage, median, values_of_quantity},
};
use rayon::prelude::*;

const SEED: u64 = 2026;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let (mut numbers, mut rows, mut variants) = (Vec::new(), None, Variant::ALL.to_vec());
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--rows" => rows = arguments.next().map(PathBuf::from),
            "--given" => variants.retain(|v| v.form_given),
            "--no-lines" => variants.retain(|v| !v.excitation),
            "--lines" => variants.retain(|v| v.excitation),
            number => numbers.push(number.parse::<u64>().unwrap()),
        }
    }
    let people = numbers.first().copied().unwrap_or(2000);
    let first = numbers.get(1).copied().unwrap_or(0);
    let all: Vec<Outcome> = (first..first + people)
        .into_par_iter()
        .flat_map_iter(|number| fit_person(SEED, number, &variants).unwrap())
        .collect();
    if let Some(file) = rows {
        std::fs::write(file, to_csv(&all)).unwrap();
    }
    for variant in variants {
        let of: Vec<&Outcome> = all.iter().filter(|o| o.variant == variant).collect();
        print_report(variant, &of);
    }
}

fn print_report(variant: Variant, of: &[&Outcome]) {
    println!("\n## {} ({} people)\n", variant.name(), of.len());
    let failed = of.iter().filter(|o| o.found.is_err()).count();
    let seconds: Vec<f64> = of.iter().map(|o| o.seconds).collect();
    println!(
        "{failed} failed; {:.2} s a fit in the mean, {:.2} s at most",
        seconds.iter().sum::<f64>() / seconds.len() as f64,
        seconds.iter().copied().fold(0.0, f64::max)
    );
    let right = Proportion::count(
        of.iter()
            .filter_map(|o| Some(o.found.as_ref().ok()?.form == o.true_form)),
    );
    println!("\nright form: {}", right.text());
    println!(
        "\n| quantity | determined | coverage | form right | median width/|truth| | bias, s.e. | rms of error/s.e. | left open: coverage |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let with_right_form: Vec<&Outcome> = of
        .iter()
        .copied()
        .filter(|o| o.found.as_ref().is_ok_and(|f| f.form == o.true_form))
        .collect();
    for name in QUANTITIES {
        let all = values_of_quantity(of, name);
        if all.is_empty() {
            continue;
        }
        let determined = Proportion::count(all.iter().map(|q| q.determined));
        let errors: Vec<f64> = all
            .iter()
            .filter(|q| q.determined)
            .filter_map(|q| Some((q.value - q.truth) / q.standard_error?))
            .filter(|z| z.is_finite())
            .collect();
        let n = errors.len().max(1) as f64;
        let bias = errors.iter().sum::<f64>() / n;
        let rms = (errors.iter().map(|z| z * z).sum::<f64>() / n).sqrt();
        let width = median(
            all.iter()
                .filter(|q| q.determined)
                .filter_map(|q| q.interval.map(|(l, h)| (h - l) / q.truth.abs())),
        );
        let open = Proportion::count(all.iter().filter(|q| !q.determined).filter_map(|q| q.contains_truth()));
        println!(
            "| {name} | {} | {} | {} | {:.2} | {bias:+.2} ± {:.2} | {rms:.2} | {} |",
            determined.text(),
            coverage(&all).text(),
            coverage(&values_of_quantity(&with_right_form, name)).text(),
            width.unwrap_or(f64::NAN),
            1.0 / n.sqrt(),
            open.text(),
        );
    }
    by("runs", of, &[1, 2, 5, 10].map(|n| n.to_string()), |o| {
        o.cell.runs.to_string()
    });
    by("sample rate, Hz", of, &[60, 100].map(|n| n.to_string()), |o| {
        o.cell.rate_hz.to_string()
    });
    by(
        "spread between runs",
        of,
        &Spread::ALL.map(|s| s.name().to_owned()),
        |o| o.cell.spread.name().to_owned(),
    );
    by(
        "true form",
        of,
        &["lead", "lead-lag", "lead2-lag"].map(str::to_owned),
        |o| o.true_form.to_string(),
    );
    let kinds: Vec<String> = hoid::sim::people::RemnantKind::ALL
        .iter()
        .map(ToString::to_string)
        .collect();
    by("remnant", of, &kinds, |o| o.cell.kind.to_string());
    println!("\n| verdict | share | response off by, median | 90 % below | coverage of all that is determined |");
    println!("|---|---|---|---|---|");
    for level in VerdictLevel::ALL {
        let such: Vec<&Outcome> = of
            .iter()
            .copied()
            .filter(|o| o.found.as_ref().is_ok_and(|f| f.level == level))
            .collect();
        let mut errors: Vec<f64> = such
            .iter()
            .filter_map(|o| Some(o.found.as_ref().ok()?.response_error))
            .collect();
        errors.sort_by(f64::total_cmp);
        let part = |p: f64| {
            errors
                .get((p * errors.len() as f64) as usize)
                .map_or("–".to_owned(), |e| format!("{:.1} %", 100.0 * e))
        };
        println!(
            "| {level} | {} | {} | {} | {} |",
            Proportion {
                of: such.len(),
                all: of.len()
            }
            .text(),
            part(0.5),
            part(0.9),
            overall_coverage(&such).text()
        );
    }
    print_findings(of);
}

/// Prints the number of occurrences of each finding, including notes.
fn print_findings(of: &[&Outcome]) {
    let made: Vec<&Vec<String>> = of.iter().filter_map(|o| Some(&o.found.as_ref().ok()?.kinds)).collect();
    let kinds: BTreeSet<&String> = made.iter().copied().flatten().collect();
    println!("\n| finding | share |");
    println!("|---|---|");
    for kind in kinds {
        let share = Proportion::count(made.iter().map(|all| all.contains(kind)));
        println!("| {kind} | {} |", share.text());
    }
}

/// Returns the coverage over all determined quantities, each counted once.
fn overall_coverage(of: &[&Outcome]) -> Proportion {
    let each = QUANTITIES
        .iter()
        .filter(|n| !n.contains("1.96"))
        .map(|name| coverage(&values_of_quantity(of, name)));
    each.fold(Proportion::default(), |a, b| Proportion {
        of: a.of + b.of,
        all: a.all + b.all,
    })
}

fn by(what: &str, of: &[&Outcome], values: &[String], key: impl Fn(&Outcome) -> String) {
    let names: Vec<&str> = QUANTITIES
        .into_iter()
        .filter(|name| !values_of_quantity(of, name).is_empty())
        .collect();
    println!("\n| {what} | right form | {} |", names.join(" | "));
    println!("|---|---|{}", "---|".repeat(names.len()));
    for value in values {
        let such: Vec<&Outcome> = of.iter().copied().filter(|o| key(o) == *value).collect();
        let right = Proportion::count(
            such.iter()
                .filter_map(|o| Some(o.found.as_ref().ok()?.form == o.true_form)),
        );
        let cells: Vec<String> = names
            .iter()
            .map(|name| coverage(&values_of_quantity(&such, name)).text())
            .collect();
        println!("| {value} | {} | {} |", right.text(), cells.join(" | "));
    }
}

/// Returns one row for each quantity of each fit.
fn to_csv(all: &[Outcome]) -> String {
    let mut text = "person,plant,kind,rate,runs,spread,lines,given,true_form,form,level,kinds,response_error,inflation,nd,seconds,name,truth,value,se,low,high,prior_share,determined,error\n".to_owned();
    for o in all {
        let head = format!(
            "{},{},{},{},{},{},{},{},{}",
            o.person,
            o.cell.plant,
            o.cell.kind,
            o.cell.rate_hz,
            o.cell.runs,
            o.cell.spread.name(),
            o.variant.excitation,
            o.variant.form_given,
            o.true_form
        );
        match &o.found {
            Err(error) => writeln!(
                text,
                "{head},,,,,,,{:.3},,,,,,,,,{}",
                o.seconds,
                error.replace(',', ";")
            )
            .unwrap(),
            Ok(f) => {
                for q in &f.quantities {
                    let (low, high) = q.interval.unwrap_or((f64::NAN, f64::NAN));
                    writeln!(
                        text,
                        "{head},{},{},{},{:.4},{:.3},{},{:.3},{},{},{},{},{low},{high},{:.3},{},",
                        f.form,
                        f.level,
                        f.kinds.join(" "),
                        f.response_error,
                        f.inflation,
                        f.noise_order,
                        o.seconds,
                        q.name,
                        q.truth,
                        q.value,
                        q.standard_error.unwrap_or(f64::NAN),
                        q.prior_share,
                        q.determined
                    )
                    .unwrap();
                }
            }
        }
    }
    text
}
