//! Options shared by several batch estimators. Each option is defined once, for any estimator with the corresponding
//! field.

use std::{collections::BTreeMap, ops::RangeInclusive};

use hoid_model::Form;

use crate::{
    Constraint, IdentError,
    criterion::InitialState,
    family::OperatorPrior,
    optimize::{SearchMethod, SearchOptions},
    settings::{BatchOption, Bounds, Kind, NumberOrSpan, Setting, Value},
};

/// Accepted values of the option `form`.
static FORMS: [&str; Form::NAMES.len() + 1] = prepend_auto(Form::NAMES);
/// Accepted values of the option `initial_state`.
static INITIAL_STATES: [&str; InitialState::NAMES.len() + 1] = prepend_auto(InitialState::NAMES);

/// Returns `auto` followed by these names.
const fn prepend_auto<const N: usize, const M: usize>(names: [&'static str; N]) -> [&'static str; M] {
    let (mut all, mut i) = (["auto"; M], 0);
    while i < N {
        all[i + 1] = names[i];
        i += 1;
    }
    all
}

/// Function that returns a mutable reference to a field of an estimator.
pub type FieldAccessor<E, T> = fn(&mut E) -> &mut T;

/// Returns the option for the type of noise model of an operator; this option also determines which estimator is used.
pub fn noise_option<E: 'static>(
    set: impl Fn(&mut E, &Setting, &str) -> Result<(), IdentError> + 'static,
) -> BatchOption<E> {
    let help = "Noise model: autoregression (ar), autoregression and moving average of order nc (arma), or remnant of \
                order m (remnant)";
    let setting = Setting::new("noise", Kind::Choice(&["ar", "arma", "remnant"]), help).default("ar");
    BatchOption::new(setting, set)
}

/// Returns the option for a change in the operator; this option also determines which estimator is used.
pub fn change_option<E: 'static>() -> BatchOption<E> {
    let help = "Change in the operator: none, or one sigmoid change in its gains (hoid identify then rejects \
                --figure, --validate, --horizon and --report)";
    let setting = Setting::new("change", Kind::Choice(&["none", "sigmoid"]), help).default("none");
    BatchOption::new(setting, |_, _, _| Ok(()))
}

/// Returns the option for the form of an operator; the text `auto` means `None`.
pub fn form_option<E: 'static>(set: fn(&mut E, Option<Form>)) -> BatchOption<E> {
    let help = "Form of the operator; auto: average over the forms that the data allow (with --change sigmoid: lead)";
    let setting = Setting::new("form", Kind::Choice(&FORMS), help).default("auto");
    BatchOption::new(setting, move |how, option, text| {
        let form = match text {
            "auto" => None,
            name => Some(option.parse_choice(name)?),
        };
        set(how, form);
        Ok(())
    })
}

/// Returns the option for the neuromuscular part of an operator.
pub fn neuromuscular_option<E: 'static>(field: FieldAccessor<E, bool>) -> BatchOption<E> {
    let help = "Include neuromuscular dynamics (omega_nm, zeta_nm)";
    let setting = Setting::new("neuromuscular", Kind::Choice(&["yes", "no"]), help).default("yes");
    BatchOption::new(setting, move |how, option, text| {
        *field(how) = match text {
            "yes" | "true" => true,
            "no" | "false" => false,
            _ => return Err(option.invalid_value(text, "yes or no")),
        };
        Ok(())
    })
}

/// Returns `yes` for true and `no` for false.
pub fn yes_no_text(yes: bool) -> String {
    if yes { "yes" } else { "no" }.to_owned()
}

/// Returns the option for prior knowledge of the person.
pub fn prior_option<E: 'static>(default: &str, field: FieldAccessor<E, OperatorPrior>) -> BatchOption<E> {
    let help = "Prior knowledge of the person: population (published data), none, a JSON result of another fit, or \
     NAME=CENTRE:SPREAD for omega_nm, zeta_nm, tau_e, T_L, T_I, such as omega_nm=10.5:0.3 (relative spread)";
    let setting = Setting::new("prior", Kind::Prior, help).default(default);
    BatchOption::new(setting, move |how, _, text| {
        *field(how) = text.parse()?;
        Ok(())
    })
}

