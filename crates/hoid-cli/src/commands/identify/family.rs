//! `hoid identify` by default: an operator of the family of operators.

use hoid::analysis::{Identification, IdentifiedModel, Recordings};
use hoid::report::{Report, operator_figure, write_report};
use serde_json::Value;

use super::family_form::FamilyReport;
use crate::{
    args::IdentifyArgs,
    commands::{figure, paper_table},
    error::CliError,
    json, output,
};

pub fn run(
    args: &IdentifyArgs,
    identification: &Identification,
    read: Recordings,
    other: Option<Recordings>,
) -> Result<(), CliError> {
    let identified = output::run_with_spinner("fitting", || identification.run(read))?;
    let model = &identified.fit.operator(0).polynomial_fit;
    let validation = other.map(|other| identified.validated(model, other)).transpose()?;
    let IdentifiedModel { fit, data, .. } = &identified;
    let found = FamilyReport {
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
        figure::write(path, &operator_figure(&identified), args.picture.width)?;
    }
    if let Some(directory) = &args.report {
        let page = write_report(directory, &Report::from_operator_fit(&identified).to_html()?)?;
        output::add_notice("", format!("report: {}", page.display()));
    }
    paper_table::write(&args.show, || Ok(identified.json()?))?;
    if args.show.json {
        let mut object = identified.json()?;
        if let Some((file, quality)) = &found.validation {
            object.insert("validation".to_owned(), json::validation(file, quality));
        }
        json::print(&Value::Object(object))?;
    } else {
        output::show(&found.page(args.show.verbose)?)?;
    }
    CliError::check_verdict(&fit.verdict)
}
