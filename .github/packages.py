"""Examines packages before they are published, and installs them outside the repository.

    python3 .github/packages.py target/package/*.crate python/dist/*      # both licence texts in each
    python3 .github/packages.py --install target/package/*.crate          # built of the packages alone, then tried

A wheel or source distribution is installed into an environment of its own. Crates are unpacked and replace those
of crates.io, which are not available yet. Needs Python's library alone; `--profile dev` builds faster.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tarfile
import tempfile
import time
import venv
import zipfile
from pathlib import Path

LICENCES = ("LICENSE-MIT", "LICENSE-APACHE")
#: The crate of the program.
PROGRAM = "hoid-cli"
#: First commands of a user. Their output must start with the verdict.
TRIAL = "import pyhoid; print(pyhoid.identify(pyhoid.simulate('C1', seed=1)))"


def contents(package: Path) -> dict[str, int]:
    """The files of a package and their sizes."""
    if package.suffix == ".whl":
        with zipfile.ZipFile(package) as wheel:
            return {file.filename: file.file_size for file in wheel.infolist()}
    with tarfile.open(package) as archive:
        return {file.name: file.size for file in archive.getmembers()}


def licences_missing(package: Path) -> list[str]:
    """Returns missing or incomplete texts: a link in place of a text has only a few bytes."""
    files = contents(package)
    return [name for name in LICENCES if not any(Path(file).name == name and size > 900 for file, size in files.items())]


def run(command: list[str | Path], directory: Path, environment: dict[str, str] | None = None) -> str:
    begun = time.monotonic()
    done = subprocess.run(
        [str(word) for word in command],
        cwd=directory,
        env={**os.environ, **(environment or {})},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    print(f"{time.monotonic() - begun:6.0f} s  {Path(command[0]).name} {' '.join(map(str, command[1:3]))} ...", flush=True)
    return done.stdout


def try_program(crates: list[Path], profile: str, directory: Path) -> None:
    """Installs the program of unpacked crates, and lets it identify a simulated person."""
    unpacked = directory / "crates"
    for crate in crates:
        with tarfile.open(crate) as archive:
            archive.extractall(unpacked, filter="data")
    patches = [f'{folder.name.rsplit("-", 1)[0]} = {{ path = "{folder}" }}' for folder in sorted(unpacked.iterdir())]
    (unpacked / ".cargo").mkdir()
    (unpacked / ".cargo" / "config.toml").write_text("[patch.crates-io]\n" + "\n".join(patches) + "\n", encoding="utf-8")
    folder = next(folder for folder in unpacked.iterdir() if folder.name.rsplit("-", 1)[0] == PROGRAM)
    run(["cargo", "install", "--path", folder, "--root", directory / "installed", "--profile", profile], unpacked)
    program = directory / "installed" / "bin" / "hoid"
    run([program, "simulate", "--condition", "C1", "--seed", "1", "--out", "c1.csv"], directory)
    tell(run([program, "identify", "c1.csv"], directory))


def try_module(package: Path, profile: str, directory: Path) -> None:
    """Installs a wheel or a source distribution into a new environment, and does the same with it."""
    environment = directory / f"environment{package.suffix}"
    venv.create(environment, with_pip=True)
    python = environment / ("Scripts" if os.name == "nt" else "bin") / "python"
    run([python, "-m", "pip", "install", "--quiet", package.absolute()], directory, {"MATURIN_PEP517_ARGS": f"--profile {profile}"})
    tell(run([python, "-c", TRIAL], directory))


def tell(output: str) -> None:
    if not output.startswith("Verdict: trustworthy"):
        sys.exit(f"what was installed does not identify a simulated person:\n{output}")
    print("         " + output.splitlines()[0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("packages", nargs="+", type=Path, help=".crate, .whl, .tar.gz")
    parser.add_argument("--install", action="store_true", help="install the program of the crates, each wheel and source distribution")
    parser.add_argument("--profile", default="release", help="of cargo, for what is built")
    given = parser.parse_args()
    wrong = False
    for package in given.packages:
        missing = licences_missing(package)
        wrong |= bool(missing)
        print(f"{package.name}: {', '.join(missing) + ' missing' if missing else 'both licence texts'}")
    if wrong:
        sys.exit(1)
    if given.install:
        with tempfile.TemporaryDirectory(prefix="hoid-packages-") as name:
            directory = Path(name)
            crates = [package.absolute() for package in given.packages if package.suffix == ".crate"]
            if crates:
                try_program(crates, given.profile, directory)
            for package in given.packages:
                if package.suffix != ".crate":
                    try_module(package, given.profile, directory)


if __name__ == "__main__":
    main()
