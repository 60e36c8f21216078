#!/usr/bin/env python3
"""The planner beside PyPI's toppra, per node, in one run:

    python3 -m venv /tmp/toppra && /tmp/toppra/bin/pip install numpy toppra
    /tmp/toppra/bin/python crates/planner/benches/toppra.py

And toppra's own C++ library, which is on PyPI too, on P01, P03, P10 and P12:

    python3 -m venv /tmp/toppra-cpp && /tmp/toppra-cpp/bin/pip install cmeel-toppra cmeel-eigen
    P=$(echo /tmp/toppra-cpp/lib/python3*/site-packages/cmeel.prefix)
    g++ -O3 -std=c++17 -I$P/include -I$P/include/eigen3 crates/planner/benches/toppra.cpp -L$P/lib -ltoppra -Wl,-rpath,$P/lib -o /tmp/toppra-cpp/bench
    /tmp/toppra/bin/python crates/planner/benches/toppra.py --cpp /tmp/toppra-cpp/bench

Runs `cargo bench --package pkm-planner -- CASE` and toppra in turn, several times, and prints the medians over the rounds;
in each round toppra's fastest of several (its C++: the median of 101). toppra is charged with its solver only (path and
constraints are computed before the clock starts), its C++ with path and kinematics too; the planner with everything: path,
kinematics, spacing of the nodes, look-ahead and the planning part of every servo tick.

Cases (mm, s, rad), on n equal intervals a piece, n = max(least, ceil(length / (whole length / 500))):
P01 line and P03 circle on a MOMA, P04 1000 chords and P05 zigzag with blended corners on it, P10 circle on a linear delta, P12
line of a hexapod. Corners are the parabolas of G64 P.
"""
import importlib.metadata
import os
import statistics
import subprocess
import sys
import time

# This file is not the package of its name.
sys.path.pop(0)

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint

toppra.setup_logging("ERROR")

ROUNDS = 5
REPEATS = 5


# ---- path: a list of (length, function of s giving X, dX/ds, d2X/ds2 as arrays of rows)

def line(a, b):
    a, b = np.asarray(a, float), np.asarray(b, float)
    length = np.linalg.norm((b - a)[:3])
    e = (b - a) / length
    return length, lambda s: (a + np.outer(s, e), np.tile(e, (len(s), 1)), np.zeros((len(s), len(a))))


def circle(centre, radius):
    centre = np.asarray(centre, float)

    def at(s):
        c, d = np.cos(s / radius), np.sin(s / radius)
        rows = np.zeros((3, len(s), len(centre)))
        rows[0] = centre
        rows[0, :, 0] += radius * c
        rows[0, :, 1] += radius * d
        rows[1, :, 0], rows[1, :, 1] = -d, c
        rows[2, :, 0], rows[2, :, 1] = -c / radius, -d / radius
        return tuple(rows)

    return 2 * np.pi * radius, at


def corner(at_corner, e1, e2, d):
    def at(s):
        w = (s / (2 * d))[:, None]
        first = (1 - w) * e1 + w * e2
        place = at_corner - d * e1 + 2 * d * (w * e1 + 0.5 * w * w * (e2 - e1))
        return place, first, np.tile((e2 - e1) / (2 * d), (len(s), 1))

    return 2 * d, at


def blended(points, p):
    """Chords with corners rounded within p, at most half of either chord."""
    points = np.asarray(points, float)
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    e = steps / lengths[:, None]
    turn = np.linalg.norm(np.diff(e, axis=0), axis=1)
    d = np.minimum(np.minimum(lengths[:-1], lengths[1:]) / 2, 4 * p / np.maximum(turn, 1e-300))
    cut = np.concatenate([[0.0], d, [0.0]])
    pieces = []
    for k in range(len(e)):
        a, b = points[k] + cut[k] * e[k], points[k + 1] - cut[k + 1] * e[k]
        if np.dot(b - a, e[k]) > 1e-9:
            pieces.append(line(a, b))
        if k + 1 < len(e):
            pieces.append(corner(points[k + 1], e[k], e[k + 1], d[k]))
    return pieces


# ---- mechanisms: q', q'' from X, X', X''

def moma(x, v, a):
    """Sliders on rails at 265 and 275 degrees from (-100, 0) and (100, 0), links of 195 mm: |X - R - p u| = l."""
    first, second = [], []
    for side, angle in ((-1, 265), (1, 275)):
        u = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        r = x[:, :2] - np.array([side * 100.0, 0.0])
        along = r @ u
        p = along - np.sqrt(along**2 - (r * r).sum(1) + 195.0**2)
        link = r - p[:, None] * u
        reach = link @ u
        p1 = (link * v[:, :2]).sum(1) / reach
        swing = v[:, :2] - p1[:, None] * u
        first.append(p1)
        second.append(((swing * swing).sum(1) + (link * a[:, :2]).sum(1)) / reach)
    return np.stack(first, 1), np.stack(second, 1)


