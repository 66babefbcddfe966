//! Surfaces with cylindrical coordinates S_{f,a,b} (Sec. III), f a bicubic spline.

use crate::contact::Contact;
use crate::error::Error;
use crate::math;
use crate::spline::{Basis, Local};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;
use std::sync::OnceLock;

mod cone;
mod integrals;
mod revolution;

pub(crate) use integrals::simpson;

/// Lengths between these, in the unit of the object, are exact to rounding in all that is computed
/// from them: products of six neither overflow nor vanish.
const SHORTEST: f64 = 1e-50;
const LONGEST: f64 = 1e50;

/// c(u, θ) = (f cos θ, f sin θ, (1 − u) a + u b) with f a tensor product of uniform cubic
/// B-splines, clamped in u and periodic in θ. All coefficients are positive, hence f > 0.
/// Lengths lie between 1e-50 and 1e50.
#[derive(Debug, Clone)]
pub struct Surface {
    bottom: f64,
    top: f64,
    /// Row-major: a row per basis function in u, a column per basis function in θ.
    coefficients: Vec<f64>,
    columns: usize,
    u_basis: Basis,
    theta_basis: Basis,
    integrals: OnceLock<Integrals>,
}

/// The radius f and its derivatives at a point.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Radius {
    /// f.
    pub value: f64,
    /// ∂f/∂u and ∂f/∂θ.
    pub slope: [f64; 2],
    /// ∂²f/∂u², ∂²f/∂u∂θ, ∂²f/∂θ².
    pub bend: [f64; 3],
}

/// A contact on a surface with its derivatives by u and θ.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    /// The contact itself.
    pub contact: Contact,
    /// t₁ = ∂c/∂u and t₂ = ∂c/∂θ.
    pub tangents: [DVec3; 2],
    /// ∂n/∂u and ∂n/∂θ.
    pub normal_slopes: [DVec3; 2],
}

/// Area and centres of mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integrals {
    /// Area of the surface.
    pub area: f64,
    /// Centre of mass of the surface, z_S of the paper.
    pub center_of_mass: DVec3,
    /// Volume of the solid that the surface and two flat lids enclose.
    pub volume: f64,
    /// Centre of mass of that solid.
    pub solid_center_of_mass: DVec3,
}

impl std::ops::Add for Radius {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let sum = |k: usize| self.bend[k] + other.bend[k];
        Self {
            value: self.value + other.value,
            slope: [
                self.slope[0] + other.slope[0],
                self.slope[1] + other.slope[1],
            ],
            bend: [sum(0), sum(1), sum(2)],
        }
    }
}

impl Surface {
    /// From spline coefficients, row-major with `columns` per row.
    pub fn new(
        bottom: f64,
        top: f64,
        columns: usize,
        coefficients: Vec<f64>,
    ) -> Result<Self, Error> {
        if !(bottom.is_finite() && top.is_finite() && bottom < top) {
            return Err(Error::Heights { bottom, top });
        }
        let farthest = bottom.abs().max(top.abs());
        if let Some(&length) = [top - bottom, farthest].iter().find(|l| out_of_range(l)) {
            return Err(Error::Length { got: length });
        }
        let rows = coefficients.len() / columns.max(1);
        if rows < 4 || columns < 4 {
            return Err(Error::CoefficientShape { rows, columns });
        }
        if rows * columns != coefficients.len() {
            return Err(Error::CoefficientCount {
                wanted: rows * columns,
                got: coefficients.len(),
            });
        }
        let wrong = |c: &f64| !(c.is_finite() && *c > 0.0);
        if let Some(index) = coefficients.iter().position(wrong) {
            let value = coefficients[index];
            return Err(Error::Coefficient {
                row: index / columns,
                column: index % columns,
                got: value,
            });
        }
        if let Some(&length) = coefficients.iter().find(|c| out_of_range(c)) {
            return Err(Error::Length { got: length });
        }
        Ok(Self {
            bottom,
            top,
            u_basis: Basis::new(rows, false),
            theta_basis: Basis::new(columns, true),
            coefficients,
            columns,
            integrals: OnceLock::new(),
        })
    }

