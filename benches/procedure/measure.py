#!/usr/bin/env python3
"""What does the paper's own procedure cost, against Salp's, both by Salp, on one core in one run?

The paper's procedure: forward differences (n + 1 analyses a gradient), `quad4` elements of 0.9 mm on average, residual tolerance
0.1, ten equal states a leg, MMFD by DOT's published rules. Salp's: the adjoint, `quad9` by the size rule, 1e-8, eight graded states,
GCMMA, with stretch limit and load margin. Contact on in both.

1. Cost of one evaluation: a study of one given start and a budget of one evaluation for each procedure, three units with 16 variables
   and nine with 144, at two designs: rectangles of 40 x 15 mm, and the design of --design (a scene, such as a report's best.json).
2. How many evaluations each optimiser needs from the common start (voids of 1 x 1 mm) to come within 2 % of what the weaker of the
   two finds under the limits, counted with exact gradients on elements of at most --size mm: MMFD with differences would need n
   analyses more for each of its gradients.
3. Their product is what the procedures would cost. That is an inference: no run of the paper's procedure to its end is part of it, and
   its differences of states converged to 0.1 are noise that this count forgives.

Writes JSON and prints tables in Markdown. Resumes. Not part of CI.

    python3 benches/procedure/measure.py target/release/salp --design best.json --out salp-out/procedure
"""

import argparse
import csv
import json
import subprocess
import sys
from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "examples"
RECTANGLES = [20, 13, 60, 13, 60, 28, 20, 28, 20, 52, 60, 52, 60, 67, 20, 67]
PAPER_MODEL = {"element": "quad4", "mean_size_mm": 0.9, "relative_residual_force_tolerance": 0.1, "contact": "auto"}
HOLD = [[0, 0], [15, 0], [15, 15], [0, 0]]


def paper(units):
    """The paper's procedure on three or nine units."""
    direct = units == 9
    step = {"id": "three-units", "target": {"kind": "enclosed_area", "probe_mm": [640 if direct else 160, 40], "orientation": "clockwise"}}
    if direct:
        step |= {"level": 1, "model": {"kind": "fe_direct", **PAPER_MODEL}}
    return {"preset": "paper", "name": f"paper-{units}", "actuator": {"units": units}, "actuation": {"schedule": HOLD}, "step": [step]}


def run(salp, out, study, settings):
    """The folder of a study that has run."""
    if not (out / "report" / "ledger.csv").exists():
        out.mkdir(parents=True, exist_ok=True)
        if isinstance(study, dict):
            file = out / "study.json"
            file.write_text(json.dumps(study))
            study = file
        command = [salp, "run", str(study), "--out", str(out), "--workers", "1", "--set", "error_bands=false"]
        for setting in settings:
            command += ["--set", setting]
        done = subprocess.run(command, capture_output=True, text=True)
        if not (out / "report" / "ledger.csv").exists():
            sys.exit(f"{' '.join(command)}\n{done.stdout}\n{done.stderr}")
    return out / "report"


def ledger(report):
    with open(report / "ledger.csv") as file:
        return list(csv.DictReader(file))


def costs(salp, out, designs):
    """CPU seconds of one evaluation, by number of units, procedure and design."""
    table = {}
    for units in (3, 9):
        ours = EXAMPLES / ("asymmetric-bending.toml" if units == 3 else "direct.toml")
        for procedure, study in (("salp", ours), ("paper", paper(units))):
            for name, x in designs.items():
                points = json.dumps([x if units == 3 else x * 9])
                report = run(
                    salp,
                    out / f"cost-{procedure}-{units}-{name}",
                    study,
                    [
                        f'step[0].restarts={{"start": "given", "points": {points}}}',
                        "step[0].budget.evaluations=1",
                        "step[0].target.orientation=clockwise",
                        'step[0].constraints.wall_gap_mm="off"',
                    ],
                )
                row = ledger(report)[0]
                table[f"{procedure}-{units}-{name}"] = {"cpu_s": float(row["cpu_s"]), "status": row["status"], "objective": row["objective"]}
    return table


