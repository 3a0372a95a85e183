//! The time of a file: its name, its grid, the handling of gaps and jitter, and spans.

#![allow(clippy::unwrap_used, reason = "a test may fail at any line, its helpers as well")]

mod common;

use common::{TestFolder, default_options};
use hoid_io::{IoError, Preparation, QualityIssueKind, ReadOptions, ReadRecord, Repair, read_prepared, read_record};

const FILL: Repair = Repair {
    resample: false,
    fill: true,
};
const RESAMPLE: Repair = Repair {
    resample: true,
    fill: false,
};

#[test]
fn recorder_names_of_time_are_accepted() {
    let directory = tempfile::tempdir().unwrap();
    let read = |header: &str, factor: f64| {
        let path = directory.path().join("run.csv");
        let row = |k: i32| format!("{:.3};{k};{}\n", f64::from(k) / 60.0 * factor, 2 * k);
        let rows: String = (0..40).map(row).collect();
        std::fs::write(&path, format!("{header}\n{rows}")).unwrap();
        read_record(&path, &ReadOptions::default())
    };
    // The times are printed to a microsecond or a millisecond; the grid is found in both cases.
    let found = read("Time [ms];e;u", 1000.0).unwrap();
    assert!((found.record.sample_time().s() - 1.0 / 60.0).abs() < 1e-6);
    assert!(
        found
            .notes
            .iter()
            .any(|note| note == "Time [ms] is taken as t, in s, from ms"),
        "{:?}",
        found.notes
    );
    assert!((read("time;e;u", 1.0).unwrap().record.time_s(39) - 0.65).abs() < 1e-3);
    // With two time columns the choice is ambiguous.
    let path = directory.path().join("two.csv");
    std::fs::write(&path, "time,time_ms,e,u\n0,0,1,2\n0.01,10,1,2\n").unwrap();
    let message = read_record(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(
        message.contains("has no column t") && message.contains("--time"),
        "{message}"
    );
}

/// A header, the format of its times, and the requested time.
type TimeNotation<'a> = (&'a str, &'a dyn Fn(i64) -> String, Option<&'a str>);

/// The record of a header, with 40 rows at 50 Hz whose times are formatted by `time`.
fn record_with(header: &str, time: impl Fn(i64) -> String, choice: Option<&str>) -> Result<ReadRecord, IoError> {
    let rows: String = (0..40).map(|k| format!("{},{k},{}\n", time(k), 2 * k)).collect();
    let options = ReadOptions {
        time: choice.map(|choice| choice.parse().unwrap()),
        ..default_options()
    };
    TestFolder::new().read(format!("{header},e,u\n{rows}"), &options)
}

