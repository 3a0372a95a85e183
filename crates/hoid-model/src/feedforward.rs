//! Response of a person to a displayed target: `u = Y e + F f + remnant`.
//!
//! F has its own form, gains and delay. F shares the neuromuscular system of the response to the error (M. M. van
//! Paassen and M. Mulder, IFAC Man-Machine Systems, 1998; K. van der El et al., IEEE Trans. Cybernetics 46 (2016)
//! 1199-1209); if this system changes over time, it also changes in F. The gains, time constants and delay of F may
//! also change, with the sigmoid of the scenario.
//!
//! As text, a response consists of its form and the gain of this form, followed by other parameters by name:
//! `derivative:0.15,tau_f=0.1,preview=0.25`. tau_f is the delay relative to the present target; with a preview it may
//! be negative. `derivative:0.15..0.3` means `K_d = 0.15 s` before and 0.3 s after the change in the scenario.

use crate::{FamilyOperator, Form, ModelError, SampleTime, delayed_operator::whole_samples, schedule::Schedule};

/// Longest preview, s.
const LONGEST_PREVIEW_S: f64 = 60.0;
/// Largest sum of tau_f and preview, in s, that is attributed to rounding and counts as zero.
const ROUNDING_TOLERANCE_S: f64 = 1e-12;

/// Operator at one instant, and its delay as a number of whole samples and a fraction of a sample.
pub type OperatorWithDelay = (FamilyOperator, (usize, f64));

/// Response of a person to the displayed target.
#[derive(Debug, Clone, PartialEq)]
pub struct Feedforward {
    /// Operator from the target to u; its delay is relative to the end of the preview.
    pub operator: FamilyOperator,
    /// Operator after the change in the scenario; `None` if it is the same.
    pub last: Option<FamilyOperator>,
    /// Preview time, s.
    pub preview_s: f64,
}

impl Feedforward {
    /// Returns a response that does not change.
    pub fn new(operator: FamilyOperator, preview_s: f64) -> Self {
        Self {
            operator,
            last: None,
            preview_s,
        }
    }

    /// Parses a response such as `derivative:0.15,tau_f=0.1,preview=0.25`. `neuromuscular` contains omega_nm in rad/s
    /// and zeta_nm of the person; `None` if the person has no neuromuscular system.
    ///
    /// # Errors
    /// [`ModelError::Operator`] with the part that is wrong.
    pub fn from_text(text: &str, neuromuscular: Option<(f64, f64)>) -> Result<Self, ModelError> {
        let wrong = |reason: String| ModelError::Operator {
            reason: format!(
                "the response to the target {text:?}: {reason}; expected FORM:GAIN with further parameters by name, such \
                 as derivative:0.15,tau_f=0.1,preview=0.25"
            ),
        };
        let mut parts = text.split(',');
        let (form, gain) = parts
            .next()
            .unwrap_or("")
            .split_once(':')
            .ok_or_else(|| wrong("a form and its gain are missing".to_owned()))?;
        let form: Form = form
            .trim()
            .parse()
            .map_err(|error: crate::UnknownName| wrong(error.to_string()))?;
        let number = |name: &str, text: &str| {
            let number = text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
            number.ok_or_else(|| wrong(format!("{name} is {:?}, which is not a number", text.trim())))
        };
        // Each parameter has a value before and a value after the change.
        let both = |name: &str, text: &str| -> Result<[f64; 2], ModelError> {
            Ok(match text.split_once("..") {
                Some((before, after)) => [number(name, before)?, number(name, after)?],
                None => [number(name, text)?; 2],
            })
        };
        let (of_gain, _) = form.gain_name_and_unit();
        let mut pairs = vec![(of_gain.to_owned(), both(of_gain, gain)?)];
        let (mut tau_f, mut preview_s) = ([0.0; 2], 0.0);
        for part in parts {
            let (name, value) = part
                .split_once('=')
                .ok_or_else(|| wrong(format!("{:?} is not NAME=VALUE", part.trim())))?;
            match name.trim() {
                "tau_f" => tau_f = both("tau_f", value)?,
                "preview" => preview_s = number("preview", value)?,
                name if ["omega_nm", "zeta_nm", "tau_e"].contains(&name) => {
                    return Err(wrong(format!("{name} is a parameter of the response to the error")));
                }
                name if pairs.iter().any(|(known, _)| known == name) => {
                    return Err(wrong(format!("{name} is given twice")));
                }
                name => pairs.push((name.to_owned(), both(name, value)?)),
            }
        }
        let of = |at: usize| {
            let mut named: Vec<(String, f64)> = pairs.iter().map(|(name, both)| (name.clone(), both[at])).collect();
            if let Some((omega, zeta)) = neuromuscular {
                named.extend([("omega_nm".to_owned(), omega), ("zeta_nm".to_owned(), zeta)]);
            }
            named.push(("tau_e".to_owned(), Self::delay_s(tau_f[at], preview_s)?));
            FamilyOperator::from_names(form, &named).map_err(|error| wrong(error.to_string()))
        };
        let (operator, last) = (of(0)?, of(1)?);
        Ok(Self {
            last: Some(last).filter(|last| *last != operator),
            operator,
            preview_s,
        })
    }

