//! Curves in a grid of panels, with bands, markers, error bars and stems, on linear or logarithmic axes.

use kuva::{
    prelude::{BandPlot, Plot},
    render::render::Scene,
};

use super::{
    axes::{log_range, with_abscissa, with_ordinate},
    draw::{self, BAND_OPACITY},
    frame::{self, Frame, Ordinates},
    labels::panel_label,
    legend::{Entry, Sample, add_legend_in_multiples_of},
    palette::Shade,
    scale::Scale,
    series::{runs, thinned_run_indices},
    style::{self, BLACK},
    svg,
};

/// Height of the axes of a panel; `SINGLE_PANEL_HEIGHT` is the height if the figure has a single panel.
const PANEL_HEIGHT: f64 = 112.0;
const SINGLE_PANEL_HEIGHT: f64 = 150.0;
const LINE_WIDTH: f64 = 1.4;
const MARKER_RADIUS: f64 = 2.2;
/// Half of the width of an error bar's cap.
const CAP_HALF_WIDTH: f64 = 2.5;
/// Margin outside the first and the last stem or marker, as a fraction of the abscissa.
const ABSCISSA_MARGIN: f64 = 0.03;

/// Style of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LineKind {
    /// Solid line in the colour of the curve.
    #[default]
    Line,
    /// Dashed line in the colour of the curve, so that a curve that coincides with it stays visible.
    Dashed,
    /// Dotted line in the colour of the curve.
    Dotted,
    /// Dashed black line for the true or specified value.
    Truth,
    /// Solid line with a marker at each value; the shape of the marker represents the level.
    Marked,
    /// A marker at each value, without a line.
    Points,
    /// A vertical line from the abscissa to each value, with a marker, for line spectra.
    Stems,
}

/// One curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name in the legend; empty for no entry. Entries with equal name and style appear only once.
    pub name: String,
    /// Line style.
    pub kind: LineKind,
    /// Colour of the curve.
    pub shade: Shade,
    /// Abscissas in ascending order.
    pub x: Vec<f64>,
    /// Ordinates. A value that is not finite leaves a gap; so does a value that is not positive on a logarithmic axis.
    pub y: Vec<f64>,
    /// Lower and upper edges of the band at each abscissa; empty if there is no band.
    pub band: Vec<(f64, f64)>,
    /// Lower and upper ends of the error bar at each abscissa; empty if there are no error bars.
    pub bars: Vec<(f64, f64)>,
}

/// One panel of curves.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CurvePanel {
    /// Name of the ordinate; `_` and `^` mark subscripts and superscripts of one character, or of several in braces.
    pub name: String,
    /// Unit of the ordinate; empty if it has none. An ordinate in `deg` has ticks at fractions of a full turn.
    pub unit: String,
    /// True for a logarithmic ordinate.
    pub logarithmic: bool,
    /// Range of the ordinate; if `None`, it covers the curves with their bands and error bars.
    pub ordinate_range: Option<(f64, f64)>,
    /// The curves, drawn over all bands in this order.
    pub curves: Vec<Curve>,
}

/// Panels with a common abscissa.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CurveGrid {
    /// The panels, row by row.
    pub panels: Vec<CurvePanel>,
    /// Panels per row; zero counts as one. A figure with a single column has the width of a text column; a figure with
    /// several has the width of a page.
    pub columns: usize,
    /// Titles of the columns, or of all panels; empty for no titles.
    pub titles: Vec<String>,
    /// Name and unit of the abscissa, such as `time (s)`.
    pub abscissa: String,
    /// True for a logarithmic abscissa.
    pub logarithmic_abscissa: bool,
    /// True if the panels of a row share an ordinate.
    pub shared_ordinates: bool,
}

