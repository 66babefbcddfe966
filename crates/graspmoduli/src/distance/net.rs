//! Ranges of a bicubic function's derivatives, from control points.

use glam::DVec2;
use std::f64::consts::TAU;
use std::ops::Mul;

/// Bézier control points of a bicubic function on a cell: rows along u.
pub type Net = [[f64; 4]; 4];

/// All values lie in [`low`, `high`].
#[derive(Debug, Clone, Copy)]
pub struct Range {
    pub low: f64,
    pub high: f64,
}

impl Range {
    const EMPTY: Self = Self {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
    };

    fn with(self, x: f64) -> Self {
        Self {
            low: if x < self.low { x } else { self.low },
            high: if x > self.high { x } else { self.high },
        }
    }

    fn and(self, other: Self) -> Self {
        self.with(other.low).with(other.high)
    }

    pub fn middle(self) -> f64 {
        0.5 * (self.low + self.high)
    }

    /// Half the width.
    pub fn half(self) -> f64 {
        0.5 * (self.high - self.low)
    }

    /// Of quotients by positive numbers.
    pub fn over(self, divisor: Self) -> Self {
        let by = |x: f64| [x / divisor.low, x / divisor.high];
        let ([a, b], [c, d]) = (by(self.low), by(self.high));
        Self {
            low: a.min(b),
            high: c.max(d),
        }
    }

    /// The largest |x|.
    pub fn most(self) -> f64 {
        self.high.max(-self.low)
    }

    /// The smallest |x|.
    pub fn least(self) -> f64 {
        self.low.max(-self.high).max(0.0)
    }
}

/// By a positive number.
impl Mul<f64> for Range {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self {
            low: self.low * factor,
            high: self.high * factor,
        }
    }
}

/// Of ∂^{a+b}f/∂u^a∂θ^b, a + b ≤ 3, by [a][b]. The others are empty.
pub type Ranges = [[Range; 4]; 4];

/// On a cell of half the width `span`.
pub fn ranges_on(net: &Net, span: DVec2) -> Ranges {
    let mut out = [[Range::EMPTY; 4]; 4];
    derivatives::<4>(net, span, &mut out[0]);
    let along_u = derivative_along_u::<4>(net, span);
    derivatives::<3>(&along_u, span, &mut out[1]);
    let along_u = derivative_along_u::<3>(&along_u, span);
    derivatives::<2>(&along_u, span, &mut out[2]);
    let along_u = derivative_along_u::<2>(&along_u, span);
    derivatives::<1>(&along_u, span, &mut out[3]);
    out
}

/// From `ROWS` rows to one less.
#[inline(always)]
fn derivative_along_u<const ROWS: usize>(net: &Net, span: DVec2) -> Net {
    let factor = (ROWS - 1) as f64 / (2.0 * span.x);
    let mut out = *net;
    for i in 0..ROWS - 1 {
        for j in 0..4 {
            out[i][j] = factor * (net[i + 1][j] - net[i][j]);
        }
    }
    out
}

/// Ranges of `ROWS` rows and their first `ROWS` − 1 derivatives along θ.
#[inline(always)]
fn derivatives<const ROWS: usize>(net: &Net, span: DVec2, out: &mut [Range; 4]) {
    let mut d = *net;
    for (b, out) in out[..ROWS].iter_mut().enumerate() {
        if b > 0 {
            let factor = (4 - b) as f64 / (2.0 * span.y);
            for row in &mut d[..ROWS] {
                for j in 0..4 - b {
                    row[j] = factor * (row[j + 1] - row[j]);
                }
            }
        }
        for row in &d[..ROWS] {
            *out = row[..4 - b].iter().fold(*out, |range, &x| range.with(x));
        }
    }
}

