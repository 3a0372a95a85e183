//! Recursive estimates over time as medians over all runs: Figs. 11, 12, G.1 to G.8 and H.1 to H.12.

use hoid_study::{Query, Results, plan::Cell, statistics::quantile};

use super::{
    axes::{REMNANT_ORDERS, level_name, order_titles},
    item::{Item, ItemOutput},
    table_builder::TableBuilder,
};
use hoid_report::figures::{CurveKind, Ordinate, TraceCurve, TraceGrid, TracePanel, trace_panels};

/// Parameter in a row of panels: its column for RLS, its column for RPEM, and the name and unit of the panel.
pub(super) type Row = (&'static str, &'static str, &'static str, &'static str);

pub(super) const DISCRETE: [Row; 4] = [
    ("a1", "f1", "a1", ""),
    ("a2", "f2", "a2", ""),
    ("b0", "b0", "b0", ""),
    ("b1", "b1", "b1", ""),
];
pub(super) const OPERATOR: [Row; 5] = [
    ("K_e", "K_e", "K_e", "deg/deg"),
    ("T_L", "T_L", "T_L", "s"),
    ("K_e_dot", "K_e_dot", "K_e_dot", "s"),
    ("omega_nm", "omega_nm", "omega_nm", "rad/s"),
    ("zeta_nm", "zeta_nm", "zeta_nm", ""),
];

