//! Files of named arrays: files of other programs, written by the `make.py` of their folder in `fixtures`, and files of
//! hoid.

#![allow(clippy::unwrap_used, reason = "a test may fail at any line, its helpers as well")]

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use common::options;
use hoid_io::{IoError, ReadOptions, ReadRecord, read_record, read_table, write_record};
use hoid_model::{Channel, Record, SampleTime};

const N: usize = 40;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures").join(name)
}

fn read(name: &str, input: &str, output: &str) -> ReadRecord {
    read_record(&fixture(name), &options(input, output)).unwrap()
}

fn refusal(name: &str, input: &str, output: &str) -> String {
    let message = read_record(&fixture(name), &options(input, output))
        .unwrap_err()
        .to_string();
    assert!(message.contains(name), "{message}");
    message
}

fn e() -> Vec<f64> {
    (0..N).map(|k| (0.7 * k as f64).sin() / 3.0).collect()
}

fn u() -> Vec<f64> {
    (0..N).map(|k| (0.3 * k as f64).cos() * 1e-3).collect()
}

/// Compares values that may differ in the last bit, because the sine functions of two libraries do.
fn assert_close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    assert!(
        found
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() <= 1e-15 * b.abs().max(1e-3)),
        "{found:?}"
    );
}

fn assert_identical(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    assert!(
        found.iter().zip(expected).all(|(a, b)| a.to_bits() == b.to_bits()),
        "{found:?} {expected:?}"
    );
}

/// Checks that the record contains e and u at 80 Hz.
fn assert_complete_record(read: &ReadRecord) {
    assert_eq!(read.record.sample_time().s(), 0.0125);
    assert_close(read.record.input(), &e());
    assert_close(read.record.output(), &u());
}

fn channel<'a>(read: &'a ReadRecord, name: &str) -> &'a [f64] {
    &read.record.channels().find(|c| c.name == name).unwrap().values
}

#[test]
fn numpy_archives_are_read() {
    for name in [
        "npz/savez.npz",
        "npz/savez_compressed.npz",
        "npz/versions.npz",
        "npz/others.npz",
        "npz/kinds.npz",
    ] {
        if name.contains("kinds") {
            assert_close(read(name, "column", "row").record.input(), &e());
        } else {
            assert_complete_record(&read(name, "e", "u"));
        }
    }
    let twice: Vec<f64> = e().iter().map(|e| 2.0 * e).collect();
    assert_close(
        channel(&read("npz/savez_compressed.npz", "e", "x[:,1]"), "x[:,1]"),
        &twice,
    );
    assert_close(
        channel(&read("npz/savez_compressed.npz", "e", "f[0,:]"), "f[0,:]"),
        &u(),
    );
    // Further arrays become channels, and entries that are not columns are reported.
    let found = read("npz/savez_compressed.npz", "e", "u");
    assert_eq!(found.record.channels().count(), 6);
    let found = read("npz/others.npz", "e", "u");
    let notes = found.notes.join("\n");
    for path in ["z", "when", "cube", "empty", "objects", "short", "names"] {
        assert!(notes.contains(path), "{notes}");
    }
    assert_close(read("npz/others.npz", "e", "part.a").record.output(), &u());
}

#[test]
fn numpy_types_are_read() {
    let found = read("npz/kinds.npz", "le_f8", "be_f8");
    for order in ["le", "be"] {
        for kind in ["f2", "f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8"] {
            let sign = if kind.starts_with('u') { 1.0 } else { -1.0 };
            let expected: Vec<f64> = (0..N).map(|k| sign * k as f64 + 0.0).collect();
            let values = channel(&found, &format!("{order}_{kind}"));
            assert!(
                values.iter().zip(&expected).all(|(a, b)| a == b),
                "{order}_{kind} {values:?}"
            );
        }
    }
    assert_eq!(channel(&found, "flag")[..3], [1.0, 0.0, 1.0]);
}

