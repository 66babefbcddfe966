//! Is the origin in the interior of a hull, and which simplex of its points is about it? The simplex
//! method of [`surround`](super::surround), in lanes and for hulls whose points are listed.
//!
//! Where that one has a column per point and asks again and again in the same order, this one keeps
//! the inverse by columns, a lane per basic point, and moves x along the row that leaves. It answers
//! only where nothing is near: all else is unclear, and left to the other.

use super::lanes::{LANES, Lane, Lanes, greatest, load, splat_each};
use super::points::{Farthest, Points, dot};
use super::r6::{self, Twist};
use super::support::Levels;
use super::surround::{BOUNDARY, UNCLEAR_BOUNDARY};
use crate::contact::Norm;
use pulp::Simd;

/// Steps before the method counts as failed; it needs about a dozen.
const MOST_STEPS: usize = 100;
/// An entry of a column, relative to the largest, that is too small to divide by.
const PIVOT: f64 = 1e-9;
/// The longest polar vertex of a first simplex: beyond it, or nearly, it may be flat.
const LONGEST: f64 = 1e6;

/// Where the origin is.
#[expect(clippy::large_enum_variant, reason = "inlined: never moved")]
pub(super) enum First {
    /// In the interior of a simplex of points of the hull.
    About(FirstSimplex),
    /// Not in the interior of the hull: a unit x with ⟨x, w⟩ ≤ [`BOUNDARY`] for all its points.
    Separated(Twist),
    /// Too near to tell.
    Unclear,
}

/// Seven points about the origin, and the facets by their polar vertices: the x
/// with ⟨x, p⟩ = level of p for all points but that of the same index.
pub(super) struct FirstSimplex {
    pub points: [Twist; 7],
    pub facets: [Twist; 7],
}

/// The basis: per component of a row of the inverse, a lane per basic point.
struct Pivots {
    inverse: [Lanes; 6],
    /// λ ≥ 0 with Σ λ_k w_k = d.
    weights: Lanes,
    points: [Twist; 6],
    /// What ⟨x, w_k⟩ must not exceed; of artificial columns there is none.
    levels: [f64; 6],
    artificial: u32,
}

/// Looks for the origin in the hull of some points, or of the sums of one of each group.
#[inline(always)]
pub(super) fn first_simplex<S: Simd>(
    simd: S,
    points: &mut Points,
    norm: Norm,
    levels: Levels,
) -> First {
    let inside = points.inside();
    let mut pivots = Pivots::artificial(&inside);
    let mut x = [0.0; 6];
    for i in 0..6 {
        x[i] = pivots.inverse[i][i];
    }
    for _ in 0..MOST_STEPS {
        let Farthest { point, height, key } = points.farthest(simd, norm, &x);
        let length = r6::dot(&x, &x).sqrt();
        let beyond = height > UNCLEAR_BOUNDARY * length;
        if !beyond {
            return if height <= BOUNDARY * length {
                First::Separated(x.map(|c| c / length))
            } else {
                First::Unclear
            };
        }
        let level = levels.of(key);
        let target = if pivots.artificial != 0 { 0.0 } else { level };
        if pivots.artificial == 0 && height <= level + 1e-12 * length {
            return pivots.simplex(simd, points, norm, levels, &inside);
        }
        let had = pivots.artificial;
        let Some(head) = pivots.enter(simd, &point, level) else {
            return First::Unclear;
        };
        if had != 0 && pivots.artificial == 0 {
            x = pivots.polar();
        } else {
            x = r6::add(&x, target - height, &head);
        }
    }
    First::Unclear
}

impl Pivots {
    /// Columns along the axes that cost more than any real one.
    #[inline(always)]
    fn artificial(inside: &Twist) -> Self {
        let (mut inverse, mut weights) = ([Lanes::default(); 6], Lanes::default());
        for k in 0..6 {
            inverse[k][k] = 1.0_f64.copysign(-inside[k]);
            weights[k] = inside[k].abs();
        }
        Self {
            inverse,
            weights,
            points: [[0.0; 6]; 6],
            levels: [0.0; 6],
            artificial: 0b11_1111,
        }
    }

    /// The x with ⟨x, w_k⟩ = level of w_k.
    #[inline(always)]
    fn polar(&self) -> Twist {
        let mut x = [0.0; 6];
        for i in 0..6 {
            for k in 0..6 {
                x[i] += self.levels[k] * self.inverse[i][k];
            }
        }
        x
    }

    /// Products of all rows of the inverse with a point.
    #[inline(always)]
    fn entries<S: Simd>(&self, simd: S, point: &Twist) -> Lanes {
        let point = splat_each(simd, *point);
        let mut entries = Lanes::default();
        for v in 0..LANES / S::F64_LANES {
            let entry = dot(&load(simd, &self.inverse, v), &point);
            S::as_mut_simd_f64s(&mut entries.0).0[v] = entry.value;
        }
        entries
    }

