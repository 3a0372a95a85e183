//! Box plots of quantities by remnant order, group and series.

use hoid_report::figures::{BoxGrid, BoxPanel, BoxRange, BoxSeries, BoxStatistics, box_plots};
use hoid_study::{Query, Results};

use super::super::{
    axes::{REMNANT_ORDERS, order_titles},
    item::{Item, ItemOutput},
    table_builder::TableBuilder,
};

/// Rows, groups and series of box plots.
#[derive(Clone, Copy)]
pub(super) struct Layout<'a> {
    /// Quantity and label of each row of panels.
    pub rows: &'a [(String, String)],
    pub abscissa: &'a str,
    pub groups: &'a [&'a str],
    pub series: &'a [BoxSeries],
    pub with_zero: bool,
}

/// Draws box plots of quantities by remnant order, group and series.
pub(super) fn boxes(
    item: &Item,
    results: &Results,
    layout: &Layout<'_>,
    query: impl Fn(&str, usize, &str, usize) -> Query,
) -> ItemOutput {
    let Layout {
        rows,
        abscissa,
        groups,
        series,
        with_zero,
    } = *layout;
    let mut data = TableBuilder::new(
        &["quantity", "group", "series"],
        &[
            "remnant_order",
            "runs",
            "lower_whisker",
            "lower_quartile",
            "median",
            "upper_quartile",
            "upper_whisker",
        ],
    );
    let mut panels = Vec::new();
    for (quantity, label) in rows {
        for m0 in REMNANT_ORDERS {
            let mut of_panel = Vec::new();
            for group in groups {
                let mut of_group = Vec::new();
                for (i, of) in series.iter().enumerate() {
                    let s = BoxStatistics::of(&results.values(&query(quantity, m0, group, i)));
                    data.add_row(
                        &[quantity, group, &of.name],
                        &[
                            m0 as f64,
                            s.count as f64,
                            s.lower_whisker,
                            s.lower_quartile,
                            s.median,
                            s.upper_quartile,
                            s.upper_whisker,
                        ],
                    );
                    of_group.push(s);
                }
                of_panel.push(of_group);
            }
            panels.push(BoxPanel {
                name: label.clone(),
                unit: "%".to_owned(),
                boxes: of_panel,
                ..BoxPanel::default()
            });
        }
    }
    let grid = BoxGrid {
        panels,
        columns: REMNANT_ORDERS.len(),
        titles: order_titles(),
        abscissa: abscissa.to_owned(),
        groups: groups.iter().map(|g| (*g).to_owned()).collect(),
        series: series.to_vec(),
        range: BoxRange::Whiskers,
        shared_ordinates: false,
        with_zero,
        min_half_range: 0.0,
    };
    item.draw(box_plots, &grid, data)
}
