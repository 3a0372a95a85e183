//! Settings: nested brackets, excessive numbers of keys, tables and values, up to and beyond the longest text that is
//! read.

use crate::mutations::draw::Draw;

/// Makes a bomb of a scenario.
pub fn toml(draw: &mut Draw) -> Vec<u8> {
    let bytes = random_length(draw);
    let times = |text: &str| text.repeat(bytes / text.len());
    let numbered = |each: &dyn Fn(usize) -> String| (0..bytes / 12).map(each).collect::<String>();
    match draw.below(12) {
        0 => format!("x = {}1{}", "[".repeat(bytes / 2), "]".repeat(bytes / 2)),
        1 => format!("x = {}", times("{a = ")),
        2 => format!("[{}a]", times("a.")),
        3 => format!("{}a = 1", times("a.")),
        4 => format!("x = [{}]", times("1,")),
        5 => format!("x = [{}]", times("[],")),
        6 => format!("x = [{}]", times("{},")),
        7 => times("[[x]]\n"),
        8 => numbered(&|k| format!("k{k} = 1\n")),
        9 => numbered(&|k| format!("[k{k}]\n")),
        10 => format!("x = \"{}\"", times("\\u00e4")),
        _ => format!("x = {}", times("9")),
    }
    .into_bytes()
}

/// Makes a bomb of a fit.
pub fn json(draw: &mut Draw) -> Vec<u8> {
    let bytes = random_length(draw);
    let times = |text: &str| text.repeat(bytes / text.len());
    match draw.below(8) {
        0 => times("["),
        1 => times("{\"a\":"),
        2 => format!("{{\"structure\": [{}1]}}", times("1,")),
        3 => format!("{{\"structure\": [{}1]}}", times("[],")),
        4 => format!("{{\"x\": [{}1]}}", times("{},")),
        5 => {
            let keys: String = (0..bytes / 14).map(|k| format!("\"k{k}\": 1,\n")).collect();
            format!("{{{keys}\"a\": 1}}")
        }
        6 => format!("{{\"structure\": \"{}\"}}", times("\\u00e4")),
        _ => format!("{{\"structure\": {}}}", times("9")),
    }
    .into_bytes()
}

/// Draws a length from one kilobyte to sixteen megabytes.
fn random_length(draw: &mut Draw) -> usize {
    1 << (10 + draw.below(15))
}