/// Draws panels of curves as one figure. `title` is the text for screen readers.
pub fn curves(id: &str, title: &str, grid: &CurveGrid) -> String {
    let columns = grid.columns.max(1);
    let n = grid.panels.len();
    if n == 0 {
        return frame::empty_figure(id, title);
    }
    let labels = grid.panels.iter().map(|p| (p.name.as_str(), p.unit.as_str()));
    let ordinates = Ordinates::of(labels, columns, grid.shared_ordinates);
    let height = if n == 1 { SINGLE_PANEL_HEIGHT } else { PANEL_HEIGHT };
    let x_range = grid.abscissa_range();
    let ranges = frame::row_ranges(
        grid.panels.iter().map(CurvePanel::range).collect(),
        columns,
        grid.shared_ordinates,
    );
    let frame = Frame::new(n, columns, height, ordinates, grid.titles.len());
    let scale = |i: usize| Scale {
        area: frame.area(i),
        x: x_range,
        y: ranges[i],
        log_x: grid.logarithmic_abscissa,
        log_y: grid.panels[i].logarithmic,
    };
    let cell = |(i, panel): (usize, &CurvePanel)| {
        let layout = style::layout(x_range, ranges[i], height);
        let layout = with_abscissa(layout, x_range, grid.logarithmic_abscissa, frame.area(i).width);
        let layout = with_ordinate(
            layout,
            ranges[i],
            &panel.unit,
            panel.logarithmic,
            height,
            frame.has_ticks(i),
        );
        (panel.plots(&scale(i)), frame.fit_layout(i, layout))
    };
    let cells = grid.panels.iter().enumerate().map(cell).collect();
    let label = |i: usize| panel_label(&grid.panels[i].name, &grid.panels[i].unit);
    let mut scene = frame.draw_panels(cells, &grid.abscissa, label, &grid.titles, 0.0);
    for (i, panel) in grid.panels.iter().enumerate() {
        for curve in &panel.curves {
            curve.draw_marks(&mut scene, &scale(i));
        }
    }
    add_legend_in_multiples_of(&mut scene, &grid.entries(), grid.level_count());
    svg::finish(id, title, scene)
}

impl CurveGrid {
    fn abscissa_range(&self) -> (f64, f64) {
        let all = || self.panels.iter().flat_map(|p| &p.curves);
        let values = || all().flat_map(|c| c.x.iter().copied());
        let room = all().any(|c| matches!(c.kind, LineKind::Marked | LineKind::Points | LineKind::Stems));
        let room = if room { ABSCISSA_MARGIN } else { 0.0 };
        let drawable = |v: &f64| style::is_drawable(*v) && (*v > 0.0 || !self.logarithmic_abscissa);
        let ends = values().filter(drawable);
        let start = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = ends.fold(start, |(l, h), v| (l.min(v), h.max(v)));
        if low >= high {
            return match self.logarithmic_abscissa {
                true => log_range(values()),
                false => style::padded_range(values()),
            };
        }
        if self.logarithmic_abscissa {
            let factor = (high / low).powf(room);
            return (low / factor, high * factor);
        }
        // Rounding must not remove a tick at the very end of the axis.
        let room = room.max(1e-9);
        (low - room * (high - low), high + room * (high - low))
    }

    fn entries(&self) -> Vec<Entry> {
        let mut entries: Vec<Entry> = Vec::new();
        let all = || self.panels.iter().flat_map(|p| &p.curves);
        for curve in all().filter(|c| !c.name.is_empty()) {
            let sample = match curve.kind {
                LineKind::Line => Sample::Line,
                LineKind::Truth | LineKind::Dashed => Sample::Dashed,
                LineKind::Dotted => Sample::Dotted,
                LineKind::Marked => Sample::LineMark(curve.shade.mark()),
                LineKind::Points | LineKind::Stems => Sample::Point,
            };
            let entry = Entry::new(&curve.name, &curve.colour(), sample);
            if !entries.contains(&entry) {
                entries.push(entry);
            }
        }
        // The true value is the last entry of the legend, so that the levels of a method stay in one row.
        entries.sort_by_key(|entry| entry.sample == Sample::Dashed && entry.colour == BLACK);
        entries
    }

    /// Number of levels of the method with the most levels.
    fn level_count(&self) -> usize {
        let curves = self.panels.iter().flat_map(|p| &p.curves);
        curves.map(|c| c.shade.levels).max().unwrap_or(1)
    }
}

impl CurvePanel {
    fn range(&self) -> (f64, f64) {
        let edges = |c: &Curve| -> Vec<f64> { c.band.iter().chain(&c.bars).flat_map(|b| [b.0, b.1]).collect() };
        let mut values: Vec<f64> = self.curves.iter().flat_map(|c| c.y.iter().copied()).collect();
        if self.logarithmic {
            // On a logarithmic axis the lower edge of a wide band may be zero or negative; such an edge does not
            // determine the range.
            let least = values
                .iter()
                .copied()
                .filter(|v| *v > 0.0)
                .fold(f64::INFINITY, f64::min);
            let reached = self.curves.iter().flat_map(edges).filter(|v| *v > 0.1 * least);
            return match self.ordinate_range {
                Some((low, high)) if low > 0.0 && high > low && high.is_finite() => (low, high),
                _ => log_range(values.iter().copied().chain(reached)),
            };
        }
        if let Some((low, high)) = self.ordinate_range.filter(|(l, h)| h > l && (h - l).is_finite()) {
            return (low, high);
        }
        values.extend(self.curves.iter().flat_map(edges));
        if self.curves.iter().any(|c| c.kind == LineKind::Stems) {
            values.push(0.0);
        }
        style::padded_range(values)
    }

