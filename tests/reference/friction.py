#!/usr/bin/env python3
"""Coulomb friction in discrete-tooth harmonic drives, tooth by tooth and without approximation.

Writes friction.json beside itself: what src/solver/losses.rs is held against (docs/explanation/theory.md, section 10).

    usage: python3 friction.py               friction.json
           python3 friction.py ranges 40     how far first order is from the exact equilibrium, over the drives below
                                             and 40 drawn at random

Nothing here knows the formulas of section 10. A tooth is a body in a plane. Its contacts are points; their velocities
are differences of the velocities of the two bodies there, taken as vectors, with the tooth's centre, the ring's curve
and its normal differentiated numerically. Each contact sticks or slips one way or the other; every combination is
tried, its forces are solved from the two balances of forces and the one of moments, and it counts where its own
velocities and forces bear it out. Power is torque times speed of the three members; that what goes in is what comes
out and what friction takes is checked to 1e-30.

The force of the wave generator on each tooth is given: that without friction, shared by virtual work over three equal
stiffnesses.

`limit` has the loss with all coefficients scaled by 1e-20, divided by that scale: first order, to some 19 digits. `exact`
has the efficiencies at the coefficients themselves, null where the drive jams.
"""

import json
import math
import sys
from fractions import Fraction
from itertools import product
from pathlib import Path
from random import Random
from types import SimpleNamespace

from mpmath import mp, mpf

mp.dps = 60
STEP = mpf(10) ** -18          # central differences: errors of STEP^2 and of 10^-dps/STEP
SMALL = mpf(10) ** -20         # the scale of the coefficients that stands for the limit
CONTACTS = ("wave_generator", "ring", "carrier")
H, K, S = 0, 1, 2

ELLIPSE, HARMONIC, HARMONIC_PATH = "ellipse", "harmonic", "harmonic_path"

# name, cam, its two lengths, lobes, Z_G, Z'_G, Z_K, r, input angles as parts of a period
DRIVES = [
    ("5.1", ELLIPSE, 58.0, 56.0, 2, 28, 28, 26, 5.0, (0.0, 0.37)),
    ("5.2 undercut", ELLIPSE, 50.7, 49.3, 2, 80, 40, 78, 1.5, (0.0, 0.63)),
    ("ellipse, carrier against the input", ELLIPSE, 58.0, 56.0, 2, 28, 28, 30, 4.0, (0.0, 0.37)),
    ("ellipse, zones unlike", ELLIPSE, 58.0, 56.0, 2, 27, 27, 25, 5.0, (0.23,)),
    ("eccentric, carrier against the input", HARMONIC, 30.8, 1.2, 1, 20, 20, 21, 2.0, (0.0, 0.41)),
    ("eccentric, carrier with the input", HARMONIC, 30.8, 1.2, 1, 20, 20, 19, 2.5, (0.19,)),
    ("eccentric, steep, undercut", HARMONIC, 20.0, 3.0, 1, 11, 11, 10, 3.5, (0.0, 0.5)),
    ("harmonic, three lobes", HARMONIC, 48.0, 1.0, 3, 36, 36, 33, 2.5, (0.31,)),
    ("harmonic path, three lobes", HARMONIC_PATH, 52.0, 1.0, 3, 33, 33, 36, 2.0, (0.31,)),
    ("harmonic, nearly round", HARMONIC, 50.0, 0.3, 2, 102, 102, 100, 1.0, (0.5,)),
    ("harmonic, few teeth", HARMONIC, 40.0, 2.5, 2, 16, 16, 14, 5.0, (0.27,)),
]

# name, wave generator, spins, coefficients at the wave generator, ring and carrier, bearing's coefficient
FRICTIONS = [
    ("plain, equal", "plain", True, (0.05, 0.05, 0.05), 0.0),
    ("plain, unlike", "plain", True, (0.02, 0.08, 0.05), 0.0),
    ("plain, the ring's low", "plain", True, (0.05, 0.006, 0.09), 0.0),
    ("plain, flat-sided", "plain", False, (0.03, 0.05, 0.07), 0.0),
    ("race, equal", "race", True, (0.05, 0.05, 0.05), 0.0015),
    ("race, unlike", "race", True, (0.03, 0.09, 0.05), 0.003),
    ("race, stiff bearing", "race", True, (0.02, 0.02, 0.02), 0.05),
    ("race, flat-sided", "race", False, (0.05, 0.05, 0.05), 0.0015),
    ("rolling, equal", "rolling", True, (0.05, 0.05, 0.05), 0.0015),
    ("rolling, unlike", "rolling", True, (0.05, 0.03, 0.08), 0.0),
    ("rolling, flat-sided", "rolling", False, (0.05, 0.05, 0.03), 0.0015),
]


