#!/usr/bin/env python3
"""Do a coordinator and two workers keep up with two loops of `salp solve` side by side?

Random pairs of rectangles in a coarse model of three units: once as a sweep of a study with a coordinator and two workers, once as two
shell loops of `salp solve` over the same designs, every second one to each. Designs per second are counted until the queue first runs
dry: in the study until its last evaluation is claimed, in the loops until the first of them has ended. Designs differ in their cost, so
that each counts with its median CPU time in the loops over the mean; beside it the plain number. What comes after is the tail. CPU is user
and system time of all processes. The two take turns, and the ratio of each pair is written with the median of all. Needs an idle
machine of at least two cores. Not part of CI; some minutes.

    python3 benches/throughput/measure.py target/release/salp docs/data/throughput.csv [--designs 40] [--pairs 5]
"""

import argparse
import csv
import json
import os
import random
import shlex
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

WORKERS = 2
UNIT_MM, WALL_MM = 80.0, 2.0
# Width and height in mm: valid geometry with walls that the limits of the study would allow.
LOWEST, HIGHEST = [15.0, 8.0], [70.0, 36.0]
ACTUATION = {"schedule": "hold", "pressure_kpa": 8, "load_steps_per_leg": 8}
SIZE_MM = 6
TOLERANCE = 1e-8
OFF = {"stretch": "off", "wall_gap_mm": "off", "load_margin": "off", "exclude_non_unique": False}


def designs(count, seed):
    stream = random.Random(seed)
    return [[round(stream.uniform(a, b), 3) for a, b in zip(LOWEST, HIGHEST)] for _ in range(count)]


