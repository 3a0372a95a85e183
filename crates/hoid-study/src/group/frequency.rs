//! Describing functions of a group, from the Fourier coefficients at the lines of the excitation (see
//! [`hoid_ident::frequency`]).
//!
//! For each subject and each condition whose manifest entry names an excitation, the tables give the describing
//! function over the readable runs, its verdict, and the crossover and margins with the controlled element, as in
//! `hoid describe` ([`describe_runs`]). The describing functions complement the parametric fits, whose structure they
//! do not assume.
//!
//! Distance of a fit: let `H_j` be the describing function at line j, `s_j` its standard error, and `F_j` the median
//! response of the fits over the runs. The relative distance is `sqrt(sum |F_j - H_j|^2/s_j^2 / sum |H_j|^2/s_j^2)`,
//! with the lines weighted by their precision; the distance in standard errors is `sqrt(mean |F_j - H_j|^2/s_j^2)`.
//! Since the error of a line is estimated from few runs, each error is shrunk towards the median over all lines,
//! `r_j^2 <- (nu r_j^2 + 4 r~^2)/(nu + 4)` with `r = s/|H|` and `nu = 2 (runs - 1)` (moderated variances, Smyth 2004);
//! otherwise an error that is small by chance would dominate. Fit and describing function come from the same runs, so
//! an unbiased fit is closer than one standard error. If the controlled element is known, a fit agrees if its crossover
//! is within 10 % and its phase margin within 5 deg of the values of the describing function, which is about the
//! difference between two experiments with the same person. If it is not known, a fit agrees if its distance is below
//! 10 %. If the task changes within the run, the fit and the describing function average over the change differently,
//! and no agreement is reported.

use std::path::Path;

use hoid_ident::frequency::{DescribingFunction, Line, RecordDescriptionOptions, describe_runs};
use hoid_io::OutputTable;
use hoid_model::{ContinuousTransferFunction, Detrend, ModelError, Record, uncertainty::Estimate};
use hoid_numerics::statistics::mean;

use super::{
    condition_settings::ConditionSettings,
    manifest::Manifest,
    reading::{Pairing, Run, read_run},
    responses::{MedianResponse, ResponseAverages},
    tables::{join_sentences, real_columns, schema, text_columns},
};
use crate::{columns::Rows, statistics::median};

/// Tables of the describing functions: one row per line, one row per subject and condition, and one row per fit.
pub(super) struct FrequencyTables {
    pub lines: OutputTable,
    pub margins: OutputTable,
    pub agreement: OutputTable,
}

const LINE_COLUMNS: [&str; 7] = [
    "omega_rad_s",
    "magnitude_db",
    "magnitude_db_se",
    "phase_deg",
    "phase_deg_se",
    "coherence",
    "spread",
];
const MARGIN_COLUMNS: [&str; 9] = [
    "crossover_rad_s",
    "phase_margin_deg",
    "phase_crossover_rad_s",
    "gain_margin_db",
    "coherence",
    "off_line_share",
    "noise_ratio",
    "rms_e",
    "rms_u",
];

const AGREEMENT_COLUMNS: [&str; 6] = [
    "crossover_rad_s",
    "phase_margin_deg",
    "crossover_difference_percent",
    "phase_margin_difference_deg",
    "distance_percent",
    "distance_in_errors",
];

/// Largest differences at which a fit agrees: of the crossover in %, of the phase margin in deg, and, if there is no
/// crossover, of the response in %.
const AGREEMENT_LIMITS: (f64, f64, f64) = (10.0, 5.0, 10.0);

/// Rows of the tables written so far.
struct Tables {
    lines: Rows,
    margins: Rows,
    agreement: Rows,
}

