//! The figures of reports and studies, each as SVG text.
//!
//! | function | figure |
//! |---|---|
//! | [`bode`] | frequency response of fitted models with 95 % bands |
//! | [`autocorrelation`], [`cross_correlation`] | tests of the residuals |
//! | [`time_response`] | measured, predicted and simulated output |
//! | [`trace_panels`] | estimates over time, by method and level: recursive estimates, batch fits, true values |
//! | [`box_plots`] | scatter of the results of many runs, in groups and series |
//! | [`maps`] | a quantity as a function of two variables, as coloured cells |
//! | [`bode_grid`] | several Bode diagrams next to each other, each with several responses |
//! | [`describing`] | a describing function with its errors and coherence, and the curves of models |
//! | [`responses`] | frequency responses to several inputs, with 95 % bands |
//! | [`people_by_condition`] | estimates for people by condition, with the mean and its interval |
//! | [`curves`] | any other curves, with bands, error bars, markers and stems |
//! | [`FigureFormat`], [`with_width_mm`] | conversion of the SVG text to SVG, PDF or PNG, and its width on paper |
//!
//! Figures are 420 units wide, or 840 with several columns of panels. The text is 13 units high, which is 7.5 pt in a
//! column of 85 mm and on a page of 170 mm; subscripts have 7.0 pt. Dashed black lines are true values; dotted lines
//! are batch fits. The colours are those of Okabe and Ito (*Color Universal Design*, 2008) on white: the hue represents
//! the method, the shade the level, and black the true values; see [`Shade`]. In names and titles, `_` and `^` before a
//! character or braces mark subscripts and superscripts. Non-finite values leave gaps. Equal data give identical bytes.
//! Figures on the same page must have different values of `id`, which is the prefix of all ids inside the SVG.

mod axes;
mod bode;
mod bode_grid;
mod bode_points;
mod box_statistics;
mod boxes;
mod colour_bar;
mod correlation;
mod curves;
mod describing;
mod draw;
mod file;
mod frame;
mod labels;
mod legend;
mod maps;
mod palette;
mod panel;
mod people;
mod responses;
mod scale;
mod series;
mod style;
mod svg;
mod time_response;
mod trace;

pub use bode::{BodeModel, TrueResponse, bode, bode_with_points};
pub use bode_grid::{BodeColumn, BodeCurve, BodeGrid, bode_grid};
pub use bode_points::BodePoints;
pub use box_statistics::BoxStatistics;
pub use boxes::{BoxGrid, BoxPanel, BoxRange, BoxSeries, box_plots};
pub use colour_bar::MapColours;
pub use correlation::{autocorrelation, cross_correlation};
pub use curves::{Curve, CurveGrid, CurvePanel, LineKind, curves};
pub use describing::{ModelCurve, describing, log_spaced};
pub use file::{DPI, FigureFormat, with_width_mm};
pub use maps::{MapGrid, MapPanel, maps};
pub use palette::{Shade, shade};
pub use panel::{CurveKind, Ordinate, RowsBeyondAxes, TraceCurve, TracePanel};
pub use people::{CategoryEstimate, PeopleGrid, PeoplePanel, people_by_condition};
pub use responses::responses;
pub(crate) use time_response::has_close_up;
pub use time_response::time_response;
pub use trace::{TraceGrid, trace_panels};
