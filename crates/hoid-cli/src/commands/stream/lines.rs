//! Parsing of the lines of a stream, which may come from untrusted sources. For a line that cannot be parsed, the
//! reason is returned; only a header that lacks a column ends a stream.

use std::io::{self, BufRead, ErrorKind};

use hoid::io::{find_control_column, find_error_column};
use serde::de::IgnoredAny;
use serde_json::{Map, Value};

use crate::error::CliError;

/// Maximum length of a line in bytes. The rest of a longer line is skipped, so the use of memory is bounded.
const MAX_LINE_BYTES: usize = 1 << 16;
/// Maximum number of characters of an invalid cell shown in messages.
const MAX_CELL_CHARS: usize = 24;

/// Reader of lines of bounded length.
pub struct Lines<R> {
    input: R,
    bytes: Vec<u8>,
}

impl<R: BufRead> Lines<R> {
    pub fn new(input: R) -> Self {
        Self {
            input,
            bytes: Vec::new(),
        }
    }

    /// Returns the next line without its line feed: an inner `Err` if the line is too long, `None` at the end of the
    /// input.
    pub fn next(&mut self) -> io::Result<Option<Result<String, String>>> {
        self.bytes.clear();
        let mut length = 0;
        loop {
            let chunk = match self.input.fill_buf() {
                Ok(chunk) => chunk,
                Err(e) if e.kind() == ErrorKind::Interrupted => continue,
                Err(e) => return Err(e),
            };
            if chunk.is_empty() && length == 0 {
                return Ok(None);
            }
            let end = chunk.iter().position(|b| *b == b'\n');
            let part = &chunk[..end.unwrap_or(chunk.len())];
            let room = MAX_LINE_BYTES - self.bytes.len();
            self.bytes.extend_from_slice(&part[..part.len().min(room)]);
            let used = end.map_or(chunk.len(), |e| e + 1);
            let ended = end.is_some() || chunk.is_empty();
            length += used;
            self.input.consume(used);
            if ended {
                break;
            }
        }
        Ok(Some(if self.bytes.len() < MAX_LINE_BYTES {
            Ok(String::from_utf8_lossy(&self.bytes).into_owned())
        } else {
            Err(format!("the line is longer than {MAX_LINE_BYTES} bytes"))
        }))
    }
}

/// Result of parsing a line.
#[derive(Debug, Clone, PartialEq)]
pub enum ParsedLine {
    /// A blank line, a comment or a header.
    Nothing,
    /// A sample.
    Sample(StreamSample),
    /// A line that is not a sample, with the reason.
    Unreadable(String),
}

/// A sample as read; an invalid value is NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct StreamSample {
    /// Time in s; `None` without a column t.
    pub t: Option<f64>,
    pub e: f64,
    pub u: f64,
    /// External signal, if there is a column f_t with a number.
    pub reference: Option<f64>,
    /// Problem with the value of e or u; `None` if both values are valid.
    pub fault: Option<String>,
}

/// Positions of the columns in a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ColumnPositions {
    count: usize,
    t: Option<usize>,
    e: Option<usize>,
    u: usize,
    reference: Option<usize>,
}

/// The columns of a stream, known from the header or from the number of cells in the first line of numbers.
pub struct Columns {
    input: String,
    output: String,
    with_input: bool,
    largest: f64,
    positions: Option<ColumnPositions>,
}

impl Columns {
    pub fn new(input: &str, output: &str, with_input: bool, largest: f64) -> Self {
        Self {
            input: input.to_owned(),
            output: output.to_owned(),
            with_input,
            largest,
            positions: None,
        }
    }

    /// True if the samples have a column t.
    pub fn has_time(&self) -> bool {
        self.positions.is_some_and(|p| p.t.is_some())
    }

    /// True once a header or a line of numbers has given the columns.
    pub fn are_known(&self) -> bool {
        self.positions.is_some()
    }

