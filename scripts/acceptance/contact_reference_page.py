"""The page of the contact models' reference numbers, from its result file: ``python -m scripts.acceptance.contact_reference_page``."""

import json
from pathlib import Path
from typing import Any

from datasets.atomic_files import written_whole
from scripts.acceptance.contact_measured import QUANTITIES

ROOT = Path(__file__).resolve().parents[2]
RESULT, PAGE = ROOT / "docs" / "results" / "contact_reference.json", ROOT / "docs" / "studies" / "contact_reference.md"

TEXT = """\
# Contact models: reference numbers

Two contact models are under test, the Mirtich–Stronge impulse and Hertz–Mindlin without slip on a clump of spheres. Before they judge, or
are judged by, real impacts they have to be what they say they are. This page has every reference number they were held against, what
came, and the difference. It is copied from [contact_reference.json](../results/contact_reference.json) by
`scripts/acceptance/contact_reference_page.py`.

**{verdict}**

| group | numbers | largest difference | allowed |
| --- | --- | --- | --- |
{groups}

The number of each group that comes closest to what is allowed. Differences are over the number expected; with *abs.* they are in its
own unit, and half of the last digit printed is allowed. Expected numbers were computed independently with many digits or come from
public verification suites [Chung & Ooi 2011]. For random impacts the number that came is the largest of all, e drawn from 0 to 1, μ
from 0 to 1.5; below 0 there means that energy was lost, or friction kept inside its cone, in every one.

## Every number

| | expected | came | difference | {lammps_head}
| --- | --- | --- | --- | {lammps_rule}
{rows}

{lammps}

## How fast

| | |
| --- | --- |
{speeds}

Processor time of one core, compilation not counted; `tumble bench --only contact` measures it anew. Asked for were 1000 impacts of the
impulse model per second, and at most 1 s for the clump.

## How close a clump comes

The stone is a convex body of diamond of about 2 mm with up to 40 corners, its smallest sphere 20 µm in radius. The error is the gap
between the outlines of hull and clump, over 3000 directions. Mass and inertia are the mesh's, whatever the spheres.

| spheres | RMS, µm | largest, µm |
| --- | --- | --- |
{clump}

## Measured impacts of a sphere

Alumina spheres of 5 mm at 3.9 m/s on a thick plate [Kharaz, Gorham & Salman 2001], beside both models with the published e 0.98 and
μ 0.092. Dashed: the same models with e and μ fitted to all points, counted over assumed errors of reading of
0.02, 20 rad/s and 0.5°, and to the published e within 0.02.

![Measured impacts beside both models](contact_reference.png)

| | points | impulse: RMS | largest, at | Hertz–Mindlin: RMS | largest, at |
| --- | --- | --- | --- | --- | --- |
{measured}

The constants fitted, and what they leave, RMS:

| | e | μ | {fitted_head} |
| --- | --- | --- | --- | --- | --- |
{fitted}

{findings}

## Limits

- One contact point for the impulse model; an edge or a face that arrives flat is several. The support point says by how much the next
  corner lies higher.
- Hertz–Mindlin without slip keeps the tangential displacement while its stiffness changes with the depth; there is no slip inside the
  contact area. Spring and damper together are cut at μFₙ, and the spring alone at μFₙ too.
- e does not depend on speed in either model, there is no adhesion, and gravity is left out during contact.

Again, about half a minute: `python -m scripts.acceptance.contact_reference --result docs/results/contact_reference.json
--measured FILE --figure docs/studies/contact_reference.png && python -m scripts.acceptance.contact_reference_page`; the measured spheres
alone: `python -m scripts.acceptance.contact_measured FILE`; with `make lammps` before it LAMMPS's numbers come too.
"""
FINDINGS = """\
With the published constants, closer to the measurement: {said}.

- Past the onset of full sliding, about 32° from the normal, the two models are the same and lie on the measurement.
- At middling angles the contact recoils sideways: the measured spin is larger, and the tangential velocity smaller, than rolling gives.
  Hertz–Mindlin has that, the impulse model, rigid sideways, has not.
- Near the normal Hertz–Mindlin gives nearly all tangential velocity back, {near_compliant_largest:+.2f} from the measurement at
  {near_compliant_largest_at_deg:.0f}°; the contact loses some to slip at its rim, which a law without slip leaves out. The impulse
  model lies closer there, but at the one value of rolling for all angles."""
