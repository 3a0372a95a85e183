//! Quantities over time in a grid of panels with one time axis: recursive estimates, their bands and errors, innovations.

use std::{ops::Range, sync::Arc};

use kuva::{
    prelude::{BandPlot, Plot, ReferenceLine, ShadedRegion, TickFormat},
    render::render::{Primitive, Scene, TextAnchor},
};

use super::{
    axes::{is_power_of_ten, log_tick, panel_label, plain, tagged, tick, tick_step},
    panel::{CurveKind, Ordinate, TraceCurve, TracePanel},
    series::{runs, thinned_band, thinned_run, without_level},
    style::{self, BLACK, GREY, LEFT, MODEL_COLOURS, RIGHT, TEXT, WIDTH},
};

/// Height between the axes of a panel, and the space around them where no time stands below.
const HEIGHT: f64 = 84.0;
const SPACE: f64 = 8.0;
/// Between neighbouring panels that share their ordinate.
const GAP: f64 = 16.0;
const TITLE: f64 = 18.0;
/// Centre of the label of the ordinate.
const LABEL_AT: f64 = 13.0;

const DASHES: &str = "#444444";

/// Panels with a common time axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TraceGrid {
    /// The panels by rows.
    pub panels: Vec<TracePanel>,
    /// Panels in a row; one where it is zero. One column is as wide as a column of text, several as a page.
    pub columns: usize,
    /// Text above each column; empty for none.
    pub titles: Vec<String>,
    /// Names of the methods, for the legend; empty for none.
    pub methods: Vec<String>,
    /// Spans that are shaded, s.
    pub shaded_s: Vec<(f64, f64)>,
    /// Times with a dotted line, s.
    pub marks_s: Vec<f64>,
    /// True when panels of a row have one ordinate, which is labelled once.
    pub shared_ordinates: bool,
}

/// The panels of a grid as one figure. `title` is what a screen reader says.
pub fn trace_panels(id: &str, title: &str, grid: &TraceGrid) -> String {
    let columns = grid.columns.max(1);
    let n = grid.panels.len();
    if n == 0 {
        return style::finish(id, title, &Scene::new(WIDTH, 1.0));
    }
    let rows = n.div_ceil(columns);
    let widths = grid.widths(columns);
    let time = grid.time_range();
    let ranges = grid.ranges(columns);
    let mut cells = Vec::with_capacity(n);
    let mut heights = Vec::with_capacity(rows);
    let mut labels: Vec<(f64, f64, String)> = Vec::new();
    let mut y = 0.0;
    for row in 0..rows {
        let in_row = row * columns..n.min((row + 1) * columns);
        let top = if row == 0 && !grid.titles.is_empty() {
            TITLE
        } else {
            0.0
        } + SPACE;
        // The lowest panel of each column has the times.
        let bottom = if in_row.clone().any(|i| i + columns >= n) {
            style::BOTTOM
        } else {
            SPACE
        };
        let height = top + HEIGHT + bottom;
        let mut x = 0.0;
        for (column, i) in in_row.enumerate() {
            let panel = &grid.panels[i];
            let first = column == 0 || !grid.shared_ordinates;
            let margin = if first { LEFT } else { GAP };
            let layout = panel
                .layout(time, ranges[i], height, first)
                .with_width(widths[column])
                .with_force_margins(margin, RIGHT)
                .with_force_margins_y(top, bottom);
            let layout = if i + columns >= n {
                layout.with_x_label("time (s)")
            } else {
                layout.with_x_tick_format(TickFormat::Custom(Arc::new(|_| String::new())))
            };
            cells.push((panel.plots(ranges[i]), grid.marked(layout, time)));
            if first {
                labels.push((
                    x + LABEL_AT,
                    y + top + 0.5 * HEIGHT,
                    panel_label(&panel.name, &panel.unit),
                ));
            }
            x += widths[column];
        }
        y += height;
        heights.push(height);
    }
    let mut scene = style::in_grid(cells, &widths, &heights);
    for (x, y, content) in labels {
        scene.add(text(x + 4.5, y, content, Some(-90.0)));
    }
    let mut x = 0.0;
    for (column, title) in grid.titles.iter().take(columns).enumerate() {
        let margin = if column == 0 || !grid.shared_ordinates {
            LEFT
        } else {
            GAP
        };
        let middle = x + margin + 0.5 * (widths[column] - margin - RIGHT);
        scene.add(text(middle, TITLE, style::label(&plain(title)), None));
        x += widths[column];
    }
    grid.add_legend(&mut scene);
    tagged(&style::finish(id, title, &scene))
}