#[test]
fn single_numpy_arrays_are_read() {
    let found = read("npz/structured.npy", "e", "u");
    assert_eq!(found.record.sample_time().s(), 0.0125);
    assert_close(found.record.input(), &e());
    let single: Vec<f64> = u().iter().map(|u| f64::from(*u as f32)).collect();
    assert_identical(found.record.output(), &single);
    let counted = ReadOptions {
        sampling_hz: Some(80.0),
        ..options("arr_0[:,1]", "arr_0[:,2]")
    };
    assert_complete_record(&read_record(&fixture("npz/matrix.npy"), &counted).unwrap());
}

fn scaled(factor: f64, values: &[f64]) -> Vec<f64> {
    values.iter().map(|value| factor * value).collect()
}

#[test]
fn matlab_variables_are_read() {
    for name in ["octave_v6", "octave_v7", "scipy_v7", "h5py_v73"] {
        let name = format!("mat/{name}.mat");
        assert_complete_record(&read(&name, "e", "u"));
        assert_close(channel(&read(&name, "e", "x(:,2)"), "x(:,2)"), &scaled(2.0, &e()));
        if name != "mat/h5py_v73.mat" {
            assert_close(channel(&read(&name, "e", "u"), "wide(2,:)"), &scaled(3.0, &u()));
        }
        // Elements of structures are selected by their full path or by the end of the path, and the nearest time is
        // used.
        for run in 1..=3_i32 {
            let factor = f64::from(run);
            for path in ["run", "data.run"] {
                let found = read(&name, &format!("{path}({run}).e"), &format!("{path}({run}).u"));
                assert_eq!(found.record.sample_time().s(), 0.0125);
                assert_close(found.record.input(), &scaled(factor, &e()));
                assert_close(found.record.output(), &scaled(factor, &u()));
            }
        }
        assert_close(read(&name, "deep.e", "deep.u").record.output(), &scaled(5.0, &u()));
        assert_complete_record(&read(&name, "c{1}", "c{3}"));
        assert_eq!(channel(&read(&name, "e", "u"), "flag")[..3], [1.0, 0.0, 1.0]);
        let message = refusal(&name, "z", "u");
        assert!(message.contains("z holds complex numbers"), "{message}");
        let message = refusal(&name, "e", "run(4).e");
        assert!(
            message.contains("run(4).e") && message.contains("data.run(3).e"),
            "{message}"
        );
        let message = refusal(&name, "e", "run(1).who");
        assert!(message.contains("run(1).who holds text"), "{message}");
    }
    for name in ["mat/octave_v4.mat", "mat/scipy_v4.mat"] {
        assert_complete_record(&read(name, "e", "u"));
    }
    assert_complete_record(&read("mat/h5py_latest_v73.mat", "e", "u"));
    assert_close(channel(&read("mat/h5py_v73.mat", "e", "u"), "big"), &e());
    for name in ["mat/octave_v7.mat", "mat/h5py_v73.mat"] {
        let found = read(name, "e", "u");
        let fine: Vec<f64> = e().iter().map(|e| f64::from(*e as f32)).collect();
        assert_identical(channel(&found, "fine"), &fine);
        assert_eq!(channel(&found, "count")[39], 39.0);
    }
    let found = read("mat/octave_v7.mat", "e", "u");
    assert!(found.notes.join("").contains("words"), "{:?}", found.notes);
    for kind in ["f4", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8"] {
        let found = read("mat/scipy_v7.mat", "e", "u");
        let values = channel(&found, &format!("k_{kind}"));
        assert!(values.iter().enumerate().all(|(k, value)| *value == k as f64), "{kind}");
    }
}

