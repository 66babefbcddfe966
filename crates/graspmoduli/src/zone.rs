//! Boxes and half-spaces, and how far a finger's way is from them.

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
