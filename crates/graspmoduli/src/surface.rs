//! Surfaces with cylindrical coordinates S_{f,a,b} (Sec. III), f a bicubic spline.

use crate::contact::Contact;
use crate::error::Error;
use crate::math;
use crate::spline::{Basis, Local};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;
use std::sync::OnceLock;

/// Largest number of spline intervals in a common refinement, per direction.
const LARGEST_GRID: usize = 8192;

/// c(u, θ) = (f cos θ, f sin θ, (1 − u) a + u b) with f a tensor product of uniform cubic
/// B-splines, clamped in u and periodic in θ. All coefficients are positive, hence f > 0.
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

impl Surface {
    /// From spline coefficients, row-major with `columns` per row.
    pub fn new(
        bottom: f64,
        top: f64,
        columns: usize,
        coefficients: Vec<f64>,
    ) -> Result<Self, Error> {
        if !(bottom.is_finite() && top.is_finite() && bottom < top) {
            return Err(Error::Heights(bottom, top));
        }
        let rows = coefficients.len() / columns.max(1);
        if rows < 4 || columns < 4 {
            return Err(Error::CoefficientShape(rows, columns));
        }
        if rows * columns != coefficients.len() {
            return Err(Error::CoefficientCount(rows * columns, coefficients.len()));
        }
        let wrong = |c: &f64| !(c.is_finite() && *c > 0.0);
        if let Some(index) = coefficients.iter().position(wrong) {
            let value = coefficients[index];
            return Err(Error::Coefficient(index / columns, index % columns, value));
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

    /// f and its derivatives at (u, θ); u in [0, 1], θ any real.
    #[inline]
    pub fn radius(&self, u: f64, theta: f64) -> Radius {
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

    /// The same by Simpson's rule with an even number of steps in each direction, as in the paper
    /// (60 in IV.B, 20 in IV.E).
    pub fn integrals_by_simpson(&self, steps: usize) -> Integrals {
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

    /// Σ weight·S in the convex cone of surfaces (Lemma III.1): exact on the coefficients, once
    /// all are written on a common refinement of their grids. Weights are positive.
    pub fn combine(terms: &[(f64, &Surface)]) -> Result<Self, Error> {
        let (intervals, columns) = common_grid(terms.iter().map(|&(_, surface)| surface))?;
        let mut sum = vec![0.0; (intervals + 3) * columns];
        let (mut bottom, mut top) = (0.0, 0.0);
        for &(weight, surface) in terms {
            if !(weight.is_finite() && weight > 0.0) {
                return Err(Error::Weight(weight));
            }
            bottom += weight * surface.bottom;
            top += weight * surface.top;
            let refined = surface.refined(intervals, columns);
            for (total, coefficient) in sum.iter_mut().zip(refined) {
                *total += weight * coefficient;
            }
        }
        Self::new(bottom, top, columns, sum)
    }

    /// Both surfaces, unchanged, on a common refinement of their grids.
    pub(crate) fn on_common_grid(&self, other: &Self) -> Result<(Self, Self), Error> {
        let (intervals, columns) = common_grid([self, other])?;
        let on_grid = |s: &Self| Self::new(s.bottom, s.top, columns, s.refined(intervals, columns));
        Ok((on_grid(self)?, on_grid(other)?))
    }

    /// (1 − t) S + t S' of surfaces on the same grid, 0 ≤ t ≤ 1.
    pub(crate) fn towards(&self, other: &Self, t: f64) -> Self {
        let mix = |a: f64, b: f64| (1.0 - t) * a + t * b;
        let pairs = self.coefficients.iter().zip(&other.coefficients);
        Self {
            bottom: mix(self.bottom, other.bottom),
            top: mix(self.top, other.top),
            coefficients: pairs.map(|(&a, &b)| mix(a, b)).collect(),
            integrals: OnceLock::new(),
            ..self.clone()
        }
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

    /// The same surface on the smallest periodic grid, if to rounding it is one of revolution.
    pub(crate) fn of_revolution(&self) -> Option<Self> {
        let largest = self.coefficients.iter().fold(0.0, |m: f64, &c| m.max(c));
        let even = |row: &[f64]| row.iter().all(|c| (c - row[0]).abs() <= 1e-14 * largest);
        let mut rows = self.coefficients.chunks_exact(self.columns);
        rows.all(even).then(|| self.project())
    }

    /// Coefficients on a grid of so many intervals in u and θ, multiples of the present ones.
    fn refined(&self, intervals: usize, columns: usize) -> Vec<f64> {
        let mut rows: Vec<Vec<f64>> = self
            .coefficients
            .chunks_exact(self.columns)
            .map(<[f64]>::to_vec)
            .collect();
        if columns != self.columns {
            let factor = columns / self.columns;
            rows = rows
                .iter()
                .map(|row| self.theta_basis.refine(factor, row))
                .collect();
        }
        if intervals == self.u_basis.intervals() {
            return rows.concat();
        }
        let factor = intervals / self.u_basis.intervals();
        let mut out = vec![0.0; (intervals + 3) * columns];
        for column in 0..columns {
            let line: Vec<f64> = rows.iter().map(|row| row[column]).collect();
            for (i, value) in self.u_basis.refine(factor, &line).into_iter().enumerate() {
                out[i * columns + column] = value;
            }
        }
        out
    }

    /// π(S): the surface of revolution whose radius is the mean over θ (Sec. IV.E), which is the
    /// mean of the coefficients.
    pub fn project(&self) -> Self {
        let columns = 4;
        let means = self.row_means();
        Self {
            coefficients: means.into_iter().flat_map(|mean| [mean; 4]).collect(),
            columns,
            theta_basis: Basis::new(columns, true),
            integrals: OnceLock::new(),
            ..self.clone()
        }
    }

    /// (1 − t) π(S) + t S, the path from the projection to the surface, 0 ≤ t ≤ 1.
    pub fn from_projection(&self, t: f64) -> Self {
        let means = self.row_means();
        let rows = self.coefficients.chunks_exact(self.columns);
        Self {
            coefficients: rows
                .zip(means)
                .flat_map(|(row, mean)| row.iter().map(move |c| (1.0 - t) * mean + t * c))
                .collect(),
            integrals: OnceLock::new(),
            ..self.clone()
        }
    }

    /// Is the radius the same all around, to 1.5 % on average?
    pub fn is_round(&self) -> bool {
        let means = self.row_means();
        let deviation: f64 = self
            .coefficients
            .chunks_exact(self.columns)
            .zip(&means)
            .map(|(row, mean)| row.iter().map(|c| (c - mean).abs()).sum::<f64>())
            .sum();
        deviation < 0.015 * means.iter().sum::<f64>() * self.columns as f64
    }

    fn row_means(&self) -> Vec<f64> {
        self.coefficients
            .chunks_exact(self.columns)
            .map(|row| row.iter().sum::<f64>() / self.columns as f64)
            .collect()
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

/// Simpson's weights for `steps` steps of unit length.
pub(crate) fn simpson(steps: usize) -> impl Iterator<Item = f64> {
    (0..=steps).map(move |i| match i {
        0 => 1.0 / 3.0,
        i if i == steps => 1.0 / 3.0,
        i if i % 2 == 1 => 4.0 / 3.0,
        _ => 2.0 / 3.0,
    })
}

/// Intervals in u and θ of the coarsest grid that refines all surfaces' grids.
fn common_grid<'a>(
    surfaces: impl IntoIterator<Item = &'a Surface>,
) -> Result<(usize, usize), Error> {
    let (mut intervals, mut columns) = (1, 1);
    for surface in surfaces {
        intervals = least_common_multiple(intervals, surface.u_basis.intervals());
        columns = least_common_multiple(columns, surface.columns);
    }
    if intervals > LARGEST_GRID || columns > LARGEST_GRID {
        return Err(Error::GridTooLarge(intervals, columns));
    }
    Ok((intervals, columns))
}

fn least_common_multiple(a: usize, b: usize) -> usize {
    let (mut x, mut y) = (a, b);
    while y != 0 {
        (x, y) = (y, x % y);
    }
    (a / x).saturating_mul(b)
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
