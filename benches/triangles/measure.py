#!/usr/bin/env python3
"""Triangles against the block map: CPU time at equal error.

Solves a scene on the meshes of `salp converge` (9-node quadrilaterals of the block map) and on graded triangulations of
the same chambers (6-node triangles from Gmsh, solved as P2 + bubble with discontinuous P1 pressure), with the same path and
tolerance, and prints for both the error of tip and area against the extrapolated reference of `salp converge`, the CPU time
of the solve, and how long the triangulation itself took. Not part of CI.

    pip install gmsh==4.15.2
    python3 benches/triangles/measure.py target/release/salp examples/scenes/chambers-40x15.json [PRESSURE_KPA]

Gmsh is a measuring tool here (GPL); Salp neither ships nor needs it.
"""

import json
import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import gmsh

STEPS = 4
RUNS = 3
QUAD9_SIZES = (10.0, 8.0, 6.0, 4.0, None)
# Size at a chamber's corner (mm), its growth with the distance to the corner, size at a chamber's edge (mm), its growth
# with the distance to the edge, largest size (mm); each is multiplied by the scales.
GRADINGS = {
    "corner": (0.4, 0.5, 4.0, 1.0, 8.0),
    "corner, steep": (0.2, 0.7, 4.0, 1.0, 10.0),
    "corner, edge": (0.4, 0.5, 2.0, 1.0, 8.0),
    "edge": (0.5, 0.5, 1.0, 0.8, 8.0),
}
SCALES = (2.8, 2.0, 1.4, 1.0, 0.7, 0.5)


def run(salp, *arguments):
    """The JSON answer of a command."""
    done = subprocess.run([salp, *map(str, arguments), "--json"], capture_output=True, text=True)
    if not done.stdout.strip():
        raise SystemExit(done.stderr)
    return json.loads(done.stdout)


def distance(p, a, b):
    """Distance of a point to a segment."""
    u = (b[0] - a[0], b[1] - a[1])
    t = ((p[0] - a[0]) * u[0] + (p[1] - a[1]) * u[1]) / (u[0] ** 2 + u[1] ** 2)
    t = min(1.0, max(0.0, t))
    return math.hypot(p[0] - a[0] - t * u[0], p[1] - a[1] - t * u[1])


def triangulate(actuator, grading, scale, file):
    """Writes a triangulation of the chain; CPU seconds of its generation and the number of triangles."""
    corner, corner_growth, edge, edge_growth, largest = grading
    width, height = actuator.get("unit_mm", [80, 80])
    repeat = actuator.get("repeat", 1)
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    gmsh.option.setNumber("Mesh.ElementOrder", 2)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    geo = gmsh.model.geo
    segments = []

    def loop(points):
        tags = [geo.addPoint(x, y, 0) for x, y in points]
        lines = [geo.addLine(a, b) for a, b in zip(tags, tags[1:] + tags[:1])]
        return geo.addCurveLoop(lines), lines

    chambers = actuator["chambers_mm"]
    corners = []
    # A point on the outline between units, so that the probe is a node as it is in the block map.
    rail = [(k * width, 0) for k in range(repeat + 1)] + [(repeat * width, height)]
    rail += [(k * width, height) for k in range(repeat - 1, -1, -1)]
    outline, lines = loop(rail)
    holes, groups = [], [[] for _ in chambers]
    for unit in range(repeat):
        for channel, polygon in enumerate(chambers):
            moved = [(x + unit * width, y) for x, y in polygon]
            corners += moved
            segments += list(zip(moved, moved[1:] + moved[:1]))
            tag, rim = loop(moved)
            holes.append(tag)
            groups[channel] += rim
    solid = geo.addPlaneSurface([outline, *holes])
    geo.synchronize()
    gmsh.model.addPhysicalGroup(1, lines[-1:], name="left")
    for channel, group in enumerate(groups):
        gmsh.model.addPhysicalGroup(1, group, name=f"chamber-{channel}")
    gmsh.model.addPhysicalGroup(2, [solid], name="solid")

    def size(_dim, _tag, x, y, _z, _lc):
        to_corner = min(math.hypot(x - p[0], y - p[1]) for p in corners)
        to_edge = min(distance((x, y), a, b) for a, b in segments)
        wanted = (corner + corner_growth * to_corner, edge + edge_growth * to_edge, largest)
        return scale * min(wanted)

    gmsh.model.mesh.setSizeCallback(size)
    start = time.process_time()
    gmsh.model.mesh.generate(2)
    seconds = time.process_time() - start
    gmsh.write(str(file))
    types, tags, _ = gmsh.model.mesh.getElements(2)
    gmsh.finalize()
    assert list(types) == [9]
    return seconds, len(tags[0])


