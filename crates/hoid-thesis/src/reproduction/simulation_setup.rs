//! The setting of the thesis: forcing function, states, conditions, starting points, remnant gain. Tables 1, 2 (4.2,
//! 4.3), 4.4, 6.1; Figs. 3, 4, A.1.

use hoid_model::{
    forcing::{ForcingFunction, REFERENCE_PERIOD_S},
    margins::{MANUAL_CONTROL_RANGE_RAD_S, Margins, margins},
    sample_time::SampleTime,
    scenario::{Condition, OperatingState, Scenario},
    schedule::Schedule,
};
use hoid_study::{Query, Results};

use crate::plans;

use super::{
    axes::{REMNANT_ORDERS, order_titles},
    item::{Item, ItemOutput},
    table_builder::TableBuilder,
};
use hoid_report::figures::{Curve, CurveGrid, CurvePanel, LineKind, Shade, curves};

pub(super) fn items() -> Vec<Item> {
    let table = |name: &str, title: &str, caption: &str, make: fn(&str) -> hoid_io::OutputTable| {
        Item::new(name, title, caption, None, move |item, _| make(&item.title).into())
    };
    vec![
        table(
            "table-1",
            "Sinusoids of the forcing function",
            "Eq. 42; frequencies are whole multiples of 2 pi / 81.92 s.",
            forcing_table,
        ),
        table(
            "table-2",
            "Controlled element, operator and held operator in states s1 and s2 (also Tables 4.2 and 4.3)",
            "Computed from the stated parameters at 100 Hz. The thesis gives crossovers of 1.5 and 2.8 rad/s and phase margins of 77.0 and 22.7 deg.",
            states_table,
        ),
        table(
            "table-4.4",
            "Conditions",
            "G is the rate of the sigmoid of eq. 5 at t_M = 40.96 s.",
            conditions_table,
        ),
        table(
            "table-6.1",
            "Starts of the Box-Jenkins searches",
            "As in the plan initial-conditions; the coefficients of D start at zero.",
            starts_table,
        ),
        Item::new(
            "fig-3",
            "Power spectrum of the forcing function",
            "One-sided power of each sinusoid, A^2/2, at its frequency: the spectrum is zero in between.",
            None,
            |item, _| spectrum(item),
        ),
        Item::new(
            "fig-4",
            "Error gain K_e in conditions C1 to C6",
            "Conditions with the same states coincide before and after the change, so slow and fast changes have separate panels.",
            None,
            |item, _| schedules(item),
        ),
        Item::from_study(
            "A.1",
            "Resulting and requested noise level, condition C1",
            "Mean over the runs of (var u - var u0) / var u where u0 is the control in the run without remnant (A.4); band: plus and minus one standard deviation; dashed: the requested level.",
            "noise-level",
            noise_level,
        ),
    ]
}

fn forcing_table(title: &str) -> hoid_io::OutputTable {
    let mut data = TableBuilder::new(&[], &["k", "n_t", "omega_rad_s", "amplitude_deg", "phase_rad"]);
    for (k, s) in ForcingFunction::reference().sinusoids().iter().enumerate() {
        let cycles = (s.omega_rad_s * REFERENCE_PERIOD_S / std::f64::consts::TAU).round();
        data.add_row(
            &[],
            &[k as f64 + 1.0, cycles, s.omega_rad_s, s.amplitude_deg, s.phase_rad],
        );
    }
    data.build(title)
}

fn margins_of(state: &OperatingState) -> Option<Margins> {
    let operator = state.operator.transfer_function().ok()?;
    let open_loop = operator.series(&state.controlled_element.transfer_function().ok()?);
    Some(margins(|omega| open_loop.response(omega), MANUAL_CONTROL_RANGE_RAD_S))
}

