//! Describing function of records: coefficients at the lines of every run, their averages and standard errors.

use hoid_model::{Channel, Complex64, Record, uncertainty::Estimate};
use hoid_numerics::statistics::root_mean_square;

use super::{
    excitation::{COMMON_EXCITATIONS, Excitation, channel_values, refuse},
    options::{Averaging, DescribingOptions, Realisation},
    ratio::{Ratio, mean, standard_deviation},
    remnant::{ControlSpectrum, RemnantBand, remnant_share_and_noise_ratio, spectrum},
    window::{Window, shifted_coefficients},
};
use crate::{IdentError, informative_data::common_sample_time};

/// Amplitude of a line, relative to the root sum of squares of all coefficients of its channel, up to which it counts
/// as a rounding error.
const MIN_LINE_AMPLITUDE: f64 = 1e-12;

/// Smallest power of a line of another excitation, relative to its largest line, and smallest number of bins for each
/// line.
const MIN_LINE_POWER: f64 = 1e-5;
const MIN_BINS_PER_LINE: usize = 10;
/// Number of bins at non-excited frequencies from which the remnant at a line is estimated.
const NEIGHBOUR_COUNT: usize = 8;

/// The describing function H at one line.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Frequency of the line, rad/s.
    pub omega_rad_s: f64,
    /// Number of the harmonic of the period at which the line is.
    pub harmonic: usize,
    /// H, averaged over runs.
    pub response: Complex64,
    /// Standard error sigma, the root mean square of `|dH|`; `None` for one run.
    pub standard_error: Option<f64>,
    /// Standard deviation of the ratios of single runs, as a root mean square modulus; `None` for one run.
    pub spread: Option<f64>,
    /// Standard error sigma computed from the remnant near the line, `N = U - H E` at the nearest non-excited bins,
    /// which contain only remnant. It does not include differences between runs and is also defined for a single run.
    pub neighbour_error: f64,
    /// Squared coherence, 0 to 1; `None` for one run, where it is always 1.
    pub coherence: Option<f64>,
    /// Ratio `U_i/E_i` of each run.
    pub per_run: Vec<Complex64>,
    /// Frequency response of the controlled element, if it is estimated.
    pub element: Option<Complex64>,
    pub(crate) ratio: Ratio,
    pub(super) element_ratio: Option<Ratio>,
}

impl Line {
    /// Returns `20 log10 |H|` in dB.
    pub fn magnitude_db(&self) -> Estimate {
        Estimate {
            value: 20.0 * self.response.norm().log10(),
            standard_error: self.relative_error().map(|r| 20.0 / std::f64::consts::LN_10 * r),
        }
    }

    /// Returns `arg H` in deg, between -180 and 180.
    pub fn phase_deg(&self) -> Estimate {
        Estimate {
            value: self.response.arg().to_degrees(),
            standard_error: self.relative_error().map(f64::to_degrees),
        }
    }

    /// Returns the relative standard error `sigma/(sqrt(2) |H|)`.
    fn relative_error(&self) -> Option<f64> {
        self.standard_error
            .map(|s| s / (std::f64::consts::SQRT_2 * self.response.norm()))
    }

    /// Returns H computed from all runs except `run`.
    pub fn response_without(&self, run: usize) -> Complex64 {
        self.ratio.value(Some(run))
    }

    /// Returns the centre and radius of the circle in the complex plane that contains the true H with this probability.
    /// The result is exact for a circular normal remnant, even if e is small compared with the remnant. `None` for one
    /// run, or if the denominator of H does not differ from zero at this level.
    pub fn confidence_circle(&self, probability: f64) -> Option<(Complex64, f64)> {
        self.ratio.confidence_disc(probability)
    }
}

/// Summary of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunSummary {
    /// Label of the record.
    pub label: String,
    /// Number of periods in the run.
    pub periods: usize,
    /// Root mean square of e.
    pub rms_e: f64,
    /// Root mean square of u.
    pub rms_u: f64,
    /// Share of the variance of u at non-excited frequencies.
    pub off_line_share: f64,
    /// Power of the remnant in u relative to the variance of u.
    pub noise_ratio: f64,
}

