//! One quantity over time, and the range of its ordinate.
//!
//! An estimate that briefly leaves its normal range (such as T_L where K_e nearly vanishes) must not compress the scale
//! for all other values. The ordinate therefore covers the true values, the batch fits and the estimates between their
//! 10 and 90 % quantiles. The ordinate extends beyond this range, by at most one and a half times the range on either
//! side, to include the 1 and 99 % quantiles and the middle part of the bands. If a true value is known and at least
//! one method is near it, methods far from it do not determine the scale either: the ordinate ends at most two spans
//! from the true values, where a span is the range of the true values or a quarter of their magnitude, and methods and
//! batch fits beyond are ignored. Values outside the ordinate are cut off at the axes, and
//! [`TracePanel::rows_beyond_axes`] counts them.

use hoid_numerics::statistics::{finite_quantile, quantile, sorted_finite_values};

use super::{axes::round_to_one_two_five, style};

/// Largest extension of an ordinate beyond its middle part, as a multiple of the range of that part.
const MAX_EXTENSION: f64 = 1.5;

/// Style of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurveKind {
    /// Estimate: a line in the colour of its method, with a band.
    Estimate,
    /// True value: a thin dashed black line.
    Truth,
    /// Batch fit over a span: a dotted line in the colour of its method.
    Batch,
    /// A count that is constant until the next row, as steps in the colour of its method.
    Steps,
    /// Bound of the expected range: a thin black line without an entry in the legend.
    Bound,
}

/// One curve of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceCurve {
    /// Line style.
    pub kind: CurveKind,
    /// Index of the method, which determines the colour.
    pub method: usize,
    /// Index of the level in the grid, which determines the shade; unused if the grid has no levels.
    pub level: usize,
    /// Times (s) in ascending order.
    pub times_s: Vec<f64>,
    /// One value for each time. Non-finite values leave gaps.
    pub values: Vec<f64>,
    /// Lower and upper edges of the band at each time; empty if there is no band.
    pub band: Vec<(f64, f64)>,
}

/// Range of the ordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ordinate {
    /// From quantiles, as described in the documentation of this module.
    Robust,
    /// A given range with a small margin.
    Within(f64, f64),
    /// Logarithmic, from the 1 % to the 99 % quantile.
    Logarithmic,
}

/// Number of rows of a method that lie beyond the axes of a panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RowsBeyondAxes {
    /// Index of the method.
    pub method: usize,
    /// Number of rows with an estimate beyond the axes.
    pub outside: usize,
    /// Number of rows with an estimate.
    pub rows: usize,
}

/// One quantity over time.
#[derive(Debug, Clone, PartialEq)]
pub struct TracePanel {
    /// Name. Parameters of the operator, such as `K_e`, and coefficients, such as `b0`, are written with subscripts;
    /// other names are unchanged.
    pub name: String,
    /// Unit; empty if there is none.
    pub unit: String,
    /// The curves, drawn over all bands in this order.
    pub curves: Vec<TraceCurve>,
    /// Range of the ordinate.
    pub ordinate: Ordinate,
}

impl TracePanel {
    fn pooled_values(&self, pick: impl Fn(&TraceCurve) -> Vec<f64>) -> Vec<f64> {
        self.curves.iter().flat_map(pick).collect()
    }

    /// Returns the range of the ordinate.
    pub fn range(&self) -> (f64, f64) {
        match self.ordinate {
            Ordinate::Robust => self.robust_range(),
            Ordinate::Within(low, high) => style::padded_range([low, high]),
            Ordinate::Logarithmic => {
                let positive = sorted_finite_values(
                    self.pooled_values(|c| c.values.iter().copied().filter(|v| *v > 0.0).collect()),
                );
                match (quantile(&positive, 0.01), quantile(&positive, 0.99)) {
                    (Some(low), Some(high)) => (
                        round_to_one_two_five(low, false),
                        round_to_one_two_five(high * 1.05, true),
                    ),
                    _ => (0.1, 1.0),
                }
            }
        }
    }

