//! d(S, S') = sup max(‖c_S − c_S'‖, ‖n_S − n_S'‖) of Sec. III, with a proven error bound.
//!
//! Branch and bound over cells of the (u, θ) rectangle. In the frame that turns with θ the
//! differences are δ_c = (Δf, 0, Δz) and δ_n = n − n'. On a cell with half-widths (a, b) about its
//! centre, Taylor's formula bounds ‖δ‖ by the largest ‖δ ± a δ_u ± b δ_θ‖ at the centre plus
//! ½ Σ K_ij h_i h_j, K_ij bounds of the second derivatives of δ. These come from the splines' Bézier
//! nets on each cell (`bounds`), as products of sizes and of *differences* between the two surfaces,
//! so that they vanish with the distance. Every bound includes what rounding can have done to it:
//! to the coefficients on a common grid, to δ and its derivatives at a point (`pair`), to the nets.

use crate::error::Error;
use crate::surface::Surface;
use bounds::{bends, normals_apart};
use cell::{Cell, Distance, Noise};
use glam::{DVec2, DVec3};
use net::ranges_on;
use pair::{Pair, Patch};
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::TAU;
use std::ops::ControlFlow;

mod bounds;
mod cell;
mod net;
mod pair;
mod size;

/// Cells looked at before the search ends with the bound that it has.
const MOST_CELLS: usize = 1 << 18;

/// Cells between two calls of the progress function.
const CELLS_BETWEEN: usize = 1 << 12;

/// Bounds of second derivatives are computed anew on cells halved up to three times, and then at
/// every fourth halving up to this one, beyond which derivatives of nets are mostly rounding. In
/// between a cell keeps its ancestor's bounds, which hold for it too.
const DEEPEST: u32 = 12;

/// Positions are rounded to less than this.
const POSITION: DVec2 = DVec2::new(8.0 * f64::EPSILON, 8.0 * TAU * f64::EPSILON);

/// A distance between surfaces: d(S, S') lies in [`value`, `value` + `error`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceDistance {
    /// The distance of the points or normals at (u, θ), to its own rounding.
    pub value: f64,
    /// How much larger the supremum may be, rounding included.
    pub error: f64,
    /// Where.
    pub at: [f64; 2],
}

/// The furthest point so far.
struct Best {
    value: f64,
    at: DVec2,
}

impl Best {
    fn improve(&mut self, value: f64, at: DVec2) {
        if value > self.value {
            self.value = value;
            self.at = at;
        }
    }

    fn with_bound(mut self, pair: &Pair, bound: f64) -> SurfaceDistance {
        self.at.x = self.at.x.clamp(0.0, 1.0);
        self.at.y = self.at.y.rem_euclid(TAU);
        // It was the furthest by one of the two distances, and may be further by the other one.
        let value = self.value.max(pair.distance(self.at));
        let left = (bound + pair.moved(bound) - value).max(0.0);
        SurfaceDistance {
            value,
            error: left * (1.0 + 1e-15) + 4.0 * f64::EPSILON * value,
            at: self.at.into(),
        }
    }
}

/// d(S, S') to a relative error of `tolerance`, or to rounding where that is more.
///
/// `progress` is called every few milliseconds; what it answers may end the search with
/// [`Error::Interrupted`].
pub fn surface_distance(
    first: &Surface,
    second: &Surface,
    tolerance: f64,
    mut progress: impl FnMut() -> ControlFlow<()>,
) -> Result<SurfaceDistance, Error> {
    if tolerance.is_nan() || tolerance <= 0.0 {
        return Err(Error::Tolerance { got: tolerance });
    }
    let mut pair = Pair::new(first, second)?;
    let mut best = Best {
        value: 0.0,
        at: DVec2::ZERO,
    };
    if pair.are_equal() {
        return Ok(SurfaceDistance {
            value: 0.0,
            error: 0.0,
            at: [0.0; 2],
        });
    }
    // Cells that are in the queue, and places that are free again.
    let (mut cells, mut free): (Vec<Cell>, Vec<usize>) = Default::default();
    let patches = pair.patches().into_iter();
    let mut queue: BinaryHeap<Entry> = patches
        .map(|(bound, patch)| Entry {
            bound,
            noise: 0.0,
            part: Part::Patch(patch),
        })
        .collect();
    // What was put aside may be larger than the best by its rounding.
    let mut aside = 0.0_f64;
    let mut examined = 0;
    while let Some(Entry { bound, noise, part }) = queue.pop() {
        let close = tolerance * best.value * (1.0 - 1e-9) + 2.0 * noise + pair.moved(bound);
        if bound - best.value <= close || examined > MOST_CELLS {
            return Ok(best.with_bound(&pair, bound.max(aside)));
        }
        let parts = match part {
            Part::Patch(patch) => [Some(pair.cell(patch)), None],
            Part::Cell(index, along_u) => {
                free.push(index);
                cells[index].halves(along_u).map(Some)
            }
        };
        for mut cell in parts.into_iter().flatten() {
            examined += 1;
            if examined % CELLS_BETWEEN == 0 && progress().is_break() {
                return Err(Error::Interrupted);
            }
            match examine(&pair, &mut cell, &mut best, bound) {
                Outcome::Bounded {
                    bound,
                    noise,
                    along_u,
                } => {
                    let index = free.pop().unwrap_or(cells.len());
                    if index == cells.len() {
                        cells.push(cell);
                    } else {
                        cells[index] = cell;
                    }
                    let part = Part::Cell(index, along_u);
                    queue.push(Entry { bound, noise, part });
                }
                Outcome::Below(bound) => aside = aside.max(bound),
                Outcome::LargestElsewhere => {}
            }
        }
    }
    // Every cell was shown to have nothing larger than the best, or its largest in another one.
    Ok(best.with_bound(&pair, aside))
}

