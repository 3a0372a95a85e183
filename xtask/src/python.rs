//! The tests of the Python package: a fresh virtual environment, the wheel, pytest.
//!
//! The wheel is built with the profile of the tests and in their target folder, so that what they
//! have compiled is not compiled again; the test requirements come from PyPI. `HOID_PYTHON` names
//! another interpreter than `python3`.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    counts::Counts,
    process::{AS_TESTS, SHIPPED, cargo, each_line, run, target_directory},
    processors::{BUILT, other_processors},
};

/// Oldest Python that the package supports.
const OLDEST: (u32, u32) = (3, 10);

/// Builds and installs the wheel, and runs pytest with these arguments.
pub fn test(arguments: &[String]) -> Result<Counts, String> {
    let target = target_directory();
    // The same command line as the tests', to compare with, and the examples that the book runs.
    cargo(&[&AS_TESTS[..], &["--quiet"]].concat(), &[])?;
    other_processors("dev")?;
    let python = environment(Wheel::OfTests)?;
    let mut counts = Counts::default();
    let mut command = Command::new(&python);
    command
        .args(["-W", "error", "-m", "pytest", "--color=no", "--durations=5"])
        .args(arguments)
        .current_dir(package()?)
        .env("MPLBACKEND", "Agg")
        .env(BUILT, "1")
        .env(
            "HOID_BINARY",
            target.join("debug").join(format!("hoid{}", env::consts::EXE_SUFFIX)),
        );
    let shown = format!("{command:?}");
    let status = each_line(&mut command, |line| counts.add_pytest(line))?;
    if !status.success() && counts.failed == 0 {
        return Err(format!("failed ({status}): {shown}"));
    }
    Ok(counts)
}

/// How the wheel is built and what comes with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wheel {
    /// As the tests have compiled it, with what they require.
    OfTests,
    /// As it is shipped, with what the places need.
    Shipped,
}

/// A fresh environment with the package in it; its interpreter. For that of the tests the workspace is built before.
pub fn environment(wheel: Wheel) -> Result<PathBuf, String> {
    let target = target_directory();
    let work = target.join("python");
    let (place, extra, others, profile) = match wheel {
        Wheel::OfTests => (
            "venv",
            "test",
            &[][..],
            &["--profile", "dev", "--features", "as-in-workspace"][..],
        ),
        Wheel::Shipped => ("venv-shipped", "lsl", &["fmpy"][..], &["--profile", SHIPPED][..]),
    };
    let python = fresh_environment(&work.join(place))?;
    let wheels = work.join("wheels");
    let _ = fs::remove_dir_all(&wheels);
    pip(&python, &["maturin>=1.9.4,<2"])?;
    run(Command::new(&python)
        .args(["-m", "maturin", "build"])
        .args(profile)
        .arg("--out")
        .arg(&wheels)
        .current_dir(package()?)
        .env("CARGO_TARGET_DIR", &target))?;
    let built = fs::read_dir(&wheels)
        .map_err(|e| format!("{}: {e}", wheels.display()))?
        .filter_map(Result::ok)
        .map(|entry| entry.path())
        .find(|path| path.extension().is_some_and(|e| e == "whl"))
        .ok_or_else(|| format!("maturin has left no wheel in {}", wheels.display()))?;
    let with_extra = format!("{}[{extra}]", built.display());
    pip(&python, &[&[with_extra.as_str()], others].concat())?;
    Ok(python)
}

/// The folder of the package.
pub fn package() -> Result<PathBuf, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent();
    Ok(root.ok_or("the folder of xtask has no parent")?.join("python"))
}

/// A virtual environment with nothing in it; returns its interpreter.
fn fresh_environment(directory: &Path) -> Result<PathBuf, String> {
    let base = interpreter()?;
    let _ = fs::remove_dir_all(directory);
    run(Command::new(&base).args(["-m", "venv"]).arg(directory)).map_err(|e| {
        format!(
            "{e}\nthe tests of the Python package need the module venv; on Debian and Ubuntu: apt install python3-venv"
        )
    })?;
    Ok(if cfg!(windows) {
        directory.join("Scripts").join("python.exe")
    } else {
        directory.join("bin").join("python")
    })
}

/// An interpreter that is not too old.
fn interpreter() -> Result<String, String> {
    let named = env::var("HOID_PYTHON").ok();
    let names: Vec<String> = match named {
        Some(name) => vec![name],
        None => [
            "python3",
            "python",
            "python3.13",
            "python3.12",
            "python3.11",
            "python3.10",
        ]
        .map(str::to_owned)
        .to_vec(),
    };
    let mut found = Vec::new();
    for name in names {
        let asked = Command::new(&name)
            .args(["-c", "import sys; print(*sys.version_info[:2])"])
            .output();
        let Ok(output) = asked else { continue };
        let text = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        let mut parts = text.split(' ').map(str::parse::<u32>);
        if let (Some(Ok(major)), Some(Ok(minor))) = (parts.next(), parts.next()) {
            if (major, minor) >= OLDEST {
                return Ok(name);
            }
            found.push(format!("{name} is {major}.{minor}"));
        }
    }
    Err(format!(
        "the tests of the Python package need Python {}.{} or newer{}; install it, or name it in HOID_PYTHON",
        OLDEST.0,
        OLDEST.1,
        if found.is_empty() {
            ", and none was found".to_owned()
        } else {
            format!(" ({})", found.join(", "))
        }
    ))
}

fn pip(python: &Path, packages: &[&str]) -> Result<(), String> {
    run(Command::new(python)
        .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"])
        .args(packages))
}
