#!/usr/bin/env python3
"""What do idle workers gain by evaluating what an optimiser will probably ask next?

A program that sleeps stands in for an analysis, so that the machine's cores do not matter: MMFD, GCMMA and SQP with differences on a
smooth problem of six variables with one constraint, one restart, with and without `speculate`, by one and by several workers. Writes
wall time, evaluations of the optimiser, guesses and how many of them were asked for as CSV, and stops where histories differ. Not
part of CI; some minutes.

    python3 benches/speculation/measure.py target/release/salp docs/data/speculation.csv [--pause 0.5] [--workers 1 4 8]
"""

import argparse
import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

VARIABLES = 6
METHODS = {"mmfd": 6, "gcmma": 8, "sqp": 8}
MODEL = """
import json, math, sys, time
for line in sys.stdin:
    x = json.loads(line)["x"]
    time.sleep(float(sys.argv[1]))
    f = sum((a - i) ** 2 + math.sin(a) / 10 for i, a in enumerate(x)) + x[0] * x[1]
    print(json.dumps({"objective": f, "constraints": [sum(a * a for a in x) / 20 - 1]}), flush=True)
"""


def study(method, iterations, pause, speculate):
    model = {"kind": "command", "argv": ["python3", "model.py", str(pause)], "time_limit_s": 60, "gradient": False}
    step = {
        "id": "solve",
        "model": model,
        "variables": {"lower": [-6] * VARIABLES, "upper": [6] * VARIABLES},
        "constraints": {"inequalities": 1, "equalities": 0},
        "optimiser": {"method": method, "gradient": "differences", "max_iterations": iterations},
        "restarts": {"start": "given", "points": [[0.3] * VARIABLES]},
    }
    return {"name": f"{method}-{speculate}".lower(), "speculate": speculate, "step": [step]}


def run(salp, folder, document, workers):
    path = folder / "study.json"
    path.write_text(json.dumps(document))
    out = folder / f"{document['name']}-{workers}"
    command = [salp, "run", path, "--allow-commands", "--workers", str(workers), "--out", out, "--json"]
    ended = subprocess.run(command, capture_output=True, text=True)
    if ended.returncode != 0:
        sys.exit(f"{document['name']}: {ended.stderr}{ended.stdout[-2000:]}")
    return json.loads(ended.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("salp")
    parser.add_argument("csv", type=Path)
    parser.add_argument("--pause", type=float, default=0.5, help="seconds of an evaluation")
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 4, 8])
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / "model.py").write_text(MODEL)
        for method, iterations in METHODS.items():
            histories = set()
            for workers in options.workers:
                for speculate in (False, True):
                    document = study(method, iterations, options.pause, speculate)
                    answer = run(str(Path(options.salp).resolve()), folder, document, workers)
                    (restart,) = answer["steps"][0]["restarts"]
                    histories.add(restart["history_sha256"])
                    row = {
                        "method": method,
                        "workers": workers,
                        "speculate": speculate,
                        "pause_s": options.pause,
                        "wall_s": round(answer["seconds"], 2),
                        "evaluations": len(restart["history"]),
                        "guesses": answer["guesses"]["answered"],
                        "used": answer["guesses"]["used"],
                    }
                    print(json.dumps(row), flush=True)
                    rows.append(row)
            if len(histories) != 1:
                sys.exit(f"{method}: {len(histories)} histories")
    with options.csv.open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
