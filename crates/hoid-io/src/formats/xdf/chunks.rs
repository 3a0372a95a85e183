//! The chunks of XDF (github.com/sccn/xdf/wiki/Specifications, version 1.0), each with a length, a tag and contents.
//!
//! Each sample may have a time stamp; a sample without one follows the previous sample by the nominal sample time.

use std::collections::HashMap;

use super::header::{self, Footer, Header};
use crate::formats::arrays::Kind;
use crate::wording::abbreviate;

const STREAM_HEADER: u16 = 2;
const SAMPLES: u16 = 3;
const CLOCK_OFFSET: u16 = 4;
const STREAM_FOOTER: u16 = 6;

/// A stream as stored in the file.
#[derive(Debug)]
pub(super) struct Stream {
    pub(super) id: u32,
    pub(super) header: Header,
    /// Time stamps on the clock of the stream, s.
    pub(super) stamps: Vec<f64>,
    pub(super) samples: Samples,
    /// Measured offsets to the clock of the recorder: time of the measurement and offset, s.
    pub(super) offsets: Vec<(f64, f64)>,
    /// Footer of the stream; `None` if the recorder did not close the file, or if the end of the file is lost.
    pub(super) footer: Option<Footer>,
    /// Reason why an existing footer cannot be read.
    pub(super) unread_footer: Option<String>,
}

/// Values of all channels, sample by sample.
#[derive(Debug)]
pub(super) enum Samples {
    Numbers { kind: Kind, bytes: Vec<u8> },
    Texts(Vec<String>),
}

/// Reads bytes from front to back.
struct ByteReader<'a> {
    rest: &'a [u8],
}

impl<'a> ByteReader<'a> {
    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(length)?;
        self.rest = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    /// Reads a length of 1, 4 or 8 bytes, whose number of bytes precedes it.
    fn length(&mut self) -> Option<usize> {
        match self.array::<1>()? {
            [1] => self.array().map(|[n]| usize::from(n)),
            [4] => usize::try_from(u32::from_le_bytes(self.array()?)).ok(),
            [8] => usize::try_from(u64::from_le_bytes(self.array()?)).ok(),
            _ => None,
        }
    }

    fn f64(&mut self) -> Option<f64> {
        self.array().map(f64::from_le_bytes)
    }
}

/// Reads the streams of a file, which starts with the magic bytes. Returns the streams in the order of their headers
/// and, if the last chunk is truncated, its position; all chunks before it are complete.
pub(super) fn read_streams(bytes: &[u8]) -> Result<(Vec<Stream>, Option<usize>), String> {
    let mut rest = ByteReader {
        rest: bytes.get(4..).unwrap_or_default(),
    };
    let mut streams: Vec<Stream> = Vec::new();
    let mut known: HashMap<u32, usize> = HashMap::new();
    while !rest.rest.is_empty() {
        let at = bytes.len().saturating_sub(rest.rest.len());
        let ends = || format!("the chunk at byte {at} is truncated, or its length is wrong");
        let is_length = matches!(rest.rest, [1 | 4 | 8, ..]);
        let Some(taken) = rest.length().and_then(|length| rest.take(length)) else {
            if is_length && !streams.is_empty() {
                return Ok((streams, Some(at)));
            }
            return Err(ends());
        };
        let mut content = ByteReader { rest: taken };
        let tag = content.array().map(u16::from_le_bytes).ok_or_else(ends)?;
        if !matches!(tag, STREAM_HEADER | SAMPLES | CLOCK_OFFSET | STREAM_FOOTER) {
            continue;
        }
        let id = content.array().map(u32::from_le_bytes).ok_or_else(ends)?;
        let damaged = |what: String| format!("stream {id}, the chunk at byte {at}: {what}");
        if tag == STREAM_HEADER {
            let header = header::parse(content.rest).map_err(damaged)?;
            let samples = empty_samples(&header.format).ok_or_else(|| {
                damaged(format!(
                    "the channel format \"{}\" is unknown",
                    abbreviate(&header.format)
                ))
            })?;
            if known.insert(id, streams.len()).is_some() {
                return Err(damaged(String::from("the stream has two headers")));
            }
            streams.push(Stream {
                id,
                header,
                stamps: Vec::new(),
                samples,
                offsets: Vec::new(),
                footer: None,
                unread_footer: None,
            });
            continue;
        }
        let stream = known.get(&id).and_then(|at| streams.get_mut(*at));
        let stream = stream.ok_or_else(|| damaged(String::from("the stream has no header")))?;
        if tag == STREAM_FOOTER {
            // The footer is not needed to read the samples; it is only compared with them.
            match header::parse_footer(content.rest) {
                Ok(footer) => stream.footer = Some(footer),
                Err(why) => stream.unread_footer = Some(why),
            }
            continue;
        }
        let read = if tag == SAMPLES {
            stream.read_samples(&mut content)
        } else {
            stream.read_offset(&mut content)
        };
        read.ok_or_else(|| damaged(String::from("it ends in the middle of a sample")))?;
    }
    Ok((streams, None))
}

