//! The distance from the origin to the boundary of a convex hull in R⁶ that is known only by its
//! support function: best-first expansion of an inner polytope about the origin.
//!
//! A facet is kept as x ∈ R⁶ with ⟨x, p⟩ = 1 for its six points; its distance from the origin is
//! 1/‖x‖. The nearest facet is asked for the farthest point beyond it. If there is none it is a
//! facet of the hull, and the answer. Otherwise the facets that see the new point are replaced by
//! a cone of new ones from it: each goes through a ridge between a facet f that sees the point and
//! a g that does not, so x is the convex combination of x_f and x_g with ⟨x, p⟩ = 1, and nothing is
//! solved. At any time 1/‖x‖ of the nearest facet bounds the answer from below, and h(x)/‖x‖, h
//! the support function, from above.
//!
//! Points in one plane, such as the edges of a cone, would give facets of more than six points.
//! So a point p counts as p/(1 + ε_p) with fixed tiny different ε_p, which moves the answer inward
//! by less than that; the value reported is that of the points as they are.

use super::Twist;
use super::gradient::solve;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A convex hull by its farthest points.
pub(super) trait Support {
    /// A point of the hull with the greatest ⟨x, p⟩, and a number that identifies it.
    fn farthest(&self, x: &Twist) -> (Twist, u64);
}

/// Circumradii of the simplex about the origin that is the first inner polytope, tried one after
/// the other, and the perturbations that go with them: from a large one facets are accurate, a
/// small one fits into small hulls.
const SEEDS: [(f64, f64); 3] = [(1e-2, 1e-11), (1e-5, 1e-9), (1e-9, 1e-5)];
/// Slots of the table of ridges: free, and met twice.
const EMPTY: u32 = u32::MAX;
const JOINED: u32 = u32::MAX - 1;
const SEED_POINTS: u32 = 7;
/// A hull that reaches less far than this beyond a plane through the origin does not contain it in
/// its interior, to rounding.
const DEGENERATE: f64 = 1e-12;
/// Facets created before the search ends with the bounds that it has.
const MOST_FACETS: usize = 1 << 22;

/// What is known about the distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Distance {
    /// Not above the distance.
    pub lower: f64,
    /// Not below it: h(v) for the unit vector `direction`.
    pub upper: f64,
    /// v.
    pub direction: Twist,
}

impl Distance {
    /// Of a hull that is known not to have the origin in its interior.
    pub const ZERO: Self = Self::zero([0.0; 6]);

