//! Box plots of relative biases (eq. 41) by delay, noise level and remnant order: Figs. 5, 6, 9 and
//! C.1 to C.16.

use hoid_study::{Query, Results};

use super::{
    axes::{DELAYS, NOISE_LEVELS, REMNANT_ORDERS, level_name, order_titles},
    item::{Item, ItemOutput},
    table_builder::TableBuilder,
};
use hoid_report::figures::{BoxGrid, BoxPanel, BoxRange, BoxSeries, BoxStatistics, Shade, box_plots};

/// Estimator shown in a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Model {
    Arx,
    /// Box-Jenkins model with m* = m0.
    Matched,
    /// Box-Jenkins model with m* = 1.
    First,
}

impl Model {
    fn name(self) -> &'static str {
        match self {
            Self::Arx => "ARX",
            Self::Matched => "Box-Jenkins with m* = m0",
            Self::First => "Box-Jenkins with m* = 1",
        }
    }

    /// Index of the method, which determines the hue.
    pub(super) fn method_index(self) -> usize {
        usize::from(self != Self::Arx)
    }

    /// Restricts a query to this estimator in the study of biases.
    pub(super) fn restrict(self, query: Query, remnant_order: usize) -> Query {
        match self {
            Self::Arx => query.name("ARX"),
            Self::Matched => query.name("BJ").nd(remnant_order),
            Self::First => query.name("BJ").nd(1),
        }
    }
}

/// Group of parameters shown in a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Parameters {
    Discrete,
    Operator,
    Remnant,
}

/// A parameter: its name in the study for ARX, its name for Box-Jenkins, its symbol, and its name in the table.
type Row = (&'static str, &'static str, &'static str, &'static str);

const DISCRETE: [Row; 4] = [
    ("a1", "f1", "a_1", "a1"),
    ("a2", "f2", "a_2", "a2"),
    ("b0", "b0", "b_0", "b0"),
    ("b1", "b1", "b_1", "b1"),
];
const OPERATOR: [Row; 5] = [
    ("K_e", "K_e", "K_e", "K_e"),
    ("T_L", "T_L", "T_L", "T_L"),
    ("K_e_dot", "K_e_dot", "K_{\u{117}}", "K_e_dot"),
    ("omega_nm", "omega_nm", "\u{3c9}_{nm}", "omega_nm"),
    ("zeta_nm", "zeta_nm", "\u{3b6}_{nm}", "zeta_nm"),
];
const REMNANT: [Row; 4] = [
    ("d1", "d1", "d_1", "d1"),
    (
        "innovation_variance",
        "innovation_variance",
        "\u{3c3}_\u{3b5}^2",
        "innovation variance",
    ),
    ("T_n_backward_euler", "T_n_backward_euler", "T_n", "T_n"),
    ("K_n_backward_euler", "K_n_backward_euler", "K_n", "K_n"),
];

impl Parameters {
    fn rows(self) -> &'static [Row] {
        match self {
            Self::Discrete => &DISCRETE,
            Self::Operator => &OPERATOR,
            Self::Remnant => &REMNANT,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Discrete => "discrete parameters",
            Self::Operator => "operator parameters",
            Self::Remnant => "remnant parameters",
        }
    }
}

/// Limit, in %, up to which an ordinate is linear if [`has_large_biases`] is true.
const LINEAR_LIMIT_PERCENT: f64 = 10.0;

/// True if biases may reach thousands of times the true value: the remnant parameters of a first-order noise model
/// differ from the parameters of a higher-order remnant.
fn has_large_biases(model: Model, remnant_order: usize, letters: &str) -> bool {
    model == Model::First && remnant_order > 1 && matches!(letters, "innovation variance" | "T_n" | "K_n")
}

pub(super) fn items() -> Vec<Item> {
    use Model::{Arx, First, Matched};
    use Parameters::{Discrete, Operator, Remnant};
    let mut all = vec![
        item("fig-5", "C1", Arx, Discrete),
        item("fig-6", "C1", Matched, Discrete),
        item("fig-9", "C1", First, Discrete),
    ];
    let of_condition = [
        (Arx, Discrete),
        (Arx, Operator),
        (Matched, Discrete),
        (Matched, Operator),
        (Matched, Remnant),
        (First, Discrete),
        (First, Operator),
        (First, Remnant),
    ];
    for (condition, first) in [("C1", 1), ("C2", 9)] {
        for (i, (model, parameters)) in of_condition.into_iter().enumerate() {
            all.push(item(&format!("C.{}", first + i), condition, model, parameters));
        }
    }
    all
}

