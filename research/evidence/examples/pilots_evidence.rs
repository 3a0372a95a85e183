//! Tracking of pilots who adapt during the recording (P. M. T. Zaal, *J. Guidance, Control, and Dynamics* 39 (2016),
//! doi 10.2514/1.G001592), by each method.
//!
//! `HOID_PILOT_DATA=DIR cargo run --release -p hoid-evidence --example pilots_evidence -- [RUNS|all] [METHOD...]`
//!
//! The folder contains the recordings `A1_C1_pitch_1.parquet` (t, e, u at 100 Hz) and `reference_h.csv`: the logarithm
//! of the gain and the phase of each cell at three frequencies before and after 50 s, from Fourier coefficients over
//! its six runs. The error of H is `sqrt(mean((ln |H|/|H_ref|)^2 + (arg H/H_ref)^2))` over the frequencies. No method
//! gets prior information. Conditions C6 to C8 change at 50 s, and C3 to C5 change slowly about 50 s; C1 and C2, and
//! the axis that does not change, are constant. Alarms are counted from 20 s on if nothing changes, and otherwise
//! before the change. The bands are the shares of the 95 % intervals of the gain and of the phase that contain the
//! reference.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::{collections::BTreeMap, env, f64::consts::PI, fs, path::Path};

use hoid_evidence::pilots::{self, MEASUREMENT_START_S};
use hoid_track::{Sample, TrackOptions, Tracker};
use rayon::prelude::*;

const EVALUATION_OMEGA_RAD_S: [f64; 3] = [1.0, 2.5, 4.0];
const CHANGE_S: f64 = 50.0;
/// Times at which errors are evaluated, s.
const EVALUATION_TIMES_S: [f64; 3] = [45.0, 60.0, 70.0];
/// Times at which bands are evaluated, s after the change.
const BAND_TIMES_S: [f64; 6] = [-10.0, -5.0, 5.0, 10.0, 20.0, 39.0];
/// Time within which alarms belong to one event, s.
const EVENT_DURATION_S: f64 = 8.0;

type Response = [[f64; 2]; 3];
type References = BTreeMap<(String, String, String, String), Response>;

fn references(folder: &Path) -> References {
    let text = fs::read_to_string(folder.join("reference_h.csv")).unwrap();
    let mut all = References::new();
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let omega: f64 = cells[4].parse().unwrap();
        let index = EVALUATION_OMEGA_RAD_S.iter().position(|w| *w == omega).unwrap();
        let key = [0, 1, 2, 3].map(|i| cells[i].to_owned()).into();
        all.entry(key).or_insert([[0.0; 2]; 3])[index] = [5, 6].map(|i| cells[i].parse().unwrap());
    }
    all
}

fn wrap_phase(phase: f64) -> f64 {
    (phase + PI).rem_euclid(2.0 * PI) - PI
}

/// Returns the logarithm of the gain, and the phase, minus those of a reference.
fn deviation(h: [f64; 2], reference: [f64; 2]) -> [f64; 2] {
    [
        h[0].hypot(h[1]).ln() - reference[0],
        wrap_phase(h[1].atan2(h[0]) - reference[1]),
    ]
}

fn error(h: &[[f64; 2]; 3], reference: &Response) -> f64 {
    let squares = h.iter().zip(reference).map(|(h, r)| {
        let [gain, phase] = deviation(*h, *r);
        gain * gain + phase * phase
    });
    (squares.sum::<f64>() / 3.0).sqrt()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.filter(|v| !v.is_nan()).collect();
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[n / 2],
        n => 0.5 * (values[n / 2] + values[n / 2 - 1]),
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Constant,
    Gradual,
    Sudden,
}

fn kind(condition: &str, axis: &str) -> Kind {
    let changes = match condition {
        "C3" | "C6" => axis == "roll",
        "C4" | "C7" => axis == "pitch",
        "C5" | "C8" => true,
        _ => false,
    };
    match condition {
        _ if !changes => Kind::Constant,
        "C3" | "C4" | "C5" => Kind::Gradual,
        _ => Kind::Sudden,
    }
}

struct Run {
    kind: Kind,
    errors: [f64; 3],
    /// Share of the time in which the estimate is nearer to the operator with H2, before 50 s and from 65 s on.
    nearer: [f64; 2],
    /// Number of bands of the gain and of the phase that contain the reference.
    hold: [[f64; 2]; 6],
    alarms_s: Vec<f64>,
    changed_at_s: Vec<f64>,
    /// K_e, T_L, K_e_dot and tau_e before the change and at the end.
    operator: [[f64; 4]; 2],
    restarts: u64,
    /// Events of the guard, by kind.
    faults: BTreeMap<&'static str, usize>,
}

