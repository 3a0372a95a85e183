//! Tests with faults injected into simulated runs, and with runs without faults.

use hoid_model::{
    Channel, Fault, FaultAction, FaultHandling, FaultKind, Record, SampleTime, Severity,
    scenario::{Condition, Scenario},
};
use hoid_sim::{
    RunSeed, Simulator,
    people::{Person, Plant, Population, RemnantKind, Task},
};

use super::{RepairedRecord, repair};

fn run(condition: Condition, seed: u64) -> Record {
    let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
    let seed = RunSeed {
        seed,
        ..RunSeed::default()
    };
    simulator.run(seed, false).unwrap()
}

/// Returns the record with changed signals.
fn with_signals(record: &Record, change: impl FnOnce(&mut Vec<f64>, &mut Vec<f64>)) -> Record {
    let (mut e, mut u) = (record.input().to_vec(), record.output().to_vec());
    change(&mut e, &mut u);
    Record::new(record.sample_time(), Channel::new("e", "", e), Channel::new("u", "", u)).unwrap()
}

fn repair_by_bridging(record: &Record) -> RepairedRecord {
    repair(record, FaultHandling::Bridge).unwrap()
}

fn fault_kinds(found: &[Fault]) -> Vec<FaultKind> {
    found.iter().map(|f| f.kind).collect()
}

#[test]
fn clean_runs_have_no_faults_and_are_unchanged() {
    for condition in Condition::ALL {
        let record = run(condition, 17);
        let found = repair_by_bridging(&record);
        assert!(
            found.faults.is_empty() && found.findings.is_empty(),
            "{condition:?} {:?}",
            found.faults
        );
        assert_eq!(found.segments.len(), 1);
        assert_eq!(found.segments[0].output(), record.output());
    }
    let (population, task) = (Population::default(), Task::default());
    for (k, remnant) in RemnantKind::ALL.into_iter().enumerate() {
        for plant in Plant::ALL {
            let person = Person::draw(&population, &task, plant, None, remnant, 40 + k as u64, 0).unwrap();
            let record = person.run(1).unwrap().record;
            assert!(
                repair_by_bridging(&record).faults.is_empty(),
                "{remnant} {plant:?} {:?}",
                repair_by_bridging(&record).faults
            );
        }
    }
}

#[test]
fn short_bursts_of_any_sign_are_found() {
    for signs in [&[-1.0, 1.0][..], &[1.0, 1.0], &[1.0, -1.0, 1.0, 1.0, -1.0], &[1.0; 8]] {
        for place in [490, 4000] {
            let clean = run(Condition::C1, 5);
            let record = with_signals(&clean, |e, _| {
                (0..signs.len()).for_each(|k| e[place + k] += 7.0 * signs[k]);
            });
            let found = repair_by_bridging(&record);
            assert_eq!(fault_kinds(&found.faults), [FaultKind::Spike], "{signs:?} {place}");
            let fault = &found.faults[0];
            let first = (fault.from_s - record.time_s(place)) / record.sample_time().s();
            assert!(first.abs() < 1.5 && fault.samples <= signs.len() + 2, "{fault}");
            let off = found.segments[0].input()[place] - clean.input()[place];
            assert!(off.abs() < 0.2, "{off}");
        }
    }
}

#[test]
fn spike_of_the_error_is_found_and_bridged() {
    for (condition, place) in [(Condition::C1, 4000), (Condition::C3, 700), (Condition::C6, 7000)] {
        let clean = run(condition, 5);
        let record = with_signals(&clean, |e, _| e[place] = 30.0);
        let found = repair_by_bridging(&record);
        assert_eq!(fault_kinds(&found.faults), [FaultKind::Spike], "{:?}", found.faults);
        let fault = &found.faults[0];
        assert_eq!((fault.channel.as_str(), fault.action), ("e", FaultAction::Bridged));
        assert_eq!(fault.from_s, record.time_s(place));
        assert!((fault.size - (30.0 - clean.input()[place])).abs() < 0.1, "{fault}");
        assert!((found.segments[0].input()[place] - clean.input()[place]).abs() < 0.05);
        assert_eq!(found.findings[0].severity, Severity::Note);
        // The faults are reported and not repaired.
        let reported = repair(&record, FaultHandling::Report).unwrap();
        assert_eq!(reported.segments[0].input(), record.input());
        assert_eq!(reported.findings[0].severity, Severity::Doubt);
        assert!(repair(&record, FaultHandling::Keep).unwrap().faults.is_empty());
        let cut = repair(&record, FaultHandling::Cut).unwrap();
        assert_eq!((cut.segments.len(), cut.faults[0].action), (2, FaultAction::Cut));
        assert_eq!(cut.segments[1].time_s(0), record.time_s(place + 1));
    }
}

