//! The orders and the delay of the models of a run, chosen beforehand on its sub-batches.

use hoid_ident::{Estimator, OrderRanges, choose_orders, order_selection::Criterion};
use hoid_model::{Orders, Record, Structure, remnant::RemnantDiscretisation, uncertainty::Estimate};

use super::{analysis_settings::AnalysisSettings, run_rows::RunRows, windows::Window};

/// Label of a structure in the tables.
pub(super) fn label_of(structure: Structure) -> &'static str {
    if structure == Structure::Arx { "ARX" } else { "BJ" }
}

/// The orders of a structure, chosen on the sub-batches; a row has the delay of each.
pub(super) fn choose(
    settings: &AnalysisSettings,
    record: &Record,
    structure: Structure,
    windows: &[Window; 3],
    rows: &mut RunRows<'_>,
) -> Result<Orders, String> {
    let mut ranges = ranges(settings, record, structure);
    if structure == Structure::BoxJenkins {
        ranges.nd = settings.nd.0..=settings.nd.1;
    }
    let template = Estimator::new(structure, structure.operator_orders(1));
    let mut wanted = Vec::new();
    let mut t_n = Vec::new();
    for window in &windows[..2] {
        let part = record.span(window.from_s, window.to_s).map_err(|e| e.to_string())?;
        let choice = choose_orders(&template, &ranges, Criterion::Bic, &[part]).map_err(|e| e.to_string())?;
        let orders = choice.fit.orders();
        rows.row(
            Some(*window),
            label_of(structure),
            "nk_of_window",
            Estimate::fixed(orders.nk as f64),
        );
        if let Ok(remnant) = choice.fit.remnant(RemnantDiscretisation::ZeroOrderHold) {
            t_n.push(remnant.t_n_s.value);
        }
        wanted.push(orders);
    }
    let nk = (wanted.iter().map(|o| o.nk).sum::<usize>() as f64 / wanted.len() as f64).round() as usize;
    let nd = wanted.iter().map(|o| o.nd).max().unwrap_or(0);
    rows.row(None, label_of(structure), "nk", Estimate::fixed(nk as f64));
    if structure == Structure::BoxJenkins {
        rows.row(None, label_of(structure), "nd", Estimate::fixed(nd as f64));
        let mean = t_n.iter().sum::<f64>() / t_n.len() as f64;
        if mean.is_finite() {
            rows.row(None, label_of(structure), "T_n", Estimate::fixed(mean));
        }
    }
    Ok(Orders {
        nk,
        nd,
        ..structure.operator_orders(nk)
    })
}

/// The operator's orders with the delays of the manifest.
pub(super) fn ranges(settings: &AnalysisSettings, record: &Record, structure: Structure) -> OrderRanges {
    let (least, most) = settings.delay_s;
    let samples = |delay_s: f64| (delay_s / record.sample_time().s()).round() as usize + 1;
    let mut ranges = OrderRanges::from(structure.operator_orders(1));
    ranges.nk = samples(least)..=samples(most);
    ranges
}
