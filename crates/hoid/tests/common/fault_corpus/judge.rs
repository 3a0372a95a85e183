//! Assessment of a result by comparison with the true values.
//!
//! The error of a parameter is its distance from the true value in its own standard errors; a delay that is estimated
//! only in whole samples has a standard error of one sample. A parameter that is reported as not determined, or has no
//! standard error, is not assessed.
//!
//! A trace is wrong if it is wrong at its last row or [`RECOVERY_CHECK_S`] after the fault. Its recovery time is the
//! time from the end of the fault to the last row in which a parameter differs by more than [`MAX_RECOVERED_ERRORS`] of
//! its standard errors and by more than [`MAX_RECOVERED_RELATIVE_ERROR`] of its true value. Its lasting error is the
//! largest error that it had for [`MIN_LASTING_S`] without interruption.

use serde_json::Value;

use super::bases::Truth;

/// Number of standard errors from which a value is wrong.
pub const WRONG_LIMIT_ERRORS: f64 = 4.0;
/// Largest distance of a report from its fault, s.
pub const MAX_REPORT_DISTANCE_S: f64 = 1.0;
/// Time after the fault at which a trace is examined again, s.
pub const RECOVERY_CHECK_S: f64 = 20.0;
const MAX_RECOVERED_ERRORS: f64 = 2.5;
const MAX_RECOVERED_RELATIVE_ERROR: f64 = 0.1;
const MIN_LASTING_S: f64 = 5.0;
/// Findings that only report faults of the recording.
const FAULT_FINDINGS: [&str; 4] = ["faults", "held-back", "hostile-span", "restarted"];

/// Known properties of a case.
#[derive(Debug, Clone)]
pub struct CaseTruth {
    pub truth: Truth,
    /// True values after the fault, if another person acts from then on.
    pub then: Option<Truth>,
    /// Span of the fault (s); `None` in a clean run.
    pub span_s: Option<(f64, f64)>,
    /// Name of the file with the fault.
    pub file: String,
    pub sample_time: f64,
}

/// The assessment of one result.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CaseOutcome {
    /// The parameter with the largest error, and its error in standard errors.
    pub worst: Option<(String, f64)>,
    pub wrong: bool,
    /// The verdict in one word; "rejected" if there is no result.
    pub level: String,
    /// Kinds of the findings against the result.
    pub kinds: Vec<String>,
    /// True if a finding other than a note reports faults.
    pub of_faults: bool,
    /// Number of reported faults; `placed` is true if one of them is at the right place.
    pub told: usize,
    pub placed: bool,
    /// For traces: time until the trace stayed near the true values (s); infinite if it never did.
    pub recovery_s: Option<f64>,
    /// For traces: the largest lasting error, in standard errors.
    pub lasting: Option<f64>,
}

impl CaseOutcome {
    /// Outcome for a record that the program rejects.
    pub fn refused() -> Self {
        Self {
            level: "refused".to_owned(),
            ..Self::default()
        }
    }

    /// True if the user is warned.
    pub fn is_flagged(&self) -> bool {
        self.level != "trustworthy" || self.placed
    }

    /// True for the outcome that must not occur: a wrong result that is not flagged.
    pub fn is_silently_wrong(&self) -> bool {
        self.wrong && !self.is_flagged()
    }
}

/// One parameter: its value, and its standard error if it has one.
pub type Claim = (String, f64, f64);

/// A row of a trace.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub t: f64,
    pub claims: Vec<Claim>,
}

/// Assesses a fit from the output of the program.
pub fn judge_fit(json: &Value, known: &CaseTruth) -> CaseOutcome {
    let claims = parse_claims(json, known);
    let worst = worst_claim(&claims, &known.truth);
    CaseOutcome {
        wrong: worst.as_ref().is_some_and(|(_, z)| *z > WRONG_LIMIT_ERRORS),
        worst,
        ..verdict_outcome(json, known)
    }
}

