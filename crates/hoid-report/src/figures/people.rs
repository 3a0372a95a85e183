//! Figure of people by condition: for each person a thin line through their estimates with standard errors, and the
//! mean over people with its 95 % interval.

use kuva::{prelude::Plot, render::render::Scene};

use super::{
    Shade,
    axes::with_ordinate,
    draw::{self, OUTLINE_COLOUR},
    frame::{self, Area, Frame, Ordinates},
    labels::{label_markup, panel_label},
    legend::{Entry, Sample, add_legend},
    palette::MarkerShape,
    style::{self, BLACK, GREY, TEXT_SIZE},
    svg,
};

const PANEL_HEIGHT: f64 = 150.0;
/// Distance of the category names below the axis; `ROW_DISTANCE` is the distance of a second row of names below the
/// first.
const NAME_DISTANCE: f64 = 17.0;
const ROW_DISTANCE: f64 = 12.0;
/// Horizontal positions of the first and the last person within a category, as fractions of its width; `MEAN_POSITION`
/// is the position of the mean.
const PEOPLE_POSITIONS: (f64, f64) = (0.18, 0.6);
const MEAN_POSITION: f64 = 0.78;
/// Maximum number of people with individual colours; larger groups are drawn in grey, with one legend entry for all
/// people.
const MAX_COLOURED_PEOPLE: usize = 6;

/// Estimate for a person in a category, with its standard error if known; `None` if there is no estimate.
pub type CategoryEstimate = Option<(f64, Option<f64>)>;

/// One panel with the estimates of a quantity.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PeoplePanel {
    /// Name of the quantity, such as `omega_c`.
    pub name: String,
    /// Unit of the quantity; empty if it has none.
    pub unit: String,
    /// The estimates by person and category.
    pub people: Vec<Vec<CategoryEstimate>>,
    /// The mean over people in each category, with the ends of its interval.
    pub means: Vec<Option<(f64, (f64, f64))>>,
}

/// Panels of people with common categories.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PeopleGrid {
    /// The panels, one for each quantity.
    pub panels: Vec<PeoplePanel>,
    /// Names of the people.
    pub people: Vec<String>,
    /// Names of the categories, such as conditions.
    pub categories: Vec<String>,
    /// Name of the category axis.
    pub abscissa: String,
}

/// Draws people by condition as one figure, with two panels per row if there are several panels. `title` is the text
/// for screen readers.
pub fn people_by_condition(id: &str, title: &str, grid: &PeopleGrid) -> String {
    let n = grid.panels.len();
    if n == 0 || grid.categories.is_empty() {
        return frame::empty_figure(id, title);
    }
    let columns = if n == 1 { 1 } else { 2 };
    let labels = grid.panels.iter().map(|p| (p.name.as_str(), p.unit.as_str()));
    let ordinates = Ordinates::of(labels, columns, false);
    let ranges: Vec<(f64, f64)> = grid.panels.iter().map(PeoplePanel::range).collect();
    let frame = Frame::new(n, columns, PANEL_HEIGHT, ordinates, 0);
    let places = (0.5, grid.categories.len() as f64 + 0.5);
    let cell = |(i, panel): (usize, &PeoplePanel)| {
        let layout = style::layout(places, ranges[i], PANEL_HEIGHT);
        let layout = with_ordinate(layout, ranges[i], &panel.unit, false, PANEL_HEIGHT, frame.has_ticks(i));
        let layout = frame
            .fit_layout(i, layout)
            .with_x_categories(vec![String::new(); grid.categories.len()]);
        (vec![Plot::from(style::line([], BLACK, 1.0))], layout)
    };
    let cells = grid.panels.iter().enumerate().map(cell).collect();
    let label = |i: usize| panel_label(&grid.panels[i].name, &grid.panels[i].unit);
    let mut scene = frame.draw_panels(cells, &grid.abscissa, label, &[], 0.0);
    for (i, panel) in grid.panels.iter().enumerate() {
        grid.draw(&mut scene, panel, frame.area(i), ranges[i]);
        if frame.is_lowest(i) {
            grid.add_names(&mut scene, frame.area(i));
        }
    }
    let mut entries: Vec<Entry> = match grid.people.len() <= MAX_COLOURED_PEOPLE {
        true => (grid.people.iter().enumerate())
            .map(|(i, name)| {
                Entry::new(
                    name,
                    &colour(i, grid.people.len()),
                    Sample::LineMark(MarkerShape::Circle),
                )
            })
            .collect(),
        false => vec![Entry::new("a person", GREY, Sample::LineMark(MarkerShape::Circle))],
    };
    entries.push(Entry::new("mean, 95 %", BLACK, Sample::LineMark(MarkerShape::Diamond)));
    add_legend(&mut scene, &entries);
    svg::finish(id, title, scene)
}

fn colour(person: usize, people: usize) -> String {
    if people <= MAX_COLOURED_PEOPLE {
        Shade::of_method(person).colour()
    } else {
        GREY.to_owned()
    }
}

impl PeoplePanel {
    fn range(&self) -> (f64, f64) {
        let people = self.people.iter().flatten().flatten();
        let ends = people.flat_map(|(value, error)| {
            let reach = error.filter(|e| e.is_finite()).unwrap_or(0.0);
            [value - reach, value + reach]
        });
        let means = self
            .means
            .iter()
            .flatten()
            .flat_map(|(mean, (low, high))| [*mean, *low, *high]);
        style::padded_range(ends.chain(means))
    }
}

