//! Options of a describing function: averaging, spans, offsets, and the channels of the controlled element.

use hoid_model::Detrend;

/// Method of averaging over runs.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Averaging {
    /// The mean of the ratios `U_i/E_i`. Coherence is that between e and u.
    #[default]
    Ratios,
    /// `sum U_i D_i* / sum E_i D_i*` with D_i of this channel, the forcing function or the
    /// disturbance. Phases may differ between runs. Coherence is that between this channel and u.
    Reference {
        /// Name of the channel.
        channel: String,
    },
    /// The same with D_i = 1: every run (and period) starts at the same phase of the same excitation.
    SameExcitation,
}

/// Definition of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Realisation {
    /// Each record is one realisation, however many periods it has.
    #[default]
    Record,
    /// Each period of each record is one, so that one record has a spread. The remnants of neighbouring periods are
    /// assumed independent.
    Period,
}

/// Channels from which the controlled element is estimated as `Y/(U + D)` at the lines.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MeasuredElement {
    /// Name of the channel of its output y.
    pub output: String,
    /// Name of the channel of a disturbance that is added to u, row by row and with the offset of u, if there is one:
    /// without the disturbance, `Y/U` would be minus the inverse of H.
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
    /// End of the span, s, which is excluded.
    pub to_s: Option<f64>,
    /// `e[k]` belongs to `u[k + offset_samples]`, an integer or not. Default 0.
    pub offset_samples: f64,
    /// Trend removed from e and u of each run beforehand. A mean has no effect on the lines, but on the rms; a straight
    /// line has power at all lines. Default none.
    pub detrend: Detrend,
    /// Number of bins of the shortest run that are averaged into one value of the remnant spectrum. Default 8.
    pub smoothing_bins: usize,
    /// Channels from which the controlled element is estimated, if any.
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
