"""What gives way behind the contacts, by finite elements: fingers, free rims, and bodies held at their backs; writes backing.json beside this file.

Each is a compliance of one contact as the solver estimates it (docs/explanation/theory.md 4.10): displacement over force, in mm/N, weighted by the forces
where there are several, so that the work is the same.
"""

import json
import logging
from pathlib import Path

import numpy as np
from scipy.sparse.linalg import splu
from skfem import Basis, ElementQuad2, ElementVector, FacetBasis, LinearForm, MeshQuad, asm
from skfem.models.elasticity import lame_parameters, linear_elasticity

from drives import outline_along
from elastic import Body, Patch, weights_of

E_MPA, NU = 210e3, 0.3


def plane_stress_lame():
    """Lamé's parameters that make plane strain what plane stress is."""
    mu = E_MPA / (2 * (1 + NU))
    return E_MPA * NU / (1 - NU**2), mu


def solved(basis, lame, load, fixed):
    stiffness = asm(linear_elasticity(*lame), basis)
    is_fixed = np.zeros(stiffness.shape[0], bool)
    is_fixed[fixed] = True
    free = np.flatnonzero(~is_fixed)
    u = np.zeros(stiffness.shape[0])
    u[free] = splu(stiffness[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A").solve(load[free])
    return u


def finger(length_mm, thickness_mm, height_mm, at_both_ends):
    """Mean deflection of the middle of a finger that is evenly pressed from one side, over the force on it."""
    mesh = MeshQuad.init_tensor(np.linspace(0, length_mm, 97), np.linspace(-thickness_mm / 2, thickness_mm / 2, 17))
    basis = Basis(mesh, ElementVector(ElementQuad2()))
    held = mesh.facets_satisfying(lambda x: (x[0] < 1e-9) | (at_both_ends & (x[0] > length_mm - 1e-9)))
    pressed = FacetBasis(mesh, ElementVector(ElementQuad2()), facets=mesh.facets_satisfying(lambda x: x[1] > thickness_mm / 2 - 1e-9))
    load = asm(LinearForm(lambda v, w: v[1]), pressed)
    u = solved(basis, plane_stress_lame(), load, basis.get_dofs(held).all())
    on_axis = np.flatnonzero(np.abs(mesh.p[1]) < 1e-9)
    on_axis = on_axis[np.argsort(mesh.p[0][on_axis])]
    deflections = u[basis.nodal_dofs[1, on_axis]]
    # A unit pressure is `length` newtons a millimetre of height.
    return float(np.trapezoid(deflections, mesh.p[0][on_axis]) / length_mm / (length_mm * height_mm))


def free_rim(inner_radius_mm, outer_radius_mm, width_mm, teeth, lobes):
    """A ring pressed from within where teeth carry, `sin Uψ` over half of each lobe; a lobe alone only pushes it aside, which is taken off."""
    radial, around = 9, 180
    r, angle = np.linspace(inner_radius_mm, outer_radius_mm, radial), np.arange(around) * 2 * np.pi / around
    points = np.array([[x * np.cos(a), x * np.sin(a)] for x in r for a in angle]).T
    node = lambda i, j: i * around + j % around
    quads = np.array([[node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)] for i in range(radial - 1) for j in range(around)]).T
    mesh = MeshQuad(points, quads)
    basis = Basis(mesh, ElementVector(ElementQuad2()))
    inner = FacetBasis(mesh, ElementVector(ElementQuad2()), intorder=6,
                       facets=mesh.facets_satisfying(lambda x: np.hypot(*x) < inner_radius_mm + 1e-6, boundaries_only=True))

    def pressure(x):
        p = np.maximum(np.sin(lobes * np.arctan2(x[1], x[0])), 0.0)
        # The resultant of one lobe, `p0/2 sin ψ`, is what holds the ring in its place.
        return p - 0.5 * x[1] / np.hypot(*x) if lobes == 1 else p

    load = asm(LinearForm(lambda v, w: pressure(w.x) * (w.x[0] * v[0] + w.x[1] * v[1]) / np.hypot(*w.x)), inner)
    pins = [basis.nodal_dofs[0, node(radial - 1, 0)], basis.nodal_dofs[1, node(radial - 1, 0)], basis.nodal_dofs[1, node(radial - 1, around // 2)]]
    u = solved(basis, lame_parameters(E_MPA, NU), load, pins)
    # Work of teeth at a pitch: Σ C F², F the pressure over a pitch.
    pitch_mm = 2 * np.pi * inner_radius_mm / teeth
    squares = np.pi * inner_radius_mm / 2
    return float(load @ u / (pitch_mm * width_mm * squares))


def held_body(surface_radius_mm, held_radius_mm, tooth_radius_mm, width_mm, teeth, lobes):
    """What a body held at its back gives way beyond the contact law with the tooth's radius for a depth: a rim pressed from within or a cam from
    without, by every tooth of half a lobe."""
    is_rim = held_radius_mm > surface_radius_mm
    half_mm = 0.02 * tooth_radius_mm
    s = np.linspace(-half_mm, half_mm, 17)
    span = np.pi / lobes
    at = lambda length: surface_radius_mm * np.column_stack([np.cos(np.asarray(length) / surface_radius_mm), np.sin(np.asarray(length) / surface_radius_mm)])
    begin = -0.6
    shifted = lambda length: at(np.asarray(length) + begin * surface_radius_mm)
    positions = (np.arange(int(teeth // (2 * lobes))) + 0.5) * 2 * np.pi / teeth
    centers = (positions - begin) * surface_radius_mm
    total = (span + 2 * 0.6) * surface_radius_mm
    nodes, patches = outline_along(shifted, total, centers, s, s[1] - s[0])
    normals = [(-1 if is_rim else 1) * np.array([np.cos(a), np.sin(a)]) for a in positions]
    ends = total / surface_radius_mm + begin
    back = held_radius_mm * np.column_stack([np.cos(a := np.linspace(ends, begin, 300)), np.sin(a)])
    outline, held = np.vstack([nodes, back]), np.arange(len(nodes), len(nodes) + len(back))
    if is_rim:
        outline, held = outline[::-1], np.arange(0, len(back))
    body = Body(outline, E_MPA, NU, [Patch(patch, normal) for patch, normal in zip(patches, normals)], held)
    mass = weights_of(s[1] - s[0], len(s))
    hertz = np.sqrt(np.maximum(1 - (s / half_mm) ** 2, 0.0))
    hertz /= (mass @ hertz).sum()
    forces = np.sin(lobes * positions)
    pressure = np.concatenate([force * hertz for force in forces])
    per_force = pressure @ body.flexibility @ pressure / (forces @ forces)
    # Of Hertz's distribution the mean displacement, weighted by itself, is half of (1 - ν²)/(π E) below that of its middle.
    t = (1 - NU**2) / (np.pi * E_MPA)
    return float((per_force - t * (2 * np.log(2 * tooth_radius_mm / half_mm) - NU / (1 - NU) - 0.5)) / width_mm)


def main():
    logging.getLogger("skfem").setLevel(logging.ERROR)
    results = {"youngs_modulus_gpa": E_MPA / 1e3, "poissons_ratio": NU, "fingers": [], "free_rims": [], "held_bodies": []}
    for length_mm, thickness_mm, height_mm in [(15.0, 3.884, 6.4), (15.0, 5.0, 6.0), (12.0, 2.0, 4.0), (30.0, 3.0, 8.0)]:
        for at_both_ends in (False, True):
            found = finger(length_mm, thickness_mm, height_mm, at_both_ends)
            results["fingers"].append(dict(length_mm=length_mm, thickness_mm=thickness_mm, height_mm=height_mm, at_both_ends=at_both_ends, compliance_mm_per_n=found))
            print(results["fingers"][-1], flush=True)
    for inner, outer, width_mm, teeth, lobes in [(68.0, 81.6, 15.0, 28, 2), (68.0, 74.0, 15.0, 28, 2), (52.2, 62.64, 15.0, 40, 2), (52.0, 58.0, 12.0, 33, 3), (36.0, 43.2, 12.0, 20, 1)]:
        found = free_rim(inner, outer, width_mm, teeth, lobes)
        results["free_rims"].append(dict(inner_radius_mm=inner, outer_radius_mm=outer, width_mm=width_mm, teeth=teeth, lobes=lobes, compliance_mm_per_n=found))
        print(results["free_rims"][-1], flush=True)
    for surface, held, tooth_radius_mm, width_mm, teeth, lobes in [(68.0, 81.6, 5.0, 15.0, 28, 2), (68.0, 73.0, 5.0, 15.0, 28, 2), (52.2, 62.64, 1.5, 15.0, 40, 2), (36.0, 43.2, 2.0, 12.0, 20, 1),
                                                                   (57.0, 20.0, 5.0, 15.0, 28, 2), (57.0, 45.0, 5.0, 15.0, 28, 2), (50.0, 25.0, 1.5, 15.0, 40, 2)]:
        found = held_body(surface, held, tooth_radius_mm, width_mm, teeth, lobes)
        results["held_bodies"].append(dict(surface_radius_mm=surface, held_radius_mm=held, tooth_radius_mm=tooth_radius_mm, width_mm=width_mm, teeth=teeth, lobes=lobes, compliance_mm_per_n=found))
        print(results["held_bodies"][-1], flush=True)
    Path(__file__).with_name("backing.json").write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
