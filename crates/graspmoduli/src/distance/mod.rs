//! d(S, S') = sup max(‖c_S − c_S'‖, ‖n_S − n_S'‖) of Sec. III, with a proven error bound.
//!
//! Branch and bound over cells of the (u, θ) rectangle. In the frame that turns with θ the
//! differences are δ_c = (Δf, 0, Δz) and δ_n = φ(X) − φ(X'), where X = (∂_θ ln f, f_u/H), H the height,
//! and φ(X) = (−1, X)/√(1 + ‖X‖²). On a cell with half-widths (a, b) about its centre, Taylor's
//! formula bounds ‖δ‖ by the largest ‖δ ± a δ_u ± b δ_θ‖ at the centre plus ½ Σ K_ij h_i h_j, K_ij
//! bounds of the second derivatives of δ. These come from the splines' Bézier nets on each cell, as
//! products of sizes and of *differences* between the two surfaces, so that they vanish with
//! the distance. Along a line in X, with s = 1/√(1 + ‖X‖²), φ turns in a plane, by at most s per unit
//! of X; its second derivative is at most 1.16 s², its third 3 s³, and so are the multilinear forms.

use crate::error::Error;
use crate::surface::{Radius, Surface};
use glam::{DVec2, DVec3};
use net::{Net, Range, Ranges, ranges_on, ranges_on_patches};
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::TAU;
use std::ops::{Add, Mul};

mod net;

/// Cells looked at before the search ends with the bound that it has.
const MOST_CELLS: usize = 1 << 20;

/// Halvings of a patch down to which second derivatives are bounded anew, at first every time, then
/// now and then: what a cell inherits holds for it too.
const DEEPEST: u32 = 12;

/// A distance between surfaces: d(S, S') lies in [`value`, `value` + `error`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceDistance {
    /// Attained at (u, θ).
    pub value: f64,
    /// How much larger the supremum may be.
    pub error: f64,
    /// Where.
    pub at: [f64; 2],
}

impl SurfaceDistance {
    fn improve(&mut self, value: f64, at: DVec2) {
        if value > self.value {
            self.value = value;
            self.at = [at.x.clamp(0.0, 1.0), at.y.rem_euclid(TAU)];
        }
    }
}

/// d(S, S') to a relative error of `tolerance`.
pub fn surface_distance(
    first: &Surface,
    second: &Surface,
    tolerance: f64,
) -> Result<SurfaceDistance, Error> {
    let (first, second) = match (first.of_revolution(), second.of_revolution()) {
        (Some(first), Some(second)) => first.on_common_grid(&second)?,
        _ => first.on_common_grid(second)?,
    };
    let pair = Pair::new(&first, &second);
    let mut best = SurfaceDistance {
        value: 0.0,
        error: 0.0,
        at: [0.0; 2],
    };
    let mut cells: Vec<Cell> = Vec::new();
    let mut queue = BinaryHeap::from(pair.patches());
    while let Some(Entry { bound, part }) = queue.pop() {
        best.error = (bound - best.value).max(0.0);
        if best.error <= tolerance * best.value || cells.len() > MOST_CELLS {
            return Ok(best);
        }
        let parts = match part {
            Part::Patch(patch, of) => [Some(pair.cell(patch, of)), None],
            Part::Cell(index, along_u) => cells[index].halves(along_u).map(Some),
        };
        for mut cell in parts.into_iter().flatten() {
            if let Some((bound, along_u)) = pair.examine(&mut cell, &mut best) {
                let part = Part::Cell(cells.len(), along_u);
                cells.push(cell);
                queue.push(Entry { bound, part });
            }
        }
    }
    // Every cell was shown to have its largest distance in another one: only rounding is left.
    best.error = tolerance * best.value;
    Ok(best)
}

/// A part of the surfaces and a bound of the distance on it.
#[derive(Debug, Clone, Copy)]
struct Entry {
    bound: f64,
    part: Part,
}

