//! `pyhoid.identify` by default: an operator of the family of operators.

use std::{borrow::Cow, path::PathBuf};

use hoid_analysis::{IdentifiedModel, Recordings};
use hoid_ident::family::{AgreementMethod, ClusterKind, FormFigures, LoopMeasures, LoopShape, Parameter};
use hoid_report::{Report, write_report};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::{self, ChannelSelection, array, matrix},
    controlled_element::ControlledElement,
    errors::Outcome,
    faults::{UsedRecord, faults_of, used_records},
    figures::{self, ValueWithError, response_columns, value_and_error, verdict},
    fit::PyFit,
};

/// The operator of a person; the package wraps it in `pyhoid.OperatorFit`.
#[pyclass(name = "OperatorFit", module = "pyhoid._pyhoid", frozen)]
pub struct PyOperatorFit(pub IdentifiedModel);

/// Name, unit, value, standard errors for the runs and for the person, interval, share of the prior, whether the data
/// determine the parameter, and the forms over which it was averaged.
type ParameterParts = (
    String,
    &'static str,
    f64,
    [Option<f64>; 2],
    Option<(f64, f64)>,
    f64,
    bool,
    Vec<&'static str>,
);

fn parameter(p: &Parameter) -> ParameterParts {
    (
        p.name.clone(),
        p.unit,
        p.value,
        [p.standard_error, p.standard_error_person],
        p.interval,
        p.prior_share,
        p.determined,
        p.averaged_over.iter().map(|form| form.name()).collect(),
    )
}

fn loop_parts<'py>(py: Python<'py>, measures: Option<LoopMeasures>) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    all.set_item("crossover_rad_s", measures.map(|m| value_and_error(m.crossover_rad_s)))?;
    all.set_item(
        "phase_margin_deg",
        measures.map(|m| value_and_error(m.phase_margin_deg)),
    )?;
    Ok(all)
}

/// Returns the 95 % intervals of the crossover frequency and the phase margin from Student's t distribution.
fn loop_intervals<'py>(py: Python<'py>, measures: Option<LoopMeasures>) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    all.set_item("crossover_rad_s", measures.and_then(|m| m.crossover_interval))?;
    all.set_item("phase_margin_deg", measures.and_then(|m| m.phase_margin_interval))?;
    Ok(all)
}

/// Returns all crossovers, the smallest phase margin, the gain margin, and whether the closed loop is stable.
fn shape_parts<'py>(py: Python<'py>, shape: &LoopShape) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    let crossovers: Vec<(ValueWithError, ValueWithError)> = shape
        .crossovers
        .iter()
        .map(|(w, m)| (value_and_error(*w), value_and_error(*m)))
        .collect();
    all.set_item("crossovers", crossovers)?;
    all.set_item(
        "smallest_phase_margin_deg",
        shape.smallest_margin().map(|(_, m)| value_and_error(m)),
    )?;
    all.set_item("gain_margin_db", shape.gain_margin.map(|(_, db)| value_and_error(db)))?;
    all.set_item(
        "phase_crossover_rad_s",
        shape.gain_margin.map(|(omega, _)| value_and_error(omega)),
    )?;
    all.set_item("stable", shape.is_stable())?;
    Ok(all)
}

fn form_row<'py>(py: Python<'py>, f: &FormFigures) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("form", f.form.name())?;
    row.set_item("weight", f.weight)?;
    row.set_item("loss", f.loss)?;
    row.set_item("criterion", f.criterion)?;
    row.set_item("held_out", f.held_out)?;
    row.set_item("chi2", f.chi_squared)?;
    row.set_item("degrees_of_freedom", f.degrees_of_freedom)?;
    row.set_item("converged", f.converged)?;
    Ok(row)
}

#[pymethods]
impl PyOperatorFit {
    /// Returns the settings: name, value, and whether the user gave it.
    #[getter]
    fn settings(&self) -> Vec<(String, String, bool)> {
        figures::settings(&self.0.settings)
    }

    /// Returns the result as JSON, from which it can be restored.
    fn to_json(&self) -> Outcome<String> {
        Ok(self.0.to_json()?)
    }

    /// Returns the name of the form, and whether the operator includes neuromuscular dynamics.
    #[getter]
    fn form(&self) -> (&'static str, bool) {
        (self.0.fit.form.name(), self.0.fit.neuromuscular)
    }

    #[getter]
    fn title(&self) -> String {
        self.0.fit.title()
    }

    /// Returns the parameters of the common operator, or of the operator of each record.
    #[getter]
    fn parameters(&self) -> Vec<Vec<ParameterParts>> {
        let of = |parameters: &Vec<Parameter>| parameters.iter().map(parameter).collect();
        self.0.fit.operators.iter().map(|o| of(&o.parameters)).collect()
    }

