"""``tumble validate-contact`` on estimates made from the truth: what it writes, what it leaves out, what it refuses."""

import dataclasses
import json
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
import trimesh

from datasets.errors import InputError
from datasets.estimate import Estimate, FrameReport, ImpactEstimate, Status, VelocityEstimate
from datasets.estimate_files import write_estimate
from datasets.json_documents import read_document
from datasets.observation import Observation
from datasets.observation_files import write_observation
from datasets.recipes.recipe import Recipe, RigRecipe
from datasets.truth import Truth
from estimator.data.configuration import Configuration
from estimator.impacts.breakage import worse_after
from scripts.acceptance.acceptance_contact import HIDDEN, page, powers_of, rows_of, summary
from synth.sequence import build_silhouette_sequence
from tests.reference.contact_sets import SIGMAS, drop_recipe, touches_once
from tests.tumble.made_up import made_up_estimate
from tumble.cli.main import main
from tumble.contact_documents import FILE, KIND
from tumble.contact_validating import Known, collected_from, shape_of
from tumble.engine import Item
from tumble.reports.contact_charts import experiments_of, run_labels
from tumble.reports.contact_page import render_contact

pytestmark = pytest.mark.long

RUNS = 5
RECIPE: Recipe = replace(drop_recipe(2024), rig=RigRecipe(drops=1))


def estimate_of(observation: Observation, truth: Truth, seed: int) -> Estimate:
    """What a good instrument would say: the first true impact with errors as the silhouette tier leaves them."""
    impact, errors = truth.impacts[0], SIGMAS * np.random.default_rng(seed).normal(size=18)
    covariance = np.diag(SIGMAS**2)

    def velocity(v: np.ndarray, omega: np.ndarray, rows: slice) -> VelocityEstimate:
        part = covariance[rows, rows]
        return VelocityEstimate(impact.time_s, v + errors[rows][:3], omega + errors[rows][3:], part, part)

    before = velocity(impact.v_before, impact.omega_before, slice(6, 12))
    after = velocity(impact.v_after, impact.omega_after, slice(12, 18))
    found = ImpactEstimate(impact.time_s, 1e-6, impact.x_world, impact.q_world_body, before, after, covariance)
    frames = tuple(FrameReport(0, k, True, "", 0.2, 1.0) for k in range(len(truth.motion.times_s)))
    made = made_up_estimate(observation, truth)
    return replace(made, impacts=(found,), frames=frames, configuration=dataclasses.asdict(Configuration(hull_resolution=32)))


@pytest.fixture(scope="module")
def campaign() -> list[tuple[Observation, Truth, Estimate]]:
    recipe = RECIPE
    made = (build_silhouette_sequence(recipe, index) for index in range(3 * RUNS))
    pairs = list(islice((pair for pair in made if touches_once(pair[1], recipe.motion.frame_rate_hz)), RUNS))
    return [(observation, truth, estimate_of(observation, truth, k)) for k, (observation, truth) in enumerate(pairs)]


@pytest.fixture
def folder(campaign, tmp_path: Path) -> Path:
    """Observations, estimates and the particle's mesh on disk."""
    (tmp_path / "estimates").mkdir()
    for observation, _, estimate in campaign:
        write_observation(observation, tmp_path / "observations" / observation.name)
        write_estimate(estimate, tmp_path / "estimates" / f"{estimate.name}.estimate.json")
    truth = campaign[0][1]
    trimesh.Trimesh(truth.mesh_vertices, truth.mesh_faces, process=False).export(tmp_path / "stone.ply")
    return tmp_path


def words(folder: Path, *more: str) -> list[str]:
    known = ["--observations", str(folder / "observations"), "--mesh", str(folder / "stone.ply"), "--models", "stronge_impulse"]
    return ["validate-contact", str(folder / "estimates"), *known, "--out", str(folder / "out"), *more]


def broken(estimate: Estimate) -> Estimate:
    """The same with pictures that fit worse from the impact on."""
    frames = tuple(replace(f, rms_whitened=3.0 if k > 60 else 1.0) for k, f in enumerate(estimate.frames))
    return replace(estimate, frames=frames)


def test_a_rigid_truth_misses_nothing_and_its_constants_come_back(folder, capsys) -> None:
    assert main(words(folder, "-q")) == 0
    assert capsys.readouterr().out == ""
    document = read_document(folder / "out" / FILE, KIND)
    values = {v["name"]: v["value"] for v in document["models"][0]["values"]}
    assert document["verdict"]["missing"] == []
    assert values["restitution"] == pytest.approx(RECIPE.contact.restitution, abs=0.03)
    assert values["friction"] == pytest.approx(RECIPE.contact.friction, abs=0.02)
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    assert "no contact physics is missing" in page
    assert page.count("<svg") >= 8
    assert "http" not in page.replace("http://www.w3.org", "").replace("http-equiv", "")
    assert main(words(folder, "-q")) == 2
    assert main(words(folder, "-q", "--resume")) == 0