#[derive(Debug, Clone, Copy)]
enum Part {
    /// A patch of the splines that was not looked at closely yet.
    Patch(usize, Distance),
    /// A cell, and whether to halve it along u.
    Cell(usize, bool),
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Entry {}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound)
    }
}

/// A rectangle on which both radii are polynomials.
#[derive(Debug, Clone, Copy)]
struct Cell {
    /// Which distance is looked at on it.
    of: Distance,
    /// Of both radii and of their difference, which is subdivided by itself: differences of nets
    /// would be rounding.
    nets: [Net; 3],
    /// Half the width of the nets' cell.
    span: DVec2,
    center: DVec2,
    /// The same as `span`, or 0 along u where only the edge at an end of the surfaces is left.
    half: DVec2,
    /// Bounds of the second derivatives uu, uθ, θθ of δ: those of a cell that it is part of.
    bends: [f64; 3],
    depth: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Distance {
    Points,
    Normals,
}

impl Cell {
    /// By de Casteljau's algorithm.
    fn halves(&self, along_u: bool) -> [Self; 2] {
        let mut parts = [*self; 2];
        let shift = if along_u {
            DVec2::new(0.5 * self.half.x, 0.0)
        } else {
            DVec2::new(0.0, 0.5 * self.half.y)
        };
        for (part, sign) in parts.iter_mut().zip([-1.0, 1.0]) {
            part.depth += 1;
            part.center += shift * sign;
            part.half -= shift;
            part.span -= shift;
        }
        for surface in 0..3 {
            for line in 0..4 {
                let at = |k: usize| if along_u { (k, line) } else { (line, k) };
                let mut d: [f64; 4] = std::array::from_fn(|k| {
                    let (row, column) = at(k);
                    self.nets[surface][row][column]
                });
                for level in 0..4 {
                    let (row, column) = at(level);
                    parts[0].nets[surface][row][column] = d[0];
                    let (row, column) = at(3 - level);
                    parts[1].nets[surface][row][column] = d[3 - level];
                    for k in 0..3 - level {
                        d[k] = 0.5 * (d[k] + d[k + 1]);
                    }
                }
            }
        }
        parts
    }
}

/// A bound of |x| and |x'| over a cell, and one of |x − x'|.
#[derive(Debug, Clone, Copy)]
struct Size {
    most: f64,
    change: f64,
}

impl Add for Size {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            most: self.most + other.most,
            change: self.change + other.change,
        }
    }
}

impl Mul for Size {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self {
            most: self.most * other.most,
            change: self.change * other.most + self.most * other.change,
        }
    }
}

impl Mul<f64> for Size {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self {
            most: self.most * factor,
            change: self.change * factor,
        }
    }
}

/// Of a vector, by its two components.
fn long(a: Size, b: Size) -> Size {
    Size {
        most: DVec2::new(a.most, b.most).length(),
        change: DVec2::new(a.change, b.change).length(),
    }
}

struct Pair<'a> {
    surfaces: [&'a Surface; 2],
    heights: [f64; 2],
    /// Of both ends: a − a' and b − b'.
    lifts: [f64; 2],
    /// Both are surfaces of revolution.
    round: bool,
}

/// Sizes on a cell: of 1/f and 1/H, of f's derivatives, and of X.
struct Sizes {
    r: Size,
    inverse_height: Size,
    fu: Size,
    ft: Size,
    x: Size,
    /// A bound of 1/√(1 + ‖X‖²) for all X between those of the two surfaces.
    slow: f64,
}

impl<'a> Pair<'a> {
    fn new(first: &'a Surface, second: &'a Surface) -> Self {
        Self {
            surfaces: [first, second],
            heights: [first, second].map(|s| s.top() - s.bottom()),
            lifts: [first.bottom() - second.bottom(), first.top() - second.top()],
            round: first.of_revolution().is_some() && second.of_revolution().is_some(),
        }
    }