# ---------------------------------------------------------------------------------------------------------
# Geometry: curves, differentiated numerically
# ---------------------------------------------------------------------------------------------------------

class Drive:
    """A drive; its cam as a curve of contact points with normals, over a parameter that runs with the position."""

    def __init__(self, name, cam, first, second, lobes, teeth, installed, ring_teeth, radius, moments):
        self.name, self.cam, self.moments = name, cam, moments
        self.first, self.second, self.radius = mpf(first), mpf(second), mpf(radius)
        self.lobes, self.teeth, self.installed, self.ring_teeth = lobes, teeth, installed, ring_teeth
        self.k = mpf(ring_teeth) / lobes
        self.sense = 1 if teeth > ring_teeth else -1
        self.alike = installed % lobes == 0
        self.found = {}

    def race_radius(self):
        if self.cam == ELLIPSE:
            return (self.first + self.second) / 2
        return self.first - self.radius if self.cam == HARMONIC_PATH else self.first

    def touch(self, t):
        """Point on the cam, its outward normal and the tooth's centre, at the parameter t."""
        if self.cam == ELLIPSE:                       # the ellipse's own parameter
            cos, sin = mp.cos_sin(t)
            length = mp.sqrt((self.second * cos) ** 2 + (self.first * sin) ** 2)
            point = (self.first * cos, self.second * sin)
            normal = (self.second * cos / length, self.first * sin / length)
        elif self.cam == HARMONIC:                    # the normal's angle
            cos, sin = mp.cos_sin(t)
            support = self.first + self.second * mp.cos(self.lobes * t)
            slope = -self.second * self.lobes * mp.sin(self.lobes * t)
            point = (support * cos - slope * sin, support * sin + slope * cos)
            normal = (cos, sin)
        else:                                         # the centre's polar angle
            cos, sin = mp.cos_sin(t)
            distance = self.first + self.second * mp.cos(self.lobes * t)
            slope = -self.second * self.lobes * mp.sin(self.lobes * t)
            tangent = (slope * cos - distance * sin, slope * sin + distance * cos)
            length = mp.sqrt(tangent[0] ** 2 + tangent[1] ** 2)
            normal = (tangent[1] / length, -tangent[0] / length)
            point = (distance * cos - self.radius * normal[0], distance * sin - self.radius * normal[1])
        return point, normal, (point[0] + self.radius * normal[0], point[1] + self.radius * normal[1])

    def parameter(self, psi):
        """The parameter of the tooth whose centre stands at psi: some bisection, then the secant method."""
        if self.cam == HARMONIC_PATH:
            return psi
        cos, sin = mp.cos_sin(psi)

        def beyond(t):
            center = self.touch(t)[2]
            return center[1] * cos - center[0] * sin
        low, high = psi - mpf("0.2"), psi + mpf("1.2")
        for _ in range(24):
            middle = (low + high) / 2
            low, high = (middle, high) if beyond(middle) < 0 else (low, middle)
        before, t = low, high
        value_before, value = beyond(before), beyond(t)
        for _ in range(40):
            if value == value_before or abs(t - before) < mpf(10) ** (5 - mp.dps):
                return t
            before, t, value_before = t, t - value * (t - before) / (value - value_before), value
            value = beyond(t)
        raise ArithmeticError("no tooth there")

    def cam_contact(self, psi):
        if psi not in self.found:
            self.found[psi] = self.touch(self.parameter(psi))
        return self.found[psi]

    def distance(self, psi):
        center = self.cam_contact(psi)[2]
        return mp.sqrt(center[0] ** 2 + center[1] ** 2)

    def ring_path(self, psi):
        """The tooth's centre in the ring's frame."""
        theta = -self.sense * psi / self.k
        distance = self.distance(psi)
        return (distance * mp.cos(theta), distance * mp.sin(theta))

    def ring_contact(self, psi):
        """Point and outward normal of the ring's flank, in the ring's frame."""
        before, after = self.ring_path(psi - STEP), self.ring_path(psi + STEP)
        tangent = (after[0] - before[0], after[1] - before[1])
        length = mp.sqrt(tangent[0] ** 2 + tangent[1] ** 2)
        center = self.ring_path(psi)
        normal = (tangent[1] / length, -tangent[0] / length)
        if normal[0] * center[0] + normal[1] * center[1] < 0:
            normal = (-normal[0], -normal[1])
        return (center[0] + self.radius * normal[0], center[1] + self.radius * normal[1]), normal

    def flank_end(self):
        """Where the flank comes to the middle of the ring's tooth: the tip, or before it with undercut."""
        pitch = mp.pi / self.ring_teeth

        def short(psi):
            point = self.ring_contact(psi)[0]
            return pitch - abs(mp.atan2(point[1], point[0]))
        end = mp.pi / self.lobes
        grid = [end * i / 60 for i in range(1, 60)]
        for before, after in zip(grid, grid[1:]):
            if short(after) < 0:
                for _ in range(60):
                    middle = (before + after) / 2
                    before, after = (middle, after) if short(middle) > 0 else (before, middle)
                return before
        return end

    def positions(self, moment):
        """Position and lobe of the teeth in mesh, of one zone if zones are alike, when a part of a period has passed."""
        end, found = self.flank_end(), []
        part = Fraction(moment)
        for tooth in range(self.installed):
            for lobe in range(1 if self.alike else self.lobes):
                # 2 pi i/Z' - j Z_K/Z_G with j = part 2 pi m/Z_K, m = Z_G/Z', from the lobe's middle
                turn = Fraction(tooth, self.installed) - part / self.installed - Fraction(lobe, self.lobes)
                turn -= math.floor(turn)
                psi = 2 * mp.pi * turn.numerator / turn.denominator
                # At a regular tip a tooth has no lever arm and no force.
                if 0 < turn < Fraction(1, 2 * self.lobes) and psi <= end:
                    found.append((psi, lobe))
        return found