/// A part of the surfaces and a bound of the distance on it.
#[derive(Debug, Clone, Copy)]
struct Entry {
    bound: f64,
    /// How much of the bound is for the rounding of δ at a point, which no halving takes off.
    noise: f64,
    part: Part,
}

#[derive(Debug, Clone, Copy)]
enum Part {
    Patch(Patch),
    /// A cell, and whether to halve it along u.
    Cell(usize, bool),
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Entry {}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound)
    }
}

enum Outcome {
    /// Nothing on the cell is further apart than `bound`, `noise` of it for the rounding of δ.
    Bounded {
        bound: f64,
        noise: f64,
        along_u: bool,
    },
    /// The same, and that is no more than the best.
    Below(f64),
    /// The distance grows all over the cell in one direction, so that it is largest beyond it.
    LargestElsewhere,
}

/// Bounds a cell after trying its centre and the corner that promises most. `known` is a bound for a
/// larger one.
///
/// Where ‖δ‖ is shown to grow all over the cell in one direction, it is largest on the edge: if
/// that is an end of the surfaces, only the edge is left, else the largest is beyond it.
fn examine(pair: &Pair, cell: &mut Cell, best: &mut Best, known: f64) -> Outcome {
    let mut rough = known;
    let regular = cell.depth < 4 || cell.depth.is_multiple_of(4);
    if cell.of == Distance::Normals && cell.is_rough && cell.depth <= 2 * DEEPEST
        || regular && cell.depth <= DEEPEST
    {
        let mut ranges =
            std::array::from_fn(|k| ranges_on(&cell.nets[k], cell.span, cell.net_errors[k]));
        for (ranges, lowest) in ranges.iter_mut().zip(cell.lowest) {
            ranges[0][0].low = ranges[0][0].low.max(lowest);
        }
        if cell.of == Distance::Normals {
            let low = ranges.map(|r| [r[0][0], r[1][0], r[0][1]]);
            rough = rough.min(normals_apart(low, pair.heights).0 + cell.noise.value);
            if rough < best.value {
                return Outcome::Below(rough);
            }
        }
        let tighter = bends(cell.of, &ranges, pair.heights);
        cell.bends = std::array::from_fn(|k| cell.bends[k].min(tighter[k]));
    }
    let mut model = Model::new(pair, cell);
    if let Some(sign) = model.grows_along_u(cell) {
        let end = cell.center.x + cell.half.x * sign;
        if end > 1e-9 && end < 1.0 - 1e-9 {
            return Outcome::LargestElsewhere;
        }
        cell.center.x = end.round();
        cell.half.x = 0.0;
        model = Model::new(pair, cell);
    }
    if model.grows_along_theta(cell) {
        return Outcome::LargestElsewhere;
    }
    best.improve(model.value.length(), cell.center);
    let (longest, corner) = model.longest();
    if longest > best.value {
        let corner = cell.center + corner * cell.half;
        best.improve(pair.difference(cell.of, corner)[0].length(), corner);
    }
    let rounding = longest * 1e-15 + model.noise.value + model.noise.slope.dot(model.half);
    let close = longest + model.bend() + rounding;
    cell.is_rough = rough < close;
    Outcome::Bounded {
        bound: close.min(rough),
        noise: model.noise.value,
        along_u: model.is_better_halved_along_u(),
    }
}

/// Taylor's formula for δ about the centre of a cell.
struct Model {
    value: DVec3,
    by_u: DVec3,
    by_theta: DVec3,
    /// Half-widths, 0 or a little more than those of the cell: positions are rounded.
    half: DVec2,
    bends: [f64; 3],
    noise: Noise,
}

impl Model {
    fn new(pair: &Pair, cell: &Cell) -> Self {
        let [value, by_u, by_theta] = pair.difference(cell.of, cell.center);
        let wide = |half: f64, rounding: f64| if half > 0.0 { half + rounding } else { 0.0 };
        Self {
            value,
            by_u,
            by_theta,
            half: DVec2::new(wide(cell.half.x, POSITION.x), wide(cell.half.y, POSITION.y)),
            bends: cell.bends,
            noise: cell.noise,
        }
    }

    /// Bounds of ‖δ_u‖ and ‖δ_θ‖ on the cell.
    fn fastest(&self) -> [f64; 2] {
        let ([uu, ut, tt], DVec2 { x, y }) = (self.bends, self.half);
        [
            self.by_u.length() + self.noise.slope.x + uu * x + ut * y,
            self.by_theta.length() + self.noise.slope.y + ut * x + tt * y,
        ]
    }

