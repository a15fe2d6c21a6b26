"""What a document violates in its published JSON Schema, said plainly: where, what was expected, what came."""

import difflib
import json
import re
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from typing import Any

from jsonschema import Draft202012Validator, TypeChecker, validators
from jsonschema.exceptions import ValidationError

_LONGEST = 60
_OF_NO_NUMBER = {"type", "pattern", "description"}
"""Keywords that restrict no number but by its type."""


@cache
def schema(kind: str) -> dict[str, Any]:
    """The published schema of a kind of document, ``datasets/schemas/<kind>.schema.json``."""
    text = files("datasets").joinpath("schemas", f"{kind}.schema.json").read_text(encoding="utf-8")
    loaded: dict[str, Any] = json.loads(text)
    return loaded


def _pattern(_validator: Any, pattern: str, instance: Any, _schema: Any) -> Iterator[ValidationError]:
    """JSON Schema's ``pattern``; its ``$`` is the very end of a text, Python's may stand before a last newline."""
    if isinstance(instance, str) and re.search(re.sub(r"\$$", r"\\Z", pattern), instance) is None:
        yield ValidationError(f"does not match {pattern}")


def _items(validator: Any, items: Any, instance: Any, whole: Any) -> Iterator[ValidationError]:
    """JSON Schema's ``items``; of numbers that nothing but their type restricts, none is looked at twice."""
    restricted = not isinstance(items, dict) or not items.keys() <= _OF_NO_NUMBER or "number" not in items.get("type", ())
    if restricted or not isinstance(instance, list) or any(type(each) not in (int, float) for each in instance):
        yield from Draft202012Validator.VALIDATORS["items"](validator, items, instance, whole)


def _inlined(part: Any, definitions: dict[str, Any]) -> Any:
    """A part of a schema with the definitions of plain values in the places of references to them."""
    if isinstance(part, list):
        return [_inlined(each, definitions) for each in part]
    if not isinstance(part, dict):
        return part
    meant = definitions.get(str(part.get("$ref", "")).removeprefix("#/$defs/")) if len(part) == 1 else None
    plain = meant is not None and meant.keys() <= _OF_NO_NUMBER
    return meant if plain else {key: _inlined(each, definitions) for key, each in part.items()}


def _is_integer(_checker: TypeChecker, instance: Any) -> bool:
    """Integers written as such; ``640.0`` is none, since sizes and numbers of pictures are used as they come."""
    return isinstance(instance, int) and not isinstance(instance, bool)


_extend: Any = validators.extend
_Validator = _extend(
    Draft202012Validator,
    {"pattern": _pattern, "items": _items},
    type_checker=Draft202012Validator.TYPE_CHECKER.redefine("integer", _is_integer),
)


@cache
def _validator(kind: str) -> Any:
    return _Validator(_inlined(schema(kind), schema(kind).get("$defs", {})))


def first_violation(document: Any, kind: str) -> str | None:
    """The first violation in the order of the file's structure, as a sentence, or ``None``."""
    error = next(iter(_validator(kind).iter_errors(document)), None)
    return None if error is None else _sentence(error)


def _sentence(error: ValidationError) -> str:
    return f"at {error.json_path}: expected {_expected(error)}."


def _expected(error: ValidationError) -> str:
    """What the violated keyword asks for, and what came."""
    rule: Any = error.validator_value
    came: Any = error.instance
    match error.validator:
        case "type":
            return f"{_types(rule)}, got {shown(came)}"
        case "required":
            missing = next(key for key in rule if key not in came)
            return f'the key "{missing}", which is missing'
        case "additionalProperties":
            return _unknown_key(error)
        case "enum" | "const":
            choices = rule if error.validator == "enum" else [rule]
            return f"{' or '.join(json.dumps(choice) for choice in choices)}, got {shown(came)}"
        case "minItems" | "maxItems":
            bound = "at least" if error.validator == "minItems" else "at most"
            return f"{bound} {rule} entries, got {len(came)}"
        case "minimum" | "exclusiveMinimum" | "maximum" | "exclusiveMaximum":
            sign = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}[str(error.validator)]
            return f"a number {sign} {rule}, got {shown(came)}"
        case "pattern":
            return f"text of the form {rule}, got {shown(came)}"
    described = error.schema.get("description") if isinstance(error.schema, dict) else None
    return f"{described or f'{error.validator} {shown(rule)}'}, got {shown(came)}"


def _unknown_key(error: ValidationError) -> str:
    known = sorted(error.schema.get("properties", {})) if isinstance(error.schema, dict) else []
    instance: Any = error.instance
    unknown = next(key for key in instance if key not in known)
    nearest = difflib.get_close_matches(unknown, known, n=1)
    return f"one of the keys {', '.join(known)}, got {shown(unknown)}" + (f' (did you mean "{nearest[0]}"?)' if nearest else "")


def _types(rule: str | list[str]) -> str:
    names = [rule] if isinstance(rule, str) else rule
    return " or ".join({"object": "an object", "array": "a list", "integer": "an integer", "string": "text"}.get(n, n) for n in names)


def shown(value: Any) -> str:
    """A value as JSON, cut where it is long."""
    text = json.dumps(value)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."
