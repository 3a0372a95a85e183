//! The legend below a figure.

use kuva::render::render::{Scene, TextAnchor};

use super::{
    draw,
    labels::label_markup,
    palette::MarkerShape,
    style::{LEFT_MARGIN, TEXT_SIZE},
};

const ROW_HEIGHT: f64 = 18.0;
const SAMPLE_WIDTH: f64 = 22.0;
const NAME_GAP: f64 = 6.0;
const ENTRY_GAP: f64 = 14.0;
const MAX_NAME_CHARS: usize = 48;

/// Graphical sample next to the text of a legend entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sample {
    /// A solid line.
    Line,
    /// A dashed line.
    Dashed,
    /// A dotted line.
    Dotted,
    /// A filled box.
    Box,
    /// A point.
    Point,
    /// A line with a mark.
    LineMark(MarkerShape),
    /// A small cross.
    Cross,
    /// A hatched box.
    Hatched,
}

/// One entry of a legend.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Text of the entry; see [`label_markup`] for subscripts.
    pub name: String,
    /// Colour `#rrggbb`.
    pub colour: String,
    /// Graphical sample of the entry.
    pub sample: Sample,
}

impl Entry {
    pub fn new(name: &str, colour: &str, sample: Sample) -> Self {
        Self {
            name: name.to_owned(),
            colour: colour.to_owned(),
            sample,
        }
    }
}

/// Adds a legend below the figure and increases the height of the figure accordingly. The entries form one row if the
/// width suffices, otherwise columns or, if names are long, rows with as many entries as fit.
pub fn add_legend(scene: &mut Scene, entries: &[Entry]) {
    add_legend_in_multiples_of(scene, entries, 1);
}

/// Adds a legend as [`add_legend`] does. If it needs several rows, the number of columns is a multiple of `multiple`
/// where possible, so that related entries stay together.
pub fn add_legend_in_multiples_of(scene: &mut Scene, entries: &[Entry], multiple: usize) {
    if entries.is_empty() {
        return;
    }
    let names: Vec<String> = entries
        .iter()
        .map(|e| label_markup(&shorten(&e.name, MAX_NAME_CHARS)))
        .collect();
    let widths: Vec<f64> = names
        .iter()
        .map(|n| SAMPLE_WIDTH + NAME_GAP + draw::text_space(n, TEXT_SIZE) + ENTRY_GAP)
        .collect();
    let last = scene.width - 4.0 + ENTRY_GAP;
    let whole: f64 = widths.iter().sum();
    let pitch = widths.iter().copied().fold(0.0, f64::max);
    let columns = ((last - LEFT_MARGIN) / pitch) as usize;
    let columns = if columns > multiple {
        columns - columns % multiple.max(1)
    } else {
        columns
    };
    let in_one_row = whole <= last - 8.0;
    let left = if in_one_row {
        LEFT_MARGIN.min(last - whole)
    } else {
        LEFT_MARGIN
    };
    let (mut x, mut y) = (left, scene.height + 15.0);
    for (i, entry) in entries.iter().enumerate() {
        let (start, advance) = match columns {
            _ if in_one_row => (x, widths[i]),
            2.. => {
                if i > 0 && i.is_multiple_of(columns) {
                    (x, y) = (left, y + ROW_HEIGHT);
                }
                (x, pitch)
            }
            _ => {
                if x > left && x + widths[i] > last {
                    (x, y) = (left, y + ROW_HEIGHT);
                }
                (x.min(last - widths[i]).max(4.0), widths[i])
            }
        };
        add_sample(scene, entry, start, y - 4.5);
        let at = start + SAMPLE_WIDTH + NAME_GAP;
        scene.add(draw::text(at, y, names[i].clone(), TEXT_SIZE, TextAnchor::Start, None));
        x = start + advance;
    }
    scene.height = y + 7.0;
}

fn add_sample(scene: &mut Scene, entry: &Entry, x: f64, y: f64) {
    let colour = entry.colour.as_str();
    let middle = x + 0.5 * SAMPLE_WIDTH;
    let line = |dashes: Option<&str>| draw::line((x, y), (x + SAMPLE_WIDTH, y), colour, 2.0, dashes);
    match entry.sample {
        Sample::Line => scene.add(line(None)),
        Sample::Dashed => scene.add(line(Some("6 3"))),
        Sample::Dotted => scene.add(line(Some("2 4"))),
        Sample::Box => scene.add(draw::rectangle(
            (x + 3.0, y - 5.0),
            (SAMPLE_WIDTH - 6.0, 10.0),
            colour,
            Some((draw::OUTLINE_COLOUR, 0.7)),
        )),
        Sample::Point => draw::points(scene, &[(middle, y)], 2.6, colour, None),
        Sample::LineMark(mark) => {
            scene.add(line(None));
            draw::mark(scene, (middle, y), 2.6, mark, colour);
        }
        Sample::Cross => draw::cross(scene, (middle, y), 3.5, colour, 1.3),
        Sample::Hatched => draw::hatched_rectangle(scene, (x + 3.0, y - 5.0), (SAMPLE_WIDTH - 6.0, 10.0)),
    }
}

fn shorten(text: &str, longest: usize) -> String {
    if text.chars().count() <= longest {
        return text.to_owned();
    }
    let mut short: String = text.chars().take(longest - 1).collect();
    short.push('\u{2026}');
    short
}

#[cfg(test)]
mod tests {
    use kuva::render::render::Primitive;

    use super::*;

    #[test]
    fn long_names_are_shortened() {
        assert_eq!(shorten("abc", 3), "abc");
        assert_eq!(shorten("\u{3c9}\u{3c9}\u{3c9}\u{3c9}", 3), "\u{3c9}\u{3c9}\u{2026}");
    }

    #[test]
    fn entries_stay_within_the_figure() {
        let mut scene = Scene::new(420.0, 100.0);
        let entries: Vec<Entry> = (0..9)
            .map(|k| Entry::new(&"name ".repeat(1 + k), "#000000", Sample::Line))
            .collect();
        add_legend(&mut scene, &entries);
        let mut before = (0.0, 0.0);
        for element in &scene.elements {
            if let Primitive::Text { x, y, .. } = element {
                assert!(*x > 0.0 && *x < 420.0 && *y < scene.height);
                assert!((*y, *x) > before, "entries in reading order");
                before = (*y, *x);
            }
        }
        assert!(scene.height > 100.0 + 3.0 * ROW_HEIGHT);
    }
}
