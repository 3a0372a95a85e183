//! A record in which no single sample can dominate a fit, for a second opinion.
//!
//! Each sample of e and u is limited relative to its interpolation from both sides. The interpolation error
//! `r(t) = sum_i a_i eps(t+i)/|a|^2` has the standard deviation `s = sigma/|a|`; a sample beyond `c s` is moved to this
//! limit, `x(t) - r + c s sign(r)` (a two-sided version of the filter cleaner of R. D. Martin and D. J. Thomson, *Proc.
//! IEEE* 70 (1982) 1097-1115). The sample with the largest error is moved first, and its neighbours are then examined
//! again: an outlier affects the interpolation of its neighbours, which would otherwise be moved instead. This bounds
//! the effect of any sample of e or u on subsequent filters, and thus its leverage on theta. With c =
//! [`INTERPOLATION_ERROR_LIMIT`], one sample in 16 000 of a normally distributed channel is moved. If a fit to this
//! record differs from the fit to the original record, a few samples dominate the fit; if no sample is moved, the two
//! fits are identical.

use std::{cmp::Ordering, collections::BinaryHeap};

use hoid_model::Record;

use super::{
    autoregression::{Autoregression, NOISE_FLOOR},
    robust::{level_and_deviation, quantisation_step},
    spikes::innovation_scales,
};

/// Limit of the interpolation error of a sample, in standard deviations.
const INTERPOLATION_ERROR_LIMIT: f64 = 4.0;

/// Returns the record with limited samples; `None` if no sample is moved.
pub fn limited_record(record: &Record) -> Option<Record> {
    let ts = record.sample_time().s();
    let mut moved = false;
    let held = record.clone().map_signals(|values| moved |= limit_samples(values, ts));
    held.ok().filter(|_| moved)
}

fn limit_samples(values: &mut [f64], sample_time_s: f64) -> bool {
    let (level, deviation) = level_and_deviation(values);
    let x: Vec<f64> = values.iter().map(|v| v - level).collect();
    let Some(ar) = Autoregression::of(&x, deviation) else {
        return false;
    };
    let mut eps = ar.residuals(&x);
    let norm = ar.norm();
    let window = ((1.0 / sample_time_s) as usize).clamp(64, 4096);
    let sigma = innovation_scales(
        &eps,
        window,
        (NOISE_FLOOR * deviation).max(quantisation_step(values)) * norm,
    );
    let (p, n) = (ar.order(), x.len());
    let error =
        |eps: &[f64], t: usize| -> f64 { ar.a.iter().zip(&eps[t..]).map(|(a, e)| a * e).sum::<f64>() / (norm * norm) };
    let most = |t: usize| INTERPOLATION_ERROR_LIMIT * sigma.at(t) / norm;
    let inside = p..n.saturating_sub(p);
    let mut queue: BinaryHeap<Excess> = inside
        .clone()
        .map(|t| Excess::of(error(&eps, t).abs() / most(t), t))
        .filter(|excess| excess.ratio > 1.0)
        .collect();
    let mut moves = 0;
    while let Some(Excess { ratio, t }) = queue.pop() {
        let (r, most_here) = (error(&eps, t), most(t));
        // Skips outdated entries: a sample whose error has changed because a neighbour was moved is now within its
        // limit, or is in the queue again.
        if r.abs() <= most_here || (r.abs() / most_here - ratio).abs() > 1e-9 * ratio {
            continue;
        }
        let by = r - most_here * r.signum();
        values[t] -= by;
        ar.a.iter().zip(&mut eps[t..]).for_each(|(a, e)| *e -= a * by);
        moves += 1;
        if moves > n {
            break;
        }
        for near in t.saturating_sub(p).max(p)..(t + p + 1).min(inside.end) {
            let ratio = error(&eps, near).abs() / most(near);
            if near != t && ratio > 1.0 {
                queue.push(Excess::of(ratio, near));
            }
        }
    }
    moves > 0
}

/// A sample beyond its limit, with the ratio of its interpolation error to the limit.
struct Excess {
    ratio: f64,
    t: usize,
}

impl Excess {
    fn of(ratio: f64, t: usize) -> Self {
        Self { ratio, t }
    }
}

impl Ord for Excess {
    fn cmp(&self, other: &Self) -> Ordering {
        self.ratio.total_cmp(&other.ratio).then(other.t.cmp(&self.t))
    }
}

impl PartialOrd for Excess {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Excess {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Excess {}

/// Returns all records with limited samples; `None` if no sample of any record is moved.
pub fn limited_records(records: &[Record]) -> Option<Vec<Record>> {
    let all: Vec<Option<Record>> = records.iter().map(limited_record).collect();
    all.iter().any(Option::is_some).then(|| {
        let pairs = all.into_iter().zip(records);
        pairs
            .map(|(held, as_is)| held.unwrap_or_else(|| as_is.clone()))
            .collect()
    })
}

#[cfg(test)]
mod tests {
    use hoid_model::{Channel, SampleTime};

    use super::{super::test_signals::autoregressive_signal, *};

    fn record(e: Vec<f64>) -> Record {
        let u = autoregressive_signal(e.len(), 77);
        let ts = SampleTime::new(0.01).unwrap();
        Record::new(ts, Channel::new("e", "", e), Channel::new("u", "", u)).unwrap()
    }

    #[test]
    fn influence_of_one_sample_is_bounded() {
        let clean = autoregressive_signal(3000, 21);
        let mut held = Vec::new();
        for size in [10.0, 1e3, 1e5] {
            let mut e = clean.clone();
            e[1700] += size;
            let whole = limited_record(&record(e)).unwrap();
            held.push(whole.input()[1700]);
            // Its neighbours stay unchanged.
            let off = |t: usize| (whole.input()[t] - clean[t]).abs();
            let others = (0..clean.len()).filter(|t| *t != 1700 && off(*t) > 0.0).count();
            assert!(others <= 4, "{size}: {others} others moved");
        }
        // The limited value does not depend on the size of the error.
        assert!(
            (held[1] - held[2]).abs() < 0.1 && (held[0] - held[1]).abs() < 1.0,
            "{held:?}"
        );
        assert!((held[1] - clean[1700]).abs() < 5.0);
        let moved = limited_record(&record(clean.clone()))
            .map_or(0, |r| r.input().iter().zip(&clean).filter(|(a, b)| a != b).count());
        assert!(moved <= 2, "{moved}");
        assert!(limited_record(&record(vec![1.0; 3000])).is_none_or(|r| r.input() == vec![1.0; 3000]));
    }
}
