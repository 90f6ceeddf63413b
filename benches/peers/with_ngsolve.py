"""NGSolve: symbolic energies, compiled to machine code, with pressure and inner unknowns condensed in the elements."""

import importlib.metadata

import netgen.meshing as ng
import ngsolve as ngs
import numpy as np

from case import straight
from march import Criterion, MAX_ITERATIONS, NotConverged

# Element: order of the displacement, pressure space.
FORMS = {
    "discontinuous": {1: "H1 order 1 with L2 order 0 (Q1-P0)", 2: "H1 order 2 with discontinuous P1 (Q2-P1)"},
    "taylor-hood": {2: "H1 order 2 with H1 order 1 (Q2-Q1, Taylor-Hood)"},
}


def netgen_mesh(case):
    """Corner nodes only; boundary conditions count from 1, the last for what no group holds."""
    mesh = ng.Mesh(dim=2)
    used = np.unique(case.quads[:, :4])
    point = {int(n): mesh.Add(ng.MeshPoint(ng.Pnt(*case.nodes[n], 0))) for n in used}
    names = [*case.lines, "free"]
    mesh.Add(ng.FaceDescriptor(surfnr=1, domin=1, bc=1))
    mesh.SetMaterial(1, "solid")
    for quad in case.quads[:, :4]:
        mesh.Add(ng.Element2D(1, [point[int(n)] for n in quad]))
    group = {frozenset(map(int, ends)): i for i, lines in enumerate(case.lines.values()) for ends in lines[:, :2]}
    count = {}
    for quad in case.quads[:, :4]:
        for ends in zip(quad, np.roll(quad, -1)):
            key = frozenset(map(int, ends))
            count[key] = None if key in count else ends
    for key, ends in count.items():
        if ends is not None:
            number = 1 + group.get(key, len(names) - 1)
            mesh.Add(ng.Element1D([point[int(n)] for n in ends], index=number))
    for i, name in enumerate(names):
        mesh.SetBCName(i, name)
    return ngs.Mesh(mesh)


class Peer:
    def __init__(self, case, form):
        if not straight(case):
            raise ValueError("the elements' edges must be straight")
        ngs.SetNumThreads(1)
        order = 2 if case.quadratic else 1
        self.criterion = Criterion(case)
        self.element = FORMS[form][order]
        self.mesh = netgen_mesh(case)
        displacement = ngs.VectorH1(self.mesh, order=order, dirichlet="left")
        self.condense = form == "discontinuous"
        if form == "taylor-hood":
            pressure = ngs.H1(self.mesh, order=1)
        elif order == 1:
            pressure = ngs.L2(self.mesh, order=0)
        else:
            # L2 of order 1 has four functions on a quadrilateral; three constants weigh 1, xi and eta instead.
            pressure = ngs.L2(self.mesh, order=0) ** 3
        self.space = displacement * pressure
        (u, p), _ = self.space.TnT()
        if self.condense and order == 2:
            xi = ngs.specialcf.xref(2)
            p = p[0] + p[1] * (xi[0] - 0.5) + p[2] * (xi[1] - 0.5)
        self.pressures = [ngs.Parameter(0.0) for _ in case.channels]
        F = ngs.Id(2) + ngs.Grad(u)
        J = ngs.Det(F)
        energy = case.c10 * (J ** (-2 / 3) * (ngs.InnerProduct(F, F) + 1) - 3) + p * (J - 1) - p * p / (2 * case.bulk)
        self.form = ngs.BilinearForm(self.space, symmetric=True, condense=self.condense)
        rule = {ngs.QUAD: ngs.IntegrationRule(ngs.QUAD, 5 if order == 2 else 3)}
        self.form += ngs.Variation(energy.Compile(True, wait=True) * ngs.dx(intrules=rule))
        # The wall's normal leaves the solid, so the cavity's area is minus this integral.
        n = ngs.specialcf.normal(2)
        t = ngs.CF((-n[1], n[0]))
        at = ngs.CF((ngs.x, ngs.y)) + u
        along = t + ngs.Grad(u).Trace() * t
        area = (at[0] * along[1] - at[1] * along[0]) / 2
        for i, pressure in enumerate(self.pressures):
            work = (pressure * area).Compile(True, wait=True)
            self.form += ngs.Variation(work * ngs.ds(definedon=self.mesh.Boundaries(f"channel-{i}")))
        self.check_orientation(case)
        self.state = ngs.GridFunction(self.space)
        self.residual = self.state.vec.CreateVector()
        self.step = self.state.vec.CreateVector()
        of_displacement = np.zeros(self.space.ndof, dtype=bool)
        of_displacement[: displacement.ndof] = True
        free = np.array(list(self.space.FreeDofs()))
        self.free, self.held = of_displacement & free, of_displacement & ~free
        self.unknowns = free.sum()
        self.inverse = self.inverse_of = None
        self.solver = "sparsecholesky" if self.condense else "umfpack"

    def check_orientation(self, case):
        n = ngs.specialcf.normal(2)
        for i, lines in enumerate(case.channels):
            found = ngs.Integrate((ngs.x * n[0] + ngs.y * n[1]) / 2, self.mesh, definedon=self.mesh.Boundaries(f"channel-{i}"))
            ends = case.nodes[lines[:, :2]]
            area = abs(np.sum(ends[:, 0, 0] * ends[:, 1, 1] - ends[:, 1, 0] * ends[:, 0, 1]) / 2)
            assert abs(found + area) < 1e-9 * area, "normals that do not leave the solid"

    def warm(self):
        """Machine code exists by now; one solution of no load loads the libraries."""
        self.solve(self.criterion.no_load)

    def solve(self, pressures):
        self.criterion.load(pressures)
        for parameter, pressure in zip(self.pressures, pressures):
            parameter.Set(pressure)
        form, state, residual = self.form, self.state.vec, self.residual
        form.Apply(state, residual)
        for iteration in range(1, MAX_ITERATIONS + 1):
            form.AssembleLinearization(state)
            inverse = self.factorise()
            if self.condense:
                residual.data += form.harmonic_extension_trans * residual
                self.step.data = inverse * residual
                self.step.data += form.harmonic_extension * self.step
                self.step.data += form.inner_solve * residual
            else:
                self.step.data = inverse * residual
            state.data -= self.step
            form.Apply(state, residual)
            forces = residual.FV().NumPy()
            if self.criterion.met(forces[self.free], forces[self.held]):
                return iteration
        raise NotConverged(f"not within {MAX_ITERATIONS} iterations")

    def factorise(self):
        """As NGSolve's own Newton: the ordering of the first factorisation serves all."""
        if self.inverse is None or self.inverse_of is not self.form.mat:
            self.inverse_of = self.form.mat
            self.inverse = self.inverse_of.Inverse(self.space.FreeDofs(coupling=self.condense), inverse=self.solver)
        else:
            self.inverse.Update()
        return self.inverse

    def save(self):
        kept = self.state.vec.CreateVector()
        kept.data = self.state.vec
        return kept

    def restore(self, kept):
        self.state.vec.data = kept

    def displacement(self, probe):
        return np.array(self.state.components[0](self.mesh(*probe.at)))

    def versions(self):
        return {name: importlib.metadata.version(name) for name in ["ngsolve", "netgen-mesher"]}
