//! `hoid identify` of systems other than operators by polynomial models: exact data and a step test.
#![allow(clippy::unwrap_used)]

mod common;

use serde_json::Value;
use tempfile::TempDir;

use common::{json, wave, write_samples};

fn coefficients(found: &Value) -> Vec<(String, f64)> {
    let all = found["parameters"].as_array().unwrap();
    let one = |p: &Value| (p["name"].as_str().unwrap().to_owned(), p["value"].as_f64().unwrap());
    all.iter().map(one).collect()
}

fn finding_kinds(found: &Value) -> Vec<&str> {
    let all = found["verdict"]["findings"].as_array().unwrap();
    all.iter().map(|finding| finding["kind"].as_str().unwrap()).collect()
}

/// Returns noise of unit size, which is the same in every run.
fn noise(t: usize) -> f64 {
    let mut x = (t as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12_f64.sqrt()
}

/// The data have a level and an initial transient in addition to the model, whose coefficients are recovered.
#[test]
fn exact_data_give_exact_coefficients() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let e: Vec<f64> = (0..600).map(|t| wave(10 * t).1 + noise(t)).collect();
    let (b, a) = ([0.7, -1.3, 2.1], -0.6);
    let mut u = vec![5.0; e.len()];
    for t in 4..e.len() {
        u[t] = -a * u[t - 1] + (0..3).map(|j| b[j] * e[t - 2 - j]).sum::<f64>();
    }
    write_samples(d, "exact.csv", "t,e,u", e.len(), |t| {
        format!("{},{},{}", t as f64 / 10.0, e[t], u[t] + 3.0)
    });
    let options = ["--structure", "arx", "--orders", "na=1,nb=3", "--nk", "2", "--json"];
    let found = json(d, &[&["identify", "exact.csv"], options.as_slice()].concat());
    for ((name, value), expected) in coefficients(&found).iter().zip([a, b[0], b[1], b[2]]) {
        assert!((value - expected).abs() < 1e-10, "{name}: {value}");
    }
    let level = found["records"][0]["level"]["value"].as_f64().unwrap();
    assert!((level - 3.0).abs() < 1e-8, "{level}");
    assert_eq!(found["verdict"]["level"], "trustworthy", "{}", found["verdict"]);
    assert_eq!(finding_kinds(&found), ["no-noise"]);
}

/// The step response of a furnace at a level of 13.5 (a step of 10 after 3 s at rest) gives its dead time of .35 s, its
/// lag of 1.5 s, its gain of 2, and the level.
#[test]
fn step_response_gives_gain_lag_and_level() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let (ts, at, dead, lag, gain) = (0.05, 60, 7, 1.5, 2.0);
    write_samples(d, "step.csv", "t,e,u", 400, |t| {
        let e = if t < at { 0.0 } else { 10.0 };
        let since = t.saturating_sub(at + dead) as f64 * ts;
        let u = 13.5 + gain * 10.0 * (1.0 - (-since / lag).exp()) + 0.02 * noise(t);
        format!("{},{e},{u}", t as f64 * ts)
    });
    let options = [
        "--structure",
        "oe",
        "--orders",
        "nb=1,nf=1",
        "--delay",
        "0..1",
        "--json",
    ];
    let found = json(d, &[&["identify", "step.csv"], options.as_slice()].concat());
    assert_eq!(found["verdict"]["level"], "trustworthy", "{}", found["verdict"]);
    assert_eq!(found["records"][0]["samples"], 400, "nothing is cut");
    let (b0, f1) = match coefficients(&found).as_slice() {
        [(_, b0), (_, f1)] => (*b0, *f1),
        other => panic!("{other:?}"),
    };
    assert_eq!(found["orders"]["nk"], dead + 1);
    assert!((b0 / (1.0 + f1) - gain).abs() < 0.005, "{b0} {f1}");
    assert!((-ts / (-f1).ln() - lag).abs() < 0.005, "{f1}");
    let level = found["records"][0]["level"]["value"].as_f64().unwrap();
    assert!((level - 13.5).abs() < 0.02, "{level}");
}
