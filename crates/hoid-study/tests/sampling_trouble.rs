//! Simulated sampling defects are detected at the correct locations; without defects, none are reported.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use hoid_io::{
    Preparation, QualityIssue as Found, QualityIssueKind, ReadOptions, Repair, Step, read_prepared, read_record,
    read_segments,
};
use hoid_model::{Record, scenario::Condition};
use hoid_study::group::{SamplingDefect, VirtualExperiment, simulate_group};

fn experiment(trouble: &[SamplingDefect]) -> VirtualExperiment {
    VirtualExperiment {
        subjects: 1,
        conditions: vec![Condition::C1, Condition::C4],
        runs: 1,
        between_subjects: 0.1,
        between_runs: 0.03,
        remnant_order: 1,
        noise_level: 0.1,
        seed: 5,
        defects: trouble.to_vec(),
    }
}

/// Returns the sampling problems of each run, and the run without defects.
fn sampling_issues(trouble: &[SamplingDefect], options: &ReadOptions) -> Vec<(Vec<Found>, Record)> {
    let (clean, troubled) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    simulate_group(&experiment(&[]), clean.path(), &|| ()).unwrap();
    simulate_group(&experiment(trouble), troubled.path(), &|| ()).unwrap();
    ["S1_C1_1.csv", "S1_C4_1.csv"]
        .map(|name| {
            let read = |directory: &Path, options: &ReadOptions| read_record(&directory.join(name), options).unwrap();
            let whole = read(clean.path(), &ReadOptions::default());
            assert_eq!(whole.quality_issues, []);
            let preparation = Preparation {
                drop_repeated: true,
                ..Preparation::default()
            };
            let read = read_prepared(&troubled.path().join(name), options, &preparation).unwrap();
            (read.quality_issues, whole.record)
        })
        .into()
}

fn resampling_options() -> ReadOptions {
    ReadOptions {
        repair: Repair {
            resample: true,
            fill: false,
        },
        ..ReadOptions::default()
    }
}

fn assert_only(found: &[Found], kinds: &[QualityIssueKind]) {
    assert_eq!(found.iter().map(|one| one.kind).collect::<Vec<_>>(), kinds, "{found:?}");
}

#[test]
fn jitter_and_clock_errors_have_the_simulated_size() {
    for (found, _) in sampling_issues(&[SamplingDefect::Jitter], &resampling_options()) {
        assert_only(&found, &[QualityIssueKind::Jitter]);
        // Jitter of 0.2 of a sample, which is clamped at 2.25 standard deviations, has an RMS value of 0.194.
        assert!((found[0].size / 0.01 - 0.194).abs() < 0.006, "{}", found[0]);
    }
    for (found, _) in sampling_issues(&[SamplingDefect::SlowClock], &ReadOptions::default()) {
        assert_only(&found, &[QualityIssueKind::Clock]);
        assert!((found[0].size - (1.0 / 0.998 - 1.0)).abs() < 1e-6, "{}", found[0]);
    }
}

#[test]
fn missing_and_repeated_rows_are_counted_individually() {
    for trouble in [
        vec![SamplingDefect::Missing],
        vec![SamplingDefect::Missing, SamplingDefect::Jitter],
    ] {
        for (found, record) in sampling_issues(&trouble, &resampling_options()) {
            let gap = found.iter().find(|one| one.kind == QualityIssueKind::Gap).unwrap();
            // One in two hundred of 8192 rows is missing: 41 on average, with a standard deviation of 6.4.
            assert!((15..70).contains(&gap.rows) && gap.row_spans.len() <= gap.rows, "{gap}");
            let (first, last) = (record.time_s(0), record.time_s(record.len() - 1));
            for place in &gap.row_spans {
                let length = place.to_s.unwrap() - place.from_s.unwrap();
                let jitter = if trouble.len() > 1 { 0.9 } else { 1e-6 };
                assert!((length / 0.01 - place.rows as f64 - 1.0).abs() <= jitter, "{place:?}");
                assert!((first..last).contains(&place.from_s.unwrap()));
            }
            assert_eq!(found.len(), trouble.len(), "{found:?}");
        }
    }
    for (found, _) in sampling_issues(&[SamplingDefect::Repeated], &ReadOptions::default()) {
        assert_only(&found, &[QualityIssueKind::Repeated]);
        assert!((15..70).contains(&found[0].rows), "{}", found[0]);
    }
}

