//! Contact frames and friction cones (Sec. II of the paper).

use crate::error::Error;
use crate::math;
use glam::DVec3;
use std::f64::consts::TAU;

/// A contact as the kernels see it: a point and the unit normal pointing into the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Contact point in the object frame.
    pub point: DVec3,
    /// Unit normal pointing into the object.
    pub normal: DVec3,
}

impl Contact {
    /// A contact at a point, with a unit normal that points into the object; an error where a
    /// coordinate is not finite or the normal's length is off by more than 1e-4.
    pub fn new(point: DVec3, normal: DVec3) -> Result<Self, Error> {
        if !point.is_finite() {
            return Err(Error::Point {
                got: point.to_array(),
            });
        }
        let length = normal.length();
        // Not so either where it is not a number.
        let is_unit = (length - 1.0).abs() <= 1e-4;
        if !is_unit {
            return Err(Error::Normal { length });
        }
        Ok(Self {
            point,
            normal: normal / length,
        })
    }
}

/// What a unit of strength of the fingers means (Sec. II of the paper).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Norm {
    /// The normal forces of all fingers sum to at most 1: Q_l.
    Sum,
    /// The normal force of every finger is at most 1: Q'_l.
    Each,
}

/// The polygonal friction cones of a grasp's contacts about e₃, and their polar cones: what the
/// contact frames rotate; and how strong the fingers are, by which their wrenches add up.
///
/// Edge j is f_j = (μ cos φ_j, μ sin φ_j, 1) with φ_j = 2πj/l. The polar cone has the l extreme
/// rays (cos ψ_j, sin ψ_j, −μ cos(π/l)), ψ_j = 2π(j + ½)/l; ray j is orthogonal to the edges
/// j and j + 1. All contacts have the same number of edges; each may have a μ of its own.
#[derive(Debug, Clone)]
pub struct FrictionCone {
    /// One for all contacts, or one for each.
    frictions: Vec<f64>,
    torsion: f64,
    norm: Norm,
    /// (cos φ_j, sin φ_j).
    pub(crate) edges: Vec<[f64; 2]>,
    /// (cos ψ_j, sin ψ_j).
    pub(crate) rays: Vec<[f64; 2]>,
    /// cos(π/l).
    pub(crate) inner: f64,
}

impl FrictionCone {
    /// The cone of friction coefficient μ = `friction` with l = `edges` edges; a ray for μ = 0.
    pub fn new(friction: f64, edges: usize) -> Result<Self, Error> {
        Self::each(&[friction], edges)
    }

    /// Cones with a friction coefficient for each contact; a single one is that of all.
    pub fn each(frictions: &[f64], edges: usize) -> Result<Self, Error> {
        if frictions.is_empty() {
            return Err(Error::Friction { got: f64::NAN });
        }
        for &friction in frictions {
            if !(friction.is_finite() && friction >= 0.0) {
                return Err(Error::Friction { got: friction });
            }
        }
        if edges < 3 {
            return Err(Error::Edges { got: edges });
        }
        let at = |turns: f64| {
            let (sin, cos) = math::sin_cos(TAU * turns / edges as f64);
            [cos, sin]
        };
        // The paper counts j = 1…l; j = 0 and j = l are the same edge, so the set is the same.
        Ok(Self {
            frictions: frictions.to_vec(),
            torsion: 0.0,
            norm: Norm::Sum,
            edges: (0..edges).map(|j| at(j as f64)).collect(),
            rays: (0..edges).map(|j| at(j as f64 + 0.5)).collect(),
            inner: math::cos(TAU / (2.0 * edges as f64)),
        })
    }

    /// The same cone of a soft finger: with normal force 1 it can also apply a torque about the
    /// normal of up to γ = `torsion`, a length. Sliding and spinning friction trade off linearly:
    /// the wrenches (n, r × n ± γ n) join those of the edges.
    pub fn soft(self, torsion: f64) -> Result<Self, Error> {
        if !(torsion.is_finite() && torsion >= 0.0) {
            return Err(Error::Torsion { got: torsion });
        }
        Ok(Self { torsion, ..self })
    }

    /// The same cones of fingers with a limit each, or with one for their sum.
    pub fn with_norm(self, norm: Norm) -> Self {
        Self { norm, ..self }
    }

    /// What a unit of strength of the fingers means; [`Norm::Sum`] unless said otherwise.
    pub fn norm(&self) -> Norm {
        self.norm
    }