/// Estimator in a figure: index of the method for the colour, name in the plan, and its batch fits with their spans.
type EstimatorCurves = (usize, &'static str, &'static [(&'static str, f64, f64)]);

const RLS: EstimatorCurves = (0, "RLS", &[("OLS first", 0.0, 30.72), ("OLS last", 51.2, 81.92)]);
const RPEM: EstimatorCurves = (1, "RPEM", &[("PEM first", 0.0, 30.72), ("PEM last", 51.2, 81.92)]);

const CAPTION: &str = "Median over the runs at each time. The thesis shows averages, but one run in which K_e nearly \
                       vanishes would dominate the average of T_L. Coloured dots: batch fits to [0, 30.72] and \
                       [51.20, 81.92] s; black dashes: the simulated operator. The values from 15 s on set the range \
                       of a panel; earlier values beyond it are clipped.";

pub(super) fn items() -> Vec<Item> {
    let mut all = vec![
        recursive_item("fig-11".to_owned(), "C4", &DISCRETE, "discrete parameters"),
        recursive_item("fig-12".to_owned(), "C4", &OPERATOR, "operator parameters"),
    ];
    for (i, condition) in ["C1", "C2", "C3", "C4", "C5", "C6"].into_iter().enumerate() {
        all.push(recursive_item(
            format!("H.{}", 2 * i + 1),
            condition,
            &DISCRETE,
            "discrete parameters",
        ));
        all.push(recursive_item(
            format!("H.{}", 2 * i + 2),
            condition,
            &OPERATOR,
            "operator parameters",
        ));
    }
    for (rows, what, first) in [
        (&DISCRETE[..], "discrete parameters", 1),
        (&OPERATOR[..], "operator parameters", 5),
    ] {
        for m0 in REMNANT_ORDERS {
            all.push(Item::from_study(
                format!("G.{}", first + m0 - 1),
                format!("RLS with a forgetting matrix, {what}, condition C3, m0 = {m0}"),
                "Median over the runs at each time, by noise level; infinite memory for a1 and a2, 256 samples for b0 \
                 and b1. Dashed: the simulated operator. The values from 15 s on set the range of a panel.",
                "recursive-arx",
                move |item, results| {
                    let levels = [0.0, 0.1, 0.2, 0.3];
                    make(item, results, "C3", rows, &[m0], &levels, &[(0, "RLS", &[])])
                },
            ));
        }
    }
    all
}

fn recursive_item(name: String, condition: &'static str, rows: &'static [Row], what: &str) -> Item {
    Item::from_study(
        name,
        format!("Recursive ARX and Box-Jenkins (m* = 1) estimates, {what}, condition {condition}"),
        CAPTION,
        "recursive",
        move |item, results| {
            make(
                item,
                results,
                condition,
                rows,
                &REMNANT_ORDERS,
                &[0.01, 0.1, 0.2],
                &[RLS, RPEM],
            )
        },
    )
}

fn make(
    item: &Item,
    results: &Results,
    condition: &str,
    rows: &[Row],
    orders: &[usize],
    levels: &[f64],
    estimators: &[EstimatorCurves],
) -> ItemOutput {
    let mut data = TableBuilder::new(
        &["parameter", "estimator"],
        &[
            "remnant_order",
            "noise_level",
            "t",
            "lower_quartile",
            "median",
            "mean",
            "upper_quartile",
        ],
    );
    let mut panels = Vec::new();
    for (of_rls, of_rpem, name, unit) in rows {
        for m0 in orders {
            let mut curves = Vec::new();
            for (level_at, level) in levels.iter().enumerate() {
                let base = Query::default()
                    .condition(condition)
                    .remnant_order(*m0)
                    .noise_level(*level);
                let Some(cell) = results.cells(&base).first().copied() else {
                    continue;
                };
                for (method, estimator, batch) in estimators {
                    let column = if *method == 0 { of_rls } else { of_rpem };
                    if let Some(trace) = results.traces(cell.index, estimator)
                        && let Some(bands) = trace.parameters.get(*column)
                    {
                        for (k, t) in trace.times_s.iter().enumerate() {
                            data.add_row(
                                &[name, estimator],
                                &[
                                    *m0 as f64,
                                    *level,
                                    *t,
                                    bands.lower_quartile[k],
                                    bands.median[k],
                                    bands.mean[k],
                                    bands.upper_quartile[k],
                                ],
                            );
                        }
                        curves.push(TraceCurve {
                            kind: CurveKind::Estimate,
                            method: *method,
                            level: level_at,
                            times_s: trace.times_s.clone(),
                            values: bands.median.clone(),
                            band: Vec::new(),
                        });
                    }
                    for (fit, from, to) in *batch {
                        let query = base.clone().name(fit);
                        let row = results.find(&query).into_iter().find(|row| row.quantity == *column);
                        if let Some(row) = row {
                            let s = &row.statistics;
                            for t in [*from, *to] {
                                data.add_row(
                                    &[name, fit],
                                    &[
                                        *m0 as f64,
                                        *level,
                                        t,
                                        s.lower_quartile,
                                        s.median,
                                        s.mean,
                                        s.upper_quartile,
                                    ],
                                );
                            }
                            curves.push(TraceCurve {
                                kind: CurveKind::Batch,
                                method: *method,
                                level: level_at,
                                times_s: vec![*from, *to],
                                values: vec![s.median; 2],
                                band: Vec::new(),
                            });
                        }
                    }
                }
                if level_at + 1 == levels.len() {
                    curves.push(truth(cell, name));
                }
            }
            panels.push(TracePanel {
                name: (*name).to_owned(),
                unit: (*unit).to_owned(),
                ordinate: ordinate(&curves),
                curves,
            });
        }
    }
    let alone = orders.len() == 1;
    // The panels of a single order form two columns, unless the last row would then have a single panel.
    let of_one = if panels.len().is_multiple_of(2) { 2 } else { 1 };
    let grid = TraceGrid {
        panels,
        columns: if alone { of_one } else { orders.len() },
        titles: if alone { Vec::new() } else { order_titles() },
        methods: estimators
            .iter()
            .map(|(method, name, _)| format!("{} ({name})", if *method == 0 { "ARX" } else { "BJ" }))
            .collect(),
        levels: levels.iter().map(|level| level_name(*level)).collect(),
        ..TraceGrid::default()
    };
    item.draw(trace_panels, &grid, data)
}

/// Time from which the estimates determine the range of their panels (s); before this time the estimates are still
/// moving away from their initial values.
const SETTLED_S: f64 = 15.0;

/// Range of the ordinate: all true values and batch fits, and the estimates from [`SETTLED_S`] on without the highest
/// and lowest three per cent. Every estimator contributes, even if another is better.
fn ordinate(curves: &[TraceCurve]) -> Ordinate {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for curve in curves {
        let settled = |t: f64| t >= SETTLED_S || curve.kind != CurveKind::Estimate;
        let rows = curve.times_s.iter().zip(&curve.values);
        let kept = rows.filter(|(t, v)| settled(**t) && v.is_finite()).map(|row| *row.1);
        let mut sorted: Vec<f64> = kept.collect();
        sorted.sort_by(f64::total_cmp);
        let share = if curve.kind == CurveKind::Estimate { 0.03 } else { 0.0 };
        for p in [share, 1.0 - share] {
            let value = quantile(&sorted, p);
            low = low.min(value);
            high = high.max(value);
        }
    }
    if low < high {
        Ordinate::Within(low, high)
    } else {
        Ordinate::Robust
    }
}

/// Curve of a parameter or coefficient of the simulated operator over time.
fn truth(cell: &Cell, name: &str) -> TraceCurve {
    let scenario = cell.resolved.scenario();
    let times_s: Vec<f64> = (0..=512)
        .map(|k| scenario.measurement_s * f64::from(k) / 512.0)
        .collect();
    let value = |t: &f64| {
        let operator = cell.resolved.parameters_at(*t).operator;
        let held = operator.discretise(scenario.sample_time).map(|d| d.zoh).ok();
        match name {
            "K_e" => operator.k_e,
            "T_L" => operator.t_l_s,
            "K_e_dot" => operator.k_e_dot(),
            "omega_nm" => operator.omega_nm_rad_s,
            "zeta_nm" => operator.zeta_nm,
            "a1" => held.map_or(f64::NAN, |h| h.f1),
            "a2" => held.map_or(f64::NAN, |h| h.f2),
            "b0" => held.map_or(f64::NAN, |h| h.b0),
            _ => held.map_or(f64::NAN, |h| h.b1),
        }
    };
    TraceCurve {
        kind: CurveKind::Truth,
        method: 0,
        level: 0,
        values: times_s.iter().map(value).collect(),
        times_s,
        band: Vec::new(),
    }
}
