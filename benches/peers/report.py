"""Tables and the picture of a comparison."""

import math
from pathlib import Path
from statistics import median

from polygon import enclosed_area

COLOURS = {"salp": "#c0392b", "dolfinx": "#2471a3", "ngsolve": "#1e8449", "felupe": "#8e44ad"}
COLUMNS = [
    "package",
    "unknowns",
    "Newton steps",
    "inserted",
    "failed",
    "CPU s (runs)",
    "of Salp's",
    "process CPU s",
    "tip, area against Salp",
    "tip, area error",
]
WIDTH, HEIGHT, LEFT, BOTTOM, TOP = 560, 380, 70, 50, 30


def processor():
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return "unknown"


def progress(name, mesh, ours, theirs):
    said = f"{theirs['cpu_s']:.2f} CPU s" if theirs["status"] == "ok" else f"{theirs['status']}: {theirs['reason']}"
    return f"{name} {mesh}: salp {ours['seconds']['cpu']:.2f} CPU s, {theirs['package']} {theirs['form']} {said}"


def distance(a, b):
    return math.hypot(a[0] - b[0], a[1] - b[1])


def errors(tips, corners, reference):
    """Relative errors of the tip, over the corners of the schedule, and of the enclosed area."""
    largest = max(math.hypot(*t) for t in reference["tip_mm"])
    tip = max(distance(tips[i], t) for i, t in zip(corners, reference["tip_mm"])) / largest
    area = abs(enclosed_area(tips) / reference["area_mm2"] - 1)
    return {"tip_error": tip, "area_error": area}


def compare(name, mesh, settings, reference, ours, theirs):
    """One mesh: medians, ratios, agreement with Salp on the same mesh, errors against the reference."""
    first = ours[0]
    tips = [s["displacement_mm"]["tip"] for s in first["path"]]
    corners = [i for i, s in enumerate(first["path"]) if s["fraction"] == 1.0]
    cpu = median(a["seconds"]["cpu"] for a in ours)
    rows = [
        {
            "package": "salp",
            "form": first["mesh"]["element"],
            "status": first["status"],
            "runs": len(ours),
            "cpu_s": cpu,
            "process_cpu_s": median(a["process_cpu_s"] for a in ours),
            "unknowns": first["mesh"]["dofs"],
            "newton_iterations": first["work"]["newton_iterations"],
            "inserted_states": first["work"]["inserted_states"],
            "ratio": 1.0,
        }
        | errors(tips, corners, reference)
    ]
    for (package, form), runs in theirs.items():
        row = {"package": package, "form": form, "runs": len(runs)} | {k: v for k, v in runs[0].items() if k != "path"}
        if row["status"] == "ok":
            row["cpu_s"] = median(r["cpu_s"] for r in runs)
            row["process_cpu_s"] = median(r["process_cpu_s"] for r in runs)
            row["ratio"] = row["cpu_s"] / cpu
            found = [s["tip"] for s in runs[0]["path"]]
            largest = max(math.hypot(*t) for t in tips)
            row["tip_against_salp"] = max(distance(a, b) for a, b in zip(found, tips)) / largest
            row["area_against_salp"] = abs(enclosed_area(found) / enclosed_area(tips) - 1)
            row |= errors(found, corners, reference)
        rows.append(row)
    return {
        "scene": name,
        "mesh": mesh,
        "settings": settings,
        "elements": first["mesh"]["elements"],
        "salp_cpu_s": [a["seconds"]["cpu"] for a in ours],
        "reference": reference,
        "rows": rows,
    }


def tables(document):
    """Markdown."""
    versions, solvers = {}, {}
    for result in document["results"]:
        for row in result["rows"]:
            versions |= row.get("versions", {})
            if "solver" in row:
                solvers[f"{row['package']} {row['form']}"] = f"{row['element']}; {row['solver']}"
    out = [f"{document['salp']}; " + ", ".join(f"{k} {v}" for k, v in versions.items())]
    out.append(f"{document['machine']['processor']}, one thread\n")
    out += [f"- {k}: {v}" for k, v in solvers.items()]
    for result in document["results"]:
        out.append(f"\n{result['scene']}, {result['mesh']}: {result['elements']} elements ({' '.join(result['settings'])})\n")
        out.append(f"| {' | '.join(COLUMNS)} |\n{'|---' * len(COLUMNS)}|")
        out += [line(row) for row in result["rows"]]
    return "\n".join(out) + "\n"


