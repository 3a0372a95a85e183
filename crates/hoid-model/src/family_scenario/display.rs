//! The display of a task: the signals that the person sees.

use serde::{Deserialize, Serialize};

/// Display of the task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Display {
    /// The person sees only the error.
    #[default]
    Compensatory,
    /// The person sees the target and the output.
    Pursuit,
    /// The person sees the output, the target and the future target.
    Preview,
}

crate::named_choice!(Display, "display of the task", 3, {
    Compensatory => "compensatory",
    Pursuit => "pursuit",
    Preview => "preview",
});
