//! Complete files are written and read: the data are reproduced, and damage is reported.

#![allow(clippy::unwrap_used, reason = "a test may fail at any line, its helpers as well")]

mod common;

use std::{fs, path::Path};

use common::{TestFolder, default_options, options};
use hoid_io::{IoError, ReadOptions, ReadRecord, Repair, read_record, write_record};
use hoid_model::{Channel, Record, SampleTime};

/// Pseudo-random numbers from a linear congruential generator (Knuth's MMIX constants); they are the same on every
/// machine.
struct Draw(u64);

impl Draw {
    fn bits(&mut self) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    fn below(&mut self, n: usize) -> usize {
        (self.bits() % n.max(1) as u64) as usize
    }

    fn value(&mut self) -> f64 {
        self.bits() as f64 / f64::from(1_u32 << 30) - 1.0
    }
}

fn record(n: usize, ts: f64, start: f64) -> Record {
    let mut draw = Draw(7);
    let mut channel = |name: &str, unit: &str| Channel::new(name, unit, (0..n).map(|_| draw.value().powi(5)).collect());
    let (e, u) = (channel("e", "deg"), channel("u", "deg"));
    Record::new(SampleTime::new(ts).unwrap(), e, u)
        .unwrap()
        .starting_at(start)
        .labelled("run")
        .with_channel(channel("x", ""))
        .unwrap()
        .with_channel(channel("f_t", "deg"))
        .unwrap()
        .with_channel(channel("stick, \"raw\"", ""))
        .unwrap()
        .with_channel(channel("K e", "deg per deg"))
        .unwrap()
}

#[test]
fn csv_records_round_trip_bit_for_bit() {
    let desk = TestFolder::new();
    let path = desk.path("run.csv");
    for (n, ts, start) in [
        (5000, 0.01, 0.0),
        (9000, 0.01, -8.0),
        (333, 1.0 / 60.0, 0.1),
        (400, 0.007_3, -1.0 / 3.0),
        // Two grids close to a whole number of Hz that are not rounded to it.
        (700, 0.010_000_03, 12.5),
        (4001, 1.0 / 99.995, 0.0),
        (2, 0.3, 0.0),
        (1, 0.3, 5.0),
    ] {
        let record = record(n, ts, start);
        write_record(&path, &record).unwrap();
        let back = read_record(&path, &default_options()).unwrap();
        assert!(back.notes.is_empty(), "{:?}", back.notes);
        let back = back.record;
        assert_eq!(back.sample_time().s().to_bits(), ts.to_bits(), "{n} samples of {ts} s");
        assert_eq!(back.time_s(0).to_bits(), record.time_s(0).to_bits());
        assert_eq!(back.label(), "run");
        assert_eq!(back.len(), n);
        assert_eq!(back.channels().count(), record.channels().count());
        for channel in record.channels() {
            let other = back.channels().find(|c| c.name == channel.name).unwrap();
            assert_eq!(other.unit, channel.unit);
            assert!(
                other
                    .values
                    .iter()
                    .zip(&channel.values)
                    .all(|(a, b)| a.to_bits() == b.to_bits())
            );
        }
    }
}

#[test]
fn columns_are_written_in_task_order() {
    let desk = TestFolder::new();
    let path = desk.path("run.csv");
    write_record(&path, &record(3, 0.01, 0.0)).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "# units: t s, f_t deg, e deg, u deg, K e deg per deg");
    assert_eq!(lines[1], "# sample_time: 0.01 s");
    assert_eq!(lines[2], "t,f_t,e,u,x,\"stick, \"\"raw\"\"\",K e");
    assert_eq!(lines.len(), 6);
    assert_eq!(fs::read_dir(desk.dir.path()).unwrap().count(), 1);
}