fn item(name: &str, condition: &'static str, model: Model, parameters: Parameters) -> Item {
    let mut caption = "Relative bias by delay nk* and noise level P_n, remnant orders m0 = 1 to 4. Boxes: quartiles; \
                       whiskers: the last run within 1.5 interquartile ranges; triangles: number of runs outside the \
                       panel; cross: no run gives a value. Without remnant all runs are identical and give a single \
                       line. True nk = 29."
        .to_owned();
    if parameters == Parameters::Remnant {
        caption.push_str(
            " T_n and K_n use the backward Euler form of the thesis (B.14, B.16); d1 and the innovation variance are compared with those of the exactly held filter.",
        );
        if model == Model::First {
            caption
                .push_str(" For m0 >= 2 the vertical axes of the last three are linear to 10 % and logarithmic above.");
        }
    }
    Item::from_study(
        name,
        format!("Bias of {}, {}, condition {condition}", parameters.name(), model.name()),
        caption,
        "bias",
        move |item, results| make(item, results, condition, model, parameters),
    )
}

fn make(item: &Item, results: &Results, condition: &str, model: Model, parameters: Parameters) -> ItemOutput {
    // Without a remnant, the parameters of the remnant have no true values.
    let levels = if parameters == Parameters::Remnant {
        &NOISE_LEVELS[1..]
    } else {
        &NOISE_LEVELS[..]
    };
    let mut data = TableBuilder::new(
        &["parameter", "outliers"],
        &[
            "remnant_order",
            "nk",
            "noise_level",
            "runs",
            "lower_whisker",
            "lower_quartile",
            "median",
            "upper_quartile",
            "upper_whisker",
        ],
    );
    let mut panels = Vec::new();
    for (arx, bj, symbol, letters) in parameters.rows() {
        let column = if model == Model::Arx { arx } else { bj };
        for m0 in REMNANT_ORDERS {
            let mut boxes = Vec::new();
            for nk in DELAYS {
                let mut group = Vec::new();
                for &level in levels {
                    let query = Query::of(&format!("bias_{column}"))
                        .condition(condition)
                        .remnant_order(m0);
                    let query = model.restrict(query.noise_level(level).nk(nk), m0);
                    let s = BoxStatistics::of(&results.values(&query));
                    let outliers: Vec<String> = s.outliers.iter().map(f64::to_string).collect();
                    data.add_row(
                        &[letters, &outliers.join(" ")],
                        &[
                            m0 as f64,
                            nk as f64,
                            level,
                            s.count as f64,
                            s.lower_whisker,
                            s.lower_quartile,
                            s.median,
                            s.upper_quartile,
                            s.upper_whisker,
                        ],
                    );
                    group.push(s);
                }
                boxes.push(group);
            }
            panels.push(BoxPanel {
                name: format!("B_r({symbol})"),
                unit: "%".to_owned(),
                boxes,
                linear_limit: has_large_biases(model, m0, letters).then_some(LINEAR_LIMIT_PERCENT),
                ..BoxPanel::default()
            });
        }
    }
    let grid = BoxGrid {
        panels,
        columns: REMNANT_ORDERS.len(),
        titles: order_titles(),
        abscissa: "n_k^*".to_owned(),
        groups: DELAYS.iter().map(usize::to_string).collect(),
        series: levels
            .iter()
            .map(|level| BoxSeries {
                name: level_name(*level),
                shade: Shade {
                    method: model.method_index(),
                    level: NOISE_LEVELS.iter().position(|l| l == level).unwrap_or(0),
                    levels: NOISE_LEVELS.len(),
                },
            })
            .collect(),
        range: BoxRange::Whiskers,
        shared_ordinates: false,
        with_zero: true,
        min_half_range: 0.1,
    };
    item.draw(box_plots, &grid, data)
}