    /// The origin is not in the interior of the hull, which lies behind the plane with this normal.
    const fn zero(direction: Twist) -> Self {
        Self {
            lower: 0.0,
            upper: 0.0,
            direction,
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
    /// Has a point of the simplex that the expansion started from. While there are such facets the
    /// origin may be outside of the hull itself, so they come first.
    of_seed: bool,
    norm_squared: f64,
    facet: u32,
}

impl Eq for Entry {}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> Ordering {
        self.of_seed
            .cmp(&other.of_seed)
            .then(self.norm_squared.total_cmp(&other.norm_squared))
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

/// Why an expansion ended without an answer.
enum Failure {
    /// The simplex that it started from reaches out of the hull.
    TooSmall(Twist),
    /// Rounding made the facets contradict each other.
    Rounding,
}

impl Polytope {
    /// The distance from the origin to the boundary of a hull, by the metric that counts the last
    /// three coordinates `scale` times (the hull should be about as long in these as in the first
    /// three). `enough(lower, upper)` may end the search early.
    ///
    /// The distance is 0 where the origin is not in the interior, or by less than 1e-9.
    pub fn distance(
        &mut self,
        support: &impl Support,
        scale: f64,
        mut enough: impl FnMut(f64, f64) -> bool,
    ) -> Distance {
        if let Some(x) = separating(support) {
            return Distance::zero(x);
        }
        let mut outside = [0.0; 6];
        for (seed, perturbation) in SEEDS {
            // A failure by rounding is cured by other, larger perturbations.
            for attempt in 0..4 {
                let epsilon = perturbation * 10f64.powi(attempt);
                match self.expand(support, scale, seed, epsilon, &mut enough) {
                    Ok(distance) => return distance,
                    Err(Failure::TooSmall(x)) => {
                        outside = x;
                        break;
                    }
                    Err(Failure::Rounding) => {}
                }
            }
        }
        Distance::zero(outside)
    }

    fn expand(
        &mut self,
        support: &impl Support,
        scale: f64,
        seed: f64,
        epsilon: f64,
        enough: &mut impl FnMut(f64, f64) -> bool,
    ) -> Result<Distance, Failure> {
        // A twist's last coordinates were multiplied by the scale by which wrenches' were divided.
        let metric = 1.0 / (scale * scale);
        self.start(seed, metric);
        let mut best = Distance {
            lower: 0.0,
            upper: f64::INFINITY,
            direction: [0.0; 6],
        };
        let mut made = 0;
        while let Some(entry) = self.queue.pop() {
            let facet = self.facets[entry.facet as usize];
            if !facet.alive {
                continue;
            }
            let x = facet.x;
            let length = entry.norm_squared.sqrt();
            if !entry.of_seed {
                best.lower = 1.0 / length;
            }
            let (point, key) = support.farthest(&x);
            let height = dot(&x, &point);
            let real = dot(&x, &x).sqrt();
            if height <= DEGENERATE * real {
                return Ok(Distance::zero(x.map(|c| c / real)));
            }
            best.take(height, &x, metric);
            let level = 1.0 + epsilon * spread(key);
            if height - level <= 0.01 * epsilon {
                if entry.of_seed {
                    return Err(Failure::TooSmall(x.map(|c| c / real)));
                }
                self.polish(support, entry, epsilon, metric, &mut best);
                return Ok(best);
            }
            if enough(best.lower, best.upper) || made > MOST_FACETS {
                return Ok(best);
            }
            made += self.insert(entry.facet, point, level, metric)?;
        }
        Err(Failure::Rounding)
    }

    /// A regular simplex of circumradius `seed`.
    fn start(&mut self, seed: f64, metric: f64) {
        self.points.clear();
        self.facets.clear();
        self.queue.clear();
        let n = 6.0_f64;
        let diagonal = (1.0 + 1.0 / n).sqrt();
        let shift = ((n + 1.0).sqrt() + 1.0) / (n * n.sqrt());
        for i in 0..6 {
            let mut point = [-seed * shift; 6];
            point[i] += seed * diagonal;
            self.points.push(point);
        }
        self.points.push([seed / n.sqrt(); 6]);
        self.hashes.clear();
        self.hashes.extend((0..SEED_POINTS).map(|p| mix(p.into())));
        for opposite in 0..SEED_POINTS {
            let x = self.points[opposite as usize].map(|c| -n * c / (seed * seed));
            // Facet k lies opposite to point k, so it is also the neighbour across from it.
            let others = std::array::from_fn(|k| k as u32 + u32::from(k as u32 >= opposite));
            let facet = Facet {
                x,
                points: others,
                neighbors: others,
                alive: true,
            };
            self.facets.push(facet);
            self.queue.push(Entry {
                of_seed: true,
                norm_squared: norm_squared(&x, metric),
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
        metric: f64,
    ) -> Result<usize, Failure> {
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
                if under > 0.0 {
                    other.alive = false;
                    self.visible.push(neighbor);
                    continue;
                }
                // over > 0 ≥ under, by more than rounding for all but unlucky perturbations.
                let share = over / (over - under);
                let x: Twist =
                    std::array::from_fn(|i| facet.x[i] + share * (other.x[i] - facet.x[i]));
                let mut points = facet.points;
                points[side] = new_point;
                let mut neighbors = [u32::MAX; 6];
                neighbors[side] = neighbor;
                let Some(back) = other.neighbors.iter().position(|&n| n == index) else {
                    return Err(Failure::Rounding);
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
                    of_seed: points.iter().any(|&p| p < SEED_POINTS),
                    norm_squared: norm_squared(&x, metric),
                    facet: created,
                });
            }
        }
        self.join(new_point)?;
        Ok(self.created.len())
    }

    /// Makes neighbours of the created facets that share four points and the new one: each ridge
    /// is met twice.
    fn join(&mut self, new_point: u32) -> Result<(), Failure> {
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
                    return Err(Failure::Rounding);
                }
                self.facets[first as usize].neighbors[other as usize] = created;
                self.facets[created as usize].neighbors[side] = first;
                self.ridges[slot].1 = JOINED;
                open -= 1;
            }
        }
        if open == 0 {
            Ok(())
        } else {
            Err(Failure::Rounding)
        }
    }

