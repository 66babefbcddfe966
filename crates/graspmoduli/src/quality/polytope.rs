//! The distance from the origin to the boundary of a convex hull in R⁶ that is known only by its
//! support function: best-first expansion of an inner polytope about the origin.
//!
//! A facet is kept as x ∈ R⁶ with ⟨x, p⟩ = 1 for its six points; its distance from the origin is
//! 1/‖x‖. The nearest facet is asked for the farthest point beyond it. If there is none it is a
//! facet of the hull, and the answer. Otherwise the facets that see the new point are replaced by
//! a cone of new ones from it: each goes through a ridge between a facet f that sees the point and
//! a g that does not, so x is the convex combination of x_f and x_g with ⟨x, p⟩ = 1, and nothing is
//! solved. At any time 1/‖x‖ of the nearest facet bounds the answer from below, and h(x)/‖x‖, h
//! the support function, from above. The first polytope is the simplex that [`surround`] finds.
//!
//! Points in one plane, such as the edges of a cone, would give facets of more than six points.
//! So a point p counts as p/(1 + ε_p) with fixed tiny different ε_p, which moves the answer inward
//! by less than that; the value reported is that of the points as they are. Where a sign cannot
//! be told from rounding all the same, the expansion begins anew in coordinates in which the hull
//! is not flat, and then with other, larger ε_p.

use super::metric::Metric;
use super::r6::{Twist, dot, solve};
use super::support::{Levels, Support, mix};
use super::surround::{BOUNDARY, Coordinates, Own, Position, Simplex, UNCLEAR_BOUNDARY, surround};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// The perturbations ε that are tried, one after the other.
const EPSILONS: [f64; 6] = [1e-9, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5];
/// The largest error of a value, relative to the longest wrench, that a perturbation may bring with
/// it; a value with a larger one has not converged.
pub(crate) const LARGEST_ERROR: f64 = 1e-8;
/// Slots of the table of ridges: free, and met twice.
const EMPTY: u32 = u32::MAX;
const JOINED: u32 = u32::MAX - 1;
/// A height over a facet, relative to ‖x‖, that rounding may have made.
const ROUNDING: f64 = 1e-14;
/// Facets created before the search ends with the bounds that it has.
const MOST_FACETS: usize = 1 << 22;

/// What is known about the distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Distance {
    /// Not above the distance.
    pub lower: f64,
    /// Not below it: h(x) for the x of length 1 that is `direction`.
    pub upper: f64,
    /// x, in the hull's coordinates.
    pub direction: Twist,
    /// Is `upper` the distance, but for rounding? Or else, did the caller have enough?
    pub converged: bool,
}

impl Distance {
    /// The origin is not in the interior of the hull, which lies behind the plane with this normal.
    pub const fn zero(direction: Twist) -> Self {
        Self {
            lower: 0.0,
            upper: 0.0,
            direction,
            converged: true,
        }
    }

    /// Nothing is known but that the distance is at least 0.
    pub const UNKNOWN: Self = Self {
        lower: 0.0,
        upper: f64::INFINITY,
        direction: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        converged: false,
    };

