"""Light comes from where it should, as much as it should, and surfaces answer."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from datasets.errors import InputError
from synth.rendering import scene
from synth.rendering.light import AMBIENT, MAP_SHAPE, background_radiance, environment_map, lighting, map_directions
from synth.rendering.materials import material

SPHERE = trimesh.creation.icosphere(subdivisions=3, radius=2e-3)
BACK = lighting("back", focus_m=0.6, widest_slope=0.085, falloff=0.2)
FRONT = lighting("front", focus_m=0.6, widest_slope=0.085, falloff=0.2)


def solid_angles() -> np.ndarray:
    """Of the cells of an environment map (sr)."""
    rows, columns = MAP_SHAPE
    theta = (np.arange(rows) + 0.5) / rows * np.pi
    return np.repeat(np.sin(theta)[:, None], columns, axis=1) * (np.pi / rows) * (2 * np.pi / columns)


def test_the_panel_darkens_towards_its_edges() -> None:
    edge = BACK.panel_half_m / BACK.panel_z_m
    radiance = background_radiance(BACK, np.array([[0.0, 0.0], [0.999999 * edge, 0.0], [1.01 * edge, 0.0]]))
    np.testing.assert_allclose(radiance, [1.0, 0.8, AMBIENT], rtol=1e-5)


def test_the_particle_sees_the_panel_behind_it() -> None:
    radiance = environment_map(BACK, np.array([0.0, 0.0, 0.6]))
    bright = map_directions()[radiance > 0.5]
    assert bright[:, 2].min() > 0.9
    slope = np.abs(bright[:, :2] / bright[:, 2:]).max()
    assert slope == pytest.approx(BACK.panel_half_m / (BACK.panel_z_m - 0.6), abs=0.02)


def test_a_white_facing_surface_in_front_light_has_radiance_one() -> None:
    cosine = np.clip(-map_directions()[..., 2], 0, None)
    radiance = environment_map(FRONT, np.array([0.0, 0.0, 0.6]))
    assert np.sum((radiance - AMBIENT) * cosine * solid_angles()) / np.pi == pytest.approx(1.0, rel=0.04)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.4, -1.1, 2.0)])
@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm"])
def test_the_side_towards_the_light_is_bright(room, pose, monkeypatch, axis, turn, variant, llvm) -> None:
    monkeypatch.setattr(scene, "environment_map", lambda *_: (map_directions()[..., axis] > 0.9).astype(float))
    picture = room(SPHERE, variant=llvm() if variant == "llvm" else variant).take([pose(turn=turn)], samples=16).radiance
    low, high = np.array_split(picture, 2, axis=1 - axis)
    assert high.sum() > 20 * low.sum()


def test_surfaces_in_back_light(room, pose) -> None:
    """Matte and metal are dark in the middle; diamond gathers light there and is dark near its rim."""
    pictures = {name: room(SPHERE, surface=name).take([pose()], samples=16).radiance for name in ("matte", "rough_metal", "diamond")}
    middle = {name: picture[36:44, 44:52].mean() for name, picture in pictures.items()}
    assert middle["matte"] < 0.05
    assert middle["rough_metal"] < 0.05
    assert middle["diamond"] > 0.4
    assert pictures["diamond"][38:42, 30:33].mean() < 0.5 * middle["diamond"]


def test_clear_bodies_lose_no_energy(room, pose, monkeypatch) -> None:
    """In uniform light a clear body is invisible (the furnace test), up to paths that are cut off."""
    monkeypatch.setattr(scene, "environment_map", lambda *_: np.ones(MAP_SHAPE))
    traced = room(SPHERE, surface="diamond").take([pose()], samples=64)
    assert traced.radiance.sum() / traced.coverage.sum() == pytest.approx(1.0, abs=0.02)


def test_unknown_surfaces_are_named() -> None:
    with pytest.raises(InputError, match=r"matte.*'velvet'"):
        material("velvet")


def test_light_off_the_axis_is_seen_from_the_particle() -> None:
    shifted = environment_map(replace(BACK, falloff=0.0), np.array([0.05, 0.0, 0.6]))
    bright = map_directions()[shifted > 0.5]
    slopes = bright[:, 0] / bright[:, 2]
    assert (slopes.max() + slopes.min()) / 2 == pytest.approx(-0.05 / 0.3, abs=0.02)
