//! Serialisation of a tracker, so that it can be continued elsewhere with bit-identical results.
//!
//! In the binary format (`binary_format`), the description contains the request and the orders, and the data are the
//! numbers of [`hoid_track::Live::save`].

use hoid_model::Orders;
use serde_json::{Value, json};

use crate::{
    binary_format::{UnpackError, as_bytes, as_numbers, pack, unpack},
    options::TrackerRequest,
    session::Session,
    status::{Failure, HOID_BAD_STATE},
};

const MAGIC: [u8; 8] = *b"hoid\x01\0\0\0";
impl Session {
    /// Returns the tracker as bytes, without changing it.
    pub fn save(&mut self) -> Vec<u8> {
        let (asked, live) = self.request_and_recursion();
        let (orders, numbers) = live.save();
        let orders = orders.map(|o| json!([o.na, o.nb, o.nc, o.nd, o.nf, o.nk]));
        let description = json!({
            "hoid": env!("CARGO_PKG_VERSION"),
            "method": asked.method,
            "sample_time": asked.sample_time_s,
            "options": asked.options,
            "fit": asked.fit,
            "orders": orders,
        });
        pack(MAGIC, &description, &as_bytes(&numbers))
    }

    /// Restores a tracker from the bytes of [`Session::save`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Failure> {
        let wrong = |text: &str| Failure::new(HOID_BAD_STATE, format!("{text}; save the tracker again"));
        let damaged = || wrong("the bytes were changed or truncated since they were saved");
        let (description, numbers) = unpack(MAGIC, bytes).map_err(|closed| match closed {
            UnpackError::Other => wrong("the bytes are not a tracker that this version of hoid has saved"),
            UnpackError::Damaged => damaged(),
        })?;
        let numbers = as_numbers(numbers).ok_or_else(damaged)?;
        let orders = match &description["orders"] {
            Value::Null => None,
            listed => Some(orders(listed).ok_or_else(damaged)?),
        };
        let text = |name: &str| description[name].as_str().map(str::to_owned);
        let asked = TrackerRequest {
            method: text("method"),
            sample_time_s: description["sample_time"].as_f64().ok_or_else(damaged)?,
            options: text("options"),
            fit: text("fit"),
        };
        let of_state = |failure: Failure| Failure::new(HOID_BAD_STATE, failure.text);
        let mut session = Self::of(asked).map_err(of_state)?;
        session.restore(orders, &numbers).map_err(of_state)?;
        Ok(session)
    }
}

fn orders(listed: &Value) -> Option<Orders> {
    let all: Vec<usize> = (listed.as_array()?.iter())
        .map(|n| usize::try_from(n.as_u64()?).ok())
        .collect::<Option<_>>()?;
    let &[na, nb, nc, nd, nf, nk] = all.as_slice() else {
        return None;
    };
    Some(Orders { na, nb, nc, nd, nf, nk })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::{Condition, Scenario};
    use hoid_sim::{RunSeed, Simulator};
    use hoid_track::Sample;

    use super::*;

    const NO_WARM_UP: &str =
        r#"{"nk": 29, "nd": 1, "start": {"b0": 0.04, "b1": -0.04, "d1": -0.8, "f1": -1.9, "f2": 0.92}}"#;

    /// Number of samples before saving, and total number; under Miri a few samples suffice.
    const SAMPLE_COUNTS: [usize; 2] = if cfg!(miri) { [5, 8] } else { [1500, 2500] };

    fn samples() -> Vec<Sample> {
        if cfg!(miri) {
            let each = (0..SAMPLE_COUNTS[1]).map(|k| [(0.3 * k as f64).sin(), (0.2 * k as f64).cos()]);
            return each.map(|[e, u]| Sample { e, u, reference: None }).collect();
        }
        let simulator = Simulator::new(&Scenario::condition(Condition::C4)).unwrap();
        let record = simulator.run(RunSeed::default(), false).unwrap();
        let pairs = record.input().iter().zip(record.output());
        let sample = |(e, u): (&f64, &f64)| Sample {
            e: *e,
            u: *u,
            reference: None,
        };
        pairs.map(sample).collect()
    }

    #[test]
    fn restored_tracker_is_bit_identical() {
        let samples = samples();
        let [taken, all] = SAMPLE_COUNTS;
        // The second name is an earlier name of the method, as in older saved trackers.
        let of_bank = [
            ("adaptive", None, 0.01),
            ("population", None, 0.01),
            ("adaptive", None, 0.001),
        ];
        let at_work = [("rpem", Some(NO_WARM_UP), 0.01)];
        let warm = [
            ("rpem", Some("{\"nk\": 29, \"nd\": 1, \"warm_up\": 20}"), 0.01),
            ("rpem", Some("{\"nk\": 29, \"nd\": [1, 2], \"warm_up\": 10}"), 0.01),
        ];
        let warming = [("rpem", Some("{\"nk\": 29, \"nd\": 1, \"warm_up\": 1}"), 0.01)];
        let cases = if cfg!(miri) {
            [&at_work[..], &warming].concat()
        } else {
            [&of_bank[..], &at_work, &warm, &warming].concat()
        };
        for (method, options, sample_time_s) in cases {
            let mut first = Session::new(Some(method), sample_time_s, options, None).unwrap();
            for sample in &samples[..taken] {
                first.take(*sample, true);
            }
            let bytes = first.save();
            assert_eq!(bytes, first.save(), "saving changes nothing");
            let mut second = Session::from_bytes(&bytes).unwrap();
            for sample in &samples[taken..all] {
                let (a, b) = (first.take(*sample, true), second.take(*sample, true));
                assert_eq!(a.innovation.to_bits(), b.innovation.to_bits());
            }
            assert_eq!(first.covariance(), second.covariance(), "{method} {options:?}");
            assert_eq!(first.counts(), second.counts());
        }
    }

    #[test]
    fn damaged_bytes_are_refused() {
        let (method, options) = if cfg!(miri) {
            (Some("rpem"), Some(NO_WARM_UP))
        } else {
            (None, None)
        };
        let mut session = Session::new(method, 0.01, options, None).unwrap();
        let bytes = session.save();
        let places = if cfg!(miri) { 9 } else { 199 };
        let refused = |bytes: &[u8]| {
            let failure = Session::from_bytes(bytes).err().unwrap();
            assert_eq!(failure.status, HOID_BAD_STATE);
        };
        for length in [0, 7, 8, 15, 16, 24, 100, bytes.len() - 1] {
            refused(&bytes[..length.min(bytes.len())]);
        }
        for place in (0..bytes.len()).step_by(bytes.len() / places + 1) {
            let mut changed = bytes.clone();
            changed[place] ^= 0x40;
            refused(&changed);
        }
        // Even with a valid checksum, the description must be valid.
        for (from, to) in [
            ("adaptive", "ldaptive"),
            ("\"orders\":[", "\"orders\":{"),
            ("0.01", "-.01"),
        ] {
            let place = bytes.windows(from.len()).position(|window| window == from.as_bytes());
            let Some(place) = place else { continue };
            let mut changed = bytes[..bytes.len() - 8].to_vec();
            changed[place..place + from.len()].copy_from_slice(to.as_bytes());
            let true_sum = crate::binary_format::checksum(&changed);
            changed.extend_from_slice(&true_sum.to_le_bytes());
            refused(&changed);
        }
    }
}
