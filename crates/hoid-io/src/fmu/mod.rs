//! Functional mock-up units (FMUs): archives with an XML description, a shared library and the settings that the
//! library reads at start.
//!
//! *Functional Mock-up Interface for Model Exchange and Co-Simulation*, version 2.0.4 (Modelica Association, 2022), and
//! *Functional Mock-up Interface Specification*, version 3.0.1 (2023). The library is `hoid-ffi`; this module defines
//! the parts that the library and the description share: the variables ([`FmuKind::variables`]), whose value references
//! are their positions in the list, and the token ([`FmuKind::token`]).
//!
//! | file | contents |
//! |---|---|
//! | `variables` | the variables of an FMU |
//! | `settings` | settings that the library reads when it starts |
//! | `description` | `modelDescription.xml` |
//! | `archive` | the archive, with a library for each platform |

mod archive;
mod description;
mod settings;
mod variables;

pub use archive::{Library, write_fmu};
pub use description::FmiVersion;
pub use settings::{FMU_SETTINGS_FILE, FmuSettings};
pub use variables::{DETERMINED_VARIABLES, FmuKind, FmuStart, FmuVariable, Role};
