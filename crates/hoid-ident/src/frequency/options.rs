//! Options of a describing function: averaging, span, offset, and the channels of the controlled element.

use hoid_model::Detrend;

/// Method of averaging over runs.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Averaging {
    /// Mean of the ratios `U_i/E_i`. The coherence is computed between e and u.
    #[default]
    Ratios,
    /// `sum U_i D_i* / sum E_i D_i*`, where D_i is the coefficient of a forcing function or a disturbance. Phases may
    /// differ between runs. The coherence is computed between this channel and u.
    Reference {
        /// Name of the channel with the forcing function or disturbance.
        channel: String,
    },
    /// `sum U_i / sum E_i`: every run (or period) starts at the same phase of the same excitation.
    SameExcitation,
}

/// Definition of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Realisation {
    /// Each record is one run, regardless of its number of periods.
    #[default]
    Record,
    /// Each period of each record is one run, so a single record has a spread. The remnants of neighbouring periods are
    /// assumed to be independent.
    Period,
}

/// Channels for estimating the controlled element as `Y/(U + D)` at the lines.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MeasuredElement {
    /// Name of the channel with the output y of the controlled element.
    pub output: String,
    /// Name of the channel with a disturbance that is added to u sample by sample, with the offset of u; `None` if
    /// there is no disturbance. If a disturbance acts but is not named, `Y/U` is the negative inverse of H.
    pub disturbance: Option<String>,
}

/// Options of [`super::describe()`].
#[derive(Debug, Clone, PartialEq)]
pub struct DescribingOptions {
    /// Method of averaging over runs. Default [`Averaging::Ratios`].
    pub averaging: Averaging,
    /// Definition of a run. Default [`Realisation::Record`].
    pub realisation: Realisation,
    /// Start of the span, s; `None` for the start of the record.
    pub from_s: Option<f64>,
    /// End of the span, s (exclusive); `None` for the end of the record.
    pub to_s: Option<f64>,
    /// Offset between the channels: `e[k]` belongs to `u[k + offset_samples]`. The offset need not be an integer.
    /// Default 0.
    pub offset_samples: f64,
    /// Trend removed from e and u of each run before the analysis. A mean affects the rms but not the lines; a straight
    /// line has power at all lines. Default none.
    pub detrend: Detrend,
    /// Width of a band of the remnant spectrum, in frequency bins of the shortest run. Default 8.
    pub smoothing_bins: usize,
    /// Channels for estimating the controlled element, if it is estimated.
    pub element: Option<MeasuredElement>,
}

impl Default for DescribingOptions {
    fn default() -> Self {
        Self {
            averaging: Averaging::default(),
            realisation: Realisation::default(),
            from_s: None,
            to_s: None,
            offset_samples: 0.0,
            detrend: Detrend::None,
            smoothing_bins: 8,
            element: None,
        }
    }
}
