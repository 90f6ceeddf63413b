"""dolfinx: UFL energies, compiled by FFCx; MUMPS (LDL^T) through PETSc."""

import dolfinx
import numpy as np
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from petsc4py import PETSc

from case import straight
from march import Criterion, MAX_ITERATIONS, NotConverged

FORMS = {
    "discontinuous": {1: ("Q1-P0", ("DQ", 0)), 2: ("Q2 with discontinuous P1 (DPC)", ("DPC", 1))},
    "taylor-hood": {2: ("Q2-Q1 (Taylor-Hood)", ("Q", 1))},
}
JIT = {"cffi_extra_compile_args": ["-O3", "-march=native"], "cffi_libraries": ["m"]}


class Peer:
    def __init__(self, case, form):
        if not straight(case):
            raise ValueError("the elements' edges must be straight")
        order = 2 if case.quadratic else 1
        self.criterion = Criterion(case)
        self.element, (family, degree) = FORMS[form][order]
        self.solver = "MUMPS, LDL^T (PCCHOLESKY)"
        self.case = case

        # Corners in dolfinx's order, which runs along the axes.
        used, corners = np.unique(case.quads[:, [0, 1, 3, 2]], return_inverse=True)
        shape = ufl.Mesh(ufl.VectorElement("Lagrange", "quadrilateral", 1))
        self.mesh = mesh.create_mesh(MPI.COMM_SELF, corners.reshape(-1, 4), case.nodes[used], shape)
        tags = self.tag_walls()

        cell = self.mesh.ufl_cell()
        mixed = ufl.MixedElement([ufl.VectorElement("Q", cell, order), ufl.FiniteElement(family, cell, degree)])
        self.space = fem.FunctionSpace(self.mesh, mixed)
        self.state = fem.Function(self.space)
        u, p = ufl.split(self.state)
        F = ufl.Identity(2) + ufl.grad(u)
        J = ufl.det(F)
        isochoric = case.c10 * (J ** (-2 / 3) * (ufl.inner(F, F) + 1) - 3)
        dx = ufl.Measure("dx", domain=self.mesh, metadata={"quadrature_degree": 5 if order == 2 else 3})
        ds = ufl.Measure("ds", domain=self.mesh, subdomain_data=tags, metadata={"quadrature_degree": 2 * order})
        energy = (isochoric + p * (J - 1) - p**2 / (2 * case.bulk)) * dx
        self.pressures = [fem.Constant(self.mesh, PETSc.ScalarType(0)) for _ in case.channels]
        # The wall's normal leaves the solid, so the cavity's area is minus this integral.
        at = ufl.SpatialCoordinate(self.mesh) + u
        area = ufl.dot(at, J * ufl.inv(F).T * ufl.FacetNormal(self.mesh)) / 2
        for i, pressure in enumerate(self.pressures):
            energy += pressure * area * ds(i + 1)
        residual = ufl.derivative(energy, self.state, ufl.TestFunction(self.space))
        tangent = ufl.derivative(residual, self.state, ufl.TrialFunction(self.space))
        self.residual_form = fem.form(residual, jit_params=JIT)
        self.tangent_form = fem.form(tangent, jit_params=JIT)

        displacement, dofs = self.space.sub(0).collapse()
        of_displacement = np.zeros(self.space.dofmap.index_map.size_local, dtype=bool)
        of_displacement[dofs] = True
        left = mesh.locate_entities_boundary(self.mesh, 1, lambda x: np.isclose(x[0], 0))
        held = fem.locate_dofs_topological((self.space.sub(0), displacement), 1, left)
        zero = fem.Function(displacement)
        self.bc = fem.dirichletbc(zero, held, self.space.sub(0))
        self.held = np.zeros_like(of_displacement)
        self.held[held[0]] = True
        self.free = of_displacement & ~self.held
        self.unknowns = (~self.held).sum()
        self.node_of = self.nodes_to_dofs(displacement, dofs)

        self.matrix = fem.petsc.create_matrix(self.tangent_form)
        self.matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self.vector = fem.petsc.create_vector(self.residual_form)
        self.step = self.vector.duplicate()
        self.ksp = PETSc.KSP().create(MPI.COMM_SELF)
        self.ksp.setOperators(self.matrix)
        self.ksp.setType("preonly")
        self.ksp.getPC().setType("cholesky")
        self.ksp.getPC().setFactorSolverType("mumps")

    def tag_walls(self):
        facets, tags = [], []
        for i, lines in enumerate(self.case.channels):
            ends = {tuple(np.round(self.case.nodes[n], 6)) for n in np.unique(lines[:, :2])}
            found = mesh.locate_entities_boundary(
                self.mesh, 1, lambda x: np.array([tuple(np.round(p[:2], 6)) in ends for p in x.T])
            )
            assert len(found) == len(lines), f"walls of channel {i}"
            facets.append(found)
            tags.append(np.full(len(found), i + 1, dtype=np.int32))
        facets, tags = np.concatenate(facets), np.concatenate(tags)
        order = np.argsort(facets)
        return mesh.meshtags(self.mesh, 1, facets[order], tags[order])

    def nodes_to_dofs(self, displacement, dofs):
        """For each node of the case the places of its two components in the vector of unknowns."""
        at = {tuple(np.round(x[:2], 6)): i for i, x in enumerate(displacement.tabulate_dof_coordinates())}
        dofs = np.asarray(dofs).reshape(-1, 2)
        return np.array([dofs[at[tuple(np.round(x, 6))]] for x in self.case.nodes])

    def warm(self):
        """Machine code exists by now; one solution of no load loads the libraries."""
        self.solve(self.criterion.no_load)

    def assemble_residual(self):
        with self.vector.localForm() as local:
            local.set(0)
        fem.petsc.assemble_vector(self.vector, self.residual_form)

    def solve(self, pressures):
        self.criterion.load(pressures)
        for constant, pressure in zip(self.pressures, pressures):
            constant.value = pressure
        self.assemble_residual()
        for iteration in range(1, MAX_ITERATIONS + 1):
            self.matrix.zeroEntries()
            fem.petsc.assemble_matrix(self.matrix, self.tangent_form, bcs=[self.bc])
            self.matrix.assemble()
            self.vector.array[self.held] = 0
            self.ksp.solve(self.vector, self.step)
            if self.ksp.getConvergedReason() < 0:
                raise NotConverged("MUMPS failed")
            self.state.vector.axpy(-1, self.step)
            self.assemble_residual()
            forces = self.vector.array_r
            if self.criterion.met(forces[self.free], forces[self.held]):
                return iteration
        raise NotConverged(f"not within {MAX_ITERATIONS} iterations")

    def save(self):
        return self.state.vector.array_r.copy()

    def restore(self, kept):
        self.state.vector.array[:] = kept

    def displacement(self, probe):
        return probe.of(self.state.vector.array_r[self.node_of])

    def versions(self):
        petsc = ".".join(map(str, PETSc.Sys.getVersion()))
        return {"dolfinx": dolfinx.__version__, "petsc": petsc, "ufl": ufl.__version__}
