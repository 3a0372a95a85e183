//! `hoid compare`: differences between conditions and people, from recordings with their manifest or from the results
//! of a group.

use std::path::Path;

use hoid::design::compare::{Comparison, ComparisonOptions, Difference, GroupEstimates, Variation};
use hoid::model::numbers::{self, with_uncertainty};
use hoid::report::{PaperTable, comparison_figure};
use hoid::study::{RunOptions, group::Manifest};

use super::{figure, group::analyse_with_progress, output_paths, paper_table};
use crate::{args::CompareArgs, error::CliError, json, output, table::Rows, text};

/// Tables that `--out` writes, in addition to the figure and the sentences.
const TABLE_FILES: [&str; 3] = ["differences.csv", "differences.md", "differences.tex"];
const FIGURE_FILE: &str = "people.svg";
const SENTENCE_FILE: &str = "sentences.txt";
const JSON_FILE: &str = "comparison.json";

pub fn run(args: &CompareArgs) -> Result<(), CliError> {
    if let Some(figure) = &args.picture.figure {
        figure::check(figure)?;
    }
    paper_table::check(&args.show)?;
    let files = [args.picture.figure.as_deref(), args.show.table.as_deref()];
    output_paths::check(&[&args.results], &files, &[])?;
    if let Some(out) = &args.out {
        hoid::io::check_output_directory(out, &[&args.results])?;
    }
    let variation = match (args.within, args.between) {
        (true, _) => Some(Variation::Within),
        (_, true) => Some(Variation::Between),
        _ => None,
    };
    let comparing = ComparisonOptions {
        factors: args.factor.clone(),
        variation,
        quantities: args.of.clone(),
        covariate: args.covariate,
        adjustment: args.adjust,
        weights: args.weights,
    };
    let estimates = match GroupEstimates::recordings_path(&args.results) {
        Some(manifest) => estimates_from_recordings(&comparing, &manifest, args)?,
        None => GroupEstimates::read(&args.results)?,
    };
    let found = comparing.run(&estimates)?;
    if let Some(path) = &args.picture.figure {
        figure::write(path, &comparison_figure(&found), args.picture.width)?;
    }
    paper_table::write(&args.show, || Ok(found.json()))?;
    if let Some(out) = &args.out {
        write_all(&found, out)?;
    }
    if args.show.json {
        json::print(&serde_json::Value::Object(found.json()))?;
    } else {
        output::show(&page(&found, args.show.verbose))?;
    }
    CliError::check_verdict(&found.verdict)
}

/// Analyses recordings and returns the estimates. The results of the runs are written to the directory of `--out`, or
/// to a temporary directory that is removed afterwards.
fn estimates_from_recordings(
    comparing: &ComparisonOptions,
    path: &Path,
    args: &CompareArgs,
) -> Result<GroupEstimates, CliError> {
    let manifest = Manifest::read(path)?;
    let removed;
    let directory = match &args.out {
        Some(out) => out.as_path(),
        None => {
            removed = tempfile::tempdir().map_err(temporary_directory_error)?;
            removed.path()
        }
    };
    // With --out, runs that were already analysed for another comparison are reused.
    let options = RunOptions {
        jobs: args.jobs.map(usize::from),
        resume: true,
        ..RunOptions::default()
    };
    comparing.estimates_of(&manifest, directory, |manifest, place| {
        match analyse_with_progress(manifest, path, place, &options) {
            // This command has no --resume: with --out, runs already analysed are kept; otherwise they are removed.
            Err(CliError::Stopped(_)) => Err(CliError::Stopped(
                "the comparison was stopped; if --out was given, run the same command again to resume it".to_owned(),
            )),
            outcome => outcome.map(|_| ()),
        }
    })
}

fn temporary_directory_error(error: std::io::Error) -> CliError {
    CliError::Stream(format!(
        "no temporary directory can be created for the analysis ({error}): name a directory with --out"
    ))
}

fn write_all(found: &Comparison, out: &Path) -> Result<(), CliError> {
    hoid::io::make_directory(out)?;
    let write =
        |name: &str, text: &str| hoid::io::write_atomically(&out.join(name), |file| file.write_all(text.as_bytes()));
    write(JSON_FILE, &found.to_json())?;
    write(SENTENCE_FILE, &sentences(found))?;
    write(FIGURE_FILE, &comparison_figure(found))?;
    if let Some(table) = PaperTable::of(&found.json()) {
        for name in TABLE_FILES {
            table.write(&out.join(name))?;
        }
    }
    output::add_notice("", format!("results: {}", out.display()));
    Ok(())
}

fn sentences(found: &Comparison) -> String {
    found.differences.iter().map(|d| format!("{}\n", d.sentence)).collect()
}