def rotated(vector, angle):
    cos, sin = mp.cos_sin(angle)
    return (vector[0] * cos - vector[1] * sin, vector[0] * sin + vector[1] * cos)


def left_of(vector):
    return (-vector[1], vector[0])


def dot(one, other):
    return one[0] * other[0] + one[1] * other[1]


def cross(one, other):
    return one[0] * other[1] - one[1] * other[0]


def length(vector):
    return mp.sqrt(dot(vector, vector))


def difference(one, other):
    return (one[0] - other[0], one[1] - other[1])


def tooth_at(drive, psi, lobe):
    """Everything about a tooth that does not hang on friction, in its slot's frame: x outward, y counter-clockwise.
    Velocities are for a wave generator that turns counter-clockwise at 1 rad/s against the carrier."""
    r = drive.radius
    point, normal, center = drive.cam_contact(psi)
    distance = length(center)
    ring_point, ring_normal = drive.ring_contact(psi)
    turn = drive.sense * psi / drive.k                    # from the ring's frame to the slot's
    middle = (distance, mpf(0))
    # From the tooth's centre: the cam lies inward along its normal, the ring outward, the slot's wall ahead of the tooth
    # or behind it, whichever the sense of rotation loads.
    outward = [tuple(-value for value in rotated(normal, -psi)), rotated(ring_normal, turn), (mpf(0), mpf(drive.sense))]
    points = [(middle[0] + r * n[0], middle[1] + r * n[1]) for n in outward]
    assert length(difference(points[H], rotated(point, -psi))) < mpf(10) ** -30
    assert length(difference(points[K], rotated(ring_point, turn))) < mpf(10) ** -15
    # The tooth's centre: psi falls as fast as the wave generator turns.
    velocity = (-(drive.distance(psi + STEP) - drive.distance(psi - STEP)) / (2 * STEP), mpf(0))
    turning = [mpf(1), -drive.sense / drive.k, mpf(0)]    # cam, ring and carrier against the carrier
    tangents = [left_of(n) for n in outward]
    slips = []
    for contact in (H, K, S):
        body = tuple(turning[contact] * value for value in left_of(points[contact]))
        slips.append(dot(difference(velocity, body), tangents[contact]))
    # How fast the point of contact moves over each part.
    after, before = drive.cam_contact(psi + STEP)[0], drive.cam_contact(psi - STEP)[0]
    ring_after, ring_before = drive.ring_contact(psi + STEP)[0], drive.ring_contact(psi - STEP)[0]
    advance = [length(difference(after, before)) / (2 * STEP),
               length(difference(ring_after, ring_before)) / (2 * STEP), abs(velocity[0])]
    pushes = [tuple(-value for value in n) for n in outward]              # what each part does to the tooth
    # Without friction: F_K and F_S for F_H = 1.
    determinant = cross(pushes[K], pushes[S])
    ratios = [mpf(1), -cross(pushes[H], pushes[S]) / determinant, -cross(pushes[K], pushes[H]) / determinant]
    lever = cross(points[H], outward[H])
    tan_gamma = -outward[H][1] / -outward[H][0]
    # The cam's curvature from its normals, the path's from the ring's: both as turning over way.
    turned = cross(drive.cam_contact(psi - STEP)[1], drive.cam_contact(psi + STEP)[1])
    along = dot(difference(after, before), left_of(normal))
    flank_turned = cross(drive.ring_contact(psi - STEP)[1], drive.ring_contact(psi + STEP)[1])
    path_after, path_before = drive.ring_path(psi + STEP), drive.ring_path(psi - STEP)
    path_along = dot(difference(path_after, path_before), left_of(ring_normal))
    return SimpleNamespace(
        psi=psi, lobe=lobe, r=r, distance=distance, points=points, pushes=pushes, tangents=tangents, slips=slips,
        ratios=ratios, lever=abs(lever), tan_gamma=tan_gamma, advance=advance,
        cam_curvature=turned / along, regularity=1 + r * flank_turned / path_along)


