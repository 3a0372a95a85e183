//! Tasks that run in parallel with other tasks.

use std::{
    env,
    fs::{self, File},
    path::PathBuf,
    process::{Child, Command, Stdio},
};

use crate::process::target_directory;

/// A task of this program in a separate process. Its output is stored until the task has ended, so it does not mix with
/// the output of other tasks.
pub struct Background {
    name: &'static str,
    child: Child,
    output_file: PathBuf,
}

impl Background {
    pub fn spawn(name: &'static str) -> Result<Self, String> {
        let cannot = |e: std::io::Error| format!("cargo xtask {name}: {e}");
        let folder = target_directory().join("beside");
        fs::create_dir_all(&folder).map_err(cannot)?;
        let output_file = folder.join(format!("{name}.txt"));
        let file = File::create(&output_file).map_err(cannot)?;
        let child = Command::new(env::current_exe().map_err(cannot)?)
            .arg(name)
            .stdin(Stdio::null())
            .stderr(file.try_clone().map_err(cannot)?)
            .stdout(file)
            .spawn()
            .map_err(cannot)?;
        Ok(Self {
            name,
            child,
            output_file,
        })
    }

    /// Waits for the end of the task and prints its output.
    pub fn wait(mut self) -> Result<(), String> {
        let name = self.name;
        let status = self.child.wait().map_err(|e| format!("cargo xtask {name}: {e}"))?;
        print!("{}", fs::read_to_string(&self.output_file).unwrap_or_default());
        if status.success() {
            return Ok(());
        }
        Err(format!("failed ({status}): cargo xtask {name}"))
    }
}

/// Kills a task that is still running, for example after another task has failed.
impl Drop for Background {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
