#!/usr/bin/env python3
"""Best areas under the limits: both records, three schedules, free corners against the best pair of rectangles; the same
on elements split 2 by 2, model spread and nine units of each winner.

For each record and schedule runs `examples/asymmetric-bending.toml` (paper's voids and `--random` random designs, each in both
senses), then `examples/rectangles.toml`, two sweeps whose grids are chosen so that they take about the CPU time of the first. Prints a
table and writes it as CSV. A run that has been made is not made again, so the command resumes. Not part of CI; about an hour on
two cores.

    python3 benches/areas/measure.py target/release/salp docs/data/best-areas.csv --out salp-out/areas
"""

import argparse
import csv
import json
import subprocess
import sys
from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "examples"
RECORDS = ["mold-star-30", "mold-star-30-soft"]
SCHEDULES = ["hold", "swap", "overlap"]
# Heights of the sweep, mm; the number of widths follows from the time there is.
HEIGHTS = [6, 12, 18, 24, 28, 31, 33, 35, 36, 37]
LEAST_WIDTH, LARGEST_WIDTH = 6, 76
PILOT_COLUMNS = 6
# Largest violation of a design that counts as within the limits.
TOLERANCE = 3e-3


def run(salp, study, folder, settings):
    report = folder / "report" / "summary.json"
    if not report.exists():
        command = [salp, "run", str(study), "--out", str(folder)]
        for setting in settings:
            command += ["--set", setting]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode not in (0, 1) or not report.exists():
            sys.exit(f"{' '.join(command)}\n{done.stderr}")
    return json.loads(report.read_text())


def solve(salp, folder, *arguments):
    command = [salp, "solve", str(folder / "report" / "best.json"), "--json", *arguments]
    return json.loads(subprocess.run(command, capture_output=True, text=True).stdout)


def kept(file, make):
    if not file.exists():
        file.write_text(json.dumps(make()))
    return json.loads(file.read_text())


def sweep(options, name, common, columns):
    width = (LARGEST_WIDTH - LEAST_WIDTH) / (columns - 1)
    widths = [round(LEAST_WIDTH + k * width, 3) for k in range(columns)]
    grid = f"step[0].optimiser.grid=[{widths}, {HEIGHTS}]"
    return run(options.salp, EXAMPLES / "rectangles.toml", options.out / name, [*common, grid])


def optima_touching(salp, folder):
    """Of the restarts' best designs within the limits: on how many contact acts, and how many there are."""
    result = json.loads((folder / "report" / "result.json").read_text())
    touching = within = 0
    for restart in result["steps"][0]["restarts"]:
        good = [
            entry
            for entry in restart["history"]
            if entry["outcome"] == "ok" and entry["objective"] is not None and max(entry["constraints"]) <= TOLERANCE
        ]
        if not good:
            continue
        x = min(good, key=lambda entry: entry["objective"])["x"]
        corners = [[x[k], x[k + 1]] for k in range(0, 16, 2)]
        chambers = json.dumps([corners[:4], corners[4:]])
        answer = solve(salp, folder, "--set", f"actuator.chambers_mm={chambers}")
        within += 1
        touching += answer["contact"] is not None
    return f"{touching} of {within}"


def percent(part, whole):
    return None if part is None else round(100 * part / abs(whole), 2)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("salp")
    parser.add_argument("csv", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--random", type=int, default=1, help="random starts beside the paper's")
    parser.add_argument("--only", help="only this record")
    parser.add_argument("--numerical-error", action="store_true", help="of each winner: 10 minutes each with contact")
    options = parser.parse_args()
    rows = []
    for record in RECORDS:
        if options.only not in (None, record):
            continue
        for schedule in SCHEDULES:
            common = [f"material={record}", f"actuation.schedule={schedule}"]
            name = f"{record}-{schedule}"
            free = run(
                options.salp,
                EXAMPLES / "asymmetric-bending.toml",
                options.out / name,
                common + [f"step[0].restarts.count={options.random}"],
            )
            # What a pair costs is known from a coarse sweep; the time that is left then goes into a finer one.
            pilot = sweep(options, name + "-pilot", common, PILOT_COLUMNS)
            left = free["cpu_s"] - pilot["cpu_s"]
            columns = max(2, round(left / (pilot["cpu_s"] / PILOT_COLUMNS)))
            pairs = sweep(options, name + "-rectangles", common, columns)
            pairs = {
                "enclosed_area_mm2": max((p["enclosed_area_mm2"] for p in (pilot, pairs)), key=lambda area: abs(area or 0)),
                **{key: pilot[key] + pairs[key] for key in ("evaluations", "restarts", "cpu_s")},
            }
            row = {"record": record, "schedule": schedule}
            for key, summary in [("free", free), ("rectangles", pairs)]:
                row[f"{key}_area_mm2"] = summary.get("enclosed_area_mm2")
                row[f"{key}_evaluations"] = summary["evaluations"]
                row[f"{key}_restarts"] = summary["restarts"]
                row[f"{key}_cpu_s"] = round(summary["cpu_s"], 1)
            row["ratio"] = round(abs(row["free_area_mm2"] / row["rectangles_area_mm2"]), 2)
            folder = options.out / name
            winner = kept(folder / "spread.json", lambda: solve(options.salp, folder, "--model-spread"))
            fine = kept(folder / "fine.json", lambda: solve(options.salp, folder, "--refine", "2"))
            row["split_2_by_2_area_mm2"] = fine["enclosed_area_mm2"]
            if options.numerical_error:
                error = kept(folder / "error.json", lambda: solve(options.salp, folder, "--numerical-error"))
                row["finest_area_mm2"] = error["numerical_error"]["value"]
                row["finest_error_percent"] = error["numerical_error"]["error_percent"]
                row["own_error_percent"] = error["numerical_error"]["own_mesh"]["error_percent"]
            row["optima_with_contact"] = optima_touching(options.salp, options.out / name)
            for beside in winner["companions"]:
                areas = [area["enclosed_area_mm2"] for area in beside["areas"]]
                if beside["kind"] == "model_spread":
                    change = abs(areas[0]) - abs(row["free_area_mm2"]) if areas else None
                    row["model_spread_percent"] = percent(change, row["free_area_mm2"])
                else:
                    row["unit_8_area_mm2"], row["unit_9_area_mm2"] = areas or (None, None)
            print(json.dumps(row), flush=True)
            rows.append(row)
    with options.csv.open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