/// Computes the describing functions of all subjects and conditions with an excitation, and the distances of the fits
/// from them; `None` if the manifest names no excitation.
pub(super) fn frequency_tables(manifest: &Manifest, base: &Path, fits: &ResponseAverages) -> Option<FrequencyTables> {
    manifest
        .conditions
        .values()
        .find(|settings| settings.excitation.is_some())?;
    let with_errors: Vec<String> = MARGIN_COLUMNS
        .iter()
        .flat_map(|name| [(*name).to_owned(), format!("{name}_se")])
        .collect();
    let numbers = [vec!["runs".to_owned()], with_errors].concat();
    let keys = ["subject", "condition"];
    let mut tables = Tables {
        lines: Rows::new(&schema(text_columns(&keys).chain(real_columns(&LINE_COLUMNS)))),
        margins: Rows::new(&schema(
            text_columns(&keys)
                .chain(text_columns(&["status", "reason", "verdict", "reasons"]))
                .chain(real_columns(&numbers)),
        )),
        agreement: Rows::new(&schema(
            text_columns(&keys)
                .chain(text_columns(&["estimator", "agrees"]))
                .chain(real_columns(&AGREEMENT_COLUMNS)),
        )),
    };
    let mut known: Vec<(&str, &str)> = Vec::new();
    for run in manifest.runs.iter().filter(|run| run.counts) {
        let key = (run.subject.as_str(), run.condition.as_str());
        let Some(settings) = manifest
            .conditions
            .get(&run.condition)
            .filter(|settings| settings.excitation.is_some())
        else {
            continue;
        };
        if known.contains(&key) {
            continue;
        }
        known.push(key);
        let of_cell = manifest
            .runs
            .iter()
            .filter(|r| r.counts && (r.subject.as_str(), r.condition.as_str()) == key);
        let runs: Vec<Run> = of_cell
            .filter_map(|r| read_run(manifest, base, r, Pairing::Recorded).ok())
            .collect();
        // A ratio of Fourier coefficients does not include the hold, so the corresponding shift of the input is
        // reversed.
        let late_samples = runs.first().map_or(0.0, |run| {
            run.run_samples(settings.offset_samples) + run.input_lead_s / run.record.sample_time().s()
        });
        let records: Vec<Record> = runs.into_iter().map(|run| run.record).collect();
        let margins = &mut tables.margins;
        margins.start_row();
        margins.set_text("subject", key.0);
        margins.set_text("condition", key.1);
        margins.set_real("runs", records.len() as f64);
        match write_describing_function(&records, (settings, late_samples), key, fits, &mut tables) {
            Ok(()) => tables.margins.set_text("status", "ok"),
            Err(reason) => {
                tables.margins.set_text("status", "failed");
                tables.margins.set_text("reason", &reason);
            }
        }
    }
    Some(FrequencyTables {
        lines: tables.lines.into_table(Vec::new()),
        margins: tables.margins.into_table(Vec::new()),
        agreement: tables.agreement.into_table(Vec::new()),
    })
}

