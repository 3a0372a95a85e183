"""Streams of LabStreamingLayer as a file, as a recorder writes them: XDF 1.0 of double64
(github.com/sccn/xdf/wiki/Specifications)."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Stream:
    name: str
    rate: float
    labels: Sequence[str]
    stamps: Sequence[float]
    rows: Sequence[Sequence[float]]
    #: Times on the clock of the stream, and the offsets to the clock of the recorder, s.
    offsets: Sequence[tuple[float, float]] = ()


def write(path: Path, streams: Sequence[Stream]) -> None:
    parts = [b"XDF:", _chunk(1, b'<?xml version="1.0"?><info><version>1.0</version></info>')]
    for number, stream in enumerate(streams, 1):
        parts.append(_chunk(2, struct.pack("<I", number) + _header(stream)))
        parts += [
            _chunk(4, struct.pack("<Idd", number, time, offset)) for time, offset in stream.offsets
        ]
        samples = zip(stream.stamps, stream.rows, strict=True)
        content = b"".join(
            struct.pack(f"<Bd{len(stream.labels)}d", 8, stamp, *row) for stamp, row in samples
        )
        count = struct.pack("<I", number) + _length(len(stream.rows))
        parts.append(_chunk(3, count + content))
        footer = (
            f"<?xml version='1.0'?><info><sample_count>{len(stream.rows)}</sample_count></info>"
        )
        parts.append(_chunk(6, struct.pack("<I", number) + footer.encode()))
    path.write_bytes(b"".join(parts))


def _header(stream: Stream) -> bytes:
    channels = "".join(f"<channel><label>{label}</label></channel>" for label in stream.labels)
    return (
        f'<?xml version="1.0"?><info><name>{stream.name}</name><type>Person</type>'
        f"<channel_count>{len(stream.labels)}</channel_count>"
        f"<nominal_srate>{stream.rate}</nominal_srate><channel_format>double64</channel_format>"
        f"<desc><channels>{channels}</channels></desc></info>"
    ).encode()


def _chunk(tag: int, content: bytes) -> bytes:
    return _length(len(content) + 2) + struct.pack("<H", tag) + content


def _length(n: int) -> bytes:
    return struct.pack("<BB", 1, n) if n < 256 else struct.pack("<BI", 4, n)
