"""A scene with its exported mesh, as every package reads it."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

# Gmsh's numbers of the shapes that an exported mesh holds.
LINES = {1: 2, 8: 3}
QUADS = {3: 4, 10: 9}


@dataclass
class Probe:
    """A point of the undeformed shape and its interpolation."""

    at: np.ndarray
    nodes: np.ndarray
    weights: np.ndarray

    def of(self, values):
        """The value there of nodal values (n, 2)."""
        return self.weights @ values[self.nodes]


@dataclass
class Case:
    """Lengths in mm, stresses in MPa; nodes count from 0."""

    name: str
    nodes: np.ndarray  # (n, 2)
    quads: np.ndarray  # (e, 4 or 9): corners counter-clockwise, mid-sides, centre
    lines: dict  # group name -> (m, 2 or 3): ends, mid-side
    c10: float
    bulk: float
    states: np.ndarray  # (s, channels): pressures of the path, rest first
    probes: dict  # name -> Probe
    tolerance: float

    @property
    def quadratic(self):
        return self.quads.shape[1] == 9

    @property
    def held(self):
        return np.unique(self.lines["left"])

    @property
    def channels(self):
        return [self.lines[f"channel-{i}"] for i in range(self.states.shape[1])]

    def largest_nodal_force(self):
        """Of the pressures of the schedule on the undeformed shape: the force scale of the tolerance."""
        force = np.zeros_like(self.nodes)
        for lines, pressure in zip(self.channels, abs(self.states).max(axis=0)):
            ends = self.nodes[lines[:, 1]] - self.nodes[lines[:, 0]]
            normal = pressure * np.column_stack([ends[:, 1], -ends[:, 0]])
            shares = [1 / 6, 1 / 6, 2 / 3] if self.quadratic else [1 / 2, 1 / 2]
            for k, share in enumerate(shares):
                np.add.at(force, lines[:, k], share * normal)
        return np.linalg.norm(force, axis=1).max()


def read_mesh(path):
    """Nodes, quadrilaterals and lines by group of a file in MSH 4.1 ASCII."""
    words = Path(path).read_text().split("\n")
    at = {line: i for i, line in enumerate(words) if line.startswith("$")}

    names = {}
    for line in words[at["$PhysicalNames"] + 2 : at["$EndPhysicalNames"]]:
        dimension, tag, name = line.split(maxsplit=2)
        names[int(dimension), int(tag)] = name.strip('"')

    group = {}
    start = at["$Entities"] + 1
    counts = [int(n) for n in words[start].split()]
    row = start + 1
    for dimension, count in enumerate(counts):
        for line in words[row : row + count]:
            entity = line.split()
            skip = 4 if dimension == 0 else 7
            if int(entity[skip]):
                group[dimension, int(entity[0])] = names[dimension, int(entity[skip + 1])]
        row += count

    blocks, count = (int(n) for n in words[at["$Nodes"] + 1].split()[:2])
    assert blocks == 1, "one block of nodes expected"
    start = at["$Nodes"] + 3
    tags = np.array(words[start : start + count], dtype=int)
    nodes = np.array([w.split() for w in words[start + count : start + 2 * count]], dtype=float)[:, :2]
    index = np.full(tags.max() + 1, -1)
    index[tags] = np.arange(count)

    lines, quads = {}, []
    row = at["$Elements"] + 2
    while not words[row].startswith("$"):
        dimension, entity, kind, count = (int(n) for n in words[row].split())
        members = np.array([w.split() for w in words[row + 1 : row + 1 + count]], dtype=int)
        members = index[members[:, 1:]]
        if kind in LINES:
            lines.setdefault(group[dimension, entity], []).append(members)
        elif kind in QUADS:
            quads.append(members)
        else:
            raise ValueError(f"element kind {kind}: quadrilaterals and their edges expected")
        row += 1 + count
    return nodes, np.concatenate(quads), {name: np.concatenate(m) for name, m in lines.items()}


def read_case(folder):
    """A case folder: `mesh.msh`, and Salp's own answer on that mesh, which says scene and states."""
    folder = Path(folder)
    nodes, quads, lines = read_mesh(folder / "mesh.msh")
    answer = json.loads((folder / "salp.json").read_text())
    scene = answer["resolved"]
    c10 = scene["material"]["c10_mpa"]
    return Case(
        name=folder.name,
        nodes=nodes,
        quads=quads,
        lines=lines,
        c10=c10,
        bulk=scene["material"]["bulk_over_shear"] * 2 * c10,
        states=np.array([s["pressure_kpa"] for s in answer["path"]]) / 1000,
        probes={name: locate(nodes, quads, at) for name, at in scene["probes"].items()},
        tolerance=scene["relative_residual_force_tolerance"],
    )


def bilinear(s, t):
    return np.array([(1 - s) * (1 - t), (1 + s) * (1 - t), (1 + s) * (1 + t), (1 - s) * (1 + t)]) / 4


def biquadratic(s, t):
    low, middle, high = (lambda r: r * (r - 1) / 2), (lambda r: 1 - r * r), (lambda r: r * (r + 1) / 2)
    along = [low, high, high, low, middle, high, middle, low, middle]
    across = [low, low, high, high, low, middle, high, middle, middle]
    return np.array([f(s) * g(t) for f, g in zip(along, across)])


def locate(nodes, quads, at):
    """The element around a point and its weights there, the four corners taken for the shape."""
    at = np.asarray(at, dtype=float)
    corners = nodes[quads[:, :4]]
    near = np.argsort(np.linalg.norm(corners.mean(axis=1) - at, axis=1))[:32]
    for element in near:
        shape, local = corners[element], np.zeros(2)
        for _ in range(20):
            s, t = local
            ds = np.array([-(1 - t), 1 - t, 1 + t, -(1 + t)]) / 4
            dt = np.array([-(1 - s), -(1 + s), 1 + s, 1 - s]) / 4
            local = local + np.linalg.solve(np.column_stack([ds @ shape, dt @ shape]), at - bilinear(s, t) @ shape)
        if abs(local).max() < 1 + 1e-9:
            shape_functions = biquadratic if quads.shape[1] == 9 else bilinear
            return Probe(at, quads[element], shape_functions(*local))
    raise ValueError(f"no element at {at}")


def straight(case):
    """Whether all mid-side and centre nodes are where straight edges put them: then four corners say the shape."""
    if not case.quadratic:
        return True
    corners = case.nodes[case.quads[:, :4]]
    sides = (corners + np.roll(corners, -1, axis=1)) / 2
    centre = corners.mean(axis=1, keepdims=True)
    expected = np.concatenate([sides, centre], axis=1)
    return np.abs(case.nodes[case.quads[:, 4:]] - expected).max() < 1e-9
