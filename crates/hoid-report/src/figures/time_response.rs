//! Measured output, with the simulated and the one-step-ahead predicted output of a model.

use hoid_ident::validation::Validation;
use hoid_model::Record;
use kuva::prelude::Plot;

use super::{
    labels,
    legend::{Entry, Sample, add_legend},
    series::thinned_indices,
    style::{self, BLUE, GREY, VERMILLION},
    svg,
};

/// Length of a record divided by the length of its close-up; a close-up has at least `MIN_CLOSE_UP_SAMPLES` samples.
const CLOSE_UP_RATIO: usize = 8;
const MIN_CLOSE_UP_SAMPLES: usize = 50;

const RECORD_HEIGHT: f64 = 150.0;
const CLOSE_UP_HEIGHT: f64 = 190.0;

/// Draws the measured (grey), predicted (vermillion) and simulated (blue) output over time: the whole record above, and
/// below it the middle eighth, where the prediction can be distinguished from the measurement.
///
/// The ordinate covers all outputs, but extends beyond the measured output by at most half its range on either side;
/// values beyond (from an unstable model) are cut off. Long records are drawn with the smallest and the largest sample
/// in each column, which preserves peaks.
pub fn time_response(id: &str, record: &Record, validation: &Validation) -> String {
    let measured = record.output();
    let (low, high) = style::padded_range(measured.iter().copied());
    let half = 0.5 * (high - low);
    let models = validation.simulated.iter().chain(&validation.predicted);
    let (wanted_low, wanted_high) = style::padded_range(measured.iter().chain(models).copied());
    let range = (wanted_low.max(low - half), wanted_high.min(high + half));
    // The path is clipped at the axes; without this limit, values such as 1e300 would be written to the file.
    let bounded = |v: f64| v.clamp(range.0 - half, range.1 + half);

    let panel = |from: usize, to: usize| -> (Vec<Plot>, (f64, f64)) {
        let trace = |first: usize, values: &[f64], colour: &str, width: f64| -> Plot {
            let part =
                &values[from.saturating_sub(first).min(values.len())..to.saturating_sub(first).min(values.len())];
            let start = from.max(first);
            let points = thinned_indices(part)
                .into_iter()
                .map(|k| (record.time_s(start + k), bounded(part[k])));
            style::line(points, colour, width).into()
        };
        let plots = vec![
            trace(0, measured, GREY, 2.6),
            trace(validation.first, &validation.predicted, VERMILLION, 0.9),
            trace(validation.first, &validation.simulated, BLUE, 1.2),
        ];
        // A panel with a single sample still needs an axis.
        (plots, (record.time_s(from), record.time_s((to - 1).max(from + 1))))
    };
    let channel = record.output_channel();
    let ordinate = labels::axis_label(&channel.name, &channel.unit);
    let layout = |span, height| style::layout(span, range, height).with_y_label(ordinate.clone());

    let n = record.len();
    let mut panels = Vec::new();
    let (from, to) = if has_close_up(record) {
        let (plots, span) = panel(0, n);
        let upper =
            layout(span, RECORD_HEIGHT).with_force_margins_y(style::TOP_MARGIN, style::BOTTOM_MARGIN_WITHOUT_LABEL);
        panels.push((plots, upper, RECORD_HEIGHT));
        let part = n / CLOSE_UP_RATIO;
        ((n - part) / 2, (n + part) / 2)
    } else {
        (0, n)
    };
    let (plots, span) = panel(from, to);
    panels.push((
        plots,
        layout(span, CLOSE_UP_HEIGHT).with_x_label("time (s)"),
        CLOSE_UP_HEIGHT,
    ));
    let mut scene = style::stack_panels(panels);
    let entries = [
        Entry::new("measured", GREY, Sample::Line),
        Entry::new("predicted", VERMILLION, Sample::Line),
        Entry::new("simulated", BLUE, Sample::Line),
    ];
    add_legend(&mut scene, &entries);
    svg::finish(id, "Measured, simulated and predicted output over time", scene)
}

/// True if the record is long enough for a close-up of its middle.
pub fn has_close_up(record: &Record) -> bool {
    record.len() / CLOSE_UP_RATIO >= MIN_CLOSE_UP_SAMPLES
}
