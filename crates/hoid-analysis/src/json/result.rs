//! Conversion of a result to JSON and back.

use hoid_ident::{GreyBoxFit, SigmoidFit};
use hoid_io::{QualityIssue, QualityIssueKind, RowSpan};
use hoid_model::{ContinuousTransferFunction, Decimation, Detrend, Fault, Verdict, uncertainty::Estimate};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::{Map, Value, json};

use super::state;
use crate::{
    AnalysisError,
    answers::Answers,
    estimators::PolynomialFit,
    identified::IdentifiedModel,
    recordings::{Account, Recordings},
    registry,
    settings::Setting,
};

/// Value of `kind` for an operator.
pub(super) const OPERATOR_KIND: &str = "operator";
/// Value of `kind` for a polynomial model.
pub(super) const POLYNOMIAL_KIND: &str = "polynomial";

/// A fit that can be written as JSON.
pub trait JsonFit: Answers + Serialize + DeserializeOwned {
    /// Name of the estimator of this fit in the registry.
    const ESTIMATOR: &'static str;

    /// Returns the JSON object, without the state.
    ///
    /// # Errors
    /// The errors of predicting the records.
    fn object(found: &IdentifiedModel<Self>) -> Result<Map<String, Value>, AnalysisError>;
}

/// The result of any batch fit.
#[derive(Debug, Clone)]
// The variants may differ greatly in size, because results are read one by one and not stored in large numbers.
#[allow(clippy::large_enum_variant)]
pub enum BatchResult {
    /// Operator of a person in the form that the evidence supports.
    Operator(IdentifiedModel),
    /// Operator with a gain and a lead, and a remnant of order m.
    Remnant(IdentifiedModel<GreyBoxFit>),
    /// An operator whose gains change once.
    Change(IdentifiedModel<SigmoidFit>),
    /// A polynomial model.
    Polynomials(IdentifiedModel<PolynomialFit>),
}

impl BatchResult {
    /// Reads a result written by [`IdentifiedModel::to_json`].
    ///
    /// # Errors
    /// [`AnalysisError::NotAResult`] if the text is invalid, damaged, or from another version.
    pub fn from_json(text: &str) -> Result<Self, AnalysisError> {
        let object = parse_object(text)?;
        let estimator = object.get("estimator").and_then(Value::as_str).unwrap_or_default();
        match estimator {
            registry::OPERATOR => restore_result(object).map(Self::Operator),
            registry::REMNANT => restore_result(object).map(Self::Remnant),
            registry::CHANGE => restore_result(object).map(Self::Change),
            registry::PEM => restore_result(object).map(Self::Polynomials),
            other => Err(not_a_result_error(match object.get("kind").and_then(Value::as_str) {
                // These objects do not contain the whole result.
                Some(kind @ ("trace" | "description" | "group" | "axes")) => {
                    format!("its kind is {kind}, whose JSON cannot be read back; run the analysis again")
                }
                _ => format!("its estimator is {other:?}"),
            })),
        }
    }
}

/// Serialised form of the findings in an account.
#[derive(Serialize, Deserialize)]
struct RecordFindings {
    faults: Vec<Fault>,
    #[serde(default)]
    quality_issues: Vec<Issue>,
    level: Option<Estimate>,
}

/// A quality issue with all its fields; the JSON object for users contains fewer fields.
#[derive(Serialize, Deserialize)]
struct Issue(#[serde(with = "IssueFields")] QualityIssue);

#[derive(Serialize, Deserialize)]
#[serde(remote = "QualityIssue")]
struct IssueFields {
    kind: QualityIssueKind,
    channel: String,
    rows: usize,
    share: f64,
    size: f64,
    unit: String,
    #[serde(rename = "places")]
    row_spans: Vec<RowSpan>,
    text: String,
}

/// Serialised form of a result.
#[derive(Serialize)]
struct SerializedResult<'a, F> {
    fit: &'a F,
    verdict: &'a Verdict,
    names: &'a [String],
    origins: &'a [usize],
    found_in: Vec<RecordFindings>,
    settings: &'a [Setting],
    controlled_element: &'a Option<ContinuousTransferFunction>,
    excitation: &'a Option<String>,
    taken_out: Detrend,
    rate: Decimation,
    counts_samples: bool,
}

#[derive(Deserialize)]
struct SavedResult<F> {
    fit: F,
    verdict: Verdict,
    names: Vec<String>,
    origins: Vec<usize>,
    found_in: Vec<RecordFindings>,
    settings: Vec<Setting>,
    controlled_element: Option<ContinuousTransferFunction>,
    excitation: Option<String>,
    taken_out: Detrend,
    rate: Decimation,
    counts_samples: bool,
}