    /// a, the height at u = 0.
    pub fn bottom(&self) -> f64 {
        self.bottom
    }

    /// b, the height at u = 1.
    pub fn top(&self) -> f64 {
        self.top
    }

    /// Spline coefficients, row-major.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Shape of the coefficients: functions in u, functions in θ.
    pub fn shape(&self) -> (usize, usize) {
        (self.coefficients.len() / self.columns, self.columns)
    }

    /// f and its derivatives at (u, θ); u in [0, 1], θ any real, reduced modulo 2π.
    #[inline]
    pub fn radius(&self, u: f64, theta: f64) -> Radius {
        let theta = reduced(theta);
        self.contract(&self.u_basis.at(u), &self.theta_basis.at(theta / TAU))
    }

    #[inline]
    fn contract(&self, u: &Local, theta: &Local) -> Radius {
        let mut columns = [0; 4];
        for (k, column) in columns.iter_mut().enumerate() {
            *column = (theta.first + k) % self.columns;
        }
        let mut radius = Radius::default();
        for i in 0..4 {
            let row = &self.coefficients[(u.first + i) * self.columns..][..self.columns];
            let (mut value, mut slope, mut bend) = (0.0, 0.0, 0.0);
            for (k, &column) in columns.iter().enumerate() {
                value += theta.value[k] * row[column];
                slope += theta.slope[k] * row[column];
                bend += theta.bend[k] * row[column];
            }
            radius.value += u.value[i] * value;
            radius.slope[0] += u.slope[i] * value;
            radius.slope[1] += u.value[i] * slope;
            radius.bend[0] += u.bend[i] * value;
            radius.bend[1] += u.slope[i] * slope;
            radius.bend[2] += u.value[i] * bend;
        }
        // The basis is periodic with period 1 in θ/2π.
        radius.slope[1] /= TAU;
        radius.bend[1] /= TAU;
        radius.bend[2] /= TAU * TAU;
        radius
    }

    fn height(&self, u: f64) -> f64 {
        (1.0 - u) * self.bottom + u * self.top
    }

    /// The contact at (u, θ): c_S and n_S of the paper.
    pub fn contact(&self, u: f64, theta: f64) -> Contact {
        self.place(u, theta).contact
    }

    /// The contact at (u, θ) and its derivatives.
    ///
    /// In the frame e_r, e_θ, e_z that turns with θ, and with H = b − a,
    /// t₁ × t₂ = (−H f, H f_θ, f f_u): it points inward.
    pub fn place(&self, u: f64, theta: f64) -> Placed {
        let theta = reduced(theta);
        let Radius {
            value: f,
            slope: [fu, ft],
            bend: [fuu, fut, ftt],
        } = self.radius(u, theta);
        let h = self.top - self.bottom;
        let (sin, cos) = math::sin_cos(theta);
        let turn = |v: DVec3| DVec3::new(v.x * cos - v.y * sin, v.x * sin + v.y * cos, v.z);
        let cross = DVec3::new(-h * f, h * ft, f * fu);
        let length = cross.length();
        let normal = cross / length;
        let along_u = DVec3::new(-h * fu, h * fut, fu * fu + f * fuu);
        let along_theta = DVec3::new(-2.0 * h * ft, h * (ftt - f), ft * fu + f * fut);
        let slope = |d: DVec3| turn((d - normal * normal.dot(d)) / length);
        Placed {
            contact: Contact {
                point: turn(DVec3::new(f, 0.0, self.height(u))),
                normal: turn(normal),
            },
            tangents: [turn(DVec3::new(fu, 0.0, h)), turn(DVec3::new(ft, f, 0.0))],
            normal_slopes: [slope(along_u), slope(along_theta)],
        }
    }