    /// Bands and lines of the panel; the bands precede the lines, which are drawn over them.
    fn plots(&self, scale: &Scale) -> Vec<Plot> {
        let mut plots: Vec<Plot> = self.curves.iter().flat_map(|c| c.bands(scale)).collect();
        plots.extend(self.curves.iter().flat_map(|c| c.lines(scale)));
        // A panel without curves still needs axes.
        if plots.is_empty() {
            plots.push(style::line([], BLACK, 1.0).into());
        }
        plots
    }
}

impl Curve {
    fn colour(&self) -> String {
        match self.kind {
            LineKind::Truth => BLACK.to_owned(),
            _ => self.shade.colour(),
        }
    }

    fn bands(&self, scale: &Scale) -> Vec<Plot> {
        let n = self.band.len().min(self.x.len());
        let known = |k: usize| scale.has_x(self.x[k]) && self.band[k].0.is_finite() && self.band[k].1.is_finite();
        let band = |run: std::ops::Range<usize>| -> Plot {
            BandPlot::new(
                run.clone().map(|k| self.x[k]),
                run.clone().map(|k| scale.clamp_to_axis(self.band[k].0)),
                run.map(|k| scale.clamp_to_axis(self.band[k].1)),
            )
            .with_color(self.colour())
            .with_opacity(BAND_OPACITY)
            .into()
        };
        runs(n, known).into_iter().filter(|r| r.len() > 1).map(band).collect()
    }

    fn lines(&self, scale: &Scale) -> Vec<Plot> {
        if matches!(self.kind, LineKind::Points | LineKind::Stems) {
            return Vec::new();
        }
        let n = self.y.len().min(self.x.len());
        let known = |k: usize| scale.has_x(self.x[k]) && scale.has_y(self.y[k]);
        let values = &self.y[..n];
        let line = |run: std::ops::Range<usize>| -> Plot {
            let kept = thinned_run_indices(values, run, scale.area.column_count()).into_iter();
            let points = kept.map(|k| (self.x[k], scale.limit_to_axes(values[k])));
            let line = style::line(points, &self.colour(), LINE_WIDTH);
            match self.kind {
                LineKind::Truth | LineKind::Dashed => line.with_dashed().into(),
                LineKind::Dotted => line.with_dotted().into(),
                _ => line.into(),
            }
        };
        runs(n, known).into_iter().filter(|r| r.len() > 1).map(line).collect()
    }

