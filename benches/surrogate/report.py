#!/usr/bin/env python3
"""Rank correlation and sign agreement of few units with nine, from the CSV of `measure.py`: a table on standard output, a picture.

Signs are compared where both areas are larger than their error: that of the map's interpolation, which the CSV has, and that of the
mesh, `--mesh-error` times the square of the tip's largest displacement. Designs count where every chain that was solved of them has a
complete and unique map.

    python3 benches/surrogate/report.py docs/data/surrogate.csv docs/images/surrogate.svg [--units 5]
"""

import argparse
import csv
import math
from pathlib import Path

SCHEDULES = ["hold", "swap", "overlap"]
TIPS = {"tip": "x = 640", "end": "x = 720"}
STRATA = {"uniform": "#0072b2", "near_bounds": "#d55e00", "met": "#009e73"}
# Areas of few units that count as large, mm^2.
LARGE = 10.0
# Largest averaged stretch of mold-star-30 in the default study.
STRETCH_LIMIT = 1.85


def read(file):
    """Per design and number of units, its line."""
    with open(file) as lines:
        rows = list(csv.DictReader(lines))
    found = {}
    for row in rows:
        found.setdefault(int(row["design"]), {})[int(row["units"])] = row
    return found


def feasible(lines):
    return 9 in lines and all(l["status"] == "ok" and l["unique"] == "True" for n, l in lines.items() if n > 1)


def area(line, schedule, probe, mesh_error):
    """Area and its error."""
    name = f"{schedule}_{probe}"
    by_mesh = mesh_error * float(line["reach_mm"]) ** 2
    return float(line[f"{name}_mm2"]), float(line[f"{name}_error_mm2"]) + by_mesh


def ranks(values):
    order = sorted(range(len(values)), key=values.__getitem__)
    out, i = [0.0] * len(values), 0
    while i < len(order):
        j = i
        while j + 1 < len(order) and values[order[j + 1]] == values[order[i]]:
            j += 1
        for k in order[i : j + 1]:
            out[k] = (i + j) / 2
        i = j + 1
    return out


def spearman(a, b):
    a, b = ranks(a), ranks(b)
    mean_a, mean_b = sum(a) / len(a), sum(b) / len(b)
    both = sum((x - mean_a) * (y - mean_b) for x, y in zip(a, b))
    return both / math.sqrt(sum((x - mean_a) ** 2 for x in a) * sum((y - mean_b) ** 2 for y in b))


def kendall(a, b):
    """Tau b."""
    sign = lambda v: (v > 0) - (v < 0)
    both = ties_a = ties_b = 0
    pairs = len(a) * (len(a) - 1) // 2
    for i in range(len(a)):
        for j in range(i):
            x, y = sign(a[i] - a[j]), sign(b[i] - b[j])
            both += x * y
            ties_a += x == 0
            ties_b += y == 0
    return both / math.sqrt((pairs - ties_a) * (pairs - ties_b))


def compared(designs, units, schedule, probe, mesh_error):
    """Pairs of areas: few units, nine, whether both are known well enough for their signs, stratum."""
    pairs = []
    for lines in designs.values():
        few, its_error = area(lines[units], schedule, "tip", mesh_error)
        nine, nine_error = area(lines[9], schedule, probe, mesh_error)
        known = abs(few) > its_error and abs(nine) > nine_error
        pairs.append((few, nine, known, lines[9]["stratum"]))
    return pairs