/// A describing function, with the remnant and a summary of each run.
#[derive(Debug, Clone, PartialEq)]
pub struct DescribingFunction {
    /// The describing function at each line, in ascending order of frequency.
    pub lines: Vec<Line>,
    /// Summaries of the runs, which are records or periods.
    pub runs: Vec<RunSummary>,
    /// Share of the variance of u at non-excited frequencies, mean over runs.
    pub off_line_share: Estimate,
    /// Power of the remnant in u relative to the variance of u (P_n of eq. 43), mean over runs.
    pub noise_ratio: Estimate,
    /// Spectrum of the remnant in u.
    pub remnant_spectrum: Vec<RemnantBand>,
    /// Root mean square of e, mean over runs.
    pub rms_e: Estimate,
    /// Root mean square of u, mean over runs.
    pub rms_u: Estimate,
}

/// Fourier coefficients of one run.
struct Run {
    label: String,
    window: Window,
    e: Vec<Complex64>,
    u: Vec<Complex64>,
    /// Bins of the lines of all recorded excitations, in ascending order.
    excited: Vec<usize>,
    reference: Option<Vec<Complex64>>,
    /// Fourier coefficients of the output and of the input of the controlled element.
    element: Option<(Vec<Complex64>, Vec<Complex64>)>,
    rms: (f64, f64),
}

/// Computes the describing function from e to u of one or several records at the lines of their excitation.
///
/// # Errors
/// [`IdentError::NoRecords`], [`IdentError::MixedSampling`], [`IdentError::NotWholePeriods`],
/// [`IdentError::LineBeyondNyquist`], [`IdentError::NoExcitation`] for a constant e or u, [`IdentError::NoLinePower`]
/// for a line without power, [`IdentError::BadOption`] for a channel that does not exist.
pub fn describe(
    records: &[Record],
    excitation: &Excitation,
    options: &DescribingOptions,
) -> Result<DescribingFunction, IdentError> {
    let ts_s = common_sample_time(records)?.s();
    if !options.offset_samples.is_finite() {
        return refuse(
            "the offset between e and u",
            options.offset_samples,
            "a finite number of samples",
        );
    }
    if options.smoothing_bins == 0 {
        return refuse("the bins averaged in the remnant spectrum", 0, "1 or more");
    }
    let mut runs = Vec::new();
    for record in records {
        runs.extend(runs_of(record, excitation, options)?);
    }
    let lines = excitation.harmonics().iter().zip(excitation.omega_rad_s());
    let lines: Result<Vec<Line>, IdentError> = lines.map(|(&n, omega)| line(&runs, n, omega, options)).collect();
    let mut lines = lines?;
    for line in &mut lines {
        line.neighbour_error = neighbour_error(&runs, line);
    }

    let controls: Vec<ControlSpectrum<'_>> = runs
        .iter()
        .map(|run| ControlSpectrum {
            coefficients: &run.u,
            window: run.window,
            excited: &run.excited,
        })
        .collect();
    let remnant_spectrum = spectrum(&controls, ts_s, options.smoothing_bins);
    let runs: Vec<RunSummary> = runs
        .iter()
        .zip(&controls)
        .map(|(run, control)| {
            let (share, ratio) = remnant_share_and_noise_ratio(control, ts_s, &remnant_spectrum);
            RunSummary {
                label: run.label.clone(),
                periods: run.window.periods,
                rms_e: run.rms.0,
                rms_u: run.rms.1,
                off_line_share: share,
                noise_ratio: ratio,
            }
        })
        .collect();
    let over_runs = |get: fn(&RunSummary) -> f64| mean(&runs.iter().map(get).collect::<Vec<f64>>());
    Ok(DescribingFunction {
        lines,
        off_line_share: over_runs(|r| r.off_line_share),
        noise_ratio: over_runs(|r| r.noise_ratio),
        rms_e: over_runs(|r| r.rms_e),
        rms_u: over_runs(|r| r.rms_u),
        remnant_spectrum,
        runs,
    })
}

