//! A fit of an operator as printed by `hoid identify --json`, read as a prior or an initial state.
//!
//! The JSON object contains more data than are read here; unknown keys are ignored, so files from later versions can be
//! read.

use std::path::Path;

use hoid_model::{
    FamilyOperator, FittedOperator, Form, NamedChoice, SampleTime, Verdict, VerdictLevel, family_scenario::Feedforward,
    uncertainty::Estimate,
};
use serde::Deserialize;

use crate::{IoError, read_settings};

/// A parameter of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FitParameter {
    /// Name of the parameter.
    pub name: String,
    /// Value and standard error.
    pub estimate: Estimate,
    /// True if the data determine the parameter.
    pub determined: bool,
}

/// Contents of a fit file.
#[derive(Debug, Clone, PartialEq)]
pub struct FitFile {
    /// Parameters of the fit that have a value.
    pub parameters: Vec<FitParameter>,
    /// Response to the target; `None` unless the fit has exactly one feedforward input.
    pub feedforward: Option<Feedforward>,
    operator: Result<FittedOperator, String>,
    source: String,
}

impl FitFile {
    /// Returns the operator with its covariance.
    ///
    /// # Errors
    /// [`IoError::NoFit`] for a fit of another structure, without covariance, or without determined parameters.
    pub fn operator(self) -> Result<FittedOperator, IoError> {
        self.operator.map_err(|reason| no_fit_error(&self.source, reason))
    }
}

/// True if a name has the extension of a fit file.
pub fn is_fit_file(name: &str) -> bool {
    Path::new(name)
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("json"))
}

/// Reads a fit from its file.
///
/// # Errors
/// [`IoError::Unreadable`]; [`IoError::NoFit`].
pub fn read_fit(path: &Path) -> Result<FitFile, IoError> {
    parse_fit(&read_settings(path)?, &path.display().to_string())
}

/// Reads a fit from the text of its file.
///
/// # Errors
/// [`IoError::NoFit`] for text that is not such a fit.
pub fn parse_fit(text: &str, source: &str) -> Result<FitFile, IoError> {
    let found: FitObject = serde_json::from_str(text).map_err(|error| no_fit_error(source, error.to_string()))?;
    let of = |p: &ParameterObject| {
        Some(FitParameter {
            name: p.name.clone(),
            estimate: Estimate {
                value: p.value?,
                standard_error: p.standard_error,
            },
            determined: p.determined?,
        })
    };
    Ok(FitFile {
        parameters: found.parameters.iter().filter_map(of).collect(),
        feedforward: found.feedforward(),
        operator: found.operator(source),
        source: source.to_owned(),
    })
}

fn no_fit_error(source: &str, reason: String) -> IoError {
    IoError::NoFit {
        file: source.to_owned(),
        reason,
    }
}

#[derive(Deserialize)]
struct FitObject {
    parameters: Vec<ParameterObject>,
    #[serde(default)]
    verdict: Option<Verdict>,
    #[serde(default)]
    records: Vec<RecordObject>,
    structure: Option<String>,
    form: Option<String>,
    neuromuscular: Option<bool>,
    innovation_variance: Option<f64>,
    covariance: Option<CovarianceObject>,
    noise: Option<NoiseObject>,
    #[serde(default)]
    channels: Vec<ChannelObject>,
}

#[derive(Deserialize)]
struct ChannelObject {
    role: String,
    preview: Option<f64>,
    form: Option<String>,
    parameters: Option<Vec<ParameterObject>>,
}

#[derive(Deserialize)]
struct ParameterObject {
    name: String,
    value: Option<f64>,
    standard_error: Option<f64>,
    determined: Option<bool>,
}

#[derive(Deserialize)]
struct RecordObject {
    sample_time: Option<f64>,
    #[serde(default)]
    units: UnitsObject,
}

#[derive(Default, Deserialize)]
struct UnitsObject {
    input: String,
    output: String,
}

