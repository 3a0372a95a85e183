//! Text of labels: symbols of parameters, subscripts and superscripts.
//!
//! The drawing library has no subscripts. Subscripts and superscripts are marked by characters of the private use area
//! of Unicode, which become tags in the finished SVG ([`insert_tags`]). SVG readers differ: some add the shifts of
//! nested tags, others replace them. Some drop tags without text, trim spaces at the edges of a tag, or position each
//! tag of centred text separately. The tags are therefore not nested; each contains text and the full shift from the
//! previous tag, and leading spaces are non-breaking. `svg` sets the start position of text with tags.

/// Markers in a label for the start and end of a subscript and of a superscript; they become tags.
const SUB: char = '\u{e000}';
const END_SUB: char = '\u{e001}';
const SUPER: char = '\u{e003}';
const END_SUPER: char = '\u{e004}';
const MARKER_CHARS: [char; 4] = [SUB, END_SUB, SUPER, END_SUPER];
const NO_BREAK_SPACE: char = '\u{a0}';

/// Vertical position of a part of a label.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    Line,
    Subscript,
    Superscript,
}

impl Level {
    /// Distance of the part below the baseline, in units of the figure; negative for a superscript.
    fn baseline_offset(self) -> i32 {
        match self {
            Self::Line => 0,
            Self::Subscript => 3,
            Self::Superscript => -4,
        }
    }

    /// Font size of the part relative to that of the line.
    pub fn size(self) -> f64 {
        if self == Self::Line { 1.0 } else { SUBSCRIPT_SIZE_RATIO }
    }
}

/// Font size of subscripts in units of the figure; `SUBSCRIPT_SIZE_RATIO` is the size relative to the line.
const SUBSCRIPT_SIZE: &str = "12.2";
const SUBSCRIPT_SIZE_RATIO: f64 = 12.2 / 13.0;

/// Escapes dollar signs in text, because a dollar sign would start a formula.
fn escape_dollars(text: &str) -> String {
    text.replace('$', "\\$")
}

/// Label of an axis: name and unit.
pub fn axis_label(name: &str, unit: &str) -> String {
    let unit = if unit.is_empty() { "-" } else { unit };
    escape_dollars(&strip_markers(&format!("{name} ({unit})")))
}

/// Label of a panel: name and unit; several names are separated by commas.
pub fn panel_label(name: &str, unit: &str) -> String {
    let names: Vec<String> = name.split(", ").map(symbol).collect();
    let unit = match unit {
        "" => String::new(),
        unit => format!(" ({})", mark_scripts(unit)),
    };
    escape_dollars(&format!("{}{unit}", names.join(", ")))
}

/// Marks the subscripts and superscripts of a label, such as `n_k^*` or `B_r(b_0^{d,0})`. `_` and `^` mark one
/// character, or several in braces; words such as `my_model` and `run_2` are unchanged.
pub fn label_markup(text: &str) -> String {
    escape_dollars(&mark_scripts(text))
}

fn mark_scripts(text: &str) -> String {
    let signs: Vec<char> = strip_markers(text).chars().collect();
    let mut result = String::new();
    let mut at = 0;
    while at < signs.len() {
        let (open, close) = match signs[at] {
            '_' => (SUB, END_SUB),
            '^' => (SUPER, END_SUPER),
            _ => ('\0', '\0'),
        };
        let rest = &signs[at + 1..];
        let in_word = at > 1 && signs[at - 1].is_alphanumeric() && signs[at - 2].is_alphanumeric();
        let length = match rest {
            _ if open == '\0' || at == 0 => 0,
            ['{', inner @ ..] => inner.iter().position(|c| *c == '}').map_or(0, |end| end + 2),
            [_, next, ..] if next.is_alphanumeric() => 0,
            _ if in_word && open == SUB => 0,
            [one, ..] if one.is_alphanumeric() || *one == '*' => 1,
            _ => 0,
        };
        if length == 0 {
            result.push(signs[at]);
        } else {
            result.push(open);
            result.extend(rest[..length].iter().filter(|c| length == 1 || !matches!(c, '{' | '}')));
            result.push(close);
        }
        at += 1 + length;
    }
    result
}

