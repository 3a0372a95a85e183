//! The grid of figures with several panels: widths, heights and margins of the cells, labels of the rows, and titles of
//! columns or panels.
//!
//! A figure with a single column has the width of a text column; a figure with several has the width of a page. The
//! axes have the same width in all columns. Only the lowest panel of a column has tick labels and the name of the
//! abscissa.

use std::sync::Arc;

use kuva::{
    prelude::{Layout, Plot, TickFormat},
    render::render::Scene,
};

use super::{
    draw,
    labels::label_markup,
    style::{self, LEFT_MARGIN, RIGHT_MARGIN, WIDTH},
    svg,
};

/// Space above the axes of a panel, and below the axes if there is no abscissa.
const VERTICAL_MARGIN: f64 = 8.0;
/// Space to the left of a panel that shares the ordinate of its neighbour.
const PANEL_GAP: f64 = 16.0;
/// Space to the left of a panel that has its own ticks but no label.
const TICK_SPACE: f64 = 50.0;
/// Space to the right of a panel whose neighbour has ticks but no label. This space is less than half of a tick label,
/// which therefore extends into the space of the neighbour.
const NARROW_RIGHT_MARGIN: f64 = 5.0;
const TITLE_HEIGHT: f64 = 18.0;
/// Position of the centre of the ordinate label.
const LABEL_POSITION: f64 = 13.0;
/// Distance of the name of the abscissa below the axis, with room for two rows of category names.
const NAME_DISTANCE: f64 = 44.0;

/// Selection of the panels of a row that have ticks and the label of the ordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ordinates {
    /// Each panel has ticks and a label.
    Each,
    /// Each panel has ticks; only the first has the label.
    Ticks,
    /// Only the first panel has ticks and the label, because all panels of a row have the same range.
    Shared,
}

impl Ordinates {
    /// Chooses the ordinates for panels with these names and units, given row by row. One label suffices if all panels
    /// of a row show the same quantity.
    pub fn of<'a>(labels: impl Iterator<Item = (&'a str, &'a str)>, columns: usize, shared: bool) -> Self {
        let labels: Vec<(&str, &str)> = labels.collect();
        let one = |row: &[(&str, &str)]| row.iter().all(|l| *l == row[0]);
        match shared {
            true => Self::Shared,
            false if labels.chunks(columns.max(1)).all(one) => Self::Ticks,
            false => Self::Each,
        }
    }
}

/// Rectangle of the axes of a panel, in units of the figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

impl Area {
    /// Number of columns of points to which a line between these axes is reduced: one for each unit of width.
    pub fn column_count(&self) -> usize {
        self.width.max(1.0) as usize
    }

    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }
}

/// Sizes of a grid of `n` panels, counted row by row; the last row may have fewer panels.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    n: usize,
    columns: usize,
    ordinates: Ordinates,
    titles: usize,
    above: f64,
    axes_height: f64,
    widths: Vec<f64>,
    heights: Vec<f64>,
}

impl Frame {
    /// Creates a frame of panels whose axes have this height. The first `titles` panels have a title: all panels, the
    /// panels of the first row, or none.
    pub fn new(n: usize, columns: usize, axes_height: f64, ordinates: Ordinates, titles: usize) -> Self {
        Self::with_space(n, columns, axes_height, ordinates, titles, (0.0, 0.0))
    }

    /// Creates a frame with additional space above each panel and at the right of the figure.
    pub fn with_space(
        n: usize,
        columns: usize,
        axes_height: f64,
        ordinates: Ordinates,
        titles: usize,
        (above, right_space): (f64, f64),
    ) -> Self {
        let columns = columns.max(1);
        let whole = if columns == 1 { WIDTH } else { 2.0 * WIDTH } - right_space;
        let mut frame = Self {
            n,
            columns,
            ordinates,
            titles,
            above,
            axes_height,
            widths: Vec::new(),
            heights: Vec::new(),
        };
        let margins: f64 = (0..columns).map(|c| frame.left(c) + frame.right(c)).sum();
        let axes = (whole - margins) / columns as f64;
        frame.widths = (0..columns).map(|c| frame.left(c) + axes + frame.right(c)).collect();
        frame.heights = (0..n.div_ceil(columns))
            .map(|row| frame.top(row) + axes_height + frame.bottom(row))
            .collect();
        frame
    }