/// Of f, f_u and f_θ on every patch, from the coefficients of the B-splines: wider than those of the
/// Bézier nets, and much cheaper. Patch after patch, those of an interval in u together.
pub fn ranges_on_patches(coefficients: &[f64], columns: usize) -> Vec<[Range; 3]> {
    let rows = coefficients.len() / columns;
    let intervals = rows - 3;
    let row = |i: usize| &coefficients[i * columns..][..columns];
    let values = windows(rows, columns, [4, 4], |i, out| out.copy_from_slice(row(i)));
    let slopes = windows(rows - 1, columns, [3, 4], |i, out| {
        // The derivative's coefficient over the knots i + 1 to i + 4, clamped at both ends.
        let knots = (i + 1).min(intervals) - i.saturating_sub(2);
        let factor = 3.0 * intervals as f64 / knots as f64;
        for (out, (a, b)) in out.iter_mut().zip(row(i).iter().zip(row(i + 1))) {
            *out = factor * (b - a);
        }
    });
    let turns = windows(rows, columns, [4, 3], |i, out| {
        let row = row(i);
        for (j, out) in out.iter_mut().enumerate() {
            *out = columns as f64 / TAU * (row[(j + 1) % columns] - row[j]);
        }
    });
    values
        .into_iter()
        .zip(slopes.into_iter().zip(turns))
        .map(|(value, (slope, turn))| [value, slope, turn])
        .collect()
}

/// Ranges over all windows of `size` rows and columns of a table; columns wrap around.
fn windows(
    rows: usize,
    columns: usize,
    [height, width]: [usize; 2],
    row: impl Fn(usize, &mut [f64]),
) -> Vec<Range> {
    let mut lines = vec![Range::EMPTY; rows * columns];
    let mut values = vec![0.0; columns + width - 1];
    for (i, line) in lines.chunks_exact_mut(columns).enumerate() {
        row(i, &mut values[..columns]);
        values.copy_within(..width - 1, columns);
        for (range, window) in line.iter_mut().zip(values.windows(width)) {
            *range = window.iter().fold(Range::EMPTY, |range, &x| range.with(x));
        }
    }
    (0..(rows + 1 - height) * columns)
        .map(|k| (1..height).fold(lines[k], |range, i| range.and(lines[k + i * columns])))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Surface;

    #[test]
    fn derivatives_stay_within_their_ranges() {
        let (rows, columns) = (7, 5);
        let coefficients =
            (0..rows * columns).map(|k| 1.0 + 0.5 * crate::math::sin(1.7 * k as f64));
        let surface = Surface::new(0.0, 1.0, columns, coefficients.collect()).unwrap();
        let wide = ranges_on_patches(surface.coefficients(), columns);
        let span = DVec2::new(0.5 / (rows - 3) as f64, 0.5 * TAU / columns as f64);
        assert_eq!(wide.len(), (rows - 3) * columns);
        for (patch, wide) in wide.iter().enumerate() {
            let (i, j) = (patch / columns, patch % columns);
            let close = ranges_on(&surface.bezier_net(i, j), span);
            let close_low = [close[0][0], close[1][0], close[0][1]];
            for k in 0..64 {
                let (s, t) = ((k / 8) as f64 / 7.0, (k % 8) as f64 / 7.0);
                let at = DVec2::new(i as f64 + s * 0.999999, j as f64 + t * 0.999999) * span * 2.0;
                let r = surface.radius(at.x, at.y);
                let low = [r.value, r.slope[0], r.slope[1]];
                for ((x, wide), close) in low.into_iter().zip(wide).zip(close_low) {
                    assert!(wide.low - 1e-12 <= close.low && close.high <= wide.high + 1e-12);
                    assert!(close.low - 1e-12 <= x && x <= close.high + 1e-12);
                }
                for (x, range) in r
                    .bend
                    .into_iter()
                    .zip([close[2][0], close[1][1], close[0][2]])
                {
                    assert!(range.low - 1e-9 <= x && x <= range.high + 1e-9);
                }
            }
        }
    }
}
