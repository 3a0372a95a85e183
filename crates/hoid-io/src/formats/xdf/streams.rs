//! Conversion of the streams of a file to arrays: one path per channel, and one for the times of each stream.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use super::chunks::{self, Samples, Stream};
use super::clock;
use crate::IoError;
use crate::formats::arrays::{Array, Contents, Entry, Indexing, Numbers, Value};
use crate::formats::budget::Budget;
use crate::wording::{abbreviate, quote_start};

/// Approximate memory of an entry, in bytes.
const ENTRY_BYTES: u64 = 512;

/// Reads the streams from the bytes of a file.
pub(super) fn read(bytes: &[u8], file: &str) -> Result<Contents, IoError> {
    if !bytes.starts_with(b"XDF:") {
        return Err(IoError::WrongFormat {
            file: file.to_owned(),
            format: "XDF",
            found: quote_start(bytes),
            expected: "\"XDF:\" at the start",
        });
    }
    let mut budget = Budget::of(bytes.len());
    let (streams, cut) = chunks::read_streams(bytes).map_err(|found| IoError::Damaged {
        file: file.to_owned(),
        found,
    })?;
    let mut notes = Vec::new();
    notes.extend(cut.map(|at| {
        format!(
            "the file is truncated at byte {at} of {}: the samples before it are read, and the {} bytes after it are \
             not; copy the file again if the original is complete",
            bytes.len(),
            bytes.len().saturating_sub(at)
        )
    }));
    for stream in &streams {
        stream.check_footer().map_err(|found| IoError::Damaged {
            file: file.to_owned(),
            found,
        })?;
        if let Some(why) = &stream.unread_footer {
            notes.push(format!(
                "stream {}: {why}; its {} samples are read, but others may be missing",
                abbreviate(&stream.header.name),
                stream.stamps.len()
            ));
        } else if let (None, Some(first), Some(last)) = (&stream.footer, stream.stamps.first(), stream.stamps.last()) {
            notes.push(format!(
                "stream {} has no footer: the file was cut short, or its recorder never closed it; {} samples over \
                 {:.3} s are present, and any after them are lost",
                abbreviate(&stream.header.name),
                stream.stamps.len(),
                last - first
            ));
        }
    }
    let times: Vec<Vec<f64>> = streams
        .iter()
        .map(|stream| clock::sample_times(stream, &mut notes))
        .collect();
    let first = times
        .iter()
        .filter_map(|times| times.first())
        .copied()
        .filter(|t| t.is_finite());
    let start = first.min_by(f64::total_cmp).unwrap_or(0.0);
    if start != 0.0 {
        notes.push(format!(
            "t counts from the first sample, which is at {start:.6} s on the clock of the recorder"
        ));
    }
    let mut names = UniqueNames::default();
    let mut entries = Vec::new();
    for (stream, times) in streams.into_iter().zip(times) {
        let name = match stream.header.name.trim() {
            "" => format!("stream {}", stream.id),
            name => name.to_owned(),
        };
        let parent = names.unique(&name);
        budget.take(
            ENTRY_BYTES.saturating_mul((stream.header.channels as u64).saturating_add(1)),
            file,
        )?;
        entries.extend(entries_of(
            stream,
            &parent,
            times.iter().map(|t| t - start).collect::<Vec<f64>>().as_slice(),
        ));
    }
    let mut contents = Contents::new(entries, Indexing::Python);
    contents.notes = notes;
    contents.own_clocks = true;
    Ok(contents)
}

/// Returns the time stamps and the channels of a stream as entries.
fn entries_of(stream: Stream, parent: &str, times: &[f64]) -> Vec<Entry> {
    let mut names = UniqueNames::default();
    let times = Value::Array(Array::vector(Numbers::from_f64(times)));
    let mut entries = vec![Entry {
        unit: String::from("s"),
        ..Entry::field(parent, &names.unique("t"), times)
    }];
    let channels = stream.header.channels;
    let mut values: Vec<Value> = match stream.samples {
        Samples::Texts(texts) => (0..channels)
            .map(|channel| Value::Texts(texts.iter().skip(channel).step_by(channels.max(1)).cloned().collect()))
            .collect(),
        Samples::Numbers { kind, bytes } => {
            let bytes = Rc::new(bytes);
            let item = channels.saturating_mul(kind.size());
            (0..channels)
                .map(|channel| {
                    Value::Array(Array::vector(Numbers::field(
                        &bytes,
                        kind,
                        false,
                        channel.saturating_mul(kind.size()),
                        item,
                    )))
                })
                .collect()
        }
    };
    for (channel, value) in values.drain(..).enumerate() {
        let known = stream.header.labels.get(channel);
        let label = known.map(|(label, _)| label.trim()).filter(|label| !label.is_empty());
        let label = names.unique(&label.map_or_else(|| format!("ch{}", channel.saturating_add(1)), str::to_owned));
        let mut entry = Entry::field(parent, &label, value);
        known.map_or("", |(_, unit)| unit.trim()).clone_into(&mut entry.unit);
        entries.push(entry);
    }
    entries
}

/// Makes names unique by appending a number to the second and each further use of a name.
#[derive(Default)]
struct UniqueNames {
    names: HashSet<String>,
    /// Number to try next for a name.
    next: HashMap<String, usize>,
}