impl TraceGrid {
    fn widths(&self, columns: usize) -> Vec<f64> {
        let whole = if columns == 1 { WIDTH } else { 2.0 * WIDTH };
        if !self.shared_ordinates {
            return vec![whole / columns as f64; columns];
        }
        let axes = (whole - LEFT - RIGHT * columns as f64 - GAP * (columns - 1) as f64) / columns as f64;
        let of = |column| if column == 0 { LEFT } else { GAP } + axes + RIGHT;
        (0..columns).map(of).collect()
    }

    fn time_range(&self) -> (f64, f64) {
        let times = self.panels.iter().flat_map(|p| &p.curves).flat_map(|c| &c.times_s);
        let finite = times.copied().filter(|t| t.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(t), h.max(t)));
        if low < high {
            (low, high)
        } else {
            style::padded_range([low])
        }
    }

    /// The range of each panel; one for each row when they share it.
    fn ranges(&self, columns: usize) -> Vec<(f64, f64)> {
        let own: Vec<(f64, f64)> = self.panels.iter().map(TracePanel::range).collect();
        if !self.shared_ordinates {
            return own;
        }
        let of_row = |row: &[(f64, f64)]| {
            let widest = row
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), r| (l.min(r.0), h.max(r.1)));
            vec![widest; row.len()]
        };
        own.chunks(columns).flat_map(of_row).collect()
    }

    fn marked(&self, mut layout: kuva::prelude::Layout, (from, to): (f64, f64)) -> kuva::prelude::Layout {
        for &(begin, end) in &self.shaded_s {
            let (begin, end) = (begin.clamp(from, to), end.clamp(from, to));
            if begin < end {
                let region = ShadedRegion::vertical(begin, end).with_color(GREY).with_opacity(0.14);
                layout = layout.with_shaded_region(region);
            }
        }
        for &mark in self.marks_s.iter().filter(|m| (from..=to).contains(*m)) {
            let line = ReferenceLine::vertical(mark)
                .with_color("#666666")
                .with_stroke_width(1.1);
            layout = layout.with_reference_line(line.with_dasharray("1.5 2.5"));
        }
        layout
    }

    fn add_legend(&self, scene: &mut Scene) {
        let names: Vec<String> = self.methods.iter().map(|m| plain(m)).collect();
        let mut entries: Vec<(&str, &str, bool)> = names
            .iter()
            .enumerate()
            .map(|(i, name)| (name.as_str(), MODEL_COLOURS[i % MODEL_COLOURS.len()], false))
            .collect();
        let has = |kind| self.panels.iter().flat_map(|p| &p.curves).any(|c| c.kind == kind);
        if has(CurveKind::Batch) {
            entries.push(("batch fit", DASHES, true));
        }
        if has(CurveKind::Truth) {
            entries.push(("truth", BLACK, false));
        }
        if !entries.is_empty() {
            style::add_legend(scene, &entries);
        }
    }
}

