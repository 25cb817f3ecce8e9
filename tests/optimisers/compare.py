"""Hypervolume over evaluations: the search's own optimiser in its islands, NSGA-II of heuropt after a Sobol scan in as many islands and in one
population, NSGA-II of pymoo.

Counted is whatever an optimiser has found so far, not only its last population. The hypervolume lies between the front and a corner that is
fixed below; it is told as a share of that of all fronts together.
"""

import json
import subprocess
import sys
from bisect import bisect_left
from pathlib import Path

import matplotlib
import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402

HERE = Path(__file__).parent
BINARY = sys.argv[1]
SEEDS = range(1, 4)
POPULATION = 100
# Dimensions, limits, evaluations, and a corner that every point of a front beats: of the drive its limits.
PROBLEMS = {
    "drive": (5, 4, 50_000, (120.0, -200.0)),
    "osy": (6, 6, 25_000, (0.0, 80.0)),
    "welded-beam": (4, 4, 25_000, (40.0, 0.016)),
}
NAMES = {
    "own": "the search's, in islands",
    "heuropt-islands": "NSGA-II of heuropt after Sobol, in islands",
    "heuropt": "the same, one population",
    "pymoo": "NSGA-II of pymoo, one population",
}
TITLES = {"drive": "ratio 20, 200 N·m, 120 mm", "osy": "OSY", "welded-beam": "welded beam"}


class Asked(Problem):
    """A problem that the binary evaluates; each evaluation is kept with its number."""

    def __init__(self, name):
        dimensions, self.limits, _, _ = PROBLEMS[name]
        super().__init__(n_var=dimensions, n_obj=2, n_ieq_constr=self.limits, xl=0.0, xu=1.0)
        self.process = subprocess.Popen([BINARY, "evaluate", name], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.count, self.found = 0, []

    def _evaluate(self, places, out, *_, **__):
        self.process.stdin.write("".join(" ".join(map(repr, map(float, place))) + "\n" for place in places) + "\n")
        self.process.stdin.flush()
        objectives, violations = [], []
        for _ in places:
            self.count += 1
            line = self.process.stdout.readline().split()
            if line == ["none"]:
                # What cannot be is further beyond than anything that can.
                objectives.append([0.0, 0.0])
                violations.append([1e6] * self.limits)
                continue
            numbers = [float(number) for number in line]
            objectives.append(numbers[:2])
            violations.append(numbers[2:])
            if max(numbers[2:]) <= 0.0:
                self.found.append((self.count, *numbers[:2]))
        out["F"], out["G"] = np.array(objectives), np.array(violations)


def run_pymoo(name, seed):
    problem = Asked(name)
    minimize(problem, NSGA2(pop_size=POPULATION), ("n_eval", PROBLEMS[name][2]), seed=seed)
    problem.process.stdin.close()
    problem.process.wait()
    return problem.found


def run_binary(which, name, seed):
    output = subprocess.run([BINARY, which, name, str(PROBLEMS[name][2]), str(seed)], check=True, capture_output=True, text=True).stdout
    return [tuple(float(number) for number in line.split()) for line in output.splitlines()]


def insert(front, point):
    """Adds a point to a front, kept by its first objective, the second falling."""
    at = bisect_left(front, point)
    if at > 0 and front[at - 1][1] <= point[1]:
        return
    end = at
    while end < len(front) and front[end][1] >= point[1]:
        end += 1
    front[at:end] = [point]


def hypervolume(front, corner):
    volume, height = 0.0, corner[1]
    for first, second in front:
        if first < corner[0] and second < height:
            volume += (corner[0] - first) * (height - second)
            height = second
    return volume


def course(found, checkpoints, corner):
    front, volumes, at = [], [], 0
    for checkpoint in checkpoints:
        while at < len(found) and found[at][0] <= checkpoint:
            insert(front, found[at][1:])
            at += 1
        volumes.append(hypervolume(front, corner))
    return volumes, front


def main():
    results = {}
    figure, axes = plt.subplots(1, len(PROBLEMS), figsize=(12, 3.6), layout="constrained")
    for axis, (name, (_, _, evaluations, corner)) in zip(axes, PROBLEMS.items()):
        checkpoints = sorted({int(evaluations * share) for share in (0.01, 0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)})
        courses, together = {}, []
        for which in NAMES:
            runs = []
            for seed in SEEDS:
                found = run_pymoo(name, seed) if which == "pymoo" else run_binary(which, name, seed)
                volumes, front = course(found, checkpoints, corner)
                runs.append(volumes)
                for point in front:
                    insert(together, point)
                print(name, which, seed, f"{volumes[-1]:.6g}", flush=True)
            courses[which] = np.array(runs)
        best = hypervolume(together, corner)
        results[name] = {"corner": corner, "hypervolume_of_all": best, "evaluations": checkpoints, "seeds": list(SEEDS), "shares": {}}
        for which, runs in courses.items():
            shares = runs / best
            # Islands that ran one after the other have no course in common.
            if which == "heuropt-islands":
                results[name]["shares"][which] = [[round(float(run[-1]), 5)] for run in shares]
                continue
            results[name]["shares"][which] = [[round(float(share), 5) for share in run] for run in shares]
            median = np.median(shares, axis=0)
            line = axis.plot(checkpoints, 1.0 - median, label=NAMES[which])[0]
            axis.fill_between(checkpoints, 1.0 - shares.max(axis=0), 1.0 - shares.min(axis=0), color=line.get_color(), alpha=0.2, linewidth=0)
        axis.set(title=TITLES[name], xlabel="evaluations", yscale="log", xlim=(0, evaluations))
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("hypervolume that is missing")
    axes[0].legend(fontsize=8)
    plt.rcParams["svg.hashsalt"] = "optimisers"
    figure.savefig(HERE / "../../benches/results/optimisers.svg", metadata={"Date": None})
    (HERE / "results.json").write_text(json.dumps(results, indent=1) + "\n")
    lines = ["| problem, evaluations | " + " | ".join(NAMES.values()) + " |", "|---|" + "---|" * len(NAMES)]
    for name, result in results.items():
        for at in (result["evaluations"].index(int(0.2 * PROBLEMS[name][2])), -1):
            cells = []
            for which in NAMES:
                if at != -1 and which == "heuropt-islands":
                    cells.append("")
                    continue
                shares = [run[at] for run in result["shares"][which]]
                cells.append(f"{np.median(shares):.4f} ({min(shares):.4f} to {max(shares):.4f})")
            lines.append(f"| {TITLES[name]}, {result['evaluations'][at]} | " + " | ".join(cells) + " |")
    print("\n".join(lines))


main()
