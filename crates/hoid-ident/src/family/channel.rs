//! A further input of the person: request, form and results.

use std::{fmt, str::FromStr};

use hoid_model::{Complex64, FamilyOperator, Form, SampleTime, UnknownName, uncertainty::Estimate};

use super::{intersample::Intersample, layout::ChannelInLayout, parameter::Parameter};
use crate::ResponsePoint;

/// Role of a further input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ChannelRole {
    /// A target that the person sees.
    #[default]
    Feedforward,
    /// Motion of the machine that the person feels.
    Motion,
    /// The output of the machine, which the person sees in addition to the error.
    Output,
}

hoid_model::named_choice!(ChannelRole, "role of a channel", 3, {
    Feedforward => "feedforward",
    Motion => "motion",
    Output => "output",
});

impl ChannelRole {
    /// True if the channel enters the loop from outside. The output of the machine and its motion do not: they have the
    /// lines of all excitations, and contain the remnant.
    pub fn excites(self) -> bool {
        self == Self::Feedforward
    }

    /// Forms that are compared for a channel with this role.
    pub fn forms(self) -> &'static [Form] {
        match self {
            Self::Feedforward | Self::Output => &Form::TARGET_FORMS,
            Self::Motion => &Form::MOTION_FORMS,
        }
    }
}

/// A requested further input.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenChannel {
    /// Name of the channel in the records.
    pub name: String,
    /// Role of the channel.
    pub role: ChannelRole,
    /// Preview time, s.
    pub preview_s: f64,
    /// Candidate forms. If there are several forms, the absence of a response is also a candidate.
    pub forms: Vec<Form>,
}

impl SeenChannel {
    /// Creates a request with the default options.
    pub fn new(name: impl Into<String>, role: ChannelRole) -> Self {
        Self {
            name: name.into(),
            role,
            preview_s: 0.0,
            forms: role.forms().to_vec(),
        }
    }
}

impl fmt::Display for SeenChannel {
    /// Formats the request as on the command line: `r=feedforward:0.5`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.name, self.role)?;
        if self.preview_s > 0.0 {
            write!(f, ":{}", self.preview_s)?;
        }
        match self.forms.as_slice() {
            [only] => write!(f, "/{only}"),
            _ => Ok(()),
        }
    }
}

impl FromStr for SeenChannel {
    type Err = String;

    /// Parses `NAME`, `NAME=ROLE` or `NAME=ROLE:PREVIEW`, each optionally followed by `/FORM`.
    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || "NAME=ROLE, such as r=feedforward, r=feedforward:0.5 or r=feedforward/derivative".to_owned();
        let (text, form) = match text.split_once('/') {
            Some((head, form)) => (head, Some(form)),
            None => (text, None),
        };
        let (name, role) = text.split_once('=').unwrap_or((text, ChannelRole::default().name()));
        let (role, shown) = match role.split_once(':') {
            Some((role, shown)) => (role, Some(shown)),
            None => (role, None),
        };
        if name.trim().is_empty() {
            return Err(expected());
        }
        let one_of = |unknown: UnknownName| format!("a {}: {}", unknown.what, unknown.expected);
        let role = role.trim().parse::<ChannelRole>().map_err(one_of)?;
        let mut channel = Self::new(name.trim(), role);
        if let Some(shown) = shown {
            let seconds = shown.trim().trim_end_matches('s').parse::<f64>();
            channel.preview_s = seconds
                .ok()
                .filter(|s| *s >= 0.0 && s.is_finite())
                .ok_or_else(expected)?;
        }
        if let Some(form) = form {
            channel.forms = vec![form.trim().parse::<Form>().map_err(one_of)?];
        }
        Ok(channel)
    }
}

