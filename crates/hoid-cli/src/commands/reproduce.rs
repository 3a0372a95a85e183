//! `hoid reproduce`: runs the named plans that are needed, draws tables and figures, judges the claims, writes the index page.
//!
//! Studies stand in `studies/NAME`, pictures and numbers in `figures` and `tables`. A study that is there already is taken as it is, so that
//! a reproduction that was stopped goes on.

use std::{collections::BTreeSet, path::Path, time::Instant};

use hoid_report::reproduction::{IndexPage, Item, Studies, StudyEntry, items};
use hoid_study::{
    NAMED_PLANS, NamedPlan, Results, RunOptions,
    claims::{Evidence, Verdict, claims, claims_table, findings},
};
use rayon::prelude::*;

use super::study::run_with_progress;
use crate::{args::ReproduceArgs, error::CliError, output};

pub fn run(args: &ReproduceArgs) -> Result<(), CliError> {
    let all = items();
    if args.list {
        let items = all.iter().map(|item| (item.name.as_str(), item.title.as_str()));
        let lines = items.chain([(CLAIMS, "Statements of the text, and what the data say of them")]);
        output::print(
            &lines
                .map(|(name, title)| format!("{name:26} {title}\n"))
                .collect::<String>(),
        );
        return Ok(());
    }
    let begin = Instant::now();
    let (chosen, with_claims) = chosen(all, &args.only)?;
    let mut plans: BTreeSet<&str> = chosen.iter().filter_map(|item| item.plan).collect();
    if with_claims {
        plans.extend(claims().iter().flat_map(|claim| claim.plans.iter().copied()));
    }
    let mut page = IndexPage::default();
    let mut studies = Studies::new();
    for named in NAMED_PLANS.iter().filter(|named| plans.contains(named.name)) {
        let (entry, results) = study(named, args)?;
        let took = entry.seconds.map_or("was there".to_owned(), |s| format!("{s:.1} s"));
        output::complain(&format!("{:22} {} estimates, {took}", entry.name, entry.estimates));
        page.add_study(&entry);
        studies.insert(named.name.to_owned(), results);
    }
    let simulated_s = begin.elapsed().as_secs_f64();
    for directory in ["figures", "tables"] {
        hoid_io::make_directory(&args.out.join(directory))?;
    }
    // Collected by place, so that the page does not depend on which is drawn first.
    let made: Vec<_> = chosen
        .par_iter()
        .map(|item| write(item, &studies, &args.out))
        .collect::<Result<_, CliError>>()?;
    for (item, made) in chosen.iter().zip(&made) {
        page.add(item, made.svg.as_deref(), &made.data, &made.table);
    }
    let claimed = if with_claims {
        Some(judge(&studies, &mut page, &args.out)?)
    } else {
        None
    };
    let drawn_s = begin.elapsed().as_secs_f64() - simulated_s;
    page.settings = vec![
        ("made by".to_owned(), format!("hoid {}", env!("CARGO_PKG_VERSION"))),
        ("replications of each cell".to_owned(), args.replications.to_string()),
        ("tables and figures".to_owned(), chosen.len().to_string()),
    ];
    if args.replications < NamedPlan::REPLICATIONS {
        page.notes.push(format!(
            "A quick look: with {} replications instead of {} many claims are not decided.",
            args.replications,
            NamedPlan::REPLICATIONS
        ));
    }
    let index = args.out.join("index.html");
    let html = page.html()?;
    hoid_io::write_atomically(&index, |file| file.write_all(html.as_bytes()))?;
    if let Some(text) = claimed {
        output::print(&text);
    }
    output::print(&format!(
        "{} tables and figures in {:.1} s: {simulated_s:.1} s for the studies, {drawn_s:.1} s for the drawing\n  {}\n",
        chosen.len(),
        begin.elapsed().as_secs_f64(),
        index.display()
    ));
    Ok(())
}

/// Name of the claims among tables and figures.
const CLAIMS: &str = "claims";

/// The items that were asked for, by their name, their plan or the letter of an appendix, and whether the claims were.
fn chosen(all: Vec<Item>, only: &[String]) -> Result<(Vec<Item>, bool), CliError> {
    if only.is_empty() {
        return Ok((all, true));
    }
    let means = |item: &Item, name: &str| {
        let letter = format!("{}.", name.to_ascii_uppercase());
        item.name.eq_ignore_ascii_case(name)
            || item.plan.is_some_and(|plan| plan == name)
            || (name.len() == 1 && item.name.starts_with(&letter))
    };
    let names: Vec<&str> = only.iter().map(|name| name.trim()).collect();
    if let Some(name) = names
        .iter()
        .find(|name| **name != CLAIMS && !all.iter().any(|item| means(item, name)))
    {
        return Err(CliError::Usage(format!(
            "--only {name}: no table, figure or study is called so; `hoid reproduce --list` lists them"
        )));
    }
    let items = all
        .into_iter()
        .filter(|item| names.iter().any(|name| means(item, name)));
    Ok((items.collect(), names.contains(&CLAIMS)))
}

/// Judges the claims of the text: their table, their part of the page, and how many hold.
fn judge(studies: &Studies, page: &mut IndexPage, out: &Path) -> Result<String, CliError> {
    let mut evidence = Evidence::new();
    for results in studies.values() {
        evidence.add(results);
    }
    let findings = findings(&evidence);
    hoid_io::write_table(&out.join("tables/claims.csv"), &claims_table(&findings))?;
    page.add_claims(&findings);
    let count = |is: fn(&Verdict) -> bool| findings.iter().filter(|(_, finding)| is(&finding.verdict)).count();
    Ok(format!(
        "{} claims: {} hold, {} in part, {} do not, {} cannot be tested\n",
        findings.len(),
        count(|v| *v == Verdict::Holds),
        count(|v| *v == Verdict::HoldsInPart),
        count(|v| *v == Verdict::DoesNotHold),
        count(|v| matches!(v, Verdict::CannotBeTested(_)))
    ))
}

/// Runs a named plan, or takes what is there.
fn study(named: &NamedPlan, args: &ReproduceArgs) -> Result<(StudyEntry, Results), CliError> {
    let plan = named.plan()?.with_replications(args.replications)?;
    let directory = args.out.join("studies").join(named.name);
    let begin = Instant::now();
    let options = RunOptions {
        jobs: args.jobs.map(usize::from),
        resume: true,
        ..RunOptions::default()
    };
    let outcome = run_with_progress(&plan, &directory, &options)?;
    let entry = StudyEntry {
        name: plan.name.clone(),
        title: plan.title.clone(),
        directory: format!("studies/{}", plan.name),
        estimates: plan.estimates(),
        seconds: (outcome.estimates > 0).then(|| begin.elapsed().as_secs_f64()),
    };
    Ok((entry, Results::read(&directory)?))
}

/// Where the parts of an item were written, from the page.
struct Written {
    svg: Option<String>,
    data: String,
    table: hoid_io::OutputTable,
}

fn write(item: &Item, studies: &Studies, out: &Path) -> Result<Written, CliError> {
    let made = item.make(studies);
    let folder = if made.svg.is_some() { "figures" } else { "tables" };
    let data = format!("{folder}/{}.csv", item.name);
    hoid_io::write_table(&out.join(&data), &made.data)?;
    let mut written = Written {
        svg: None,
        data,
        table: made.data,
    };
    if let Some(svg) = made.svg {
        let path = format!("{folder}/{}.svg", item.name);
        hoid_io::write_atomically(&out.join(&path), |file| file.write_all(svg.as_bytes()))?;
        written.svg = Some(path);
    }
    Ok(written)
}
