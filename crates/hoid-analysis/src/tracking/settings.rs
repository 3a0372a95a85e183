//! Settings of a recursion as printed.

use hoid_ident::{Choice, settings::DelayRange};
use hoid_model::Decimation;
use hoid_track::{Method, StartSource, Trace, TrackOptions, TrackPlan, TrackRequest};

use super::tracked::CovarianceSource;
use crate::{recordings::Recordings, settings::Setting};

/// Returns all options of a recursion with units, including defaults.
pub fn settings_of_recursion(
    asked: &TrackRequest,
    plan: &TrackPlan,
    options: &TrackOptions,
    choice: Option<&Choice>,
) -> Vec<Setting> {
    let mut orders = options.orders.to_string();
    if let Some(choice) = choice {
        orders.push_str(&format!(
            " (chosen from {} by {})",
            plan.ranges(),
            choice.criterion.label()
        ));
    }
    let own = options.method.settings();
    let value = |name: &str| own.get(name).filter(|text| !text.is_empty());
    let listed = own.list();
    let mut memories = listed.iter().filter(|one| one.name.starts_with("memory"));
    let memory_given = memories.any(|one| value(one.name).is_some_and(|text| text != one.default));
    let mut list = vec![
        Setting::new("method", options.method.name()).with_given(options.method.name() != Method::default().name()),
        Setting::new("structure", options.structure.name()).with_given(asked.structure.is_some()),
        Setting::new("orders", orders).with_given(!asked.orders.is_empty() || asked.delay.is_some()),
    ];
    if let Some(further) = &options.further {
        list.push(Setting::new("further input", further.to_string()).with_given(true));
    }
    if let Some(delay @ DelayRange::Seconds(..)) = &asked.delay {
        list.push(Setting::new("delay", delay.to_string()).with_given(true));
    }
    list.push(Setting::new("memory", options.memory_as_text(plan.sample_time())).with_given(memory_given));
    for one in &listed {
        // The memory lengths, including the defaults of all parameters, have been added above.
        if let Some(text) = value(one.name) {
            let given = text != one.default;
            list.push(Setting::new(one.name.replace('_', " "), text).with_given(given));
        }
    }
    if options.method.innovation_limit().is_finite() {
        list.push(Setting::new(
            "limit of innovations",
            format!("{} standard deviations", options.method.innovation_limit()),
        ));
    }
    if !options.at_rad_s.is_empty() {
        let each: Vec<String> = options.at_rad_s.iter().map(f64::to_string).collect();
        list.push(Setting::new("response at", format!("{} rad/s", each.join(", "))).with_given(true));
    }
    if let Some(element) = &options.controlled_element {
        list.push(Setting::new("controlled element", element.to_string()).with_given(true));
    }
    let fault = format!("not a finite number, or larger than {}", options.largest);
    list.push(Setting::new("fault", fault).with_given(options.largest != TrackOptions::DEFAULT_MAX_MAGNITUDE));
    list
}

/// Settings that do not belong to the recursion: second run, start and rows of the trace.
pub(super) struct OwnSettings<'a> {
    pub trace: &'a Trace,
    pub options: &'a TrackOptions,
    pub covariance: Option<&'a CovarianceSource>,
    pub start_given: bool,
    pub update_given: bool,
    /// Length of the moving average in rows.
    pub rows: usize,
    /// Number of samples per row, and whether the user gave it.
    pub every: (usize, bool),
    pub rate: Decimation,
}

impl OwnSettings<'_> {
    /// Returns these settings, and the options with which the file was read.
    pub fn list(&self, data: &Recordings) -> Vec<Setting> {
        let Self {
            trace,
            options,
            rows,
            every: (every, every_given),
            ..
        } = *self;
        let mut list = Vec::new();
        match self.covariance {
            Some(CovarianceSource::Chosen(file, choice)) => {
                let words = format!(
                    "the best of {} values: its trace explains most of {file} from {:.2} to {:.2} s, VAF {:.2} %",
                    choice.candidates.len(),
                    choice.span_s.0,
                    choice.span_s.1,
                    choice.vaf()
                );
                list.push(Setting::new("covariance chosen", words));
            }
            Some(CovarianceSource::Updated(file)) => {
                let words = format!("by the VAF of the estimate on {file}");
                list.push(Setting::new("covariance updated", words).with_given(true));
            }
            None => {}
        }
        let words = match &options.start {
            _ if options.method.is_self_starting() => options.start_as_text(),
            StartSource::Span(Some((from, to))) => format!("batch fit of {from:.2} to {to:.2} s"),
            StartSource::Span(None) => "batch fit of the first third".to_owned(),
            StartSource::Theta(_) => "given".to_owned(),
            StartSource::Nothing => "nothing".to_owned(),
        };
        list.push(Setting::new("start", words).with_given(self.start_given));
        if trace.idle_s() > 0.0 {
            let words = format!("{:.2} s, in which neither e nor u moves", trace.idle_s());
            list.push(Setting::new("idle head", words));
        }
        if options.method.requests_two_sided() {
            list.push(Setting::new("estimate", "two-sided, from the whole record"));
        } else {
            let words = format!("{:.2} s", trace.updated_from_s());
            list.push(Setting::new("estimate moves from", words).with_given(self.update_given));
        }
        if rows > 1 {
            let lag = (rows - 1) as f64 / 2.0 * every as f64 * data.records[0].sample_time().s();
            list.push(Setting::new("moving average", format!("{rows} rows, lags by {lag:.3} s")).with_given(true));
        }
        if let Some(source) = &data.source {
            list.extend(source.reading.settings(self.rate));
        }
        list.push(Setting::new("rows of the trace", format!("every {every} samples")).with_given(every_given));
        list
    }
}
