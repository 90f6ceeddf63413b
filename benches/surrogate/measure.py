#!/usr/bin/env python3
"""Are three units fit to stand for nine? Areas of the same designs on three, five and nine units, for three schedules.

Takes the designs of `salp verify --designs N --csv FILE` (a third uniform in the paper's boxes, a third near their outer edges, a
third met by optimisers), solves each as chains of units with `salp map` (one map has the areas of all schedules, with their errors)
and writes a line per design and number of units, of one unit its stretch alone: 15 kPa, `mold-star-30`, contact where surfaces come near. A design is feasible
where all its maps are complete and unique. What has been solved is not solved again, so the command resumes. Not part of CI: about
an hour on two cores.

    target/release/salp verify --designs 330 --csv salp-out/designs.csv
    python3 benches/surrogate/measure.py target/release/salp salp-out/designs.csv docs/data/surrogate.csv --out salp-out/surrogate
    python3 benches/surrogate/report.py docs/data/surrogate.csv docs/images/surrogate.svg
"""

import argparse
import csv
import json
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from itertools import zip_longest
from pathlib import Path

STRATA = ["uniform", "near_bounds", "met"]
SCHEDULES = ["hold", "swap", "overlap"]
# Where the tip is: that of few units is the middle of the last but one, as the end of the last bulges.
PROBES = {1: {"tip": [80, 40]}, 3: {"tip": [160, 40]}, 5: {"tip": [320, 40]}, 9: {"tip": [640, 40], "end": [720, 40]}}


def designs(file):
    """Index, stratum and coordinates of each design, the strata in turn."""
    seen = {}
    with file.open() as lines:
        for line in csv.DictReader(lines):
            x = [float(v) for v in line["x"].split()]
            seen.setdefault(int(line["design"]), (line["stratum"], x))
    by_stratum = [[(i, *d) for i, d in sorted(seen.items()) if d[0] == s] for s in STRATA]
    return [design for turn in zip_longest(*by_stratum) for design in turn if design]


def scene(x, units, size):
    points = [x[k : k + 2] for k in range(0, 16, 2)]
    return {
        "version": 1,
        "actuator": {"repeat": units, "chambers_mm": [points[:4], points[4:]]},
        "material": "mold-star-30",
        "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 4},
        "mesh": {"element": "quad9", "max_size_mm": size},
        "contact": "auto",
        "probes": PROBES[units],
    }


def stretched(salp, x):
    """The largest averaged stretch at the corners of the pressure plane, of one unit on the mesh of the size rule: those meshes that
    are enough for an area show too little of it."""
    document = scene(x, 1, None)
    document["actuation"] = {"schedule": [[0, 0], [15, 0], [15, 15], [0, 15]], "load_steps_per_leg": 1}
    answer = asked(salp, "solve", document)
    line = {"units": 1, "size_mm": None, "status": answer["status"], "unique": answer["unique"]}
    line["max_stretch"] = max((s["max_stretch"] for s in answer["path"]), default=None)
    return line | {"elements": answer["mesh"]["elements"], "cpu_s": answer["seconds"]["cpu"]}


def asked(salp, verb, document, *arguments):
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        file.write(json.dumps(document))
        file.flush()
        run = subprocess.run([salp, verb, file.name, *arguments, "--json"], capture_output=True, text=True)
    return json.loads(run.stdout)


def solved(salp, x, units, size, grid):
    if units == 1:
        return stretched(salp, x)
    answer = asked(salp, "map", scene(x, units, size), "--grid", str(grid))
    line = {
        "units": units,
        "size_mm": size,
        "status": answer["status"],
        "unique": answer["unique"],
        "max_stretch": answer["max_stretch"],
        "contact": answer["contact"] is not None,
        "reach_mm": max((sum(c * c for c in s["displacement_mm"]["tip"]) ** 0.5 for s in answer["states"]), default=None),
        "elements": answer["mesh"]["elements"],
        "cpu_s": answer["seconds"]["cpu"],
    }
    for entry in answer["schedules"]:
        for probe, score in entry["scores"].items():
            name = f"{entry['schedule']}_{probe}"
            line[f"{name}_mm2"], line[f"{name}_error_mm2"] = score["area_mm2"], score["error_mm2"]
    return line


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("salp")
    parser.add_argument("designs", type=Path)
    parser.add_argument("csv", type=Path)
    parser.add_argument("--out", type=Path, required=True, help="folder of what has been solved")
    parser.add_argument("--units", type=int, nargs="+", default=[3, 9, 5, 1], choices=PROBES, help="the first that fails ends a design")
    parser.add_argument("--size", type=float, default=20.0, help="longest element edge, mm; 0: by the size rule, as designs that have no mesh of it")
    parser.add_argument("--grid", type=int, default=7)
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    cache = options.out / f"{options.size:g}-{options.grid}.jsonl"
    known = {}
    if cache.exists():
        for line in map(json.loads, cache.read_text().splitlines()):
            known[line["design"], line["units"]] = line

    def of_design(design):
        index, stratum, x = design
        size = options.size
        for units in options.units:
            line = known.get((index, units))
            # A deep notch asks for the mesh that the size rule chooses.
            while line is None or (line["status"] == "infeasible_geometry" and line["size_mm"]):
                size = None if line else size
                line = {"design": index, "stratum": stratum} | solved(options.salp, x, units, size, options.grid)
                known[index, units] = line
                with cache.open("a") as file:
                    file.write(json.dumps(line) + "\n")
                print(index, stratum, units, line["status"], line["unique"], f"{line['cpu_s']:.1f} CPU s", flush=True)
            size = line["size_mm"]
            if line["status"] != "ok" or not line["unique"]:
                return

    options.size = options.size or None
    wanted = designs(options.designs)
    with ThreadPoolExecutor(options.threads) as pool:
        list(pool.map(of_design, wanted))
    lines = [known[key] for key in sorted(known) if key[0] in {d[0] for d in wanted} and key[1] in options.units]
    names = list(dict.fromkeys(name for line in lines for name in line))
    digits = lambda value: f"{value:.6g}" if isinstance(value, float) else value
    with options.csv.open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=names, lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: digits(value) for name, value in line.items()} for line in lines)


if __name__ == "__main__":
    main()
