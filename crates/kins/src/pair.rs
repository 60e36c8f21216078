//! Two of everything side by side, so that the processor can do both at once: struts of a hexapod, the chains of a planar mechanism. Every
//! function does with each of the two what one alone would do: the same bits.

use crate::attitude::Attitude;
use crate::pose::Pose;
use crate::vector::Vec3;

/// The same quantity of both.
pub(crate) type Two = [f64; 2];
/// Components of a vector in space, of both.
pub(crate) type Pair = [Two; 3];

#[inline]
fn map(a: Two, b: Two, f: impl Fn(f64, f64) -> f64) -> Two {
    [f(a[0], b[0]), f(a[1], b[1])]
}

#[inline]
pub(crate) fn plus(a: Two, b: Two) -> Two {
    map(a, b, |a, b| a + b)
}

#[inline]
pub(crate) fn minus(a: Two, b: Two) -> Two {
    map(a, b, |a, b| a - b)
}

#[inline]
pub(crate) fn times(a: Two, b: Two) -> Two {
    map(a, b, |a, b| a * b)
}

/// Six vectors, two and two.
pub(crate) fn all([a, b, c, d, e, f]: &[Vec3; 6]) -> [Pair; 3] {
    [[a, b], [c, d], [e, f]].map(|[u, v]| [[u[0], v[0]], [u[1], v[1]], [u[2], v[2]]])
}

/// And one by one again.
#[inline]
pub(crate) fn apart([p, q, r]: &[Pair; 3]) -> [Vec3; 6] {
    let one = |[x, y, z]: &Pair, k: usize| [x[k & 1], y[k & 1], z[k & 1]];
    [one(p, 0), one(p, 1), one(q, 0), one(q, 1), one(r, 0), one(r, 1)]
}

/// The same vector for both.
#[inline]
pub(crate) fn both(v: Vec3) -> Pair {
    v.map(|x| [x, x])
}

#[inline]
pub(crate) fn add(u: Pair, v: Pair) -> Pair {
    [plus(u[0], v[0]), plus(u[1], v[1]), plus(u[2], v[2])]
}

#[inline]
pub(crate) fn sub(u: Pair, v: Pair) -> Pair {
    [minus(u[0], v[0]), minus(u[1], v[1]), minus(u[2], v[2])]
}

#[inline]
pub(crate) fn dot(u: Pair, v: Pair) -> Two {
    plus(plus(times(u[0], v[0]), times(u[1], v[1])), times(u[2], v[2]))
}

#[inline]
pub(crate) fn cross([ux, uy, uz]: Pair, [vx, vy, vz]: Pair) -> Pair {
    let minor = |a: Two, b: Two, c: Two, d: Two| minus(times(a, b), times(c, d));
    [minor(uy, vz, uz, vy), minor(uz, vx, ux, vz), minor(ux, vy, uy, vx)]
}

/// R a and the way from base to platform, p + R a − b.
#[inline]
pub(crate) fn strut(at: &Attitude, pose: &Pose, point: &Pair, base: &Pair) -> (Pair, Pair) {
    let arm = rotate(at, *point);
    (arm, sub(add(both([pose.x, pose.y, pose.z]), arm), *base))
}

/// As [`Attitude::rotate`].
#[inline]
pub(crate) fn rotate(at: &Attitude, [bx, by, bz]: Pair) -> Pair {
    let two = |(s, c): (f64, f64)| ([s, s], [c, c]);
    let ((ss, cs), (st, ct), (sp, cp)) = (two(at.psi), two(at.theta), two(at.phi));
    let (y, z) = (minus(times(cs, by), times(ss, bz)), plus(times(ss, by), times(cs, bz)));
    let (x, height) = (plus(times(ct, bx), times(st, z)), minus(times(ct, z), times(st, bx)));
    [minus(times(cp, x), times(sp, y)), plus(times(sp, x), times(cp, y)), height]
}
