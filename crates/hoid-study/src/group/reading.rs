//! Reading and preparation of the runs of a group as specified in the manifest.

use std::path::Path;

use hoid_analysis::{Account, AnalysisError, Recordings, SystemKind};
use hoid_io::{
    ColumnKind, ColumnSchema, OutputTable, Preparation, ReadOptions, ReadRecord, Repair, Step, TableSchema,
    read_aligned,
};
use hoid_model::{Detrend, Fault, Record};

use super::{
    manifest::{Manifest, RunEntry},
    read_settings::Detrending,
};
use crate::{StudyError, columns::Rows};

/// Alignment of u with e.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pairing {
    /// Alignment as recorded, corrected by the offsets of `[prepare]`.
    Recorded,
    /// Alignment as in `Recorded`, then corrected by `offset_samples` of the condition: u is aligned with the e to
    /// which it responds.
    InTheLoop,
}

/// Reads and prepares a file, with the preparation of its condition.
fn read_file(manifest: &Manifest, condition: &str, path: &Path, pairing: Pairing) -> Result<CheckedRecord, String> {
    let reading = &manifest.read;
    let text = |error: hoid_io::IoError| error.to_string();
    let options = ReadOptions {
        input: Some(reading.input.parse().map_err(text)?),
        output: reading.output.parse().map_err(text)?,
        trial: reading.trial.as_deref().map(str::parse).transpose().map_err(text)?,
        time: reading.time.as_deref().map(str::parse).transpose().map_err(text)?,
        sampling_hz: reading.sampling_hz,
        span_s: (reading.from_s, reading.to_s),
        sparse: reading.sparse_columns()?,
        columns: None,
        repair: Repair {
            resample: reading.resample,
            fill: reading.fill,
        },
    };
    let preparation = Preparation {
        detrend: match reading.detrend {
            Detrending::None => Detrend::None,
            Detrending::Mean => Detrend::Mean,
            Detrending::Linear => Detrend::Linear,
        },
        ..manifest.preparation(condition)?
    };
    let late_samples = match pairing {
        Pairing::Recorded => 0.0,
        Pairing::InTheLoop => manifest
            .conditions
            .get(condition)
            .map_or(0.0, |settings| settings.offset_samples),
    };
    let read = read_aligned(path, &options, &preparation, late_samples)
        .map_err(|error| AnalysisError::from_reading(error, path, &options).to_string())?;
    let recorded = UnrepairedRun {
        record: read.record.clone(),
        account: Account {
            steps: read.steps.clone(),
            quality_issues: read.quality_issues.clone(),
            ..Account::default()
        },
    };
    let mut as_recorded = Recordings::default();
    as_recorded.push(
        path.display().to_string(),
        recorded.record.clone(),
        recorded.account.clone(),
    );
    let repaired = as_recorded
        .repaired(reading.faults.handling(), SystemKind::Person)
        .map_err(|error| error.to_string())?;
    let faults = repaired
        .accounts
        .into_iter()
        .flat_map(|account| account.faults)
        .collect();
    let longest = repaired.records.into_iter().max_by_key(Record::len);
    let mut read = ReadRecord {
        record: longest.unwrap_or_else(|| read.record.clone()),
        ..read
    };
    // The rate is reduced only now, since faults are detected in the recorded samples.
    let (record, done) = manifest
        .rate_decimation(condition)?
        .apply(read.record)
        .map_err(|error| error.to_string())?;
    read.record = record;
    read.steps.extend(done.map(Step::from));
    Ok(CheckedRecord {
        factor: done.map_or(1, |done| done.factor),
        read,
        faults,
        recorded,
    })
}

/// A record that has been read and repaired, with its faults.
pub(super) struct CheckedRecord {
    read: ReadRecord,
    faults: Vec<Fault>,
    /// Factor by which the rate was reduced, after the steps that count recorded samples.
    factor: usize,
    recorded: UnrepairedRun,
}

/// Returns the columns of two tables: preparation steps of the runs, one per row, and problems of their sampling, one
/// per row.
pub(super) fn schemas() -> [(&'static str, TableSchema); 2] {
    let schema = |names: &[&str]| {
        let column = |name: &&str| ColumnSchema {
            name: (*name).to_owned(),
            kind: match *name {
                "rows" | "first_row" | "places" => ColumnKind::Whole,
                "share" | "from_s" | "size" => ColumnKind::Real,
                _ => ColumnKind::Text,
            },
        };
        TableSchema {
            comments: Vec::new(),
            columns: ["subject", "condition", "run", "file"]
                .iter()
                .chain(names)
                .map(column)
                .collect(),
        }
    };
    let trouble = [
        "kind",
        "channel",
        "rows",
        "share",
        "places",
        "first_row",
        "from_s",
        "size",
        "unit",
        "what",
        "remedy",
    ];
    [
        ("preparation", schema(&["step", "what"])),
        ("trouble", schema(&trouble)),
    ]
}

/// A file, given by its name in the manifest, and the result of reading it.
pub(super) type ReadFile<'a> = (&'a Path, Result<CheckedRecord, String>);

/// Reads the file of a run and, if there is one, the file joined after it.
pub(super) fn read_files<'a>(
    manifest: &Manifest,
    base: &Path,
    entry: &'a RunEntry,
    pairing: Pairing,
) -> Vec<ReadFile<'a>> {
    let files = std::iter::once(&entry.file).chain(&entry.then);
    files
        .map(|file| {
            let read = read_file(manifest, &entry.condition, &base.join(file), pairing);
            (file.as_path(), read)
        })
        .collect()
}

