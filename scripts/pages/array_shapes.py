"""Which public array arguments of the estimator have a shape that a reader is told, read off the source.

``python -m scripts.pages.array_shapes`` lists those that have none. An argument of a public function or method, or a field of a public
dataclass, counts where it is annotated as a plain array (``NDArray`` or an alias of it). Its shape is told by jaxtyping, or by its
docstring (that of its class, for a field) as its name followed by sizes between brackets, (n, 3); several names may share one shape.

Arrays of vectors, whose last size is 3, need a unit besides, and a frame. The unit is in the name (``_m``), behind the shape, or there is
none: of directions, rotations, whole numbers. The frame is in the name (``_world``, ``R_cam_body``) or somewhere in the docstring.
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from scripts.pages.source_reading import ESTIMATOR, file_of, imported, modules, tree

PROTOCOLS = (ESTIMATOR / "effects" / "link.py", ESTIMATOR / "fitting" / "campaigns" / "measurement_kind.py")
"""The methods of effects and of kinds of measurement are told there, once for all."""
_SIZE = r"(?:\.\.\.|\d+ [A-Za-z]\w*|\d+|[A-Za-z]\w*)"
SHAPE = re.compile(rf"\({_SIZE}(?: ?[-+*] ?{_SIZE})*(?:, ?{_SIZE}(?: ?[-+*] ?{_SIZE})*)*,?\)")
"""Sizes between brackets, ``(n, 3)``, ``(21 + q,)``, ``(..., 2)``."""
UNIT = re.compile(
    r"[^`.;()]{0,4}(?:1/)?(?:m²|(?:mm|m|s|rad|px|kg|N|J|DN|Hz)\b)"
    r"|[^`.;]{0,30}\b(?:units?|unit mass|per|ratios?|nominal|standard deviations)\b"
)
"""A unit right behind a shape, or what says that there is none."""
UNIT_IN_NAME = re.compile(r"_(?:px|m|s|rad|deg|rads|ms|ms2|kg)\d?$")
NO_UNIT = re.compile(r"^(?:R|rig_R|turns?|axes|made_at)(?:_|$)|normal|direction|outward|viewing")
"""Names of rotations and of directions, which have no unit."""
FRAME_IN_NAME = re.compile(r"_(?:world|cam|body|particle)(?:_|$)")
FRAME = re.compile(r"\b(?:world|frame|frames|axes|camera|body|contact)\b")
LISTED = re.compile(r"^(?:``)?(?:(?:,| and|, and| or| to) ``\w+``)*")
"""What follows a name: its closing marks, and further names of which the same shape is told."""
REACH = 160
"""Characters after a name in which its shape is looked for."""


@dataclass(frozen=True)
class Argument:
    """An array argument or field: ``owner`` is its function or class, ``text`` the docstring, ``whole`` whether it has integers."""

    path: Path
    line: int
    owner: str
    name: str
    text: str
    whole: bool

    @property
    def told(self) -> bool:
        """Whether its shape is told."""
        return tells(self.text, self.name)

    @property
    def lacks(self) -> str:
        """What is not told of it: its shape or, of vectors, a unit or a frame; empty where all is."""
        shape, after = shape_told(self.text, self.name)
        if not shape:
            return "shape"
        if self.whole or not re.search(r"(?:, |\()3,?\)$", shape):
            return ""
        if not (NO_UNIT.search(self.name) or UNIT_IN_NAME.search(self.name) or UNIT.match(after)):
            return "unit"
        return "" if FRAME_IN_NAME.search(self.name) or FRAME.search(self.text) else "frame"


def arguments() -> list[Argument]:
    """All public array arguments and fields of the estimator."""
    return [argument for path in modules() for argument in _of(path)]


def untold(what: str = "shape") -> list[Argument]:
    """Those of which a shape, a unit or a frame is not told."""
    return [argument for argument in arguments() if argument.lacks == what]


def _of(path: Path) -> Iterator[Argument]:
    for node in tree(path).body:
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            yield from _of_function(path, node, node.name, ast.get_docstring(node) or "")
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from _of_class(path, node)


def _of_class(path: Path, node: ast.ClassDef) -> Iterator[Argument]:
    text = ast.get_docstring(node) or ""
    for part in node.body:
        if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name) and is_array(path, part.annotation):
            yield Argument(path, part.lineno, node.name, part.target.id, text, is_whole(path, part.annotation))
        if isinstance(part, ast.FunctionDef) and not part.name.startswith("_") and (path in PROTOCOLS or part.name not in _protocol()):
            yield from _of_function(path, part, f"{node.name}.{part.name}", f"{ast.get_docstring(part) or ''}\n{text}")


def _of_function(path: Path, node: ast.FunctionDef, owner: str, text: str) -> Iterator[Argument]:
    for argument in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs):
        if argument.annotation is not None and is_array(path, argument.annotation):
            yield Argument(path, node.lineno, owner, argument.arg, text, is_whole(path, argument.annotation))


def is_array(path: Path, annotation: ast.expr) -> bool:
    """Whether an annotation has a plain array in it, outside of what a callable takes and gives."""
    if isinstance(annotation, ast.Subscript):
        base = ast.unparse(annotation.value)
        if base == "NDArray":
            return True
        return base not in {"Callable", *_typed(annotation)} and is_array(path, annotation.slice)
    if isinstance(annotation, ast.Tuple):
        return any(is_array(path, part) for part in annotation.elts)
    if isinstance(annotation, ast.BinOp):
        return is_array(path, annotation.left) or is_array(path, annotation.right)
    return isinstance(annotation, ast.Name) and annotation.id in plain_aliases(path)


def _typed(annotation: ast.Subscript) -> tuple[str, ...]:
    """The annotation's own base where it is a jaxtyping array, which has its shape in a string."""
    strings = [n for n in ast.walk(annotation.slice) if isinstance(n, ast.Constant) and isinstance(n.value, str)]
    return (ast.unparse(annotation.value),) if strings else ()