#[test]
fn channel_roles_round_trip() {
    let desk = TestFolder::new();
    let seen = Channel::new("seen", "deg", vec![1.0, 2.0, 3.0]).with_role("feedforward:0.5");
    let written = record(3, 0.01, 0.0).with_channel(seen).unwrap();
    for name in ["run.csv", "run.parquet", "run.npz", "run.mat"] {
        let path = desk.path(name);
        write_record(&path, &written).unwrap();
        let read = read_record(&path, &default_options()).unwrap().record;
        let roles = read.channels().filter(|c| !c.role.is_empty());
        let roles: Vec<(&str, &str)> = roles.map(|c| (c.name.as_str(), c.role.as_str())).collect();
        assert_eq!(roles, [("seen", "feedforward:0.5")], "{name}");
        let part = read.span(0.01, 1.0).unwrap();
        assert!(part.channels().any(|c| c.role == "feedforward:0.5"), "{name}");
    }
}

#[test]
fn unreadable_channel_names_are_not_written() {
    let desk = TestFolder::new();
    for name in ["t", "", " x"] {
        let record = record(3, 0.01, 0.0)
            .with_channel(Channel::new(name, "", vec![0.0; 3]))
            .unwrap();
        let written = write_record(&desk.path("run.csv"), &record);
        assert!(matches!(written, Err(IoError::ChannelName { .. })), "{name:?}");
    }
    assert!(!desk.path("run.csv").exists());
}

#[test]
fn other_extensions_and_missing_files_are_errors() {
    let desk = TestFolder::new();
    for name in ["run.xlsx", "run", "run.npz.gz", "run.dat"] {
        fs::write(desk.path(name), "PK\u{3}\u{4}\0\0 words only").unwrap();
        let message = read_record(&desk.path(name), &default_options())
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("extension") && message.contains("; expected .csv"),
            "{message}"
        );
        assert!(write_record(&desk.path(name), &record(3, 0.01, 0.0)).is_err());
    }
    fs::write(desk.path("run.TSV"), "t\te\tu\n0\t1\t2\n1\t1\t2\n").unwrap();
    assert_eq!(
        read_record(&desk.path("run.TSV"), &default_options())
            .unwrap()
            .record
            .len(),
        2
    );
    assert!(matches!(
        read_record(desk.dir.path(), &default_options()),
        Err(IoError::Directory { .. })
    ));
    assert!(matches!(
        read_record(&desk.path("no.csv"), &default_options()),
        Err(IoError::Unreadable { .. })
    ));
}

/// A text table is recognised by its contents, regardless of the name of the file.
#[test]
fn text_tables_with_other_extensions_are_read() {
    let desk = TestFolder::new();
    let rows = |mark: &str| format!("t{mark}e{mark}u\n0.00{mark}1{mark}2\n0.01{mark}3{mark}4\n0.02{mark}5{mark}6\n");
    for name in [
        "run.dat",
        "run.asc",
        "run.log",
        "run.PRN",
        "run",
        "run.lvm",
        "run 3.5 deg",
    ] {
        for mark in [",", ";", "\t", " ", " | ", "|"] {
            fs::write(desk.path(name), rows(mark)).unwrap();
            let read = read_record(&desk.path(name), &default_options()).unwrap().record;
            assert_eq!(read.input(), [1.0, 3.0, 5.0], "{name} {mark}");
            assert_eq!(read.output(), [2.0, 4.0, 6.0], "{name} {mark}");
            assert_eq!(read.sample_time().s(), 0.01, "{name} {mark}");
        }
    }
    for words in [
        "",
        "\n",
        "one, two\nthree, four\n",
        "{\"t\": [0, 1]}\n",
        "[table]\nx = [1, 2]\n",
    ] {
        fs::write(desk.path("run.dat"), words).unwrap();
        let message = read_record(&desk.path("run.dat"), &default_options())
            .unwrap_err()
            .to_string();
        assert!(
            message.contains(".dat is not the extension of a record format"),
            "{message}"
        );
    }
    let message = read_record(&desk.path("missing.dat"), &default_options())
        .unwrap_err()
        .to_string();
    assert!(message.contains(".dat is not the extension"), "{message}");
}