fn page(found: &Comparison, verbose: bool) -> String {
    let mut page = format!(
        "{}\n\n{}\n",
        text::verdict(&found.verdict).trim_end(),
        difference_table(found, verbose)
    );
    page.push_str(
        "Mean over people ± standard error; weights from the standard error of each person and the variance between \
         people; Hartung-Knapp 95 % intervals.\n",
    );
    if !found.learning.is_empty() {
        page.push_str(&format!("\nChange per run\n{}\n", learning_table(found)));
    }
    if verbose {
        page.push_str(&format!(
            "\nMeans over people\n{}\n\nPeople\n{}\n",
            mean_table(found),
            people_table(found)
        ));
    }
    page.push_str(&format!("\n{}", sentences(found)));
    if verbose {
        page.push_str(&text::settings(&found.settings));
    }
    page
}

fn difference_table(found: &Comparison, verbose: bool) -> Rows {
    let all = &found.differences;
    let several = all.iter().any(|d| d.factor != all[0].factor);
    let adjusted = all.iter().any(|d| d.p_adjusted != d.estimate.p);
    let sizes: Vec<&str> = all
        .iter()
        .filter_map(|d| Some(d.effect_size.as_ref()?.name.as_str()))
        .collect();
    // If all rows have the same kind of effect size, the header contains its name.
    let size = sizes.first().filter(|name| sizes.iter().all(|other| other == *name));
    let mut header = vec!["quantity"];
    header.extend(several.then_some("factor"));
    header.extend(["levels", "difference", "95 % from", "to", "t (df)", "p"]);
    header.extend(adjusted.then_some("adjusted"));
    header.extend(verbose.then_some("BF10"));
    header.extend([size.copied().unwrap_or("size"), "n"]);
    let mut rows = text::table(&header);
    for d in all {
        let error = Some(d.estimate.standard_error);
        let digits = |v: f64| with_uncertainty(v, error).0;
        let (value, error) = with_uncertainty(d.estimate.value, error);
        let of_size = d
            .effect_size
            .as_ref()
            .map(|s| (s.name.as_str(), numbers::format_significant(s.value, 2)));
        let of_size = match (of_size, size) {
            (None, _) => String::new(),
            (Some((_, value)), Some(_)) => value,
            (Some((name, value)), None) => format!("{name} = {value}"),
        };
        let mut cells = vec![name_with_unit(d)];
        cells.extend(several.then(|| d.factor.clone()));
        cells.extend([
            format!("{} - {}", d.to, d.from),
            format!("{value} ± {error}"),
            digits(d.estimate.interval.0),
            digits(d.estimate.interval.1),
            format!(
                "{} ({})",
                numbers::format_significant(d.estimate.t, 2),
                d.degrees_of_freedom
            ),
            numbers::format_significant(d.estimate.p, 2),
        ]);
        cells.extend(adjusted.then(|| numbers::format_significant(d.p_adjusted, 2)));
        cells.extend(verbose.then(|| {
            d.bayes_factor
                .map_or_else(String::new, |factor| numbers::format_significant(factor, 2))
        }));
        cells.extend([of_size, d.people.len().to_string()]);
        rows.add_row(cells);
    }
    rows
}

fn name_with_unit(d: &Difference) -> String {
    match d.quantity.unit() {
        "" => d.quantity.to_string(),
        unit => format!("{} ({unit})", d.quantity),
    }
}

fn learning_table(found: &Comparison) -> Rows {
    let mut rows = text::table(&["quantity", "condition", "per run", "95 % from", "to", "p", "n"]);
    for l in &found.learning {
        let error = Some(l.estimate.standard_error);
        let digits = |v: f64| with_uncertainty(v, error).0;
        let (value, error) = with_uncertainty(l.estimate.value, error);
        rows.add_row([
            l.quantity.to_string(),
            l.condition.clone(),
            format!("{value} ± {error}"),
            digits(l.estimate.interval.0),
            digits(l.estimate.interval.1),
            text::format_significant(l.estimate.p),
            l.people.to_string(),
        ]);
    }
    rows
}

fn mean_table(found: &Comparison) -> Rows {
    let mut rows = text::table(&[
        "quantity",
        "condition",
        "group",
        "mean",
        "95 % from",
        "to",
        "SD between people",
        "n",
    ]);
    for m in &found.means {
        let error = Some(m.estimate.standard_error);
        let digits = |v: f64| with_uncertainty(v, error).0;
        let (value, error) = with_uncertainty(m.estimate.value, error);
        rows.add_row([
            m.quantity.to_string(),
            m.condition.clone(),
            m.group.clone(),
            format!("{value} ± {error}"),
            digits(m.estimate.interval.0),
            digits(m.estimate.interval.1),
            text::format_significant(m.tau),
            m.people.to_string(),
        ]);
    }
    rows
}

fn people_table(found: &Comparison) -> Rows {
    let mut rows = text::table(&["quantity", "person", "condition", "value", "runs"]);
    for e in &found.estimates {
        let value = match e.standard_error {
            Some(error) => {
                let (value, error) = with_uncertainty(e.value, Some(error));
                format!("{value} ± {error}")
            }
            None => text::format_significant(e.value),
        };
        let cells = [
            e.quantity.to_string(),
            e.subject.clone(),
            e.condition.clone(),
            value,
            e.runs.to_string(),
        ];
        rows.add_row(cells);
    }
    rows
}
