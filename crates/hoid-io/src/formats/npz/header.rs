//! The header of NPY: a Python dictionary with the keys `descr`, `fortran_order` and `shape` (NEP 1, versions 1 to 3).
//!
//! hoid parses this literal itself because its grammar is small, and because a general parser of Python literals
//! recurses as deeply as a malicious header demands.

/// Content of a header.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Header {
    pub(super) descr: Descr,
    pub(super) fortran_order: bool,
    pub(super) shape: Vec<usize>,
}

/// Type of an array item.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Descr {
    /// A plain type, such as `<f8`.
    Plain(String),
    /// The fields of a structured array: each name, with the type if it is plain.
    Fields(Vec<(String, Option<String>)>),
}

/// The Python literals that occur in headers.
#[derive(Debug, Clone, PartialEq)]
enum Literal {
    Text(String),
    Whole(usize),
    Flag(bool),
    Sequence(Vec<Literal>),
}

/// Maximum nesting of sequences; a shape in a field in a list needs three levels.
const MAX_NESTING: usize = 6;

/// Parses the header text, which lies between the length and the data.
pub(super) fn parse(text: &str) -> Option<Header> {
    let mut reader = Reader { rest: text };
    reader.expect_token('{')?;
    let (mut descr, mut fortran_order, mut shape) = (None, None, None);
    while reader.expect_token('}').is_none() {
        let key = reader.text()?;
        reader.expect_token(':')?;
        let value = reader.literal(0)?;
        match (key.as_str(), value) {
            ("descr", Literal::Text(text)) => descr = Some(Descr::Plain(text)),
            ("descr", Literal::Sequence(fields)) => {
                descr = Some(Descr::Fields(fields.iter().map(parse_field).collect::<Option<_>>()?))
            }
            ("fortran_order", Literal::Flag(flag)) => fortran_order = Some(flag),
            ("shape", Literal::Sequence(sides)) => {
                let side = |side: &Literal| match side {
                    Literal::Whole(side) => Some(*side),
                    _ => None,
                };
                shape = Some(sides.iter().map(side).collect::<Option<_>>()?);
            }
            _ => return None,
        }
        if reader.expect_token(',').is_none() {
            reader.expect_token('}')?;
            break;
        }
    }
    reader.rest.trim().is_empty().then_some(())?;
    Some(Header {
        descr: descr?,
        fortran_order: fortran_order?,
        shape: shape?,
    })
}

/// Parses a field (name and type, or name, type and shape). The name may be a pair of title and name.
fn parse_field(field: &Literal) -> Option<(String, Option<String>)> {
    let Literal::Sequence(parts) = field else { return None };
    let name = match parts.first()? {
        Literal::Text(name) => name.clone(),
        Literal::Sequence(names) => match names.last()? {
            Literal::Text(name) => name.clone(),
            _ => return None,
        },
        _ => return None,
    };
    match parts.get(1)? {
        Literal::Text(descr) if parts.len() == 2 => Some((name, Some(descr.clone()))),
        _ => Some((name, None)),
    }
}

struct Reader<'a> {
    rest: &'a str,
}

impl Reader<'_> {
    fn expect_token(&mut self, token: char) -> Option<()> {
        self.rest = self.rest.trim_start();
        self.rest = self.rest.strip_prefix(token)?;
        Some(())
    }

    fn text(&mut self) -> Option<String> {
        self.rest = self.rest.trim_start();
        let quote = self.rest.chars().next().filter(|c| ['\'', '"'].contains(c))?;
        let mut text = String::new();
        let mut characters = self.rest.char_indices().skip(1);
        loop {
            match characters.next()? {
                (at, c) if c == quote => {
                    self.rest = self.rest.get(at..)?.strip_prefix(quote)?;
                    return Some(text);
                }
                (_, '\\') => match characters.next()?.1 {
                    c @ ('\\' | '\'' | '"') => text.push(c),
                    // Other Python escapes do not occur in names that hoid can display, so they are kept unchanged.
                    c => text.extend(['\\', c]),
                },
                (_, c) => text.push(c),
            }
        }
    }

    fn literal(&mut self, depth: usize) -> Option<Literal> {
        self.rest = self.rest.trim_start();
        let first = self.rest.chars().next()?;
        match first {
            '\'' | '"' => self.text().map(Literal::Text),
            '(' | '[' => {
                let end = if first == '(' { ')' } else { ']' };
                self.expect_token(first)?;
                let mut items = Vec::new();
                while self.expect_token(end).is_none() {
                    if depth == MAX_NESTING {
                        return None;
                    }
                    items.push(self.literal(depth.saturating_add(1))?);
                    if self.expect_token(',').is_none() {
                        self.expect_token(end)?;
                        break;
                    }
                }
                Some(Literal::Sequence(items))
            }
            '0'..='9' => {
                let end = self.rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(self.rest.len());
                let (digits, rest) = self.rest.split_at(end);
                // Python 2 wrote long integers with a trailing L.
                self.rest = rest.strip_prefix('L').unwrap_or(rest);
                digits.parse().ok().map(Literal::Whole)
            }
            _ => {
                for (word, flag) in [("True", true), ("False", false)] {
                    if let Some(rest) = self.rest.strip_prefix(word) {
                        self.rest = rest;
                        return Some(Literal::Flag(flag));
                    }
                }
                None
            }
        }
    }
}

/// Formats text as a Python string literal.
pub(super) fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\\', "\\\\").replace('\'', "\\'"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numpy_headers_are_parsed() {
        let plain = parse("{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }  \n").unwrap();
        assert_eq!(
            plain,
            Header {
                descr: Descr::Plain("<f8".into()),
                fortran_order: false,
                shape: vec![3, 2]
            }
        );
        assert_eq!(
            parse("{'shape':(3L,),'fortran_order':True,'descr':'|b1'}")
                .unwrap()
                .shape,
            [3]
        );
        assert_eq!(
            parse("{'shape':(),'fortran_order':True,'descr':'|b1'}").unwrap().shape,
            [0; 0]
        );
        let fields = parse(
            "{'descr': [('t', '<f8'), ('a\\'b', '<i4', (2,)), (('x', 'y'), '<u2')], 'fortran_order': False, 'shape': (5,)}",
        );
        let expected = vec![
            ("t".into(), Some("<f8".into())),
            ("a'b".into(), None),
            ("y".into(), Some("<u2".into())),
        ];
        assert_eq!(fields.unwrap().descr, Descr::Fields(expected));
    }

    #[test]
    fn damaged_headers_are_refused() {
        for text in [
            "",
            "{",
            "{}",
            "{'descr': '<f8'}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (-3,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999999,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (3,)} x",
            "{'descr': '<f8, 'fortran_order': False, 'shape': (3,)}",
        ] {
            assert_eq!(parse(text), None, "{text}");
        }
        let deep = format!("{{'descr': {}", "[".repeat(100_000));
        assert_eq!(parse(&deep), None);
    }

    #[test]
    fn quoted_text_round_trip() {
        for text in ["e", "a'b", "a\\b", "\u{e9}"] {
            assert_eq!(Reader { rest: &quoted(text) }.text().as_deref(), Some(text));
        }
    }
}
