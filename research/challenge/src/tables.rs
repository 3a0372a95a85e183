//! The tables of the challenge, in Markdown.

use std::fmt::Write as _;

use super::{
    measure::{DETECTION_LIMITS_S, Line, TIMES_AFTER_CHANGE_S},
    oracle::CERTAIN_LOG_RATIO,
};

/// Number of methods in one table of numbers on a page 1200 pixels wide; `METHODS_PER_WORD_TABLE` is the number in a
/// table of words.
const METHODS_PER_TABLE: usize = 7;
const METHODS_PER_WORD_TABLE: usize = 5;

/// Returns the tables of results: error of H, its time course after a change, alarms, detected changes, coverage,
/// parameters, findings.
pub fn tables(lines: &[Line]) -> String {
    let mut text = String::new();
    let methods = unique_names(lines.iter().map(|line| line.method.as_str()));
    let cases = unique_names(lines.iter().map(|line| line.case.as_str()));
    text += &overview(lines, &methods, &cases);

    text += "\n### Error of H\n\nMean of |dH|/|H| over the lines, from 8 s after a change on or without a change; median over the runs.\n\n";
    write_rows_by_case(&mut text, &cases, &methods, METHODS_PER_TABLE, |case, method| {
        let of = lines_of(lines, case, method).flat_map(|line| &line.moments);
        let settled = of.filter(|m| is_settled(&m.label)).map(|m| m.error);
        median(settled.collect()).map_or("–".to_owned(), |e| format!("{e:.2}"))
    });

    text += "\n### Course of the error of H\n\nMedian over all runs in which someone changes at once.\n\n";
    let labels: Vec<String> = ["before".to_owned()]
        .into_iter()
        .chain(TIMES_AFTER_CHANGE_S.map(|s| format!("+{s:.0}")))
        .collect();
    write_head(
        &mut text,
        "method",
        &labels.iter().map(String::as_str).collect::<Vec<_>>(),
    );
    for method in &methods {
        let cell = |label: &String| {
            let of = lines
                .iter()
                .filter(|line| line.method == *method && !line.changes.is_empty());
            let errors = of
                .flat_map(|line| &line.moments)
                .filter(|m| m.label == *label)
                .map(|m| m.error);
            median(errors.collect()).map_or("–".to_owned(), |e| format!("{e:.2}"))
        };
        write_row(&mut text, method, labels.iter().map(cell));
    }

    let declaring: Vec<&str> = (methods.iter().copied())
        .filter(|m| {
            lines
                .iter()
                .any(|line| line.method == *m && line.false_alarms.is_some())
        })
        .collect();
    text += "\n### Alarms an hour without a change\n\nThose that are reported to be of the remnant alone are after the plus sign.\n\n";
    write_head(&mut text, "case", &[&["hours"], declaring.as_slice()].concat());
    for case in &cases {
        let hours = |method: &str| lines_of(lines, case, method).map(|line| line.exposed_s).sum::<f64>() / 3600.0;
        let cell = |method: &&str| {
            let of = || lines_of(lines, case, method);
            let alarms: usize = of().filter_map(|line| line.false_alarms).sum();
            let of_remnant: usize = of().map(|line| line.of_remnant).sum();
            let rate = |n: usize| n as f64 / hours(method);
            match of_remnant {
                0 => format!("{:.0}", rate(alarms)),
                n => format!("{:.0} + {:.0}", rate(alarms), rate(n)),
            }
        };
        let all = declaring.first().map_or(0.0, |m| hours(m));
        if all > 0.0 {
            write_row(
                &mut text,
                case,
                [format!("{all:.2}")].into_iter().chain(declaring.iter().map(cell)),
            );
        }
    }

    text += "\n### Changes found\n\nOf the changes that the oracle finds with certainty (log likelihood ratio of the true models over 12) within 5 and 8 s, those that were declared in that time; median delay.\n\n";
    write_head(
        &mut text,
        "case",
        &[&["changes", "certain 5 s, 8 s"], declaring.as_slice()].concat(),
    );
    for case in &cases {
        let of = |method: &str| {
            lines_of(lines, case, method)
                .flat_map(|line| line.changes.clone())
                .collect::<Vec<_>>()
        };
        let all = declaring.first().map_or(Vec::new(), |m| of(m));
        if all.is_empty() {
            continue;
        }
        let certain = |i: usize| all.iter().filter(|c| c.evidence[i] > CERTAIN_LOG_RATIO).count();
        let cell = |method: &&str| {
            let found = |i: usize| {
                let own = of(method);
                let such = own.iter().filter(|c| c.evidence[i] > CERTAIN_LOG_RATIO);
                such.filter(|c| c.after_s.is_some_and(|s| s <= DETECTION_LIMITS_S[i]))
                    .count()
            };
            let delay = median(of(method).iter().filter_map(|c| c.after_s).collect());
            let delay = delay.map_or(String::new(), |s| format!(" ({s:.1} s)"));
            format!("{}, {}{delay}", found(0), found(1))
        };
        let head = [all.len().to_string(), format!("{}, {}", certain(0), certain(1))];
        write_row(&mut text, case, head.into_iter().chain(declaring.iter().map(cell)));
    }

    text += "\n### Coverage\n\nBands of 1.96 standard errors of real and imaginary part of H that hold the truth, in percent; from 8 s after a change on or without a change.\n\n";
    write_rows_by_case(&mut text, &cases, &methods, METHODS_PER_TABLE, |case, method| {
        let of = lines_of(lines, case, method)
            .flat_map(|line| &line.moments)
            .filter(|m| is_settled(&m.label));
        let [inside, all] = of.fold([0, 0], |sum, m| [sum[0] + m.covered[0], sum[1] + m.covered[1]]);
        percentage(inside, all)
    });

    text += "\n### Parameters\n\nMedian relative error in percent and coverage, in runs whose operator is that of the thesis; from 8 s after a change on or without a change.\n\n";
    let names = ["K_e", "K_e_dot", "omega_nm", "zeta_nm", "tau_e"];
    write_head(&mut text, "method", &names);
    let named = |m: &&&str| {
        lines
            .iter()
            .any(|l| l.method == **m && l.moments.iter().any(|m| !m.parameters.is_empty()))
    };
    for method in methods.iter().filter(named) {
        let cell = |name: &&str| {
            let of = lines
                .iter()
                .filter(|line| line.method == *method)
                .flat_map(|line| &line.moments);
            let said: Vec<(f64, Option<bool>)> = (of.filter(|m| is_settled(&m.label)))
                .filter_map(|m| m.parameters.get(*name).copied())
                .collect();
            let bands: Vec<bool> = said.iter().filter_map(|(_, inside)| *inside).collect();
            let covered = percentage(bands.iter().filter(|inside| **inside).count(), bands.len());
            median(said.iter().map(|(e, _)| *e).collect())
                .map_or("–".to_owned(), |e| format!("{:.0} ({covered})", 100.0 * e))
        };
        write_row(&mut text, method, names.iter().map(cell));
    }

    let judged: Vec<&str> = (methods.iter().copied())
        .filter(|m| lines.iter().any(|line| line.method == *m && !line.findings.is_empty()))
        .collect();
    if !judged.is_empty() {
        text += "\n### What their verdicts report\n\nThe two findings that a verdict has most often, with the runs that have them.\n\n";
        write_rows_by_case(&mut text, &cases, &judged, METHODS_PER_WORD_TABLE, |case, method| {
            most_frequent_findings(lines_of(lines, case, method))
        });
    }

    text += &failures(lines);
    text
}

