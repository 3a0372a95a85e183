//! Bode plots of models whose coefficients are the averages over the runs: Figs. 10 and D.1 to
//! D.18.

use hoid_model::{Complex64, Orders, PolynomialModel, Structure};
use hoid_study::{Query, Results};

use super::{
    axes::{DELAYS, NOISE_LEVELS, REMNANT_ORDERS, level_name},
    bias::Model,
    item::{Item, ItemOutput},
    table_builder::TableBuilder,
};
use hoid_report::figures::{BodeColumn, BodeCurve, BodeGrid, LineKind, Shade, bode_grid};

const TRUE_DELAY: usize = 29;

/// Curves shown in a figure.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Curves {
    /// One model at one noise level, by delay.
    ByDelay(Model, f64),
    /// ARX and a Box-Jenkins model at the true delay, by noise level.
    Both(Model),
}

pub(super) fn items() -> Vec<Item> {
    let mut all = vec![item("fig-10".to_owned(), "C1", Curves::Both(Model::First))];
    for (condition, first) in [("C1", 1), ("C2", 10)] {
        for (i, level) in NOISE_LEVELS.into_iter().enumerate() {
            all.push(item(
                format!("D.{}", first + i),
                condition,
                Curves::ByDelay(Model::Arx, level),
            ));
            all.push(item(
                format!("D.{}", first + 4 + i),
                condition,
                Curves::ByDelay(Model::Matched, level),
            ));
        }
        all.push(item(
            format!("D.{}", first + 8),
            condition,
            Curves::Both(Model::Matched),
        ));
    }
    all
}

fn item(name: String, condition: &'static str, curves: Curves) -> Item {
    let (title, by) = match curves {
        Curves::ByDelay(Model::Arx, level) => {
            (format!("Bode plots of ARX models by delay, P_n = {level}"), "delay nk*")
        }
        Curves::ByDelay(_, level) => (
            format!("Bode plots of Box-Jenkins models (m* = m0) by delay, P_n = {level}"),
            "delay nk*",
        ),
        Curves::Both(model) => {
            let order = if model == Model::First { "1" } else { "m0" };
            (
                format!("Bode plots of ARX and Box-Jenkins models (m* = {order}), nk* = 29"),
                "noise level",
            )
        }
    };
    Item::from_study(
        name,
        format!("{title}, condition {condition}"),
        format!(
            "Responses of the models with the coefficients averaged over the runs, by {by}; dashed: the simulated operator, held at 100 Hz."
        ),
        "bias",
        move |item, results| make(item, results, condition, curves),
    )
}

fn omegas() -> Vec<f64> {
    (0..=160)
        .map(|i| 10f64.powf(-1.0 + 2.7 * f64::from(i) / 160.0))
        .collect()
}

/// Returns the response of the averaged model; `None` if no run gives a value.
fn averaged_response(
    results: &Results,
    condition: &str,
    m0: usize,
    model: Model,
    level: f64,
    nk: usize,
    omega: &[f64],
) -> Option<Vec<Complex64>> {
    let names = if model == Model::Arx {
        ["b0", "b1", "a1", "a2"]
    } else {
        ["b0", "b1", "f1", "f2"]
    };
    let theta: Option<Vec<f64>> = names
        .into_iter()
        .map(|name| {
            let query = Query::of(name)
                .condition(condition)
                .remnant_order(m0)
                .noise_level(level)
                .nk(nk);
            results
                .find_one(&model.restrict(query, m0))
                .map(|row| row.statistics.mean)
        })
        .collect();
    response(&theta?, nk, omega)
}

/// Returns the response of `(b0 + b1 q^-1) q^-nk / (1 + f1 q^-1 + f2 q^-2)` at 100 Hz.
fn response(theta: &[f64], nk: usize, omega: &[f64]) -> Option<Vec<Complex64>> {
    let orders = Orders {
        nb: 2,
        nf: 2,
        nk,
        ..Orders::default()
    };
    let model = PolynomialModel::new(
        Structure::OutputError,
        orders,
        hoid_model::SampleTime::AT_100_HZ,
        theta.to_vec(),
    )
    .ok()?;
    Some(omega.iter().map(|w| model.response(*w)).collect())
}

fn make(item: &Item, results: &Results, condition: &str, curves: Curves) -> ItemOutput {
    let omega = omegas();
    let mut data = TableBuilder::new(
        &["model"],
        &[
            "remnant_order",
            "noise_level",
            "nk",
            "omega_rad_s",
            "magnitude_db",
            "phase_deg",
        ],
    );
    let mut columns = Vec::new();
    for m0 in REMNANT_ORDERS {
        let mut drawn = Vec::new();
        let mut add =
            |name: String, kind, shade: Shade, model: &str, level: f64, nk: usize, response: Vec<Complex64>| {
                let delay_s = nk as f64 * 0.01;
                let curve = BodeCurve::of_response(&name, kind, shade, &omega, &response, delay_s);
                for (i, w) in omega.iter().enumerate() {
                    data.add_row(
                        &[model],
                        &[
                            m0 as f64,
                            level,
                            nk as f64,
                            *w,
                            curve.magnitude_db[i],
                            curve.phase_deg[i],
                        ],
                    );
                }
                drawn.push(curve);
            };
        match curves {
            Curves::ByDelay(model, level) => {
                for (i, nk) in DELAYS.into_iter().enumerate() {
                    let shade = Shade {
                        method: model.method_index(),
                        level: i,
                        levels: DELAYS.len(),
                    };
                    if let Some(h) = averaged_response(results, condition, m0, model, level, nk, &omega) {
                        add(format!("n_k^* = {nk}"), LineKind::Line, shade, "estimate", level, nk, h);
                    }
                }
            }
            Curves::Both(bj) => {
                for model in [Model::Arx, bj] {
                    for (i, level) in NOISE_LEVELS.into_iter().enumerate() {
                        let shade = Shade {
                            method: model.method_index(),
                            level: i,
                            levels: NOISE_LEVELS.len(),
                        };
                        let name = if model == Model::Arx { "ARX" } else { "BJ" };
                        if let Some(h) = averaged_response(results, condition, m0, model, level, TRUE_DELAY, &omega) {
                            add(
                                format!("{name}, {}", level_name(level)),
                                LineKind::Line,
                                shade,
                                name,
                                level,
                                TRUE_DELAY,
                                h,
                            );
                        }
                    }
                }
            }
        }
        let truth = results
            .plan
            .cells
            .iter()
            .find(|cell| cell.condition == condition)
            .and_then(|cell| {
                let [f1, f2, b0, b1] = cell.true_states()[0].discrete;
                response(&[b0, b1, f1, f2], TRUE_DELAY, &omega)
            });
        if let Some(h) = truth {
            add(
                "simulated".to_owned(),
                LineKind::Truth,
                Shade::of_method(0),
                "simulated",
                f64::NAN,
                TRUE_DELAY,
                h,
            );
        }
        columns.push(BodeColumn {
            title: format!("m^0 = {m0}"),
            curves: drawn,
        });
    }
    item.draw(bode_grid, &BodeGrid { columns }, data)
}
