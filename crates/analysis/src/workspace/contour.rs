//! Filled contours: the sets {f ≥ level} of a function over a box, as polygons.
//!
//! Marching squares on a grid; the corners of the polygons are then moved along the grid's edges onto the level by bisection of
//! the function itself, so that only the chords between two edges are approximate.

use pkm_kins::Vec2;

/// Polygons of {f ≥ level} within a box of `columns` × `rows` cells. Outside of the box counts as below the level.
pub(crate) fn above(
    f: impl Fn(Vec2) -> f64,
    [low, high]: [Vec2; 2],
    [columns, rows]: [usize; 2],
    level: f64,
) -> Vec<Vec<Vec2>> {
    // One ring of nodes more on every side, which is below.
    let (wide, tall) = (columns + 3, rows + 3);
    let step = [(high[0] - low[0]) / columns as f64, (high[1] - low[1]) / rows as f64];
    let place = |i: usize, j: usize| {
        let at = |k: usize, axis: usize| {
            let share = (k as f64 - 1.0).clamp(0.0, if axis == 0 { columns } else { rows } as f64);
            low[axis] + share * step[axis]
        };
        [at(i, 0), at(j, 1)]
    };
    let rim = |i: usize, j: usize| i == 0 || j == 0 || i == wide - 1 || j == tall - 1;
    let mut inside = vec![false; wide * tall];
    for j in 0..tall {
        for i in 0..wide {
            inside[j * wide + i] = !rim(i, j) && f(place(i, j)) >= level;
        }
    }
    let crossing = |a: (usize, usize), b: (usize, usize)| {
        let (mut yes, mut no) = if inside[a.1 * wide + a.0] {
            (place(a.0, a.1), place(b.0, b.1))
        } else {
            (place(b.0, b.1), place(a.0, a.1))
        };
        for _ in 0..24 {
            let middle = [0.5 * (yes[0] + no[0]), 0.5 * (yes[1] + no[1])];
            if f(middle) >= level { yes = middle } else { no = middle }
        }
        yes
    };
    // Edges are numbered: 2 (j wide + i) from node (i, j) to the right, + 1 upwards. `next[edge]` is where the contour goes on,
    // with the set on its left; a saddle has two contours through different edges, so one entry per edge is enough.
    let mut next = vec![usize::MAX; 2 * wide * tall];
    for j in 0..tall - 1 {
        for i in 0..wide - 1 {
            let corner = |di: usize, dj: usize| inside[(j + dj) * wide + i + di];
            let (bottom, top) = (2 * (j * wide + i), 2 * ((j + 1) * wide + i));
            let (left, right) = (bottom + 1, 2 * (j * wide + i + 1) + 1);
            let code = usize::from(corner(0, 0))
                | usize::from(corner(1, 0)) << 1
                | usize::from(corner(1, 1)) << 2
                | usize::from(corner(0, 1)) << 3;
            let mut go = |from: usize, to: usize| next[from] = to;
            match code {
                1 => go(bottom, left),
                2 => go(right, bottom),
                3 => go(right, left),
                4 => go(top, right),
                6 => go(top, bottom),
                7 => go(top, left),
                8 => go(left, top),
                9 => go(bottom, top),
                11 => go(right, top),
                12 => go(left, right),
                13 => go(bottom, right),
                14 => go(left, bottom),
                5 | 10 => {
                    let (a, b) = (place(i, j), place(i + 1, j + 1));
                    let joined = f([0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]) >= level;
                    match (code, joined) {
                        (5, true) => {
                            go(bottom, right);
                            go(top, left);
                        }
                        (5, false) => {
                            go(bottom, left);
                            go(top, right);
                        }
                        (_, true) => {
                            go(left, bottom);
                            go(right, top);
                        }
                        _ => {
                            go(right, bottom);
                            go(left, top);
                        }
                    }
                }
                _ => {}
            }
        }
    }
    let mut polygons = Vec::new();
    for start in 0..next.len() {
        let mut polygon = Vec::new();
        let mut edge = start;
        while next[edge] != usize::MAX {
            let node = edge / 2;
            let (i, j) = (node % wide, node / wide);
            let end = if edge % 2 == 0 { (i + 1, j) } else { (i, j + 1) };
            polygon.push(crossing((i, j), end));
            edge = std::mem::replace(&mut next[edge], usize::MAX);
        }
        if polygon.len() > 2 {
            polygons.push(polygon);
        }
    }
    polygons
}

