//! Draws the share of detected changes against false alarms per hour, from the table printed by
//! `cargo run --release -p hoid-evidence --example multiple_model_evidence -- detection 40`:
//!
//! `cargo run -p hoid-evidence --example detection_figure -- detection.txt > docs/src/images/detection.svg`
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use hoid_report::figures::{Curve, CurveGrid, CurvePanel, LineKind, Shade, curves};

/// Position of a rate of zero, 1/h: less than one alarm in all hours of the table.
const ZERO_RATE_POSITION: f64 = 0.02;

fn main() {
    let path = std::env::args().nth(1).unwrap_or_else(|| "detection.txt".to_owned());
    let text = std::fs::read_to_string(path).unwrap();
    let rows: Vec<Vec<&str>> = text
        .lines()
        .map(|line| line.split('|').map(str::trim).collect::<Vec<_>>())
        .filter(|cells| cells.len() > 7 && cells[2].parse::<f64>().is_ok())
        .collect();
    let panel = |column: usize| {
        let curve = |name: &str, statistic: &str, kind: LineKind, shade: Shade| {
            let number = |cell: &str| cell.parse::<f64>().unwrap_or(f64::NAN);
            let mut points: Vec<(f64, f64)> = rows
                .iter()
                .filter(|cells| cells[1].starts_with(statistic))
                .map(|cells| (number(cells[3]).max(ZERO_RATE_POSITION), number(cells[column])))
                .collect();
            // Of the thresholds without a false alarm, the lowest is the best.
            points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
            let silent = points.iter().rposition(|p| p.0 <= ZERO_RATE_POSITION).unwrap_or(0);
            let points = &points[silent..];
            Curve {
                name: name.to_owned(),
                kind,
                shade,
                x: points.iter().map(|p| p.0).collect(),
                y: points.iter().map(|p| p.1).collect(),
                band: Vec::new(),
                bars: Vec::new(),
            }
        };
        CurvePanel {
            name: "found".to_owned(),
            unit: "%".to_owned(),
            ordinate_range: Some((70.0, 101.0)),
            curves: vec![
                curve(
                    "log odds of multiple-model",
                    "log odds",
                    LineKind::Marked,
                    Shade::of_method(0),
                ),
                curve(
                    "k sigma of error and error rate",
                    "k sigma",
                    LineKind::Marked,
                    Shade::of_method(1),
                ),
            ],
            ..CurvePanel::default()
        }
    };
    let grid = CurveGrid {
        panels: vec![panel(4), panel(6)],
        columns: 2,
        titles: vec!["C4".to_owned(), "C6".to_owned()],
        abscissa: "false alarms an hour".to_owned(),
        logarithmic_abscissa: true,
        shared_ordinates: true,
    };
    println!(
        "{}",
        curves(
            "detection",
            "Share of changes found against false alarms an hour",
            &grid
        )
    );
}
