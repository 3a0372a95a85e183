//! Figs. H.1 to H.12 as in the thesis, *obtained values averaged from M realizations*: averages over the runs, with the
//! medians for comparison.
//!
//! A single run in which K_e nearly vanishes dominates the average of `T_L = K_e_dot/K_e`. The figures of the module
//! `traces` with the same numbers therefore show the medians.

use hoid_study::{Query, Results};

use super::{
    axes::{REMNANT_ORDERS, order_titles},
    item::{Item, ItemOutput},
    table_builder::TableBuilder,
    traces::{DISCRETE, OPERATOR, Row},
};
use hoid_report::figures::{CurveKind, Ordinate, TraceCurve, TraceGrid, TracePanel, trace_panels};

/// The displayed noise level; averages and medians at three levels would give twelve lines per panel.
const NOISE_LEVEL: f64 = 0.1;

pub(super) fn items() -> Vec<Item> {
    let mut all = Vec::new();
    for (i, condition) in ["C1", "C2", "C3", "C4", "C5", "C6"].into_iter().enumerate() {
        for (k, (rows, what)) in [(&DISCRETE[..], "discrete"), (&OPERATOR[..], "operator")]
            .into_iter()
            .enumerate()
        {
            all.push(Item::from_study(
                format!("H.{}-average", 2 * i + k + 1),
                format!("Average and median of recursive estimates, {what} parameters, condition {condition}, P_n = {NOISE_LEVEL}"),
                "Average over the runs at each time (dark), as in the thesis, and median (light). The average is clipped where it exceeds the range of the vertical axis.",
                "recursive",
                move |item, results| make(item, results, condition, rows),
            ));
        }
    }
    all
}

fn make(item: &Item, results: &Results, condition: &str, rows: &[Row]) -> ItemOutput {
    let mut data = TableBuilder::new(
        &["parameter", "estimator"],
        &["remnant_order", "t", "mean", "median", "sd"],
    );
    let mut panels = Vec::new();
    for (of_rls, of_rpem, name, unit) in rows {
        for m0 in REMNANT_ORDERS {
            let cell = Query::default()
                .condition(condition)
                .remnant_order(m0)
                .noise_level(NOISE_LEVEL);
            let mut curves = Vec::new();
            for (method, (estimator, column)) in [("RLS", of_rls), ("RPEM", of_rpem)].into_iter().enumerate() {
                let cells = results.cells(&cell);
                let traces = cells.first().and_then(|cell| results.traces(cell.index, estimator));
                let Some((traces, bands)) = traces.and_then(|of| Some((of, of.parameters.get(*column)?))) else {
                    continue;
                };
                for (k, t) in traces.times_s.iter().enumerate() {
                    let numbers = [m0 as f64, *t, bands.mean[k], bands.median[k], bands.sd[k]];
                    data.add_row(&[name, estimator], &numbers);
                }
                for (level, values) in [&bands.median, &bands.mean].into_iter().enumerate() {
                    curves.push(TraceCurve {
                        kind: CurveKind::Estimate,
                        method,
                        level,
                        times_s: traces.times_s.clone(),
                        values: values.clone(),
                        band: Vec::new(),
                    });
                }
            }
            panels.push(TracePanel {
                name: (*name).to_owned(),
                unit: (*unit).to_owned(),
                ordinate: Ordinate::Robust,
                curves,
            });
        }
    }
    let grid = TraceGrid {
        panels,
        columns: REMNANT_ORDERS.len(),
        titles: order_titles(),
        methods: ["ARX (RLS)", "BJ (RPEM)"].map(str::to_owned).to_vec(),
        levels: ["median", "average"].map(str::to_owned).to_vec(),
        ..TraceGrid::default()
    };
    item.draw(trace_panels, &grid, data)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_study::Plan;

    use super::*;

    #[test]
    fn average_and_median_are_drawn_for_each_order() {
        let text = r#"
name = "recursive"
replications = 1
[keep]
trace_every = 512
[[scenarios]]
condition = "C4"
remnant = { order = [1, 2, 3, 4], noise_level = 0.1 }
[[estimators]]
name = "RLS"
method = "rls"
[[estimators]]
name = "RPEM"
method = "rpem"
"#;
        let plan = Plan::parse(text, "recursive.toml").unwrap();
        let results = Results::synthetic(plan, &|_, _, _, _| 0.0);
        let all = items();
        assert_eq!(all.len(), 12);
        let made = make(&all[7], &results, "C4", &OPERATOR);
        assert!(made.svg.unwrap().contains("average"));
        // There are two estimators, five parameters and four orders.
        let rows = made.data.columns[0].values.len();
        assert_eq!(rows % 40, 0);
        assert!(rows > 0);
    }
}
