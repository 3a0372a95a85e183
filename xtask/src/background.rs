//! A chore that runs next to another.

use std::{
    env,
    fs::{self, File},
    path::PathBuf,
    process::{Child, Command, Stdio},
};

use crate::process::target_directory;

/// A chore of this program in a process of its own. What it reports is kept until it is waited for, so that it does not
/// be between the lines of another.
pub struct Background {
    name: &'static str,
    child: Child,
    said: PathBuf,
}

impl Background {
    pub fn begin(name: &'static str) -> Result<Self, String> {
        let cannot = |e: std::io::Error| format!("cargo xtask {name}: {e}");
        let folder = target_directory().join("beside");
        fs::create_dir_all(&folder).map_err(cannot)?;
        let said = folder.join(format!("{name}.txt"));
        let file = File::create(&said).map_err(cannot)?;
        let child = Command::new(env::current_exe().map_err(cannot)?)
            .arg(name)
            .stdin(Stdio::null())
            .stderr(file.try_clone().map_err(cannot)?)
            .stdout(file)
            .spawn()
            .map_err(cannot)?;
        Ok(Self { name, child, said })
    }

    /// Waits for its end and shows what it has reported.
    pub fn end(mut self) -> Result<(), String> {
        let name = self.name;
        let status = self.child.wait().map_err(|e| format!("cargo xtask {name}: {e}"))?;
        print!("{}", fs::read_to_string(&self.said).unwrap_or_default());
        if status.success() {
            return Ok(());
        }
        Err(format!("failed ({status}): cargo xtask {name}"))
    }
}

/// Nothing continues after a chore that has failed.
impl Drop for Background {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
