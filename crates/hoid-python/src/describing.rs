//! `pyhoid.describe` and `pyhoid.describing_function`: response of an operator at the lines of the excitation.

use hoid_analysis::{DescribingFunctionOptions, DescribingFunctionResult, Recordings};
use hoid_ident::frequency::{
    Averaging, DescribingFunction, DescribingOptions, Excitation, GainLeadDelayOptions, LineDetectionOptions,
    LineWeights, Realisation, RecordDescriptionOptions, describe as describe_lines,
};
use hoid_model::{FaultHandling, uncertainty::Estimate};
use numpy::{Complex64, PyArray1};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::{self, ChannelSelection, array},
    controlled_element::ControlledElement,
    errors::{Outcome, bad_option},
    faults::{UsedRecord, faults_of, used_records},
    figures::{self, ValueWithError, error_or_nan, value_and_error, verdict},
    files, names,
};

/// A describing function; the package wraps it in `pyhoid.DescribingFunction`.
#[pyclass(name = "DescribingFunction", module = "pyhoid._pyhoid", frozen)]
pub struct PyDescribingFunction {
    found: DescribingFunction,
}

/// A describing function with its verdict and its settings; the package wraps it in `pyhoid.Description`.
#[pyclass(name = "Description", module = "pyhoid._pyhoid", frozen)]
pub struct PyDescription(DescribingFunctionResult);

#[pyfunction]
#[pyo3(signature = (records, *, excitation, lines, period, controlled_element, start, stop, offset_samples, detrend, faults,
    decimate))]
#[allow(clippy::too_many_arguments)]
pub fn describe<'py>(
    py: Python<'py>,
    records: Vec<Bound<'py, PyAny>>,
    excitation: Option<String>,
    lines: Option<Vec<f64>>,
    period: Option<f64>,
    controlled_element: Option<ControlledElement>,
    start: Option<f64>,
    stop: Option<f64>,
    offset_samples: f64,
    detrend: &str,
    faults: &str,
    decimate: &str,
) -> Outcome<PyDescription> {
    let records = arrays::records(&records, ChannelSelection::All)?;
    let describing = DescribingFunctionOptions {
        options: RecordDescriptionOptions {
            excitation,
            lines_rad_s: lines,
            period_s: period,
            controlled_element: controlled_element.map(|e| e.transfer_function()).transpose()?,
            from_s: start,
            to_s: stop,
            offset_samples,
            detrend: names::detrend(detrend)?,
        },
        faults: names::choice::<FaultHandling>("faults", faults)?,
        rate: files::decimation(decimate)?,
        ..DescribingFunctionOptions::default()
    };
    let found = py.detach(|| describing.run(Recordings::from_records(records)))?;
    Ok(PyDescription(found))
}

#[pymethods]
impl PyDescription {
    /// Returns the settings: name, value, and whether the user gave it.
    #[getter]
    fn settings(&self) -> Vec<(String, String, bool)> {
        figures::settings(&self.0.settings)
    }

    /// Returns the description as JSON.
    fn to_json(&self) -> String {
        self.0.to_json()
    }

    /// Returns the records that were described: for each, the index of the given record from which it comes, the
    /// record, and the steps applied to it.
    fn records<'py>(&self, py: Python<'py>) -> PyResult<Vec<UsedRecord<'py>>> {
        used_records(py, &self.0.data)
    }

    /// Returns the faults, each with the index of the given record in which it was found.
    #[getter]
    fn faults<'py>(&self, py: Python<'py>) -> PyResult<Vec<(usize, Bound<'py, PyDict>)>> {
        faults_of(py, &self.0.data)
    }

    /// Returns the describing function of the description.
    fn function(&self) -> PyDescribingFunction {
        PyDescribingFunction {
            found: self.0.found.function.clone(),
        }
    }

    /// Returns the unwrapped phase in deg at each line.
    #[getter]
    fn phase_deg<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.0.found.phases_deg().iter().map(|p| p.value).collect())
    }

    /// Returns the crossover frequency and the margins; `None` without a controlled element.
    #[getter]
    fn open_loop<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(margins) = self.0.margins() else {
            return Ok(None);
        };
        let all = PyDict::new(py);
        all.set_item("crossover_rad_s", margins.crossover_rad_s.map(value_and_error))?;
        all.set_item("phase_margin_deg", margins.phase_margin_deg.map(value_and_error))?;
        all.set_item("gain_margin_db", margins.gain_margin_db.map(value_and_error))?;
        all.set_item(
            "phase_crossover_rad_s",
            margins.phase_crossover_rad_s.map(value_and_error),
        )?;
        Ok(Some(all))
    }

    /// Returns two estimates as shares of the variance of u: the part of u at non-excited frequencies, and the whole
    /// remnant, which includes its part at the lines.
    #[getter]
    fn remnant(&self) -> (ValueWithError, ValueWithError) {
        let function = &self.0.found.function;
        (
            value_and_error(function.off_line_share),
            value_and_error(function.noise_ratio),
        )
    }

    /// Returns the verdict: level, reasons and notes.
    #[getter]
    fn verdict(&self) -> String {
        verdict(&self.0.found.verdict)
    }

    /// Returns the channel of the excitation and its period in s.
    #[getter]
    fn excitation(&self) -> (Option<String>, f64) {
        (self.0.found.channel.clone(), self.0.found.excitation.period_s())
    }
}

