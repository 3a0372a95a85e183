//! Verdicts of traces on runs with faults and on clean runs.
//!
//! `cargo run --release -p hoid-evidence --example verdict_evidence -- [--runs N] [--seed S] [--method M] [--element]
//! [--kinds]`
//!
//! The runs last 82 s and are sampled at 100 Hz: operators with a lead on `1/s^2` and `1/(s(s+1))`, gain-like operators
//! on `1/s`, and lags on a gain, with remnants of 5 to 30 % of the variance of u (a lag, a remnant that depends on u,
//! or pulses). The virtual people of [`hoid_sim::people`] are added without faults. The loop of the modified runs is
//! integrated here, in steps of 1 ms, and shares no code with [`hoid_sim`]. The limits were set on seeds below 1000;
//! the default seed is 9000.
//!
//! `HOID_HUMAN_DATA=DIR` evaluates the recordings of people in a folder instead: CSV with columns t, u and e, or r and
//! y instead of e; u of a row was read one sample earlier.
//!
//! A run counts as flagged if its trace is not trustworthy and, for a single change, also if the change was declared;
//! both shares are printed. `--element` gives the controlled element, `--kinds` counts the findings.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::{collections::BTreeMap, env, f64::consts::TAU, fs, time::Instant};

use hoid_model::{
    Channel, Complex64, ContinuousTransferFunction, Record, SampleTime, Severity, VerdictLevel,
    scenario::{Condition, Scenario},
};
use hoid_sim::{
    RunSeed, Simulator,
    people::{Person, Plant, Population, RemnantKind, Task},
};
use hoid_track::{Method, TrackOptions, track};
use rayon::prelude::*;

const LENGTH_S: f64 = 82.0;
const RUN_IN_S: f64 = 15.0;
const RATE_HZ: usize = 100;
const STEPS_PER_SAMPLE: usize = 10;
const PRIMES: [f64; 11] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0];

/// The simulated operator, `K (T_L s + 1)/(T_I s + 1) e^{-tau s}` in series with the neuromuscular system; T_I = 0 for
/// none.
#[derive(Debug, Clone, Copy)]
struct Operator {
    k: f64,
    lead: f64,
    lag: f64,
    tau: f64,
    omega: f64,
    zeta: f64,
}

impl Operator {
    fn response(&self, w: f64) -> Complex64 {
        let s = Complex64::new(0.0, w);
        let muscles = self.omega * self.omega / (s * s + 2.0 * self.zeta * self.omega * s + self.omega * self.omega);
        self.k * (self.lead * s + 1.0) / (self.lag * s + 1.0) * (-self.tau * s).exp() * muscles
    }
}

/// The controlled element, as its denominator; the numerator is one.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Element {
    Gain,
    Integrator,
    LaggedIntegrator,
    DoubleIntegrator,
}

impl Element {
    fn denominator(self) -> &'static [f64] {
        match self {
            Self::Gain => &[1.0],
            Self::Integrator => &[1.0, 0.0],
            Self::LaggedIntegrator => &[1.0, 1.0, 0.0],
            Self::DoubleIntegrator => &[1.0, 0.0, 0.0],
        }
    }

    fn transfer_function(self) -> ContinuousTransferFunction {
        ContinuousTransferFunction::new(&[1.0], self.denominator()).unwrap()
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Lead,
    GainLike,
    Lag,
}

/// An operator with its remnant.
#[derive(Debug, Clone, Copy)]
struct SimulatedPerson {
    operator: Operator,
    element: Element,
    share: f64,
    remnant: usize,
}

fn simulated_person(kind: Kind, numbers: &[f64]) -> SimulatedPerson {
    let at = |i: usize, low: f64, high: f64| low + numbers[i] * (high - low);
    let element = match kind {
        Kind::Lead if numbers[0] < 0.5 => Element::DoubleIntegrator,
        Kind::Lead => Element::LaggedIntegrator,
        Kind::GainLike => Element::Integrator,
        Kind::Lag => Element::Gain,
    };
    let mut operator = Operator {
        k: 1.0,
        lead: if kind == Kind::Lead { at(1, 0.5, 1.5) } else { 0.0 },
        lag: if kind == Kind::Lag { at(1, 3.0, 10.0) } else { 0.0 },
        tau: at(2, 0.14, 0.26),
        omega: at(3, 9.0, 14.0),
        zeta: at(4, 0.2, 0.5),
    };
    let crossover = at(5, 1.5, 3.0);
    operator.k = 1.0 / (operator.response(crossover) * element.transfer_function().response(crossover)).norm();
    SimulatedPerson {
        operator,
        element,
        share: 0.05 * 6.0_f64.powf(numbers[6]),
        remnant: (3.0 * numbers[7]) as usize,
    }
}

