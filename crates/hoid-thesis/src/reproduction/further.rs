//! What the text leaves for later: decimation, T_n = 0.2 s, the second definition of the noise level, memories, forgetting matrix; and the
//! example of a study of one's own.

use hoid_study::{Query, Results, SummaryRow};

use super::{Data, Item, Made, REMNANT_ORDERS, level_name, order_titles};
use hoid_report::figures::{
    BoxGrid, BoxPanel, BoxRange, BoxSeries, BoxStatistics, Curve, CurveGrid, CurvePanel, LineKind, Shade, box_plots,
    curves,
};

const OPERATOR: [(&str, &str); 5] = [
    ("K_e", "K_e"),
    ("T_L", "T_L"),
    ("K_e_dot", "K_{\u{117}}"),
    ("omega_nm", "\u{3c9}_{nm}"),
    ("zeta_nm", "\u{3b6}_{nm}"),
];

pub(super) fn items() -> Vec<Item> {
    let mut all = vec![
        Item::of_study(
            "decimation",
            "Error of the frequency response by sample time, condition C1, P_n = 0.1",
            "Median over the runs of the relative error of the response over the lines of the forcing function; bars: quartiles. Every k-th sample of runs at \
             100 Hz; the delay is 0.28 s.",
            "decimation",
            decimation,
        ),
        Item::of_study(
            "memory",
            "Error of recursive estimates by memory, condition C4, P_n = 0.1",
            "Median over the runs of the root mean square of the relative error from 10 s on; bars: quartiles.",
            "memory",
            memory,
        ),
        Item::of_study(
            "memory-settling",
            "Settling of recursive estimates by memory, condition C4, P_n = 0.1",
            "Time after the change at which the median trace has covered 90 % of the step of K_e_dot. A point that is missing has not settled within the run.",
            "memory",
            settling,
        ),
        Item::of_study(
            "forgetting",
            "Forgetting factor against forgetting matrix, P_n = 0.1",
            "Root mean square of the relative error of each run from 10 s on. Light: one factor for all, 256 samples; dark: a matrix that forgets b alone.",
            "forgetting",
            forgetting,
        ),
        Item::of_study(
            "lead-change",
            "How well a change of T_L by 20 % shows within 5 s",
            "Distance of the medians of T_L at 45.9 and 40.6 s in their spreads (interquartile range / 1.349, mean of both), the change is at 40.96 s. At 2.5 a threshold \
             with 5 % false alarms finds 80 % of the changes.",
            "lead-change",
            lead_change,
        ),
    ];
    for condition in ["C1", "C2"] {
        all.push(Item::of_study(
            format!("remnant-time-constant-{condition}"),
            format!("Bias by time constant of the remnant, condition {condition}"),
            "Relative bias with nk = 29, Box-Jenkins with m* = 1, by T_n.",
            "remnant-time-constant",
            move |item, results| by_axis(item, results, condition, "remnant_T_n_s", &["0.06", "0.2"], "T_n (s)"),
        ));
        all.push(Item::of_study(
            format!("noise-definition-{condition}"),
            format!("Bias by definition of the noise level, P_n = 0.1, condition {condition}"),
            "Relative bias with nk = 29, Box-Jenkins with m* = 1. response: P_n = var(u_n)/var(u); remnant: P_n = var(n)/var(u).",
            "noise-definition",
            move |item, results| {
                by_axis(item, results, condition, "remnant_noise_definition", &["response", "remnant"], "definition of P_n")
            },
        ));
    }
    all
}

/// A curve of medians with bars from quartile to quartile.
fn with_quartiles(name: &str, shade: Shade, points: &[(f64, &SummaryRow)]) -> Curve {
    Curve {
        name: name.to_owned(),
        kind: LineKind::Marked,
        shade,
        x: points.iter().map(|(x, _)| *x).collect(),
        y: points.iter().map(|(_, row)| row.statistics.median).collect(),
        band: Vec::new(),
        bars: points
            .iter()
            .map(|(_, row)| (row.statistics.lower_quartile, row.statistics.upper_quartile))
            .collect(),
    }
}