fn runs_of(record: &Record, excitation: &Excitation, options: &DescribingOptions) -> Result<Vec<Run>, IdentError> {
    let window = Window::from_span(record, options.from_s, options.to_s, excitation.period_s())?;
    let bin = |n: usize| n.saturating_mul(window.periods);
    let beyond = |n: &&usize| bin(**n).saturating_mul(2) >= window.samples;
    if let Some(n) = excitation.harmonics().iter().find(beyond) {
        return Err(IdentError::LineBeyondNyquist {
            omega_rad_s: std::f64::consts::TAU * *n as f64 / excitation.period_s(),
            label: record.label().to_owned(),
            nyquist_rad_s: record.sample_time().nyquist_rad_s(),
        });
    }
    if record.input_channel().is_none() {
        return refuse(
            &format!("record {}", record.label()),
            "no input",
            "the tracking error, to which u responds, as input",
        );
    }
    let span = window.first..window.first + window.samples;
    for channel in record.channels().take(2) {
        let part = &channel.values[span.clone()];
        if part.iter().all(|v| *v == part[0]) {
            return Err(IdentError::NoExcitation {
                channel: channel.name.clone(),
                label: record.label().to_owned(),
            });
        }
    }
    let reference = match &options.averaging {
        Averaging::Reference { channel } => Some(channel_values(record, channel, "the channel of the excitation")?),
        _ => None,
    };
    let element = match &options.element {
        None => None,
        Some(element) => {
            let output = channel_values(record, &element.output, "the output of the controlled element")?;
            let disturbance = match &element.disturbance {
                Some(name) => Some(channel_values(
                    record,
                    name,
                    "the disturbance of the controlled element",
                )?),
                None => None,
            };
            Some((output, disturbance))
        }
    };
    let windows = match options.realisation {
        Realisation::Record => vec![window],
        Realisation::Period => window.single_periods(),
    };
    let run = |window: Window| -> Result<Run, IdentError> {
        let (e, _) = window.shifted_samples(record.input(), 0.0);
        let (u, late) = window.shifted_samples(record.output(), options.offset_samples);
        let channel = |name: &str, values: &[f64]| Channel::new(name, "", values.to_vec());
        let pair = Record::new(record.sample_time(), channel("e", e), channel("u", u))?.detrended(options.detrend);
        let control = shifted_coefficients(pair.output(), late);
        let element = element.map(|(output, disturbance)| {
            let mut input = control.clone();
            if let Some(d) = disturbance {
                for (sum, d) in input.iter_mut().zip(window.coefficients(d, options.offset_samples)) {
                    *sum += d;
                }
            }
            (window.coefficients(output, 0.0), input)
        });
        Ok(Run {
            label: record.label().to_owned(),
            window,
            excited: excited_bins(record, window, excitation),
            e: shifted_coefficients(pair.input(), 0.0),
            u: control,
            reference: reference.map(|r| window.coefficients(r, 0.0)),
            element,
            rms: (root_mean_square(pair.input()), root_mean_square(pair.output())),
        })
    };
    let runs: Result<Vec<Run>, IdentError> = windows.into_iter().map(run).collect();
    let runs = runs?;
    for run in &runs {
        run.check_lines(record, excitation, options)?;
    }
    Ok(runs)
}

/// Returns the bins of the lines of an excitation, and of the other excitations that were recorded with it: u responds to
/// all of them, and only the other bins contain remnant alone. A channel whose power is not concentrated at a few lines,
/// such as filtered noise, excites all bins and is not included.
fn excited_bins(record: &Record, window: Window, excitation: &Excitation) -> Vec<usize> {
    let mut all: Vec<usize> = excitation.harmonics().iter().map(|n| n * window.periods).collect();
    for channel in COMMON_EXCITATIONS.iter().filter_map(|name| record.other_channel(name)) {
        let power: Vec<f64> = (window.coefficients(channel, 0.0).iter().skip(1))
            .map(Complex64::norm_sqr)
            .collect();
        let largest = power.iter().copied().fold(0.0, f64::max);
        let lines = (power.iter().enumerate()).filter(|(_, p)| **p > MIN_LINE_POWER * largest);
        let lines: Vec<usize> = lines.map(|(k, _)| k + 1).collect();
        if lines.len() * MIN_BINS_PER_LINE <= power.len() {
            all.extend(lines);
        }
    }
    all.sort_unstable();
    all.dedup();
    all
}

impl Run {
    /// Returns an error if a line has zero power in e, u or another channel of the averages.
    fn check_lines(
        &self,
        record: &Record,
        excitation: &Excitation,
        options: &DescribingOptions,
    ) -> Result<(), IdentError> {
        let names: Vec<&str> = record.channels().take(2).map(|c| c.name.as_str()).collect();
        let mut channels = vec![(names[0], &self.e), (names[1], &self.u)];
        if let (Averaging::Reference { channel }, Some(x)) = (&options.averaging, &self.reference) {
            channels.push((channel, x));
        }
        if let (Some(element), Some((y, w))) = (&options.element, &self.element) {
            channels.push((&element.output, y));
            channels.push(("the input of the controlled element", w));
        }
        for (name, x) in channels {
            let whole: f64 = x.iter().map(|c| c.norm_sqr()).sum();
            for (n, omega_rad_s) in excitation.harmonics().iter().zip(excitation.omega_rad_s()) {
                let size = x[n * self.window.periods].norm();
                if size.is_nan() || size <= MIN_LINE_AMPLITUDE * whole.sqrt() {
                    return Err(IdentError::NoLinePower {
                        channel: name.to_owned(),
                        label: self.label.clone(),
                        omega_rad_s,
                    });
                }
            }
        }
        Ok(())
    }
}