def delta(x, v, a):
    """Carriages on columns at radius 105, links of 217 mm: q = z + sqrt(l^2 - d^2)."""
    first, second = [], []
    for angle in (210, 330, 90):
        d = x[:, :2] - 105.0 * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        h = np.sqrt(217.0**2 - (d * d).sum(1))
        h1 = -(d * v[:, :2]).sum(1) / h
        first.append(v[:, 2] + h1)
        second.append(a[:, 2] - ((v[:, :2] ** 2).sum(1) + (d * a[:, :2]).sum(1) + h1 * h1) / h)
    return np.stack(first, 1), np.stack(second, 1)


def turn(axis, angle):
    """Rotation about X, Y or Z with its derivatives by the angle."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    out = np.zeros((3, len(angle), 3, 3))
    out[0, :, axis, axis] = 1
    for k, (cc, ss) in enumerate(((c, s), (-s, c), (-c, -s))):
        out[k, :, i, i] = out[k, :, j, j] = cc
        out[k, :, i, j], out[k, :, j, i] = -ss, ss
    return out


def hexapod(x, v, a):
    """Struts between rings of radius 120 (angles 120k -+ 10) and 60 (120k -+ 50); R = Rz(c) Ry(b) Rx(a)."""
    series = []
    for axis in range(3):
        r, r1, r2 = turn(axis, x[:, 3 + axis])
        w, w1 = v[:, 3 + axis, None, None], a[:, 3 + axis, None, None]
        series.append((r, r1 * w, r2 * w * w + r1 * w1))

    def times(m, n):
        return (m[0] @ n[0], m[1] @ n[0] + m[0] @ n[1], m[2] @ n[0] + 2 * m[1] @ n[1] + m[0] @ n[2])

    r = times(times(series[2], series[1]), series[0])
    first, second = [], []
    for k in range(3):
        for side in (-1, 1):
            ring = lambda radius, gap: radius * np.array(
                [np.cos(np.radians(120 * k + side * gap)), np.sin(np.radians(120 * k + side * gap)), 0.0])
            base, platform = ring(120.0, 10), ring(60.0, 50)
            strut = x[:, :3] + r[0] @ platform - base
            rate, curve = v[:, :3] + r[1] @ platform, a[:, :3] + r[2] @ platform
            length = np.sqrt((strut * strut).sum(1))
            l1 = (strut * rate).sum(1) / length
            first.append(l1)
            second.append(((rate * rate).sum(1) + (strut * curve).sum(1) - l1 * l1) / length)
    return np.stack(first, 1), np.stack(second, 1)


# ---- toppra

class Chain:
    """What toppra wants to know of a path at the nodes: q' and q''."""

    def __init__(self, s, first, second):
        self.s, self.first, self.second = s, first, second
        self.path_interval = np.array([s[0], s[-1]])
        self.dof = first.shape[1]

    def __call__(self, s, order=0):
        at = np.clip(np.searchsorted(self.s, s), 0, len(self.s) - 1)
        return {0: self.first * 0, 1: self.first, 2: self.second}[order][at]

    def eval(self, s):
        return self(s, 0)

    def evald(self, s):
        return self(s, 1)

    def evaldd(self, s):
        return self(s, 2)


class Strips(toppra.constraint.LinearConstraint):
    """|q' u + q'' x| <= a at both ends of every interval, and q'^2 x <= v^2."""

    def __init__(self, left, right, delta, v_max, a_max):
        super().__init__()
        n = left[0].shape[1]
        self.dof, self.identical = n, True
        self.set_discretization_type(0)
        # Row i holds interval i: its own strips and, seen from its start, those of its end (x_end = x + 2 delta u).
        p0, q0, p1, q1 = right[0], right[1], left[0], left[1]
        d = 2 * delta[:, None]
        self.a = np.concatenate([p0, p1 + d * q1], axis=1)
        self.b = np.concatenate([q0, q1], axis=1)
        self.rows = n
        self.a_max = a_max
        self.x_max = (v_max / np.maximum(np.abs(p0), 1e-300)) ** 2
        self.x_max = np.minimum(self.x_max.min(1), 1e8)

    def compute_constraint_params(self, path, gridpoints, *_):
        n = len(gridpoints)
        m = 2 * self.rows
        box = np.concatenate([np.eye(m), -np.eye(m)])
        bound = np.full(2 * m, self.a_max)
        limits = np.stack([np.zeros(n), self.x_max], axis=1)
        return self.a, self.b, np.zeros((n, m)), box, bound, None, limits


def nodes(pieces, mechanism):
    """Nodes with q', q'' to their left and right."""
    whole = sum(length for length, _ in pieces)
    least = 4 if len(pieces) <= 100 else 2 if len(pieces) <= 5000 else 1
    s, left, right, begin = [0.0], [None], [], 0.0
    for length, at in pieces:
        n = max(least, int(np.ceil(length / (whole / 500) - 1e-9)))
        t = np.linspace(0, length, n + 1)
        first, second = mechanism(*at(t))
        for k in range(n):
            right.append((first[k], second[k]))
            left.append((first[k + 1], second[k + 1]))
            s.append(begin + t[k + 1])
        begin += length
    right.append(left[-1])
    left[0] = right[0]
    column = lambda rows, k: np.array([row[k] for row in rows])
    return np.array(s), (column(left, 0), column(left, 1)), (column(right, 0), column(right, 1))


