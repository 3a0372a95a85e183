//! Names that several commands share.

use clap::ValueEnum;
use hoid_ident::order_selection::Criterion;
use hoid_model::{Detrend, remnant_gain::NoiseDefinition};

names!(CriterionName for Criterion {
    Loss = Criterion::Loss,
    Aic = Criterion::Aic,
    Aicc = Criterion::Aicc,
    Bic = Criterion::Bic,
    Fpe = Criterion::Fpe,
    Mdl = Criterion::Mdl,
    Yic = Criterion::Yic,
});
names!(DetrendName for Detrend { None = Detrend::None, Mean = Detrend::Mean, Linear = Detrend::Linear });
names!(NoiseDefinitionName for NoiseDefinition {
    Response = NoiseDefinition::Response,
    Remnant = NoiseDefinition::Remnant,
});
