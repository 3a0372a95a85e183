//! Summaries of a study: one row for each cell, estimator and quantity.
//!
//! Quantities are all real columns of the table of fits that are not settings; `bias_<p>`, the
//! relative bias `100 (x - x0) / x0` in %, of theta, operator and remnant where the truth is known
//! and constant; and the rates `failed`, `not_convertible`, `converged` and `diverged` (mean and
//! its Monte Carlo error). Of traces each kept time has mean, standard deviation, quartiles and
//! median of each parameter; `settle50_of_median_<p>` and `settle90_of_median_<p>` are the times
//! after t_M at which the median trace has covered 50 or 90 % of the step.
//!
//! Both are computed from the parts of one cell at a time. If the numbers of a cell do not fit into
//! memory, its parts are read several times, each time for some of its estimators.

mod fits;
mod layout;
mod traces;

pub(crate) use fits::write_fits;
pub(crate) use layout::PartsOfCell;
pub(crate) use traces::write_traces;