    fn left(&self, column: usize) -> f64 {
        match self.ordinates {
            _ if column == 0 => LEFT_MARGIN,
            Ordinates::Each => LEFT_MARGIN,
            Ordinates::Ticks => TICK_SPACE,
            Ordinates::Shared => PANEL_GAP,
        }
    }

    fn right(&self, column: usize) -> f64 {
        match self.ordinates {
            Ordinates::Ticks if column + 1 < self.columns => NARROW_RIGHT_MARGIN,
            _ => RIGHT_MARGIN,
        }
    }

    fn top(&self, row: usize) -> f64 {
        let titled = row * self.columns < self.titles;
        VERTICAL_MARGIN + self.above + if titled { TITLE_HEIGHT } else { 0.0 }
    }

    fn bottom(&self, row: usize) -> f64 {
        let last = self.n.min((row + 1) * self.columns);
        if last + self.columns > self.n {
            style::BOTTOM_MARGIN
        } else {
            VERTICAL_MARGIN
        }
    }

    /// True if the panel is the lowest of its column.
    pub fn is_lowest(&self, i: usize) -> bool {
        i + self.columns >= self.n
    }

    /// True if the panel has ticks on its ordinate.
    pub fn has_ticks(&self, i: usize) -> bool {
        i.is_multiple_of(self.columns) || self.ordinates != Ordinates::Shared
    }

    /// True if the panel has a label on its ordinate.
    pub fn has_label(&self, i: usize) -> bool {
        i.is_multiple_of(self.columns) || self.ordinates == Ordinates::Each
    }

    /// Area of the axes of a panel.
    pub fn area(&self, i: usize) -> Area {
        let (row, column) = (i / self.columns, i % self.columns);
        let left = self.left(column);
        Area {
            left: self.widths[..column].iter().sum::<f64>() + left,
            top: self.heights[..row].iter().sum::<f64>() + self.top(row),
            width: self.widths[column] - left - self.right(column),
            height: self.axes_height,
        }
    }

    /// Returns the layout with the size and margins of a panel. Only the lowest panel of a column has tick labels on
    /// the abscissa.
    pub fn fit_layout(&self, i: usize, layout: Layout) -> Layout {
        let (row, column) = (i / self.columns, i % self.columns);
        let layout = layout
            .with_width(self.widths[column])
            .with_height(self.heights[row])
            .with_force_margins(self.left(column), self.right(column))
            .with_force_margins_y(self.top(row), self.bottom(row));
        if self.is_lowest(i) {
            return layout;
        }
        layout.with_x_tick_format(TickFormat::Custom(Arc::new(|_| String::new())))
    }

    /// Draws the panels with the name of the abscissa, the labels of the ordinates and the titles.
    pub fn draw_panels(
        &self,
        cells: Vec<(Vec<Plot>, Layout)>,
        abscissa: &str,
        label: impl Fn(usize) -> String,
        titles: &[String],
        right_space: f64,
    ) -> Scene {
        let mut scene = style::arrange_in_grid(cells, &self.widths, &self.heights);
        for i in (0..self.n).filter(|i| self.has_label(*i)) {
            let area = self.area(i);
            let (x, y) = (
                area.left - LEFT_MARGIN + LABEL_POSITION + 4.5,
                area.top + 0.5 * area.height,
            );
            let room = area.height + 2.0 * VERTICAL_MARGIN;
            scene.add(draw::fitted_text(x, y, label(i), room, Some(-90.0)));
        }
        for area in (0..self.n).filter(|i| self.is_lowest(*i)).map(|i| self.area(i)) {
            let (x, y) = (area.left + 0.5 * area.width, area.bottom() + NAME_DISTANCE);
            scene.add(draw::fitted_text(
                x,
                y,
                label_markup(abscissa),
                area.width + 2.0 * VERTICAL_MARGIN,
                None,
            ));
        }
        for (i, title) in titles.iter().take(self.n.min(self.titles)).enumerate() {
            let area = self.area(i);
            let (middle, y) = (area.left + 0.5 * area.width, area.top - VERTICAL_MARGIN - self.above);
            scene.add(draw::fitted_text(
                middle,
                y,
                label_markup(title),
                area.width + VERTICAL_MARGIN,
                None,
            ));
        }
        // The widths of the cells add up to the width of the figure, up to rounding errors.
        scene.width = (scene.width + right_space).round();
        scene
    }
}

