//! Conversion of text from other programs to text that the table reader accepts.
//!
//! The conversion keeps the order of the lines, so messages still refer to lines of the file.
//!
//! | module | contents |
//! |---|---|
//! | `encoding` | UTF-16, Latin 1, line ends |
//! | `lines` | cells of a line, numbers |
//! | `pipes` | cells between vertical bars |
//! | `layout` | the header and the first row; lines above the header, cells between blanks |
//! | `names` | the words of a header and the cells below them |
//! | `units` | a line of units below the header |
//! | `tail` | lines of words below the table |

mod encoding;
mod layout;
mod lines;
mod names;
mod pipes;
mod tail;
mod units;

pub(super) use layout::mismatch;
pub(super) use lines::{Separator, is_row, joined_lines};

use crate::record::ReadOptions;
use layout::Layout;

/// Rewrites the bytes of a table as plain CSV; returns a description of each change.
pub(super) fn convert_to_plain_csv(bytes: &mut Vec<u8>, options: &ReadOptions) -> Vec<String> {
    let mut notes = Vec::from_iter(encoding::decode(bytes));
    let Ok(text) = std::str::from_utf8(bytes) else {
        return notes;
    };
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let tabs = pipes::with_tabs(text);
    if tabs.is_some() {
        notes.push(String::from("the columns are separated by vertical bars"));
    }
    let text = tabs.as_deref().unwrap_or(text);
    let layout = Layout::of(text, options);
    let end = layout
        .as_ref()
        .and_then(|layout| tail::text_below(text, layout.separator));
    let kept = match &end {
        Some((end, _)) => text.get(..*end).unwrap_or(text),
        None => text,
    };
    let rewritten = layout.and_then(|layout| layout.to_plain_csv(kept));
    let plain = match (rewritten, end.is_some() || tabs.is_some()) {
        (Some((text, changes)), _) => {
            notes.extend(changes);
            Some(text)
        }
        (None, true) => Some(kept.to_owned()),
        (None, false) => None,
    };
    notes.extend(end.map(|(_, note)| note));
    if let Some(plain) = plain {
        *bytes = plain.into_bytes();
    }
    notes
}