/// The non-empty parts of a label and their vertical positions.
pub fn parts(text: &str) -> Vec<(Level, String)> {
    let mut parts: Vec<(Level, String)> = Vec::new();
    let mut level = Level::Line;
    for sign in text.chars() {
        match (sign, parts.last_mut()) {
            (SUB, _) => level = Level::Subscript,
            (SUPER, _) => level = Level::Superscript,
            (END_SUB | END_SUPER, _) => level = Level::Line,
            (sign, Some((last, part))) if *last == level => part.push(sign),
            (sign, _) => parts.push((level, sign.to_string())),
        }
    }
    parts
}

/// Returns the figure with tags in place of the markers of subscripts and superscripts.
pub fn insert_tags(svg: &str) -> String {
    let mut result = String::with_capacity(svg.len());
    let mut rest = svg;
    while let Some(sign) = rest.find(MARKER_CHARS) {
        let start = rest[..sign].rfind('>').map_or(0, |at| at + 1);
        let end = rest[sign..].find('<').map_or(rest.len(), |at| sign + at);
        result.push_str(&rest[..start]);
        result.push_str(&with_tags(&rest[start..end]));
        rest = &rest[end..];
    }
    result.push_str(rest);
    result
}

fn with_tags(text: &str) -> String {
    let mut result = String::new();
    let mut above = Level::Line;
    for (level, part) in parts(text) {
        if level == above {
            result.push_str(&part);
            continue;
        }
        let step = level.baseline_offset() - above.baseline_offset();
        let size = match level {
            Level::Line => String::new(),
            _ => format!(" font-size=\"{SUBSCRIPT_SIZE}\""),
        };
        let part = match part.strip_prefix(' ') {
            Some(after) => format!("{NO_BREAK_SPACE}{after}"),
            None => part,
        };
        result.push_str(&format!("<tspan dy=\"{step}\"{size}>{part}</tspan>"));
        above = level;
    }
    result
}

/// True if the text has subscripts or superscripts.
pub fn has_tags(text: &str) -> bool {
    text.contains(MARKER_CHARS)
}

/// Removes the private characters that mark subscripts and superscripts.
pub fn strip_markers(text: &str) -> String {
    text.replace(MARKER_CHARS, "")
}

/// Symbol of a parameter with its subscript; other text is unchanged.
fn symbol(name: &str) -> String {
    let (letter, sub) = match name {
        "K_e" => ("K", "e"),
        "T_L" => ("T", "L"),
        "K_e_dot" => ("K", "\u{117}"),
        "omega_nm" => ("\u{3c9}", "nm"),
        "zeta_nm" => ("\u{3b6}", "nm"),
        "tau_e" => ("\u{3c4}", "e"),
        "K_f" => ("K", "f"),
        "K_f_dot" => ("K", "\u{1e1f}"),
        "tau_f" => ("\u{3c4}", "f"),
        other => match other.char_indices().nth(1).map(|(at, _)| other.split_at(at)) {
            Some((letter, digits)) if digits.bytes().all(|b| b.is_ascii_digit()) => (letter, digits),
            _ => return mark_scripts(other),
        },
    };
    format!("{letter}{SUB}{sub}{END_SUB}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subscripts_and_superscripts_are_marked() {
        let shown = |text: &str| insert_tags(&label_markup(text));
        assert_eq!(
            shown("n_k^*"),
            "n<tspan dy=\"3\" font-size=\"12.2\">k</tspan><tspan dy=\"-7\" font-size=\"12.2\">*</tspan>"
        );
        assert_eq!(
            shown("m^0 = 1"),
            "m<tspan dy=\"-4\" font-size=\"12.2\">0</tspan><tspan dy=\"4\">\u{a0}= 1</tspan>"
        );
        assert_eq!(shown("b_{nm}"), "b<tspan dy=\"3\" font-size=\"12.2\">nm</tspan>");
        for plain in ["my_model", "run_2", "_", "a_", "^2", "a_{b", "x_ y", ""] {
            assert_eq!(shown(plain), plain);
        }
        let of_line: String = parts(&label_markup("P_n = 0.1"))
            .into_iter()
            .map(|part| part.1)
            .collect();
        assert_eq!(of_line, "Pn = 0.1");
    }

    #[test]
    fn only_text_elements_are_tagged() {
        let figure = format!("<text x=\"1\">{}</text><line/><text>b</text>", label_markup("K_e (s)"));
        assert_eq!(
            insert_tags(&figure),
            "<text x=\"1\">K<tspan dy=\"3\" font-size=\"12.2\">e</tspan><tspan dy=\"-3\">\u{a0}(s)</tspan></text><line/><text>b</text>"
        );
    }
}