/// Numbers as spreadsheets and programs in several languages write them, all with the values 0.5 and -1234.5 and one
/// missing value.
#[test]
fn number_notations_of_many_programs_are_read() {
    let desk = TestFolder::new();
    let fill = ReadOptions {
        repair: hoid_io::Repair {
            fill: true,
            ..Default::default()
        },
        ..default_options()
    };
    for (mark, half, large, missing) in [
        (";", "0,5", "-1.234,5", "n.a."),
        (";", "0.5", "-1,234.5", "#N/A"),
        (";", "0.5", "-1'234.5", "#DIV/0!"),
        ("\t", "0,5", "-1\u{a0}234,5", "null"),
        ("\t", "0,5", "\u{2212}1\u{202f}234,5", ""),
        (",", "\"0.5\"", "\"-1,234.5\"", "NA"),
        (",", "5.0D-01", "-1.2345D+03", "NaN"),
    ] {
        let rows: Vec<String> = [half, large, missing, large]
            .iter()
            .map(|e| [half, e, half].join(mark))
            .collect();
        let text = format!("{}\n{}\n", ["x", "e", "u"].join(mark), rows.join("\n"));
        let fill = ReadOptions {
            sampling_hz: Some(50.0),
            ..fill.clone()
        };
        let read = desk
            .read(&text, &fill)
            .unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(read.record.input(), [0.5, -1234.5, -1234.5, -1234.5], "{text}");
        assert_eq!(read.record.output(), [0.5; 4], "{text}");
    }
}

/// Rows below the table, repeated headers, preambles, and header cells that the rows lack do not change the record.
#[test]
fn lines_around_a_table_do_not_change_the_record() {
    let desk = TestFolder::new();
    let rows: Vec<String> = (0..30)
        .map(|k| format!("{:.2},{k},{}", 0.02 * f64::from(k), -k))
        .collect();
    let plain = format!("t,e,u\n{}\n", rows.join("\n"));
    let expected = desk.read(&plain, &default_options()).unwrap().record;
    let again = format!("t,e,u\n{}\nt,e,u\n{}\n", rows[..10].join("\n"), rows[10..].join("\n"));
    for (text, note) in [
        (format!("{plain}Mean,14.5,-14.5\n"), "the first is \"Mean,14.5,-14.5\""),
        (
            format!("{plain}\nEnd of run\nOperator 3\n"),
            "below the table are left out: 2",
        ),
        (again, "repeated lines of the header are left out: 1"),
        (format!("sep=,\n{plain}"), "lines above the header are left out: 1"),
        (
            format!("Rate,50,Hz\n\nRun 1,,\n{plain}"),
            "lines above the header are left out: 2",
        ),
        (
            format!("# {plain}"),
            "the comment above the first row is taken as the header",
        ),
        (plain.replace(',', " "), "separated by blanks"),
        (plain.replace(',', "|"), "separated by vertical bars"),
    ] {
        let read = desk
            .read(&text, &default_options())
            .unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(read.record, expected, "{text}");
        assert!(
            read.notes.iter().any(|found| found.contains(note)),
            "{text}: {:?}",
            read.notes
        );
    }
    for text in [
        plain.replace('\n', ",\n"),
        plain.replacen("t,e,u", "t;e;u", 1),
        plain.replacen("t,e,u", "'t','e','u'", 1),
        plain.replacen("t,e,u", "\"t\", \"e\", \"u\"", 1),
        (plain
            .lines()
            .map(|line| format!("\"{}\"\n", line.replace(',', "\", \""))))
        .collect(),
        format!("{plain}\u{1a}"),
        plain.replacen("u\n", "u,\n", 1),
        plain.replacen("u\n", "u,Comment\n", 1),
        plain.replace('\n', "\r"),
        plain.replace('\n', "\r\r\n"),
    ] {
        let read = desk
            .read(&text, &default_options())
            .unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(read.record, expected, "{text}");
    }
}

