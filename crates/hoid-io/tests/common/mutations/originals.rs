//! The valid files: files that hoid writes, files of other programs (`fixtures/`), and CSV with all its features.

use std::{fs, path::Path};

use hoid_io::write_record;
use hoid_model::{Channel, Record, SampleTime};

use super::inside::UnpackedParts;

/// A valid file.
#[derive(Debug, Clone)]
pub struct Original {
    pub extension: &'static str,
    pub name: String,
    pub bytes: Vec<u8>,
    pub inside: Option<UnpackedParts>,
    /// Words of the format.
    pub tokens: &'static [&'static [u8]],
}

impl Original {
    /// True for a table of text.
    pub fn is_text(&self) -> bool {
        ["csv", "txt", "tsv"].contains(&self.extension)
    }
}

const TEXTS: [&str; 5] = [
    "# units: t s, e deg, u deg\n# sample_time: 0.01 s\nt,e,u\n0,0.125,-0.5\n0.01,0.25,-0.25\n0.02,1e-3,7\n0.03,0,1\n",
    "\u{feff}time;stick \"raw\";e;u;r;y\r\n\r\n0;1;2;3;4;5\r\n0.5;1;NaN;3;4;5\r\n1;;2;3;4;5\r\n1.5;1;2;NA;4;5\r\n",
    "t\te\tu\tnote\n0\t1\t2\t\"a\tb\"\n1\t3\t4\t=1+1\n2\t5\t6\t\n",
    "# two, by hand\n\"t\" , e ,u\n# here, too\n0, 1 ,2\n1,3,4\n2,3,4\n2,3,4\n9,3,4\n\n,,\n,,\n",
    "frame,e,u,f_t,phase\r0,1,2,3,0\r1,2,3,4,0\r2,3,4,5,1\r",
];

/// All valid files, in a fixed order.
pub fn originals() -> Vec<Original> {
    let mut all: Vec<Original> = TEXTS
        .iter()
        .enumerate()
        .map(|(k, text)| {
            original(
                ["csv", "txt", "tsv"][k % 3],
                format!("text {k}"),
                text.as_bytes().to_vec(),
            )
        })
        .collect();
    let directory = tempfile::tempdir().unwrap();
    for extension in ["csv", "parquet", "npz", "mat"] {
        for (n, start) in [(3, 0.0), (60, -12.5)] {
            let path = directory.path().join("run").with_extension(extension);
            write_record(&path, &record(n, start)).unwrap();
            all.push(original(extension, format!("written {n}"), fs::read(&path).unwrap()));
        }
    }
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    for folder in ["npz", "mat", "parquet", "xdf"] {
        let mut files: Vec<_> = fs::read_dir(fixtures.join(folder))
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .collect();
        files.sort();
        for path in files {
            let extension = path.extension().unwrap().to_str().unwrap().to_owned();
            let Some(extension) = ["npz", "npy", "mat", "parquet", "xdf"]
                .into_iter()
                .find(|e| *e == extension)
            else {
                continue;
            };
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            // This file is rejected as a whole, because hoid does not read Zstandard.
            if name == "zstd.parquet" {
                continue;
            }
            all.push(original(extension, name, fs::read(&path).unwrap()));
        }
    }
    all.push(original("xdf", "small".into(), small_xdf()));
    all
}

fn original(extension: &'static str, name: String, bytes: Vec<u8>) -> Original {
    Original {
        inside: UnpackedParts::of(extension, &bytes),
        tokens: tokens(extension),
        extension,
        name,
        bytes,
    }
}

/// Some rows, with names that are invalid in some formats.
fn record(n: usize, start: f64) -> Record {
    let channel = |name: &str, k: f64| {
        let values = (0..n).map(|i| (k * i as f64).sin()).collect();
        Channel::new(name, "deg", values)
    };
    let record = Record::new(SampleTime::new(0.01).unwrap(), channel("e", 0.3), channel("u", 0.2)).unwrap();
    record
        .starting_at(start)
        .with_channel(channel("K e", 0.1))
        .and_then(|record| record.with_channel(channel("f_t", 1.0)))
        .unwrap()
}