def scene(design):
    """The same analysis as an evaluation of the study."""
    width, height = design
    domain = (UNIT_MM - 3 * WALL_MM) / 2
    rectangle = lambda y: [
        [UNIT_MM / 2 + i * width / 2, y + j * height / 2] for i, j in [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    ]
    centres = [WALL_MM + domain / 2, UNIT_MM - WALL_MM - domain / 2]
    return {
        "version": 1,
        "actuator": {"repeat": 3, "unit_mm": [UNIT_MM] * 2, "chambers_mm": [rectangle(y) for y in centres]},
        "material": "mold-star-30",
        "actuation": ACTUATION,
        "mesh": {"element": "quad9", "max_size_mm": SIZE_MM},
        "contact": "off",
        "relative_residual_force_tolerance": TOLERANCE,
        "probes": {"tip": [160, 40]},
        "objective": {"kind": "enclosed_area", "probe": "tip", "orientation": "counter_clockwise"},
    }


def study(points, name):
    model = {
        "kind": "fe_cascade",
        "element": "quad9",
        "max_size_mm": SIZE_MM,
        "relative_residual_force_tolerance": TOLERANCE,
        "contact": "off",
    }
    step = {
        "id": "sweep",
        "target": {"kind": "enclosed_area", "probe_mm": [160, 40], "orientation": "counter_clockwise"},
        "model": model,
        "variables": {"parametrisation": "rectangle"},
        "constraints": {"wall_mm": WALL_MM, "spike_deg": 3, **OFF},
        "optimiser": {"method": "sweep", "points": points},
    }
    return {
        "name": name,
        "error_bands": False,
        "material": "mold-star-30",
        "actuator": {"units": 3},
        "actuation": ACTUATION,
        "step": [step],
    }


def cpu(process):
    """Waits for a process; its CPU seconds with those of the children that it waited for."""
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return used.ru_utime + used.ru_stime


def ask(url, body=None):
    data = None if body is None else json.dumps(body).encode()
    headers = {"Content-Type": "application/json"}
    with urllib.request.urlopen(urllib.request.Request(url, data, headers), timeout=30) as answer:
        return json.load(answer)


def run_study(salp, points, folder):
    """Wall seconds of each design's end, the instant at which the queue ran dry, objectives, CPU seconds of all processes."""
    folder.mkdir()
    # It prints one line with its address.
    serve = subprocess.Popen(
        [salp, "serve", "--listen", "127.0.0.1:0", "--json", "--store", str(folder / "salp.db")],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    url = json.loads(serve.stdout.readline())["url"]
    workers = [
        subprocess.Popen([salp, "work", url], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for _ in range(WORKERS)
    ]
    try:
        # Both wait for work.
        time.sleep(1.0)
        identity = ask(f"{url}/v1/studies", study(points, folder.name))["id"]
        while (view := ask(f"{url}/v1/studies/{identity}"))["state"] in ("queued", "running"):
            time.sleep(0.2)
        rows = ask(f"{url}/v1/studies/{identity}/evaluations?limit=10000")["evaluations"]
    finally:
        for process in workers:
            process.terminate()
        spent = sum(cpu(process) for process in workers)
        serve.terminate()
        spent += cpu(serve)
    if view["state"] != "done" or any(row["status"] != "ok" for row in rows):
        sys.exit(f"the study is {view['state']}: {sorted({row['status'] for row in rows})}")
    rows.sort(key=lambda row: (row["batch"], row["batch_index"]))
    began = view["started_ms"]
    ends = [(row["finished_ms"] - began) / 1000 for row in rows]
    # When the last one is claimed every other worker still has one.
    dry = sorted(ends)[len(ends) - WORKERS - 1]
    return ends, dry, [row["objective"] for row in rows], spent


def run_loops(salp, points, folder):
    """As above; and the CPU seconds of each design."""
    folder.mkdir()
    for k, point in enumerate(points):
        (folder / f"{k}.json").write_text(json.dumps(scene(point)))
    began = time.time()
    loops = []
    for first in range(WORKERS):
        names = " ".join(str(k) for k in range(first, len(points), WORKERS))
        line = f"{shlex.quote(salp)} solve $k.json --json > $k.out 2> $k.log || exit 1; date +%s.%N > $k.end"
        loops.append(subprocess.Popen(["sh", "-c", f"for k in {names}; do {line}; done"], cwd=folder))
    spent = sum(cpu(loop) for loop in loops)
    if any(loop.returncode for loop in loops):
        logs = [path.read_text() for path in folder.glob("*.log")]
        sys.exit(f"a loop failed: {[log for log in logs if log][-1:]}")
    ends = [float((folder / f"{k}.end").read_text()) - began for k in range(len(points))]
    dry = min(max(ends[first::WORKERS]) for first in range(WORKERS))
    answers = [json.loads((folder / f"{k}.out").read_text()) for k in range(len(points))]
    objectives = [answer["objective"] for answer in answers]
    return ends, dry, objectives, spent, [answer["seconds"]["cpu"] for answer in answers]


def figures(kind, pair, ends, dry, spent, weights):
    until_dry = [weight for end, weight in zip(ends, weights) if end <= dry]
    return {
        "pair": pair,
        "what": kind,
        "designs": len(ends),
        "until_dry": len(until_dry),
        "dry_s": round(dry, 3),
        "designs_per_s": round(sum(until_dry) / dry, 4),
        "plain_per_s": round(len(until_dry) / dry, 4),
        "tail_s": round(max(ends) - dry, 3),
        "cpu_s_per_design": round(spent / len(ends), 4),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("salp")
    parser.add_argument("csv", type=Path)
    parser.add_argument("--designs", type=int, default=40)
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if options.designs <= WORKERS:
        parser.error(f"more than {WORKERS} designs are needed")
    salp = str(Path(options.salp).resolve())
    points = designs(options.designs, options.seed)
    measured = []
    with tempfile.TemporaryDirectory() as scratch:
        for pair in range(options.pairs):
            run = {}
            # The order alternates, so that a machine that grows warm or slow favours neither.
            kinds = ["study", "loops"] if pair % 2 == 0 else ["loops", "study"]
            for kind in kinds:
                of = run_study if kind == "study" else run_loops
                run[kind] = of(salp, points, Path(scratch) / f"{kind}-{pair}")
            apart = max(abs(a - b) / abs(b) for a, b in zip(run["study"][2], run["loops"][2]))
            if apart > 1e-6:
                sys.exit(f"the two do not analyse the same: objectives differ by {apart:.1e}")
            measured.append(run)
    costs = [statistics.median(run["loops"][4][k] for run in measured) for k in range(len(points))]
    weights = [cost / statistics.mean(costs) for cost in costs]
    rows, ratios, cpus = [], [], []
    for pair, run in enumerate(measured):
        pair_rows = {
            kind: figures(kind, pair, run[kind][0], run[kind][1], run[kind][3], weights) for kind in ("study", "loops")
        }
        rows += pair_rows.values()
        ratios.append(pair_rows["study"]["designs_per_s"] / pair_rows["loops"]["designs_per_s"])
        cpus.append(pair_rows["study"]["cpu_s_per_design"] / pair_rows["loops"]["cpu_s_per_design"])
    for row in rows:
        print(json.dumps(row))
    told = lambda values: f"median {statistics.median(values):.3f}, {min(values):.3f} to {max(values):.3f}"
    print(f"designs per second until the queue runs dry, study over loops: {told(ratios)} of {len(ratios)}")
    print(f"CPU seconds per design, study over loops: {told(cpus)}")
    for kind in ("study", "loops"):
        tails = [row["tail_s"] for row in rows if row["what"] == kind]
        print(f"tail of the {kind}, s: {told(tails)}")
    with options.csv.open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