#[test]
fn column_expressions_select_and_combine() {
    let desk = TestFolder::new();
    let text = "# units: t s, r deg, y deg, stick mV\nt,r,y,stick\n0,1,0.25,3\n0.5,2,0.5,4\n";
    let ReadRecord { record, notes, .. } = desk.read(text, &options("r-y", "-stick")).unwrap();
    assert!(notes.is_empty());
    assert_eq!((record.input(), record.output()), (&[0.75, 1.5][..], &[-3.0, -4.0][..]));
    assert_eq!(
        (
            record.input_channel().unwrap().name.as_str(),
            record.input_channel().unwrap().unit.as_str()
        ),
        ("r-y", "deg")
    );
    assert_eq!(record.output_channel().unit, "mV");
    let names: Vec<&str> = record.channels().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["r-y", "-stick", "r", "y", "stick"]);
    // After the record has been written and read again, the columns r-y and -stick are found by their names.
    let path = desk.path("again.csv");
    write_record(&path, &record).unwrap();
    let again = read_record(&path, &options("r-y", "-stick"))
        .unwrap()
        .record
        .labelled("run");
    assert_eq!(again, record);

    assert!(desk.error(text, &default_options()).contains(
        "has no column \"e\" (requested: e); it has t, r, y, stick; select columns with --input and --output"
    ));
    let of_trial = ReadOptions {
        trial: Some("run".parse().unwrap()),
        ..options("r", "y")
    };
    let message = desk.error(text, &of_trial);
    assert!(
        message.contains("no column \"run\"") && message.ends_with("--trial COLUMN or COLUMN=VALUE"),
        "{message}"
    );
    let kept = ReadOptions {
        columns: Some(vec![String::from("z")]),
        ..options("r", "y")
    };
    let message = desk.error(text, &kept);
    assert!(
        message.contains("no column \"z\"") && message.ends_with("--columns NAME,NAME, or none"),
        "{message}"
    );
    assert!(
        desk.error(text, &options("r-y", "r-y"))
            .contains("input and output are both r-y")
    );
}

/// Spreadsheet files with decimal commas give the same record: with semicolons or tabs, a byte order mark or CRLF.
#[test]
fn decimal_commas_give_the_same_record() {
    let desk = TestFolder::new();
    let of = |text: &str| desk.read(text, &default_options()).unwrap();
    let point = of("t,e,u\n0.00,-1.5,2e-3\n0.01,1.25,0\n0.02,1,5\n");
    for text in [
        "\u{feff}t;e;u\r\n0,00;-1,5;2e-3\r\n0,01;1,25;0\r\n0,02;1;5\r\n",
        "t\te\tu\n0,00\t-1,5\t2e-3\n0,01\t1,25\t0\n0,02\t1\t5\n",
        "\"t\",\"e\",\"u\"\n\"0,00\",\"-1,500\",\"2e-3\"\n\"0,01\",\"1,25\",\"0\"\n\"0,02\",\"1\",\"5\"\n",
    ] {
        let comma = of(text);
        assert_eq!(comma.record, point.record);
        assert_eq!(comma.notes, ["the commas in the numbers are taken as decimal commas"]);
    }
    // A comma before three digits may separate thousands.
    let message = desk.error(
        "t,e,u\n0,\"1,500\",\"2,000\"\n1,\"1,250\",\"3,000\"\n",
        &default_options(),
    );
    assert!(message.contains("decimal point instead of a comma"), "{message}");
}

