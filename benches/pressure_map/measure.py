#!/usr/bin/env python3
"""How well does a map over the pressure plane score schedules, and what does it cost against solving them?

For each scene and number of pressures a channel: the score of `hold`, `swap` and `overlap` by `salp map`, its stated error, and the
error against direct solves with 10 and 20 graded states a leg, of which the limit of order two is the reference; beside it the error of
direct solves with 4 and with 20 states. Writes a line per scene, schedule and grid as CSV. Not part of CI.

    python3 benches/pressure_map/measure.py target/release/salp docs/data/pressure-map.csv SCENE...

docs/decisions/pressure-map.md is from examples/scenes/{chambers-40x15,chambers-20x35,slanted,bellows-40x37}.json and the `best.json` of two
runs of benches/areas.
"""

import argparse
import csv
import json
import subprocess
from pathlib import Path

SCHEDULES = ["hold", "swap", "overlap"]


def salp(program, *arguments):
    run = subprocess.run([program, *arguments, "--json"], capture_output=True, text=True)
    return json.loads(run.stdout)


def direct(program, scene, states):
    """Area and CPU seconds per schedule."""
    sets = [f"--set=actuation.load_steps_per_leg={states}", "--set=actuation.spacing=graded"]
    answer = salp(program, "map", scene, "--grid", "5", "--direct", *sets)
    found = {s["schedule"]: s["direct"] for s in answer["schedules"]}
    return {name: (d["enclosed_area_mm2"].get("tip"), d["cpu_s"]) for name, d in found.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("salp")
    parser.add_argument("csv", type=Path)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--grids", type=int, nargs="+", default=[5, 7, 9])
    options = parser.parse_args()
    rows = []
    for scene in options.scenes:
        name = scene.stem if scene.stem != "best" else f"best of {scene.parents[1].name}"
        solved = {states: direct(options.salp, str(scene), states) for states in (4, 10, 20)}
        maps = {grid: salp(options.salp, "map", str(scene), "--grid", str(grid)) for grid in options.grids}
        for schedule in SCHEDULES:
            (four, four_s), (ten, _), (twenty, twenty_s) = (solved[states][schedule] for states in (4, 10, 20))
            reference = twenty + (twenty - ten) / 3
            percent = lambda area: round(100 * (area / reference - 1), 4)
            for grid, answer in maps.items():
                (found,) = [s for s in answer["schedules"] if s["schedule"] == schedule]
                score = found["scores"]["tip"]
                row = {
                    "scene": name,
                    "schedule": schedule,
                    "area_mm2": round(reference, 6),
                    "direct_4_percent": percent(four),
                    "direct_20_percent": percent(twenty),
                    "direct_4_cpu_s": round(four_s, 2),
                    "direct_20_cpu_s": round(twenty_s, 2),
                    "grid": grid,
                    "map_percent": percent(score["area_mm2"]),
                    "stated_percent": round(100 * score["error_mm2"] / abs(reference), 4),
                    "map_cpu_s": round(answer["seconds"]["cpu"], 2),
                    "gap_mm": f"{answer['gap_mm']:.1e}",
                    "contact": answer["contact"] is not None,
                }
                print(json.dumps(row), flush=True)
                rows.append(row)
    with options.csv.open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
