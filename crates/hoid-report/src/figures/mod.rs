//! The figures of reports and studies, each as an SVG text.
//!
//! | function | figure |
//! |---|---|
//! | [`bode`] | frequency response of fitted models with 95 % bands |
//! | [`autocorrelation`], [`cross_correlation`] | tests of the residuals |
//! | [`time_response`] | measured, predicted and simulated output |
//! | [`trace_panels`] | estimates over time, by method and level: recursions, batch fits, truth |
//! | [`box_plots`] | the spread of the results of many runs, in groups and series |
//! | [`maps`] | a value over two orders as coloured cells |
//! | [`bode_grid`] | several responses in each of several Bode pairs |
//! | [`describing`] | a describing function with its errors and coherence, models through it |
//! | [`responses`] | frequency responses to several inputs, with 95 % bands |
//! | [`people_by_condition`] | estimates of people by condition, with the mean and its interval |
//! | [`curves`] | any other curves, with bands, error bars, markers and stems |
//! | [`FigureFormat`], [`with_width_mm`] | such a text as SVG, PDF or PNG, in its width on paper |
//!
//! Figures are 420 units wide, or 840 with several columns of panels, with 13-unit text: 7.5 pt in
//! a column of 85 mm and on a page of 170 mm, subscripts 7.0 pt. Dashed black lines are true
//! values, dots are batch fits. Colours are those of Okabe and Ito (*Color Universal Design*,
//! 2008), on white: the hue represents the method, its shade the level, black the truth; see
//! [`Shade`]. In names and titles, `_` and `^` before a character or braces make subscripts and
//! superscripts. Non-finite values are gaps. The same data give the same bytes. `id` must be
//! different for figures on the same page: it is the prefix of all ids inside the SVG.

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
pub use describing::{ModelCurve, describing};
pub use file::{DPI, FigureFormat, with_width_mm};
pub use maps::{MapGrid, MapPanel, maps};
pub use palette::{Shade, shade};
pub use panel::{Beyond, CurveKind, Ordinate, TraceCurve, TracePanel};
pub use people::{PeopleGrid, PeoplePanel, PersonAt, people_by_condition};
pub use responses::{InputResponse, responses};
pub(crate) use time_response::has_close_up;
pub use time_response::time_response;
pub use trace::{TraceGrid, trace_panels};
