//! One figure of each kind for studies, with artificial results of realistic size. To view them:
//! `HOID_FIGURES=folder cargo test -p hoid-report --test study_figures -- --ignored`.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use hoid_model::{
    Complex64,
    scenario::{Condition, OperatingState},
    uncertainty::Estimate,
};
use hoid_report::figures::{
    BodeColumn, BodeCurve, BodeGrid, BodePoints, BoxGrid, BoxPanel, BoxRange, BoxSeries, BoxStatistics, Curve,
    CurveGrid, CurveKind, CurvePanel, LineKind, MapColours, MapGrid, MapPanel, Ordinate, Shade, TraceCurve, TraceGrid,
    TracePanel, bode_grid, box_plots, curves, maps, trace_panels,
};

const PARAMETERS: [&str; 4] = ["a_1", "a_2", "b_0", "b_1"];

/// Pseudo-random numbers between -1 and 1 from a linear congruential generator.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn normal(&mut self) -> f64 {
        // The third power of a sum has heavy tails and therefore outliers.
        let sum = self.next() + self.next() + self.next();
        sum + 0.3 * sum.powi(3)
    }
}

fn orders() -> Vec<String> {
    (1..=6).map(|m| format!("m^0 = {m}")).collect()
}

fn shade(method: usize, level: usize, levels: usize) -> Shade {
    Shade { method, level, levels }
}

fn noise_levels(method: usize) -> Vec<BoxSeries> {
    let series = |k| BoxSeries {
        name: format!("P_n = 0.{k}"),
        shade: shade(method, k, 4),
    };
    (0..4).map(series).collect()
}

fn boxes(range: BoxRange, method: usize) -> BoxGrid {
    let mut noise = Noise(1);
    let mut panels = Vec::new();
    for (row, name) in PARAMETERS.iter().enumerate() {
        for column in 0..4 {
            let scale = if column == 0 { 60.0 } else { 0.8 };
            let mut sample = |group: usize, series: usize| {
                let centre = scale * (series as f64) * (1.0 + row as f64) * (0.3 + 0.2 * (group as f64 - 2.0));
                let values: Vec<f64> = (0..100)
                    .map(|_| centre + 0.15 * scale * (0.1 + series as f64) * noise.normal())
                    .collect();
                match (column, group, series) {
                    (3, 4, 3) => BoxStatistics::default(),
                    (2, 0, 2) => BoxStatistics::of(&values[..3]),
                    (1, 3, 3) => BoxStatistics::of(&[&values[..], &[25.0, 30.0, -9.0]].concat()),
                    _ => BoxStatistics::of(&values),
                }
            };
            panels.push(BoxPanel {
                name: format!("B_r({name})"),
                unit: "%".to_owned(),
                boxes: (0..5).map(|g| (0..4).map(|s| sample(g, s)).collect()).collect(),
                ..BoxPanel::default()
            });
        }
    }
    BoxGrid {
        panels,
        columns: 4,
        titles: orders(),
        abscissa: "n_k^*".to_owned(),
        groups: (26..=30).map(|n| n.to_string()).collect(),
        series: noise_levels(method),
        range,
        with_zero: true,
        min_half_range: 0.0,
        shared_ordinates: false,
    }
}

