//! The distance from the origin to the boundary of a hull in R⁶ whose farthest points are found in
//! lanes: the expansion of [`Polytope`](super::polytope::Polytope) for those hulls, nearly all, that
//! need few facets and no sign of which is near 0.
//!
//! Facets lie side by side in lanes by their polar vertices x. A facet is a mask of six of at most
//! 64 inserted points; two are neighbours where their masks differ in two, so that no lists of
//! neighbours are kept: the ridges about the facets that see a new point are found by comparing their
//! masks with those of the facets that do not. What is not clear beyond rounding is left undone.

use super::enough::Enough;
use super::lanes::{LANES, Lane, Lanes, Table, load, splat_each};
use super::metric::Metric;
use super::neighbors::{MOST_POINTS, Mask, Missing};
use super::pivots::FirstSimplex;
use super::points::{Farthest, Points, dot, first_equal, lane_of};
use super::polytope::Distance;
use super::r6::{self, Twist, solve};
use super::support::Levels;
use super::surround::UNCLEAR_BOUNDARY;
use crate::contact::Norm;
use pulp::Simd;

/// The perturbation of the points' levels that makes facets simple.
pub(super) const EPSILON: f64 = 1e-9;
/// Heights over facets, relative to their polar vertices, that rounding may have made.
const ROUNDING: f64 = 1e-13;
/// Facets at a time before the other polytope is asked.
const MOST_FACETS: usize = 1 << 12;

/// Working memory.
#[derive(Debug, Clone, Default)]
pub(super) struct Facets {
    /// Polar vertices by component, a lane per facet; 0 in lanes that are free.
    x: Table<6>,
    /// The same by facet.
    rows: Vec<Lanes>,
    /// The points of a facet; none in lanes that are free.
    masks: Vec<Mask>,
    count: usize,
    points: Vec<Twist>,
    /// ‖x‖² or heights of a new point over the facets.
    values: Vec<Lanes>,
    /// Facets that see a new point.
    visible: Vec<u32>,
    /// Facets that do not, with five of their points, and their masks.
    candidates: Vec<u32>,
    candidate_masks: Vec<Mask>,
    created: Vec<Lanes>,
    created_masks: Vec<Mask>,
}

