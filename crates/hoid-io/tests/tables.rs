//! Tables of results are written and read; Parquet files of other programs and damaged files are read.

#![allow(clippy::unwrap_used, reason = "a test may fail at any line, its helpers as well")]

use std::fs;
use std::path::{Path, PathBuf};

use hoid_io::{
    ColumnKind, ColumnSchema, ColumnValues, IoError, OutputColumn, OutputTable, ReadOptions, Repair, TableSchema,
    TableWriter, read_record, read_table, write_record, write_table,
};
use hoid_model::{Channel, Record, SampleTime};

const FORMATS: [&str; 7] = ["csv", "TXT", "tsv", "parquet", "pq", "npz", "mat"];

fn output_column(name: &str, values: ColumnValues) -> OutputColumn {
    OutputColumn {
        name: name.to_owned(),
        values,
    }
}

/// Rows with all features that must be preserved.
fn table(rows: usize) -> OutputTable {
    let awkward = [
        0.0,
        -0.0,
        1.0,
        -17.0,
        0.1,
        f64::NAN,
        1e16,
        1e-5,
        5e-324,
        f64::MAX,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ];
    let texts = ["bj", "a,b", "#1", "say \"no\"", "two\nlines", " é ", "", "\t;"];
    OutputTable {
        comments: vec![
            "method: rpem".into(),
            String::new(),
            "  units: t s, K_e deg/deg".into(),
            "#".into(),
        ],
        columns: vec![
            output_column(
                "t",
                ColumnValues::Real((0..rows).map(|k| 0.01 * k as f64 - 1.0).collect()),
            ),
            output_column(
                "K_e",
                ColumnValues::Real((0..rows).map(|k| awkward[k % awkward.len()]).collect()),
            ),
            output_column(
                "convertible",
                ColumnValues::Whole((0..rows).map(|k| u64::MAX * (k as u64 % 2)).collect()),
            ),
            output_column(
                "who, \"when\"",
                ColumnValues::Text((0..rows).map(|k| texts[k % texts.len()].to_owned()).collect()),
            ),
            output_column("none", ColumnValues::Real(vec![f64::NAN; rows])),
        ],
    }
}

/// Checks that two tables are bit-identical, except for the payload of NaN.
fn assert_same(a: &OutputTable, b: &OutputTable) {
    assert_eq!(a.comments, b.comments);
    assert_eq!(a.schema(), b.schema());
    for (a, b) in a.columns.iter().zip(&b.columns) {
        match (&a.values, &b.values) {
            (ColumnValues::Real(x), ColumnValues::Real(y)) => {
                assert_eq!(x.len(), y.len());
                let same = |(x, y): (&f64, &f64)| x.to_bits() == y.to_bits() || x.is_nan() && y.is_nan();
                assert!(x.iter().zip(y).all(same), "{}", a.name);
            }
            (x, y) => assert_eq!(x, y, "{}", a.name),
        }
    }
}

#[test]
fn tables_round_trip_bit_for_bit() {
    let dir = tempfile::tempdir().unwrap();
    for extension in FORMATS {
        let path = dir.path().join("table").with_extension(extension);
        for rows in [1, 8, 9, 100, 70_000] {
            let table = table(rows);
            write_table(&path, &table).unwrap();
            assert_same(&read_table(&path).unwrap(), &table);
        }
        let single = OutputTable {
            columns: vec![output_column("a", ColumnValues::Real(vec![f64::NAN, 2.0, f64::NAN]))],
            ..OutputTable::default()
        };
        write_table(&path, &single).unwrap();
        assert_same(&read_table(&path).unwrap(), &single);
    }
    // In a CSV file without rows, the kinds of the columns are unknown.
    let path = dir.path().join("none.parquet");
    write_table(&path, &table(0)).unwrap();
    assert_same(&read_table(&path).unwrap(), &table(0));
    let path = dir.path().join("none.csv");
    write_table(&path, &table(0)).unwrap();
    assert_eq!(read_table(&path).unwrap().columns.len(), 5);
}