/// A figure without panels.
pub fn empty_figure(id: &str, title: &str) -> String {
    svg::finish(id, title, Scene::new(WIDTH, 1.0))
}

/// The range of each panel; if `shared`, the smallest range that covers all panels of its row.
pub fn row_ranges(own: Vec<(f64, f64)>, columns: usize, shared: bool) -> Vec<(f64, f64)> {
    if !shared {
        return own;
    }
    let of_row = |row: &[(f64, f64)]| {
        let start = (f64::INFINITY, f64::NEG_INFINITY);
        let widest = row.iter().fold(start, |(l, h), r| (l.min(r.0), h.max(r.1)));
        vec![widest; row.len()]
    };
    own.chunks(columns.max(1)).flat_map(of_row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_equally_wide_and_fill_the_page() {
        for ordinates in [Ordinates::Each, Ordinates::Ticks, Ordinates::Shared] {
            for columns in [1, 2, 4] {
                let frame = Frame::with_space(2 * columns, columns, 80.0, ordinates, columns, (5.0, 30.0));
                let areas: Vec<Area> = (0..2 * columns).map(|i| frame.area(i)).collect();
                assert!(areas.iter().all(|a| (a.width - areas[0].width).abs() < 1e-9));
                let whole = if columns == 1 { WIDTH } else { 2.0 * WIDTH };
                assert!((areas[columns - 1].right() - (whole - 30.0 - RIGHT_MARGIN)).abs() < 1e-9);
                assert!(
                    areas
                        .windows(2)
                        .all(|w| w[1].left > w[0].right() || w[1].top > w[0].bottom())
                );
            }
        }
    }

    #[test]
    fn titles_add_space_above_their_rows() {
        let tops = |titles| {
            let frame = Frame::new(5, 2, 80.0, Ordinates::Shared, titles);
            [0, 2, 4].map(|i| frame.area(i).top)
        };
        let none = tops(0);
        assert_eq!(tops(2), none.map(|top| top + TITLE_HEIGHT));
        assert_eq!(
            tops(5),
            [
                none[0] + TITLE_HEIGHT,
                none[1] + 2.0 * TITLE_HEIGHT,
                none[2] + 3.0 * TITLE_HEIGHT
            ]
        );
    }

    #[test]
    fn lowest_panels_of_a_short_last_row_are_found() {
        let frame = Frame::new(5, 2, 80.0, Ordinates::Shared, 0);
        let lowest: Vec<bool> = (0..5).map(|i| frame.is_lowest(i)).collect();
        assert_eq!(lowest, [false, false, false, true, true]);
    }

    #[test]
    fn rows_with_several_quantities_label_each_panel() {
        let of = |labels: [&'static str; 4], shared| Ordinates::of(labels.into_iter().map(|l| (l, "s")), 2, shared);
        assert_eq!(of(["a", "a", "b", "b"], false), Ordinates::Ticks);
        assert_eq!(of(["a", "b", "a", "b"], false), Ordinates::Each);
        assert_eq!(of(["a", "a", "b", "b"], true), Ordinates::Shared);
    }

    #[test]
    fn rows_share_the_widest_range() {
        let own = vec![(0.0, 1.0), (-1.0, 0.5), (3.0, 4.0)];
        assert_eq!(row_ranges(own.clone(), 2, true), [(-1.0, 1.0), (-1.0, 1.0), (3.0, 4.0)]);
        assert_eq!(row_ranges(own.clone(), 2, false), own);
    }
}