/// A run, read and prepared according to the manifest.
pub(super) struct Run {
    pub record: Record,
    /// Time at which the second of two joined files starts, s.
    pub seam_s: Option<f64>,
    /// Factor by which the rate was reduced: the number of recorded samples per sample of the run.
    pub factor: usize,
    /// Time by which a sample of the input is later than the sample of the output in the same row, s.
    pub input_lead_s: f64,
    /// The recording before repair, for an identification; `None` for a run joined from two files, within which the
    /// task changes.
    pub recorded: Option<UnrepairedRun>,
}

/// A recorded run after preparation, but with its faults and at its recorded rate.
#[derive(Clone)]
pub(super) struct UnrepairedRun {
    pub record: Record,
    /// Preparation steps and quality issues of the run.
    pub account: Account,
}

impl Run {
    /// Converts a number of recorded samples to a number of samples of the run.
    pub fn run_samples(&self, recorded: f64) -> f64 {
        recorded / self.factor as f64
    }
}

/// Reads a run.
pub(super) fn read_run(manifest: &Manifest, base: &Path, entry: &RunEntry, pairing: Pairing) -> Result<Run, String> {
    join_files(read_files(manifest, base, entry, pairing))
}

/// A run as prepared for the analysis of its group, for use by other analyses.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedRun {
    /// The prepared record.
    pub record: Record,
    /// Time at which the task changes (in s): from the manifest, or the time at which two files are joined.
    pub change_s: Option<f64>,
}

impl RecordedRun {
    /// Reads and prepares a run of a manifest. File names are relative to `base`. Each row contains an e and the u that
    /// responds to it.
    ///
    /// # Errors
    /// [`StudyError::Recording`] with file, reason and remedy.
    pub fn read(manifest: &Manifest, base: &Path, entry: &RunEntry) -> Result<Self, StudyError> {
        let run =
            read_run(manifest, base, entry, Pairing::InTheLoop).map_err(|reason| StudyError::Recording { reason })?;
        let settings = manifest.conditions.get(&entry.condition);
        Ok(Self {
            record: run.record,
            change_s: run.seam_s.or(settings.and_then(|settings| settings.change_s)),
        })
    }
}

/// Returns the run of one file, or of two files joined.
pub(super) fn join_files(files: Vec<ReadFile<'_>>) -> Result<Run, String> {
    let mut run: Option<Run> = None;
    for (_, read) in files {
        let CheckedRecord {
            read, factor, recorded, ..
        } = read?;
        let record = read.record;
        let lead = |step: &Step| match step {
            Step::Rate { input_lead_s, .. } => *input_lead_s,
            _ => 0.0,
        };
        run = Some(match run {
            None => Run {
                record,
                seam_s: None,
                factor,
                input_lead_s: read.steps.iter().map(lead).sum(),
                recorded: Some(recorded),
            },
            Some(first) => Run {
                factor: first.factor,
                input_lead_s: first.input_lead_s,
                seam_s: Some(first.record.time_s(first.record.len())),
                record: first.record.joined(&record).map_err(|error| error.to_string())?,
                recorded: None,
            },
        });
    }
    run.ok_or_else(|| "no file is named".to_owned())
}

/// Returns two tables: the steps applied to the files of a run, and the problems of the files. A file that cannot be
/// read has no rows here; the table of estimates reports it.
pub(super) fn account_tables(entry: &RunEntry, files: &[ReadFile<'_>]) -> [(&'static str, OutputTable); 2] {
    let [(steps_name, steps), (trouble_name, trouble)] = schemas();
    let (mut steps, mut trouble) = (Rows::new(&steps), Rows::new(&trouble));
    for (file, read) in files {
        let Ok(CheckedRecord { read, faults, .. }) = read else {
            continue;
        };
        for fault in faults {
            start_row(&mut trouble, entry, file);
            trouble.set_text("kind", fault.kind.name());
            trouble.set_text("channel", &fault.channel);
            trouble.set_whole("rows", fault.samples as u64);
            trouble.set_real("share", fault.samples as f64 / read.record.len() as f64);
            trouble.set_whole("places", 1);
            trouble.set_real("from_s", fault.from_s);
            trouble.set_real("size", fault.size);
            trouble.set_text("what", &fault.to_string());
            trouble.set_text("remedy", fault.remedy());
        }
        for step in &read.steps {
            start_row(&mut steps, entry, file);
            steps.set_text("step", step.name());
            steps.set_text("what", &step.to_string());
        }
        for one in &read.quality_issues {
            start_row(&mut trouble, entry, file);
            trouble.set_text("kind", one.kind.name());
            trouble.set_text("channel", &one.channel);
            trouble.set_whole("rows", one.rows as u64);
            trouble.set_real("share", one.share);
            trouble.set_whole("places", one.row_spans.len() as u64);
            if let Some(place) = one.row_spans.first() {
                trouble.set_whole("first_row", place.row as u64);
                trouble.set_real("from_s", place.from_s.unwrap_or(f64::NAN));
            }
            trouble.set_real("size", one.size);
            trouble.set_text("unit", &one.unit);
            trouble.set_text("what", &one.text);
            trouble.set_text("remedy", one.kind.remedy());
        }
    }
    [
        (steps_name, steps.into_table(Vec::new())),
        (trouble_name, trouble.into_table(Vec::new())),
    ]
}

fn start_row(rows: &mut Rows, entry: &RunEntry, file: &Path) {
    rows.start_row();
    rows.set_text("subject", &entry.subject);
    rows.set_text("condition", &entry.condition);
    rows.set_text("run", &entry.run);
    rows.set_text("file", &file.display().to_string());
}