def test_a_plate_seen_from_its_other_side_is_refused(folder, campaign, capsys) -> None:
    """The world's y axis points down: 0,1,0 is an easy mistake, of which constants of no contact would come."""
    assert main(words(folder, "-q", "--plate=0,1,0")) == 2
    said = capsys.readouterr().err
    assert f"in {RUNS} of {RUNS} impacts" in said
    assert "got (0, 1, 0)" in said
    assert not (folder / "out" / FILE).exists()


def test_runs_without_use_are_left_out_and_named(folder, campaign, capsys) -> None:
    _, _, first = campaign[0]
    write_estimate(broken(first), folder / "estimates" / f"{first.name}.estimate.json")
    assert main(words(folder, "--json")) == 1
    told = capsys.readouterr()
    assert f"{first.name} is left out: the particle broke" in told.err
    document = json.loads(told.out)
    assert document["broken"] == [first.name]
    assert len(document["impacts"]) == 4


def test_a_campaign_of_broken_particles_says_so(folder, campaign, capsys) -> None:
    for _, _, estimate in campaign[:4]:
        write_estimate(broken(estimate), folder / "estimates" / f"{estimate.name}.estimate.json")
    assert main(words(folder)) == 1
    assert "The particle broke in 4 of 5 runs" in capsys.readouterr().out
    assert read_document(folder / "out" / FILE, KIND)["verdict"]["missing"] == ["chip"]


def test_estimates_without_impacts_are_refused(folder, campaign, capsys) -> None:
    for _, _, estimate in campaign:
        write_estimate(replace(estimate, impacts=()), folder / "estimates" / f"{estimate.name}.estimate.json")
    assert main(words(folder)) == 2
    told = capsys.readouterr().err
    assert "expected estimates with impacts on a plate" in told
    assert "there is no impact in it" in told
    assert not (folder / "out" / FILE).exists()


def test_too_few_runs_are_refused(folder, campaign, capsys) -> None:
    for _, _, estimate in campaign[:2]:
        write_estimate(replace(estimate, status=Status.AMBIGUOUS), folder / "estimates" / f"{estimate.name}.estimate.json")
    assert main(words(folder)) == 2
    assert "expected impacts of at least 4 runs, got 3 that can be used (2 left out)" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "said"),
    [
        (("--poisson", "0.6"), "Poisson's ratio of the particle: expected above -1 and below 0.5, got 0.6"),
        (("--young", "-3"), "Young's modulus of the particle"),
        (("--plate-young", "0"), "Young's modulus of the plate"),
        (("--density", "-1"), "density: expected a finite number above 0 kg/m³"),
        (("--models", "glue"), "contact models: expected some of frictionless"),
        (("--plate=0,0,0",), "--plate: expected the plate's normal"),
        (("--mesh", "nowhere.ply"), "nowhere.ply: expected a mesh"),
    ],
)
def test_impossible_options_are_refused(folder, capsys, option, said) -> None:
    assert main(words(folder, *option)) == 2
    assert said in capsys.readouterr().err
    assert not (folder / "out" / FILE).exists()


def test_estimates_need_their_observations(folder, capsys) -> None:
    assert main(["validate-contact", str(folder / "estimates"), "--out", str(folder / "out")]) == 2
    assert "expected --observations FOLDER" in capsys.readouterr().err


def test_the_shape_comes_from_the_calibrated_views(campaign) -> None:
    observation, truth, estimate = campaign[0]
    shape = shape_of(observation, estimate, Known())
    assert shape.solid.mass_kg == pytest.approx(truth.mass_kg)
    assert shape.solid.volume_m3 == pytest.approx(truth.mass_kg / 2650.0, rel=0.25)
    extent = np.ptp(shape.vertices_body, axis=0)
    np.testing.assert_allclose(extent, np.ptp(truth.mesh_vertices, axis=0), rtol=0.08)


def test_a_stated_normal_stands_in_for_a_plate_that_is_not_stated(campaign) -> None:
    observation, truth, estimate = campaign[0]
    without = replace(observation, plate=None)
    nothing = collected_from([(estimate, lambda _: without)], Known())
    assert nothing.left_out == {estimate.name: "no plate is stated; give its normal with --plate=X,Y,Z"}
    normal = tuple((2.0 * truth.plate.normal_world).tolist())
    given = collected_from([(estimate, lambda _: without)], Known(normal_world=normal))
    np.testing.assert_allclose(given.impacts[0].plate.normal_world, truth.plate.normal_world)


def test_pictures_that_fit_alike_before_and_after_are_of_a_whole_particle(campaign) -> None:
    observation, _, estimate = campaign[0]
    assert worse_after(estimate, observation.clock.times_s) is None
    said = worse_after(broken(estimate), observation.clock.times_s)
    assert said is not None
    assert "the particle broke" in said


def test_a_page_with_markup_in_a_name_stays_a_page() -> None:
    verdict = {"kind": "the particle broke", "sentence": "<b>", "missing": ["chip"], "remarks": [], "next": "look"}
    ladder = {"rungs": [], "alike": {}, "missing": []}
    document = {"source": "x", "verdict": verdict, "impacts": [], "models": [], "ladder": ladder, "maps": []}
    page = render_contact({**document, "left_out": {"<script>": "broke"}, "broken": ["<script>"]})
    assert "<script>" not in page
    assert "&lt;script&gt;" in page