impl RecordFindings {
    fn of(account: &Account) -> Self {
        Self {
            faults: account.faults.clone(),
            quality_issues: account.quality_issues.iter().cloned().map(Issue).collect(),
            level: account.level,
        }
    }

    fn account(self) -> Account {
        Account {
            faults: self.faults,
            quality_issues: self.quality_issues.into_iter().map(|Issue(issue)| issue).collect(),
            level: self.level,
            ..Account::default()
        }
    }
}

impl<F: JsonFit> IdentifiedModel<F> {
    /// Returns the JSON object of the result, including the state from which the result can be restored.
    ///
    /// # Errors
    /// The errors of predicting the records.
    pub fn json(&self) -> Result<Map<String, Value>, AnalysisError> {
        if let Some(written) = &self.source_json {
            return Ok(written.clone());
        }
        Ok(self.complete(F::object(self)?))
    }

    /// Adds to a JSON object of this result the state from which the result can be restored.
    pub fn complete(&self, mut map: Map<String, Value>) -> Map<String, Value> {
        map.insert("estimator".to_owned(), json!(F::ESTIMATOR));
        let state = SerializedResult {
            fit: &self.fit,
            verdict: &self.verdict,
            names: &self.data.names,
            origins: &self.data.origins,
            found_in: self.data.accounts.iter().map(RecordFindings::of).collect(),
            settings: &self.settings,
            controlled_element: &self.controlled_element,
            excitation: &self.excitation,
            taken_out: self.removed_trend,
            rate: self.rate,
            counts_samples: self.counts_samples,
        };
        let state = state::serialise(&state).map_or(Value::Null, Value::String);
        map.insert("state".to_owned(), state);
        map
    }

    /// Returns the JSON object as indented text.
    ///
    /// # Errors
    /// Same as [`Self::json`].
    pub fn to_json(&self) -> Result<String, AnalysisError> {
        Ok(format!("{:#}", Value::Object(self.json()?)))
    }

    /// Reads the output of [`Self::to_json`], which contains everything except the samples of the recordings. The
    /// restored model predicts, simulates and validates as before, on records supplied by the caller.
    ///
    /// # Errors
    /// [`AnalysisError::NotAResult`] if the text is invalid, damaged, or from another version or estimator.
    pub fn from_json(text: &str) -> Result<Self, AnalysisError> {
        restore_result(parse_object(text)?)
    }
}

/// Two results are equal if their serialised forms are equal.
impl<F: JsonFit> PartialEq for IdentifiedModel<F> {
    fn eq(&self, other: &Self) -> bool {
        matches!((self.json(), other.json()), (Ok(one), Ok(two)) if one == two)
    }
}

fn not_a_result_error(found: String) -> AnalysisError {
    AnalysisError::NotAResult { found }
}

fn parse_object(text: &str) -> Result<Map<String, Value>, AnalysisError> {
    match serde_json::from_str(text) {
        Ok(Value::Object(object)) => Ok(object),
        Ok(_) => Err(not_a_result_error("it is not an object".to_owned())),
        Err(error) => Err(not_a_result_error(format!("it is not JSON: {error}"))),
    }
}

fn restore_result<F: JsonFit>(object: Map<String, Value>) -> Result<IdentifiedModel<F>, AnalysisError> {
    let estimator = object.get("estimator").and_then(Value::as_str).unwrap_or_default();
    if estimator != F::ESTIMATOR {
        return Err(not_a_result_error(format!(
            "its estimator is {estimator:?}, expected {:?}",
            F::ESTIMATOR
        )));
    }
    let text = object.get("state").and_then(Value::as_str);
    let text = text.ok_or_else(|| not_a_result_error("it has no state".to_owned()))?;
    let read: SavedResult<F> = state::read(text).map_err(not_a_result_error)?;
    Ok(IdentifiedModel {
        fit: read.fit,
        verdict: read.verdict,
        data: Recordings {
            names: read.names,
            origins: read.origins,
            accounts: read.found_in.into_iter().map(RecordFindings::account).collect(),
            ..Recordings::default()
        },
        described: None,
        settings: read.settings,
        controlled_element: read.controlled_element,
        excitation: read.excitation,
        rate: read.rate,
        counts_samples: read.counts_samples,
        removed_trend: read.taken_out,
        source_json: Some(object),
    })
}
