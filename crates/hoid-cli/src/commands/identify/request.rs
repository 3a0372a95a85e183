//! Converts the options of `hoid identify` to a request to the library.

use hoid::analysis::{Request, ResolvedRequest};

use crate::{args::IdentifyArgs, error::CliError, output};

/// The request, the options checked against each other.
///
/// # Errors
/// [`CliError::Usage`].
pub fn asked(args: &IdentifyArgs) -> Result<ResolvedRequest, CliError> {
    let request = Request {
        structure: args.structure.clone(),
        method: Some(args.method.clone()),
        options: args
            .options
            .given()
            .map(|(name, text)| (name.to_owned(), text.to_owned()))
            .collect(),
        faults: args.faults.faults,
        rate: args.read.prepare.rate.decimate,
    };
    let (asked, notes) = request.resolve().map_err(CliError::of_options)?;
    for note in notes {
        output::notice("", format!("note: {note}"));
    }
    match misplaced(args, &asked) {
        Some((option, with)) => Err(CliError::Usage(format!("{option} belongs to {with}"))),
        None => Ok(asked),
    }
}

/// The first option of reading and writing that has no meaning for what is asked, and what it belongs to.
fn misplaced(args: &IdentifyArgs, asked: &ResolvedRequest) -> Option<(&'static str, &'static str)> {
    let changing = matches!(asked, ResolvedRequest::Change(_));
    let steady = "a model that does not change";
    let all = [
        (
            args.picture.figure.is_some() && (changing || !asked.has_input()),
            "--figure",
            "a model that does not change, of a structure with an input",
        ),
        (args.trace.is_some() && !changing, "--trace", "--change sigmoid"),
        (args.validate.is_some() && changing, "--validate", steady),
        (args.horizon.is_some() && changing, "--horizon", steady),
        (
            args.report.is_some() && changing,
            "--report",
            "a model that does not change; --trace writes the gains",
        ),
    ];
    let found = all.into_iter().find(|(wrong, ..)| *wrong);
    found.map(|(_, option, with)| (option, with))
}