/// Assesses a trace.
pub fn judge_trace(json: &Value, rows: &[Row], known: &CaseTruth) -> CaseOutcome {
    let truth_at = |t: f64| match (&known.then, known.span_s) {
        (Some(then), Some((from, _))) if t >= from => then,
        _ => &known.truth,
    };
    let worst_at = |row: &Row| worst_claim(&row.claims, truth_at(row.t));
    let span_end = known.span_s.map_or(0.0, |(_, to)| to);
    let later = rows
        .iter()
        .find(|row| known.span_s.is_some() && row.t >= span_end + RECOVERY_CHECK_S);
    let looked_at = [rows.last(), later].into_iter().flatten();
    let worst = looked_at.filter_map(worst_at).max_by(|a, b| a.1.total_cmp(&b.1));
    let span_start = known.span_s.map_or(0.0, |(from, _)| from);
    let errors: Vec<(f64, f64)> = rows
        .iter()
        .filter(|row| row.t >= span_start)
        .map(|row| (row.t, worst_at(row).map_or(0.0, |(_, z)| z)))
        .collect();
    let recovery_s = known.span_s.and_then(|_| {
        let after: Vec<&Row> = rows.iter().filter(|row| row.t >= span_end).collect();
        let far = |row: &&&Row| !has_recovered(&row.claims, truth_at(row.t));
        let last = after.last()?.t;
        // A trace that ends with the fault, or soon after it, has no recovery time.
        (last - span_end > 1.0).then(|| match after.iter().rfind(far) {
            Some(row) if row.t >= last => f64::INFINITY,
            Some(row) => row.t - span_end,
            None => 0.0,
        })
    });
    CaseOutcome {
        wrong: worst.as_ref().is_some_and(|(_, z)| *z > WRONG_LIMIT_ERRORS),
        worst,
        recovery_s,
        lasting: lasting_error(&errors),
        ..verdict_outcome(json, known)
    }
}

/// Returns the verdict and the reported faults of any result.
fn verdict_outcome(json: &Value, known: &CaseTruth) -> CaseOutcome {
    let verdict = &json["verdict"];
    let findings = verdict["findings"].as_array().map_or(&[][..], Vec::as_slice);
    let graver = findings.iter().filter(|f| f["severity"] != "note");
    let kinds: Vec<String> = graver.filter_map(|f| Some(f["kind"].as_str()?.to_owned())).collect();
    let faults = json["faults"].as_array().map_or(&[][..], Vec::as_slice);
    let of_file = |fault: &&Value| match fault["record"].as_str() {
        Some(record) => record.ends_with(&known.file),
        None => true,
    };
    let meets = |fault: &Value| {
        let Some((from, to)) = known.span_s else { return false };
        // A fault of the whole file, such as a wrong unit of time, has no place.
        let begins = fault["from"].as_f64().unwrap_or(0.0);
        let ends = fault["to"].as_f64().unwrap_or(f64::INFINITY);
        begins <= to + MAX_REPORT_DISTANCE_S && ends >= from - MAX_REPORT_DISTANCE_S
    };
    CaseOutcome {
        level: verdict["level"].as_str().unwrap_or("none").to_owned(),
        of_faults: kinds.iter().any(|kind| FAULT_FINDINGS.contains(&kind.as_str())),
        kinds,
        told: faults.len(),
        placed: faults.iter().filter(of_file).any(meets),
        ..CaseOutcome::default()
    }
}

fn parse_claims(json: &Value, known: &CaseTruth) -> Vec<Claim> {
    let named = |name: &str| {
        let listed = json["parameters"]
            .as_array()
            .and_then(|all| all.iter().find(|p| p["name"] == name));
        let of = if json["operator"][name].is_object() {
            &json["operator"][name]
        } else {
            listed?
        };
        if of["determined"] == Value::Bool(false) {
            return None;
        }
        let grid = (name == "tau_e").then_some(known.sample_time);
        let error = of["standard_error"].as_f64().filter(|s| *s > 0.0).or(grid)?;
        Some((name.to_owned(), of["value"].as_f64()?, error))
    };
    known.truth.iter().filter_map(|(name, _)| named(name)).collect()
}

fn worst_claim(claims: &[Claim], truth: &Truth) -> Option<(String, f64)> {
    let off = |(name, value, error): &Claim| {
        let (_, own) = truth.iter().find(|(known, _)| known == name)?;
        Some((name.clone(), (value - own).abs() / error))
    };
    claims.iter().filter_map(off).max_by(|a, b| a.1.total_cmp(&b.1))
}

fn has_recovered(claims: &[Claim], truth: &Truth) -> bool {
    let near = |(name, value, error): &Claim| {
        truth.iter().find(|(known, _)| known == name).is_none_or(|(_, own)| {
            let off = (value - own).abs();
            off <= MAX_RECOVERED_ERRORS * error || off <= MAX_RECOVERED_RELATIVE_ERROR * own.abs()
        })
    };
    !claims.is_empty() && claims.iter().all(near)
}

/// Returns the largest error that lasted for [`MIN_LASTING_S`], from pairs of time and error.
fn lasting_error(errors: &[(f64, f64)]) -> Option<f64> {
    let (first, last) = (errors.first()?.0, errors.last()?.0);
    if last - first < MIN_LASTING_S {
        return None;
    }
    let step = (last - first) / (errors.len() - 1) as f64;
    let rows = ((MIN_LASTING_S / step).round() as usize).max(1);
    let least = |window: &[(f64, f64)]| window.iter().map(|(_, z)| *z).fold(f64::INFINITY, f64::min);
    errors.windows(rows).map(least).max_by(f64::total_cmp)
}