#[test]
fn csv_tables_are_readable_text() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("table.csv");
    write_table(&path, &table(6)).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(
        lines[..5],
        [
            "# method: rpem",
            "# ",
            "#   units: t s, K_e deg/deg",
            "# #",
            "t,K_e,convertible,\"who, \"\"when\"\"\",none"
        ]
    );
    assert_eq!(lines[5], "-1.0,0.0,0,bj,");
    assert_eq!(lines[6], "-0.99,-0.0,18446744073709551615,\"a,b\",");
    assert_eq!(lines[7], "-0.98,1.0,0,\"#1\",");
    assert!(text.contains("\n-0.95,,"), "NaN is an empty cell");
}

#[test]
fn appending_rows_gives_the_same_file() {
    let dir = tempfile::tempdir().unwrap();
    let whole = table(150_000);
    for extension in ["csv", "parquet"] {
        let (at_once, grown) = (dir.path().join("at_once"), dir.path().join("grown"));
        let (at_once, grown) = (at_once.with_extension(extension), grown.with_extension(extension));
        write_table(&at_once, &whole).unwrap();
        for step in [977, 65_536, 140_000] {
            let mut writer = TableWriter::create(&grown, &whole.schema()).unwrap();
            for start in (0..150_000).step_by(step) {
                writer
                    .append(&table_rows(&whole, start, 150_000.min(start + step)))
                    .unwrap();
            }
            writer.append(&table_rows(&whole, 0, 0)).unwrap();
            writer.finish().unwrap();
            assert!(
                fs::read(&at_once).unwrap() == fs::read(&grown).unwrap(),
                "{extension}, {step}"
            );
        }
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 4);
}

fn table_rows(table: &OutputTable, start: usize, end: usize) -> OutputTable {
    let part = |c: &OutputColumn| {
        let values = match &c.values {
            ColumnValues::Real(values) => ColumnValues::Real(values[start..end].to_vec()),
            ColumnValues::Whole(values) => ColumnValues::Whole(values[start..end].to_vec()),
            ColumnValues::Text(values) => ColumnValues::Text(values[start..end].to_vec()),
        };
        output_column(&c.name, values)
    };
    OutputTable {
        comments: Vec::new(),
        columns: table.columns.iter().map(part).collect(),
    }
}

#[test]
fn unfinished_write_keeps_the_old_file() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("study.parquet");
    fs::write(&path, "before").unwrap();
    let mut writer = TableWriter::create(&path, &table(0).schema()).unwrap();
    writer.append(&table(70_000)).unwrap();
    drop(writer);
    assert_eq!(fs::read(&path).unwrap(), b"before");
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn invalid_tables_are_not_written() {
    let dir = tempfile::tempdir().unwrap();
    for extension in ["csv", "parquet"] {
        let path = dir.path().join("table").with_extension(extension);
        let message = |table: &OutputTable| write_table(&path, table).unwrap_err().to_string();
        let mut uneven = table(3);
        uneven.columns[2].values = ColumnValues::Whole(vec![1]);
        assert!(message(&uneven).contains("\"convertible\" holds 1 values, expected 3"));
        let mut named = table(3);
        named.columns[1].name = "t".into();
        assert!(message(&named).contains("columns 1 and 2 are both named \"t\""));
        for name in ["", " t"] {
            named.columns[1].name = name.into();
            assert!(message(&named).contains("cannot be written"));
        }
        assert!(message(&OutputTable::default()).contains("no columns"));
        assert!(TableWriter::create(&path, &TableSchema::default()).is_err());

        let mut writer = TableWriter::create(&path, &table(0).schema()).unwrap();
        let mut other = table(2);
        other.columns[2].values = ColumnValues::Real(vec![1.0; 2]);
        let differ = writer.append(&other).unwrap_err().to_string();
        assert!(
            differ.contains("convertible (real)") && differ.contains("convertible (whole)"),
            "{differ}"
        );
        assert!(matches!(writer.append(&uneven), Err(IoError::ColumnLength { .. })));
        // Rejected rows have no effect on the file.
        writer.append(&table(2)).unwrap();
        writer.finish().unwrap();
        assert_same(&read_table(&path).unwrap(), &table(2));
    }
    let unknown = write_table(&dir.path().join("table.xlsx"), &table(2)).unwrap_err();
    assert!(unknown.to_string().contains(".parquet"), "{unknown}");
    assert!(matches!(
        write_table(dir.path(), &table(2)),
        Err(IoError::Directory { .. })
    ));
    assert!(write_table(&dir.path().join("no/table.parquet"), &table(2)).is_err());
    // A comment of two lines is written as two comments in both formats.
    for extension in ["csv", "parquet"] {
        let path = dir.path().join("lines").with_extension(extension);
        let lines = OutputTable {
            comments: vec!["one\ntwo".into()],
            ..table(1)
        };
        write_table(&path, &lines).unwrap();
        assert_eq!(read_table(&path).unwrap().comments, ["one", "two"]);
    }
}

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../fixtures/parquet")
        .join(name)
        .with_extension("parquet")
}