fn run(name: &str, folder: &Path, references: &References, method: &str) -> Run {
    let parts: Vec<&str> = name.split('_').collect();
    let (pilot, condition, axis) = (parts[0], parts[1], parts[2]);
    let of = |condition: &str, part: &str| {
        let key = [pilot, condition, axis, part].map(str::to_owned).into();
        references[&key]
    };
    let whole = |condition: &str| {
        let (pre, post) = (of(condition, "pre"), of(condition, "post"));
        [0, 1, 2].map(|i| [0, 1].map(|k| 0.5 * (pre[i][k] + post[i][k])))
    };
    let people = [whole("C1"), whole("C2")];
    let (record, first) = pilots::read(folder, name);
    let (name, setting) = method.split_once(':').map_or((method, None), |(m, s)| (m, Some(s)));
    let mut method = hoid_survey::method(name).unwrap();
    if let Some((key, value)) = setting.and_then(|s| s.split_once('=')) {
        method.set(key, value).unwrap();
    }
    let nk = record.sample_time().nk(0.2);
    let mut options = TrackOptions::default_for(method.clone(), nk);
    let thesis_settings = matches!(name, "rls" | "rpem");
    if thesis_settings {
        let mut settings = vec![("memory", "256"), ("covariance", "0.1"), ("limit", "inf")];
        settings.extend((name == "rpem").then_some(("stable", "noise")));
        options = options.with(&settings).unwrap();
    }
    let span = record.span(MEASUREMENT_START_S, MEASUREMENT_START_S + 27.3).unwrap();
    let starts = options.method.is_self_starting();
    let mut tracker = Tracker::new(&options, (!starts).then_some(&span), record.sample_time()).unwrap();
    let kind = kind(condition, axis);
    let mut run = Run {
        kind,
        errors: [f64::NAN; 3],
        nearer: [0.0; 2],
        hold: [[f64::NAN; 2]; 6],
        alarms_s: Vec::new(),
        changed_at_s: Vec::new(),
        operator: [[f64::NAN; 4]; 2],
        restarts: 0,
        faults: BTreeMap::new(),
    };
    let mut looked = [0.0; 2];
    for k in first..record.len() {
        let t = record.time_s(k);
        let sample = Sample {
            e: record.input()[k],
            u: record.output()[k],
            reference: None,
        };
        tracker.update(sample, true);
        if let Some(event) = tracker.event() {
            *run.faults.entry(event.kind.name()).or_default() += 1;
        }
        if let Some(change) = tracker.change() {
            run.alarms_s.push(t);
            run.changed_at_s.push(t - change.seconds_ago);
        }
        let is_at = |s: f64| (t - s).abs() < 0.004;
        if k % 10 != 0
            && !EVALUATION_TIMES_S.iter().any(|s| is_at(*s))
            && !BAND_TIMES_S.iter().any(|s| is_at(CHANGE_S + s))
        {
            continue;
        }
        let responses: Option<Vec<_>> = EVALUATION_OMEGA_RAD_S.iter().map(|w| tracker.response(*w)).collect();
        let Some(responses) = responses else { continue };
        let h = [0, 1, 2].map(|i| responses[i].value);
        for (i, at) in EVALUATION_TIMES_S.iter().enumerate() {
            if is_at(*at) {
                run.errors[i] = error(&h, &of(condition, if i == 0 { "pre" } else { "post" }));
            }
        }
        for (i, after) in BAND_TIMES_S.iter().enumerate() {
            if is_at(CHANGE_S + after) {
                let reference = of(condition, if *after < 0.0 { "pre" } else { "post" });
                let mut held = [0.0; 2];
                for (response, reference) in responses.iter().zip(reference) {
                    let [re, im] = response.value;
                    let size = re.hypot(im);
                    // Along the response and across it.
                    let along = [[re / size, im / size], [-im / size, re / size]];
                    let c = &response.covariance;
                    let d = deviation(response.value, reference);
                    for (part, a) in along.iter().enumerate() {
                        let v = a[0] * a[0] * c[0][0] + 2.0 * a[0] * a[1] * c[0][1] + a[1] * a[1] * c[1][1];
                        held[part] += f64::from(d[part].abs() <= 1.96 * v.max(0.0).sqrt() / size) / 3.0;
                    }
                }
                run.hold[i] = held;
            }
        }
        let which = match t {
            t if (20.0..CHANGE_S).contains(&t) => 0,
            t if t >= 65.0 => 1,
            _ => continue,
        };
        looked[which] += 1.0;
        run.nearer[which] += f64::from(u8::from(error(&h, &people[1]) < error(&h, &people[0])));
        if let Ok(operator) = tracker.operator() {
            let values = [operator.k_e, operator.t_l_s, operator.k_e_dot, operator.tau_e_s];
            run.operator[which] = values.map(|e| e.value);
        }
    }
    run.nearer = [run.nearer[0] / looked[0], run.nearer[1] / looked[1]];
    run.restarts = tracker.counts().restarts;
    run
}

