"""A fresh interpreter that runs the Python blocks of a page one after the other.

It reads a block a line, as JSON, and answers by a line of JSON on the file that its first argument
numbers: null, or what went wrong. A comment after an expression that is a number, a list or a text
is what the reader is reported to expect, and compared.
"""

from __future__ import annotations

import ast
import json
import os
import sys
import traceback
from typing import Any


def run(code: str, names: dict[str, Any]) -> None:
    lines = code.splitlines()
    for node in ast.parse(code).body:
        if not isinstance(node, ast.Expr):
            exec(compile(ast.Module([node], []), "<block>", "exec"), names)
            continue
        value = eval(compile(ast.Expression(node.value), "<block>", "eval"), names)
        behind = lines[(node.end_lineno or 1) - 1][(node.end_col_offset or 0) :].strip()
        expected = behind.removeprefix("#").strip()
        if expected and expected[0] in "0123456789-['\"":
            found = repr(value) if isinstance(value, (str, list)) else str(value)
            if found != expected:
                raise AssertionError(f"{ast.unparse(node)} is {found}, the page states {expected}")


if __name__ == "__main__":
    names: dict[str, Any] = {"__name__": "__main__"}
    with os.fdopen(int(sys.argv[1]), "w") as answers:
        for line in sys.stdin:
            wrong = None
            try:
                run(json.loads(line), names)
            except BaseException:
                wrong = traceback.format_exc()
            sys.stdout.flush()
            sys.stderr.flush()
            print(json.dumps(wrong), file=answers, flush=True)
