"""Fingers of the carrier as trapezia on an elastic disc, by finite elements in three dimensions; writes fingers.json beside this file.

The theory is section 4.12 of docs/explanation/theory.md. Elements are bricks of 20 nodes. The disc is as thick as the finger and held at its back; it reaches
a finger's height farther in and out, and to the middles of the next fingers. Nothing here follows from the solver but the slices' compliance, which is an input of both.
"""

import json
import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.sparse.linalg import splu
from skfem import Basis, ElementHexS2, ElementVector, FacetBasis, LinearForm, MeshHex, asm
from skfem.models.elasticity import lame_parameters, linear_elasticity

E_MPA, NU = 210e3, 0.3


@dataclass
class Finger:
    """Radii of the carrier, half the width of a slot, number and length of the fingers, and the compliance of a slice of a tooth."""

    inner_mm: float
    outer_mm: float
    slot_half_width_mm: float
    count: int
    length_mm: float
    slice_mm2_per_n: float

    @property
    def wall_angle(self):
        return np.pi / self.count

    def half_thickness(self, x):
        return x * np.tan(self.wall_angle) - self.slot_half_width_mm / np.cos(self.wall_angle)

    @property
    def thickness_mm(self):
        middle = (self.inner_mm + self.outer_mm) / 2
        return 2 * (middle * np.sin(self.wall_angle) - self.slot_half_width_mm)


def lines(ends, counts):
    """Places of a grid, so many intervals between each two ends."""
    parts = [np.linspace(a, b, count + 1)[:-1] for a, b, count in zip(ends, ends[1:], counts)]
    return np.concatenate([*parts, [ends[-1]]])


class Body:
    """A finger on its disc. `z` are the places along the finger, from 0 at the disc; the last is free, or the middle of a finger between two discs."""

    def __init__(self, finger, z, is_half, across=6, along_radius=6):
        self.finger, self.z = finger, z
        height, thickness = finger.outer_mm - finger.inner_mm, finger.thickness_mm
        x = lines([finger.inner_mm - height, finger.inner_mm, finger.outer_mm, finger.outer_mm + height], [3, along_radius, 3])
        y = lines([-2, -1, 1, 2], [3, across, 3])
        depth = lines([-thickness, 0], [5])
        mesh = MeshHex.init_tensor(x, y, np.concatenate([depth[:-1], z]))
        middle = mesh.p[:, mesh.t].mean(axis=1)
        is_beside = (middle[0] < finger.inner_mm) | (middle[0] > finger.outer_mm) | (np.abs(middle[1]) > 1)
        mesh = mesh.remove_elements(np.flatnonzero((middle[2] > 0) & is_beside))
        p = mesh.p.copy()
        half = finger.half_thickness(np.clip(p[0], finger.inner_mm, finger.outer_mm))
        far = np.maximum(p[0] * np.tan(2 * finger.wall_angle), 2 * half)
        p[1] = np.where(np.abs(mesh.p[1]) <= 1, mesh.p[1] * half, np.sign(mesh.p[1]) * (half + (np.abs(mesh.p[1]) - 1) * (far - half)))
        self.mesh = MeshHex(p, mesh.t)
        element = ElementVector(ElementHexS2())
        self.basis = Basis(self.mesh, element, intorder=4)
        law = linear_elasticity(*lame_parameters(E_MPA, NU))
        stiffness = asm(law, self.basis)
        fixed = [self.basis.get_dofs(self.mesh.facets_satisfying(lambda q: q[2] < -thickness + 1e-9)).all()]
        if is_half:
            fixed.append(self.basis.get_dofs(self.mesh.facets_satisfying(lambda q: q[2] > z[-1] - 1e-9)).all("u^3"))
        self.free = np.setdiff1d(np.arange(self.basis.N), np.concatenate(fixed))
        self.solver = splu(stiffness[self.free][:, self.free].tocsc(), permc_spec="MMD_AT_PLUS_A")
        in_finger = np.flatnonzero(self.mesh.p[:, self.mesh.t].mean(axis=1)[2] > 0)
        self.of_finger = asm(law, Basis(self.mesh, element, intorder=4, elements=in_finger))
        # The wall that is pressed, and the way its force points.
        self.normal = np.array([np.sin(finger.wall_angle), -np.cos(finger.wall_angle), 0.0])
        self.slabs = list(zip(z, z[1:]))

    def pressed(self, low, high):
        """One newton, evenly over the wall between two places."""
        is_wall = lambda q: (q[2] > low) & (q[2] < high) & (q[1] > 0) & (np.abs(q[1] - self.finger.half_thickness(q[0])) < 1e-6)
        wall = FacetBasis(self.mesh, ElementVector(ElementHexS2()), facets=self.mesh.facets_satisfying(is_wall, boundaries_only=True), intorder=4)
        load = asm(LinearForm(lambda v, w: sum(self.normal[i] * v[i] for i in range(2))), wall)
        return load / np.sum(wall.dx)

    def solve(self, load):
        u = np.zeros(self.basis.N)
        u[self.free] = self.solver.solve(load[self.free])
        return u

    def means(self):
        """Weights of the displacements whose sum is the mean displacement along the force over the finger's section, for each slab."""
        middles = self.mesh.p[:, self.mesh.t].mean(axis=1)[2]
        weights = []
        for low, high in self.slabs:
            part = Basis(self.mesh, ElementVector(ElementHexS2()), intorder=4, elements=np.flatnonzero((middles > low) & (middles < high)))
            weights.append(asm(LinearForm(lambda v, w: sum(self.normal[i] * v[i] for i in range(2))), part) / np.sum(part.dx))
        return np.array(weights)

    def moment_at_foot(self, u, load):
        """Bending moment that the disc takes, from the forces on the finger's nodes there."""
        force = self.of_finger @ u - load
        foot = np.flatnonzero(np.abs(self.basis.doflocs[2]) < 1e-9)
        axial = np.intersect1d(foot, self.basis.get_dofs(elements=np.arange(self.mesh.nelements)).all("u^3"))
        place = self.basis.doflocs[:, axial]
        return abs(float(np.sum(force[axial] * (self.normal[0] * (place[0] - place[0].mean()) + self.normal[1] * place[1]))))


