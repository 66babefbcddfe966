//! Two surfaces on one grid, and δ between them at a point with bounds of its rounding.

use super::bounds::{FURTHEST, normals_apart};
use super::cell::{Cell, Distance, Noise};
use super::net::{Net, Range, ranges_on_patches};
use crate::error::Error;
use crate::surface::{Radius, Surface};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// How far sums of a spline's sixteen products are from the exact ones at most, relative to the
/// coefficients and, for derivatives, to the knots.
const SUM: f64 = 256.0 * f64::EPSILON;

pub struct Pair {
    /// On a common grid.
    surfaces: [Surface; 2],
    /// f − f' on it.
    difference: Surface,
    pub heights: [f64; 2],
    /// Of both ends: a − a' and b − b'.
    lifts: [f64; 2],
    /// Both are surfaces of revolution: it is enough to look at one meridian.
    round: bool,
    /// By how much the coefficients on the common grid may differ from those of the surfaces.
    moved: f64,
}

/// A patch of the splines that was not looked at closely yet.
#[derive(Debug, Clone, Copy)]
pub struct Patch {
    number: usize,
    of: Distance,
    /// A bound of s on it.
    turning: f64,
}

impl Pair {
    pub fn new(first: &Surface, second: &Surface) -> Result<Self, Error> {
        let round = first.as_revolution().zip(second.as_revolution());
        let ([one, other], mut moved) = match &round {
            Some(((one, a), (other, b))) => ([one, other], a + b),
            None => ([first, second], 0.0),
        };
        let surfaces: [Surface; 2] = one.on_common_grid(other)?.into();
        moved += one.refinement_error(&surfaces[0]) + other.refinement_error(&surfaces[1]);
        let pairs = surfaces[0].coefficients().iter();
        let pairs = pairs.zip(surfaces[1].coefficients());
        let difference = surfaces[0].with_coefficients(pairs.map(|(a, b)| a - b).collect());
        Ok(Self {
            heights: [first, second].map(|s| s.top() - s.bottom()),
            lifts: [first.bottom() - second.bottom(), first.top() - second.top()],
            round: round.is_some(),
            surfaces,
            difference,
            moved,
        })
    }

    /// Do the surfaces have the same points?
    pub fn are_equal(&self) -> bool {
        let same = self.difference.coefficients().iter().all(|c| *c == 0.0);
        same && self.lifts == [0.0; 2] && self.moved == 0.0
    }

    /// All patches with bounds that take no second derivatives: cheap, and enough to put most aside.
    pub fn patches(&self) -> Vec<(f64, Patch)> {
        let (_, columns) = self.difference.shape();
        let [first, second] = &self.surfaces;
        let [one, other, apart] = [first, second, &self.difference]
            .map(|surface| ranges_on_patches(surface.coefficients(), columns));
        let lift = self.lifts[0].abs().max(self.lifts[1].abs());
        let looked_at = if self.round { 1 } else { columns };
        let mut patches = Vec::with_capacity(2 * one.len());
        for number in (0..one.len()).filter(|patch| patch % columns < looked_at) {
            let ranges = [one[number], other[number], apart[number]];
            let radii = ranges.map(|r| r[0]);
            let points = DVec2::new(radii[2].largest(), lift).length();
            let points = points + self.noise_of_points(radii).value;
            let (normals, turning) = normals_apart(ranges, self.heights);
            let normals = normals + self.noise_of_normals(radii, turning).value;
            let patch = |of| Patch {
                number,
                of,
                turning,
            };
            patches.push((points, patch(Distance::Points)));
            patches.push((normals.min(FURTHEST), patch(Distance::Normals)));
        }
        patches
    }

    /// The whole of a patch.
    pub fn cell(&self, patch: Patch) -> Cell {
        let Patch {
            number,
            of,
            turning,
        } = patch;
        let (_, columns) = self.difference.shape();
        let (i, j) = (number / columns, number % columns);
        let [first, second] = &self.surfaces;
        let all = [first, second, &self.difference];
        let radii = all.map(|surface| surface.patch_range(i, j));
        let radii = radii.map(|(low, high)| Range { low, high });
        let span = self.patch();
        let nets: [Net; 3] = all.map(|surface| surface.bezier_net(i, j));
        let noise = match of {
            Distance::Points => self.noise_of_points(radii),
            Distance::Normals => self.noise_of_normals(radii, turning),
        };
        Cell {
            of,
            nets,
            net_errors: radii.map(|range| SUM * range.largest()),
            lowest: [radii[0].low, radii[1].low],
            span,
            center: DVec2::new((2 * i + 1) as f64, (2 * j + 1) as f64) * span,
            half: DVec2::new(span.x, if self.round { 0.0 } else { span.y }),
            bends: [f64::INFINITY; 3],
            depth: 0,
            noise,
        }
    }

