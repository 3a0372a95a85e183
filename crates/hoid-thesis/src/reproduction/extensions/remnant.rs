//! Bias as a function of the time constant of the remnant, and for the two definitions of the noise level.

use hoid_report::figures::{BoxSeries, Shade};
use hoid_study::{Query, Results};

use super::{
    super::{
        axes::level_name,
        item::{Item, ItemOutput},
    },
    boxes::{Layout, boxes},
    symbols::{OPERATOR, noise_level_of},
};

pub(super) fn items() -> Vec<Item> {
    let mut all = Vec::new();
    for condition in ["C1", "C2"] {
        all.push(Item::from_study(
            format!("remnant-time-constant-{condition}"),
            format!("Bias by time constant of the remnant, condition {condition}"),
            "Relative bias with nk = 29, Box-Jenkins with m* = 1, by T_n.",
            "remnant-time-constant",
            move |item, results| biases_by_axis(item, results, condition, "remnant_T_n_s", &["0.06", "0.2"], "T_n (s)"),
        ));
        all.push(Item::from_study(
            format!("noise-definition-{condition}"),
            format!("Bias by definition of the noise level, P_n = 0.1, condition {condition}"),
            "Relative bias with nk = 29, Box-Jenkins with m* = 1. response: P_n = var(u_n)/var(u); remnant: P_n = var(n)/var(u).",
            "noise-definition",
            move |item, results| {
                biases_by_axis(item, results, condition, "remnant_noise_definition", &["response", "remnant"], "definition of P_n")
            },
        ));
    }
    all
}

fn biases_by_axis(
    item: &Item,
    results: &Results,
    condition: &str,
    axis: &str,
    groups: &[&str],
    abscissa: &str,
) -> ItemOutput {
    let mut levels: Vec<f64> = results
        .plan
        .cells
        .iter()
        .filter_map(|cell| noise_level_of(&cell.axes))
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