impl TracePanel {
    /// The curves within a range: bands first, then lines.
    fn plots(&self, (low, high): (f64, f64)) -> Vec<Plot> {
        let logarithmic = self.ordinate == Ordinate::Logarithmic;
        let half = 0.5 * (high - low);
        // Beyond the axes the path is cut; without bound, numbers of 1e300 would stand in the file.
        let bounded = |v: f64| match logarithmic {
            true => v.clamp(low / 10.0, high * 10.0),
            false => v.clamp(low - half, high + half),
        };
        let drawable = |v: f64| v.is_finite() && (v > 0.0 || !logarithmic);
        let mut plots: Vec<Plot> = Vec::new();
        for curve in self.curves.iter().filter(|c| !c.band.is_empty()) {
            plots.extend(curve.bands((low, high)));
        }
        for curve in &self.curves {
            let n = curve.values.len().min(curve.times_s.len());
            let values = &curve.values[..n];
            for run in runs(n, |k| drawable(values[k]) && curve.times_s[k].is_finite()) {
                let points = curve.points(run, bounded);
                let line = match curve.kind {
                    CurveKind::Estimate => style::line(points, curve.colour(), 1.2),
                    CurveKind::Truth | CurveKind::Bound => style::line(points, BLACK, 1.0),
                    CurveKind::Batch => style::line(points, curve.colour(), 1.8).with_dashed(),
                    CurveKind::Steps => style::line(points, curve.colour(), 1.4).with_step(),
                };
                plots.push(line.into());
            }
        }
        // A panel without a curve still has its axes.
        if plots.is_empty() {
            plots.push(style::line([], BLACK, 1.0).into());
        }
        plots
    }
}

impl TraceCurve {
    fn colour(&self) -> &'static str {
        MODEL_COLOURS[self.method % MODEL_COLOURS.len()]
    }

    /// The rows of a run that are drawn: none on the level of both neighbours. One row alone is as long as its sample.
    fn points(&self, run: Range<usize>, bounded: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let at = |k: usize| (self.times_s[k], bounded(self.values[k]));
        if run.len() == 1 {
            let (t, y) = at(run.start);
            let half = match self.times_s.as_slice() {
                [first, second, ..] => 0.5 * (second - first),
                _ => 0.0,
            };
            return vec![(t - half, y), (t + half, y)];
        }
        let whole: Vec<usize> = run.clone().collect();
        let turns = without_level(&whole, |k| self.values[k]);
        let thin = thinned_run(&self.values, run);
        let kept = if turns.len() <= thin.len() { turns } else { thin };
        kept.into_iter().map(at).collect()
    }

    fn bands(&self, (low, high): (f64, f64)) -> Vec<Plot> {
        let n = self.band.len().min(self.times_s.len());
        let cut = |v: f64| v.clamp(low, high);
        let lower: Vec<f64> = self.band[..n].iter().map(|b| cut(b.0)).collect();
        let upper: Vec<f64> = self.band[..n].iter().map(|b| cut(b.1)).collect();
        let band = |run: Range<usize>| -> Plot {
            let kept = thinned_band(&lower, &upper, run);
            let places: Vec<usize> = (0..kept.len()).collect();
            let needed: Vec<_> = without_level(&places, |i| (kept[i].1, kept[i].2))
                .into_iter()
                .map(|i| kept[i])
                .collect();
            BandPlot::new(
                needed.iter().map(|k| self.times_s[k.0]),
                needed.iter().map(|k| k.1),
                needed.iter().map(|k| k.2),
            )
            .with_color(self.colour())
            .with_opacity(0.2)
            .into()
        };
        runs(n, |k| lower[k].is_finite() && upper[k].is_finite())
            .into_iter()
            .filter(|run| run.len() > 1)
            .map(band)
            .collect()
    }
}

impl TracePanel {
    fn layout(&self, time: (f64, f64), (low, high): (f64, f64), height: f64, labelled: bool) -> kuva::prelude::Layout {
        let layout = style::layout(time, (low, high), height);
        if self.ordinate == Ordinate::Logarithmic {
            let narrow = high / low < 10.5;
            let format = move |v: f64| match labelled && (narrow || is_power_of_ten(v)) {
                true => log_tick(v),
                false => String::new(),
            };
            return layout
                .with_log_y()
                .with_y_tick_format(TickFormat::Custom(Arc::new(format)));
        }
        let step = tick_step(high - low);
        let format = move |v: f64| if labelled { tick(v, step) } else { String::new() };
        layout
            .with_y_tick_step(step)
            .with_y_tick_format(TickFormat::Custom(Arc::new(format)))
    }
}