impl Facets {
    /// The distance of the hull's boundary from the origin, beginning with a simplex about it;
    /// `None` where a sign cannot be told.
    #[inline(always)]
    #[expect(
        clippy::too_many_arguments,
        reason = "inlined: the parts of a question"
    )]
    pub fn distance<S: Simd>(
        &mut self,
        simd: S,
        first: &FirstSimplex,
        hull: &mut Points,
        norm: Norm,
        levels: Levels,
        metric: Metric,
        enough: Enough,
    ) -> Option<Distance> {
        self.start(first);
        let mut best = Distance::UNKNOWN;
        loop {
            let nearest = self.nearest(simd, metric);
            let x = self.twist(nearest);
            let length = r6::dot(&x, &x).sqrt();
            best.lower = best.lower.max(1.0 / metric.length(&x)).min(best.upper);
            let Farthest { point, height, key } = hull.farthest(simd, norm, &x);
            // Not so where it is not a number, either.
            let beyond = height > UNCLEAR_BOUNDARY * length;
            if !beyond {
                return None;
            }
            best.take(height, &x, metric);
            let level = levels.of(key);
            let over = height - level;
            if over <= 0.01 * levels.epsilon {
                if !self.polish(simd, hull, norm, nearest, levels.epsilon, metric, &mut best) {
                    return None;
                }
                best.converged = true;
                return Some(best);
            }
            if enough.are(best.lower, best.upper) {
                best.converged = true;
                return Some(best);
            }
            self.insert(simd, &point, level)?;
        }
    }

    #[inline(always)]
    fn twist(&self, facet: usize) -> Twist {
        let row = &self.rows[facet];
        [row[0], row[1], row[2], row[3], row[4], row[5]]
    }

    /// The facets of the simplex: facet k lies opposite to point k.
    #[inline(always)]
    fn start(&mut self, first: &FirstSimplex) {
        self.reserve(64);
        self.points[..7].copy_from_slice(&first.points);
        let used = self.count.max(7);
        self.count = 7;
        for (k, x) in first.facets.iter().enumerate() {
            let mut row = Lanes::default();
            row[..6].copy_from_slice(x);
            self.put(k, row, 0b111_1111 & !(1 << k));
        }
        for free in 7..used {
            self.put(free, Lanes::default(), 0);
        }
    }

    /// Room for so many facets.
    #[inline(always)]
    fn reserve(&mut self, facets: usize) {
        if self.masks.len() < facets {
            self.grow(facets.next_power_of_two());
        }
    }

    #[cold]
    fn grow(&mut self, facets: usize) {
        self.x.resize(facets / LANES, Default::default());
        self.values.resize(facets / LANES, Lanes::default());
        self.rows.resize(facets, Lanes::default());
        self.points.resize(MOST_POINTS, [0.0; 6]);
        self.masks.resize(facets, 0);
        self.candidate_masks.resize(facets, 0);
        self.visible.resize(facets, 0);
        self.candidates.resize(facets, 0);
    }

    #[inline(always)]
    fn put(&mut self, facet: usize, row: Lanes, mask: Mask) {
        self.rows[facet] = row;
        self.masks[facet] = mask;
        let block = &mut self.x[facet / LANES];
        for i in 0..6 {
            block[i][facet % LANES] = row[i];
        }
    }

    /// The facet nearest to the origin; sets all ‖x‖².
    #[inline(always)]
    fn nearest<S: Simd>(&mut self, simd: S, metric: Metric) -> usize {
        let blocks = self.count.div_ceil(LANES);
        let mut most = Lane::splat(simd, 0.0);
        let values = &mut self.values[..blocks];
        for (rows, out) in self.x[..blocks].iter().zip(&mut *values) {
            for v in 0..LANES / S::F64_LANES {
                let square = metric.squares(simd, &load(simd, rows, v));
                most = most.max(square);
                S::as_mut_simd_f64s(&mut out.0).0[v] = square.value;
            }
        }
        let (block, lane) = first_equal(values, simd.reduce_max_f64s(most.value));
        block * LANES + lane
    }

    /// Replaces the facets that see a new point by new ones about it; `None` where it is not clear
    /// which do, or there are too many.
    #[inline(always)]
    fn insert<S: Simd>(&mut self, simd: S, point: &Twist, level: f64) -> Option<()> {
        let count = self.count;
        let (visible, seen) = self.see(simd, point, level)?;
        // The facets that do not see it, but have five points of those that do.
        let (mut candidates, mut used) = (0, 0);
        for facet in 0..count {
            let mask = self.masks[facet];
            used |= mask;
            self.candidates[candidates] = facet as u32;
            self.candidate_masks[candidates] = mask;
            let hidden = self.values[facet / LANES][facet % LANES] < 0.0;
            candidates += usize::from(hidden & ((mask & seen).count_ones() >= 5));
        }
        let place = (!used).trailing_zeros();
        if place as usize >= MOST_POINTS || visible == 0 {
            return None;
        }
        self.points[place as usize] = *point;
        self.created.clear();
        self.created_masks.clear();
        for from in (0..visible).step_by(64) {
            let part = &self.visible[from..visible.min(from + 64)];
            let missing = Missing::of(&self.masks, part);
            for k in 0..candidates {
                let mask = self.candidate_masks[k];
                let mut met = missing.neighbors(mask);
                while met != 0 {
                    let own = self.visible[from + met.trailing_zeros() as usize] as usize;
                    met &= met - 1;
                    self.between(simd, own, self.candidates[k] as usize);
                    let ridge = mask & self.masks[own];
                    self.created_masks.push(ridge | 1 << place);
                }
            }
        }
        self.replace(visible)
    }

    /// The heights of a new point over the facets, and those that see it: how many, and all their
    /// points.
    #[inline(always)]
    fn see<S: Simd>(&mut self, simd: S, point: &Twist, level: f64) -> Option<(usize, Mask)> {
        let blocks = self.count.div_ceil(LANES);
        let (point, level) = (splat_each(simd, *point), Lane::splat(simd, level));
        let bar = Lane::splat(simd, ROUNDING * ROUNDING);
        let mut least = Lane::splat(simd, f64::INFINITY);
        for (rows, out) in self.x[..blocks].iter().zip(&mut self.values) {
            for v in 0..LANES / S::F64_LANES {
                let x = load(simd, rows, v);
                let height = dot(&point, &x) - level;
                least = least.min(height * height - bar * dot(&x, &x));
                S::as_mut_simd_f64s(&mut out.0).0[v] = height.value;
            }
        }
        let clear = simd.reduce_min_f64s(least.value) > 0.0;
        if !clear {
            return None;
        }
        let (mut visible, mut seen) = (0, 0);
        for block in 0..blocks {
            let mut bits = positive(&self.values[block]);
            while bits != 0 {
                let facet = block * LANES + lane_of(bits);
                bits &= bits - 1;
                self.visible[visible] = facet as u32;
                seen |= self.masks[facet];
                visible += 1;
            }
        }
        Some((visible, seen))
    }

    /// Creates the facet through a new point and the ridge between two, of which the first sees the point
    /// and the other does not.
    #[inline(always)]
    fn between<S: Simd>(&mut self, simd: S, seeing: usize, other: usize) {
        let over = self.values[seeing / LANES][seeing % LANES];
        let under = self.values[other / LANES][other % LANES];
        let share = Lane::splat(simd, over / (over - under));
        let (from, to) = (&self.rows[seeing], &self.rows[other]);
        let mut row = Lanes::default();
        for v in 0..LANES / S::F64_LANES {
            let from = Lane::new(simd, S::as_simd_f64s(&from.0).0[v]);
            let to = Lane::new(simd, S::as_simd_f64s(&to.0).0[v]);
            let between = from + share * (to - from);
            S::as_mut_simd_f64s(&mut row.0).0[v] = between.value;
        }
        self.created.push(row);
    }

    /// Puts the created facets into the places of the visible ones and behind the others.
    #[inline(always)]
    fn replace(&mut self, visible: usize) -> Option<()> {
        let created = self.created.len();
        let count = self.count + created - visible.min(created);
        if count > MOST_FACETS {
            return None;
        }
        self.reserve(count);
        for k in 0..created {
            let (row, mask) = (self.created[k], self.created_masks[k]);
            let place = if k < visible {
                self.visible[k] as usize
            } else {
                self.count + k - visible
            };
            self.put(place, row, mask);
        }
        self.count = count;
        // Fewer than there were: the last ones move into the places that are free.
        for k in (created..visible).rev() {
            let free = self.visible[k] as usize;
            self.count -= 1;
            let last = self.count;
            self.put(free, self.rows[last], self.masks[last]);
            self.put(last, Lanes::default(), 0);
        }
        Some(())
    }

    /// The best of the facets that may be nearest but for the perturbation, by the planes through
    /// their points as they are; false if that is not a facet of the hull beyond rounding.
    #[inline(always)]
    #[expect(
        clippy::too_many_arguments,
        reason = "inlined: the parts of a question"
    )]
    fn polish<S: Simd>(
        &self,
        simd: S,
        hull: &mut Points,
        norm: Norm,
        nearest: usize,
        epsilon: f64,
        metric: Metric,
        best: &mut Distance,
    ) -> bool {
        let square = |facet: usize| self.values[facet / LANES][facet % LANES];
        let bar = square(nearest) * (1.0 - 8.0 * epsilon);
        let mut proper = f64::INFINITY;
        for facet in 0..self.count {
            if square(facet) < bar {
                continue;
            }
            let (mut rows, mut mask) = ([[0.0; 6]; 6], self.masks[facet]);
            for row in &mut rows {
                *row = self.points[mask.trailing_zeros() as usize % MOST_POINTS];
                mask &= mask.wrapping_sub(1);
            }
            if let Some(x) = solve(rows, [1.0; 6]) {
                let Farthest { height, .. } = hull.farthest(simd, norm, &x);
                best.take(height, &x, metric);
                if height - 1.0 <= ROUNDING * r6::dot(&x, &x).sqrt() {
                    proper = proper.min(height / metric.length(&x));
                }
            }
        }
        best.lower = best.lower.min(best.upper);
        proper <= best.upper * (1.0 + 1e-12)
    }
}

/// Which numbers are positive, a byte each.
#[inline(always)]
fn positive(row: &Lanes) -> u64 {
    let mut flags = [0; LANES];
    for lane in 0..LANES {
        flags[lane] = u8::from(row[lane] > 0.0);
    }
    u64::from_le_bytes(flags)
}
