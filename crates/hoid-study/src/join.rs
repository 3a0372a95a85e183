//! Joins the parts of a study into its tables.

use std::path::Path;

use hoid_io::TableWriter;

use crate::{
    Plan, StudyError,
    block::blocks,
    columns::Schemas,
    directory::{part_path, table_path},
    summary::{self, PartsOfCell},
    truth::cells_table,
};

/// Writes the tables of a study from its parts, in the order of the blocks.
pub(crate) fn join(
    plan: &Plan,
    schemas: &Schemas,
    parts: &[(&Path, u64)],
    directory: &Path,
    csv: bool,
) -> Result<(), StudyError> {
    let all = blocks(plan);
    let mut of_cell = PartsOfCell::new();
    for (from, block) in parts {
        of_cell
            .entry(all[*block as usize].cell)
            .or_default()
            .push((*from, *block));
    }
    hoid_io::write_table(&table_path(directory, "cells", csv), &cells_table(plan))?;
    let medians = summary::write_traces(plan, schemas, &of_cell, &table_path(directory, "trace-summary", csv))?;
    summary::write_fits(
        plan,
        schemas,
        &of_cell,
        &medians,
        &table_path(directory, "summary", csv),
    )?;
    let points = schemas.traces.as_ref().filter(|_| plan.trace_points);
    for (table, schema) in [("fits", Some(&schemas.fits)), ("traces", points)] {
        let Some(schema) = schema else { continue };
        let mut writer = TableWriter::create(&table_path(directory, table, csv), schema)?;
        for (from, block) in parts {
            writer.append(&hoid_io::read_table(&part_path(from, *block, table))?)?;
        }
        writer.finish()?;
    }
    Ok(())
}
