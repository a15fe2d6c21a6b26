"""Files spoiled in a seeded way: bits, pieces, headers, and values that are nasty in JSON, TOML and tables."""

import io
import json
import re
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np

Rng = np.random.Generator
Mutation = Callable[[bytes, Rng], bytes]

NASTY = (
    *("1e400", "-1e400", "NaN", "Infinity", "-Infinity", "1e308", "-1e308", "5e-324", "0", "-0.0", "-1", "1", "2", "0.5", "1e-9", "1e9"),
    *("1" * 400, "1" * 5000, "9223372036854775807", "9223372036854775808", "1000000000000000", "4294967296", "65536", "65537", "640.0"),
    *('""', '"a\\n"', '"\\ud800"', '"NaN"', '"Infinity"', '"1_0"', '"٣"', '"../x"', '"/etc/passwd"', '".."', '"[red]x[/red]"'),
    *('"a\\u0000b"', "[]", "{}", "null", "true", "false", "[" * 40 + "]" * 40, "[" * 5000 + "]" * 5000, '{"a":' * 300 + "1" + "}" * 300),
    '"' + "x" * 9000 + '"',
)
"""As they are written in JSON."""
PLAIN = (
    *("1e400", "nan", "inf", "-inf", "1_0", "٣", "1" * 400, "1" * 5000, "9" * 19, "-1", "0", "", "x", '"', "1e308", "5e-324", "[", "true"),
    *("=", "\0"),
)
"""As they are written in a table or TOML."""
SCALES: tuple[Callable[[Any], Any], ...] = (
    *(lambda x, k=k: x * 10**k for k in (3, 6, 9, 150)),
    *(lambda x, k=k: x / 10**k for k in (3, 6, 9, 150)),
    *(lambda x: -x, lambda _: 0, lambda _: 1, lambda _: 1e308, lambda _: -1e308, lambda _: 5e-324, lambda _: 2**53, lambda _: 1e-9),
)
INTEGERS = (0, 1, 2, 3, 7, 8, 16, 32, 255, 256, 32767, 32768, 65535, 65536, 2**24, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**63 - 1, 2**64 - 1)


def flipped(data: bytes, rng: Rng) -> bytes:
    """One to eight bits turned round."""
    found = bytearray(data)
    for at in rng.integers(0, len(data), rng.integers(1, 9)):
        found[at] ^= 1 << int(rng.integers(8))
    return bytes(found)


def cut(data: bytes, rng: Rng) -> bytes:
    """The end gone."""
    return data[: int(rng.integers(0, len(data)))]


def spliced(data: bytes, rng: Rng) -> bytes:
    """A piece removed, doubled, moved, or overwritten by zeros or noise."""
    a, b, c = sorted(int(x) for x in rng.integers(0, len(data) + 1, 3))
    b = min(b, a + 200)
    match int(rng.integers(5)):
        case 0:
            return data[:a] + data[b:]
        case 1:
            return data[:b] + data[a:]
        case 2:
            return data[:a] + data[b:c] + data[a:b] + data[c:]
        case 3:
            return data[:a] + bytes(b - a) + data[b:]
    return data[:a] + rng.bytes(b - a) + data[b:]


def overwritten(data: bytes, rng: Rng) -> bytes:
    """One to three numbers of a binary header, most often near the beginning or the end, replaced by nasty ones."""
    found = bytearray(data)
    for _ in range(int(rng.integers(1, 4))):
        width, order = int(rng.choice([1, 2, 4, 8])), str(rng.choice(["little", "big"]))
        ends = min(len(data), 400)
        at = int(rng.choice([rng.integers(0, len(data)), rng.integers(0, ends), len(data) - 1 - rng.integers(0, ends)]))
        found[at : at + width] = (int(rng.choice(np.array(INTEGERS, dtype=object))) % 256**width).to_bytes(width, order)
    return bytes(found)


BYTES: tuple[Mutation, ...] = (flipped, cut, spliced, overwritten)


