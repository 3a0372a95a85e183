//! A fitted model.

use std::path::PathBuf;

use hoid_analysis::{IdentifiedModel, PolynomialFit, Recordings, json::state};
use hoid_ident::{Candidate, Choice, Fit, GreyBoxFit, MarginEstimates, Series, grey_box::OrderCandidate};
use hoid_model::{Record, margins::MANUAL_CONTROL_RANGE_RAD_S};
use hoid_report::{ModelSection, Report, known_operator, write_report};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::{
    prelude::*,
    types::{PyComplex, PyDict, PyList},
};

use crate::{
    arrays::{self, ChannelSelection, array, matrix},
    controlled_element::ControlledElement,
    errors::{DataError, Outcome},
    faults::{UsedRecord, faults_of, used_records},
    figures::{self, ValueWithError, value_and_error},
    names,
};

/// A fitted model; the package wraps it in `pyhoid.Fit`.
#[pyclass(name = "Fit", module = "pyhoid._pyhoid", frozen)]
pub struct PyFit {
    fit: Fit,
    choice: Option<Choice>,
    /// Number of records to which the model was fitted.
    records: usize,
    /// The complete result to which the model belongs; `None` if the model is a part of a result of another class.
    full_result: Option<FullResult>,
}

/// A model that is a part of another result, as serialised.
#[derive(serde::Serialize)]
struct SerializedPart<'a> {
    fit: &'a Fit,
    choice: &'a Option<Choice>,
    records: usize,
}

/// A model that is a part of another result, as deserialised.
#[derive(serde::Deserialize)]
pub struct PartRead {
    fit: Fit,
    choice: Option<Choice>,
    records: usize,
}

impl From<PartRead> for PyFit {
    fn from(part: PartRead) -> Self {
        Self::new(part.fit, part.choice, part.records)
    }
}

/// A result that is presented as polynomials.
enum FullResult {
    Polynomials(Box<IdentifiedModel<PolynomialFit>>),
    Remnant(Box<IdentifiedModel<GreyBoxFit>>),
}

/// Evaluates an expression for a result of either kind.
macro_rules! each {
    ($whole:expr, $found:ident => $what:expr) => {
        match $whole {
            FullResult::Polynomials($found) => $what,
            FullResult::Remnant($found) => $what,
        }
    };
}

impl PyFit {
    /// Creates a model that is a part of another result.
    pub fn new(fit: Fit, choice: Option<Choice>, records: usize) -> Self {
        Self {
            fit,
            choice,
            records,
            full_result: None,
        }
    }

    /// Creates a model from identified polynomials.
    pub fn from_polynomials(found: IdentifiedModel<PolynomialFit>) -> Self {
        Self {
            fit: found.fit.fit.clone(),
            choice: found.fit.choice.clone(),
            records: found.data.names.len(),
            full_result: Some(FullResult::Polynomials(Box::new(found))),
        }
    }

    /// Creates a model from an identified operator with its remnant.
    pub fn from_grey_box(found: IdentifiedModel<GreyBoxFit>) -> Self {
        Self {
            fit: found.fit.polynomial_fit(0).clone(),
            choice: None,
            records: found.data.names.len(),
            full_result: Some(FullResult::Remnant(Box::new(found))),
        }
    }

    fn grey_box(&self) -> Option<&GreyBoxFit> {
        match &self.full_result {
            Some(FullResult::Remnant(found)) => Some(&found.fit),
            _ => None,
        }
    }

    fn data(&self) -> Option<&Recordings> {
        self.full_result
            .as_ref()
            .map(|whole| each!(whole, found => &found.data))
    }

    fn margins_with(&self, element: &ControlledElement) -> Outcome<MarginEstimates> {
        let element = element.transfer_function()?;
        let (low, high) = MANUAL_CONTROL_RANGE_RAD_S;
        // The sampled model carries no information above half the sampling frequency.
        let high = high.min(self.fit.model().sample_time().nyquist_rad_s());
        Ok(self.fit.margins(|omega| element.response(omega), (low, high)))
    }

    /// Evaluates the fit on a record, without the interpreter lock.
    fn evaluate_on_record<T: Send>(
        &self,
        py: Python<'_>,
        record: &Bound<'_, PyAny>,
        work: impl FnOnce(&Fit, &Record) -> Result<T, hoid_ident::IdentError> + Send,
    ) -> Outcome<T> {
        let record = arrays::record(record, ChannelSelection::Only(&[]))?;
        let fit = &self.fit;
        Ok(py.detach(|| work(fit, &record))?)
    }
}