fn map_grid(colours: MapColours, columns: usize, bar_per_row: bool) -> MapGrid {
    let mut noise = Noise(2);
    let mut panels = Vec::new();
    for row in 0..4 {
        for column in 0..columns {
            let mut cell = |x: usize, y: usize| {
                if (row, column, x, y) == (3, 1, 0, 3) {
                    return f64::NAN;
                }
                let away = (x as f64 - 4.0).powi(2) * 0.6 + if y == 3 { 2.0 } else { 0.1 * y as f64 };
                let value = 98.0 - 9.0 * row as f64 - away + 0.2 * noise.next();
                if colours == MapColours::Diverging {
                    (value - 92.0 + 9.0 * row as f64) / 10.0
                } else {
                    value
                }
            };
            panels.push(MapPanel {
                name: format!("P_n = 0.{row}"),
                values: (0..4).map(|y| (0..6).map(|x| cell(x, y)).collect()).collect(),
                marked: Some((4, column)),
            });
        }
    }
    MapGrid {
        panels,
        columns,
        titles: if columns > 1 { orders() } else { Vec::new() },
        abscissa: "n_k^*".to_owned(),
        x_categories: (25..=30).map(|n| n.to_string()).collect(),
        ordinate: "m^*".to_owned(),
        y_categories: (1..=4).map(|m| m.to_string()).collect(),
        value: match colours {
            MapColours::Sequential => "VAF (%)".to_owned(),
            MapColours::Diverging => "\u{394}VAF (%)".to_owned(),
        },
        colours,
        limits: None,
        bar_per_row,
        cross_label: "simulated orders".to_owned(),
    }
}

fn bode() -> BodeGrid {
    let operator = OperatingState::s1().operator.transfer_function().unwrap();
    let omega: Vec<f64> = (0..200).map(|k| 0.1 * 500.0_f64.powf(f64::from(k) / 199.0)).collect();
    let response: Vec<Complex64> = omega.iter().map(|w| operator.response(*w)).collect();
    let column = |m: usize| {
        let mut curves: Vec<BodeCurve> = (0..5)
            .map(|k| {
                let part = (k as f64 - 3.0) * if m == 0 { 0.25 } else { 0.04 };
                let wrong =
                    |(w, h): (&f64, &Complex64)| h * Complex64::from_polar(1.0 + part * w / (3.0 + w), 0.01 * part * w);
                let of: Vec<Complex64> = omega.iter().zip(&response).map(wrong).collect();
                let name = format!("n_k^* = {}", 26 + k);
                let mut curve = BodeCurve::of_response(&name, LineKind::Line, shade(0, k, 5), &omega, &of, 0.28);
                if k == 0 {
                    curve.magnitude_band = curve.magnitude_db.iter().map(|v| (v - 2.0, v + 2.0)).collect();
                    curve.phase_band = curve.phase_deg.iter().map(|v| (v - 15.0, v + 15.0)).collect();
                }
                curve
            })
            .collect();
        let of_truth = ("simulated", LineKind::Truth, Shade::of_method(0));
        curves.push(BodeCurve::of_response(
            of_truth.0, of_truth.1, of_truth.2, &omega, &response, 0.28,
        ));
        let at = |k: &usize| *k >= 20 && k.is_multiple_of(20);
        let lines: Vec<usize> = (0..170).filter(at).collect();
        let estimate = |value: f64, error: f64| Estimate {
            value,
            standard_error: Some(error),
        };
        let points = BodePoints {
            name: "describing function".to_owned(),
            omega_rad_s: lines.iter().map(|k| omega[*k]).collect(),
            magnitude_db: lines
                .iter()
                .map(|k| estimate(20.0 * response[*k].norm().log10() + 0.3, 0.8))
                .collect(),
            phase_deg: lines
                .iter()
                .map(|k| estimate(response[*k].arg().to_degrees() - 4.0, 12.0))
                .collect(),
            delay_s: 0.28,
        };
        curves.push(BodeCurve::of_points(&points, Shade::of_method(2)));
        BodeColumn {
            title: format!("m^0 = {}", m + 1),
            curves,
        }
    };
    BodeGrid {
        columns: (0..4).map(column).collect(),
    }
}

fn curve(name: &str, kind: LineKind, shade: Shade, points: impl IntoIterator<Item = (f64, f64)>) -> Curve {
    let (x, y) = points.into_iter().unzip();
    Curve {
        name: name.to_owned(),
        kind,
        shade,
        x,
        y,
        band: Vec::new(),
        bars: Vec::new(),
    }
}

