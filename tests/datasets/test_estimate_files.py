import json
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from datasets.errors import InputError, TumbleError
from datasets.estimate import Estimate, FrameReport, Status, VelocityEstimate
from datasets.estimate_files import read_estimate, write_estimate
from datasets.vocabulary.surface_mesh import SurfaceMesh


def assert_equal(a, b) -> None:
    """Equality through dataclasses, arrays and NaN."""
    if is_dataclass(a):
        assert type(a) is type(b)
        for field in fields(a):
            assert_equal(getattr(a, field.name), getattr(b, field.name))
    elif isinstance(a, dict):
        assert a.keys() == b.keys()
        for key in a:
            assert_equal(a[key], b[key])
    elif isinstance(a, list | tuple):
        assert type(a) is type(b)
        assert len(a) == len(b)
        for one, other in zip(a, b, strict=True):
            assert_equal(one, other)
    elif isinstance(a, float | np.ndarray):
        assert np.array_equal(a, b, equal_nan=True)
    else:
        assert a == b


def written(estimate: Estimate, folder: Path) -> Path:
    write_estimate(estimate, folder / "estimate.json")
    return folder / "estimate.json"


def test_round_trip(truth, estimate_of, tmp_path):
    estimate = estimate_of(truth, np.arange(6) * 0.1)
    assert_equal(estimate, read_estimate(written(estimate, tmp_path)))


def test_the_same_estimate_gives_the_same_bytes(truth, estimate_of, tmp_path):
    estimate = estimate_of(truth, np.arange(6) * 0.1)
    first = written(estimate, tmp_path).read_bytes()
    turned = replace(estimate, statistics=dict(reversed(estimate.statistics.items())))
    assert written(turned, tmp_path).read_bytes() == first
    assert written(read_estimate(tmp_path / "estimate.json"), tmp_path).read_bytes() == first


def test_a_surface_lies_beside_its_estimate_and_goes_with_it(truth, estimate_of, tmp_path):
    plain = estimate_of(truth, np.arange(6) * 0.1)
    estimate = replace(plain, surface=SurfaceMesh(truth.mesh_vertices, truth.mesh_faces))
    path = tmp_path / "one.estimate.json"
    write_estimate(replace(estimate, companion=estimate), path)
    assert {file.name for file in tmp_path.iterdir()} == {"one.estimate.json", "one.surface.ply", "one.surface.companion.ply"}
    assert_equal(replace(estimate, companion=estimate), read_estimate(path))
    (tmp_path / "one.surface.companion.ply").unlink()
    assert_equal(replace(estimate, companion=plain), read_estimate(path))
    write_estimate(plain, path)
    assert [file.name for file in tmp_path.iterdir()] == ["one.estimate.json"]


def test_without_a_measurement(tmp_path):
    estimate = Estimate("s", Status.NOT_ENOUGH_FRAMES, "two frames show the particle, three are needed")
    assert_equal(estimate, read_estimate(written(estimate, tmp_path)))


any_float = st.floats(allow_nan=True, allow_infinity=True)
finite = st.floats(allow_nan=False, allow_infinity=False)
trees = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**53), 2**53)
    | any_float
    | st.text(max_size=8).filter(lambda t: "NaN" not in t and "Inf" not in t),
    lambda children: st.lists(children, max_size=3) | st.dictionaries(st.text(max_size=5), children, max_size=3),
    max_leaves=8,
)


@st.composite
def estimates(draw) -> Estimate:
    p = draw(st.integers(0, 4))

    def matrix(n: int) -> np.ndarray:
        return draw(hnp.arrays(np.float64, (n, n), elements=any_float))

    def velocity() -> VelocityEstimate:
        vectors = [draw(hnp.arrays(np.float64, 3, elements=finite)) for _ in range(2)]
        return VelocityEstimate(draw(finite), *vectors, matrix(6), matrix(6))

    return Estimate(
        name="a-b_c.1",
        status=draw(st.sampled_from(Status)),
        message=draw(st.text()),
        start=draw(st.none() | st.builds(velocity)),
        middle=velocity(),
        parameters=tuple(f"p{k}" for k in range(p)),
        values=draw(hnp.arrays(np.float64, p, elements=any_float)),
        covariance=matrix(p),
        bound=matrix(p),
        frames=tuple(FrameReport(0, k, draw(st.booleans()), draw(st.text()), draw(any_float), draw(any_float)) for k in range(p)),
        statistics=draw(st.dictionaries(st.text(max_size=5), trees, max_size=4)),
    )


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(estimate=estimates())
def test_any_estimate_round_trips_exactly(estimate, tmp_path_factory):
    assert_equal(estimate, read_estimate(written(estimate, tmp_path_factory.mktemp("e"))))


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("status", "fine", r'at \$\.status: expected "converged" or "ambiguous"'),
        ("values", [1.0], r"at \$\.values: expected 2 entries \(one per parameter\), got 1"),
        ("covariance", [[1.0]], r"at \$\.covariance: expected a square matrix of 2 rows"),
        ("bound", [[1.0, 2.0], [3.0]], r"at \$\.bound: expected a square matrix of 2 rows, got rows of unequal length"),
        ("middle", None, r'at \$\.middle: expected velocities, since the status is "converged", got null'),
        ("values", [1.0, "many"], r"at \$\.values\[1\]"),
        ("frames", [{"camera": 0}], r'at \$\.frames\[0\]: expected the key "frame", which is missing'),
        ("statistic", {}, r'got "statistic" \(did you mean "statistics"\?\)'),
    ],
)
def test_hand_edited_estimates(truth, estimate_of, tmp_path, key, value, message):
    path = written(estimate_of(truth, np.zeros(6)), tmp_path)
    document = json.loads(path.read_text())
    del document["sha256"]
    document[key] = value
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=message) as caught:
        read_estimate(path)
    assert str(path) in str(caught.value)


def test_a_motion_with_missing_frames(truth, estimate_of, tmp_path):
    path = written(estimate_of(truth, np.zeros(6)), tmp_path)
    document = json.loads(path.read_text())
    del document["sha256"]
    document["motion"]["x_world"].pop()
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"at \$\.motion: expected x_world of shape \(5, 3\), got \(4, 3\)"):
        read_estimate(path)


def test_a_folder_that_cannot_be_is_named(truth, estimate_of, tmp_path):
    (tmp_path / "taken").write_text("a file, not a folder")
    with pytest.raises(TumbleError, match=r"cannot be written \(Not a directory\)"):
        write_estimate(estimate_of(truth, np.zeros(6)), tmp_path / "taken" / "flight.estimate.json")


def test_a_full_disk_leaves_the_old_file(truth, estimate_of, tmp_path, monkeypatch):
    path = written(estimate_of(truth, np.zeros(6)), tmp_path)
    before = path.read_bytes()

    def full(*_args, **_settings):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(TumbleError, match=r"estimate\.json: the disk is full"):
        write_estimate(estimate_of(truth, np.ones(6)), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
