//! Where fingers may go: what is asked of contacts, one by one and in pairs.

use glam::DVec3;

/// Regions of space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Zone {
    /// All that lies behind a plane, on the side from which its unit normal points away.
    HalfSpace {
        /// A point of the plane.
        point: DVec3,
        /// A unit vector.
        normal: DVec3,
    },
    /// A box along the axes.
    Box {
        /// Least coordinates.
        low: DVec3,
        /// Largest coordinates.
        high: DVec3,
    },
}

impl Zone {
    /// Does a point lie in it, or on its border?
    pub fn holds(&self, at: DVec3) -> bool {
        match *self {
            Self::HalfSpace { point, normal } => (at - point).dot(normal) <= 0.0,
            Self::Box { low, high } => at.cmpge(low).all() && at.cmple(high).all(),
        }
    }

    /// The distance of a segment from it: 0 or less where they meet.
    pub fn distance(&self, start: DVec3, end: DVec3) -> f64 {
        match *self {
            Self::HalfSpace { point, normal } => {
                (start - point).dot(normal).min((end - point).dot(normal))
            }
            Self::Box { low, high } => {
                let along = end - start;
                let off = |t: f64| {
                    let at = start + along * t;
                    at - at.clamp(low, high)
                };
                // Half of the squared distance's slope, which grows with t and is linear between
                // the places where the segment crosses one of the six planes.
                let slope = |t: f64| off(t).dot(along);
                let mut places = vec![0.0, 1.0];
                for k in 0..3 {
                    for plane in [low[k], high[k]] {
                        let t = (plane - start[k]) / along[k];
                        if t > 0.0 && t < 1.0 {
                            places.push(t);
                        }
                    }
                }
                places.sort_by(f64::total_cmp);
                let mut best = off(0.0).length().min(off(1.0).length());
                for pair in places.windows(2) {
                    let (a, b) = (slope(pair[0]), slope(pair[1]));
                    let share = if b > a {
                        (-a / (b - a)).clamp(0.0, 1.0)
                    } else {
                        0.0
                    };
                    let t = pair[0] + share * (pair[1] - pair[0]);
                    best = best.min(off(t).length());
                }
                best
            }
        }
    }
}

/// What is asked of the contacts of a grasp; nothing by [`Limits::none`].
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Least and largest distance between any two contacts.
    pub opening: [f64; 2],
    /// Least distance between the middles of any two fingertips.
    pub apart: f64,
    /// Radius of the fingertips, balls that touch at the contacts.
    pub radius: f64,
    /// Along how much of their ways fingertips keep clear of obstacles.
    pub way: f64,
    /// A unit vector, and the least cosine of the angle between it and a finger's way.
    pub approach: Option<(DVec3, f64)>,
    /// What fingertips keep clear of.
    pub obstacles: Vec<Zone>,
    /// Each contact lies in one of these, if there are any.
    pub wanted: Vec<Zone>,
    /// No contact lies in one of these.
    pub unwanted: Vec<Zone>,
}

impl Limits {
    /// Everything goes.
    pub fn none() -> Self {
        Self {
            opening: [0.0, f64::INFINITY],
            apart: 0.0,
            radius: 0.0,
            way: 0.0,
            approach: None,
            obstacles: Vec::new(),
            wanted: Vec::new(),
            unwanted: Vec::new(),
        }
    }

    /// Do pairs of contacts matter?
    pub fn pairs_matter(&self) -> bool {
        self.opening != [0.0, f64::INFINITY] || self.apart > 0.0
    }

    /// May a finger press at a point along a normal?
    pub fn allows(&self, point: DVec3, normal: DVec3) -> bool {
        if self
            .approach
            .is_some_and(|(way, least)| way.dot(normal) < least)
        {
            return false;
        }
        if !self.wanted.is_empty() && !self.wanted.iter().any(|zone| zone.holds(point)) {
            return false;
        }
        if self.unwanted.iter().any(|zone| zone.holds(point)) {
            return false;
        }
        let middle = point - normal * self.radius;
        let before = middle - normal * self.way;
        self.obstacles.iter().all(|zone| {
            let distance = zone.distance(middle, before);
            distance >= self.radius && distance > 0.0
        })
    }

    /// May two fingers, each a point and a normal, press there together?
    pub fn allows_pair(&self, one: (DVec3, DVec3), other: (DVec3, DVec3)) -> bool {
        if !self.pairs_matter() {
            return true;
        }
        let distance = (one.0 - other.0).length();
        let [low, high] = self.opening;
        let middle = |(point, normal): (DVec3, DVec3)| point - normal * self.radius;
        distance >= low && distance <= high && (middle(one) - middle(other)).length() >= self.apart
    }

    /// May fingers press there together, each a point and a normal?
    pub fn allow(&self, contacts: &[(DVec3, DVec3)]) -> bool {
        contacts.iter().all(|&(p, n)| self.allows(p, n))
            && (1..contacts.len()).all(|k| {
                contacts[..k]
                    .iter()
                    .all(|&c| self.allows_pair(c, contacts[k]))
            })
    }

    /// May one finger of several be where it is, if the others may?
    pub fn allow_one(&self, contacts: &[(DVec3, DVec3)], finger: usize) -> bool {
        let own = contacts[finger];
        self.allows(own.0, own.1)
            && contacts
                .iter()
                .enumerate()
                .all(|(k, &other)| k == finger || self.allows_pair(own, other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_is_as_far_from_a_box_as_the_nearest_of_many_points_on_it() {
        let zone = Zone::Box {
            low: DVec3::new(-1.0, -0.5, 0.0),
            high: DVec3::new(1.0, 0.5, 0.25),
        };
        let mut state = 3u64;
        let mut draw = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 * 6.0 - 3.0
        };
        let (mut met, mut missed) = (0, 0);
        for k in 0..2000 {
            let start = DVec3::new(draw(), draw(), draw());
            let mut end = DVec3::new(draw(), draw(), draw());
            if k % 3 == 0 {
                // Along an axis, or a point: divisions by 0.
                end = start + DVec3::new(0.0, 0.0, if k % 2 == 0 { 1.5 } else { 0.0 });
            }
            let points = (0..=20_000).map(|i| start + (end - start) * (f64::from(i) / 20_000.0));
            let Zone::Box { low, high } = zone else {
                unreachable!()
            };
            let slow = points
                .map(|p| (p - p.clamp(low, high)).length())
                .fold(f64::INFINITY, f64::min);
            let fast = zone.distance(start, end);
            assert!((fast - slow).abs() < 1e-3 && fast <= slow + 1e-12);
            if slow == 0.0 { met += 1 } else { missed += 1 }
        }
        assert!(met > 100 && missed > 500);
    }
}