#[test]
fn spike_of_the_output_is_found() {
    let clean = run(Condition::C1, 9);
    let deviation = (clean.output().iter().map(|u| u * u).sum::<f64>() / clean.len() as f64).sqrt();
    let found = repair_by_bridging(&with_signals(&clean, |_, u| u[3000] += 10.0 * deviation));
    assert_eq!(fault_kinds(&found.faults), [FaultKind::Spike], "{:?}", found.faults);
    assert_eq!(found.faults[0].channel, "u");
}

#[test]
fn idle_span_before_a_run_is_cut() {
    let clean = run(Condition::C1, 3);
    let record = with_signals(&clean, |e, u| {
        e.splice(0..0, vec![0.0; 1500]);
        u.splice(0..0, vec![0.0; 1500]);
    });
    let found = repair_by_bridging(&record);
    assert_eq!(fault_kinds(&found.faults), [FaultKind::Idle], "{:?}", found.faults);
    assert_eq!((found.faults[0].action, found.segments.len()), (FaultAction::Cut, 1));
    assert!((found.segments[0].time_s(0) - 15.0).abs() < 0.1);
    assert_eq!(found.findings[0].severity, Severity::Note);
}

#[test]
fn frozen_output_scale_change_and_step_cut_the_record() {
    let clean = run(Condition::C1, 4);
    let frozen = repair_by_bridging(&with_signals(&clean, |_, u| {
        let held = u[2000];
        u[2000..2400].fill(held);
    }));
    assert_eq!(fault_kinds(&frozen.faults), [FaultKind::Frozen], "{:?}", frozen.faults);
    assert_eq!((frozen.faults[0].samples, frozen.segments.len()), (400, 2));
    let scaled = repair_by_bridging(&with_signals(&clean, |e, u| {
        e[1000..3000].iter_mut().for_each(|v| *v *= 1e6);
        u[1000..3000].iter_mut().for_each(|v| *v *= 1e6);
    }));
    assert!(
        fault_kinds(&scaled.faults).iter().all(|k| *k == FaultKind::Scale),
        "{:?}",
        scaled.faults
    );
    let largest = |r: &Record| r.input().iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    assert!(scaled.segments.iter().all(|r| largest(r) < 100.0));
    let stepped = repair_by_bridging(&with_signals(&clean, |e, _| {
        e[4000..].iter_mut().for_each(|v| *v += 40.0)
    }));
    assert_eq!(fault_kinds(&stepped.faults), [FaultKind::Step], "{:?}", stepped.faults);
    assert_eq!(stepped.segments.iter().map(Record::len).sum::<usize>(), clean.len());
}

#[test]
fn time_in_milliseconds_is_not_determined() {
    let clean = run(Condition::C1, 6);
    let record = Record::new(
        SampleTime::new(10.0).unwrap(),
        Channel::new("e", "", clean.input().to_vec()),
        Channel::new("u", "", clean.output().to_vec()),
    )
    .unwrap();
    let found = repair_by_bridging(&record);
    assert_eq!(fault_kinds(&found.faults), [FaultKind::TimeUnit]);
    // A wait of 50 samples is not reported as an idle stretch of 500 s.
    let waits = with_signals(&record, |e, u| {
        e[400..450].fill(0.0);
        u[400..450].fill(0.0);
    });
    assert_eq!(fault_kinds(&repair_by_bridging(&waits).faults), [FaultKind::TimeUnit]);
    assert_eq!(found.findings[0].severity, Severity::Undetermined);
}