#[test]
fn errors_name_line_column_and_remedy() {
    let desk = TestFolder::new();
    let message = |text: &str| desk.error(text, &default_options());
    let says = |text: &str, parts: &[&str]| {
        let message = message(text);
        for part in parts {
            assert!(message.contains(part), "\"{part}\" is not in: {message}");
        }
    };
    says(
        "t,e,u\n0,1,2\n1,abc,2\n",
        &["line 3, column e: found \"abc\", expected a number", "--fill"],
    );
    says(
        "t;e;u\n0;1,5;2\n1;1.6;2\n",
        &["line 2, column e", "decimal point instead of a comma"],
    );
    says(
        "t,e,u\n0,\"1,500\",2\n1,\"1,600\",2\n",
        &["line 2, column e", "decimal point instead of a comma"],
    );
    says(
        "t,e,u\nframes,counts,counts\n0,1,2\n1,1,2\n",
        &["line 2, column t: found \"frames\"", "remove it and give --unit"],
    );
    says(
        "t,e,u\n2024-03-01 10:00:00.00,1,2\n0.02,1,2\n",
        &["line 2, column t", "mixes numbers with dates or clock times", "--fs HZ"],
    );
    says(
        "t e\n0.00 1.5 2\n0.01 1.6 2\n",
        &[
            "line 1: the header has 2 words, expected 3 names as in the rows below it",
            "in quotation marks",
        ],
    );
    says(
        "Run 3\n\nTime s Roll error\n0.00 1.5 2\n0.01 1.6 2\n",
        &["line 3: the header has 4 words, expected 3 names"],
    );
    says(
        "@relation run\n@attribute t numeric\n@data\n0,1,2\n1,1,2\n2,1,2\n",
        &["line 3: the header has 1 word, expected 3 names"],
    );
    says(
        "0,00;1,5;2\n0,01;1,6;2\n0,02;1,6;2\n",
        &["line 1: the first line holds numbers (0,00, 1,5, 2)"],
    );
    says(
        "t,e,u\n0,00,1,5,2,5\n0,01,1,6,2,5\n",
        &[
            "line 2: 6 values, expected 3 as in the header",
            "decimal commas",
            "semicolons or tabs",
        ],
    );
    says(
        "0.00 1.5 2\n0.01 1.6 2\n",
        &["line 1: the first line holds numbers (0.00, 1.5, 2)", "insert a header"],
    );
    says(
        "t,e,u\n0,1,2\n#\n1,NaN,2\n2,,2\n",
        &[
            "line 4, column e: the value is missing (NaN; 2 of 3 missing in this column)",
            "--fill",
        ],
    );
    says(
        "t,e,u\n0,1,2\n1,2,\n",
        &["line 3, column u: the value is missing (empty; "],
    );
    says(
        "t,e,u\n0,1,2\n1,2,-inf\n",
        &["line 3, column u: found -inf, expected a finite number"],
    );
    says("t,e,u\n0,1,2\nx,2,3\n", &["line 3, column t: found \"x\""]);
    says("t,e,u\n0,1,2\n,2,3\n", &["line 3, column t: the value is missing"]);
    says("t,e,u\n0,1,2\n", &["1 sample, expected at least 2", "--fs HZ"]);
    says(
        "t,e,u\n0,1,2\n1,1,2\n1,1,2\n2,1,2\n",
        &["line 4: t = 1 s follows t = 1 s, expected increasing time"],
    );
    says("t,e,u\n0,1,2\n2,1,2\n1,1,2\n", &["line 4: t = 1 s follows t = 2 s"]);
    says(
        "t,e,u\n0.0,1,2\n0.1,1,2\n0.2,1,2\n0.6,1,2\n0.7,1,2\n0.8,1,2\n0.9,1,2\n",
        &[
            "gap after line 4, t = 0.2 s (missing samples: 3; next sample at 0.6 s",
            "total number of gaps: 1",
            "--resample",
        ],
    );
    says(
        "t,e,u\n0.000,1,2\n0.100,1,2\n0.230,1,2\n0.300,1,2\n",
        &[
            "t = 0.23 s at line 4 is 3.000e-2 s off",
            "expected at most 1.000e-3 s",
            "--resample",
        ],
    );
    says("t,e,u\n0,1,2\n1,1\n", &["line 3: 2 values, expected 3"]);
    says(
        "t,e,u\n0,1,2\n1,\"1,2\n2,1,2\n",
        &[
            "line 3: a quotation mark opens a cell in this line and is never closed",
            "remove the mark",
        ],
    );
}

