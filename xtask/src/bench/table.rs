//! The table of speed ratios.

use std::fmt::Write;

use super::lines::{Line, Outcome, difference};

/// Relative difference up to which results count as equal.
const EQUAL_TOLERANCE: f64 = 1e-6;

/// Limits on the speed of hoid: task, words in the name of the peer, and smallest permitted ratio.
const RATIO_LIMITS: [(&str, &str, f64); 16] = [
    ("arx", "normal equations", 10.0),
    ("arx", "numba", 2.0),
    ("bj", "own LM", 7.0),
    ("bj", "numba", 1.4),
    ("bj", "pysib", 1000.0),
    ("bj", "sippy", 1000.0),
    ("bj", "timeseries", 1000.0),
    ("rls", "padasip", 500.0),
    ("rls", "numba", 1.0),
    ("rpem", "numpy", 350.0),
    ("rpem", "numba", 1.0),
    ("rpem", "scilab", 2.0),
    ("loop with noise", "numba", 6.0),
    ("cell", "numba", 4.0),
    ("cell", "own LM", 20.0),
    ("reproduce, M = 100", "", 0.0),
];

/// Returns a table with one row per task and peer, followed by the versions and the machine.
pub fn ratio_table(lines: &[Line], machine: &str) -> String {
    let mut text = String::from(
        "| task | hoid | peer | its time | ratio | at least | answers |\n|---|---:|---|---:|---:|---:|---|\n",
    );
    let mut skipped = String::new();
    for line in lines {
        if let Outcome::Skipped(reason) = &line.outcome {
            let of = if line.task.is_empty() { "all" } else { &line.task };
            // Each item of a Markdown list must be on one line.
            let _ = writeln!(skipped, "- {}, {of}: {}", line.peer, reason.replace(['\n', '|'], " "));
        }
    }
    for own in lines.iter().filter(|line| line.is_ours()) {
        let Outcome::Measured { seconds, answer, .. } = &own.outcome else {
            continue;
        };
        let peers: Vec<&Line> = lines.iter().filter(|l| l.task == own.task && !l.is_ours()).collect();
        let mut alone = true;
        for peer in peers {
            let Outcome::Measured {
                seconds: theirs,
                answer: other,
                differs,
            } = &peer.outcome
            else {
                continue;
            };
            alone = false;
            let ratio = theirs / seconds;
            let limit = RATIO_LIMITS
                .iter()
                .find(|(task, words, _)| *task == own.task && peer.peer.contains(words));
            let asked = limit.map_or(String::new(), |(_, _, least)| {
                let missed = if ratio < *least { " (missed)" } else { "" };
                format!("{}{missed}", format_number(*least))
            });
            let answers = compare_answers(answer, other, differs.as_deref());
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {asked} | {answers} |",
                own.task,
                format_time(*seconds),
                peer.peer,
                format_time(*theirs),
                format_number(ratio)
            );
        }
        if alone {
            let _ = writeln!(text, "| {} | {} | | | | | |", own.task, format_time(*seconds));
        }
    }
    let version = lines.iter().find(|l| l.is_ours()).map_or("", |l| l.peer.as_str());
    let _ = write!(text, "\n{version} on {machine}.\n");
    if !skipped.is_empty() {
        let _ = write!(text, "\nNot measured:\n\n{skipped}");
    }
    text
}

fn compare_answers(ours: &[f64], theirs: &[f64], differs: Option<&str>) -> String {
    match (difference(ours, theirs), differs) {
        (Some(d), None) if d <= EQUAL_TOLERANCE => format!("same to {d:.0e}"),
        (Some(d), None) => format!("**differ by {d:.0e}**"),
        (Some(d), Some(why)) => format!("{why} ({d:.0e})"),
        (None, Some(why)) => why.to_owned(),
        (None, None) => "random".to_owned(),
    }
}

/// Formats a time with a unit and about three digits.
pub fn format_time(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s < 1e-3 => (s * 1e6, "us"),
        s if s < 1.0 => (s * 1e3, "ms"),
        s => (s, "s"),
    };
    format!("{} {unit}", format_number(value))
}

/// Formats a number with about three digits.
pub fn format_number(value: f64) -> String {
    match value.abs() {
        v if v >= 100.0 => format!("{value:.0}"),
        v if v >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(task: &str, peer: &str, seconds: f64, answer: &[f64], differs: Option<&str>) -> Line {
        Line {
            task: task.to_owned(),
            peer: peer.to_owned(),
            outcome: Outcome::Measured {
                seconds,
                answer: answer.to_vec(),
                differs: differs.map(str::to_owned),
            },
        }
    }

    #[test]
    fn table_contains_ratios_limits_and_answers() {
        let skipped = Line {
            task: "bj".to_owned(),
            peer: "z".to_owned(),
            outcome: Outcome::Skipped("no | module".to_owned()),
        };
        let lines = [
            line("arx", "hoid 0.1.0", 1e-5, &[1.0], None),
            line("rls trace", "hoid 0.1.0", 2.5e-4, &[1.0], None),
            line("arx", "numba 1", 1.5e-5, &[1.0 + 1e-9], None),
            line("arx", "numpy 2, normal equations", 2e-4, &[1.1], None),
            line("arx", "other", 1e-2, &[1.1], Some("zeros before the record")),
            skipped,
        ];
        let text = ratio_table(&lines, "a machine");
        for part in [
            "| arx | 10.0 us | numba 1 | 15.0 us | 1.50 | 2.00 (missed) | same to 1e-9 |",
            "| arx | 10.0 us | numpy 2, normal equations | 200 us | 20.0 | 10.0 | **differ by 9e-2** |",
            "| arx | 10.0 us | other | 10.0 ms | 1000 |  | zeros before the record (9e-2) |",
            "| rls trace | 250 us | | | | | |",
            "hoid 0.1.0 on a machine.",
            "- z, bj: no   module",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
    }
}