#[test]
fn h5py_files_are_read() {
    let name = "mat/h5py.h5";
    assert_complete_record(&read(name, "e", "u"));
    assert_complete_record(&read(name, "session.run1.e", "session.run1.u"));
    // Lines of a matrix are counted as in numpy.
    assert_close(channel(&read(name, "e", "u"), "u"), &u());
    let counted = ReadOptions {
        sampling_hz: Some(80.0),
        ..options("x[:,1]", "x[:,2]")
    };
    let found = read_record(&fixture(name), &counted).unwrap();
    assert_close(found.record.output(), &scaled(2.0, &e()));
}

#[test]
fn hdf5_tables_of_records_are_read() {
    let name = "mat/h5py_table.h5";
    for (input, output) in [("run.e", "run.u"), ("e", "u")] {
        let found = read(name, input, output);
        assert_close(found.record.input(), &e());
        assert_close(found.record.output(), &u());
        assert_eq!(found.record.sample_time().s(), 0.0125);
    }
    let counted = channel(&read(name, "run.e", "run.u"), "n").to_vec();
    assert!(counted.iter().enumerate().all(|(k, n)| *n == k as f64), "{counted:?}");
    let message = refusal(name, "run.mark", "run.u");
    assert!(message.contains("something other than numbers"), "{message}");
}

#[test]
fn matlab_objects_are_refused_with_an_export_command() {
    let message = refusal("mat/h5py_objects_v73.mat", "runs", "stick");
    assert!(
        message.contains("runs holds an object of the class timetable") && message.contains("x.Properties.RowTimes"),
        "{message}"
    );
    let message = refusal("mat/h5py_objects_v73.mat", "stick", "runs");
    assert!(
        message.contains("timeseries") && message.contains("x.Time"),
        "{message}"
    );
    // The missing name may be inside the object.
    let message = refusal("mat/h5py_objects_v73.mat", "e", "u");
    assert!(
        message.contains("runs holds an object of the class timetable"),
        "{message}"
    );
}

#[test]
fn names_are_searched_in_nested_structures() {
    let message = refusal("mat/octave_struct.mat", "e", "u");
    assert!(
        message.contains("\"e\" matches data.run(1).e, data.run(2).e"),
        "{message}"
    );
    assert_close(
        read("mat/octave_struct.mat", "deep.e", "deep.u").record.input(),
        &scaled(5.0, &e()),
    );
    // Structures nested too deeply are rejected.
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("deep.mat");
    let mut inner = element(
        14,
        &[
            element(6, &[6, 0, 0, 0, 0, 0, 0, 0]),
            element(5, &[0; 8]),
            element(1, b""),
        ]
        .concat(),
    );
    for _ in 0..40 {
        let head = [
            element(6, &[2, 0, 0, 0, 0, 0, 0, 0]),
            element(5, &[1, 0, 0, 0, 1, 0, 0, 0]),
            element(1, b"a"),
        ];
        let fields = [element(5, &[2, 0, 0, 0]), element(1, b"b\0"), inner];
        inner = element(14, &[head.concat(), fields.concat()].concat());
    }
    let mut bytes = vec![b' '; 124];
    bytes.extend([0, 1, b'I', b'M']);
    fs::write(&path, [bytes, inner].concat()).unwrap();
    let message = read_record(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("structures nested more than 32 deep"), "{message}");
}

/// A data element of version 5.
fn element(kind: u32, bytes: &[u8]) -> Vec<u8> {
    let mut element = [kind.to_le_bytes(), (bytes.len() as u32).to_le_bytes()].concat();
    element.extend_from_slice(bytes);
    element.resize(element.len().next_multiple_of(8), 0);
    element
}