#[pyfunction]
#[pyo3(signature = (records, *, harmonics, omega, period, channel, least_amplitude, averaging, reference, realisation, start, stop,
    offset_samples, detrend, smoothing_bins))]
#[allow(clippy::too_many_arguments)]
pub fn describing_function<'py>(
    py: Python<'py>,
    records: Vec<Bound<'py, PyAny>>,
    harmonics: Option<Vec<usize>>,
    omega: Option<Vec<f64>>,
    period: Option<f64>,
    channel: Option<String>,
    least_amplitude: f64,
    averaging: &str,
    reference: Option<String>,
    realisation: &str,
    start: Option<f64>,
    stop: Option<f64>,
    offset_samples: f64,
    detrend: &str,
    smoothing_bins: usize,
) -> Outcome<PyDescribingFunction> {
    let wanted: Vec<&str> = channel.iter().chain(&reference).map(String::as_str).collect();
    let records = arrays::records(&records, ChannelSelection::Only(&wanted))?;
    let excitation = match (harmonics, omega, channel, period) {
        (Some(harmonics), None, _, Some(period)) => Excitation::from_harmonics(&harmonics, period)?,
        (None, Some(omega), _, Some(period)) => Excitation::new(&omega, period)?,
        (None, None, Some(channel), period_s) => {
            let search = LineDetectionOptions {
                period_s,
                min_amplitude: least_amplitude,
            };
            Excitation::detect(&records[0], &channel, &search)?
        }
        (None, None, None, _) => {
            return Err(bad_option(
                "there is no excitation: give the channel that contains it, or harmonics or omega with the period",
            ));
        }
        (Some(_), Some(_), _, _) => return Err(bad_option("give harmonics or omega, not both")),
        (_, _, _, None) => return Err(bad_option("harmonics and omega need the period in s")),
    };
    let words = [("ratios", 0), ("reference", 1), ("same-excitation", 2)];
    let averaging = match (names::value_of_name("averaging", averaging, &words)?, reference) {
        (0, _) => Averaging::Ratios,
        (1, Some(channel)) => Averaging::Reference { channel },
        (1, None) => return Err(bad_option("averaging=\"reference\" needs a channel as reference")),
        _ => Averaging::SameExcitation,
    };
    let realisation = [("record", Realisation::Record), ("period", Realisation::Period)]
        .into_iter()
        .find(|(name, _)| *name == realisation)
        .map(|(_, value)| value)
        .ok_or_else(|| {
            bad_option(format!(
                "realisation is {realisation:?}, expected \"record\" or \"period\""
            ))
        })?;
    let options = DescribingOptions {
        averaging,
        realisation,
        from_s: start,
        to_s: stop,
        offset_samples,
        detrend: names::detrend(detrend)?,
        smoothing_bins,
        element: None,
    };
    let found = py.detach(|| describe_lines(&records, &excitation, &options))?;
    Ok(PyDescribingFunction { found })
}

