//! The figures of the report, each as one SVG text.
//!
//! All are drawn 420 units wide with 13-unit text: 7.5 pt in a column of 85 mm. Colours are those of Okabe and Ito
//! (*Color Universal Design*, 2008), on white. The same data give the same bytes. `id` must be different for figures that stand
//! on one page: it is the prefix of all ids inside the SVG.

mod axes;
mod bode;
mod correlation;
mod panel;
mod series;
mod style;
mod time_response;
mod trace;

pub use bode::{BodeModel, TrueResponse, bode};
pub use correlation::{autocorrelation, cross_correlation};
pub use panel::{Beyond, CurveKind, Ordinate, TraceCurve, TracePanel};
pub(crate) use series::quantile_of;
pub(crate) use time_response::has_close_up;
pub use time_response::time_response;
pub use trace::{TraceGrid, trace_panels};
