//! Describing functions with the fits, and the agreement between them.

use hoid_model::uncertainty::Estimate;
use hoid_study::group::Person;
use minijinja::{Value, context};

use super::{
    report::{GroupReport, id_of},
    tables::{reals, rows_of, texts},
};
use crate::{
    figures::{BodeColumn, BodeCurve, BodeGrid, BodePoints, LineKind, Shade, bode_grid},
    numbers,
};

/// Estimators whose fits are drawn, with the index of their colour: as in all figures, ARX is blue and Box-Jenkins
/// vermillion.
const FITS: [(&str, usize); 5] = [
    ("family, all runs", 2),
    ("ARX", 0),
    ("BJ", 1),
    ("grey box", 3),
    ("BJ, all runs", 4),
];

impl GroupReport<'_> {
    /// Measures of the loop from the describing functions, with standard errors; one row for each subject and
    /// condition.
    pub(super) fn margins(&self) -> Vec<Value> {
        let Some(table) = self.tables.frequencies.map(|f| f.margins) else {
            return Vec::new();
        };
        let [subject, condition, reason, verdict] =
            ["subject", "condition", "reason", "verdict"].map(|name| texts(table, name));
        let cell = |name: &str, i: usize| {
            let value = reals(table, name).get(i).copied().filter(|v| v.is_finite());
            let error = reals(table, &format!("{name}_se"))
                .get(i)
                .copied()
                .filter(|v| v.is_finite());
            match (value, error) {
                (None, _) => "\u{2013}".to_owned(),
                (Some(value), None) => numbers::format_fixed(value, 3),
                (Some(value), error) => {
                    let (value, error) = numbers::with_uncertainty(value, error);
                    format!("{value} \u{b1} {error}")
                }
            }
        };
        (0..subject.len())
            .filter(|i| self.shows(&subject[*i]))
            .map(|i| {
                let names = [
                    "crossover_rad_s",
                    "phase_margin_deg",
                    "gain_margin_db",
                    "coherence",
                    "off_line_share",
                ];
                let cells = names.map(|name| cell(name, i)).to_vec();
                context! { subject => &subject[i], condition => &condition[i], reason => &reason[i], verdict => &verdict[i], cells }
            })
            .collect()
    }

    /// Bode diagrams of the describing functions, one figure for each condition with a column for each subject.
    pub(super) fn describing_functions(&self) -> Vec<Value> {
        let figures = self.describing_figures(false).into_iter();
        figures
            .map(|(condition, figure)| context! { condition, figure })
            .collect()
    }

    /// Bode diagrams of the describing functions as pairs of name and SVG text. If `narrow` is true, each figure has a
    /// single column with one subject.
    pub(super) fn describing_figures(&self, narrow: bool) -> Vec<(String, String)> {
        let Some(lines) = self.tables.frequencies.map(|f| f.lines) else {
            return Vec::new();
        };
        let (subjects, conditions) = self.subjects_and_conditions();
        let column = |condition: &str, subject: &str| {
            let rows = rows_of(lines, subject, condition);
            let pick = |name: &str| rows.iter().map(|i| reals(lines, name)[*i]).collect::<Vec<f64>>();
            let omega = pick("omega_rad_s");
            let mut curves = Vec::new();
            if let (Some(low), Some(high)) = (omega.first(), omega.last()) {
                curves = self.fits(subject, condition, (*low, *high));
            }
            let estimates = |name: &str| {
                let errors = pick(&format!("{name}_se"));
                let estimate = |(value, error): (f64, f64)| Estimate {
                    value,
                    standard_error: Some(error).filter(|e| e.is_finite()),
                };
                pick(name)
                    .into_iter()
                    .zip(errors)
                    .map(estimate)
                    .collect::<Vec<Estimate>>()
            };
            let points = BodePoints {
                name: "describing function".to_owned(),
                magnitude_db: estimates("magnitude_db"),
                phase_deg: estimates("phase_deg"),
                delay_s: self.delay_s(subject, condition),
                omega_rad_s: omega,
            };
            curves.push(BodeCurve::of_points(&points, Shade::of_method(5)));
            BodeColumn {
                title: format!("subject {subject}"),
                curves,
            }
        };
        // Not every subject has runs in every condition.
        let columns = |condition: &str| -> Vec<BodeColumn> {
            let took_part = |subject: &&&str| !rows_of(lines, subject, condition).is_empty();
            let there = subjects.iter().filter(took_part);
            there.map(|subject| column(condition, subject)).collect()
        };
        let mut figures = Vec::new();
        for condition in conditions.iter() {
            let all = columns(condition);
            let title = format!("Describing functions, condition {condition}");
            if narrow && all.len() > 1 {
                for column in all {
                    let name = format!("{condition}-{}", column.title.trim_start_matches("subject "));
                    let grid = BodeGrid { columns: vec![column] };
                    figures.push((name.clone(), bode_grid(&id_of("describing", &name), &title, &grid)));
                }
            } else if !all.is_empty() {
                let figure = bode_grid(&id_of("describing", condition), &title, &BodeGrid { columns: all });
                figures.push((condition.to_string(), figure));
            }
        }
        figures
    }

    /// Delay of a person (s), for unwrapping the phase from line to line; 0 if unknown.
    fn delay_s(&self, subject: &str, condition: &str) -> f64 {
        let of = |p: &&Person| p.subject == subject && p.condition == condition;
        let person = self.summary.people.iter().find(of);
        let delay = person.and_then(|p| p.parameter("tau_e")).map(|tau| tau.value);
        delay.unwrap_or(0.0)
    }

    /// Returns the curve of each estimator: the median over the runs of the fitted response in a frequency range, with
    /// the quartiles as a band.
    fn fits(&self, subject: &str, condition: &str, (low, high): (f64, f64)) -> Vec<BodeCurve> {
        let table = self.tables.responses;
        let (estimators, omega) = (texts(table, "estimator"), reals(table, "omega_rad_s"));
        let rows = rows_of(table, subject, condition);
        let curve = |(estimator, method): (&str, usize)| {
            // The frequency range is 10 % wider on both sides, so the curves cover the lines.
            let inside = |i: &&usize| estimators[**i] == estimator && (0.9 * low..=1.1 * high).contains(&omega[**i]);
            let at: Vec<usize> = rows.iter().filter(inside).copied().collect();
            let pick = |name: &str| at.iter().map(|i| reals(table, name)[*i]).collect::<Vec<f64>>();
            let band = |name: &str| {
                let upper = pick(&format!("{name}_upper_quartile"));
                pick(&format!("{name}_lower_quartile")).into_iter().zip(upper).collect()
            };
            (!at.is_empty()).then(|| BodeCurve {
                magnitude_db: pick("magnitude_db_median"),
                phase_deg: pick("phase_deg_median"),
                magnitude_band: band("magnitude_db"),
                phase_band: band("phase_deg"),
                ..BodeCurve::of_response(
                    estimator,
                    LineKind::Line,
                    Shade::of_method(method),
                    &pick("omega_rad_s"),
                    &[],
                    0.0,
                )
            })
        };
        FITS.into_iter().filter_map(curve).collect()
    }

    /// Agreement between the fits and the describing function, one row for each subject, condition and estimator.
    pub(super) fn agreement(&self) -> Vec<Value> {
        let Some(table) = self.tables.frequencies.map(|f| f.agreement) else {
            return Vec::new();
        };
        let [subject, condition, estimator, agrees] =
            ["subject", "condition", "estimator", "agrees"].map(|name| texts(table, name));
        let columns = [
            ("crossover_rad_s", 2),
            ("crossover_difference_percent", 1),
            ("phase_margin_deg", 1),
            ("phase_margin_difference_deg", 1),
            ("distance_percent", 0),
            ("distance_in_errors", 1),
        ]
        .map(|(name, digits)| (reals(table, name), digits));
        (0..subject.len())
            .filter(|i| self.shows(&subject[*i]))
            .map(|i| {
                let cells = columns.map(|(column, digits)| numbers::format_fixed(column.get(i).copied().unwrap_or(f64::NAN), digits)).to_vec();
                context! { subject => &subject[i], condition => &condition[i], estimator => &estimator[i], agrees => &agrees[i], cells }
            })
            .collect()
    }
}
