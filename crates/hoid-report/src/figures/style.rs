//! Properties common to all figures: size, colours and fonts.

use std::sync::Arc;

use kuva::{
    prelude::{Figure, Layout, LinePlot, Plot, Theme, TickFormat},
    render::render::Scene,
};

/// Width of a figure with a single column, in units of the SVG.
pub const WIDTH: f64 = 420.0;
/// Space for the tick labels and the label of the ordinate, equal in all figures so that panels are aligned.
pub const LEFT_MARGIN: f64 = 76.0;
pub const RIGHT_MARGIN: f64 = 14.0;
/// Space above the axes.
pub const TOP_MARGIN: f64 = 10.0;
/// Space below the axes for ticks and the label of the abscissa.
pub const BOTTOM_MARGIN: f64 = 48.0;
/// Space below the axes for ticks only.
pub const BOTTOM_MARGIN_WITHOUT_LABEL: f64 = 26.0;
pub const TEXT_SIZE: u32 = 13;

pub const BLACK: &str = "#000000";
pub const GREY: &str = "#999999";
pub const BLUE: &str = "#0072B2";
pub const VERMILLION: &str = "#D55E00";

/// Colours of the models, in the order of the report: blue, vermillion, green, purple, orange, sky blue.
pub const MODEL_COLOURS: [&str; 6] = [BLUE, VERMILLION, "#009E73", "#CC79A7", "#E69F00", "#56B4E9"];

/// Layout with fixed ranges of both axes.
pub fn layout((x_low, x_high): (f64, f64), (y_low, y_high): (f64, f64), height: f64) -> Layout {
    Layout::new((x_low, x_high), (y_low, y_high))
        .with_x_axis_min(x_low)
        .with_x_axis_max(x_high)
        .with_y_axis_min(y_low)
        .with_y_axis_max(y_high)
        .with_width(WIDTH)
        .with_height(height)
        .with_force_margins(LEFT_MARGIN, RIGHT_MARGIN)
        .with_force_margins_y(TOP_MARGIN, BOTTOM_MARGIN)
        .with_theme(Theme {
            grid_color: "#e4e4e4".to_owned(),
            ..Theme::light()
        })
        .with_font_family("Helvetica, Arial, 'Liberation Sans', sans-serif")
        .with_label_size(TEXT_SIZE)
        .with_tick_size(TEXT_SIZE)
        .with_body_size(TEXT_SIZE)
        .with_axis_line_width(1.0)
        .with_tick_format(TickFormat::Custom(Arc::new(tick_label)))
}

/// Label of a tick as the shortest decimal number, without rounding errors such as that of `0.1 + 0.2`.
fn tick_label(value: f64) -> String {
    let text = format!("{value:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    match text {
        "-0" | "" => "0".to_owned(),
        _ => text.to_owned(),
    }
}

/// Line through points; non-finite points are omitted.
pub fn line(points: impl IntoIterator<Item = (f64, f64)>, colour: &str, width: f64) -> LinePlot {
    let finite = |(x, y): &(f64, f64)| x.is_finite() && y.is_finite();
    LinePlot::new()
        .with_data(points.into_iter().filter(finite))
        .with_color(colour)
        .with_stroke_width(width)
}

/// True if the value can be drawn; differences of values that are too large would overflow.
pub fn is_drawable(value: f64) -> bool {
    value.abs() < 1e100
}

/// Range of the values with a margin of 5 % on both sides; if all values are equal, the range is widened.
pub fn padded_range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for value in values.into_iter().filter(|v| is_drawable(*v)) {
        low = low.min(value);
        high = high.max(value);
    }
    if low > high {
        return (-1.0, 1.0);
    }
    let room = match high - low {
        0.0 if high == 0.0 => 1.0,
        0.0 => 0.1 * high.abs(),
        span => 0.05 * span,
    };
    (low - room, high + room)
}

/// Stacks panels vertically, each with its own height.
pub fn stack_panels(panels: Vec<(Vec<Plot>, Layout, f64)>) -> Scene {
    let mut figure = Figure::new(panels.len(), 1)
        .with_cell_size(WIDTH, WIDTH)
        .with_spacing(0.0)
        .with_padding(0.0);
    let (mut plots, mut layouts) = (Vec::new(), Vec::new());
    for (row, (plot, layout, height)) in panels.into_iter().enumerate() {
        figure = figure.with_row_height(row, height);
        plots.push(plot);
        layouts.push(layout);
    }
    figure.with_plots(plots).with_layouts(layouts).render()
}

/// Arranges panels, given row by row, in columns and rows of these widths and heights; the last row may have fewer
/// panels.
pub fn arrange_in_grid(panels: Vec<(Vec<Plot>, Layout)>, widths: &[f64], heights: &[f64]) -> Scene {
    let mut figure = Figure::new(heights.len(), widths.len())
        .with_cell_size(WIDTH, WIDTH)
        .with_spacing(0.0)
        .with_padding(0.0);
    for (row, height) in heights.iter().enumerate() {
        figure = figure.with_row_height(row, *height);
    }
    for (column, width) in widths.iter().enumerate() {
        figure = figure.with_col_width(column, *width);
    }
    let (plots, layouts) = panels.into_iter().unzip();
    figure.with_plots(plots).with_layouts(layouts).render()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tick_labels_are_short() {
        assert_eq!(tick_label(0.1 + 0.2), "0.3");
        assert_eq!(tick_label(-0.0), "0");
        assert_eq!(tick_label(-1e-12), "0");
        assert_eq!(tick_label(20.0), "20");
    }

    #[test]
    fn ranges_always_have_a_width() {
        assert_eq!(padded_range([]), (-1.0, 1.0));
        assert_eq!(padded_range([0.0, f64::NAN]), (-1.0, 1.0));
        assert_eq!(padded_range([2.0]), (1.8, 2.2));
        assert_eq!(padded_range([0.0, 1.0]), (-0.05, 1.05));
    }
}
