//! The columns of a file of any format, before they form a record: interpretation of cells and selection of columns.
//!
//! | module | contents |
//! |---|---|
//! | `columns` | [`Table`]: the columns of a file, and the reasons why a value cannot be used |
//! | `cell` | [`Cell`]: numbers with a decimal point or comma, missing values, text |
//! | `interpolation` | linear interpolation between two values |
//! | `precision` | [`Precision`]: the number of digits with which a column is printed |
//! | `column_expression` | [`ColumnExpression`]: choice of the input and output columns |
//! | `column_option` | [`ColumnOption`]: the option with which a column was requested |
//! | `selection` | selection of the columns that are kept |
//! | `common_names` | recognition of the error and the control by common column names |

mod cell;
pub(crate) mod column_expression;
mod column_option;
mod columns;
mod common_names;
mod interpolation;
mod precision;
mod selection;

pub(crate) use cell::{Cell, DECIMAL_COMMA_REMEDY, has_decimal_comma, with_decimal_point};
pub use column_expression::ColumnExpression;
pub(crate) use column_expression::Signal;
pub use column_option::ColumnOption;
pub(crate) use columns::{
    Column, Source, Table, UNITS_ROW_REMEDY, check_column_count, check_names, keep_rows, read_comments,
};
pub use common_names::{find_control_column, find_error_column};
pub(crate) use interpolation::interpolate;
pub(crate) use precision::Precision;
pub(crate) use selection::{check_selected, select_columns};