    /// The patches of the splines, without second derivatives: cheap, and enough to put most aside.
    fn patches(&self) -> Vec<Entry> {
        let [first, second] = self.surfaces;
        let (_, columns) = first.shape();
        let pairs = first.coefficients().iter().zip(second.coefficients());
        let difference: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
        let [one, other, apart] = [first.coefficients(), second.coefficients(), &difference]
            .map(|coefficients| ranges_on_patches(coefficients, columns));
        let lift = self.lifts[0].abs().max(self.lifts[1].abs());
        // Surfaces of revolution are the same at every angle.
        let looked_at = if self.round { 1 } else { columns };
        let mut entries = Vec::with_capacity(2 * one.len());
        for patch in (0..one.len()).filter(|patch| patch % columns < looked_at) {
            let sizes = self.sizes([one[patch], other[patch], apart[patch]]);
            entries.push(Entry {
                bound: DVec2::new(apart[patch][0].most(), lift).length(),
                part: Part::Patch(patch, Distance::Points),
            });
            entries.push(Entry {
                bound: (sizes.slow * sizes.x.change)
                    .min(self.rough_bound(one[patch], other[patch])),
                part: Part::Patch(patch, Distance::Normals),
            });
        }
        entries
    }

    /// How far normals are apart: that of two normals, and what others differ from these.
    fn rough_bound(&self, one: [Range; 3], other: [Range; 3]) -> f64 {
        let mut spread = 0.0;
        let [n, m] = [(one, self.heights[0]), (other, self.heights[1])].map(|(ranges, height)| {
            let [f, fu, ft] = ranges;
            let x = [ft.over(f), fu * (1.0 / height)];
            let least = DVec3::new(1.0, x[0].least(), x[1].least());
            spread += DVec2::new(x[0].half(), x[1].half()).length() / least.length();
            DVec3::new(-1.0, x[0].middle(), x[1].middle()).normalize()
        });
        n.distance(m) + spread
    }

    fn cell(&self, patch: usize, of: Distance) -> Cell {
        let (rows, columns) = self.surfaces[0].shape();
        let (i, j) = (patch / columns, patch % columns);
        let [first, second] = self.surfaces.map(|surface| surface.bezier_net(i, j));
        let span = DVec2::new(0.5 / (rows - 3) as f64, 0.5 * TAU / columns as f64);
        Cell {
            of,
            nets: [first, second, difference(&first, &second)],
            bends: [f64::INFINITY; 3],
            depth: 0,
            span,
            center: DVec2::new((2 * i + 1) as f64, (2 * j + 1) as f64) * span,
            half: if self.round {
                DVec2::new(span.x, 0.0)
            } else {
                span
            },
        }
    }

    /// From the ranges of f, f_u and f_θ of both surfaces and of their difference.
    fn sizes(&self, [first, second, difference]: [[Range; 3]; 3]) -> Sizes {
        let size = |k: usize| Size {
            most: first[k].most().max(second[k].most()),
            change: difference[k].most(),
        };
        // How far from 0 all values of both surfaces are.
        let away = |k: usize| {
            let (one, other) = (first[k], second[k]);
            one.low
                .min(other.low)
                .max(-one.high.max(other.high))
                .max(0.0)
        };
        let r = Size {
            most: 1.0 / first[0].low.min(second[0].low),
            change: difference[0].most() / (first[0].low * second[0].low),
        };
        let [one, other] = self.heights;
        let inverse_height = Size {
            most: 1.0 / one.min(other),
            change: (one - other).abs() / (one * other),
        };
        let (fu, ft) = (size(1), size(2));
        let steep = DVec3::new(
            1.0,
            away(2) / first[0].high.max(second[0].high),
            away(1) / one.max(other),
        );
        Sizes {
            r,
            inverse_height,
            fu,
            ft,
            x: long(ft * r, fu * inverse_height),
            slow: steep.length().recip(),
        }
    }