LAMMPS = """\
LAMMPS is a public discrete element code; it was run in the same go on the elastic cases (`hertz` and `mindlin` with the stiffnesses given,
no damping), the two spheres as two spheres. The largest difference from ours is {largest:.1e}. Damped cases are not compared: its damping
styles are defined otherwise."""
Row = dict[str, Any]


def page(result: dict[str, Any]) -> str:
    """The page's text."""
    rows: list[Row] = result["rows"]
    missed = [row for row in rows if not row["kept"]]
    compared = [row for row in rows if row["lammps"] is not None]
    largest = max((abs(row["came"] / row["lammps"] - 1.0) for row in compared), default=0.0)
    verdict = (
        f"All {len(rows)} numbers are as close as asked."
        if not missed
        else f"{len(missed)} of {len(rows)} numbers are not as close as asked."
    )
    return TEXT.format(
        verdict=verdict,
        groups="\n".join(_group(name, [r for r in rows if r["group"] == name]) for name in dict.fromkeys(r["group"] for r in rows)),
        lammps_head="LAMMPS |" if compared else "",
        lammps_rule="--- |" if compared else "",
        rows="\n".join(_row(row, with_lammps=bool(compared)) for row in rows),
        lammps=LAMMPS.format(largest=largest) if compared else "LAMMPS was not installed when these numbers were made.",
        speeds="\n".join(f"| {name} | {_plain(value)} |" for name, value in result["speeds"].items()),
        clump="\n".join(f"| {c['spheres']} | {c['rms_um']:.1f} | {c['largest_um']:.1f} |" for c in result["clump"]),
        measured="\n".join(_measured(entry) for entry in result["measured"]),
        fitted_head=" | ".join(QUANTITIES[entry["quantity"]] for entry in result["measured"]),
        fitted="\n".join(_fitted(entry, [m["quantity"] for m in result["measured"]]) for entry in result["fitted"]),
        findings=_findings({entry["quantity"]: entry for entry in result["measured"]}),
    )


def _plain(value: float) -> str:
    return f"{value:,.0f}" if value >= 100.0 else f"{value:.2g}"


def _group(name: str, rows: list[Row]) -> str:
    worst = max(rows, key=lambda row: row["off"] / row["allowed"])
    unit = " abs." if worst["absolute"] else ""
    return f"| {name} | {len(rows)} | {worst['off']:.1e}{unit} | {worst['allowed']:.1e} |"


def _row(row: Row, *, with_lammps: bool) -> str:
    expected = f"{'at most ' if row['at_most'] else ''}{row['expected']:.12g}"
    other = "" if row["lammps"] is None else f"{row['lammps']:.9g}"
    name = f"{row['group']}: {row['name']}".replace("|", "\\|")
    return f"| {name} | {expected} | {row['came']:.12g} | {row['off']:.1e} |" + (f" {other} |" if with_lammps else "")


def _measured(entry: Row) -> str:
    cells = [
        f"{entry[f'{m}_rms']:.3g} | {entry[f'{m}_largest']:+.3g}, {entry[f'{m}_largest_at_deg']:.0f}°" for m in ("impulse", "compliant")
    ]
    return f"| {QUANTITIES[entry['quantity']]} | {entry['points']} | {cells[0]} | {cells[1]} |"


def _fitted(entry: Row, quantities: list[str]) -> str:
    constants = " | ".join(f"{value:.3f} ± {sigma:.3f}" for value, sigma in (entry["restitution"], entry["friction"]))
    return f"| {entry['model']} | {constants} | " + " | ".join(f"{entry['rms'][q]:.3g}" for q in quantities) + " |"


def _findings(entries: dict[str, Row]) -> str:
    ahead = {name: "impulse" if e["impulse_rms"] < e["compliant_rms"] else "compliant" for name, e in entries.items()}
    if not entries:
        return ""
    words = {"impulse": "the impulse model", "compliant": "Hertz–Mindlin"}
    said = "; ".join(f"{QUANTITIES[name].split(',')[0]}: {words[model]}" for name, model in ahead.items())
    return FINDINGS.format(said=said, **{f"near_{k}": v for k, v in entries["tangential_restitution"].items()})


def main() -> int:
    """Write the page."""
    text = page(json.loads(RESULT.read_text(encoding="utf-8")))
    with written_whole(PAGE) as temporary:
        temporary.write_text(text, encoding="utf-8")
    print(PAGE.relative_to(ROOT))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
