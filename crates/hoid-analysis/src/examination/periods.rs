//! Search for the excitation of a run: the channel whose power is in single lines over a span of whole periods, and the
//! longest such span.
//!
//! Over a whole number of periods `T` the power of a periodic signal lies in the bins of its discrete Fourier transform
//! at the frequencies `n / T`, and in no others; over any other span it leaks into all bins. The spans between whole
//! seconds are tried, the longest first, until nearly all the power lies in single bins ([`Excitation::detect`]).
//! A period need not be a number of whole seconds, so the length of this span is then varied by samples until the
//! leakage is smallest. Without this step, a span of 82.01 s for a period of 81.92 s has two additional lines, at which
//! the ratio of u to e is not the response of the person.

use hoid_ident::frequency::{COMMON_EXCITATIONS, Excitation, LineDetectionOptions};
use hoid_model::{Complex64, Record};
use hoid_numerics::statistics::variance;

use super::options::ExaminationOptions;

/// Maximum part of a record that a span may omit at either end: in s, and as a fraction of the record; the smaller
/// one applies.
const MAX_CUT_S: f64 = 20.0;
const MAX_CUT_SHARE: f64 = 0.4;
/// Minimum number of lines of an excitation, since people can predict a single sine.
const MIN_LINES: usize = 3;
/// Largest ratio of two leaked fractions of the power that are treated as equal.
const MAX_LEAK_RATIO: f64 = 3.0;
/// First step in which the length of a span is varied, s.
const COARSE_STEP_S: f64 = 0.01;
/// Fraction of the power outside the lines that may be due to rounding to about five digits.
const ROUNDING_POWER_FRACTION: f64 = 1e-9;

/// The excitation of a run.
#[derive(Debug, Clone)]
pub struct Periods {
    /// Name of the channel.
    pub channel: String,
    /// Period of the excitation, s.
    pub period_s: f64,
    /// The longest span of whole periods, s.
    pub span_s: (f64, f64),
    /// Lines of the excitation.
    pub excitation: Excitation,
    /// Description of the excitation in words.
    pub description: String,
}

/// Finds the excitation in the channel named by the user, or else in the first channel that has lines: channels with a
/// common name are tried before all others.
pub(super) fn search(record: &Record, known: &ExaminationOptions) -> Result<Periods, String> {
    let channels: Vec<&str> = record.channels().map(|channel| channel.name.as_str()).collect();
    let candidates: Vec<&str> = match known.excitation.as_deref() {
        Some("none") => return Err("as requested".to_owned()),
        Some(name) => vec![name],
        None => {
            // Error, control and output respond to the excitation: they contain its lines and other power.
            let answers = channels.iter().take(2).copied().chain(["y", "x", "n", "e", "u"]);
            let answers: Vec<&str> = answers.collect();
            let default = COMMON_EXCITATIONS.into_iter().filter(|name| channels.contains(name));
            let others = channels.iter().copied();
            let others = others.filter(|name| !answers.contains(name) && !COMMON_EXCITATIONS.contains(name));
            default.chain(others).collect()
        }
    };
    if let Some(missing) = candidates.iter().find(|name| record.channel(name).is_none()) {
        return Err(format!(
            "there is no column {missing}; the columns are {}",
            channels.join(", ")
        ));
    }
    let found = candidates
        .iter()
        .find_map(|channel| search_channel(record, channel, known));
    found.ok_or_else(|| {
        if candidates.is_empty() {
            return "there are no columns other than the error and the control".to_owned();
        }
        format!(
            "no column among {} has its power in spectral lines over whole periods; select a column with --excitation, and a span with --from and --to",
            candidates.join(", ")
        )
    })
}

/// Finds the longest span of whole periods of a channel. A span that is a few samples too long leaks little and would
/// be accepted; therefore the spans that are shorter by less than a second are compared, and the one with the least
/// leakage is chosen.
fn search_channel(record: &Record, channel: &str, known: &ExaminationOptions) -> Option<Periods> {
    let all = spans(record, known);
    let longest = all.iter().position(|span| lines_in(record, channel, *span).is_some())?;
    let least_s = all[longest].1 - all[longest].0 - 1.0;
    let near: Vec<FoundSpan> = all[longest..]
        .iter()
        .take_while(|(from_s, to_s)| to_s - from_s > least_s)
        .filter_map(|span| lines_in(record, channel, *span).map(|(excitation, leak)| (*span, excitation, leak)))
        .collect();
    let least = near.iter().map(|(.., leak)| *leak).fold(f64::INFINITY, f64::min);
    // Of spans with equal leakage the first one, which is the longest, is chosen.
    let limit = MAX_LEAK_RATIO * least.max(ROUNDING_POWER_FRACTION);
    let chosen = near.into_iter().find(|(.., leak)| *leak <= limit)?;
    let ((from_s, to_s), excitation, _) = refine_span(record, channel, chosen, known);
    let (omega, period_s) = (excitation.omega_rad_s(), excitation.period_s());
    let words = format!(
        "{channel} has {} lines from {:.3} to {:.3} rad/s, harmonics of {period_s:.4} s, over {from_s:.3} to {to_s:.3} s",
        omega.len(),
        omega.first().copied().unwrap_or_default(),
        omega.last().copied().unwrap_or_default()
    );
    Some(Periods {
        channel: channel.to_owned(),
        period_s,
        span_s: (from_s, to_s),
        excitation,
        description: words,
    })
}

