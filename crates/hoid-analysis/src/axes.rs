//! Several axes in one recording: the operator of each axis, and the coupling between axes.
//!
//! A person who controls roll and pitch closes two loops, `u_x = Y_x e_x + C_xy e_y + n_x`. Each operator is first
//! identified from its own error and control, as if the other axis did not exist. The coupling C_xy is then tested as
//! an additional response of u_x to the error of the other axis (D. T. McRuer and D. K. Schmidt, *J. Guidance, Control,
//! and Dynamics* 13 (1990) 348-355).
//!
//! **Lines.** If targets excite both axes at the same frequencies, e_x and e_y are correlated, and a deficient form of
//! the operator looks like a coupling. The excitations of the axes must therefore be recorded and have different lines;
//! otherwise the coupling is reported as not tested.
//!
//! **Level.** Each pair of axes is tested in both directions: a coupling is reported if its p-value is below .01
//! divided by the number of tests (Bonferroni).

use std::str::FromStr;

use hoid_ident::{
    diagnostics::other_inputs::response_to,
    family::{ChannelRole, SeenChannel},
    frequency::{Excitation as Lines, LineDetectionOptions},
};
use hoid_model::{Channel, Finding, Record, Verdict, numbers::format_p_value};
use serde_json::{Map, Value, json};

use crate::{AnalysisError, Excitation, Identification, IdentifiedModel, Recordings, json};

/// Familywise significance level for reporting a coupling.
const FAMILYWISE_LEVEL: f64 = 0.01;
/// Relative difference below which two lines count as equal.
const LINE_TOLERANCE: f64 = 1e-3;
/// Value of `kind` in JSON.
pub const AXES_KIND: &str = "axes";

/// Error and control of an axis, and its recorded excitation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AxisPair {
    /// Column of the error.
    pub input: String,
    /// Column of the control.
    pub output: String,
    /// Column of the target or disturbance of this axis.
    pub excitation: Option<String>,
}

impl FromStr for AxisPair {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        match parts.as_slice() {
            [input, output, rest @ ..] if rest.len() < 2 && parts.iter().all(|part| !part.is_empty()) => Ok(Self {
                input: (*input).to_owned(),
                output: (*output).to_owned(),
                excitation: rest.first().map(|&name| name.to_owned()),
            }),
            _ => Err(format!(
                "found {text:?}, expected the error and control of an axis, such as ex,ux, optionally followed by its \
                 excitation, such as ex,ux,rx"
            )),
        }
    }
}

/// An axis with its operator and couplings.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Signals of the axis.
    pub pair: AxisPair,
    /// Operator of the axis.
    pub identified: IdentifiedModel,
    /// Responses of the control of this axis to the errors of the other axes.
    pub couplings: Vec<Coupling>,
}

/// A response of the control of one axis to the error of another.
#[derive(Debug, Clone, PartialEq)]
pub struct Coupling {
    /// Column of the error of the other axis.
    pub input: String,
    /// p-value of the response, or the reason why it was not tested.
    pub p_value: Result<f64, String>,
    /// True if the response is significant.
    pub responds: bool,
}

/// Identifies the operator of each axis from the recordings of the axis, and tests the couplings.
///
/// # Errors
/// The errors of [`check_axes`]; [`AnalysisError`] if an axis has no result.
pub fn axes(identification: &Identification, mut all: Vec<(AxisPair, Recordings)>) -> Result<Vec<Axis>, AnalysisError> {
    let pairs: Vec<AxisPair> = all.iter().map(|(pair, _)| pair.clone()).collect();
    check_axes(identification, &pairs)?;
    for x in 0..all.len() {
        for y in (0..all.len()).filter(|y| *y != x) {
            let name = &pairs[y].input;
            // The value of an expression such as r-y is not a channel of the other records.
            if all[x].1.records.iter().any(|record| record.channel(name).is_none()) {
                let other = all[y].1.records.clone();
                with_error(&mut all[x].1.records, name, &other)?;
            }
        }
    }
    let tests = pairs.len() * (pairs.len() - 1);
    let mut found = Vec::with_capacity(all.len());
    for (pair, recordings) in all {
        let asked = Identification {
            excitation: match &pair.excitation {
                Some(name) => Excitation::Named(name.clone()),
                None => identification.excitation.clone(),
            },
            ..identification.clone()
        };
        let identified = asked.run(recordings)?;
        let others = pairs.iter().filter(|other| **other != pair);
        let couplings = others
            .map(|other| coupling(&asked, &identified, (&pair, other), tests))
            .collect();
        found.push(Axis {
            pair,
            identified,
            couplings,
        });
    }
    Ok(found)
}

