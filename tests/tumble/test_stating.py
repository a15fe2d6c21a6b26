"""What is stated on the command line: read as written, refused with the statement and what was expected."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from datasets.errors import InputError
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.campaign import Campaign
from estimator.fitting.campaigns.facts import Fact
from estimator.measurements.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import Hidden, Tracker, campaign
from tumble.quantities import Quantity, quantity
from tumble.stating import facts_of, known, possible
from tumble.tracked_bodies import rest_heights


@pytest.fixture(scope="module")
def tosses() -> Campaign:
    return register_trajectories(campaign(3, Hidden(), Tracker(rows=12), sequences=2)).campaign


def fact(words: str, tosses: Campaign, mesh: Path | None = None) -> Fact:
    (found,) = facts_of([known(words)], tosses, catalogue(), mesh)
    return found


@pytest.mark.parametrize(
    ("text", "value", "sigma", "unit"),
    [
        ("51.3mm±0.3mm", 0.0513, 0.0003, "m"),
        ("51.3 mm +- 0.3 mm", 0.0513, 0.0003, "m"),
        ("9.81+/-0.01 m/s2", 9.81, 0.01, "m/s2"),
        ("100±0.2mm", 0.1, 0.0002, "m"),
        ("100mm±0.2%", 0.1, 0.0002, "m"),
        ("0±1e-5", 0.0, 1e-5, "1"),
        ("±0.2%", 0.0, 0.002, "1"),
        ("2.1%±0.3%", 0.021, 0.003, "1"),
        ("98.0mm", 0.098, 0.0, "m"),
        ("-5e-3m", -0.005, 0.0, "m"),
        ("4000Hz±0.4Hz", 4000.0, 0.4, "Hz"),
    ],
)
def test_quantities_are_read_as_people_write_them(text: str, value: float, sigma: float, unit: str) -> None:
    found = quantity(text)
    assert (found.value, found.sigma, found.unit) == (pytest.approx(value), pytest.approx(sigma), unit)


@pytest.mark.parametrize("text", ["", "mm", "5 parsec", "5mm±0.1s", "5mm±0mm", "1e400m±1m", "5mm±", "nan", "5mm±-1mm", "5,3mm±0.1mm"])
def test_what_is_no_quantity_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"expected .* got "):
        quantity(text)


def test_lengths_are_a_length_scale(tosses: Campaign) -> None:
    for words in ("length=100mm±0.2mm measured 98.0mm", "drop_height=10cm±0.2mm measured 98mm"):
        found = fact(words, tosses)
        assert found.weights == (("length_scale", (1.0,)),)
        assert found.value == pytest.approx(100.0 / 98.0 - 1.0)
        assert found.sigma == pytest.approx(0.002 * 100.0 / 98.0)


def test_a_resting_height_may_be_above_a_plane_that_is_not_at_zero(tosses: Campaign) -> None:
    plain = fact("rest_height=52.4mm±0.1mm measured 51.3mm±0.3mm", tosses)
    raised = fact("rest_height=52.4mm±0.1mm measured 51.9mm±0.3mm above 0.6mm±0.4mm", tosses)
    assert plain.value == pytest.approx(raised.value)
    assert raised.sigma > plain.sigma


def test_a_mesh_says_how_high_a_body_rests(tosses: Campaign, tmp_path: Path) -> None:
    trimesh.creation.box((0.2, 0.1, 0.06)).export(tmp_path / "box.ply")
    for recorded, true in (("29.4mm±0.2mm", 0.03), ("98mm±0.2mm", 0.1)):
        found = fact(f"rest_height={recorded}", tosses, tmp_path / "box.ply")
        assert found.value == pytest.approx(true / quantity(recorded).value - 1.0, rel=1e-5)
    with pytest.raises(InputError, match="or --mesh"):
        fact("rest_height=29.4mm±0.2mm", tosses)


def test_a_mesh_with_normals_of_its_own_at_every_corner_is_closed(tmp_path: Path) -> None:
    """As OBJ files of cubes have them: eight points, a normal for each face that meets there."""
    box = trimesh.creation.box((0.2, 0.1, 0.06))
    lines = [f"v {x} {y} {z}" for x, y, z in box.vertices] + [f"vn {x} {y} {z}" for x, y, z in box.face_normals]
    lines += ["f " + " ".join(f"{v + 1}//{number}" for v in face) for number, face in enumerate(box.faces, start=1)]
    (tmp_path / "box.obj").write_text("\n".join(lines))
    assert np.allclose(np.unique(rest_heights(tmp_path / "box.obj").round(9)), [0.03, 0.05, 0.1])


def test_clock_gravity_and_parameters(tosses: Campaign) -> None:
    assert fact("frame_rate=0±1e-5", tosses).sigma == 1e-5
    assert fact("frame_rate=148.148±0.1Hz", tosses).value == pytest.approx(1e-3)
    gravity = fact("gravity=9.80±0.01m/s2", tosses)
    assert gravity.weights == (("gravity", (0.0, 0.0, -1.0)),)
    assert gravity.value == pytest.approx(-0.01)
    assert fact("centre_of_mass.c3=6±1mm", tosses).weights == (("centre_of_mass", (0.0, 0.0, 1.0)),)


def test_a_possible_effect_is_possible_in_each_of_its_parameters(tosses: Campaign) -> None:
    found = facts_of([possible("gravity=±0.02m/s2"), possible("length_scale=±0.2%")], tosses, catalogue())
    assert [f.value for f in found] == [0.0] * 4
    assert np.allclose([f.sigma for f in found], [0.02] * 3 + [0.002])
    assert found[1].weights == (("gravity", (0.0, 1.0, 0.0)),)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("length", "expected NAME=VALUE"),
        ("=5mm±1mm", "expected NAME=VALUE"),
        ("length=100mm±0.2mm", "expected what it is and what the recordings say"),
        ("length=100mm measured 98mm", "expected how sure it is"),
        ("length=100mm±1mm measured 98s", "expected lengths in m, cm, mm or um, got s"),
        ("length=100mm±1mm measured 98m", "expected length_scale within"),
        ("length=100mm±1mm measured 0mm", "expected lengths above 0"),
        ("lenght=100mm±1mm measured 98mm", "only lengths are both"),
        ("lengthscale=0±1%", "did you mean length_scale"),
        ("length=1mm±0.1mm measured 1mm above 0mm", "expected 'above' after a measured rest_height"),
        ("gravity=9.81±0.01", "expected m/s2, got a number without unit"),
        ("gravity=0.1±0.01m/s2", "expected gravity within"),
        ("frame_rate=0±1mm", "expected a number without unit"),
        ("centre_of_mass=0±1mm", "expected centre_of_mass.c1 or centre_of_mass.c2"),
        ("uniform_acceleration.a_x=0±1m/s2", "expected an effect with one value for all sequences"),
        ("rolling_shutter=0±1%", "does not apply to these measurements: it acts on pictures"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_the_statement(words: str, message: str, tosses: Campaign) -> None:
    with pytest.raises(InputError) as caught:
        fact(words, tosses)
    assert message in str(caught.value)
    assert f"--known {words!r}" in str(caught.value)
    assert "got" in str(caught.value) or "does not apply" in str(caught.value)


@pytest.mark.parametrize("words", ["length_scale=1%±0.2%", "length_scale=0", "length=±1mm", "length_scale"])
def test_a_possible_effect_has_a_deviation_alone(words: str) -> None:
    with pytest.raises(InputError, match=r"--possible .*: expected .*, got "):
        possible(words)


def test_a_quantity_is_a_record() -> None:
    assert quantity("1mm±1um") == Quantity(1e-3, 1e-6, "m")


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("gravity.g_x", ("gravity", "g_x")),
        ("principal_point@side.dx", ("principal_point@side", "dx")),
        ("principal_point@cam.1.dx", ("principal_point@cam.1", "dx")),
        ("focal_length@cam.1", ("focal_length@cam.1", "")),
        ("my_lens@side.power", ("my_lens@side", "power")),
    ],
)
def test_names_of_cameras_may_have_dots(name: str, parts: tuple[str, str]) -> None:
    found = known(f"{name}=0±0.5")
    assert found.parts == parts
    assert found.effect == parts[0]
