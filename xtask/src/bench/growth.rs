//! Growth of time and memory with the numbers of samples, parameters, replications and threads.
//!
//! Each point is measured in its own process. The example of hoid reports its own peak memory. For the command line,
//! the largest resident memory is read from `/proc` while it runs (on Linux; elsewhere the column is empty). The slope
//! of `log time` over `log N` is fitted by least squares, starting from the third smallest N because the fixed cost of
//! a run dominates at smaller N; a slope of 1 means that time is proportional to N.

use std::{
    fmt::Write,
    fs,
    path::Path,
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use serde_json::Value;

use super::table::{format_number, format_time};
use crate::process::output;

/// A measured point.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Point {
    n: usize,
    seconds: f64,
    /// Additional memory, bytes; `None` if the system does not report it.
    memory: Option<u64>,
}

/// Interval between measurements of a child's memory.
const MEMORY_POLL_INTERVAL: Duration = Duration::from_millis(2);

const PLAN: &str = "name = \"growth\"
title = \"One cell: ARX and Box-Jenkins in condition C1\"
seed = 1
replications = 100

[[scenarios]]
name = \"constant\"
condition = \"C1\"

[[estimators]]
name = \"ARX\"
method = \"fit\"
structure = \"arx\"
orders.nk = 29

[[estimators]]
name = \"BJ\"
method = \"fit\"
structure = \"bj\"
orders.nd = 1
orders.nk = 29
";

/// Measures all points and returns the tables as Markdown; `quick` omits the largest points.
///
/// # Errors
/// The reason, if a point cannot be measured.
pub fn measure_tables(tasks: &Path, hoid: &Path, work: &Path, quick: bool) -> Result<String, String> {
    let data = work.join("data");
    let largest = if quick { 5 } else { 7 };
    let powers = |to: u32| (3..=to).map(|k| 10_usize.pow(k)).collect::<Vec<_>>();
    let mut text = String::new();
    for (name, title, unit, values) in [
        ("arx", "ARX fit, 4 parameters", "samples", powers(largest)),
        (
            "bj",
            "Box-Jenkins fit, 5 parameters, no start given",
            "samples",
            powers(largest),
        ),
        (
            "rls",
            "RLS by `track`, one row with standard errors per sample",
            "samples",
            powers(largest.min(6)),
        ),
        (
            "rpem",
            "RPEM by `track`, one row with standard errors per sample",
            "samples",
            powers(largest.min(6)),
        ),
        (
            "arx parameters",
            "ARX fit, 8192 samples",
            "parameters",
            vec![2, 4, 6, 8, 12, 16, 20],
        ),
        (
            "bj parameters",
            "Box-Jenkins fit, 8192 samples, nd = p - 4",
            "parameters",
            vec![5, 6, 8, 12, 16, 20],
        ),
        (
            "rls parameters",
            "RLS by `track`, 8192 samples",
            "parameters",
            vec![2, 4, 6, 8, 12, 16, 20],
        ),
    ] {
        eprintln!("{name}");
        let points = values
            .into_iter()
            .map(|n| measure_task(tasks, &data, name, n))
            .collect::<Result<Vec<_>, _>>()?;
        write_section(&mut text, title, unit, &points);
    }
    let plan = work.join("growth.toml");
    fs::write(&plan, PLAN).map_err(|e| format!("{}: {e}", plan.display()))?;
    for threads in [1, 2] {
        eprintln!("replications, {threads} threads");
        let points = (0..=if quick { 3 } else { 5 })
            .map(|k| measure_study(hoid, &plan, work, 10_usize.pow(k), threads))
            .collect::<Result<Vec<_>, _>>()?;
        let title =
            format!("`hoid study run`: runs of C1 simulated and fitted by ARX and Box-Jenkins, threads: {threads}");
        write_section(&mut text, &title, "replications", &points);
    }
    text += &measure_identify(tasks, hoid, work, 10_usize.pow(largest))?;
    Ok(text)
}

/// Measures a point with the example `tasks`.
fn measure_task(tasks: &Path, data: &Path, name: &str, n: usize) -> Result<Point, String> {
    let mut command = Command::new(tasks);
    command
        .arg(data)
        .args(["--growth", name, &n.to_string()])
        .env("RAYON_NUM_THREADS", "1");
    let printed = output(&mut command)?;
    let object: Value = serde_json::from_str(printed.trim()).map_err(|e| format!("{name}: {e} in {printed}"))?;
    let number = |key: &str| object[key].as_f64().unwrap_or(0.0);
    let (before, peak) = (number("before_bytes"), number("peak_bytes"));
    Ok(Point {
        n,
        seconds: number("seconds"),
        memory: (peak > 0.0).then_some((peak - before) as u64),
    })
}

fn measure_study(hoid: &Path, plan: &Path, work: &Path, n: usize, threads: usize) -> Result<Point, String> {
    let out = work.join("growth-study");
    let _ = fs::remove_dir_all(&out);
    let mut command = Command::new(hoid);
    command.args(["study", "run"]).arg(plan).arg("--out").arg(&out).args([
        "--replications",
        &n.to_string(),
        "--jobs",
        &threads.to_string(),
    ]);
    let (seconds, memory) = run_measured(&mut command)?;
    Ok(Point { n, seconds, memory })
}

