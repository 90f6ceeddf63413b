#!/usr/bin/env python3
"""What does it save that an analysis leaves out what its scene does not need?

Solves scenes lean and full in turn (lean, full, lean, full, ...) and compares the CPU seconds of the two processes, user and
system: without and with a gradient, an objective, files, a load on a channel, a law of its own for each unit. Then the first
evaluation of a study of each scene's unit, without and with its limits; its CPU seconds are those of the study's ledger. What
no option switches on needlessly is bounded by its share of the run, as the answer's `seconds` have it. Prints a table in Markdown and
writes it as CSV. Not part of CI; some ten CPU minutes for 13 pairs.

    python3 benches/omissions/measure.py target/release/salp docs/data/omissions.csv [pairs]
"""

import csv
import json
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

SCENES = ["chambers-40x15", "bellows-50x37"]
FOLDER = Path(__file__).parents[2] / "examples" / "scenes"
LAW = {"model": "neo_hookean", "c10_mpa": 0.11}
OTHER = {"model": "neo_hookean", "c10_mpa": 0.11 * (1 + 1e-9)}
AREA = {"kind": "enclosed_area", "probe": "tip", "orientation": "counter_clockwise"}
ONE_STATE = {"kind": "displacement", "probe": "tip", "component": "y", "leg": 1}
LIMITS = {"stretch": 10, "wall_gap_mm": 0.2, "load_margin": 1.1, "exclude_non_unique": False}


def solve(verb="solve", files=(), **fields):
    return {"verb": verb, "files": files, "fields": fields}


def schedule(rows):
    return {"actuation": {"schedule": rows, "load_steps_per_leg": 10}}


# What is left out, lean, full.
OF_SCENES = [
    ("self-contact, which is not available: noise", solve(contact="off"), solve(contact="auto")),
    ("adjoints of 41 states, exact factors", solve(), solve("gradient")),
    ("adjoint of 1 state, exact factors", solve(objective=ONE_STATE), solve("gradient", objective=ONE_STATE)),
    ("objective", solve(objective=None), solve(objective=AREA)),
    ("displacement fields, VTU file", solve(), solve(files=["--vtu"])),
    ("displacement fields, picture", solve(), solve(files=["--svg"])),
    ("mesh file", solve(), solve(files=["--msh"])),
    ("load of a channel", solve(**schedule([[0, 0], [15, 0], [0, 0]])), solve(**schedule([[0, 0], [15, 1e-6], [0, 0]]))),
    ("materials by unit", solve(unit_materials=[LAW] * 3), solve(unit_materials=[LAW, OTHER, LAW])),
]


def study(optimiser="gcmma", **limits):
    return {"optimiser": optimiser, "constraints": {**LIMITS, **limits}}


OFF = {"stretch": "off", "wall_gap_mm": "off", "load_margin": "off"}
OF_STUDIES = [
    ("all gradients", study("sweep"), study()),
    ("load margin, with gradients", study(load_margin="off"), study()),
    ("load margin, without gradients", study("sweep", load_margin="off"), study("sweep")),
    ("stretch rows, with gradients", study(**OFF), study(**{**OFF, "stretch": 10})),
    ("stretch rows, without gradients", study("sweep", **OFF), study("sweep", **{**OFF, "stretch": 10})),
    ("gap rows, with gradients", study(**OFF), study(**{**OFF, "wall_gap_mm": 0.2})),
]


def cpu():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def call(arguments):
    before = cpu()
    run = subprocess.run(arguments, capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f"{' '.join(arguments)}: {run.stderr}{run.stdout[-2000:]}")
    return run.stdout, cpu() - before


def run_scene(salp, scene, what, folder):
    arguments = [salp, what["verb"], str(FOLDER / f"{scene}.json"), "--json"]
    for path, value in what["fields"].items():
        arguments += ["--set", f"{path}={json.dumps(value)}"]
    for option in what["files"]:
        arguments += [option, str(Path(folder) / "file")]
    text, seconds = call(arguments)
    answer = json.loads(text)
    return seconds, answer["work"]["factorisations"], answer["seconds"]


