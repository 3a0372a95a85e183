//! Quantities over time in a grid of panels with a common time axis: recursive estimates with bands, their standard
//! errors, and innovations.

use std::ops::Range;

use kuva::{
    prelude::{BandPlot, Plot, ReferenceLine, ShadedRegion},
    render::render::Scene,
};

use super::{
    axes::{with_abscissa, with_ordinate},
    draw::BAND_OPACITY,
    frame::{self, Frame, Ordinates},
    labels::panel_label,
    legend::{Entry, Sample, add_legend_in_multiples_of},
    palette::shade,
    panel::{CurveKind, Ordinate, TraceCurve, TracePanel},
    series::{remove_constant_stretches, runs, thinned_band_points, thinned_run_indices},
    style::{self, BLACK, GREY},
    svg,
};

/// Height of the axes of a panel.
const PANEL_HEIGHT: f64 = 84.0;

const DOT_COLOUR: &str = "#444444";
/// Maximum number of changes named in the legend.
const MAX_NAMED_CHANGES: usize = 6;

/// Panels with a common time axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TraceGrid {
    /// The panels, row by row.
    pub panels: Vec<TracePanel>,
    /// Panels per row; zero counts as one. A figure with a single column has the width of a text column; a figure with
    /// several has the width of a page.
    pub columns: usize,
    /// Titles of the columns, or of all panels; empty for no titles.
    pub titles: Vec<String>,
    /// Names of the methods for the legend, which lists only methods that are drawn; empty if there are no names.
    pub methods: Vec<String>,
    /// Names of the levels of each method, such as noise levels, from the lowest; empty if there are none. The levels
    /// are shades of the colour of the method.
    pub levels: Vec<String>,
    /// Time spans that are shaded, s.
    pub shaded_spans_s: Vec<(f64, f64)>,
    /// Times marked by a dotted line, s.
    pub marks_s: Vec<f64>,
    /// Declared changes as time in s and description. Each has a dashed line, which is numbered in the first panel.
    pub changes: Vec<(f64, String)>,
    /// True if the panels of a row share an ordinate, which has ticks and a label only in the first panel.
    pub shared_ordinates: bool,
}

/// Draws the panels of a grid as one figure. `title` is the text for screen readers.
pub fn trace_panels(id: &str, title: &str, grid: &TraceGrid) -> String {
    let columns = grid.columns.max(1);
    let n = grid.panels.len();
    if n == 0 {
        return frame::empty_figure(id, title);
    }
    let time = grid.time_range();
    let ranges = frame::row_ranges(
        grid.panels.iter().map(TracePanel::range).collect(),
        columns,
        grid.shared_ordinates,
    );
    let labels = grid.panels.iter().map(|p| (p.name.as_str(), p.unit.as_str()));
    let ordinates = Ordinates::of(labels, columns, grid.shared_ordinates);
    let frame = Frame::new(n, columns, PANEL_HEIGHT, ordinates, grid.titles.len());
    let cell = |(i, panel): (usize, &TracePanel)| {
        let layout = style::layout(time, ranges[i], PANEL_HEIGHT);
        let layout = with_abscissa(layout, time, false, frame.area(i).width);
        let logarithmic = panel.ordinate == Ordinate::Logarithmic;
        let layout = with_ordinate(
            layout,
            ranges[i],
            &panel.unit,
            logarithmic,
            PANEL_HEIGHT,
            frame.has_ticks(i),
        );
        let layout = frame.fit_layout(i, layout);
        (
            panel.plots(ranges[i], grid.levels.len(), frame.area(i).column_count()),
            grid.with_marks(layout, time, i == 0),
        )
    };
    let cells = grid.panels.iter().enumerate().map(cell).collect();
    let label = |i: usize| panel_label(&grid.panels[i].name, &grid.panels[i].unit);
    let mut scene = frame.draw_panels(cells, "time (s)", label, &grid.titles, 0.0);
    grid.add_legend(&mut scene);
    svg::finish(id, title, scene)
}

impl TraceGrid {
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

    fn with_marks(
        &self,
        mut layout: kuva::prelude::Layout,
        (from, to): (f64, f64),
        numbered: bool,
    ) -> kuva::prelude::Layout {
        for &(start, end) in &self.shaded_spans_s {
            let (start, end) = (start.clamp(from, to), end.clamp(from, to));
            if start < end {
                let region = ShadedRegion::vertical(start, end).with_color(GREY).with_opacity(0.14);
                layout = layout.with_shaded_region(region);
            }
        }
        for &mark in self.marks_s.iter().filter(|m| (from..=to).contains(*m)) {
            let line = ReferenceLine::vertical(mark)
                .with_color("#666666")
                .with_stroke_width(1.1);
            layout = layout.with_reference_line(line.with_dasharray("1.5 2.5"));
        }
        let inside = |(at, _): &&(f64, String)| (from..=to).contains(at);
        for (number, (at, _)) in self.changes.iter().filter(inside).enumerate() {
            let mut line = ReferenceLine::vertical(*at)
                .with_color(DOT_COLOUR)
                .with_stroke_width(1.2)
                .with_dasharray("6 3");
            if numbered {
                line = line.with_label((number + 1).to_string());
            }
            layout = layout.with_reference_line(line);
        }
        layout
    }

