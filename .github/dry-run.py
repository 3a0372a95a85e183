"""Runs the steps of the hosted workflows on this machine, as far as they go without accounts.

    python3 -m pip install pyyaml
    python3 .github/dry-run.py release            # or test, pages, advisories; with names of jobs after it: these alone
    python3 .github/dry-run.py --dev release      # without optimisation: a fraction of the time
    python3 .github/dry-run.py --list

A job runs for the entry of its matrix that is this platform, in a clone of the committed state. Commands run as
they stand; `cargo publish` and other steps that publish are made dry. For the actions, maturin's runs maturin from
PyPI, artifacts are folders, check-out and tools are what is here already; what is left (deployments, tokens) is
given by name. Jobs that need artifacts need the jobs that make them. It ends with a count, and with an error where a step has failed.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).resolve().parents[1]
#: Name of a runner of this platform in the matrices.
HERE = ("x86_64-unknown-linux-gnu", "linux-x86_64", "ubuntu-latest", "ubuntu-22.04", "ubuntu-24.04")
#: Actions that are not needed here: the clone, the tools of this machine, their caches.
AT_HAND = ("actions/checkout", "dtolnay/rust-toolchain", "Swatinem/rust-cache", "actions/setup-python", "actions/setup-node")
#: Commands that publish, and their replacements.
DRY = {"cargo publish ": "cargo package --allow-dirty --no-verify ", "gh release create": "echo gh release create"}
#: The same, built faster.
DEV = {"--profile shipped": "--profile dev", "/shipped/": "/debug/", "packages.py --install": "packages.py --profile dev --install"}
#: Possible results of a step.
OUTCOMES = ("passed", "failed", "not here")


def matrix_of(job: dict[str, Any]) -> dict[str, str] | None:
    """The entry for this platform; none if there is none."""
    matrix = job.get("strategy", {}).get("matrix")
    if not matrix:
        return {}
    entries = list(matrix.get("include", []))
    for key, values in matrix.items():
        if key not in ("include", "exclude"):
            entries = [{**entry, key: value} for value in values for entry in entries or [{}]]
    here = [entry for entry in entries if set(map(str, entry.values())) & set(HERE)]
    # The most specific name counts: a target before a shared runner.
    here.sort(key=lambda entry: min(HERE.index(str(v)) for v in entry.values() if str(v) in HERE))
    return here[0] if here else None


def filled(text: str, matrix: dict[str, str]) -> str:
    """Replaces the values of the matrix; other expressions are empty, as without an event."""
    text = re.sub(r"\$\{\{\s*matrix\.([\w-]+)\s*\}\}", lambda m: str(matrix[m[1]]), text)
    return re.sub(r"\$\{\{.*?\}\}", "", text)


def replaced(text: str, others: dict[str, str]) -> str:
    for old, new in others.items():
        text = text.replace(old, new)
    return text


def command_of(step: dict[str, Any], matrix: dict[str, str], artifacts: Path, tools: Path) -> str | None:
    """Returns the commands of a step; none if it needs the host."""
    if "run" in step:
        return replaced(filled(step["run"], matrix), DRY)
    action, given = step["uses"].split("@")[0], {k: filled(str(v), matrix) for k, v in step.get("with", {}).items()}
    if action in AT_HAND:
        return "true"
    if action == "PyO3/maturin-action":
        command = given.get("command", "build")
        return f"cd {given.get('working-directory', '.')} && {tools}/bin/maturin {command} {given.get('args', '')}"
    if action == "actions/upload-artifact":
        return f"mkdir -p {artifacts}/{given['name']} && cp -r {given['path']} {artifacts}/{given['name']}/"
    if action == "actions/download-artifact":
        return f"mkdir -p {given['path']} && cp -r {artifacts}/{given['pattern']}/* {given['path']}/"
    return None


def run(workflow: str, jobs: list[str], directory: Path, dev: bool) -> dict[str, int]:
    """Runs the jobs; returns the numbers of steps that passed, failed, and cannot run here."""
    described = yaml.safe_load((ROOT / f".github/workflows/{workflow}.yml").read_text(encoding="utf-8"))
    unknown = set(jobs) - set(described["jobs"])
    if unknown:
        sys.exit(f"{workflow} has no job {', '.join(sorted(unknown))}; there is {', '.join(described['jobs'])}")
    checkout, artifacts, tools = directory / "checkout", directory / "artifacts", directory / "tools"
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(checkout)], check=True)
    subprocess.run([sys.executable, "-m", "venv", str(tools)], check=True)
    subprocess.run([f"{tools}/bin/pip", "install", "--quiet", "maturin>=1.9.4,<2"], check=True)
    path = f"{tools}/bin{os.pathsep}{os.environ['PATH']}"
    counts = dict.fromkeys(OUTCOMES, 0)
    for name, job in described["jobs"].items():
        if jobs and name not in jobs:
            continue
        matrix = matrix_of(job)
        if matrix is None:
            print(f"{name}: no entry for this platform")
            continue
        for step in job["steps"]:
            title = filled(step.get("name") or step.get("run") or step["uses"], matrix).strip().splitlines()[0]
            command = command_of(step, matrix, artifacts, tools)
            outcome, begun = "not here", time.monotonic()
            if command is not None:
                command = replaced(command, DEV) if dev else command
                environment = {k: filled(str(v), matrix) for k, v in step.get("env", {}).items()}
                done = subprocess.run(
                    ["bash", "-euo", "pipefail", "-c", command],
                    cwd=checkout,
                    env={**os.environ, "PATH": path, "GITHUB_REF_NAME": "v0.0.0-dry", **environment},
                    stdin=subprocess.DEVNULL,
                    capture_output=True,
                    text=True,
                )
                outcome = "passed" if done.returncode == 0 else "failed"
                if outcome == "failed":
                    print("\n".join((done.stdout + done.stderr).splitlines()[-30:]))
            counts[outcome] += 1
            print(f"{outcome:8} {time.monotonic() - begun:5.0f} s  {workflow} / {name} / {title}", flush=True)
    return counts


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("workflow", nargs="?", help="name of a file in .github/workflows")
    parser.add_argument("jobs", nargs="*", help="these jobs alone")
    parser.add_argument("--dev", action="store_true", help="build without optimisation")
    parser.add_argument("--list", action="store_true", help="the workflows and their jobs")
    given = parser.parse_args()
    if given.list or given.workflow is None:
        for file in sorted((ROOT / ".github/workflows").glob("*.yml")):
            print(f"{file.stem}: {', '.join(yaml.safe_load(file.read_text(encoding='utf-8'))['jobs'])}")
        return
    directory = Path(tempfile.mkdtemp(prefix="hoid-workflow-"))
    try:
        counts = run(given.workflow, given.jobs, directory, given.dev)
    finally:
        shutil.rmtree(directory, ignore_errors=True)
    print(", ".join(f"{count} {outcome}" for outcome, count in counts.items()))
    sys.exit(counts["failed"] > 0)


if __name__ == "__main__":
    main()