def json_value(data: bytes, rng: Rng) -> bytes:
    """One to two values of a document replaced, removed, doubled or exchanged; its sha256 is taken out, as by a person who edits."""
    document = json.loads(data)
    document.pop("sha256", None)
    for _ in range(int(rng.integers(1, 3))):
        _spoil(document, rng)
    text = json.dumps(document, ensure_ascii=bool(rng.integers(2)))
    text = re.sub(r'"@@(\d+)@@"', lambda found: NASTY[int(found[1])], text)
    if rng.random() < 0.1:  # a key twice
        text = re.sub(r'("\w+"): ([\d.]+|"\w*")', r"\1: \2, \1: \2", text, count=int(rng.integers(1, 4)))
    return text.encode()


def unsigned(data: bytes, rng: Rng) -> bytes:
    """Bits turned round or pieces moved in a document whose sha256 is taken out."""
    return (flipped, spliced)[int(rng.integers(2))](re.sub(rb'"sha256": "\w+"(,\s*)?', b"", data), rng)


def _spoil(document: Any, rng: Rng) -> None:
    """Change one entry of a document in its place."""
    places = list(_places(document))
    numbers = [(h, k) for h, k in places if isinstance(h[k], int | float) and not isinstance(h[k], bool)]
    if numbers and rng.random() < 0.5:  # a document that still fits its schema gets further into a reader
        holder, key = numbers[int(rng.integers(len(numbers)))]
        holder[key] = SCALES[int(rng.integers(len(SCALES)))](holder[key])
        return
    holder, key = places[int(rng.integers(len(places)))]
    match int(rng.integers(5)):
        case 0:
            del holder[key]
        case 1:
            other, name = places[int(rng.integers(len(places)))]
            holder[key] = json.loads(json.dumps(other[name]))
        case 2 if isinstance(holder[key], list):
            holder[key] = holder[key][:-1] if rng.integers(2) else holder[key] * 2
        case _:
            holder[key] = f"@@{int(rng.integers(len(NASTY)))}@@"


def _places(value: Any) -> Any:
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, entry in entries:
        yield value, key
        yield from _places(entry)


def text_value(data: bytes, rng: Rng) -> bytes:
    """One to three words of a table or TOML replaced, or a line removed or doubled."""
    text = data.decode()
    for _ in range(int(rng.integers(1, 4))):
        words = list(re.finditer(r"[^\s,=\[\]]+", text))
        lines = text.splitlines(keepends=True)
        if not words or rng.random() < 0.2:
            at = int(rng.integers(len(lines))) if lines else 0
            text = "".join(lines[:at] + lines[at + 1 :] if rng.integers(2) else lines[: at + 1] + lines[at:])
            continue
        word = words[int(rng.integers(len(words)))]
        text = text[: word.start()] + PLAIN[int(rng.integers(len(PLAIN)))] + text[word.end() :]
    return text.encode()


def member(data: bytes, rng: Rng) -> bytes:
    """A zip archive with one of its members spoiled and packed anew, so that its checksum holds."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    name = list(parts)[int(rng.integers(len(parts)))]
    parts[name] = ARRAY[int(rng.integers(len(ARRAY)))](parts[name], rng)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", int(rng.choice([zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED]))) as archive:
        for key, part in parts.items():
            archive.writestr(key, part)
    return packed.getvalue()


def stated_shape(data: bytes, rng: Rng) -> bytes:
    """Another shape or type in the header of a NumPy array."""
    shape = str(rng.choice(["(1000000000000,)", "(0,)", "()", "(-1, 2)", "(3,2)", "(2,)", "('a',)"]))
    kind = str(rng.choice(["<f8", "<i8", "|O", "<U3", "<c16", ">f4", "<M8[s]", "|V8", "?"]))
    pattern, put = (rb"\([^)]*\)", shape) if rng.integers(2) else (rb"'<[fi]8'", f"'{kind}'")
    header = re.sub(pattern, put.encode(), data[:128], count=1)
    return header[:127].rstrip().ljust(127) + b"\n" + data[128:]


ARRAY: tuple[Mutation, ...] = (flipped, cut, spliced, overwritten, stated_shape, stated_shape)
JSON: tuple[Mutation, ...] = (flipped, unsigned, cut, spliced, json_value, json_value, json_value, json_value)
TEXT: tuple[Mutation, ...] = (flipped, cut, spliced, text_value, text_value, text_value)
ARCHIVE: tuple[Mutation, ...] = (*BYTES, member, member)
