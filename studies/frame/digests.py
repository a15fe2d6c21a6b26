"""Digests: of the files that decide a study's rows, of what these use of the libraries, of rows, and of what a picture was drawn from.

A study depends on what its plan imports, directly or through other modules: a change to how effects are named moves no row of a study that
names none. Comments, docstrings and sentences decide nothing.
"""

import ast
import hashlib
import io
import re
import tokenize
from collections.abc import Iterator, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TypeGuard

import grimp

LIBRARIES = ("datasets", "synth", "estimator")
"""What makes, measures and scores a sequence."""
Span = tuple[tuple[int, int], tuple[int, int]]
"""From and to: line from 1, byte of it from 0."""
SENTENCE = re.compile("[A-Za-z]{2,} [a-z]{2,}")
"""What only texts for people have: two words side by side, the second one in small letters."""
SHORT = 12
"""Hexadecimal digits of a digest that is read by people; two of a few thousand sources agree in it once in ten million times."""


def of_modules(names: tuple[str, ...]) -> dict[str, str]:
    """The short digest of the source of every module, by name."""
    return {name: of_bytes(source_of(name).read_bytes()) for name in sorted(names)}


def source_of(module: str) -> Path:
    """The file of a module."""
    spec = find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin)


def of_libraries(modules: tuple[str, ...]) -> dict[str, str]:
    """The short digest of what ``modules`` use of every library, by the library's name."""
    used = used_by(modules)
    return {library: of_bytes(*_named_code(sorted(name for name in used if name.partition(".")[0] == library))) for library in LIBRARIES}


def used_by(modules: tuple[str, ...]) -> frozenset[str]:
    """All modules of the libraries that are imported by ``modules``, directly or through others; packages that lead there, too."""
    graph, found, left = _imports(tuple(sorted({name.partition(".")[0] for name in modules}))), set[str](), set(modules)
    while left:
        name = left.pop()
        found.add(name)
        package = name.rpartition(".")[0]
        left |= (graph.find_modules_directly_imported_by(name) | ({package} if package else set())) - found
    return frozenset(name for name in found if name.partition(".")[0] in LIBRARIES)


@cache
def _imports(packages: tuple[str, ...]) -> grimp.ImportGraph:
    return grimp.build_graph(*dict.fromkeys((*packages, *LIBRARIES)), cache_dir=None)


def _named_code(modules: Sequence[str]) -> Iterator[bytes]:
    for name in modules:
        yield name.encode()
        yield code_of(source_of(name).read_text(encoding="utf-8")).encode()


def code_of(source: str) -> str:
    """A module's text without comments, docstrings, strings that stand alone, sentences, and empty lines outside of other strings."""
    lines, told, within = source.split("\n"), list[Span](), set[int]()
    left: list[ast.AST] = [ast.parse(source)]
    while left:
        node = left.pop()
        if _is_told(node):
            told.append(_span(node))
            continue
        if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str | bytes)):
            (first, _), (last, _) = _span(node)
            within |= set(range(first, last))
        left += ast.iter_child_nodes(node)
    notes = [note for note in _comments(source) if not any(first <= note[0] < last for first, last in told)]
    for (first, start), (last, end) in sorted((*told, *notes), reverse=True):
        head, tail = lines[first - 1].encode()[:start].decode(), lines[last - 1].encode()[end:].decode()
        lines[first - 1 : last] = [head + tail] + [""] * (last - first)
        within -= set(range(first, last))
    text = ((line if number in within else line.rstrip(), number in within) for number, line in enumerate(lines, 1))
    return "\n".join(line for line, kept in text if kept or line)


def _is_told(node: ast.AST) -> TypeGuard[ast.expr | ast.stmt]:
    """Whether a node is a string that stands alone, or a sentence with all that is put into it."""
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    parts = node.values if isinstance(node, ast.JoinedStr) else [node]
    texts = [part.value for part in parts if isinstance(part, ast.Constant) and isinstance(part.value, str)]
    return any(SENTENCE.search(text) for text in texts)


def _span(node: ast.expr | ast.stmt) -> Span:
    return (node.lineno, node.col_offset), (node.end_lineno or node.lineno, node.end_col_offset or 0)


def _comments(source: str) -> Iterator[Span]:
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            before = len(token.line[: token.start[1]].encode())
            yield (token.start[0], before), (token.end[0], before + len(token.string.encode()))


def of_bytes(*parts: bytes) -> str:
    """A short digest of all parts."""
    found = hashlib.sha256()
    for part in parts:
        found.update(part + b"\0")
    return found.hexdigest()[:SHORT]