/// The polygon with as few corners as keep it within `tolerance_mm` (Douglas and Peucker).
pub(crate) fn simplified(polygon: &[Vec2], tolerance_mm: f64) -> Vec<Vec2> {
    let Some(&first) = polygon.first() else { return Vec::new() };
    let mut closed = polygon.to_vec();
    closed.push(first);
    let mut keep = vec![false; closed.len()];
    // Split at the corner farthest from the first: a closed line has no chord of its own.
    let square = |a: Vec2, b: Vec2| (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
    let far = (0..closed.len())
        .max_by(|&a, &b| square(closed[a], first).total_cmp(&square(closed[b], first)))
        .unwrap_or(0);
    let mut open = vec![(0, far), (far, closed.len() - 1)];
    for end in [0, far, closed.len() - 1] {
        keep[end] = true;
    }
    while let Some((from, to)) = open.pop() {
        let (a, b) = (closed[from], closed[to]);
        let long = square(a, b).sqrt();
        let off = |p: Vec2| {
            if long > 0.0 {
                ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])).abs() / long
            } else {
                square(p, a).sqrt()
            }
        };
        let worst = (from + 1..to).map(|k| (k, off(closed[k]))).max_by(|x, y| x.1.total_cmp(&y.1));
        if let Some((k, distance)) = worst
            && distance > tolerance_mm
        {
            keep[k] = true;
            open.extend([(from, k), (k, to)]);
        }
    }
    keep.pop();
    closed.pop();
    closed.into_iter().zip(keep).filter(|(_, keep)| *keep).map(|(point, _)| point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(polygons: &[Vec<Vec2>]) -> f64 {
        let one = |p: &Vec<Vec2>| {
            let pairs = p.iter().zip(p.iter().cycle().skip(1));
            0.5 * pairs.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
        };
        polygons.iter().map(one).sum()
    }

    /// A ring: one polygon each way round, areas of circles, corners on the level.
    #[test]
    fn a_ring_is_found() {
        let f = |p: Vec2| {
            let r = (p[0] * p[0] + p[1] * p[1]).sqrt();
            1.0 - (r - 5.0).abs()
        };
        let rings = above(f, [[-8.0, -7.5], [8.0, 7.5]], [80, 75], 0.0);
        assert_eq!(rings.len(), 2);
        let exact = std::f64::consts::PI * (36.0 - 16.0);
        assert!((area(&rings) - exact).abs() < 0.2, "{}", area(&rings));
        assert!(rings.iter().flatten().all(|p| f(*p).abs() < 1e-4));
        let fewer: Vec<Vec<Vec2>> = rings.iter().map(|ring| simplified(ring, 0.05)).collect();
        assert!(fewer[0].len() < rings[0].len() / 2);
        assert!((area(&fewer) - exact).abs() < 2.0);
    }

    /// What reaches the edge of the box is closed along it; saddles do not cross.
    #[test]
    fn the_box_closes_it() {
        assert!((area(&above(|_| 1.0, [[0.0, 0.0], [3.0, 2.0]], [6, 4], 0.0)) - 6.0).abs() < 1e-3);
        assert!(above(|_| -1.0, [[0.0, 0.0], [3.0, 2.0]], [6, 4], 0.0).is_empty());
        let saddle = above(|p| p[0] * p[1] - 0.01, [[-1.0, -1.0], [1.0, 1.0]], [7, 7], 0.0);
        assert_eq!(saddle.len(), 2);
    }
}