    /// Draws stems, error bars, markers and isolated values inside the axes.
    fn draw_marks(&self, scene: &mut Scene, scale: &Scale) {
        let colour = self.colour();
        let n = self.y.len().min(self.x.len());
        let known = |k: usize| scale.has_x(self.x[k]) && scale.has_y(self.y[k]);
        for k in (0..self.bars.len().min(n)).filter(|k| scale.has_x(self.x[*k])) {
            let (low, high) = self.bars[k];
            if !(low.is_finite() && high.is_finite()) || high < scale.y.0 || low > scale.y.1 {
                continue;
            }
            let x = scale.map_x(self.x[k]);
            let (from, to) = (
                scale.map_y(scale.clamp_to_axis(low)),
                scale.map_y(scale.clamp_to_axis(high)),
            );
            scene.add(draw::line((x, from), (x, to), &colour, 1.0, None));
            for (end, y) in [(low, from), (high, to)] {
                // An end of a bar that lies beyond the axes has no cap.
                if scale.clamp_to_axis(end) == end {
                    scene.add(draw::line(
                        (x - CAP_HALF_WIDTH, y),
                        (x + CAP_HALF_WIDTH, y),
                        &colour,
                        1.0,
                        None,
                    ));
                }
            }
        }
        let has_marker = matches!(self.kind, LineKind::Marked | LineKind::Points | LineKind::Stems);
        let mut at = Vec::new();
        for run in runs(n, known) {
            for k in run.clone().filter(|_| has_marker || run.len() == 1) {
                let (x, y) = (scale.map_x(self.x[k]), scale.map_y(scale.clamp_to_axis(self.y[k])));
                if self.kind == LineKind::Stems {
                    let foot = scale.map_y(scale.clamp_to_axis(0.0));
                    scene.add(draw::line((x, foot), (x, y), &colour, 1.2, None));
                }
                if scale.clamp_to_axis(self.y[k]) == self.y[k] {
                    at.push((x, y));
                }
            }
        }
        match self.kind {
            LineKind::Marked => at
                .iter()
                .for_each(|at| draw::mark(scene, *at, MARKER_RADIUS, self.shade.mark(), &colour)),
            _ => draw::points(scene, &at, MARKER_RADIUS, &colour, None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::draw::tests::contains_element, *};

    fn curve(kind: LineKind, x: &[f64], y: &[f64]) -> Curve {
        Curve {
            name: "one".to_owned(),
            kind,
            shade: Shade::of_method(0),
            x: x.to_vec(),
            y: y.to_vec(),
            band: Vec::new(),
            bars: Vec::new(),
        }
    }

    fn grid(curves: Vec<Curve>, logarithmic: bool) -> CurveGrid {
        CurveGrid {
            panels: vec![CurvePanel {
                name: "y".to_owned(),
                logarithmic,
                curves,
                ..CurvePanel::default()
            }],
            abscissa: "x (-)".to_owned(),
            logarithmic_abscissa: logarithmic,
            ..CurveGrid::default()
        }
    }

    #[test]
    fn stems_and_bars_are_drawn_at_their_coordinates() {
        let mut stems = curve(LineKind::Stems, &[1.0, 10.0, 100.0], &[1.0, 10.0, 100.0]);
        stems.bars = vec![(0.5, 2.0), (f64::NAN, 1.0), (-1.0, 1000.0)];
        let svg = curves("c", "t", &grid(vec![stems], true));
        let left = style::LEFT_MARGIN;
        let width = style::WIDTH - style::LEFT_MARGIN - style::RIGHT_MARGIN;
        // The abscissa extends by 3 % of two decades beyond both ends; the ordinate ranges from 0.5 to 1000.
        let x = |v: f64| left + width * (v.log10() + 0.06) / 2.12;
        let y = |v: f64| 8.0 + SINGLE_PANEL_HEIGHT * (1000.0 / v).log10() / 2000.0_f64.log10();
        let upright = |at: f64, from: f64, to: f64| {
            contains_element(
                &svg,
                "line",
                &[("x1", x(at)), ("y1", y(from)), ("x2", x(at)), ("y2", y(to))],
            )
        };
        for v in [1.0, 10.0, 100.0] {
            assert!(upright(v, 0.5, v), "stem at {v}: {svg}");
            assert!(
                contains_element(&svg, "circle", &[("cx", x(v)), ("cy", y(v))]),
                "point at {v}"
            );
        }
        assert!(upright(1.0, 0.5, 2.0), "bar");
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn gaps_split_lines_and_single_values_are_points() {
        let nan = f64::NAN;
        let y = [1.0, 2.0, nan, 5.0, nan, 3.0, 2.0, f64::INFINITY];
        let x: Vec<f64> = (0..8).map(f64::from).collect();
        let svg = curves("c", "t", &grid(vec![curve(LineKind::Line, &x, &y)], false));
        let blue = svg.to_lowercase().matches("stroke=\"#0072b2\"").count();
        // Two lines and the legend sample have this colour.
        assert_eq!(blue, 3, "{svg}");
        assert_eq!(svg.matches("<circle").count(), 1);
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn legend_lists_names_once_and_the_truth_in_black() {
        let x = [1.0, 2.0];
        let truth = curve(LineKind::Truth, &x, &[1.0, 2.0]);
        let line = curve(LineKind::Line, &x, &[2.0, 1.0]);
        let grid = grid(vec![line.clone(), truth, line], false);
        let entries = grid.entries();
        assert_eq!(entries.len(), 2);
        assert_eq!((entries[1].colour.as_str(), entries[1].sample), (BLACK, Sample::Dashed));
        assert_eq!(curves("c", "t", &grid), curves("c", "t", &grid));
    }

    #[test]
    fn invalid_input_gives_a_valid_figure() {
        let empty = CurveGrid::default();
        let none = grid(vec![curve(LineKind::Line, &[], &[])], true);
        let negative = grid(vec![curve(LineKind::Stems, &[-1.0, 0.0], &[-1.0, 0.0])], true);
        let short = grid(vec![curve(LineKind::Marked, &[1.0, 2.0, 3.0], &[1e300])], false);
        let level = grid(vec![curve(LineKind::Points, &[1.0, 1.0], &[5.0, 5.0])], true);
        let far = grid(vec![curve(LineKind::Line, &[1.0, 2.0], &[-1e308, 1e308])], false);
        for grid in [empty, none, negative, short, level, far] {
            let svg = curves("c", "t", &grid);
            assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>"));
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }
}
