//! `pyhoid.design`: a forcing function and the expected errors; the package reads the JSON of the result.

use hoid_design::experiment::{
    DesignOptions, DesignRequest, DifferenceRequest, EntryPoint, ExperimentDesign, OtherForcing, People, Remnant,
    SpreadSource,
};
use hoid_model::{Form, family_scenario::Display};
use hoid_report::{design_figure, runs_figure};
use pyo3::prelude::*;

use crate::{controlled_element::ControlledElement, errors::Outcome, names};

/// Designs an experiment and returns it as JSON.
#[pyfunction]
#[pyo3(signature = (people, *, condition, controlled_element, form, wanted, disturbance, remnant, length, runs, lines, spacing, band, shelf, limits, against, difference, run_to_run, statistics, display, seed))]
#[allow(clippy::too_many_arguments)]
pub fn design(
    py: Python<'_>,
    people: &str,
    condition: Option<String>,
    controlled_element: Option<ControlledElement>,
    form: Option<&str>,
    wanted: Vec<String>,
    disturbance: bool,
    remnant: (f64, f64),
    length: f64,
    runs: Option<usize>,
    lines: usize,
    spacing: u32,
    band: (f64, f64),
    shelf: f64,
    limits: (Option<f64>, Option<f64>),
    against: Option<&str>,
    difference: Option<&str>,
    run_to_run: Option<String>,
    statistics: (f64, f64, Option<String>),
    display: &str,
    seed: u64,
) -> Outcome<String> {
    let (power, alpha, between_people) = statistics;
    let sought = |text: &str| -> Outcome<DifferenceRequest> {
        Ok(DifferenceRequest {
            sought: text.parse()?,
            power,
            alpha,
            between_people: between_people.as_deref().map(SpreadSource::from_text),
        })
    };
    let request = DesignRequest {
        people: People::from_text(people),
        condition,
        controlled_element: controlled_element
            .map(|element| element.transfer_function())
            .transpose()?,
        form: form.map(|name| names::choice::<Form>("form", name)).transpose()?,
        enters: if disturbance {
            EntryPoint::Disturbance
        } else {
            EntryPoint::Target
        },
        remnant: Remnant {
            share: remnant.0,
            time_constant_s: remnant.1,
            ..Remnant::default()
        },
        designing: DesignOptions {
            requested_quantities: wanted.iter().map(|text| text.parse()).collect::<Result<_, _>>()?,
            period_s: length,
            lines,
            spacing,
            band_rad_s: band,
            shelf,
            max_rms: [limits.0, limits.1],
            seed,
            ..DesignOptions::default()
        },
        run_to_run: run_to_run.as_deref().map(SpreadSource::from_text),
        runs,
        against: against.map(OtherForcing::from_text),
        difference: difference.map(sought).transpose()?,
        display: names::choice::<Display>("display", display)?,
    };
    let found = py.detach(|| request.run())?;
    Ok(found.to_json())
}

/// Returns the files of a design, given as JSON: the scenario, the experiment for the lab (empty if there is none), and
/// the lines.
#[pyfunction]
pub fn design_files_of(text: &str, scenario: &str) -> Outcome<(String, String, String)> {
    let found = ExperimentDesign::from_json(text)?;
    Ok((
        found.scenario(),
        found.lab_config(scenario).unwrap_or_default(),
        found.forcing_csv(),
    ))
}

/// Returns two figures of a design as SVG: the lines with the response, and the errors against the number of runs.
#[pyfunction]
pub fn design_figures_of(text: &str) -> Outcome<(String, String)> {
    let found = ExperimentDesign::from_json(text)?;
    Ok((design_figure(&found), runs_figure(&found)))
}