/// Curves of the obtained noise level over the specified noise level.
fn noise_level_curves() -> CurveGrid {
    let demanded: Vec<f64> = (0..=30).map(|k| 0.01 * f64::from(k)).collect();
    let panel = |m: usize| {
        let bent = |p: f64| p * (1.0 + 0.03 * (m as f64 - 1.5) * (p * 12.0).sin());
        let mean = demanded.iter().map(|p| (*p, bent(*p)));
        let mut mean = curve("obtained", LineKind::Line, Shade::of_method(0), mean);
        mean.band = demanded
            .iter()
            .map(|p| (bent(*p) - 0.12 * p, bent(*p) + 0.12 * p))
            .collect();
        let line = demanded.iter().map(|p| (*p, *p));
        CurvePanel {
            name: "P_n".to_owned(),
            unit: "-".to_owned(),
            curves: vec![mean, curve("demanded", LineKind::Truth, Shade::of_method(0), line)],
            ..CurvePanel::default()
        }
    };
    CurveGrid {
        panels: (0..4).map(panel).collect(),
        columns: 4,
        titles: orders(),
        abscissa: "demanded P_n (-)".to_owned(),
        shared_ordinates: true,
        ..CurveGrid::default()
    }
}

fn error_curves() -> CurveGrid {
    let lengths = [5.0, 10.0, 20.0, 40.0, 80.0, 160.0];
    let panel = |name: &str, unit: &str, scale: f64| {
        let of = |method: usize, name: &str| {
            let at = |t: f64| scale * (1.0 + method as f64) / t.sqrt() + 0.02 * scale * method as f64;
            let mut line = curve(
                name,
                LineKind::Marked,
                Shade::of_method(method),
                lengths.iter().map(|t| (*t, at(*t))),
            );
            line.bars = lengths.iter().map(|t| (0.8 * at(*t), 1.25 * at(*t))).collect();
            line
        };
        CurvePanel {
            name: name.to_owned(),
            unit: unit.to_owned(),
            logarithmic: true,
            curves: vec![of(0, "ARX"), of(1, "BJ")],
            ..CurvePanel::default()
        }
    };
    CurveGrid {
        panels: vec![panel("RMSE(K_e)", "", 0.02), panel("RMSE(\u{3c9}_{nm})", "rad/s", 3.0)],
        abscissa: "memory (s)".to_owned(),
        logarithmic_abscissa: true,
        ..CurveGrid::default()
    }
}

fn spectrum() -> CurveGrid {
    let lines = [5.0, 11.0, 23.0, 37.0, 51.0, 71.0, 101.0, 137.0, 171.0, 226.0];
    let lines = lines.map(|n: f64| {
        let omega = n * std::f64::consts::TAU / 81.92;
        (omega, 1.2 / (1.0 + (omega / 1.2).powi(4)) + 0.003)
    });
    CurveGrid {
        panels: vec![CurvePanel {
            name: "S_{ff}".to_owned(),
            unit: "deg^2 s/rad".to_owned(),
            logarithmic: true,
            curves: vec![curve("", LineKind::Stems, Shade::of_method(0), lines)],
            ..CurvePanel::default()
        }],
        abscissa: "frequency \u{3c9} (rad/s)".to_owned(),
        logarithmic_abscissa: true,
        ..CurveGrid::default()
    }
}

fn schedules() -> CurveGrid {
    let conditions = [
        Condition::C1,
        Condition::C2,
        Condition::C3,
        Condition::C4,
        Condition::C5,
        Condition::C6,
    ];
    let times: Vec<f64> = (0..=8192).map(|k| 0.01 * f64::from(k)).collect();
    let gain = |condition: Condition, t: f64| {
        let share = |g: f64| 1.0 / (1.0 + (-g * (t - 40.96)).exp());
        let (from, to) = (0.09, 0.07);
        match condition {
            Condition::C1 => from,
            Condition::C2 => to,
            Condition::C3 => from + (to - from) * share(0.5),
            Condition::C4 => from + (to - from) * share(100.0),
            Condition::C5 => to + (from - to) * share(0.5),
            _ => to + (from - to) * share(100.0),
        }
    };
    let line = |(k, condition): (usize, &Condition)| {
        let kind = if k % 2 == 0 { LineKind::Line } else { LineKind::Marked };
        let points = times.iter().map(|t| (*t, gain(*condition, *t)));
        curve(&format!("C{}", k + 1), kind, Shade::of_method(k), points)
    };
    CurveGrid {
        panels: vec![CurvePanel {
            name: "K_e".to_owned(),
            unit: "-".to_owned(),
            curves: conditions.iter().enumerate().map(line).collect(),
            ..CurvePanel::default()
        }],
        abscissa: "time (s)".to_owned(),
        ..CurveGrid::default()
    }
}

