//! Twists from velocities of the contacts, in the frame of the contact plane.

use super::lanes::{Lane, Number, splat_each};
use super::r6::Twist;
use glam::{DVec2, DVec3};
use pulp::Simd;

/// Twists from velocities of the contacts, in the frame of the plane.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Velocity<T> {
    pub normal: [[T; 3]; 3],
    /// Contact 2 is at (p, 0), contact 3 at (q, s).
    inverse_p: T,
    inverse_s: T,
    q: T,
    center: [T; 3],
}

impl Velocity<f64> {
    #[inline(always)]
    /// Of contacts at (0, 0), (`second`, 0) and `third` with these normals, and the centre of mass.
    pub(super) fn new(normals: [DVec3; 3], second: f64, third: DVec2, center: DVec3) -> Self {
        Self {
            normal: normals.map(|normal| normal.to_array()),
            inverse_p: 1.0 / second,
            inverse_s: 1.0 / third.y,
            q: third.x,
            center: center.to_array(),
        }
    }

    #[inline(always)]
    pub(super) fn splat<S: Simd>(self, simd: S) -> Velocity<Lane<S>> {
        let [first, second, third] = self.normal;
        Velocity {
            normal: [
                splat_each(simd, first),
                splat_each(simd, second),
                splat_each(simd, third),
            ],
            inverse_p: Lane::splat(simd, self.inverse_p),
            inverse_s: Lane::splat(simd, self.inverse_s),
            q: Lane::splat(simd, self.q),
            center: splat_each(simd, self.center),
        }
    }

    /// The twist that lifts one contact out of the plane at unit velocity, the others at rest.
    #[inline(always)]
    pub(super) fn lift(&self, contact: usize) -> Twist {
        let mut heights = [0.0; 3];
        heights[contact] = 1.0;
        self.rigid([0.0; 2], 0.0, heights)
    }
}

impl<T: Number> Velocity<T> {
    /// From the velocity of contact 1 and what else is needed of those of 2 and 3.
    #[inline(always)]
    pub(super) fn twist(&self, first: [T; 3], second_y: T, second_z: T, third_z: T) -> [T; 6] {
        let [x, y, z] = first;
        let spin = (second_y - y) * self.inverse_p;
        self.rigid([x, y], spin, [z, second_z, third_z])
    }

    /// From the planar velocity of contact 1, the spin, and the velocities out of the plane.
    #[inline(always)]
    pub(super) fn rigid(&self, origin: [T; 2], spin: T, [z1, z2, z3]: [T; 3]) -> [T; 6] {
        let wy = (z1 - z2) * self.inverse_p;
        let wx = wy.mul_add(self.q, z3 - z1) * self.inverse_s;
        let [x, y, z] = self.center;
        [
            wy.mul_add(z, origin[0]) - spin * y,
            spin.mul_add(x, origin[1]) - wx * z,
            wx.mul_add(y, z1) - wy * x,
            wx,
            wy,
            spin,
        ]
    }
}
