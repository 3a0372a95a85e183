//! Runs of the program on a case; the output for the user is assessed.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use serde_json::Value;

use super::{
    bases::{Base, OperatorKind, base},
    inject::inject,
    judge::{self, CaseOutcome, CaseTruth, Row},
    kinds::{Change, Fault},
};

/// Time limit of a run of the program, s.
const TIMEOUT_S: u64 = 120;
/// Number of samples per row of a trace.
const SAMPLES_PER_ROW: &str = "10";

/// Method by which a record is evaluated, with default options.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EvaluationMethod {
    /// `identify --form` with the true form: the grey box.
    GreyBox,
    /// `identify --structure bj`.
    BoxJenkins,
    Adaptive,
    MultipleModel,
    Physical,
    Rls,
    Rpem,
}

impl EvaluationMethod {
    pub const ALL: [Self; 7] = [
        Self::GreyBox,
        Self::BoxJenkins,
        Self::Adaptive,
        Self::MultipleModel,
        Self::Physical,
        Self::Rls,
        Self::Rpem,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::GreyBox => "grey-box",
            Self::BoxJenkins => "bj",
            Self::Adaptive => "adaptive",
            Self::MultipleModel => "multiple-model",
            Self::Physical => "physical",
            Self::Rls => "rls",
            Self::Rpem => "rpem",
        }
    }

    pub fn is_tracker(self) -> bool {
        !matches!(self, Self::GreyBox | Self::BoxJenkins)
    }

    /// Returns the methods for a run. The grey box represents all operators, and the other methods represent a gain
    /// with a lead; for people, only the three methods intended for people are used.
    pub fn of(base: &Base) -> &'static [Self] {
        const METHODS_FOR_LEAD: [EvaluationMethod; 4] = [
            EvaluationMethod::GreyBox,
            EvaluationMethod::Adaptive,
            EvaluationMethod::MultipleModel,
            EvaluationMethod::Physical,
        ];
        match (base.who, base.form) {
            (OperatorKind::C1 | OperatorKind::C2, _) => &Self::ALL,
            (OperatorKind::Person, hoid::model::Form::Lead) => &METHODS_FOR_LEAD,
            (OperatorKind::Person, _) => &METHODS_FOR_LEAD[..1],
        }
    }
}

/// A fault in a run, evaluated in one way.
#[derive(Debug, Clone)]
pub struct Outcome {
    pub case: u64,
    pub fault: Fault,
    pub who: OperatorKind,
    pub label: String,
    pub way: EvaluationMethod,
    pub seconds: f64,
    pub judged: CaseOutcome,
    /// Message of the program if there is no result.
    pub refusal: Option<String>,
}

/// Evaluates a fault in the runs of `who` by each requested method that applies.
///
/// # Errors
/// Errors of the simulation or the file system.
pub fn evaluate_case(
    program: &Path,
    seed: u64,
    case: u64,
    fault: Fault,
    who: OperatorKind,
    ways: &[EvaluationMethod],
) -> Result<Vec<Outcome>, String> {
    let base = base(who, seed, case).map_err(|e| e.to_string())?;
    let folder = std::env::temp_dir().join(format!("hoid-faults-{}-{case}-{}", std::process::id(), who.name()));
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let (files, known) = write_case(&base, &fault, &folder, seed, case)?;
    let evaluated = |way: &EvaluationMethod| {
        let start_time = Instant::now();
        let found = run(program, *way, &base, &files, &known, &folder)?;
        let (judged, refusal) = match found {
            Ok(judged) => (judged, None),
            Err(message) => (CaseOutcome::refused(), Some(message)),
        };
        Ok(Outcome {
            case,
            fault,
            who,
            label: base.label.clone(),
            way: *way,
            seconds: start_time.elapsed().as_secs_f64(),
            judged,
            refusal,
        })
    };
    let all = EvaluationMethod::of(&base).iter().filter(|way| ways.contains(way));
    let all: Result<Vec<Outcome>, String> = all.map(evaluated).collect();
    fs::remove_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    all
}