#[derive(Deserialize)]
struct CovarianceObject {
    coordinates: Vec<String>,
    values: Vec<f64>,
    matrix: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
struct NoiseObject {
    c: Vec<f64>,
    d: Vec<f64>,
}

impl FitObject {
    /// Returns the response to the target if there is a single one. In the file the delay `tau_f` is relative to the
    /// present target, and is negative if the person uses the future target; the delay in [`Feedforward`] is relative
    /// to the end of the preview.
    fn feedforward(&self) -> Option<Feedforward> {
        let mut seen = self.channels.iter().filter(|channel| channel.role == "feedforward");
        let channel = seen.next().filter(|_| seen.next().is_none())?;
        let form = Form::from_name(channel.form.as_deref()?).ok()?;
        let own = channel.parameters.as_ref()?;
        let value = |name: &str| {
            let named = |all: &[ParameterObject]| all.iter().find(|p| p.name == name).and_then(|p| p.value);
            named(own).or_else(|| named(&self.parameters))
        };
        let tau_f_s = value("tau_f")?;
        let preview_s = channel.preview.unwrap_or(0.0).max(-tau_f_s);
        // Parameters that are products of other parameters are omitted.
        let is_own = |name: &&str| !(*name == "K_e_dot" || *name == "K" && form.has_lag());
        let names = form.parameters(self.neuromuscular?).into_iter().filter(is_own);
        let pairs: Option<Vec<(String, f64)>> = names
            .map(|name| {
                let found = if name == "tau_e" {
                    Some(tau_f_s + preview_s)
                } else {
                    value(name)
                };
                Some((name.to_owned(), found?))
            })
            .collect();
        let operator = FamilyOperator::from_names(form, &pairs?).ok()?;
        Some(Feedforward::new(operator, preview_s))
    }

    fn operator(self, source: &str) -> Result<FittedOperator, String> {
        let Some(form) = self.form else {
            return Err(format!(
                "it is a fit of the structure {}, which has no operator form",
                self.structure.as_deref().unwrap_or("?")
            ));
        };
        if let Some(verdict) = self
            .verdict
            .filter(|verdict| verdict.level == VerdictLevel::NotDetermined)
        {
            let reasons: Vec<&str> = verdict.reasons().collect();
            return Err(format!("its operator is not determined: {}", reasons.join("; ")));
        }
        let form = Form::from_name(&form).map_err(|error| error.to_string())?;
        let covariance = self.covariance.ok_or("it has no covariance")?;
        let neuromuscular = self.neuromuscular.ok_or("it has no key `neuromuscular`")?;
        let names: Vec<&str> = form.coordinates(neuromuscular).iter().map(|c| c.name()).collect();
        if covariance.coordinates != names {
            return Err(format!(
                "its covariance has the coordinates {}, expected {} for the form {form}",
                covariance.coordinates.join(", "),
                names.join(", ")
            ));
        }
        let record = self.records.first().ok_or("it has no record")?;
        let sample_time = record.sample_time.ok_or("its record has no sample_time")?;
        let operator = FamilyOperator::new(form, neuromuscular, &covariance.values).map_err(|e| e.to_string())?;
        let noise = self.noise.ok_or("it has no noise model")?;
        let fitted = FittedOperator {
            operator,
            covariance: covariance.matrix.into_iter().flatten().collect(),
            noise: (noise.c, noise.d),
            innovation_variance: self.innovation_variance.ok_or("it has no innovation_variance")?,
            sample_time: SampleTime::new(sample_time).map_err(|e| e.to_string())?,
            units: [record.units.input.clone(), record.units.output.clone()],
            source: source.to_owned(),
        };
        fitted.checked().map_err(|e| e.to_string())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn feedforward_delay_includes_the_preview() {
        let of = |channels: &str| {
            let text = FIT_JSON.trim_end().strip_suffix('}').unwrap();
            parse_fit(&format!("{text}, \"channels\": [{channels}]}}"), "fit.json")
                .unwrap()
                .feedforward
        };
        let channel = |role: &str, form: Option<&str>, tau_f: f64, preview: f64| {
            let named = [
                ("K_e", 0.5),
                ("K_d", 0.2),
                ("T_L", 0.4),
                ("omega_nm", 10.0),
                ("zeta_nm", 0.3),
                ("tau_f", tau_f),
            ];
            let parameters = named.map(|(name, value)| serde_json::json!({ "name": name, "value": value }));
            serde_json::json!({ "role": role, "preview": preview, "form": form, "parameters": parameters }).to_string()
        };
        for (form, tau_f, preview, delay, ahead) in [
            ("derivative", 0.2, 0.0, 0.2, 0.0),
            ("lead", -0.5, 0.25, 0.0, 0.5),
            ("derivative-lead", -0.1, 0.25, 0.15, 0.25),
        ] {
            let seen = of(&channel("feedforward", Some(form), tau_f, preview)).unwrap();
            assert!((seen.operator.tau_e_s() - delay).abs() < 1e-12, "{form}");
            assert_eq!(seen.preview_s, ahead, "{form}");
            assert_eq!(
                seen.operator.neuromuscular_parameters().map(|(omega, _)| omega.round()),
                Some(10.0)
            );
        }
        let one = channel("feedforward", Some("derivative"), 0.2, 0.0);
        assert_eq!(of(""), None);
        assert_eq!(of(&channel("feedback", Some("derivative"), 0.2, 0.0)), None);
        assert_eq!(of(&channel("feedforward", None, 0.2, 0.0)), None);
        assert_eq!(of(&format!("{one}, {one}")), None);
    }

    const FIT_JSON: &str = r#"{"hoid": "0.1.0", "structure": "grey-box", "form": "gain", "neuromuscular": true,
        "verdict": {"level": "doubtful", "reasons": ["few seconds"]},
        "records": [{"file": "a.csv", "sample_time": 0.01, "units": {"input": "deg", "output": "mm"}}],
        "parameters": [{"name": "K", "value": 2.0, "standard_error": 0.1, "determined": true},
                       {"name": "T_I", "value": null, "standard_error": null, "determined": false}],
        "noise": {"c": [], "d": [-0.9]}, "innovation_variance": 0.1,
        "covariance": {"coordinates": ["gain", "ln omega_nm", "ln zeta_nm", "tau_e"], "values": [2.0, 2.4, -1.2, 0.2],
                       "matrix": [[0.01, 0, 0, 0], [0, 0.01, 0, 0], [0, 0, 0.01, 0], [0, 0, 0, 0.0001]]}}"#;

