//! Summaries of a study: one row for each cell, estimator and quantity.
//!
//! The quantities are: all real columns of the table of fits that are not settings; the relative bias `bias_<p>`,
//! `100 (x - x0) / x0` in %, of theta, operator and remnant if the true value is known and constant; and the rates
//! `failed`, `not_convertible`, `converged` and `diverged`, each with its Monte Carlo error. For traces, the summary
//! gives the mean, standard deviation, quartiles and median of each parameter at each stored time;
//! `settle50_of_median_<p>` and `settle90_of_median_<p>` are the times after t_M at which the median trace has covered
//! 50 or 90 % of the step.
//!
//! Both summaries are computed from the parts of one cell at a time. If the numbers of a cell do not fit into memory,
//! its parts are read several times, each time for some of its estimators.

mod fits;
mod layout;
mod traces;

pub(crate) use fits::write_fits;
pub(crate) use layout::PartsOfCell;
pub(crate) use traces::write_traces;
