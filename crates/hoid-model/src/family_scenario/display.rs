//! The display: the signals of the task that a person sees.

use serde::{Deserialize, Serialize};

/// Display of the task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Display {
    /// Error only.
    #[default]
    Compensatory,
    /// Target and output.
    Pursuit,
    /// Output, target, and future target.
    Preview,
}

crate::named_choice!(Display, "display of the task", 3, {
    Compensatory => "compensatory",
    Pursuit => "pursuit",
    Preview => "preview",
});
