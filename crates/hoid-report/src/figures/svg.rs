//! Final processing of a figure to SVG text.

use kuva::{
    prelude::SvgBackend,
    render::render::{Primitive, Scene, TextAnchor},
};

use super::{
    draw,
    labels::{has_tags, insert_tags, strip_markers},
};

/// Returns the SVG text with a view box (so that the figure scales with the page), a title for screen readers, and the
/// id of the figure as the prefix of all other ids.
pub fn finish(id: &str, title: &str, scene: Scene) -> String {
    let scene = anchor_tagged_texts(scene);
    let raw = SvgBackend::new().render_scene(&scene);
    let Some((_, body)) = raw.split_once('>') else {
        return raw;
    };
    let font = scene.font_family.as_deref().map(escape_xml).unwrap_or_default();
    let (width, height) = (scene.width, scene.height);
    let (id, title) = (escape_xml(id), escape_xml(&strip_markers(title)));
    // The generator comment is removed: it contains a version, on which the bytes would depend.
    let body = match body.split_once("-->") {
        Some((stamp, rest)) if stamp.trim_start().starts_with("<!--") => rest,
        _ => body,
    };
    let body = insert_tags(&renumber_ids(body, "kuva-clip-", &format!("{id}-clip-")));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"{font}\" fill=\"black\" role=\"img\" aria-labelledby=\"{id}-title\"><title id=\"{id}-title\">{title}</title>{body}"
    )
}

/// Replaces the ids `from` + number by `to` + number, counted from 1 in the order of occurrence. The library counts ids
/// over the lifetime of the process, so two drawings of the same figure would differ.
fn renumber_ids(text: &str, from: &str, to: &str) -> String {
    let mut known: Vec<&str> = Vec::new();
    let mut parts = text.split(from);
    let mut result = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let digits = part.len() - part.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let (number, rest) = part.split_at(digits);
        let position = known.iter().position(|k| *k == number).unwrap_or_else(|| {
            known.push(number);
            known.len() - 1
        });
        result.push_str(&format!("{to}{}{rest}", position + 1));
    }
    result
}

fn escape_xml(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// Anchors text with tags at its start, because SVG readers do not agree on the position of the tags in centred text.
fn anchor_tagged_texts(mut scene: Scene) -> Scene {
    for element in &mut scene.elements {
        let Primitive::Text {
            x,
            y,
            content,
            size,
            anchor,
            rotate,
            ..
        } = element
        else {
            continue;
        };
        let share = match anchor {
            TextAnchor::Start => 0.0,
            TextAnchor::Middle => 0.5,
            TextAnchor::End => 1.0,
        };
        if share > 0.0 && has_tags(content) {
            let before = share * draw::text_width(content, *size);
            let (sine, cosine) = rotate.unwrap_or(0.0).to_radians().sin_cos();
            *x -= before * cosine;
            *y -= before * sine;
            *anchor = TextAnchor::Start;
        }
    }
    scene
}

#[cfg(test)]
mod tests {
    use super::{
        super::{
            labels::{axis_label, label_markup},
            style::{BLUE, layout, line, stack_panels},
        },
        *,
    };

    #[test]
    fn ids_are_renumbered_from_one() {
        let text = "<a id=\"k-12\"/><b id=\"k-7\"/> url(#k-7) url(#k-12)";
        assert_eq!(
            renumber_ids(text, "k-", "f-"),
            "<a id=\"f-1\"/><b id=\"f-2\"/> url(#f-2) url(#f-1)"
        );
    }

    #[test]
    fn user_text_is_escaped() {
        let plots = vec![line([(0.0, 0.0), (1.0, 1.0)], BLUE, 1.0).into()];
        let layout = layout((0.0, 1.0), (0.0, 1.0), 200.0).with_x_label(axis_label("a<b> & $x^2$", "\"s\""));
        let svg = finish("f<1", "t & t", stack_panels(vec![(plots, layout, 200.0)]));
        assert!(svg.contains("a&lt;b&gt; &amp; $x^2$"), "{svg}");
        assert!(svg.contains("f&lt;1-title") && svg.contains("t &amp; t"));
        assert!(!svg.contains("kuva"));
    }

    #[test]
    fn tagged_text_starts_where_centred_text_would() {
        let mut scene = Scene::new(100.0, 100.0);
        for (content, rotate) in [("m_0", None), ("m_0", Some(-90.0)), ("m", None)] {
            scene.add(draw::text(
                50.0,
                50.0,
                label_markup(content),
                13,
                TextAnchor::Middle,
                rotate,
            ));
        }
        let half = 0.5 * draw::text_width(&label_markup("m_0"), 13);
        let expected = [(50.0 - half, 50.0), (50.0, 50.0 + half), (50.0, 50.0)];
        for (element, (left, top)) in anchor_tagged_texts(scene).elements.iter().zip(expected) {
            let Primitive::Text { x, y, .. } = element else {
                panic!("a text")
            };
            assert!((x - left).abs() < 1e-9 && (y - top).abs() < 1e-9, "{x} {y}");
        }
    }
}
