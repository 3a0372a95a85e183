//! Text output of `hoid describe`.

use hoid::analysis::DescribingFunctionResult;
use hoid::ident::frequency::Realisation;
use hoid::model::{ContinuousTransferFunction, uncertainty::Estimate};
use hoid::report::numbers;

use crate::text;

/// A describing function to display, with the controlled element if one was given.
pub struct DescriptionReport<'a> {
    pub described: &'a DescribingFunctionResult,
    pub element: Option<&'a ContinuousTransferFunction>,
}

impl DescriptionReport<'_> {
    /// Returns the heading in one line: the channels, the number of lines, and the runs or periods.
    pub fn title(&self) -> String {
        let (found, names) = (
            &self.described.found,
            self.described.data.records.first().map(|r| {
                let names: Vec<&str> = r.channels().take(2).map(|c| c.name.as_str()).collect();
                (
                    names.first().copied().unwrap_or("e").to_owned(),
                    names.get(1).copied().unwrap_or("u").to_owned(),
                )
            }),
        );
        let (e, u) = names.unwrap_or_default();
        let (n, period) = (
            found.function.runs.len(),
            numbers::format_plain(found.excitation.period_s()),
        );
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

    /// Returns the page, with the verdict first; `verbose` adds all settings.
    pub fn page(&self, verbose: bool) -> String {
        let DescribingFunctionResult { found, data, settings } = self.described;
        let function = &found.function;
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
        if let (Some(margins), Some(element)) = (self.described.margins(), self.element) {
            page.push_str(&format!("Open loop with {element}: {}", text::margins(margins)));
        }
        let percent = |e: &Estimate| {
            let scaled = Estimate {
                value: 100.0 * e.value,
                standard_error: e.standard_error.map(|s| 100.0 * s),
            };
            format!("{scaled} %")
        };
        page.push_str(&format!(
            "Remnant: {} of the output power lies at non-excited frequencies; with the remnant at the lines, {} \
             (P_n).\n",
            percent(&function.off_line_share),
            percent(&function.noise_ratio),
        ));
        page.push_str(&format!("RMS: input {}, output {}.\n", function.rms_e, function.rms_u));
        page.push_str(&text::records(&data.names, &data.records, &data.accounts, verbose));
        if verbose {
            page.push_str(&text::settings(settings));
        } else {
            page.push_str(text::SETTINGS_HINT);
        }
        page
    }
}