    fn refusal(text: &str) -> String {
        let found = parse_fit(text, "fit.json").and_then(FitFile::operator);
        found.unwrap_err().to_string()
    }

    #[test]
    fn a_fit_is_read_with_its_covariance_and_units() {
        let found = parse_fit(FIT_JSON, "fit.json").unwrap();
        assert_eq!(found.parameters.len(), 1);
        assert!(found.parameters[0].determined);
        let fit = found.operator().unwrap();
        assert_eq!(fit.operator.form(), Form::Gain);
        assert_eq!((fit.covariance.len(), fit.covariance[15]), (16, 0.0001));
        assert_eq!((fit.noise.1[0], fit.sample_time), (-0.9, SampleTime::AT_100_HZ));
        assert_eq!(fit.units, ["deg", "mm"]);
    }

    #[test]
    fn errors_give_the_reason_for_unusable_fits() {
        assert!(refusal("{}").contains("parameters") && refusal("[1").contains("hoid identify --json"));
        for (from, to, expected) in [
            (r#""form": "gain", "#, "", "structure grey-box"),
            ("doubtful", "not determined", "few seconds"),
            (
                r#""doubtful", "reasons": ["few seconds"]"#,
                r#""not determined", "reasons": [{"kind": "too-few", "severity": "undetermined", "message": "few s"}]"#,
                "few s",
            ),
            (
                r#""gain", "ln omega_nm""#,
                r#""ln omega_nm", "gain""#,
                "covariance has the coordinates",
            ),
            (r#""sample_time": 0.01, "#, "", "sample_time"),
            ("[0.01, 0, 0, 0]", "[0.01, 0, 0]", "expected 16"),
            ("\"gain\", \"neuro", "\"curve\", \"neuro", "curve"),
        ] {
            let reason = refusal(&FIT_JSON.replace(from, to));
            assert!(reason.contains(expected), "{expected}: {reason}");
        }
    }
}