def on_other_wall(tooth):
    """The same tooth against the other wall of its slot, where friction may press it: the slot has no play."""
    opposite = SimpleNamespace(**vars(tooth))
    opposite.points = tooth.points[:2] + [(tooth.points[S][0], -tooth.points[S][1])]
    opposite.pushes, opposite.tangents = list(tooth.pushes), list(tooth.tangents)
    opposite.pushes[S] = tuple(-value for value in tooth.pushes[S])
    opposite.tangents[S] = tuple(-value for value in tooth.tangents[S])
    opposite.slips = tooth.slips[:2] + [-tooth.slips[S]]
    return opposite


def with_forces(teeth, torque):
    """The wave generator's forces without friction, by virtual work over three equal stiffnesses."""
    shares = [tooth.lever / sum(ratio ** 2 for ratio in tooth.ratios) for tooth in teeth]
    scale = torque / sum(share * tooth.lever for share, tooth in zip(shares, teeth))
    for share, tooth in zip(shares, teeth):
        tooth.force = scale * share
    return teeth


# ---------------------------------------------------------------------------------------------------------
# Equilibrium with friction
# ---------------------------------------------------------------------------------------------------------

def determinant3(columns):
    (a, b, c), (d, e, f), (g, h, i) = columns
    return a * (e * i - f * h) - d * (b * i - c * h) + g * (b * f - c * e)


def solve3(columns, right):
    whole = determinant3(columns)
    if whole == 0:
        return None
    return [determinant3([right if i == j else columns[j] for j in range(3)]) / whole for i in range(3)]


def equilibria(tooth, coefficients, spins, direction, race):
    """The equilibrium of a tooth, against either wall of its slot, if there is one."""
    found = (one_wall(tooth, coefficients, spins, direction, race)
             or one_wall(on_other_wall(tooth), coefficients, spins, direction, race))
    assert len(found) <= 1, "more than one equilibrium"
    return found