    fn robust_range(&self) -> (f64, f64) {
        let limit = self.limits();
        let within = |v: f64| limit.map_or(v, |(low, high)| v.clamp(low, high));
        let near = |v: f64| within(v) == v;
        let (mut core, mut wanted) = (Vec::new(), Vec::new());
        for curve in &self.curves {
            let values = sorted_finite_values(curve.values.iter().copied());
            if curve.kind != CurveKind::Estimate {
                core.extend(values.into_iter().filter(|v| near(*v)));
                continue;
            }
            if !quantile(&values, 0.5).is_some_and(near) {
                continue;
            }
            core.extend([0.1, 0.9].iter().filter_map(|q| quantile(&values, *q)));
            wanted.extend([0.01, 0.99].iter().filter_map(|q| quantile(&values, *q)));
            wanted.extend(quantile(&sorted_finite_values(curve.band.iter().map(|b| b.0)), 0.25));
            wanted.extend(quantile(&sorted_finite_values(curve.band.iter().map(|b| b.1)), 0.75));
        }
        let (low, high) = style::padded_range(core.into_iter().map(within));
        let more = MAX_EXTENSION * (high - low);
        let reach = wanted.into_iter().map(|v| within(v).clamp(low - more, high + more));
        let (low, high) = reach.fold((low, high), |(l, h), v| (l.min(v), h.max(v)));
        style::padded_range([low, high])
    }

    /// Limits of the ordinate, two spans to either side of the true values; `None` if the median of no estimate lies
    /// between them.
    fn limits(&self) -> Option<(f64, f64)> {
        let of = |kind| self.curves.iter().filter(move |c| c.kind == kind);
        let truth = sorted_finite_values(of(CurveKind::Truth).flat_map(|c| c.values.iter().copied()));
        let (least, most) = (*truth.first()?, *truth.last()?);
        let span = (most - least).max(0.25 * least.abs().max(most.abs()));
        let (low, high) = (least - 2.0 * span, most + 2.0 * span);
        let near = |c: &TraceCurve| finite_quantile(&c.values, 0.5).is_some_and(|m| (low..=high).contains(&m));
        of(CurveKind::Estimate).any(near).then_some((low, high))
    }

    /// Returns the methods with rows beyond the range of this panel, which is the drawn range unless the panel shares
    /// its ordinate with others.
    pub fn rows_beyond_axes(&self) -> Vec<RowsBeyondAxes> {
        let (low, high) = self.range();
        let estimates = self.curves.iter().filter(|c| c.kind == CurveKind::Estimate);
        let count = |c: &TraceCurve| {
            let finite = || c.values.iter().filter(|v| v.is_finite());
            RowsBeyondAxes {
                method: c.method,
                outside: finite().filter(|v| !(low..=high).contains(*v)).count(),
                rows: finite().count(),
            }
        };
        estimates.map(count).filter(|b| b.outside > 0).collect()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub fn curve(kind: CurveKind, values: Vec<f64>) -> TraceCurve {
        TraceCurve {
            kind,
            method: 0,
            level: 0,
            times_s: (0..values.len()).map(|k| 0.01 * k as f64).collect(),
            values,
            band: Vec::new(),
        }
    }

    pub fn panel(curves: Vec<TraceCurve>) -> TracePanel {
        TracePanel {
            name: "T_L".to_owned(),
            unit: "s".to_owned(),
            curves,
            ordinate: Ordinate::Robust,
        }
    }

    #[test]
    fn excursions_do_not_widen_the_ordinate() {
        let mut values: Vec<f64> = (0..1000).map(|k| 1.0 + 0.1 * (f64::from(k) * 0.1).sin()).collect();
        let quiet = panel(vec![curve(CurveKind::Estimate, values.clone())]).range();
        for k in 500..530 {
            values[k] = -1e6;
        }
        let with = panel(vec![curve(CurveKind::Estimate, values.clone())]);
        let (low, high) = with.range();
        // The ordinate extends below the middle part by at most one and a half times its range, plus a margin of 5 %.
        assert!(low > 0.3 && high < quiet.1 + 0.1, "{low} {high}");
        let expected = RowsBeyondAxes {
            method: 0,
            outside: 30,
            rows: 1000,
        };
        assert_eq!(with.rows_beyond_axes(), [expected]);
        // The range always includes all true values.
        let truth = vec![1.0, 1.0, -0.5, 1.0];
        let (low, _) = panel(vec![curve(CurveKind::Estimate, values), curve(CurveKind::Truth, truth)]).range();
        assert!(low < -0.5);
    }

    #[test]
    fn distant_estimates_do_not_widen_the_ordinate() {
        let truth = || curve(CurveKind::Truth, vec![11.25; 100]);
        let near = curve(
            CurveKind::Estimate,
            (0..100).map(|k| 11.0 + 0.005 * f64::from(k)).collect(),
        );
        let far = curve(CurveKind::Estimate, vec![60.0; 100]);
        let (low, high) = panel(vec![near, far.clone(), truth()]).range();
        assert!(low > 9.0 && high < 13.0, "{low} {high}");
        // A single method determines the range.
        let (low, high) = panel(vec![far, truth()]).range();
        assert!(low < 11.25 && high > 60.0);
    }
}