/// Writes the files of a case, with the faulty file last, and returns the known properties of the case.
fn write_case(
    base: &Base,
    fault: &Fault,
    folder: &Path,
    seed: u64,
    case: u64,
) -> Result<(Vec<PathBuf>, CaseTruth), String> {
    let injected = inject(fault, &base.runs[base.faulty_run_index()], &base.second, seed, case);
    let mut files = Vec::new();
    for (i, run) in base.runs.iter().enumerate() {
        if i != base.faulty_run_index() {
            files.push((folder.join(format!("run{i}.csv")), run.to_csv()));
        }
    }
    files.push((folder.join("faulty.csv"), injected.table.to_csv()));
    for (file, text) in &files {
        fs::write(file, text).map_err(|e| format!("{}: {e}", file.display()))?;
    }
    let known = CaseTruth {
        truth: base.truth.clone(),
        then: (fault.kind.what == Change::SecondOperator).then(|| base.second_truth.clone()),
        span_s: (fault.kind.what != Change::Nothing).then_some((injected.from_s, injected.to_s)),
        file: "faulty.csv".to_owned(),
        sample_time: injected.table.h,
    };
    Ok((files.into_iter().map(|(file, _)| file).collect(), known))
}

/// Returns the assessment, or the message of the program if there is no result.
fn run(
    program: &Path,
    way: EvaluationMethod,
    base: &Base,
    files: &[PathBuf],
    known: &CaseTruth,
    folder: &Path,
) -> Result<Result<CaseOutcome, String>, String> {
    let trace = folder.join(format!("trace-{}.csv", way.name()));
    let mut command = Command::new(program);
    command.env("RAYON_NUM_THREADS", "1");
    match way {
        EvaluationMethod::GreyBox => command.arg("identify").args(files).args(["--form", base.form.name()]),
        EvaluationMethod::BoxJenkins => command.arg("identify").args(files).args(["--structure", "bj"]),
        _ => command
            .arg("track")
            .args(files.last())
            .args(["--method", way.name(), "--every", SAMPLES_PER_ROW, "--out"])
            .arg(&trace),
    };
    command.arg("--json");
    let (message, printed) = run_to_end(&mut command, folder)?;
    let Ok(json) = serde_json::from_str::<Value>(&printed) else {
        return Ok(Err(message));
    };
    if !way.is_tracker() {
        return Ok(Ok(judge::judge_fit(&json, known)));
    }
    let text = fs::read_to_string(&trace).map_err(|e| format!("{}: {e}", trace.display()))?;
    Ok(Ok(judge::judge_trace(&json, &parse_rows(&text), known)))
}

/// Returns the error stream and the output of a command, or the message if the command failed.
fn run_to_end(command: &mut Command, folder: &Path) -> Result<(String, String), String> {
    let (output, errors) = (folder.join("output"), folder.join("errors"));
    let create = |path: &Path| File::create(path).map_err(|e| format!("{}: {e}", path.display()));
    command
        .stdin(Stdio::null())
        .stdout(create(&output)?)
        .stderr(create(&errors)?);
    let mut child = command
        .spawn()
        .map_err(|e| format!("{}: {e}", command.get_program().display()))?;
    let start_time = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
            break status;
        }
        if start_time.elapsed() > Duration::from_secs(TIMEOUT_S) {
            child.kill().map_err(|e| e.to_string())?;
            child.wait().map_err(|e| e.to_string())?;
            return Ok((format!("took longer than {TIMEOUT_S} s"), String::new()));
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let read = |path: &Path| fs::read(path).map_err(|e| format!("{}: {e}", path.display()));
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    let (message, printed) = (text(read(&errors)?), text(read(&output)?));
    let message = format!("{status}: {}", message.trim());
    Ok((message, if status.success() { printed } else { String::new() }))
}

/// Returns the rows of a trace file: the time, and each column for which a column with the suffix `_se` exists.
pub fn parse_rows(text: &str) -> Vec<Row> {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap_or("").split(',').collect();
    let index = |name: &str| names.iter().position(|n| *n == name);
    let pairs: Vec<(&str, usize, usize)> = names
        .iter()
        .enumerate()
        .filter_map(|(i, name)| Some((*name, i, index(&format!("{name}_se"))?)))
        .collect();
    let row = |line: &str| {
        let cells: Vec<Option<f64>> = line.split(',').map(|cell| cell.parse().ok()).collect();
        let cell = |i: usize| cells.get(i).copied().flatten().filter(|x: &f64| x.is_finite());
        let claim = |(name, value, error): &(&str, usize, usize)| {
            Some(((*name).to_owned(), cell(*value)?, cell(*error).filter(|s| *s > 0.0)?))
        };
        Some(Row {
            t: cell(index("t")?)?,
            claims: pairs.iter().filter_map(claim).collect(),
        })
    };
    lines.filter_map(row).collect()
}