/// Returns the setting for orders, given as numbers or as ranges to search.
pub fn orders_setting(default: &str) -> Setting {
    let help = "Orders, or ranges to search, such as nb=2,nc=0,nd=1..4,nf=2; nb counts b0, b1, ...";
    Setting::new("orders", Kind::Named(&Kind::Counts), help).default(default)
}

/// Returns the setting for the delay in s.
pub fn delay_setting(default: &str) -> Setting {
    let help = "Delay tau_e (for polynomials instead of nk = tau_e/Ts + 1) or a range to search";
    Setting::new("delay", Kind::NumberOrSpan, help)
        .default(default)
        .unit("s")
        .bounds(Bounds::NonNegative)
}

/// Returns the option for the shortest and the longest delay of an operator; `of` returns the delays for printed
/// output.
pub fn delay_range_option<E: 'static>(
    default: (f64, f64),
    field: FieldAccessor<E, (f64, f64)>,
    of: fn(&E) -> (f64, f64),
) -> BatchOption<E> {
    let setting = delay_setting(&default.text().unwrap_or_default());
    BatchOption::new(setting, move |how, option, text| {
        let NumberOrSpan(low, high) = option.read(text)?;
        *field(how) = (low, high);
        Ok(())
    })
    .with_formatter("delay in s", move |how, _| of(how).text())
}

/// Formats a range of orders.
pub fn order_range_text(range: &RangeInclusive<usize>) -> String {
    range.text().unwrap_or_default()
}

/// Returns the option for parameters that differ between records.
pub fn individual_parameters_option<E: 'static>(
    set: impl Fn(&mut E, &Setting, Vec<String>) -> Result<(), IdentError> + 'static,
) -> BatchOption<E> {
    let help = "Parameters that differ between records, such as K,T_L";
    let setting = Setting::new("individual", Kind::Names, help);
    BatchOption::new(setting, move |how, option, text| set(how, option, option.read(text)?))
}

/// Returns the option for the initial states; the text `auto` means `None`.
pub fn initial_state_option<E: 'static>(
    set: impl Fn(&mut E, &Setting, Option<InitialState>) -> Result<(), IdentError> + 'static,
) -> BatchOption<E> {
    let help = "Initial states of each record; auto: estimate, but backcast for structures without an input (ar, ma, \
                arma)";
    let setting = Setting::new("initial_state", Kind::Choice(&INITIAL_STATES), help).default("auto");
    BatchOption::new(setting, move |how, option, text| {
        let rule = match text {
            "auto" => None,
            name => Some(option.parse_choice(name)?),
        };
        set(how, option, rule)
    })
}

/// Returns the options for parameters that are fixed at a value or constrained to bounds; a parameter must not have
/// both.
pub fn constraint_options<E: 'static>(
    field: FieldAccessor<E, BTreeMap<String, Constraint>>,
    of: ConstraintsGetter<E>,
) -> [BatchOption<E>; 2] {
    let fix = "Parameters fixed at a value, such as d1=-0.85,f1=-1.9";
    let fix = Setting::new("fix", Kind::Named(&Kind::Number), fix).bounds(Bounds::Finite);
    let bound = "Bounds of parameters, such as b0=0..0.2,f2=..0.99; either end may be omitted";
    let bound = Setting::new("bound", Kind::Named(&Kind::OpenSpan), bound);
    let fixed = move |how: &mut E, option: &Setting, text: &str| {
        let all: BTreeMap<String, f64> = option.read(text)?;
        constrain(
            field(how),
            option,
            all.into_iter().map(|(name, value)| (name, Constraint::Fixed(value))),
        )
    };
    let bounded = move |how: &mut E, option: &Setting, text: &str| {
        let all: BTreeMap<String, Constraint> = option.read(text)?;
        constrain(field(how), option, all.into_iter())
    };
    [
        BatchOption::new(fix, fixed).with_formatter("fixed", move |how, _| fixed_text(of(how))),
        BatchOption::new(bound, bounded).with_formatter("bounds", move |how, _| bound_text(of(how))),
    ]
}