fn line(runs: &[Run], harmonic: usize, omega_rad_s: f64, options: &DescribingOptions) -> Result<Line, IdentError> {
    let one = Complex64::new(1.0, 0.0);
    let at = |run: &Run, x: &[Complex64]| x[harmonic * run.window.periods];
    let (mut terms, mut element_terms) = (Vec::new(), Vec::new());
    let (mut cross, mut power_u, mut power_d) = (Complex64::new(0.0, 0.0), 0.0, 0.0);
    for run in runs {
        let (e, u) = (at(run, &run.e), at(run, &run.u));
        // Weight of the run in the numerator and the denominator: D*, or 1, or for the mean of ratios the inverse of
        // the denominator.
        let (weight, element_weight, d) = match (&options.averaging, &run.reference) {
            (Averaging::Reference { .. }, Some(reference)) => {
                let d = at(run, reference);
                (d.conj(), d.conj(), d)
            }
            (Averaging::SameExcitation, _) => (one, one, one),
            _ => {
                let input = run.element.as_ref().map_or(one, |(_, w)| at(run, w));
                (e.inv(), input.inv(), e)
            }
        };
        terms.push((u * weight, e * weight));
        if let Some((y, w)) = &run.element {
            element_terms.push((at(run, y) * element_weight, at(run, w) * element_weight));
        }
        cross += u * d.conj();
        power_u += u.norm_sqr();
        power_d += d.norm_sqr();
    }
    let ratio = Ratio(terms);
    let element_ratio = options.element.as_ref().map(|_| Ratio(element_terms));
    let response = ratio.value(None);
    let element = element_ratio.as_ref().map(|r| r.value(None));
    if !(response.is_finite() && element.is_none_or(Complex64::is_finite)) {
        return Err(IdentError::NoLinePower {
            channel: "the average over the runs".to_owned(),
            label: runs.iter().map(|r| r.label.as_str()).collect::<Vec<_>>().join(", "),
            omega_rad_s,
        });
    }
    let per_run = ratio.run_ratios();
    let parts = |get: fn(&Complex64) -> f64| standard_deviation(&per_run.iter().map(get).collect::<Vec<f64>>());
    let spread = parts(|h| h.re).zip(parts(|h| h.im)).map(|(re, im)| re.hypot(im));
    Ok(Line {
        omega_rad_s,
        harmonic,
        response,
        standard_error: ratio.standard_error(),
        spread,
        coherence: (runs.len() > 1).then(|| cross.norm_sqr() / (power_u * power_d)),
        per_run,
        neighbour_error: f64::NAN,
        element,
        ratio,
        element_ratio,
    })
}

/// Returns sigma of a line from the neighbouring bins: `sigma^2 = sum_i |D_i|^2 S_i / |sum_i b_i|^2`, where S_i is the
/// mean of `|U - H E|^2` over the nearest non-excited bins of run i and `b_i = E_i D_i*`.
fn neighbour_error(runs: &[Run], line: &Line) -> f64 {
    let mut squares = 0.0;
    for (run, (_, b)) in runs.iter().zip(&line.ratio.0) {
        let periods = run.window.periods;
        let at = line.harmonic * periods;
        let is_remnant = |k: &usize| run.excited.binary_search(k).is_err();
        let mut nearby_bins: Vec<usize> = (1..run.e.len()).filter(is_remnant).collect();
        nearby_bins.sort_by_key(|k| k.abs_diff(at));
        nearby_bins.truncate(NEIGHBOUR_COUNT);
        let power = |k: &usize| (run.u[*k] - line.response * run.e[*k]).norm_sqr();
        let mean = nearby_bins.iter().map(power).sum::<f64>() / nearby_bins.len() as f64;
        // Squared modulus of the weight of the run in the average, such as |D_i|^2.
        let d = b.norm_sqr() / run.e[at].norm_sqr();
        squares += d * mean;
    }
    let whole: Complex64 = line.ratio.0.iter().map(|(_, b)| b).sum();
    squares.sqrt() / whole.norm()
}
