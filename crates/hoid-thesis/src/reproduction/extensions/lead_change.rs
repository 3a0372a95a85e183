//! Detectability of a change in the lead within 5 s.

use hoid_report::figures::{Curve, CurveGrid, CurvePanel, LineKind, Shade, curves};
use hoid_study::Results;

use super::{
    super::{
        item::{Item, ItemOutput},
        table_builder::TableBuilder,
    },
    symbols::noise_level_of,
};

pub(super) fn items() -> Vec<Item> {
    vec![Item::from_study(
        "lead-change",
        "Detectability of a 20 % change in T_L within 5 s",
        "Distance between the medians of T_L at 45.9 and 40.6 s in units of their spread (interquartile range / \
         1.349, mean of both); the change is at 40.96 s. At 2.5 (dashed), a threshold with 5 % false alarms detects \
         80 % of the changes.",
        "lead-change",
        lead_change,
    )]
}

/// Returns the median of T_L and its standard deviation over the runs, estimated from the quartiles, at the last stored
/// time that is not after the given time.
fn t_l_at_time(results: &Results, cell: u64, estimator: &str, time_s: f64) -> Option<(f64, f64)> {
    let trace = results.traces(cell, estimator)?;
    let bands = trace.parameters.get("T_L")?;
    let k = trace.times_s.iter().rposition(|t| *t <= time_s)?;
    Some((
        bands.median[k],
        (bands.upper_quartile[k] - bands.lower_quartile[k]) / 1.349,
    ))
}

fn lead_change(item: &Item, results: &Results) -> ItemOutput {
    let mut data = TableBuilder::new(
        &["estimator"],
        &[
            "noise_level",
            "before_s",
            "spread_before_s",
            "after_s",
            "spread_after_s",
            "distance",
        ],
    );
    let mut panels = Vec::new();
    let names = ["RPEM", "physical"];
    for (method, name) in names.into_iter().enumerate() {
        let estimators: Vec<&hoid_study::plan::EstimatorCell> =
            results.plan.estimators.iter().filter(|e| e.name == name).collect();
        let mut drawn = Vec::new();
        for (level, estimator) in estimators.iter().enumerate() {
            let (mut x, mut y) = (Vec::new(), Vec::new());
            for cell in &results.plan.cells {
                let Some(p_n) = noise_level_of(&cell.axes) else {
                    continue;
                };
                let (Some(before), Some(after)) = (
                    t_l_at_time(results, cell.index, &estimator.label, 40.7),
                    t_l_at_time(results, cell.index, &estimator.label, 45.96),
                ) else {
                    continue;
                };
                let distance = (after.0 - before.0) / (0.5 * (before.1 + after.1));
                data.add_row(
                    &[&estimator.label],
                    &[p_n, before.0, before.1, after.0, after.1, distance],
                );
                x.push(p_n);
                y.push(distance);
            }
            let memory = estimator.axes.first().map_or("", |axis| axis.value.as_str());
            drawn.push(Curve {
                name: format!("{name}, {memory}"),
                kind: LineKind::Marked,
                shade: Shade {
                    method: method + 1,
                    level,
                    levels: estimators.len(),
                },
                x,
                y,
                band: Vec::new(),
                bars: Vec::new(),
            });
        }
        drawn.push(Curve {
            name: "80 % found".to_owned(),
            kind: LineKind::Truth,
            shade: Shade::of_method(0),
            x: vec![0.01, 0.3],
            y: vec![2.486; 2],
            band: Vec::new(),
            bars: Vec::new(),
        });
        panels.push(CurvePanel {
            name: "distance in spreads".to_owned(),
            unit: String::new(),
            logarithmic: false,
            ordinate_range: None,
            curves: drawn,
        });
    }
    let grid = CurveGrid {
        panels,
        columns: names.len(),
        titles: names.iter().map(|n| (*n).to_owned()).collect(),
        abscissa: "P_n".to_owned(),
        logarithmic_abscissa: true,
        shared_ordinates: true,
    };
    item.draw(curves, &grid, data)
}
