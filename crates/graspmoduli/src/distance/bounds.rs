//! How far normals can be apart on a cell, and how fast δ can bend there, from ranges of derivatives.
//!
//! In the frame that turns with θ, n = φ(X) with X = (∂_θ ln f, f_u/H), H the height of the surface,
//! and φ(X) = (−1, X)/√(1 + ‖X‖²). Along a line in X, with s = 1/√(1 + ‖X‖²), φ turns in a plane, by at
//! most s per unit of X; its second derivative is at most 1.16 s², its third 3 s³, and so are the
//! multilinear forms.

use super::cell::Distance;
use super::net::{Range, Ranges};
use super::size::{Size, length};
use glam::{DVec2, DVec3};

/// For the rounding of sums and products of positive numbers: far more than it can be.
const ROUNDING: f64 = 1.0 + 1e-12;

/// No two unit vectors are further apart.
pub const FURTHEST: f64 = 2.0;

/// Sizes on a cell: of 1/f and 1/H, of f's derivatives, and of X.
struct Sizes {
    inverse_radius: Size,
    inverse_height: Size,
    fu: Size,
    ft: Size,
    x: Size,
    /// Of the cross product of X − X' and any vector between X and X'.
    across: f64,
    /// A bound of s for all X between those of the two surfaces.
    turning: f64,
}

/// From the ranges of f, f_u and f_θ of both surfaces and of their difference.
fn sizes([first, second, difference]: [[Range; 3]; 3], heights: [f64; 2]) -> Sizes {
    let size = |k: usize| Size {
        largest: first[k].largest().max(second[k].largest()),
        change: difference[k].largest(),
    };
    // How far from 0 all values of both surfaces are, on the same side.
    let away = |k: usize| {
        let (one, other) = (first[k], second[k]);
        one.low
            .min(other.low)
            .max(-one.high.max(other.high))
            .max(0.0)
    };
    let inverse_radius = Size {
        largest: 1.0 / first[0].low.min(second[0].low),
        change: difference[0].largest() / (first[0].low * second[0].low),
    };
    let [one, other] = heights;
    let inverse_height = Size {
        largest: 1.0 / one.min(other),
        change: (one - other).abs() / (one * other),
    };
    let (fu, ft) = (size(1), size(2));
    let (by_theta, by_u) = (ft * inverse_radius, fu * inverse_height);
    let steep = DVec3::new(
        1.0,
        away(2) / first[0].high.max(second[0].high),
        away(1) / one.max(other),
    );
    Sizes {
        inverse_radius,
        inverse_height,
        fu,
        ft,
        x: length(by_theta, by_u),
        across: by_theta.largest * by_u.change + by_u.largest * by_theta.change,
        turning: steep.length().recip(),
    }
}

/// A bound of the distance of normals on a patch, and one of s. The same ranges as for `sizes`.
pub fn normals_apart(ranges: [[Range; 3]; 3], heights: [f64; 2]) -> (f64, f64) {
    let Sizes {
        x, across, turning, ..
    } = sizes(ranges, heights);
    // ‖Dφ(X) v‖ = s² √(‖v‖² + (X × v)²), which is at most s ‖v‖. Where surfaces are steep, v is nearly
    // along X, and the first is far less.
    let along = turning * turning * DVec2::new(x.change, across).length();
    let near = along.min(turning * x.change) * ROUNDING;
    let bound = near.min(rough_bound(ranges[0], ranges[1], heights));
    (bound, turning)
}

/// How far normals are apart: how far those of two values of X are, and how far all others are from
/// these.
fn rough_bound(one: [Range; 3], other: [Range; 3], heights: [f64; 2]) -> f64 {
    let mut spread = 0.0;
    let [n, m] = [(one, heights[0]), (other, heights[1])].map(|(ranges, height)| {
        let [f, fu, ft] = ranges;
        let x = [ft.over(f), fu * (1.0 / height)];
        let least = DVec3::new(1.0, x[0].smallest(), x[1].smallest());
        spread += DVec2::new(x[0].half(), x[1].half()).length() / least.length();
        DVec3::new(-1.0, x[0].middle(), x[1].middle()).normalize()
    });
    // That of the two values of X is rounded by some units, whatever their size.
    ((n.distance(m) + spread) * ROUNDING + 16.0 * f64::EPSILON).min(FURTHEST)
}