    /// Returns the delay relative to the end of the preview, in s, for a delay relative to the present target.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if the person would respond before the target is displayed.
    pub fn delay_s(tau_f_s: f64, preview_s: f64) -> Result<f64, ModelError> {
        let delay_s = tau_f_s + preview_s;
        if delay_s.abs() < ROUNDING_TOLERANCE_S {
            return Ok(0.0);
        }
        if delay_s >= 0.0 {
            return Ok(delay_s);
        }
        Err(ModelError::OutOfRange {
            quantity: "delay tau_f of the response to the target in s",
            found: tau_f_s,
            expected: "at least minus the preview: a person cannot respond to a target before it is displayed",
        })
    }

    /// Returns the response of a person whose neuromuscular system has the parameters omega_nm in rad/s and zeta_nm.
    ///
    /// # Errors
    /// As [`FamilyOperator::new`].
    pub fn with_neuromuscular(&self, omega_nm_rad_s: f64, zeta_nm: f64) -> Result<Self, ModelError> {
        let with = |operator: &FamilyOperator| operator.with_neuromuscular(omega_nm_rad_s, zeta_nm);
        Ok(Self {
            operator: with(&self.operator)?,
            last: self.last.as_ref().map(with).transpose()?,
            preview_s: self.preview_s,
        })
    }

    /// Checks the preview, the delays and the forms, and returns the delays before and after the change ([`delays`]).
    ///
    /// # Errors
    /// [`ModelError`], which names the quantity.
    pub fn check(&self, schedule: &Schedule, sample_time: SampleTime) -> Result<[(usize, f64); 2], ModelError> {
        let quantity = "preview of the target in s";
        let wrong = |expected| {
            Err(ModelError::OutOfRange {
                quantity,
                found: self.preview_s,
                expected,
            })
        };
        if sample_time.whole_samples(self.preview_s).is_none() {
            return wrong("zero or more, and a whole number of samples");
        }
        if self.preview_s > LONGEST_PREVIEW_S {
            return wrong("at most 60 s");
        }
        let last = self.last.as_ref().unwrap_or(&self.operator);
        if !self.operator.has_same_form(last) {
            return Err(ModelError::Operator {
                reason: format!(
                    "the form of the response to the target changes from {} to {}; expected the same form before and \
                     after",
                    self.operator.form(),
                    last.form()
                ),
            });
        }
        if self.last.is_some() && *schedule == Schedule::Constant {
            return Err(ModelError::Operator {
                reason:
                    "the response to the target changes, but nothing else does; expected a scenario with a change, or \
                     a single value for each parameter"
                        .to_owned(),
            });
        }
        delays([self.operator.tau_e_s(), last.tau_e_s()], sample_time)
    }

