"""Common parts of results that consist of their JSON alone: verdict, settings, equality."""

from __future__ import annotations

import json
from typing import Any

from .verdict import Verdict

__all__ = ["JsonResult"]


class JsonResult:
    """A result that consists of its JSON alone."""

    #: Verdict on the result: level, reasons and notes.
    verdict: Verdict
    #: The settings that were used.
    settings: dict[str, str]

    def __init__(self, text: str) -> None:
        self._text = text
        self._read(json.loads(text))

    def _read(self, found: dict[str, Any]) -> None:
        self.verdict = Verdict(*(found["verdict"][key] for key in ("level", "reasons", "notes")))
        self.settings = {s["name"]: s["value"] for s in found["settings"]}

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self) or not isinstance(other, JsonResult):
            return NotImplemented
        return bool(json.loads(self._text) == json.loads(other._text))

    def __hash__(self) -> int:
        return hash(json.dumps(json.loads(self._text)))