/// Bounds of the second derivatives uu, uθ, θθ of δ over a cell.
pub fn bends(of: Distance, ranges: &[Ranges; 3], heights: [f64; 2]) -> [f64; 3] {
    if of == Distance::Points {
        return [(2, 0), (1, 1), (0, 2)].map(|(a, b)| ranges[2][a][b].largest());
    }
    let Sizes {
        inverse_radius: r,
        inverse_height: h,
        fu,
        ft,
        x,
        turning,
        ..
    } = sizes(ranges.map(|r| [r[0][0], r[1][0], r[0][1]]), heights);
    let [first, second, difference] = ranges;
    let size = |a: usize, b: usize| Size {
        largest: first[a][b].largest().max(second[a][b].largest()),
        change: difference[a][b].largest(),
    };
    let (fuu, fut, ftt) = (size(2, 0), size(1, 1), size(0, 2));
    let (fuuu, fuut, futt, fttt) = (size(3, 0), size(2, 1), size(1, 2), size(0, 3));
    let (r2, r3) = (r * r, r * r * r);
    // Derivatives of ln f by θ and once or twice more, and of f_u/H.
    let xu = length(fut * r + fu * ft * r2, fuu * h);
    let xt = length(ftt * r + ft * ft * r2, fut * h);
    let xuu = length(
        fuut * r + (fuu * ft + fut * fu * 2.0) * r2 + fu * fu * ft * r3 * 2.0,
        fuuu * h,
    );
    let xut = length(
        futt * r + (ftt * fu + fut * ft * 2.0) * r2 + fu * ft * ft * r3 * 2.0,
        fuut * h,
    );
    let xtt = length(
        fttt * r + ftt * ft * r2 * 3.0 + ft * ft * ft * r3 * 2.0,
        futt * h,
    );
    // δ_ab = Dφ(X) X_ab + D²φ(X)[X_a, X_b] less the same of the other surface.
    let near = |ab: Size, a: Size, b: Size| {
        turning * ab.change
            + 1.16
                * turning
                * turning
                * (x.change * ab.largest + a.change * b.largest + a.largest * b.change)
            + 3.0 * turning * turning * turning * x.change * a.largest * b.largest
    };
    let near = [near(xuu, xu, xu), near(xut, xu, xt), near(xtt, xt, xt)];
    // Far apart, the sum of what each normal may do is less.
    let [one, other] = [0, 1].map(|k| normal_bends(&ranges[k], heights[k]));
    std::array::from_fn(|k| near[k].min(one[k] + other[k]) * ROUNDING)
}

/// Bounds of n_uu, n_uθ, n_θθ of one surface of height `h` over a cell.
///
/// With M = (−H f, H f_θ, f f_u) and W_a = M × M_a, n_a = W_a × M/‖M‖³ and
/// ‖n_ab‖ ≤ ‖∂_b W_a‖/‖M‖² + 4 ‖W_a‖ ‖M_b‖/‖M‖³. In the W's what only lengthens M cancels.
fn normal_bends(ranges: &Ranges, h: f64) -> [f64; 3] {
    let largest = |a: usize, b: usize| ranges[a][b].largest();
    let smallest = |a: usize, b: usize| ranges[a][b].smallest();
    let (f, fu, ft) = (largest(0, 0), largest(1, 0), largest(0, 1));
    let (fuu, fut, ftt) = (largest(2, 0), largest(1, 1), largest(0, 2));
    let (fuuu, fuut, futt, fttt) = (largest(3, 0), largest(2, 1), largest(1, 2), largest(0, 3));
    let norm = |x: f64, y: f64, z: f64| DVec3::new(x, y, z).length();
    let least = smallest(0, 0);
    let m = norm(h * least, h * smallest(0, 1), least * smallest(1, 0));
    let mu = norm(h * fu, h * fut, fu * fu + f * fuu);
    let mt = norm(h * ft, h * ftt, ft * fu + f * fut);
    let wu = norm(
        h * (ft * (fu * fu + f * fuu) + f * fu * fut),
        h * f * f * fuu,
        h * h * (ft * fu + f * fut),
    );
    let wt = norm(
        h * (ft * (ft * fu + f * fut) + f * fu * ftt),
        h * f * f * fut,
        h * h * (f * ftt + ft * ft),
    );
    let wuu = norm(
        h * (ft * (3.0 * fu * fuu + f * fuuu) + f * fu * fuut),
        h * f * (2.0 * fu * fuu + f * fuuu),
        h * h * (ft * fuu + f * fuut),
    );
    let wut = norm(
        h * (ftt * (fu * fu + f * fuu)
            + ft * (fu * fut + ft * fuu + f * fuut)
            + f * (fut * fut + fu * futt)),
        h * f * (2.0 * ft * fuu + f * fuut),
        h * h * (ftt * fu + f * futt),
    );
    let wtt = norm(
        h * (ft * (ftt * fu + 2.0 * ft * fut + f * futt) + f * fu * fttt),
        h * f * (2.0 * ft * fut + f * futt),
        h * h * (ft * ftt + f * fttt),
    );
    let bound = |w2: f64, w: f64, mb: f64| w2 / (m * m) + 4.0 * w * mb / (m * m * m);
    [bound(wuu, wu, mu), bound(wut, wu, mt), bound(wtt, wt, mt)]
}