const ROW_COUNT: usize = 300;

/// The columns as `fixtures/parquet/make.py` defines them.
fn expected_values(name: &str, missing: bool) -> ColumnValues {
    let real = |f: &dyn Fn(f64) -> f64| ColumnValues::Real((0..ROW_COUNT).map(|k| f(k as f64)).collect());
    let whole = |f: &dyn Fn(u64) -> u64| ColumnValues::Whole((0..ROW_COUNT as u64).map(f).collect());
    match name {
        "t" => real(&|k| 0.01 * k),
        "e" => real(&|k| match k as usize {
            k if missing && (k % 7 == 3 || k == 11) => f64::NAN,
            _ => (0.1 * k).sin(),
        }),
        "u" => real(&|k| f64::from((0.1 * k).cos() as f32)),
        "half" => real(&|k| k % 64.0 / 8.0),
        "i8" => real(&|k| k % 100.0 - 50.0),
        "i32" => real(&|k| 1000.0 * k - 3.0),
        "price" | "cost" => real(&|k| (k - 5.0) / 100.0),
        "inner.x" => real(&|k| k),
        "i64" => whole(&|k| (1 << 40) + k),
        "u16" => whole(&|k| 60_000 + k),
        "u32" => whole(&|k| (1 << 32) - 1 - k),
        "u64" => whole(&|k| u64::MAX - k),
        "flag" => whole(&|k| u64::from(k % 3 == 0)),
        "who" => ColumnValues::Text(
            (0..ROW_COUNT)
                .map(|k| match k % 5 {
                    4 if missing => String::new(),
                    _ => format!("P{}", k % 3),
                })
                .collect(),
        ),
        other => panic!("no column {other}"),
    }
}

const NUMERIC_COLUMNS: [&str; 13] = [
    "half", "i8", "i32", "i64", "u16", "u32", "u64", "price", "cost", "flag", "inner.x", "e", "u",
];

#[test]
fn pyarrow_files_are_read() {
    for (name, missing) in [
        ("snappy", false),
        ("missing", true),
        ("missing_v2", true),
        ("encodings", false),
        ("lengths", true),
    ] {
        let options = ReadOptions {
            repair: Repair {
                resample: false,
                fill: missing,
            },
            ..ReadOptions::default()
        };
        let read = read_record(&fixture(name), &options).unwrap();
        let record = read.record;
        assert_eq!((record.len(), record.sample_time().s()), (ROW_COUNT, 0.01), "{name}");
        let names: Vec<&str> = record.channels().map(|c| c.name.as_str()).collect();
        for number in NUMERIC_COLUMNS {
            assert!(names.contains(&number), "{name}: {number} of {names:?}");
            let channel = record.channels().find(|c| c.name == number).unwrap();
            let check = |k: usize, value: f64| {
                let found = channel.values[k];
                // The sine functions of two libraries differ in the last bit; missing values were interpolated.
                assert!(
                    (found - value).abs() <= 2e-16 || value.is_nan(),
                    "{name}, {number}, row {k}: {found} {value}"
                );
            };
            match expected_values(number, missing) {
                ColumnValues::Real(values) => values.iter().enumerate().for_each(|(k, v)| check(k, *v)),
                ColumnValues::Whole(values) => values.iter().enumerate().for_each(|(k, v)| check(k, *v as f64)),
                ColumnValues::Text(_) => unreachable!(),
            }
        }
        let notes = read.notes.join("\n");
        for (column, what) in [
            ("who", "P0"),
            ("day", "a date or time"),
            ("pair.list.element", "a list"),
        ] {
            let note = format!("column {column} is left out");
            assert!(notes.contains(&note) && notes.contains(what), "{name}: {notes}");
        }
        let table = read_table(&fixture(name)).unwrap_err().to_string();
        assert!(table.contains("column day holds a date or time"), "{table}");
    }
}

