"""Elastic bodies in frictionless contact, in plane strain, for one millimetre of width.

A body answers once for how its surface gives way under unit pressures on its contact patches: finite elements (quadratic
triangles) with one factorisation. What the bodies do together is then a complementarity problem of the pressures alone: weighted gaps and
pressures are never negative, and one of the two is nil (a mortar method with linear pressures).
"""

import clarabel
import gmsh
import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementTriP1, ElementTriP2, ElementVector, FacetBasis, MeshTri, asm
from skfem.models.elasticity import lame_parameters, linear_elasticity


class Patch:
    """A stretch of a surface around a point of contact, or up to a corner that is pressed, by its nodes."""

    def __init__(self, nodes_mm, normal):
        self.nodes_mm = np.asarray(nodes_mm)
        self.normal = np.asarray(normal)


def graded(start, end, fine_at_start, fine_at_end, coarse, growth=1.25):
    """Parameters strictly between two ends, their steps growing from what they are there."""
    length = end - start
    forward, backward = [], []
    a, b = fine_at_start, fine_at_end
    x, y = start, end
    while y - x > 1.5 * min(a, b):
        if a <= b:
            a = min(a * growth, coarse)
            x += a
            forward.append(x)
        else:
            b = min(b * growth, coarse)
            y -= b
            backward.append(y)
    if forward and backward and forward[-1] >= backward[-1] - 0.3 * min(a, b):
        forward.pop()
    inside = np.array(forward + backward[::-1])
    return inside[(inside > start + 0.2 * fine_at_start) & (inside < end - 0.2 * fine_at_end)] if length > 0 else inside[:0]


class Body:
    """An elastic body by its closed outline of points, counter-clockwise; `held` marks points of its outline that do not move."""

    def __init__(self, outline_mm, youngs_modulus_mpa, poissons_ratio, patches, held=None, pins=None):
        outline_mm = np.asarray(outline_mm)
        mesh, index = triangulated(outline_mm)
        self.nodes = mesh.p.shape[1]
        basis = Basis(mesh, ElementVector(ElementTriP2()))
        stiffness = asm(linear_elasticity(*lame_parameters(youngs_modulus_mpa, poissons_ratio)), basis)
        fixed = np.zeros(stiffness.shape[0], bool)
        if held is not None:
            held_nodes = np.zeros(self.nodes, bool)
            held_nodes[index[np.asarray(held)]] = True
            facets = mesh.boundary_facets()
            facets = facets[held_nodes[mesh.facets[:, facets]].all(axis=0)]
            fixed[basis.get_dofs(facets).all()] = True
        for point, component in pins or []:
            node = np.argmin(np.hypot(*(mesh.p - np.asarray(point)[:, None])))
            fixed[basis.nodal_dofs[component, node]] = True
        free = np.flatnonzero(~fixed)
        factors = splu(stiffness[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.0)
        columns = [self._load(mesh, patch) for patch in patches]
        loads = np.hstack(columns)[free]
        give = np.empty_like(loads)
        for first in range(0, loads.shape[1], 64):
            give[:, first : first + 64] = factors.solve(np.ascontiguousarray(loads[:, first : first + 64]))
        self.flexibility = loads.T @ give
        self.sizes = [column.shape[1] for column in columns]

    @staticmethod
    def _load(mesh, patch):
        """The nodal forces of unit linear pressures on a patch, along minus its outward normal."""
        distance = np.hypot(mesh.p[0][:, None] - patch.nodes_mm[:, 0], mesh.p[1][:, None] - patch.nodes_mm[:, 1])
        nodes = distance.argmin(axis=0)
        assert distance.min(axis=0).max() < 1e-9, "the patch is no part of the mesh"
        is_node = np.zeros(mesh.p.shape[1], bool)
        is_node[nodes] = True
        facets = mesh.boundary_facets()
        facets = facets[is_node[mesh.facets[:, facets]].all(axis=0)]
        into = -patch.normal
        push = BilinearForm(lambda p, v, w: p * (into[0] * v[0] + into[1] * v[1]))
        of_pressure = FacetBasis(mesh, ElementTriP1(), facets=facets, intorder=4)
        of_motion = FacetBasis(mesh, ElementVector(ElementTriP2()), facets=facets, intorder=4)
        return asm(push, of_pressure, of_motion)[:, nodes].toarray()


def triangulated(outline_mm):
    """Triangles within an outline, as fine as its points stand there, and which node each of its points became."""
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 1)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1)
    gmsh.option.setNumber("Mesh.Algorithm", 6)
    step = np.hypot(*(np.roll(outline_mm, -1, axis=0) - outline_mm).T)
    size = np.minimum(step, np.roll(step, 1))
    points = [gmsh.model.geo.addPoint(x, y, 0.0, s) for (x, y), s in zip(outline_mm, size)]
    lines = [gmsh.model.geo.addLine(a, b) for a, b in zip(points, points[1:] + points[:1])]
    surface = gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop(lines)])
    for line in lines:
        gmsh.model.geo.mesh.setTransfiniteCurve(line, 2)
    gmsh.model.geo.synchronize()
    gmsh.model.mesh.generate(2)
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    _, corners = gmsh.model.mesh.getElementsByType(2)
    gmsh.finalize()
    number = np.zeros(int(tags.max()) + 1, int)
    number[tags.astype(int)] = np.arange(len(tags))
    p = coordinates.reshape(-1, 3)[:, :2].T.copy()
    t = number[corners.astype(int)].reshape(-1, 3).T
    used = np.unique(t)
    again = np.full(p.shape[1], -1)
    again[used] = np.arange(len(used))
    mesh = MeshTri(p[:, used], again[t])
    index = np.array([np.argmin((mesh.p[0] - x) ** 2 + (mesh.p[1] - y) ** 2) for x, y in outline_mm])
    return mesh, index


def weights_of(places_mm):
    """The integrals of products of linear pressures along a patch with nodes at these lengths."""
    mass = np.zeros((len(places_mm), len(places_mm)))
    for i, step_mm in enumerate(np.diff(places_mm)):
        mass[i : i + 2, i : i + 2] += step_mm / 6 * np.array([[2.0, 1.0], [1.0, 2.0]])
    return mass


def solve_contact(flexibility, gaps, motions, loads):
    """Pressures p >= 0 with `flexibility p + gaps - motions x >= 0`, one of the two nil everywhere, and `motions' p = loads`; x are rigid motions.

    They are the least of the energy `p' flexibility p / 2 + gaps' p`, a convex quadratic programme, which an interior-point method solves.
    """
    count, free = motions.shape
    unit = 1.0 / np.abs(np.diag(flexibility)).mean()
    energy = csc_matrix(np.triu(0.5 * (flexibility + flexibility.T) * unit))
    constraints = csc_matrix(np.vstack([motions.T, -np.eye(count)]))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    cones = [clarabel.ZeroConeT(free), clarabel.NonnegativeConeT(count)]
    solution = clarabel.DefaultSolver(energy, gaps * unit, constraints, np.concatenate([loads, np.zeros(count)]), cones, settings).solve()
    if "Solved" not in str(solution.status):
        raise RuntimeError(f"the contact did not settle: {solution.status}")
    return np.maximum(np.array(solution.x), 0.0), -np.array(solution.z[:free]) / unit