#[test]
fn xdf_streams_are_joined() {
    // The error of one stream is interpolated to the times of the stick in another stream.
    let found = read("xdf/tracking.xdf", "e", "u");
    let record = &found.record;
    assert!((1.0 / record.sample_time().s() - 25.0).abs() < 0.05);
    assert!(
        found.notes.join("\n").contains("interpolated linearly from 39.996 Hz"),
        "{:?}",
        found.notes
    );
    for (k, (e, u)) in record.input().iter().zip(record.output()).enumerate() {
        // After averaging over 300 samples, jitter of 2 ms leaves an error of 0.3 ms; the quantisation step is 1e-4,
        // and linear interpolation of the sine at 40 Hz adds 8e-5.
        let t = u.acos();
        let expected = if record.time_s(k) < std::f64::consts::PI {
            1e4 * t.sin()
        } else {
            continue;
        };
        assert!((e - expected).abs() < 20.0, "{k}: {e} {expected}");
    }
    assert_eq!(record.channels().find(|c| c.name == "u").unwrap().unit, "N");
    assert_eq!(record.channels().find(|c| c.name == "e").unwrap().unit, "deg");
    assert_eq!(channel(&found, "twice u")[3], 2.0 * record.output()[3]);
    let message = refusal("xdf/tracking.xdf", "Events.ch1", "u");
    assert!(message.contains("Events.ch1 holds text"), "{message}");
}

#[test]
fn unusable_variables_are_refused_with_the_reason() {
    let message = refusal("npz/others.npz", "z", "u");
    assert!(
        message.contains("z holds complex numbers") && message.contains("real numbers"),
        "{message}"
    );
    let message = refusal("npz/others.npz", "e", "short");
    assert!(
        message.contains("short holds 7 values, expected 40 as in e"),
        "{message}"
    );
    let message = refusal("npz/others.npz", "e", "w");
    assert!(
        message.contains("no column \"w\"") && message.contains("cube"),
        "{message}"
    );
    let message = refusal("npz/others.npz", "objects", "u");
    assert!(message.contains("Python objects"), "{message}");
    let message = refusal("npz/others.npz", "empty", "empty");
    assert!(message.contains("no samples"), "{message}");
    let dir = tempfile::tempdir().unwrap();
    for (name, bytes, word) in [
        ("a.npz", &b"t,e,u\n0,1,2\n"[..], "is not in NPZ format"),
        ("a.npz", b"", "is not in NPZ format"),
        ("a.npz", b"PK\x05\x06", "is damaged"),
        ("a.npy", b"t,e,u\n0,1,2\n", "is not in NPY format"),
        ("a.mat", b"t,e,u\n0,1,2\n", "is not in MATLAB format"),
        ("a.mat", b"", "is not in MATLAB format"),
        (
            "a.mat",
            b"# Created by Octave 8.4.0\n# name: t\n# type: matrix\n",
            "save -v7 run.mat",
        ),
        ("a.mat", &[0; 64], "is damaged: variable 4"),
    ] {
        fs::write(dir.path().join(name), bytes).unwrap();
        let message = read_record(&dir.path().join(name), &ReadOptions::default())
            .unwrap_err()
            .to_string();
        assert!(message.contains(word), "{message}");
    }
}

const WRITTEN_FORMATS: [&str; 2] = ["npz", "mat"];

/// Pseudo-random numbers from a linear congruential generator (Knuth's MMIX constants).
struct Draw(u64);

impl Draw {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n
    }

    fn value(&mut self) -> f64 {
        (self.below(1 << 30) as f64 / f64::from(1 << 29) - 1.0).powi(5)
    }
}

fn record(n: usize, ts: f64, start: f64) -> Record {
    let mut draw = Draw(7);
    let mut channel = |name: &str, unit: &str| Channel::new(name, unit, (0..n).map(|_| draw.value()).collect());
    let (e, u) = (channel("run(3).e", "deg"), channel("u", "deg"));
    let mut record = Record::new(SampleTime::new(ts).unwrap(), e, u)
        .unwrap()
        .starting_at(start);
    for (name, unit) in [
        ("x", ""),
        ("f_t", "deg"),
        ("stick, \"raw\"", ""),
        ("K e", "deg per deg"),
        ("K_e", ""),
        ("f-y", ""),
    ] {
        record = record.with_channel(channel(name, unit)).unwrap();
    }
    record
}

