//! The fit of an operator whose gains change once.

use hoid_analysis::Identified;
use hoid_ident::{ChangedOperator, GainsAt, SigmoidFit, validation::whiteness};
use numpy::{PyArray1, PyArray2};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::{self, Wanted, array, matrix},
    errors::Outcome,
    faults::{UsedRecord, faults_of, used_records},
    figures::{self, ValueWithError, VerdictParts, error_or_nan, pair},
};

/// The package wraps it in `pyhoid.TimeVaryingFit`.
#[pyclass(name = "TimeVaryingFit", module = "pyhoid._pyhoid", frozen)]
pub struct PyTimeVaryingFit(pub Identified<SigmoidFit>);

/// The operator before or after the change: of a gain and a lead as that of any fit, else its form
/// and each parameter by its name; the poles of the family are stable by their bounds.
fn operator<'py>(py: Python<'py>, of: &ChangedOperator) -> PyResult<Option<Bound<'py, PyDict>>> {
    if let Some(lead) = of.lead() {
        return figures::operator(py, &Ok(lead));
    }
    let all = PyDict::new(py);
    all.set_item("convertible", true)?;
    all.set_item("stable", true)?;
    all.set_item("form", of.operator.form().name())?;
    for p in &of.parameters {
        all.set_item(p.name, pair(p.estimate))?;
    }
    Ok(Some(all))
}

#[pymethods]
impl PyTimeVaryingFit {
    /// The settings that were used.
    #[getter]
    fn settings(&self) -> Vec<(String, String, bool)> {
        figures::settings(&self.0.settings)
    }

    /// The result as JSON, from which it comes back.
    fn to_json(&self) -> Outcome<String> {
        Ok(self.0.to_json()?)
    }

    #[getter]
    fn form(&self) -> &'static str {
        self.0.fit.form().name()
    }

    /// Name, estimate, unit and remark of each parameter.
    #[getter]
    fn parameters(&self) -> Vec<(String, ValueWithError, &'static str, Option<String>)> {
        let one = |p: hoid_ident::ChangeParameter| (p.name, pair(p.estimate), p.unit, p.remark.map(|r| r.to_string()));
        self.0.fit.parameters().into_iter().map(one).collect()
    }

    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let Some(c) = self.0.fit.covariance() else {
            return Ok(None);
        };
        let columns = (c.len() as f64).sqrt().round() as usize;
        matrix(py, c, columns).map(Some)
    }

    #[getter]
    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (fit, all) = (&self.0.fit, PyDict::new(py));
        all.set_item("loss", fit.loss())?;
        all.set_item("innovation_variance", fit.innovation_variance())?;
        all.set_item("residuals", fit.residual_count())?;
        all.set_item("initial_states", fit.state_count())?;
        Ok(all)
    }

    #[getter]
    fn termination<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = figures::termination(py, self.0.fit.termination())?;
        all.set_item("start", self.0.fit.start())?;
        Ok(all)
    }

    /// Whether there is a change, and the comparison with an operator that does not change.
    #[getter]
    fn change<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (c, all) = (self.0.fit.comparison(), PyDict::new(py));
        all.set_item("found", self.0.fit.change_found())?;
        all.set_item("likelihood_ratio", c.likelihood_ratio)?;
        all.set_item("extra_parameters", c.extra_parameters)?;
        all.set_item("bic_difference", c.bic_difference)?;
        all.set_item("t_M_interval", self.0.fit.midpoint_interval())?;
        all.set_item("G_interval", self.0.fit.rate_interval())?;
        Ok(all)
    }

    /// The level of u in each record, where it was estimated.
    #[getter]
    fn levels(&self) -> Vec<Option<ValueWithError>> {
        self.0
            .data
            .accounts
            .iter()
            .map(|account| account.level.map(pair))
            .collect()
    }

    /// The records as they were fitted: which of those given each is a part of, the record, and the processing of it.
    fn records<'py>(&self, py: Python<'py>) -> PyResult<Vec<UsedRecord<'py>>> {
        used_records(py, &self.0.data)
    }

    /// The faults of the records: which of those given, and the fault.
    #[getter]
    fn faults<'py>(&self, py: Python<'py>) -> PyResult<Vec<(usize, Bound<'py, PyDict>)>> {
        faults_of(py, &self.0.data)
    }

    #[getter]
    fn initial<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        operator(py, self.0.fit.initial_operator())
    }

    #[getter]
    fn last<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        operator(py, self.0.fit.last_operator())
    }

    /// `t`, and what changes (K_e, T_L and K_e_dot of a gain and a lead) at these times, each with
    /// its standard error.
    fn gains<'py>(&self, py: Python<'py>, times: Vec<f64>) -> PyResult<Bound<'py, PyDict>> {
        let gains: Vec<GainsAt> = times.iter().map(|t| self.0.fit.gains_at(*t)).collect();
        let all = PyDict::new(py);
        all.set_item("t", array(py, times))?;
        // The names exist even without times.
        for (i, of) in self.0.fit.gains_at(0.0).gains.iter().enumerate() {
            all.set_item(
                of.name,
                array(py, gains.iter().map(|g| g.gains[i].estimate.value).collect()),
            )?;
            let errors = gains.iter().map(|g| error_or_nan(g.gains[i].estimate)).collect();
            all.set_item(format!("{}_se", of.name), array(py, errors))?;
        }
        Ok(all)
    }

    fn residuals<'py>(
        &self,
        py: Python<'py>,
        record: &Bound<'py, PyAny>,
    ) -> Outcome<(usize, Bound<'py, PyArray1<f64>>)> {
        let record = arrays::record(record, Wanted::Only(&[]))?;
        let found = py.detach(|| self.0.fit.residuals(&record))?;
        Ok((found.first, array(py, found.values)))
    }

    fn simulate<'py>(
        &self,
        py: Python<'py>,
        record: &Bound<'py, PyAny>,
    ) -> Outcome<(usize, Bound<'py, PyArray1<f64>>)> {
        let record = arrays::record(record, Wanted::Only(&[]))?;
        let found = py.detach(|| self.0.fit.simulate(&record))?;
        Ok((found.first, array(py, found.values)))
    }

    #[getter]
    fn verdict(&self) -> VerdictParts {
        figures::verdict(&self.0.verdict)
    }

    /// Whiteness of the residuals of a record.
    fn ljung_box<'py>(&self, py: Python<'py>, record: &Bound<'py, PyAny>) -> Outcome<Option<Bound<'py, PyDict>>> {
        let record = arrays::record(record, Wanted::Only(&[]))?;
        let fit = &self.0.fit;
        let test = py.detach(|| {
            fit.residuals(&record)
                .map(|found| whiteness(&found.values, fit.d().len()))
        })?;
        Ok(figures::ljung_box(py, test.as_ref())?)
    }
}
