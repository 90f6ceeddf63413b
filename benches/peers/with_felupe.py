"""FElupe: three-field u-p-J elements in their documented forms, PARDISO (MKL) through pypardiso."""

import importlib.metadata

import felupe as fem
import numpy as np
import pypardiso

from march import Criterion, NotConverged, MAX_ITERATIONS

FORMS = {
    "condensed": "SolidBodyNearlyIncompressible: Q1, p and J constant in an element, condensed",
    "mixed": "FieldsMixed with NearlyIncompressible: Q1-P0-P0, or Q2 with disconnected Q1 for p and J",
    "taylor-hood": "FieldsMixed(disconnect=False) with NearlyIncompressible: Q2 with continuous Q1 for p and J",
}


class Peer:
    def __init__(self, case, form):
        self.criterion = Criterion(case)
        self.element = FORMS[form]
        self.solver = "PARDISO (MKL), unsymmetric, through pypardiso"
        mesh = fem.Mesh(case.nodes, case.quads, "quad9" if case.quadratic else "quad")
        if case.quadratic:
            region, edges = fem.RegionBiQuadraticQuad(mesh), fem.RegionBiQuadraticQuadBoundary
        else:
            region, edges = fem.RegionQuad(mesh), fem.RegionQuadBoundary
        isochoric = fem.NeoHooke(mu=2 * case.c10)
        if form == "condensed":
            field = fem.FieldContainer([fem.FieldPlaneStrain(region, dim=2)])
            self.solid = fem.SolidBodyNearlyIncompressible(isochoric, field, bulk=case.bulk)
        else:
            more = {"disconnect": False} if form == "taylor-hood" else {}
            field = fem.FieldsMixed(region, n=3, planestrain=True, **more)
            self.solid = fem.SolidBody(fem.NearlyIncompressible(isochoric, bulk=case.bulk), field)
        self.pressures = []
        for lines in case.channels:
            on_wall = np.zeros(len(case.nodes), dtype=bool)
            on_wall[lines] = True
            walls = edges(mesh, only_surface=True, mask=on_wall, ensure_3d=True)
            assert len(walls.mesh.cells) == len(lines)
            self.pressures.append(fem.SolidBodyPressure(fem.FieldContainer([fem.FieldPlaneStrain(walls, dim=2)])))
        held = np.zeros(len(case.nodes), dtype=bool)
        held[case.held] = True
        boundaries = {"left": fem.Boundary(field[0], mask=held)}
        self.dof0, self.dof1 = fem.dof.partition(field, boundaries)
        self.displacements = field[0].values.size
        self.free = self.dof1[self.dof1 < self.displacements]
        self.unknowns = len(self.dof1)

    def warm(self):
        """Nothing is compiled; one solution of no load loads the libraries."""
        self.solve(self.criterion.no_load)

    def _check(self, dx, x, f, xtol, ftol, dof1=None, dof0=None, items=None):
        free, reactions = f[self.free], f[self.dof0]
        return np.linalg.norm(dx), np.linalg.norm(free), self.criterion.met(free, reactions)

    def solve(self, pressures):
        self.criterion.load(pressures)
        for body, pressure in zip(self.pressures, pressures):
            body.update(pressure)
        try:
            result = fem.newtonraphson(
                items=[self.solid, *self.pressures],
                dof0=self.dof0,
                dof1=self.dof1,
                solver=pypardiso.spsolve,
                check=self._check,
                maxiter=MAX_ITERATIONS,
                verbose=0,
            )
        except (fem.NewtonConvergenceError, ArithmeticError) as why:
            raise NotConverged(str(why).strip()) from why
        return result.iterations

    def save(self):
        return self.solid.checkpoint()

    def restore(self, kept):
        self.solid.restore(kept)

    def displacement(self, probe):
        return probe.of(self.solid.field[0].values)

    def versions(self):
        return {name: importlib.metadata.version(name) for name in ["felupe", "pypardiso", "mkl", "numpy", "scipy"]}
