//! Vertices of the polar P of a wrench hull of three contacts, and what may be asked about them.

use super::lanes::{LANES, at, dot, greatest};
use super::plane::Plane;
use super::r6::Twist;
use glam::DVec3;
use std::ops::ControlFlow;

/// Multipliers above minus this count as not negative: they are products of unit vectors.
pub(super) const SLACK: f64 = 1e-13;
/// Added to the squared determinant of a system: candidates with a determinant below 1e-14 are
/// rounding noise unless their twist is huge all the same.
pub(super) const TINY: f64 = 1e-28;
/// Candidates this close to the longest so far (relative, by their squares) are looked at again:
/// the quadratic forms that compare them cancel where the contacts are nearly collinear.
pub(super) const TIE: f64 = 1e-6;

/// Edges this parallel to the plane (as a share of their length) bound no height.
pub(super) const LEVEL: f64 = 1e-12;

/// The constraints that meet in a vertex of P, by contact and ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Active {
    /// y_i on ray j_i of its cone, for all three.
    Rays([usize; 3]),
    /// y of the first contact at the apex, of the second on a ray, of the third on the face
    /// orthogonal to an edge.
    Apex {
        apex: usize,
        ray: (usize, usize),
        edge: (usize, usize),
    },
}

/// A vertex of P, or a point on an edge or face of P that rounding took for one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Vertex {
    /// (v, ω) in the object frame, on the boundary of P.
    pub twist: Twist,
    /// ‖x‖².
    pub norm_squared: f64,
    /// Did the candidate satisfy all constraints to rounding before it was scaled?
    pub exact: bool,
    pub active: Active,
}

impl Vertex {
    /// Distance of its facet from the origin.
    #[inline]
    pub fn quality(&self) -> f64 {
        1.0 / self.norm_squared.sqrt()
    }
}

/// What to look for in P.
#[derive(Debug, Clone, Copy)]
pub(super) enum Question {
    /// The longest twist.
    Longest,
    /// The longest, or any one that shows Q to be below this.
    LongestUpTo(f64),
    /// The longest that is longer than this (by its square).
    LongerThan(f64),
    /// All that are longer than this (by its square), but not more than so many.
    All(f64, usize),
}

/// Vertices that were found.
#[derive(Debug, Clone, Default)]
pub(super) struct Found {
    pub vertices: Vec<Vertex>,
}

impl Found {
    /// Longest first, the `most` longest.
    pub fn sort(&mut self, most: usize) {
        self.vertices
            .sort_by(|a, b| b.norm_squared.total_cmp(&a.norm_squared));
        self.vertices.truncate(most);
    }

    /// Takes a proposed twist (in the frame of the plane) if, once it is on the boundary of P, it
    /// is longer than the limit.
    #[inline(always)]
    pub fn offer(
        &mut self,
        plane: &Plane,
        twist: Twist,
        active: Active,
        question: Question,
        limit: &mut f64,
    ) -> ControlFlow<()> {
        let velocity = DVec3::new(twist[0], twist[1], twist[2]);
        let omega = DVec3::new(twist[3], twist[4], twist[5]);
        // The padding's zeros do no harm: the support is positive.
        let mut supports = [0.0; LANES];
        for side in &plane.sides {
            let v = velocity + omega.cross(side.point.extend(0.0) - plane.center);
            for [x, y, z] in &side.edge {
                for lane in 0..LANES {
                    let along = x[lane] * v.x + y[lane] * v.y + z[lane] * v.z;
                    supports[lane] = greatest(along, supports[lane]);
                }
            }
        }
        let support = supports.into_iter().fold(0.0, greatest);
        let norm_squared = dot(&twist, &twist) / (support * support);
        // Negated so that NaN, from overflow, is refused; a support of 0 contradicts the test.
        if !(support > 0.0 && norm_squared > *limit && norm_squared.is_finite()) {
            return ControlFlow::Continue(());
        }
        let linear = plane.basis.mul_vec3(velocity / support);
        let angular = plane.basis.mul_vec3(omega / support);
        let vertex = Vertex {
            twist: [
                linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
            ],
            norm_squared,
            exact: (support - 1.0).abs() < 1e-9,
            active,
        };
        if let Question::All(_, most) = question {
            self.vertices.push(vertex);
            if self.vertices.len() == 4 * most {
                self.sort(2 * most);
                *limit = self.vertices[2 * most - 1].norm_squared;
            }
            return ControlFlow::Continue(());
        }
        self.vertices.clear();
        self.vertices.push(vertex);
        *limit = norm_squared;
        match question {
            Question::LongestUpTo(threshold) if vertex.quality() < threshold => {
                ControlFlow::Break(())
            }
            _ => ControlFlow::Continue(()),
        }
    }
}

/// A ray of a contact's polar cone, of unit length, in the frame of the plane.
#[inline(always)]
pub(super) fn ray(plane: &Plane, contact: usize, index: usize) -> DVec3 {
    at(&plane.sides[contact].ray, index).into()
}
