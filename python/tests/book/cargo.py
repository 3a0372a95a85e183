"""`cargo` for the blocks of the book: the tests provide the release builds.

| block | runs |
|---|---|
| `cargo run --release -- ...` | the program of the tests |
| `cargo run --release -p CRATE --example NAME -- ...` | the example, as the tests have compiled it |
| `cargo xtask slow NAME ...` | its example, the same |
| `cargo test -p CRATE ...` | with the features of the whole workspace, as the tests have compiled it |
| `cargo xtask ffi --out DIR` | the same with the libraries of the tests |
| `cargo xtask test` | nothing: that is what runs |
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]


def command(arguments: list[str]) -> list[str]:
    program = Path(os.environ["HOID_BINARY"])
    words = list(arguments)
    rest = words[words.index("--") + 1 :] if "--" in words else []
    if words[0] == "run":
        if "--example" not in words:
            return [str(program), *rest]
        return [example(program, words[words.index("--example") + 1]), *rest]
    if words[:2] == ["xtask", "slow"]:
        return [example(program, words[2].replace("-", "_")), *words[3:]]
    if words[:3] == ["xtask", "ffi", "--out"]:
        out = str(Path(words[3]).absolute())
        os.chdir(ROOT)
        os.environ["CARGO_TARGET_DIR"] = target_folder(program)
        return [real_cargo(), "xtask", "ffi", "--dev", "--out", out]
    if words[:2] == ["xtask", "test"]:
        return ["true"]
    if words[0] == "test":
        if "-p" in words:
            crate = words.index("-p")
            words[crate : crate + 2] = ["--workspace"]
        if "--test" not in words:
            # Not `--lib`, which includes the Python module.
            words.insert(2, "--tests")
        # The directory with the configuration of cargo.
        os.chdir(ROOT)
        target = ["--target-dir", target_folder(program)]
        return [real_cargo(), words[0], *target, *words[1:]]
    sys.exit(f"cargo {' '.join(words)}: the tests of the book do not know this command")


def target_folder(program: Path) -> str:
    return os.environ.get("CARGO_TARGET_DIR") or str(program.parents[1])


def example(program: Path, name: str) -> str:
    path = program.parent / "examples" / (name + program.suffix)
    if not path.exists():
        sys.exit(f"no example {path}; cargo build --workspace --examples makes it")
    return str(path)


def real_cargo() -> str:
    """The next cargo in the path."""
    behind = os.environ["PATH"].split(os.pathsep)[1:]
    return next(
        str(Path(folder) / "cargo") for folder in behind if (Path(folder) / "cargo").exists()
    )


if __name__ == "__main__":
    found = command(sys.argv[1:])
    os.execvp(found[0], found)
