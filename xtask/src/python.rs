//! Tests of the Python package: a new virtual environment, the wheel, and pytest.
//!
//! The wheel is built with the profile and in the target folder of the tests, so nothing is compiled twice; the
//! requirements of the tests are installed from PyPI. `HOID_PYTHON` gives an interpreter other than `python3`.
//!
//! `cargo xtask test` runs the first two steps in parallel with the tests of Rust (module `background`), because they
//! need different resources and each leaves a processor idle at times.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    counts::Counts,
    process::{SHIPPED_PROFILE, TEST_BUILD_ARGUMENTS, cargo, run, run_by_line, target_directory},
    processors::{BUILT_VARIABLE, build_for_other_processors},
};

/// Name of the task that creates the environment; `BUILD_TASK` is the name of the task that builds the wheel. `cargo
/// xtask test` runs both in parallel with the tests of Rust.
pub const REQUIRE_TASK: &str = "python-require";
pub const BUILD_TASK: &str = "python-build";

/// Oldest Python version that the package supports.
const OLDEST_PYTHON: (u32, u32) = (3, 10);

/// Builds and installs the wheel, and runs pytest with these arguments.
pub fn test(arguments: &[String]) -> Result<Counts, String> {
    create_test_environment()?;
    build()?;
    pytest(arguments)
}

/// Creates a new environment with all requirements of the tests except the wheel; Rust is not needed.
pub fn create_test_environment() -> Result<(), String> {
    create_environment(Wheel::OfTests).map(|_| ())
}

/// Builds the wheel and all programs that its tests run, and installs the wheel after `create_test_environment`.
pub fn build() -> Result<(), String> {
    // This builds the command-line program as for the tests of Rust, for comparison, and the examples of the book.
    cargo(&[&TEST_BUILD_ARGUMENTS[..], &["--quiet"]].concat(), &[])?;
    build_for_other_processors("dev")?;
    install(Wheel::OfTests)
}

/// Runs the tests after `build`.
pub fn pytest(arguments: &[String]) -> Result<Counts, String> {
    let mut counts = Counts::default();
    let mut command = Command::new(Wheel::OfTests.python());
    command
        .args(["-W", "error", "-m", "pytest", "--color=no", "--durations=5"])
        .args(["--numprocesses=logical", "--dist=loadgroup"])
        .args(arguments)
        .current_dir(package_folder()?)
        .env("MPLBACKEND", "Agg")
        .env(BUILT_VARIABLE, "1")
        .env(
            "HOID_BINARY",
            target_directory()
                .join("debug")
                .join(format!("hoid{}", env::consts::EXE_SUFFIX)),
        );
    let shown = format!("{command:?}");
    let status = run_by_line(&mut command, |line| counts.add_pytest(line))?;
    if !status.success() && counts.failed == 0 {
        return Err(format!("failed ({status}): {shown}"));
    }
    Ok(counts)
}

/// Build profile of the wheel and its requirements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wheel {
    /// The profile of the tests, with the requirements of the tests.
    OfTests,
    /// The profile of shipped wheels, with the requirements of the interfaces.
    Shipped,
}

impl Wheel {
    /// Folder of the virtual environment.
    fn folder(self) -> PathBuf {
        target_directory().join("python").join(match self {
            Self::OfTests => "venv",
            Self::Shipped => "venv-shipped",
        })
    }

    fn python(self) -> PathBuf {
        self.folder().join(if cfg!(windows) {
            "Scripts/python.exe"
        } else {
            "bin/python"
        })
    }

    /// Name of the optional requirements (`[project.optional-dependencies]`) that are installed with the package.
    const fn extra_name(self) -> &'static str {
        match self {
            Self::OfTests => "test",
            Self::Shipped => "lsl",
        }
    }
}

/// Creates a new environment with the package and returns its interpreter. The tests require that the workspace was
/// built before.
pub fn environment_with_package(wheel: Wheel) -> Result<PathBuf, String> {
    create_environment(wheel)?;
    install(wheel)?;
    Ok(wheel.python())
}

