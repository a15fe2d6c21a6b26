"""Effects of users' own: ``path.py:Class`` becomes an effect like those of the catalogue, watched while it runs.

The class derives from :class:`estimator.effects.link.EffectModel`, has an ``entry`` (key, stage, scope, parameters with units) and
overrides the one link it belongs to. Every call of a link is checked: a link that raises, answers with another shape or with numbers that
are not finite ends in an :class:`~datasets.errors.InputError` that names the file, the class, the parameters and the frame.
"""

import difflib
import importlib.util
import inspect
import math
import sys
from collections.abc import Callable, Mapping
from enum import StrEnum
from pathlib import Path
from types import MethodType, ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.vocabulary.effects import EFFECTS, EffectEntry, Parameter, Scope, Stage
from estimator.effects.link import BodyChange, EffectModel, Moment, Places, Setting
from estimator.effects.model import overrides
from estimator.motion.flight import LAYOUT

Array = NDArray[np.float64]
LINKS = ("times", "delays", "body", "air", "acceleration", "torque", "scale", "tracked", "reading", "correct", "shift")
"""What an effect may override to act."""
STAGES: Mapping[str, tuple[Stage, ...]] = {
    "times": (Stage.CLOCK,),
    "delays": (Stage.CLOCK, Stage.EXPOSURE),
    "body": (Stage.BODY,),
    "acceleration": (Stage.DYNAMICS,),
    "torque": (Stage.DYNAMICS,),
    "scale": (Stage.BODY,),
    "tracked": (Stage.TRACKING,),
    "correct": (Stage.OPTICS,),
    "shift": (Stage.OPTICS, Stage.EXPOSURE, Stage.SEGMENTATION),
}
"""Where in the chain from particle to outline each link acts."""
CHOICES: Mapping[str, tuple[StrEnum, ...]] = {"stage": tuple(Stage), "scope": tuple(Scope)}


def is_plug_in(word: str) -> bool:
    """Whether a word names a plug-in rather than an effect of the catalogue."""
    return ":" in word or word.endswith(".py")


def load_plug_in(word: str) -> EffectModel:
    """The effect that ``path.py:Class`` names.

    Raises
    ------
    InputError
        Where there is no such file or class, or the class is no effect.
    """
    path, _, name = word.rpartition(":")
    if not path or not name or name.endswith(".py"):
        raise InputError(f"{word}: expected FILE.py:CLASS, for instance ./my_wind.py:Wind.")
    module = _module(Path(path))
    found = _class(module, name, path)
    _check_entry(found, word)
    return _watched(found, word)


def _module(path: Path) -> ModuleType:
    if not path.is_file():
        raise InputError(f"{path}: expected the Python file of an effect, got {'a folder' if path.is_dir() else 'nothing'}.")
    name = f"tumble_plug_in_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path}: expected a Python file (.py).")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses in it look there
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # whatever a user's file raises is the file's fault
        raise InputError(f"{path}: {_raised(error)} while it was read.") from error
    return module


def _class(module: ModuleType, name: str, path: str) -> type[EffectModel]:
    effects = {
        key: value
        for key, value in vars(module).items()
        if isinstance(value, type) and issubclass(value, EffectModel) and hasattr(value, "entry")
    }
    found = effects.get(name)
    if found is not None:
        return found
    if isinstance(getattr(module, name, None), type):
        lacks = "an entry" if issubclass(getattr(module, name), EffectModel) else "EffectModel among its bases (estimator.effects.link)"
        raise InputError(f"{path}: expected {name} to be an effect; it has not {lacks}.")
    near = difflib.get_close_matches(name, effects, n=3) or sorted(effects)
    known = f"; its effects: {', '.join(near)}" if near else "; it has no effect at all"
    raise InputError(f"{path}: expected a class {name!r}, which it has not{known}.")