impl PeopleGrid {
    fn add_names(&self, scene: &mut Scene, area: Area) {
        let names: Vec<String> = self.categories.iter().map(|name| label_markup(name)).collect();
        let pitch = area.width / names.len() as f64;
        let staggered = names.iter().any(|name| draw::text_space(name, TEXT_SIZE) > pitch);
        for (k, name) in names.into_iter().enumerate() {
            let below = if staggered && k % 2 == 1 { ROW_DISTANCE } else { 0.0 };
            let x = area.left + pitch * (k as f64 + 0.5);
            scene.add(draw::centred_text(x, area.bottom() + NAME_DISTANCE + below, name, None));
        }
    }

    fn draw(&self, scene: &mut Scene, panel: &PeoplePanel, area: Area, (low, high): (f64, f64)) {
        let y_of = |v: f64| area.bottom() - (v.clamp(low, high) - low) / (high - low) * area.height;
        let pitch = area.width / self.categories.len() as f64;
        let x_of = |index: usize, part: f64| area.left + pitch * (index as f64 + part);
        let n = self.people.len();
        for (i, places) in panel.people.iter().enumerate() {
            let share = if n > 1 { i as f64 / (n - 1) as f64 } else { 0.5 };
            let part = PEOPLE_POSITIONS.0 + share * (PEOPLE_POSITIONS.1 - PEOPLE_POSITIONS.0);
            let colour = colour(i, n);
            let drawable = |at: &CategoryEstimate| at.filter(|(v, _)| style::is_drawable(*v));
            let mut last: Option<(f64, f64)> = None;
            for (index, at) in places.iter().enumerate() {
                let Some((value, error)) = drawable(at) else {
                    last = None;
                    continue;
                };
                let point = (x_of(index, part), y_of(value));
                if let Some(before) = last {
                    scene.add(draw::line(before, point, &colour, 0.6, Some("3 2")));
                }
                if let Some(error) = error.filter(|e| e.is_finite()) {
                    let ends = [value - error, value + error].map(|v| (point.0, y_of(v)));
                    scene.add(draw::line(ends[0], ends[1], &colour, 1.0, None));
                }
                draw::mark(scene, point, 2.2, MarkerShape::Circle, &colour);
                last = Some(point);
            }
        }
        for (index, mean) in panel.means.iter().enumerate() {
            let Some((value, (from, to))) = mean.filter(|(v, _)| style::is_drawable(*v)) else {
                continue;
            };
            let x = x_of(index, MEAN_POSITION);
            scene.add(draw::line((x, y_of(from)), (x, y_of(to)), BLACK, 1.4, None));
            for end in [from, to] {
                scene.add(draw::line((x - 4.0, y_of(end)), (x + 4.0, y_of(end)), BLACK, 1.4, None));
            }
            draw::mark(scene, (x, y_of(value)), 3.4, MarkerShape::Diamond, OUTLINE_COLOUR);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::draw::tests::contains_element, *};

    fn grid() -> PeopleGrid {
        PeopleGrid {
            panels: vec![PeoplePanel {
                name: "omega_c".to_owned(),
                unit: "rad/s".to_owned(),
                people: vec![
                    vec![Some((0.0, None)), Some((10.0, Some(1.0)))],
                    vec![Some((4.0, Some(f64::NAN))), None],
                ],
                means: vec![Some((2.0, (0.0, 4.0))), None],
            }],
            people: vec!["P".to_owned(), "Q".to_owned()],
            categories: vec!["fo".to_owned(), "so".to_owned()],
            abscissa: "condition".to_owned(),
        }
    }

    #[test]
    fn marks_are_drawn_at_their_coordinates() {
        let svg = people_by_condition("p", "t", &grid());
        // The ordinate from 0 to 11 has a margin of 5 %.
        let y = |v: f64| 8.0 + PANEL_HEIGHT * (11.55 - v) / 12.1;
        let width = style::WIDTH - style::LEFT_MARGIN - style::RIGHT_MARGIN;
        let x = |index: f64, part: f64| style::LEFT_MARGIN + 0.5 * width * (index + part);
        for (at, v) in [
            (x(0.0, PEOPLE_POSITIONS.0), 0.0),
            (x(1.0, PEOPLE_POSITIONS.0), 10.0),
            (x(0.0, PEOPLE_POSITIONS.1), 4.0),
        ] {
            assert!(contains_element(&svg, "circle", &[("cx", at), ("cy", y(v))]), "{svg}");
        }
        let m = x(0.0, MEAN_POSITION);
        assert!(contains_element(
            &svg,
            "line",
            &[("x1", m), ("y1", y(0.0)), ("x2", m), ("y2", y(4.0))]
        ));
        assert!(svg.contains(">fo</text>") && svg.contains("mean, 95 %") && !svg.contains("NaN"));
        assert_eq!(svg, people_by_condition("p", "t", &grid()));
    }

    #[test]
    fn empty_grid_is_valid_and_many_people_are_grey() {
        let none = people_by_condition("p", "t", &PeopleGrid::default());
        assert!(none.starts_with("<svg ") && !none.contains("NaN"));
        let mut many = grid();
        many.people = (0..9).map(|i| format!("P{i}")).collect();
        many.panels[0].people = vec![vec![Some((1.0, Some(0.1))); 2]; 9];
        let svg = people_by_condition("p", "t", &many);
        assert!(svg.contains("a person") && !svg.contains(">P3<"));
    }
}
