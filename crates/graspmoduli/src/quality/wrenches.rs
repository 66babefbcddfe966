//! Wrench hulls of any number of contacts, by their farthest points.

use super::polytope::{Levels, Support};
use super::r6::{Twist, add, dot};
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
    /// Contact after contact, in an order of their own.
    pub all: Vec<Twist>,
    order: Vec<usize>,
    per_contact: usize,
    pub scale: f64,
    norm: Norm,
}

impl Wrenches {
    pub fn new() -> Self {
        Self {
            all: Vec::new(),
            order: Vec::new(),
            per_contact: 1,
            scale: 1.0,
            norm: Norm::Sum,
        }
    }

    /// `order` is the order in which the contacts' wrenches are looked at.
    pub fn set(
        &mut self,
        contacts: &[Contact],
        order: &[usize],
        center: DVec3,
        cone: &FrictionCone,
        norm: Norm,
    ) {
        self.scale = scale(contacts, center, cone.torsion());
        self.per_contact = cone.generators();
        self.norm = norm;
        self.order.clear();
        self.order.extend_from_slice(order);
        self.all.clear();
        for &i in order {
            let contact = &contacts[i];
            let frame = Frame::new(contact.normal);
            self.all.extend((0..self.per_contact).map(|k| {
                let (local, spin) = cone.generator(i, k);
                wrench(contact, center, frame.turn(local), spin, self.scale)
            }));
        }
    }

    /// The contact of a wrench, and which of its generators it comes from.
    pub fn origin(&self, index: usize) -> (usize, usize) {
        (
            self.order[index / self.per_contact],
            index % self.per_contact,
        )
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

    fn inside(&self, levels: Levels) -> Twist {
        // Of every finger's hull, which has the origin as a corner if each has a limit of its own,
        // and so of their sum; or of the one hull.
        mean(
            (0..)
                .zip(&self.all)
                .map(|(key, w)| (levels.spread(key), *w)),
        )
    }
}

/// The weighted mean of some vectors.
fn mean(terms: impl Iterator<Item = (f64, Twist)>) -> Twist {
    let (mut sum, mut total) = ([0.0; 6], 0.0);
    for (weight, term) in terms {
        sum = add(&sum, weight, &term);
        total += weight;
    }
    sum.map(|c| c / total)
}

/// Contacts with circular friction cones.
#[derive(Debug)]
pub(super) struct Circular<'a> {
    pub contacts: &'a [Contact],
    /// The order in which contacts are looked at.
    pub order: &'a [usize],
    pub center: DVec3,
    pub cone: &'a FrictionCone,
    pub scale: f64,
}

impl Support for Circular<'_> {
    fn farthest(&self, x: &Twist) -> (Twist, u64) {
        let mut best = ([0.0; 6], f64::NEG_INFINITY);
        let linear = DVec3::new(x[0], x[1], x[2]);
        let angular = DVec3::new(x[3], x[4], x[5]) / self.scale;
        for &i in self.order {
            let contact = &self.contacts[i];
            let velocity = linear + angular.cross(contact.point - self.center);
            let friction = self.cone.friction(i);
            let force = contact.normal + sideways(velocity, contact.normal) * friction;
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

    fn inside(&self, levels: Levels) -> Twist {
        // A triangle of edges within each cone, more of one than of the next.
        mean((0..).zip(self.order).flat_map(|(number, &i)| {
            let contact = &self.contacts[i];
            let frame = Frame::new(contact.normal);
            (0..3).map(move |k| {
                let force = self.cone.edge(i, &frame, k * self.cone.len() / 3);
                let weight = levels.spread(3 * number + k as u64);
                (weight, wrench(contact, self.center, force, 0.0, self.scale))
            })
        }))
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