def on_triangles(scene, file):
    """The scene with a mesh file instead of an actuator."""
    actuator = scene["actuator"]
    moved = {k: v for k, v in scene.items() if k not in ("actuator", "mesh")}
    channels = range(len(actuator["chambers_mm"]))
    moved["mesh_file"] = file.name
    moved["supports"] = [{"group": "left", "fix": ["x", "y"]}]
    moved["pressures"] = [{"group": f"chamber-{c}", "channel": c} for c in channels]
    return moved


def errors(answer, reference, steps):
    """Relative errors of tip and area of an answer, as `salp converge` measures them."""
    corners = [s["displacement_mm"]["tip"] for s in answer["path"][::steps][1:]]
    largest = max(math.hypot(*p) for p in reference["tip_mm"])
    tip = max(math.dist(p, q) for p, q in zip(corners, reference["tip_mm"][-len(corners):])) / largest
    area = abs(answer["objective"] / -reference["area_mm2"])
    return tip, abs(area - 1.0)


def quickest(salp, scene, file):
    """The answer of a scene with the least CPU time of a few runs."""
    file.write_text(json.dumps(scene))
    answers = [run(salp, "solve", file) for _ in range(RUNS)]
    return min(answers, key=lambda a: a["seconds"]["cpu"])


def row(name, answer, error, triangulation):
    """A row of the table."""
    mesh = answer["mesh"]
    return (name, mesh["elements"], mesh["dofs"], *error, answer["seconds"]["cpu"], triangulation)


def main():
    salp, scene_file, *pressure = sys.argv[1:]
    scene = json.loads(Path(scene_file).read_text())
    scene["actuation"]["load_steps_per_leg"] = STEPS
    if pressure:
        scene["actuation"]["pressure_kpa"] = float(pressure[0])
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "scene.json").write_text(json.dumps(scene))
        found = run(salp, "converge", folder / "scene.json", "--out", folder / "converge")
        reference = found["reference"]
        print(f"reference: {json.dumps(reference)}")
        rows = []
        for size in QUAD9_SIZES:
            quads = {**scene, "mesh": {"element": "quad9", "max_size_mm": size}}
            answer = quickest(salp, quads, folder / "quads.json")
            name = "quad9 " + (f"{size} mm" if size else "size rule")
            rows.append(row(name, answer, errors(answer, reference, STEPS), 0.0))
        for r in found["runs"]:
            if r["family"] == "reference" and r["refined"] == 2:
                name = "quad9 size rule / 2"
                rows.append((name, r["elements"], r["dofs"], r["tip_error"], r["area_error"], r["cpu_s"], 0.0))
        for name, grading in GRADINGS.items():
            for scale in SCALES:
                file = folder / "mesh.msh"
                seconds, triangles = triangulate(scene["actuator"], grading, scale, file)
                answer = quickest(salp, on_triangles(scene, file), folder / "mesh.json")
                name_here = f"tri7 {name} x {scale}"
                if answer["status"] != "ok":
                    print(f"{name_here}: {triangles} triangles, {answer['status']}")
                    continue
                rows.append(row(name_here, answer, errors(answer, reference, STEPS), seconds))
        print("| mesh | elements | unknowns | tip | area | CPU s | triangulation s |")
        print("|---|---|---|---|---|---|---|")
        for name, elements, dofs, tip, area, cpu, mesh in rows:
            print(f"| {name} | {elements} | {dofs} | {100 * tip:.2f} % | {100 * area:.2f} % | {cpu:.2f} | {mesh:.2f} |")


if __name__ == "__main__":
    main()