/// Function that returns the constraints of an estimator.
pub type ConstraintsGetter<E> = fn(&E) -> &BTreeMap<String, Constraint>;

fn constrain(
    all: &mut BTreeMap<String, Constraint>,
    option: &Setting,
    given: impl Iterator<Item = (String, Constraint)>,
) -> Result<(), IdentError> {
    for (name, constraint) in given {
        if all.contains_key(&name) {
            return Err(option.error(format!("{name} is both fixed and bounded; drop one of the two")));
        }
        all.insert(name, constraint);
    }
    Ok(())
}

fn fixed_text(all: &BTreeMap<String, Constraint>) -> Option<String> {
    let fixed = all.iter().filter_map(|(name, c)| match c {
        Constraint::Fixed(value) => Some((name, *value)),
        Constraint::Between(..) => None,
    });
    named_values_text(fixed)
}

fn bound_text(all: &BTreeMap<String, Constraint>) -> Option<String> {
    let bounded = all.iter().filter(|(_, c)| matches!(c, Constraint::Between(..)));
    let words: Vec<String> = bounded
        .map(|(name, c)| format!("{name}={}", c.text().unwrap_or_default()))
        .collect();
    (!words.is_empty()).then(|| words.join(", "))
}

/// Formats values as `name=value, name=value`; `None` if there are no values.
pub fn named_values_text<'a>(values: impl IntoIterator<Item = (&'a String, f64)>) -> Option<String> {
    let all: Vec<String> = values
        .into_iter()
        .map(|(name, value)| format!("{name}={value}"))
        .collect();
    (!all.is_empty()).then(|| all.join(", "))
}

/// Returns the options for the method and the termination of the search, with the defaults of the estimator.
pub fn search_options<E: 'static>(
    default: SearchOptions,
    field: FieldAccessor<E, SearchOptions>,
) -> Vec<BatchOption<E>> {
    let mut all = vec![search_method_option(field)];
    all.extend(search_termination_options(default, field));
    all
}

/// Returns the option for the method of the search.
pub fn search_method_option<E: 'static>(field: FieldAccessor<E, SearchOptions>) -> BatchOption<E> {
    let help = "Search: Gauss-Newton (gn), Levenberg-Marquardt (lm), steepest descent (grad)";
    let setting =
        Setting::new("search_method", Kind::Choice(&SearchMethod::NAMES), help).default(SearchMethod::default().name());
    BatchOption::new(setting, move |how, option, text| {
        field(how).method = option.parse_choice(text)?;
        Ok(())
    })
}

/// Returns the options for the termination of the search.
pub fn search_termination_options<E: 'static>(
    default: SearchOptions,
    field: FieldAccessor<E, SearchOptions>,
) -> [BatchOption<E>; 2] {
    let steps = Setting::new("max_iterations", Kind::Count, "Maximum search steps from each start")
        .default(&default.max_iterations.to_string());
    let tolerance = "Relative decrease of the loss for convergence";
    let tolerance = Setting::new("tolerance", Kind::Number, tolerance)
        .default(&format!("{:e}", default.tolerance))
        .bounds(Bounds::PositiveFinite);
    [
        BatchOption::new(steps, move |how, option, text| {
            field(how).max_iterations = option.read(text)?;
            Ok(())
        }),
        BatchOption::new(tolerance, move |how, option, text| {
            field(how).tolerance = option.read(text)?;
            Ok(())
        }),
    ]
}

#[cfg(test)]
mod tests {
    use hoid_model::NamedChoice;

    use super::*;

    #[test]
    fn choice_names_match_the_library() {
        fn choice_names<T: NamedChoice>() -> Vec<&'static str> {
            T::CHOICES.iter().map(|choice| choice.choice_name()).collect()
        }
        assert_eq!(FORMS[1..], choice_names::<Form>());
        assert_eq!(INITIAL_STATES[1..], choice_names::<InitialState>());
        assert_eq!(SearchMethod::NAMES.to_vec(), choice_names::<SearchMethod>());
    }
}