fn write_describing_function(
    records: &[Record],
    (settings, offset_samples): (&ConditionSettings, f64),
    (subject, condition): (&str, &str),
    fits: &ResponseAverages,
    tables: &mut Tables,
) -> Result<(), String> {
    let Tables {
        lines,
        margins,
        agreement,
    } = tables;
    if records.is_empty() {
        return Err("no run could be read".to_owned());
    }
    let element = settings.constant_element();
    let element: Option<ContinuousTransferFunction> = element
        .map(str::parse)
        .transpose()
        .map_err(|error: ModelError| error.to_string())?;
    let options = RecordDescriptionOptions {
        excitation: settings.excitation.clone(),
        period_s: settings.period_s,
        controlled_element: element.clone(),
        offset_samples,
        // The trend was already removed when the runs were read.
        detrend: Detrend::None,
        ..RecordDescriptionOptions::default()
    };
    let description = describe_runs(records, &options).map_err(|error| error.to_string())?;
    let found = &description.function;
    for (line, phase) in found.lines.iter().zip(description.phases_deg()) {
        lines.start_row();
        lines.set_text("subject", subject);
        lines.set_text("condition", condition);
        let magnitude = line.magnitude_db();
        let values = [
            line.omega_rad_s,
            magnitude.value,
            magnitude.standard_error.unwrap_or(f64::NAN),
            phase.value,
            phase.standard_error.unwrap_or(f64::NAN),
            line.coherence.unwrap_or(f64::NAN),
            line.spread.unwrap_or(f64::NAN),
        ];
        LINE_COLUMNS
            .iter()
            .zip(values)
            .for_each(|(name, value)| lines.set_real(name, value));
    }
    margins.set_text("verdict", description.verdict.level.name());
    margins.set_text("reasons", &join_sentences(description.verdict.reasons()));
    let mut put = |name: &str, estimate: Estimate| {
        margins.set_real(name, estimate.value);
        margins.set_real(&format!("{name}_se"), estimate.standard_error.unwrap_or(f64::NAN));
    };
    let coherences: Vec<f64> = found.lines.iter().filter_map(|line| line.coherence).collect();
    put("coherence", Estimate::fixed(mean(&coherences)));
    put("off_line_share", found.off_line_share);
    put("noise_ratio", found.noise_ratio);
    put("rms_e", found.rms_e);
    put("rms_u", found.rms_u);
    let mut margins_of_lines = None;
    if let Some(margins) = &description.margins {
        let at = &margins.estimates;
        let all = [
            ("crossover_rad_s", at.crossover_rad_s),
            ("phase_margin_deg", at.phase_margin_deg),
            ("phase_crossover_rad_s", at.phase_crossover_rad_s),
            ("gain_margin_db", at.gain_margin_db),
        ];
        for (name, estimate) in all {
            if let Some(estimate) = estimate {
                put(name, estimate);
            }
        }
        margins_of_lines = at
            .crossover_rad_s
            .zip(at.phase_margin_deg)
            .map(|(c, m)| (c.value, m.value));
    }
    for (estimator, response) in fits.medians(subject, condition) {
        agreement.start_row();
        agreement.set_text("subject", subject);
        agreement.set_text("condition", condition);
        agreement.set_text("estimator", estimator);
        let (distance, in_errors) = distance(found, &response);
        agreement.set_real("distance_percent", distance);
        agreement.set_real("distance_in_errors", in_errors);
        let mut agrees = distance <= AGREEMENT_LIMITS.2;
        if let Some((crossover, margin)) = margins_of_lines {
            agrees = false;
            if let Some(of_fit) = element.as_ref().and_then(|element| response.crossover(element)) {
                let by = 100.0 * (of_fit.omega_rad_s / crossover - 1.0);
                let turn = of_fit.phase_margin_deg - margin;
                agreement.set_real("crossover_rad_s", of_fit.omega_rad_s);
                agreement.set_real("phase_margin_deg", of_fit.phase_margin_deg);
                agreement.set_real("crossover_difference_percent", by);
                agreement.set_real("phase_margin_difference_deg", turn);
                agrees = by.abs() <= AGREEMENT_LIMITS.0 && turn.abs() <= AGREEMENT_LIMITS.1;
            }
        }
        let verdict = if agrees { "yes" } else { "no" };
        agreement.set_text("agrees", if settings.change_s.is_some() { "" } else { verdict });
    }
    Ok(())
}

/// Returns the distance between a describing function and a fit, in percent and in standard errors. A single run has no
/// standard errors: its lines have equal weights, and the distance is in percent only.
fn distance(found: &DescribingFunction, response: &MedianResponse) -> (f64, f64) {
    const PRIOR_DEGREES_OF_FREEDOM: f64 = 4.0;
    let relative = |line: &Line| line.standard_error.map(|s| s * s / line.response.norm_sqr());
    let known: Vec<f64> = found.lines.iter().filter_map(relative).collect();
    let (middle, nu) = (median(&known), 2.0 * (found.runs.len() as f64 - 1.0));
    let (mut between, mut of_lines, mut count) = (0.0, 0.0, 0.0);
    for line in &found.lines {
        let Some(fit) = response.at(line.omega_rad_s) else {
            continue;
        };
        let size = line.response.norm_sqr();
        let moderated = relative(line)
            .map(|r| (nu * r + PRIOR_DEGREES_OF_FREEDOM * middle) / (nu + PRIOR_DEGREES_OF_FREEDOM) * size);
        let weight = moderated.map_or(1.0, |variance| 1.0 / variance);
        between += weight * (fit - line.response).norm_sqr();
        of_lines += weight * size;
        count += 1.0;
    }
    (
        100.0 * (between / of_lines).sqrt(),
        if known.is_empty() {
            f64::NAN
        } else {
            (between / count).sqrt()
        },
    )
}