    /// Torsional friction coefficient γ, a length; 0 for a hard finger.
    pub fn torsion(&self) -> f64 {
        self.torsion
    }

    /// Wrenches per contact: the edges, and two more for a soft finger.
    pub(crate) fn generators(&self) -> usize {
        self.len() + if self.torsion > 0.0 { 2 } else { 0 }
    }

    /// Force in the contact frame and torque about the normal of a generator of a contact.
    pub(crate) fn generator(&self, contact: usize, index: usize) -> ([f64; 3], f64) {
        if index < self.len() {
            (self.local_edge(contact, index), 0.0)
        } else if index == self.len() {
            ([0.0, 0.0, 1.0], self.torsion)
        } else {
            ([0.0, 0.0, 1.0], -self.torsion)
        }
    }

    /// Friction coefficient μ of a contact; that of the last, if there are fewer coefficients.
    #[inline]
    pub fn friction(&self, contact: usize) -> f64 {
        self.frictions[contact.min(self.frictions.len() - 1)]
    }

    /// The same cones with the least of the friction coefficients for all contacts.
    pub(crate) fn least_friction(&self) -> Self {
        let least = self.frictions.iter().copied().fold(f64::INFINITY, f64::min);
        Self {
            frictions: vec![least],
            ..self.clone()
        }
    }

    /// Hard fingers whose circular cones are inscribed in these polygons, however they are turned.
    pub(crate) fn inscribed(&self) -> Self {
        Self {
            frictions: self.frictions.iter().map(|mu| mu * self.inner).collect(),
            torsion: 0.0,
            norm: Norm::Sum,
            ..self.clone()
        }
    }

    /// The largest of the friction coefficients.
    pub(crate) fn steepest(&self) -> f64 {
        self.frictions.iter().copied().fold(0.0, f64::max)
    }

    /// Have all contacts the same friction?
    #[inline]
    pub(crate) fn is_uniform(&self) -> bool {
        self.frictions.len() == 1
    }

    /// Has any contact friction?
    #[inline]
    pub(crate) fn is_rough(&self) -> bool {
        self.frictions.iter().any(|&friction| friction > 0.0)
    }

    /// Gives the contacts the friction coefficients of another grasp, finite and not negative.
    pub(crate) fn set_frictions(&mut self, frictions: &[f64]) {
        self.frictions.clear();
        self.frictions.extend_from_slice(frictions);
    }

    /// Number of edges l.
    pub fn len(&self) -> usize {
        self.edges.len()
    }

    /// Never: a cone has at least three edges.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Edge j of a contact's cone in the contact frame.
    #[inline]
    pub(crate) fn local_edge(&self, contact: usize, j: usize) -> [f64; 3] {
        let friction = self.friction(contact);
        let [x, y] = self.edges[j];
        [friction * x, friction * y, 1.0]
    }

    /// Edge j of a contact's cone, whose frame is `frame`.
    pub fn edge(&self, contact: usize, frame: &Frame, j: usize) -> DVec3 {
        frame.turn(self.local_edge(contact, j))
    }

    /// How far a force in a contact's frame is outside of its cone: the largest product with the
    /// polar cone's rays, not positive inside.
    pub(crate) fn excess(&self, contact: usize, [x, y, z]: [f64; 3]) -> f64 {
        let bound = self.friction(contact) * self.inner * z;
        let along = self.rays.iter().map(|[a, b]| a * x + b * y);
        along.fold(f64::NEG_INFINITY, f64::max) - bound
    }
}

/// R(n): the smallest rotation that takes e₃ to n, as the images of e₁, e₂, e₃.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// R(n) e₁ and R(n) e₂.
    pub tangents: [DVec3; 2],
    /// R(n) e₃ = n.
    pub normal: DVec3,
    /// 1 / (1 + n₃), the one number of the rotation that is not polynomial in n.
    k: f64,
}

impl Frame {
    /// The contact frame of a unit normal.
    #[inline(always)]
    pub fn new(normal: DVec3) -> Self {
        let DVec3 { x, y, z } = normal;
        // 1 + z cancels near −e₃; there 1 + z = (x² + y²)/(1 − z) is exact to rounding.
        let planar = x * x + y * y;
        let k = if z > 0.0 {
            1.0 / (1.0 + z)
        } else {
            (1.0 - z) / planar
        };
        if planar < f64::MIN_POSITIVE && z < 0.0 {
            return Self {
                tangents: [DVec3::X, DVec3::NEG_Y],
                normal,
                k: 0.0,
            };
        }
        Self {
            tangents: [
                DVec3::new(1.0 - k * x * x, -k * x * y, -x),
                DVec3::new(-k * x * y, 1.0 - k * y * y, -y),
            ],
            normal,
            k,
        }
    }