/// `read_table` reads the values in the same way; kinds and empty text cells are specific to it.
#[test]
fn pyarrow_column_kinds_are_read() {
    let table = read_table(&fixture("kinds")).unwrap();
    for name in ["t", "e", "i8", "i64", "u32", "u64", "flag", "who", "inner.x"] {
        let (found, expected) = (table.column(name).unwrap(), expected_values(name, true));
        match (found, &expected) {
            (ColumnValues::Real(a), ColumnValues::Real(b)) => {
                assert_eq!(a.len(), b.len());
                assert!(
                    a.iter()
                        .zip(b)
                        .all(|(a, b)| (a - b).abs() <= 2e-16 || a.is_nan() && b.is_nan()),
                    "{name}"
                );
            }
            _ => assert_eq!(*found, expected, "{name}"),
        }
    }
    assert!(table.comments.is_empty());
}

#[test]
fn missing_parquet_values_are_located() {
    let message = |input: &str| {
        let options = ReadOptions {
            input: Some(input.parse().unwrap()),
            ..ReadOptions::default()
        };
        read_record(&fixture("missing"), &options).unwrap_err().to_string()
    };
    let null = message("e");
    assert!(
        null.contains("missing.parquet, row 4, column e: the value is missing (null; 44 of 300 missing"),
        "{null}"
    );
    assert!(null.contains("--fill"), "{null}");
    assert!(message("who").contains("row 1, column who: found \"P0\", expected a number"));
    assert!(message("day").contains("row 1, column day: found \"a date or time\""));
    assert!(message("E").contains("has no column"));

    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.parquet");
    let write = |t: ColumnValues, e: Vec<f64>| {
        let u = ColumnValues::Real(vec![0.5; e.len()]);
        let columns = vec![
            output_column("t", t),
            output_column("e", ColumnValues::Real(e)),
            output_column("u", u),
        ];
        write_table(
            &path,
            &OutputTable {
                comments: Vec::new(),
                columns,
            },
        )
        .unwrap();
        read_record(&path, &ReadOptions::default())
    };
    let t = |n: usize| ColumnValues::Real((0..n).map(|k| k as f64 / 60.0).collect());
    assert_eq!(
        write(t(50), vec![1.0; 50]).unwrap().record.sample_time().s(),
        1.0 / 60.0
    );
    let infinite = write(t(3), vec![0.0, f64::NEG_INFINITY, 0.0]).unwrap_err().to_string();
    assert!(
        infinite.contains("row 2, column e: found -inf, expected a finite number"),
        "{infinite}"
    );
    let still = write(ColumnValues::Whole(vec![0, 1, 1]), vec![0.0; 3])
        .unwrap_err()
        .to_string();
    assert!(still.contains("row 3: t = 1 s follows t = 1 s"), "{still}");
    assert!(matches!(write(t(0), Vec::new()), Err(IoError::NoRows { .. })));
}

#[test]
fn parquet_records_round_trip() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.parquet");
    let values = |a: f64| (0..70_000).map(|k| (a * f64::from(k)).sin()).collect::<Vec<f64>>();
    let ts = 1.0 / 99.995;
    let record = Record::new(
        SampleTime::new(ts).unwrap(),
        Channel::new("e", "deg", values(0.1)),
        Channel::new("u", "", values(0.2)),
    )
    .unwrap()
    .starting_at(-8.0)
    .labelled("run")
    .with_channel(Channel::new("f_t", "deg", values(0.3)))
    .unwrap();
    write_record(&path, &record).unwrap();
    let back = read_record(&path, &ReadOptions::default()).unwrap();
    assert!(back.notes.is_empty(), "{:?}", back.notes);
    assert_eq!(back.record.sample_time().s().to_bits(), ts.to_bits());
    assert_eq!(back.record.time_s(0), -8.0);
    for channel in record.channels() {
        let other = back.record.channels().find(|c| c.name == channel.name).unwrap();
        assert_eq!((&other.unit, &other.values), (&channel.unit, &channel.values));
    }
    // Both readers accept the same file as a table and as a record.
    let table = read_table(&path).unwrap();
    let names: Vec<&str> = table.columns.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["t", "f_t", "e", "u"]);
    assert_eq!(table.comments[0], "units: t s, f_t deg, e deg");
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn single_precision_time_is_even() {
    // At 2000 s the resolution of single precision is 1.2e-4 s; this rounding is not jitter.
    let read = read_record(&fixture("single"), &ReadOptions::default()).unwrap();
    assert_eq!(read.record.sample_time().s(), 0.01);
    assert_eq!(read.record.len(), 300);
}