#[test]
fn time_units_and_formats_give_the_same_record() {
    let ms = |k: i64| (20 * k).to_string();
    let ns = |k: i64| (1_718_000_000_123_456_789 + 20_000_000 * k).to_string();
    let stamp = |k: i64| {
        format!(
            "{},{}",
            1_718_000_000 + (980 + 20 * k) / 1000,
            (980 + 20 * k) % 1000 * 1_000_000
        )
    };
    let iso = |k: i64| {
        format!(
            "2024-03-05T10:{:02}:{:02}.{:03}Z",
            11 + (59_900 + 20 * k) / 60_000,
            (59_900 + 20 * k) / 1000 % 60,
            (59_900 + 20 * k) % 1000
        )
    };
    let s = |k: i64| format!("{:.2}", 0.02 * k as f64);
    let days = |from: f64| move |k: i64| format!("{:.10}", from + 0.02 * k as f64 / 86_400.0);
    let (excel, matlab) = (days(45_321.5), days(739_000.5));
    let evening = |k: i64| match 86_399_500 + 20 * k {
        ms @ ..86_400_000 => format!("23:59:{:02}.{:03}", ms / 1000 % 60, ms % 1000),
        ms => format!("00:00:00,{:03}", ms % 1000),
    };
    let found: [TimeNotation<'_>; 27] = [
        ("Date Time", &excel, None),
        ("Time", &excel, None),
        ("t", &excel, None),
        ("datenum", &matlab, None),
        ("clock", &excel, Some("clock:d")),
        (
            "clock",
            &|k| format!("{:.10}", 0.02 * k as f64 / 86_400.0),
            Some("clock:days"),
        ),
        ("time_stamps", &|k| format!("{:.2}", 123_456.7 + 0.02 * k as f64), None),
        ("xAxis [ms]", &|k| format!("{:.1}", 20.0 * k as f64), None),
        ("clock", &|k| evening(k).replace(',', "."), None),
        ("time", &|k| format!("{} sec", 0.02 * k as f64), None),
        ("time", &|k| format!("0 days 00:00:{:09.6}", 0.02 * k as f64), None),
        ("Time", &|k| format!("05-Mar-2024 10:11:{:06.3}", 0.02 * k as f64), None),
        ("_time", &s, None),
        ("Zeit [s]", &s, None),
        ("elapsed", &s, None),
        ("elapsed", &ms, None),
        ("t", &ms, None),
        ("time", &|k| (20_000 * k).to_string(), None),
        ("%time", &ns, None),
        ("header.stamp", &ns, None),
        ("time_ns", &|k| (20_000_000 * k).to_string(), None),
        ("stamp.sec,stamp.nanosec", &stamp, None),
        ("timestamp", &iso, None),
        ("", &s, None),
        ("clock", &ms, Some("clock:ms")),
        (
            "clock",
            &|k| format!("{:.9}", 0.02 * k as f64 / 60.0),
            Some("clock:min"),
        ),
        ("t", &ms, Some("t:ms")),
    ];
    for (header, time, choice) in found {
        let read = record_with(header, time, choice).unwrap_or_else(|error| panic!("{header} {choice:?}: {error}"));
        assert!(
            (read.record.sample_time().s() - 0.02).abs() < 1e-9,
            "{header} {choice:?}"
        );
        let first = if header == "time_stamps" { 123_456.7 } else { 0.0 };
        assert!((read.record.time_s(0) - first).abs() < 1e-9, "{header} {choice:?}");
        assert_eq!(read.record.len(), 40);
    }
    // A row number is not a time, and a requested unit takes precedence over the detected one.
    assert!(record_with("", |k| k.to_string(), None).is_err());
    assert_eq!(
        record_with("t", ms, Some("t:s")).unwrap().record.sample_time().s(),
        20.0
    );
    let message = record_with("clock", ms, Some("cloc")).unwrap_err().to_string();
    assert!(
        message.contains("no column \"cloc\"") && message.contains("clock"),
        "{message}"
    );
    assert!(
        message.ends_with("select the time column with --time COLUMN or COLUMN:UNIT"),
        "{message}"
    );
}

#[test]
fn given_sampling_rate_overrides_t() {
    let desk = TestFolder::new();
    let with = |hz| ReadOptions {
        sampling_hz: Some(hz),
        ..default_options()
    };
    let text = "t,e,u\n5,1,0\n5.1,2,0\n9,3,0\n";
    let read = desk.read(text, &with(50.0)).unwrap();
    assert_eq!(read.record.times_s(), [5.0, 5.02, 5.04]);
    assert!(
        read.notes[0].contains("the given sampling frequency of 50 Hz is used"),
        "{:?}",
        read.notes
    );
    let clock = desk.read("t,e,u\n12:00:01,1,0\n12:00:02,2,0\n", &with(2.0)).unwrap();
    assert_eq!(clock.record.time_s(1), 0.5);
    assert_eq!(clock.notes[0], "t is in s from its first time stamp");
    let none = desk.read("t,e,u\nx,1,0\n12:00:02,2,0\n", &with(2.0)).unwrap();
    assert!(
        none.notes[0].contains("t is not a number in line 2"),
        "{:?}",
        none.notes
    );
    assert_eq!(desk.read("e,u\n1,2\n", &with(2.0)).unwrap().record.len(), 1);
    assert!(
        desk.error("e,u\n1,2\n", &default_options())
            .contains("has no column t (time in s)")
    );
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-320] {
        assert!(
            matches!(desk.read(text, &with(bad)), Err(IoError::SamplingFrequency { .. })),
            "{bad}"
        );
    }
    // A span also applies to counted samples.
    let span = ReadOptions {
        span_s: (Some(5.02), None),
        ..with(50.0)
    };
    let part = desk.read(text, &span).unwrap().record;
    assert_eq!((part.time_s(0), part.input()), (5.02, &[2.0, 3.0][..]));
}