def prepare(pieces, mechanism, v_max, a_max):
    """Nodes, constraint and path: everything that happens before the clock starts."""
    s, left, right = nodes(pieces, mechanism)
    shifted = tuple(np.concatenate([part[1:], part[-1:]]) for part in left)
    delta = np.append(np.diff(s), 0.0)
    return s, Strips(shifted, right, delta, v_max, a_max), Chain(s, *right)


def flower(chords):
    t = 2 * np.pi * np.arange(chords + 1) / chords
    return np.stack([40 * np.cos(t) + 6 * np.cos(7 * t) - 6, -265 + 32 * np.sin(t) + 6 * np.sin(7 * t)], 1)


def cases():
    zigzag = [(-40 + 4 * k, -265 + 4 * (k % 2)) for k in range(21)]
    low = [-30, -20, 150, *np.radians([-5, 3, 0])]
    high = [30, 20, 170, *np.radians([5, -3, 10])]
    return {
        "P01": ([line((-50, -270), (50, -270))], moma, 100, 1000),
        "P03": ([circle((0, -265), 40)], moma, 100, 1000),
        "P04": (blended(flower(1000), 0.01), moma, 100, 1000),
        "P05": (blended(zigzag, 0.1), moma, 100, 1000),
        "P10": ([circle((0, 0, 20), 80)], delta, 200, 3000),
        "P12": ([line(low, high)], hexapod, 100, 1000),
    }


def solve(s, strips, path):
    """Seconds spent (the fastest of a few), and the duration found."""
    spent = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        solver = toppra.algorithm.TOPPRA([strips], path, gridpoints=s, solver_wrapper="seidel")
        _, rates, _, _ = solver.compute_parameterization(0, 0, return_data=True)
        spent.append(time.perf_counter() - begin)
    speed = np.asarray(rates)
    return min(spent), float(np.sum(2 * np.diff(s) / (speed[1:] + speed[:-1])))


def ours(ids):
    """From the bench's table of costs: nodes, ns a node, duration."""
    root = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../..")
    command = ["cargo", "bench", "--quiet", "--package", "pkm-planner", "--bench", "cases", "--", "--plain", *ids]
    text = subprocess.run(command, cwd=root, check=True, capture_output=True, text=True).stdout
    rows = {}
    for row in text.splitlines():
        word = row.split()
        if len(word) == 4 and word[0] in ids:
            rows[word[0]] = (int(word[1]), float(word[2]), float(word[3]))
    return rows


def plus_plus(program):
    """What toppra.cpp prints: us a node, duration."""
    if program is None:
        return {}
    text = subprocess.run([program], check=True, capture_output=True, text=True).stdout
    return {name: (float(us), float(s)) for name, us, s in map(str.split, text.splitlines())}


def main():
    table, wanted, program = cases(), sys.argv[1:], None
    if "--cpp" in wanted:
        at = wanted.index("--cpp")
        program = wanted[at + 1]
        del wanted[at:at + 2]
    ids = [name for name in table if not wanted or name in wanted]
    prepared = {name: prepare(*table[name]) for name in ids}
    rounds = []
    for _ in range(ROUNDS):
        # Case by case, so that both find the same machine, and each has its own case in the caches.
        mine, his = {}, {}
        for name in ids:
            mine |= ours([name])
            his[name] = solve(*prepared[name])
        rounds.append((mine, his, plus_plus(program)))
    middle = lambda pick: statistics.median(pick(*one) for one in rounds)
    print(f"toppra {importlib.metadata.version('toppra')} (Seidel), {ROUNDS} rounds in turn, medians")
    print("case   planner: nodes  us/node       s   toppra: nodes  us/node       s   ratio per node   whole case")
    worst = float("inf")
    for name in ids:
        count = len(prepared[name][0]) - 1
        us = middle(lambda mine, his, _: mine[name][1]) / 1e3
        their_us = middle(lambda mine, his, _: his[name][0]) / count * 1e6
        mine = rounds[0][0][name]
        worst = min(worst, their_us / us)
        print(f"{name}  {mine[0]:15} {us:8.3f} {mine[2]:8.4f}  {count:14} {their_us:8.2f} "
              f"{rounds[0][1][name][1]:8.4f}  {their_us / us:14.0f} {their_us * count / (us * mine[0]):12.0f}")
    print(f"worst ratio per node: {worst:.0f} (bar: 50)")
    for name in ids:
        if name in rounds[0][2]:
            us = middle(lambda mine, his, plus: mine[name][1]) / 1e3
            their_us = middle(lambda mine, his, plus: plus[name][0])
            print(f"{name}  toppra's C++, path and kinematics included: {their_us:.3f} us a node, {rounds[0][2][name][1]:.4f} s;"
                  f" ratio {their_us / us:.1f} (bar: 5)")


if __name__ == "__main__":
    main()
