//! Wrench hulls of any number of contacts, by their farthest points.

use super::points::Points;
use super::r6::{Twist, add, dot};
use super::support::{Levels, Support};
use crate::contact::{Contact, Frame, FrictionCone, Norm};
use glam::DVec3;

/// What torques are about and divided by while a hull is expanded: the centroid of the contacts and
/// their longest distance from it, or the torsional coefficient if that is longer. Whether a grasp
/// is force closure does not depend on the centre of mass, and so the hull about the centroid,
/// which is about as long in torques as in forces, can tell best.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reference {
    pub point: DVec3,
    pub scale: f64,
}

impl Reference {
    /// Of contacts in the order in which they are looked at.
    pub fn new(contacts: &[Contact], order: &[usize], torsion: f64) -> Self {
        let share = 1.0 / order.len() as f64;
        let point = order
            .iter()
            .fold(DVec3::ZERO, |sum, &i| sum + contacts[i].point * share);
        let scale = order
            .iter()
            .map(|&i| contacts[i].point.distance(point))
            // Unlike `f64::max` this does not pass over what is not a number.
            .fold(torsion, |a, b| if a >= b { a } else { b });
        Self { point, scale }
    }

    /// Are all contacts in one place, and hard?
    pub fn is_point(self) -> bool {
        self.scale == 0.0
    }

    /// Force and torque as one vector.
    #[inline(always)]
    fn wrench(self, contact: &Contact, force: DVec3, spin: f64) -> Twist {
        let lever = contact.point - self.point;
        let torque = (lever.cross(force) + contact.normal * spin) / self.scale;
        [force.x, force.y, force.z, torque.x, torque.y, torque.z]
    }

    /// A wrench about the centre of mass in these coordinates.
    pub fn of_wrench(self, [a, b, c, d, e, f]: Twist, center_of_mass: DVec3) -> Twist {
        let force = DVec3::new(a, b, c);
        let torque = DVec3::new(d, e, f) - (self.point - center_of_mass).cross(force);
        let torque = torque / self.scale;
        [a, b, c, torque.x, torque.y, torque.z]
    }

    /// A twist about the centre of mass in these coordinates, in which it does the same work.
    pub fn of_twist(self, [a, b, c, d, e, f]: Twist, center_of_mass: DVec3) -> Twist {
        let angular = DVec3::new(d, e, f);
        let linear = DVec3::new(a, b, c) + angular.cross(self.point - center_of_mass);
        let angular = angular * self.scale;
        [
            linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
        ]
    }
}

/// The wrenches of a grasp with polygonal cones.
#[derive(Debug, Clone)]
pub(super) struct Wrenches {
    /// A group for each contact, in an order of their own.
    pub points: Points,
    /// The same as a list, once it was asked for; see [`Wrenches::list`].
    pub all: Vec<Twist>,
    order: Vec<usize>,
    per_contact: usize,
    pub reference: Reference,
    pub norm: Norm,
}

impl Wrenches {
    pub fn new() -> Self {
        Self {
            points: Points::default(),
            all: Vec::new(),
            order: Vec::new(),
            per_contact: 1,
            reference: Reference {
                point: DVec3::ZERO,
                scale: 1.0,
            },
            norm: Norm::Sum,
        }
    }

    /// `order` is the order in which the contacts' wrenches are looked at.
    pub fn set(&mut self, contacts: &[Contact], order: &[usize], cone: &FrictionCone) {
        self.reference = Reference::new(contacts, order, cone.torsion());
        self.per_contact = cone.generators();
        self.norm = cone.norm();
        self.order.clear();
        self.order.extend_from_slice(order);
        self.points.shape(self.per_contact, order.len());
        for (group, &i) in order.iter().enumerate() {
            let contact = &contacts[i];
            let frame = Frame::new(contact.normal);
            for k in 0..self.per_contact {
                let (local, spin) = cone.generator(i, k);
                let wrench = self.reference.wrench(contact, frame.turn(local), spin);
                self.points.set(group, k, &wrench);
            }
            self.points.fill(group);
        }
        self.all.clear();
    }