#[test]
fn saturation_quantisation_and_stalls_are_located() {
    for (found, record) in sampling_issues(&[SamplingDefect::Saturated], &ReadOptions::default()) {
        assert_only(&found, &[QualityIssueKind::Saturated, QualityIssueKind::Saturated]);
        let u = record.output();
        let sd = (u.iter().map(|u| u * u).sum::<f64>() / u.len() as f64).sqrt();
        let beyond = u.iter().filter(|u| u.abs() > 1.5 * sd).count();
        assert_eq!(found.iter().map(|one| one.rows).sum::<usize>(), beyond);
    }
    for (found, record) in sampling_issues(&[SamplingDefect::Quantised], &ReadOptions::default()) {
        assert_only(&found, &[QualityIssueKind::Quantised]);
        let sd = (record.output().iter().map(|u| u * u).sum::<f64>() / record.len() as f64).sqrt();
        assert!((found[0].size / (8.0 * sd / 256.0) - 1.0).abs() < 1e-9, "{}", found[0]);
    }
    for (found, record) in sampling_issues(&[SamplingDefect::Stalled], &ReadOptions::default()) {
        assert_only(&found, &[QualityIssueKind::Stalled]);
        let place = found[0].row_spans[0];
        // Rows are counted from 1; the first row of a stall still has a new value.
        assert_eq!((place.row, place.rows), (record.len() / 3 + 2, 49));
    }
    // Several defects at the same time.
    let all = [
        SamplingDefect::Saturated,
        SamplingDefect::Quantised,
        SamplingDefect::Repeated,
        SamplingDefect::Missing,
    ];
    for (found, _) in sampling_issues(&all, &resampling_options()) {
        use QualityIssueKind::{Gap, Quantised, Repeated, Saturated};
        assert_only(&found, &[Repeated, Gap, Saturated, Saturated, Quantised]);
    }
}

#[test]
fn masks_split_the_record() {
    let directory = tempfile::tempdir().unwrap();
    simulate_group(
        &experiment(&[SamplingDefect::Stalled, SamplingDefect::Missing]),
        directory.path(),
        &|| (),
    )
    .unwrap();
    let path = directory.path().join("S1_C1_1.csv");
    let cut = |mask: &[QualityIssueKind], shortest_s| {
        read_segments(
            &path,
            &ReadOptions::default(),
            &Preparation::default(),
            mask,
            shortest_s,
        )
    };
    // Without a mask, gaps are an error.
    assert!(cut(&[], 2.0).unwrap_err().to_string().contains("missing samples: "));
    let segments = cut(&[QualityIssueKind::Gap, QualityIssueKind::Stalled], 1.0).unwrap();
    assert!(segments.len() > 10);
    let mut end = f64::NEG_INFINITY;
    for segment in &segments {
        let record = &segment.record;
        assert!(record.time_s(0) > end && record.sample_time().s() == 0.01 && record.len() > 100);
        end = record.time_s(record.len() - 1);
        assert!(matches!(segment.steps[0], Step::Mask { .. }));
        assert!(record.output().windows(2).all(|pair| pair[0] != pair[1]));
    }
    assert_eq!(segments[0].quality_issues.len(), 2);
    for (mask, shortest, words) in [
        (&[QualityIssueKind::Clock][..], 1.0, "one or more of missing, gap"),
        (&[QualityIssueKind::Gap], f64::NAN, "NaN"),
        (&[QualityIssueKind::Gap], 1e6, "no segment of 1000000 s"),
    ] {
        assert!(cut(mask, shortest).unwrap_err().to_string().contains(words), "{words}");
    }
}

#[test]
fn clean_runs_raise_no_issue() {
    let mut runs = 0;
    for (noise_level, remnant_order) in [(0.01, 1), (0.1, 2), (0.2, 3), (0.3, 4)] {
        let clean = VirtualExperiment {
            subjects: 5,
            conditions: vec![Condition::C1, Condition::C2],
            runs: 5,
            noise_level,
            remnant_order,
            ..experiment(&[])
        };
        let directory = tempfile::tempdir().unwrap();
        for run in simulate_group(&clean, directory.path(), &|| ()).unwrap().runs {
            let read = read_record(&directory.path().join(&run.file), &ReadOptions::default()).unwrap();
            assert_eq!(read.quality_issues, [], "{}", run.file.display());
            runs += 1;
        }
    }
    assert_eq!(runs, 200);
}