#[test]
fn non_numeric_columns_are_omitted_with_a_note() {
    let desk = TestFolder::new();
    let text = "t,e,u,who,d,\n0,1,2,P1,,\n1,1,2,P1,3,\n2,1,2,P1,4,\n";
    let read = desk.read(text, &default_options()).unwrap();
    let names: Vec<&str> = read.record.channels().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["e", "u"]);
    assert_eq!(read.notes.len(), 3, "{:?}", read.notes);
    assert!(read.notes[0].contains("column 6 has no name"));
    assert!(read.notes[1].contains("column who is left out") && read.notes[1].contains("found \"P1\""));
    assert!(read.notes[2].contains("column d is left out") && read.notes[2].contains("missing (empty; "));
}

/// For any content of a file, the result is a record of finite numbers or an error that names the file.
#[test]
fn damaged_files_do_not_cause_a_panic() {
    let desk = TestFolder::new();
    let path = desk.path("run.csv");
    write_record(&path, &record(12, 0.01, -0.05)).unwrap();
    let seeds = [
        fs::read(&path).unwrap(),
        b"\xef\xbb\xbft;e;u;d\r\n0,00;1;2;a\r\n0.01;1e3;-2;\r\n0.02;NaN;3;4\r\n0.03;1;2;3\r\n".to_vec(),
        b"t\te\tu\n-1\t1\t2\n0\t3\t4\n1\t5\t6\n2\t5\t6\n".to_vec(),
    ];
    let pieces: [&[u8]; 14] = [
        b"\"",
        b"\n",
        b"\r",
        b"#",
        b",",
        b"NaN",
        b"-inf",
        b"1e308",
        b"-1e308",
        b"5e-324",
        b"\xff",
        b"\0",
        b"t",
        b"e-999999999999",
    ];
    let mut draw = Draw(1);
    let (mut read, mut refused) = (0, 0);
    for round in 0..3000 {
        let mut bytes = seeds[round % seeds.len()].clone();
        for _ in 0..=draw.below(4) {
            let at = draw.below(bytes.len());
            match draw.below(6) {
                0 if !bytes.is_empty() => bytes[at] = draw.below(256) as u8,
                1 => bytes.truncate(at),
                2 => {
                    let end = (at + draw.below(20)).min(bytes.len());
                    bytes.drain(at..end);
                }
                3 => {
                    let end = (at + draw.below(40)).min(bytes.len());
                    let copy = bytes[at..end].to_vec();
                    bytes.splice(at..at, copy);
                }
                4 if !bytes.is_empty() => bytes[at] = b"0123456789.-e,;"[draw.below(15)],
                _ => {
                    let piece = pieces[draw.below(pieces.len())];
                    bytes.splice(at..at, piece.iter().copied());
                }
            }
        }
        let options = ReadOptions {
            input: Some(["e", "u-e", "-e"][draw.below(3)].parse().unwrap()),
            sampling_hz: [None, None, Some(100.0)][draw.below(3)],
            span_s: [(None, None), (Some(0.0), None), (Some(-1.0), Some(1.5))][draw.below(3)],
            repair: Repair {
                resample: draw.below(2) == 0,
                fill: draw.below(2) == 0,
            },
            ..default_options()
        };
        match desk.read(&bytes, &options) {
            Ok(good) => {
                read += 1;
                assert!(good.record.channels().flat_map(|c| &c.values).all(|v| v.is_finite()));
                assert!(good.record.times_s().iter().all(|t| t.is_finite()));
            }
            Err(error) => {
                refused += 1;
                assert!(error.to_string().contains("run.csv"), "{error}");
            }
        }
    }
    // Both outcomes are frequent.
    assert!(read > 250 && refused > 250, "{read} read, {refused} refused");
}

/// Recordings of people are not part of the project; the test is skipped if they are absent.
#[test]
fn recordings_of_people_are_read() {
    let Some(dir) = std::env::var_os("HOID_HUMAN_DATA") else {
        eprintln!("skipped: HOID_HUMAN_DATA names no directory of recordings with columns t, r, y, u");
        return;
    };
    let mut read = 0;
    for entry in fs::read_dir(Path::new(&dir)).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "csv") || path.file_stem().is_some_and(|stem| stem == "index") {
            continue;
        }
        let found = read_record(&path, &options("r-y", "u")).unwrap();
        assert!(found.notes.is_empty(), "{:?}", found.notes);
        assert_eq!(found.record.sample_time().s(), 1.0 / 60.0);
        read += 1;
    }
    assert!(read > 0);
    eprintln!("{read} recordings read");
}