    /// The best of the facets that may be nearest but for the perturbation, by the planes through
    /// their points as they are.
    fn polish(
        &mut self,
        support: &impl Support,
        nearest: Entry,
        epsilon: f64,
        metric: f64,
        best: &mut Distance,
    ) {
        const MOST: usize = 64;
        let bar = nearest.norm_squared * (1.0 - 8.0 * epsilon);
        let mut entry = Some(nearest);
        let mut looked_at = 0;
        while let Some(candidate) = entry.filter(|e| e.norm_squared >= bar && looked_at < MOST) {
            let facet = self.facets[candidate.facet as usize];
            if facet.alive {
                looked_at += 1;
                let rows = facet.points.map(|p| self.points[p as usize]);
                if let Some(x) = solve(rows, [1.0; 6]) {
                    let (point, _) = support.farthest(&x);
                    best.take(dot(&x, &point), &x, metric);
                }
            }
            entry = self.queue.pop();
        }
        best.lower = best.lower.min(best.upper);
    }
}

impl Distance {
    /// Takes the direction x, in which the hull reaches up to ⟨x, ·⟩ = height.
    fn take(&mut self, height: f64, x: &Twist, metric: f64) {
        let length = norm_squared(x, metric).sqrt();
        if height / length < self.upper {
            self.upper = height / length;
            self.direction = x.map(|c| c / length);
        }
    }
}

/// A direction in which the hull does not even reach the origin, if a few steps of Gilbert's
/// algorithm find one: the point p of the hull nearest to the origin is approached along segments
/// to its farthest points towards the origin.
fn separating(support: &impl Support) -> Option<Twist> {
    const STEPS: usize = 48;
    let (mut p, _) = support.farthest(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    for _ in 0..STEPS {
        let length = dot(&p, &p).sqrt();
        let back = p.map(|c| -c / length);
        let (s, _) = support.farthest(&back);
        let height = dot(&back, &s);
        // A hull through the origin gives 0/0.
        if height.is_nan() {
            return None;
        }
        if height < -DEGENERATE {
            return Some(back);
        }
        let way: Twist = std::array::from_fn(|i| s[i] - p[i]);
        let share = -dot(&p, &way) / dot(&way, &way);
        p = std::array::from_fn(|i| p[i] + share.clamp(0.0, 1.0) * way[i]);
    }
    None
}

/// Numbers in [0.5, 1] that no relation among the points knows of.
fn spread(key: u64) -> f64 {
    0.5 + 0.5 * (mix(key) >> 11) as f64 / (1u64 << 53) as f64
}

/// The finaliser of SplitMix64.
fn mix(key: u64) -> u64 {
    let mut z = key.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Without the fused operations of the closed form, which cost a call where they are not native.
#[inline(always)]
pub(super) fn dot(a: &Twist, b: &Twist) -> f64 {
    ((a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])) + (a[4] * b[4] + a[5] * b[5])
}

#[inline(always)]
fn norm_squared(x: &Twist, metric: f64) -> f64 {
    let linear = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
    linear + metric * (x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
}