#[test]
fn invalid_parquet_files_are_errors() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.parquet");
    let message = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        let record = read_record(&path, &ReadOptions::default()).unwrap_err().to_string();
        assert_eq!(record, read_table(&path).unwrap_err().to_string());
        assert!(record.contains("run.parquet"), "{record}");
        record
    };
    assert!(message(b"").contains("not a Parquet file: it is empty"));
    let csv = message(b"t,e,u\n0,1,2\n0.01,3,4\n");
    assert!(
        csv.contains("it starts with \"t,e,u\\n0,1,2") && csv.contains(".csv"),
        "{csv}"
    );
    assert!(message(b"PAR1").contains("ends after its first bytes"));
    let whole = fs::read(fixture("snappy")).unwrap();
    assert!(message(&whole[..whole.len() / 2]).contains("it is truncated"));
    let mut long = whole.clone();
    let at = long.len() - 8;
    long[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    let footer = message(&long);
    assert!(footer.contains("run.parquet is damaged: EOF"), "{footer}");
    let zstd = read_table(&fixture("zstd")).unwrap_err().to_string();
    assert!(
        zstd.contains("column t, row group 1 is compressed with Zstandard") && zstd.contains("Snappy"),
        "{zstd}"
    );
    // A file that is truncated at any position is rejected.
    for cut in (0..whole.len()).step_by(97) {
        message(&whole[..cut]);
    }
}

/// Files with modified bytes, especially in footers, give a table, a record or an error, without a panic or excessive
/// memory.
#[test]
fn damaged_parquet_files_do_not_cause_a_panic() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.parquet");
    write_table(&path, &table(60)).unwrap();
    let mut seeds = vec![fs::read(&path).unwrap()];
    for name in ["snappy", "missing", "missing_v2", "encodings", "lengths", "kinds"] {
        seeds.push(fs::read(fixture(name)).unwrap());
    }
    let mut state = 5_u64;
    let mut below = |n: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    let (mut read, mut refused) = (0, 0);
    for round in 0..4000 {
        let mut bytes = seeds[round % seeds.len()].clone();
        let footer = u32::from_le_bytes(bytes[bytes.len() - 8..][..4].try_into().unwrap()) as usize;
        for _ in 0..=below(4) {
            let start = if below(2) == 0 { 4 } else { bytes.len() - 8 - footer };
            let at = start + below(bytes.len() - start);
            match below(3) {
                0 => bytes[at] = below(256) as u8,
                1 => bytes[at] ^= 1 << below(8),
                _ => bytes[at] = [0, 0xff, 0x7f, 0x80][below(4)],
            }
        }
        fs::write(&path, &bytes).unwrap();
        for error in [
            read_table(&path).map(drop).err(),
            read_record(&path, &ReadOptions::default()).map(drop).err(),
        ] {
            match error {
                None => read += 1,
                Some(error) => {
                    refused += 1;
                    assert!(error.to_string().contains("run.parquet"), "{error}");
                }
            }
        }
    }
    assert!(read > 500 && refused > 500, "{read} read, {refused} refused");
}

#[test]
fn schema_matches_the_table() {
    let schema = table(2).schema();
    let kinds: Vec<ColumnKind> = schema.columns.iter().map(|c: &ColumnSchema| c.kind).collect();
    assert_eq!(
        kinds,
        [
            ColumnKind::Real,
            ColumnKind::Real,
            ColumnKind::Whole,
            ColumnKind::Text,
            ColumnKind::Real
        ]
    );
    assert!(table(0).column("t").unwrap().is_empty() && table(2).column("T").is_none());
}