    /// Takes the direction x, in which the hull reaches up to ⟨x, ·⟩ = height.
    pub fn take(&mut self, height: f64, x: &Twist, metric: Metric) {
        let length = metric.length(x);
        if height / length < self.upper {
            self.upper = height / length;
            self.direction = x.map(|c| c / length);
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Facet {
    x: Twist,
    points: [u32; 6],
    /// Across the ridge without the point of the same index.
    neighbors: [u32; 6],
    alive: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    /// ‖x‖² but for the metric's unit.
    square: f64,
    facet: u32,
}

impl Eq for Entry {}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> Ordering {
        self.square
            .total_cmp(&other.square)
            .then(other.facet.cmp(&self.facet))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Working memory for expansions.
#[derive(Debug, Clone, Default)]
pub(super) struct Polytope {
    points: Vec<Twist>,
    hashes: Vec<u64>,
    facets: Vec<Facet>,
    queue: BinaryHeap<Entry>,
    /// Facets that see the new point, and the ridges about them.
    visible: Vec<u32>,
    created: Vec<u32>,
    /// Ridges of the created facets in an open hash table: sum of the points' hashes, and where
    /// the ridge was met first, facet · 8 + side.
    ridges: Vec<(u64, u32)>,
}

/// Rounding made the facets contradict each other, or a sign could not be told.
struct Rounding;

/// What an expansion is asked, and what it knows so far.
struct Expansion<'a, S, E> {
    support: &'a S,
    metric: Metric,
    levels: Levels,
    best: &'a mut Distance,
    /// How far the hull reaches in the direction in which it reaches least, of those looked at.
    flattest: &'a mut (f64, Twist),
    enough: &'a mut E,
}

impl Polytope {
    /// The distance from the origin to the boundary of a hull by a metric. `enough(lower, upper)`
    /// may end the search early.
    ///
    /// The distance is 0 where the origin is not in the interior, or only by [`BOUNDARY`].
    pub fn distance(
        &mut self,
        support: &impl Support,
        metric: Metric,
        mut enough: impl FnMut(f64, f64) -> bool,
    ) -> Distance {
        let mut best = Distance::UNKNOWN;
        if !metric.is_tame() {
            return best;
        }
        for (attempt, epsilon) in (0..).zip(EPSILONS) {
            let levels = Levels {
                epsilon,
                salt: attempt << 48,
            };
            let found = match surround(support, levels, &Own) {
                Position::Unclear(basis) => (surround(support, levels, &*basis), Some(basis)),
                found => (found, None),
            };
            let (basis, coordinates) = match found {
                (Position::Separated(x), _) => return Distance::zero(x),
                (Position::Surrounded(basis), coordinates) => (basis, coordinates),
                (Position::Unclear(_), _) => continue,
            };
            let mut flattest = (f64::INFINITY, [0.0; 6]);
            let mut expansion = Expansion {
                flattest: &mut flattest,
                support,
                metric,
                levels,
                best: &mut best,
                enough: &mut enough,
            };
            let expanded = match coordinates {
                None => self
                    .expand(basis.simplex(), &Own, &mut expansion)
                    .or_else(|_| self.expand(basis.simplex_of_axes(), &*basis, &mut expansion)),
                Some(flat) => self.expand(basis.simplex(), &*flat, &mut expansion),
            };
            if expanded.is_ok() {
                return best;
            }
            if flattest.0 <= UNCLEAR_BOUNDARY {
                return Distance::zero(flattest.1);
            }
        }
        best.lower = best.lower.min(best.upper);
        best
    }

    /// Narrows the bounds until they meet, or are enough for the caller, or too many facets.
    fn expand<S: Support, E: FnMut(f64, f64) -> bool>(
        &mut self,
        simplex: Simplex,
        coordinates: &impl Coordinates,
        expansion: &mut Expansion<'_, S, E>,
    ) -> Result<(), Rounding> {
        let Expansion {
            support,
            metric,
            levels,
            best,
            flattest,
            enough,
        } = expansion;
        let metric = *metric;
        // Bounds from above stay right whatever rounding did before, those from below may not.
        best.lower = 0.0;
        self.start(simplex, metric, coordinates);
        let epsilon = levels.epsilon;
        let mut made = 0;
        while let Some(entry) = self.queue.pop() {
            let facet = self.facets[entry.facet as usize];
            if !facet.alive {
                continue;
            }
            let x = coordinates.own(&facet.x);
            let real = dot(&x, &x).sqrt();
            best.lower = best.lower.max(1.0 / metric.length(&x)).min(best.upper);
            let (point, key) = support.farthest(&x);
            let height = dot(&x, &point);
            if height <= BOUNDARY * real {
                **best = Distance::zero(x.map(|c| c / real));
                return Ok(());
            }
            best.take(height, &x, metric);
            if height / real < flattest.0 {
                **flattest = (height / real, x.map(|c| c / real));
            }
            let level = levels.of(key);
            let point = coordinates.point(&point);
            let over = dot(&facet.x, &point) - level;
            let rounding = ROUNDING * dot(&facet.x, &facet.x).sqrt();
            if over <= rounding.max(0.01 * epsilon) {
                // What the perturbation may have hidden.
                if epsilon / real > LARGEST_ERROR * support.size() {
                    return Err(Rounding);
                }
                self.polish(*support, entry, epsilon, metric, coordinates, best);
                best.converged = true;
                return Ok(());
            }
            best.converged = enough(best.lower, best.upper);
            if best.converged || made > MOST_FACETS {
                return Ok(());
            }
            made += self.insert(entry.facet, point, level, metric, coordinates)?;
        }
        Err(Rounding)
    }

    /// The facets of a simplex about the origin: facet k lies opposite to point k, so it is also
    /// the neighbour across from it.
    fn start(&mut self, simplex: Simplex, metric: Metric, coordinates: &impl Coordinates) {
        self.points.clear();
        self.points.extend(simplex.points);
        self.hashes.clear();
        self.hashes.extend((0..7).map(mix));
        self.facets.clear();
        self.queue.clear();
        for (opposite, x) in (0..).zip(simplex.facets) {
            let others = std::array::from_fn(|k| k as u32 + u32::from(k as u32 >= opposite));
            self.facets.push(Facet {
                x,
                points: others,
                neighbors: others,
                alive: true,
            });
            self.queue.push(Entry {
                square: metric.square(&coordinates.own(&x)),
                facet: opposite,
            });
        }
    }

    /// Adds a point that the facet `seen` sees, ⟨x, point⟩ > level; tells how many facets are new.
    fn insert(
        &mut self,
        seen: u32,
        point: Twist,
        level: f64,
        metric: Metric,
        coordinates: &impl Coordinates,
    ) -> Result<usize, Rounding> {
        let new_point = self.points.len() as u32;
        self.points.push(point);
        self.hashes.push(mix(new_point.into()));
        self.visible.clear();
        self.created.clear();
        self.facets[seen as usize].alive = false;
        self.visible.push(seen);
        let mut next = 0;
        while next < self.visible.len() {
            let index = self.visible[next];
            next += 1;
            let facet = self.facets[index as usize];
            let over = dot(&facet.x, &point) - level;
            for (side, &neighbor) in facet.neighbors.iter().enumerate() {
                let other = &mut self.facets[neighbor as usize];
                if !other.alive {
                    continue;
                }
                let under = dot(&other.x, &point) - level;
                if under.abs() <= ROUNDING * dot(&other.x, &other.x).sqrt() {
                    return Err(Rounding);
                }
                if under > 0.0 {
                    other.alive = false;
                    self.visible.push(neighbor);
                    continue;
                }
                let share = over / (over - under);
                let x: Twist =
                    std::array::from_fn(|i| facet.x[i] + share * (other.x[i] - facet.x[i]));
                let mut points = facet.points;
                points[side] = new_point;
                let mut neighbors = [u32::MAX; 6];
                neighbors[side] = neighbor;
                let Some(back) = other.neighbors.iter().position(|&n| n == index) else {
                    return Err(Rounding);
                };
                let created = self.facets.len() as u32;
                self.facets[neighbor as usize].neighbors[back] = created;
                self.facets.push(Facet {
                    x,
                    points,
                    neighbors,
                    alive: true,
                });
                self.created.push(created);
                self.queue.push(Entry {
                    square: metric.square(&coordinates.own(&x)),
                    facet: created,
                });
            }
        }
        self.join(new_point)?;
        Ok(self.created.len())
    }

    /// Makes neighbours of the created facets that share four points and the new one: each ridge
    /// is met twice.
    fn join(&mut self, new_point: u32) -> Result<(), Rounding> {
        let size = (8 * self.created.len()).next_power_of_two();
        self.ridges.clear();
        self.ridges.resize(size, (0, EMPTY));
        let mut open = 0;
        for &created in &self.created {
            let points = self.facets[created as usize].points;
            let hashes = points.map(|p| self.hashes[p as usize]);
            let all = hashes.into_iter().fold(0, u64::wrapping_add);
            for side in 0..6 {
                if points[side] == new_point {
                    continue;
                }
                // The ridge lies across from this point.
                let key = all.wrapping_sub(hashes[side]);
                let mut slot = key as usize & (size - 1);
                while self.ridges[slot].1 != EMPTY && self.ridges[slot].0 != key {
                    slot = (slot + 1) & (size - 1);
                }
                let met = self.ridges[slot].1;
                if met == EMPTY {
                    self.ridges[slot] = (key, created * 8 + side as u32);
                    open += 1;
                    continue;
                }
                let (first, other) = (met / 8, met % 8);
                if met == JOINED {
                    return Err(Rounding);
                }
                self.facets[first as usize].neighbors[other as usize] = created;
                self.facets[created as usize].neighbors[side] = first;
                self.ridges[slot].1 = JOINED;
                open -= 1;
            }
        }
        if open == 0 { Ok(()) } else { Err(Rounding) }
    }

    /// The best of the facets that may be nearest but for the perturbation, by the planes through
    /// their points as they are.
    fn polish(
        &mut self,
        support: &impl Support,
        nearest: Entry,
        epsilon: f64,
        metric: Metric,
        coordinates: &impl Coordinates,
        best: &mut Distance,
    ) {
        const MOST: usize = 64;
        let bar = nearest.square * (1.0 - 8.0 * epsilon);
        let mut entry = Some(nearest);
        let mut looked_at = 0;
        while let Some(candidate) = entry.filter(|e| e.square >= bar && looked_at < MOST) {
            let facet = self.facets[candidate.facet as usize];
            if facet.alive {
                looked_at += 1;
                let rows = facet.points.map(|p| self.points[p as usize]);
                if let Some(x) = solve(rows, [1.0; 6]) {
                    let x = coordinates.own(&x);
                    let (point, _) = support.farthest(&x);
                    best.take(dot(&x, &point), &x, metric);
                }
            }
            entry = self.queue.pop();
        }
        best.lower = best.lower.min(best.upper);
    }
}
