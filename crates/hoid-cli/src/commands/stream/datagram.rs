//! Samples and estimates as datagrams: lines of text in the same format as on standard input (cells or JSON objects),
//! or packed little-endian C structs.
//!
//! ```c
//! struct sample {             /* 40 bytes */
//!     char magic[4];          /* "hoid" */
//!     uint32_t sequence;      /* one more at each sample */
//!     double t, e, u, f_t;    /* s; NaN: t is sequence times the sample time, others are missing */
//! };
//! struct estimate {           /* 168 bytes */
//!     char magic[4];          /* "hoid" */
//!     uint32_t sequence;      /* of the sample */
//!     double t;               /* s */
//!     double operator_[12];   /* K_e, T_L, K_e_dot, omega_nm, zeta_nm, tau_e, each followed by its standard error */
//!     double open_loop[4];    /* crossover_rad_s, phase_margin_deg, each followed by its standard error */
//!     double innovation;
//!     double change_t;        /* s; time of a change declared since the last estimate */
//!     int32_t level;          /* 0 trustworthy, 1 doubtful, 2 not determined */
//!     uint32_t ready;         /* 1 once there is an estimate */
//! };
//! ```
//!
//! Unknown values are NaN.

use hoid::model::{SampleTime, VerdictLevel, uncertainty::Estimate};
use hoid::track::{Change, Live};

use super::lines::StreamSample;

const MAGIC: &[u8; 4] = b"hoid";
/// Sizes of a sample and of an estimate, in bytes.
const SAMPLE_BYTES: usize = 40;
const ESTIMATE_BYTES: usize = 168;

/// Content of a datagram.
#[derive(Debug, PartialEq)]
pub enum Datagram<'b> {
    Sample(SampleDatagram),
    Lines(&'b str),
    Unreadable(String),
}

/// A sample as a struct.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleDatagram {
    pub sequence: u32,
    t: f64,
    e: f64,
    u: f64,
    f_t: f64,
}

impl<'b> Datagram<'b> {
    pub fn of(bytes: &'b [u8]) -> Self {
        if let Some(rest) = bytes.strip_prefix(MAGIC) {
            return match rest.first_chunk::<{ SAMPLE_BYTES - 4 }>() {
                Some(all) if rest.len() == SAMPLE_BYTES - 4 => Self::Sample(SampleDatagram::of(all)),
                _ => Self::Unreadable(format!(
                    "the datagram starts like a sample, but has {} bytes; expected {SAMPLE_BYTES}",
                    bytes.len()
                )),
            };
        }
        match std::str::from_utf8(bytes) {
            Ok(text) => Self::Lines(text),
            Err(_) => Self::Unreadable(format!(
                "the datagram of {} bytes is neither a sample nor text",
                bytes.len()
            )),
        }
    }
}

impl SampleDatagram {
    fn of(bytes: &[u8; SAMPLE_BYTES - 4]) -> Self {
        let mut number = [0; 4];
        number.copy_from_slice(&bytes[..4]);
        let (numbers, _) = bytes[4..].as_chunks::<8>();
        let [t, e, u, f_t] = [0, 1, 2, 3].map(|i| f64::from_le_bytes(numbers[i]));
        Self {
            sequence: u32::from_le_bytes(number),
            t,
            e,
            u,
            f_t,
        }
    }

    /// Converts the sample to the form read from a line; an invalid value is NaN.
    pub fn to_sample(self, sample_time: SampleTime, largest: f64) -> StreamSample {
        let sound = |v: f64| v.abs() <= largest;
        let fault = |name: &str, v: f64| (!sound(v)).then(|| format!("{name} is {v}"));
        let faults: Vec<String> = [fault("e", self.e), fault("u", self.u)].into_iter().flatten().collect();
        let value = |v: f64| if sound(v) { v } else { f64::NAN };
        StreamSample {
            t: Some(if self.t.is_finite() {
                self.t
            } else {
                f64::from(self.sequence) * sample_time.s()
            }),
            e: value(self.e),
            u: value(self.u),
            reference: Some(self.f_t).filter(|f| sound(*f)),
            fault: (!faults.is_empty()).then(|| faults.join("; ")),
        }
    }
}

