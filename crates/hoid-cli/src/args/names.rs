//! Names that several commands share.

use clap::ValueEnum;
use hoid_ident::order_selection::Criterion;

names!(CriterionName for Criterion {
    Loss = Criterion::Loss,
    Aic = Criterion::Aic,
    Aicc = Criterion::Aicc,
    Bic = Criterion::Bic,
    Fpe = Criterion::Fpe,
    Mdl = Criterion::Mdl,
    Yic = Criterion::Yic,
});