fn text(x: f64, y: f64, content: String, rotate: Option<f64>) -> Primitive {
    Primitive::Text {
        x,
        y,
        content,
        anchor: TextAnchor::Middle,
        size: TEXT,
        rotate,
        bold: false,
        color: None,
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::panel::tests::{curve, panel},
        *,
    };

    fn paths(svg: &str) -> usize {
        svg.matches("stroke=\"#0072B2\"").count() + svg.matches("stroke=\"#0072b2\"").count()
    }

    #[test]
    fn gaps_are_not_bridged() {
        let mut values: Vec<f64> = (0..300).map(|k| (f64::from(k) * 0.05).sin()).collect();
        let grid = |values: Vec<f64>| TraceGrid {
            panels: vec![panel(vec![curve(CurveKind::Estimate, values)])],
            columns: 1,
            ..TraceGrid::default()
        };
        let whole = trace_panels("a", "t", &grid(values.clone()));
        values[100] = f64::NAN;
        values[200] = f64::INFINITY;
        // A row between two gaps is drawn as well.
        values[202] = f64::NAN;
        let broken = trace_panels("a", "t", &grid(values));
        assert_eq!((paths(&whole), paths(&broken)), (1, 4));
        assert!(!broken.contains("NaN") && !broken.contains("inf"));
        // Nothing at all still has axes.
        let nothing = trace_panels("a", "t", &grid(vec![f64::NAN; 50]));
        assert!(nothing.contains("time (s)") && !nothing.contains("NaN"));
    }

    #[test]
    fn a_jump_stays_a_jump_and_a_level_costs_nothing() {
        let values: Vec<f64> = (0..100_000).map(|k| if k < 50_000 { 1.0 } else { 2.0 }).collect();
        let truth = curve(CurveKind::Truth, values);
        let points = truth.points(0..100_000, |v| v);
        assert_eq!(points.len(), 4);
        assert!(points[2].0 - points[1].0 < 0.011);
    }

    #[test]
    fn grids_may_have_a_short_last_row_or_nothing() {
        let one = || panel(vec![curve(CurveKind::Estimate, vec![1.0, 2.0, 1.5])]);
        for (n, columns, shared) in [(5, 2, false), (5, 3, true), (1, 4, true), (3, 0, false), (0, 2, false)] {
            let grid = TraceGrid {
                panels: (0..n).map(|_| one()).collect(),
                columns,
                titles: vec!["one $".to_owned(), "two".to_owned()],
                methods: vec!["a".to_owned()],
                shared_ordinates: shared,
                ..TraceGrid::default()
            };
            let svg = trace_panels("g", "t", &grid);
            assert_eq!(paths(&svg), n + usize::from(n > 0), "{n} {columns}");
            assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>") && !svg.contains("NaN"));
            assert_eq!(svg.matches("<tspan").count(), svg.matches("</tspan>").count());
        }
    }

    #[test]
    fn names_have_subscripts_and_hostile_text_stays_text() {
        let mut hostile = panel(vec![curve(CurveKind::Estimate, vec![1.0, 2.0])]);
        hostile.name = "a1, f1".to_owned();
        hostile.unit = "<\u{e000}b>".to_owned();
        let svg = trace_panels(
            "g",
            "t",
            &TraceGrid {
                panels: vec![hostile],
                methods: vec!["<x\u{e001}>".to_owned()],
                ..TraceGrid::default()
            },
        );
        assert!(svg.contains("a<tspan dy=\"3\" font-size=\"10\">1</tspan>"), "{svg}");
        assert!(svg.contains("(&lt;b&gt;)") && svg.contains("&lt;x&gt;"));
        assert_eq!(svg.matches("<tspan").count(), svg.matches("</tspan>").count());
    }

    #[test]
    fn a_logarithmic_panel_leaves_out_what_has_no_logarithm() {
        let mut errors = panel(vec![curve(
            CurveKind::Estimate,
            vec![0.0, 0.01, -1.0, 0.02, 0.03, f64::NAN],
        )]);
        errors.ordinate = Ordinate::Logarithmic;
        assert_eq!(errors.range().0, 0.01);
        let svg = trace_panels(
            "g",
            "t",
            &TraceGrid {
                panels: vec![errors],
                ..TraceGrid::default()
            },
        );
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        assert_eq!(paths(&svg), 2);
    }
}
