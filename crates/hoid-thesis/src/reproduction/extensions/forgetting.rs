//! Comparison of a forgetting factor with a forgetting matrix.

use hoid_report::figures::{BoxSeries, Shade};
use hoid_study::{Query, Results};

use super::{
    super::item::{Item, ItemOutput},
    boxes::{Layout, boxes},
    symbols::OPERATOR,
};

pub(super) fn items() -> Vec<Item> {
    vec![Item::from_study(
        "forgetting",
        "Forgetting factor against forgetting matrix, P_n = 0.1",
        "Root mean square of the relative error of each run from 10 s on. Light: one factor for all parameters, 256 samples; dark: a matrix that forgets only b.",
        "forgetting",
        forgetting,
    )]
}

fn forgetting(item: &Item, results: &Results) -> ItemOutput {
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
