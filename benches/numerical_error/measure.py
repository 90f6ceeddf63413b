#!/usr/bin/env python3
"""Does the true error of an area lie within the numerical error that `salp solve --numerical-error` states?

Takes the designs of `salp verify --designs N` (a third uniform in the paper's boxes, a third near their outer edges, a third met by
optimisers) as one unit, `hold` at 15 kPa, `mold-star-30`, 2 load steps a leg, and compares two stated values with a reference: that
of the finest of the three nested meshes (elements split 4 by 4), and that of the scene's own mesh.

The reference is A8 + rest + settings:
  A8        elements split 8 by 8, half as large as the finest of the estimate
  rest      what Richardson's extrapolation of A2, A4, A8 adds, where they have an order of 0.5 to 6; else nothing
  settings  B - A2, where B has elements split 2 by 2, a tolerance of 1e-11, K/mu = 1e5, and as its load steps the limit of order
            two of 4 and 8 times as many
With --full it is instead one solve of all that at once, split 8 by 8, and the same rest.

With --contact surfaces meet (`contact = "auto"`), and where they do the settings of B have no activation distance: the limit of order
one of a half and a quarter of it.

K/mu counts as a setting by which incompressible rubber is reached: the reference has 1e5, the stated error has its term. What is
right for who keeps K/mu as a property of the material is counted beside it: a reference of the own K/mu, the sum without its term.

Writes a line per design as CSV and prints the shares. Not part of CI: about 20 CPU seconds a design.

    python3 benches/numerical_error/measure.py target/release/salp docs/data/numerical-error.csv [--designs 100] [--full]
"""

import argparse
import csv
import json
import math
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

TERMS = ["mesh", "tolerance", "path", "contact", "bulk"]


def salp(program, *arguments):
    run = subprocess.run([program, *arguments, "--json"], capture_output=True, text=True)
    if run.returncode not in (0, 1):
        sys.exit(run.stdout + run.stderr)
    return json.loads(run.stdout)