def counts(salp, out, size, iterations, of_units):
    """Trials and gradients that each optimiser needs, by number of units."""
    table = {}
    for units in of_units:
        study = EXAMPLES / ("asymmetric-bending.toml" if units == 3 else "direct.toml")
        histories = {}
        for method in ("gcmma", "mmfd"):
            options = {"method": method, "gradient": "model", "max_iterations": iterations}
            report = run(
                salp,
                out / f"count-{method}-{units}",
                study,
                [
                    f"step[0].optimiser={json.dumps(options)}",
                    'step[0].restarts={"start": "paper"}',
                    f"step[0].model.max_size_mm={size}",
                    "step[0].target.orientation=clockwise",
                    'step[0].constraints.wall_gap_mm="off"',
                    "actuation.load_steps_per_leg=4",
                ],
            )
            result = json.loads((report / "result.json").read_text())
            rows = ledger(report)
            feasible = [(r["feasible"] == "true" and r["status"] == "ok", float(r["objective"] or 0)) for r in rows]
            histories[method] = (rows, feasible, result["steps"][0]["restarts"][0])
        # What the weaker of the two comes to, so that both have come there.
        reached = {method: min(o for ok, o in feasible if ok) for method, (_, feasible, _) in histories.items()}
        aim = 0.98 * max(reached.values())
        for method, (rows, feasible, restart) in histories.items():
            there = next(i for i, (ok, o) in enumerate(feasible) if ok and o <= aim)
            until = rows[: there + 1]
            table[f"{method}-{units}"] = {
                "best": reached[method],
                "aim": aim,
                "stop": restart.get("stop_reason"),
                "evaluations": len(until),
                "gradients": len({r["iteration"] for r in until}),
                "cpu_s": sum(float(r["cpu_s"]) for r in until),
            }
    return table


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("salp")
    parser.add_argument("--design", required=True)
    parser.add_argument("--out", default="salp-out/procedure")
    parser.add_argument("--size", type=float, default=16)
    parser.add_argument("--iterations", type=int, default=40)
    parser.add_argument("--units", type=int, nargs="+", default=[3, 9], help="of the counts; nine units take an hour")
    options = parser.parse_args()
    out = Path(options.out)
    unit = json.loads(Path(options.design).read_text())["actuator"]["chambers_mm"]
    designs = {"rectangles": RECTANGLES, "winner": [v for chamber in unit for point in chamber for v in point]}
    cost = costs(options.salp, out, designs)
    count = counts(options.salp, out, options.size, options.iterations, options.units)
    answer = {"cost": cost, "count": count, "size_mm": options.size}
    (out / "procedure.json").write_text(json.dumps(answer, indent=1))

    print("| units, variables | design | Salp, CPU s an evaluation with gradient | the paper's, CPU s an analysis | a gradient, ratio |\n|---|---|---|---|---|")
    for units, n in ((3, 16), (9, 144)):
        for name in designs:
            a, b = cost[f"salp-{units}-{name}"], cost[f"paper-{units}-{name}"]
            print(f"| {units}, {n} | {name} | {a['cpu_s']:.2f} ({a['status']}) | {b['cpu_s']:.1f} ({b['status']}) | {(n + 1) * b['cpu_s'] / a['cpu_s']:.0f} |")
    print("\n| units, variables | optimiser | best, mm² | aim | evaluations | gradients | analyses with differences | CPU s, inferred at the winner | ratio |\n|---|---|---|---|---|---|---|---|---|")
    for units, n in ((3, 16), (9, 144)):
        if units not in options.units:
            continue
        inferred = {}
        for method, procedure in (("gcmma", "salp"), ("mmfd", "paper")):
            c = count[f"{method}-{units}"]
            analyses = c["evaluations"] + (n * c["gradients"] if procedure == "paper" else 0)
            inferred[method] = analyses * cost[f"{procedure}-{units}-winner"]["cpu_s"]
            ratio = inferred[method] / inferred["gcmma"]
            print(f"| {units}, {n} | {method} | {c['best']:.4g} | {c['aim']:.4g} | {c['evaluations']} | {c['gradients']} | {analyses} | {inferred[method]:.0f} | {ratio:.0f} |")


if __name__ == "__main__":
    main()