/// Two streams of a few samples, with clock offsets and a footer.
fn small_xdf() -> Vec<u8> {
    let mut file = b"XDF:".to_vec();
    let mut chunk = |tag: u16, content: &[u8]| {
        file.push(4);
        file.extend((content.len() as u32 + 2).to_le_bytes());
        file.extend(tag.to_le_bytes());
        file.extend(content);
    };
    chunk(1, b"<?xml version=\"1.0\"?><info><version>1.0</version></info>");
    for (id, format, hz) in [(1_u32, "double64", 100), (2, "string", 0)] {
        let header = format!(
            "<info><name>s{id}</name><channel_count>2</channel_count><nominal_srate>{hz}</nominal_srate><channel_format>{format}\
             </channel_format><desc><channels><channel><label>e</label><unit>deg</unit></channel><channel><label>u</label>\
             </channel></channels></desc></info>"
        );
        chunk(2, &[&id.to_le_bytes()[..], header.as_bytes()].concat());
        let mut samples = id.to_le_bytes().to_vec();
        samples.extend([1, 4]);
        for k in 0..4 {
            samples.push(8);
            samples.extend((1.0 + 0.01 * f64::from(k)).to_le_bytes());
            for channel in 0..2 {
                match id {
                    1 => samples.extend(f64::from(k + channel).to_le_bytes()),
                    _ => samples.extend([1, 2, b'a', b'b']),
                }
            }
        }
        chunk(3, &samples);
        for at in [1.0_f64, 1.02, 1.04] {
            let offset = [&id.to_le_bytes()[..], &at.to_le_bytes(), &1e-3_f64.to_le_bytes()].concat();
            chunk(4, &offset);
        }
        let footer = "<info><first_timestamp>1</first_timestamp><last_timestamp>1.03</last_timestamp><sample_count>4</sample_count></info>";
        chunk(6, &[&id.to_le_bytes()[..], footer.as_bytes()].concat());
    }
    file
}

fn tokens(extension: &str) -> &'static [&'static [u8]] {
    match extension {
        "csv" | "txt" | "tsv" => &[
            b",",
            b";",
            b"\t",
            b"\"",
            b"\"\"",
            b"\n",
            b"\r",
            b"\r\n",
            b"#",
            b"t",
            b"e",
            b"u",
            b"NaN",
            b"inf",
            b"-",
            b"+1e999",
            b"# sample_time: 1e-300 s\n",
            b"# units: t s, e \xc2\xb0\n",
            b"\0",
            b"\xff",
            b"\xef\xbb\xbf",
            b"0,1",
            b"1e-400",
            b"\n\n\n\n",
            b",,,,,,,,,,,,,,,,",
            b"\x1b[31m",
            b"=cmd|' /C calc'!A0",
            b"1e308",
        ],
        "npz" | "npy" => &[
            b"\x93NUMPY",
            b"\x01\x00",
            b"\x03\x00",
            b"'shape': (",
            b"(4294967296,)",
            b"(0, 4294967296, 4294967296)",
            b"'<f8'",
            b"'<U0'",
            b"'|S0'",
            b"'<U1073741824'",
            b"'|O'",
            b"[('a', '<f8'), ('b', '<f8')]",
            b"True",
            b"False",
            b"}",
            b"PK\x01\x02",
            b"PK\x03\x04",
            b"PK\x05\x06",
            b".npy",
            b"\n",
        ],
        "mat" => &[
            b"MI",
            b"IM",
            b"\x0e\0\0\0",
            b"\x0f\0\0\0",
            b"\x01\0\0\0",
            b"\x02\0\0\0",
            b"\x06\0\0\0",
            b"\x05\0\x04\0",
            b"\x09\0\0\0",
            b"\0\0\0\x80",
            b"\x89HDF\r\n\x1a\n",
            b"TREE",
            b"SNOD",
            b"HEAP",
            b"GCOL",
            b"OHDR",
            b"FRHP",
            b"BTHD",
            b"MATLAB_class",
            b"double\0",
            b"struct\0",
            b"cell\0",
            b"hoid_names",
            b"e",
            b"u",
            b"t",
        ],
        "parquet" => &[
            b"PAR1",
            b"PARE",
            b"\x15\x00",
            b"\x15\x02",
            b"\x16\xfe\xff\xff\xff\xff\xff\xff\xff\xff\x01",
            b"\x16\x80\x80\x80\x80\x10",
            b"\x19\xfc",
            b"\x19\xfc\xff\xff\xff\xff\x0f",
            b"\x1c\x15",
            b"\x26\x08",
            b"\x48",
            b"\0\0\0\0",
            b"\xff\xff\xff\xff\x0f",
            b"schema",
            b"e",
            b"u",
        ],
        _ => &[
            b"XDF:",
            b"\x01\x01",
            b"\x04\xff\xff\xff\x7f",
            b"\x08\xff\xff\xff\xff\xff\xff\xff\x7f",
            b"\x02\0",
            b"\x03\0",
            b"\x04\0",
            b"\x06\0",
            b"\x01\0\0\0",
            b"<channel_count>4096</channel_count>",
            b"<nominal_srate>1e-300</nominal_srate>",
            b"<nominal_srate>1e300</nominal_srate>",
            b"<channel_format>int8</channel_format>",
            b"<channel_count>0</channel_count>",
            b"</info>",
            b"<info>",
            b"&amp;",
            b"<a>",
            b"string",
            b"float32",
        ],
    }
}
