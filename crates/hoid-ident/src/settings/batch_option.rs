//! An option of a batch estimator, which is declared once: its description, its parser, and its printed form.

use hoid_model::SampleTime;

use super::setting::Setting;
use crate::IdentError;

/// Function that sets an option of an estimator from its text.
type ValueSetter<E, X> = Box<dyn Fn(&mut E, &Setting, &str) -> Result<(), X>>;
/// Function that returns the value of an option as text for a given sample time; `None` if the value is not printed.
type ValueFormatter<E> = Box<dyn Fn(&E, SampleTime) -> Option<String>>;

/// An option of an estimator `E`; invalid text gives an error of type `X`.
pub struct BatchOption<E, X = IdentError> {
    /// Name, type, default, bounds and help text.
    pub setting: Setting,
    setter: ValueSetter<E, X>,
    formatter: Option<(&'static str, ValueFormatter<E>)>,
}

/// An estimator that declares its options.
pub trait BatchOptions: Sized + 'static {
    /// Returns all options, in the order in which they are set and printed.
    fn options() -> Vec<BatchOption<Self>>;
}

impl<E: 'static, X: 'static> BatchOption<E, X> {
    /// Creates an option with a function that sets it.
    pub fn new(setting: Setting, set: impl Fn(&mut E, &Setting, &str) -> Result<(), X> + 'static) -> Self {
        Self {
            setting,
            setter: Box::new(set),
            formatter: None,
        }
    }

    /// Returns the option, which is then also printed under this name among the settings in use.
    #[must_use]
    pub fn with_formatter(
        self,
        name: &'static str,
        words: impl Fn(&E, SampleTime) -> Option<String> + 'static,
    ) -> Self {
        Self {
            formatter: Some((name, Box::new(words))),
            ..self
        }
    }

    /// Sets the option from text.
    ///
    /// # Errors
    /// An error of type `X` if the text is not a valid value or contradicts an option that was set before.
    pub fn set(&self, of: &mut E, text: &str) -> Result<(), X> {
        (self.setter)(of, &self.setting, text)
    }

    /// Returns the name and the value as printed; `None` if the option is not printed.
    pub fn formatted_value(&self, of: &E, sample_time: SampleTime) -> Option<(&'static str, String)> {
        let (name, words) = self.formatter.as_ref()?;
        Some((*name, words(of, sample_time)?))
    }

    /// Returns the same option with another parser.
    #[must_use]
    pub fn with_parser(self, set: impl Fn(&mut E, &Setting, &str) -> Result<(), X> + 'static) -> Self {
        Self {
            setter: Box::new(set),
            ..self
        }
    }

    /// Returns the same option for an estimator that contains this estimator.
    pub fn nested<W: 'static, Y: From<X> + 'static>(
        self,
        part: fn(&W) -> &E,
        part_mut: fn(&mut W) -> &mut E,
    ) -> BatchOption<W, Y> {
        let Self {
            setting,
            setter: set,
            formatter: printed,
        } = self;
        BatchOption {
            setting,
            setter: Box::new(move |whole, setting, text| set(part_mut(whole), setting, text).map_err(Y::from)),
            formatter: printed.map(|(name, words)| -> (&'static str, ValueFormatter<W>) {
                (
                    name,
                    Box::new(move |whole, sample_time| words(part(whole), sample_time)),
                )
            }),
        }
    }
}
