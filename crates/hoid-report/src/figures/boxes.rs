//! Box plots of the results of many runs: the abscissa shows groups, and each group has one box for each series.
//! [`BoxStatistics`] describes the boxes.

use kuva::{
    prelude::Plot,
    render::render::{Scene, TextAnchor},
};

use super::{
    BoxStatistics,
    axes::{SymmetricLogAxis, with_ordinate},
    draw::{self, OUTLINE_COLOUR},
    frame::{self, Area, Frame, Ordinates},
    labels::{label_markup, panel_label},
    legend::{Entry, Sample, add_legend_in_multiples_of},
    palette::{Shade, is_dark},
    style::{self, BLACK, TEXT_SIZE},
    svg,
};

/// Height of the axes of a panel; `SINGLE_PANEL_HEIGHT` is the height if the figure has a single panel.
const PANEL_HEIGHT: f64 = 112.0;
const SINGLE_PANEL_HEIGHT: f64 = 150.0;
/// Space above a panel for its note and for the counts of outliers beyond its range.
const NOTE_SPACE: f64 = 13.0;
/// Distance of the group names below the axis; `ROW_DISTANCE` is the distance of a second row of names below the first.
const NAME_DISTANCE: f64 = 17.0;
const ROW_DISTANCE: f64 = 12.0;
/// Fraction of the width of a group that its boxes occupy; `BOX_WIDTH_SHARE` is the width of a box as a fraction of its
/// place, and `MAX_BOX_WIDTH` the largest width.
const GROUP_WIDTH_SHARE: f64 = 0.86;
const BOX_WIDTH_SHARE: f64 = 0.8;
const MAX_BOX_WIDTH: f64 = 26.0;

/// Range of the ordinate of box plots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BoxRange {
    /// The range includes all boxes, whiskers and outliers.
    #[default]
    Full,
    /// The range includes boxes and whiskers. The number of outliers beyond it is written above the panel, and a
    /// triangle at the edge of the panel marks each box that has such outliers.
    Whiskers,
}

/// A series of boxes with the same colour.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxSeries {
    /// Name in the legend.
    pub name: String,
    /// Colour of the boxes.
    pub shade: Shade,
}

/// One panel of box plots.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BoxPanel {
    /// Name of the quantity, such as `B_r(b_0)`; `_` and `^` mark subscripts and superscripts of one character, or of
    /// several in braces.
    pub name: String,
    /// Unit of the quantity; empty if it has none.
    pub unit: String,
    /// The boxes by group and series; statistics without values represent a missing box.
    pub boxes: Vec<Vec<BoxStatistics>>,
    /// Limit up to which the ordinate is linear; it is logarithmic beyond. `None` for a linear ordinate.
    pub linear_limit: Option<f64>,
    /// Text above the panel, such as the largest value that it shows; empty for no text.
    pub note: String,
}

/// Panels of box plots with common groups and series.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BoxGrid {
    /// The panels, row by row.
    pub panels: Vec<BoxPanel>,
    /// Panels per row; zero counts as one. A figure with a single column has the width of a text column; a figure with
    /// several has the width of a page.
    pub columns: usize,
    /// Titles of the columns, or of all panels; empty for no titles.
    pub titles: Vec<String>,
    /// Name of the grouping variable, such as `n_k^*`.
    pub abscissa: String,
    /// Names of the groups.
    pub groups: Vec<String>,
    /// The series of each group.
    pub series: Vec<BoxSeries>,
    /// Range of the ordinates.
    pub range: BoxRange,
    /// True if the panels of a row share an ordinate.
    pub shared_ordinates: bool,
    /// True if every range includes zero, which is marked by a line.
    pub with_zero: bool,
    /// Smallest half width of the range of each ordinate, so that rounding errors do not look like scatter; zero for no
    /// limit.
    pub min_half_range: f64,
}