/// Results of a further input.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ChannelFit {
    /// Name of the channel.
    pub name: String,
    /// Role of the channel.
    pub role: ChannelRole,
    /// Preview time, s.
    pub preview_s: f64,
    /// The forms that were compared, including the absence of a response.
    pub forms: Vec<ChannelForm>,
    /// Probability of a likelihood ratio at least as large as for the best form if there is no response, corrected for
    /// the number of forms.
    pub p_value: f64,
    /// The response; `None` if none was found.
    pub response: Option<ChannelResponse>,
}

/// A candidate form of a channel, with its criteria.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ChannelForm {
    /// The form; `None` for no response.
    pub form: Option<Form>,
    /// Loss of the prediction error fit; `None` if the forms were compared at the lines or the fit failed.
    pub loss: Option<f64>,
    /// Akaike's criterion minus that of the best candidate; without lines, the log-likelihood is divided by the
    /// inflation kappa.
    pub criterion: Option<f64>,
}

/// The response of the person to a channel.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ChannelResponse {
    /// Operator of the response; its delay is relative to the end of the preview.
    pub operator: FamilyOperator,
    /// Covariance of the coordinates of the operator by rows.
    pub covariance: Option<Vec<f64>>,
    /// Parameters of the operator. The delay `tau_f` is relative to the current value of the channel; it is negative if
    /// the person anticipates.
    pub parameters: Vec<Parameter>,
}

impl ChannelFit {
    /// Returns the gain and phase of the response to the channel at frequencies in rad/s; `None` if there is no
    /// response.
    pub fn frequency_response(
        &self,
        omega_rad_s: &[f64],
        (sample_time, intersample): (SampleTime, Intersample),
    ) -> Option<Vec<ResponsePoint>> {
        let of = self.response.as_ref()?;
        let point = |&omega: &f64| {
            let found = of.operator.response_and_gradient(omega);
            let held = found.value
                * intersample.response(omega, sample_time)
                * Complex64::from_polar(1.0, omega * self.preview_time_s(sample_time));
            let relative = of.covariance.as_deref().map(|c| found.relative_covariance(c));
            let error = |part: usize| relative.map(|c| c[part][part].max(0.0).sqrt());
            ResponsePoint {
                omega_rad_s: omega,
                magnitude_db: Estimate {
                    value: 20.0 * held.norm().log10(),
                    standard_error: error(0).map(|e| e * 20.0 / std::f64::consts::LN_10),
                },
                phase_deg: Estimate {
                    value: held.arg().to_degrees(),
                    standard_error: error(1).map(f64::to_degrees),
                },
            }
        };
        Some(omega_rad_s.iter().map(point).collect())
    }

    /// Returns the preview time in s, rounded to whole samples.
    pub(super) fn preview_time_s(&self, sample_time: SampleTime) -> f64 {
        preview_samples(self.preview_s, sample_time) as f64 * sample_time.s()
    }
}

impl ChannelFit {
    /// Creates the result of a further input from the comparison of its forms; the response is added later.
    pub(super) fn from_comparison(asked: &SeenChannel, forms: Vec<ChannelForm>, p_value: f64) -> Self {
        Self {
            name: asked.name.clone(),
            role: asked.role,
            preview_s: asked.preview_s,
            forms,
            p_value,
            response: None,
        }
    }
}

/// Returns the preview in samples.
pub(super) fn preview_samples(preview_s: f64, sample_time: SampleTime) -> usize {
    (preview_s / sample_time.s()).round() as usize
}

/// A further input in one form, as part of a prediction model.
#[derive(Debug, Clone)]
pub(super) struct Channel<'a> {
    /// Index of the input among the requested channels.
    pub index: usize,
    pub form: Form,
    /// Bounds of the coordinates that only this channel has.
    pub limits: Vec<(f64, f64)>,
    pub start: Vec<f64>,
    /// Values of the channel in each record.
    pub values: Vec<&'a [f64]>,
}

impl Channel<'_> {
    pub fn layout_entry(&self) -> ChannelInLayout {
        ChannelInLayout {
            form: self.form,
            limits: self.limits.clone(),
            start: self.start.clone(),
            place: 0,
        }
    }
}
