//! Joins the parts of the runs into the tables of a group.
//!
//! The traces of 1000 runs do not fit into memory, so they are averaged for one person in one condition at a time.

use std::{collections::BTreeMap, path::Path};

use hoid_io::{OutputTable, TableSchema, TableWriter};

use super::{
    analysis::PEOPLE_TABLE,
    averages::{Averages, Delays, TraceAverages},
    block::Block,
    frequency,
    manifest::Manifest,
    person::{Person, people_table, read_people},
    reading,
    responses::{self, ResponseAverages},
    run_rows::estimates_schema,
    settling::Settling,
    tables::{numbers, texts},
    traces::TraceColumns,
};
use crate::{
    StudyError,
    directory::{part_path, table_path},
};

/// The writers of a table, one for each file format.
struct TableWriters(Vec<TableWriter>);

impl TableWriters {
    fn append(&mut self, table: &OutputTable) -> Result<(), StudyError> {
        Ok(self.0.iter_mut().try_for_each(|writer| writer.append(table))?)
    }

    fn finish(self) -> Result<(), StudyError> {
        Ok(self.0.into_iter().try_for_each(TableWriter::finish)?)
    }
}

/// A run of a person in a condition.
struct RunOfCell {
    block: usize,
    /// Time at which the task changes, s.
    change_s: Option<f64>,
}

/// Joins the parts into the tables, as Parquet and, if `csv` is set, also as CSV.
pub(super) fn join(
    manifest: &Manifest,
    base: &Path,
    blocks: &[Block<'_>],
    directory: &Path,
    csv: bool,
) -> Result<(), StudyError> {
    let formats: &[bool] = if csv { &[false, true] } else { &[false] };
    let writers = |table: &str, schema: &TableSchema| -> Result<TableWriters, StudyError> {
        let writer = |csv: &bool| TableWriter::create(&table_path(directory, table, *csv), schema);
        Ok(TableWriters(formats.iter().map(writer).collect::<Result<_, _>>()?))
    };
    let read = |block: usize, table: &str| hoid_io::read_table(&part_path(directory, block as u64, table));

    let (mut averages, mut delays) = (Averages::default(), Delays::default());
    let mut of_responses = ResponseAverages::default();
    let mut estimates = writers("estimates", &estimates_schema())?;
    let mut responses = writers("responses", &responses::responses_schema())?;
    // The runs of each person in each condition.
    let mut cells: BTreeMap<(&str, &str), Vec<RunOfCell>> = BTreeMap::new();
    for (block, of) in blocks.iter().enumerate() {
        let found = read(block, "estimates")?;
        averages.add(&found);
        if matches!(of, Block::Cell(_)) {
            delays.add(&found);
        }
        estimates.append(&found)?;
        if let Block::Run(run) = of {
            let cell = cells.entry((&run.subject, &run.condition)).or_default();
            cell.push(RunOfCell {
                block,
                change_s: change_time_s(&found),
            });
        }
        let found = read(block, "responses")?;
        of_responses.add(&found);
        responses.append(&found)?;
    }
    estimates.finish()?;
    responses.finish()?;

    for (table, schema) in reading::schemas() {
        // These tables are the first that users examine, so they are always written as CSV too.
        let writer = |csv: bool| TableWriter::create(&table_path(directory, table, csv), &schema);
        let mut writers = TableWriters(vec![writer(false)?, writer(true)?]);
        for (block, _) in blocks.iter().enumerate().filter(|(_, of)| matches!(of, Block::Run(_))) {
            writers.append(&read(block, table)?)?;
        }
        writers.finish()?;
    }

    let columns = TraceColumns::of(&manifest.analysis);
    let names = columns.names();
    let settle = columns.settling_columns();
    let mut traces = writers("traces", &columns.schema())?;
    let mut trace_averages = writers("trace-averages", &TraceAverages::schema(&names))?;
    let mut settlings = writers("settling", &Settling::schema())?;
    for runs in cells.values() {
        let (mut of_traces, mut settling) = (TraceAverages::new(names.clone()), Settling::default());
        for run in runs {
            let found = read(run.block, "traces")?;
            of_traces.add(&found);
            if let Some(change_s) = run.change_s {
                settling.add(&found, &settle, change_s);
            }
            traces.append(&found)?;
        }
        trace_averages.append(&of_traces.table())?;
        settlings.append(&settling.table(&of_traces))?;
    }
    for writers in [traces, trace_averages, settlings] {
        writers.finish()?;
    }

    let mut people: Vec<Person> = Vec::new();
    for (block, _) in blocks.iter().enumerate().filter(|(_, of)| matches!(of, Block::Cell(_))) {
        people.extend(read_people(&read(block, PEOPLE_TABLE)?));
    }
    let people = people_table(&people);
    for csv in [false, true] {
        hoid_io::write_table(&table_path(directory, PEOPLE_TABLE, csv), &people)?;
    }

    let mut whole = vec![
        ("averages", averages.table()),
        ("delays", delays.table()),
        ("response-averages", of_responses.table()),
    ];
    if let Some(found) = frequency::frequency_tables(manifest, base, &of_responses) {
        whole.extend([
            ("describing-functions", found.lines),
            ("frequency-margins", found.margins),
            ("agreement", found.agreement),
        ]);
    }
    for (name, table) in &whole {
        for csv in formats {
            hoid_io::write_table(&table_path(directory, name, *csv), table)?;
        }
    }
    Ok(())
}

/// Returns the time in s at which the task of a run changes, read from the estimates of the run.
fn change_time_s(estimates: &OutputTable) -> Option<f64> {
    let names = texts(estimates, "parameter");
    let row = names.iter().position(|name| name == "change_s")?;
    numbers(estimates, "value").get(row).copied()
}
