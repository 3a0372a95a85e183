//! Comparison of fits from other starts with fits from the base start: Figs. F.1 to F.8.

use hoid_study::{Query, Results};

use super::{
    axes::{DELAYS, NOISE_LEVELS, REMNANT_ORDERS, level_name, order_titles},
    item::{Item, ItemOutput},
    table_builder::TableBuilder,
};
use hoid_report::figures::{BoxGrid, BoxPanel, BoxRange, BoxSeries, BoxStatistics, Shade, box_plots};

pub(super) fn items() -> Vec<Item> {
    (1..=8)
        .map(|start| {
            Item::from_study(
                format!("F.{start}"),
                format!(
                    "Bias from start IC{start} minus that from the base start, Box-Jenkins with m* = m0, condition C1"
                ),
                "Relative bias of each run from this start minus that from the base start of Table 6.1, in percentage \
                 points. A line at zero means that both searches found the same minimum within the search tolerance. \
                 The largest difference is given above each panel.",
                "initial-conditions",
                move |item, results| make(item, results, start),
            )
        })
        .collect()
}

fn make(item: &Item, results: &Results, start: usize) -> ItemOutput {
    let mut data = TableBuilder::new(
        &["parameter"],
        &[
            "remnant_order",
            "nk",
            "noise_level",
            "runs",
            "least",
            "lower_quartile",
            "median",
            "upper_quartile",
            "most",
        ],
    );
    let mut panels = Vec::new();
    for (column, symbol, letters) in [
        ("f1", "a_1", "a1"),
        ("f2", "a_2", "a2"),
        ("b0", "b_0", "b0"),
        ("b1", "b_1", "b1"),
    ] {
        for m0 in REMNANT_ORDERS {
            let mut boxes = Vec::new();
            let mut most = 0.0_f64;
            for nk in DELAYS {
                let of_level = |level: &f64| {
                    let query = Query::of(&format!("bias_{column}"))
                        .remnant_order(m0)
                        .noise_level(*level)
                        .nk(nk);
                    let base = results.values(&query.clone().start("base"));
                    let other = results.values(&query.start(&format!("IC{start}")));
                    let differences: Vec<f64> = other.iter().zip(&base).map(|(other, base)| other - base).collect();
                    (*level, differences)
                };
                let group: Vec<(f64, Vec<f64>)> = NOISE_LEVELS.iter().map(of_level).collect();
                for (level, differences) in &group {
                    let s = BoxStatistics::of(differences);
                    let finite = || differences.iter().copied().filter(|v| v.is_finite());
                    most = finite().fold(most, |most, v| most.max(v.abs()));
                    data.add_row(
                        &[letters],
                        &[
                            m0 as f64,
                            nk as f64,
                            *level,
                            s.count as f64,
                            finite().fold(f64::INFINITY, f64::min),
                            s.lower_quartile,
                            s.median,
                            s.upper_quartile,
                            finite().fold(f64::NEG_INFINITY, f64::max),
                        ],
                    );
                }
                boxes.push(
                    group
                        .iter()
                        .map(|(_, differences)| BoxStatistics::of(differences))
                        .collect(),
                );
            }
            panels.push(BoxPanel {
                name: format!("\u{394}B_{{r}}({symbol})"),
                unit: "%".to_owned(),
                boxes,
                note: match most {
                    small if small < 0.01 => format!("at most {small:.0e}"),
                    large => format!("at most {large:.2}"),
                },
                ..BoxPanel::default()
            });
        }
    }
    let series = NOISE_LEVELS.iter().enumerate().map(|(i, level)| BoxSeries {
        name: level_name(*level),
        shade: Shade {
            method: 1,
            level: i,
            levels: NOISE_LEVELS.len(),
        },
    });
    let grid = BoxGrid {
        panels,
        columns: REMNANT_ORDERS.len(),
        titles: order_titles(),
        abscissa: "n_k^*".to_owned(),
        groups: DELAYS.iter().map(usize::to_string).collect(),
        series: series.collect(),
        range: BoxRange::Full,
        shared_ordinates: false,
        with_zero: true,
        min_half_range: 0.01,
    };
    item.draw(box_plots, &grid, data)
}
