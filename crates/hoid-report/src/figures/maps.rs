//! Maps of a function of two variables as coloured cells; the values are printed in the cells where they fit.

use kuva::{
    prelude::Plot,
    render::render::{Scene, TextAnchor},
};

use super::{
    MapColours,
    colour_bar::{BAR_SPACE, ColourScale},
    draw,
    frame::{self, Area, Frame, Ordinates},
    labels::label_markup,
    legend::{Entry, Sample, add_legend},
    palette::is_dark,
    style::{self, BLACK, TEXT_SIZE},
    svg,
};

/// Height of a cell; `MIN_PANEL_HEIGHT` is the smallest height of a panel.
const CELL_HEIGHT: f64 = 26.0;
const MIN_PANEL_HEIGHT: f64 = 78.0;
/// Distance between the axis and the name of the ordinate.
const NAME_DISTANCE: f64 = 26.0;
/// Smallest space between category names.
const LABEL_SPACING: f64 = 5.0;

/// One map of a figure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MapPanel {
    /// Name that distinguishes the rows of panels, such as `P_n = 0.1`; only the name of the first panel of a row is
    /// shown.
    pub name: String,
    /// Values by ordinate, from the lowest, and by abscissa. Cells with a non-finite or missing value are hatched.
    pub values: Vec<Vec<f64>>,
    /// Indices (from zero) along the abscissa and the ordinate of the cell marked by a cross.
    pub marked: Option<(usize, usize)>,
}

/// Maps with common axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MapGrid {
    /// The panels, row by row.
    pub panels: Vec<MapPanel>,
    /// Panels per row; zero counts as one. A figure with a single column has the width of a text column; a figure with
    /// several has the width of a page.
    pub columns: usize,
    /// Titles of the columns, or of all panels; empty for no titles.
    pub titles: Vec<String>,
    /// Name of the abscissa, such as `n_k^*`; `_` and `^` mark subscripts and superscripts of one character, or of
    /// several in braces.
    pub abscissa: String,
    /// Category names of the abscissa.
    pub x_categories: Vec<String>,
    /// Name of the ordinate.
    pub ordinate: String,
    /// Category names of the ordinate, from the lowest.
    pub y_categories: Vec<String>,
    /// Name and unit of the mapped quantity, such as `VAF (%)`.
    pub value: String,
    /// Colours of the cells.
    pub colours: MapColours,
    /// Values at the ends of the colour map; if `None`, the extreme values of the data.
    pub limits: Option<(f64, f64)>,
    /// True if each row has its own colour map and colour bar.
    pub bar_per_row: bool,
    /// Meaning of the cross, for the legend; empty for no entry.
    pub cross_label: String,
}

/// Draws maps as one figure. `title` is the text for screen readers.
pub fn maps(id: &str, title: &str, grid: &MapGrid) -> String {
    let columns = grid.columns.max(1);
    let n = grid.panels.len();
    let (nx, ny) = (grid.x_categories.len(), grid.y_categories.len());
    if n == 0 || nx == 0 || ny == 0 {
        return frame::empty_figure(id, title);
    }
    let height = (CELL_HEIGHT * ny as f64).max(MIN_PANEL_HEIGHT);
    let frame = Frame::with_space(
        n,
        columns,
        height,
        Ordinates::Shared,
        grid.titles.len(),
        (0.0, BAR_SPACE),
    );
    let (x_range, y_range) = ((0.5, nx as f64 + 0.5), (0.5, ny as f64 + 0.5));
    let x_names = grid.x_names(frame.area(0).width);
    let cell = |i: usize| {
        let shown = match frame.is_lowest(i) {
            true => x_names.clone(),
            false => vec![String::new(); nx],
        };
        let layout = style::layout(x_range, y_range, height)
            .with_show_grid(false)
            .with_y_tick_step(10.0 * (ny as f64 + 1.0));
        let layout = frame.fit_layout(i, layout).with_x_categories(shown);
        (vec![Plot::from(style::line([], BLACK, 1.0))], layout)
    };
    let cells = (0..n).map(cell).collect();
    let label = |i: usize| label_markup(&grid.panels[i].name);
    let mut scene = frame.draw_panels(cells, &grid.abscissa, label, &grid.titles, BAR_SPACE);

    let whole = grid.scale(&grid.panels);
    let mut missing = false;
    for (row, panels) in grid.panels.chunks(columns).enumerate() {
        let scale = match grid.bar_per_row {
            true => grid.scale(panels),
            false => whole,
        };
        let first = frame.area(row * columns);
        grid.add_ordinate(&mut scene, first);
        for (column, panel) in panels.iter().enumerate() {
            let area = frame.area(row * columns + column);
            missing |= grid.draw(&mut scene, panel, area, &scale);
        }
        if grid.bar_per_row {
            scale.add_bar(&mut scene, first.top, first.bottom(), &grid.value);
        }
    }
    if !grid.bar_per_row {
        whole.add_bar(&mut scene, frame.area(0).top, frame.area(n - 1).bottom(), &grid.value);
    }
    let mut entries = Vec::new();
    if !grid.cross_label.is_empty() && grid.panels.iter().any(|p| p.marked.is_some()) {
        entries.push(Entry::new(&grid.cross_label, BLACK, Sample::Cross));
    }
    if missing {
        entries.push(Entry::new("no value", BLACK, Sample::Hatched));
    }
    add_legend(&mut scene, &entries);
    svg::finish(id, title, scene)
}

