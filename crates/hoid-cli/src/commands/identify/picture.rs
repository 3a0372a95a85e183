//! The figure of a fit: the model through the describing function of the records, where they have a
//! periodic excitation; else its frequency response with the bands of its coefficients.

use hoid::ident::{
    Fit,
    frequency::{Description, DescriptionOptions, describe_runs},
};
use hoid::model::{Detrend, Record};
use hoid::report::{
    Picture,
    figures::{BodeModel, ModelCurve, bode, describing},
};

use crate::{
    args::IdentifyArgs,
    commands::{
        describe::{offset_of_output, without_offsets},
        faults, reading,
    },
    error::CliError,
};

/// The describing function of the records without the offset of u, which is a phase of it: moved
/// rows would leave less than whole periods.
pub fn description(args: &IdentifyArgs, records: &[Record]) -> Result<Description, CliError> {
    let (read, offsets) = without_offsets(&args.read);
    let unmoved;
    let (records, offset_samples) = if offsets.is_empty() {
        (records, 0.0)
    } else {
        let again = reading::read_again(&args.records, &read, &args.mask)?;
        let again = faults::mended_again(again, args.faults.faults)?;
        let late = again.first().map_or(Ok(0.0), |r| offset_of_output(r, &offsets))?;
        let ts_s = again.first().map_or(1.0, |r| r.sample_time().s());
        // Of what is fitted beside it.
        let used_s = records.first().map_or(ts_s, |r| r.sample_time().s());
        let used = |r: Record| {
            r.decimated((used_s / ts_s).round().max(1.0) as usize)
                .map(|found| found.0)
        };
        unmoved = again.into_iter().map(used).collect::<Result<Vec<_>, _>>()?;
        let late = late * ts_s / used_s;
        (unmoved.as_slice(), late)
    };
    if args.excitation.as_deref() == Some("none") {
        return Err(CliError::Usage("no excitation was asked for".to_owned()));
    }
    let options = DescriptionOptions {
        excitation: args.excitation.clone(),
        period_s: args.period,
        offset_samples,
        detrend: Detrend::None,
        ..DescriptionOptions::default()
    };
    Ok(describe_runs(records, &options)?)
}

/// A polynomial model in a figure.
pub fn of_polynomials(fit: &Fit, records: &[Record], described: Option<&Description>) -> String {
    let title = fit.title();
    // What is behind the semicolon does not fit below a figure of one column.
    let title = title.split(';').next().unwrap_or(&title).to_owned();
    let delay_s = fit.orders().nk as f64 * fit.model().sample_time().s();
    match described {
        Some(described) => {
            let curve = ModelCurve::over(described, &title, delay_s, |omega| fit.model().response(omega));
            describing("identified", &title, described, &[curve])
        }
        None => bode(
            "identified",
            &[BodeModel {
                name: &title,
                fit,
                records,
            }],
            &[],
        ),
    }
}

/// The same for a page; none without a describing function, as the page has the response anyway.
pub fn for_page(fit: &Fit, records: &[Record], described: Option<&Description>) -> Option<Picture> {
    let svg = of_polynomials(fit, records, Some(described?));
    Some(Picture {
        svg,
        caption: "The describing function at the lines of the excitation, with 95 % by its scatter, and the model."
            .to_owned(),
    })
}
