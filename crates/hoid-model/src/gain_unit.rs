//! Units of the gains of an operator.
//!
//! A gain is a ratio of the output u to the input e, so its unit is the ratio of their units. It is reported only if
//! the units of both channels are declared; for a recording without units, gains are reported without units. An
//! operator `K (1 + T_L s) / (1 + T_I s)` has the gain `K` in u/e, the gain of the error rate `K_e_dot = K T_L` in u
//! s/e, and the ratio `K / T_I` in u/(e s).

use crate::Record;

/// Units of the input and the output, from which the unit of a gain follows.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct GainUnit(Option<(String, String)>);

impl GainUnit {
    /// Returns the units of a record, or no units if the input or the output has none.
    pub fn of(record: &Record) -> Self {
        let units = record
            .input_channel()
            .map(|e| (e.unit.trim(), record.output_channel().unit.trim()));
        let declared = units.filter(|(e, u)| !e.is_empty() && !u.is_empty());
        Self(declared.map(|(e, u)| (e.to_owned(), u.to_owned())))
    }

    /// Returns the unit of a parameter from its name and from `own`, its unit if e and u have the same unit: "s" for
    /// K_e_dot, "1/s" for K/T_I, "deg/deg" or "" for K. A gain has the unit u/e times the unit of time in `own`, and no
    /// unit if the units of the channels are unknown. For a parameter that is not a gain, `own` is returned unchanged.
    ///
    /// ```
    /// # use hoid_model::{Channel, GainUnit, Record, SampleTime};
    /// let channel = |name: &str, unit: &str| Channel::new(name, unit, vec![0.0; 4]);
    /// let record = Record::new(SampleTime::new(0.01)?, channel("e", "mm"), channel("u", "deg"))?;
    /// let unit = GainUnit::of(&record);
    /// assert_eq!(unit.unit("K_e", ""), "deg/mm");
    /// assert_eq!(unit.unit("K_over_T_I", "1/s"), "deg/(mm s)");
    /// assert_eq!(unit.unit("T_L", "s"), "s");
    /// assert_eq!(GainUnit::default().unit("K_e_dot", "s"), "");
    /// # Ok::<(), hoid_model::ModelError>(())
    /// ```
    pub fn unit(&self, parameter: &str, own: &str) -> String {
        if !is_gain(parameter) {
            return own.to_owned();
        }
        match (&self.0, own) {
            (None, _) => String::new(),
            // If the units of e and u are equal, only the unit of time remains.
            (Some((e, u)), "s" | "1/s") if e == u => own.to_owned(),
            (Some((e, u)), "s") => format!("{u} s/{e}"),
            (Some((e, u)), "1/s") => format!("{u}/({e} s)"),
            (Some((e, u)), _) => format!("{u}/{e}"),
        }
    }
}

/// True if a parameter is proportional to u/e. The remnant gain K_n does not count as a gain, because it is a ratio of
/// u to white noise.
fn is_gain(parameter: &str) -> bool {
    let name = parameter.trim_end_matches(|c: char| c.is_ascii_digit());
    matches!(name, "K" | "K_e" | "K_e_dot" | "K_over_T_I" | "K_I")
}