/// Draws box plots as one figure. `title` is the text for screen readers.
pub fn box_plots(id: &str, title: &str, grid: &BoxGrid) -> String {
    let columns = grid.columns.max(1);
    let n = grid.panels.len();
    if n == 0 || grid.groups.is_empty() {
        return frame::empty_figure(id, title);
    }
    let labels = grid.panels.iter().map(|p| (p.name.as_str(), p.unit.as_str()));
    let ordinates = Ordinates::of(labels, columns, grid.shared_ordinates);
    let ranges = frame::row_ranges(
        grid.panels.iter().map(|p| grid.range_of(p)).collect(),
        columns,
        grid.shared_ordinates,
    );
    let height = if n == 1 { SINGLE_PANEL_HEIGHT } else { PANEL_HEIGHT };
    let with_text = grid.range == BoxRange::Whiskers || grid.panels.iter().any(|p| !p.note.is_empty());
    let above = if with_text { NOTE_SPACE } else { 0.0 };
    let frame = Frame::with_space(n, columns, height, ordinates, grid.titles.len(), (above, 0.0));
    let groups = (0.5, grid.groups.len() as f64 + 0.5);
    let cell = |(i, panel): (usize, &BoxPanel)| {
        let layout = style::layout(groups, ranges[i], height);
        let layout = match panel.symmetric_log_axis() {
            Some(bent) => bent.with_ordinate(layout, ranges[i], height),
            None => with_ordinate(layout, ranges[i], &panel.unit, false, height, frame.has_ticks(i)),
        };
        let layout = frame
            .fit_layout(i, layout)
            .with_x_categories(vec![String::new(); grid.groups.len()]);
        (vec![Plot::from(style::line([], BLACK, 1.0))], layout)
    };
    let cells = grid.panels.iter().enumerate().map(cell).collect();
    let label = |i: usize| panel_label(&grid.panels[i].name, &grid.panels[i].unit);
    let mut scene = frame.draw_panels(cells, &grid.abscissa, label, &grid.titles, 0.0);
    let mut missing = false;
    for (i, panel) in grid.panels.iter().enumerate() {
        missing |= grid.draw(&mut scene, panel, frame.area(i), ranges[i]);
        if frame.is_lowest(i) {
            grid.add_names(&mut scene, frame.area(i));
        }
    }
    grid.add_legend(&mut scene, missing);
    svg::finish(id, title, scene)
}

impl BoxPanel {
    fn symmetric_log_axis(&self) -> Option<SymmetricLogAxis> {
        self.linear_limit.map(|linear_within| SymmetricLogAxis {
            linear_limit: linear_within,
        })
    }

    /// Position of a value on the ordinate: the value itself on a linear ordinate, otherwise in decades.
    fn height(&self, value: f64) -> f64 {
        self.symmetric_log_axis().map_or(value, |bent| bent.height(value))
    }
}

impl BoxGrid {
    fn range_of(&self, panel: &BoxPanel) -> (f64, f64) {
        let boxes = panel.boxes.iter().flatten().filter(|b| b.is_drawable());
        let mut values: Vec<f64> = boxes.clone().flat_map(BoxStatistics::marks).collect();
        if self.range == BoxRange::Full {
            values.extend(boxes.flat_map(|b| b.outliers.iter().copied()));
        }
        if self.with_zero {
            values.push(0.0);
        }
        let (low, high) = style::padded_range(values.into_iter().map(|v| panel.height(v)));
        let (middle, reach) = (0.5 * (low + high), 0.5 * (high - low));
        if reach < self.min_half_range {
            (middle - self.min_half_range, middle + self.min_half_range)
        } else {
            (low, high)
        }
    }

    /// Draws the names of the groups, in two rows if they are long.
    fn add_names(&self, scene: &mut Scene, area: Area) {
        let names: Vec<String> = self.groups.iter().map(|g| label_markup(g)).collect();
        let pitch = area.width / names.len() as f64;
        let widest = names.iter().map(|n| draw::text_space(n, TEXT_SIZE)).fold(0.0, f64::max);
        let staggered = widest > pitch;
        for (k, name) in names.iter().enumerate() {
            let x = area.left + pitch * (k as f64 + 0.5);
            let y = area.bottom()
                + if staggered && k % 2 == 1 {
                    NAME_DISTANCE + ROW_DISTANCE
                } else {
                    NAME_DISTANCE
                };
            scene.add(draw::centred_text(x, y, name.clone(), None));
        }
    }