    /// ∂²c/∂u², ∂²c/∂u∂θ, ∂²c/∂θ².
    pub fn second_derivatives(&self, u: f64, theta: f64) -> [DVec3; 3] {
        let theta = reduced(theta);
        let Radius {
            value: f,
            slope: [fu, ft],
            bend: [fuu, fut, ftt],
        } = self.radius(u, theta);
        let (sin, cos) = math::sin_cos(theta);
        let turn = |r: f64, t: f64| DVec3::new(r * cos - t * sin, r * sin + t * cos, 0.0);
        [turn(fuu, 0.0), turn(fut, fu), turn(ftt - f, 2.0 * ft)]
    }

    /// A = ‖t₁ × t₂‖, the area density, at one u and many θ.
    pub(crate) fn densities(&self, u: f64, thetas: &[Local]) -> Vec<f64> {
        let at = self.u_basis.at(u);
        thetas
            .iter()
            .map(|theta| self.density(&self.contract(&at, theta)))
            .collect()
    }

    fn density(&self, radius: &Radius) -> f64 {
        let h = self.top - self.bottom;
        let (f, [fu, ft]) = (radius.value, radius.slope);
        (h * h * (f * f + ft * ft) + f * f * fu * fu).sqrt()
    }

    /// The basis in θ at `count` equally spaced angles from 0 to 2π, both included.
    pub(crate) fn angles(&self, count: usize) -> Vec<Local> {
        (0..count)
            .map(|i| self.theta_basis.at(i as f64 / (count - 1) as f64))
            .collect()
    }

    /// Bézier control points of the radius on the patch of an interval in u and a column: rows along u.
    pub(crate) fn bezier_net(&self, interval: usize, column: usize) -> [[f64; 4]; 4] {
        let along_u = self.u_basis.bezier(interval);
        let along_theta = self.theta_basis.bezier(0);
        let mut net = [[0.0; 4]; 4];
        for k in 0..4 {
            let row = &self.coefficients[(interval + k) * self.columns..][..self.columns];
            for l in 0..4 {
                let coefficient = row[(column + l) % self.columns];
                for a in 0..4 {
                    for b in 0..4 {
                        net[a][b] += along_u[k][a] * along_theta[l][b] * coefficient;
                    }
                }
            }
        }
        net
    }

    /// The smallest and the largest of the coefficients that the radius on a patch is a mean of.
    pub(crate) fn patch_range(&self, interval: usize, column: usize) -> (f64, f64) {
        let mut range = (f64::INFINITY, f64::NEG_INFINITY);
        for row in self.coefficients[interval * self.columns..][..4 * self.columns]
            .chunks_exact(self.columns)
        {
            for k in 0..4 {
                let c = row[(column + k) % self.columns];
                range = (range.0.min(c), range.1.max(c));
            }
        }
        range
    }

    pub(crate) fn largest_coefficient(&self) -> f64 {
        self.coefficients.iter().fold(0.0, |m: f64, &c| m.max(c))
    }

    /// A function on the same grid with other coefficients, of any sign: no surface.
    pub(crate) fn with_coefficients(&self, coefficients: Vec<f64>) -> Self {
        Self {
            coefficients,
            integrals: OnceLock::new(),
            ..self.clone()
        }
    }

    /// Largest distance of the surface from a point, on a grid of `steps` by `steps`.
    pub fn radius_about(&self, center: DVec3, steps: usize) -> f64 {
        let mut farthest: f64 = 0.0;
        for (i, k) in (0..=steps).flat_map(|i| (0..steps).map(move |k| (i, k))) {
            let (u, theta) = (i as f64 / steps as f64, TAU * k as f64 / steps as f64);
            let (sin, cos) = math::sin_cos(theta);
            let planar = DVec2::new(cos, sin) * self.radius(u, theta).value;
            farthest = farthest.max(planar.extend(self.height(u)).distance(center));
        }
        farthest
    }
}

/// θ modulo 2π as far as that is a number, so that radius, sine and cosine are those of one angle
/// and points lie on the surface, whatever θ.
fn reduced(theta: f64) -> f64 {
    if theta.abs() <= TAU {
        theta
    } else {
        theta % TAU
    }
}