#[test]
fn filled_values_are_interpolated_and_reported() {
    let desk = TestFolder::new();
    let fill = |repair| ReadOptions {
        repair,
        ..default_options()
    };
    let text = "t,e,u,d\n0,1,2,1\n,NaN,2,NA\n2,,2,\n3,4,2,4\n";
    let read = desk.read(text, &fill(FILL)).unwrap();
    assert_eq!(read.record.input(), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(read.record.channel("d").unwrap(), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(read.record.times_s(), [0.0, 1.0, 2.0, 3.0]);
    assert!(
        read.steps
            .iter()
            .any(|step| step.to_string() == "column e: 2 missing values bridged linearly, at most 2 in a row")
    );
    let open = desk.error("t,e,u\n0,1,2\n1,,2\n", &fill(FILL));
    assert!(
        open.contains("line 3, column e: the values at the end of the record are missing"),
        "{open}"
    );
    let open = desk.error("t,e,u\n0,,2\n1,1,2\n", &fill(FILL));
    assert!(
        open.contains("line 2, column e: the values at the start of the record are missing"),
        "{open}"
    );
    // Text and infinite values are errors and not gaps.
    assert!(
        desk.error("t,e,u\n0,1,2\n1,x,2\n2,1,2\n", &fill(FILL))
            .contains("found \"x\"")
    );
    assert!(
        desk.error("t,e,u\n0,1,2\n1,inf,2\n2,1,2\n", &fill(FILL))
            .contains("found inf")
    );
}

/// An outer join of two topics: each row has a value of only one topic, including the first and the last row.
#[test]
fn two_topics_are_read_where_both_have_values() {
    let desk = TestFolder::new();
    let both = Repair {
        fill: true,
        resample: true,
    };
    let ask = |repair| ReadOptions {
        repair,
        ..default_options()
    };
    // Both topics have a common clock, and e is in every second row.
    let mut text = String::from("t,e,u\n");
    for k in 0..=21 {
        let t = 0.01 * f64::from(k);
        let e = if k % 2 == 1 {
            format!("{}", 10.0 * t)
        } else {
            String::new()
        };
        text.push_str(&format!("{t:.2},{e},{}\n", 1.0 - t));
    }
    assert!(desk.error(&text, &default_options()).contains("--fill"));
    let read = desk.read(&text, &ask(FILL)).unwrap();
    assert_eq!((read.record.len(), read.record.time_s(0)), (21, 0.01));
    for k in 0..21 {
        let t = 0.01 * f64::from(k + 1);
        assert!((read.record.input()[k as usize] - 10.0 * t).abs() < 1e-13);
    }
    assert_eq!(
        read.notes,
        [
            "1 row at the start and 0 at the end left out: --fill has no value to bridge to there (columns: e, u)",
            "column e has many missing values, as if logged at its own times: --fill interpolates linearly; --sparse \
             e=hold holds the last value"
        ]
    );
    // The topics have separate clocks at 50 and 40 Hz without a common time stamp; the grid is that of the faster
    // clock.
    let mut rows: Vec<(f64, bool)> = (0..50).map(|k| (0.02 * f64::from(k), true)).collect();
    rows.extend((0..40).map(|k| (0.013 + 0.025 * f64::from(k), false)));
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut text = String::from("t,e,u\n");
    for (t, is_e) in rows {
        let row = if is_e {
            format!("{t:.3},{},\n", 10.0 * t)
        } else {
            format!("{t:.3},,{}\n", 1.0 - t)
        };
        text.push_str(&row);
    }
    let read = desk.read(&text, &ask(both)).unwrap();
    assert!((read.record.sample_time().s() - 0.02).abs() < 1e-12);
    for k in 0..read.record.len() {
        let t = read.record.time_s(k);
        assert!(
            (read.record.input()[k] - 10.0 * t).abs() < 1e-12 && (read.record.output()[k] - (1.0 - t)).abs() < 1e-12
        );
    }
    // The topics do not overlap at all, which the error reports.
    assert!(
        desk.error("t,e,u\n0,1,\n1,2,\n2,,1\n3,,2\n", &ask(FILL))
            .contains("of the record are missing")
    );
}

#[test]
fn resampling_bridges_gaps_and_jitter() {
    let desk = TestFolder::new();
    let ask = |repair, sampling_hz| ReadOptions {
        repair,
        sampling_hz,
        ..default_options()
    };
    // With e = 10 t and u = 1 - t on an uneven t with two missing samples, the straight lines are reproduced up to
    // rounding.
    let times = [0.0, 0.101, 0.199, 0.3, 0.6, 0.7, 0.803, 0.9, 1.0];
    let mut text = String::from("t,e,u\n");
    times
        .iter()
        .for_each(|t| text.push_str(&format!("{t:.3},{},{}\n", 10.0 * t, 1.0 - t)));
    assert!(matches!(
        desk.read(&text, &default_options()),
        Err(IoError::Gap { missing: 2, .. })
    ));
    let read = desk.read(&text, &ask(RESAMPLE, None)).unwrap();
    assert_eq!(read.record.sample_time().s(), 0.1);
    assert_eq!(read.record.len(), 11);
    for k in 0..11 {
        let t = 0.1 * k as f64;
        assert!((read.record.input()[k] - 10.0 * t).abs() < 1e-13, "{k}");
        assert!((read.record.output()[k] - (1.0 - t)).abs() < 1e-14, "{k}");
    }
    assert!(
        read.steps[0]
            .to_string()
            .contains("from 9 samples to 11 at 10 Hz; the longest step"),
        "{:?}",
        read.steps
    );
    let twenty = desk.read(&text, &ask(RESAMPLE, Some(20.0))).unwrap().record;
    assert_eq!((twenty.len(), twenty.sample_time().s()), (21, 0.05));
    let coarse = desk.read(&text, &ask(RESAMPLE, Some(4.0))).unwrap();
    assert_eq!(coarse.record.times_s(), [0.0, 0.25, 0.5, 0.75, 1.0]);
    assert!((coarse.record.input()[1] - 2.5).abs() < 1e-14);
    let slow = desk.read(&text, &ask(RESAMPLE, Some(2.0))).unwrap();
    assert!(slow.notes[0].contains("no low-pass filter"), "{:?}", slow.notes);
    // A file with evenly spaced times is unchanged; a file with a jump in time is rejected.
    let even = "t,e,u\n0.0,1,2\n0.1,2,3\n0.2,4,5\n";
    assert_eq!(
        desk.read(even, &ask(RESAMPLE, None)).unwrap(),
        desk.read(even, &default_options()).unwrap()
    );
    let away = desk.error("t,e,u\n0,1,2\n1,1,2\n2,1,2\n1e9,1,2\n", &ask(RESAMPLE, None));
    assert!(away.contains("would turn 4 samples into 1000000001"), "{away}");
    let back = desk.error("t,e,u\n0,1,2\n1,1,2\n0.5,1,2\n", &ask(RESAMPLE, None));
    assert!(back.contains("expected increasing time"), "{back}");
}

/// If the time is also a signal, it has a value in each row and is resampled to the grid.
#[test]
fn time_as_a_signal_is_resampled() {
    let options = ReadOptions {
        repair: RESAMPLE,
        output: "t".parse().unwrap(),
        ..default_options()
    };
    let text = "t,e,u\n0.0,1,2\n0.1,2,3\n0.2,3,4\n0.3,4,5\n0.6,7,8\n0.7,8,9\n";
    let read = TestFolder::new().read(text, &options).unwrap().record;
    assert_eq!(read.len(), 8);
    assert!(
        read.times_s()
            .iter()
            .zip(read.output())
            .all(|(a, b)| (a - b).abs() < 1e-12)
    );
}

/// A single sample, as in a truncated file or a short span, cannot be resampled.
#[test]
fn one_sample_is_not_resampled() {
    let desk = TestFolder::new();
    let options = ReadOptions {
        sampling_hz: Some(50.0),
        repair: RESAMPLE,
        ..default_options()
    };
    let message = desk.error("# sample_time: 0.01 s\nt,e,u\n0,1,2\n", &options);
    assert!(message.contains("1 sample, expected at least 2"), "{message}");
}

#[test]
fn rows_outside_the_span_are_ignored() {
    let desk = TestFolder::new();
    let span = |from, to| ReadOptions {
        span_s: (from, to),
        ..default_options()
    };
    let text = "t,e,u\n0,x,2\n1,1,2\n2,2,2\n3,3,2\n7,,2\n";
    let read = desk.read(text, &span(Some(1.0), Some(7.0))).unwrap().record;
    assert_eq!(
        (read.times_s(), read.input()),
        (vec![1.0, 2.0, 3.0], &[1.0, 2.0, 3.0][..])
    );
    assert!(desk.error(text, &span(Some(3.0), None)).contains("column e"));
    // The bound 0.3 coincides with the sample at 0.30000000000000004.
    let sums = "t,e,u\n0.1,1,2\n0.2,2,2\n0.30000000000000004,3,2\n0.4,4,2\n";
    assert_eq!(desk.read(sums, &span(None, Some(0.3))).unwrap().record.len(), 2);
    assert_eq!(desk.read(sums, &span(Some(0.3), None)).unwrap().record.len(), 2);
    for (from, to) in [
        (Some(9.0), None),
        (None, Some(0.0)),
        (Some(2.0), Some(2.0)),
        (Some(f64::NAN), None),
    ] {
        let message = desk.error(text, &span(from, to));
        assert!(
            message.contains("holds no samples; the record covers 0 to 7 s"),
            "{message}"
        );
    }
}

/// Serial days are recognised by their size and their steps; the same numbers with longer steps are seconds.
#[test]
fn serial_days_are_recognised() {
    let in_days = |header: &str, step_s: f64, decimals: usize| {
        let time = |k: i64| format!("{:.decimals$}", 45_321.5 + step_s * k as f64 / 86_400.0);
        record_with(header, time, None).unwrap()
    };
    // One unit of seven decimals is 8.64 ms.
    let read = in_days("Time", 0.02, 7);
    assert_eq!(read.record.sample_time().s(), 0.02);
    assert_eq!(
        read.notes,
        ["Time is taken as t, in s from its first time stamp, from days"]
    );
    assert_eq!(
        in_days("t", 0.02, 10).notes,
        ["t is in s from its first time stamp, from days"]
    );
    let seconds = record_with("Time", |k| format!("{:.2}", 45_321.5 + 0.02 * k as f64), None).unwrap();
    assert_eq!(
        (seconds.record.time_s(0), seconds.record.sample_time().s()),
        (45_321.5, 0.02)
    );
    // A column with another name is not a time.
    assert!(record_with("level", |k| format!("{:.10}", 45_321.5 + 1e-6 * k as f64), None).is_err());
}

/// The unit below the header also applies if the name denotes a time without a unit.
#[test]
fn time_unit_below_the_header_is_used() {
    let desk = TestFolder::new();
    let rows: String = (0..40)
        .map(|k| format!("{:.1},{k},{}\n", 12.5 * f64::from(k), 2 * k))
        .collect();
    let read = desk
        .read(format!("Time,e,u\nms,deg,V\n{rows}"), &default_options())
        .unwrap();
    assert_eq!(read.record.sample_time().s(), 0.0125);
}

/// A table of 40 rows at 50 Hz, with times given by `time`.
fn table_of_times(time: impl Fn(usize) -> String) -> String {
    let rows = (0..40).map(|k| format!("{};{k};{}\n", time(k), 2 * k));
    std::iter::once(String::from("timestamp;e;u\n")).chain(rows).collect()
}

#[test]
fn dates_of_other_programs_are_read() {
    let desk = TestFolder::new();
    let ms = |k: usize| 980 + 20 * k;
    for (start, separator, end) in [
        ("03/05/24 10:11:", ".", ""),
        ("05.03.24 10:11:", ".", ""),
        ("2024-03-05 10:11:", ".", " UTC"),
        ("05 Mar 2024 10:11:", ".", ""),
        ("Tue Mar 05 10:11:", ".", " 2024"),
        ("10.11.", ",", ""),
        ("20240305T1011", ".", "Z"),
    ] {
        let time = |k| format!("{start}{:02}{separator}{:03}{end}", ms(k) / 1000, ms(k) % 1000);
        let read = desk.read(table_of_times(time), &default_options()).unwrap();
        assert_eq!(read.record.sample_time().s(), 0.02, "{start}{end}");
        assert_eq!((read.record.len(), read.record.time_s(0)), (40, 0.0), "{start}{end}");
    }
    // The error states formats that are read and a remedy that works.
    let unread = table_of_times(|k| format!("5 mars 2024 10h11:{:02}.{:03}", ms(k) / 1000, ms(k) % 1000));
    let unread = unread.replace("timestamp", "t");
    let message = desk.error(&unread, &default_options());
    assert!(
        message.contains("write them as 2024-03-05 10:11:12.5") && message.contains("--fs HZ"),
        "{message}"
    );
    let at_50_hz = ReadOptions {
        sampling_hz: Some(50.0),
        ..default_options()
    };
    assert_eq!(desk.read(&unread, &at_50_hz).unwrap().record.len(), 40);
}

#[test]
fn single_wrong_time_is_named_with_its_row() {
    let desk = TestFolder::new();
    let text = |time: &dyn Fn(usize) -> f64| {
        let rows = (0..40).map(|k| format!("{:.2},{k},{}\n", time(k), 2 * k));
        std::iter::once(String::from("t,e,u\n")).chain(rows).collect::<String>()
    };
    for wrong in [0.0, 99.0] {
        let text = text(&|k| if k == 20 { wrong } else { 0.02 * k as f64 });
        for trial in [None, Some("t")] {
            let options = ReadOptions {
                trial: trial.map(|trial| trial.parse().unwrap()),
                ..default_options()
            };
            let message = desk.error(&text, &options);
            let expected = format!("line 22: t = {wrong} s, expected 0.4 s");
            assert!(message.contains(&expected) && message.contains("--fs 50 "), "{message}");
        }
        let at_50_hz = ReadOptions {
            sampling_hz: Some(50.0),
            ..default_options()
        };
        let record = desk.read(&text, &at_50_hz).unwrap().record;
        assert_eq!((record.len(), record.output()[20]), (40, 40.0));
    }
    // For two rows out of order, the error names the line and the remedy.
    let message = desk.error(
        text(&|k| 0.02 * if k / 2 == 10 { 41 - k } else { k } as f64),
        &default_options(),
    );
    assert!(
        message.contains("line 23") && message.contains("sort the rows by t"),
        "{message}"
    );
    // For a clock that was set back for longer than a few rows, the error suggests trials.
    let set_back = text(&|k| 0.02 * if k < 25 { k } else { k - 10 } as f64);
    assert!(desk.error(&set_back, &default_options()).contains("use --trial t"));
    let second = ReadOptions {
        trial: Some("t=2".parse().unwrap()),
        ..default_options()
    };
    assert_eq!(desk.read(&set_back, &second).unwrap().record.len(), 15);
}

#[test]
fn blocks_written_twice_are_dropped() {
    let desk = TestFolder::new();
    let row = |k: usize| format!("{:.2},{k},{}\n", 0.02 * k as f64, 2 * k);
    let text: String = std::iter::once(String::from("t,e,u\n"))
        .chain((0..25).chain(20..40).map(row))
        .collect();
    assert!(desk.error(&text, &default_options()).contains("--drop-repeated"));
    let drop_repeated = Preparation {
        drop_repeated: true,
        ..Preparation::default()
    };
    let read = read_prepared(&desk.path("run.csv"), &default_options(), &drop_repeated).unwrap();
    assert_eq!((read.record.len(), read.record.sample_time().s()), (40, 0.02));
    assert_eq!(read.record.output()[39], 78.0);
    let repeated: Vec<(QualityIssueKind, usize)> = read
        .quality_issues
        .iter()
        .map(|issue| (issue.kind, issue.rows))
        .collect();
    assert_eq!(repeated, [(QualityIssueKind::Repeated, 5)]);
}

#[test]
fn empty_time_and_index_of_pandas_are_recognised() {
    let desk = TestFolder::new();
    let rows: String = (0..40).map(|k| format!(",{k},{}\n", 2 * k)).collect();
    let message = desk.error(format!("t,e,u\n{rows}"), &default_options());
    assert!(message.contains("the time column is empty; give --fs HZ"), "{message}");
    let rows: String = (0..40).map(|k| format!("{k},{},{}\n", 2 * k, 20_000_000 * k)).collect();
    let text = format!("e,u,__index_level_0__\n{rows}");
    assert_eq!(
        desk.read(text, &default_options()).unwrap().record.sample_time().s(),
        0.02
    );
}

#[test]
fn second_table_is_named_with_its_line() {
    let desk = TestFolder::new();
    let rows: String = (0..300)
        .map(|k| format!("{:.2},{k},{}\n", 0.02 * k as f64, 2 * k))
        .collect();
    let rows = format!("t,e,u\n{rows}");
    let text = format!("{rows}\nTrajectories\n50\nFrame,X,Y,Z\n,mm,mm,mm\n1,2,3,4\n2,3,4,5\n");
    let message = desk.error(text, &default_options());
    assert!(message.contains("line 303: a second table starts here"), "{message}");
    let message = desk.error(format!("{rows}MSG\n7.04,1,2\n7.06,1,2\n"), &default_options());
    assert!(message.contains("1 values, expected 3"), "{message}");
}

#[test]
fn unit_inferred_from_steps_is_reported_with_its_remedy() {
    let whole = |k: i64| (10 * k).to_string();
    let count = record_with("t", whole, None).unwrap();
    assert_eq!(count.record.sample_time().s(), 0.01);
    let note = "t is in s, from ms, since its integers advance by 10; if they are in s, add --time t:s";
    assert_eq!(count.notes, [note]);
    // With the remedy of the message, with decimals, or in steps of whole minutes, the times are in s.
    let slow = [
        (whole as fn(i64) -> String, Some("t:s"), 10.0),
        (|k| format!("{:.1}", 5.0 * k as f64), None, 5.0),
        (|k| (900 * k).to_string(), None, 900.0),
    ];
    for (time, choice, sample_time_s) in slow {
        let found = record_with("t", time, choice).unwrap();
        assert_eq!(found.record.sample_time().s(), sample_time_s);
        assert!(found.notes.is_empty(), "{:?}", found.notes);
    }
}
