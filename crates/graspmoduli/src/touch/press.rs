//! One fingertip, a ball, pressed at one place.

use super::OUTSIDE;
use super::mesh::Mesh;
use crate::contact::Frame;
use crate::math;
use glam::DVec3;
use std::f64::consts::TAU;

/// Rays in rings about the tip's axis: radius over the tip's, number.
const RINGS: [(f64, usize); 4] = [(0.0, 1), (0.3, 6), (0.6, 12), (0.9, 18)];
/// How deep a tip gives way, over its radius.
const DEPTH: f64 = 0.25;
/// What is farther behind the first touch than this, over the radius, no longer is the pad's.
const PAD: f64 = 0.6;
/// Directions of aims beside a place; and how far out, 1 / cos(180° / 12), none passes by an edge.
pub(crate) const ASIDE: usize = 12;
const CORNER: f64 = 1.035_276_180_410_083;
/// cos 30°: normals that differ more are not of one flat place.
pub(crate) const ALIKE: f64 = 0.866_025_403_784_438_6;

/// A ball of some radius, over the size of the object, as a bundle of parallel rays.
#[derive(Debug, Clone)]
pub struct Tip {
    radius: f64,
    /// Per ray: place across the axis, and how far its part of the ball lies behind the front.
    rays: Vec<([f64; 2], f64)>,
}

/// What a tip meets that comes from outside along a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pressed {
    /// Where the ray through the middle lands, if it hits anything.
    pub landing: Option<Landing>,
    /// The mean of the normals under the pad, weighted by how deep it is pressed there; a unit
    /// vector along the direction.
    pub felt: DVec3,
    /// How far the ball is stopped before its middle touches, over its radius; infinite if the
    /// middle meets nothing.
    pub blocked: f64,
    /// Share of what lies under the pad whose normal differs from the felt one by more than 30°.
    pub off: f64,
    /// Share of the pad that meets the object, with a normal within 30° of the felt one.
    pub bearing: f64,
}

/// Where a ray lands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Landing {
    /// The point of the mesh.
    pub point: DVec3,
    /// The triangle's normal, along the ray.
    pub normal: DVec3,
}

impl Tip {
    /// A ball of a positive radius.
    pub fn new(radius: f64) -> Self {
        let mut rays = Vec::new();
        for (ring, count) in RINGS {
            let behind = radius - (radius * radius * (1.0 - ring * ring)).sqrt();
            for k in 0..count {
                let (sin, cos) = math::sin_cos(TAU * k as f64 / count as f64);
                rays.push(([ring * radius * cos, ring * radius * sin], behind));
            }
        }
        Self { radius, rays }
    }

    /// The radius, over the size of the object.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Presses at a point along a unit vector; `None` if the object is missed.
    pub fn press(&self, mesh: &Mesh, aim: DVec3, way: DVec3) -> Option<Pressed> {
        let [x, y] = Frame::new(way).tangents;
        let start = aim - way * OUTSIDE;
        let hits: Vec<_> = self
            .rays
            .iter()
            .map(|&([a, b], behind)| {
                mesh.ray(start + x * a + y * b, way)
                    .map(|hit| (hit.distance + behind, hit))
            })
            .collect();
        let front = hits
            .iter()
            .flatten()
            .map(|&(depth, _)| depth)
            .fold(f64::INFINITY, f64::min);
        if front == f64::INFINITY {
            return None;
        }
        let mut sum = DVec3::ZERO;
        for &(depth, hit) in hits.iter().flatten() {
            let weight = 1.0 - (depth - front) / (DEPTH * self.radius);
            if weight > 0.0 {
                sum += mesh.normal_along(hit.face, way) * weight;
            }
        }
        // All lie along the way, so that they do not cancel; only edge on they have no sum.
        let felt = sum.try_normalize()?;
        let (mut under, mut alike) = (0, 0);
        for &(depth, hit) in hits.iter().flatten() {
            if depth - front < PAD * self.radius {
                under += 1;
                alike += usize::from(mesh.normal_along(hit.face, way).dot(felt) > ALIKE);
            }
        }
        let landing =
            hits[0].map(|(depth, hit)| (depth, land(mesh, start, way, hit.distance, hit.face)));
        Some(Pressed {
            landing: landing.map(|(_, landing)| landing),
            felt,
            blocked: landing.map_or(f64::INFINITY, |(depth, _)| (depth - front) / self.radius),
            off: (under - alike) as f64 / under as f64,
            bearing: alike as f64 / hits.len() as f64,
        })
    }

    /// Where rays land that aim beside a point, all around, half a radius away.
    pub fn fan(&self, mesh: &Mesh, aim: DVec3, way: DVec3) -> [Option<Landing>; ASIDE] {
        let reach = 0.5 * CORNER * self.radius;
        around(aim, way, reach).map(|beside| land_along(mesh, beside, way))
    }
}

/// Points beside one, all around across a way.
pub(crate) fn around(point: DVec3, way: DVec3, reach: f64) -> [DVec3; ASIDE] {
    let [x, y] = Frame::new(way).tangents;
    std::array::from_fn(|k| {
        let (sin, cos) = math::sin_cos(TAU * k as f64 / ASIDE as f64);
        point + (x * cos + y * sin) * reach
    })
}

fn land(mesh: &Mesh, start: DVec3, way: DVec3, distance: f64, face: usize) -> Landing {
    Landing {
        point: start + way * distance,
        normal: mesh.normal_along(face, way),
    }
}

/// Where the ray through a point lands that comes from outside.
pub fn land_along(mesh: &Mesh, aim: DVec3, way: DVec3) -> Option<Landing> {
    let start = aim - way * OUTSIDE;
    mesh.ray(start, way)
        .map(|hit| land(mesh, start, way, hit.distance, hit.face))
}
