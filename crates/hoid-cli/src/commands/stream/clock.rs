//! Comparison of the times of the lines with an evenly spaced grid, to detect missing samples and late lines.
//!
//! Live times have jitter, and their rate differs slightly from `--fs`. The grid therefore follows the times with a
//! small gain. Samples count as missing only if the time of a line deviates by more than half a sample from the
//! expected time.

/// Gain with which the grid follows the times.
const GRID_GAIN: f64 = 0.1;
/// Longest gap that is filled, s.
pub const MAX_GAP_S: f64 = 10.0;
/// Number of consecutive lines with earlier but increasing times after which the clock is assumed to have been set
/// back.
const SET_BACK_LINES: usize = 10;
/// Number of samples by which the grid may be ahead of the times before this is reported.
const MAX_ADVANCE_SAMPLES: f64 = 2.0;

/// Number of lines over which the rate of the times is checked.
const RATE_LINES: usize = 128;
/// Largest tolerated relative deviation of the rate from `--fs`.
const RATE_TOLERANCE: f64 = 0.05;

/// Classification of a line by its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Arrival {
    /// The next sample, after `missing` samples that must be filled in. If the gap is longer than [`MAX_GAP_S`],
    /// `left_out` is true and `missing` is limited to that length.
    Sample { missing: usize, left_out: bool },
    /// A line whose time is not later than the time of the last line.
    Behind { last_s: f64 },
}

/// The evenly spaced grid that follows the times of a stream.
#[derive(Debug)]
pub struct Clock {
    sample_time_s: f64,
    /// Position of the last sample on the grid, and its time.
    last: Option<(f64, f64)>,
    /// Time of the last line that was not later than the last accepted line, and the number of such lines in
    /// succession.
    late: Option<(f64, usize)>,
    has_advanced_too_fast: bool,
    /// Differences of successive times, collected for the next check of the rate, s.
    steps: Vec<f64>,
}

impl Clock {
    pub fn new(sample_time_s: f64) -> Self {
        Self {
            sample_time_s,
            last: None,
            late: None,
            has_advanced_too_fast: false,
            steps: Vec::with_capacity(RATE_LINES),
        }
    }

    /// Processes the time of a line.
    pub fn classify(&mut self, t: f64) -> Arrival {
        let ts = self.sample_time_s;
        let next = Arrival::Sample {
            missing: 0,
            left_out: false,
        };
        let Some((place, last_s)) = self.last else {
            self.last = Some((t, t));
            return next;
        };
        if t <= last_s {
            let row = match self.late {
                Some((before, n)) if t > before => n + 1,
                _ => 1,
            };
            self.late = Some((t, row));
            if row < SET_BACK_LINES {
                return Arrival::Behind { last_s };
            }
            self.late = None;
            self.last = Some((t, t));
            return Arrival::Sample {
                missing: row - 1,
                left_out: false,
            };
        }
        self.late = None;
        let steps = ((t - place) / ts).round().max(1.0);
        let most = (MAX_GAP_S / ts).floor();
        if steps - 1.0 > most {
            self.last = Some((t, t));
            return Arrival::Sample {
                missing: most as usize,
                left_out: true,
            };
        }
        let expected = place + steps * ts;
        self.steps.push(t - last_s);
        self.has_advanced_too_fast |= expected - t > MAX_ADVANCE_SAMPLES * ts;
        self.last = Some((expected + GRID_GAIN * (t - expected), t));
        Arrival::Sample {
            missing: steps as usize - 1,
            left_out: false,
        }
    }

    /// Returns the rate of the times in Hz if it differs from `--fs`. Called after each line, this function returns a
    /// value at most once in [`RATE_LINES`] lines. Both the median and the mean of the differences must deviate: the
    /// median is insensitive to single gaps, the mean to rounded times.
    pub fn deviating_rate(&mut self) -> Option<f64> {
        if self.steps.len() < RATE_LINES {
            return None;
        }
        let mut steps = std::mem::take(&mut self.steps);
        steps.sort_unstable_by(f64::total_cmp);
        let median = steps[RATE_LINES / 2];
        let mean = steps.iter().sum::<f64>() / steps.len() as f64;
        let is_off = |step: f64| (step / self.sample_time_s - 1.0).abs() > RATE_TOLERANCE;
        (is_off(median) && is_off(mean)).then_some(1.0 / median)
    }

