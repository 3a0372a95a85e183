//! Claims that cannot be tested, because there are no data for them.

use super::claim::{Claim, Source, Theme};

const NO_SUBJECTS: &str = "it is about recordings of three subjects in a simulator, which are not public";

pub(super) const CLAIMS: &[Claim] = &[
    Claim {
        id: "experiment-detects",
        theme: Theme::Experiment,
        statement: "On experimental data \"the recursive BJ is capable of detecting adaptation in subjects\".",
        reference: "VI; VII",
        measure: "Not measured.",
        plans: &[],
        source: Source::Untested(NO_SUBJECTS),
    },
    Claim {
        id: "experiment-less-clear",
        theme: Theme::Experiment,
        statement: "On experimental data \"BJ shows the expected adaptation of K_e, T_L and K_e_dot less clearly than the ARX outcomes\".",
        reference: "VI; VIII",
        measure: "Not measured.",
        plans: &[],
        source: Source::Untested(NO_SUBJECTS),
    },
    Claim {
        id: "experiment-fluctuations",
        theme: Theme::Experiment,
        statement: "\"Through experimental testing, it is proven that the slow adaptation of the recursive BJ can lead to excessive fluctuations.\"",
        reference: "VI; VIII",
        measure: "Not measured.",
        plans: &[],
        source: Source::Untested(NO_SUBJECTS),
    },
];