#[pymethods]
impl PyDescribingFunction {
    /// Returns columns by name, with one value for each line.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let lines = &self.found.lines;
        let all = PyDict::new(py);
        let column = |of: &dyn Fn(&hoid_ident::frequency::Line) -> f64| array(py, lines.iter().map(of).collect());
        all.set_item("omega", column(&|l| l.omega_rad_s))?;
        all.set_item(
            "harmonic",
            PyArray1::from_iter(py, lines.iter().map(|l| l.harmonic as i64)),
        )?;
        all.set_item("response", PyArray1::from_iter(py, lines.iter().map(|l| l.response)))?;
        all.set_item("response_se", column(&|l| l.standard_error.unwrap_or(f64::NAN)))?;
        all.set_item("coherence", column(&|l| l.coherence.unwrap_or(f64::NAN)))?;
        type LineQuantity = fn(&hoid_ident::frequency::Line) -> Estimate;
        let both: [(&str, LineQuantity); 2] =
            [("magnitude_db", |l| l.magnitude_db()), ("phase_deg", |l| l.phase_deg())];
        for (name, of) in both {
            all.set_item(name, column(&|l| of(l).value))?;
            all.set_item(format!("{name}_se"), column(&|l| error_or_nan(of(l))))?;
        }
        Ok(all)
    }

    /// Returns the complex response of each run (or period) at each line, with one array per run.
    #[getter]
    fn per_run<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyArray1<Complex64>>>> {
        let runs = self.found.lines.first().map_or(0, |line| line.per_run.len());
        let row = |k: usize| PyArray1::from_iter(py, self.found.lines.iter().map(|line| line.per_run[k]));
        Ok((0..runs).map(row).collect())
    }

    /// Returns the frequencies in rad/s, the density of the remnant, and its standard error.
    #[getter]
    fn remnant_spectrum<'py>(&self, py: Python<'py>) -> [Bound<'py, PyArray1<f64>>; 3] {
        let bands = &self.found.remnant_spectrum;
        [
            array(py, bands.iter().map(|b| b.omega_rad_s).collect()),
            array(py, bands.iter().map(|b| b.density).collect()),
            array(py, bands.iter().map(|b| b.standard_error()).collect()),
        ]
    }

    #[getter]
    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (f, all) = (&self.found, PyDict::new(py));
        all.set_item("runs", f.runs.iter().map(|r| r.label.clone()).collect::<Vec<_>>())?;
        all.set_item("off_line_share", value_and_error(f.off_line_share))?;
        all.set_item("noise_ratio", value_and_error(f.noise_ratio))?;
        all.set_item("rms_e", value_and_error(f.rms_e))?;
        all.set_item("rms_u", value_and_error(f.rms_u))?;
        Ok(all)
    }

    /// Fits the gain, the lead (in s) and the delay (in s) of the person to the response, and returns them with the
    /// misfit.
    #[pyo3(signature = (*, lead, weights, delay))]
    fn gain_lead_delay<'py>(
        &self,
        py: Python<'py>,
        lead: bool,
        weights: &str,
        delay: (f64, f64),
    ) -> Outcome<Bound<'py, PyDict>> {
        let words = [
            ("coherence", LineWeights::Coherence),
            ("variance", LineWeights::Variance),
            ("uniform", LineWeights::Uniform),
        ];
        let options = GainLeadDelayOptions {
            lead,
            weights: names::value_of_name("weights", weights, &words)?,
            delay_range_s: delay,
        };
        let found = self.found.fit_gain_lead_delay(&options)?;
        let all = PyDict::new(py);
        all.set_item("gain", value_and_error(found.gain))?;
        all.set_item("lead_s", value_and_error(found.lead_s))?;
        all.set_item("delay_s", value_and_error(found.delay_s))?;
        all.set_item("misfit", found.misfit)?;
        Ok(all)
    }

    /// Returns the crossover frequency and the phase margin of the loop with a controlled element.
    fn margins<'py>(&self, py: Python<'py>, element: ControlledElement) -> Outcome<Bound<'py, PyDict>> {
        let margins = self.found.open_loop(&element.transfer_function()?).margins().estimates;
        let all = PyDict::new(py);
        all.set_item("crossover_rad_s", margins.crossover_rad_s.map(value_and_error))?;
        all.set_item("phase_margin_deg", margins.phase_margin_deg.map(value_and_error))?;
        Ok(all)
    }
}
