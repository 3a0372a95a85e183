//! Orders and delay of the ARX and Box-Jenkins models, chosen before the runs are fitted.
//!
//! A single run determines the delay of a person poorly: the loss of a second-order model is flat over nk, often
//! decreases towards the end of the range, and has several minima; a single sample can change which minimum is
//! selected. The delay is therefore common to all runs of a person in a condition. It is the delay of their operator in
//! the family: `nk = round(tau_e/Ts) + 1`, plus the number of samples by which u is recorded late. If there is no such
//! operator, every nk in the range is fitted jointly to all runs on each of two sub-batches, and nk is the rounded mean
//! of the two best values. nd is the larger of the orders that BIC selects on the two sub-batches of all runs.

use hoid_ident::{Estimator, OrderRanges, choose_orders, order_selection::Criterion};
use hoid_io::OutputTable;
use hoid_model::{Orders, Record, Structure, remnant::RemnantDiscretisation, uncertainty::Estimate};
use hoid_numerics::statistics::mean;

use super::{
    analysis_settings::AnalysisSettings,
    run_rows::RunRows,
    tables::{numbers, texts},
    windows::windows,
};

/// Returns the label of a structure in the tables.
pub(super) fn label_of(structure: Structure) -> &'static str {
    if structure == Structure::Arx { "ARX" } else { "BJ" }
}

/// Returns nk for a delay in s if u is recorded `late_samples` late.
pub(super) fn nk_of(delay_s: f64, sample_time_s: f64, late_samples: f64) -> usize {
    (delay_s / sample_time_s + late_samples).round().max(0.0) as usize + 1
}

/// Chooses the orders of a structure for all runs, with a known or estimated delay. If the delay is estimated, a row is
/// written for the delay of each sub-batch.
pub(super) fn choose(
    settings: &AnalysisSettings,
    records: &[Record],
    structure: Structure,
    known_nk: Option<usize>,
    rows: &mut RunRows<'_>,
) -> Result<(), String> {
    let first = records.first().ok_or("no run could be read")?;
    let mut ranges = ranges(settings, first, structure);
    if let Some(nk) = known_nk {
        ranges.nk = nk..=nk;
    }
    if structure == Structure::BoxJenkins {
        ranges.nd = settings.nd.0..=settings.nd.1;
    }
    let template = Estimator::new(structure, structure.operator_orders(1));
    let mut wanted = Vec::new();
    let mut t_n = Vec::new();
    for which in 0..2 {
        let part = |record: &Record| {
            let window = windows(settings, record)[which];
            record.span(window.from_s, window.to_s).map_err(|e| e.to_string())
        };
        let parts: Vec<Record> = records.iter().map(part).collect::<Result<_, _>>()?;
        let choice = choose_orders(&template, &ranges, Criterion::Bic, &parts).map_err(|e| e.to_string())?;
        let orders = choice.fit.orders();
        if known_nk.is_none() {
            rows.write_row(
                Some(windows(settings, first)[which]),
                label_of(structure),
                "nk_of_window",
                Estimate::fixed(orders.nk as f64),
            );
        }
        if let Ok(remnant) = choice.fit.remnant(RemnantDiscretisation::ZeroOrderHold) {
            t_n.push(remnant.t_n_s.value);
        }
        wanted.push(orders);
    }
    let nk = (wanted.iter().map(|o| o.nk).sum::<usize>() as f64 / wanted.len() as f64).round() as usize;
    let nd = wanted.iter().map(|o| o.nd).max().unwrap_or(0);
    rows.write_row(None, label_of(structure), "nk", Estimate::fixed(nk as f64));
    if structure == Structure::BoxJenkins {
        rows.write_row(None, label_of(structure), "nd", Estimate::fixed(nd as f64));
        let mean = mean(&t_n);
        if mean.is_finite() {
            rows.write_row(None, label_of(structure), "T_n", Estimate::fixed(mean));
        }
    }
    Ok(())
}

/// Returns the orders of a second-order operator as ranges, with nk in the range of delays of the manifest.
pub(super) fn ranges(settings: &AnalysisSettings, record: &Record, structure: Structure) -> OrderRanges {
    let (least, most) = settings.delay_s;
    let samples = |delay_s: f64| (delay_s / record.sample_time().s()).round() as usize + 1;
    let mut ranges = OrderRanges::from(structure.operator_orders(1));
    ranges.nk = samples(least)..=samples(most);
    ranges
}

/// Returns the chosen orders, read from the estimates of a person in a condition, or the reason why no orders were
/// chosen.
pub(super) fn chosen_orders(estimates: &OutputTable, structure: Structure) -> Result<Orders, String> {
    let [window, estimator, parameter, reason] =
        ["window", "estimator", "parameter", "reason"].map(|name| texts(estimates, name));
    let values = numbers(estimates, "value");
    let own = |i: &usize| window[*i].is_empty() && estimator[*i] == label_of(structure);
    let value = |name: &str| {
        let row = (0..values.len()).filter(own).find(|i| parameter[*i] == name)?;
        Some(values[row] as usize)
    };
    let Some(nk) = value("nk") else {
        let row = (0..values.len()).filter(own).find(|i| !reason[*i].is_empty());
        return Err(row.map_or_else(|| "no delay was chosen".to_owned(), |i| reason[i].clone()));
    };
    let default = structure.operator_orders(nk);
    Ok(Orders {
        nd: value("nd").unwrap_or(default.nd),
        ..default
    })
}

#[cfg(test)]
mod tests {
    use super::nk_of;

    #[test]
    fn extra_samples_of_delay_increase_nk() {
        // nk = 1 corresponds to a delay of zero.
        assert_eq!(nk_of(0.0, 0.01, 0.0), 1);
        assert_eq!(nk_of(0.28, 0.01, 0.0), 29);
        assert_eq!(nk_of(0.28, 0.01, 1.0), 30);
        assert_eq!(nk_of(0.284, 0.01, -0.5), 29);
        assert_eq!(nk_of(0.02, 0.01, -9.0), 1);
    }
}