type SeriesParts<'py> = (usize, Bound<'py, PyArray1<f64>>);

fn series(py: Python<'_>, found: Series) -> SeriesParts<'_> {
    (found.first, array(py, found.values))
}

#[pymethods]
impl PyFit {
    /// Returns the settings: name, value, and whether the user gave it.
    #[getter]
    fn settings(&self) -> Vec<(String, String, bool)> {
        let of = |whole: &FullResult| each!(whole, found => figures::settings(&found.settings));
        self.full_result.as_ref().map(of).unwrap_or_default()
    }

    /// Returns the result as JSON, from which it can be restored.
    fn to_json(&self) -> Outcome<String> {
        match &self.full_result {
            Some(whole) => Ok(each!(whole, found => found.to_json())?),
            None => Err(DataError::new_err(
                "this model is part of another result: write that result instead (fit.to_json() of the operator or the \
                 trace)",
            )
            .into()),
        }
    }

    /// Returns the serialised model if it is a part of another result; `None` for a separate result, which is restored
    /// from JSON.
    fn state(&self) -> Option<String> {
        if self.full_result.is_some() {
            return None;
        }
        state::serialise(&SerializedPart {
            fit: &self.fit,
            choice: &self.choice,
            records: self.records,
        })
    }

    #[getter]
    fn structure(&self) -> &'static str {
        if self.fit.is_grey_box() {
            "operator"
        } else {
            self.fit.model().structure().name()
        }
    }

    #[getter]
    fn title(&self) -> String {
        self.fit.title()
    }

    #[getter]
    fn orders<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        figures::orders(py, &self.fit.orders())
    }

    #[getter]
    fn sample_time(&self) -> f64 {
        self.fit.model().sample_time().s()
    }

    #[getter]
    fn parameters(&self) -> Vec<(String, ValueWithError)> {
        self.fit
            .parameters()
            .into_iter()
            .map(|(name, e)| (name, value_and_error(e)))
            .collect()
    }

    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let found = match self.grey_box() {
            Some(grey_box) => grey_box.covariance(),
            // The covariance of an operator of the family refers to its coordinates, not to the coefficients.
            None if self.fit.is_grey_box() => None,
            None => self.fit.covariance(),
        };
        let Some(c) = found else { return Ok(None) };
        let columns = (c.len() as f64).sqrt().round() as usize;
        matrix(py, c.to_vec(), columns).map(Some)
    }

    /// Returns A, B, C, D and F in ascending powers of q^-1.
    ///
    /// A, C, D and F start with 1, and B starts with nk zeros for the delay.
    #[getter]
    fn polynomials<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let model = self.fit.model();
        let all = PyDict::new(py);
        for (name, coefficients) in [("A", model.a()), ("C", model.c()), ("D", model.d()), ("F", model.f())] {
            let mut monic = vec![1.0];
            monic.extend_from_slice(coefficients);
            all.set_item(name, array(py, monic))?;
        }
        let mut b = vec![0.0; if model.b().is_empty() { 0 } else { model.orders().nk }];
        b.extend_from_slice(model.b());
        all.set_item("B", array(py, b))?;
        Ok(all)
    }

    #[getter]
    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (fit, all) = (&self.fit, PyDict::new(py));
        all.set_item("loss", fit.loss())?;
        all.set_item("innovation_variance", fit.innovation_variance())?;
        all.set_item("aic", fit.aic())?;
        all.set_item("aicc", fit.aicc())?;
        all.set_item("bic", fit.bic())?;
        all.set_item("fpe", fit.fpe())?;
        all.set_item("mdl", fit.mdl())?;
        all.set_item("yic", fit.yic())?;
        all.set_item("residuals", fit.residual_count())?;
        all.set_item("initial_states", fit.state_count())?;
        Ok(all)
    }

    #[getter]
    fn termination<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = figures::termination(py, self.fit.termination())?;
        all.set_item("start", self.fit.start())?;
        Ok(all)
    }

    #[getter]
    fn stable(&self) -> bool {
        self.fit.model().is_stable()
    }

    #[getter]
    fn operator<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        figures::operator(py, &self.fit.operator())
    }

    /// Returns the operator of each record of a grey-box fit; empty for other fits.
    #[getter]
    fn operators<'py>(&self, py: Python<'py>) -> PyResult<Vec<Option<Bound<'py, PyDict>>>> {
        let Some(grey_box) = self.grey_box() else {
            return Ok(Vec::new());
        };
        (0..self.records)
            .map(|k| figures::operator(py, &grey_box.operator(k)))
            .collect()
    }

    /// Returns the constant level of u in each record of the fit, in the units of the recording; empty if no levels
    /// were estimated.
    #[getter]
    fn levels(&self) -> Vec<Option<ValueWithError>> {
        let without = |whole: &&FullResult| each!(whole, found => found.is_without_means());
        let data = self.full_result.as_ref().filter(without).and_then(|_| self.data());
        let accounts = data.into_iter().flat_map(|data| &data.accounts);
        accounts.map(|account| account.level.map(value_and_error)).collect()
    }

    /// Returns the records that were fitted: for each, the index of the given record from which it comes, the record,
    /// and the steps applied to it.
    fn records<'py>(&self, py: Python<'py>) -> PyResult<Vec<UsedRecord<'py>>> {
        let data = self.data().map(|data| used_records(py, data));
        data.unwrap_or_else(|| Ok(Vec::new()))
    }

    /// Returns the faults, each with the index of the given record in which it was found.
    #[getter]
    fn faults<'py>(&self, py: Python<'py>) -> PyResult<Vec<(usize, Bound<'py, PyDict>)>> {
        let data = self.data().map(|data| faults_of(py, data));
        data.unwrap_or_else(|| Ok(Vec::new()))
    }

    fn remnant<'py>(&self, py: Python<'py>, discretisation: &str) -> Outcome<Option<Bound<'py, PyDict>>> {
        let how = names::remnant_discretisation(discretisation)?;
        if self.fit.orders().nd == 0 {
            return Ok(None);
        }
        Ok(Some(figures::remnant(py, &self.fit.remnant(how))?))
    }

    fn quality<'py>(&self, py: Python<'py>, records: Vec<Bound<'py, PyAny>>) -> Outcome<Bound<'py, PyDict>> {
        let records = arrays::records(&records, ChannelSelection::Only(&[]))?;
        let fit = &self.fit;
        let quality = py.detach(|| fit.quality(&records))?;
        Ok(figures::quality(py, &quality)?)
    }

    /// Returns the verdict on the fit; if the fit is a part of another result, the verdict is based on these records
    /// only.
    fn verdict(&self, py: Python<'_>, records: Vec<Bound<'_, PyAny>>) -> Outcome<String> {
        if let Some(whole) = &self.full_result {
            return Ok(each!(whole, found => figures::verdict(&found.verdict)));
        }
        let records = arrays::records(&records, ChannelSelection::Only(&[]))?;
        let found = py.detach(|| self.fit.verdict(&records, self.choice.as_ref()))?;
        Ok(figures::verdict(&found))
    }

    fn predict<'py>(&self, py: Python<'py>, record: &Bound<'py, PyAny>, horizon: usize) -> Outcome<SeriesParts<'py>> {
        let found = self.evaluate_on_record(py, record, |fit, record| match horizon {
            1 => fit.predict(record),
            k => fit.predict_ahead(record, k),
        })?;
        Ok(series(py, found))
    }

    fn simulate<'py>(&self, py: Python<'py>, record: &Bound<'py, PyAny>) -> Outcome<SeriesParts<'py>> {
        Ok(series(py, self.evaluate_on_record(py, record, Fit::simulate)?))
    }

    fn residuals<'py>(&self, py: Python<'py>, record: &Bound<'py, PyAny>) -> Outcome<SeriesParts<'py>> {
        Ok(series(py, self.evaluate_on_record(py, record, Fit::residuals)?))
    }

    fn validate<'py>(&self, py: Python<'py>, record: &Bound<'py, PyAny>) -> Outcome<Bound<'py, PyDict>> {
        let v = self.evaluate_on_record(py, record, Fit::validate)?;
        let (all, signs) = (PyDict::new(py), v.diagnostics());
        all.set_item("first", v.first)?;
        all.set_item("quality", figures::quality(py, &v.quality)?)?;
        all.set_item("ljung_box", figures::ljung_box(py, v.ljung_box.as_ref())?)?;
        all.set_item("coloured_residuals", signs.coloured_residuals)?;
        all.set_item("under_modelled", signs.under_modelled)?;
        all.set_item("feedback", signs.feedback)?;
        for (name, correlation) in [
            ("autocorrelation", v.autocorrelation),
            ("cross_correlation", v.cross_correlation),
        ] {
            let lags = PyArray1::from_vec(py, correlation.lags);
            all.set_item(name, (lags, array(py, correlation.values), correlation.bound_99))?;
        }
        all.set_item("simulated", array(py, v.simulated))?;
        all.set_item("predicted", array(py, v.predicted))?;
        Ok(all)
    }

    /// Returns the magnitude in dB and the phase in deg at these frequencies, each with its standard error (NaN if
    /// there is none).
    fn frequency_response<'py>(
        &self,
        py: Python<'py>,
        omega: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<[Bound<'py, PyArray1<f64>>; 4]> {
        Ok(figures::response_columns(
            py,
            &self.fit.frequency_response(omega.as_slice()?),
        ))
    }

    #[getter]
    fn roots<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let ts = self.fit.model().sample_time().s();
        let one = |root: hoid_ident::Root| {
            let all = PyDict::new(py);
            all.set_item("polynomial", root.polynomial.to_string())?;
            all.set_item("value", PyComplex::from_doubles(py, root.value.re, root.value.im))?;
            all.set_item("standard_error", root.standard_error)?;
            let of_s = root.frequency_and_damping(ts);
            all.set_item("frequency_rad_s", of_s.map(|s| s.0))?;
            all.set_item("damping", of_s.map(|s| s.1))?;
            Ok(all)
        };
        self.fit.roots().into_iter().map(one).collect()
    }

    /// Returns the crossover frequency and the margins of the operator in series with a controlled element.
    fn margins<'py>(&self, py: Python<'py>, element: ControlledElement) -> Outcome<Bound<'py, PyDict>> {
        Ok(figures::margins(py, &self.margins_with(&element)?)?)
    }

    /// Writes the report page of the model and its records to a directory.
    #[pyo3(signature = (records, directory, *, title, settings, controlled_element))]
    fn report(
        &self,
        py: Python<'_>,
        records: Vec<Bound<'_, PyAny>>,
        directory: PathBuf,
        title: String,
        settings: Vec<(String, String)>,
        controlled_element: Option<ControlledElement>,
    ) -> Outcome<PathBuf> {
        let records = arrays::records(&records, ChannelSelection::All)?;
        let margins = controlled_element
            .map(|element| self.margins_with(&element))
            .transpose()?;
        let page = py.detach(|| {
            let report = Report {
                title,
                settings,
                models: vec![ModelSection {
                    name: self.fit.title(),
                    fit: &self.fit,
                    records: &records,
                    candidates: self.choice.as_ref(),
                    truth: known_operator(&records),
                    margins,
                }],
                notes: Vec::new(),
                fit_summary: None,
                pictures: Vec::new(),
            };
            write_report(&directory, &report.to_html()?)
        })?;
        Ok(page)
    }

    /// Returns the candidates from which the model was selected.
    #[getter]
    fn candidates<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let list = PyList::empty(py);
        for candidate in self.choice.iter().flat_map(|choice| &choice.candidates) {
            list.append(candidate_row(py, candidate)?)?;
        }
        for candidate in self.grey_box().into_iter().flat_map(GreyBoxFit::candidates) {
            list.append(order_row(py, candidate)?)?;
        }
        Ok(list)
    }

    #[getter]
    fn criterion(&self) -> Option<&'static str> {
        self.choice.as_ref().map(|choice| choice.criterion.label())
    }

    #[getter]
    fn delay_interval(&self) -> Option<(usize, usize)> {
        self.choice.as_ref().and_then(Choice::delay_interval)
    }

    fn __repr__(&self) -> String {
        format!("<pyhoid._pyhoid.Fit {}>", self.fit.title())
    }
}

fn candidate_row<'py>(py: Python<'py>, candidate: &Candidate) -> PyResult<Bound<'py, PyDict>> {
    let row = figures::orders(py, &candidate.orders)?;
    match &candidate.outcome {
        Ok(f) => {
            for (name, value) in [
                ("loss", f.loss),
                ("aic", f.aic),
                ("aicc", f.aicc),
                ("bic", f.bic),
                ("fpe", f.fpe),
                ("mdl", f.mdl),
            ] {
                row.set_item(name, value)?;
            }
            row.set_item("yic", f.yic)?;
            row.set_item("converged", f.converged)?;
        }
        Err(reason) => row.set_item("error", reason)?,
    }
    Ok(row)
}

fn order_row<'py>(py: Python<'py>, candidate: &OrderCandidate) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("remnant_order", candidate.order)?;
    match &candidate.outcome {
        Ok(f) => {
            row.set_item("loss", f.loss)?;
            row.set_item("aic", f.aic)?;
            row.set_item("bic", f.bic)?;
            row.set_item("converged", f.converged)?;
        }
        Err(reason) => row.set_item("error", reason)?,
    }
    Ok(row)
}