def one_wall(tooth, coefficients, spins, direction, race):
    """Every equilibrium of a tooth against one wall: normal forces, friction (along the counter-clockwise tangents) and the
    contact that sticks. The motion has the sense `direction`; `race` is the speed that a race adds to the cam's surface."""
    speeds = [direction * tooth.slips[H] - race, direction * tooth.slips[K], direction * tooth.slips[S]]
    force = tooth.force
    given = [force * tooth.pushes[H][0], force * tooth.pushes[H][1]]
    found = []
    if not spins:
        # No spin: the slot's flat takes up the couple.
        signs = [(speed > 0) - (speed < 0) for speed in speeds]
        cam_friction = -signs[H] * coefficients[H] * force
        columns = []
        for contact in (K, S):
            friction = -signs[contact] * coefficients[contact]
            columns.append([tooth.pushes[contact][axis] + friction * tooth.tangents[contact][axis] for axis in (0, 1)])
        right = [-(given[axis] + cam_friction * tooth.tangents[H][axis]) for axis in (0, 1)]
        whole = cross(columns[0], columns[1])
        if whole == 0:
            return []
        ring, carrier = cross(right, columns[1]) / whole, cross(columns[0], right) / whole
        if ring < 0 or carrier < 0:
            return []
        forces = [force, ring, carrier]
        frictions = [-sign * coefficient * normal for sign, coefficient, normal in zip(signs, coefficients, forces)]
        return [SimpleNamespace(tooth=tooth, forces=forces, frictions=frictions, sticks=None)]
    for regime in product((-1, 0, 1), repeat=3):
        sticking = [contact for contact in (H, K, S) if regime[contact] == 0]
        if len(sticking) != 1:
            # All three slipping: three equations for two unknown forces. Two sticking: their speeds would be alike.
            continue
        stick = sticking[0]
        slips = [speed - speeds[stick] for speed in speeds]                # the spin stops the sticking one
        if any(slips[contact] * regime[contact] <= 0 for contact in (H, K, S) if contact != stick):
            continue
        # Unknown: ring's and carrier's normal forces, and the friction that sticks. Balances: x, y, moment over r.
        columns, right = [], [-given[0], -given[1], mpf(0) if isinstance(force, mpf) else 0.0]
        for contact in (K, S):
            friction = -regime[contact] * coefficients[contact]
            tangent = tooth.tangents[contact]
            columns.append([tooth.pushes[contact][0] + friction * tangent[0],
                            tooth.pushes[contact][1] + friction * tangent[1], friction])
        columns.append([tooth.tangents[stick][0], tooth.tangents[stick][1], 1])
        cam_friction = -regime[H] * coefficients[H] * force
        right[0] -= cam_friction * tooth.tangents[H][0]
        right[1] -= cam_friction * tooth.tangents[H][1]
        right[2] -= cam_friction
        solution = solve3(columns, right)
        if solution is None:
            continue
        ring, carrier, sticking_friction = solution
        forces = [force, ring, carrier]
        if ring < 0 or carrier < 0 or abs(sticking_friction) > coefficients[stick] * forces[stick]:
            continue
        frictions = [-regime[contact] * coefficients[contact] * forces[contact] for contact in (H, K, S)]
        frictions[stick] = sticking_friction
        found.append(SimpleNamespace(tooth=tooth, forces=forces, frictions=frictions, sticks=stick))
    return found


def weighted(states, weight):
    """The states with their share in a mixture."""
    return [SimpleNamespace(**{**vars(state), "weight": weight}) for state in states]


def balanced(drive, teeth, friction, direction):
    """All teeth in equilibrium, the race's speed, the bearing's couple on the wave generator and its power; None where the
    drive jams."""
    _, kind, spins, coefficients, bearing = friction
    bearing_radius = drive.bearing_radius
    load = sum(tooth.force for tooth in teeth)

    def all_at(race, cam_slides=True):
        used = coefficients if cam_slides else (0 * coefficients[H], *coefficients[1:])
        found = [equilibria(tooth, used, spins, direction, race) for tooth in teeth]
        return weighted([states[0] for states in found], 1) if all(found) else None

    if kind != "race":
        race = direction * drive.race if kind == "rolling" else 0
        states = all_at(race, cam_slides=kind == "plain")
        couple = bearing * bearing_radius * load if kind == "rolling" else 0
        return states and SimpleNamespace(states=states, race=race, couple=couple, bearing_power=couple)
    # A free race: friction of the teeth along it and of the bearing balance. Between the speeds at which some tooth has
    # two alike no regime changes, so the sum along the race is constant there.
    drag = bearing * bearing_radius / drive.race * load
    places = {0}
    for tooth in teeth:
        places.add(direction * (tooth.slips[H] - tooth.slips[K]) if spins else direction * tooth.slips[H])
        if spins:
            places.add(direction * (tooth.slips[H] - tooth.slips[S]))
    places = sorted(places)
    middles = [places[0] - 1] + [(one + two) / 2 for one, two in zip(places, places[1:])] + [places[-1] + 1]
    # The teeth drag the race along the clockwise tangent by minus their friction.
    sums = []
    for middle in middles:
        states = all_at(middle)
        pull = states and -sum(state.frictions[H] for state in states)
        sums.append(states and (pull - (drag if middle > 0 else -drag), states))
    for place, before, after in zip(places, sums, sums[1:]):
        if before is None or after is None:
            continue
        if before[0] >= 0 >= after[0]:
            # At the place itself two contacts of a tooth stick at once; of the forces that this leaves open, which are the
            # mixtures of both sides, that one stands in which the race is in balance.
            share = before[0] / (before[0] - after[0]) if before[0] != after[0] else 0
            states = weighted(before[1], 1 - share) + weighted(after[1], share)
            pull = -sum(state.weight * state.frictions[H] for state in states)
            assert abs(pull) <= drag * (1 + 1e-12) + 1e-12 * load
            return SimpleNamespace(states=states, race=place, couple=0, bearing_power=pull * place)
    return None


