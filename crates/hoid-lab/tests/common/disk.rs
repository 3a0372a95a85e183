//! A disk of limited size that can be filled.

use std::{
    fs,
    io::Write as _,
    path::Path,
    process::{Command, Stdio},
};

/// A separate disk that is mounted on a folder while this value exists: a `tmpfs`, which an administrator can mount on
/// Linux.
pub struct Disk<'a>(&'a Path);

impl<'a> Disk<'a> {
    /// Mounts a disk; `None` if no disk can be mounted.
    pub fn mount(at: &'a Path, kilobytes: usize) -> Option<Self> {
        let size = format!("size={kilobytes}k");
        let mount = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &size, "tmpfs"])
            .arg(at)
            .stderr(Stdio::null())
            .status();
        mount.is_ok_and(|status| status.success()).then_some(Self(at))
    }
}

impl Drop for Disk<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0).status();
    }
}

/// Fills the remaining space.
pub fn fill(ballast: &Path) {
    let Ok(mut file) = fs::File::create(ballast) else {
        return;
    };
    for part in [vec![0_u8; 1 << 16], vec![0; 1 << 10], vec![0; 7]] {
        while file.write_all(&part).is_ok() {}
    }
}

/// Copies all files to another place.
pub fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let target = to.join(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => copy_folder(&entry.path(), &target),
            false => drop(fs::copy(entry.path(), target).unwrap()),
        }
    }
}