    /// Lists the wrenches contact after contact, for what looks at one after the other.
    pub fn list(&mut self) {
        if self.all.is_empty() {
            self.points.list(&mut self.all);
        }
    }

    /// The wrenches of each contact, in their order.
    pub fn by_contact(&self) -> impl Iterator<Item = &[Twist]> {
        self.all.chunks_exact(self.per_contact)
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
        for own in self.by_contact() {
            let (index, height) = farthest_of(own, x);
            key = key.wrapping_mul(self.per_contact as u64 + 1);
            if height > 0.0 {
                key = key.wrapping_add(index as u64 + 1);
                sum = std::array::from_fn(|i| sum[i] + own[index][i]);
            }
        }
        (sum, key)
    }

    fn size(&self) -> f64 {
        let longest = |own: &[Twist]| own.iter().map(|w| dot(w, w)).fold(0.0, f64::max).sqrt();
        match self.norm {
            Norm::Sum => longest(&self.all),
            Norm::Each => self.by_contact().map(longest).sum(),
        }
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
pub(super) fn mean(terms: impl Iterator<Item = (f64, Twist)>) -> Twist {
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
    pub cone: &'a FrictionCone,
    pub reference: Reference,
}

impl Support for Circular<'_> {
    fn farthest(&self, x: &Twist) -> (Twist, u64) {
        let (mut best, mut sum) = (([0.0; 6], f64::NEG_INFINITY), [0.0; 6]);
        let linear = DVec3::new(x[0], x[1], x[2]);
        let angular = DVec3::new(x[3], x[4], x[5]) / self.reference.scale;
        for &i in self.order {
            let contact = &self.contacts[i];
            let velocity = linear + angular.cross(contact.point - self.reference.point);
            let friction = self.cone.friction(i);
            let force = contact.normal + sideways(velocity, contact.normal) * friction;
            let mut wrench = self.reference.wrench(contact, force, 0.0);
            let mut height = dot(x, &wrench);
            if self.cone.torsion() > 0.0 {
                let spin = self.cone.torsion().copysign(angular.dot(contact.normal));
                let twisted = self.reference.wrench(contact, contact.normal, spin);
                if dot(x, &twisted) > height {
                    (wrench, height) = (twisted, dot(x, &twisted));
                }
            }
            if height > best.1 {
                best = (wrench, height);
            }
            if height > 0.0 {
                sum = add(&sum, 1.0, &wrench);
            }
        }
        let found = match self.cone.norm() {
            Norm::Sum => best.0,
            Norm::Each => sum,
        };
        // Every point of a circle is another: its bits tell them apart.
        let key = found
            .iter()
            .fold(0u64, |key, c| key.rotate_left(9) ^ c.to_bits());
        (found, key)
    }

    fn size(&self) -> f64 {
        // Lever arms and the torsional coefficient are at most 1 here.
        let frictions = self.order.iter().map(|&i| self.cone.friction(i));
        let steepest = frictions.fold(0.0, f64::max);
        let longest = (3.0 + 2.0 * steepest * steepest).sqrt();
        match self.cone.norm() {
            Norm::Sum => longest,
            Norm::Each => longest * self.order.len() as f64,
        }
    }

    fn inside(&self, levels: Levels) -> Twist {
        // A triangle of edges within each cone and what spins, more of one than of the next.
        let per_contact = if self.cone.torsion() > 0.0 { 5 } else { 3 };
        mean((0..).zip(self.order).flat_map(|(number, &i)| {
            let contact = &self.contacts[i];
            let frame = Frame::new(contact.normal);
            let spin = self.cone.torsion();
            (0..per_contact).map(move |k| {
                let (force, spin) = match k {
                    0..3 => (self.cone.edge(i, &frame, k * self.cone.len() / 3), 0.0),
                    3 => (contact.normal, spin),
                    _ => (contact.normal, -spin),
                };
                let weight = levels.spread(per_contact as u64 * number + k as u64);
                (weight, self.reference.wrench(contact, force, spin))
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
