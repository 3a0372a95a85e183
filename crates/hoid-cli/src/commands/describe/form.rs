//! A description as a page for people and as an object for programs.

use hoid::analysis::Account;
use hoid::ident::{
    MarginEstimates,
    frequency::{Description, Realisation},
};
use hoid::model::{ContinuousTransferFunction, Record, uncertainty::Estimate};
use hoid::report::numbers;
use serde_json::{Map, Value, json};

use crate::{json, text};

/// A description with what it was made from.
pub struct Described<'a> {
    pub files: &'a [String],
    pub records: &'a [Record],
    pub accounts: &'a [Account],
    pub found: &'a Description,
    pub settings: Vec<(String, String)>,
    pub element: Option<&'a ContinuousTransferFunction>,
}

impl Described<'_> {
    /// What was described, in a line.
    pub fn title(&self) -> String {
        let (found, names) = (
            self.found,
            self.records.first().map(|r| {
                let names: Vec<&str> = r.channels().take(2).map(|c| c.name.as_str()).collect();
                (
                    names.first().copied().unwrap_or("e").to_owned(),
                    names.get(1).copied().unwrap_or("u").to_owned(),
                )
            }),
        );
        let (e, u) = names.unwrap_or_default();
        let (n, period) = (found.function.runs.len(), numbers::plain(found.excitation.period_s()));
        let periods = found.function.runs.first().map_or(1, |run| run.periods);
        let of = match (found.realisation, n) {
            (Realisation::Period, _) => format!("{n} periods of {period} s"),
            (Realisation::Record, 1) => format!("one run of {period} s"),
            (Realisation::Record, _) if periods == 1 => format!("{n} runs of one period of {period} s"),
            (Realisation::Record, _) => format!("{n} runs of {periods} periods of {period} s"),
        };
        format!(
            "Describing function from {e} to {u} at {} lines, over {of}",
            found.function.lines.len()
        )
    }

    fn margins(&self) -> Option<MarginEstimates> {
        self.found.margins.as_ref().map(|m| MarginEstimates {
            crossover_rad_s: m.crossover_rad_s,
            phase_margin_deg: m.phase_margin_deg,
            gain_margin_db: m.gain_margin_db,
            phase_crossover_rad_s: m.phase_crossover_rad_s,
        })
    }

    /// The page: what it is worth first; with `verbose` every setting.
    pub fn page(&self, verbose: bool) -> String {
        let (found, function) = (self.found, &self.found.function);
        let mut page = text::verdict(&found.verdict);
        let mut rows = text::table(&[
            "frequency (rad/s)",
            "gain (dB)",
            "standard error",
            "phase (deg)",
            "standard error",
            "coherence",
        ]);
        for (line, phase) in function.lines.iter().zip(found.phases_deg()) {
            let ((gain, gain_error), (phase, phase_error)) = (
                text::with_uncertainty(&line.magnitude_db()),
                text::with_uncertainty(&phase),
            );
            rows.add_row([
                format!("{:.4}", line.omega_rad_s),
                gain,
                gain_error,
                phase,
                phase_error,
                line.coherence.map_or("-".to_owned(), |c| format!("{c:.2}")),
            ]);
        }
        page.push_str(&format!("{}\n{rows}\n", self.title()));
        if let (Some(margins), Some(element)) = (self.margins(), self.element) {
            page.push_str(&format!("Open loop with {element}: {}", text::margins(&margins)));
        }
        let percent = |e: &Estimate| {
            let scaled = Estimate {
                value: 100.0 * e.value,
                standard_error: e.standard_error.map(|s| 100.0 * s),
            };
            format!("{scaled} %")
        };
        page.push_str(&format!(
            "Remnant: {} of the power of the output off the lines, {} with its part at the lines (P_n).\n",
            percent(&function.off_line_share),
            percent(&function.noise_ratio),
        ));
        page.push_str(&format!("RMS: input {}, output {}.\n", function.rms_e, function.rms_u));
        page.push_str(&text::records(self.files, self.records, self.accounts, verbose));
        if verbose {
            page.push_str(&text::settings(&self.settings));
        } else {
            page.push_str(text::MORE_SETTINGS);
        }
        page
    }

    pub fn to_json(&self) -> Value {
        let (found, function) = (self.found, &self.found.function);
        let mut map = Map::new();
        let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
        set("hoid", json!(env!("CARGO_PKG_VERSION")));
        set("verdict", json::verdict(&found.verdict));
        set("records", json::records(self.files, self.records, self.accounts));
        set("warnings", json::warnings(self.files, self.accounts));
        set("faults", json::faults(self.files, self.accounts));
        set(
            "excitation",
            json!({
                "channel": found.channel,
                "period_s": json::number(found.excitation.period_s()),
                "harmonics": found.excitation.harmonics(),
            }),
        );
        let lines = function.lines.iter().zip(found.phases_deg()).map(|(line, phase)| {
            let gain = line.magnitude_db();
            json!({
                "omega_rad_s": json::number(line.omega_rad_s),
                "gain_db": json::number(gain.value),
                "gain_se_db": json::optional(gain.standard_error),
                "phase_deg": json::number(phase.value),
                "phase_se_deg": json::optional(phase.standard_error),
                "coherence": json::optional(line.coherence),
                "real": json::number(line.response.re),
                "imaginary": json::number(line.response.im),
            })
        });
        set("lines", lines.collect());
        if let Some(margins) = self.margins() {
            set("open_loop", json::margin_estimates(&margins));
        }
        let bands = function.remnant_spectrum.iter().map(|band| {
            json!({
                "omega_rad_s": json::number(band.omega_rad_s),
                "density": json::number(band.density),
                "density_se": json::number(band.standard_error()),
            })
        });
        set(
            "remnant",
            json!({
                "share": json::estimate(&function.off_line_share),
                "noise_ratio": json::estimate(&function.noise_ratio),
                "spectrum": bands.collect::<Vec<_>>(),
            }),
        );
        let runs = function.runs.iter().enumerate().map(|(k, run)| {
            let crossover = found.margins.as_ref().and_then(|m| m.per_run.get(k).copied().flatten());
            json!({
                "label": run.label,
                "periods": run.periods,
                "rms_e": json::number(run.rms_e),
                "rms_u": json::number(run.rms_u),
                "remnant_share": json::number(run.off_line_share),
                "crossover_rad_s": json::optional(crossover.map(|c| c.omega_rad_s)),
                "phase_margin_deg": json::optional(crossover.map(|c| c.phase_margin_deg)),
            })
        });
        set("runs", runs.collect());
        let realisation = match found.realisation {
            Realisation::Record => "record",
            Realisation::Period => "period",
        };
        set("errors_between", json!(format!("{realisation}s")));
        set("rms_e", json::estimate(&function.rms_e));
        set("rms_u", json::estimate(&function.rms_u));
        let settings: Map<String, Value> = self.settings.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
        set("settings", Value::Object(settings));
        Value::Object(map)
    }
}
