//! `pyhoid.compare`: differences between conditions and people; the package reads the JSON of the result.

use std::path::PathBuf;

use hoid_design::compare::{Adjustment, Comparing, Comparison, Covariate, GroupEstimates, Variation, Weights};
use hoid_report::comparison_figure;
use pyo3::prelude::*;

use crate::{errors::Outcome, names};

/// Compares, and returns the result as JSON.
#[pyfunction]
#[pyo3(signature = (results, *, factors, variation, of, covariate, adjust, weights))]
#[allow(clippy::too_many_arguments)]
pub fn compare(
    py: Python<'_>,
    results: PathBuf,
    factors: Vec<String>,
    variation: Option<&str>,
    of: Vec<String>,
    covariate: Option<&str>,
    adjust: &str,
    weights: &str,
) -> Outcome<String> {
    let comparing = Comparing {
        factors: factors.iter().map(|text| text.parse()).collect::<Result<_, _>>()?,
        variation: variation
            .map(|name| names::choice::<Variation>("variation", name))
            .transpose()?,
        of: of.iter().map(|text| text.parse()).collect::<Result<_, _>>()?,
        covariate: covariate
            .map(|name| names::choice::<Covariate>("covariate", name))
            .transpose()?,
        adjustment: names::choice::<Adjustment>("adjust", adjust)?,
        weights: names::choice::<Weights>("weights", weights)?,
    };
    let found = py.detach(|| comparing.run(&GroupEstimates::read(&results)?))?;
    Ok(found.to_json())
}

/// The JSON of a comparison, checked, and its figure as SVG.
#[pyfunction]
pub fn comparison_figure_of(text: &str) -> Outcome<String> {
    Ok(comparison_figure(&Comparison::from_json(text)?))
}