/// Averages of recursive estimates of two methods at three noise levels.
fn average_traces() -> TraceGrid {
    let times: Vec<f64> = (0..8192).map(|k| 0.01 * f64::from(k)).collect();
    let truth = |row: usize, t: f64| [-1.9, 0.92, 0.04, -0.037][row] * if t < 40.96 { 1.0 } else { 0.97 };
    let mut noise = Noise(4);
    let mut panels = Vec::new();
    for (row, name) in ["a1, f1", "a2, f2", "b0", "b1"].iter().enumerate() {
        for column in 0..4 {
            let mut curves = Vec::new();
            for method in 0..2 {
                for level in 0..3 {
                    let bias = match (method, column) {
                        (0, 0) => -0.12 * level as f64,
                        (0, _) => -0.01 * level as f64,
                        _ => 0.004 * level as f64,
                    };
                    let mut estimate = truth(row, 0.0) * 1.1;
                    let values = times.iter().map(|t| {
                        let wanted = truth(row, *t) * (1.0 + bias);
                        estimate +=
                            0.004 * (wanted - estimate + 0.3 * wanted * (1.0 + level as f64) * 0.3 * noise.normal());
                        estimate
                    });
                    curves.push(TraceCurve {
                        kind: CurveKind::Estimate,
                        method,
                        level,
                        times_s: times.clone(),
                        values: values.collect(),
                        band: Vec::new(),
                    });
                    for (from, to) in [(0.0, 30.72), (51.2, 81.91)] {
                        curves.push(TraceCurve {
                            kind: CurveKind::Batch,
                            method,
                            level,
                            times_s: vec![from, to],
                            values: vec![truth(row, from) * (1.0 + bias); 2],
                            band: Vec::new(),
                        });
                    }
                }
            }
            curves.push(TraceCurve {
                kind: CurveKind::Truth,
                method: 0,
                level: 0,
                times_s: times.clone(),
                values: times.iter().map(|t| truth(row, *t)).collect(),
                band: Vec::new(),
            });
            panels.push(TracePanel {
                name: (*name).to_owned(),
                unit: String::new(),
                curves,
                ordinate: Ordinate::Robust,
            });
        }
    }
    TraceGrid {
        panels,
        columns: 4,
        titles: orders(),
        methods: vec!["RLS".to_owned(), "RPEM".to_owned()],
        levels: [0.01, 0.1, 0.2].map(|p| format!("P_n = {p}")).to_vec(),
        ..TraceGrid::default()
    }
}