    /// Returns the operator at time `t_s`, with its delay as a number of whole samples and a fraction of a sample.
    /// `neuromuscular` is the neuromuscular system of the person at this time; if it is `None`, the system of the
    /// stored operator is used.
    ///
    /// # Errors
    /// As [`Feedforward::check`] and [`FamilyOperator::new`].
    pub fn at(
        &self,
        t_s: f64,
        schedule: &Schedule,
        sample_time: SampleTime,
        neuromuscular: Option<(f64, f64)>,
    ) -> Result<OperatorWithDelay, ModelError> {
        let delays = self.check(schedule, sample_time)?;
        let mut operator = match &self.last {
            Some(last) => self
                .operator
                .with_interpolated_parameters(last, |a, b| schedule.value(a, b, t_s))?,
            None => self.operator.clone(),
        };
        if let Some((omega, zeta)) = neuromuscular {
            operator = operator.with_neuromuscular(omega, zeta)?;
        }
        let delay = delay_at(delays, schedule, t_s);
        if delays[0] != delays[1] {
            operator = operator.with_delay(delay.0 as f64 * sample_time.s())?;
        }
        Ok((operator, delay))
    }

    /// Returns the role of the target in a recording: `feedforward`, or `feedforward:0.25` with a preview of 0.25 s.
    pub fn role(&self) -> String {
        if self.preview_s > 0.0 {
            format!("feedforward:{}", self.preview_s)
        } else {
            "feedforward".to_owned()
        }
    }
}

/// Returns the name, the unit and the value of each parameter of the response to a further input: the parameters of its
/// form, and the delay tau_f relative to the present input. The neuromuscular parameters are omitted, because the
/// response to the error has the same ones.
pub fn response_parameters(operator: &FamilyOperator, preview_s: f64) -> Vec<(&'static str, &'static str, f64)> {
    let named = operator.named_parameters().into_iter();
    let own = named.filter(|p| !["omega_nm", "zeta_nm"].contains(&p.name));
    let of = |p: crate::operator_family::NamedParameter| match p.name {
        "tau_e" => ("tau_f", p.unit, p.value - preview_s),
        name => (name, p.unit, p.value),
    };
    own.map(of).collect()
}

/// Returns the delays before and after a change, each as a number of whole samples and a fraction of a sample. If the
/// delay changes, both are rounded to whole samples.
///
/// # Errors
/// [`ModelError::OutOfRange`] for a delay of too many samples.
pub fn delays(tau_s: [f64; 2], sample_time: SampleTime) -> Result<[(usize, f64); 2], ModelError> {
    let changes = tau_s[0] != tau_s[1];
    let mut delays = [(0, 0.0); 2];
    for (delay, tau_s) in delays.iter_mut().zip(tau_s) {
        let tau = tau_s / sample_time.s();
        let whole = whole_samples(tau_s, sample_time)?;
        *delay = if changes {
            (tau.round() as usize, 0.0)
        } else {
            // If tau is an integer number of samples, this remainder is only a rounding error.
            let late = tau - whole as f64;
            (whole, if late < 1e-9 { 0.0 } else { late })
        };
    }
    Ok(delays)
}