def turn(drive, teeth, friction, direction):
    """The efficiencies in one sense of rotation at |omega_HS| = 1 and what friction takes; None where the drive jams."""
    result = balanced(drive, teeth, friction, direction)
    if not result:
        return None
    torques = [-direction * result.couple, 0, direction * result.couple]     # on cam, ring and carrier
    lost, lost_by = result.bearing_power, [0, 0, 0]
    for state in result.states:
        tooth = state.tooth
        speeds = [direction * tooth.slips[H] - result.race, direction * tooth.slips[K], direction * tooth.slips[S]]
        # The spin's own work is nil where the moments balance, or where there is none.
        spin = 0 if state.sticks is None else speeds[state.sticks]
        for contact in (H, K, S):
            onto = [-(state.forces[contact] * tooth.pushes[contact][axis]
                      + state.frictions[contact] * tooth.tangents[contact][axis]) for axis in (0, 1)]
            torques[contact] += state.weight * cross(tooth.points[contact], onto)
            work = -state.weight * state.frictions[contact] * (speeds[contact] - spin)
            lost_by[contact] += work
            lost += work
        # Where the tooth cannot spin the slot takes up the couple; where it can there is none.
        torques[S] += state.weight * tooth.r * sum(state.frictions)
    turning = [direction, -direction * drive.sense / drive.k, 0]
    found, worst = {}, 0
    forwards = {"ring_fixed": (H, S, direction == 1), "carrier_fixed": (H, K, direction == 1),
                "wave_generator_fixed": (K, S, direction == -drive.sense)}
    for fixed, (source, sink, is_forwards) in forwards.items():
        still = ({H, K, S} - {source, sink}).pop()
        powers = [torque * (speed - turning[still]) for torque, speed in zip(torques, turning)]
        worst = max(worst, abs(sum(powers) + lost) / max(abs(power) for power in powers))
        if not is_forwards:
            source, sink, fixed = sink, source, fixed + "_back_driven"
        found[fixed] = powers[sink] / -powers[source] if powers[source] < 0 else None
    return SimpleNamespace(found=found, lost=lost, lost_by=lost_by, result=result, balance=worst)


def scaled(friction, factor):
    name, kind, spins, coefficients, bearing = friction
    return name, kind, spins, tuple(factor * value for value in coefficients), factor * bearing


def in_doubles(tooth):
    """The same tooth in doubles: for surveys of many."""
    def plain(value):
        if isinstance(value, mpf):
            return float(value)
        return type(value)(plain(item) for item in value) if isinstance(value, (list, tuple)) else value
    return SimpleNamespace(**{name: plain(value) for name, value in vars(tooth).items()})


def built(row):
    drive = Drive(*row)
    drive.race = drive.race_radius()
    drive.bearing_radius = drive.race * mpf("0.9")
    moments = []
    for moment in drive.moments:
        teeth = [tooth_at(drive, psi, lobe) for psi, lobe in drive.positions(moment)]
        moments.append(with_forces(teeth, mpf(20000)))
    return drive, moments


# ---------------------------------------------------------------------------------------------------------
# What is written
# ---------------------------------------------------------------------------------------------------------

FACTORS = (1.0, 0.25, 0.0625)


def digits(value):
    return mp.nstr(value, 20)


def radial_load(drive, teeth):
    """What the teeth's normal forces come to on the wave generator, in its frame; all zones, point by point."""
    total = [mpf(0), mpf(0)]
    for turned in range(drive.lobes if drive.alike else 1):
        for tooth in teeth:
            normal = rotated(drive.cam_contact(tooth.psi)[1], 2 * mp.pi * (tooth.lobe + turned) / drive.lobes)
            total = [total[axis] - tooth.force * normal[axis] for axis in (0, 1)]
    return total