fn states_table(title: &str) -> hoid_io::OutputTable {
    let mut data = TableBuilder::new(
        &["state"],
        &[
            "K_c",
            "omega_b_rad_s",
            "K_e",
            "T_L_s",
            "K_e_dot",
            "tau_e_s",
            "omega_nm_rad_s",
            "zeta_nm",
            "T_n_s",
            "omega_c_rad_s",
            "phase_margin_deg",
            "gain_margin_db",
            "a1",
            "a2",
            "b0",
            "b1",
            "nk",
        ],
    );
    for (name, state) in [("s1", OperatingState::s1()), ("s2", OperatingState::s2())] {
        let (o, c) = (state.operator, state.controlled_element);
        let found = margins_of(&state);
        let of = |pick: fn(&Margins) -> Option<f64>| found.as_ref().and_then(pick).unwrap_or(f64::NAN);
        let held = o.discretise(SampleTime::AT_100_HZ).ok();
        let [a1, a2, b0, b1] = held.map_or([f64::NAN; 4], |h| [h.zoh.f1, h.zoh.f2, h.zoh.b0, h.zoh.b1]);
        data.add_row(
            &[name],
            &[
                c.k_c,
                c.omega_b_rad_s,
                o.k_e,
                o.t_l_s,
                o.k_e_dot(),
                o.tau_e_s,
                o.omega_nm_rad_s,
                o.zeta_nm,
                Scenario::condition(Condition::C1).remnant.time_constant_s,
                of(|m| m.crossover_rad_s),
                of(|m| m.phase_margin_deg),
                of(|m| m.gain_margin_db),
                a1,
                a2,
                b0,
                b1,
                held.map_or(f64::NAN, |h| h.nk as f64),
            ],
        );
    }
    data.build(title)
}

fn state_name(state: &OperatingState) -> &'static str {
    if *state == OperatingState::s1() { "s1" } else { "s2" }
}

fn conditions_table(title: &str) -> hoid_io::OutputTable {
    let mut data = TableBuilder::new(&["condition", "states"], &["G_per_s", "t_M_s"]);
    for condition in Condition::ALL {
        let scenario = Scenario::condition(condition);
        let rate = scenario.schedule.rate_per_s().unwrap_or(f64::NAN);
        let at = scenario.schedule.change_s().unwrap_or(f64::NAN);
        let states = match scenario.schedule {
            Schedule::Constant => state_name(&scenario.initial).to_owned(),
            _ => format!("{} to {}", state_name(&scenario.initial), state_name(&scenario.last)),
        };
        data.add_row(&[&condition.to_string(), &states], &[rate, at]);
    }
    data.build(title)
}

fn starts_table(title: &str) -> hoid_io::OutputTable {
    let mut data = TableBuilder::new(&["start"], &["b0", "b1", "a1", "a2"]);
    let plan = plans::find("initial-conditions").and_then(|named| named.plan().ok());
    let mut known: Vec<String> = Vec::new();
    // Only the starts of Table 6.1 are shown; the more distant starts belong to a claim.
    let of_the_table = |estimator: &&hoid_study::plan::EstimatorCell| estimator.name == "BJ";
    for estimator in plan.iter().flat_map(|plan| &plan.estimators).filter(of_the_table) {
        if known.contains(&estimator.start) {
            continue;
        }
        known.push(estimator.start.clone());
        let of = |name: &str| estimator.start_value(name).unwrap_or(f64::NAN);
        data.add_row(&[&estimator.start], &[of("b0"), of("b1"), of("f1"), of("f2")]);
    }
    data.build(title)
}

fn spectrum(item: &Item) -> ItemOutput {
    let forcing = ForcingFunction::reference();
    let x: Vec<f64> = forcing.sinusoids().iter().map(|s| s.omega_rad_s).collect();
    let y: Vec<f64> = forcing
        .sinusoids()
        .iter()
        .map(|s| 0.5 * s.amplitude_deg * s.amplitude_deg)
        .collect();
    let mut data = TableBuilder::new(&[], &["omega_rad_s", "power_deg2"]);
    x.iter().zip(&y).for_each(|(x, y)| data.add_row(&[], &[*x, *y]));
    let grid = CurveGrid {
        panels: vec![CurvePanel {
            name: "S_{ff}".to_owned(),
            unit: "deg^2".to_owned(),
            logarithmic: true,
            ordinate_range: None,
            curves: vec![Curve {
                name: String::new(),
                kind: LineKind::Stems,
                shade: Shade::of_method(0),
                x,
                y,
                band: Vec::new(),
                bars: Vec::new(),
            }],
        }],
        columns: 1,
        abscissa: "\u{3c9} (rad/s)".to_owned(),
        logarithmic_abscissa: true,
        ..CurveGrid::default()
    };
    item.draw(curves, &grid, data)
}