impl MapGrid {
    fn scale(&self, panels: &[MapPanel]) -> ColourScale {
        let values = panels.iter().flat_map(|p| p.values.iter().flatten());
        let finite = values.copied().filter(|v| style::is_drawable(*v));
        let start = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = finite.fold(start, |(l, h), v| (l.min(v), h.max(v)));
        let given = self.limits.filter(|(l, h)| h > l && (h - l).is_finite());
        let (low, high) = match given {
            Some(limits) => limits,
            None if high > low => (low, high),
            None => style::padded_range([low]),
        };
        let reach = low.abs().max(high.abs());
        let (low, high) = match self.colours {
            MapColours::Sequential => (low, high),
            MapColours::Diverging => (-reach, reach),
        };
        ColourScale {
            low,
            high,
            colours: self.colours,
        }
    }

    /// Category names of an abscissa of this width; only every second, third or further name is shown if not all fit.
    fn x_names(&self, width: f64) -> Vec<String> {
        let names: Vec<String> = self.x_categories.iter().map(|p| label_markup(p)).collect();
        let widest = names.iter().map(|n| draw::text_space(n, TEXT_SIZE)).fold(0.0, f64::max);
        let every = ((widest + LABEL_SPACING) * names.len() as f64 / width).ceil().max(1.0) as usize;
        let shown = |(i, name): (usize, String)| if i.is_multiple_of(every) { name } else { String::new() };
        names.into_iter().enumerate().map(shown).collect()
    }

    /// Draws the name and the category names of the ordinate.
    fn add_ordinate(&self, scene: &mut Scene, area: Area) {
        let ny = self.y_categories.len() as f64;
        for (k, place) in self.y_categories.iter().enumerate() {
            let y = area.bottom() - area.height * (k as f64 + 0.5) / ny;
            scene.add(draw::line((area.left - 5.0, y), (area.left, y), BLACK, 1.0, None));
            scene.add(draw::text(
                area.left - 8.0,
                y + 4.5,
                label_markup(place),
                TEXT_SIZE,
                TextAnchor::End,
                None,
            ));
        }
        let middle = area.top + 0.5 * area.height;
        let x = area.left - NAME_DISTANCE;
        scene.add(draw::centred_text(x, middle, label_markup(&self.ordinate), Some(-90.0)));
    }

    /// Draws the cells of a panel. Returns true if a value is missing.
    fn draw(&self, scene: &mut Scene, panel: &MapPanel, area: Area, scale: &ColourScale) -> bool {
        let (nx, ny) = (self.x_categories.len(), self.y_categories.len());
        let (width, height) = (area.width / nx as f64, area.height / ny as f64);
        let decimals = self.decimals(width);
        let mut missing = false;
        for y in 0..ny {
            for x in 0..nx {
                let corner = (area.left + width * x as f64, area.bottom() - height * (y + 1) as f64);
                let value = panel.values.get(y).and_then(|row| row.get(x)).copied();
                let is_marked = panel.marked == Some((x, y));
                let Some(value) = value.filter(|v| style::is_drawable(*v)) else {
                    missing = true;
                    draw::hatched_rectangle(scene, corner, (width, height));
                    if is_marked {
                        let at = (corner.0 + 0.5 * width, corner.1 + 0.5 * height);
                        draw::cross(scene, at, 5.0, BLACK, 1.6);
                    }
                    continue;
                };
                let colour = scale.colour(value);
                let ink = if is_dark(&colour) { "#FFFFFF" } else { BLACK };
                scene.add(draw::rectangle(corner, (width, height), &colour, Some((&colour, 0.4))));
                if let Some(decimals) = decimals {
                    let mut text = draw::text(
                        corner.0 + 0.5 * width,
                        corner.1 + 0.5 * height + 4.5,
                        format_without_negative_zero(value, decimals),
                        TEXT_SIZE,
                        TextAnchor::Middle,
                        None,
                    );
                    if let kuva::render::render::Primitive::Text { color, .. } = &mut text {
                        *color = Some(ink.into());
                    }
                    scene.add(text);
                }
                if is_marked {
                    // The cross is next to the number, or in the middle of a cell without a number.
                    let (at, half) = match decimals {
                        Some(_) => ((corner.0 + width - 4.6, corner.1 + 4.6), 2.2),
                        None => ((corner.0 + 0.5 * width, corner.1 + 0.5 * height), 5.0),
                    };
                    draw::cross(scene, at, half, ink, 1.4);
                    scene.add(draw::rectangle(
                        (corner.0 + 0.8, corner.1 + 0.8),
                        (width - 1.6, height - 1.6),
                        "none",
                        Some((ink, 1.2)),
                    ));
                }
            }
        }
        missing
    }