def limit_of(drive, teeth, friction):
    small = tuple(SMALL * mpf(value) for value in friction[3])
    found = turn(drive, teeth, (friction[0], friction[1], friction[2], small, SMALL * mpf(friction[4])), 1)
    assert found.balance < mpf(10) ** -30, (drive.name, friction[0], found.balance)
    result, slips, sticks = found.result, [], []
    for state in result.states[:len(teeth)]:
        speeds = [state.tooth.slips[H] - result.race, state.tooth.slips[K], state.tooth.slips[S]]
        spin = 0 if state.sticks is None else speeds[state.sticks]
        slips.append([digits(speed - spin) for speed in speeds])
        sticks.append(None if state.sticks is None else CONTACTS[state.sticks])
    work = dict(zip(CONTACTS, (digits(value / SMALL) for value in found.lost_by)))
    return {"race_mm_per_rad": digits(result.race), "slip_mm_per_rad": slips, "rolls": sticks,
            "work_nmm_per_rad": work, "bearing_nmm_per_rad": digits(result.bearing_power / SMALL)}


def exact_of(drive, teeth, friction):
    rows = []
    for factor in FACTORS:
        row = {"factor": factor}
        for direction in (1, -1):
            found = turn(drive, teeth, scaled(friction, factor), direction)
            assert found is None or found.balance < 1e-9
            if found:
                row.update(found.found)
        rows.append(row)
    return rows


def doubled(drive):
    """The drive's numbers that equilibria need, in doubles."""
    return SimpleNamespace(race=float(drive.race), bearing_radius=float(drive.bearing_radius), k=float(drive.k),
                           sense=drive.sense)


def case_of(drive, moment, teeth):
    plain = [in_doubles(tooth) for tooth in teeth]
    rows = [{"position_rad": tooth.psi, "lobe": tooth.lobe, "center_radius_mm": tooth.distance,
             "tan_pressure_angle": tooth.tan_gamma, "regularity": tooth.regularity,
             "cam_curvature_per_mm": tooth.cam_curvature,
             "force_n": [tooth.force * ratio for ratio in tooth.ratios],
             "advance_mm_per_rad": tooth.advance} for tooth in plain]
    frictions = []
    for friction in FRICTIONS:
        name, kind, spins, coefficients, bearing = friction
        frictions.append({"name": name, "wave_generator": kind, "spins": spins, "coefficient": coefficients,
                          "bearing_coefficient": bearing, "limit": limit_of(drive, teeth, friction),
                          "exact": exact_of(doubled(drive), plain, friction)})
    return {"name": drive.name, "moment": moment, "lobes": drive.lobes, "teeth": drive.teeth,
            "installed": drive.installed, "ring_teeth": drive.ring_teeth, "tooth_radius_mm": float(drive.radius),
            "race_radius_mm": float(drive.race), "bearing_radius_mm": float(drive.bearing_radius),
            "radial_load_n": [digits(value) for value in radial_load(drive, teeth)],
            "placed": rows, "frictions": frictions}


def write():
    cases = []
    for row in DRIVES:
        drive, moments = built(row)
        for moment, teeth in zip(drive.moments, moments):
            cases.append(case_of(drive, moment, teeth))
        print(drive.name, file=sys.stderr)
    lines = ",\n".join(json.dumps(case) for case in cases)
    Path(__file__).with_name("friction.json").write_text('{"cases": [\n' + lines + "\n]}\n")


# ---------------------------------------------------------------------------------------------------------
# How far first order reaches
# ---------------------------------------------------------------------------------------------------------

LEVELS = (0.01, 0.03, 0.05, 0.1, 0.15)
# Coefficients at the wave generator, ring, carrier and bearing.
RATIOS = ((1, 1, 1, 0.03), (0.3, 1, 1, 0.03), (1, 0.3, 1, 0.03), (1, 1, 0.3, 0.03), (1, 0.3, 0.3, 0.03),
          (1, 1, 1, 0.3), (1, 0.3, 0.3, 0.3), (0.3, 1, 1, 1), (1, 1, 1, 3))


def told(drive, friction):
    """The bound of section 10.6 over the loss, and whether the coefficients lie within its range."""
    _, kind, spins, coefficients, bearing = friction
    of_bearing = 0 if kind == "plain" else bearing * drive.bearing_radius / drive.race
    along = {"plain": max(coefficients), "race": min(coefficients[H], of_bearing), "rolling": 0}[kind]
    largest = max(*coefficients[H if kind != "rolling" else K:], of_bearing)
    share = 0 if kind == "plain" else 2.5 if spins else 9.5
    return share * largest + 10 * along, largest <= 0.1 and along <= 0.05


