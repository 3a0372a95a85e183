//! Residual auto- and cross-correlation with the bounds for uncorrelated residuals.

use hoid_ident::validation::Correlation;
use hoid_model::SampleTime;
use kuva::prelude::{LollipopPlot, ReferenceLine, ShadedRegion};

use super::{
    labels,
    style::{self, BLUE, GREY, VERMILLION},
    svg,
};

const HEIGHT: f64 = 220.0;

/// Draws the autocorrelation of the residuals over positive lags with its 99 % bounds. Values outside the bounds are
/// vermillion.
pub fn autocorrelation(id: &str, correlation: &Correlation, sample_time: SampleTime) -> String {
    stems(
        id,
        "Autocorrelation of the residuals",
        "autocorrelation (-)",
        correlation,
        sample_time,
    )
}

/// Draws the cross-correlation of the residuals and the input over negative and positive lags with its 99 % bounds.
/// Values outside the bounds are vermillion.
pub fn cross_correlation(id: &str, correlation: &Correlation, sample_time: SampleTime) -> String {
    stems(
        id,
        "Cross-correlation of residuals and input",
        "cross-correlation (-)",
        correlation,
        sample_time,
    )
}

fn stems(id: &str, title: &str, ordinate: &str, correlation: &Correlation, sample_time: SampleTime) -> String {
    let bound = correlation.bound_99;
    let points = correlation
        .lags
        .iter()
        .map(|&k| k as f64)
        .zip(correlation.values.iter().copied());
    let mut stems = LollipopPlot::new()
        .with_stem_width(1.4)
        .with_dot_radius(1.9)
        .with_dot_stroke_width(0.0)
        .with_show_baseline(false);
    for (lag, value) in points.filter(|(_, v)| v.is_finite()) {
        let colour = if value.abs() > bound { VERMILLION } else { BLUE };
        stems = stems.with_colored_point(lag, value, colour);
    }
    let first = correlation.lags.first().map_or(0.0, |&k| (k as f64).min(0.0));
    let last = correlation.lags.last().map_or(1.0, |&k| k as f64);
    let room = 0.02 * (last - first);
    let values = correlation.values.iter().copied();
    let range = style::padded_range(values.chain([-1.2 * bound, 1.2 * bound]));
    let edge = |y: f64| {
        ReferenceLine::horizontal(y)
            .with_color(GREY)
            .with_stroke_width(1.0)
            .with_dasharray("4 3")
    };
    let layout = style::layout((first - room, last + room), range, HEIGHT)
        .with_x_label(labels::axis_label(
            "lag",
            &format!("samples of {} s", crate::numbers::format_plain(sample_time.s())),
        ))
        .with_y_label(ordinate)
        .with_shaded_region(
            ShadedRegion::horizontal(-bound, bound)
                .with_color(GREY)
                .with_opacity(0.18),
        )
        .with_reference_line(edge(bound))
        .with_reference_line(edge(-bound))
        .with_reference_line(
            ReferenceLine::horizontal(0.0)
                .with_color("#444444")
                .with_stroke_width(0.8)
                .with_dasharray("none"),
        );
    svg::finish(
        id,
        title,
        style::stack_panels(vec![(vec![stems.into()], layout, HEIGHT)]),
    )
}
