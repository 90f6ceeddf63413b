#!/usr/bin/env python3
"""Measures Salp against FElupe, NGSolve and dolfinx: same mesh, material, load path and tolerance, one thread.

Run it from the repository after `cargo build --release`. Everything that it makes goes to `target/peers`: an environment
with FElupe and NGSolve, the cases, `results.json`, `table.md`, `error-against-time.svg`. dolfinx is Debian's:
`apt-get install python3-dolfinx`. NGSolve compiles its energies with `c++`.
"""

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
from pathlib import Path

import report

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
WORK = ROOT / "target" / "peers"
SCENES = ["chambers-40x15", "bellows-50x37"]
PATH_OF_LOADS = ["actuation.schedule=overlap", "actuation.load_steps_per_leg=4"]
ONE_THREAD = {
    name: "1" for name in ["OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NGS_NUM_THREADS", "RAYON_NUM_THREADS"]
}
# Meshes: settings of the scene beside the load path. `recommended` comes from `salp converge`.
MESHES = {
    "quad4-0.9": ["mesh.element=quad4", "mesh.max_size_mm=0.9"],
    "quad9-graded": ["mesh.element=quad9"],
    "recommended": None,
    "quad9-10": ["mesh.element=quad9", "mesh.max_size_mm=10"],
    "quad9-6": ["mesh.element=quad9", "mesh.max_size_mm=6"],
    "quad4-2": ["mesh.element=quad4", "mesh.max_size_mm=2"],
    "quad4-1.4": ["mesh.element=quad4", "mesh.max_size_mm=1.4"],
}
PEERS = {
    "quad4": [("dolfinx", "discontinuous"), ("ngsolve", "discontinuous"), ("felupe", "condensed"), ("felupe", "mixed")],
    "quad9": [("dolfinx", "discontinuous"), ("ngsolve", "discontinuous"), ("felupe", "mixed"), ("felupe", "taylor-hood")],
}
# A run dearer than this is not repeated.
DEAR_CPU_S = 10.0


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--salp", type=Path, default=ROOT / "target" / "release" / "salp", help="the executable")
    parser.add_argument("--scene", action="append", choices=SCENES, help="one scene instead of both")
    parser.add_argument("--mesh", action="append", choices=list(MESHES), help="these meshes [default: the first three]")
    parser.add_argument("--package", action="append", choices=["dolfinx", "ngsolve", "felupe"], help="these packages")
    parser.add_argument("--skip", action="append", default=[], metavar="PACKAGE:FORM", help="leave out, e.g. felupe:mixed")
    parser.add_argument("--rounds", type=int, default=3, help="runs of each; the median counts [default: 3]")
    parser.add_argument("--time-limit", type=float, default=3600, help="wall seconds of one run [default: 3600]")
    parser.add_argument("--out", type=Path, default=WORK, help="folder of results, table and picture [default: target/peers]")
    return parser.parse_args()


def environment():
    """The Python with FElupe and NGSolve, made at the first run."""
    folder = WORK / "venv"
    python = folder / "bin" / "python"
    wanted = (HERE / "requirements.txt").read_text()
    stamp = folder / "requirements.txt"
    if not stamp.exists() or stamp.read_text() != wanted:
        subprocess.run([sys.executable, "-m", "venv", "--clear", folder], check=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "-r", HERE / "requirements.txt"], check=True)
        stamp.write_text(wanted)
    return python


def python_with_dolfinx():
    for folder in os.get_exec_path():
        python = Path(folder) / "python3"
        if python.exists():
            found = subprocess.run([python, "-c", "import dolfinx"], capture_output=True, check=False)
            if found.returncode == 0:
                return python
    sys.exit("no python3 in PATH has dolfinx: apt-get install python3-dolfinx")


def run(command, time_limit=None, path=None):
    """Runs a command on one thread; answers its output and the CPU seconds of the whole process."""
    variables = os.environ | ONE_THREAD
    if path:
        # NGSolve's compiler script looks for its own Python.
        variables["PATH"] = f"{path}{os.pathsep}{variables['PATH']}"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [str(c) for c in command], capture_output=True, text=True, check=False, env=variables, timeout=time_limit, cwd=HERE
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return done, cpu


def solve_with_salp(salp, scene, settings, *more):
    command = [salp, "solve", scene, "--json", *more]
    for setting in settings:
        command += ["--set", setting]
    done, cpu = run(command)
    if not done.stdout:
        sys.exit(f"{done.stderr}\n{' '.join(map(str, command))} failed")
    answer = json.loads(done.stdout)
    answer["process_cpu_s"] = cpu
    return answer