    /// Parses a line.
    ///
    /// # Errors
    /// [`CliError::Stream`] if a header lacks a column.
    pub fn parse_line(&mut self, line: &str) -> Result<ParsedLine, CliError> {
        let line = line.trim_matches(['\r', ' ', '\u{feff}']);
        if line.trim().is_empty() && !line.contains('\t') || line.starts_with('#') {
            return Ok(ParsedLine::Nothing);
        }
        if line.starts_with('{') {
            return Ok(self.parse_object(line));
        }
        let separator = ['\t', ';', ','].into_iter().find(|s| line.contains(*s)).unwrap_or(',');
        let cells: Vec<&str> = line.split(separator).map(|c| c.trim().trim_matches('"')).collect();
        let places = match self.positions {
            Some(places) => places,
            None => {
                if is_header(&cells) {
                    self.positions = Some(self.positions_from_header(&cells)?);
                    return Ok(ParsedLine::Nothing);
                }
                match self.positions_from_count(&cells) {
                    Some(places) => *self.positions.insert(places),
                    None => return Ok(ParsedLine::Unreadable(format!("no numbers: {}", quote(line)))),
                }
            }
        };
        if cells.len() != places.count {
            return Ok(ParsedLine::Unreadable(format!(
                "{} cells, expected {}: {}",
                cells.len(),
                places.count,
                quote(line)
            )));
        }
        let of = |index: Option<usize>| index.map(|i| parse_number(cells[i]));
        Ok(self.new_sample(
            of(places.t),
            of(places.e),
            parse_number(cells[places.u]),
            of(places.reference),
        ))
    }

    /// Parses a JSON object with the names of the channels: `{"t": 0.01, "e": 0.5, "u": -1.0}`.
    fn parse_object(&self, line: &str) -> ParsedLine {
        let object: Map<String, Value> = match serde_json::from_str(line) {
            Ok(object) => object,
            Err(error) => return ParsedLine::Unreadable(format!("not a JSON object ({error}): {}", quote(line))),
        };
        let of = |name: &str| object.get(name).map(json_number);
        let e = of(&self.input).filter(|_| self.with_input);
        match of(&self.output) {
            Some(u) if e.is_some() || !self.with_input => self.new_sample(of("t"), e, u, of("f_t")),
            _ => ParsedLine::Unreadable(format!(
                "the JSON object does not have both {}: {}",
                self.required_channels(),
                quote(line)
            )),
        }
    }

    /// Creates a sample from its numbers; missing numbers are `None`.
    fn new_sample(
        &self,
        t: Option<Result<f64, Fault>>,
        e: Option<Result<f64, Fault>>,
        u: Result<f64, Fault>,
        reference: Option<Result<f64, Fault>>,
    ) -> ParsedLine {
        let t = match t {
            None => None,
            Some(Ok(t)) if t.is_finite() => Some(t),
            Some(Ok(t)) => return ParsedLine::Unreadable(format!("t is {t}")),
            Some(Err(what)) => return ParsedLine::Unreadable(format!("t is {what}")),
        };
        let mut faults = Vec::new();
        let mut value = |name: &str, number: Result<f64, Fault>| match number {
            Ok(v) if v.abs() <= self.largest => v,
            Ok(v) if v.is_finite() => {
                faults.push(format!("{name} is {v:e}, beyond {}", self.largest));
                f64::NAN
            }
            Ok(v) => {
                faults.push(format!("{name} is {v}"));
                f64::NAN
            }
            Err(what) => {
                faults.push(format!("{name} is {what}"));
                f64::NAN
            }
        };
        let e = e.map_or(0.0, |e| value(&self.input, e));
        let u = value(&self.output, u);
        ParsedLine::Sample(StreamSample {
            t,
            e,
            u,
            reference: reference.and_then(Result::ok).filter(|r| r.abs() <= self.largest),
            fault: (!faults.is_empty()).then(|| faults.join("; ")),
        })
    }

    /// Returns the names of the required channels.
    fn required_channels(&self) -> String {
        let input = if self.with_input {
            format!("{} and ", self.input)
        } else {
            String::new()
        };
        format!("{input}{}", self.output)
    }

    fn positions_from_header(&self, cells: &[&str]) -> Result<ColumnPositions, CliError> {
        let index = |name: &str| cells.iter().position(|c| *c == name);
        let e = index(&self.input);
        match (e, index(&self.output)) {
            (e, Some(u)) if e.is_some() || !self.with_input => Ok(ColumnPositions {
                count: cells.len(),
                t: index("t"),
                e: e.filter(|_| self.with_input),
                u,
                reference: index("f_t"),
            }),
            (e, u) => Err(CliError::Stream(format!(
                "the header has the columns {}, expected {}; choose with --input and --output{}",
                cells.join(", "),
                self.required_channels(),
                self.hint(cells, (e.is_none(), u.is_none()))
            ))),
        }
    }

    /// Returns a hint such as ", as --input err --output stick" if the missing columns exist under other names.
    fn hint(&self, cells: &[&str], (no_input, no_output): (bool, bool)) -> String {
        let input = find_error_column(cells).filter(|_| no_input && self.with_input);
        let output = find_control_column(cells).filter(|_| no_output);
        let named = [("--input", input), ("--output", output)];
        let words: Vec<String> = named
            .into_iter()
            .filter_map(|(option, name)| Some(format!("{option} \"{}\"", name?)))
            .collect();
        if words.is_empty() {
            String::new()
        } else {
            format!(", as {}", words.join(" "))
        }
    }

