//! An entrant: anything that estimates the response of a person and the times of changes.

use hoid_model::{Complex64, Record, SampleTime};

/// Signals to process, sample by sample.
#[derive(Debug, Clone)]
pub struct Task {
    /// Time between two samples.
    pub sample_time: SampleTime,
    /// Error; NaN if nothing was recorded. The first sample is at time 0.
    pub e: Vec<f64>,
    /// Control.
    pub u: Vec<f64>,
    /// Name of the run.
    pub label: String,
    /// The span that may be used at once for a start, s. No estimate is requested before its end.
    pub start_s: (f64, f64),
    /// The delay in samples including that of the hold, if given.
    pub nk: Option<usize>,
    /// Frequencies at which the response is requested, rad/s.
    pub lines_rad_s: Vec<f64>,
    /// Times at which it is requested, s, in order.
    pub asked_s: Vec<f64>,
    /// The seam of two joined recordings.
    pub seam: Option<Seam>,
}

/// Data before the second of two recordings. A filter whose state is that of the end of the first
/// would jump at the seam as no person does: it processes these samples first, without an update of
/// the estimate.
#[derive(Debug, Clone)]
pub struct Seam {
    /// First sample of the second recording.
    pub at: usize,
    /// Error before it.
    pub e: Vec<f64>,
    /// Control before it.
    pub u: Vec<f64>,
}

impl Task {
    /// Time of a sample, s.
    pub fn time_s(&self, k: usize) -> f64 {
        k as f64 * self.sample_time.s()
    }

    /// The sample at or before a time.
    pub fn sample(&self, t_s: f64) -> usize {
        ((t_s / self.sample_time.s() + 1e-6) as usize).min(self.e.len().saturating_sub(1))
    }

    /// The whole as a record, if all of it was recorded.
    pub fn record(&self) -> Option<Record> {
        self.span(0, self.e.len())
    }

    /// The start span as a record, if all of it was recorded.
    pub fn start_record(&self) -> Option<Record> {
        self.span(self.sample(self.start_s.0), self.sample(self.start_s.1))
    }

    /// Some samples as a record.
    pub fn span(&self, from: usize, to: usize) -> Option<Record> {
        let channel = |name: &str, x: &[f64]| hoid_model::Channel::new(name, "", x[from..to].to_vec());
        let record = Record::new(self.sample_time, channel("e", &self.e), channel("u", &self.u)).ok()?;
        Some(record.labelled(self.label.clone()).starting_at(self.time_s(from)))
    }

    /// All samples in order, with the history of the second recording before it: sample index, or
    /// none for the history; error; control.
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
    /// H at each line; empty if there is none.
    pub response: Vec<Complex64>,
    /// Variances of its real and imaginary part and their covariance, at each line.
    pub covariance: Option<Vec<[f64; 3]>>,
    /// Parameters under the names of [`Operator::named`](super::Operator::named), with standard
    /// errors.
    pub parameters: Vec<(&'static str, f64, Option<f64>)>,
}

/// A declared change.
#[derive(Debug, Clone, PartialEq)]
pub struct Alarm {
    /// Time, s.
    pub t_s: f64,
    /// True if it is attributed to the remnant only.
    pub of_remnant: bool,
}

/// Result of an entrant.
#[derive(Debug, Clone, Default)]
pub struct EntrantResult {
    /// The estimate at each requested time.
    pub said: Vec<ReportedResponse>,
    /// The declared changes; none for an entrant that declares none.
    pub alarms: Option<Vec<Alarm>>,
    /// Names of the findings against the result.
    pub findings: Vec<String>,
}

/// A participant of the challenge.
pub trait Entrant: Send + Sync {
    /// Its name.
    fn name(&self) -> String;

    /// Processes the signals.
    ///
    /// # Errors
    /// The reason for a failure.
    fn follow(&self, task: &Task) -> Result<EntrantResult, String>;
}

/// Covariance of a complex sum `sum g_i theta_i`: variance of the real part, of the imaginary part,
/// and their covariance.
pub(super) fn of_complex(gradient: &[Complex64], covariance: &[f64]) -> [f64; 3] {
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