/// Returns the delay at time `t_s`, between the two values of [`delays`]; a changing delay is rounded to whole samples.
pub fn delay_at([initial, last]: [(usize, f64); 2], schedule: &Schedule, t_s: f64) -> (usize, f64) {
    if initial == last {
        return initial;
    }
    let delay = schedule.value(initial.0 as f64, last.0 as f64, t_s);
    (delay.round() as usize, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEUROMUSCULAR: Option<(f64, f64)> = Some((11.25, 0.35));

    fn of(text: &str) -> Feedforward {
        Feedforward::from_text(text, NEUROMUSCULAR).unwrap()
    }

    #[test]
    fn text_is_parsed_into_parameters() {
        let plain = of("derivative:0.15");
        assert_eq!(plain.operator.coordinates(), [0.15, 11.25_f64.ln(), 0.35_f64.ln(), 0.0]);
        assert_eq!((plain.preview_s, plain.role().as_str()), (0.0, "feedforward"));
        let late = of("derivative:0.15,tau_f=0.1,preview=0.25");
        assert!((late.operator.tau_e_s() - 0.35).abs() < 1e-15);
        assert_eq!(late.role(), "feedforward:0.25");
        let parameters = response_parameters(&late.operator, late.preview_s);
        assert_eq!(parameters[0], ("K_d", "s", 0.15));
        assert!(parameters[1].0 == "tau_f" && (parameters[1].2 - 0.1).abs() < 1e-15);
        let early = of("lag:0.5, T_I=2, tau_f=-0.25, preview=0.25");
        assert_eq!(early.operator.tau_e_s(), 0.0);
        assert_eq!(early.operator.coordinates()[..2], [0.25, 0.5]);
        assert_eq!(of("lead:0.5,T_L=0.4").operator.form(), Form::Lead);
        let changing = of("derivative:0.15..0.3,tau_f=0.1");
        assert_eq!(changing.last.unwrap().coordinates()[0], 0.3);
    }

    #[test]
    fn invalid_text_is_refused() {
        for (text, reason) in [
            ("", "a form and its gain"),
            ("derivative", "a form and its gain"),
            ("derivative:", "not a number"),
            ("derivative:nan", "not a number"),
            ("wheel:1", "wheel"),
            ("derivative:0.1,K_d=0.2", "given twice"),
            ("derivative:0.1,tau_f", "NAME=VALUE"),
            ("derivative:0.1,T_L=1", "no parameter T_L"),
            ("derivative:0.1,omega_nm=9", "response to the error"),
            ("lag:0.1", "T_I is missing"),
            ("derivative:0.1,tau_f=-0.1", "before it is displayed"),
        ] {
            let error = Feedforward::from_text(text, NEUROMUSCULAR).unwrap_err().to_string();
            assert!(error.contains(reason), "{text}: {error}");
        }
        assert!(Feedforward::from_text("derivative:0.1", None).is_err());
    }

    #[test]
    fn change_follows_schedule_and_shares_neuromuscular_system() {
        let ts = SampleTime::AT_100_HZ;
        let seen = of("derivative:0.1..0.3,tau_f=0.1..0.2");
        let schedule = Schedule::Sigmoid {
            rate_per_s: 2.0,
            midpoint_s: 10.0,
        };
        let (operator, delay) = seen.at(10.0, &schedule, ts, Some((9.0, 0.5))).unwrap();
        assert!((operator.coordinates()[0] - 0.2).abs() < 1e-15);
        assert_eq!(delay, (15, 0.0));
        assert!((operator.tau_e_s() - 0.15).abs() < 1e-15);
        let (omega, zeta) = operator.neuromuscular_parameters().unwrap();
        assert!((omega - 9.0).abs() < 1e-14 && (zeta - 0.5).abs() < 1e-15);
        let (before, _) = seen.at(-100.0, &schedule, ts, None).unwrap();
        assert_eq!(before.coordinates()[..3], seen.operator.coordinates()[..3]);
    }

    #[test]
    fn previews_and_forms_are_checked() {
        let ts = SampleTime::AT_100_HZ;
        let check = |seen: &Feedforward| seen.check(&Schedule::Constant, ts);
        assert_eq!(check(&of("derivative:0.1,tau_f=0.105")).unwrap()[0].0, 10);
        for preview_s in [0.255, -0.1, f64::NAN, 61.0] {
            let seen = Feedforward {
                preview_s,
                ..of("derivative:0.1")
            };
            assert!(check(&seen).is_err(), "{preview_s}");
        }
        let other = Feedforward {
            last: Some(of("gain:0.1").operator),
            ..of("derivative:0.1")
        };
        assert!(check(&other).unwrap_err().to_string().contains("derivative to gain"));
        let changing = check(&of("derivative:0.1..0.2")).unwrap_err().to_string();
        assert!(changing.contains("a scenario with a change"), "{changing}");
    }
}