    /// Returns the positions of the columns of a stream without a header, from the number of cells in a line of
    /// numbers: `e,u`, `t,e,u` or `t,e,u,f_t`; for a model without input `u` or `t,u`. `None` for any other line.
    fn positions_from_count(&self, cells: &[&str]) -> Option<ColumnPositions> {
        let readable = |c: &str| matches!(parse_number(c), Ok(_) | Err(Fault::Missing));
        let any = cells.iter().any(|c| parse_number(c).is_ok_and(f64::is_finite));
        if !any || !cells.iter().all(|c| readable(c)) {
            return None;
        }
        let places = |t, e, u, reference| ColumnPositions {
            count: cells.len(),
            t,
            e,
            u,
            reference,
        };
        match (self.with_input, cells.len()) {
            (true, 2) => Some(places(None, Some(0), 1, None)),
            (true, 3) => Some(places(Some(0), Some(1), 2, None)),
            (true, 4) => Some(places(Some(0), Some(1), 2, Some(3))),
            (false, 1) => Some(places(None, None, 0, None)),
            (false, 2) => Some(places(Some(0), None, 1, None)),
            _ => None,
        }
    }
}

/// Reason why a cell is not a number.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Fault {
    Missing,
    Text(String),
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Missing => f.write_str("missing"),
            Self::Text(text) => write!(f, "{text}, not a number"),
        }
    }
}

fn parse_number(cell: &str) -> Result<f64, Fault> {
    match cell.parse::<f64>() {
        Ok(value) => Ok(value),
        Err(_)
            if ["", "na", "n/a", "null"]
                .iter()
                .any(|word| cell.eq_ignore_ascii_case(word)) =>
        {
            Err(Fault::Missing)
        }
        Err(_) => Err(Fault::Text(quote(cell))),
    }
}

/// Returns the number in a JSON value.
fn json_number(value: &Value) -> Result<f64, Fault> {
    match value {
        Value::Null => Err(Fault::Missing),
        Value::String(text) => parse_number(text),
        other => other.as_f64().ok_or_else(|| Fault::Text(quote(&other.to_string()))),
    }
}

/// True if the text is a single JSON object, possibly over several lines.
pub fn is_object(text: &str) -> bool {
    text.trim_start().starts_with('{') && serde_json::from_str::<IgnoredAny>(text).is_ok()
}

/// Returns the text in quotation marks, shortened to a readable length.
fn quote(text: &str) -> String {
    let cut: String = text.chars().take(MAX_CELL_CHARS).collect();
    let rest = if text.chars().count() > MAX_CELL_CHARS {
        "..."
    } else {
        ""
    };
    format!("\"{}{rest}\"", cut.escape_debug())
}