    /// Returns the names of the coordinates, in the order of the covariance.
    #[getter]
    fn coordinates(&self) -> Vec<&'static str> {
        let all = self.0.fit.form.coordinates(self.0.fit.neuromuscular);
        all.iter().map(|c| c.name()).collect()
    }

    fn coordinate_values<'py>(&self, py: Python<'py>, record: usize) -> Bound<'py, PyArray1<f64>> {
        array(py, self.0.fit.operator(record).operator.coordinates().to_vec())
    }

    fn covariance<'py>(&self, py: Python<'py>, record: usize) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.square(py, self.0.fit.operator(record).covariance.as_deref())
    }

    /// Returns the covariance that would be valid if the residuals were white and the person did not vary.
    fn model_based_covariance<'py>(
        &self,
        py: Python<'py>,
        record: usize,
    ) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.square(py, self.0.fit.operator(record).model_based.as_deref())
    }

    #[getter]
    fn verdict(&self) -> String {
        verdict(&self.0.fit.verdict)
    }

    #[getter]
    fn forms<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.0.fit.forms.iter().map(|f| form_row(py, f)).collect()
    }

    #[getter]
    fn lines<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(lines) = &self.0.fit.lines else {
            return Ok(None);
        };
        let (all, parameters) = (PyDict::new(py), PyDict::new(py));
        for (name, estimate) in lines.parameters() {
            parameters.set_item(name, value_and_error(estimate))?;
        }
        all.set_item("parameters", parameters)?;
        all.set_item("chi2", lines.chi_squared)?;
        all.set_item("degrees_of_freedom", lines.degrees_of_freedom)?;
        all.set_item("held_out", lines.held_out_total())?;
        all.set_item("converged", lines.termination.converged())?;
        if let Some(element) = &self.0.controlled_element {
            let measures = self.0.fit.loop_measures_at_lines(element);
            all.set_item("open_loop", loop_parts(py, measures)?)?;
            all.set_item("open_loop_intervals", loop_intervals(py, measures)?)?;
        }
        Ok(Some(all))
    }

    /// Returns the reason why there is no fit at the lines of an excitation that the user named.
    #[getter]
    fn no_lines(&self) -> Option<&str> {
        self.0.fit.no_lines.as_deref()
    }

    #[getter]
    fn riv_bj<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(found) = &self.0.fit.instrumental else {
            return Ok(None);
        };
        let (all, parameters) = (PyDict::new(py), PyDict::new(py));
        for (name, estimate) in found.parameters() {
            parameters.set_item(name, value_and_error(estimate))?;
        }
        all.set_item("parameters", parameters)?;
        all.set_item("nd", found.noise_order)?;
        all.set_item("converged", found.termination.converged())?;
        all.set_item("termination", found.termination.to_string())?;
        if let Some(element) = &self.0.controlled_element {
            let measures = self.0.fit.loop_measures_by_instruments(element);
            all.set_item("open_loop", loop_parts(py, measures)?)?;
        }
        Ok(Some(all))
    }

    #[getter]
    fn agreement<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(agreement) = &self.0.fit.agreement else {
            return Ok(None);
        };
        let (all, mut rows) = (PyDict::new(py), Vec::new());
        for found in &agreement.rows {
            let with_error = |(value, error): (f64, f64)| -> ValueWithError { (value, Some(error)) };
            let row = PyDict::new(py);
            row.set_item("coordinate", found.coordinate.name())?;
            for method in [
                AgreementMethod::PredictionError,
                AgreementMethod::Lines,
                AgreementMethod::Instrumental,
            ] {
                row.set_item(method.name(), found.of(method).map(with_error))?;
            }
            row.set_item("difference_in_errors", found.difference_in_errors)?;
            rows.push(row);
        }
        all.set_item("coordinates", rows)?;
        let mut pairs = Vec::new();
        for found in &agreement.pairs {
            let pair = PyDict::new(py);
            pair.set_item("methods", (found.methods.0.name(), found.methods.1.name()))?;
            pair.set_item("chi2", found.statistic)?;
            pair.set_item("p_value", found.p_value)?;
            pairs.push(pair);
        }
        all.set_item("pairs", pairs)?;
        all.set_item("chi2", agreement.statistic)?;
        all.set_item("p_value", agreement.p_value)?;
        Ok(Some(all))
    }

    /// Returns the magnitude in dB and the phase in deg of the operator of a record at these frequencies, each with its
    /// standard error (NaN if there is none).
    fn frequency_response<'py>(
        &self,
        py: Python<'py>,
        omega: PyReadonlyArray1<'py, f64>,
        record: usize,
    ) -> PyResult<[Bound<'py, PyArray1<f64>>; 4]> {
        Ok(response_columns(
            py,
            &self.0.fit.frequency_response(record, omega.as_slice()?),
        ))
    }

    /// Returns the crossover frequency and the phase margin with another controlled element.
    fn margins<'py>(&self, py: Python<'py>, element: ControlledElement) -> Outcome<Bound<'py, PyDict>> {
        let element = element.transfer_function()?;
        Ok(loop_parts(py, self.0.fit.loop_measures(0, &element))?)
    }

    /// Returns the crossover frequency and the phase margin; `None` without a controlled element.
    #[getter]
    fn open_loop<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let of = |element| loop_parts(py, self.0.fit.loop_measures(0, element));
        self.0.controlled_element.as_ref().map(of).transpose()
    }

    /// Returns all crossovers of the loop, its smallest phase margin, its gain margin, and whether it is stable; `None`
    /// without a controlled element.
    #[getter]
    fn loop_shape<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let of = |element| shape_parts(py, &self.0.fit.loop_shape(0, element));
        self.0.controlled_element.as_ref().map(of).transpose()
    }

    /// Returns the crossover frequency and the phase margin with the standard errors for the person, not for these
    /// runs; `None` without a controlled element.
    #[getter]
    fn open_loop_person<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let of = |element| {
            let measures = self.0.fit.loop_measures(0, element);
            loop_parts(py, measures.map(LoopMeasures::as_of_person))
        };
        self.0.controlled_element.as_ref().map(of).transpose()
    }

    #[getter]
    fn open_loop_intervals<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let of = |element| loop_intervals(py, self.0.fit.loop_measures(0, element));
        self.0.controlled_element.as_ref().map(of).transpose()
    }

    #[getter]
    fn box_jenkins<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(free) = &self.0.fit.free_model else {
            return Ok(None);
        };
        let all = PyDict::new(py);
        all.set_item("loss", free.loss)?;
        all.set_item("likelihood_ratio", free.likelihood_ratio)?;
        all.set_item("degrees_of_freedom", free.degrees_of_freedom)?;
        all.set_item("p_value", free.p_value)?;
        Ok(Some(all))
    }

    /// Returns the coefficients c and d of the noise model.
    #[getter]
    fn noise<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>) {
        let (c, d) = self.0.fit.noise.clone();
        (array(py, c), array(py, d))
    }

    /// Returns the parameter, the centre, the spread and the source of each entry of the prior.
    #[getter]
    fn prior(&self) -> Vec<(String, f64, f64, String)> {
        let entries = self.0.fit.prior.entries().iter();
        entries
            .map(|e| (e.parameter.clone(), e.centre, e.spread, e.source.clone()))
            .collect()
    }

    #[getter]
    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (found, all) = (&self.0.fit, PyDict::new(py));
        let kind = match found.cluster_kind {
            ClusterKind::Runs => "runs",
            ClusterKind::Blocks => "blocks",
        };
        all.set_item("loss", found.loss)?;
        all.set_item("innovation_variance", found.innovation_variance)?;
        all.set_item("residuals", found.residuals)?;
        all.set_item("coherent_share", found.coherent_share)?;
        all.set_item("sample_time", found.sample_time.s())?;
        all.set_item("intersample", found.intersample.name())?;
        all.set_item("tau_e_if_straight", found.delay_if_linear_s(0))?;
        all.set_item("clusters", found.clusters)?;
        all.set_item("kind", kind)?;
        all.set_item("inflation", found.inflation)?;
        all.set_item("largest_ratio_to_model_based", found.error_ratio)?;
        Ok(all)
    }

    #[getter]
    fn termination<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        figures::termination(py, self.0.fit.termination)
    }

    /// Returns the channel of the excitation; `None` if there was none.
    #[getter]
    fn excitation(&self) -> Option<&str> {
        self.0.excitation.as_deref()
    }

    /// Returns the records that were fitted: for each, the index of the given record from which it comes, the record,
    /// and the steps applied to it.
    fn records<'py>(&self, py: Python<'py>) -> PyResult<Vec<UsedRecord<'py>>> {
        used_records(py, &self.0.data)
    }

    /// Returns the faults, each with the index of the given record in which it was found.
    #[getter]
    fn faults<'py>(&self, py: Python<'py>) -> PyResult<Vec<(usize, Bound<'py, PyDict>)>> {
        faults_of(py, &self.0.data)
    }

    /// Writes the report page of the operator to a directory. `records` are used if the result was restored from a
    /// pickle, which does not contain them.
    #[pyo3(signature = (records, directory, *, title))]
    fn report(
        &self,
        py: Python<'_>,
        records: Vec<Bound<'_, PyAny>>,
        directory: PathBuf,
        title: Option<String>,
    ) -> Outcome<PathBuf> {
        let mut found = Cow::Borrowed(&self.0);
        if found.data.is_empty() {
            found.to_mut().data = Recordings::from_records(arrays::records(&records, ChannelSelection::All)?);
        }
        let page = py.detach(|| {
            let mut report = Report::from_operator_fit(&found);
            report.title = title.unwrap_or(report.title);
            write_report(&directory, &report.to_html()?)
        })?;
        Ok(page)
    }

    /// Returns the polynomial model of a record.
    fn fit(&self, record: usize) -> PyFit {
        PyFit::new(
            self.0.fit.operator(record).polynomial_fit.clone(),
            None,
            self.0.data.len(),
        )
    }
}

impl PyOperatorFit {
    fn square<'py>(&self, py: Python<'py>, values: Option<&[f64]>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let columns = self.0.fit.form.coordinates(self.0.fit.neuromuscular).len();
        values.map(|c| matrix(py, c.to_vec(), columns)).transpose()
    }
}
