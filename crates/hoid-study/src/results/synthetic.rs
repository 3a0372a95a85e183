//! Synthetic results without simulated runs, for fast tests of code that reads results.

use std::collections::BTreeMap;

use super::{
    rows::{TraceStatistics, TraceSummary},
    study_results::Results,
};
use crate::{
    Plan, TrueState,
    plan::{Cell, EstimatorCell, Task},
    true_value,
};

impl Results {
    /// Creates results of a plan without running it. `data` gives the relative error of a quantity that has a true
    /// value, otherwise the quantity itself. The traces follow the steps of the true values, with the relative error of
    /// replication 0 rounded to whole percent and with quartiles 1 % of the true value from the median.
    pub fn synthetic(plan: Plan, data: &dyn Fn(&Cell, &EstimatorCell, &str, u64) -> f64) -> Self {
        const QUANTITIES_WITH_TRUTH: [&str; 14] = [
            "a1",
            "a2",
            "f1",
            "f2",
            "b0",
            "b1",
            "K_e",
            "T_L",
            "K_e_dot",
            "omega_nm",
            "zeta_nm",
            "T_n_backward_euler",
            "K_n_backward_euler",
            "T_n",
        ];
        const OTHER_COLUMNS: [&str; 14] = [
            "K_n",
            "loss",
            "vaf",
            "response_error",
            "innovation_variance",
            "d1",
            "converged",
            "diverged",
            "noise_level_obtained",
            "rms_K_e",
            "rms_T_L",
            "rms_K_e_dot",
            "rms_omega_nm",
            "rms_zeta_nm",
        ];
        let mut results = Self::without_tables(plan);
        let mut fits: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        fits.insert("share_not_convertible".to_owned(), Vec::new());
        let mut row = 0;
        for pair in &mut results.pairs {
            let (cell, estimator) = (&results.plan.cells[pair.cell], &results.plan.estimators[pair.estimator]);
            for replication in 0..cell.replications {
                for name in QUANTITIES_WITH_TRUTH
                    .into_iter()
                    .chain(OTHER_COLUMNS)
                    .chain(["share_not_convertible"])
                {
                    let truth = true_value(cell, estimator, name);
                    let found = data(cell, estimator, name, replication);
                    let value = if truth.is_finite() {
                        truth * (1.0 + found)
                    } else {
                        found
                    };
                    fits.entry(name.to_owned()).or_default().push(value);
                }
                pair.fits.push(row);
                row += 1;
            }
            let (Task::Track(_), Some(every)) = (&estimator.task, results.plan.trace_every) else {
                continue;
            };
            let scenario = cell.resolved.scenario();
            let change_s = scenario.schedule.change_s().unwrap_or(0.0);
            let step = every as f64 * scenario.sample_time.s();
            let times_s: Vec<f64> = (1..)
                .map(|k| f64::from(k) * step - 0.01)
                .take_while(|t| *t < scenario.measurement_s)
                .collect();
            let mut parameters = BTreeMap::new();
            for (i, name) in QUANTITIES_WITH_TRUTH[..11].iter().enumerate() {
                let of = |state: &TrueState| match i {
                    0..2 => state.discrete[i],
                    2..6 => state.discrete[i - 2],
                    _ => state.operator[i - 6],
                };
                let [before, after] = cell.true_states().map(|state| of(&state));
                let off = 1.0 + (100.0 * data(cell, estimator, name, 0)).round() / 100.0;
                let at = |factor: f64| -> Vec<f64> {
                    times_s
                        .iter()
                        .map(|t| factor * if *t < change_s { before } else { after })
                        .collect()
                };
                let bands = TraceStatistics {
                    mean: at(off),
                    sd: at(0.01),
                    lower_quartile: at(off - 0.01 * after.signum()),
                    median: at(off),
                    upper_quartile: at(off + 0.01 * after.signum()),
                };
                parameters.insert((*name).to_owned(), bands);
            }
            results.traces.insert(
                (cell.index, estimator.label.clone()),
                TraceSummary { times_s, parameters },
            );
        }
        results.fits = fits;
        results
    }
}