#[test]
fn constant_term_of_a_difference_is_not_reported() {
    let desk = TestFolder::new();
    let rows: String = (0..50)
        .map(|k| format!("{:.2},0,{},7\n", 0.01 * f64::from(k), f64::from(k * k % 17).sqrt()))
        .collect();
    let text = format!("t,r,y,u\n{rows}");
    let found = |input: &str, output: &str| -> Vec<String> {
        let read = desk.read(&text, &options(input, output)).unwrap();
        read.quality_issues
            .iter()
            .map(|one| format!("{}: {one}", one.kind.name()))
            .collect()
    };
    assert_eq!(found("r-y", "u"), ["constant: u is constant: 7"]);
    assert_eq!(found("y", "-r"), ["constant: r is constant: 0"]);
    assert_eq!(found("r-u", "y").len(), 2);
}

#[test]
fn only_requested_columns_are_kept() {
    let directory = tempfile::tempdir().unwrap();
    let csv = directory.path().join("run.csv");
    fs::write(
        &csv,
        "time_ms,word,r,y,u,x,n\n0,a,1,0,5,7,9\n10,b,2,0,6,8,10\n20,c,4,1,7,9,\n",
    )
    .unwrap();
    let options = |columns: &[&str]| ReadOptions {
        input: Some("r-y".parse().unwrap()),
        columns: Some(columns.iter().map(|name| (*name).to_owned()).collect()),
        ..ReadOptions::default()
    };
    let names = |path: &Path, columns: &[&str]| -> Vec<String> {
        let read = read_record(path, &options(columns)).unwrap();
        assert_eq!(read.record.input(), [1.0, 2.0, 3.0]);
        read.record.channels().map(|channel| channel.name.clone()).collect()
    };
    assert_eq!(names(&csv, &[]), ["r-y", "u", "r", "y"]);
    assert_eq!(names(&csv, &["x"]), ["r-y", "u", "r", "y", "x"]);
    let npz = directory.path().join("run.npz");
    let all = read_record(&csv, &options(&["x"])).unwrap().record;
    write_record(&npz, &all).unwrap();
    assert_eq!(names(&npz, &[]), ["r-y", "u", "r", "y"]);
    let error = read_record(&csv, &options(&["z"])).unwrap_err().to_string();
    assert!(error.contains("\"z\"") && error.contains("word"), "{error}");
}

#[test]
fn points_between_thousands_are_refused() {
    let desk = TestFolder::new();
    let table = |print: &dyn Fn(i32) -> String| {
        let rows = (0..40).map(|k| format!("{:.2};{};{}\n", 0.02 * f64::from(k), print(1200 - 30 * k), 2 * k));
        std::iter::once(String::from("t;e;u\n")).chain(rows).collect::<String>()
    };
    let in_thousands = |value: i32| match value.abs() {
        1000.. => format!("{}.{:03}", value / 1000, value.abs() % 1000),
        _ => value.to_string(),
    };
    let message = desk.error(table(&in_thousands), &default_options());
    assert!(
        message.contains("column e: found \"1.200\"") && message.contains("may separate thousands"),
        "{message}"
    );
    // Numbers with three decimals are read.
    let decimals = |value: i32| format!("{:.3}", f64::from(value) / 100.0);
    let read = desk.read(table(&decimals), &default_options()).unwrap();
    assert_eq!(read.record.input()[0], 12.0);
    let trimmed = |value: i32| format!("{}", f64::from(value) / 1000.0);
    let read = desk.read(table(&trimmed), &default_options()).unwrap();
    assert_eq!(read.record.input()[1], 1.17);
}
