//! Conversion of text from other programs to text that the table reader accepts: UTF-16 and Latin 1, lines above the
//! header, a line of units below the header, columns separated by blanks.
//!
//! The conversion keeps the order of the lines, so that messages still refer to lines of the file.

use super::text::{is_aside, is_unit, separator};
use crate::table::{Cell, with_decimal_point};

/// Number of lines at the start of a file in which the header and the line of units are searched for.
const LINES: usize = 60;

/// Latin 1 letters and signs that occur in units and column names; other non-ASCII bytes count as damage.
const LATIN: &[u8] = b"\xb0\xb2\xb3\xb5\xc4\xc9\xd6\xdc\xdf\xe0\xe4\xe7\xe8\xe9\xea\xf1\xf6\xfc";

/// Rewrites the bytes of a table as plain CSV; returns a description of each change.
pub(super) fn made_plain(bytes: &mut Vec<u8>) -> Vec<String> {
    let mut notes = Vec::new();
    if let Some(text) = utf16(bytes) {
        *bytes = text.into_bytes();
        notes.push(String::from("the text is in UTF-16"));
    } else if std::str::from_utf8(bytes).is_err() && is_latin(bytes) {
        *bytes = bytes
            .iter()
            .map(|byte| char::from(*byte))
            .collect::<String>()
            .into_bytes();
        notes.push(String::from("the text is taken as Latin 1"));
    }
    let Ok(text) = std::str::from_utf8(bytes) else {
        return notes;
    };
    let above = units_above(text);
    if above.is_some() {
        notes.push(String::from("the line below the header is taken as the units"));
    }
    let text = above.as_deref().unwrap_or(text);
    if let Some(tabs) = between_tabs(text) {
        *bytes = tabs.into_bytes();
        notes.push(String::from("the columns are separated by blanks"));
    } else if let Some((lines, without)) = without_preamble(text) {
        *bytes = without.into_bytes();
        notes.push(format!("lines above the header are left out: {lines}"));
    } else if let Some(above) = above {
        *bytes = above.into_bytes();
    }
    notes
}

/// Decodes UTF-16 text, which is recognised by its byte order mark; `None` for other text.
fn utf16(bytes: &[u8]) -> Option<String> {
    let (unit, rest): (fn([u8; 2]) -> u16, _) = match bytes {
        [0xff, 0xfe, rest @ ..] => (u16::from_le_bytes, rest),
        [0xfe, 0xff, rest @ ..] => (u16::from_be_bytes, rest),
        _ => return None,
    };
    let (pairs, []) = rest.as_chunks() else { return None };
    let units: Vec<u16> = pairs.iter().map(|pair| unit(*pair)).collect();
    String::from_utf16(&units).ok()
}

/// True if each non-ASCII byte may occur in a name or a unit.
fn is_latin(bytes: &[u8]) -> bool {
    bytes.iter().all(|byte| byte.is_ascii() || LATIN.contains(byte))
}

fn is_number(cell: &str) -> bool {
    matches!(
        Cell::parse(&with_decimal_point(cell.trim().trim_matches('"'), true)),
        Cell::Number(_)
    )
}

/// Replaces blanks by tabs in a table separated by blanks; `None` unless the header has as many words as each line
/// below it has numbers. A percent sign before the header, the comment sign of MATLAB, is left out.
fn between_tabs(text: &str) -> Option<String> {
    let mut lines = text.lines().filter(|line| !is_aside(line));
    let marked = lines.next()?;
    let header = marked.trim_start().trim_start_matches('%');
    let count = header.split_whitespace().count();
    let is_row = |line: &str| line.split_whitespace().count() == count;
    let numbers = |line: &str| {
        line.split_whitespace()
            .all(|word| matches!(Cell::parse(word), Cell::Number(_) | Cell::Missing))
    };
    if count < 2 || header.contains([',', ';', '\t', '"']) || header.split_whitespace().any(is_number) {
        return None;
    }
    let mut rows = lines.peekable();
    (rows.peek().is_some() && rows.all(|line| is_row(line) && numbers(line))).then(|| {
        let line = |line: &str| match is_aside(line) {
            true => line.to_owned(),
            false if std::ptr::eq(line, marked) => header.split_whitespace().collect::<Vec<_>>().join("\t"),
            false => line.split_whitespace().collect::<Vec<_>>().join("\t"),
        };
        text.lines().map(|text| line(text) + "\n").collect()
    })
}