/// Measures `hoid identify` on a Parquet file of n samples (t, e, u).
fn measure_identify(tasks: &Path, hoid: &Path, work: &Path, n: usize) -> Result<String, String> {
    let file = work.join("growth.parquet");
    let mut write = Command::new(tasks);
    write
        .arg(work.join("data"))
        .args(["--growth", "arx", &n.to_string()])
        .arg(&file);
    output(&mut write)?;
    // The file contains t, e and u; the record contains only e and u with 8 bytes each.
    let data = 16 * n as u64;
    let mut text = format!(
        "\n`hoid identify` on a Parquet file of {n} samples (e and u: {}):\n\n| fit | time | peak memory | times e and u |\n|---|---:|---:|---:|\n",
        format_bytes(data)
    );
    for (name, structure, options) in [
        ("ARX", "arx", &["--orders", "na=2,nb=2", "--nk", "29"][..]),
        ("Box-Jenkins", "bj", &["--orders", "nb=2,nd=1,nf=2", "--nk", "29"]),
        // The candidates are fitted on all cores at once.
        ("Box-Jenkins, orders and delay chosen", "bj", &[]),
    ] {
        eprintln!("identify: {name}");
        let mut command = Command::new(hoid);
        command
            .arg("identify")
            .arg(&file)
            .args(["--structure", structure])
            .args(options);
        let (seconds, memory) = run_measured(&mut command)?;
        let (peak, factor) = memory.map_or(("-".to_owned(), "-".to_owned()), |m| {
            (format_bytes(m), format_number(m as f64 / data as f64))
        });
        let _ = writeln!(text, "| {name} | {} | {peak} | {factor} |", format_time(seconds));
    }
    let _ = fs::remove_file(&file);
    Ok(text)
}

/// Runs a command and returns its time and the largest resident memory that was measured.
fn run_measured(command: &mut Command) -> Result<(f64, Option<u64>), String> {
    let shown = format!("{command:?}");
    let begun = Instant::now();
    let mut child = command
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .map_err(|e| format!("cannot run {shown}: {e}"))?;
    let status = format!("/proc/{}/status", child.id());
    let mut peak = None;
    loop {
        peak = peak.max(fs::read_to_string(&status).ok().and_then(|text| peak_memory(&text)));
        match child.try_wait().map_err(|e| format!("{shown}: {e}"))? {
            Some(ended) if ended.success() => return Ok((begun.elapsed().as_secs_f64(), peak)),
            Some(ended) => return Err(format!("failed ({ended}): {shown}")),
            None => thread::sleep(MEMORY_POLL_INTERVAL),
        }
    }
}

/// Returns `VmHWM` from the text of a status file, bytes.
fn peak_memory(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace()
        .next()?
        .parse::<u64>()
        .ok()
        .map(|kib| 1024 * kib)
}

fn write_section(text: &mut String, title: &str, unit: &str, points: &[Point]) {
    let _ = write!(
        text,
        "\n{title}:\n\n| {unit} | time | a unit | memory |\n|---:|---:|---:|---:|\n"
    );
    for point in points {
        let memory = point.memory.map_or("-".to_owned(), format_bytes);
        let _ = writeln!(
            text,
            "| {} | {} | {} | {memory} |",
            point.n,
            format_time(point.seconds),
            format_unit_time(point.seconds / point.n as f64)
        );
    }
    let _ = writeln!(
        text,
        "\nSlope: {:.2}.",
        slope(&points[points.len().saturating_sub(3).min(2)..])
    );
}

fn format_unit_time(seconds: f64) -> String {
    if seconds < 1e-6 {
        format!("{} ns", format_number(seconds * 1e9))
    } else {
        format_time(seconds)
    }
}

/// Returns the slope of `log time` over `log N`.
fn slope(points: &[Point]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|p| ((p.n as f64).ln(), p.seconds.ln())).collect();
    let count = logs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(|l| l.0), mean(|l| l.1));
    let along: f64 = logs.iter().map(|l| (l.0 - x) * (l.1 - y)).sum();
    let across: f64 = logs.iter().map(|l| (l.0 - x) * (l.0 - x)).sum();
    along / across
}

fn format_bytes(n: u64) -> String {
    match n as f64 / f64::from(1 << 20) {
        m if m >= 1024.0 => format!("{} GiB", format_number(m / 1024.0)),
        m => format!("{} MiB", format_number(m)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_of_a_power_law_is_its_exponent() {
        for exponent in [1.0, 2.0] {
            let points: Vec<Point> = [10_usize, 100, 1000]
                .map(|n| Point {
                    n,
                    seconds: 1e-6 * (n as f64).powf(exponent),
                    memory: None,
                })
                .to_vec();
            assert!((slope(&points) - exponent).abs() < 1e-12);
        }
    }

    #[test]
    fn peak_memory_is_parsed_and_formatted() {
        assert_eq!(peak_memory("VmPeak:\t 9 kB\nVmHWM:\t  2048 kB\n"), Some(2 << 20));
        assert_eq!(peak_memory(""), None);
        assert_eq!(format_bytes(2 << 20), "2.00 MiB");
        assert_eq!(format_bytes(3 << 30), "3.00 GiB");
    }

    #[test]
    fn section_has_one_row_per_point() {
        let mut text = String::new();
        let at = |n: usize| Point {
            n,
            seconds: 1e-8 * n as f64,
            memory: Some(1 << 20),
        };
        write_section(&mut text, "Fit", "samples", &[at(10), at(100), at(1000), at(10_000)]);
        assert!(text.contains("| 1000 | 10.0 us | 10.0 ns | 1.00 MiB |"), "{text}");
        assert!(text.contains("Slope: 1.00."), "{text}");
    }
}