/// Checks the axes before any file is read.
///
/// # Errors
/// [`AnalysisError::Options`] if there are fewer than two axes, if two axes share a column, or if there are further
/// inputs.
pub fn check_axes(identification: &Identification, pairs: &[AxisPair]) -> Result<(), AnalysisError> {
    let refuse = |reason: String| Err(AnalysisError::Options { reason });
    if pairs.len() < 2 {
        return refuse("pair: found one axis, expected two or more; for one axis, use input and output".to_owned());
    }
    for (k, pair) in pairs.iter().enumerate() {
        let shares = |other: &&AxisPair| other.input == pair.input || other.output == pair.output;
        if let Some(twice) = pairs[..k].iter().find(shares) {
            return refuse(format!(
                "pair: {},{} and {},{} share a column; give each axis its own error and control",
                twice.input, twice.output, pair.input, pair.output
            ));
        }
    }
    if !identification.estimator.channels.is_empty() {
        return refuse("pair: an axis has one input; drop the roles of further inputs".to_owned());
    }
    Ok(())
}

/// Adds the error of another axis as a channel to the records that do not contain it and have the same length.
fn with_error(records: &mut [Record], name: &str, other: &[Record]) -> Result<(), AnalysisError> {
    for (record, of) in records.iter_mut().zip(other) {
        if record.channel(name).is_none() && record.len() == of.len() {
            let channel = Channel::new(name, "", of.input().to_vec());
            *record = record.clone().with_channel(channel)?;
        }
    }
    Ok(())
}

/// Tests whether the control of an axis responds to the error of another axis.
fn coupling(
    asked: &Identification,
    identified: &IdentifiedModel,
    (pair, other): (&AxisPair, &AxisPair),
    tests: usize,
) -> Coupling {
    let records = &identified.data.records;
    let tested = check_separate_lines(records, pair, other, asked.period_s).and_then(|()| {
        let channel = SeenChannel::new(other.input.clone(), ChannelRole::Feedforward);
        response_to(&asked.estimator, &identified.fit, records, channel)
            .map(|(found, _)| found.p_value)
            .ok_or_else(|| {
                format!(
                    "{} cannot be fitted as an input together with {}",
                    other.input, pair.input
                )
            })
    });
    Coupling {
        input: other.input.clone(),
        responds: tested.as_ref().is_ok_and(|p| *p < FAMILYWISE_LEVEL / tests as f64),
        p_value: tested,
    }
}

/// Checks that the excitations of two axes have different lines; the error is the reason why their responses cannot be
/// separated.
fn check_separate_lines(
    records: &[Record],
    pair: &AxisPair,
    other: &AxisPair,
    period_s: Option<f64>,
) -> Result<(), String> {
    let (Some(own), Some(of_other)) = (&pair.excitation, &other.excitation) else {
        return Err("the excitation is not given for both axes; add it to each pair, as in ex,ux,rx".to_owned());
    };
    let search = LineDetectionOptions {
        period_s,
        ..LineDetectionOptions::default()
    };
    for record in records {
        let lines = |name: &String| {
            let found = Lines::detect(record, name, &search).map_err(|error| error.to_string())?;
            Ok::<_, String>(found.omega_rad_s())
        };
        let (here, there) = (lines(own)?, lines(of_other)?);
        let shared = here
            .iter()
            .find(|a| there.iter().any(|b| (*a / b - 1.0).abs() < LINE_TOLERANCE));
        if let Some(omega) = shared {
            return Err(format!(
                "{own} and {of_other} share the line at {omega:.3} rad/s: give each axis its own lines"
            ));
        }
    }
    Ok(())
}

impl Axis {
    /// Returns the verdict on the operator of the axis, with a note for each significant coupling.
    pub fn verdict(&self) -> Verdict {
        let notes = self
            .couplings
            .iter()
            .filter(|coupling| coupling.responds)
            .map(|coupling| {
                let chance = format_p_value(coupling.p_value.as_ref().map_or(1.0, |p| *p));
                Finding::note(
                    "axis-coupling",
                    format!(
                        "{} responds to {} as well ({chance}): the axes are coupled",
                        self.pair.output, coupling.input
                    ),
                )
            });
        self.identified.verdict.clone().append(notes)
    }
}

/// Returns the axes as a JSON object: the result of each axis with its couplings.
///
/// # Errors
/// The errors of converting an operator to JSON.
pub fn axes_json(all: &[Axis]) -> Result<Map<String, Value>, AnalysisError> {
    let coupling = |coupling: &Coupling| {
        json!({
            "input": coupling.input,
            "tested": coupling.p_value.is_ok(),
            "reason": coupling.p_value.as_ref().err(),
            "p_value": coupling.p_value.as_ref().ok().map(|p| json::number(*p)),
            "responds": coupling.responds,
        })
    };
    let axis = |axis: &Axis| {
        let mut result = axis.identified.json()?;
        result.insert("verdict".to_owned(), json::verdict(&axis.verdict()));
        Ok::<_, AnalysisError>(json!({
            "input": axis.pair.input,
            "output": axis.pair.output,
            "excitation": axis.pair.excitation,
            "coupling": axis.couplings.iter().map(coupling).collect::<Vec<_>>(),
            "result": result,
        }))
    };
    let each = all.iter().map(axis).collect::<Result<Vec<_>, _>>()?;
    let mut map = Map::new();
    map.insert("hoid".to_owned(), json!(env!("CARGO_PKG_VERSION")));
    map.insert("kind".to_owned(), json!(AXES_KIND));
    map.insert("axes".to_owned(), Value::Array(each));
    Ok(map)
}