/// An estimate as a struct.
pub struct EstimateDatagram {
    bytes: [u8; ESTIMATE_BYTES],
}

impl EstimateDatagram {
    pub fn new(
        sequence: u32,
        t: Option<f64>,
        live: &Live,
        innovation: Option<f64>,
        change: Option<&(Option<f64>, Change)>,
    ) -> Self {
        let tracker = live.tracker();
        let operator = tracker.map(|tracker| tracker.operator());
        let level = tracker
            .zip(operator.as_ref())
            .map(|(tracker, operator)| tracker.verdict_level(operator));
        let level = match level.unwrap_or(VerdictLevel::NotDetermined) {
            VerdictLevel::Trustworthy => 0_i32,
            VerdictLevel::Doubtful => 1,
            VerdictLevel::NotDetermined => 2,
        };
        let rows = operator
            .and_then(Result::ok)
            .map(|operator| operator.rows().map(|(.., e)| Some(e)));
        let open_loop = tracker.and_then(|tracker| tracker.open_loop()).and_then(Result::ok);
        let of_loop = [
            open_loop.map(|found| found.crossover_rad_s),
            open_loop.map(|found| found.phase_margin_deg),
        ];
        let pair = |e: &Option<Estimate>| {
            let value = e.map_or(f64::NAN, |e| e.value);
            [value, e.and_then(|e| e.standard_error).unwrap_or(f64::NAN)]
        };
        let changed = change.and_then(|(t, change)| Some((*t)? - change.seconds_ago));
        let estimates = rows.unwrap_or([None; 6]);
        let numbers = std::iter::once(t.unwrap_or(f64::NAN))
            .chain(estimates.iter().chain(&of_loop).flat_map(pair))
            .chain([innovation.unwrap_or(f64::NAN), changed.unwrap_or(f64::NAN)]);
        let mut all = Vec::with_capacity(ESTIMATE_BYTES);
        all.extend_from_slice(MAGIC);
        all.extend_from_slice(&sequence.to_le_bytes());
        all.extend(numbers.flat_map(f64::to_le_bytes));
        all.extend_from_slice(&level.to_le_bytes());
        all.extend_from_slice(&u32::from(tracker.is_some()).to_le_bytes());
        let mut bytes = [0; ESTIMATE_BYTES];
        bytes.copy_from_slice(&all);
        Self { bytes }
    }

    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn sample(sequence: u32, numbers: [f64; 4]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend_from_slice(&sequence.to_le_bytes());
        bytes.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
        bytes
    }

    #[test]
    fn samples_are_read_as_structs_and_as_text() {
        let read = |bytes: &[u8]| match Datagram::of(bytes) {
            Datagram::Sample(sample) => sample.to_sample(SampleTime::AT_100_HZ, 1e6),
            other => panic!("{other:?}"),
        };
        let found = read(&sample(7, [f64::NAN, 0.5, -1.0, f64::NAN]));
        assert_eq!(
            (found.t, found.e, found.u, found.reference),
            (Some(0.07), 0.5, -1.0, None)
        );
        let found = read(&sample(7, [2.5, 1e7, f64::INFINITY, 3.0]));
        assert_eq!((found.t, found.reference), (Some(2.5), Some(3.0)));
        assert!(found.e.is_nan() && found.u.is_nan());
        assert_eq!(found.fault.as_deref(), Some("e is 10000000; u is inf"));
        assert_eq!(Datagram::of(b"0,1,2\n"), Datagram::Lines("0,1,2\n"));
        assert_eq!(Datagram::of(b""), Datagram::Lines(""));
        let whole = sample(7, [0.0; 4]);
        let longer = [&whole[..], b"x"].concat();
        for wrong in [&whole[..39], &whole[..4], &longer, b"\xff\xfe"] {
            assert!(matches!(Datagram::of(wrong), Datagram::Unreadable(_)));
        }
    }
}
