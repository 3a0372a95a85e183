//! The figure of a fit: the model through the describing function of the records, where they have a
//! periodic excitation; else its frequency response with the bands of its coefficients.

use hoid::analysis::{Excitation, Recordings};
use hoid::ident::{Fit, frequency::Description};
use hoid::model::Record;
use hoid::report::{
    Picture,
    figures::{BodeModel, ModelCurve, bode, describing},
};

use crate::args::IdentifyArgs;

/// The describing function of the records, where they have a recorded excitation.
pub fn description(args: &IdentifyArgs, data: &Recordings) -> Option<Description> {
    data.described(&Excitation::default(), None, args.faults.faults)
        .ok()
        .flatten()
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