fn schedules(item: &Item) -> ItemOutput {
    let mut data = TableBuilder::new(&["condition"], &["t", "K_e"]);
    let groups = [
        ("constant", [Condition::C1, Condition::C2]),
        ("G = 0.5 s^{-1}", [Condition::C3, Condition::C5]),
        ("G = 100 s^{-1}", [Condition::C4, Condition::C6]),
    ];
    let mut panels = Vec::new();
    for (_, conditions) in &groups {
        let mut drawn = Vec::new();
        for (i, condition) in conditions.iter().enumerate() {
            let Ok(resolved) = Scenario::condition(*condition).resolve() else {
                continue;
            };
            let x: Vec<f64> = (0..=1024).map(|k| REFERENCE_PERIOD_S * f64::from(k) / 1024.0).collect();
            let y: Vec<f64> = x.iter().map(|t| resolved.parameters_at(*t).operator.k_e).collect();
            x.iter()
                .zip(&y)
                .for_each(|(t, k)| data.add_row(&[&condition.to_string()], &[*t, *k]));
            drawn.push(Curve {
                name: if i == 0 {
                    "C1, C3, C4".to_owned()
                } else {
                    "C2, C5, C6".to_owned()
                },
                kind: LineKind::Line,
                shade: Shade::of_method(i),
                x,
                y,
                band: Vec::new(),
                bars: Vec::new(),
            });
        }
        panels.push(CurvePanel {
            name: "K_e".to_owned(),
            unit: "deg/deg".to_owned(),
            logarithmic: false,
            ordinate_range: None,
            curves: drawn,
        });
    }
    let grid = CurveGrid {
        columns: panels.len(),
        panels,
        titles: groups.iter().map(|(title, _)| (*title).to_owned()).collect(),
        abscissa: "time (s)".to_owned(),
        logarithmic_abscissa: false,
        shared_ordinates: true,
    };
    item.draw(curves, &grid, data)
}

fn noise_level(item: &Item, results: &Results) -> ItemOutput {
    let mut data = TableBuilder::new(&[], &["remnant_order", "demanded", "mean", "mean_se", "sd", "runs"]);
    let mut panels = Vec::new();
    for m0 in REMNANT_ORDERS {
        let rows = results.find(&Query::of("noise_level_obtained").remnant_order(m0));
        let x: Vec<f64> = rows.iter().map(|row| row.noise_level).collect();
        let curve = |name: &str, kind, y: Vec<f64>, band| Curve {
            name: name.to_owned(),
            kind,
            shade: Shade::of_method(0),
            x: x.clone(),
            y,
            band,
            bars: Vec::new(),
        };
        let band = rows.iter().map(|row| {
            (
                row.statistics.mean - row.statistics.sd,
                row.statistics.mean + row.statistics.sd,
            )
        });
        for row in &rows {
            let s = &row.statistics;
            data.add_row(
                &[],
                &[m0 as f64, row.noise_level, s.mean, s.mean_se, s.sd, s.count as f64],
            );
        }
        panels.push(CurvePanel {
            name: "P_n".to_owned(),
            unit: String::new(),
            logarithmic: false,
            ordinate_range: Some((0.0, 1.0)),
            curves: vec![
                curve(
                    "obtained",
                    LineKind::Line,
                    rows.iter().map(|row| row.statistics.mean).collect(),
                    band.collect(),
                ),
                curve("demanded", LineKind::Truth, x.clone(), Vec::new()),
            ],
        });
    }
    let grid = CurveGrid {
        panels,
        columns: REMNANT_ORDERS.len(),
        titles: order_titles(),
        abscissa: "demanded P_n".to_owned(),
        logarithmic_abscissa: false,
        shared_ordinates: true,
    };
    item.draw(curves, &grid, data)
}