fn figures() -> Vec<(&'static str, String)> {
    let mut one_box = boxes(BoxRange::Full, 1);
    one_box.panels.truncate(1);
    one_box.columns = 1;
    one_box.titles.clear();
    let mut shared = boxes(BoxRange::Whiskers, 1);
    shared.shared_ordinates = true;
    let mut both = boxes(BoxRange::Whiskers, 0);
    both.panels.truncate(4);
    both.columns = 2;
    both.titles.clear();
    both.series = [(0, "ARX"), (1, "BJ")]
        .iter()
        .flat_map(|(method, name)| {
            noise_levels(*method).into_iter().map(move |s| BoxSeries {
                name: format!("{name}, {}", s.name),
                ..s
            })
        })
        .collect();
    for panel in &mut both.panels {
        for group in &mut panel.boxes {
            group.extend(group.clone());
        }
    }
    both.groups = ["nominal", "no hold", "fixed f_s", "a long name here", "short"]
        .map(str::to_owned)
        .to_vec();
    let mut two_columns = error_curves();
    two_columns.columns = 2;
    let mut shared_averages = average_traces();
    shared_averages.shared_ordinates = true;
    vec![
        ("boxes", box_plots("boxes", "Relative bias", &boxes(BoxRange::Full, 0))),
        (
            "boxes_robust",
            box_plots("boxes_robust", "Relative bias", &boxes(BoxRange::Whiskers, 1)),
        ),
        ("boxes_shared", box_plots("boxes_shared", "Relative bias", &shared)),
        ("boxes_one", box_plots("boxes_one", "Relative bias", &one_box)),
        ("boxes_both", box_plots("boxes_both", "Relative bias", &both)),
        (
            "maps_six",
            maps("maps_six", "VAF", &map_grid(MapColours::Sequential, 6, false)),
        ),
        ("maps", maps("maps", "VAF", &map_grid(MapColours::Sequential, 4, false))),
        (
            "maps_rows",
            maps("maps_rows", "VAF", &map_grid(MapColours::Sequential, 4, true)),
        ),
        (
            "maps_difference",
            maps(
                "maps_difference",
                "Difference of VAF",
                &map_grid(MapColours::Diverging, 4, false),
            ),
        ),
        (
            "maps_one",
            maps("maps_one", "VAF", &map_grid(MapColours::Sequential, 1, false)),
        ),
        ("bode_grid", bode_grid("bode_grid", "Frequency responses", &bode())),
        ("obtained", curves("obtained", "Noise levels", &noise_level_curves())),
        ("errors", curves("errors", "Errors over memory", &error_curves())),
        (
            "errors_beside",
            curves("errors_beside", "Errors over memory", &two_columns),
        ),
        ("spectrum", curves("spectrum", "Forcing function", &spectrum())),
        ("schedules", curves("schedules", "Gain over time", &schedules())),
        (
            "averages",
            trace_panels("averages", "Recursive estimates", &average_traces()),
        ),
        (
            "averages_shared",
            trace_panels("averages_shared", "Recursive estimates", &shared_averages),
        ),
    ]
}

#[test]
fn figures_are_complete_and_reproducible() {
    let again = figures();
    for ((name, svg), (_, second)) in figures().iter().zip(&again) {
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>"), "{name}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        // All subscript markers become tags.
        assert!(
            !svg.contains(['\u{e000}', '\u{e001}', '\u{e002}', '\u{e003}', '\u{e004}']),
            "{name}"
        );
        assert_eq!(svg.matches("<tspan").count(), svg.matches("</tspan>").count(), "{name}");
        assert!(svg == second, "{name} differs when drawn again");
    }
}

/// In print 420 units are 85 mm, so 7 pt are 12.2 units.
#[test]
fn text_is_seven_points_in_print_except_subscripts() {
    for (name, svg) in figures() {
        let sizes = |tag: &str| -> Vec<f64> {
            let tags = svg.split(tag).skip(1).filter_map(|rest| rest.split_once('>'));
            let size = |(tag, _): (&str, &str)| tag.split_once("font-size=\"")?.1.split_once('"')?.0.parse().ok();
            tags.filter_map(size).collect()
        };
        let text = sizes("<text ");
        assert!(
            !text.is_empty() && text.iter().all(|size| *size >= 12.2),
            "{name}: {text:?}"
        );
        assert!(sizes("<tspan ").iter().all(|size| *size >= 11.0), "{name}");
    }
}

#[test]
#[ignore = "writes the figures to the folder HOID_FIGURES"]
fn write_figures() {
    let folder = std::path::PathBuf::from(std::env::var_os("HOID_FIGURES").expect("HOID_FIGURES names a folder"));
    for (name, svg) in figures() {
        std::fs::write(folder.join(format!("{name}.svg")), svg).unwrap();
    }
}