fn decimation(item: &Item, results: &Results) -> Made {
    const ESTIMATORS: [&str; 7] = [
        "ARX",
        "BJ, whole delay",
        "BJ, fractional delay",
        "BJ, Pade 1",
        "BJ, Pade 2",
        "BJ, Pade 3",
        "grey box",
    ];
    let mut data = Data::new(
        &["estimator"],
        &[
            "remnant_order",
            "sample_time_s",
            "lower_quartile",
            "median",
            "upper_quartile",
        ],
    );
    let orders = [1, 2];
    let mut panels = Vec::new();
    for m0 in orders {
        let mut drawn = Vec::new();
        for (i, name) in ESTIMATORS.into_iter().enumerate() {
            let mut points = Vec::new();
            for k in 1..=8 {
                if let Some(row) = results.one(&Query::of("response_error").remnant_order(m0).name(name).decimate(k)) {
                    let s = &row.statistics;
                    data.row(
                        &[name],
                        &[m0 as f64, 0.01 * k as f64, s.lower_quartile, s.median, s.upper_quartile],
                    );
                    points.push((0.01 * k as f64, row));
                }
            }
            // Blue for ARX, shades of vermillion for Box-Jenkins, green for the grey box.
            let shade = match i {
                0 => Shade::of_method(0),
                6 => Shade::of_method(2),
                i => Shade {
                    method: 1,
                    level: i - 1,
                    levels: 5,
                },
            };
            drawn.push(with_quartiles(name, shade, &points));
        }
        panels.push(CurvePanel {
            name: "response error".to_owned(),
            unit: "%".to_owned(),
            logarithmic: true,
            within: None,
            curves: drawn,
        });
    }
    let grid = CurveGrid {
        panels,
        columns: orders.len(),
        titles: orders.iter().map(|m| format!("m^0 = {m}")).collect(),
        abscissa: "T_s (s)".to_owned(),
        logarithmic_abscissa: false,
        shared_ordinates: true,
    };
    Made {
        svg: Some(curves(&item.name, &item.title, &grid)),
        data: data.table(&item.title),
    }
}

const MEMORIES: [(&str, f64); 5] = [("0.5s", 0.5), ("1s", 1.0), ("2.56s", 2.56), ("5s", 5.0), ("10s", 10.0)];

fn memory(item: &Item, results: &Results) -> Made {
    let mut data = Data::new(
        &["parameter", "estimator"],
        &[
            "remnant_order",
            "memory_s",
            "lower_quartile",
            "median",
            "upper_quartile",
        ],
    );
    let mut panels = Vec::new();
    for (parameter, symbol) in OPERATOR {
        for m0 in REMNANT_ORDERS {
            let mut drawn = Vec::new();
            for (method, name) in ["RLS", "RPEM"].into_iter().enumerate() {
                let mut points = Vec::new();
                for (label, seconds) in MEMORIES {
                    let query = Query::of(&format!("rms_{parameter}"))
                        .remnant_order(m0)
                        .name(name)
                        .axis("memory", label);
                    if let Some(row) = results.one(&query) {
                        let s = &row.statistics;
                        data.row(
                            &[parameter, name],
                            &[m0 as f64, seconds, s.lower_quartile, s.median, s.upper_quartile],
                        );
                        points.push((seconds, row));
                    }
                }
                drawn.push(with_quartiles(name, Shade::of_method(method), &points));
            }
            panels.push(CurvePanel {
                name: format!("error of {symbol}"),
                unit: "%".to_owned(),
                logarithmic: true,
                within: None,
                curves: drawn,
            });
        }
    }
    let grid = CurveGrid {
        panels,
        columns: REMNANT_ORDERS.len(),
        titles: order_titles(),
        abscissa: "memory (s)".to_owned(),
        logarithmic_abscissa: true,
        shared_ordinates: false,
    };
    Made {
        svg: Some(curves(&item.name, &item.title, &grid)),
        data: data.table(&item.title),
    }
}

