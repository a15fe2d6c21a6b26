"""Writes effects of users' own: a plug-in from the law or the empirical term that a diagnosis proposes, or a minimal one to start from.

The functions of a law's terms are copied as they stand in :mod:`estimator.effects.empirical.law_terms`, so the file can be read and edited
alone. The next command runs the file, so no text of a diagnosis gets into it: only the names of terms and families that are known here, and
numbers.
"""

import inspect
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.json_documents import read_document, revived
from datasets.vocabulary.effects import EFFECTS, Parameter
from estimator.effects.empirical.families import EMPIRICAL
from estimator.effects.empirical.law_effect import REFERENCE, law_formula
from estimator.effects.empirical.law_terms import TERMS, Term
from estimator.effects.model import overrides
from estimator.effects.plug_ins import LINKS
from tumble.commands import command
from tumble.numbers import compact
from tumble.reports.words import FAMILY_WORDS
from tumble.unknowns import law_words


@dataclass(frozen=True)
class Kind:
    """A template without a law: how it is told, and the code that differs."""

    words: str
    imports: str
    stage: str
    scope: str
    parameter: str
    formula: str
    method: str


KINDS = {
    "force": Kind(
        "a force",
        "Moment, Setting",
        "DYNAMICS",
        "CAMPAIGN",
        '"push", "m/s2", (-5.0, 5.0), 1e-3, "acceleration along x, world frame"',
        "dv/dt = g + push x",
        '''    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """Acceleration (m, 3) m/s², world frame, of m flights; moment has x, v, omega, L, R (world from body) and time_s."""
        del moment, setting
        return np.asarray(theta * np.array([1.0, 0.0, 0.0]))''',
    ),
    "torque": Kind(
        "a torque",
        "Moment, Setting",
        "DYNAMICS",
        "PARTICLE",
        '"twist", "rad/s2", (-500.0, 500.0), 10.0, "torque per largest moment about body axis 1"',
        "dL/dt = R_world_body (twist, 0, 0)",
        '''    def torque(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """Torque per largest moment (m, 3) rad/s², world frame, of m flights; moment.R turns body axes into the world's."""
        del setting
        return np.asarray(theta * (moment.R @ np.array([1.0, 0.0, 0.0])))''',
    ),
    "outline": Kind(
        "a displacement of the outline",
        "Places, Setting",
        "SEGMENTATION",
        "CAMERA",
        '"growth", "px/s", (-100.0, 100.0), 1e-1, "displacement outwards per second"',
        "delta = growth t",
        '''    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """Displacement (n, k, 2) px outwards at the tangencies of n pictures with k views; places says where they are."""
        del setting
        return np.asarray(theta[0] * places.times_s[:, None, None] * np.ones(places.radius_px.shape))''',
    ),
    "clock": Kind(
        "a clock that goes wrong",
        "Setting",
        "CLOCK",
        "CAMPAIGN",
        '"drift", "1/s", (-1.0, 1.0), 1e-3, "relative change of the frame rate per second"',
        "true time = t + drift t2 / 2, t counted from the first frame",
        '''    def times(self, theta: Array, setting: Setting, times_s: Array) -> Array:
        """True times (f,) s of frames whose time stamps are times_s."""
        since = times_s - setting.times_s[0]
        return np.asarray(times_s + 0.5 * theta[0] * since**2)''',
    ),
}
"""The templates by what they are for."""


def plug_in_text(name: str, out: Path, *, source: Path | None, kind: str | None) -> str:
    """The text of a plug-in of class ``name`` for the file ``out``: from a diagnosis (``source``), or a template of a ``kind``.

    Raises
    ------
    InputError
        Where the name cannot be one, or the diagnosis proposes nothing.
    """
    key = effect_key(name)
    told = {"name": name, "key": key, "title": key.replace("_", " ").capitalize(), "use": _in_docstring(_use(name, out))}
    if source is None:
        return _rendered("blank.py.j2", {**told, "kind": KINDS[kind or "force"]})
    found = revived(read_document(source, "diagnosis")).get("unknown")
    if found is None:
        raise InputError(
            f"{source}: expected a diagnosis in which something is left that the catalogue does not explain; this one has nothing unknown. "
            "`tumble explain` writes such a part where it finds one; for an empty template give --kind instead of --from."
        )
    if found["law"] is None:
        return _rendered("family.py.j2", {**told, **_family(found, source)})
    return _rendered("law.py.j2", {**told, **_law(found, source)})


def write_plug_in(text: str, out: Path) -> None:
    """Write a plug-in where there is no file yet.

    Raises
    ------
    InputError
        Where there is one, or the name is no Python file's.
    """
    if out.suffix != ".py":
        raise InputError(f"--out {out}: expected the name of a Python file (.py).")
    if out.exists():
        raise InputError(f"--out {out}: is there already; expected a new file. Choose another name, or delete it.")
    with written_whole(out) as temporary:
        temporary.write_text(text, encoding="utf-8")


