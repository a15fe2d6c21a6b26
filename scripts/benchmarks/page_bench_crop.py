"""The page of the crop benchmark, from its result file: ``python -m scripts.benchmarks.page_bench_crop``."""

import json
from pathlib import Path
from typing import Any

from datasets.atomic_files import written_whole

ROOT = Path(__file__).resolve().parents[2]
RESULT, PAGE = ROOT / "docs" / "results" / "bench_crop.json", ROOT / "docs" / "studies" / "crop_rendering.md"

TEXT = """\
# Rendering only the crop

A frame of the high-speed camera is the static background, and the particle in a small part of it. So only the crop around the particle is
rendered, with a margin of eight pixels and what defocus adds, and put into the background. This page compares that with rendering the
full frame, the same rays per pixel in both. Numbers are copied from [bench_crop.json](../results/bench_crop.json) by
`scripts/benchmarks/page_bench_crop.py`.

| material, renderer; what covers 1/16 of the picture | pixels, full over crop | full frame, s | crop, s | full over crop |
| --- | --- | --- | --- | --- |
{times}

Processor time of one core, medians of seven pictures of 1024 × 1024.

**Wanted: at least 5 times as fast when the particle covers 1/16 of the picture.**
{verdict}
The gain is below the ratio of the pixels because the empty part of a frame is the cheap one: its rays meet nothing. For diamond most of
the time goes into light inside the particle, which both ways have to follow, so the crop saves less; there is no limit for it.

| material, renderer; what covers 1/16 | mean of the difference | displacement x, y | scatter | outside the crop |
| --- | --- | --- | --- | --- |
{agreement}

**The two agree within noise.** The mean is in standard deviations of the noise, and so is the scatter, which has to be 1; the displacement
of the one picture against the other is in px. Outside the crop a full frame is the background exactly. The largest of mean and
displacements is {largest:.1f} standard deviations, over {tests} such numbers; the limit was {limit:g}.

Again, about two minutes: `python -m scripts.benchmarks.bench_crop --result docs/results/bench_crop.json &&
python -m scripts.benchmarks.page_bench_crop`.
"""

Figures = dict[str, float]


def page(figures: list[dict[str, Any]]) -> str:
    """The page's text."""
    cases: dict[str, Figures] = {}
    limits: dict[str, float] = {}
    errors: dict[str, list[float]] = {}
    for entry in figures:
        case, name = entry["name"].split(": ", 1)
        if name == "its error":
            errors.setdefault(case, []).append(entry["value"])
            continue
        cases.setdefault(case, {})[name] = entry["value"]
        limits |= {name: entry["limit"]} if "limit" in entry else {}
    largest = "largest of mean and displacements"
    return TEXT.format(
        times="\n".join(_times(case, seen) for case, seen in cases.items()),
        agreement="\n".join(_agreement(case, seen, errors[case]) for case, seen in cases.items()),
        verdict=_verdict(cases, limits["full frame over crop"]),
        largest=max(seen[largest] for seen in cases.values()),
        tests=3 * len(cases),
        limit=limits[largest],
    )


def _label(case: str) -> str:
    return case.removesuffix(", silhouette 1/16") + ("; its silhouette" if "silhouette" in case else "; its bounding box")


def _times(case: str, seen: Figures) -> str:
    pixels, ratio = seen["pixels of the full frame over those of the crop"], seen["full frame over crop"]
    return f"| {_label(case)} | {pixels:.1f} | {seen['full frame']:.2f} | {seen['crop']:.2f} | {ratio:.1f} |"


def _agreement(case: str, seen: Figures, errors: list[float]) -> str:
    moved = ", ".join(f"{seen[f'displacement along {k}']:+.4f} ± {error:.4f}" for k, error in zip("xy", errors, strict=True))
    scatter, outside = seen["standard deviation of crop - full"], seen["difference outside the crop"]
    return f"| {_label(case)} | {seen['mean of crop - full']:+.1f} | {moved} | {scatter:.3f} | {outside:g} |"


def _verdict(cases: dict[str, Figures], wanted: float) -> str:
    matte = {case: seen["full frame over crop"] for case, seen in cases.items() if case.startswith("matte")}
    boxes = [ratio for case, ratio in matte.items() if "silhouette" not in case]
    areas = [ratio for case, ratio in matte.items() if "silhouette" in case]
    told = f"With its bounding box it is {_both(boxes)} times."
    return told + "".join(f"\nRead more strictly, with its silhouette, it is {r:.1f} times: {_reached(r, wanted)}." for r in areas)


def _both(ratios: list[float]) -> str:
    return " and ".join(f"{ratio:.1f}" for ratio in ratios)


def _reached(ratio: float, wanted: float) -> str:
    return "reached" if ratio >= wanted else "not reached"


def main() -> int:
    """Write the page."""
    text = page(json.loads(RESULT.read_text(encoding="utf-8")))
    with written_whole(PAGE) as temporary:
        temporary.write_text(text, encoding="utf-8")
    print(PAGE.relative_to(ROOT))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
