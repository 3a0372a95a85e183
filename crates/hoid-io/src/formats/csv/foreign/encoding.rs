//! Encodings other than UTF-8, and line ends other than line feeds.

/// Letters and signs of Latin 1, and dashes and quotation marks of Windows, that occur in units and column names; other
/// non-ASCII bytes count as damage.
const LATIN_BYTES: &[u8] = b"\x91\x92\x93\x94\x96\x97\xa0\xb0\xb2\xb3\xb5\xb7\xc4\xc9\xd6\xdc\xdf\xe0\xe1\xe2\xe4\xe5\xe7\xe8\xe9\xea\xed\xf1\xf3\xf4\xf6\xf8\xfa\xfc";

/// Number of bytes at the start of a file from which UTF-16 without a byte order mark is recognised.
const UTF16_PROBE_BYTES: usize = 256;

/// Decodes the bytes as UTF-8 in place and makes every line end a line feed, with or without a carriage return; returns
/// a description of another encoding.
pub(super) fn decode(bytes: &mut Vec<u8>) -> Option<String> {
    let mut note = None;
    if let Some(text) = decode_utf16(bytes) {
        *bytes = text.into_bytes();
        note = Some(String::from("the text is in UTF-16"));
    } else if std::str::from_utf8(bytes).is_err() && is_latin(bytes) {
        *bytes = bytes
            .iter()
            .map(|byte| latin_character(*byte))
            .collect::<String>()
            .into_bytes();
        note = Some(String::from("the text is read as Latin 1"));
    }
    let cut = trim_end_of_file(bytes);
    normalise_line_ends(bytes);
    note.or(cut)
}

/// Removes the end-of-file character of DOS, and zero bytes that a recorder left when it lost power; returns a note on
/// the zero bytes.
fn trim_end_of_file(bytes: &mut Vec<u8>) -> Option<String> {
    let kept = bytes
        .iter()
        .rposition(|byte| *byte != 0)
        .map_or(0, |last| last.saturating_add(1));
    let zeros = bytes.len().saturating_sub(kept);
    let is_text = kept > 0 && bytes.get(..kept).is_some_and(|text| !text.contains(&0));
    if zeros > 0 && is_text {
        bytes.truncate(kept);
        return Some(format!(
            "null bytes at the end of the file are left out: {zeros}; the recording may be incomplete"
        ));
    }
    if bytes.ends_with(b"\x1a") {
        bytes.pop();
    }
    None
}

/// Decodes UTF-16 text, which is recognised by its byte order mark, or by zeros in every second byte of its start;
/// `None` for other text.
fn decode_utf16(bytes: &[u8]) -> Option<String> {
    let start = bytes.get(..UTF16_PROBE_BYTES.min(bytes.len()))?;
    let (pairs_of_start, _) = start.as_chunks();
    let all = |test: fn(&[u8; 2]) -> bool| pairs_of_start.len() > 1 && pairs_of_start.iter().all(test);
    let (unit, rest): (fn([u8; 2]) -> u16, _) = match bytes {
        [0xff, 0xfe, rest @ ..] => (u16::from_le_bytes, rest),
        [0xfe, 0xff, rest @ ..] => (u16::from_be_bytes, rest),
        rest if all(|[low, high]| *low != 0 && *high == 0) => (u16::from_le_bytes, rest),
        rest if all(|[high, low]| *low != 0 && *high == 0) => (u16::from_be_bytes, rest),
        _ => return None,
    };
    let (pairs, []) = rest.as_chunks() else { return None };
    let units: Vec<u16> = pairs.iter().map(|pair| unit(*pair)).collect();
    String::from_utf16(&units).ok()
}

/// True if each non-ASCII byte may occur in a name or a unit.
fn is_latin(bytes: &[u8]) -> bool {
    bytes.iter().all(|byte| byte.is_ascii() || LATIN_BYTES.contains(byte))
}

/// Returns the character of a byte; Windows assigns printable characters to the control characters of Latin 1.
fn latin_character(byte: u8) -> char {
    match byte {
        0x91 | 0x92 => '\'',
        0x93 | 0x94 => '"',
        0x96 | 0x97 => '\u{2013}',
        byte => char::from(byte),
    }
}

/// Replaces each carriage return that is not followed by a line feed by a line feed, because old Mac programs end lines
/// with a carriage return. The length of the text is unchanged.
fn normalise_line_ends(bytes: &mut [u8]) {
    let mut rest = bytes;
    while let Some(at) = rest.iter().position(|byte| *byte == b'\r') {
        let (_, from) = rest.split_at_mut(at);
        rest = match from {
            [_, b'\n', rest @ ..] => rest,
            [end, rest @ ..] => {
                *end = b'\n';
                rest
            }
            [] => return,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(bytes: &[u8]) -> (String, bool) {
        let mut bytes = bytes.to_vec();
        let note = decode(&mut bytes);
        (String::from_utf8_lossy(&bytes).into_owned(), note.is_some())
    }

    #[test]
    fn encodings_are_detected() {
        let text = "t\te\n0\t1\n";
        for order in [u16::to_le_bytes as fn(u16) -> [u8; 2], u16::to_be_bytes] {
            let bytes: Vec<u8> = text.encode_utf16().flat_map(order).collect();
            let marked = [&order(0xfeff)[..], &bytes].concat();
            assert_eq!(decoded(&marked), (text.to_owned(), true));
            assert_eq!(decoded(&bytes), (text.to_owned(), true));
        }
        assert_eq!(decoded(b"t,e [\xb0]\n0,1\n"), (String::from("t,e [°]\n0,1\n"), true));
        let dash = decoded(b"t,e \x96 roll\n0,1\n");
        assert_eq!(dash, (String::from("t,e \u{2013} roll\n0,1\n"), true));
        // Damaged text is not converted: half a UTF-16 code unit, bytes that are not Latin 1 letters, or zero bytes
        // elsewhere.
        for bytes in [
            &b"\xff\xfet\0e"[..],
            b"t,e\n0,\xff1\n",
            b"t,e\n0,\x801\n",
            b"t\0e,\n",
            b"\0\0\0",
            b"\0",
            b"",
        ] {
            assert!(!decoded(bytes).1, "{bytes:?}");
        }
    }

    #[test]
    fn trailing_zero_and_control_bytes_are_removed() {
        let text = String::from("t,e\n0,1\n");
        assert_eq!(decoded(b"t,e\n0,1\n\0\0\0"), (text.clone(), true));
        assert_eq!(decoded(b"t,e\n0,1\n\x1a"), (text, false));
        assert!(!decoded(b"t,\0e\n0,1\n\0").1);
    }

    #[test]
    fn line_endings_are_normalised() {
        for (text, found) in [
            ("t,e\r0,1\r", "t,e\n0,1\n"),
            ("t,e\r\n0,1\r\n", "t,e\r\n0,1\r\n"),
            ("t,e\r\n0,1\r1,2\n", "t,e\r\n0,1\n1,2\n"),
            ("t,e\r\r\n0,1", "t,e\n\r\n0,1"),
            ("\r", "\n"),
        ] {
            assert_eq!(decoded(text.as_bytes()), (found.to_owned(), false));
        }
    }
}