/// A span with its lines and its leakage.
type FoundSpan = ((f64, f64), Excitation, f64);

/// Varies the length of a span by up to a second, first in steps of a hundredth of a second and then by samples, and
/// returns the span with the least leakage. The span keeps its end, or its start if the user gave that one.
fn refine_span(record: &Record, channel: &str, found: FoundSpan, known: &ExaminationOptions) -> FoundSpan {
    let ts = record.sample_time().s();
    let is_given = (known.from_s.is_some(), known.to_s.is_some());
    if found.2 <= ROUNDING_POWER_FRACTION || is_given == (true, true) {
        return found;
    }
    let (start_s, end_s) = (record.time_s(0), record.time_s(record.len()));
    let least_of = |best: FoundSpan, step: i64, steps: i64| {
        let (from_s, to_s) = best.0;
        let moved = |k: i64| {
            let by_s = (k * step) as f64 * ts;
            if is_given.0 {
                (from_s, to_s + by_s)
            } else {
                (from_s - by_s, to_s)
            }
        };
        let spans = (-steps..=steps).map(moved);
        let inside = spans.filter(|(from, to)| *from >= start_s - 0.5 * ts && *to <= end_s + 0.5 * ts);
        let all = inside.filter_map(|span| lines_in(record, channel, span).map(|(lines, leak)| (span, lines, leak)));
        all.fold(best, |best, other| if other.2 < best.2 { other } else { best })
    };
    let leak = found.2;
    let coarse = ((COARSE_STEP_S / ts).round() as i64).max(1);
    let steps = (1.0 / (coarse as f64 * ts)).floor() as i64;
    let best = least_of(found.clone(), coarse, steps);
    let best = if coarse > 1 { least_of(best, 1, coarse) } else { best };
    // A small gain is due to noise in the channel.
    if MAX_LEAK_RATIO * best.2.max(ROUNDING_POWER_FRACTION) < leak {
        best
    } else {
        found
    }
}

/// Returns the lines of a channel over a span if they contain nearly all of its power, and the fraction of the power
/// outside them.
fn lines_in(record: &Record, channel: &str, (from_s, to_s): (f64, f64)) -> Option<(Excitation, f64)> {
    let span = record.span(from_s, to_s).ok()?;
    let excitation = Excitation::detect(&span, channel, &LineDetectionOptions::default()).ok()?;
    if excitation.harmonics().len() < MIN_LINES {
        return None;
    }
    let values = span.channel(channel)?;
    let n = values.len() as f64;
    let power = variance(values);
    let of_line = |omega: &f64| -> f64 {
        // Rotating a phasor by one step per sample is much faster than computing the sine of each phase.
        let turn = Complex64::from_polar(1.0, omega * span.sample_time().s());
        let mut phasor = Complex64::new(1.0, 0.0);
        let mut sum = Complex64::new(0.0, 0.0);
        for v in values {
            sum += *v * phasor;
            phasor *= turn;
        }
        2.0 * sum.norm_sqr() / (n * n)
    };
    let of_lines: f64 = excitation.omega_rad_s().iter().map(of_line).sum();
    Some((excitation, (1.0 - of_lines / power).max(0.0)))
}

