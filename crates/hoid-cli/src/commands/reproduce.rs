//! `hoid reproduce`: the tables, figures and claims of the thesis.

use std::sync::atomic::Ordering;

use hoid::thesis::{
    ThesisError,
    reproduction::{CLAIMS_NAME, Reproduction, ReproductionEvent, items, reproduce},
};

use super::{output_paths, study::stop_at_interrupt};
use crate::{args::ReproduceArgs, error::CliError, output};

pub fn run(args: &ReproduceArgs) -> Result<(), CliError> {
    if args.list {
        let items = items().into_iter().map(|item| (item.name, item.title));
        let claims = (
            CLAIMS_NAME.to_owned(),
            "Statements of the thesis and the evidence from the data".to_owned(),
        );
        let lines = items
            .chain([claims])
            .map(|(name, title)| format!("{name:26} {title}\n"));
        output::print(&lines.collect::<String>())?;
        return Ok(());
    }
    output_paths::check(&[], &[], &[Some(&args.out)])?;
    let wanted = Reproduction {
        only: args.only.clone(),
        replications: args.replications,
        jobs: args.jobs.map(usize::from),
        recordings: args.recordings.clone(),
    };
    let stopped = stop_at_interrupt();
    let bar = output::progress_bar(0, "estimates");
    let tell = |event: ReproductionEvent<'_>| match event {
        ReproductionEvent::Progress(progress) => {
            bar.set_length(progress.total);
            bar.set_position(progress.done);
        }
        ReproductionEvent::Study(study) => {
            let took = study
                .seconds
                .map_or("already present".to_owned(), |s| format!("{s:.1} s"));
            bar.suspend(|| output::print_message(&format!("{:22} {} estimates, {took}", study.name, study.estimates)));
            bar.reset();
        }
        ReproductionEvent::Note(note) => bar.suspend(|| output::print_message(&format!("warning: {note}"))),
    };
    let found = reproduce(&wanted, &args.out, &tell, &|| !stopped.load(Ordering::Relaxed));
    bar.finish_and_clear();
    let found = found.map_err(|error| match error {
        ThesisError::UnknownItem { name, .. } => CliError::Usage(format!(
            "--only {name}: no table, figure or study has this name; `hoid reproduce --list` lists them"
        )),
        ThesisError::NotTheExperiment => CliError::Usage(
            "--recordings applies only to the experiment: add --only experiment, and no other name".to_owned(),
        ),
        ThesisError::Study(error) => CliError::Study(*error),
        other => other.into(),
    })?;
    let Some(found) = found else {
        return Err(CliError::Stopped(format!(
            "the reproduction was stopped; completed parts are in {}; run the same command again to resume it",
            args.out.display()
        )));
    };
    if let Some([hold, more_so, in_part, not, untestable]) = found.verdict_counts {
        output::print(&format!(
            "{} claims: {hold} hold, {more_so} hold more strongly, {in_part} hold in part, {not} do not hold, \
             {untestable} cannot be tested\n",
            hold + more_so + in_part + not + untestable
        ))?;
    }
    let (simulated_s, drawn_s) = (found.simulation_time_s, found.drawing_time_s);
    output::print(&format!(
        "{} tables and figures in {:.1} s: {simulated_s:.1} s for the studies, {drawn_s:.1} s for drawing\n  {}\n",
        found.items,
        simulated_s + drawn_s,
        found.index.display()
    ))?;
    Ok(())
}
