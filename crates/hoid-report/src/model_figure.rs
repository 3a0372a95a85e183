//! The figure of a polynomial model. If the records have a periodic excitation, the figure shows the model with the
//! describing function of the records; otherwise the frequency response of the model with its bands.

use hoid_ident::{Fit, frequency::Description};
use hoid_model::Record;

use crate::{
    Picture,
    figures::{BodeModel, ModelCurve, bode, describing},
};

/// Draws the figure of a polynomial model.
pub fn model_figure(fit: &Fit, records: &[Record], described: Option<&Description>) -> String {
    let title = fit.title();
    // The part of the text after the semicolon does not fit below a single-column figure.
    let title = title.split(';').next().unwrap_or(&title).to_owned();
    let delay_s = fit.orders().nk as f64 * fit.model().sample_time().s();
    match described {
        Some(described) => {
            let curve =
                ModelCurve::over_frequencies(described, 0.0, &title, delay_s, |omega| fit.model().response(omega));
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

/// Draws a polynomial model with the describing function, for a page; `None` without a describing function, since the
/// page contains the frequency response in any case.
pub fn model_picture(fit: &Fit, records: &[Record], described: Option<&Description>) -> Option<Picture> {
    let svg = model_figure(fit, records, Some(described?));
    Some(Picture {
        svg,
        caption: "The describing function at the lines of the excitation, with 95 % intervals from its scatter, and \
                  the model."
            .to_owned(),
    })
}