def test_experiments_of_several_runs_have_a_picture_each() -> None:
    runs = [{"experiment": e, "run": f"{e}-r{k:02d}"} for e in ("s-e00", "s-e01") for k in range(3)]
    assert experiments_of(runs) == [("s-e00", [0, 1, 2]), ("s-e01", [3, 4, 5])]
    assert experiments_of([runs[0], runs[3]]) == [("all runs", [0, 1])]


def test_labels_tell_impacts_apart() -> None:
    assert run_labels(["s-e00-r00", "s-e00-r01", "s-e00-r01, impact 2"]) == ["00", "01", "01·2"]
    assert run_labels(["s-e00-r00", "s-e01-r00", "s-e02-r00"]) == ["e00 00", "e01 00", "e02 00"]


def test_the_study_counts_what_was_named_and_what_was_accused() -> None:
    row = {"seed": 1, "impacts": 10, "left_out": 0, "verdict": "found", "alike": [], "gained": 20.0, "cpu_s": 1.0}
    rows = [
        {**row, "case": "compliant", "missing": ["tangential_compliance"], "hertz_mindlin_ahead": 3.0},
        {**row, "case": "compliant", "missing": ["plate_tilt"], "hertz_mindlin_ahead": -3.0},
        {**row, "case": "rigid", "missing": ["adhesion"], "hertz_mindlin_ahead": -1.0},
        {**row, "case": "rigid", "missing": [], "hertz_mindlin_ahead": -1.0},
    ]
    cases = summary(rows, {"seed": 1, "mode": "fast"})["cases"]
    assert (cases["compliant"]["ranked_right"], cases["compliant"]["named_right"]) == (1, 1)
    assert (cases["rigid"]["ranked_right"], cases["rigid"]["accused"]) == (2, 1)
    assert cases["compliant"]["accused"] == 1


def test_the_page_says_what_to_type_for_it() -> None:
    row = {"seed": 3, "impacts": 10, "missing": [], "alike": [], "gained": 0.0, "cpu_s": 1.0}
    judged, hidden = ["compliant", "rigid"], list(HIDDEN)[:-1]
    for cases, runs, mode, words in (
        ({**dict.fromkeys(judged, 20), **dict.fromkeys(hidden, 10)}, 10, "fast", "scripts.acceptance.acceptance_contact`"),
        ({**dict.fromkeys(judged, 5), **dict.fromkeys(hidden, 10)}, 10, "fast", "scripts.acceptance.acceptance_contact --sets 5`"),
        ({"adhesion": 10}, 20, "fast", "scripts.acceptance.acceptance_contact --runs 20 --cases adhesion`"),
        ({"chip": 4}, 10, "full", "scripts.acceptance.acceptance_contact --mode full --hidden-sets 4 --cases chip`"),
    ):
        rows = [{**row, "case": case} for case, sets in cases.items() for _ in range(sets)]
        assert words in page(summary(rows, {"seed": 3, "mode": mode, "runs_per_set": runs}))


def test_what_can_be_expected_is_told_by_all_sets_together(tmp_path: Path) -> None:
    """A set that shows nothing does not excuse itself: the law of its case is the median of all sets."""
    items = []
    for number, pull in enumerate((0.0, 0.02, 0.04)):
        product = tmp_path / f"set-{number}.json"
        product.write_text(json.dumps({"case": "adhesion", "law": {"adhesion": pull}}))
        items.append(Item(product.stem, {"case": "adhesion", "seed": number, "mode": "fast", "product": str(product)}, product))
    wanted = powers_of(items)
    assert [item.payload["law"] for item in wanted] == [{"adhesion": 0.02}] * 3
    wanted[1].product.write_text('{"power": 0.7}')
    assert [row.get("power") for row in rows_of(items)] == [None, 0.7, None]


def test_impacts_of_several_contacts_are_left_out(campaign) -> None:
    observation, _, estimate = campaign[0]
    several = replace(estimate, statistics={**estimate.statistics, "impacts": [{"chi_square": 80.0, "spread_s": 5e-5}]})
    found = collected_from([(several, lambda _: observation)], Known())
    assert found.left_out[estimate.name] == "each of its impacts was more than one contact"
    single = replace(estimate, statistics={**estimate.statistics, "impacts": [{"chi_square": 4.0, "spread_s": 0.0}]})
    assert len(collected_from([(single, lambda _: observation)], Known()).impacts) == len(estimate.impacts)


def test_an_impact_needs_a_whole_covariance(campaign) -> None:
    observation, _, estimate = campaign[0]
    bad = replace(estimate, impacts=(replace(estimate.impacts[0], covariance=np.eye(6)),))
    found = collected_from([(bad, lambda _: observation)], Known())
    assert "expected 18 x 18 finite numbers" in found.left_out[estimate.name]
    with pytest.raises(InputError, match="density"):
        Known(density_kg_m3=float("nan"))