    /// Draws the boxes of a panel. Returns true if a box is missing.
    fn draw(&self, scene: &mut Scene, panel: &BoxPanel, area: Area, (low, high): (f64, f64)) -> bool {
        let share = |v: f64| (panel.height(v).clamp(low, high) - low) / (high - low);
        let y_of = |v: f64| area.bottom() - share(v) * area.height;
        if self.with_zero && low < 0.0 && high > 0.0 {
            let y = y_of(0.0);
            scene.add(draw::line((area.left, y), (area.right(), y), "#666666", 0.8, None));
        }
        let of_group = area.width / self.groups.len() as f64;
        for k in 1..self.groups.len() {
            let x = area.left + of_group * k as f64;
            scene.add(draw::line(
                (x, area.top),
                (x, area.bottom()),
                "#cccccc",
                0.6,
                Some("2 2"),
            ));
        }
        let pitch = GROUP_WIDTH_SHARE * of_group / self.series.len().max(1) as f64;
        let half = 0.5 * (BOX_WIDTH_SHARE * pitch).min(MAX_BOX_WIDTH);
        let (mut above, mut below, mut missing) = (0, 0, false);
        for group in 0..self.groups.len() {
            let start = area.left + of_group * (group as f64 + 0.5 * (1.0 - GROUP_WIDTH_SHARE));
            for (index, series) in self.series.iter().enumerate() {
                let x = start + pitch * (index as f64 + 0.5);
                let statistics = panel.boxes.get(group).and_then(|b| b.get(index));
                let Some(statistics) = statistics.filter(|b| b.is_drawable()) else {
                    missing = true;
                    draw::cross(scene, (x, area.bottom() - 6.0), half.min(3.0), OUTLINE_COLOUR, 1.0);
                    continue;
                };
                let colour = series.shade.colour();
                draw_box(scene, statistics, x, half, &colour, &y_of);
                let over = statistics.outliers.iter().filter(|v| panel.height(**v) > high).count();
                let under = statistics.outliers.iter().filter(|v| panel.height(**v) < low).count();
                if over > 0 {
                    draw::triangle(scene, (x, area.top), half.clamp(2.0, 3.5), true, &colour);
                }
                if under > 0 {
                    draw::triangle(scene, (x, area.bottom()), half.clamp(2.0, 3.5), false, &colour);
                }
                let inside = |v: &&f64| (low..=high).contains(&panel.height(**v));
                let at: Vec<(f64, f64)> = statistics
                    .outliers
                    .iter()
                    .filter(inside)
                    .map(|v| (x, y_of(*v)))
                    .collect();
                let radius = if at.len() > 30 { 0.7 } else { 1.1 };
                draw::points(scene, &at, radius, &colour, None);
                above += over;
                below += under;
            }
        }
        let marks = [(above, "above"), (below, "below")];
        let marks: Vec<String> = marks
            .iter()
            .filter(|t| t.0 > 0)
            .map(|(count, side)| format!("{count} {side}"))
            .chain((!panel.note.is_empty()).then(|| panel.note.clone()))
            .collect();
        if !marks.is_empty() {
            let y = area.top - 3.0;
            scene.add(draw::text(
                area.right(),
                y,
                marks.join(", "),
                TEXT_SIZE,
                TextAnchor::End,
                None,
            ));
        }
        missing
    }

    fn add_legend(&self, scene: &mut Scene, missing: bool) {
        let named = self.series.iter().filter(|s| !s.name.is_empty());
        let mut entries: Vec<Entry> = named
            .map(|s| Entry::new(&s.name, &s.shade.colour(), Sample::Box))
            .collect();
        if missing {
            entries.push(Entry::new("no value", OUTLINE_COLOUR, Sample::Cross));
        }
        // In the legend, the levels of one method stay in one row.
        let levels = self.series.first().map_or(1, |s| s.shade.levels);
        add_legend_in_multiples_of(scene, &entries, levels);
    }
}

fn draw_box(
    scene: &mut Scene,
    statistics: &BoxStatistics,
    x: f64,
    half: f64,
    colour: &str,
    y_of: &impl Fn(f64) -> f64,
) {
    let [lowest, lower, median, upper, highest] = statistics.marks().map(y_of);
    for (end, side) in [(lowest, lower), (highest, upper)] {
        scene.add(draw::line((x, side), (x, end), OUTLINE_COLOUR, 0.8, None));
        scene.add(draw::line(
            (x - 0.6 * half, end),
            (x + 0.6 * half, end),
            OUTLINE_COLOUR,
            0.8,
            None,
        ));
    }
    let size = (2.0 * half, lower - upper);
    scene.add(draw::rectangle(
        (x - half, upper),
        size,
        colour,
        Some((OUTLINE_COLOUR, 0.6)),
    ));
    // Only the median line of a very flat box is visible.
    let on_box = if size.1 < 2.0 || !is_dark(colour) {
        BLACK
    } else {
        "#FFFFFF"
    };
    scene.add(draw::line((x - half, median), (x + half, median), on_box, 1.2, None));
}

#[cfg(test)]
mod tests {
    use super::{super::draw::tests::contains_element, *};

    fn grid(boxes: Vec<Vec<BoxStatistics>>) -> BoxGrid {
        let (groups, series) = (boxes.len(), boxes.first().map_or(0, Vec::len));
        BoxGrid {
            panels: vec![BoxPanel {
                name: "B_r(b0)".to_owned(),
                unit: "%".to_owned(),
                boxes,
                ..BoxPanel::default()
            }],
            groups: (0..groups).map(|g| format!("{}", 26 + g)).collect(),
            series: (0..series)
                .map(|level| BoxSeries {
                    name: format!("P_n = 0.{level}"),
                    shade: Shade {
                        method: 0,
                        level,
                        levels: series,
                    },
                })
                .collect(),
            ..BoxGrid::default()
        }
    }