fn empty_samples(format: &str) -> Option<Samples> {
    let kind = match format {
        "string" => return Some(Samples::Texts(Vec::new())),
        "double64" => Kind::F64,
        "float32" => Kind::F32,
        "int8" => Kind::I8,
        "int16" => Kind::I16,
        "int32" => Kind::I32,
        "int64" => Kind::I64,
        _ => return None,
    };
    Some(Samples::Numbers {
        kind,
        bytes: Vec::new(),
    })
}

impl Stream {
    /// Compares the footer with the samples that were read.
    ///
    /// # Errors
    /// A description of the difference, which means that part of the file is missing.
    pub(super) fn check_footer(&self) -> Result<(), String> {
        let Some(footer) = self.footer else { return Ok(()) };
        let read = self.stamps.len();
        if let Some(stated) = footer.samples.filter(|n| *n != read as u64) {
            return Err(format!(
                "stream {} ({}): its footer states {stated} samples, but {read} are present: part of the file is \
                 missing",
                self.id,
                abbreviate(&self.header.name)
            ));
        }
        let ends = self.stamps.first().zip(self.stamps.last());
        for (what, stated, found) in footer
            .span_s
            .zip(ends)
            .into_iter()
            .flat_map(|((from, to), (first, last))| [("first", from, *first), ("last", to, *last)])
        {
            // Recorders print times with six digits, and may omit time stamps that follow from the nominal sample time.
            let slack_s = self.nominal_step_s().max(1e-5 * stated.abs()).max(1e-6);
            if (stated - found).abs() > slack_s {
                return Err(format!(
                    "stream {} ({}): its footer states that the {what} sample is at {stated} s, but it is at {found} \
                     s: part of the file is missing",
                    self.id,
                    abbreviate(&self.header.name)
                ));
            }
        }
        Ok(())
    }

    fn read_samples(&mut self, content: &mut ByteReader<'_>) -> Option<()> {
        // No memory is reserved for the stated number of samples; each sample takes at least one byte.
        for _ in 0..content.length()? {
            let stamp = match content.array::<1>()? {
                [0] => self.stamps.last().copied().unwrap_or(0.0) + self.nominal_step_s(),
                _ => content.f64()?,
            };
            match &mut self.samples {
                Samples::Numbers { kind, bytes } => {
                    bytes.extend_from_slice(content.take(self.header.channels.saturating_mul(kind.size()))?);
                }
                Samples::Texts(texts) => {
                    for _ in 0..self.header.channels {
                        let length = content.length()?;
                        texts.push(String::from_utf8_lossy(content.take(length)?).into_owned());
                    }
                }
            }
            self.stamps.push(stamp);
        }
        Some(())
    }

    fn read_offset(&mut self, content: &mut ByteReader<'_>) -> Option<()> {
        self.offsets.push((content.f64()?, content.f64()?));
        Some(())
    }

    /// Returns the nominal sample time; 0 for a stream without a nominal rate.
    pub(super) fn nominal_step_s(&self) -> f64 {
        if self.header.nominal_hz > 0.0 {
            1.0 / self.header.nominal_hz
        } else {
            0.0
        }
    }
}