/// Sines at primes of .05 Hz, with smaller amplitudes above 2 rad/s.
struct Forcing(Vec<[f64; 3]>);

impl Forcing {
    fn new(numbers: &[f64], of_target: bool) -> Self {
        let count = if of_target { 7 } else { PRIMES.len() };
        let sine = |(i, p): (usize, &f64)| {
            let w = TAU * 0.05 * p;
            [w, 1.0 / (1.0 + (w / 1.5).powi(2)), TAU * numbers[i]]
        };
        Self(PRIMES[..count].iter().enumerate().map(sine).collect())
    }

    fn at(&self, t: f64) -> f64 {
        self.0.iter().map(|[w, a, phase]| a * (w * t + phase).sin()).sum()
    }
}

/// Simulates a loop and returns e and u; `None` if the loop is unbounded.
fn simulate(
    person: &SimulatedPerson,
    forcing: &Forcing,
    normals: &[f64],
    level: f64,
    at: &dyn Fn(f64) -> Operator,
) -> Option<[Vec<f64>; 2]> {
    let h = 1.0 / (RATE_HZ * STEPS_PER_SAMPLE) as f64;
    let count = ((RUN_IN_S + LENGTH_S) * RATE_HZ as f64) as usize;
    let mut past = vec![0.0; count * STEPS_PER_SAMPLE + 1];
    let (mut lagged, mut z, mut dz, mut y, mut dy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut n, mut running) = (0.0, 0.0_f64);
    let time_constant = 0.1;
    let (pole, drive) = {
        let pole = (-1.0 / (RATE_HZ as f64 * time_constant)).exp();
        (pole, (1.0 - pole * pole).sqrt())
    };
    let (mut e_all, mut u_all) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for k in 0..count {
        let w = normals[k];
        n = match person.remnant {
            // Running rms of u over a second.
            1 => pole * n + drive * w * (0.45 + 0.89 * running.sqrt().min(3.0)),
            // Two pulses per second.
            2 => {
                let pulse = if normals[count + k].abs() > 2.326 { w * 7.0 } else { 0.0 };
                pole * n + drive * (0.45 * w + 0.89 * pulse)
            }
            _ => pole * n + drive * w,
        };
        let mut u = 0.0;
        for j in 0..STEPS_PER_SAMPLE {
            let step = k * STEPS_PER_SAMPLE + j;
            let t = step as f64 * h - RUN_IN_S;
            let operator_now = at(t);
            let f = forcing.at(t);
            u = operator_now.k * (z + operator_now.lead * dz) + level * n;
            let position = if person.element == Element::Gain { u } else { y };
            let e = if person.element == Element::Gain {
                f - position
            } else {
                -position
            };
            past[step] = e;
            if j == 0 {
                e_all.push(e);
                u_all.push(u);
            }
            let ago = (operator_now.tau / h).round() as usize;
            let seen = step.checked_sub(ago).map_or(0.0, |s| past[s]);
            let seen = if operator_now.lag > 0.0 {
                lagged += h * (seen - lagged) / operator_now.lag;
                lagged
            } else {
                seen
            };
            let (omega, zeta) = (operator_now.omega, operator_now.zeta);
            dz += h * (omega * omega * (seen - z) - 2.0 * zeta * omega * dz);
            z += h * dz;
            match person.element {
                Element::Gain => {}
                Element::Integrator => y += h * (u + f),
                Element::LaggedIntegrator => {
                    dy += h * (u + f - dy);
                    y += h * dy;
                }
                Element::DoubleIntegrator => {
                    dy += h * (u + f);
                    y += h * dy;
                }
            }
        }
        running += (u * u / (level / person.share.sqrt().max(1e-9)).powi(2).max(1e-9) - running) / RATE_HZ as f64;
        if !(y.abs() < 1e3 && u.abs() < 1e4) {
            return None;
        }
    }
    let from = (RUN_IN_S * RATE_HZ as f64) as usize;
    Some([e_all[from..].to_vec(), u_all[from..].to_vec()])
}

