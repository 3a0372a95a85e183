//! Names of the files and folders of a session; they follow BIDS where BIDS defines them.

use std::path::{Path, PathBuf};

use crate::LabError;

/// Returns the folder of a session.
pub fn session_folder(out: &Path, subject: &str, session: usize) -> PathBuf {
    out.join(format!("sub-{subject}")).join(format!("ses-{session:02}"))
}

/// Checks that a pseudonym consists of 1 to 20 letters and digits.
///
/// # Errors
/// [`LabError::Order`].
pub(super) fn check_subject(subject: &str) -> Result<(), LabError> {
    let sound = (1..=20).contains(&subject.len()) && subject.bytes().all(|b| b.is_ascii_alphanumeric());
    if sound {
        return Ok(());
    }
    Err(LabError::Order(format!(
        "the pseudonym is {:?}, expected 1 to 20 letters and digits, such as P01",
        hoid_io::escape_control_characters(subject)
    )))
}

/// Common prefix of the file names of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stem {
    folder: PathBuf,
    stem: String,
}

impl Stem {
    /// Creates the stem for the run with this number in a session.
    pub fn new(folder: &Path, subject: &str, session: usize, condition: &str, number: usize) -> Self {
        Self {
            folder: folder.to_owned(),
            stem: format!("sub-{subject}_ses-{session:02}_task-{condition}_run-{number:02}"),
        }
    }

    /// Returns the stem as text.
    pub fn text(&self) -> &str {
        &self.stem
    }

    /// Returns the path of a file of the run, such as `ticks.csv`.
    pub fn file(&self, end: &str) -> PathBuf {
        self.folder.join(format!("{}_{end}", self.stem))
    }

    /// Returns the folder of the pages of the run.
    pub fn report_folder(&self) -> PathBuf {
        self.folder.join("reports").join(&self.stem)
    }

    /// Returns all started runs in a folder, in the order of their numbers.
    ///
    /// # Errors
    /// [`LabError::Io`].
    pub fn find_all(folder: &Path) -> Result<Vec<(usize, Self)>, LabError> {
        let mut found: Vec<(usize, Self)> = hoid_io::file_names(folder)?
            .iter()
            .filter_map(|name| {
                let stem = name.strip_suffix("_run.json")?;
                // The 32-bit range leaves room for the number of the next run.
                let number: u32 = stem.rsplit_once("_run-")?.1.parse().ok()?;
                let number = usize::try_from(number).ok()?;
                let own = Self {
                    folder: folder.to_owned(),
                    stem: stem.to_owned(),
                };
                Some((number, own))
            })
            .collect();
        found.sort_by_key(|(number, _)| *number);
        Ok(found)
    }
}