def _check_entry(found: type[EffectModel], word: str) -> None:
    entry = found.entry
    if not isinstance(entry, EffectEntry):
        raise InputError(f"{word}: expected entry to be an EffectEntry (datasets.vocabulary.effects), got {type(entry).__name__}.")
    _check_types(entry, word)
    if entry.key in EFFECTS:
        raise InputError(f'{word}: its key "{entry.key}" is that of an effect of the catalogue; choose another.')
    if entry.key in LAYOUT.names:
        raise InputError(f'{word}: its key "{entry.key}" is what parameters of a flight are called; choose another.')
    if not entry.key.isidentifier():
        raise InputError(f'{word}: expected a key of letters, digits and underscores, got "{entry.key}".')
    if not entry.parameters:
        raise InputError(f"{word}: expected at least one parameter, got none.")
    if len(set(entry.names)) < len(entry.names):
        raise InputError(f"{word}: expected parameters of different names, got {', '.join(entry.names)}.")
    for parameter in entry.parameters:
        if not parameter.step > 0.0:
            raise InputError(f"{word}: parameter {parameter.name}: expected a step above 0, got {parameter.step}.")
        if not parameter.plausible[0] < parameter.plausible[1]:
            raise InputError(f"{word}: parameter {parameter.name}: expected a plausible range (low, high), got {parameter.plausible}.")
    if not overrides(_made(found, word), *LINKS):
        raise InputError(f"{word}: expected one of the links {', '.join(LINKS)} to be overridden, got none: it would do nothing.")
    _check_stage(found, word)


def _check_types(entry: EffectEntry, word: str) -> None:
    """What an entry says is of the types that it declares; Python checks none of them."""
    for name, kind in (("key", str), ("stage", Stage), ("scope", Scope), ("parameters", tuple), ("searched", tuple)):
        value = getattr(entry, name)
        if not isinstance(value, kind):
            of = f", one of {', '.join(each.name for each in CHOICES[name])}" if name in CHOICES else ""
            raise InputError(f"{word}: expected {name} of its entry to be a {kind.__name__}{of}, got {value!r}.")
    for parameter in entry.parameters:
        if not isinstance(parameter, Parameter):
            raise InputError(f"{word}: expected parameters to be Parameter (datasets.vocabulary.effects), got {parameter!r}.")
        numbers = (parameter.step, *(parameter.plausible if isinstance(parameter.plausible, tuple) else (parameter.plausible,)))
        if len(numbers) != 3 or not all(isinstance(x, int | float) and not math.isnan(x) for x in numbers):
            raise InputError(f"{word}: parameter {parameter.name}: expected a step and a plausible range of numbers, got {numbers}.")
    unknown = set(entry.searched) - set(entry.names)
    if unknown:
        raise InputError(f"{word}: expected searched to name its parameters, got {', '.join(map(str, unknown))}.")


def _check_stage(found: type[EffectModel], word: str) -> None:
    """The stage is one at which an overridden link acts."""
    links = [link for link in LINKS if getattr(found, link) is not getattr(EffectModel, link)]
    stages = dict.fromkeys(stage for link in links for stage in STAGES[link])
    if found.entry.stage not in stages:
        wanted = " or ".join(f"Stage.{stage.name}" for stage in stages)
        raise InputError(f"{word}: expected {wanted}, where {'() and '.join(links)}() acts, got Stage.{found.entry.stage.name}.")


def _made(found: type[EffectModel], word: str) -> EffectModel:
    try:
        return found()
    except (Exception, SystemExit) as error:
        raise InputError(f"{word}: {_raised(error)} when it was made; an effect is made without arguments.") from error


def _raised(error: BaseException) -> str:
    return f"raised {type(error).__name__} ({error})"


def _watched(found: type[EffectModel], word: str) -> EffectModel:
    """An effect of a plug-in's class of which every overridden link is checked."""
    watch, effect = _Watch(word, found), _made(found, word)
    for link in ("starts", *(link for link in LINKS if effect.touches(link))):
        vars(effect)[link] = MethodType(watch.guarded(link, getattr(watch, link)), effect)
    return effect


