//! Averages of the fits, selected delays, and failed estimates.

use minijinja::{Value, context};

use super::{
    report::GroupReport,
    tables::{reals, texts},
};
use crate::numbers;

/// Columns of the table of averages: parameter and heading. Quantities that scale with u/e have no unit, as in the
/// table of people.
const AVERAGE_COLUMNS: [(&str, &str); 10] = [
    ("K_over_T_I", "K/T_I"),
    ("K", "K"),
    ("K_e", "K_e"),
    ("T_L", "T_L (s)"),
    ("T_I", "T_I (s)"),
    ("K_e_dot", "K_e_dot"),
    ("omega_nm", "omega_nm (rad/s)"),
    ("zeta_nm", "zeta_nm"),
    ("tau_e", "tau_e (s)"),
    ("vaf", "VAF (%)"),
];

/// Returns the headings of the table of averages.
pub(super) fn headings() -> Vec<&'static str> {
    AVERAGE_COLUMNS.iter().map(|(_, heading)| *heading).collect()
}

impl GroupReport<'_> {
    /// Returns one row for each subject, condition and estimator: for each parameter, the median over the runs of the
    /// estimates from whole runs.
    pub(super) fn averages(&self) -> Vec<Value> {
        let table = self.tables.averages;
        let [subject, condition, window, estimator, parameter] =
            ["subject", "condition", "window", "estimator", "parameter"].map(|name| texts(table, name));
        let (median, runs) = (reals(table, "median"), reals(table, "runs"));
        let mut rows: Vec<(String, String, String, Vec<String>, f64)> = Vec::new();
        for i in 0..median.len() {
            let at = AVERAGE_COLUMNS.iter().position(|(name, _)| *name == parameter[i]);
            let Some(at) = at.filter(|_| window[i] == "whole" && self.shows(&subject[i])) else {
                continue;
            };
            let key = |row: &(String, String, String, Vec<String>, f64)| {
                row.0 == subject[i] && row.1 == condition[i] && row.2 == estimator[i]
            };
            let index = rows.iter().position(key).unwrap_or_else(|| {
                rows.push((
                    subject[i].clone(),
                    condition[i].clone(),
                    estimator[i].clone(),
                    vec!["\u{2013}".to_owned(); AVERAGE_COLUMNS.len()],
                    0.0,
                ));
                rows.len() - 1
            });
            rows[index].3[at] = numbers::format_significant(median[i], 4);
            rows[index].4 = rows[index].4.max(runs[i]);
        }
        rows.into_iter()
            .map(|(subject, condition, estimator, cells, runs)| context! { subject, condition, estimator, cells, runs => numbers::format_plain(runs) })
            .collect()
    }

    pub(super) fn delays(&self) -> Vec<Value> {
        let table = self.tables.delays;
        let [subject, condition] = ["subject", "condition"].map(|name| texts(table, name));
        let columns = ["ARX_nk", "BJ_nk", "BJ_nd", "BJ_T_n"].map(|name| reals(table, name));
        (0..subject.len())
            .filter(|i| self.shows(&subject[*i]))
            .map(|i| {
                let cells = columns.map(|column| numbers::format_plain(column.get(i).copied().unwrap_or(f64::NAN)));
                context! { subject => &subject[i], condition => &condition[i], cells => cells.to_vec() }
            })
            .collect()
    }

    /// Returns the failed estimates: for each subject, condition, estimator and status, the number of quantities that
    /// could not be estimated, with the first reason.
    pub(super) fn failures(&self) -> Vec<Value> {
        let table = self.tables.estimates;
        let [subject, condition, estimator, status, reason] =
            ["subject", "condition", "estimator", "status", "reason"].map(|name| texts(table, name));
        let mut found: Vec<([&str; 4], usize, &str)> = Vec::new();
        for i in (0..status.len()).filter(|i| status[*i] != "ok" && self.shows(&subject[*i])) {
            let key = [&subject[i], &condition[i], &estimator[i], &status[i]].map(String::as_str);
            match found.iter_mut().find(|(known, _, _)| *known == key) {
                Some(entry) => entry.1 += 1,
                None => found.push((key, 1, &reason[i])),
            }
        }
        found
            .into_iter()
            .map(|([subject, condition, estimator, status], times, reason)| context! { subject, condition, estimator, status, times, reason })
            .collect()
    }
}