def wilson(hits, count):
    """95 % interval of a share."""
    z, share = 1.96, hits / count
    middle = (share + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    return middle - half, middle + half


def table(designs, units, mesh_error):
    print("| schedule | nine units at | Spearman | Kendall | sign agrees | 95 % interval | of areas above 10 mm\u00b2 |")
    print("|---|---|---|---|---|---|---|")
    for schedule in SCHEDULES:
        for probe, where in TIPS.items():
            pairs = compared(designs, units, schedule, probe, mesh_error)
            few, nine = [p[0] for p in pairs], [p[1] for p in pairs]
            known = [p for p in pairs if p[2]]
            hits = sum(p[0] * p[1] > 0 for p in known)
            low, high = wilson(hits, len(known))
            large = [p for p in known if abs(p[0]) > LARGE]
            of_large = sum(p[0] * p[1] > 0 for p in large)
            print(
                f"| `{schedule}` | {where} | {spearman(few, nine):.3f} | {kendall(few, nine):.3f} "
                f"| {100 * hits / len(known):.1f} % ({hits} of {len(known)}) | {100 * low:.1f} to {100 * high:.1f} % "
                f"| {100 * of_large / max(len(large), 1):.1f} % ({of_large} of {len(large)}) |"
            )


def place(value, unit):
    """Signed logarithm, linear within one unit."""
    return math.copysign(math.log10(1 + abs(value) / unit), value)


def picture(designs, units, mesh_error):
    side, left, top, gap = 260, 80, 70, 70
    width, height = left + 3 * (side + gap) - gap + 30, top + 2 * (side + gap) + 50
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" role="img" '
        "font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\">",
        f"<title>Areas of {units} units against nine</title>",
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
    ]
    text = lambda x, y, size, anchor, words, more="": out.append(
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}" fill="#222222" {more}>{words}</text>'
    )
    for column, schedule in enumerate(SCHEDULES):
        for row, (probe, where) in enumerate(TIPS.items()):
            x0, y0 = left + column * (side + gap), top + row * (side + gap)
            pairs = compared(designs, units, schedule, probe, mesh_error)
            scale = (1e-2, 1.0)
            reach = [max(abs(place(p[k], scale[k])) for p in pairs) * 1.05 for k in (0, 1)]
            at = lambda few, nine: (
                x0 + side / 2 * (1 + place(few, scale[0]) / reach[0]),
                y0 + side / 2 * (1 - place(nine, scale[1]) / reach[1]),
            )
            for few, nine in [(1, 1), (-1, -1)]:
                x, y = at(0, 0)
                cx, cy = min(x, x + few * side / 2), min(y, y - nine * side / 2)
                out.append(f'<rect x="{cx:.1f}" y="{cy:.1f}" width="{side / 2}" height="{side / 2}" fill="#f3f7f3"/>')
            for k in (0, 1):
                power = 0
                while place(10**power * scale[k], scale[k]) < reach[k]:
                    for value in (10**power * scale[k], -(10**power) * scale[k]):
                        x, y = at(value, 0) if k == 0 else at(0, value)
                        if k == 0:
                            out.append(f'<path d="M{x:.1f} {y0}V{y0 + side}" stroke="#e6e6e6"/>')
                        else:
                            out.append(f'<path d="M{x0} {y:.1f}H{x0 + side}" stroke="#e6e6e6"/>')
                        if power % 2 == 0 and power > 0:
                            label = f"{value:g}".replace("-", "\u2212")
                            if k == 0:
                                text(x, y0 + side + 14, 10, "middle", label)
                            else:
                                text(x0 - 5, y + 3, 10, "end", label)
                    power += 1
            x, y = at(0, 0)
            out.append(f'<path d="M{x:.1f} {y0}V{y0 + side}M{x0} {y:.1f}H{x0 + side}" stroke="#888888"/>')
            text(x, y0 + side + 14, 10, "middle", "0")
            text(x0 - 5, y + 3, 10, "end", "0")
            for few, nine, known, stratum in sorted(pairs, key=lambda p: p[2] and p[0] * p[1] < 0):
                x, y = at(few, nine)
                wrong = ' stroke="#000000" stroke-width="1.2"' if known and few * nine < 0 else ""
                faint = "0.75" if known else "0.25"
                out.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.6" fill="{STRATA[stratum]}" fill-opacity="{faint}"{wrong}/>')
            out.append(f'<rect x="{x0}" y="{y0}" width="{side}" height="{side}" fill="none" stroke="#444444"/>')
            if row == 0:
                text(x0 + side / 2, y0 - 10, 13, "middle", schedule, 'font-weight="bold"')
            text(x0 + side / 2, y0 + side + 30, 11, "middle", f"{units} units (mm\u00b2)")
            turn = f'transform="rotate(-90 {x0 - 42} {y0 + side / 2})"'
            text(x0 - 42, y0 + side / 2, 11, "middle", f"nine units, {where} mm (mm\u00b2)", turn)
    text(left, 28, 15, "start", f"Areas of {units} units against nine, {len(designs)} designs", 'font-weight="bold"')
    x = left
    names = {"uniform": "uniform in the boxes", "near_bounds": "near the outer edges", "met": "met by optimisers"}
    for stratum, colour in STRATA.items():
        out.append(f'<circle cx="{x + 5}" cy="{height - 36}" r="4" fill="{colour}"/>')
        text(x + 14, height - 32, 11, "start", names[stratum])
        x += 30 + 7 * len(names[stratum])
    text(left, height - 12, 11, "start", "black ring: other sign; faint: smaller than its error; logarithmic from the first grid line on")
    return "\n".join([*out, "</svg>", ""])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("csv")
    parser.add_argument("svg", type=Path)
    parser.add_argument("--units", type=int, default=3)
    parser.add_argument("--mesh-error", type=float, default=3e-3)
    options = parser.parse_args()
    everything = read(options.csv)
    designs = {i: d for i, d in everything.items() if feasible(d) and options.units in d}
    within = {i: d for i, d in designs.items() if 1 in d and float(d[1]["max_stretch"]) <= STRETCH_LIMIT}
    counts = lambda d: ", ".join(f"{sum(l[9]['stratum'] == s for l in d.values())} {s}" for s in STRATA)
    print(f"{len(everything)} designs, {len(designs)} feasible ({counts(designs)})\n")
    table(designs, options.units, options.mesh_error)
    for stratum in STRATA:
        of_stratum = {i: d for i, d in designs.items() if d[9]["stratum"] == stratum}
        print(f"\n{stratum}\n")
        table(of_stratum, options.units, options.mesh_error)
    print(f"\nwithin the stretch limit {STRETCH_LIMIT}: {len(within)} ({counts(within)})\n")
    table(within, options.units, options.mesh_error)
    print(f"\n{sum(float(l['cpu_s']) for d in everything.values() for l in d.values()):.0f} CPU s")
    options.svg.write_text(picture(designs, options.units, options.mesh_error))


if __name__ == "__main__":
    main()