/// True if all cells are names and there are at least two cells, or if the only cell is `u`.
fn is_header(cells: &[&str]) -> bool {
    let is_name = |c: &&str| {
        let first = c.chars().next();
        first.is_some_and(|f| f.is_alphabetic() || f == '_') && parse_number(c).is_err_and(|f| f != Fault::Missing)
    };
    cells.len() > 1 && cells.iter().all(is_name) || cells == ["u"]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse_sample(columns: &mut Columns, line: &str) -> StreamSample {
        match columns.parse_line(line).unwrap() {
            ParsedLine::Sample(read) => read,
            other => panic!("{line}: {other:?}"),
        }
    }

    fn default_columns() -> Columns {
        Columns::new("e", "u", true, 1e6)
    }

    #[test]
    fn json_objects_are_read_by_channel_name() {
        let read = parse_sample(
            &mut default_columns(),
            r#"{"t": 2, "e": 0.5, "u": -1e0, "f_t": 7, "button": [1]}"#,
        );
        assert_eq!(
            (read.t, read.e, read.u, read.reference),
            (Some(2.0), 0.5, -1.0, Some(7.0))
        );
        assert!(read.fault.is_none());
        // Cells and JSON objects may follow each other in any order.
        let mut columns = Columns::new("error", "stick", true, 10.0);
        let read = parse_sample(&mut columns, r#"{"stick": "3", "error": null}"#);
        assert!(read.t.is_none() && read.e.is_nan() && read.u == 3.0 && !columns.are_known());
        assert_eq!(read.fault.unwrap(), "error is missing");
        assert_eq!(parse_sample(&mut columns, "1,2").u, 2.0);
        let fault = parse_sample(&mut columns, r#"{"stick": 11, "error": {}}"#)
            .fault
            .unwrap();
        assert_eq!(fault, "error is \"{}\", not a number; stick is 1.1e1, beyond 10");
        let mut alone = Columns::new("e", "u", false, 1e6);
        assert_eq!(parse_sample(&mut alone, r#"{"e": 4, "u": 1}"#).e, 0.0);
        for (line, reason) in [
            ("{", "not a JSON object"),
            ("{\"t\": 1}", "does not have both e and u"),
            ("{\"u\": 1}", "does not have both e and u"),
            ("{\"t\": null, \"e\": 1, \"u\": 1}", "t is missing"),
            ("{\"e\": 1e999, \"u\": 1}", "not a JSON object"),
        ] {
            match default_columns().parse_line(line).unwrap() {
                ParsedLine::Unreadable(fault) => assert!(fault.contains(reason), "{line}: {fault}"),
                other => panic!("{line}: {other:?}"),
            }
        }
        assert!(is_object(" {\n\"e\": 1\n}\n") && !is_object("{}\n{}") && !is_object("1"));
    }

    #[test]
    fn columns_are_read_by_position_or_header() {
        for (line, t, reference) in [
            ("0.5,-1", None, None),
            ("2 ; 0.5; -1", Some(2.0), None),
            ("2\t.5\t-1e0\t7\r", Some(2.0), Some(7.0)),
        ] {
            let read = parse_sample(&mut default_columns(), line);
            assert_eq!((read.t, read.e, read.u, read.reference), (t, 0.5, -1.0, reference));
            assert!(read.fault.is_none());
        }
        let mut columns = default_columns();
        for nothing in ["", "  ", "# a comment", "t,f_t,\"e\",u,x"] {
            assert_eq!(columns.parse_line(nothing).unwrap(), ParsedLine::Nothing);
        }
        let read = parse_sample(&mut columns, "1,2,3,4,abc");
        assert_eq!(
            (read.t, read.reference, read.e, read.u),
            (Some(1.0), Some(2.0), 3.0, 4.0)
        );
        let message = |header: &str| default_columns().parse_line(header).unwrap_err().to_string();
        assert!(message("t,y,z").ends_with("choose with --input and --output"));
        assert!(message("t,err,Stick [V]").ends_with("--output, as --input \"err\" --output \"Stick [V]\""));
        assert!(message("t,e,stick").ends_with("--output, as --output \"stick\""));
        let mut alone = Columns::new("e", "u", false, 1e6);
        assert_eq!(parse_sample(&mut alone, "3").u, 3.0);
    }

    #[test]
    fn faults_are_reported_and_reading_continues() {
        let mut columns = default_columns();
        for unreadable in ["garbage", "\u{0}\u{1}", ",", "1,2,3,4,5"] {
            assert!(
                matches!(columns.parse_line(unreadable).unwrap(), ParsedLine::Unreadable(_)),
                "{unreadable}"
            );
        }
        parse_sample(&mut columns, "1,2");
        for (line, fault) in [
            ("NaN,2", "e is NaN"),
            ("1,-inf", "u is -inf"),
            ("1e300,2", "e is 1e300, beyond 1000000"),
            (",", "e is missing; u is missing"),
            ("1,abc", "u is \"abc\", not a number"),
            ("1e999,2", "e is inf"),
        ] {
            let read = parse_sample(&mut columns, line);
            assert_eq!(read.fault.as_deref(), Some(fault));
            assert!(read.e.is_nan() || read.u.is_nan());
        }
        for unreadable in ["1", "1,2,3", "e,u,t", "t"] {
            assert!(matches!(
                columns.parse_line(unreadable).unwrap(),
                ParsedLine::Unreadable(_)
            ));
        }
    }

    #[test]
    fn lines_of_any_length_and_ending_are_read() {
        let mut text = vec![b'x'; 3 * MAX_LINE_BYTES];
        text.extend_from_slice(b"\na,b\r\n\n\xff\xfe\nlast");
        let mut lines = Lines::new(io::BufReader::with_capacity(100, text.as_slice()));
        assert!(lines.next().unwrap().unwrap().is_err());
        for expected in ["a,b\r", "", "\u{fffd}\u{fffd}", "last"] {
            assert_eq!(lines.next().unwrap().unwrap().unwrap(), expected);
        }
        assert!(lines.next().unwrap().is_none());
    }
}