fn settling(item: &Item, results: &Results) -> Made {
    let mut data = Data::new(&["estimator"], &["remnant_order", "memory_s", "settling_s"]);
    let mut panels = Vec::new();
    for m0 in REMNANT_ORDERS {
        let mut drawn = Vec::new();
        for (method, name) in ["RLS", "RPEM"].into_iter().enumerate() {
            let time = |label: &str| {
                let query = Query::of("settle90_of_median_K_e_dot")
                    .remnant_order(m0)
                    .name(name)
                    .axis("memory", label);
                results.one(&query).map_or(f64::NAN, |row| row.statistics.median)
            };
            let y: Vec<f64> = MEMORIES.iter().map(|(label, _)| time(label)).collect();
            for ((_, seconds), settling) in MEMORIES.iter().zip(&y) {
                data.row(&[name], &[m0 as f64, *seconds, *settling]);
            }
            drawn.push(Curve {
                name: name.to_owned(),
                kind: LineKind::Marked,
                shade: Shade::of_method(method),
                x: MEMORIES.iter().map(|(_, seconds)| *seconds).collect(),
                y,
                band: Vec::new(),
                bars: Vec::new(),
            });
        }
        panels.push(CurvePanel {
            name: "90 % of the step".to_owned(),
            unit: "s".to_owned(),
            logarithmic: true,
            within: None,
            curves: drawn,
        });
    }
    let grid = CurveGrid {
        panels,
        columns: REMNANT_ORDERS.len(),
        titles: order_titles(),
        abscissa: "memory (s)".to_owned(),
        logarithmic_abscissa: true,
        shared_ordinates: true,
    };
    Made {
        svg: Some(curves(&item.name, &item.title, &grid)),
        data: data.table(&item.title),
    }
}

fn forgetting(item: &Item, results: &Results) -> Made {
    const CONDITIONS: [&str; 4] = ["C3", "C4", "C5", "C6"];
    const ESTIMATORS: [(&str, usize, usize); 4] = [
        ("RLS, factor", 0, 0),
        ("RLS, matrix", 0, 1),
        ("RPEM, factor", 1, 0),
        ("RPEM, matrix", 1, 1),
    ];
    let series = ESTIMATORS.map(|(name, method, level)| BoxSeries {
        name: name.to_owned(),
        shade: Shade {
            method,
            level,
            levels: 2,
        },
    });
    let rows: Vec<(String, String)> = OPERATOR
        .map(|(p, symbol)| (format!("rms_{p}"), format!("error of {symbol}")))
        .to_vec();
    let query = |quantity: &str, m0: usize, group: &str, series: usize| {
        Query::of(quantity)
            .remnant_order(m0)
            .condition(group)
            .name(ESTIMATORS[series].0)
    };
    let layout = Layout {
        rows: &rows,
        abscissa: "condition",
        groups: &CONDITIONS,
        series: &series,
        with_zero: false,
    };
    boxes(item, results, &layout, query)
}

fn by_axis(item: &Item, results: &Results, condition: &str, axis: &str, groups: &[&str], abscissa: &str) -> Made {
    let mut levels: Vec<f64> = results
        .plan
        .cells
        .iter()
        .filter_map(|cell| level_of(&cell.axes))
        .collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    if levels.is_empty() {
        levels.push(0.1);
    }
    let mut series = Vec::new();
    let mut of = Vec::new();
    for (method, name) in ["ARX", "BJ"].into_iter().enumerate() {
        for (level, p_n) in levels.iter().enumerate() {
            series.push(BoxSeries {
                name: format!("{name}, {}", level_name(*p_n)),
                shade: Shade {
                    method,
                    level,
                    levels: levels.len(),
                },
            });
            of.push((name, *p_n));
        }
    }
    let rows: Vec<(String, String)> = OPERATOR
        .map(|(p, symbol)| (format!("bias_{p}"), format!("B_r({symbol})")))
        .to_vec();
    let query = |quantity: &str, m0: usize, group: &str, series: usize| {
        let (name, p_n) = of[series];
        Query::of(quantity)
            .condition(condition)
            .remnant_order(m0)
            .axis(axis, group)
            .noise_level(p_n)
            .name(name)
    };
    let layout = Layout {
        rows: &rows,
        abscissa,
        groups,
        series: &series,
        with_zero: true,
    };
    boxes(item, results, &layout, query)
}

