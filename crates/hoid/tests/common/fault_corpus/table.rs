//! A recording as the columns of a file.

use std::fmt::Write as _;

use hoid::model::Record;

/// Columns over time: e, u, and the disturbance d if it was recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Time between two samples, s.
    pub h: f64,
    /// Time as in the file, in s unless the fault is a wrong unit of time.
    pub t: Vec<f64>,
    pub e: Vec<f64>,
    pub u: Vec<f64>,
    pub d: Option<Vec<f64>>,
}

impl Table {
    /// Makes the table of e and u of a record, with the disturbance if it is requested and recorded.
    pub fn of(record: &Record, with_disturbance: bool) -> Self {
        let h = record.sample_time().s();
        Self {
            h,
            t: (0..record.len()).map(|k| k as f64 * h).collect(),
            e: record.input().to_vec(),
            u: record.output().to_vec(),
            d: with_disturbance
                .then(|| record.channel("d").map(<[f64]>::to_vec))
                .flatten(),
        }
    }

    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Returns the time from the first sample to the end of the last sample, s.
    pub fn duration_s(&self) -> f64 {
        self.len() as f64 * self.h
    }

    /// Returns all columns except the time.
    pub fn columns_mut(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        [&mut self.e, &mut self.u].into_iter().chain(self.d.as_mut())
    }

    /// Numbers the time again, like a recorder without information about missing or duplicated rows.
    pub fn renumber(&mut self) {
        let (n, h) = (self.e.len(), self.h);
        self.t = (0..n).map(|k| k as f64 * h).collect();
    }

    /// Returns the table as CSV; missing values are empty cells.
    pub fn to_csv(&self) -> String {
        let mut text = String::from(if self.d.is_some() { "t,e,u,d\n" } else { "t,e,u\n" });
        let cell = |x: f64| if x.is_nan() { String::new() } else { x.to_string() };
        for k in 0..self.len() {
            let _ = write!(text, "{},{},{}", self.t[k], cell(self.e[k]), cell(self.u[k]));
            if let Some(d) = &self.d {
                let _ = write!(text, ",{}", cell(d[k]));
            }
            text.push('\n');
        }
        text
    }
}

/// Standard deviation.
pub fn standard_deviation(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt()
}
