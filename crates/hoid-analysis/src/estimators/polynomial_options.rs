//! Options of a polynomial structure: the fields of [`Polynomials`], and the names by which they are set from text. An
//! option is declared only here.

use std::{collections::BTreeMap, ops::RangeInclusive};

use hoid_ident::{
    Estimator, Focus, IdentError, Instruments, IvMethod, Loss, NamedOrders, Prior, SearchOptions,
    order_selection::{Criterion, check_order},
    settings::{BatchOption, BatchOptions, Bounds, DelayRange, Kind, NumberOrSpan, Setting},
    shared_options as shared,
};
use hoid_model::{Orders, SampleTime, Structure};

/// Default limit of a robust loss in standard deviations, beyond which the loss is linear; the efficiency for normal
/// noise is 95 % (Huber 1981).
const DEFAULT_HUBER_LIMIT: f64 = 1.345;

/// A polynomial structure and the options of its estimation.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomials {
    /// Structure, initial states, search, constraints, loss and focus. Its orders and start are replaced by the fields
    /// below.
    pub template: Estimator,
    /// Orders by name, each a number or a range to search; an order without an entry is the order of the operator.
    pub orders: NamedOrders,
    /// Shortest and longest dead time in s; replaces the order nk.
    pub delay_s: Option<(f64, f64)>,
    /// Criterion that selects among candidates.
    pub criterion: Criterion,
    /// Start of the search: values of all coefficients by name.
    pub start: Option<BTreeMap<String, f64>>,
    /// Instrumental-variable method that replaces the prediction-error method for the fit; the orders are still
    /// selected by the prediction-error method.
    pub method: Option<IvMethod>,
    /// Components of the instruments; by default the forcing function, if it was recorded.
    pub instruments: Option<Instruments>,
}

impl Polynomials {
    /// Returns the defaults: orders of the operator, fitted by the prediction-error method.
    pub fn new(structure: Structure) -> Self {
        Self {
            template: Estimator::new(structure, Orders::default()),
            orders: NamedOrders::new(),
            delay_s: None,
            criterion: Criterion::Bic,
            start: None,
            method: None,
            instruments: None,
        }
    }

    fn set_order(&mut self, option: &Setting, name: String, range: RangeInclusive<usize>) -> Result<(), IdentError> {
        check_order(&name, &range)?;
        if self.orders.contains_key(&name) {
            return Err(option.error(format!("{name} is given twice; drop one of the two")));
        }
        self.orders.insert(name, range);
        Ok(())
    }
}

/// Returns the names of the options that only the prediction-error method has, and of the options that only
/// instrumental variables have.
pub(super) fn method_option_names() -> [Vec<&'static str>; 2] {
    [prediction_error_options(), instrument_options()]
        .map(|options| options.iter().map(|option| option.setting.name).collect())
}

impl BatchOptions for Polynomials {
    fn options() -> Vec<BatchOption<Self>> {
        let ends =
            shared::search_termination_options(SearchOptions::default(), |how: &mut Self| &mut how.template.search);
        let mut all = order_options();
        all.extend(prediction_error_options());
        all.extend(instrument_options());
        all.extend(ends);
        all
    }
}

/// Returns the options for orders and delay.
fn order_options() -> Vec<BatchOption<Polynomials>> {
    let default = "bj nb=2,nd=1..4,nf=2; arx na=2,nb=2";
    let nk = "Delay of b0 in samples (29) or dead time in s (0.28s), or a range (20..40, 0.1s..0.4s) to search";
    let criterion = "Criterion that selects among the candidates";
    vec![
        BatchOption::new(
            shared::orders_setting(default),
            |how: &mut Polynomials, option, text| {
                for (name, range) in option.read::<NamedOrders>(text)? {
                    how.set_order(option, name, range)?;
                }
                Ok(())
            },
        )
        .with_formatter("orders", |how, sample_time: SampleTime| {
            Some(
                how.ranges(sample_time)
                    .map_or_else(|_| String::new(), |ranges| ranges.to_string()),
            )
        }),
        BatchOption::new(
            Setting::new("nk", Kind::Delay, nk).default("0.05 to 0.6 s"),
            |how: &mut Polynomials, option, text| {
                match option.read(text)? {
                    DelayRange::Samples(range) => how.set_order(option, "nk".to_owned(), range)?,
                    DelayRange::Seconds(low, high) => how.delay_s = Some((low, high)),
                }
                Ok(())
            },
        ),
        BatchOption::new(
            Setting::new("criterion", Kind::Choice(&Criterion::NAMES), criterion).default(Criterion::Bic.name()),
            |how: &mut Polynomials, option, text| {
                how.criterion = option.parse_choice(text)?;
                Ok(())
            },
        )
        .with_formatter("criterion", |how, _| Some(how.criterion.to_string())),
        BatchOption::new(shared::delay_setting(""), |how: &mut Polynomials, option, text| {
            if how.delay_s.is_some() || how.orders.contains_key("nk") {
                return Err(option.error("delay in s and nk in samples are the same quantity; give only one of them"));
            }
            let NumberOrSpan(low, high) = option.read(text)?;
            how.delay_s = Some((low, high));
            Ok(())
        })
        .with_formatter("delay", |how, _| match how.delay_s? {
            (low, high) if low == high => Some(format!("{low} s")),
            (low, high) => Some(format!("{low}..{high} s")),
        }),
    ]
}