    /// How deep a point lies in the cone opposite to the basic points, the sides of which have
    /// normals of one over these lengths.
    #[inline(always)]
    fn depth<S: Simd>(&self, simd: S, point: &Twist, shares: &[f64; 6]) -> f64 {
        let entries = self.entries(simd, point);
        let mut least = f64::INFINITY;
        for k in 0..6 {
            let depth = -entries[k] * shares[k];
            least = if depth < least { depth } else { least };
        }
        least
    }

    /// Exchanges a column for a point of the hull, so that the weights stay positive; the row of
    /// the inverse that belongs to it.
    #[inline(always)]
    fn enter<S: Simd>(&mut self, simd: S, point: &Twist, level: f64) -> Option<Twist> {
        let entries = self.entries(simd, point);
        let mut largest = 0.0;
        for k in 0..6 {
            largest = greatest(entries[k].abs(), largest);
        }
        let (mut leaving, mut least) = (6, f64::INFINITY);
        for k in 0..6 {
            let weight = greatest(self.weights[k], 0.0);
            let ratio = weight / entries[k];
            if (entries[k] > PIVOT * largest) & (ratio < least) {
                (least, leaving) = (ratio, k);
            }
        }
        if leaving == 6 {
            return None;
        }
        let share = 1.0 / entries[leaving];
        let mut head = [0.0; 6];
        for i in 0..6 {
            head[i] = self.inverse[i][leaving] * share;
        }
        for v in 0..LANES / S::F64_LANES {
            let entry = Lane::new(simd, S::as_simd_f64s(&entries.0).0[v]);
            for i in 0..6 {
                let row = &mut S::as_mut_simd_f64s(&mut self.inverse[i].0).0[v];
                *row = (Lane::new(simd, *row) - entry * Lane::splat(simd, head[i])).value;
            }
            let weights = &mut S::as_mut_simd_f64s(&mut self.weights.0).0[v];
            *weights = (Lane::new(simd, *weights) - entry * Lane::splat(simd, least)).value;
        }
        for i in 0..6 {
            self.inverse[i][leaving] = head[i];
        }
        self.weights[leaving] = least;
        self.artificial &= !(1 << leaving);
        self.points[leaving] = *point;
        self.levels[leaving] = level;
        Some(head)
    }

    /// The simplex of the columns and a seventh point: the one that is deepest in the cone opposite
    /// to theirs of those listed or, of sums, of two; or that inside, −d, if it is deeper.
    #[inline(always)]
    fn simplex<S: Simd>(
        &self,
        simd: S,
        points: &mut Points,
        norm: Norm,
        levels: Levels,
        inside: &Twist,
    ) -> First {
        let facet = self.polar();
        let mut shares = [0.0; 6];
        let mut across = [0.0; 6];
        for k in 0..6 {
            for i in 0..6 {
                shares[k] += self.inverse[i][k] * self.inverse[i][k];
            }
            shares[k] = 1.0 / shares[k].sqrt();
            for i in 0..6 {
                across[i] -= self.inverse[i][k] * shares[k];
            }
        }
        let mut seventh = (*inside, 1.0);
        let mut depth = self.depth(simd, inside, &shares);
        match norm {
            Norm::Sum => {
                let (block, lane, deepest) = points.deepest(simd, &self.inverse, &shares);
                if deepest > depth {
                    let key = points.key(block, lane);
                    seventh = (points.point(block, lane), levels.of(key));
                }
            }
            Norm::Each => {
                for direction in [facet.map(|c| -c), across] {
                    let far = points.farthest(simd, norm, &direction);
                    let own = self.depth(simd, &far.point, &shares);
                    if own > depth {
                        depth = own;
                        seventh = (far.point, levels.of(far.key));
                    }
                }
            }
        }
        let (point, level) = seventh;
        let entries = self.entries(simd, &point);
        let gap = level - r6::dot(&facet, &point);
        let mut longest = r6::dot(&facet, &facet);
        let (mut all, mut facets) = ([point; 7], [facet; 7]);
        for k in 0..6 {
            // Not so where it is not a number, either.
            let opposite = entries[k] < 0.0;
            if !opposite {
                return First::Unclear;
            }
            all[k] = self.points[k];
            let share = gap / entries[k];
            for i in 0..6 {
                facets[k][i] = facet[i] + share * self.inverse[i][k];
            }
            longest = greatest(r6::dot(&facets[k], &facets[k]), longest);
        }
        let plump = gap > 0.0 && longest < LONGEST * LONGEST;
        if !plump {
            return First::Unclear;
        }
        First::About(FirstSimplex {
            points: all,
            facets,
        })
    }
}
