use super::*;
use crate::table::Precision;

/// Pseudo-random numbers between -1 and 1, the same in every run.
struct RandomNumbers(u64);

impl RandomNumbers {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / 2.0_f64.powi(30) - 1.0
    }
}

const TS: f64 = 0.01;
const N: usize = 4000;

fn even_times() -> Vec<f64> {
    (0..N).map(|k| k as f64 * TS).collect()
}

/// Two smooth channels of different frequencies.
fn smooth_channels() -> [Vec<f64>; 2] {
    let wave = |omega: f64| {
        even_times()
            .iter()
            .map(|t| (omega * t).sin() + 0.3 * (2.7 * omega * t + 1.0).cos())
            .collect()
    };
    [wave(0.6), wave(1.9)]
}

fn issues_in(t: &[f64], e: &[f64], u: &[f64]) -> Vec<QualityIssue> {
    find_issues(&Signals {
        columns: vec![Signal { name: "e", values: e }, Signal { name: "u", values: u }],
        time: Some(Signal { name: "t", values: t }),
        ..Signals::default()
    })
}

fn issue_kinds(found: &[QualityIssue]) -> Vec<QualityIssueKind> {
    found.iter().map(|one| one.kind).collect()
}

#[test]
fn smooth_and_quiet_channels_have_no_faults() {
    let [e, u] = smooth_channels();
    assert_eq!(issues_in(&even_times(), &e, &u), []);
    // Slow values far from zero that are printed with few decimals are no problem.
    let printed = |values: &[f64]| {
        values
            .iter()
            .map(|v| (v * 1e4).round() / 1e4 + 50.0)
            .collect::<Vec<_>>()
    };
    assert_eq!(issues_in(&even_times(), &printed(&e), &printed(&u)), []);
    // A hand that rests for a third of the time is no problem.
    let mut resting = u.clone();
    let at = resting[1000];
    resting[1000..2300].fill(at);
    assert_eq!(issues_in(&even_times(), &e, &resting), []);
    // Times that are rounded when printed, or are in single precision, are no problem.
    let rounded: Vec<f64> = (0..N).map(|k| (k as f64 / 60.0 * 1e4).round() / 1e4).collect();
    let mut precision = Precision::default();
    precision.add("0.0167");
    let signals = Signals {
        time: Some(Signal {
            name: "t",
            values: &rounded,
        }),
        precision,
        ..Signals::default()
    };
    assert_eq!(find_issues(&signals), []);
    let single: Vec<f64> = (0..N).map(|k| f64::from((k as f64 * TS) as f32)).collect();
    assert_eq!(issues_in(&single, &e, &u), []);
}

#[test]
fn gaps_are_found_despite_large_jitter() {
    let mut any = RandomNumbers(3);
    let mut t: Vec<f64> = even_times().iter().map(|t| t + 0.45 * TS * any.next()).collect();
    let [mut e, mut u] = smooth_channels();
    // The rows are removed from the end, so that the remaining row numbers stay valid.
    for (row, missing) in [(3000, 1), (2000, 7), (1000, 1), (500, 150)] {
        for column in [&mut t, &mut e, &mut u] {
            column.drain(row..row + missing);
        }
    }
    let found = issues_in(&t, &e, &u);
    assert_eq!(issue_kinds(&found), [QualityIssueKind::Gap, QualityIssueKind::Jitter]);
    let places: Vec<(usize, usize)> = found[0].row_spans.iter().map(|place| (place.row, place.rows)).collect();
    assert_eq!(places, [(500, 150), (850, 1), (1849, 7), (2842, 1)]);
    assert_eq!(found[0].rows, 159);
    // The jitter is uniform within 0.45 of a sample, so its RMS value is 0.45 / sqrt 3 samples.
    assert!(
        (found[1].size / (0.45 * TS / 3_f64.sqrt()) - 1.0).abs() < 0.05,
        "{}",
        found[1]
    );
}

#[test]
fn stalls_and_repeated_rows_are_found() {
    let [mut e, mut u] = smooth_channels();
    let (held_e, held_u) = (e[700], u[700]);
    e[700..792].fill(held_e);
    u[700..792].fill(held_u);
    let found = issues_in(&even_times(), &e, &u);
    assert_eq!(issue_kinds(&found), [QualityIssueKind::Stalled]);
    let place = found[0].row_spans[0];
    assert_eq!((found[0].row_spans.len(), place.row, place.rows), (1, 702, 91));
    assert!((found[0].size - 0.91).abs() < 1e-9);
    // Quantised channels also hold their values, but a stall lasts longer.
    let steps = |values: &[f64]| values.iter().map(|v| (v * 20.0).round() / 20.0).collect::<Vec<_>>();
    let coarse = issues_in(&even_times(), &steps(&e), &steps(&u));
    let stalls: Vec<&QualityIssue> = coarse
        .iter()
        .filter(|one| one.kind == QualityIssueKind::Stalled)
        .collect();
    assert!(
        stalls
            .iter()
            .all(|one| one.row_spans.iter().all(|place| (700..=792).contains(&place.row))),
        "{stalls:?}"
    );
    let [mut e, mut u] = smooth_channels();
    let mut t = even_times();
    for column in [&mut t, &mut e, &mut u] {
        for row in [2000, 10] {
            column.insert(row, column[row - 1]);
        }
    }
    let found = issues_in(&t, &e, &u);
    assert_eq!(issue_kinds(&found), [QualityIssueKind::Repeated]);
    assert_eq!(
        found[0].row_spans.iter().map(|place| place.row).collect::<Vec<_>>(),
        [11, 2002]
    );
    t[100] = t[20];
    assert!(issue_kinds(&issues_in(&t, &e, &u)).contains(&QualityIssueKind::Unordered));
}