impl UniqueNames {
    fn unique(&mut self, name: &str) -> String {
        let mut unique = name.to_owned();
        let number: &mut usize = self.next.entry(unique.clone()).or_insert(2);
        while !self.names.insert(unique.clone()) {
            unique = format!("{name}({number})");
            *number = number.saturating_add(1);
        }
        unique
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_match_pyxdf() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/xdf");
        let streams = chunks::read_streams(&std::fs::read(folder.join("tracking.xdf")).unwrap())
            .unwrap()
            .0;
        let expected = std::fs::read_to_string(folder.join("expected.csv")).unwrap();
        let mut compared = 0;
        for stream in streams {
            let times = clock::sample_times(&stream, &mut Vec::new());
            let start = format!("{},", stream.header.name);
            for line in expected.lines().filter_map(|line| line.strip_prefix(start.as_str())) {
                let (row, t) = line.split_once(',').unwrap();
                let (found, t) = (times[row.parse::<usize>().unwrap()], t.parse::<f64>().unwrap());
                // The reference adds the terms in a different order; an offset of 3000 s in units of 1e-4 s leaves a
                // rounding error of 1e-9 s.
                assert!((found - t).abs() < 2e-9, "{} {row}: {found} {t}", stream.header.name);
                compared += 1;
            }
        }
        assert!(compared > 50, "{compared}");
    }

    /// A file with one stream at 100 Hz with these times, and a footer.
    fn file_of(times: &[f64], footer: Option<&str>) -> Vec<u8> {
        let chunk = |tag: u16, content: &[u8]| {
            let mut bytes = vec![4];
            bytes.extend((content.len() as u32 + 2).to_le_bytes());
            bytes.extend(tag.to_le_bytes());
            bytes.extend(content);
            bytes
        };
        let of_stream = |text: &str| [&1_u32.to_le_bytes(), text.as_bytes()].concat();
        let header = "<info><name>s</name><channel_count>2</channel_count><nominal_srate>100</nominal_srate>\
                      <channel_format>double64</channel_format></info>";
        let mut samples = 1_u32.to_le_bytes().to_vec();
        samples.push(4);
        samples.extend((times.len() as u32).to_le_bytes());
        for t in times {
            samples.push(8);
            for value in [*t, t.sin(), t.cos()] {
                samples.extend(value.to_le_bytes());
            }
        }
        let mut file = b"XDF:".to_vec();
        file.extend(chunk(2, &of_stream(header)));
        file.extend(chunk(3, &samples));
        file.extend(footer.map(|text| chunk(6, &of_stream(text))).unwrap_or_default());
        file
    }

    #[test]
    fn footers_are_checked_against_the_data() {
        let times: Vec<f64> = (0..1000).map(|k| 50.0 + 0.01 * f64::from(k)).collect();
        let footer = |first: f64, last: f64, count: u32| {
            format!(
                "<info><first_timestamp>{first}</first_timestamp><last_timestamp>{last}</last_timestamp>\
                 <sample_count>{count}</sample_count></info>"
            )
        };
        let good = file_of(&times, Some(&footer(50.0, 59.99, 1000)));
        let notes = read(&good, "a.xdf").unwrap().notes;
        assert!(!notes.iter().any(|note| note.contains("footer")), "{notes:?}");
        for (bad, said) in [
            (
                footer(50.0, 59.99, 1001),
                "its footer states 1001 samples, but 1000 are present",
            ),
            (footer(49.0, 59.99, 1000), "the first sample is at 49 s"),
            (footer(50.0, 61.0, 1000), "the last sample is at 61 s"),
        ] {
            let message = read(&file_of(&times, Some(&bad)), "a.xdf").unwrap_err().to_string();
            assert!(
                message.contains("a.xdf is damaged") && message.contains(said),
                "{message}"
            );
        }
        // The footer is truncated within a chunk of the right length, but all samples are present.
        let cut = &footer(50.0, 59.99, 1000)[..70];
        let contents = read(&file_of(&times, Some(cut)), "a.xdf").unwrap();
        let said = |n: &String| n.contains("its footer") && n.contains("1000 samples are read");
        assert!(contents.notes.iter().any(said), "{:?}", contents.notes);
        // The file ends between two chunks, without a footer: this is not an error, but it is reported.
        let notes = read(&file_of(&times, None), "a.xdf").unwrap().notes;
        assert!(
            notes
                .iter()
                .any(|n| n.contains("cut short") && n.contains("1000 samples over 9.990 s")),
            "{notes:?}"
        );
    }

    #[test]
    fn lost_samples_are_reported_at_the_nominal_rate() {
        let times: Vec<f64> = (0..1200)
            .filter(|k| !(300..430).contains(k) && !(900..960).contains(k))
            .map(|k| 0.01 * f64::from(k))
            .collect();
        let contents = read(&file_of(&times, None), "a.xdf").unwrap();
        let note = contents.notes.iter().find(|note| note.contains("Hz found")).unwrap();
        assert!(
            note.contains("100.0000 Hz found") && note.contains("in 3 parts"),
            "{note}"
        );
    }

    #[test]
    fn truncated_file_is_read_up_to_the_cut() {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/xdf/tracking.xdf");
        let bytes = std::fs::read(file).unwrap();
        let whole = read(&bytes, "a.xdf").unwrap();
        assert!(!whole.notes.iter().any(|note| note.contains("is truncated")));
        for left in [bytes.len() - 3, bytes.len() / 2] {
            let notes = read(&bytes[..left], "a.xdf").unwrap().notes;
            assert!(
                notes[0].contains("the file is truncated at byte") && notes[0].contains("are read"),
                "{notes:?}"
            );
        }
        // A file that ends before the first stream contains no data.
        let message = read(&bytes[..20], "a.xdf").map(drop).unwrap_err().to_string();
        assert!(message.contains("a.xdf is damaged: the chunk at byte"), "{message}");
    }
}