/// Table with one row for each entrant.
fn overview(lines: &[Line], methods: &[&str], cases: &[&str]) -> String {
    let mut text = "\n### In a row each\n\nError of H from 8 s after a change on or without a change: median and largest of the cases. Coverage of its bands in percent. Alarms an hour in runs without a change, those of the remnant alone after the plus sign. Changes found of those that the oracle finds with certainty, within 5 and 8 s.\n\n".to_owned();
    write_head(
        &mut text,
        "method",
        &[
            "error",
            "largest",
            "coverage",
            "alarms an hour",
            "found in 5 s",
            "in 8 s",
        ],
    );
    for method in methods {
        let of = || lines.iter().filter(|line| line.method == *method);
        let settled = |line: &'_ Line| {
            line.moments
                .iter()
                .filter(|m| is_settled(&m.label))
                .cloned()
                .collect::<Vec<_>>()
        };
        let by_case: Vec<f64> = (cases.iter())
            .filter_map(|case| {
                median(
                    lines_of(lines, case, method)
                        .flat_map(settled)
                        .map(|m| m.error)
                        .collect(),
                )
            })
            .collect();
        let [inside, all] = of()
            .flat_map(settled)
            .fold([0, 0], |sum, m| [sum[0] + m.covered[0], sum[1] + m.covered[1]]);
        let steady = || of().filter(|line| line.changes.is_empty() && line.false_alarms.is_some());
        let hours = steady().map(|line| line.exposed_s).sum::<f64>() / 3600.0;
        let rate = |n: usize| n as f64 / hours;
        let alarms = match hours > 0.0 {
            true => format!(
                "{:.1} + {:.1}",
                rate(steady().filter_map(|line| line.false_alarms).sum()),
                rate(steady().map(|line| line.of_remnant).sum())
            ),
            false => "–".to_owned(),
        };
        let declares = of().any(|line| line.false_alarms.is_some());
        let found = |i: usize| {
            let certain = || {
                of().flat_map(|line| &line.changes)
                    .filter(|c| c.evidence[i] > CERTAIN_LOG_RATIO)
            };
            let found = certain()
                .filter(|c| c.after_s.is_some_and(|s| s <= DETECTION_LIMITS_S[i]))
                .count();
            if declares {
                format!("{found} of {}", certain().count())
            } else {
                "–".to_owned()
            }
        };
        let number = |e: Option<f64>| e.map_or("–".to_owned(), |e| format!("{e:.2}"));
        let largest = by_case.iter().copied().reduce(f64::max);
        let cells = [
            number(median(by_case)),
            number(largest),
            percentage(inside, all),
            alarms,
            found(0),
            found(1),
        ];
        write_row(&mut text, method, cells.into_iter());
    }
    text
}