    /// The sign of ∂‖δ‖/∂u, if that is the same on all of the cell.
    fn grows_along_u(&self, cell: &Cell) -> Option<f64> {
        let [uu, ut, _] = self.bends;
        let change = uu * self.half.x + ut * self.half.y + self.noise.slope.x;
        let grows = cell.half.x > 0.0 && self.grows(self.by_u, self.fastest()[0], change);
        grows.then(|| self.value.dot(self.by_u).signum())
    }

    /// Has ∂‖δ‖/∂θ the same sign on all of the cell?
    fn grows_along_theta(&self, cell: &Cell) -> bool {
        let [_, ut, tt] = self.bends;
        let change = ut * self.half.x + tt * self.half.y + self.noise.slope.y;
        cell.half.y > 0.0 && self.grows(self.by_theta, self.fastest()[1], change)
    }

    /// Is ⟨δ, δ'⟩ of one sign on the cell, where δ' in a direction is `slope` at the centre, changes
    /// by up to `change` and is no longer than `fastest`?
    fn grows(&self, slope: DVec3, fastest: f64, change: f64) -> bool {
        let [fastest_u, fastest_theta] = self.fastest();
        let reach = fastest_u * self.half.x + fastest_theta * self.half.y + self.noise.value;
        let length = self.value.length() + self.noise.value;
        self.value.dot(slope).abs() > (reach * fastest + length * change) * (1.0 + 1e-12)
    }

    /// The largest length of the linear part, and the signs of the corner where that is.
    fn longest(&self) -> (f64, DVec2) {
        let (along_u, along_theta) = (self.by_u * self.half.x, self.by_theta * self.half.y);
        let (mut longest, mut corner) = (0.0, DVec2::ZERO);
        for sign in [
            DVec2::ONE,
            DVec2::NEG_ONE,
            DVec2::new(1.0, -1.0),
            DVec2::new(-1.0, 1.0),
        ] {
            let length = (self.value + along_u * sign.x + along_theta * sign.y).length();
            if length > longest {
                (longest, corner) = (length, sign);
            }
        }
        (longest, corner)
    }

    /// What second derivatives add to the linear part at most.
    fn bend(&self) -> f64 {
        let ([uu, ut, tt], DVec2 { x, y }) = (self.bends, self.half);
        0.5 * (uu * x * x + 2.0 * ut * x * y + tt * y * y)
    }

    /// By what halving in either direction would take off the bound, roughly.
    fn is_better_halved_along_u(&self) -> bool {
        let ([uu, ut, tt], DVec2 { x, y }) = (self.bends, self.half);
        let gain_u = self.by_u.length() * x + uu * x * x + ut * x * y;
        let gain_theta = self.by_theta.length() * y + tt * y * y + ut * x * y;
        x > 0.0 && (y == 0.0 || gain_u >= gain_theta)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface(height: f64, seed: u64, rows: usize, columns: usize) -> Surface {
        let mut state = seed;
        let coefficients = (0..rows * columns)
            .map(|_| {
                state = state
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                0.5 + 0.3 * (state >> 11) as f64 / (1u64 << 53) as f64
            })
            .collect();
        Surface::new(-height, height, columns, coefficients).unwrap()
    }

    fn between(first: &Surface, second: &Surface) -> SurfaceDistance {
        surface_distance(first, second, 1e-6, || ControlFlow::Continue(())).unwrap()
    }

    #[test]
    fn no_point_of_a_fine_grid_is_further_apart_and_some_is_as_far() {
        for seed in 1..12 {
            let (first, second) = (surface(0.6, seed, 7, 8), surface(0.7, seed + 50, 5, 4));
            let found = between(&first, &second);
            assert!(found.error <= 1e-6 * found.value);
            let apart = |u: f64, theta: f64| {
                let (p, q) = (first.contact(u, theta), second.contact(u, theta));
                p.point.distance(q.point).max(p.normal.distance(q.normal))
            };
            let [u, theta] = found.at;
            assert!((apart(u, theta) - found.value).abs() < 1e-12);
            let mut largest = 0.0_f64;
            for i in 0..=400 {
                for j in 0..800 {
                    largest = largest.max(apart(i as f64 / 400.0, TAU * j as f64 / 800.0));
                }
            }
            assert!(largest <= found.value + found.error, "{largest} {found:?}");
            assert!(largest > 0.999 * found.value);
        }
    }

    #[test]
    fn small_differences_are_found_as_exactly() {
        let first = surface(0.6, 3, 9, 8);
        for size in [1e-3, 1e-9] {
            let moved = first.coefficients().iter().enumerate();
            let moved = moved
                .map(|(k, c)| c + size * crate::math::sin(k as f64))
                .collect();
            let second = Surface::new(-0.6, 0.6, 8, moved).unwrap();
            let found = between(&first, &second);
            assert!(found.value > 0.1 * size && found.value < 100.0 * size);
            assert!(found.error <= 1e-6 * found.value);
        }
        assert_eq!(between(&first, &first).value, 0.0);
    }
}
