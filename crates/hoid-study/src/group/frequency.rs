//! Describing functions of a group, by Fourier coefficients at the lines of the excitation (see [`hoid_ident::describing`]).
//!
//! For each subject and each condition whose excitation the manifest names: the describing function over the runs that can be read, crossover and
//! phase margin with the controlled element, and gain, lead and delay. They stand beside the parametric fits and assume nothing of their structure.

use std::path::Path;

use hoid_ident::describing::{Averaging, DescribingOptions, Excitation, GainLeadDelayOptions, LineSearch, describe};
use hoid_io::{ColumnKind, ColumnSchema, OutputTable, TableSchema};
use hoid_model::{ContinuousTransferFunction, Record, uncertainty::Estimate};

use super::{
    analysis,
    manifest::{ConditionFacts, Manifest},
};
use crate::columns::Rows;

/// What the describing functions say: a row a line, and a row a subject and condition.
pub(super) struct Frequencies {
    pub lines: OutputTable,
    pub margins: OutputTable,
}

const LINE: [&str; 7] = [
    "omega_rad_s",
    "magnitude_db",
    "magnitude_db_se",
    "phase_deg",
    "phase_deg_se",
    "coherence",
    "spread",
];
const MARGINS: [&str; 10] = [
    "crossover_rad_s",
    "phase_margin_deg",
    "gain",
    "lead_s",
    "delay_s",
    "coherence",
    "off_line_share",
    "noise_ratio",
    "rms_e",
    "rms_u",
];

fn schema(texts: &[&str], numbers: &[String]) -> TableSchema {
    let column = |name: &str, kind| ColumnSchema {
        name: name.to_owned(),
        kind,
    };
    TableSchema {
        comments: Vec::new(),
        columns: texts
            .iter()
            .map(|n| column(n, ColumnKind::Text))
            .chain(numbers.iter().map(|n| column(n, ColumnKind::Real)))
            .collect(),
    }
}

/// Describing functions of all subjects and conditions with an excitation; none where the manifest names none.
pub(super) fn frequencies(manifest: &Manifest, base: &Path) -> Option<Frequencies> {
    manifest.conditions.values().find(|facts| facts.excitation.is_some())?;
    let mut lines = Rows::new(&schema(&["subject", "condition"], &LINE.map(str::to_owned)));
    let with_errors: Vec<String> = MARGINS
        .iter()
        .flat_map(|name| [(*name).to_owned(), format!("{name}_se")])
        .collect();
    let numbers = [vec!["runs".to_owned()], with_errors].concat();
    let mut margins = Rows::new(&schema(&["subject", "condition", "status", "reason"], &numbers));
    let mut known: Vec<(&str, &str)> = Vec::new();
    for run in manifest.runs.iter().filter(|run| run.counts) {
        let key = (run.subject.as_str(), run.condition.as_str());
        let Some(facts) = manifest
            .conditions
            .get(&run.condition)
            .filter(|facts| facts.excitation.is_some())
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
        let records: Vec<Record> = of_cell.filter_map(|r| analysis::read(manifest, base, r).ok()).collect();
        margins.begin();
        margins.text("subject", key.0);
        margins.text("condition", key.1);
        margins.real("runs", records.len() as f64);
        match of_records(&records, facts, key, &mut lines, &mut margins) {
            Ok(()) => margins.text("status", "ok"),
            Err(reason) => {
                margins.text("status", "failed");
                margins.text("reason", &reason);
            }
        }
    }
    Some(Frequencies {
        lines: lines.into_table(Vec::new()),
        margins: margins.into_table(Vec::new()),
    })
}

fn of_records(
    records: &[Record],
    facts: &ConditionFacts,
    (subject, condition): (&str, &str),
    lines: &mut Rows,
    margins: &mut Rows,
) -> Result<(), String> {
    let text = |error: hoid_ident::IdentError| error.to_string();
    let first = records.first().ok_or("no run could be read")?;
    let channel = facts.excitation.clone().ok_or("no excitation is named")?;
    let search = LineSearch {
        period_s: facts.period_s,
        ..LineSearch::default()
    };
    let excitation = Excitation::found_in(first, &channel, &search).map_err(text)?;
    let options = DescribingOptions {
        averaging: Averaging::Reference { channel },
        offset_samples: facts.offset_samples,
        ..DescribingOptions::default()
    };
    let found = describe(records, &excitation, &options).map_err(text)?;
    for line in &found.lines {
        lines.begin();
        lines.text("subject", subject);
        lines.text("condition", condition);
        let (magnitude, phase) = (line.magnitude_db(), line.phase_deg());
        let values = [
            line.omega_rad_s,
            magnitude.value,
            magnitude.standard_error.unwrap_or(f64::NAN),
            phase.value,
            phase.standard_error.unwrap_or(f64::NAN),
            line.coherence.unwrap_or(f64::NAN),
            line.spread.unwrap_or(f64::NAN),
        ];
        LINE.iter()
            .zip(values)
            .for_each(|(name, value)| lines.real(name, value));
    }
    let mut put = |name: &str, estimate: Estimate| {
        margins.real(name, estimate.value);
        margins.real(&format!("{name}_se"), estimate.standard_error.unwrap_or(f64::NAN));
    };
    let coherences: Vec<f64> = found.lines.iter().filter_map(|line| line.coherence).collect();
    put(
        "coherence",
        Estimate::fixed(coherences.iter().sum::<f64>() / coherences.len() as f64),
    );
    put("off_line_share", found.off_line_share);
    put("noise_ratio", found.noise_ratio);
    put("rms_e", found.rms_e);
    put("rms_u", found.rms_u);
    let lead = GainLeadDelayOptions {
        lead: facts.lead,
        ..GainLeadDelayOptions::default()
    };
    let fit = found.fit_gain_lead_delay(&lead).map_err(text)?;
    put("gain", fit.gain);
    put("lead_s", fit.lead_s);
    put("delay_s", fit.delay_s);
    if let Some(element) = &facts.controlled_element {
        let at = found.open_loop(&transfer_function(element)?).margins();
        if let Some(crossover) = at.crossover_rad_s {
            put("crossover_rad_s", crossover);
        }
        if let Some(margin) = at.phase_margin_deg {
            put("phase_margin_deg", margin);
        }
    }
    Ok(())
}

/// `numerator/denominator`, coefficients by falling powers of s, separated by commas.
pub(super) fn transfer_function(text: &str) -> Result<ContinuousTransferFunction, String> {
    let usage = "expected NUM/DEN by falling powers of s, such as 1/1,1,0";
    let (numerator, denominator) = text
        .split_once('/')
        .ok_or_else(|| format!("{text:?} has no slash; {usage}"))?;
    let coefficients = |part: &str| -> Result<Vec<f64>, String> {
        let number = |c: &str| {
            c.trim()
                .parse::<f64>()
                .map_err(|_| format!("{c:?} is no number; {usage}"))
        };
        part.split(',').map(number).collect()
    };
    ContinuousTransferFunction::new(&coefficients(numerator)?, &coefficients(denominator)?)
        .map_err(|error| error.to_string())
}