class _Watch:
    """The checks of one plug-in's links; each gets what the link was called with and its answer, and gives the answer back."""

    def __init__(self, word: str, found: type[EffectModel]) -> None:
        self.word, self.found = word, found

    def guarded(self, link: str, check: Callable[..., Any]) -> Callable[..., Any]:
        """The link with its check; the plug-in's gets its arguments in their order, since it may name them as it likes."""
        original: Callable[..., Any] = getattr(self.found, link)
        signature = inspect.signature(getattr(EffectModel, link))

        def called(effect: EffectModel, *given: Any, **named: Any) -> Any:
            arguments = signature.bind(effect, *given, **named).args[1:] if named else given
            try:
                answer = original(effect, *arguments)
            except InputError:
                raise
            except (Exception, SystemExit) as error:
                raise InputError(f"{self.word}: {_raised(error)} in {link}(){self._at(link, arguments)}.") from error
            return check(answer, *arguments)

        return called

    def _at(self, link: str, arguments: tuple[Any, ...]) -> str:
        """Parameters and frame of a call, as far as its arguments tell."""
        theta = next((a for a in arguments if isinstance(a, np.ndarray)), None)
        told = self._parameters(np.atleast_2d(theta)[0]) if theta is not None and link != "starts" else ""
        return told + _frames_of(arguments)

    def _parameters(self, theta: Array) -> str:
        pairs = zip(self.found.entry.parameters, theta, strict=False)
        return " with " + ", ".join(f"{p.name} = {value:g} {p.unit}" for p, value in pairs)

    def _shaped(self, link: str, answer: Any, shape: tuple[int, ...], arguments: tuple[Any, ...]) -> Array:
        try:
            array = np.asarray(answer, dtype=np.float64)
        except (TypeError, ValueError):
            came = f"got {type(answer).__name__}{self._at(link, arguments)}"
            raise InputError(f"{self.word}: expected {link}() to give numbers, {came}.") from None
        if array.shape != shape:
            came = f"got {array.shape}{self._at(link, arguments)}"
            raise InputError(f"{self.word}: expected {link}() to give an array of shape {shape}, {came}.")
        return array

    def _refuse(self, link: str, theta: Array, where: str) -> InputError:
        return InputError(f"{self.word}: {link}() gave a number that is not finite{self._parameters(theta)}{where}.")

    def starts(self, answer: Any, setting: Setting) -> Array:
        """(s, q) with at least one row."""
        rows = len(answer) if hasattr(answer, "__len__") else 0
        array = self._shaped("starts", answer, (max(rows, 1), len(self.found.entry.parameters)), (setting,))
        if not np.all(np.isfinite(array)):
            raise InputError(f"{self.word}: starts() gave a number that is not finite.")
        return array

    def times(self, answer: Any, theta: Array, setting: Setting, times_s: Array) -> Array:
        """As many times as frames."""
        array = self._shaped("times", answer, times_s.shape, (theta, setting, times_s))
        bad = np.flatnonzero(~np.isfinite(array))
        if len(bad):
            raise self._refuse("times", theta, _frame(float(times_s[bad[0]] - setting.times_s[0]), setting))
        return array

    def delays(self, answer: Any, theta: Array, rows_px: Array) -> Array | None:
        """As many as outlines, or nothing."""
        if answer is None:
            return None
        array = self._shaped("delays", answer, rows_px.shape, (theta,))
        bad = np.flatnonzero(~np.isfinite(array))
        if len(bad):
            raise self._refuse("delays", theta, f" in outline {bad[0]}, {rows_px[bad[0]]:.1f} px below the middle row")
        return array

    def body(self, answer: Any, theta: Array, setting: Setting) -> BodyChange:
        """A change of the body."""
        if not isinstance(answer, BodyChange):
            came = f"got {type(answer).__name__}{self._at('body', (theta, setting))}"
            raise InputError(f"{self.word}: expected body() to give a BodyChange, {came}.")
        com, inertia = (self._shaped("body", part, (n,), (theta, setting)) for part, n in ((answer.com, 3), (answer.inertia, 5)))
        change = BodyChange(com, inertia)
        if not (np.all(np.isfinite(change.com)) and np.all(np.isfinite(change.inertia))):
            raise self._refuse("body", theta, "")
        return change

    def air(self, answer: Any, theta: Array) -> Array | None:
        """(m, 3) or nothing."""
        if answer is None:
            return None
        array = self._shaped("air", answer, (len(theta), 3), (theta,))
        if not np.isfinite(array).all():
            raise self._refuse("air", np.atleast_2d(theta)[0], "")
        return array

    def acceleration(self, answer: Any, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """(m, 3) or nothing."""
        return self._force("acceleration", answer, (theta, moment, setting))

    def torque(self, answer: Any, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """(m, 3) or nothing."""
        return self._force("torque", answer, (theta, moment, setting))

    def _force(self, link: str, answer: Any, at: tuple[Array, Moment, Setting]) -> Array | None:
        theta, moment, setting = at
        if answer is None:
            return None
        array = self._shaped(link, answer, moment.x.shape, at)
        bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
        if len(bad):
            raise self._refuse(link, theta[bad[0]], _frame(moment.time_s, setting))
        return array

    def scale(self, answer: Any, theta: Array) -> float:
        """A number above zero."""
        value = float(self._shaped("scale", answer, (), (theta,)))
        if not np.isfinite(value):
            raise self._refuse("scale", theta, "")
        if value <= 0.0:
            raise InputError(f"{self.word}: expected scale() above 0, got {value:g}{self._parameters(theta)}.")
        return value

    def tracked(self, answer: Any, theta: Array, x: Array, setting: Setting) -> Array:
        """As many positions as it was given."""
        return self._rows("tracked", answer, theta, x)

    def reading(self, answer: Any, theta: Array, omega: Array) -> Array:
        """As many readings as angular velocities."""
        return self._rows("reading", answer, theta, omega)

    def _rows(self, link: str, answer: Any, theta: Array, given: Array) -> Array:
        array = self._shaped(link, answer, given.shape, (theta,))
        if not np.isfinite(array).all():
            raise self._refuse(link, theta, "")
        return array

    def correct(self, answer: Any, theta: Array, points_px: Array, camera: Any, times_s: Array) -> Array:
        """As many points as came."""
        del camera
        array = self._shaped("correct", answer, points_px.shape, (theta,))
        bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
        if len(bad):
            number = int(np.searchsorted(np.unique(times_s), times_s[bad[0]]))
            raise self._refuse("correct", theta, f" in picture {number} ({1e3 * times_s[bad[0]]:.3f} ms)")
        return array

    def shift(self, answer: Any, theta: Array, places: Places, setting: Setting) -> Array | None:
        """(n, k, 2) or nothing; where there is no tangency any number will do."""
        if answer is None:
            return None
        array = self._shaped("shift", answer, places.radius_px.shape, (theta, places, setting))
        bad = np.flatnonzero(~np.isfinite(array).all(axis=(1, 2)))
        if len(bad):
            raise self._refuse("shift", theta, _frame(float(places.times_s[bad[0]]), setting))
        return array


def _frames_of(arguments: tuple[Any, ...]) -> str:
    """The frames that a call is about: the one of a moment, or the first and the last of many."""
    setting = next((a for a in arguments if isinstance(a, Setting)), None)
    if setting is None:
        return ""
    for each in arguments:
        if isinstance(each, Moment):
            return _frame(each.time_s, setting)
        if isinstance(each, Places):
            return f", frames {_number(each.times_s.min(), setting)} to {_number(each.times_s.max(), setting)}"
    return f", frames 0 to {len(setting.times_s) - 1}"


def _frame(time_s: float, setting: Setting) -> str:
    """The frame nearest a time since the first one."""
    return f" at frame {_number(time_s, setting)} ({1e3 * time_s:.3f} ms)"


def _number(time_s: float, setting: Setting) -> int:
    return int(np.argmin(np.abs(setting.times_s - setting.times_s[0] - time_s)))