    /// Bounds a cell after trying its centre and the corner that promises most, and says whether to
    /// halve it along u; `None` if the largest distance of all is not in it.
    ///
    /// Where ‖δ‖ is shown to grow all over the cell in one direction, it is largest on the edge: if
    /// that is an end of the surfaces, only the edge is left, else the largest is beyond it.
    fn examine(&self, cell: &mut Cell, best: &mut SurfaceDistance) -> Option<(f64, bool)> {
        // Below that, derivatives of the nets would be rounding.
        let mut most = f64::INFINITY;
        if cell.depth <= DEEPEST && (cell.depth < 4 || cell.depth.is_multiple_of(4)) {
            let ranges = cell.nets.map(|net| ranges_on(&net, cell.span));
            if cell.of == Distance::Normals {
                let [one, other, _] = ranges.map(|r| [r[0][0], r[1][0], r[0][1]]);
                most = self.rough_bound(one, other);
                if most < best.value {
                    return None;
                }
            }
            let tighter = self.bends(cell.of, &ranges);
            cell.bends = std::array::from_fn(|k| cell.bends[k].min(tighter[k]));
        }
        let [uu, ut, tt] = cell.bends;
        let mut model = self.difference(cell.of, cell.center);
        if cell.half.x > 0.0 {
            let DVec2 { x, y } = cell.half;
            let [value, by_u, by_theta] = model;
            let fastest = [
                by_u.length() + uu * x + ut * y,
                by_theta.length() + ut * x + tt * y,
            ];
            let reach = fastest[0] * x + fastest[1] * y;
            let slope = value.dot(by_u);
            if slope.abs() > reach * fastest[0] + value.length() * (uu * x + ut * y) {
                let end = cell.center.x + x * slope.signum();
                if end > 1e-12 && end < 1.0 - 1e-12 {
                    return None;
                }
                cell.center.x = end.round();
                cell.half.x = 0.0;
                model = self.difference(cell.of, cell.center);
            }
        }
        let [value, by_u, by_theta] = model;
        let DVec2 { x, y } = cell.half;
        let fastest = [
            by_u.length() + uu * x + ut * y,
            by_theta.length() + ut * x + tt * y,
        ];
        let reach = fastest[0] * x + fastest[1] * y;
        if value.dot(by_theta).abs() > reach * fastest[1] + value.length() * (ut * x + tt * y) {
            return None;
        }
        let (along_u, along_theta) = (by_u * x, by_theta * y);
        let (mut longest, mut corner) = (0.0, DVec2::ZERO);
        for sign in [
            DVec2::ONE,
            DVec2::NEG_ONE,
            DVec2::new(1.0, -1.0),
            DVec2::new(-1.0, 1.0),
        ] {
            let length = (value + along_u * sign.x + along_theta * sign.y).length();
            if length > longest {
                (longest, corner) = (length, cell.center + sign * cell.half);
            }
        }
        best.improve(value.length(), cell.center);
        if longest > best.value {
            best.improve(self.difference(cell.of, corner)[0].length(), corner);
        }
        let bound = longest + 0.5 * (uu * x * x + 2.0 * ut * x * y + tt * y * y);
        // What halving the cell in a direction would take off, roughly.
        let gain_u = along_u.length() + uu * x * x + ut * x * y;
        let gain_theta = along_theta.length() + tt * y * y + ut * x * y;
        Some((bound.min(most), x > 0.0 && gain_u >= gain_theta))
    }

