//! Text compressed by gzip, and BIDS tables with a JSON file in the same directory.

#![allow(clippy::unwrap_used, reason = "a test may fail at any line, its helpers as well")]

mod common;

use std::io::Write;

use common::TestFolder;
use flate2::{Compression, write::GzEncoder};
use hoid_io::{ReadOptions, read_record};

fn gzip(text: &[u8]) -> Vec<u8> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(text).unwrap();
    packed.finish().unwrap()
}

#[test]
fn compressed_tables_and_sidecars_are_read() {
    let desk = TestFolder::new();
    std::fs::write(desk.path("run.csv.gz"), gzip(b"t,e,u\n0,1,2\n0.02,3,4\n")).unwrap();
    let read = read_record(&desk.path("run.csv.gz"), &ReadOptions::default()).unwrap();
    assert_eq!(
        (read.record.input(), read.record.output()),
        (&[1.0, 3.0][..], &[2.0, 4.0][..])
    );
    assert_eq!(read.record.label(), "run");
    // A BIDS table contains only rows; a JSON file describes them.
    let json = r#"{"SamplingFrequency": 50.0, "StartTime": -2.0, "Columns": ["error", "stick"]}"#;
    let options = ReadOptions {
        input: Some("error".parse().unwrap()),
        output: "stick".parse().unwrap(),
        ..ReadOptions::default()
    };
    for name in ["a_physio.tsv", "a_physio.tsv.gz"] {
        let rows = b"1\t2\nn/a\t4\n5\t6\n";
        std::fs::write(desk.path("a_physio.json"), json).unwrap();
        let bytes = if name.ends_with("gz") {
            gzip(rows)
        } else {
            rows.to_vec()
        };
        std::fs::write(desk.path(name), bytes).unwrap();
        let filled = ReadOptions {
            repair: hoid_io::Repair {
                fill: true,
                ..Default::default()
            },
            ..options.clone()
        };
        let record = read_record(&desk.path(name), &filled).unwrap().record;
        assert_eq!(record.input(), [1.0, 3.0, 5.0], "{name}");
        assert_eq!((record.time_s(0), record.sample_time().s()), (-2.0, 0.02));
        // Without the JSON file, the table has no header.
        std::fs::remove_file(desk.path("a_physio.json")).unwrap();
        let message = read_record(&desk.path(name), &options).unwrap_err().to_string();
        assert!(message.contains("the first line holds numbers"), "{message}");
    }
    // A truncated gzip file, and a gzip file with another format inside, are rejected.
    let packed = gzip(b"t,e,u\n0,1,2\n0.02,3,4\n");
    std::fs::write(desk.path("cut.csv.gz"), &packed[..packed.len() - 6]).unwrap();
    let message = |name: &str| {
        read_record(&desk.path(name), &ReadOptions::default())
            .unwrap_err()
            .to_string()
    };
    assert!(message("cut.csv.gz").contains("not a complete gzip file"));
    std::fs::write(desk.path("run.npz.gz"), &packed).unwrap();
    assert!(message("run.npz.gz").contains("unpack it first"));
}

/// By the inheritance principle of BIDS, a JSON file with fewer entities describes the recording, even from a parent
/// directory.
#[test]
fn inherited_sidecars_are_read() {
    let desk = TestFolder::new();
    let folder = desk.path("sub-01/ses-1/beh");
    std::fs::create_dir_all(&folder).unwrap();
    let options = ReadOptions {
        input: Some("error".parse().unwrap()),
        output: "stick".parse().unwrap(),
        ..ReadOptions::default()
    };
    let json = |hz: i32| {
        format!(
            r#"{{"SamplingFrequency": {hz}, "Columns": ["error", "stick"], "error": {{"Units": "deg"}}, "stick": 3}}"#
        )
    };
    let name = folder.join("sub-01_ses-1_task-track_run-2_physio.tsv.gz");
    std::fs::write(&name, gzip(b"1\t2\n3\t4\n5\t6\n")).unwrap();
    let read = || read_record(&name, &options);
    let message = read().unwrap_err().to_string();
    assert!(message.contains("the first line holds numbers"), "{message}");
    // JSON files of another task or kind, and a damaged JSON file, do not describe the recording.
    std::fs::write(desk.path("task-rest_physio.json"), json(10)).unwrap();
    std::fs::write(desk.path("task-track_stim.json"), json(20)).unwrap();
    std::fs::write(folder.join("sub-01_physio.json"), "{").unwrap();
    assert!(read().is_err());
    for (path, hz) in [
        (desk.path("task-track_physio.json"), 25),
        (folder.join("task-track_physio.json"), 40),
        (folder.join("sub-01_task-track_physio.json"), 50),
    ] {
        std::fs::write(path, json(hz)).unwrap();
        let record = read().unwrap().record;
        assert_eq!(record.input(), [1.0, 3.0, 5.0]);
        assert!((record.sample_time().s() * f64::from(hz) - 1.0).abs() < 1e-12, "{hz}");
        assert_eq!(record.input_channel().unwrap().unit, "deg");
        assert_eq!(record.output_channel().unit, "");
    }
}

#[test]
fn channel_tables_of_motion_recordings_are_read() {
    let desk = TestFolder::new();
    let name = desk.path("sub-01_task-track_motion.tsv");
    std::fs::write(&name, "1\t2\n3\t4\n5\t6\n").unwrap();
    std::fs::write(
        desk.path("sub-01_task-track_motion.json"),
        r#"{"SamplingFrequency": 50}"#,
    )
    .unwrap();
    let options = ReadOptions {
        input: Some("error".parse().unwrap()),
        output: "stick".parse().unwrap(),
        ..ReadOptions::default()
    };
    for (channels, is_read) in [
        ("name\ttype\tunits\nerror\tPOS\tdeg\nstick\tPOS\tn/a\n", true),
        ("name\ttype\tunits\nerror\tPOS\tdeg\n", false),
        ("type\nPOS\nPOS\n", false),
        ("", false),
    ] {
        std::fs::write(desk.path("sub-01_task-track_channels.tsv"), channels).unwrap();
        let read = read_record(&name, &options);
        assert_eq!(read.is_ok(), is_read, "{channels}");
        if let Ok(read) = read {
            assert_eq!(read.record.output(), [2.0, 4.0, 6.0]);
            assert_eq!(read.record.input_channel().unwrap().unit, "deg");
        }
    }
}