    #[test]
    fn box_is_drawn_at_its_coordinates() {
        // The ordinate from 0 to 10 has a margin of 5 %, so the axes extend from -0.5 to 10.5.
        let one = BoxStatistics {
            count: 5,
            lower_whisker: 0.0,
            lower_quartile: 2.0,
            median: 5.0,
            upper_quartile: 8.0,
            upper_whisker: 9.0,
            outliers: vec![10.0],
        };
        let svg = box_plots("b", "t", &grid(vec![vec![one]]));
        let y = |v: f64| 8.0 + SINGLE_PANEL_HEIGHT * (10.5 - v) / 11.0;
        let middle = style::LEFT_MARGIN + 0.5 * (style::WIDTH - style::LEFT_MARGIN - style::RIGHT_MARGIN);
        let side = middle - 0.5 * MAX_BOX_WIDTH;
        let height = SINGLE_PANEL_HEIGHT * 6.0 / 11.0;
        let rect = [("x", side), ("y", y(8.0)), ("width", MAX_BOX_WIDTH), ("height", height)];
        assert!(contains_element(&svg, "rect", &rect), "{svg}");
        let line = |from: (f64, f64), to: (f64, f64)| {
            contains_element(
                &svg,
                "line",
                &[("x1", from.0), ("y1", from.1), ("x2", to.0), ("y2", to.1)],
            )
        };
        assert!(line((middle, y(2.0)), (middle, y(0.0))), "lower whisker");
        assert!(line((middle, y(8.0)), (middle, y(9.0))), "upper whisker");
        assert!(line((side, y(5.0)), (side + MAX_BOX_WIDTH, y(5.0))), "median");
        assert!(
            contains_element(&svg, "circle", &[("cx", middle), ("cy", y(10.0))]),
            "outlier"
        );
        // The ordinate of the library agrees: its tick at 2 is at the height of the lower quartile.
        assert!(
            line((style::LEFT_MARGIN - 5.0, y(2.0)), (style::LEFT_MARGIN, y(2.0))),
            "tick"
        );
        assert!(svg.contains(">10</text>") && svg.contains(">0</text>"));
    }

    #[test]
    fn outliers_off_the_axis_are_counted() {
        let mut one = BoxStatistics::of(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        one.outliers = vec![1000.0, 2000.0, -300.0];
        let missing = BoxStatistics::default();
        let broken = BoxStatistics {
            count: 3,
            median: f64::NAN,
            ..one.clone()
        };
        let mut grid = grid(vec![vec![one, missing], vec![broken]]);
        let whole = box_plots("b", "t", &grid);
        assert!(!whole.contains("above") && whole.contains(">2000</text>"));
        assert_eq!(whole.matches("no value").count(), 1);
        grid.range = BoxRange::Whiskers;
        let cut = box_plots("b", "t", &grid);
        assert!(cut.contains("2 above, 1 below") && !cut.contains(">2000<") && !cut.contains("NaN"));
        assert_eq!(cut, box_plots("b", "t", &grid));
    }

    #[test]
    fn symmetric_log_axis_shows_small_and_large_boxes() {
        let [small, large] = [1.0, 1e5].map(|v| BoxStatistics::of(&[v, 1.2 * v, 1.4 * v]));
        let of = |linear_within| {
            let mut grid = grid(vec![vec![small.clone()], vec![large.clone()]]);
            grid.panels[0].linear_limit = linear_within;
            grid.panels[0].note = "at most 1.4e5".to_owned();
            box_plots("b", "t", &grid)
        };
        let height_of_first = |svg: &str| -> f64 {
            let of_box = svg.split("<rect ").find(|rest| {
                rest.contains(&Shade::of_method(0).colour().to_lowercase())
                    || rest.contains(&Shade::of_method(0).colour())
            });
            let (_, rest) = of_box.unwrap().split_once(" height=\"").unwrap();
            rest.split_once('"').unwrap().0.parse().unwrap()
        };
        // With quartiles at 1.1 and 1.3, the box has a fifth of the height of a decade if the ordinate becomes
        // logarithmic at 1, and almost no height on a linear ordinate.
        assert!(height_of_first(&of(None)) < 0.01);
        assert!(height_of_first(&of(Some(1.0))) > 1.5);
        assert!(of(Some(1.0)).contains("at most 1.4e5") && of(Some(1.0)).contains(">1000</text>"));
    }

    #[test]
    fn empty_grid_gives_a_valid_figure() {
        for grid in [BoxGrid::default(), grid(vec![]), grid(vec![vec![]])] {
            let svg = box_plots("b", "t", &grid);
            assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>") && !svg.contains("NaN"));
        }
    }
}