    /// Bounds of the second derivatives uu, uθ, θθ of δ over a cell.
    fn bends(&self, of: Distance, ranges: &[Ranges; 3]) -> [f64; 3] {
        if of == Distance::Points {
            return [(2, 0), (1, 1), (0, 2)].map(|(a, b)| ranges[2][a][b].most());
        }
        let Sizes {
            r,
            inverse_height: h,
            fu,
            ft,
            x,
            slow,
        } = self.sizes(ranges.map(|r| [r[0][0], r[1][0], r[0][1]]));
        let [first, second, difference] = ranges;
        let size = |a: usize, b: usize| Size {
            most: first[a][b].most().max(second[a][b].most()),
            change: difference[a][b].most(),
        };
        let (fuu, fut, ftt) = (size(2, 0), size(1, 1), size(0, 2));
        let (fuuu, fuut, futt, fttt) = (size(3, 0), size(2, 1), size(1, 2), size(0, 3));
        let (r2, r3) = (r * r, r * r * r);
        // Derivatives of ln f by θ and once or twice more, and of f_u/H.
        let xu = long(fut * r + fu * ft * r2, fuu * h);
        let xt = long(ftt * r + ft * ft * r2, fut * h);
        let xuu = long(
            fuut * r + (fuu * ft + fut * fu * 2.0) * r2 + fu * fu * ft * r3 * 2.0,
            fuuu * h,
        );
        let xut = long(
            futt * r + (ftt * fu + fut * ft * 2.0) * r2 + fu * ft * ft * r3 * 2.0,
            fuut * h,
        );
        let xtt = long(
            fttt * r + ftt * ft * r2 * 3.0 + ft * ft * ft * r3 * 2.0,
            futt * h,
        );
        // δ_ab = Dφ(X) X_ab + D²φ(X)[X_a, X_b] less the same of the other surface.
        let second = |ab: Size, a: Size, b: Size| {
            let slow2 = 1.16 * slow * slow;
            slow * ab.change
                + slow2 * (x.change * ab.most + a.change * b.most + a.most * b.change)
                + 3.0 * slow * slow * slow * x.change * a.most * b.most
        };
        let together = [
            second(xuu, xu, xu),
            second(xut, xu, xt),
            second(xtt, xt, xt),
        ];
        // Far apart, the sum of what each normal may do is less.
        let [one, other] = [0, 1].map(|k| normal_bends(&ranges[k], self.heights[k]));
        std::array::from_fn(|k| together[k].min(one[k] + other[k]))
    }

    /// δ_c or δ_n with its derivatives by u and θ, in the frame that turns with θ.
    fn difference(&self, of: Distance, at: DVec2) -> [DVec3; 3] {
        let [a, b] = self.surfaces.map(|surface| surface.radius(at.x, at.y));
        if of == Distance::Points {
            let lift = (1.0 - at.x) * self.lifts[0] + at.x * self.lifts[1];
            return [
                DVec3::new(a.value - b.value, 0.0, lift),
                DVec3::new(a.slope[0] - b.slope[0], 0.0, self.lifts[1] - self.lifts[0]),
                DVec3::new(a.slope[1] - b.slope[1], 0.0, 0.0),
            ];
        }
        let [n, m] = [normal(&a, self.heights[0]), normal(&b, self.heights[1])];
        std::array::from_fn(|i| n[i] - m[i])
    }
}

/// Bounds of n_uu, n_uθ, n_θθ of one surface of height `h` over a cell.
///
/// With M = (−H f, H f_θ, f f_u) and W_a = M × M_a, n_a = W_a × M/‖M‖³ and
/// ‖n_ab‖ ≤ ‖∂_b W_a‖/‖M‖² + 4 ‖W_a‖ ‖M_b‖/‖M‖³. In the W's what only lengthens M cancels.
fn normal_bends(ranges: &Ranges, h: f64) -> [f64; 3] {
    let most = |a: usize, b: usize| ranges[a][b].most();
    let away = |a: usize, b: usize| ranges[a][b].least();
    let (f, fu, ft) = (most(0, 0), most(1, 0), most(0, 1));
    let (fuu, fut, ftt) = (most(2, 0), most(1, 1), most(0, 2));
    let (fuuu, fuut, futt, fttt) = (most(3, 0), most(2, 1), most(1, 2), most(0, 3));
    let long = |x: f64, y: f64, z: f64| DVec3::new(x, y, z).length();
    let least = away(0, 0);
    let m = long(h * least, h * away(0, 1), least * away(1, 0));
    let mu = long(h * fu, h * fut, fu * fu + f * fuu);
    let mt = long(h * ft, h * ftt, ft * fu + f * fut);
    let wu = long(
        h * (ft * (fu * fu + f * fuu) + f * fu * fut),
        h * f * f * fuu,
        h * h * (ft * fu + f * fut),
    );
    let wt = long(
        h * (ft * (ft * fu + f * fut) + f * fu * ftt),
        h * f * f * fut,
        h * h * (f * ftt + ft * ft),
    );
    let wuu = long(
        h * (ft * (3.0 * fu * fuu + f * fuuu) + f * fu * fuut),
        h * f * (2.0 * fu * fuu + f * fuuu),
        h * h * (ft * fuu + f * fuut),
    );
    let wut = long(
        h * (ftt * (fu * fu + f * fuu)
            + ft * (fu * fut + ft * fuu + f * fuut)
            + f * (fut * fut + fu * futt)),
        h * f * (2.0 * ft * fuu + f * fuut),
        h * h * (ftt * fu + f * futt),
    );
    let wtt = long(
        h * (ft * (ftt * fu + 2.0 * ft * fut + f * futt) + f * fu * fttt),
        h * f * (2.0 * ft * fut + f * futt),
        h * h * (ft * ftt + f * fttt),
    );
    let bound = |w2: f64, w: f64, mb: f64| w2 / (m * m) + 4.0 * w * mb / (m * m * m);
    [bound(wuu, wu, mu), bound(wut, wu, mt), bound(wtt, wt, mt)]
}

