//! The columns of a file of any format, before they form a record: interpretation of the cells, and
//! selection of the columns.
//!
//! | module | contents |
//! |---|---|
//! | `columns` | [`Table`]: the columns of a file, and why a value of them cannot be used |
//! | `cell` | [`Cell`]: numbers with a point or a comma, the words for a missing value |
//! | `precision` | [`Precision`]: the number of digits with which a column is printed |
//! | `column_expression` | [`ColumnExpression`]: choice of the input and output columns |
//! | `selection` | the columns that are kept, if not all are |
//! | `common_names` | error and control, recognised by common column names |

mod cell;
pub(crate) mod column_expression;
mod columns;
mod common_names;
mod precision;
mod selection;

pub(crate) use cell::{Cell, DECIMAL_COMMA, has_decimal_comma, with_decimal_point};
pub use column_expression::ColumnExpression;
pub(crate) use column_expression::Signal;
pub(crate) use columns::{Column, Source, Table, UNITS_ROW, asides, check_names, check_number, kept};
pub use common_names::{control_among, error_among};
pub(crate) use precision::Precision;
pub(crate) use selection::{check_selected, selected};