def designs(program, count, seed, threads):
    """Index, stratum and coordinates of each design, the strata in turn so that a run that is cut short has all of them."""
    lines = salp(program, "verify", "--designs", str(count), "--seed", str(seed), "--threads", str(threads))["lines"]
    seen = {}
    for line in lines:
        seen.setdefault(line["design"], (line["stratum"], line["x"]))
    turn = max(len(seen) // 3, 1)
    return sorted(((index, *rest) for index, rest in seen.items()), key=lambda design: (design[0] % turn, design[0]))


def scene(x, size, contact):
    points = [x[k:k + 2] for k in range(0, 16, 2)]
    return {
        "version": 1,
        "actuator": {"chambers_mm": [points[:4], points[4:]]},
        "material": "mold-star-30",
        "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 2},
        "mesh": {"element": "quad9", "max_size_mm": size},
        "contact": "auto" if contact else "off",
        "probes": {"tip": [80, 40]},
        "objective": {"kind": "enclosed_area", "probe": "tip", "orientation": "counter_clockwise"},
    }


class Solver:
    def __init__(self, program, document):
        self.program, self.file = program, tempfile.NamedTemporaryFile("w", suffix=".json")
        self.file.write(json.dumps(document))
        self.file.flush()

    def answer(self, *arguments):
        return salp(self.program, "solve", self.file.name, *arguments)

    def value(self, refine, steps=2, tolerance=None, bulk=None, activation=None):
        arguments = ["--refine", str(refine), "--set", f"actuation.load_steps_per_leg={steps}"]
        if tolerance is not None:
            arguments += ["--set", f"relative_residual_force_tolerance={tolerance}"]
        if activation is not None:
            arguments += ["--set", f"contact_activation_mm={activation}"]
        if bulk is not None:
            material = salp(self.program, "material", "show", "mold-star-30")
            law = material.get("law", material)
            arguments += ["--set", "material=" + json.dumps({**law, "bulk_over_shear": bulk})]
        answer = self.answer(*arguments)
        return answer["objective"] if answer["status"] == "ok" else None


def limit(a, b, c):
    """What Richardson's extrapolation adds to c."""
    first, second = b - a, c - b
    if first * second <= 0:
        return 0.0
    order = math.log2(first / second)
    return second / (2**order - 1) if 0.5 <= order <= 6 else 0.0


def measure(program, index, stratum, x, size, contact, full, threads, known):
    solver = Solver(program, scene(x, size, contact))
    earlier = known.get((str(index), stratum))
    answer = solver.answer("--numerical-error", "--threads", str(threads))
    row = {"design": index, "stratum": stratum, "status": answer["status"]}
    if answer["status"] != "ok":
        return row
    found = answer["numerical_error"]
    row["elements"] = answer["mesh"]["elements"]
    row["touched"] = int(answer["work"]["contact_steps"] > 0)
    for term in found["terms"]:
        row[term["source"]] = term["error"]
        if term["source"] == "mesh":
            row["order"] = term.get("order")
    if found["error"] is None:
        row["status"] = "not known: " + found["sentence"]
        return row
    own, finest = found["own_mesh"]["value"], found["value"]
    (mesh,) = [t for t in found["terms"] if t["source"] == "mesh"]
    mid = mesh["solves"][0]["value"]
    if earlier:
        parts = {name: float(earlier[name]) for name in ("reference", "mesh_limit", "path_part", "bulk_part")}
        return row | compared(found, own, finest, mid, row, **parts)
    overkill = {"tolerance": 1e-11}
    fine = solver.value(8)
    fine_steps = [solver.value(2, steps, **overkill) for steps in (8, 16)]
    soft = solver.value(2, 8, bulk=1e5, **overkill)
    nearer = []
    if row["touched"]:
        activation = answer["resolved"]["contact_activation_mm"]
        nearer = [solver.value(2, 8, activation=activation / n, **overkill) for n in (2, 4)]
    if None in (fine, soft, *fine_steps, *nearer):
        row["status"] = "no reference"
        return row
    rest = limit(mid, finest, fine)
    path = (fine_steps[1] - fine_steps[0]) * 4 / 3
    bulk = soft - fine_steps[0]
    contact_part = 2 * nearer[1] - nearer[0] - fine_steps[0] if nearer else 0.0
    reference = fine + rest + (fine_steps[0] + path - mid) + bulk + contact_part
    if full:
        fine = solver.value(8, 8, bulk=1e5, **overkill)
        row["composed"] = reference
        if fine is None:
            row["status"] = "no reference"
            return row
        reference = fine + rest + path + contact_part
        fine -= fine_steps[0] + bulk - mid  # what it has of the mesh alone
    path += fine_steps[0] - mid
    row["contact_part"] = contact_part
    return row | compared(found, own, finest, mid, row, reference, fine + rest, path, bulk)


def compared(found, own, finest, mid, row, reference, mesh_limit, path_part, bulk_part):
    """The columns of a design with estimate and reference; the last ones are of single terms: what each is of the whole."""
    return {
        "reference": reference, "mesh_limit": mesh_limit, "path_part": path_part, "bulk_part": bulk_part,
        "finest": finest, "own": own, "mid": mid,
        "finest_error": abs(finest - reference), "finest_bound": found["error"],
        "own_error": abs(own - reference), "own_bound": found["own_mesh"]["error"],
        "kept_error": abs(finest - (reference - bulk_part)), "kept_bound": found["error"] - row["bulk"],
        "percent": found["error_percent"],
        "mesh_error": abs(finest - mesh_limit), "mesh_bound": row["mesh"],
        "path_error": abs(path_part), "path_bound": row["path"] + row["tolerance"],
        "bulk_error": abs(bulk_part), "bulk_bound": row["bulk"],
    }


def summary(rows):
    known = [row for row in rows if "reference" in row]
    print(f"{len(rows)} designs: {len(known)} with estimate and reference")
    for status in sorted({row["status"] for row in rows if "reference" not in row}):
        print(f"  {sum(row['status'] == status for row in rows)} {status}")
    if not known:
        return
    print(f"contact acted on {sum(row['touched'] for row in known)}")
    for name, words in [("finest", "finest mesh"), ("own", "own mesh"), ("kept", "finest mesh, K/mu kept"),
                        ("mesh", "its mesh alone"), ("path", "its path and tolerance alone"), ("bulk", "its K/mu alone")]:
        inside = [row for row in known if row[f"{name}_error"] <= row[f"{name}_bound"]]
        ratios = [row[f"{name}_bound"] / max(row[f"{name}_error"], 1e-15) for row in known]
        print(f"{words}: inside {len(inside)} of {len(known)}, bound over error: median {statistics.median(ratios):.2f}, "
              f"least {min(ratios):.2f}, largest {max(ratios):.3g}")
    for term in TERMS:
        shares = [row[term] / row["finest_bound"] for row in known]
        print(f"share of {term}: median {statistics.median(shares):.2g}, largest {max(shares):.2g}")
    ordered = [row for row in known if row["order"] is not None]
    print(f"observed order used: {len(ordered)} of {len(known)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("table", type=Path)
    parser.add_argument("--designs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=20230328)
    parser.add_argument("--max-size-mm", type=float, default=None, help="default: the size rule")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--contact", action="store_true")
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--references", type=Path, help="takes the references of an earlier table, and only its designs")
    asked = parser.parse_args()
    names = ["design", "stratum", "status", "elements", "touched", *TERMS, "order", "reference", "composed", "mesh_limit", "path_part", "bulk_part", "contact_part", "finest", "own", "mid", "finest_error",
             "finest_bound", "own_error", "own_bound", "kept_error", "kept_bound", "percent", "mesh_error", "mesh_bound", "path_error", "path_bound", "bulk_error", "bulk_bound"]
    rows, known = [], {}
    if asked.references:
        with open(asked.references, newline="") as file:
            known = {(row["design"], row["stratum"]): row for row in csv.DictReader(file) if row["reference"]}
    asked.table.parent.mkdir(parents=True, exist_ok=True)
    with open(asked.table, "w", newline="") as file:
        writer = csv.DictWriter(file, names, lineterminator="\n")
        writer.writeheader()
        for index, stratum, x in designs(asked.program, asked.designs, asked.seed, asked.threads):
            if known and (str(index), stratum) not in known:
                continue
            rows.append(measure(asked.program, index, stratum, x, asked.max_size_mm, asked.contact, asked.full, asked.threads, known))
            writer.writerow(rows[-1])
            file.flush()
            print({k: f"{v:.5g}" if isinstance(v, float) else v for k, v in rows[-1].items()}, flush=True)
    summary(rows)


if __name__ == "__main__":
    main()