def at_one_end(finger, slabs):
    # Finer towards the foot, where the load is largest.
    body = Body(finger, finger.length_mm * np.linspace(0, 1, slabs + 1) ** 1.5, False)
    loads = np.array([body.pressed(low, high) for low, high in body.slabs])
    means = body.means()
    flexibility = np.array([means @ body.solve(load) for load in loads]).T
    widths = np.diff(body.z)
    even = widths / finger.length_mm
    springs = flexibility + np.diag(finger.slice_mm2_per_n / widths)
    forces = np.linalg.solve(springs, np.ones(len(widths)))
    forces /= forces.sum()
    total = body.solve(forces @ loads)
    pressures = forces / widths
    return {
        "compliance_mm_per_n": float(even @ flexibility @ even),
        "load_peak_over_mean": float(pressures.max() * finger.length_mm),
        "moment_over_force_length": body.moment_at_foot(total, forces @ loads) / finger.length_mm,
    }


def at_both_ends(finger, slabs):
    body = Body(finger, finger.length_mm / 2 * np.linspace(0, 1, slabs + 1), True)
    load = body.pressed(0, finger.length_mm / 2)
    u = body.solve(load)
    mean = (np.diff(body.z) / body.z[-1]) @ body.means() @ u
    # One newton is on half of the finger here.
    return {"compliance_mm_per_n": float(mean) / 2, "moment_over_force_length": body.moment_at_foot(u, load) / 2 / finger.length_mm}


def main():
    logging.getLogger("skfem").setLevel(logging.ERROR)
    results = {"youngs_modulus_gpa": E_MPA / 1e3, "poissons_ratio": NU, "fingers": []}
    # Case 5.1, and a drive with rollers of 1.5 mm radius.
    for finger in [Finger(58.8, 65.2, 5.0, 28, 15.0, 3.0e-4), Finger(18.7, 20.3, 1.5, 20, 8.0, 1.3e-4)]:
        found = {**finger.__dict__, "at_one_end": at_one_end(finger, 12), "at_both_ends": at_both_ends(finger, 8)}
        results["fingers"].append(found)
        print(found, flush=True)
    Path(__file__).with_name("fingers.json").write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
