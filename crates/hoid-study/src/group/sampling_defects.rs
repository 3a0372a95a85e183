//! Sampling defects of a virtual experiment.

use hoid_io::{ColumnValues, OutputColumn, OutputTable};
use hoid_model::Record;
use hoid_numerics::statistics::root_mean_square;

/// A sampling defect that occurs in recorded data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SamplingDefect {
    /// Sample times with a jitter of one fifth of a sample.
    Jitter,
    /// One row in two hundred is missing.
    Missing,
    /// One row in two hundred is duplicated.
    Repeated,
    /// A clock that is slow by 0.2 %.
    SlowClock,
    /// A stick that saturates at 1.5 times the root mean square of u.
    Saturated,
    /// A stick quantised to 8 bits over its range.
    Quantised,
    /// A recorder that repeats the same values for half a second, once per run.
    Stalled,
}

impl SamplingDefect {
    /// All defects.
    pub const ALL: [Self; 7] = [
        Self::Jitter,
        Self::Missing,
        Self::Repeated,
        Self::SlowClock,
        Self::Saturated,
        Self::Quantised,
        Self::Stalled,
    ];

    /// True if the rows are no longer evenly spaced in time.
    pub(super) fn is_uneven(self) -> bool {
        matches!(self, Self::Jitter | Self::Missing | Self::Repeated)
    }

    /// Returns the name of the defect.
    pub fn name(self) -> &'static str {
        match self {
            Self::Jitter => "jitter",
            Self::Missing => "missing",
            Self::Repeated => "repeated",
            Self::SlowClock => "slow-clock",
            Self::Saturated => "saturated",
            Self::Quantised => "quantised",
            Self::Stalled => "stalled",
        }
    }
}

/// Returns t and the given columns of a run as recorded with these defects. `noise` contains one normal deviate per
/// sample.
pub(super) fn recorded_table(
    record: &Record,
    names: &[&str],
    defects: &[SamplingDefect],
    noise: &[f64],
) -> OutputTable {
    let has = |defect: SamplingDefect| defects.contains(&defect);
    let n = record.len();
    let ts = record.sample_time().s();
    let mut t = record.times_s();
    if has(SamplingDefect::SlowClock) {
        t.iter_mut().for_each(|t| *t *= 0.998);
    }
    if has(SamplingDefect::Jitter) {
        // The jitter is less than half a sample, so the order of the samples is kept.
        t.iter_mut()
            .zip(noise)
            .for_each(|(t, z)| *t += (0.2 * z).clamp(-0.45, 0.45) * ts);
    }
    let mut u = record.output().to_vec();
    let sd = root_mean_square(&u);
    if has(SamplingDefect::Saturated) {
        u.iter_mut().for_each(|u| *u = u.clamp(-1.5 * sd, 1.5 * sd));
    }
    if has(SamplingDefect::Quantised) {
        let step = 8.0 * sd / 256.0;
        u.iter_mut().for_each(|u| *u = (*u / step).round() * step);
    }
    // Returns the row from which the values of row k are taken; the times are not repeated.
    let held = |k: usize| {
        let stall = n / 3..n / 3 + (0.5 / ts) as usize;
        if has(SamplingDefect::Stalled) && stall.contains(&k) {
            stall.start
        } else {
            k
        }
    };
    let mut rows: Vec<usize> = (0..n).collect();
    // Selects about one row in two hundred. The deviate is the same with or without the defect.
    let rare = |k: usize| (noise[k] * 1e6).abs() as u64 % 200;
    if has(SamplingDefect::Missing) {
        rows.retain(|k| *k == 0 || rare(*k) != 0);
    }
    if has(SamplingDefect::Repeated) {
        rows = rows
            .into_iter()
            .flat_map(|k| std::iter::repeat_n(k, if rare(k) == 1 { 2 } else { 1 }))
            .collect();
    }
    let column = |name: &str, values: &[f64]| OutputColumn {
        name: name.to_owned(),
        values: ColumnValues::Real(
            rows.iter()
                .map(|k| values[if name == "t" { *k } else { held(*k) }])
                .collect(),
        ),
    };
    OutputTable {
        comments: defects
            .iter()
            .map(|defect| format!("trouble: {}", defect.name()))
            .collect(),
        columns: std::iter::once(column("t", &t))
            .chain(names.iter().map(|name| match *name {
                "u" => column("u", &u),
                other => column(other, record.channel(other).unwrap_or_default()),
            }))
            .collect(),
    }
}