    /// Largest number of decimals, up to three significant digits, with which the longest number fits into a cell;
    /// `None` if no number of decimals fits.
    fn decimals(&self, width: f64) -> Option<usize> {
        let values = || self.panels.iter().flat_map(|p| p.values.iter().flatten());
        let finite = || values().copied().filter(|v| style::is_drawable(*v));
        let largest = finite().fold(0.0, |m: f64, v| m.max(v.abs()));
        let wanted = match largest {
            l if l >= 100.0 => 0,
            l if l >= 10.0 => 1,
            l if l >= 0.1 => 2,
            _ => 3,
        };
        let fits = |decimals: &usize| {
            let widths = finite().map(|v| draw::text_space(&format_without_negative_zero(v, *decimals), TEXT_SIZE));
            widths.fold(0.0, f64::max) <= width - 1.5
        };
        let least = usize::from(largest < 10.0);
        (least..=wanted).rev().find(fits)
    }
}

fn format_without_negative_zero(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|b| matches!(b, b'0' | b'.')) => rest.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::{super::draw::tests::contains_element, *};

    fn grid(values: Vec<Vec<f64>>) -> MapGrid {
        MapGrid {
            panels: vec![MapPanel {
                name: "P_n = 0.1".to_owned(),
                values,
                marked: Some((1, 0)),
            }],
            abscissa: "n_k^*".to_owned(),
            x_categories: vec!["25".to_owned(), "26".to_owned()],
            ordinate: "m^*".to_owned(),
            y_categories: vec!["1".to_owned(), "2".to_owned()],
            value: "VAF (%)".to_owned(),
            cross_label: "true order".to_owned(),
            ..MapGrid::default()
        }
    }

    #[test]
    fn cells_have_their_position_and_colour() {
        let svg = maps("m", "t", &grid(vec![vec![1.0, 2.0], vec![3.0, f64::NAN]])).to_lowercase();
        let width = 0.5 * (style::WIDTH - BAR_SPACE - style::LEFT_MARGIN - style::RIGHT_MARGIN);
        let top = 8.0;
        let cell = |x: f64, y: f64, colour: &str| {
            let place = [
                ("x", style::LEFT_MARGIN + width * x),
                ("y", top + 39.0 * y),
                ("width", width),
                ("height", 39.0),
            ];
            let of_colour = svg.replace(&format!("\" fill=\"{colour}\""), "\" wanted=\"1\"");
            contains_element(&of_colour, "rect", &[&place[..], &[("wanted", 1.0)]].concat())
        };
        // The ends of viridis: the lowest value is at the lower left, the highest value above it.
        assert!(cell(0.0, 1.0, "#440154"), "{svg}");
        assert!(cell(0.0, 0.0, "#fde725"));
        assert!(cell(1.0, 0.0, "#f2f2f2"));
        assert!(svg.contains("true order") && svg.contains("no value"));
    }

    #[test]
    fn differences_are_white_at_zero() {
        let mut grid = grid(vec![vec![-1.0, 3.0]]);
        grid.colours = MapColours::Diverging;
        let scale = grid.scale(&grid.panels);
        assert_eq!((scale.low, scale.high), (-3.0, 3.0));
        let middle = scale.colour(0.0);
        assert!(!is_dark(&middle) && is_dark(&scale.colour(-3.0)) && is_dark(&scale.colour(9.0)));
        grid.limits = Some((-1.0, 0.5));
        assert_eq!(grid.scale(&grid.panels).high, 1.0);
    }

    #[test]
    fn numbers_have_no_negative_zero() {
        assert_eq!(format_without_negative_zero(-0.001, 2), "0.00");
        assert_eq!(format_without_negative_zero(-0.01, 2), "-0.01");
    }

    #[test]
    fn invalid_input_gives_a_valid_figure() {
        let nan = f64::NAN;
        let values = [
            vec![],
            vec![vec![nan, nan]],
            vec![vec![1e308, -1e308]],
            vec![vec![5.0; 9]; 9],
        ];
        for values in values {
            for colours in [MapColours::Sequential, MapColours::Diverging] {
                let grid = MapGrid {
                    colours,
                    bar_per_row: true,
                    ..grid(values.clone())
                };
                let svg = maps("m", "t", &grid);
                assert!(svg.ends_with("</svg>") && !svg.contains("NaN") && !svg.contains("inf"));
                assert_eq!(svg, maps("m", "t", &grid));
            }
        }
        assert!(maps("m", "t", &MapGrid::default()).ends_with("</svg>"));
    }
}
