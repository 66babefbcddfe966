//! Wrench hulls of any number of contacts, by their farthest points.

use super::Twist;
use super::polytope::{Support, dot};
use crate::contact::{Contact, Frame, FrictionCone};
use glam::DVec3;

/// What a unit of strength of the fingers means (Sec. II of the paper).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Norm {
    /// The normal forces of all fingers sum to at most 1: Q_l.
    Sum,
    /// The normal force of every finger is at most 1: Q'_l.
    Each,
}

/// Force and torque as one vector, the torque divided by a length.
fn wrench(contact: &Contact, center: DVec3, force: DVec3, spin: f64, scale: f64) -> Twist {
    let torque = ((contact.point - center).cross(force) + contact.normal * spin) / scale;
    [force.x, force.y, force.z, torque.x, torque.y, torque.z]
}

/// The longest lever arm or torsional coefficient: divided by it, torques are about as long as
/// forces.
pub(super) fn scale(contacts: &[Contact], center: DVec3, torsion: f64) -> f64 {
    contacts
        .iter()
        .map(|contact| contact.point.distance(center))
        .fold(torsion, f64::max)
}

/// The wrenches of a grasp with polygonal cones, torques divided by `scale`.
#[derive(Debug, Clone)]
pub(super) struct Wrenches {
    /// Contact after contact.
    pub all: Vec<Twist>,
    per_contact: usize,
    pub scale: f64,
    norm: Norm,
}

impl Wrenches {
    pub fn new() -> Self {
        Self {
            all: Vec::new(),
            per_contact: 1,
            scale: 1.0,
            norm: Norm::Sum,
        }
    }

    pub fn set(&mut self, contacts: &[Contact], center: DVec3, cone: &FrictionCone, norm: Norm) {
        self.scale = scale(contacts, center, cone.torsion());
        self.per_contact = cone.generators();
        self.norm = norm;
        self.all.clear();
        for contact in contacts {
            let frame = Frame::new(contact.normal);
            self.all.extend((0..self.per_contact).map(|k| {
                let (local, spin) = cone.generator(k);
                wrench(contact, center, frame.turn(local), spin, self.scale)
            }));
        }
    }

    /// The contact of a wrench, and which of its generators it comes from.
    pub fn origin(&self, index: usize) -> (usize, usize) {
        (index / self.per_contact, index % self.per_contact)
    }
}

/// Index and value of the greatest ⟨x, w⟩, the first among equals.
fn farthest_of(wrenches: &[Twist], x: &Twist) -> (usize, f64) {
    let mut best = (0, f64::NEG_INFINITY);
    for (index, wrench) in wrenches.iter().enumerate() {
        let height = dot(x, wrench);
        if height > best.1 {
            best = (index, height);
        }
    }
    best
}

impl Support for Wrenches {
    fn farthest(&self, x: &Twist) -> (Twist, u64) {
        if self.norm == Norm::Sum {
            let (index, _) = farthest_of(&self.all, x);
            return (self.all[index], index as u64);
        }
        // A finger that cannot help does not press.
        let (mut sum, mut key) = ([0.0; 6], 0u64);
        for own in self.all.chunks_exact(self.per_contact) {
            let (index, height) = farthest_of(own, x);
            key = key.wrapping_mul(self.per_contact as u64 + 1);
            if height > 0.0 {
                key = key.wrapping_add(index as u64 + 1);
                sum = std::array::from_fn(|i| sum[i] + own[index][i]);
            }
        }
        (sum, key)
    }
}

/// Contacts with circular friction cones.
#[derive(Debug)]
pub(super) struct Circular<'a> {
    pub contacts: &'a [Contact],
    pub center: DVec3,
    pub friction: f64,
    pub scale: f64,
}

impl Support for Circular<'_> {
    fn farthest(&self, x: &Twist) -> (Twist, u64) {
        let mut best = ([0.0; 6], f64::NEG_INFINITY);
        let linear = DVec3::new(x[0], x[1], x[2]);
        let angular = DVec3::new(x[3], x[4], x[5]) / self.scale;
        for contact in self.contacts {
            let velocity = linear + angular.cross(contact.point - self.center);
            let force = contact.normal + sideways(velocity, contact.normal) * self.friction;
            let wrench = wrench(contact, self.center, force, 0.0, self.scale);
            let height = dot(x, &wrench);
            if height > best.1 {
                best = (wrench, height);
            }
        }
        // Every point of a circle is another: its bits tell them apart.
        let key = best
            .0
            .iter()
            .fold(0u64, |key, c| key.rotate_left(9) ^ c.to_bits());
        (best.0, key)
    }
}

/// The unit vector across `normal` that goes most along `velocity`. At the apex of the polar cone
/// the velocity is along the normal; then any will do, but it must be across and of length 1.
fn sideways(velocity: DVec3, normal: DVec3) -> DVec3 {
    let across = |v: DVec3| (v - normal * v.dot(normal)).normalize_or_zero();
    // Twice: what is left of a velocity along the normal is rounding, in any direction.
    let found = across(across(velocity));
    if found == DVec3::ZERO {
        normal.any_orthonormal_vector()
    } else {
        found
    }
}
