//! A record without slow components, for a second opinion on a fit.
//!
//! A step or a drift of a sensor cannot be seen from neighbouring samples, and it is not removed with a constant level.
//! The person does not follow it, so e has power at low frequencies to which u does not respond; the estimated gain is
//! then too low and its error bars are too small. The least-squares line and the cosines `cos(pi k (t + 1/2)/N)`,
//! `k = 1 .. 2 T/`[`SLOW_PERIOD_S`] (all components slower than that period) are removed from both channels by the same
//! linear operation, so the dynamics from e to u are preserved. A second fit lacks the information at low frequencies.
//! If nothing is wrong, it differs from the first fit by chance with the variance `var' - var` (J. A. Hausman,
//! *Econometrica* 46 (1978) 1251-1271); if it differs by more, slow components dominate the first fit.

use std::f64::consts::PI;

use hoid_model::{Detrend, Record};

/// Period above which a component is slow for a person, s.
pub const SLOW_PERIOD_S: f64 = 20.0;
/// Largest number of cosines that are removed; it limits the computing time for long records.
const MAX_COSINES: usize = 64;

/// Returns the records without components slower than `period_s`; `None` if all records are too short for such
/// components.
pub fn without_slow_components(records: &[Record], period_s: f64) -> Option<Vec<Record>> {
    let count = |r: &Record| ((2.0 * r.len() as f64 * r.sample_time().s() / period_s) as usize).min(MAX_COSINES);
    records.iter().any(|r| count(r) > 0).then(|| {
        let each = records.iter().map(|record| {
            let flat = record.clone().detrended(Detrend::Linear);
            let quick = flat.map_signals(|values| remove_cosines(values, count(record)));
            quick.unwrap_or_else(|_| record.clone())
        });
        each.collect()
    })
}

fn remove_cosines(values: &mut [f64], count: usize) {
    let n = values.len() as f64;
    for k in 1..=count {
        let wave = |t: usize| (PI * k as f64 * (t as f64 + 0.5) / n).cos();
        let size = values.iter().enumerate().map(|(t, v)| v * wave(t)).sum::<f64>() * 2.0 / n;
        values.iter_mut().enumerate().for_each(|(t, v)| *v -= size * wave(t));
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::{Channel, SampleTime};
    use hoid_numerics::statistics::root_mean_square;

    use super::*;

    fn record(n: usize, e: impl Fn(f64) -> f64) -> Record {
        let values = |gain: f64| (0..n).map(|t| gain * e(t as f64 * 0.01)).collect();
        let ts = SampleTime::new(0.01).unwrap();
        Record::new(
            ts,
            Channel::new("e", "", values(1.0)),
            Channel::new("u", "", values(0.3)),
        )
        .unwrap()
    }

    #[test]
    fn slow_components_are_removed_and_fast_ones_kept() {
        let remaining = |e: &dyn Fn(f64) -> f64| {
            let before = record(8000, e);
            let after = &without_slow_components(std::slice::from_ref(&before), SLOW_PERIOD_S).unwrap()[0];
            // u is .3 e before and after.
            let same = after.input().iter().zip(after.output());
            assert!(same.clone().all(|(e, u)| (0.3 * e - u).abs() < 1e-9));
            root_mean_square(after.input()) / root_mean_square(before.input())
        };
        assert!(remaining(&|t| 3.0 + 0.2 * t) < 1e-9);
        assert!(remaining(&|t| (2.0 * PI * t / 60.0).sin()) < 0.1);
        // A step keeps its edge.
        assert!(remaining(&|t| f64::from(u8::from(t > 31.0))) < 0.25);
        for period in [10.0, 2.0, 0.5] {
            let left = remaining(&|t| (2.0 * PI * t / period + 0.3).sin());
            assert!((left - 1.0).abs() < 0.05, "{period} s: {left}");
        }
    }

    #[test]
    fn short_records_give_no_result() {
        assert!(without_slow_components(&[record(900, f64::sin)], SLOW_PERIOD_S).is_none());
        assert!(without_slow_components(&[], SLOW_PERIOD_S).is_none());
    }
}