    /// True, once, after the grid has run ahead of the times by more than [`MAX_ADVANCE_SAMPLES`] samples, because the
    /// times advance by less than the sample time per line.
    pub fn has_run_ahead(&mut self) -> bool {
        std::mem::take(&mut self.has_advanced_too_fast)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn missing_samples(clock: &mut Clock, t: f64) -> usize {
        match clock.classify(t) {
            Arrival::Sample { missing, .. } => missing,
            late => panic!("{t}: {late:?}"),
        }
    }

    #[test]
    fn gaps_are_counted_despite_jitter_and_drift() {
        let mut clock = Clock::new(0.01);
        for k in 0..20_000 {
            let k = f64::from(k);
            // A clock that is 0.1 % slow, with a jitter of 0.35 samples.
            let t = 0.010_01 * k + 0.0035 * (k * 2.3).sin();
            assert_eq!(missing_samples(&mut clock, t), 0, "{k}");
        }
        let mut clock = Clock::new(0.01);
        for (t, gap) in [(0.0, 0), (0.01, 0), (0.03, 1), (0.0401, 0), (0.14, 9), (9.14, 899)] {
            assert_eq!(missing_samples(&mut clock, t), gap, "{t}");
        }
        assert_eq!(
            clock.classify(100.0),
            Arrival::Sample {
                missing: 1000,
                left_out: true
            }
        );
        assert_eq!(missing_samples(&mut clock, 100.01), 0);
        assert!(!clock.has_run_ahead());
    }

    #[test]
    fn late_lines_are_dropped_until_the_clock_is_accepted() {
        let mut clock = Clock::new(0.01);
        missing_samples(&mut clock, 1.0);
        for t in [1.0, 0.5, 0.4, 1.0] {
            assert_eq!(clock.classify(t), Arrival::Behind { last_s: 1.0 });
        }
        assert_eq!(missing_samples(&mut clock, 1.01), 0);
        // A single wrong time does not end the stream.
        missing_samples(&mut clock, 1e300);
        for k in 0..9 {
            assert!(matches!(
                clock.classify(1.02 + 0.01 * f64::from(k)),
                Arrival::Behind { .. }
            ));
        }
        assert_eq!(missing_samples(&mut clock, 1.11), 9);
        assert_eq!(missing_samples(&mut clock, 1.12), 0);
    }

    #[test]
    fn other_rates_are_distinguished_from_gaps() {
        let rates = |t: &dyn Fn(f64) -> f64| -> Vec<f64> {
            let mut clock = Clock::new(0.01);
            let take = |k: u32| {
                missing_samples(&mut clock, t(f64::from(k)));
                clock.deviating_rate()
            };
            (0..600).filter_map(take).collect()
        };
        for hz in [50.0, 80.0, 110.0, 200.0] {
            let found = rates(&|k| k / hz);
            assert_eq!(found.len(), 4, "{hz}");
            assert!(
                found.iter().all(|rate| (rate / hz - 1.0).abs() < 1e-9),
                "{hz}: {found:?}"
            );
        }
        // First, one sample of ten is missing; then the times have steps of 8 ms.
        assert!(rates(&|k| 0.01 * (k + (k / 9.0).floor())).is_empty());
        assert!(rates(&|k| (0.01 * k / 0.008).floor() * 0.008 + 1e-6 * k).is_empty());
    }

    #[test]
    fn too_fast_lines_are_detected() {
        let mut clock = Clock::new(0.01);
        for k in 0..200 {
            assert_eq!(missing_samples(&mut clock, 0.005 * f64::from(k)), 0);
        }
        assert!(clock.has_run_ahead() && !clock.has_run_ahead());
    }
}