def run_study(salp, scene, what, folder):
    chambers = json.loads((FOLDER / f"{scene}.json").read_text())["actuator"]["chambers_mm"]
    point = [c for chamber in chambers for corner in chamber for c in corner]
    sweep = what["optimiser"] == "sweep"
    document = {
        "name": "omissions",
        "actuator": {"units": 3},
        "material": "mold-star-30-soft",
        "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 4},
        "step": [{
            "id": "one",
            "target": {"kind": "enclosed_area", "probe_mm": [160, 40], "orientation": "clockwise"},
            "model": {"kind": "fe_cascade", "element": "quad9", "relative_residual_force_tolerance": 1e-8},
            "variables": {"parametrisation": "corners"},
            "constraints": what["constraints"],
            "optimiser": {"method": "sweep", "points": [point]} if sweep else {"method": "gcmma"},
            "budget": {"evaluations": 1},
            "restarts": {"start": ["given"], "points": [point]},
        }],
    }
    if sweep:
        del document["step"][0]["restarts"]
    file = Path(folder) / "study.json"
    file.write_text(json.dumps(document))
    out = Path(folder) / "out"
    call([salp, "run", str(file), "--workers", "1", "--fresh", "--out", str(out)])
    with open(out / "report" / "ledger.csv", newline="") as ledger:
        row = next(csv.DictReader(ledger))
    if row["status"] != "ok":
        sys.exit(f"{scene}, {what}: {row['status']}")
    return float(row["cpu_s"]), None, None


def compare(run, salp, scene, lean, full, pairs):
    """CPU seconds of alternating runs, the first pair of which is not counted."""
    found = {"lean": [], "full": []}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(pairs + 1):
            for name, what in (("lean", lean), ("full", full)):
                found[name].append(run(salp, scene, what, folder))
    seconds = {name: [r[0] for r in runs[1:]] for name, runs in found.items()}
    # Of each pair, so that what the machine did at the time counts on both sides.
    saved = [100 * (1 - a / b) for a, b in zip(seconds["lean"], seconds["full"])]
    low, middle, high = statistics.quantiles(saved, n=4)
    row = {
        "pairs": pairs,
        "lean_cpu_s": round(statistics.median(seconds["lean"]), 4),
        "full_cpu_s": round(statistics.median(seconds["full"]), 4),
        "saved_percent": round(middle, 1),
        "lower_quartile": round(low, 1),
        "upper_quartile": round(high, 1),
        "lean_factorisations": found["lean"][-1][1],
        "full_factorisations": found["full"][-1][1],
    }
    return row, [r[2] for r in found["lean"][1:]]


def shares(seconds):
    """What the phases that no option switches off take of a run, in per cent."""
    for name, phase in [("measures of states (bound)", "measures"), ("pressure of the elements (bound: all assembly)", "assembly")]:
        of_runs = [100 * s[phase] / s["wall"] for s in seconds]
        low, middle, high = statistics.quantiles(of_runs, n=4)
        yield name, {"pairs": len(seconds), "saved_percent": round(middle, 1), "lower_quartile": round(low, 1), "upper_quartile": round(high, 1)}


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    salp, table = sys.argv[1:3]
    pairs = int(sys.argv[3]) if len(sys.argv) == 4 else 13
    rows = []

    def add(kind, scene, omission, row):
        rows.append({"of": kind, "scene": scene, "left_out": omission, **row})
        print(rows[-1], file=sys.stderr, flush=True)

    for scene in SCENES:
        for index, (omission, lean, full) in enumerate(OF_SCENES):
            row, seconds = compare(run_scene, salp, scene, lean, full, pairs)
            add("scene", scene, omission, row)
            if index == 0:
                for name, share in shares(seconds):
                    add("scene", scene, name, share)
        for omission, lean, full in OF_STUDIES:
            row, _ = compare(run_study, salp, scene, lean, full, pairs)
            add("study", scene, omission, row)

    names = list(dict.fromkeys(key for row in rows for key in row))
    Path(table).parent.mkdir(parents=True, exist_ok=True)
    with open(table, "w", newline="") as file:
        writer = csv.DictWriter(file, names, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    print("| left out of a | what | " + " | ".join(f"`{s}`" for s in SCENES) + " |\n|---|---|" + "---|" * len(SCENES))
    for kind, omission in dict.fromkeys((row["of"], row["left_out"]) for row in rows):
        cells = [r for r in rows if (r["of"], r["left_out"]) == (kind, omission)]
        texts = [f"{c['saved_percent']} % ({c['lower_quartile']} to {c['upper_quartile']})" for c in cells]
        print(f"| {kind} | {omission} | " + " | ".join(texts) + " |")


if __name__ == "__main__":
    main()
