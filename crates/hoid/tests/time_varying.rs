//! The fit of an operator who changes once: recovery without noise, bias, spread and coverage over simulated runs, and what is
//! said when nothing changes.
#![allow(clippy::unwrap_used)]

use hoid::{
    ident::{IdentError, NoiseLevel, Remark, TimeVarying, TimeVaryingFit},
    model::scenario::RemnantStrength,
    prelude::*,
};

const SPAN_S: f64 = 81.92;

fn runs(condition: Condition, n: u64) -> Vec<Record> {
    let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
    let stream = |replication| Stream {
        seed: 78,
        cell: 0,
        replication,
    };
    (0..n).map(|r| simulator.run(stream(r), false).unwrap()).collect()
}

fn without_noise(condition: Condition) -> Record {
    let mut scenario = Scenario::condition(condition);
    scenario.remnant.strength = RemnantStrength::Gain {
        initial: 0.0,
        last: 0.0,
    };
    Simulator::new(&scenario)
        .unwrap()
        .run(Stream::default(), false)
        .unwrap()
}

/// Name and true value of each parameter.
fn truth(condition: Condition) -> Vec<(&'static str, f64)> {
    let (s1, s2) = ([0.09, 0.4], [0.07, 1.2]);
    let (first, last) = match condition {
        Condition::C1 => (s1, s1),
        Condition::C2 => (s2, s2),
        Condition::C3 | Condition::C4 => (s1, s2),
        Condition::C5 | Condition::C6 => (s2, s1),
    };
    let rate = match condition {
        Condition::C3 | Condition::C5 => 0.5,
        _ => 100.0,
    };
    vec![
        ("K_e1", first[0]),
        ("K_e2", last[0]),
        ("T_L1", first[1]),
        ("T_L2", last[1]),
        ("t_M", SPAN_S / 2.0),
        ("G", rate),
        ("omega_nm", 11.25),
        ("zeta_nm", 0.35),
        ("tau_e", 0.28),
        ("d1", -(-0.01_f64 / 0.06).exp()),
    ]
}

fn value(fit: &TimeVaryingFit, name: &str) -> Estimate {
    fit.parameter(name).unwrap().estimate
}

#[test]
fn a_change_without_noise_is_recovered() {
    for condition in [Condition::C3, Condition::C4, Condition::C5, Condition::C6] {
        let record = without_noise(condition);
        let fit = TimeVarying::default().fit(std::slice::from_ref(&record)).unwrap();
        let worst = truth(condition)
            .into_iter()
            .filter(|(name, _)| *name != "d1")
            .map(|(name, true_value)| (value(&fit, name).value / true_value - 1.0).abs())
            .fold(0.0, f64::max);
        println!(
            "{condition}: largest relative error {worst:.1e}, loss {:.1e}, {:?}, {}",
            fit.loss(),
            fit.termination(),
            fit.start()
        );
    }
}

/// Numbers over the runs of one condition.
struct Study {
    rows: Vec<(String, f64, f64, f64, f64)>,
    converged: f64,
}

fn study(condition: Condition, n: u64, estimator: &TimeVarying) -> Study {
    let truth = truth(condition);
    let mut errors = vec![Vec::new(); truth.len()];
    let mut inside = vec![0; truth.len()];
    let mut with_error = vec![0; truth.len()];
    let mut se = vec![Vec::new(); truth.len()];
    let (mut converged, mut found) = (0, 0);
    let mut li = [0; 3];
    let mut widths = [vec![], vec![]];
    let t0 = std::time::Instant::now();
    for record in runs(condition, n) {
        let fit = estimator.fit(std::slice::from_ref(&record)).unwrap();
        converged += u64::from(fit.termination().converged());
        found += u64::from(fit.change_found());
        for (i, (name, true_value)) in truth.iter().enumerate() {
            let e = value(&fit, name);
            errors[i].push(e.value - true_value);
            if let Some(s) = e.standard_error {
                with_error[i] += 1;
                se[i].push(s);
                inside[i] += u64::from((e.value - true_value).abs() < 1.96 * s);
            }
        }
        if let (Some(m), Some(g)) = (fit.midpoint_interval(), fit.rate_interval()) {
            let within = |(l, h): (f64, f64), x: f64| u64::from(l <= x && x <= h);
            li[0] += within(m, truth[4].1);
            li[1] += within(g, truth[5].1);
            widths[0].push(m.1 - m.0);
            widths[1].push(g.0);
            li[2] += u64::from(fit.is_change_point());
        }
        if std::env::var("V").is_ok() {
            println!(
                "   t_M {:.3?} G {:.3?} tau {:.4?} {:?} {} [{}]",
                value(&fit, "t_M"),
                value(&fit, "G"),
                value(&fit, "tau_e").value,
                fit.termination(),
                fit.comparison().likelihood_ratio,
                fit.start()
            );
        }
    }
    println!(
        "{condition}: converged {converged}/{n}, change found {found}/{n}, {:?} per fit",
        t0.elapsed() / n as u32
    );
    for w in &mut widths {
        w.sort_by(f64::total_cmp);
    }
    println!(
        "  intervals: t_M {} G {} change points {} median width t_M {:?} low of G {:?}",
        li[0],
        li[1],
        li[2],
        widths[0].get(n as usize / 2),
        widths[1].get(n as usize / 2)
    );
    let mut rows = Vec::new();
    for (i, (name, true_value)) in truth.iter().enumerate() {
        let count = errors[i].len() as f64;
        let mean = errors[i].iter().sum::<f64>() / count;
        let spread = (errors[i].iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
        let mut s = se[i].clone();
        s.sort_by(f64::total_cmp);
        let median = s.get(s.len() / 2).copied().unwrap_or(f64::NAN);
        let coverage = f64::from(inside[i] as u32) / f64::from(with_error[i].max(1));
        println!(
            "  {name:9} true {true_value:9.4}  bias {mean:+.5} ({:+.2} s.e.)  spread {spread:.5}  median s.e. {median:.5}  covered {inside}/{}",
            mean / spread * count.sqrt(),
            with_error[i],
            inside = inside[i],
        );
        rows.push(((*name).to_owned(), mean, spread, median, coverage));
    }
    Study {
        rows,
        converged: converged as f64 / n as f64,
    }
}

#[test]
fn c3() {
    study(Condition::C3, 40, &TimeVarying::default());
}
#[test]
fn c4() {
    study(Condition::C4, 40, &TimeVarying::default());
}
#[test]
fn c5() {
    study(Condition::C5, 40, &TimeVarying::default());
}
#[test]
fn c6() {
    study(Condition::C6, 40, &TimeVarying::default());
}
#[test]
fn c1() {
    study(Condition::C1, 40, &TimeVarying::default());
}