@cache
def plain_aliases(path: Path) -> frozenset[str]:
    """Names in a module that stand for arrays without a shape, its own and those it imports from where they are made."""
    others = {key for module, key in imported(path) if file_of(module).exists() and key in _own_aliases(file_of(module))}
    return _own_aliases(path) | others


@cache
def _own_aliases(path: Path) -> frozenset[str]:
    made = [n for n in tree(path).body if isinstance(n, ast.Assign) and isinstance(n.value, ast.Subscript)]
    plain = [node.targets[0] for node in made if isinstance(node.value, ast.Subscript) and ast.unparse(node.value.value) == "NDArray"]
    return frozenset(target.id for target in plain if isinstance(target, ast.Name))


def is_whole(path: Path, annotation: ast.expr) -> bool:
    """Whether an annotation is of integers or of truth values."""
    names = {n.id for n in ast.walk(annotation) if isinstance(n, ast.Name)}
    assigned = [(n.targets[0], n.value) for n in tree(path).body if isinstance(n, ast.Assign)]
    made = [value for target, value in assigned if isinstance(target, ast.Name) and target.id in names]
    return any(re.search(r"np\.(?:u?int|bool)", ast.unparse(each)) for each in (annotation, *made))


def tells(text: str, name: str) -> bool:
    """Whether a docstring names an argument and a shape behind it, before it goes on to another name."""
    return shape_told(text, name)[0] != ""


def shape_told(text: str, name: str) -> tuple[str, str]:
    """The shape that a docstring tells of an argument, and what it says behind it; empty where it tells none."""
    flat = " ".join(text.split())
    for found in re.finditer(rf"(?<![\w.]){re.escape(name)}(?!\w)", flat):
        after = LISTED.sub("", flat[found.end() : found.end() + REACH], count=1)
        shape = SHAPE.search(after)
        if shape and "``" not in after[: shape.start()]:
            return shape.group(), after[shape.end() :]
    return "", ""


@cache
def _protocol() -> frozenset[str]:
    classes = [node for path in PROTOCOLS for node in tree(path).body if isinstance(node, ast.ClassDef)]
    return frozenset(part.name for node in classes for part in node.body if isinstance(part, ast.FunctionDef))


def main() -> None:
    """List the arguments of which something is not told."""
    for what in ("shape", "unit", "frame"):
        found = untold(what)
        for argument in found:
            print(f"{argument.path.relative_to(ESTIMATOR)}:{argument.line} {argument.owner}: {argument.name} has no {what}")
        print(f"{len(found)} of {len(arguments())} public array arguments have no {what} that a reader is told")


if __name__ == "__main__":
    main()
