#!/usr/bin/env python3
"""Does the averaged stretch depend on the mesh, and how much does the raw maximum?

Solves ten designs of one unit (five named scenes, five random pairs of chambers of which at least three have a non-convex
one) on the mesh of the size rule (0.4 mm at the corners of chambers) and on three finer ones: elements of at most 1 mm (0.5 mm
at the corners), 0.7 mm and 0.5 mm. Prints the largest averaged stretch and the largest at a quadrature point over the path,
and writes both as CSV and as a picture. Not part of CI; eight CPU minutes.

    python3 benches/stretch/measure.py target/release/salp docs/data/stretch-meshes.csv docs/images/stretch-meshes.svg
"""

import csv
import json
import random
import subprocess
import sys
import tempfile
from pathlib import Path

NAMED = ["chambers-40x15", "chambers-60x25", "bellows-50x37", "slanted", "trapezia-wide-inside"]
MESHES = ["null", "1", "0.7", "0.5"]
SCENES = Path(__file__).parents[2] / "examples" / "scenes"
SEED = 20230328


def chamber(rng, low, high):
    """A quadrilateral with one corner in each quadrant of a domain, 0.5 mm off its centre lines."""
    cx, cy = (2 + 78) / 2, (low + high) / 2
    x = [rng.uniform(*side) for side in [(2, cx - 0.5), (cx + 0.5, 78), (cx + 0.5, 78), (2, cx - 0.5)]]
    y = [rng.uniform(*side) for side in [(low, cy - 0.5), (low, cy - 0.5), (cy + 0.5, high), (cy + 0.5, high)]]
    return [list(p) for p in zip(x, y)]


def angles(corners):
    """Turn (cross product) and the cosine between the rays at each corner."""
    found = []
    for k, (x, y) in enumerate(corners):
        (ax, ay), (bx, by) = corners[k - 1], corners[(k + 1) % 4]
        u, v = (bx - x, by - y), (ax - x, ay - y)
        lengths = (u[0] ** 2 + u[1] ** 2) ** 0.5 * (v[0] ** 2 + v[1] ** 2) ** 0.5
        found.append((u[0] * v[1] - u[1] * v[0], (u[0] * v[0] + u[1] * v[1]) / lengths))
    return found


def designs():
    for name in NAMED:
        yield name, json.loads((SCENES / f"{name}.json").read_text())["actuator"]["chambers_mm"], "named"
    rng, plain, bent = random.Random(SEED), 0, 0
    while plain + bent < 5:
        pair = [chamber(rng, 2, 39), chamber(rng, 41, 78)]
        all_angles = [a for c in pair for a in angles(c)]
        if max(cosine for _, cosine in all_angles) > 0.96:
            continue  # a corner of less than 16 degrees
        non_convex = any(turn < 0 for turn, _ in all_angles)
        if not non_convex and plain == 2:
            continue
        plain, bent = plain + (not non_convex), bent + non_convex
        kind = "non-convex" if non_convex else "convex"
        yield f"random {plain + bent}", pair, kind


def solve(salp, chambers, size):
    scene = {
        "version": 1,
        "actuator": {"chambers_mm": chambers},
        "material": "mold-star-30",
        "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 2},
        "mesh": {"element": "quad9", "max_size_mm": json.loads(size)},
        "contact": "off",
        "probes": {"tip": [80, 40]},
    }
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        file.write(json.dumps(scene))
        file.flush()
        run = subprocess.run([salp, "solve", file.name, "--json"], capture_output=True, text=True)
    if run.returncode not in (0, 1):
        sys.exit(run.stderr)
    return json.loads(run.stdout)


def picture(rows):
    """Two panels: averaged and raw stretch over their value on the last mesh, a line a design."""
    series = {}
    for row in rows:
        series.setdefault(row["design"], []).append(row)
    colours = ["#1b6ca8", "#d1495b", "#66a182", "#edae49", "#775dd0", "#00798c", "#8d6a9f", "#a44a3f", "#3d3d3d", "#b0b0b0"]
    out = ['<svg xmlns="http://www.w3.org/2000/svg" width="760" height="400" font-family="sans-serif" font-size="12">',
           '<rect width="760" height="400" fill="white"/>']
    values = [row[k] / series[row["design"]][-1][k] - 1 for row in rows for k in ("averaged", "raw")]
    low, high = min(values + [-0.02]), max(values + [0.02])
    span = (high - low) * 1.1
    for panel, (key, title) in enumerate([("averaged", "averaged over discs of 0.5 mm"), ("raw", "at quadrature points")]):
        left, top, width, height = 70 + 260 * panel, 40, 200, 290
        at = lambda k, v: (left + width * (0.08 + 0.28 * k), top + height * (1 - (v - low + 0.05 * span) / span))
        out.append(f'<text x="{left}" y="25">{title}</text><rect x="{left}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#888"/>')
        for bound in (-0.02, 0.02):
            y = at(0, bound)[1]
            out.append(f'<line x1="{left}" x2="{left + width}" y1="{y:.1f}" y2="{y:.1f}" stroke="#888" stroke-dasharray="4 3"/>')
            out.append(f'<text x="{left - 4}" y="{y + 4:.1f}" text-anchor="end">{100 * bound:+.0f} %</text>')
        for v in (low, high):
            y = at(0, v)[1]
            out.append(f'<text x="{left - 4}" y="{y + 4:.1f}" text-anchor="end">{100 * v:+.0f} %</text>')
        for k, mesh in enumerate(["rule", "1 mm", "0.7", "0.5"]):
            out.append(f'<text x="{at(k, 0)[0]:.1f}" y="{top + height + 16}" text-anchor="middle">{mesh}</text>')
        for n, (name, own) in enumerate(series.items()):
            points = " ".join("{:.1f},{:.1f}".format(*at(k, r[key] / own[-1][key] - 1)) for k, r in enumerate(own))
            out.append(f'<polyline points="{points}" fill="none" stroke="{colours[n]}" stroke-width="2"/>')
    for n, name in enumerate(series):
        y = 55 + 22 * n
        out.append(f'<line x1="560" x2="580" y1="{y}" y2="{y}" stroke="{colours[n]}" stroke-width="2"/><text x="586" y="{y + 4}">{name}</text>')
    out.append('<text x="70" y="380">change of the largest principal stretch of the path against that on the mesh of 0.5 mm; dashed: 2 %</text></svg>')
    return "\n".join(out) + "\n"


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    salp, table, svg = sys.argv[1:]
    rows = []
    for name, chambers, kind in designs():
        for size in MESHES:
            answer = solve(salp, chambers, size)
            if answer["status"] != "ok":
                print(f"{name}: {answer['status']} on a mesh of {size} mm")
                break
            rows.append({
                "design": name, "kind": kind, "max_size_mm": "rule" if size == "null" else size,
                "elements": answer["mesh"]["elements"],
                "averaged": max(s["max_stretch"] for s in answer["path"]),
                "raw": max(s["max_stretch_raw"] for s in answer["path"]),
            })
            print(rows[-1], flush=True)
    Path(table).parent.mkdir(parents=True, exist_ok=True)
    with open(table, "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    Path(svg).write_text(picture(rows))


if __name__ == "__main__":
    main()