fn out_of_range(length: &f64) -> bool {
    !(SHORTEST..=LONGEST).contains(length)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Radius of neither revolution nor any symmetry.
    fn wavy(rows: usize, columns: usize) -> Surface {
        let coefficients = (0..rows * columns)
            .map(|i| 0.5 + 0.1 * math::sin(3.7 * i as f64))
            .collect();
        Surface::new(-0.4, 0.7, columns, coefficients).unwrap()
    }

    #[test]
    fn derivatives_are_those_of_finite_differences() {
        let surface = wavy(7, 9);
        let h = 1e-6;
        for (u, theta) in [(0.3, 1.0), (0.71, 6.2), (0.11, -2.0)] {
            let placed = surface.place(u, theta);
            let n = placed.contact.normal;
            assert!((n.length() - 1.0).abs() < 1e-15);
            let cross = placed.tangents[0].cross(placed.tangents[1]);
            assert!((cross.normalize() - n).length() < 1e-14);
            assert!(n.dot(placed.contact.point.truncate().extend(0.0)) < 0.0);
            let bends = surface.second_derivatives(u, theta);
            for (k, (du, dt)) in [(h, 0.0), (0.0, h)].into_iter().enumerate() {
                let high = surface.place(u + du, theta + dt);
                let low = surface.place(u - du, theta - dt);
                let difference = |a: DVec3, b: DVec3| (a - b) / (2.0 * h);
                let point = difference(high.contact.point, low.contact.point);
                let normal = difference(high.contact.normal, low.contact.normal);
                assert!((point - placed.tangents[k]).length() < 1e-7);
                assert!((normal - placed.normal_slopes[k]).length() < 1e-6);
                for j in 0..2 {
                    let bend = difference(high.tangents[j], low.tangents[j]);
                    assert!((bend - bends[j + k]).length() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn a_cylinder_has_the_area_and_the_centre_of_a_cylinder() {
        let surface = Surface::new(-1.0, 2.0, 4, vec![0.5; 16]).unwrap();
        for integrals in [*surface.integrals(), surface.integrals_by_simpson(20)] {
            assert!((integrals.area - 0.5 * TAU * 3.0).abs() < 1e-12);
            assert!((integrals.volume - 0.25 * 0.5 * TAU * 3.0).abs() < 1e-12);
            let middle = DVec3::new(0.0, 0.0, 0.5);
            assert!((integrals.center_of_mass - middle).length() < 1e-12);
            assert!((integrals.solid_center_of_mass - middle).length() < 1e-12);
        }
    }

    #[test]
    fn two_quadratures_agree() {
        let surface = wavy(12, 9);
        let (a, b) = (surface.integrals(), surface.integrals_by_simpson(360));
        assert!((a.area - b.area).abs() < 1e-5);
        assert!((a.center_of_mass - b.center_of_mass).length() < 1e-5);
        assert!((a.solid_center_of_mass - b.solid_center_of_mass).length() < 1e-5);
    }

    #[test]
    fn combinations_are_exact_whatever_the_grids() {
        let (first, second) = (wavy(5, 6), wavy(9, 4));
        let sum = Surface::combine(&[(2.0, &first), (0.5, &second)]).unwrap();
        for i in 0..50 {
            let (u, theta) = (i as f64 / 49.0, 0.37 * i as f64);
            let wanted = 2.0 * first.radius(u, theta).value + 0.5 * second.radius(u, theta).value;
            assert!((sum.radius(u, theta).value - wanted).abs() < 1e-14);
        }
        assert_eq!(sum.bottom(), 2.5 * -0.4);
    }

    #[test]
    fn the_projection_is_the_mean_over_theta() {
        let surface = wavy(6, 8);
        let projected = surface.project();
        for u in [0.0, 0.3, 0.9, 1.0] {
            let mean = (0..4096)
                .map(|k| surface.radius(u, TAU * k as f64 / 4096.0).value)
                .sum::<f64>()
                / 4096.0;
            assert!((projected.radius(u, 1.0).value - mean).abs() < 1e-13);
            let between = surface.from_projection(0.25).radius(u, 2.0).value;
            let wanted = 0.75 * mean + 0.25 * surface.radius(u, 2.0).value;
            assert!((between - wanted).abs() < 1e-13);
        }
    }
}