    fn add_legend(&self, scene: &mut Scene) {
        let mut entries = Vec::new();
        let curves = || self.panels.iter().flat_map(|p| &p.curves);
        let drawn = |method| curves().any(|c| c.method == method && c.kind != CurveKind::Truth);
        for (method, name) in self.methods.iter().enumerate().filter(|(method, _)| drawn(*method)) {
            if self.levels.is_empty() {
                entries.push(Entry::new(name, &shade(method, 0, 1), Sample::Line));
            }
            for (level, of_level) in self.levels.iter().enumerate() {
                let name = match name.is_empty() {
                    true => of_level.clone(),
                    false => format!("{name}, {of_level}"),
                };
                let colour = shade(method, level, self.levels.len());
                entries.push(Entry::new(&name, &colour, Sample::Line));
            }
        }
        let has = |kind| curves().any(|c| c.kind == kind);
        if has(CurveKind::Batch) {
            entries.push(Entry::new("batch fit", DOT_COLOUR, Sample::Dotted));
        }
        if has(CurveKind::Truth) {
            entries.push(Entry::new("truth", BLACK, Sample::Dashed));
        }
        for (number, (at, what)) in self.changes.iter().enumerate().take(MAX_NAMED_CHANGES) {
            let name = format!("change {}, {at:.1} s: {what}", number + 1);
            entries.push(Entry::new(&name, DOT_COLOUR, Sample::Dashed));
        }
        if let Some(more) = self
            .changes
            .len()
            .checked_sub(MAX_NAMED_CHANGES)
            .filter(|more| *more > 0)
        {
            let changes = if more == 1 { "change" } else { "changes" };
            entries.push(Entry::new(
                &format!("{more} more {changes}"),
                DOT_COLOUR,
                Sample::Dashed,
            ));
        }
        add_legend_in_multiples_of(scene, &entries, self.levels.len());
    }
}

impl TracePanel {
    /// Bands and lines of the panel within a range; the bands precede the lines, which are drawn over them.
    fn plots(&self, (low, high): (f64, f64), levels: usize, parts: usize) -> Vec<Plot> {
        let logarithmic = self.ordinate == Ordinate::Logarithmic;
        let half = 0.5 * (high - low);
        // The path is clipped at the axes; without this limit, values such as 1e300 would be written to the file.
        let bounded = |v: f64| match logarithmic {
            true => v.clamp(low / 10.0, high * 10.0),
            false => v.clamp(low - half, high + half),
        };
        let drawable = |v: f64| v.is_finite() && (v > 0.0 || !logarithmic);
        let mut plots: Vec<Plot> = Vec::new();
        for curve in self.curves.iter().filter(|c| !c.band.is_empty()) {
            plots.extend(curve.bands((low, high), levels, parts));
        }
        for curve in &self.curves {
            let n = curve.values.len().min(curve.times_s.len());
            let values = &curve.values[..n];
            for run in runs(n, |k| drawable(values[k]) && curve.times_s[k].is_finite()) {
                let points = curve.points(run, parts, bounded);
                let line = match curve.kind {
                    CurveKind::Estimate => style::line(points, &curve.colour(levels), 1.2),
                    CurveKind::Truth => style::line(points, BLACK, 1.2).with_dashed(),
                    CurveKind::Bound => style::line(points, BLACK, 1.0),
                    CurveKind::Batch => style::line(points, &curve.colour(levels), 2.0).with_dotted(),
                    CurveKind::Steps => style::line(points, &curve.colour(levels), 1.4).with_step(),
                };
                plots.push(line.into());
            }
        }
        // A panel without curves still needs axes.
        if plots.is_empty() {
            plots.push(style::line([], BLACK, 1.0).into());
        }
        plots
    }
}

impl TraceCurve {
    fn colour(&self, levels: usize) -> String {
        shade(self.method, self.level, levels)
    }

    /// Returns the points to draw for a run of rows; rows with the same value as both neighbours are omitted. A single
    /// row is drawn as a line over one sample time.
    fn points(&self, run: Range<usize>, parts: usize, bounded: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
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
        let turns = remove_constant_stretches(&whole, |k| self.values[k]);
        let thin = thinned_run_indices(&self.values, run, parts);
        let kept = if turns.len() <= thin.len() { turns } else { thin };
        kept.into_iter().map(at).collect()
    }