#[test]
fn unusable_record_is_undetermined() {
    let ts = SampleTime::new(0.01).unwrap();
    let active = |t: usize| t % 300 < 100;
    let bursts = |seed| -> Vec<f64> {
        let all = super::test_signals::autoregressive_signal(3000, seed);
        all.iter()
            .enumerate()
            .map(|(t, v)| if active(t) { *v } else { 0.0 })
            .collect()
    };
    let record = Record::new(ts, Channel::new("e", "", bursts(3)), Channel::new("u", "", bursts(4))).unwrap();
    let found = repair_by_bridging(&record);
    assert_eq!(found.findings[0].severity, Severity::Doubt, "{:?}", found.findings);
    assert_eq!(
        found.findings.last().unwrap().severity,
        Severity::Undetermined,
        "{:?}",
        found.findings
    );
    assert_eq!(found.segments[0].output(), record.output());
}

#[test]
fn output_only_and_short_records_are_accepted() {
    let ts = SampleTime::new(0.01).unwrap();
    let mut u = super::test_signals::autoregressive_signal(3000, 3);
    u[1000] += 50.0;
    let record = Record::from_output(ts, Channel::new("u", "", u)).unwrap();
    assert_eq!(fault_kinds(&repair_by_bridging(&record).faults), [FaultKind::Spike]);
    let short = Record::from_output(ts, Channel::new("u", "", vec![1.0, 5.0, 2.0])).unwrap();
    assert!(repair_by_bridging(&short).faults.is_empty());
}

#[test]
fn exchanged_channels_and_wrong_sign_are_found() {
    let exchanged = |r: &Record| with_signals(r, std::mem::swap);
    let turned = |r: &Record| with_signals(r, |_, u| u.iter_mut().for_each(|v| *v = -*v));
    let (population, task) = (Population::default(), Task::default());
    let people = Plant::ALL.map(|plant| {
        let person = Person::draw(&population, &task, plant, None, RemnantKind::BroadBand, 7, 0).unwrap();
        person.run(1).unwrap().record
    });
    let runs = [Condition::C1, Condition::C2].map(|c| run(c, 8));
    for record in runs.iter().chain(&people) {
        assert_eq!(
            fault_kinds(&repair_by_bridging(&exchanged(record)).faults),
            [FaultKind::Exchanged]
        );
        let found = repair_by_bridging(&turned(record));
        assert_eq!(fault_kinds(&found.faults), [FaultKind::Sign]);
        assert_eq!(found.findings[0].severity, Severity::Doubt);
    }
}

#[test]
fn only_a_faulty_excitation_is_bridged() {
    for condition in [Condition::C1, Condition::C2, Condition::C4] {
        let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
        let record = simulator.run(RunSeed::default(), false).unwrap();
        assert!(record.channel("f_t").is_some());
        let clean = repair(&record, FaultHandling::Bridge).unwrap();
        assert!(clean.faults.is_empty(), "{condition:?}: {:?}", clean.faults);
        let (input, output, others) = record.clone().into_channels();
        let mut spoilt = Record::new(record.sample_time(), input.unwrap(), output).unwrap();
        for mut channel in others {
            if channel.name == "f_t" {
                channel.values[3000] += 5.0;
            }
            spoilt = spoilt.with_channel(channel).unwrap();
        }
        let found = repair(&spoilt, FaultHandling::Bridge).unwrap();
        assert_eq!((found.faults.len(), found.faults[0].channel.as_str()), (1, "f_t"));
        let (repaired, truth) = (
            found.segments[0].channel("f_t").unwrap(),
            record.channel("f_t").unwrap(),
        );
        assert!(
            (repaired[3000] - truth[3000]).abs() < 0.05,
            "{} {}",
            repaired[3000],
            truth[3000]
        );
        assert_eq!(repair(&spoilt, FaultHandling::Report).unwrap().segments[0], spoilt);
    }
}