/// Creates a new environment with the requirements for building the wheel and for its tests.
fn create_environment(wheel: Wheel) -> Result<(), String> {
    create_empty_environment(&wheel.folder())?;
    let project = package_folder()?.join("pyproject.toml");
    let text = fs::read_to_string(&project).map_err(|e| format!("{}: {e}", project.display()))?;
    let required = requirements(&text, wheel.extra_name());
    let others = match wheel {
        Wheel::OfTests => &["maturin>=1.9.4,<2"][..],
        Wheel::Shipped => &["maturin>=1.9.4,<2", "fmpy"],
    };
    pip_install(&wheel.python(), &[others, &required].concat())
}

/// Returns the optional requirements of a project under the name `extra`, in the format of pip.
fn requirements<'a>(project: &'a str, extra: &str) -> Vec<&'a str> {
    let extras = project
        .split_once("[project.optional-dependencies]")
        .map_or("", |(_, rest)| rest);
    let list = extras
        .split_once(&format!("\n{extra} = ["))
        .map_or("", |(_, rest)| rest);
    let mut found = Vec::new();
    // Every second part is in quotes, where brackets belong to a requirement, such as `dask[distributed]`.
    for (number, part) in list.split('"').enumerate() {
        match number % 2 {
            1 => found.push(part),
            _ if part.contains(']') => break,
            _ => {}
        }
    }
    found
}

/// Builds the wheel and installs it.
fn install(wheel: Wheel) -> Result<(), String> {
    let target = target_directory();
    let python = wheel.python();
    let profile = match wheel {
        Wheel::OfTests => &["--profile", "dev", "--features", "as-in-workspace"][..],
        Wheel::Shipped => &["--profile", SHIPPED_PROFILE],
    };
    let wheels = target.join("python").join("wheels");
    let _ = fs::remove_dir_all(&wheels);
    run(Command::new(&python)
        .args(["-m", "maturin", "build"])
        .args(profile)
        .arg("--out")
        .arg(&wheels)
        .current_dir(package_folder()?)
        .env("CARGO_TARGET_DIR", &target))?;
    let built = fs::read_dir(&wheels)
        .map_err(|e| format!("{}: {e}", wheels.display()))?
        .filter_map(Result::ok)
        .map(|entry| entry.path())
        .find(|path| path.extension().is_some_and(|e| e == "whl"))
        .ok_or_else(|| format!("maturin wrote no wheel to {}", wheels.display()))?;
    pip_install(&python, &[&format!("{}[{}]", built.display(), wheel.extra_name())])
}

/// Returns the folder of the Python package.
pub fn package_folder() -> Result<PathBuf, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent();
    Ok(root.ok_or("the folder of xtask has no parent")?.join("python"))
}

/// Creates an empty virtual environment.
fn create_empty_environment(directory: &Path) -> Result<(), String> {
    let base = interpreter()?;
    let _ = fs::remove_dir_all(directory);
    run(Command::new(&base).args(["-m", "venv"]).arg(directory)).map_err(|e| {
        format!(
            "{e}\nthe tests of the Python package need the module venv; on Debian and Ubuntu: apt install python3-venv"
        )
    })
}

/// Returns a Python interpreter that is recent enough.
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
            if (major, minor) >= OLDEST_PYTHON {
                return Ok(name);
            }
            found.push(format!("{name} is {major}.{minor}"));
        }
    }
    Err(format!(
        "the tests of the Python package need Python {}.{} or newer{}; install it, or name it in HOID_PYTHON",
        OLDEST_PYTHON.0,
        OLDEST_PYTHON.1,
        if found.is_empty() {
            ", and none was found".to_owned()
        } else {
            format!(" ({})", found.join(", "))
        }
    ))
}

fn pip_install(python: &Path, packages: &[&str]) -> Result<(), String> {
    run(Command::new(python)
        .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"])
        .args(packages))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requirements_of_an_extra_are_found() {
        let project = "[project]\ntest = [\"no\"]\n\n[project.optional-dependencies]\nlsl = [\"pylsl\"]\n\
                       test = [\n    \"pytest\",\n    \"matplotlib>=3.7\",\n    \"dask[distributed]\",\n    \"pyxdf\",\n]\n\
                       last = [\"other\"]\n";
        let found = |extra| requirements(project, extra);
        assert_eq!(
            found("test"),
            ["pytest", "matplotlib>=3.7", "dask[distributed]", "pyxdf"]
        );
        assert_eq!(found("lsl"), ["pylsl"]);
        assert_eq!(found("last"), ["other"]);
        assert!(found("none").is_empty());
    }
}