/// True if the start of a file holds a table: text with a line of several numbers.
pub(in crate::formats) fn is_table(start: &[u8]) -> bool {
    let mut bytes = start.to_vec();
    // The start may end in the middle of a character: in UTF-8 it is cut after a line, in UTF-16 after an even number
    // of bytes.
    if bytes.contains(&0) {
        bytes.truncate(start.len() & !1);
    } else if let Some(line) = bytes.iter().rposition(|byte| matches!(byte, b'\n' | b'\r')) {
        bytes.truncate(line.saturating_add(1));
    }
    encoding::decode(&mut bytes);
    let Some(text) = std::str::from_utf8(&bytes).ok().filter(|text| !text.contains('\0')) else {
        return false;
    };
    let tabs = pipes::with_tabs(text);
    let lines = lines::non_blank_lines(tabs.as_deref().unwrap_or(text));
    let is_row = |mark: lines::Separator| lines.iter().any(|(_, line)| lines::is_row(&mark.cells(line)));
    lines::Separator::ALL.into_iter().any(is_row)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(text: &str) -> (String, usize) {
        let mut bytes = text.as_bytes().to_vec();
        let notes = convert_to_plain_csv(&mut bytes, &ReadOptions::default());
        (String::from_utf8_lossy(&bytes).into_owned(), notes.len())
    }

    fn assert_unchanged(text: &str) {
        assert_eq!(plain(text), (text.to_owned(), 0), "{text:?}");
    }

    #[test]
    fn lines_above_the_header_become_comments() {
        let text = "Name;Session 4\nDate;05.03.2024\n\nRate;50 Hz\nt;e;u\n0,00;1;2\n";
        let found = "#Name;Session 4\n#Date;05.03.2024\n\n#Rate;50 Hz\nt;e;u\n0,00;1;2\n";
        assert_eq!(plain(text), (found.to_owned(), 1));
        // A spreadsheet line that states the separator, and a title followed by empty cells.
        assert_eq!(plain("sep=;\r\nt;e\r\n0;1\r\n").0, "#sep=;\r\nt;e\r\n0;1\r\n");
        assert_eq!(plain("Run 1,,\nt,e,u\n0,1,2\n").0, "#Run 1,,\nt,e,u\n0,1,2\n");
        assert_eq!(plain("Rate,50,Hz\nt,e,u\n0,1,2\n").0, "#Rate,50,Hz\nt,e,u\n0,1,2\n");
        for above in [
            "Rate,50 Hz,",
            "Rate,50 Hz,x",
            "Subject,S1,pilot",
            "\"A\nB\",S1,pilot",
            "Calibration,x,y\ngain,1,2",
        ] {
            for header in ["t,e,u", "\"Time\n[s]\",e,u", "a,b,c"] {
                let text = format!("{header}\n0,1,2\n");
                let commented = above.replace('\n', "\n#");
                assert_eq!(plain(&format!("{above}\n{text}")).0, format!("#{commented}\n{text}"));
            }
        }
        // Of several lines of names, one with the requested columns or the name of a time is the header.
        assert_unchanged("e,u\nleft,right\n0,1\n");
        let text = "x\nRun,7 a\nTime,b\nleft,right\n0,1\n";
        assert_eq!(plain(text).0, "#x\n#Run,7 a\nTime,b\nleft,right\n0,1\n");
        let text = "Date,today\nTracking error,stick\n0,1\n";
        assert_eq!(plain(text).0, format!("#{text}"));
        let long = "Key: value\n".repeat(100) + "t,e\n0,1\n";
        assert_eq!(plain(&long).0, "#Key: value\n".repeat(100) + "t,e\n0,1\n");
        for text in [
            "t,e,u\n0,1,2\n",
            "t,e,u\nstart,here,now\n0,1,2\n",
            "t,e,u\ns,deg\n0,1,2\n",
            "t,e,u\ns,deg,deg\na,b,c\n",
            "t e u\n0 1\n",
            "",
            "\n",
            "#\n",
            "1,2\n3,4\n",
            "a\nb\n",
            // A sample above a repeated header is not omitted.
            "0,1\n1,2\nt,e\n2,3\n3,4\n4,5\n",
            "t,e,u\n0,1\n1,2,3\n2,3,4\n3,4,5\n",
            "\"t\",\"e\"\n\"0,02\",\"0,81\"\n\"0,04\",\"0,82\"\n",
        ] {
            assert_unchanged(text);
        }
    }

    #[test]
    fn blanks_as_separators_become_tabs() {
        for (text, found) in [
            ("  t   e\n 0.0  1\n 0.1 -2\n", "t\te\n0.0\t1\n0.1\t-2\n"),
            ("% t e\n0.0 1\n0.1 -2\n", "t\te\n0.0\t1\n0.1\t-2\n"),
            ("Roll error (deg) u\n0.0 1\n", "Roll error (deg)\tu\n0.0\t1\n"),
        ] {
            assert_eq!(plain(text), (found.to_owned(), 1), "{text:?}");
        }
        let text = "Session 4\n\n! t e\n! s deg\n0,0 1\n0,1 -2\n";
        let found = "#Session 4\n\n# units: t s, e deg\nt\te\n0,0\t1\n0,1\t-2\n";
        assert_eq!(plain(text).0, found);
    }

    #[test]
    fn commented_headers_are_recognised() {
        for (text, found) in [
            ("# t e u\n0 1 2\n1 3 4\n", "t\te\tu\n0\t1\t2\n1\t3\t4\n"),
            ("# made by x\n#t,e,u\n0,1,2\n", "# made by x\nt,e,u\n0,1,2\n"),
            ("# t, e deg, u\n0 1 2\n", "t\t e deg\t u\n0\t1\t2\n"),
        ] {
            assert_eq!(plain(text).0, found, "{text:?}");
        }
        for text in [
            "# units: t s, e deg\n0,1\n",
            "# columns: 3\n0,1,2\n",
            "# a\nt,e\n#x,y\n0,1\n",
            "#\n0,1\n",
        ] {
            assert_unchanged(text);
        }
    }

    #[test]
    fn units_below_the_header_become_a_comment() {
        let with_units = "# units: t s, e deg, u V\nt,e,u\n0,1,2\n";
        for text in ["t,e,u\ns,deg,V\n0,1,2\n", "\u{feff}t,e,u\n[s],(deg),\"V\"\n0,1,2\n"] {
            assert_eq!(plain(text), (with_units.to_owned(), 1));
        }
        let text = "Session 4\n\"t\";e;u\r\ns;;-\r\n0,0;1;2\r\n";
        let found = "#Session 4\n# units: t s\r\n\"t\";e;u\r\n0,0;1;2\r\n";
        assert_eq!(plain(text), (found.to_owned(), 2));
        let found = "# units: t s, e deg\nt\te\n0\t1\n0.1\t2\n";
        assert_eq!(plain("t e\ns deg\n0 1\n0.1 2\n"), (found.to_owned(), 2));
    }

    #[test]
    fn cells_without_a_name_are_handled() {
        for (text, found) in [
            ("t,e\n0,1,\n0.1,2,\n", "t,e\n0,1\n0.1,2\n"),
            (
                "\"t\" \"e\"\n\"1\" 0 5\n\"2\" 0.1 6\n",
                "\t\"t\"\t\"e\"\n\"1\"\t0\t5\n\"2\"\t0.1\t6\n",
            ),
            ("t;e;Comment\n0;1\n0.1;2\n", "t;e\n0;1\n0.1;2\n"),
            ("| t | e |\n|---|---|\n| 0 | 1 |\n", "t\te\n#|---|---|\n0\t1\n"),
        ] {
            assert_eq!(plain(text).0, found, "{text:?}");
        }
    }

    #[test]
    fn text_below_a_table_is_removed() {
        let rows = "t,e\n0,1\n1,2\n2,3\n";
        assert_eq!(plain(&format!("{rows}\nEnd of run\n")), (rows.to_owned(), 1));
        assert_eq!(plain("Run 3\rt,e\r0,1\r").0, "#Run 3\nt,e\n0,1\n");
    }

    #[test]
    fn tables_are_recognised_by_their_first_lines() {
        let utf16: Vec<u8> = "t;e\n0;1\n0,1;2".encode_utf16().flat_map(u16::to_le_bytes).collect();
        for table in [&b"t e\n0 1\n"[..], b"x\n# y\n0,1\n", b"|t|e|\n|0|1|\n", b"0,1", &utf16] {
            assert!(is_table(table), "{table:?}");
        }
        for other in [
            &b""[..],
            b"a = [1, 2]\n",
            b"{\"t\": 1}\n",
            b"PK\x03\x04\0\0 1,2\n",
            b"words only, here\n",
            b"5\n6\n",
        ] {
            assert!(!is_table(other), "{other:?}");
        }
    }
}