fn level_of(axes: &[hoid_study::plan::Axis]) -> Option<f64> {
    axes.iter()
        .find(|axis| axis.key == "remnant_noise_level")?
        .value
        .parse()
        .ok()
}

/// Rows, groups and series of box plots.
#[derive(Clone, Copy)]
struct Layout<'a> {
    /// Quantity and label of each row of panels.
    rows: &'a [(String, String)],
    abscissa: &'a str,
    groups: &'a [&'a str],
    series: &'a [BoxSeries],
    with_zero: bool,
}

/// Box plots of some quantities by remnant order, group and series.
fn boxes(
    item: &Item,
    results: &Results,
    layout: &Layout<'_>,
    query: impl Fn(&str, usize, &str, usize) -> Query,
) -> Made {
    let Layout {
        rows,
        abscissa,
        groups,
        series,
        with_zero,
    } = *layout;
    let mut data = Data::new(
        &["quantity", "group", "series"],
        &[
            "remnant_order",
            "runs",
            "lower_whisker",
            "lower_quartile",
            "median",
            "upper_quartile",
            "upper_whisker",
        ],
    );
    let mut panels = Vec::new();
    for (quantity, label) in rows {
        for m0 in REMNANT_ORDERS {
            let mut of_panel = Vec::new();
            for group in groups {
                let mut of_group = Vec::new();
                for (i, of) in series.iter().enumerate() {
                    let s = BoxStatistics::of(&results.values(&query(quantity, m0, group, i)));
                    data.row(
                        &[quantity, group, &of.name],
                        &[
                            m0 as f64,
                            s.count as f64,
                            s.lower_whisker,
                            s.lower_quartile,
                            s.median,
                            s.upper_quartile,
                            s.upper_whisker,
                        ],
                    );
                    of_group.push(s);
                }
                of_panel.push(of_group);
            }
            panels.push(BoxPanel {
                name: label.clone(),
                unit: "%".to_owned(),
                boxes: of_panel,
            });
        }
    }
    let grid = BoxGrid {
        panels,
        columns: REMNANT_ORDERS.len(),
        titles: order_titles(),
        abscissa: abscissa.to_owned(),
        groups: groups.iter().map(|g| (*g).to_owned()).collect(),
        series: series.to_vec(),
        range: BoxRange::Whiskers,
        shared_ordinates: false,
        with_zero,
        least_reach: 0.0,
    };
    Made {
        svg: Some(box_plots(&item.name, &item.title, &grid)),
        data: data.table(&item.title),
    }
}

/// Median and spread of T_L at the kept time nearest before one.
fn at_time(results: &Results, cell: u64, estimator: &str, time_s: f64) -> Option<(f64, f64)> {
    let trace = results.traces(cell, estimator)?;
    let bands = trace.parameters.get("T_L")?;
    let k = trace.times_s.iter().rposition(|t| *t <= time_s)?;
    Some((
        bands.median[k],
        (bands.upper_quartile[k] - bands.lower_quartile[k]) / 1.349,
    ))
}

fn lead_change(item: &Item, results: &Results) -> Made {
    let mut data = Data::new(
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
                let Some(p_n) = level_of(&cell.axes) else { continue };
                let (Some(before), Some(after)) = (
                    at_time(results, cell.index, &estimator.label, 40.7),
                    at_time(results, cell.index, &estimator.label, 45.96),
                ) else {
                    continue;
                };
                let distance = (after.0 - before.0) / (0.5 * (before.1 + after.1));
                data.row(
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
            name: "80 % found at 5 % false alarms".to_owned(),
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
            within: None,
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
    Made {
        svg: Some(curves(&item.name, &item.title, &grid)),
        data: data.table(&item.title),
    }
}