/// Known units. A line of units must contain at least one of them; its other entries may be any short words.
const UNITS: [&str; 24] = [
    "s", "sec", "ms", "us", "µs", "min", "deg", "°", "rad", "mrad", "deg/s", "rad/s", "m", "mm", "cm", "ft", "m/s",
    "v", "mv", "ma", "n", "nm", "%", "hz",
];

/// Returns the unit in a cell below the header, without brackets; `None` if the cell contains no unit.
fn unit(cell: &str) -> Option<&str> {
    let cell = unquoted(cell);
    let inside = [('[', ']'), ('(', ')')]
        .into_iter()
        .find_map(|(open, close)| cell.strip_prefix(open)?.strip_suffix(close));
    let unit = inside.unwrap_or(cell).trim();
    // A unit cannot contain a comma, because commas separate the units in the comment.
    let names_one = unit.is_empty() || is_unit(unit) && !unit.contains(',') && !is_number(unit);
    names_one.then_some(unit)
}

fn unquoted(cell: &str) -> &str {
    cell.trim().trim_matches('"').trim()
}

/// Moves a line of units between the header and the first numbers into a comment `# units: t s, e deg` above the
/// header; `None` if there is no such line.
fn units_above(text: &str) -> Option<String> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines = text.lines().take(LINES).enumerate();
    let filled: Vec<(usize, &str)> = lines.filter(|(_, line)| !is_aside(line)).collect();
    let found = filled.windows(3).find_map(|lines| {
        let [(at, header), (below, line), (_, row)] = lines else {
            return None;
        };
        let mark = Some(char::from(separator(header))).filter(|mark| header.contains(*mark));
        let [names, units, numbers] = [header, line, row].map(|line| cells(line, mark));
        let units: Vec<&str> = units.into_iter().map(unit).collect::<Option<_>>()?;
        let is_known = |unit: &&str| UNITS.contains(&unit.to_lowercase().as_str());
        if units.len() != names.len() || !is_header(&names, &numbers) || !units.iter().any(is_known) {
            return None;
        }
        let named = names.iter().zip(units).filter(|(_, unit)| !matches!(*unit, "" | "-"));
        let named: Vec<String> = named.map(|(name, unit)| format!("{} {unit}", unquoted(name))).collect();
        Some((*at, *below, format!("# units: {}", named.join(", "))))
    });
    let (at, below, units) = found?;
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    let header = lines.get(at)?;
    let end = if header.ends_with("\r\n") { "\r\n" } else { "\n" };
    let placed = |(number, line): (usize, &&str)| match number {
        n if n == at => format!("{units}{end}"),
        n if n == below => (*header).to_owned(),
        _ => (*line).to_owned(),
    };
    Some(lines.iter().enumerate().map(placed).collect())
}

/// Splits a line into cells at a separator, or at blanks if there is none.
fn cells(line: &str, mark: Option<char>) -> Vec<&str> {
    match mark {
        Some(mark) => line.split(mark).collect(),
        None => line.split_whitespace().collect(),
    }
}

/// True if `names` can be the header of `row`: `row` has as many cells as `names`, more than half of these cells are
/// numbers, and no name is a number.
fn is_header(names: &[&str], row: &[&str]) -> bool {
    let numbers = row.iter().filter(|cell| is_number(cell)).count();
    names.len() > 1
        && names.len() == row.len()
        && numbers > names.len() / 2
        && !names.iter().any(|name| is_number(name))
}

