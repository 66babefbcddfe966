//! Where fingers may go: what is asked of contacts, one by one and in pairs.

pub use crate::zone::Zone;
use glam::DVec3;

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