/// Table of failed entrants, with reasons and cases.
fn failures(lines: &[Line]) -> String {
    let failed = || (lines.iter()).filter_map(|line| Some((line, line.failed.as_deref()?)));
    let mut text = String::new();
    if failed().next().is_some() {
        text += "\n### Runs that could not be followed\n\n| method | runs | why | cases |\n|---|---|---|---|\n";
    }
    for method in unique_names(failed().map(|(line, _)| line.method.as_str())) {
        for reason in unique_names(
            failed()
                .filter(|(line, _)| line.method == method)
                .map(|(_, reason)| reason),
        ) {
            let of = || failed().filter(|(line, why)| line.method == method && *why == reason);
            let cases = unique_names(of().map(|(line, _)| line.case.as_str()));
            let _ = writeln!(
                text,
                "| {method} | {} | {reason} | {} |",
                of().count(),
                cases.join(", ")
            );
        }
    }
    text
}

/// Returns the two most frequent findings.
fn most_frequent_findings<'a>(lines: impl Iterator<Item = &'a Line> + Clone) -> String {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for kind in unique_names(lines.clone().flat_map(|line| &line.findings).map(String::as_str)) {
        let count = lines
            .clone()
            .filter(|line| line.findings.iter().any(|f| f == kind))
            .count();
        counts.push((kind, count));
    }
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let words: Vec<String> = counts
        .iter()
        .take(2)
        .map(|(kind, count)| format!("{kind} {count}"))
        .collect();
    if words.is_empty() {
        "–".to_owned()
    } else {
        words.join(", ")
    }
}

/// True for results from 8 s after a change on, and for results without a change.
fn is_settled(label: &str) -> bool {
    !matches!(label, "+2" | "+4" | "before")
}

fn lines_of<'a>(lines: &'a [Line], case: &'a str, method: &'a str) -> impl Iterator<Item = &'a Line> + Clone {
    lines
        .iter()
        .filter(move |line| line.case == case && line.method == method)
}

fn unique_names<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut all: Vec<&str> = Vec::new();
    for name in names {
        if !all.contains(&name) {
            all.push(name);
        }
    }
    all
}

/// Writes a row for each case and a column for each method, split into tables with at most `beside` methods.
fn write_rows_by_case(
    text: &mut String,
    cases: &[&str],
    methods: &[&str],
    beside: usize,
    cell: impl Fn(&str, &str) -> String,
) {
    let each = methods.len().div_ceil(methods.len().div_ceil(beside).max(1)).max(1);
    for (i, some) in methods.chunks(each).enumerate() {
        if i > 0 {
            text.push('\n');
        }
        write_head(text, "case", some);
        for case in cases {
            write_row(text, case, some.iter().map(|method| cell(case, method)));
        }
    }
}

fn write_head(text: &mut String, first: &str, others: &[&str]) {
    let _ = writeln!(
        text,
        "| {first} | {} |\n|---|{}",
        others.join(" | "),
        "---|".repeat(others.len())
    );
}

fn write_row(text: &mut String, first: &str, cells: impl Iterator<Item = String>) {
    let _ = writeln!(text, "| {first} | {} |", cells.collect::<Vec<_>>().join(" | "));
}

fn percentage(of: usize, all: usize) -> String {
    match all {
        0 => "–".to_owned(),
        _ => format!("{:.0}", 100.0 * of as f64 / all as f64),
    }
}

/// Returns the median; `None` if there are no values.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    match n % 2 {
        _ if n == 0 => None,
        1 => Some(values[n / 2]),
        _ => Some((values[n / 2 - 1] + values[n / 2]) / 2.0),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::measure::{ChangeOutcome, Moment};

    #[test]
    fn tables_contain_the_expected_rows() {
        let moment = |label: &str, error| Moment {
            label: label.to_owned(),
            t_s: 0.0,
            error,
            covered: [13, 14],
            parameters: BTreeMap::from([("K_e".to_owned(), (0.07, Some(true)))]),
        };
        let line = |method: &str, found| Line {
            case: "a-case".to_owned(),
            run: 0,
            method: method.to_owned(),
            failed: None,
            moments: vec![moment("+4", 0.9), moment("+8", 0.31), moment("+28", 0.11)],
            false_alarms: Some(3),
            of_remnant: 1,
            exposed_s: 1800.0,
            changes: vec![ChangeOutcome {
                at_s: 45.0,
                evidence: [11.0, 20.0],
                after_s: found,
            }],
            findings: Vec::new(),
        };
        let text = tables(&[line("one", Some(6.5)), line("two", None)]);
        for expected in [
            "| a-case | 0.21 | 0.21 |",
            "| a-case | 0.50 | 6 + 2 | 6 + 2 |",
            "| a-case | 1 | 0, 1 | 0, 1 (6.5 s) | 0, 0 |",
            "| a-case | 93 | 93 |",
            "| one | 7 (100) |",
            "| one | 0.21 | 0.21 | 93 | – | 0 of 0 | 1 of 1 |",
        ] {
            assert!(text.contains(expected), "{expected}: {text}");
        }
    }
}
