//! The option of the guard.

use hoid_ident::{
    settings,
    settings::{Kind, Value},
};

/// Choice of a guard in front of a recursion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GuardChoice {
    /// A guard examines the samples before the recursion.
    Yes,
    /// No guard: the samples reach the recursion unchanged.
    No,
}

hoid_model::named_choice!(GuardChoice, "choice", 2, { Yes => "yes", No => "no" });

impl Value for GuardChoice {
    const KIND: Kind = Kind::Choice(&["yes", "no"]);

    fn read(text: &str) -> Result<Self, String> {
        match text.trim().to_ascii_lowercase().as_str() {
            "yes" | "true" => Ok(Self::Yes),
            "no" | "false" => Ok(Self::No),
            _ => Err("yes or no".to_owned()),
        }
    }

    fn text(&self) -> Option<String> {
        Some(self.name().to_owned())
    }
}

settings! {
    /// Option of a guard, which prevents samples and spans that cannot come from tracking from changing the estimate.
    pub struct GuardOptions {
        /// Guard: hold back outliers of e and u, exclude spans without tracking, and restart the estimate after them
        #[setting(default("yes"))]
        pub guard: Option<GuardChoice> = None,
    }
}
