//! Recorded people in a manual tracking task: describing functions are compared with the table published with the
//! recordings.
//!
//! The recordings are not part of the project. Their directory is given by the environment variable `HOID_HUMAN_DATA`;
//! if it is not set, the test reports this and passes.
#![allow(clippy::unwrap_used)]

use std::{env, path::Path};

use hoid::{
    ident::frequency::{
        Averaging, DescribingOptions, Excitation, GainLeadDelayOptions, LineDetectionOptions, MeasuredElement, describe,
    },
    io::{ReadOptions, read_record},
    model::ContinuousTransferFunction,
    prelude::*,
};

struct Row {
    person: &'static str,
    plant: &'static str,
    crossover_rad_s: f64,
    phase_margin_deg: f64,
    gain: f64,
    lead_s: f64,
    delay_s: f64,
    coherence: f64,
    off_line_share: f64,
}

#[rustfmt::skip]
const TABLE: [Row; 6] = [
    row("P03", "fo", [1.99, 57.2, 2.11, 0.0, 0.254, 0.82, 0.07]),
    row("P03", "so", [1.21, 36.3, 1.57, 0.525, 0.492, 0.59, 0.17]),
    row("P05", "fo", [3.95, 28.0, 4.13, 0.0, 0.218, 0.88, 0.12]),
    row("P05", "so", [3.23, 19.5, 6.93, 0.312, 0.282, 0.73, 0.57]),
    row("P09", "fo", [2.94, 34.1, 3.13, 0.0, 0.232, 0.86, 0.08]),
    row("P09", "so", [2.63, 16.2, 4.94, 0.331, 0.315, 0.73, 0.40]),
];

const fn row(person: &'static str, plant: &'static str, n: [f64; 7]) -> Row {
    Row {
        person,
        plant,
        crossover_rad_s: n[0],
        phase_margin_deg: n[1],
        gain: n[2],
        lead_s: n[3],
        delay_s: n[4],
        coherence: n[5],
        off_line_share: n[6],
    }
}

const PRIMES: [usize; 11] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31];

fn trials(directory: &Path, row: &Row) -> Vec<Record> {
    let prefix = format!("{}_{}_", row.person, row.plant);
    let entries = std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = entries
        .filter(|path| path.file_name().unwrap().to_string_lossy().starts_with(&prefix))
        .collect();
    files.sort();
    let options = ReadOptions {
        input: Some("r-y".parse().unwrap()),
        ..ReadOptions::default()
    };
    files
        .iter()
        .map(|file| read_record(file, &options).unwrap().record)
        .collect()
}

#[test]
fn describing_functions_match_the_table() {
    let Some(directory) = env::var_os("HOID_HUMAN_DATA") else {
        println!("skipped: HOID_HUMAN_DATA does not name the directory of the recordings");
        return;
    };
    let mut failures = Vec::new();
    for row in &TABLE {
        let records = trials(Path::new(&directory), row);
        assert_eq!(records.len(), 10);
        let first_order = row.plant == "fo";
        let harmonics = if first_order { &PRIMES[..] } else { &PRIMES[..7] };
        let excitation = Excitation::from_harmonics(harmonics, 20.0).unwrap();
        // The span contains two periods of the disturbance after the ramp. The u of a row was read one row before the
        // error of the row was displayed.
        let options = DescribingOptions {
            averaging: Averaging::Reference {
                channel: "d".to_owned(),
            },
            from_s: Some(5.0),
            to_s: Some(45.0),
            offset_samples: 1.0,
            element: Some(MeasuredElement {
                output: "y".to_owned(),
                disturbance: Some("d".to_owned()),
            }),
            ..DescribingOptions::default()
        };
        let span = records[0].span(5.0, 45.0).unwrap();
        let found = Excitation::detect(&span, "d", &LineDetectionOptions::default()).unwrap();
        assert_eq!(found.harmonics(), harmonics);

        let h = describe(&records, &excitation, &options).unwrap();
        let denominator: &[f64] = if first_order { &[1.0, 0.0] } else { &[1.0, 1.0, 0.0] };
        let element = ContinuousTransferFunction::new(&[1.0], denominator).unwrap();
        let margins = h.open_loop(&element).margins();
        let measured = h.measured_open_loop().unwrap().margins().estimates;
        let fit = h
            .fit_gain_lead_delay(&GainLeadDelayOptions {
                lead: !first_order,
                ..GainLeadDelayOptions::default()
            })
            .unwrap();
        let coherence = h.lines.iter().map(|l| l.coherence.unwrap()).sum::<f64>() / h.lines.len() as f64;
        let found = margins.estimates;
        let (crossover, phase) = (found.crossover_rad_s.unwrap(), found.phase_margin_deg.unwrap());
        println!("{} {}", row.person, row.plant);
        let shown = |e: Estimate| format!("{:.4} +- {:.4}", e.value, e.standard_error.unwrap_or(f64::NAN));
        // For small numbers, half a unit of the last digit of the table exceeds 1 %.
        let mut check = |name: &str, found: Estimate, expected: f64, tolerance: f64| {
            let off = (found.value - expected).abs();
            println!("  {name}: {} (table {expected})", shown(found));
            if off > tolerance {
                failures.push(format!(
                    "{} {} {name}: {} against {expected}",
                    row.person, row.plant, found.value
                ));
            }
        };
        let percent = |expected: f64| 0.01 * expected;
        check(
            "crossover",
            crossover,
            row.crossover_rad_s,
            percent(row.crossover_rad_s),
        );
        check("phase margin", phase, row.phase_margin_deg, 0.5);
        check("K", fit.gain, row.gain, percent(row.gain));
        check("T_L", fit.lead_s, row.lead_s, percent(row.lead_s));
        check("tau", fit.delay_s, row.delay_s, percent(row.delay_s));
        check(
            "mean coherence",
            Estimate::fixed(coherence),
            row.coherence,
            0.005 + 1e-9,
        );
        check(
            "at non-excited frequencies",
            h.off_line_share,
            row.off_line_share,
            0.005 + 1e-9,
        );
        // The plant response is the measured one, which includes its hold of half a tick.
        let (by_ratio, by_phase) = (measured.crossover_rad_s.unwrap(), measured.phase_margin_deg.unwrap());
        println!("  with the plant measured: {}, {}", shown(by_ratio), shown(by_phase));
        println!("  noise ratio {}, misfit {:.3}", shown(h.noise_ratio), fit.misfit);
        println!("  rms e {}, rms u {}", shown(h.rms_e), shown(h.rms_u));
        println!(
            "  spread over runs {:.3} rad/s, {:.2} deg of {} runs with a crossover",
            margins.crossover_spread_rad_s.unwrap(),
            margins.phase_margin_spread_deg.unwrap(),
            margins.per_run.iter().flatten().count()
        );
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
