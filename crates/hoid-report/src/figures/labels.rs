//! Text of labels: names of parameters as symbols, subscripts and superscripts.
//!
//! The library that draws knows no subscripts. They are marked by characters of the private use
//! area of Unicode, which become tags in the finished SVG ([`tagged`]).

/// Stand in the text of labels for the begin and end of a subscript and of a superscript, and the
/// end of the label; they become tags.
const SUB: char = '\u{e000}';
const BACK: char = '\u{e001}';
const END: char = '\u{e002}';
const SUPER: char = '\u{e003}';
const DOWN: char = '\u{e004}';
const SIGNS: [char; 5] = [SUB, BACK, END, SUPER, DOWN];

/// Text of the user: a dollar sign would open a formula.
fn literal(text: &str) -> String {
    text.replace('$', "\\$")
}

/// Name and unit of an axis.
pub fn axis_label(name: &str, unit: &str) -> String {
    let unit = if unit.is_empty() { "-" } else { unit };
    literal(&plain(&format!("{name} ({unit})")))
}

/// Name and unit of a panel; several names are separated by commas. [`tagged`] completes it in the
/// finished figure.
pub fn panel_label(name: &str, unit: &str) -> String {
    let names: Vec<String> = name.split(", ").map(symbol).collect();
    let unit = match unit {
        "" => String::new(),
        unit => format!(" ({})", marks(unit)),
    };
    literal(&closed(&format!("{}{unit}", names.join(", "))))
}

/// Text of a label with its subscripts and superscripts: `n_k^*`, `B_r(b_0^{d,0})`. After `_` or
/// `^` stands one sign or several in braces; words such as `my_model` and `run_2` stay as they are.
/// [`tagged`] completes it in the finished figure.
pub fn marked(text: &str) -> String {
    literal(&closed(&marks(text)))
}

/// What follows a subscript stands in a tag of its own, which ends with the label.
fn closed(text: &str) -> String {
    let ends = END.to_string().repeat(text.matches([BACK, DOWN]).count());
    format!("{text}{ends}")
}

fn marks(text: &str) -> String {
    let signs: Vec<char> = plain(text).chars().collect();
    let mut result = String::new();
    let mut at = 0;
    while at < signs.len() {
        let (open, close) = match signs[at] {
            '_' => (SUB, BACK),
            '^' => (SUPER, DOWN),
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

/// The signs of a label that are printed.
pub fn printed(text: &str) -> impl Iterator<Item = char> {
    text.chars().filter(|c| !SIGNS.contains(c))
}

/// A figure with the tags of its subscripts.
pub fn tagged(svg: &str) -> String {
    svg.replace(&format!("{BACK} "), "</tspan><tspan dy=\"-3\" dx=\"4\">")
        .replace(&format!("{DOWN} "), "</tspan><tspan dy=\"4\" dx=\"4\">")
        .replace(SUB, "<tspan dy=\"3\" font-size=\"10\">")
        .replace(BACK, "</tspan><tspan dy=\"-3\">")
        .replace(SUPER, "<tspan dy=\"-4\" font-size=\"10\">")
        .replace(DOWN, "</tspan><tspan dy=\"4\">")
        .replace(END, "</tspan>")
}

/// Text without the characters that become tags.
pub fn plain(text: &str) -> String {
    text.replace(SIGNS, "")
}

/// A parameter with its subscript; other text as it is.
fn symbol(name: &str) -> String {
    let (letter, sub) = match name {
        "K_e" => ("K", "e"),
        "T_L" => ("T", "L"),
        "K_e_dot" => ("K", "\u{117}"),
        "omega_nm" => ("\u{3c9}", "nm"),
        "zeta_nm" => ("\u{3b6}", "nm"),
        "tau_e" => ("\u{3c4}", "e"),
        other => match other.char_indices().nth(1).map(|(at, _)| other.split_at(at)) {
            Some((letter, digits)) if digits.bytes().all(|b| b.is_ascii_digit()) => (letter, digits),
            _ => return marks(other),
        },
    };
    format!("{letter}{SUB}{sub}{BACK}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subscripts_and_superscripts_are_found() {
        let shown = |text: &str| tagged(&marked(text));
        let (sub, sup) = (
            "<tspan dy=\"3\" font-size=\"10\">",
            "<tspan dy=\"-4\" font-size=\"10\">",
        );
        assert_eq!(
            shown("n_k^*"),
            format!("n{sub}k</tspan><tspan dy=\"-3\">{sup}*</tspan><tspan dy=\"4\"></tspan></tspan>")
        );
        assert_eq!(
            shown("m^0 = 1"),
            format!("m{sup}0</tspan><tspan dy=\"4\" dx=\"4\">= 1</tspan>")
        );
        assert_eq!(shown("b_{nm}"), format!("b{sub}nm</tspan><tspan dy=\"-3\"></tspan>"));
        for plain in ["my_model", "run_2", "_", "a_", "^2", "a_{b", "x_ y", ""] {
            assert_eq!(shown(plain), plain);
        }
        assert_eq!(printed(&marked("P_n = 0.1")).collect::<String>(), "Pn = 0.1");
    }
}
