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
    /// H − H', and what rounding does to it, relative to the smaller of both.
    taller: f64,
    taller_error: f64,
    /// Of both ends: a − a' and b − b'.
    lifts: [f64; 2],
    /// Both are surfaces of revolution: it is enough to look at one meridian.
    round: bool,
    /// By how much coefficients on the common grid may differ from those of the surfaces, both
    /// together, and by how much distances of normals do then.
    moved: f64,
    normals_moved: f64,
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
        let heights = [first, second].map(|s| s.top() - s.bottom());
        let lifts = [first.bottom() - second.bottom(), first.top() - second.top()];
        // Of two ways, the one that loses less.
        let (lift, height) = (lifts[0].abs() + lifts[1].abs(), heights[0].min(heights[1]));
        let (taller, scale) = if lift < height {
            (lifts[1] - lifts[0], lift)
        } else {
            (heights[0] - heights[1], heights[0] + heights[1])
        };
        let difference = surfaces[0].with_coefficients(pairs.map(|(a, b)| a - b).collect());
        Ok(Self {
            heights,
            taller,
            taller_error: 4.0 * f64::EPSILON * scale / height,
            lifts,
            round: round.is_some(),
            surfaces,
            difference,
            moved,
            normals_moved: 0.0,
        })
    }

    /// By how much a bound of the distance on the common grid must grow to hold for the surfaces.
    pub fn moved(&self, bound: f64) -> f64 {
        let normals = (bound + self.normals_moved).min(FURTHEST);
        self.moved.max(normals - bound)
    }

    /// Do the surfaces have the same points?
    pub fn are_equal(&self) -> bool {
        let same = self.difference.coefficients().iter().all(|c| *c == 0.0);
        same && self.lifts == [0.0; 2] && self.moved == 0.0
    }

    /// All patches with bounds that take no second derivatives: cheap, and enough to put most aside.
    pub fn patches(&mut self) -> Vec<(f64, Patch)> {
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
            if self.moved > 0.0 {
                let (along_u, along_theta) = self.slopes(radii);
                let moved = turning * self.moved * (along_u + along_theta);
                self.normals_moved = self.normals_moved.max(moved);
            }
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
            is_rough: true,
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
        let normals = Normals::new([b + d, b], d, self.heights, self.taller);
        let by_theta = if self.round {
            DVec3::ZERO
        } else {
            normals.by_theta()
        };
        [normals.apart, normals.by_u(), by_theta]
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
            value: rounding,
            slope: 8.0 * rounding / self.patch(),
        }
    }

    /// The same for normals; `turning` bounds s on the patch.
    fn noise_of_normals(&self, radii: [Range; 3], turning: f64) -> Noise {
        let [one, other, apart] = radii;
        let [h, k] = self.heights;
        let (along_u, along_theta) = self.slopes(radii);
        let largest = one.high.max(other.high);
        let stretch = self.taller.abs() / h.max(k);
        // X − X' is about as large as its terms at most, and they are known to `SUM` of their size.
        let terms = along_u * (apart.largest() + largest * stretch) + along_theta * apart.largest();
        // Of X too the part that H − H' makes is at most 1/s.
        let value = turning * SUM * terms + self.taller_error;
        // Derivatives multiply that by one more slope, and by one of n.
        let steepest = turning * (along_u + along_theta) * largest;
        Noise {
            value: value.min(FURTHEST),
            slope: 32.0 * value * (1.0 + steepest) / self.patch(),
        }
    }

    /// How large f_u/H and ∂_θ ln f, and differences of them, can be on a patch, relative to the
    /// largest coefficient: on N by k patches splines have slopes of 6 N and k/π times that.
    fn slopes(&self, [one, other, _]: [Range; 3]) -> (f64, f64) {
        let (rows, columns) = self.difference.shape();
        let least = one.low.min(other.low);
        let uneven = one.high.max(other.high) / least;
        (
            6.0 * (rows - 3) as f64 / self.heights[0].min(self.heights[1]),
            4.0 * columns as f64 / (std::f64::consts::PI * least) * uneven,
        )
    }

    /// Half the width of a patch.
    fn patch(&self) -> DVec2 {
        let (rows, columns) = self.difference.shape();
        DVec2::new(0.5 / (rows - 3) as f64, 0.5 * TAU / columns as f64)
    }
}

