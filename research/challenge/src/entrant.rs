//! An entrant: any method that estimates the response of a person and the times of changes.

use hoid_model::{Complex64, Record, SampleTime};

/// Signals that an entrant processes sample by sample, and the estimates that are requested.
#[derive(Debug, Clone)]
pub struct Task {
    /// Sample time.
    pub sample_time: SampleTime,
    /// Error; NaN where nothing was recorded. The first sample is at time 0.
    pub e: Vec<f64>,
    /// Control output.
    pub u: Vec<f64>,
    /// Name of the run.
    pub label: String,
    /// Span that may be used as a whole for a start fit, s. No estimate is requested before its end.
    pub start_s: (f64, f64),
    /// Delay in samples including the delay of the hold; `None` if it is not given.
    pub nk: Option<usize>,
    /// Frequencies at which the response is requested, rad/s.
    pub lines_rad_s: Vec<f64>,
    /// Times at which the response is requested (s), in ascending order.
    pub asked_s: Vec<f64>,
    /// Seam between two joined recordings; `None` for a single recording.
    pub seam: Option<Seam>,
}

/// Data before the second of two joined recordings. A filter with the state from the end of the first recording would
/// jump at the seam as no person does. It therefore processes these samples first, without an update of the estimate.
#[derive(Debug, Clone)]
pub struct Seam {
    /// Index of the first sample of the second recording.
    pub at: usize,
    /// Error before the second recording.
    pub e: Vec<f64>,
    /// Control output before the second recording.
    pub u: Vec<f64>,
}

impl Task {
    /// Time of a sample, s.
    pub fn time_s(&self, k: usize) -> f64 {
        k as f64 * self.sample_time.s()
    }

    /// Index of the last sample at or before a time.
    pub fn sample_index(&self, t_s: f64) -> usize {
        ((t_s / self.sample_time.s() + 1e-6) as usize).min(self.e.len().saturating_sub(1))
    }

    /// All samples as a record; `None` if samples are missing.
    pub fn record(&self) -> Option<Record> {
        self.span(0, self.e.len())
    }

    /// The start span as a record; `None` if samples are missing.
    pub fn start_record(&self) -> Option<Record> {
        self.span(self.sample_index(self.start_s.0), self.sample_index(self.start_s.1))
    }

    /// The samples of a span as a record; `None` if samples are missing.
    pub fn span(&self, from: usize, to: usize) -> Option<Record> {
        let channel = |name: &str, x: &[f64]| hoid_model::Channel::new(name, "", x[from..to].to_vec());
        let record = Record::new(self.sample_time, channel("e", &self.e), channel("u", &self.u)).ok()?;
        Some(record.labelled(self.label.clone()).starting_at(self.time_s(from)))
    }

    /// All samples in order, with the history of the second recording before it, as index, error and control output;
    /// the index is `None` for the history.
    pub fn samples(&self) -> impl Iterator<Item = (Option<usize>, f64, f64)> + '_ {
        let at = self.seam.as_ref().map_or(self.e.len(), |seam| seam.at);
        let own = move |from: usize, to: usize| (from..to).map(move |k| (Some(k), self.e[k], self.u[k]));
        let history = self.seam.iter().flat_map(|seam| seam.e.iter().zip(&seam.u));
        own(0, at)
            .chain(history.map(|(e, u)| (None, *e, *u)))
            .chain(own(at, self.e.len()))
    }
}

/// Estimate of the response at a time.
#[derive(Debug, Clone, Default)]
pub struct ReportedResponse {
    /// Response H at each line; empty if there is no estimate.
    pub response: Vec<Complex64>,
    /// Variances of the real and imaginary parts of the response and their covariance, at each line.
    pub covariance: Option<Vec<[f64; 3]>>,
    /// Parameters as name, value and standard error; the names are those of
    /// [`Operator::named_parameters`](super::Operator::named_parameters).
    pub parameters: Vec<(&'static str, f64, Option<f64>)>,
}

/// A declared change.
#[derive(Debug, Clone, PartialEq)]
pub struct Alarm {
    /// Time at which the change is declared, s.
    pub t_s: f64,
    /// True if the change is attributed only to the remnant.
    pub of_remnant: bool,
}

/// Result of an entrant.
#[derive(Debug, Clone, Default)]
pub struct EntrantResult {
    /// Estimates at the requested times.
    pub estimates: Vec<ReportedResponse>,
    /// Declared changes; `None` for an entrant that does not detect changes.
    pub alarms: Option<Vec<Alarm>>,
    /// Names of the findings about the result.
    pub findings: Vec<String>,
}

/// A participant of the challenge.
pub trait Entrant: Send + Sync {
    /// Returns the name of the entrant.
    fn name(&self) -> String;

    /// Processes the signals and returns the estimates.
    ///
    /// # Errors
    /// The reason why the entrant fails.
    fn follow(&self, task: &Task) -> Result<EntrantResult, String>;
}

/// Covariance of a complex sum `sum g_i theta_i`: variance of the real part, variance of the imaginary part, and their
/// covariance.
pub(super) fn complex_covariance(gradient: &[Complex64], covariance: &[f64]) -> [f64; 3] {
    let p = gradient.len();
    let mut sums = [0.0; 3];
    for (i, a) in gradient.iter().enumerate() {
        for (j, b) in gradient.iter().enumerate() {
            let c = covariance[i * p + j];
            sums[0] += a.re * c * b.re;
            sums[1] += a.im * c * b.im;
            sums[2] += a.re * c * b.im;
        }
    }
    sums
}
