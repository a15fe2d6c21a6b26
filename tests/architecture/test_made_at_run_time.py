"""Nothing in the estimator makes classes while it runs, or remembers things by where they happen to lie in memory."""

import ast

from scripts.pages.source_reading import ESTIMATOR, modules, tree

BY_PLACE = {"fitting/side_by_side.py"}
"""What processes that were forked send back names objects by identity, as ``pickle`` asks for; they are kept alive meanwhile."""


def test_no_class_is_made_at_run_time() -> None:
    found = []
    for path in modules():
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.FunctionDef) and any(isinstance(inner, ast.ClassDef) for inner in ast.walk(node)):
                found.append(f"{path.name}:{node.lineno} class in {node.name}")
            if isinstance(node, ast.Call) and ast.unparse(node.func) in {"type", "make_dataclass", "new_class"} and len(node.args) > 1:
                found.append(f"{path.name}:{node.lineno}")
    assert found == []


def test_nothing_is_remembered_by_its_place_in_memory() -> None:
    places = {
        str(path.relative_to(ESTIMATOR))
        for path in modules()
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "id"
    }
    assert places == BY_PLACE


def test_effects_are_not_changed_once_made() -> None:
    found = []
    for path in (ESTIMATOR / "effects").rglob("*.py"):
        for function in (node for node in ast.walk(tree(path)) if isinstance(node, ast.FunctionDef) and node.name != "__init__"):
            for node in ast.walk(function):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AugAssign) else []
                parts = [part for target in targets for part in (target.elts if isinstance(target, ast.Tuple) else [target])]
                found += [f"{path.name}:{node.lineno}" for part in parts if isinstance(part, ast.Attribute)]
    assert found == []
