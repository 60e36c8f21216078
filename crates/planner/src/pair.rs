//! Rows two by two: the processor computes both at once, and a loop over them takes half the turns.

/// The same quantity of two neighbouring rows.
pub(crate) type Pair = [f64; 2];

/// Two by two; an odd last one is left out.
#[inline(always)]
pub(crate) fn two(all: &[f64]) -> &[Pair] {
    all.as_chunks().0
}

/// Likewise, to be written.
#[inline(always)]
pub(crate) fn two_mut(all: &mut [f64]) -> &mut [Pair] {
    all.as_chunks_mut().0
}

/// `f` of both.
#[inline(always)]
pub(crate) fn each(a: Pair, f: impl Fn(f64) -> f64) -> Pair {
    [f(a[0]), f(a[1])]
}

/// `f` of both with both.
#[inline(always)]
pub(crate) fn with(a: Pair, b: Pair, f: impl Fn(f64, f64) -> f64) -> Pair {
    [f(a[0], b[0]), f(a[1], b[1])]
}

/// The higher one; a `b` that is no number is passed over. One instruction, where `f64::max` takes five.
#[inline(always)]
pub(crate) fn higher(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// The lower one, likewise.
#[inline(always)]
pub(crate) fn lower(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// The higher one of a pair.
#[inline(always)]
pub(crate) fn highest(a: Pair) -> f64 {
    higher(a[0], a[1])
}
