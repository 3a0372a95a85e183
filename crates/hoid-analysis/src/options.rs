//! Options of an identification, set as text by their names in the [registry](crate::registry). The command line, plans
//! and Python convert their input to text, and have no separate lists of options.
//!
//! An estimator declares its options next to its fields. This module declares the options of the analysis: the recorded
//! excitation, the controlled element, the answers to which the verdict refers, and a prior from a file.

use hoid_ident::{
    family::OperatorPrior,
    settings::{BatchOption, BatchOptions, Bounds, Kind, Setting},
    shared_options::FieldAccessor,
};

use crate::{
    AnalysisError, answers::requested_names, description::Excitation, identification::Identification,
    prior::parse_prior,
};

/// An option of an estimator or of the analysis.
pub type AnalysisOption<E> = BatchOption<Identification<E>, AnalysisError>;

/// Returns the options that an estimator declares.
pub(crate) fn estimator_options<E: BatchOptions>() -> Vec<AnalysisOption<E>> {
    let own = E::options().into_iter();
    own.map(|option| option.nested(|how: &Identification<E>| &how.estimator, |how| &mut how.estimator))
        .collect()
}

/// Returns the options of an estimator whose prior may be the result of another fit, given as JSON or as a file.
pub(crate) fn with_prior_of_fits<E: 'static>(
    options: Vec<AnalysisOption<E>>,
    field: FieldAccessor<E, OperatorPrior>,
) -> Vec<AnalysisOption<E>> {
    let read = move |option: AnalysisOption<E>| match option.setting.kind {
        Kind::Prior => option.with_parser(move |how: &mut Identification<E>, _, text| {
            *field(&mut how.estimator) = parse_prior(text)?;
            Ok(())
        }),
        _ => option,
    };
    options.into_iter().map(read).collect()
}

/// Returns the options for the channel of the excitation and its period.
pub(crate) fn excitation_options<E: 'static>() -> [AnalysisOption<E>; 2] {
    let help = "Column of the recorded disturbance or target for the fit at its lines; none: no fit at lines";
    let channel = Setting::new("excitation", Kind::Channel, help).default("the first of f_t, d, r ... with lines");
    let period = Setting::new("period", Kind::Number, "Period of the excitation")
        .default("detected")
        .unit("s")
        .bounds(Bounds::PositiveFinite);
    [
        BatchOption::new(channel, |how: &mut Identification<E>, _, text| {
            how.excitation = Excitation::from_text(Some(text));
            Ok(())
        }),
        BatchOption::new(period, |how: &mut Identification<E>, option, text| {
            how.period_s = Some(option.read(text)?);
            Ok(())
        }),
    ]
}

/// Returns the option for the controlled element.
pub(crate) fn controlled_element_option<E: 'static>() -> AnalysisOption<E> {
    let help = "Controlled element, such as 90/(s(s+6)) or 90/1,6,0 (NUM/DEN in descending powers of s): adds \
                crossover frequency and margins";
    let setting = Setting::new("controlled_element", Kind::Element, help);
    BatchOption::new(setting, |how: &mut Identification<E>, option, text| {
        let element = text.parse();
        how.controlled_element =
            Some(element.map_err(|error: hoid_model::ModelError| option.error(error.to_string()))?);
        Ok(())
    })
}

/// Returns the option for the answers to which the verdict refers.
pub(crate) fn answers_option<E: 'static>() -> AnalysisOption<E> {
    let help = "Quantities in the verdict: response,crossover,phase_margin or parameters, such as tau_e";
    let setting = Setting::new("answers", Kind::Names, help).default("response and loop");
    BatchOption::new(setting, |how: &mut Identification<E>, option, text| {
        how.answers = requested_names(&option.read::<Vec<String>>(text)?)?;
        Ok(())
    })
}
