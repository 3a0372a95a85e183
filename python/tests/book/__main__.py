"""Lists the code blocks of README and book, and how each is tested."""

from __future__ import annotations

from .pages import blocks, name, pages

for page in pages():
    for block in blocks(page):
        marks = "; ".join(f"{kind}: {' '.join(value.split())}" for kind, value in block.marks)
        print(f"{name(page)}:{block.line} {block.language}" + (f" ({marks})" if marks else ""))