fn difference(first: &Net, second: &Net) -> Net {
    std::array::from_fn(|i| std::array::from_fn(|j| first[i][j] - second[i][j]))
}

/// φ(X) and its derivatives by u and θ.
fn normal(radius: &Radius, height: f64) -> [DVec3; 3] {
    let Radius {
        value: f,
        slope: [fu, ft],
        bend: [fuu, fut, ftt],
    } = *radius;
    let cross = DVec3::new(-1.0, ft / f, fu / height);
    let length = cross.length();
    let normal = cross / length;
    let along = |p: f64, q: f64| {
        let d = DVec3::new(0.0, p, q);
        (d - normal * normal.dot(d)) / length
    };
    [
        normal,
        along(fut / f - fu * ft / (f * f), fuu / height),
        along(ftt / f - ft * ft / (f * f), fut / height),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface(height: f64, seed: u64, rows: usize, columns: usize) -> Surface {
        let mut state = seed;
        let coefficients = (0..rows * columns)
            .map(|_| {
                state = state
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                0.5 + 0.3 * (state >> 11) as f64 / (1u64 << 53) as f64
            })
            .collect();
        Surface::new(-height, height, columns, coefficients).unwrap()
    }

    #[test]
    fn no_point_of_a_fine_grid_is_further_apart_and_some_is_as_far() {
        for seed in 1..12 {
            let (first, second) = (surface(0.6, seed, 7, 8), surface(0.7, seed + 50, 5, 4));
            let found = surface_distance(&first, &second, 1e-6).unwrap();
            assert!(found.error <= 1e-6 * found.value);
            let apart = |u: f64, theta: f64| {
                let (p, q) = (first.contact(u, theta), second.contact(u, theta));
                p.point.distance(q.point).max(p.normal.distance(q.normal))
            };
            let [u, theta] = found.at;
            assert!((apart(u, theta) - found.value).abs() < 1e-12);
            let mut largest = 0.0_f64;
            for i in 0..=400 {
                for j in 0..800 {
                    largest = largest.max(apart(i as f64 / 400.0, TAU * j as f64 / 800.0));
                }
            }
            assert!(largest <= found.value + found.error, "{largest} {found:?}");
            assert!(largest > 0.999 * found.value);
        }
    }

    #[test]
    fn small_differences_are_found_as_exactly() {
        let first = surface(0.6, 3, 9, 8);
        for size in [1e-3, 1e-9] {
            let moved = first.coefficients().iter().enumerate();
            let moved = moved
                .map(|(k, c)| c + size * crate::math::sin(k as f64))
                .collect();
            let second = Surface::new(-0.6, 0.6, 8, moved).unwrap();
            let found = surface_distance(&first, &second, 1e-6).unwrap();
            assert!(found.value > 0.1 * size && found.value < 100.0 * size);
            assert!(found.error <= 1e-6 * found.value);
        }
        assert_eq!(surface_distance(&first, &first, 1e-6).unwrap().value, 0.0);
    }
}
