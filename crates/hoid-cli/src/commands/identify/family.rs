//! `hoid identify` by default: the operator of a person, of the family of operators.

use std::path::Path;

use hoid::analysis::{Identification, Identified, Recordings};
use hoid::ident::frequency::Description;
use hoid::report::{
    ModelSection, Picture, Report,
    figures::{ModelCurve, describing},
    write_report,
};
use serde_json::Value;

use super::{family_form::Found, picture::of_polynomials};
use crate::{
    args::IdentifyArgs,
    commands::{figure, reading},
    error::CliError,
    json, output,
};

pub fn run(
    args: &IdentifyArgs,
    identification: &Identification,
    read: Recordings,
    other: Option<Recordings>,
) -> Result<(), CliError> {
    let identified = output::watched("fitting", || identification.run(read))?;
    let model = &identified.fit.operator(0).polynomial_fit;
    let validation = other.map(|other| identified.validated(model, other)).transpose()?;
    let Identified {
        fit, data, described, ..
    } = &identified;
    let found = Found {
        identified: &identified,
        fit,
        files: &data.names,
        records: &data.records,
        accounts: &data.accounts,
        element: identification.controlled_element.as_ref(),
        validation: validation.as_ref().map(|v| (v.name.as_str(), v.quality)),
        settings: &identified.settings,
    };
    if let Some(path) = &args.picture.figure {
        let svg = match described {
            Some(described) => picture(&found, described),
            None => of_polynomials(&fit.operator(0).polynomial_fit, &data.records, None),
        };
        figure::write(path, &svg, args.picture.width)?;
    }
    if let Some(directory) = &args.report {
        report(&found, described.as_ref(), directory)?;
    }
    if args.show.json {
        let mut object = identified.json()?;
        if let Some((file, quality)) = &found.validation {
            object.insert("validation".to_owned(), json::validation(file, quality));
        }
        json::print(&Value::Object(object))?;
    } else {
        output::show(&found.page(args.show.verbose)?)?;
    }
    CliError::of_verdict(&fit.verdict)
}

/// The fitted operator, by prediction error and at the lines.
fn curves(found: &Found<'_>, described: &Description) -> Vec<ModelCurve> {
    let operator = &found.fit.operator(0).operator;
    let half = 0.5 * found.fit.sample_time.s();
    let curve = |name: &str, operator: &hoid::model::FamilyOperator| {
        let turn = |omega: f64| hoid::model::Complex64::from_polar(1.0, -omega * half);
        ModelCurve::over(described, name, operator.tau_e_s() + half, |omega| {
            operator.response(omega) * turn(omega)
        })
    };
    let mut all = vec![curve("prediction error", operator)];
    if let Some(lines) = &found.fit.lines {
        all.push(curve("fit at the lines", &lines.operator));
    }
    if let Some(instrumental) = found.fit.instrumental.as_ref().filter(|i| i.termination.converged()) {
        all.push(curve("RIV-BJ", &instrumental.operator));
    }
    all
}

fn through_describing_function(found: &Found<'_>, described: &Description) -> Picture {
    Picture {
        svg: picture(found, described),
        caption:
            "The describing function at the lines of the excitation, with 95 % by its scatter, and the operator of the \
                  chosen form: by prediction error, fitted at the lines, and by instrumental variables (RIV-BJ) where these converge."
                .to_owned(),
    }
}

/// The operator through the describing function.
fn picture(found: &Found<'_>, described: &Description) -> String {
    let title = format!("{} through the describing function", found.fit.form);
    describing("describing", &title, described, &curves(found, described))
}

fn report(found: &Found<'_>, described: Option<&Description>, directory: &Path) -> Result<(), CliError> {
    let fit = &found.fit.operator(0).polynomial_fit;
    let title = match found.records {
        [only] => format!("Identification of {}", only.label()),
        all => format!("Identification of {} records", all.len()),
    };
    let mut facts = vec![
        ("hoid".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("records".to_owned(), found.files.join(", ")),
    ];
    facts.extend(reading::rows(found.settings));
    facts.extend(reading::accounts(found.files, found.accounts));
    let report = Report {
        title,
        settings: facts,
        models: vec![ModelSection {
            name: found.fit.title(),
            fit,
            records: found.records,
            candidates: None,
            truth: None,
            margins: found.margins(),
        }],
        notes: Vec::new(),
        answer: Some(found.answer_of_page()),
        pictures: described
            .map(|d| through_describing_function(found, d))
            .into_iter()
            .collect(),
    };
    let page = write_report(directory, &report.to_html()?)?;
    output::notice("", format!("report: {}", page.display()));
    Ok(())
}
