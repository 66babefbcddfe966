//! The convex cone of surfaces (Lemma III.1): sums, which are exact on a common refinement of the
//! splines' grids.

use super::Surface;
use crate::error::Error;
use std::sync::OnceLock;

/// Most spline intervals per direction, and most coefficients, of a common refinement: a surface
/// of that many takes 16 MB.
const MOST_INTERVALS: usize = 8192;
const MOST_COEFFICIENTS: usize = 1 << 21;

/// How far a refined coefficient is from the exact one, relative to the largest coefficient: by
/// nine rounded steps in each direction.
const REFINED: f64 = 128.0 * f64::EPSILON;

impl Surface {
    /// Σ weight·S in the convex cone of surfaces (Lemma III.1): exact to rounding, on the
    /// coefficients, once all are written on a common refinement of their grids; an error where that
    /// is too large. Weights are positive.
    pub fn combine(terms: &[(f64, &Surface)]) -> Result<Self, Error> {
        let (intervals, columns) = common_grid(terms.iter().map(|&(_, surface)| surface))?;
        let mut sum = vec![0.0; (intervals + 3) * columns];
        let (mut bottom, mut top) = (0.0, 0.0);
        for &(weight, surface) in terms {
            if !(weight.is_finite() && weight > 0.0) {
                return Err(Error::Weight { got: weight });
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

    /// By how much the coefficients of `self.on_common_grid(other)` may be off.
    pub(crate) fn refinement_error(&self, refined: &Self) -> f64 {
        if self.shape() == refined.shape() {
            0.0
        } else {
            REFINED * self.largest_coefficient()
        }
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
    let coefficients = (intervals.saturating_add(3)).saturating_mul(columns);
    if intervals > MOST_INTERVALS || columns > MOST_INTERVALS || coefficients > MOST_COEFFICIENTS {
        return Err(Error::GridTooLarge {
            rows: intervals,
            columns,
        });
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