def drawn(random):
    """A drive of any kind, of one to four lobes and either sense, that can be built and always has a tooth in mesh."""
    while True:
        lobes = random.choice((1, 1, 2, 2, 2, 3, 4))
        cam = ELLIPSE if lobes == 2 and random.random() < 0.5 else random.choice((HARMONIC, HARMONIC, HARMONIC_PATH))
        ring_teeth = lobes * random.randint(5, 45)
        teeth = ring_teeth + random.choice((-1, 1)) * lobes
        room = math.sin(math.pi / teeth)
        radius = random.uniform(0.35, 0.85) * 50 * room / (1 - room)
        rise = random.uniform(0.3, 0.95) * min(radius, 50 / max(1, 3 * (lobes ** 2 - 1)))
        if cam == HARMONIC_PATH and radius > 0.5 * (50 - rise):
            continue
        lengths = (50 + rise, 50 - rise) if cam == ELLIPSE else (50 + (radius if cam == HARMONIC_PATH else 0), rise)
        drive = Drive("drawn", cam, *lengths, lobes, teeth, teeth, ring_teeth, radius, (random.random(),))
        end = drive.flank_end()
        tip = drive.ring_contact(end)[0]
        if length(tip) > 1.005 * (50 + rise) and end > 2.2 * mp.pi / teeth:
            return drive


def errors_of(drive, moment):
    """Wave generator, spins, coefficient, fixed member, error of the efficiency and what section 10.6 says of it."""
    positions = drive.positions(moment)
    teeth = [in_doubles(tooth) for tooth in with_forces([tooth_at(drive, *place) for place in positions], mpf(20000))]
    torque = sum(tooth.force * tooth.lever for tooth in teeth)
    shares = {"ring_fixed": drive.ring_teeth / drive.teeth, "carrier_fixed": 1.0,
              "wave_generator_fixed": drive.lobes / drive.teeth}
    plain = doubled(drive)
    for kind, spins, ratio in product(("plain", "race", "rolling"), (True, False), RATIOS):
        if kind == "rolling" and ratio[0] != 1 or kind != "race" and ratio[3] != 0.03:
            continue
        unit = ("", kind, spins, ratio[:3], ratio[3])
        limit = turn(plain, teeth, scaled(unit, 1e-7), 1).lost / torque * 1e7
        for level in LEVELS:
            found = {}
            for direction in (1, -1):
                turned = turn(plain, teeth, scaled(unit, level), direction)
                if turned:
                    assert turned.balance < 1e-8
                    found.update(turned.found)
            for fixed, share in shares.items():
                loss = limit * level * share
                for name, first in ((fixed, 1 / (1 + loss)), (fixed + "_back_driven", 1 - loss)):
                    exact = found.get(name)
                    bound, is_within = told(plain, scaled(unit, level))
                    error = None if exact is None else exact - first
                    label = kind if ratio[3] == 0.03 else "race on a stiff bearing"
                    yield label, spins, level, name, error, bound * loss, is_within


def survey(count):
    """The largest errors over the drives above and as many drawn ones, and over what section 10.6 says of them."""
    random = Random(1)
    worst = {}
    drives = [Drive(*row) for row in DRIVES] + [drawn(random) for _ in range(count)]
    for drive in drives:
        drive.race = drive.race_radius()
        drive.bearing_radius = drive.race * mpf("0.9")
        for kind, spins, level, name, error, bound, is_within in errors_of(drive, drive.moments[0]):
            entry = worst.setdefault((kind, spins, name, level), [0, 0, 0, 0, ""])
            entry[0] += 1
            if error is None:
                entry[1] += 1
                continue
            entry[2] = max(entry[2], abs(error))
            if is_within and abs(error) > entry[3] * bound:
                entry[3] = abs(error) / bound
                entry[4] = f"{drive.name} {drive.cam} U {drive.lobes} Z_G {drive.teeth} Z_K {drive.ring_teeth} " \
                           f"lengths {float(drive.first):.4g} {float(drive.second):.4g} r {float(drive.radius):.4g}"
    for (kind, spins, name, level), (tried, jammed, error, share, where) in sorted(worst.items()):
        print(f"{kind:23} {'spins' if spins else 'flat':6} {name:34} {level:<6} {tried:5} {jammed:4} jam"
              f"  error {error:.5f}  of what is told {share:.3f}  {where}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["ranges"]:
        survey(int(sys.argv[2]))
    else:
        write()
