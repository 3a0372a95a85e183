//! JSON form of a describing function.

use hoid_ident::frequency::Realisation;
use serde_json::{Map, Value, json};

use super::{envelope, estimate, margin_estimates, number, optional};
use crate::describing::DescribingFunctionResult;

impl DescribingFunctionResult {
    /// Returns the JSON object.
    pub fn json(&self) -> Map<String, Value> {
        let (found, function, data) = (&self.found, &self.found.function, &self.data);
        let mut map = envelope(
            "description",
            &data.names,
            &data.records,
            &data.accounts,
            &found.verdict,
            &self.settings,
        );
        let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
        set(
            "excitation",
            json!({
                "channel": found.channel,
                "period_s": number(found.excitation.period_s()),
                "harmonics": found.excitation.harmonics(),
            }),
        );
        let lines = function.lines.iter().zip(found.phases_deg()).map(|(line, phase)| {
            let gain = line.magnitude_db();
            json!({
                "omega_rad_s": number(line.omega_rad_s),
                "gain_db": number(gain.value),
                "gain_se_db": optional(gain.standard_error),
                "phase_deg": number(phase.value),
                "phase_se_deg": optional(phase.standard_error),
                "coherence": optional(line.coherence),
                "real": number(line.response.re),
                "imaginary": number(line.response.im),
            })
        });
        set("lines", lines.collect());
        if let Some(margins) = self.margins() {
            set("open_loop", margin_estimates(margins));
        }
        let bands = function.remnant_spectrum.iter().map(|band| {
            json!({
                "omega_rad_s": number(band.omega_rad_s),
                "density": number(band.density),
                "density_se": number(band.standard_error()),
            })
        });
        set(
            "remnant",
            json!({
                "share": estimate(&function.off_line_share),
                "noise_ratio": estimate(&function.noise_ratio),
                "spectrum": bands.collect::<Vec<_>>(),
            }),
        );
        let runs = function.runs.iter().enumerate().map(|(k, run)| {
            let crossover = found.margins.as_ref().and_then(|m| m.per_run.get(k).copied().flatten());
            json!({
                "label": run.label,
                "periods": run.periods,
                "rms_e": number(run.rms_e),
                "rms_u": number(run.rms_u),
                "remnant_share": number(run.off_line_share),
                "crossover_rad_s": optional(crossover.map(|c| c.omega_rad_s)),
                "phase_margin_deg": optional(crossover.map(|c| c.phase_margin_deg)),
            })
        });
        set("runs", runs.collect());
        let realisation = match found.realisation {
            Realisation::Record => "record",
            Realisation::Period => "period",
        };
        set("errors_between", json!(format!("{realisation}s")));
        set("rms_e", estimate(&function.rms_e));
        set("rms_u", estimate(&function.rms_u));
        map
    }

    /// Returns the JSON object as indented text.
    pub fn to_json(&self) -> String {
        format!("{:#}", Value::Object(self.json()))
    }
}