#[test]
fn saturation_and_quantisation_are_found() {
    let [e, u] = smooth_channels();
    let clipped: Vec<f64> = u.iter().map(|v| v.clamp(-0.9, 1.0)).collect();
    let found = issues_in(&even_times(), &e, &clipped);
    assert_eq!(
        issue_kinds(&found),
        [QualityIssueKind::Saturated, QualityIssueKind::Saturated]
    );
    for (one, value) in found.iter().zip([-0.9, 1.0]) {
        assert_eq!(one.rows, clipped.iter().filter(|v| **v == value).count());
    }
    // Quantisation alone is not saturation, at any step size and phase.
    for levels in [8.0, 16.0, 31.0, 64.0, 256.0] {
        for phase in [0.0, 0.2, 0.5, 0.77] {
            let steps: Vec<f64> = u
                .iter()
                .map(|v| ((v * levels / 2.6 + phase).round() - phase) * 2.6 / levels)
                .collect();
            let found = issues_in(&even_times(), &e, &steps);
            assert!(
                issue_kinds(&found)
                    .iter()
                    .all(|kind| *kind == QualityIssueKind::Quantised),
                "{levels} {phase}: {found:?}"
            );
        }
    }
    let both: Vec<f64> = clipped.iter().map(|v| (v * 40.0).round() / 40.0).collect();
    let found = issues_in(&even_times(), &e, &both);
    assert_eq!(
        issue_kinds(&found),
        [
            QualityIssueKind::Saturated,
            QualityIssueKind::Saturated,
            QualityIssueKind::Quantised
        ]
    );
    assert!((found[2].size - 0.025).abs() < 1e-12);
}

#[test]
fn clock_errors_and_drift_are_found() {
    let [e, u] = smooth_channels();
    let slow: Vec<f64> = even_times().iter().map(|t| 0.998 * t).collect();
    let found = issues_in(&slow, &e, &u);
    assert_eq!(issue_kinds(&found), [QualityIssueKind::Clock]);
    assert!(
        (found[0].size - 0.002).abs() < 1e-4 && found[0].text.contains("slow by 0.2"),
        "{}",
        found[0]
    );
    let drifting: Vec<f64> = even_times().iter().map(|t| t + 5e-5 * t * t).collect();
    let found = issues_in(&drifting, &e, &u);
    // The rate changes by 1e-4 per second over 40 s; the centres of the first and the last third are 2/3 of this time
    // apart.
    let drift = found.iter().find(|one| one.kind == QualityIssueKind::Drift).unwrap();
    assert!((drift.size - 40.0 * 2.0 / 3.0 * 1e-4).abs() < 2e-4, "{}", drift.size);
    let t = even_times();
    let other: Vec<f64> = t.iter().map(|t| 7e5 + 1.001e3 * t).collect();
    let with = |nominal_hz| {
        find_issues(&Signals {
            columns: vec![Signal { name: "e", values: &e }, Signal { name: "u", values: &u }],
            time: Some(Signal { name: "t", values: &t }),
            clocks: vec![Signal {
                name: "time_ms",
                values: &other,
            }],
            nominal_hz,
            ..Signals::default()
        })
    };
    let found = with(None);
    assert_eq!(
        (issue_kinds(&found), found[0].channel.as_str()),
        (vec![QualityIssueKind::Clock], "time_ms")
    );
    assert!((found[0].size - 1e-3).abs() < 1e-9);
    assert_eq!(with(Some(99.9)).len(), 2);
}

#[test]
fn arbitrary_data_do_not_cause_a_panic() {
    let mut any = RandomNumbers(11);
    let odd = [
        f64::NAN,
        f64::INFINITY,
        -f64::INFINITY,
        f64::MAX,
        f64::MIN,
        5e-324,
        0.0,
        -0.0,
        1.0,
        1e300,
    ];
    for round in 0..3000 {
        let n = round % 41;
        let mut column = || -> Vec<f64> {
            let kind = (any.next() * 3.0) as i32;
            (0..n)
                .map(|k| match kind {
                    0 => k as f64 * TS + 0.3 * TS * any.next(),
                    1 => odd[(any.next().abs() * 10.0) as usize % 10],
                    _ if any.next() > 0.5 => odd[(any.next().abs() * 10.0) as usize % 10],
                    _ => (any.next() * 3.0).round(),
                })
                .collect()
        };
        let (t, e, u) = (column(), column(), column());
        for one in issues_in(&t, &e, &u) {
            assert!(!one.text.is_empty() && one.kind.remedy().len() > 5);
        }
    }
    let gone = vec![f64::NAN; 5];
    let found = issues_in(&gone, &gone, &gone);
    assert_eq!(
        issue_kinds(&found),
        [QualityIssueKind::Missing, QualityIssueKind::Missing]
    );
    assert_eq!(issues_in(&[], &[], &[]), []);
    assert_eq!(issues_in(&[0.0], &[1.0], &[1.0]), []);
}

/// In a recording of hours, all values are sorted only if values are repeated in the first rows. A later value of
/// another order of magnitude may leave fewer than eight levels.
#[test]
fn late_outlier_raises_no_issue() {
    let mut u: Vec<f64> = (0..(1 << 20) + 1000).map(|k| (0.37 * f64::from(k)).sin()).collect();
    u[(1 << 20) + 500] = 1e30;
    let channel = hoid_model::Channel::new("u", "", u);
    let record = hoid_model::Record::from_output(hoid_model::SampleTime::AT_100_HZ, channel).unwrap();
    assert!(issues_of_channels(&record).is_empty());
}