/// Returns the spans to try: the longest first and, among spans of equal length, the latest first, since a person needs
/// time to settle.
fn spans(record: &Record, known: &ExaminationOptions) -> Vec<(f64, f64)> {
    let (start_s, end) = (record.time_s(0), record.time_s(record.len()));
    let most = MAX_CUT_S.min(MAX_CUT_SHARE * (end - start_s));
    let whole = |from: f64, to: f64| (from.ceil() as i64..=to.floor() as i64).map(|t| t as f64);
    let begins: Vec<f64> = match known.from_s {
        Some(t) => vec![t],
        None => std::iter::once(start_s).chain(whole(start_s, start_s + most)).collect(),
    };
    let ends: Vec<f64> = match known.to_s {
        Some(t) => vec![t],
        None => std::iter::once(end).chain(whole(end - most, end)).collect(),
    };
    let mut all: Vec<(f64, f64)> = begins
        .iter()
        .flat_map(|from| ends.iter().map(move |to| (*from, *to)))
        .collect();
    all.retain(|(from, to)| to > from);
    all.sort_by(|a, b| (b.1 - b.0).total_cmp(&(a.1 - a.0)).then(b.0.total_cmp(&a.0)));
    all.dedup();
    all
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use hoid_model::{Channel, SampleTime, forcing::ForcingFunction};

    use super::*;

    /// Returns a record of noise-like error and control, and a disturbance of period 10 s that starts at 3 s.
    fn record(lines: &[f64]) -> Record {
        let ts = SampleTime::new(0.02).unwrap();
        let n = 1300;
        let at = |k: usize| k as f64 * 0.02;
        let d = |k: usize| {
            let of = |n: &f64| (TAU * n * at(k) / 10.0 + n).sin();
            if at(k) < 3.0 {
                0.3 * at(k)
            } else {
                lines.iter().map(of).sum()
            }
        };
        let noise = |k: usize| ((k * 7919 % 1013) as f64 / 1013.0) - 0.5;
        let channel = |name: &str, f: &dyn Fn(usize) -> f64| Channel::new(name, "", (0..n).map(f).collect());
        Record::new(ts, channel("e", &noise), channel("u", &|k| noise(k + 3)))
            .unwrap()
            .with_channel(channel("d", &d))
            .unwrap()
    }

    #[test]
    fn longest_span_of_whole_periods_is_found() {
        let found = search(&record(&[1.0, 3.0, 7.0, 12.0]), &ExaminationOptions::default())
            .ok()
            .unwrap();
        assert_eq!((found.channel.as_str(), found.span_s), ("d", (6.0, 26.0)));
        assert!((found.period_s - 10.0).abs() < 1e-9, "{}", found.period_s);
        assert_eq!(found.excitation.harmonics(), [1, 3, 7, 12]);
    }

    /// The record has a few samples after the last period, as if the recorder was stopped late. The span to the end of
    /// the record leaks little, but does not consist of whole periods.
    #[test]
    fn extra_samples_at_the_end_do_not_change_the_period() {
        let whole = record(&[1.0, 2.0, 3.0]);
        let longer = whole.span(0.0, 23.0).unwrap();
        let exact = search(&longer, &ExaminationOptions::default()).ok().unwrap();
        for late in 1..=3 {
            let late = whole.span(0.0, 23.0 + 0.02 * f64::from(late)).unwrap();
            let found = search(&late, &ExaminationOptions::default()).ok().unwrap();
            assert_eq!((found.span_s, found.period_s), (exact.span_s, exact.period_s));
        }
        assert_eq!(exact.span_s, (3.0, 23.0));
    }

    /// The period of 8192 samples of the thesis is found in a record that starts and ends elsewhere.
    #[test]
    fn period_of_a_fraction_of_a_second_is_found() {
        let ts = SampleTime::AT_100_HZ;
        let target = ForcingFunction::reference().samples(0.0, ts, 9001);
        let noise = |k: usize| ((k * 7919 % 1013) as f64 / 1013.0) - 0.5;
        let channel = |name: &str, f: &dyn Fn(usize) -> f64| Channel::new(name, "", (0..9001).map(f).collect());
        let record = Record::new(ts, channel("e", &noise), channel("u", &|k| noise(k + 3))).unwrap();
        for measured in [0.0, 1e-3] {
            let r = channel("r", &|k| target[k] + measured * noise(k + 11));
            let record = record.clone().with_channel(r).unwrap();
            let found = search(&record, &ExaminationOptions::default()).ok().unwrap();
            assert!((found.period_s - 81.92).abs() < 0.015, "{} {measured}", found.period_s);
            assert_eq!(found.excitation.harmonics(), [3, 5, 8, 13, 22, 34, 53, 86, 139, 229]);
            let from_8 = ExaminationOptions {
                from_s: Some(8.0),
                ..ExaminationOptions::default()
            };
            let found = search(&record, &from_8).ok().unwrap();
            assert!(
                found.span_s.0 == 8.0 && (found.period_s - 81.92).abs() < 0.015,
                "{:?}",
                found.span_s
            );
        }
    }

    #[test]
    fn missing_excitation_gives_the_reason() {
        let sine = search(&record(&[2.0]), &ExaminationOptions::default()).err().unwrap();
        assert!(sine.contains("no column among d"), "{sine}");
        let known = |excitation: &str| ExaminationOptions {
            excitation: Some(excitation.to_owned()),
            ..ExaminationOptions::default()
        };
        assert!(
            search(&record(&[1.0, 3.0, 7.0]), &known("q"))
                .err()
                .unwrap()
                .contains("there is no column q")
        );
        assert!(search(&record(&[1.0, 3.0, 7.0]), &known("none")).is_err());
    }
}