def line(row):
    name = f"{row['package']} {row['form']}"
    if row["status"] != "ok":
        return f"| {name} | {row.get('unknowns', '')} | {row['status']}: {row.get('reason', '')} {'|' * (len(COLUMNS) - 2)}"
    agreement = "" if row["package"] == "salp" else f"{row['tip_against_salp']:.1e}, {row['area_against_salp']:.1e}"
    cells = [
        name,
        row["unknowns"],
        row["newton_iterations"],
        row["inserted_states"],
        row.get("failed_steps", ""),
        f"{row['cpu_s']:.3g} ({row['runs']})",
        f"{row['ratio']:.1f}",
        f"{row['process_cpu_s']:.3g}",
        agreement,
        f"{100 * row['tip_error']:.2f} %, {100 * row['area_error']:.2f} %",
    ]
    return "| " + " | ".join(map(str, cells)) + " |"


def picture(results):
    """CPU seconds against the error of the enclosed area, one panel a scene, log-log."""
    panels = []
    for scene in dict.fromkeys(r["scene"] for r in results):
        rows = [
            row | {"mesh": r["mesh"]}
            for r in results
            if r["scene"] == scene and r["mesh"] != "recommended"
            for row in r["rows"]
            if row["status"] == "ok"
        ]
        if rows:
            panels.append(panel(scene, rows, HEIGHT * len(panels)))
    height = HEIGHT * len(panels)
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" font-size="11">'
    return "\n".join([head, f'<rect width="{WIDTH}" height="{height}" fill="white"/>', *panels, "</svg>"]) + "\n"


def decades(values):
    return math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))


def panel(scene, rows, top):
    x0, x1 = decades([r["cpu_s"] for r in rows])
    y0, y1 = decades([100 * r["area_error"] for r in rows])
    right, bottom = WIDTH - 20, HEIGHT - BOTTOM

    def x(value):
        return LEFT + (math.log10(value) - x0) / (x1 - x0) * (right - LEFT)

    def y(value):
        return bottom - (math.log10(value) - y0) / (y1 - y0) * (bottom - TOP)

    title = f"{scene}: overlap, 4 steps a leg, 1e-8, one thread"
    out = [f'<g transform="translate(0,{top})">', f'<text x="{LEFT}" y="18" font-size="13">{title}</text>']
    for k in range(x0, x1 + 1):
        out.append(f'<line x1="{x(10.0**k):.1f}" x2="{x(10.0**k):.1f}" y1="{TOP}" y2="{bottom}" stroke="#ddd"/>')
        out.append(f'<text x="{x(10.0**k):.1f}" y="{bottom + 16}" text-anchor="middle">{10.0**k:g}</text>')
    for k in range(y0, y1 + 1):
        out.append(f'<line x1="{LEFT}" x2="{right}" y1="{y(10.0**k):.1f}" y2="{y(10.0**k):.1f}" stroke="#ddd"/>')
        out.append(f'<text x="{LEFT - 6}" y="{y(10.0**k) + 4:.1f}" text-anchor="end">{10.0**k:g} %</text>')
    out.append(f'<text x="{(LEFT + right) / 2}" y="{HEIGHT - 14}" text-anchor="middle">CPU s of the load path</text>')
    out.append(f'<text transform="translate(16,{(TOP + bottom) / 2}) rotate(-90)" text-anchor="middle">error of the enclosed area</text>')
    for row in rows:
        colour, at = COLOURS[row["package"]], (x(row["cpu_s"]), y(100 * row["area_error"]))
        if row["mesh"].startswith("quad9"):
            mark = f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="4" fill="{colour}"/>'
        else:
            mark = f'<rect x="{at[0] - 4:.1f}" y="{at[1] - 4:.1f}" width="8" height="8" fill="none" stroke="{colour}" stroke-width="2"/>'
        out.append(f"<g><title>{row['package']} {row['form']}, {row['mesh']}: {row['cpu_s']:.3g} CPU s</title>{mark}</g>")
    legend = [*COLOURS.items(), ("\u25cf quad9  \u25a1 quad4", "black")]
    for i, (text, colour) in enumerate(reversed(legend)):
        out.append(f'<text x="{LEFT + 10}" y="{bottom - 10 - 15 * i}" fill="{colour}">{text}</text>')
    return "\n".join([*out, "</g>"])