    /// δ_c or δ_n with its derivatives by u and θ, in the frame that turns with θ.
    ///
    /// From the difference of the radii rather than from two radii, so that rounding is small beside
    /// small distances too.
    pub fn difference(&self, of: Distance, at: DVec2) -> [DVec3; 3] {
        let d = self.difference.radius(at.x, at.y);
        if of == Distance::Points {
            let lift = (1.0 - at.x) * self.lifts[0] + at.x * self.lifts[1];
            return [
                DVec3::new(d.value, 0.0, lift),
                DVec3::new(d.slope[0], 0.0, self.lifts[1] - self.lifts[0]),
                DVec3::new(d.slope[1], 0.0, 0.0),
            ];
        }
        let b = self.surfaces[1].radius(at.x, at.y);
        let a = b + d;
        let [h, k] = self.heights;
        // X of both, and X − X'.
        let x = DVec2::new(a.slope[1] / a.value, a.slope[0] / h);
        let y = DVec2::new(b.slope[1] / b.value, b.slope[0] / k);
        let apart = DVec2::new(
            (d.slope[1] - y.x * d.value) / a.value,
            (d.slope[0] - y.y * (h - k)) / h,
        );
        let lengths = [x, y].map(|x| (1.0 + x.length_squared()).sqrt());
        let [l, m] = lengths;
        // 1/l − 1/m.
        let shrunk = -apart.dot(x + y) / (l * m * (l + m));
        let value = DVec3::new(
            -shrunk,
            apart.x / l + y.x * shrunk,
            apart.y / l + y.y * shrunk,
        );
        let slopes = [(&a, x, h, l), (&b, y, k, m)].map(|(r, x, h, l)| normal_slopes(r, x, h, l));
        let [by_u, by_theta] = [0, 1].map(|i| slopes[0][i] - slopes[1][i]);
        [value, by_u, if self.round { DVec3::ZERO } else { by_theta }]
    }

    /// max(‖δ_c‖, ‖δ_n‖).
    pub fn distance(&self, at: DVec2) -> f64 {
        let lengths = [Distance::Points, Distance::Normals].map(|of| self.difference(of, at)[0]);
        lengths[0].length().max(lengths[1].length())
    }

    /// Of `difference` on a patch with these ranges of f, f' and f − f', for points.
    fn noise_of_points(&self, [_, _, apart]: [Range; 3]) -> Noise {
        let lift = self.lifts[0].abs() + self.lifts[1].abs();
        let rounding = SUM * (apart.largest() + lift);
        Noise {
            value: rounding + self.moved,
            slope: 8.0 * rounding / self.patch(),
        }
    }

    /// The same for normals; `turning` bounds s on the patch.
    ///
    /// With N intervals in u and k in θ a spline of coefficients up to c has slopes up to 6 N c and
    /// (k/π) c: the error of a slope is `SUM` times that, and so on for X and n = φ(X).
    fn noise_of_normals(&self, [one, other, apart]: [Range; 3], turning: f64) -> Noise {
        let (rows, columns) = self.difference.shape();
        let [h, k] = self.heights;
        let (height, stretch) = (h.min(k), (h - k).abs() / h.max(k));
        let least = one.low.min(other.low);
        let largest = one.high.max(other.high);
        let along_u = 6.0 * (rows - 3) as f64 / height;
        let along_theta = 4.0 * columns as f64 / (std::f64::consts::PI * least);
        // X − X' is about as large as its terms at most, and they are known to `SUM` of their size.
        let terms = along_u * (apart.largest() + largest * stretch)
            + along_theta * apart.largest() * (largest / least);
        let heights = if h == k { 0.0 } else { 8.0 * f64::EPSILON };
        let moved = self.moved * (along_u + along_theta * (largest / least));
        // Derivatives of n are computed for each surface.
        let steepest = turning * (along_u + along_theta * (largest / least)) * largest;
        Noise {
            value: (turning * (SUM * terms + moved) + heights).min(FURTHEST),
            slope: 8.0 * SUM * steepest * (1.0 + steepest) / self.patch(),
        }
    }

    /// Half the width of a patch.
    fn patch(&self) -> DVec2 {
        let (rows, columns) = self.difference.shape();
        DVec2::new(0.5 / (rows - 3) as f64, 0.5 * TAU / columns as f64)
    }
}

/// Derivatives by u and θ of φ(X), √(1 + ‖X‖²) = `length`, on a surface of height `h`.
fn normal_slopes(radius: &Radius, x: DVec2, h: f64, length: f64) -> [DVec3; 2] {
    let Radius {
        value: f,
        slope: [fu, ft],
        bend: [fuu, fut, ftt],
    } = *radius;
    let normal = DVec3::new(-1.0, x.x, x.y) / length;
    let along = |p: f64, q: f64| {
        let d = DVec3::new(0.0, p, q);
        (d - normal * normal.dot(d)) / length
    };
    [
        along(fut / f - fu * ft / (f * f), fuu / h),
        along(ftt / f - ft * ft / (f * f), fut / h),
    ]
}
