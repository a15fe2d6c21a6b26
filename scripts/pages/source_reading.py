"""What the pages about the code itself read off its source: modules of the estimator, docstrings, imports, who uses whom."""

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ESTIMATOR = ROOT / "estimator"


@cache
def modules() -> tuple[Path, ...]:
    """The estimator's files, in order."""
    return tuple(sorted(ESTIMATOR.rglob("*.py")))


@cache
def tree(path: Path) -> ast.Module:
    """A file's syntax tree."""
    return ast.parse(path.read_text(encoding="utf-8"))


def room_of(path: Path) -> str:
    """The room that a file lies in; a file outside of all is one of its own."""
    first = path.relative_to(ESTIMATOR).parts[0]
    return first.removesuffix(".py")


def dotted(path: Path) -> str:
    """A file's name as a module."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def file_of(module: str) -> Path:
    """The file of a module or package."""
    path = ROOT.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def first_sentence(node: ast.AsyncFunctionDef | ast.FunctionDef | ast.ClassDef | ast.Module) -> str:
    """The first sentence of a docstring, in one line."""
    paragraph = " ".join((ast.get_docstring(node) or "").split("\n\n")[0].split())
    return paragraph.split("; ")[0].rstrip(".")


@cache
def imported(path: Path) -> tuple[tuple[str, str], ...]:
    """Modules and names that a file imports from the estimator."""
    nodes = [n for n in ast.walk(tree(path)) if isinstance(n, ast.ImportFrom) and (n.module or "").startswith("estimator")]
    return tuple((str(node.module), alias.name) for node in nodes for alias in node.names)


@cache
def rooms_imported() -> dict[str, set[str]]:
    """Of every room the other rooms that its files import."""
    found: dict[str, set[str]] = {room_of(path): set() for path in modules() if path != ESTIMATOR / "__init__.py"}
    for path in modules():
        for module, _ in imported(path):
            other = module.split(".")[1]
            if other != room_of(path) and path != ESTIMATOR / "__init__.py":
                found[room_of(path)].add(other)
    return found


def function(name: str) -> ast.FunctionDef:
    """A function by its dotted name."""
    module, _, key = name.rpartition(".")
    (found,) = (n for n in tree(file_of(module)).body if isinstance(n, ast.FunctionDef) and n.name == key)
    return found


@cache
def used_by(name: str) -> frozenset[str]:
    """Functions of the estimator, by dotted name, whose names a function's body holds; it may hand them on instead of calling them."""
    module, _, _ = name.rpartition(".")
    path = file_of(module)
    near = {n.name: f"{module}.{n.name}" for n in tree(path).body if isinstance(n, ast.FunctionDef)}
    far = {key: f"{other}.{key}" for other, key in imported(path)}
    names = {n.id for n in ast.walk(function(name)) if isinstance(n, ast.Name)}
    known = {(near | far)[key] for key in names if key in near | far}
    return frozenset(other for other in known if _is_function(other))


def _is_function(name: str) -> bool:
    module, _, key = name.rpartition(".")
    return file_of(module).exists() and any(isinstance(n, ast.FunctionDef) and n.name == key for n in tree(file_of(module)).body)


@cache
def reached_from(name: str) -> frozenset[str]:
    """All functions that can be reached from one."""
    reached, ahead = {name}, [name]
    while ahead:
        new = used_by(ahead.pop()) - reached
        reached |= new
        ahead += new
    return frozenset(reached)