    /// R(n) (a, b, c).
    #[inline(always)]
    pub(crate) fn turn(&self, [a, b, c]: [f64; 3]) -> DVec3 {
        self.tangents[0] * a + self.tangents[1] * b + self.normal * c
    }

    /// Gradient with respect to n, tangent to the sphere, of ⟨p, R(n) (a, b, c)⟩.
    ///
    /// At n = −e₃, where R is not continuous, the motion of the tangents is left out.
    pub fn gradient(&self, p: DVec3, [a, b, c]: [f64; 3]) -> DVec3 {
        let DVec3 { x, y, .. } = self.normal;
        let k = self.k;
        // ⟨p, t₁⟩ and ⟨p, t₂⟩ as polynomials in (x, y, k), with dk = −k² dz.
        let first = DVec3::new(
            -2.0 * k * x * p.x - k * y * p.y - p.z,
            -k * x * p.y,
            k * k * x * (x * p.x + y * p.y),
        );
        let second = DVec3::new(
            -k * y * p.x,
            -k * x * p.x - 2.0 * k * y * p.y - p.z,
            k * k * y * (x * p.x + y * p.y),
        );
        let free = first * a + second * b + p * c;
        free - self.normal * free.dot(self.normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normals() -> Vec<DVec3> {
        let mut all = vec![DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_Z, DVec3::NEG_X];
        for (x, y) in [(1e-3, 2e-3), (1e-8, -1e-8), (1e-160, 0.0), (0.6, -0.3)] {
            all.push(DVec3::new(x, y, -1.0).normalize());
            all.push(DVec3::new(x, y, 1.0).normalize());
        }
        all
    }

    #[test]
    fn frames_are_rotations_that_take_e3_to_the_normal() {
        for n in normals() {
            let Frame {
                tangents: [t1, t2],
                normal,
                ..
            } = Frame::new(n);
            assert!((t1.cross(t2) - n).length() < 1e-14, "{n}");
            assert!((t1.length() - 1.0).abs() < 1e-14 && (t2.length() - 1.0).abs() < 1e-14);
            assert_eq!(normal, n);
        }
    }

    #[test]
    fn the_rotation_is_the_smallest() {
        // The axis e₃ × n is fixed by it.
        let n = DVec3::new(0.3, -0.5, -0.4).normalize();
        let axis = DVec3::Z.cross(n).normalize();
        let frame = Frame::new(n);
        let turned = frame.tangents[0] * axis.x + frame.tangents[1] * axis.y + n * axis.z;
        assert!((turned - axis).length() < 1e-15);
    }

    #[test]
    fn rays_are_orthogonal_to_their_two_edges_and_polar_to_the_others() {
        for l in [3, 4, 8, 13] {
            let cone = FrictionCone::new(0.7, l).unwrap();
            for (j, ray) in cone.rays.iter().enumerate() {
                for (i, edge) in cone.edges.iter().enumerate() {
                    let across = ray[0] * edge[0] + ray[1] * edge[1];
                    let product = 0.7 * (across - cone.inner);
                    if i == j || i == (j + 1) % l {
                        assert!(product.abs() < 1e-15);
                    } else {
                        assert!(product < -1e-3);
                    }
                }
            }
        }
    }

    #[test]
    fn the_gradient_of_the_frame_is_that_of_finite_differences() {
        let p = DVec3::new(0.3, -1.1, 0.7);
        let weights = [0.4, -0.2, 1.3];
        let value = |n: DVec3| {
            let frame = Frame::new(n.normalize());
            p.dot(
                frame.tangents[0] * weights[0]
                    + frame.tangents[1] * weights[1]
                    + frame.normal * weights[2],
            )
        };
        for n in [
            DVec3::new(0.3, 0.2, 0.9),
            DVec3::new(-0.4, 0.1, -0.95),
            DVec3::X,
        ] {
            let n = n.normalize();
            let gradient = Frame::new(n).gradient(p, weights);
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                let h = 1e-6;
                let difference = (value(n + axis * h) - value(n - axis * h)) / (2.0 * h);
                assert!((difference - gradient.dot(axis)).abs() < 1e-8);
            }
        }
    }
}
