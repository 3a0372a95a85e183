//! Error and settling time of recursive estimates as functions of the memory length.

use hoid_report::figures::{Curve, CurveGrid, CurvePanel, LineKind, Shade, curves};
use hoid_study::{Query, Results};

use super::{
    super::{
        axes::{REMNANT_ORDERS, order_titles},
        item::{Item, ItemOutput},
        table_builder::TableBuilder,
    },
    quartiles::with_quartiles,
    symbols::OPERATOR,
};

const MEMORIES: [(&str, f64); 5] = [("0.5s", 0.5), ("1s", 1.0), ("2.56s", 2.56), ("5s", 5.0), ("10s", 10.0)];

pub(super) fn items() -> Vec<Item> {
    vec![
        Item::from_study(
            "memory",
            "Error of recursive estimates by memory, condition C4, P_n = 0.1",
            "Median over the runs of the root mean square of the relative error from 10 s on; bars: quartiles.",
            "memory",
            memory,
        ),
        Item::from_study(
            "memory-settling",
            "Settling of recursive estimates by memory, condition C4, P_n = 0.1",
            "Time after the change at which the median trace has covered 90 % of the step of K_e_dot. A missing point did not settle within the run.",
            "memory",
            settling,
        ),
    ]
}

fn memory(item: &Item, results: &Results) -> ItemOutput {
    let mut data = TableBuilder::new(
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
                    if let Some(row) = results.find_one(&query) {
                        let s = &row.statistics;
                        data.add_row(
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
                ordinate_range: None,
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
    item.draw(curves, &grid, data)
}

fn settling(item: &Item, results: &Results) -> ItemOutput {
    let mut data = TableBuilder::new(&["estimator"], &["remnant_order", "memory_s", "settling_s"]);
    let mut panels = Vec::new();
    for m0 in REMNANT_ORDERS {
        let mut drawn = Vec::new();
        for (method, name) in ["RLS", "RPEM"].into_iter().enumerate() {
            let time = |label: &str| {
                let query = Query::of("settle90_of_median_K_e_dot")
                    .remnant_order(m0)
                    .name(name)
                    .axis("memory", label);
                results.find_one(&query).map_or(f64::NAN, |row| row.statistics.median)
            };
            let y: Vec<f64> = MEMORIES.iter().map(|(label, _)| time(label)).collect();
            for ((_, seconds), settling) in MEMORIES.iter().zip(&y) {
                data.add_row(&[name], &[m0 as f64, *seconds, *settling]);
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
            ordinate_range: None,
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
    item.draw(curves, &grid, data)
}
