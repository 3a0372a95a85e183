//! Marks drawn over the axes at positions given in the coordinates of the figure.

use kuva::render::{
    color::Color,
    render::{PathData, Primitive, Scene, TextAnchor},
};

use super::{
    labels::{Level, parts},
    palette::MarkerShape,
    style::{GREY, TEXT_SIZE},
};

/// Colour of outlines, whiskers and marks of missing values.
pub const OUTLINE_COLOUR: &str = "#333333";
/// Font size of labels that would otherwise be too long.
const SMALL_FONT_SIZE: u32 = 10;
/// Opacity of bands around lines.
pub const BAND_OPACITY: f64 = 0.2;

/// Distance between the lines of the hatching.
const HATCH_SPACING: f64 = 5.0;

pub fn line(from: (f64, f64), to: (f64, f64), colour: &str, width: f64, dashes: Option<&str>) -> Primitive {
    Primitive::Line {
        x1: from.0,
        y1: from.1,
        x2: to.0,
        y2: to.1,
        stroke: Color::from(colour),
        stroke_width: width,
        stroke_dasharray: dashes.map(str::to_owned),
    }
}

pub fn rectangle(
    (x, y): (f64, f64),
    (width, height): (f64, f64),
    fill: &str,
    stroke: Option<(&str, f64)>,
) -> Primitive {
    Primitive::Rect {
        x,
        y,
        width,
        height,
        fill: Color::from(fill),
        stroke: stroke.map(|s| Color::from(s.0)),
        stroke_width: stroke.map(|s| s.1),
        opacity: None,
    }
}

pub fn points(scene: &mut Scene, at: &[(f64, f64)], radius: f64, colour: &str, opacity: Option<f64>) {
    if at.is_empty() {
        return;
    }
    scene.add(Primitive::CircleBatch {
        cx: at.iter().map(|p| p.0).collect(),
        cy: at.iter().map(|p| p.1).collect(),
        r: radius,
        fill: Color::from(colour),
        fill_opacity: opacity,
        stroke: None,
        stroke_width: None,
    });
}

pub fn cross(scene: &mut Scene, (x, y): (f64, f64), half: f64, colour: &str, width: f64) {
    scene.add(line((x - half, y - half), (x + half, y + half), colour, width, None));
    scene.add(line((x - half, y + half), (x + half, y - half), colour, width, None));
}

/// Draws a mark of this shape at a position. Marks of all shapes cover about the same area.
pub fn mark(scene: &mut Scene, at: (f64, f64), radius: f64, form: MarkerShape, colour: &str) {
    let (x, y) = at;
    let (side, tall, wide) = (0.9 * radius, 1.35 * radius, 1.3 * radius);
    match form {
        MarkerShape::Circle => points(scene, &[at], radius, colour, None),
        MarkerShape::Square => scene.add(rectangle((x - side, y - side), (2.0 * side, 2.0 * side), colour, None)),
        MarkerShape::Up => triangle(scene, (x, y - tall), wide, true, colour),
        MarkerShape::Down => triangle(scene, (x, y + tall), wide, false, colour),
        MarkerShape::Diamond => {
            triangle(scene, (x, y - tall), 0.8 * radius, true, colour);
            triangle(scene, (x, y + tall), 0.8 * radius, false, colour);
        }
    }
}

/// Draws a triangle that points up or down with its tip at a position.
pub fn triangle(scene: &mut Scene, (x, y): (f64, f64), half: f64, up: bool, colour: &str) {
    let base = if up { y + 1.7 * half } else { y - 1.7 * half };
    let (left, right) = (x - half, x + half);
    scene.add(Primitive::Path(Box::new(PathData {
        d: format!("M {x:.2} {y:.2} L {left:.2} {base:.2} L {right:.2} {base:.2} Z"),
        fill: Some(Color::from(colour)),
        stroke: Color::None,
        stroke_width: 0.0,
        opacity: None,
        stroke_dasharray: None,
    })));
}

/// Draws a pale rectangle with diagonal lines, for missing values.
pub fn hatched_rectangle(scene: &mut Scene, (x, y): (f64, f64), (width, height): (f64, f64)) {
    scene.add(rectangle((x, y), (width, height), "#f2f2f2", None));
    let mut offset = HATCH_SPACING;
    while offset < width + height {
        let from = (x + (offset - height).max(0.0), y + offset.min(height));
        let to = (x + offset.min(width), y + (offset - width).max(0.0));
        scene.add(line(from, to, GREY, 0.6, None));
        offset += HATCH_SPACING;
    }
}

pub fn text(x: f64, y: f64, content: String, size: u32, anchor: TextAnchor, rotate: Option<f64>) -> Primitive {
    Primitive::Text {
        x,
        y,
        content,
        anchor,
        size,
        rotate,
        bold: false,
        color: None,
    }
}

/// Text centred at a position, with the font size of labels.
pub fn centred_text(x: f64, y: f64, content: String, rotate: Option<f64>) -> Primitive {
    text(x, y, content, TEXT_SIZE, TextAnchor::Middle, rotate)
}

/// Text centred at a position, with a smaller font if it is longer than the available space.
pub fn fitted_text(x: f64, y: f64, content: String, room: f64, rotate: Option<f64>) -> Primitive {
    let size = match text_width(&content, TEXT_SIZE) > room {
        true => SMALL_FONT_SIZE,
        false => TEXT_SIZE,
    };
    text(x, y, content, size, TextAnchor::Middle, rotate)
}

/// Space for text in the reader's font; without Helvetica or Arial this is often DejaVu Sans, which is about an
/// eighth wider.
pub fn text_space(text: &str, size: u32) -> f64 {
    1.14 * text_width(text, size)
}

/// Approximate width of text in Helvetica, on average slightly too large.
pub fn text_width(text: &str, size: u32) -> f64 {
    let of = |sign: char| match sign {
        ' ' | '.' | ',' | ':' | ';' | 'i' | 'j' | 'l' | '|' | '\'' | 'I' => 0.28,
        '-' | '(' | ')' | '[' | ']' | 'f' | 't' | 'r' | '/' => 0.34,
        'm' | 'M' | 'w' | 'W' | '%' | '\u{3c9}' => 0.88,
        'A'..='Z' => 0.7,
        _ => 0.56,
    };
    let of_part = |(level, part): &(Level, String)| level.size() * part.chars().map(of).sum::<f64>();
    f64::from(size) * parts(text).iter().map(of_part).sum::<f64>()
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// True if the figure has an element with these numbers, to the written precision of a hundredth.
    pub fn contains_element(svg: &str, element: &str, numbers: &[(&str, f64)]) -> bool {
        let number = |tag: &str, name: &str| -> Option<f64> {
            let (_, rest) = tag.split_once(&format!(" {name}=\""))?;
            rest.split_once('"')?.0.parse().ok()
        };
        let open = format!("<{element} ");
        let tags = svg.split(&open).skip(1);
        let mut tags = tags.filter_map(|rest| Some(format!(" {}", rest.split_once('>')?.0)));
        tags.any(|tag| {
            let near = |(name, wanted): &(&str, f64)| number(&tag, name).is_some_and(|v| (v - wanted).abs() < 0.006);
            numbers.iter().all(near)
        })
    }

    #[test]
    fn text_width_matches_helvetica() {
        // In Helvetica, the width of a digit is 0.556 of the font size, and the width of a point 0.278.
        assert!((text_width("-0.55", 10) - 22.9).abs() < 0.5);
        assert_eq!(text_width("", 13), 0.0);
    }
}
