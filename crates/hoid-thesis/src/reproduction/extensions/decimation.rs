//! Error of the frequency response as a function of the sample time, with whole, fractional and Padé delays.

use hoid_report::figures::{CurveGrid, CurvePanel, Shade, curves};
use hoid_study::{Query, Results};

use super::{
    super::{
        item::{Item, ItemOutput},
        table_builder::TableBuilder,
    },
    quartiles::with_quartiles,
};

pub(super) fn items() -> Vec<Item> {
    vec![Item::from_study(
        "decimation",
        "Error of the frequency response by sample time, condition C1, P_n = 0.1",
        "Median over the runs of the relative error of the response at the lines of the forcing function; bars: \
         quartiles. The fits use every k-th sample of runs at 100 Hz; the delay is 0.28 s.",
        "decimation",
        decimation,
    )]
}

fn decimation(item: &Item, results: &Results) -> ItemOutput {
    const ESTIMATORS: [&str; 7] = [
        "ARX",
        "BJ, whole delay",
        "BJ, fractional delay",
        "BJ, Pade 1",
        "BJ, Pade 2",
        "BJ, Pade 3",
        "grey box",
    ];
    let mut data = TableBuilder::new(
        &["estimator"],
        &[
            "remnant_order",
            "sample_time_s",
            "lower_quartile",
            "median",
            "upper_quartile",
        ],
    );
    let orders = [1, 2];
    let mut panels = Vec::new();
    for m0 in orders {
        let mut drawn = Vec::new();
        for (i, name) in ESTIMATORS.into_iter().enumerate() {
            let mut points = Vec::new();
            for k in 1..=8 {
                if let Some(row) =
                    results.find_one(&Query::of("response_error").remnant_order(m0).name(name).decimate(k))
                {
                    let s = &row.statistics;
                    data.add_row(
                        &[name],
                        &[m0 as f64, 0.01 * k as f64, s.lower_quartile, s.median, s.upper_quartile],
                    );
                    points.push((0.01 * k as f64, row));
                }
            }
            // Colours: blue for ARX, vermillion and orange for Box-Jenkins with a whole and a fractional delay, shades
            // of purple for Padé delays, green for the grey box.
            let of = |method, level, levels| Shade { method, level, levels };
            let shade = match i {
                0 => of(0, 0, 1),
                1 => of(1, 1, 1),
                2 => of(4, 2, 1),
                3..=5 => of(3, i - 3, 3),
                _ => of(2, 3, 1),
            };
            drawn.push(with_quartiles(name, shade, &points));
        }
        panels.push(CurvePanel {
            name: "response error".to_owned(),
            unit: "%".to_owned(),
            logarithmic: true,
            ordinate_range: None,
            curves: drawn,
        });
    }
    let grid = CurveGrid {
        panels,
        columns: orders.len(),
        titles: orders.iter().map(|m| format!("m^0 = {m}")).collect(),
        abscissa: "T_s (s)".to_owned(),
        logarithmic_abscissa: false,
        shared_ordinates: true,
    };
    item.draw(curves, &grid, data)
}
