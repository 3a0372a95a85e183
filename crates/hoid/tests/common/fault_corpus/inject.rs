//! Insertion of each fault into a recording.

use hoid::prelude::RunSeed;

use super::{
    kinds::{Change, Channels, Fault, FaultPosition, WHOLE_LENGTH_S},
    table::{Table, standard_deviation},
};

/// A recording with its fault.
#[derive(Debug, Clone)]
pub struct FaultyRecording {
    pub table: Table,
    /// Start of the fault, s from the first sample.
    pub from_s: f64,
    pub to_s: f64,
    /// The first row that differs, and the first row after the last differing row, counted in the recording without the
    /// fault.
    pub rows: (usize, usize),
}

/// Returns a number in [0, 1) for a case, by SplitMix64 (G. L. Steele et al., OOPSLA 2014).
pub fn uniform(seed: u64, case: u64, draw: u64) -> f64 {
    let mut z = seed
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add(case.wrapping_mul(0xd1b5_4a32_d192_ed03))
        .wrapping_add((draw + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Inserts a fault into a recording. `second` is a recording of another person.
pub fn inject(fault: &Fault, clean: &Table, second: &Table, seed: u64, case: u64) -> FaultyRecording {
    let mut table = clean.clone();
    let n = clean.len();
    let (of_e, of_u) = (standard_deviation(&clean.e), standard_deviation(&clean.u));
    let draw = |i: u64| uniform(seed, case, i);
    let sign = |i: u64| if draw(i) < 0.5 { -1.0 } else { 1.0 };
    let near = |share: f64| ((share + 0.02 * (draw(0) - 0.5)) * n as f64) as usize;
    let at = match fault.place {
        FaultPosition::Start => near(0.06),
        FaultPosition::Middle => near(0.5),
        FaultPosition::End => near(0.9),
        FaultPosition::Whole => 0,
    };
    let samples = |seconds: f64| ((seconds / clean.h).round() as usize).max(1);
    let until = |length: usize| at.saturating_add(length).min(n);
    let (on, size) = (fault.kind.on, fault.size);
    let seconds = if size == WHOLE_LENGTH_S { n } else { samples(size) };
    // Rows that differ from the recording without the fault.
    let mut rows = (at, n);
    let mut stays = false;
    match fault.kind.what {
        Change::Nothing => rows = (0, 0),
        Change::Spike => {
            rows = (at, at + 1);
            change_each(&mut table, on, rows, |x, k, e| {
                x + sign(1 + k as u64) * size * if e { of_e } else { of_u }
            });
        }
        Change::Burst => {
            rows = (at, until(size as usize));
            change_each(&mut table, on, rows, |x, k, e| {
                x + sign(1 + 2 * k as u64 + u64::from(e)) * 10.0 * if e { of_e } else { of_u }
            });
        }
        Change::Missing => {
            rows = (at, until(size as usize));
            change_each(&mut table, on, rows, |_, _, _| f64::NAN);
        }
        Change::Wrap => {
            rows = (at, until(seconds));
            change_each(&mut table, on, rows, |x, _, _| x + 360.0);
        }
        Change::Step | Change::Offset => {
            stays = fault.kind.what == Change::Step;
            let by = sign(1) * size / 100.0;
            change_each(&mut table, on, rows, |x, _, e| x + by * if e { of_e } else { of_u });
        }
        Change::Drift => {
            let by = sign(1) * size / n as f64;
            change_each(&mut table, on, rows, |x, k, e| {
                x + by * k as f64 * if e { of_e } else { of_u }
            });
        }
        Change::Frozen => {
            rows = (at, until(seconds));
            let (e, u) = (clean.e[at], clean.u[at]);
            change_each(&mut table, on, rows, |_, _, is_e| if is_e { e } else { u });
        }
        Change::Idle | Change::IdleNoisy => {
            // The position is before, inside or after the run.
            let at = match fault.place {
                FaultPosition::Start => 0,
                FaultPosition::End => n,
                FaultPosition::Middle | FaultPosition::Whole => at,
            };
            let small = if fault.kind.what == Change::Idle { 0.0 } else { 1e-3 };
            let length = samples(size);
            for (i, column) in table.columns_mut().enumerate() {
                let noise = RunSeed {
                    seed,
                    cell: case,
                    replication: 1 + i as u64,
                }
                .white_noise(length);
                let sigma = standard_deviation(column);
                column.splice(at..at, noise.into_iter().map(|z| small * sigma * z));
            }
            table.renumber();
            return FaultyRecording {
                from_s: at as f64 * clean.h,
                to_s: (at + length) as f64 * clean.h,
                table,
                rows: (at, at),
            };
        }
        Change::Dropout => {
            rows = (at, until(seconds));
            change_each(&mut table, on, rows, |_, _, _| 0.0);
        }
        Change::Scaled | Change::ScaledLong => {
            let length = match fault.kind.what {
                Change::Scaled => samples(10.0),
                _ => samples(50.0).min(2 * n / 5),
            };
            rows = (at, until(length));
            change_each(&mut table, on, rows, |x, _, _| x * size);
        }
        Change::Milliseconds => table.t.iter_mut().for_each(|t| *t *= size),
        Change::Swapped => {
            rows = (at, until(seconds));
            table.e[at..rows.1].swap_with_slice(&mut table.u[at..rows.1]);
        }
        Change::Flipped => {
            rows = (at, until(seconds));
            change_each(&mut table, on, rows, |x, _, _| -x);
        }
        Change::Saturated => change_each(&mut table, on, rows, |x, _, e| {
            let most = size * if e { of_e } else { of_u };
            x.clamp(-most, most)
        }),
        Change::Quantised => change_each(&mut table, on, rows, |x, _, e| {
            let step = size * if e { of_e } else { of_u };
            (x / step).round() * step
        }),
        Change::Lost | Change::Duplicated => {
            stays = true;
            rows = (at, until(seconds));
            for column in table.columns_mut() {
                if fault.kind.what == Change::Lost {
                    column.drain(at..rows.1);
                } else {
                    let again = column[at..rows.1].to_vec();
                    column.splice(rows.1..rows.1, again);
                }
            }
            table.renumber();
        }
        Change::Late => {
            stays = true;
            let by = size as usize;
            for k in at..n {
                table.u[k] = clean.u[if k < at + by { at } else { k - by }];
            }
        }
        Change::Short => {
            rows = (size as usize, n);
            for column in table.columns_mut() {
                column.truncate(rows.0);
            }
            table.renumber();
            return FaultyRecording {
                from_s: 0.0,
                to_s: table.duration_s(),
                table,
                rows,
            };
        }
        Change::SecondOperator => {
            stays = true;
            let third = 2 * n / 3;
            rows = (third, n);
            table.e[third..].copy_from_slice(&second.e[third..n]);
            table.u[third..].copy_from_slice(&second.u[third..n]);
        }
    }
    let last = if stays { rows.0 } else { rows.1 };
    FaultyRecording {
        from_s: rows.0 as f64 * clean.h,
        to_s: last as f64 * clean.h,
        table,
        rows,
    }
}

/// Changes the values of the channels in some rows: `change` receives a value, its row, and true if the value belongs
/// to e.
fn change_each(table: &mut Table, on: Channels, rows: (usize, usize), change: impl Fn(f64, usize, bool) -> f64) {
    for k in rows.0..rows.1 {
        if on.e() {
            table.e[k] = change(table.e[k], k, true);
        }
        if on.u() {
            table.u[k] = change(table.u[k], k, false);
        }
    }
}