    fn bands(&self, (low, high): (f64, f64), levels: usize, parts: usize) -> Vec<Plot> {
        let n = self.band.len().min(self.times_s.len());
        let cut = |v: f64| v.clamp(low, high);
        let lower: Vec<f64> = self.band[..n].iter().map(|b| cut(b.0)).collect();
        let upper: Vec<f64> = self.band[..n].iter().map(|b| cut(b.1)).collect();
        let band = |run: Range<usize>| -> Plot {
            let kept = thinned_band_points(&lower, &upper, run, parts);
            let indices: Vec<usize> = (0..kept.len()).collect();
            let needed: Vec<_> = remove_constant_stretches(&indices, |i| (kept[i].1, kept[i].2))
                .into_iter()
                .map(|i| kept[i])
                .collect();
            BandPlot::new(
                needed.iter().map(|k| self.times_s[k.0]),
                needed.iter().map(|k| k.1),
                needed.iter().map(|k| k.2),
            )
            .with_color(self.colour(levels))
            .with_opacity(BAND_OPACITY)
            .into()
        };
        runs(n, |k| lower[k].is_finite() && upper[k].is_finite())
            .into_iter()
            .filter(|run| run.len() > 1)
            .map(band)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{
            panel::tests::{curve, panel},
            series::COLUMN_COUNT,
        },
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
        // A row between two gaps is also drawn.
        values[202] = f64::NAN;
        let broken = trace_panels("a", "t", &grid(values));
        assert_eq!((paths(&whole), paths(&broken)), (1, 4));
        assert!(!broken.contains("NaN") && !broken.contains("inf"));
        // Axes are drawn even without data.
        let nothing = trace_panels("a", "t", &grid(vec![f64::NAN; 50]));
        assert!(nothing.contains("time (s)") && !nothing.contains("NaN"));
    }

    #[test]
    fn constant_levels_need_few_points_and_jumps_stay_sharp() {
        let values: Vec<f64> = (0..100_000).map(|k| if k < 50_000 { 1.0 } else { 2.0 }).collect();
        let truth = curve(CurveKind::Truth, values);
        let points = truth.points(0..100_000, COLUMN_COUNT, |v| v);
        assert_eq!(points.len(), 4);
        assert!(points[2].0 - points[1].0 < 0.011);
    }

    #[test]
    fn short_last_rows_and_empty_grids_are_drawn() {
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
    fn changes_are_numbered_and_named() {
        let one = || panel(vec![curve(CurveKind::Estimate, vec![1.0, 2.0, 1.5])]);
        let with = |n: usize| TraceGrid {
            panels: vec![one(), one()],
            changes: (0..n).map(|k| (0.005, format!("K_e {k}"))).collect(),
            ..TraceGrid::default()
        };
        let dashes = |n: usize| trace_panels("g", "t", &with(n)).matches("dasharray=\"6 3\"").count();
        assert!(dashes(0) == 0 && dashes(2) >= 4, "{}", dashes(2));
        let many = trace_panels("g", "t", &with(8));
        assert!(many.contains("change 6, 0.0 s") && !many.contains("change 7") && many.contains("2 more changes"));
    }

    #[test]
    fn names_have_subscripts_and_text_is_escaped() {
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
        assert!(svg.contains("a<tspan dy=\"3\" font-size=\"12.2\">1</tspan>"), "{svg}");
        assert!(svg.contains("(&lt;b&gt;)") && svg.contains("&lt;x&gt;"));
        assert_eq!(svg.matches("<tspan").count(), svg.matches("</tspan>").count());
    }

    #[test]
    fn levels_are_shades_and_rows_share_a_label() {
        let of = |kind, level| TraceCurve {
            level,
            ..curve(kind, vec![1.0, 2.0, 1.5])
        };
        let curves = vec![
            of(CurveKind::Estimate, 0),
            of(CurveKind::Estimate, 1),
            of(CurveKind::Batch, 1),
        ];
        let grid = TraceGrid {
            panels: vec![panel(curves.clone()), panel(curves)],
            columns: 2,
            methods: vec!["RLS".to_owned(), "none".to_owned()],
            levels: vec!["low".to_owned(), "high".to_owned()],
            ..TraceGrid::default()
        };
        let svg = trace_panels("g", "t", &grid).to_uppercase();
        // The level appears in each panel and in the legend, which shows the batch fit in grey.
        let lines = |level| svg.matches(&format!("STROKE=\"{}\"", shade(0, level, 2))).count();
        assert_eq!((lines(0), lines(1)), (3, 5));
        assert!(svg.contains("RLS, LOW") && svg.contains("RLS, HIGH") && !svg.contains("NONE, LOW"));
        assert_eq!(svg.matches("ROTATE(-90").count(), 1);
    }

    #[test]
    fn logarithmic_panel_omits_non_positive_values() {
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