def converged(salp, name):
    """The convergence study of a scene, made once: its reference and its recommended setting for 1 %; None if it fails."""
    file = WORK / f"converge-{name}.json"
    if not file.exists():
        print(f"{name}: convergence study (minutes)", flush=True)
        command = [salp, "converge", scene_file(name), "--json", "--out", WORK / f"converge-{name}"]
        for setting in PATH_OF_LOADS:
            command += ["--set", setting]
        done, _ = run(command)
        if done.returncode:
            print(f"{name}: salp converge failed: {done.stderr.strip().splitlines()[-1]}", flush=True)
        file.write_text(done.stdout or "null")
    return json.loads(file.read_text())


def reference(options, name):
    """Tip displacements at the corners of the schedule and the enclosed area that errors are measured against."""
    study = converged(options.salp, name)
    if study:
        return study["reference"] | {"source": "salp converge, extrapolated"}
    answer = solve_with_salp(options.salp, scene_file(name), [*PATH_OF_LOADS, "mesh.max_size_mm=2"])
    corners = [s["displacement_mm"]["tip"] for s in answer["path"] if s["fraction"] == 1.0]
    area = answer["enclosed_area_mm2"]
    return {"tip_mm": corners, "area_mm2": area, "source": "quad9, 2 mm, 4 steps a leg"}


def scene_file(name):
    return ROOT / "examples" / "scenes" / f"{name}.json"


def recommended(study):
    setting = study["recommended"]
    if setting["refined"] != 1:
        sys.exit("the recommended mesh is a refined one, which no scene can ask for")
    size = setting["max_size_mm"]
    return [
        f"mesh.element={setting['element']}",
        *([] if size is None else [f"mesh.max_size_mm={size}"]),
        f"relative_residual_force_tolerance={setting['tolerance']}",
        f"actuation.load_steps_per_leg={setting['load_steps_per_leg']}",
    ]


def solve_with_peer(python, case, package, form, time_limit):
    try:
        done, cpu = run([python, "solve.py", case, package, form], time_limit, path=python.parent)
    except subprocess.TimeoutExpired:
        return {"package": package, "form": form, "status": "time_limit", "reason": f"{time_limit} s"}
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if not lines:
        last = (done.stderr.strip().splitlines() or ["no answer"])[-1]
        return {"package": package, "form": form, "status": "failed", "reason": last}
    return json.loads(lines[-1]) | {"process_cpu_s": cpu}


def measure(options, name, mesh, pythons):
    """All packages on one mesh, Salp's own run before each of theirs."""
    study = converged(options.salp, name)
    if mesh == "recommended" and not study:
        print(f"{name}: no recommended setting without a convergence study", flush=True)
        return None
    settings = PATH_OF_LOADS + (MESHES[mesh] or recommended(study))
    case = WORK / "cases" / f"{name}-{mesh}"
    case.mkdir(parents=True, exist_ok=True)
    ours = [solve_with_salp(options.salp, scene_file(name), settings, "--msh", case / "mesh.msh")]
    (case / "salp.json").write_text(json.dumps(ours[0]))
    peers = [p for p in PEERS[ours[0]["mesh"]["element"]] if p[0] in pythons and ":".join(p) not in options.skip]
    theirs = {peer: [] for peer in peers}
    # The exporting run is left out.
    ours = []
    for _ in range(options.rounds):
        for peer in peers:
            runs = theirs[peer]
            if runs and (runs[-1]["status"] != "ok" or runs[-1]["cpu_s"] > DEAR_CPU_S):
                continue
            ours.append(solve_with_salp(options.salp, scene_file(name), settings))
            runs.append(solve_with_peer(pythons[peer[0]], case, *peer, options.time_limit))
            print(report.progress(name, mesh, ours[-1], runs[-1]), flush=True)
    return report.compare(name, mesh, settings, reference(options, name), ours, theirs)


def main():
    options = arguments()
    if not options.salp.exists():
        sys.exit(f"{options.salp} does not exist: cargo build --release, or --salp FILE")
    options.salp = options.salp.resolve()
    options.out.mkdir(parents=True, exist_ok=True)
    packages = options.package or ["dolfinx", "ngsolve", "felupe"]
    pythons = {}
    if "dolfinx" in packages:
        pythons["dolfinx"] = python_with_dolfinx()
    if {"ngsolve", "felupe"} & set(packages):
        python = environment()
        pythons |= {p: python for p in ["ngsolve", "felupe"] if p in packages}
    results = []
    for name in options.scene or SCENES:
        for mesh in options.mesh or list(MESHES)[:3]:
            found = measure(options, name, mesh, pythons)
            if found is None:
                continue
            results.append(found)
            document = {
                "machine": {"processor": report.processor(), "system": platform.platform()},
                "salp": run([options.salp, "--version"])[0].stdout.strip(),
                "results": results,
            }
            (options.out / "results.json").write_text(json.dumps(document, indent=1))
            (options.out / "table.md").write_text(report.tables(document))
            (options.out / "error-against-time.svg").write_text(report.picture(results))
    print(report.tables(document))


main()
