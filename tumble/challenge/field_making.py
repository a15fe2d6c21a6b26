"""Makes the campaigns of a field challenge, one per item: what is hidden is drawn, flown, measured and written."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from datasets.observation_files import write_observation
from tumble.challenge.cases import CASE_FILE, campaign_folder, case_folder
from tumble.challenge.field_case import FieldCase, write_case
from tumble.challenge.field_drawing import FieldPlan, draw_field_case, names_of
from tumble.challenge.field_files import write_surroundings, write_trajectory, write_true_motion
from tumble.challenge.field_flights import DENSE, flown, measured
from tumble.challenge.field_silhouettes import flown_in_pictures, observed
from tumble.engine import Executor, Item, Outcome, run
from tumble.progress import progress


def make_field_campaigns(plan: FieldPlan, seed: int, out: Path, *, executor: Executor, quiet: bool) -> tuple[Outcome, ...]:
    """Make every campaign that ``out`` lacks."""
    items = []
    for number, name in enumerate(names_of(plan)):
        payload = {"plan": asdict(plan), "seed": seed, "number": number, "out": out}
        items.append(Item(name, payload, case_folder(out, name) / CASE_FILE))
    with progress("make", len(items), quiet=quiet) as advance:
        return run(make_field_item, items, executor=executor, advance=advance)


def make_field_item(payload: dict[str, Any]) -> dict[str, Any]:
    """Make one campaign."""
    case = draw_field_case(FieldPlan(**payload["plan"]), payload["seed"], payload["number"])
    write_campaign(case, Path(payload["out"]))
    return {"name": case.name}


def write_campaign(case: FieldCase, out: Path) -> None:
    """Fly, measure and write a case; the file that says what is hidden is written last."""
    observations, truth = campaign_folder(out, case.name) / "observations", case_folder(out, case.name)
    observations.mkdir(parents=True, exist_ok=True)
    if case.scene is None:
        write_surroundings(case, observations)
        for number in range(len(case.flights)):
            write_trajectory(measured(case, number), observations)
    else:
        for observation in observed(case):
            write_observation(observation, observations / observation.name)
    fly = flown if case.scene is None else flown_in_pictures
    for number, flight in enumerate(case.flights):
        write_true_motion(fly(case, number, DENSE), truth / f"{flight.name}.csv")
    write_case(case, truth / CASE_FILE)
