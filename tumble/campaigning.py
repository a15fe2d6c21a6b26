"""A campaign from its folder: observations read, sequences found and put together, what is broken named and left out."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from datasets.errors import InputError
from datasets.observation import Observation
from datasets.observation_files import read_observation
from estimator.configuration import Configuration
from estimator.effects.choosing import refuse_without_gravity
from estimator.effects.link import EffectModel
from estimator.registration import Registered, register
from tumble.progress import progress
from tumble.result_files import observations_in


@dataclass(frozen=True)
class Prepared:
    """A campaign with the observations of its sequences by name, and why others were left out."""

    registered: Registered
    observations: dict[str, Observation]
    left_out: dict[str, str]

    @property
    def names(self) -> tuple[str, ...]:
        """The sequences of the campaign."""
        return tuple(s.name for s in self.registered.campaign.sequences)


def prepare(source: Path, configuration: Configuration, effects: Sequence[EffectModel], *, quiet: bool) -> Prepared:
    """Read every observation of ``source`` and find the particle in each.

    Raises
    ------
    InputError
        Where no sequence is left, with the reason of each; where an effect cannot be found in such recordings.
    """
    observations, left_out = _read(observations_in(source))
    refuse_without_gravity([e.entry.key for e in effects], [o.gravity_world for o in observations.values()])
    names = list(observations)
    with progress("register", len(names), quiet=quiet) as advance:
        registered = register(list(observations.values()), configuration, told=lambda done, _: advance(names[done - 1]))
    left_out.update({each.name: each.reason for each in registered.left_out})
    if not registered.campaign.sequences:
        reasons = "\n".join(f"  {name}: {reason}" for name, reason in left_out.items())
        raise InputError(f"{source}: no sequence of this campaign can be measured:\n{reasons}")
    return Prepared(registered, observations, left_out)


def _read(folders: Sequence[Path]) -> tuple[dict[str, Observation], dict[str, str]]:
    observations, left_out = {}, {}
    for folder in folders:
        try:
            observation = read_observation(folder)
        except InputError as error:
            left_out[folder.name] = str(error)
        else:
            observations[observation.name] = observation
    return observations, left_out
