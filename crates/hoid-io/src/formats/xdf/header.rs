//! The header of a stream in XML: `info` with `name`, `channel_count`, `nominal_srate` and `channel_format`, and in
//! `desc` the labels and units of the channels.

use roxmltree::{Document, Node};

use crate::wording::short_error;

/// Maximum number of channels of a stream; a larger number counts as damage.
const MAX_CHANNELS: usize = 1 << 12;

/// Properties of a stream, which the file gives before the samples.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Header {
    pub(super) name: String,
    pub(super) channels: usize,
    /// Nominal rate, Hz; 0 for irregular samples.
    pub(super) nominal_hz: f64,
    /// Type of the values, such as `float32`.
    pub(super) format: String,
    /// Label and unit of each channel, if stated.
    pub(super) labels: Vec<(String, String)>,
    /// True if the stream drops samples instead of delaying them; its time stamps are then kept.
    pub(super) may_drop_samples: bool,
}

/// Parses the header in the bytes of a chunk.
pub(super) fn parse(bytes: &[u8]) -> Result<Header, String> {
    let text = String::from_utf8_lossy(bytes);
    let document = Document::parse(text.trim_start_matches('\u{feff}'))
        .map_err(|error| format!("its header: {}", short_error(&error.to_string())))?;
    let info = document.root_element();
    let text = |name: &str| {
        child(info, name)
            .and_then(|node| node.text())
            .map(|text| text.trim().to_owned())
    };
    let needed = |name: &str| text(name).ok_or_else(|| format!("its header has no {name}"));
    let number = |name: &str, text: String| {
        text.parse::<f64>()
            .map_err(|_| format!("its {name} is \"{}\", expected a number", short_error(&text)))
    };
    let count = number("channel_count", needed("channel_count")?)?;
    if !(0.0..=MAX_CHANNELS as f64).contains(&count) {
        return Err(format!("it has {count} channels, expected at most {MAX_CHANNELS}"));
    }
    let nominal_hz = number("nominal_srate", needed("nominal_srate")?)?;
    if !(nominal_hz >= 0.0 && nominal_hz.is_finite()) {
        return Err(format!("its nominal_srate is {nominal_hz} Hz, expected zero or more"));
    }
    let desc = child(info, "desc");
    let channels = desc.and_then(|desc| child(desc, "channels"));
    let labels = channels
        .into_iter()
        .flat_map(|channels| channels.children())
        .filter(|node| node.has_tag_name("channel"));
    let inner = |node: Node<'_, '_>, name: &str| {
        let text = child(node, name).and_then(|node| node.text());
        text.unwrap_or_default().to_owned()
    };
    let drop = desc.and_then(|desc| child(desc, "synchronization"));
    Ok(Header {
        name: text("name").unwrap_or_default(),
        channels: count as usize,
        nominal_hz,
        format: needed("channel_format")?,
        labels: labels
            .take(MAX_CHANNELS)
            .map(|node| (inner(node, "label"), inner(node, "unit")))
            .collect(),
        may_drop_samples: drop.is_some_and(|node| inner(node, "can_drop_samples").trim().eq_ignore_ascii_case("true")),
    })
}

/// Summary of a stream, written by the recorder when it closes the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Footer {
    pub(super) samples: Option<u64>,
    /// First and last time stamp on the clock of the stream, s.
    pub(super) span_s: Option<(f64, f64)>,
}

/// Parses the footer in the bytes of a chunk.
pub(super) fn parse_footer(bytes: &[u8]) -> Result<Footer, String> {
    let text = String::from_utf8_lossy(bytes);
    let document = Document::parse(text.trim_start_matches('\u{feff}'))
        .map_err(|error| format!("its footer: {}", short_error(&error.to_string())))?;
    let info = document.root_element();
    let number = |name: &str| {
        child(info, name)?
            .text()?
            .trim()
            .parse::<f64>()
            .ok()
            .filter(|v| v.is_finite())
    };
    Ok(Footer {
        samples: number("sample_count").filter(|n| *n >= 0.0).map(|n| n as u64),
        span_s: number("first_timestamp").zip(number("last_timestamp")),
    })
}

fn child<'a, 'input>(node: Node<'a, 'input>, name: &str) -> Option<Node<'a, 'input>> {
    node.children().find(|child| child.has_tag_name(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stream_headers_are_parsed() {
        let text = "<?xml version='1.0'?><info><name>A &lt; B</name><channel_count>2</channel_count><nominal_srate>100.5</nominal_srate>\
            <channel_format>float32</channel_format><desc><channels><channel><label>x</label><unit>N</unit></channel><channel/></channels></desc></info>";
        let header = parse(text.as_bytes()).unwrap();
        assert_eq!(
            (header.name.as_str(), header.channels, header.nominal_hz),
            ("A < B", 2, 100.5)
        );
        assert_eq!(
            header.labels,
            [("x".into(), "N".into()), (String::new(), String::new())]
        );
        for (from, to) in [
            ("<channel_count>2", "<channel_count>-1"),
            (">2<", ">two<"),
            ("100.5", "inf"),
            ("</desc>", ""),
            ("float32", ""),
        ] {
            let damaged = text.replace(from, to);
            assert!(parse(damaged.as_bytes()).is_err() || to.is_empty(), "{damaged}");
        }
        // Neither deep nesting nor entities take much memory.
        assert!(parse("<a>".repeat(1_000_000).as_bytes()).is_err());
        let bomb = "<!DOCTYPE a [<!ENTITY b \"bbbb\"><!ENTITY c \"&b;&b;&b;\">]><info>&c;</info>";
        assert!(parse(bomb.as_bytes()).is_err());
    }
}
