#!/usr/bin/env python3
"""Baseline (iii): the paper's method as a plain NumPy script.

At each input angle: the teeth's contacts with the cam by Newton's method, the 3n equations [1], [2], [6] with [7] by
np.linalg.solve, and the twelve columns of a sweep. Newton's method runs either tooth by tooth, as the paper tells it, or
over all teeth at once, as NumPy is best used.

    paper.py             times a few sweeps of case 5.1 and prints a table
    paper.py --serve     for the benchmark: reads "time METHOD INTERVALS REPEATS" or "columns METHOD INTERVALS" line by
                         line and answers each with a line of JSON, so that its runs take turns with those of the others
"""

import json
import statistics
import sys
import time

import numpy as np

CASE_5_1 = {
    "a": 58.0, "b": 56.0, "r": 5.0, "width": 15.0,
    "teeth": 28, "installed": 28, "ring_teeth": 26,
    "youngs_modulus_mpa": 210e3, "poissons_ratio": 0.3, "torque_nmm": 20e3,
}
WAVES = 2


def support(a, b, chi):
    """The cam's support function with two derivatives, the first without its sign; χ = π/2 - φ is the normal's angle."""
    sin, cos = np.sin(chi), np.cos(chi)
    h = np.sqrt(a**2 * sin**2 + b**2 * cos**2)
    h1 = (a**2 - b**2) * sin * cos / h
    h2 = ((a**2 - b**2) * np.cos(2 * chi) - h1**2) / h
    return h, h1, h2


def normal_angle(a, b, r, x):
    """χ from x = χ + atan(|h'|/(h + r)), of one tooth or of many; x = π/2 - ψ is the position."""
    chi = x
    for _ in range(50):
        h, h1, h2 = support(a, b, chi)
        residual = chi + np.arctan(h1 / (h + r)) - x
        step = residual * ((h + r) ** 2 + h1**2) / ((h + r) * (h + r + h2))
        chi = chi - step
        if np.max(np.abs(step)) < 1e-9:
            break
    return chi


def normal_angles_tooth_by_tooth(a, b, r, x):
    return np.array([normal_angle(a, b, r, one) for one in x])


METHODS = {"tooth-by-tooth": normal_angles_tooth_by_tooth, "all-at-once": normal_angle}


def solve_forces(case, lever, gamma, beta):
    """F_H, F_K, F_S of each tooth; the three stiffnesses are alike and cancel."""
    n = len(lever)
    s = np.sign(case["teeth"] - case["ring_teeth"])
    matrix, right = np.zeros((3 * n, 3 * n)), np.zeros(3 * n)
    displacement = np.column_stack([np.ones(n), np.cos(gamma + s * beta), s * np.sin(gamma)])
    for i in range(n):
        matrix[2 * i, 3 * i : 3 * i + 3] = np.cos(gamma[i]), -np.cos(beta[i]), 0.0
        matrix[2 * i + 1, 3 * i : 3 * i + 3] = np.sin(gamma[i]), s * np.sin(beta[i]), -s
        matrix[2 * n, 3 * i] = WAVES * lever[i]
        if i + 1 < n:
            row = matrix[2 * n + 1 + i]
            row[3 * i : 3 * i + 3] = displacement[i] * lever[i + 1]
            row[3 * i + 3 : 3 * i + 6] = -displacement[i + 1] * lever[i]
    right[2 * n] = case["torque_nmm"]
    return np.linalg.solve(matrix, right).reshape(n, 3)


def sweep(case, intervals, normal_angles):
    """One row a state: input angle, tooth, position, d, φ_H, φ_K, three forces, three stresses."""
    a, b, r, width = case["a"], case["b"], case["r"], case["width"]
    k = case["ring_teeth"] / WAVES
    removal = case["teeth"] / case["installed"]
    period = 2 * np.pi * removal / case["ring_teeth"]
    modulus = case["youngs_modulus_mpa"] / (2 * (1 - case["poissons_ratio"] ** 2))
    steps = intervals * case["installed"]
    rows = []
    for interval in range(intervals + 1):
        tooth = np.arange(1, case["installed"] // 4 + 2)
        step = tooth * intervals - interval
        in_mesh = (step > 0) & (4 * step <= steps)
        tooth, x = tooth[in_mesh], np.pi / 2 * (steps - 4 * step[in_mesh]) / steps

        chi = normal_angles(a, b, r, x)
        h, h1, h2 = support(a, b, chi)
        d = np.hypot(h + r, h1)
        tan_gamma = h1 / (h + r)
        gamma, beta = np.arctan(tan_gamma), np.arctan(k * tan_gamma)
        forces = solve_forces(case, h1, gamma, beta)

        sin, cos = np.sin(chi), np.cos(chi)
        cam_angle = np.arctan2(h * sin + h1 * cos, h * cos - h1 * sin)
        ring_angle = x / k - np.arctan(r * np.sin(beta) / (d + r * np.cos(beta)))
        tan_slope = (h1**2 - h2 * (h + r)) / (h + r) ** 2 * d**2 / ((h + r) * (h + r + h2))
        kappa = np.cos(beta) / d * (1 + k**2 * tan_slope / (1 + (k * tan_gamma) ** 2))
        curvature = np.column_stack([1 / r + 1 / (h + h2), 1 / (r * (1 + r * kappa)), np.full(len(x), 1 / r)])
        stress = np.sqrt(forces * curvature * modulus / (np.pi * width))

        input_angle = np.full(len(x), np.degrees(period * interval / intervals))
        angles = np.degrees(np.column_stack([cam_angle, ring_angle]))
        rows.append(np.column_stack([input_angle, tooth, 90 - np.degrees(x), d, angles, forces, stress]))
    return np.vstack(rows)


def seconds(intervals, normal_angles):
    start = time.perf_counter()
    sweep(CASE_5_1, intervals, normal_angles)
    return time.perf_counter() - start


def serve():
    print(json.dumps({"numpy": np.__version__, "python": sys.version.split()[0]}), flush=True)
    for line in sys.stdin:
        command, method, intervals, *repeats = line.split()
        if command == "time":
            answer = sum(seconds(int(intervals), METHODS[method]) for _ in range(int(repeats[0])))
        else:
            answer = sweep(CASE_5_1, int(intervals), METHODS[method]).T.tolist()
        print(json.dumps(answer), flush=True)


def main():
    for method, normal_angles in METHODS.items():
        for intervals, repeats in [(50, 21), (5000, 3)]:
            states = len(sweep(CASE_5_1, intervals, normal_angles))
            median = statistics.median(seconds(intervals, normal_angles) for _ in range(repeats))
            print(f"{method:15} {intervals:5} intervals {1e3 * median:9.3f} ms {1e9 * median / states:8.0f} ns a state")


if __name__ == "__main__":
    serve() if sys.argv[1:] == ["--serve"] else main()
