"""Particles dropped on a plate: experiments of several runs, each run a fall, its impacts and the flights between them.

Once per experiment are drawn: the plate's stand and the errors of what is stated of it, the nominal height, orientation and spin. Once per
run: the scatter about them, the frames before and after, and where between two frames the first impact lies. The release is flown exactly,
the first touch found, and from there on impact and flight take turns until the recording ends. A run that leaves the picture, or in which
the particle comes to rest, is released anew.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.recipes.effects import hidden_in_contact
from datasets.recipes.recipe import DropperRecipe, Recipe
from datasets.truth import Impact, Remnant
from datasets.vocabulary.plate import Plate
from synth.contact import chipped, collide, contact_law, first_touch
from synth.contact.chipping import Chip, chip_of, state_of_part
from synth.contact.law import ContactLaw
from synth.effects.links import FlyingBody
from synth.motion import Start, fly, fly_pushed
from synth.motion.free_flight import FreeFlight
from synth.motion.piecewise_flight import Leg, PiecewiseFlight
from synth.motion.pushed_flight import PushedFlight
from synth.motion.random_flight import Stage, ball_in_view, isotropic
from synth.planned_flight import Course
from synth.plate_setting import PlateSetting, Stand, moved, plate_setting, random_stand

Array = NDArray[np.float64]

RELEASES = 30
MOST_RESTS = 3
"""Runs that end on the plate before the experiment is given up."""
MOST_IMPACTS = 25
"""In one recording; more of them is a particle that comes to rest."""
SLOWER = 1.5
"""How much longer than free fall a fall may last where something else than gravity acts."""
SIDEWAYS = 0.8
"""Share of the impact's speed with which a particle is expected to leave along the plate; it only decides where the target stands."""


@dataclass(frozen=True)
class Experiment:
    """What the runs of one experiment share: the plate's ``stand``, height (m) of the fall, orientation, spin (3,) rad/s at release."""

    stand: Stand
    height_m: float
    orientation: Rotation
    spin: Array


@dataclass(frozen=True)
class Drop:
    """One run: ``flight`` over the recording, the plate, what happened on it, and where the particle broke what is left and what is not."""

    flight: PiecewiseFlight
    setting: PlateSetting
    impacts: tuple[Impact, ...]
    remnant: Remnant | None
    chip: Chip | None = None


def frame_counts(recipe: DropperRecipe, rng: np.random.Generator) -> tuple[int, int]:
    """Whole frames before and after the first impact."""
    return int(rng.integers(*recipe.frames_before, endpoint=True)), int(rng.integers(*recipe.frames_after, endpoint=True))


def random_experiment(recipe: Recipe, rng: np.random.Generator) -> Experiment:
    """Draw what the runs of an experiment share."""
    assert recipe.plate is not None
    stand = random_stand(recipe.plate, rng)
    height = rng.uniform(*recipe.dropper.height_mm) * 1e-3
    return Experiment(stand, float(height), Rotation.random(rng=rng), isotropic(rng) * rng.uniform(*recipe.dropper.spin_rads))


def planned_drop(
    recipe: Recipe, course: Course, faces: NDArray[np.int64], experiment: Experiment, *, before: int, rng: np.random.Generator
) -> Drop:
    """Draw a run of ``experiment`` that stays in the picture; its first impact lies after ``before`` frames.

    Raises
    ------
    InputError
        Where none does.
    """
    reason, rests = "", 0
    for _ in range(RELEASES):
        share = rng.random()
        fall = _Fall(recipe, course, faces, experiment, float((before - 1 + share) / recipe.motion.frame_rate_hz))
        try:
            drop = fall.drop(rng)
        except InputError as error:
            reason, rests = str(error), rests + 1
            if rests == MOST_RESTS:
                break
            continue
        if ball_in_view(drop.flight.at(course.true_times_s).x_world, Stage(course.true_camera, 0.0, fall.radius_m, course.stamps_s)):
            return drop
        reason = "the particle leaves the picture; lower dropper.height_mm, dropper.frames_before or dropper.frames_after"
    raise InputError(f"no release of {RELEASES} can be recorded: {reason}")


