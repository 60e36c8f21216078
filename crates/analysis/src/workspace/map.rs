//! Maps: det K and reach over a grid of poses.
//!
//! The kernel is the planar core's inverse with all branches turned into selections, so that the compiler can do several poses
//! at a time: the same operations in the same order as [`pkm_kins::Planar`], hence the same joints to the last bit.

use super::region::Chain;
use super::{Pair, View, WorkspaceError};
use crate::parallel;
use pkm_kins::maths::ceil;
use pkm_kins::{JointRange, Vec2};

/// The most poses of one map: 8 bytes each.
pub const MOST_POSES: f64 = 4e6;

/// det ∂p/∂(plane) at the nodes of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// The first node, mm.
    pub origin: Vec2,
    /// Distance of the nodes, mm.
    pub step: f64,
    /// Nodes to the right and up.
    pub size: [usize; 2],
    /// Row by row from below; NaN where the machine cannot be.
    pub determinant: Vec<f64>,
}

impl Map {
    /// The place of a node, mm.
    pub fn node(&self, column: usize, row: usize) -> Vec2 {
        [self.origin[0] + column as f64 * self.step, self.origin[1] + row as f64 * self.step]
    }
}

/// A grid over a box with a distance of `step` mm.
///
/// # Errors
/// `Resolution` for a step that is no length, `TooFine` for more than [`MOST_POSES`].
pub fn grid([low, high]: [Vec2; 2], step: f64) -> Result<Map, WorkspaceError> {
    if !(step > 0.0 && step.is_finite()) {
        return Err(WorkspaceError::Resolution { value_mm: step });
    }
    let count = |axis: usize| ceil((high[axis] - low[axis]) / step) + 1.0;
    let poses = count(0) * count(1);
    if !(poses <= MOST_POSES) {
        let finest_mm = ((high[0] - low[0]) * (high[1] - low[1]) / MOST_POSES).sqrt() * 1.01;
        return Err(WorkspaceError::TooFine { value_mm: step, poses, most: MOST_POSES, finest_mm });
    }
    let size = [count(0) as usize, count(1) as usize];
    Ok(Map { origin: low, step, size, determinant: vec![f64::NAN; size[0] * size[1]] })
}

/// What one chain contributes to a row of poses with a common y.
#[derive(Clone, Copy)]
struct Row {
    origin_x: f64,
    direction: Vec2,
    link: f64,
    mode: f64,
    edge: f64,
    low: f64,
    high: f64,
    ky: f64,
}

impl Row {
    fn new(chain: &Chain, y: f64) -> Self {
        Self {
            origin_x: chain.origin[0],
            direction: chain.direction,
            link: chain.link,
            mode: chain.mode,
            edge: -1e-12 * chain.link * chain.link,
            low: chain.range.min - JointRange::TOLERANCE,
            high: chain.range.max + JointRange::TOLERANCE,
            ky: y - chain.origin[1],
        }
    }

    /// N, σ√d, and whether reach and travel hold.
    #[inline(always)]
    fn solve(&self, x: f64) -> (f64, f64, bool) {
        let [ax, ay] = self.direction;
        let kx = x - self.origin_x;
        let b = ax * kx + ay * self.ky;
        let n = ax * self.ky - ay * kx;
        let d = (self.link - n.abs()) * (self.link + n.abs());
        let root = self.mode * (if d > 0.0 { d } else { 0.0 }).sqrt();
        let p = b + root;
        (n, root, (d >= self.edge) & (p >= self.low) & (p <= self.high))
    }
}

/// Multiplies det K of one mechanism into a row of poses at `xs`; NaN where it cannot be. Where the processor has them, four
/// lanes at a time instead of two: the same operations, none fused, hence the same bits.
fn multiply_row(pair: &Pair, y: f64, xs: &[f64], row: &mut [f64]) {
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)] // twice as fast on every processor since 2013
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2, which is all that the function asks for.
        unsafe { multiply_row_avx2(pair, y, xs, row) };
        return;
    }
    multiply_row_plain(pair, y, xs, row);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn multiply_row_avx2(pair: &Pair, y: f64, xs: &[f64], row: &mut [f64]) {
    multiply_row_plain(pair, y, xs, row);
}

#[inline(always)]
fn multiply_row_plain(pair: &Pair, y: f64, xs: &[f64], row: &mut [f64]) {
    let [c1, c2] = &pair.chains;
    let (first, second) = (Row::new(c1, y), Row::new(c2, y));
    let (a1, a2) = (c1.direction, c2.direction);
    let (sine, cosine) = (a1[0] * a2[1] - a1[1] * a2[0], a1[0] * a2[0] + a1[1] * a2[1]);
    let least = -1e-9 * c1.link * c2.link;
    for (value, &x) in row.iter_mut().zip(xs) {
        let (n1, r1, ok1) = first.solve(x);
        let (n2, r2, ok2) = second.solve(x);
        // cross(L₁, L₂) from what is known along and off the guides; w₁ w₂ = r₁ r₂.
        let x12 = sine * (n1 * n2 + r1 * r2) + cosine * (n1 * r2 - n2 * r1);
        let determinant = *value * (x12 / (r1 * r2));
        *value = if ok1 & ok2 & (pair.side * x12 >= least) { determinant } else { f64::NAN };
    }
}

