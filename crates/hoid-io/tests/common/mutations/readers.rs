//! All readers applied to one file, and the required properties: a record is evenly sampled, finite and not excessively
//! long; an error names the file, is short, and contains no terminal control characters.

use std::path::Path;

use hoid_io::{
    IoError, Preparation, QualityIssueKind, ReadOptions, ReadRecord, Repair, SparseTreatment, read_prepared,
    read_segments, read_table, survey,
};

use super::draw::Draw;

/// Maximum length of a message, characters.
const MAX_MESSAGE_CHARS: usize = 4000;
/// Maximum number of samples per byte of a file; `--resample` may create several samples per recorded sample.
const MAX_SAMPLES_PER_BYTE: usize = 200;

/// Numbers of successful and rejected reads.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ReadCounts {
    pub read: u64,
    pub refused: u64,
}

/// Gives a file to all readers.
///
/// # Panics
/// If a required property is violated.
pub fn read_with_all(path: &Path, bytes: usize, choice: u64) -> ReadCounts {
    let mut answers = ReadCounts::default();
    let mut draw = Draw::new(choice, 0);
    let file = path.file_name().unwrap().to_str().unwrap();
    let mut take = |failed: Option<IoError>| match failed {
        None => answers.read += 1,
        Some(error) => {
            answers.refused += 1;
            check_message(&error, file);
        }
    };
    for options in [ReadOptions::default(), options(&mut draw)] {
        let read = read_prepared(path, &options, &Preparation::default());
        take(read.map(|read| check_record(&read, bytes, &options)).err());
    }
    let mask = [*draw.one_of(&QualityIssueKind::MASKABLE_KINDS)];
    let read = read_segments(path, &options(&mut draw), &Preparation::default(), &mask, 0.02);
    take(read.map(|all| all.iter().for_each(check_finite)).err());
    take(survey(path).map(|found| assert!(!found.format.is_empty())).err());
    take(
        read_table(path)
            .map(|table| {
                let rows = table.columns.first().map_or(0, |column| column.values.len());
                assert!(
                    table.columns.iter().all(|column| column.values.len() == rows),
                    "a ragged table"
                );
            })
            .err(),
    );
    answers
}

fn options(draw: &mut Draw) -> ReadOptions {
    let input = *draw.one_of(&["e", "e", "e", "r-y", "-e", "s1.e"]);
    let output = *draw.one_of(&["u", "u", "u", "y", "-u", "s1.u"]);
    ReadOptions {
        input: (draw.below(8) > 0).then(|| input.parse().unwrap()),
        output: output.parse().unwrap(),
        time: None,
        trial: None,
        sampling_hz: [None, None, Some(100.0), Some(1e-6), Some(1e6)][draw.below(5)],
        sparse: (0..draw.below(3))
            .map(|_| {
                (
                    draw.one_of(&["e", "u", "r", "t", "x"]).to_string(),
                    *draw.one_of(&SparseTreatment::ALL),
                )
            })
            .collect(),
        columns: (draw.below(4) == 0).then(|| vec![draw.one_of(&["x", "r", "t", "z"]).to_string()]),
        span_s: [(None, None), (Some(0.005), Some(0.025)), (Some(-1e300), Some(1e300))][draw.below(3)],
        repair: Repair {
            resample: draw.below(2) == 0,
            fill: draw.below(2) == 0,
        },
    }
}

fn check_record(read: &ReadRecord, bytes: usize, options: &ReadOptions) {
    check_finite(read);
    let record = &read.record;
    assert!(record.sample_time().s() > 0.0 && record.sample_time().s().is_finite());
    // Compressed zeros take very few bytes.
    let most = MAX_SAMPLES_PER_BYTE * bytes + (1 << 25);
    assert!(record.len() <= most, "{} samples of {bytes} bytes", record.len());
    assert!(!record.is_empty(), "an empty record by {options:?}");
}

fn check_finite(read: &ReadRecord) {
    let record = &read.record;
    assert!(
        record.input().iter().chain(record.output()).all(|v| v.is_finite()),
        "a value that is not finite"
    );
}

fn check_message(error: &IoError, file: &str) {
    let message = error.to_string();
    assert!(!matches!(error, IoError::Unreadable { .. }), "{message}");
    assert!(
        message.chars().count() <= MAX_MESSAGE_CHARS,
        "{} characters: {message}",
        message.len()
    );
    assert!(!message.chars().any(char::is_control), "{message:?}");
    let of_options = matches!(error, IoError::SamplingFrequency { .. } | IoError::Expression { .. });
    assert!(of_options || message.contains(file), "{file} is not named: {message}");
}