def effect_key(name: str) -> str:
    """The key of a class: ``MyWind`` is ``my_wind``.

    Raises
    ------
    InputError
        Where the name is no class's, or the key is one of the catalogue.
    """
    if not re.fullmatch(r"[A-Za-z]\w*", name, flags=re.ASCII):
        raise InputError(f'tumble effect new: expected the name of a Python class, like MyWind, got "{name}".')
    key = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
    if key in EFFECTS:
        raise InputError(f'tumble effect new: "{key}" is an effect of the catalogue; choose another name.')
    return key


def _use(name: str, out: Path) -> str:
    word = f"{out if out.is_absolute() else './' + str(out)}:{name}"
    check, use = command("effect", "check", word), command("estimate", "OBSERVATIONS", "--effects", word)
    return f"Check it with ``{check}``; use it with ``{use}``."


def _in_docstring(text: str) -> str:
    """Text that ends no docstring and hides no character."""
    return repr(text)[1:-1].replace('"', '\\"').replace("\\'", "'")


def _rendered(template: str, content: dict[str, Any]) -> str:
    environment = Environment(loader=PackageLoader("tumble", "effect_templates"), undefined=StrictUndefined, trim_blocks=True)
    text = environment.get_template(template).render(content)  # Python, not HTML: nothing to escape
    return text.rstrip("\n") + "\n"


def _family(found: dict[str, Any], source: Path) -> dict[str, Any]:
    effect = EMPIRICAL.get(found["family"])
    if effect is None:
        raise InputError(f"{source}: expected a family of {', '.join(EMPIRICAL)}, got {found['family']!r}.")
    link = next(link for link in LINKS if overrides(effect, link))
    adapted = found.get("adapted", {})
    return {
        "stage": effect.entry.stage.value,
        "formula": effect.entry.meaning,
        "words": f"This is {FAMILY_WORDS[effect.entry.key]}, as a diagnosis found it to be missing.",
        "base": type(effect).__name__,
        "link": link,
        "length_s": _finite(adapted["length_s"], source) if "length_s" in adapted else None,
        "middle_m": ", ".join(_finite(x, source) for x in adapted["middle_m"]) if "middle_m" in adapted else None,
    }


def _law(found: dict[str, Any], source: Path) -> dict[str, Any]:
    terms = [_term(entry["term"]) for entry in found["law"]["terms"]]
    values = _values(found["law"]["values"], terms, source)
    words = law_words(terms)
    return {
        "formula": law_formula(tuple(terms)),
        "words": f"{words[:1].upper()}{words[1:]}.",
        "sources": list(dict.fromkeys(inspect.getsource(t.function).rstrip() for t in terms)),
        "parameters": [_parameter(p, values[p.name]) for t in terms for p in t.parameters],
        "reference": REFERENCE,
        "searched": [p.name for t in terms for p in t.shapes],
        "frozen": [t.power for t in terms if t.power is not None],
        "starts": [_number(values[p.name][0]) if p in t.shapes else "0.0" for t in terms for p in t.parameters],
        "links": _links(terms),
    }


def _term(key: str) -> Term:
    found = next((t for t in TERMS if t.key == key), None)
    if found is None:
        raise InputError(f'the diagnosis names a term "{key}", which this version does not know; expected one of {[t.key for t in TERMS]}.')
    return found


def _values(told: list[dict[str, Any]], terms: list[Term], source: Path) -> dict[str, tuple[float, float]]:
    """Value and standard deviation of each parameter of the terms."""
    given = {entry["parameter"]: entry for entry in told}
    names = [p.name for term in terms for p in term.parameters]
    missing = [name for name in names if name not in given]
    if missing:
        raise InputError(f"{source}: expected values of the parameters {', '.join(names)}, got none of {', '.join(missing)}.")
    return {name: (float(_finite(given[name]["value"], source)), float(_finite(given[name]["sigma"], source))) for name in names}


def _parameter(p: Parameter, found: tuple[float, float]) -> dict[str, Any]:
    """A parameter with a plausible range that has room for what was found, ``(value, standard deviation)``."""
    low, high = p.plausible
    room = 3.0 * abs(found[0])
    unit = "" if p.unit == "1" else f" {p.unit}"
    return {
        "name": p.name,
        "unit": p.unit,
        "low": _number(min(low, -room if low < 0.0 else low)),
        "high": _number(max(high, room)),
        "step": _number(p.step),
        "meaning": p.meaning,
        "found": f"{compact(*found)}{unit}",
    }


def _finite(value: Any, source: Path) -> str:
    """A number of a diagnosis as Python writes it."""
    if not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"{source}: expected a finite number in what is unknown, got {value!r}.")
    return repr(float(value))


def _number(value: float) -> str:
    """A float as Python writes it, with six digits."""
    return repr(float(f"{value:.6g}"))


def _links(terms: list[Term]) -> list[dict[str, str]]:
    told = {"acceleration": "Acceleration (m, 3) m/s² beside gravity", "torque": "Torque per largest moment (m, 3) rad/s²"}
    parts: dict[str, list[str]] = {}
    place = 0
    for term in terms:
        end = place + len(term.parameters)
        parts.setdefault(term.link, []).append(f"{term.function.__name__}(theta[:, {place}:{end}], moment)")
        place = end
    return [{"name": link, "doc": told[link], "sum": " + ".join(parts[link])} for link in told if link in parts]
