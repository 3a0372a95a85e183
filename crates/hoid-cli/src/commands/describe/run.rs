//! Execution of `hoid describe`: reading, describing function, figure, output.

use std::path::{Path, PathBuf};

use hoid::analysis::{DescribingFunctionOptions, without_offsets};
use hoid::ident::frequency::RecordDescriptionOptions;
use hoid::report::figures;
use serde_json::Value;

use super::form::DescriptionReport;
use crate::{
    args::DescribeArgs,
    commands::{figure, output_paths, paper_table, reading},
    error::CliError,
    json, output,
};

pub fn run(args: &DescribeArgs) -> Result<(), CliError> {
    if let Some(path) = &args.picture.figure {
        figure::check(path)?;
    }
    let inputs: Vec<&Path> = args.records.iter().map(PathBuf::as_path).collect();
    paper_table::check(&args.show)?;
    output_paths::check(
        &inputs,
        &[args.picture.figure.as_deref(), args.show.table.as_deref()],
        &[],
    )?;
    let (reading, offsets) = without_offsets(&reading::of(&args.read, Some(&args.mask), true)?);
    let read = reading.read_files(&args.records, reading::report_problems)?;
    let describing = DescribingFunctionOptions {
        options: RecordDescriptionOptions {
            excitation: args.excitation.clone(),
            lines_rad_s: args.lines.clone(),
            period_s: args.period,
            controlled_element: args.controlled_element.clone(),
            // The span was selected and the trend removed when the records were read.
            ..RecordDescriptionOptions::default()
        },
        offsets,
        faults: args.faults.faults,
        rate: args.read.prepare.rate.decimate,
    };
    let described = describing.run(read)?;
    let shown = DescriptionReport {
        described: &described,
        element: args.controlled_element.as_ref(),
    };
    if let Some(path) = &args.picture.figure {
        figure::write(
            path,
            &figures::describing("describing", &shown.title(), &described.found, &[]),
            args.picture.width,
        )?;
    }
    paper_table::write(&args.show, || Ok(described.json()))?;
    if args.show.json {
        json::print(&Value::Object(described.json()))?;
    } else {
        output::show(&shown.page(args.show.verbose))?;
    }
    CliError::check_verdict(&described.found.verdict)
}
