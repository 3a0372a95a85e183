//! Fits of the family of operators, jointly to all runs of a person in a condition, and to each run in the form chosen
//! by the joint fit.

use hoid_analysis::{Excitation, Identification, IdentifiedModel};
use hoid_ident::family::{FamilyEstimator, FamilyFit, SeenChannel};
use hoid_model::{ContinuousTransferFunction, Form, Record, uncertainty::Estimate};

use super::{
    analysis_settings::AnalysisSettings,
    condition_settings::ConditionSettings,
    manifest::{Manifest, RunEntry},
    person::{ALL_RUNS, Person},
    run_rows::RunRows,
    windows::Window,
};

/// Label of the fit of a single run in the tables.
pub(super) const SINGLE_RUN_LABEL: &str = "family";
/// Label of the joint fit of all runs in the tables.
pub(super) const JOINT_LABEL: &str = "family, all runs";

/// Returns the identification of all runs of a person in a condition, with the settings of the manifest.
pub(super) fn identification(
    manifest: &Manifest,
    condition: &str,
    rows: &RunRows<'_>,
) -> Result<Identification, String> {
    let condition_settings = &rows.condition;
    Ok(Identification {
        estimator: FamilyEstimator {
            channels: condition_settings.channels()?,
            ..manifest.analysis.family_estimator()?
        },
        excitation: (condition_settings.excitation.clone()).map_or(Excitation::Nothing, Excitation::IfRecorded),
        period_s: condition_settings.period_s,
        faults: manifest.read.faults.handling(),
        rate: manifest.rate_decimation(condition)?,
        controlled_element: rows.element().cloned(),
        answers: Vec::new(),
    })
}

/// Returns the estimator for one run.
fn estimator(settings: &AnalysisSettings, condition: &ConditionSettings) -> Result<FamilyEstimator, String> {
    Ok(FamilyEstimator {
        excitation: condition.excitation.clone(),
        period_s: condition.period_s,
        ..settings.family_estimator()?
    })
}

/// Returns the estimator for one run of a person whose forms are known. A single run has no individual parameters.
pub(super) fn estimator_of_run(
    settings: &AnalysisSettings,
    condition: &ConditionSettings,
    form: Form,
    channels: &[SeenChannel],
) -> Result<FamilyEstimator, String> {
    Ok(FamilyEstimator {
        forms: vec![form],
        channels: channels.to_vec(),
        individual: Vec::new(),
        ..estimator(settings, condition)?
    })
}

/// Returns the people of a fit: one person, or one for each run if some parameters are individual.
pub(super) fn people_of_fit(
    key: (&str, &str),
    runs: &[&RunEntry],
    found: &IdentifiedModel,
    element: Option<&ContinuousTransferFunction>,
) -> Vec<Person> {
    let fit = &found.fit;
    let person = |run: &str, record| Person::from_fit(key, run, runs.len(), fit, record, element);
    if fit.operators.len() == 1 {
        return vec![person(ALL_RUNS, 0)];
    }
    let names = found.data.names.iter().enumerate();
    names
        .map(|(record, name)| person(&run_name(runs, name), record))
        .collect()
}

/// Returns the name of the run of a recording, with its time span if the run was cut at a fault.
fn run_name(runs: &[&RunEntry], recording: &str) -> String {
    let of = |entry: &&RunEntry| {
        let span = recording.strip_prefix(&entry.file.display().to_string())?;
        (span.is_empty() || span.starts_with(" (")).then(|| format!("{}{span}", entry.run))
    };
    runs.iter().find_map(of).unwrap_or_else(|| recording.to_owned())
}

/// Writes the rows of a fit to a whole aligned record: parameters, innovation variance, VAF, response, crossover and
/// phase margin.
pub(super) fn write_fit(rows: &mut RunRows<'_>, window: Window, label: &str, fit: &FamilyFit, record: &Record) {
    let of = fit.operator(0);
    for parameter in of.parameters.iter().filter(|p| p.value.is_finite()) {
        let estimate = Estimate {
            value: parameter.value,
            standard_error: parameter.standard_error,
        };
        rows.write_row(Some(window), label, &parameter.name, estimate);
    }
    rows.write_row(
        Some(window),
        label,
        "innovation_variance",
        Estimate::fixed(fit.innovation_variance),
    );
    // The responses to further inputs are removed from u, since the polynomials of the fit do not include them.
    let own = match fit.channels.is_empty() {
        true => Ok(record.clone()),
        false => fit.without_channels(record, FamilyEstimator::default().detrend),
    };
    let vaf_of = own.and_then(|record| Ok((of.polynomial_fit.simulate(&record)?, record)));
    if let Ok((simulated, record)) = vaf_of {
        let vaf = hoid_ident::validation::vaf(&record.output()[simulated.first..], &simulated.values);
        rows.write_row(Some(window), label, "vaf", Estimate::fixed(vaf));
    }
    rows.write_responses(
        label,
        of.polynomial_fit.model(),
        record.sample_time().s(),
        rows.input_lead_s,
    );
    if let Some(measures) = rows.element().and_then(|element| fit.loop_measures(0, element)) {
        rows.write_row(Some(window), label, "crossover_rad_s", measures.crossover_rad_s);
        rows.write_row(Some(window), label, "phase_margin_deg", measures.phase_margin_deg);
    }
}