/// Returns the number of alarms within a span; the alarms of one event are counted once.
fn alarms(run: &Run, from: f64, to: f64) -> usize {
    let mut last = f64::MIN;
    let mut count = 0;
    for t in run.alarms_s.iter().filter(|t| (from..to).contains(*t)) {
        count += usize::from(t - last > EVENT_DURATION_S);
        last = *t;
    }
    count
}

/// Formats the events of the guard, by kind, and the number of recordings with events.
fn guard_events(all: &[Run]) -> String {
    let mut kinds = BTreeMap::<&str, usize>::new();
    for (kind, count) in all.iter().flat_map(|r| &r.faults) {
        *kinds.entry(kind).or_default() += count;
    }
    let counts: Vec<String> = kinds.iter().map(|(kind, count)| format!("{kind} {count}")).collect();
    let recordings = all.iter().filter(|r| !r.faults.is_empty()).count();
    format!("{}; in {recordings}", counts.join(", "))
}

fn main() {
    let Some(folder) = pilots::folder() else { return };
    let folder = folder.as_path();
    let mut arguments = env::args().skip(1);
    let runs = arguments.next().unwrap_or_else(|| "all".to_owned());
    let mut methods: Vec<String> = arguments.collect();
    if methods.is_empty() {
        methods = ["adaptive", "multiple-model", "rls", "rpem"]
            .map(str::to_owned)
            .to_vec();
    }
    let references = references(folder);
    let names = pilots::recording_names(folder, &runs);
    println!(
        "| method | sudden: 5 s before, +10, +20 s | gradual | constant | nearer to H2 before, sudden, gradual | after | bands of \
         gain at -10, -5, +5, +10, +20, +39 s | of phase | alarms an hour | sudden found in 5, 10, 15 s | gradual | instant off, s | K_e, T_L, \
         K_e_dot, tau_e before; after | restarts | faults | of which, in recordings |"
    );
    println!("|{}", "---|".repeat(16));
    for method in &methods {
        let all: Vec<Run> = names.par_iter().map(|n| run(n, folder, &references, method)).collect();
        let of = |kind: Kind| all.iter().filter(move |r| r.kind == kind);
        let errors = |kind: Kind| {
            let of = |i: usize| format!("{:.3}", median(of(kind).map(|r| r.errors[i])));
            [0, 1, 2].map(of).join(" ")
        };
        let nearer = |i: usize| {
            let of = |kind: Kind| {
                let values: Vec<f64> = of(kind).map(|r| r.nearer[i]).collect();
                format!("{:.2}", values.iter().sum::<f64>() / values.len() as f64)
            };
            format!("{} {}", of(Kind::Sudden), of(Kind::Gradual))
        };
        let bands = |part: usize| {
            let of = |i: usize| {
                let held: Vec<f64> = all.iter().map(|r| r.hold[i][part]).filter(|h| !h.is_nan()).collect();
                format!("{:.2}", held.iter().sum::<f64>() / held.len() as f64)
            };
            [0, 1, 2, 3, 4, 5].map(of).join(" ")
        };
        let (mut count, mut hours) = (0, 0.0);
        for r in &all {
            let until = match r.kind {
                Kind::Constant => 90.0,
                Kind::Gradual => 44.0,
                Kind::Sudden => CHANGE_S,
            };
            count += alarms(r, 20.0, until);
            hours += (until - 20.0) / 3600.0;
        }
        let found = |kind: Kind| {
            let of = |within: f64| {
                let hits = of(kind).filter(|r| alarms(r, CHANGE_S, CHANGE_S + within) > 0).count();
                format!("{:.2}", hits as f64 / of(kind).count() as f64)
            };
            [5.0, 10.0, 15.0].map(of).join(" ")
        };
        let off = median(of(Kind::Sudden).filter_map(|r| {
            let hit = r
                .alarms_s
                .iter()
                .position(|t| (CHANGE_S..CHANGE_S + 15.0).contains(t))?;
            Some((r.changed_at_s[hit] - CHANGE_S).abs())
        }));
        let operator = |i: usize| {
            let of = |k: usize| format!("{:.3}", median(of(Kind::Sudden).map(|r| r.operator[i][k])));
            [0, 1, 2, 3].map(of).join(" ")
        };
        println!(
            "| {method} ({}) | {} | {} | {} | {} | {} | {} | {} | {:.1} | {} | {} | {off:.1} | {}; {} | {} | {} | {} |",
            all.len(),
            errors(Kind::Sudden),
            errors(Kind::Gradual),
            errors(Kind::Constant),
            nearer(0),
            nearer(1),
            bands(0),
            bands(1),
            count as f64 / hours,
            found(Kind::Sudden),
            found(Kind::Gradual),
            operator(0),
            operator(1),
            all.iter().map(|r| r.restarts).sum::<u64>(),
            all.iter().flat_map(|r| r.faults.values()).sum::<usize>(),
            guard_events(&all),
        );
    }
}