/// Marks the lines above the header as comments and returns their number. The header is the first line of words
/// directly above a line with the same number of cells, most of them numbers.
fn without_preamble(text: &str) -> Option<(usize, String)> {
    let lines = text.lines().take(LINES).enumerate();
    let filled: Vec<(usize, &str)> = lines.filter(|(_, line)| !is_aside(line)).collect();
    let over_a_row = |pair: &[(usize, &str)]| {
        let [(_, header), (_, row)] = pair else { return false };
        let mark = Some(char::from(separator(header)));
        is_header(&cells(header, mark), &cells(row, mark))
    };
    let header = filled.windows(2).position(over_a_row)?;
    let (above, [(_, header), ..]) = filled.split_at_checked(header)? else {
        return None;
    };
    let mark = Some(char::from(separator(header)));
    let count = |line: &str| cells(line, mark).len();
    // A line above with the same number of cells is the header, and the line found is its line of units.
    if above.is_empty() || above.iter().any(|(_, line)| count(line) == count(header)) {
        return None;
    }
    // Line ends are kept.
    let marked = |(at, line): (usize, &str)| {
        if above.iter().any(|(above, _)| *above == at) {
            format!("#{line}")
        } else {
            line.to_owned()
        }
    };
    let text: String = text.split_inclusive('\n').enumerate().map(marked).collect();
    Some((above.len(), text))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(bytes: &[u8]) -> (String, usize) {
        let mut bytes = bytes.to_vec();
        let notes = made_plain(&mut bytes);
        (String::from_utf8_lossy(&bytes).into_owned(), notes.len())
    }

    #[test]
    fn encodings() {
        let text = "t\te\n0\t1\n";
        for (mark, order) in [
            (0xfeff_u16, u16::to_le_bytes as fn(u16) -> [u8; 2]),
            (0xfeff, u16::to_be_bytes),
        ] {
            let bytes: Vec<u8> = std::iter::once(mark)
                .chain(text.encode_utf16())
                .flat_map(order)
                .collect();
            assert_eq!(plain(&bytes), (text.to_owned(), 1));
        }
        assert_eq!(plain(b"t,e [\xb0]\n0,1\n"), (String::from("t,e [°]\n0,1\n"), 1));
        // Damaged text is not converted: half a UTF-16 code unit, or bytes that are not Latin 1 letters.
        for bytes in [&b"\xff\xfet\0e"[..], b"t,e\n0,\xff1\n", b"t,e\n0,\x801\n"] {
            assert_eq!(plain(bytes).1, 0);
        }
    }

    #[test]
    fn lines_above_the_header_and_blanks() {
        let text = "Name;Session 4\nDate;05.03.2024\n\nRate;50 Hz\nt;e;u\n0,00;1;2\n";
        let (found, notes) = plain(text.as_bytes());
        assert_eq!(
            found,
            "#Name;Session 4\n#Date;05.03.2024\n\n#Rate;50 Hz\nt;e;u\n0,00;1;2\n"
        );
        assert_eq!(notes, 1);
        assert_eq!(
            plain(b"  t   e\n 0.0  1\n 0.1 -2\n"),
            (String::from("t\te\n0.0\t1\n0.1\t-2\n"), 1)
        );
        assert_eq!(
            plain(b"% t e\n0.0 1\n0.1 -2\n"),
            (String::from("t\te\n0.0\t1\n0.1\t-2\n"), 1)
        );
        for same in [
            "t,e,u\n0,1,2\n",
            "t,e,u\nstart,here,now\n0,1,2\n",
            "t,e,u\ns,deg\n0,1,2\n",
            "t,e,u\ns,deg,deg\na,b,c\n",
            "t e u\n0 1\n",
            "",
            "1,2\n3,4\n",
            "a\nb\n",
        ] {
            assert_eq!(plain(same.as_bytes()), (same.to_owned(), 0), "{same:?}");
        }
    }

    #[test]
    fn units_below_the_header() {
        let with_units = "# units: t s, e deg, u V\nt,e,u\n0,1,2\n";
        for text in ["t,e,u\ns,deg,V\n0,1,2\n", "\u{feff}t,e,u\n[s],(deg),\"V\"\n0,1,2\n"] {
            assert_eq!(plain(text.as_bytes()), (with_units.to_owned(), 1));
        }
        let text = b"Session 4\n\"t\";e;u\r\ns;;-\r\n0,0;1;2\r\n";
        let found = "#Session 4\n# units: t s\r\n\"t\";e;u\r\n0,0;1;2\r\n";
        assert_eq!(plain(text), (found.to_owned(), 2));
        let found = "# units: t s, e deg\nt\te\n0\t1\n0.1\t2\n";
        assert_eq!(plain(b"t e\ns deg\n0 1\n0.1 2\n"), (found.to_owned(), 2));
    }
}