impl View {
    /// Fills a grid with det ∂p/∂(plane): the product over its mechanisms, and NaN outside [`View::reachable`].
    pub fn fill(&self, map: &mut Map, threads: usize) {
        let ([columns, _], step, [x0, y0]) = (map.size, map.step, map.origin);
        let walls: Vec<_> = self.reachable.walls().collect();
        let xs: Vec<f64> = (0..columns).map(|k| x0 + k as f64 * step).collect();
        let rows_at_once = (16_384 / columns.max(1)).max(1);
        parallel::for_pieces(&mut map.determinant, columns * rows_at_once, threads, |piece, values| {
            for (k, row) in values.chunks_mut(columns).enumerate() {
                let y = y0 + (piece * rows_at_once + k) as f64 * step;
                row.fill(self.factor);
                for pair in &self.mechanisms {
                    multiply_row(pair, y, &xs, row);
                }
                for wall in &walls {
                    for (value, &x) in row.iter_mut().zip(&xs) {
                        if !wall.holds([x, y]) {
                            *value = f64::NAN;
                        }
                    }
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::{Section, views};
    use pkm_kins::{Kinematics, Mechanism, Pose};
    use pkm_machine::Machine;

    /// The kernel and the kinematics agree about reach everywhere, and about det K to 1e-12, for any number of threads.
    #[test]
    fn the_map_is_the_mechanism() {
        for name in
            ["moma-a", "moma-b", "moma-c", "moma-d", "moma-4s-p", "moma-4s-u10", "ox-glide-o", "ox-glide-x"]
        {
            let machine = Machine::load(name, &[]).unwrap();
            let index = usize::from(name == "ox-glide-x");
            let view = views(&machine, &Section::default()).unwrap().swap_remove(index);
            let [low, high] = view.reachable.boundary().bounding_box().unwrap();
            let box_ = [[low[0] - 3.1, low[1] - 3.3], [high[0] + 2.9, high[1] + 3.7]];
            let mut map = grid(box_, (high[0] - low[0]) / 97.3).unwrap();
            view.fill(&mut map, 1);
            let mut again = map.clone();
            view.fill(&mut again, 3);
            // With two lanes and with four.
            let xs: Vec<f64> = (0..map.size[0]).map(|column| map.node(column, 0)[0]).collect();
            let y = map.node(0, 40)[1];
            let (mut two, mut four) = (vec![1.0; xs.len()], vec![1.0; xs.len()]);
            multiply_row_plain(&view.mechanisms[0], y, &xs, &mut two);
            multiply_row(&view.mechanisms[0], y, &xs, &mut four);
            assert!(two.iter().zip(&four).all(|(a, b)| a.to_bits() == b.to_bits()));
            assert!(map.determinant.iter().zip(&again.determinant).all(|(a, b)| a.to_bits() == b.to_bits()));
            let ranges = machine.joint_ranges();
            let mechanism = match machine.mechanism {
                Mechanism::OxGlide(glide) => Mechanism::OxGlide(glide.without_limits()),
                other => other,
            };
            let mut inside = 0;
            for row in 0..map.size[1] {
                for column in 0..map.size[0] {
                    let [x, y] = map.node(column, row);
                    let pose = Pose { x, y, z: 1.0, ..Pose::ZERO };
                    let reached =
                        mechanism.inverse(&pose).is_ok_and(|q| JointRange::check(&ranges, &q).is_ok());
                    let value = map.determinant[row * map.size[0] + column];
                    assert_eq!(reached, !value.is_nan(), "{name} at {x} {y}");
                    if let (true, Ok(j)) = (reached, mechanism.jacobian(&pose)) {
                        let expected = j[0][0] * j[1][1] - j[0][1] * j[1][0];
                        assert!(
                            (value - expected).abs() <= 1e-11 * (1.0 + expected.abs()),
                            "{name} at {x} {y}: {value} {expected}"
                        );
                        inside += 1;
                    }
                }
            }
            assert!(inside > 400, "{name}: {inside}");
        }
    }

    #[test]
    fn a_resolution_that_is_none_is_refused() {
        let box_ = [[0.0, 0.0], [200.0, 100.0]];
        for step in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(grid(box_, step), Err(WorkspaceError::Resolution { .. })), "{step}");
        }
        let Err(WorkspaceError::TooFine { finest_mm, .. }) = grid(box_, 1e-9) else { panic!() };
        assert!(grid(box_, finest_mm).is_ok());
    }
}
