//! Three-dimensional vectors as plain arrays: the little algebra the spatial mechanisms need.

/// mm, or without unit for directions.
pub type Vec3 = [f64; 3];

#[inline]
pub(crate) fn add(u: Vec3, v: Vec3) -> Vec3 {
    [u[0] + v[0], u[1] + v[1], u[2] + v[2]]
}

#[inline]
pub(crate) fn sub(u: Vec3, v: Vec3) -> Vec3 {
    [u[0] - v[0], u[1] - v[1], u[2] - v[2]]
}

#[inline]
pub(crate) fn scale(k: f64, v: Vec3) -> Vec3 {
    [k * v[0], k * v[1], k * v[2]]
}

#[inline]
pub(crate) fn dot(u: Vec3, v: Vec3) -> f64 {
    u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
}

#[inline]
pub(crate) fn cross(u: Vec3, v: Vec3) -> Vec3 {
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

#[inline]
pub(crate) fn norm(v: Vec3) -> f64 {
    crate::maths::sqrt(dot(v, v))
}

#[inline]
pub(crate) fn is_finite(v: Vec3) -> bool {
    v[0].is_finite() && v[1].is_finite() && v[2].is_finite()
}