/// n − n' and its derivatives, n = φ(X), from differences throughout.
struct Normals {
    radii: [Radius; 2],
    /// f − f'.
    d: Radius,
    heights: [f64; 2],
    /// H − H'.
    taller: f64,
    /// X = (∂_θ ln f, f_u/H), and X − X'.
    x: [DVec2; 2],
    x_apart: DVec2,
    /// √(1 + ‖X‖²) of both, and the difference of their reciprocals.
    lengths: [f64; 2],
    shrunk: f64,
    n: [DVec3; 2],
    apart: DVec3,
}

impl Normals {
    fn new(radii: [Radius; 2], d: Radius, heights: [f64; 2], taller: f64) -> Self {
        let [(a, h), (b, k)] = [(radii[0], heights[0]), (radii[1], heights[1])];
        let x = [(a, h), (b, k)].map(|(r, h)| DVec2::new(r.slope[1] / r.value, r.slope[0] / h));
        let x_apart = DVec2::new(
            (d.slope[1] - x[1].x * d.value) / a.value,
            (d.slope[0] - x[1].y * taller) / h,
        );
        let lengths = x.map(|x| (1.0 + x.length_squared()).sqrt());
        let [l, m] = lengths;
        let shrunk = -x_apart.dot(x[0] + x[1]) / (l * m * (l + m));
        let n = [0, 1].map(|i| DVec3::new(-1.0, x[i].x, x[i].y) / lengths[i]);
        let apart = x_apart / l + x[1] * shrunk;
        Self {
            radii,
            d,
            heights,
            taller,
            x,
            x_apart,
            lengths,
            shrunk,
            n,
            apart: DVec3::new(-shrunk, apart.x, apart.y),
        }
    }

    fn by_u(&self) -> DVec3 {
        let ([a, b], d, [h, k]) = (self.radii, self.d, self.heights);
        let [first, second] = [(a, h), (b, k)].map(|(r, h)| {
            let [fu, ft] = r.slope.map(|slope| slope / r.value);
            DVec2::new(r.bend[1] / r.value - fu * ft, r.bend[0] / h)
        });
        // Of f_uθ/f, f_u/f and f_uu/H.
        let fut = (d.bend[1] - b.bend[1] / b.value * d.value) / a.value;
        let fu = (d.slope[0] - b.slope[0] / b.value * d.value) / a.value;
        let fuu = (d.bend[0] - second.y * self.taller) / h;
        let mixed = fu * self.x[0].x + b.slope[0] / b.value * self.x_apart.x;
        self.turned([first, second], DVec2::new(fut - mixed, fuu))
    }

    fn by_theta(&self) -> DVec3 {
        let ([a, b], d, [h, k]) = (self.radii, self.d, self.heights);
        let [first, second] = [(a, h), (b, k)].map(|(r, h)| {
            let ft = r.slope[1] / r.value;
            DVec2::new(r.bend[2] / r.value - ft * ft, r.bend[1] / h)
        });
        let ftt = (d.bend[2] - b.bend[2] / b.value * d.value) / a.value;
        let fut = (d.bend[1] - second.y * self.taller) / h;
        let square = self.x_apart.x * (self.x[0].x + self.x[1].x);
        self.turned([first, second], DVec2::new(ftt - square, fut))
    }

    /// Dφ(X) X_a − Dφ(X') X'_a, with Dφ(X) v = (v − n ⟨n, v⟩)/√(1 + ‖X‖²), v = (0, X_a).
    fn turned(&self, [first, second]: [DVec2; 2], apart: DVec2) -> DVec3 {
        let space = |v: DVec2| DVec3::new(0.0, v.x, v.y);
        let [v, w, apart] = [first, second, apart].map(space);
        let [n, m] = self.n;
        let across = self.apart * n.dot(v) + m * (self.apart.dot(v) + m.dot(apart));
        (apart - across) / self.lengths[0] + (w - m * m.dot(w)) * self.shrunk
    }
}