/// Returns the options that only the prediction-error method has.
fn prediction_error_options() -> Vec<BatchOption<Polynomials>> {
    let focus = "Purpose of the model: one-step prediction, or simulation from the input alone";
    let start = "Start of the search: all coefficients, such as f1=-1.9,f2=.92,b0=.04,...";
    let guess = "Prior values and weights of coefficients: f1=-1.9:0.5 adds 0.5 (f1 + 1.9)^2 to the loss";
    let robust = "Huber loss instead of squares, linear beyond X standard deviations (1.345 if X is omitted)";
    let stable = "Accept only models that are stable from e to u (C and F are always stable)";
    let mut all = vec![
        BatchOption::new(
            Setting::new("focus", Kind::Choice(&Focus::NAMES), focus).default(Focus::default().name()),
            |how: &mut Polynomials, option, text| {
                how.template.focus = option.parse_choice(text)?;
                Ok(())
            },
        )
        .with_formatter("focus", |how, _| Some(how.template.focus.to_string())),
        BatchOption::new(
            Setting::new("start", Kind::Named(&Kind::Number), start)
                .default("automatic starts")
                .bounds(Bounds::Finite),
            |how: &mut Polynomials, option, text| {
                how.start = Some(option.read(text)?);
                Ok(())
            },
        )
        .with_formatter("start", |how, _| {
            let given = how.start.as_ref();
            let given = given.and_then(|start| shared::named_values_text(start.iter().map(|(name, v)| (name, *v))));
            Some(given.unwrap_or_else(|| "own".to_owned()))
        }),
        BatchOption::new(
            Setting::new("coefficient_prior", Kind::Named(&Kind::Guess), guess),
            |how: &mut Polynomials, option, text| {
                how.template.priors = option.read::<BTreeMap<String, Prior>>(text)?;
                Ok(())
            },
        )
        .with_formatter("prior of coefficients", |how, _| {
            let all = how.template.priors.iter();
            let all: Vec<String> = all
                .map(|(name, p)| format!("{name}={}:{}", p.value, p.weight))
                .collect();
            (!all.is_empty()).then(|| all.join(", "))
        }),
        BatchOption::new(
            Setting::new("robust", Kind::NumberOrDefault("1.345"), robust).bounds(Bounds::Positive),
            |how: &mut Polynomials, option, text| {
                let threshold = match text {
                    "true" => DEFAULT_HUBER_LIMIT,
                    _ => option.read(text)?,
                };
                how.template.loss = Loss::Huber { threshold };
                Ok(())
            },
        )
        .with_formatter("robust loss", |how, _| match how.template.loss {
            Loss::Huber { threshold } => Some(format!("Huber, {threshold} standard deviations")),
            Loss::Quadratic => None,
        }),
        BatchOption::new(
            Setting::new("stable", Kind::Flag, stable).default("false"),
            |how: &mut Polynomials, option, text| {
                how.template.stable = option.read(text)?;
                Ok(())
            },
        )
        .with_formatter("stable models only", |how, _| {
            how.template.stable.then(|| "yes".to_owned())
        }),
        shared::initial_state_option(|how: &mut Polynomials, _, rule| {
            how.template.initial_state = rule;
            Ok(())
        }),
        shared::search_method_option(|how: &mut Polynomials| &mut how.template.search),
    ];
    all.extend(shared::constraint_options(
        |how: &mut Polynomials| &mut how.template.constraints,
        |how| &how.template.constraints,
    ));
    all
}

/// Returns the options that only instrumental variables have.
fn instrument_options() -> Vec<BatchOption<Polynomials>> {
    let help = "Instruments: a channel independent of the noise, or `simulated` from the input (for an open loop)";
    let setting =
        Setting::new("instruments", Kind::Channel, help).default("f_t if all records have it, else simulated");
    vec![BatchOption::new(setting, |how: &mut Polynomials, _, text| {
        how.instruments = Some(Instruments::from_text(text));
        Ok(())
    })]
}