#[test]
fn records_round_trip_bit_for_bit() {
    let dir = tempfile::tempdir().unwrap();
    for extension in WRITTEN_FORMATS {
        let path = dir.path().join("run").with_extension(extension);
        for (n, ts, start) in [
            (5000, 0.01, 0.0),
            (333, 1.0 / 60.0, 0.1),
            (700, 0.010_000_03, -12.5),
            (2, 0.3, 0.0),
            (1, 0.3, 5.0),
        ] {
            let record = record(n, ts, start);
            write_record(&path, &record).unwrap();
            let bytes = fs::read(&path).unwrap();
            write_record(&path, &record).unwrap();
            assert_eq!(bytes, fs::read(&path).unwrap(), "{extension}");
            let back = read_record(&path, &options("run(3).e", "u")).unwrap();
            assert!(back.notes.is_empty(), "{:?}", back.notes);
            let back = back.record;
            assert_eq!(back.sample_time().s().to_bits(), ts.to_bits());
            assert_eq!(back.time_s(0).to_bits(), record.time_s(0).to_bits());
            assert_eq!(back.channels().count(), record.channels().count());
            for channel in record.channels() {
                let other = back.channels().find(|c| c.name == channel.name).unwrap();
                assert_eq!(other.unit, channel.unit, "{}", channel.name);
                assert_identical(&other.values, &channel.values);
            }
        }
    }
}

/// Truncated files and files with modified bytes give values or an error that names the file, but never a panic.
#[test]
fn damaged_files_do_not_cause_a_panic() {
    let dir = tempfile::tempdir().unwrap();
    let mut seeds = Vec::new();
    for extension in WRITTEN_FORMATS {
        let path = dir.path().join("seed").with_extension(extension);
        write_record(&path, &record(20, 0.01, 0.0)).unwrap();
        seeds.push(path);
    }
    for folder in ["npz", "mat", "xdf"] {
        for file in fs::read_dir(fixture(folder)).unwrap() {
            let path = file.unwrap().path();
            if ["npz", "npy", "mat", "xdf"].contains(&path.extension().unwrap().to_str().unwrap()) {
                seeds.push(path);
            }
        }
    }
    seeds.sort();
    let mut draw = Draw(3);
    let (mut values, mut refused) = (0, 0);
    let seeds: Vec<(String, Vec<u8>)> = seeds
        .iter()
        .map(|path| {
            (
                path.extension().unwrap().to_str().unwrap().to_owned(),
                fs::read(path).unwrap(),
            )
        })
        .collect();
    for round in 0..4000 {
        let (extension, seed) = &seeds[round % seeds.len()];
        let mut bytes = seed.clone();
        if draw.below(4) == 0 {
            bytes.truncate(draw.below(bytes.len()));
        }
        for _ in 0..=draw.below(4) {
            // Most of the structure is in the headers and at the end of an archive.
            let length = bytes.len().max(1);
            let at = match draw.below(3) {
                0 => draw.below(length),
                1 => draw.below(length.min(400)),
                _ => length - 1 - draw.below(length.min(400)),
            };
            let Some(byte) = bytes.get_mut(at) else { continue };
            match draw.below(3) {
                0 => *byte = draw.below(256) as u8,
                1 => *byte ^= 1 << draw.below(8),
                _ => *byte = [0, 0xff, 0x7f, 0x80][draw.below(4)],
            }
        }
        let path = dir.path().join("damaged").with_extension(extension);
        fs::write(&path, &bytes).unwrap();
        for error in [
            read_table(&path).map(drop).err(),
            read_record(&path, &ReadOptions::default()).map(drop).err(),
        ] {
            match error {
                None => values += 1,
                Some(error) => {
                    refused += 1;
                    assert!(error.to_string().contains("damaged."), "{error}");
                    assert!(!matches!(error, IoError::Unreadable { .. }));
                }
            }
        }
    }
    assert!(values > 300 && refused > 500, "{values} read, {refused} refused");
}