@dataclass(frozen=True)
class _Fall:
    """Everything that decides a run besides its scatter; the first impact is to lie ``impact_s`` after the first frame."""

    recipe: Recipe
    course: Course
    faces: NDArray[np.int64]
    experiment: Experiment
    impact_s: float

    @property
    def radius_m(self) -> float:
        """Of the ball about the centre of mass that holds the particle."""
        return float(np.linalg.norm(self.course.flying.vertices - self.course.flying.body.com_particle, axis=1).max())

    @property
    def gravity(self) -> Array:
        """World frame, m/s²."""
        return np.array(self.recipe.motion.gravity_ms2)

    @property
    def up(self) -> Array:
        """Unit (3,), against gravity, across the viewing direction."""
        across = -self.gravity * [1.0, 1.0, 0.0]
        return np.asarray(across / np.linalg.norm(across))

    @property
    def hidden(self) -> dict[str, dict[str, float]]:
        """What is hidden in the contact."""
        return hidden_in_contact(self.recipe.contact_physics)

    def drop(self, rng: np.random.Generator) -> Drop:
        """Release, fall and bounce."""
        assert self.recipe.plate is not None
        setting = plate_setting(self.recipe.plate, self.experiment.stand, self.up, self.target(), self.hidden.get("plate_tilt", {}))
        law = contact_law(self.recipe.contact, self.recipe.plate, self.hidden)
        falling, touch_s, release_s = self.falling(self.release(setting, rng), setting.plate)
        early = release_s + touch_s - self.impact_s
        leg = Leg(-np.inf, self.impact_s - touch_s, falling, self.course.flying.body)
        return self.bounced(leg, moved(setting, setting.plate.velocity_world * early), law)

    def target(self) -> Array:
        """Where the plate is hit (3,) m, the same in all runs: such that the paths before and after lie about the middle of the picture."""
        recipe, speed = self.recipe, np.sqrt(2 * float(np.linalg.norm(self.gravity)) * self.experiment.height_m)
        before_s, after_s = (
            np.mean(frames) / recipe.motion.frame_rate_hz for frames in (recipe.dropper.frames_before, recipe.dropper.frames_after)
        )
        tilt = self.experiment.stand.tilt_rad
        aside = Rotation.from_rotvec([0.0, 0.0, tilt]).apply(self.up) - self.up * np.cos(tilt)
        path = -0.5 * self.up * speed * before_s - SIDEWAYS * aside * np.cos(tilt) * speed * after_s
        camera, distance = self.course.true_camera, recipe.hsv.distance_m
        middle = np.array([(camera.width_px - 1) / 2 - camera.cx_px, (camera.height_px - 1) / 2 - camera.cy_px, 0.0])
        return np.asarray([0.0, 0.0, distance] + path + middle * distance / camera.fx_px)

    def release(self, setting: PlateSetting, rng: np.random.Generator) -> Start:
        """The state at release, scattered about the experiment's."""
        recipe, target = self.recipe.dropper, setting.plate.point_world
        height = self.experiment.height_m + self.radius_m + 1e-3 * recipe.height_scatter_mm * rng.normal()
        scatter = 1e-3 * recipe.place_scatter_mm * rng.normal(size=3)
        turned = Rotation.from_rotvec(np.deg2rad(recipe.orientation_scatter_deg) * rng.normal(size=3)) * self.experiment.orientation
        spin = self.experiment.spin + recipe.spin_scatter_rads * rng.normal(size=3)
        fall_s = np.sqrt(2 * height / np.linalg.norm(self.gravity))
        meeting = target + setting.plate.velocity_world * self.impact_s
        place = meeting - 0.5 * self.gravity * fall_s**2 + scatter - (scatter @ self.up) * self.up
        return Start(place, turned.as_quat(), np.zeros(3), spin)

    def falling(self, release: Start, plate: Plate) -> tuple[FreeFlight | PushedFlight, float, float]:
        """The flight from release, counted from there; when it touches the plate; when in the recording the release is taken to be.

        The plate is where it is if the release happens at that time.
        """
        height = float((release.x_world - plate.point_world) @ self.up)
        latest = SLOWER * np.sqrt(2 * (height + self.radius_m) / np.linalg.norm(self.gravity)) + 1e-3
        release_s = self.impact_s - float(np.sqrt(2 * height / np.linalg.norm(self.gravity)))
        flight = self.flown(release, self.course.flying, (min(0.0, -release_s) - self.margin_s, latest))
        there = replace(plate, point_world=plate.point_world + plate.velocity_world * release_s)
        touch = first_touch(flight, self.course.flying, there, from_s=0.0, to_s=latest)
        if touch is None:
            raise InputError("the particle misses the plate; expected one that is hit: a slower plate, weaker effects.")
        return flight, touch, release_s

    @property
    def margin_s(self) -> float:
        """How far from a frame's time something of it may be exposed."""
        camera = self.course.true_camera
        rows = np.array([-1.0, 2.0]) * camera.height_px
        return self.recipe.hsv.exposure_us * 1e-6 + float(np.abs(self.course.effects.row_delays_s(rows, camera)).max())

    def flown(self, start: Start, body: FlyingBody, span_s: tuple[float, float]) -> FreeFlight | PushedFlight:
        """A flight under whatever acts."""
        if self.course.effects.push:
            return fly_pushed(start, body, self.gravity, self.course.effects, span_s=span_s)
        return fly(start, body.inertia_kgm2, self.gravity, earliest_s=span_s[0], latest_s=span_s[1])

    def bounced(self, leg: Leg, setting: PlateSetting, law: ContactLaw) -> Drop:
        """Impact and flight in turn, from the first leg to the end of the recording."""
        end_s = max(float(self.course.true_times_s[-1]), float(self.course.stamps_s[-1])) + self.margin_s
        legs, remnant, chip, body = [leg], None, None, self.course.flying
        impacts: list[Impact] = []
        touch_s: float | None = self.impact_s
        while touch_s is not None:
            if len(impacts) == MOST_IMPACTS:
                raise InputError(
                    f"the particle comes to rest: {MOST_IMPACTS} impacts; raise contact.restitution or lower dropper.frames_after"
                )
            state = _state_at(legs[-1], touch_s)
            collision = collide(body, state, setting.plate, law, time_s=touch_s, gravity_world=self.gravity)
            impacts.append(collision.impact)
            after, parting_s = collision.after, collision.parting_s
            if len(impacts) == 1 and "chip" in self.hidden:
                rest = self.broken(body, collision.impact)
                chip = self.flown_chip(after, (body, rest), (parting_s, end_s))
                after, body = state_of_part(after, body, rest), rest
                remnant = Remnant(parting_s, rest.vertices, rest.body, rest.mass_kg, rest.inertia_kgm2)
            span = (-(parting_s - touch_s), max(end_s - parting_s, 1e-6))
            legs.append(Leg((touch_s + parting_s) / 2, parting_s, self.flown(after, body, span), body.body))
            plate = moved(setting, setting.plate.velocity_world * parting_s).plate
            found = first_touch(legs[-1].flight, body, plate, from_s=0.0, to_s=span[1]) if end_s > parting_s else None
            touch_s = None if found is None else parting_s + found
        return Drop(PiecewiseFlight(tuple(legs), self.course.flying.body), setting, tuple(impacts), remnant, chip)

    def flown_chip(self, state: Start, bodies: tuple[FlyingBody, FlyingBody], span_s: tuple[float, float]) -> Chip:
        """What broke off of a body in ``state``, given the body and its rest, and its flight within ``span_s``."""
        chip, faces = chip_of(*bodies, self.faces)
        start, (from_s, end_s) = state_of_part(state, bodies[0], chip), span_s
        flight = self.flown(start, chip, (-self.margin_s, max(end_s - from_s, 1e-6)))
        return Chip(chip, faces, PiecewiseFlight((Leg(-np.inf, from_s, flight, chip.body),), chip.body), from_s)

    def broken(self, body: FlyingBody, impact: Impact) -> FlyingBody:
        """What is left after the corner that was hit has broken off."""
        to_particle = Rotation.from_matrix(body.body.R_particle_body) * Rotation.from_quat(impact.q_world_body).inv()
        corner = body.body.com_particle + to_particle.apply(impact.point_world - impact.x_world)
        return chipped(body, self.faces, corner, self.hidden["chip"]["depth"])


def _state_at(leg: Leg, time_s: float) -> Start:
    motion = leg.flight.at(np.array([time_s - leg.zero_s]))
    return Start(motion.x_world[0], motion.q_world_body[0], motion.v_world[0], motion.omega_world[0])