/// Returns uniform numbers in `[0, 1)` from a stream (G. L. Steele, D. Lea and C. H. Flood, OOPSLA 2014: splitmix64).
fn uniform(of: [u64; 4], n: usize) -> Vec<f64> {
    let mixed = |mut x: u64| {
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    let start = of.into_iter().fold(0, |state: u64, x| {
        mixed(state.wrapping_add(x).wrapping_add(0x9e37_79b9_7f4a_7c15))
    });
    let at = |k: usize| mixed(start.wrapping_add((k as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    (0..n).map(|k| (at(k) >> 11) as f64 / (1_u64 << 53) as f64).collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Modification of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Modification {
    Clean,
    Sign,
    TwoPeople,
    Oscillating,
    Halved,
    Drifting,
    Late,
    OtherRun,
    OtherTask,
}

impl Modification {
    const ALL: [Self; 9] = [
        Self::Clean,
        Self::Sign,
        Self::TwoPeople,
        Self::Oscillating,
        Self::Halved,
        Self::Drifting,
        Self::Late,
        Self::OtherRun,
        Self::OtherTask,
    ];

    fn words(self) -> &'static str {
        match self {
            Self::Clean => "clean",
            Self::Sign => "sign of e turned over",
            Self::TwoPeople => "two people, 15 s each in turn",
            Self::Oscillating => "gain sways +-25 %, period 10 to 30 s",
            Self::Halved => "K halved and +.1 s at 45 s",
            Self::Drifting => "gain drifts to 55 % in 60 s",
            Self::Late => "delay +.1 s at 45 s",
            Self::OtherRun => "u of another run, same forcing",
            Self::OtherTask => "u of another run, other phases",
        }
    }

    fn has_single_change(self) -> bool {
        matches!(self, Self::Halved | Self::Late)
    }
}

/// Simulates a run of a kind of operator with a modification.
fn run(kind: Kind, modification: Modification, seed: u64, number: u64) -> Option<(Record, Element)> {
    let stream = |of: u64, n: usize| uniform([seed, kind as u64, number, of], n);
    let numbers = stream(0, 4000);
    let samples = ((RUN_IN_S + LENGTH_S) * RATE_HZ as f64) as usize;
    let normals = |of: u64| {
        let pairs = stream(of, 4 * samples);
        let normal = |p: &[f64]| (-2.0 * (1.0 - p[0]).ln()).sqrt() * (TAU * p[1]).cos();
        pairs.chunks_exact(2).map(normal).collect::<Vec<f64>>()
    };
    for draw in numbers.chunks_exact(80) {
        let person = simulated_person(kind, draw);
        let mut second = simulated_person(kind, &[&draw[..1], &draw[21..40]].concat());
        second.element = person.element;
        let (one, two) = (person.operator, second.operator);
        // Two similar operators count as one.
        if modification == Modification::TwoPeople && (one.response(2.0) / two.response(2.0) - 1.0).norm() < 0.25 {
            continue;
        }
        let period = 10.0 + 20.0 * draw[60];
        let at = move |t: f64| match modification {
            Modification::TwoPeople if (t / 15.0).floor().rem_euclid(2.0) == 1.0 => two,
            Modification::Oscillating => Operator {
                k: one.k * (1.0 + 0.25 * (TAU * t / period).sin()),
                ..one
            },
            Modification::Halved if t >= 45.0 => Operator {
                k: 0.5 * one.k,
                tau: one.tau + 0.1,
                ..one
            },
            Modification::Late if t >= 45.0 => Operator {
                tau: one.tau + 0.1,
                ..one
            },
            Modification::Drifting => Operator {
                k: one.k * (1.0 - 0.45 * ((t - 11.0) / 60.0).clamp(0.0, 1.0)),
                ..one
            },
            _ => one,
        };
        let of_target = person.element != Element::Integrator;
        let forcing = Forcing::new(&draw[40..60], of_target);
        let silent = vec![0.0; 2 * samples];
        let Some([_, u]) = simulate(&person, &forcing, &silent, 0.0, &at) else {
            continue;
        };
        let level = rms(&u) * person.share.sqrt();
        let Some([e, mut u]) = simulate(&person, &forcing, &normals(1), level, &at) else {
            continue;
        };
        // A loop at its stability limit is not realistic.
        if rms(&u) * person.share.sqrt() > 1.8 * level {
            continue;
        }
        if matches!(modification, Modification::OtherRun | Modification::OtherTask) {
            let forcing = match modification {
                Modification::OtherTask => Forcing::new(&draw[20..40], of_target),
                _ => forcing,
            };
            u = simulate(&person, &forcing, &normals(2), level, &at)?[1].clone();
        }
        let sign = if modification == Modification::Sign { -1.0 } else { 1.0 };
        let e = e.into_iter().map(|e| sign * e).collect();
        let channel = |name: &str, values: Vec<f64>| Channel::new(name, "", values);
        let record = Record::new(SampleTime::AT_100_HZ, channel("e", e), channel("u", u)).unwrap();
        return Some((record, person.element));
    }
    None
}

/// Verdict on a run.
struct RunVerdict {
    what: String,
    level: VerdictLevel,
    declared: bool,
    kinds: Vec<&'static str>,
    seconds: f64,
}

fn run_verdict(
    what: String,
    record: &Record,
    element: Option<ContinuousTransferFunction>,
    method: &Method,
    once: bool,
) -> RunVerdict {
    let options = TrackOptions {
        controlled_element: element,
        ..TrackOptions::without_prior(method.clone(), record.sample_time())
    };
    let trace = track(record, &options, 10).unwrap();
    let from = Instant::now();
    let verdict = trace.verdict(record, None).unwrap();
    let seconds = from.elapsed().as_secs_f64();
    let near = |t: f64| (t - 45.0).abs() < 15.0;
    let findings = verdict.findings().iter();
    RunVerdict {
        what,
        level: verdict.level,
        declared: once && trace.changes().iter().any(|(t, change)| near(t - change.seconds_ago)),
        kinds: findings
            .filter(|f| f.severity > Severity::Note)
            .map(|f| f.kind)
            .collect(),
        seconds,
    }
}

/// Returns the recordings of a folder, each with its name and its record from 5 s on.
fn recordings(folder: &str) -> Vec<(String, Record)> {
    let files = fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
    let mut files: Vec<_> = files
        .filter(|path| path.extension().is_some_and(|e| e == "csv"))
        .collect();
    files.sort();
    let of = |path: &std::path::PathBuf| {
        let text = fs::read_to_string(path).unwrap();
        let mut lines = text.lines();
        let header: Vec<&str> = lines.next()?.split(',').collect();
        let index = |name: &str| header.iter().position(|h| *h == name);
        let (t, u) = (index("t")?, index("u")?);
        let (e, r, y) = (index("e"), index("r"), index("y"));
        let rows: Vec<Vec<f64>> = lines
            .map(|line| line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect())
            .collect();
        let error = |row: &Vec<f64>| e.map_or_else(|| row[r.unwrap()] - row[y.unwrap()], |e| row[e]);
        let later = usize::from(e.is_none());
        let ts = (rows[rows.len() - 1][t] - rows[0][t]) / (rows.len() - 1) as f64;
        let from = (5.0 / ts) as usize;
        let errors = rows[from..rows.len() - later].iter().map(error).collect();
        let controls = rows[from + later..].iter().map(|row| row[u]).collect();
        let channel = |name: &str, values: Vec<f64>| Channel::new(name, "", values);
        let record = Record::new(SampleTime::new(ts).ok()?, channel("e", errors), channel("u", controls)).ok()?;
        Some((path.file_stem()?.to_string_lossy().into_owned(), record))
    };
    files.iter().filter_map(of).collect()
}

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let text = |name: &str| {
        let at = arguments.iter().position(|a| a == name)?;
        arguments.get(at + 1).cloned()
    };
    let number = |name: &str, default: u64| text(name).map_or(default, |text| text.parse().unwrap());
    let (runs, seed) = (number("--runs", 20), number("--seed", 9000));
    let is = |name: &str| arguments.iter().any(|a| a == name);
    let method = text("--method").map_or(Method::adaptive(), |name| hoid_survey::method(&name).unwrap());
    let (named, kinds) = (is("--element"), is("--kinds"));
    let only = text("--only");
    let mut asked: Vec<(Kind, Modification, u64)> = Vec::new();
    for modification in Modification::ALL {
        for kind in [Kind::Lead, Kind::GainLike, Kind::Lag] {
            asked.extend((0..runs).map(|run| (kind, modification, run)));
        }
    }
    asked.retain(|(_, modification, _)| {
        only.as_ref()
            .is_none_or(|only| modification.words().starts_with(only.as_str()))
    });
    let folder = env::var("HOID_HUMAN_DATA").ok();
    if folder.is_some() {
        asked.clear();
    }
    let mut all: Vec<RunVerdict> = asked
        .into_par_iter()
        .filter_map(|(kind, modification, number)| {
            let (record, element) = run(kind, modification, seed, number)?;
            let what = format!("{}|{kind:?}", modification.words());
            let element = named.then(|| element.transfer_function());
            Some(run_verdict(
                what,
                &record,
                element,
                &method,
                modification.has_single_change(),
            ))
        })
        .collect();
    if let Some(folder) = &folder {
        let all_of = recordings(folder);
        let of_people = all_of.par_iter().map(|(name, record)| {
            // Recordings are grouped by the second and third parts of their names, without numbers.
            let group: Vec<&str> = name
                .split('_')
                .skip(1)
                .take(2)
                .filter(|part| part.parse::<u32>().is_err())
                .collect();
            run_verdict(
                format!("recorded people|{}", group.join(" ")),
                record,
                None,
                &method,
                false,
            )
        });
        all.extend(of_people.collect::<Vec<RunVerdict>>());
    }
    let simulates = |what: &str| folder.is_none() && only.as_deref().is_none_or(|only| only == what);
    if simulates("people") {
        let task = Task {
            sample_time: SampleTime::AT_100_HZ,
            measurement_s: LENGTH_S,
            run_in_s: RUN_IN_S,
            ..Task::default()
        };
        let mut people: Vec<(RemnantKind, Plant, u64)> = Vec::new();
        for kind in RemnantKind::ALL {
            for plant in Plant::ALL {
                people.extend((0..runs.div_ceil(5)).map(|run| (kind, plant, run)));
            }
        }
        let of_people = people.into_par_iter().filter_map(|(kind, plant, number)| {
            let person = Person::draw(&Population::default(), &task, plant, None, kind, seed, number).ok()?;
            let record = person.run(0).ok()?.record;
            let channel = |name: &str, values: &[f64]| Channel::new(name, "", values.to_vec());
            let record = Record::new(
                record.sample_time(),
                channel("e", record.input()),
                channel("u", record.output()),
            )
            .unwrap();
            let element = named.then(|| plant.transfer_function().unwrap());
            Some(run_verdict(
                format!("clean, virtual people|{kind}"),
                &record,
                element,
                &method,
                false,
            ))
        });
        all.extend(of_people.collect::<Vec<RunVerdict>>());
    }
    if simulates("text") {
        let conditions: Vec<(Condition, u64)> = Condition::ALL
            .into_iter()
            .flat_map(|condition| (0..runs).map(move |run| (condition, run)))
            .collect();
        let of_text = conditions.into_par_iter().map(|(condition, replication)| {
            let streams = RunSeed {
                seed,
                replication,
                ..RunSeed::default()
            };
            let record = Simulator::new(&Scenario::condition(condition))
                .unwrap()
                .run(streams, false)
                .unwrap();
            let what = format!("clean, the text's conditions|{condition}");
            run_verdict(what, &record, None, &method, false)
        });
        all.extend(of_text.collect::<Vec<RunVerdict>>());
    }
    println!(
        "{:40}{:>16}{:>6}{:>10}{:>10}{:>10}",
        "", "", "runs", "doubted", "declared", "flagged"
    );
    let mut table: BTreeMap<&str, Vec<&RunVerdict>> = BTreeMap::new();
    for said in &all {
        table.entry(&said.what).or_default().push(said);
    }
    for (what, said) in table {
        let share = |is: &dyn Fn(&RunVerdict) -> bool| 100 * said.iter().filter(|s| is(s)).count() / said.len();
        let doubted = |s: &RunVerdict| s.level != VerdictLevel::Trustworthy;
        let (words, kind) = what.split_once('|').unwrap();
        println!(
            "{words:40}{kind:>16}{:6}{:>8} %{:>8} %{:>8} %",
            said.len(),
            share(&doubted),
            share(&|s| s.declared),
            share(&|s| doubted(s) || s.declared),
        );
        if kinds {
            let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
            for kind in said.iter().flat_map(|s| s.kinds.iter().copied()) {
                *counts.entry(kind).or_default() += 1;
            }
            println!("    {counts:?}");
        }
    }
    let slowest = all.iter().map(|s| s.seconds).fold(0.0, f64::max);
    println!("slowest verdict {slowest:.2} s");
}
