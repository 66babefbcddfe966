//! Area, volume and centres of mass of a surface, by two quadratures.

use super::{Integrals, Surface};
use crate::math;
use crate::spline::{Basis, Local};
use glam::DVec3;
use std::f64::consts::TAU;

impl Surface {
    /// Area, volume and centres of mass, by Gauss–Legendre quadrature on every spline patch.
    pub fn integrals(&self) -> &Integrals {
        self.integrals.get_or_init(|| {
            let cells = |basis: &Basis, length: f64| -> Vec<(f64, f64)> {
                let n = basis.intervals();
                // Short splines get more cells, so that the quadrature's error stays small.
                let parts = (24_usize).div_ceil(n) * n;
                let half = 0.5 * length / parts as f64;
                let gauss = (0.6_f64).sqrt();
                (0..parts)
                    .flat_map(|i| {
                        let middle = (2 * i + 1) as f64 * half;
                        [(-gauss, 5.0 / 9.0), (0.0, 8.0 / 9.0), (gauss, 5.0 / 9.0)]
                            .map(|(x, weight)| (middle + x * half, weight * half))
                    })
                    .collect()
            };
            self.integrate(&cells(&self.u_basis, 1.0), &cells(&self.theta_basis, TAU))
        })
    }

    /// The same by Simpson's rule, as in the paper (60 steps in each direction in IV.B, 20 in IV.E).
    /// The rule wants an even number, so an odd one counts as the next.
    pub fn integrals_by_simpson(&self, steps: usize) -> Integrals {
        let steps = steps.max(2).next_multiple_of(2);
        let rule = |length: f64| -> Vec<(f64, f64)> {
            simpson(steps)
                .enumerate()
                .map(|(i, weight)| {
                    let step = length / steps as f64;
                    (i as f64 * step, weight * step)
                })
                .collect()
        };
        self.integrate(&rule(1.0), &rule(TAU))
    }

    fn integrate(&self, us: &[(f64, f64)], thetas: &[(f64, f64)]) -> Integrals {
        let thetas: Vec<(Local, f64, f64, f64)> = thetas
            .iter()
            .map(|&(theta, weight)| {
                let (sin, cos) = math::sin_cos(theta);
                (self.theta_basis.at(theta / TAU), sin, cos, weight)
            })
            .collect();
        let h = self.top - self.bottom;
        let (mut area, mut volume) = (0.0, 0.0);
        let (mut moment, mut solid) = (DVec3::ZERO, DVec3::ZERO);
        for &(u, u_weight) in us {
            let at = self.u_basis.at(u);
            let z = self.height(u);
            for (theta, sin, cos, weight) in &thetas {
                let radius = self.contract(&at, theta);
                let f = radius.value;
                let share = u_weight * weight * self.density(&radius);
                let point = DVec3::new(f * cos, f * sin, z);
                area += share;
                moment += point * share;
                // Over a wedge from the axis to f: its volume, and its centroid at 2f/3.
                let wedge = u_weight * weight * 0.5 * h * f * f;
                volume += wedge;
                let planar = point.truncate() * (2.0 / 3.0);
                solid += planar.extend(z) * wedge;
            }
        }
        Integrals {
            area,
            center_of_mass: moment / area,
            volume,
            solid_center_of_mass: solid / volume,
        }
    }
}

/// Simpson's weights for `steps` steps of unit length.
pub(crate) fn simpson(steps: usize) -> impl Iterator<Item = f64> {
    (0..=steps).map(move |i| match i {
        0 => 1.0 / 3.0,
        i if i == steps => 1.0 / 3.0,
        i if i % 2 == 1 => 4.0 / 3.0,
        _ => 2.0 / 3.0,
    })
}
