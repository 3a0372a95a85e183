//! Table of the data of a figure.

use hoid_io::{ColumnValues, OutputColumn, OutputTable};

/// A table with named columns of text and numbers that is built row by row.
pub(super) struct TableBuilder {
    texts: Vec<(&'static str, Vec<String>)>,
    numbers: Vec<(&'static str, Vec<f64>)>,
}

impl TableBuilder {
    pub fn new(texts: &[&'static str], numbers: &[&'static str]) -> Self {
        Self {
            texts: texts.iter().map(|name| (*name, Vec::new())).collect(),
            numbers: numbers.iter().map(|name| (*name, Vec::new())).collect(),
        }
    }

    pub fn add_row(&mut self, texts: &[&str], numbers: &[f64]) {
        for ((_, column), text) in self.texts.iter_mut().zip(texts) {
            column.push((*text).to_owned());
        }
        for ((_, column), number) in self.numbers.iter_mut().zip(numbers) {
            column.push(*number);
        }
    }

    pub fn build(self, comment: &str) -> OutputTable {
        let texts = self.texts.into_iter().map(|(name, values)| OutputColumn {
            name: name.to_owned(),
            values: ColumnValues::Text(values),
        });
        let numbers = self.numbers.into_iter().map(|(name, values)| OutputColumn {
            name: name.to_owned(),
            values: ColumnValues::Real(values),
        });
        OutputTable {
            comments: vec![comment.to_owned()],
            columns: texts.chain(numbers).collect(),
        }
    }
}
