//! Maps of quantities against the delay n_k* and the order m* of the noise model: VAF, its difference from the VAF of
//! ARX, and absolute biases. Figs. 7, 8, E.1 to E.16.

use hoid_study::{Query, Results};

use super::{
    axes::{NOISE_LEVELS, REMNANT_ORDERS, level_name},
    item::{Item, ItemOutput},
    table_builder::TableBuilder,
};
use hoid_report::figures::{MapColours, MapGrid, MapPanel, maps};

/// Delays in the maps, samples.
const DELAYS: [usize; 6] = [25, 26, 27, 28, 29, 30];
const TRUE_DELAY: usize = 29;

/// Quantity shown in a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MapQuantity {
    Vaf,
    VafDifference,
    Bias,
}

const BIASES: [(&str, &str, &str); 6] = [
    ("b0", "b_0", "b0"),
    ("b1", "b_1", "b1"),
    ("f1", "a_1", "a1"),
    ("f2", "a_2", "a2"),
    ("innovation_variance", "\u{3c3}_\u{3b5}^2", "innovation variance"),
    ("d1", "d_1", "d1"),
];

pub(super) fn items() -> Vec<Item> {
    let mut all = vec![
        item("fig-7".to_owned(), "C1", 3, MapQuantity::Vaf),
        item("fig-8".to_owned(), "C1", 3, MapQuantity::VafDifference),
    ];
    for (condition, first) in [("C1", 1), ("C2", 9)] {
        for m0 in REMNANT_ORDERS {
            all.push(item(
                format!("E.{}", first + 2 * (m0 - 1)),
                condition,
                m0,
                MapQuantity::Vaf,
            ));
            all.push(item(
                format!("E.{}", first + 2 * (m0 - 1) + 1),
                condition,
                m0,
                MapQuantity::Bias,
            ));
        }
    }
    all
}

fn item(name: String, condition: &'static str, m0: usize, shown: MapQuantity) -> Item {
    let (what, how) = match shown {
        MapQuantity::Vaf => (
            "VAF of Box-Jenkins models",
            "Mean of VAF (eq. 39, simulated output) over the runs",
        ),
        MapQuantity::VafDifference => (
            "VAF of Box-Jenkins minus that of ARX models",
            "Mean of the difference (eq. 40) over the runs, both models with the same delay",
        ),
        MapQuantity::Bias => (
            "Absolute relative bias of Box-Jenkins models, P_n = 0.3",
            "Mean of the absolute relative bias (eq. 5.58) over the runs, P_n = 0.3",
        ),
    };
    Item::from_study(
        name,
        format!("{what}, condition {condition}, m0 = {m0}"),
        format!("{how}, by delay nk* and order m* of the noise model; the cross marks the simulated delay and order."),
        "bias",
        move |item, results| make(item, results, condition, m0, shown),
    )
}

fn make(item: &Item, results: &Results, condition: &str, m0: usize, shown: MapQuantity) -> ItemOutput {
    let vaf = if shown == MapQuantity::VafDifference {
        "delta_vaf"
    } else {
        "vaf"
    };
    let mut data = TableBuilder::new(&["quantity"], &["noise_level", "nk", "m", "value"]);
    let panels: Vec<(String, String, f64, String)> = match shown {
        MapQuantity::Bias => BIASES
            .iter()
            .map(|(column, symbol, letters)| {
                (
                    format!("bias_{column}"),
                    format!("|B_r({symbol})|"),
                    0.3,
                    (*letters).to_owned(),
                )
            })
            .collect(),
        _ => NOISE_LEVELS
            .iter()
            .map(|level| (vaf.to_owned(), level_name(*level), *level, vaf.to_owned()))
            .collect(),
    };
    let mut titles = Vec::new();
    let mut drawn = Vec::new();
    for (quantity, title, level, letters) in &panels {
        let at = |m: usize, nk: usize| {
            let base = Query::of(quantity)
                .condition(condition)
                .remnant_order(m0)
                .noise_level(*level)
                .nk(nk);
            let row = results.find_one(&base.name("BJ").nd(m));
            row.map_or(f64::NAN, |row| {
                if shown == MapQuantity::Bias {
                    row.absolute_mean
                } else {
                    row.statistics.mean
                }
            })
        };
        let values: Vec<Vec<f64>> = REMNANT_ORDERS
            .iter()
            .map(|m| DELAYS.iter().map(|nk| at(*m, *nk)).collect())
            .collect();
        for (m, row) in REMNANT_ORDERS.iter().zip(&values) {
            for (nk, value) in DELAYS.iter().zip(row) {
                data.add_row(&[letters], &[*level, *nk as f64, *m as f64, *value]);
            }
        }
        titles.push(title.clone());
        drawn.push(MapPanel {
            name: String::new(),
            values,
            marked: DELAYS.iter().position(|nk| *nk == TRUE_DELAY).map(|x| (x, m0 - 1)),
        });
    }
    let grid = |panels: Vec<MapPanel>, titles: Vec<String>| MapGrid {
        // With two columns the cells have space for their numbers. The biases of b, a and the noise model differ by
        // orders of magnitude, so each pair has its own colour bar.
        columns: 2,
        panels,
        titles,
        abscissa: "n_k^*".to_owned(),
        x_categories: DELAYS.iter().map(usize::to_string).collect(),
        ordinate: "m^*".to_owned(),
        y_categories: REMNANT_ORDERS.iter().map(usize::to_string).collect(),
        value: match shown {
            MapQuantity::Vaf => "VAF (%)".to_owned(),
            MapQuantity::VafDifference => "\u{394}VAF (%)".to_owned(),
            MapQuantity::Bias => "|B_r| (%)".to_owned(),
        },
        colours: if shown == MapQuantity::VafDifference {
            MapColours::Diverging
        } else {
            MapColours::Sequential
        },
        limits: None,
        bar_per_row: shown == MapQuantity::Bias,
        cross_label: "simulated".to_owned(),
    };
    let figure = grid(drawn, titles);
    item.draw(maps, &figure, data)
}
