"""The two computations of maps.rs, vectorised with NumPy. Prints: map median and best s, poses reached, scan median and best s, volume mm^3."""
import math
import time

import numpy as np


def timed(runs, work):
    work()
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - start)
    return sorted(times)[len(times) // 2], min(times), result


def planar_map():
    """det K and reach of MOMA a over 1000 x 1000 poses: working modes minus, assembly minus, travel 0..200."""
    x, y = np.meshgrid(-80 + 0.16 * np.arange(1000), -360 + 0.16 * np.arange(1000))
    links, along = [], []
    reach = np.ones(x.shape, bool)
    for (rx, ry), degrees in (((-100, 0), 265), ((100, 0), 275)):
        ax, ay = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        kx, ky = x - rx, y - ry
        b, n = ax * kx + ay * ky, ax * ky - ay * kx
        d = (195 - np.abs(n)) * (195 + np.abs(n))
        root = -np.sqrt(np.maximum(d, 0))
        p = b + root
        reach &= (d >= -1e-12 * 195**2) & (p >= -1e-9) & (p <= 200 + 1e-9)
        links.append((-n * ay - root * ax, n * ax - root * ay))
        along.append(-root)
    (l1x, l1y), (l2x, l2y) = links
    cross = l1x * l2y - l1y * l2x
    reach &= -cross >= -1e-9 * 195 * 195
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(reach, cross / (along[0] * along[1]), np.nan)


def rotations():
    angles = np.radians([-15, 0, 15])
    for a in angles:
        for b in angles:
            for c in angles:
                (sa, ca), (sb, cb), (sc, cc) = ((math.sin(v), math.cos(v)) for v in (a, b, c))
                yield np.array([
                    [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
                    [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
                    [-sb, cb * sa, cb * ca],
                ])


def legs():
    """Shaft in the base, and the platform joint turned by every orientation: (3, 27, 3)."""
    shafts, arms = [], []
    for azimuth in (0, 240, 120):
        t, j = math.radians(azimuth), math.radians(azimuth + 45)
        shafts.append((1000 * math.cos(t), 1000 * math.sin(t)))
        joint = np.array([300 * math.cos(j), 300 * math.sin(j), 0])
        arms.append(np.array([r @ joint for r in rotations()]))
    return shafts, arms


LEGS = legs()


def passes(x, y, z):
    """True where all 27 orientations keep all limits; all points at once, orientations along the second axis."""
    ok = np.ones((x.size, 27), bool)
    for (sx, sy), arm in zip(*LEGS):
        wx, wy = x[:, None] + (arm[:, 0] - sx), y[:, None] + (arm[:, 1] - sy)
        rho2 = wx * wx + wy * wy
        k = 900 / 1400
        h = np.sqrt(np.maximum(1400.0**2 - rho2, 0))
        g = np.sqrt(np.maximum(800.0**2 - k * k * rho2, 0))
        upper = -(z[:, None] + arm[:, 2]) - h
        spacing = k * h + g
        lower = upper + spacing
        ok &= (rho2 < 1400.0**2) & (k * k * rho2 < 800.0**2)
        ok &= (upper >= 100 - 1e-9) & (upper <= 2000 + 1e-9) & (lower >= 100 - 1e-9) & (lower <= 2000 + 1e-9)
        ok &= (spacing >= 800 - 1e-9) & (spacing <= 1600 + 1e-9)
    return ok.all(axis=1)


def scan():
    """All planes and rays march outwards together; those that failed leave the arrays; then all bisect together."""
    heights = 10.0 * np.arange(-370, 21)
    heights = heights[passes(np.zeros(heights.size), np.zeros(heights.size), heights)]
    beta = 2 * math.pi * np.arange(72) / 72
    z, c, s = (v.ravel() for v in (np.repeat(heights, 72), np.tile(np.cos(beta), heights.size), np.tile(np.sin(beta), heights.size)))
    fail = np.zeros(z.size)
    alive = np.arange(z.size)
    rho = 0.0
    while alive.size:
        rho += 5.0
        good = passes(rho * c[alive], rho * s[alive], z[alive])
        fail[alive[~good]] = rho
        alive = alive[good]
    low, high = fail - 5.0, fail.copy()
    for _ in range(13):
        middle = 0.5 * (low + high)
        good = passes(middle * c, middle * s, z)
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return 10.0 * np.sum(low * low) / 2 * 2 * math.pi / 72


map_s, map_best_s, determinant = timed(15, planar_map)
scan_s, scan_best_s, volume = timed(5, scan)
print(map_s, map_best_s, int(np.count_nonzero(~np.isnan(determinant))), scan_s, scan_best_s, volume)
