//! The metric of the paper's Q in the coordinates in which a hull is expanded.

use super::lanes::{Lane, splat_each};
use super::r6::{Twist, unit};
use super::wrenches::Reference;
use glam::DVec3;
use pulp::Simd;

/// Lengths of twists about the centre of mass, of which the hull's coordinates are about another
/// point and in another unit of length.
#[derive(Debug, Clone, Copy)]
pub(super) struct Metric {
    /// From the centre of mass to the point that torques of the hull are about, and what they
    /// were divided by: ‖x‖² = ‖v − ω/scale × shift‖² + ‖ω/scale‖².
    shift: DVec3,
    scale: f64,
    /// Both terms are multiplied by this, so that neither overflows.
    unit: f64,
}

impl Metric {
    pub fn new(reference: Reference, center_of_mass: DVec3) -> Self {
        Self {
            shift: reference.point - center_of_mass,
            scale: reference.scale,
            unit: reference.scale.min(1.0),
        }
    }

    /// Can lengths be computed without overflow?
    pub fn is_tame(&self) -> bool {
        let reach = self.shift.abs().max_element();
        let tame = |length: f64| (1e-140..1e140).contains(&length);
        tame(self.scale) && reach < 1e140 && reach / self.scale < 1e140 && self.shift.is_finite()
    }

    /// v and ω about the centre of mass, times the unit.
    #[inline(always)]
    fn about_center(self, [a, b, c, d, e, f]: &Twist) -> [DVec3; 2] {
        let angular = DVec3::new(*d, *e, *f) * (self.unit / self.scale);
        let linear = DVec3::new(*a, *b, *c) * self.unit - angular.cross(self.shift);
        [linear, angular]
    }

    #[inline(always)]
    pub fn square(self, x: &Twist) -> f64 {
        let [linear, angular] = self.about_center(x);
        linear.length_squared() + angular.length_squared()
    }

    /// The same of some twists, a lane each.
    #[inline(always)]
    pub fn squares<S: Simd>(self, simd: S, x: &[Lane<S>; 6]) -> Lane<S> {
        let unit = Lane::splat(simd, self.unit);
        let turn = Lane::splat(simd, self.unit / self.scale);
        let [a, b, c] = splat_each(simd, self.shift.to_array());
        let [d, e, f] = [x[3] * turn, x[4] * turn, x[5] * turn];
        let [u, v, w] = [
            x[0] * unit - (e * c - f * b),
            x[1] * unit - (f * a - d * c),
            x[2] * unit - (d * b - e * a),
        ];
        ((u * u + v * v) + w * w) + ((d * d + e * e) + f * f)
    }

    #[inline(always)]
    pub fn length(self, x: &Twist) -> f64 {
        self.square(x).sqrt() / self.unit
    }

    /// The unit twist about the centre of mass.
    pub fn direction(self, x: &Twist) -> Twist {
        let [v, w] = self.about_center(x);
        unit(&[v.x, v.y, v.z, w.x, w.y, w.z]).0
    }
}
