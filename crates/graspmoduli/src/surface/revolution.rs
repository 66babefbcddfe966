//! Surfaces of revolution, and the projection to them (Sec. IV.E).

use super::Surface;
use crate::spline::Basis;
use std::sync::OnceLock;

impl Surface {
    /// Is it a surface of revolution, to rounding?
    pub fn is_revolution(&self) -> bool {
        self.as_revolution().is_some()
    }

    /// The surface on the smallest periodic grid, if to rounding it is one of revolution, and by how
    /// much its coefficients differ from that.
    pub(crate) fn as_revolution(&self) -> Option<(Self, f64)> {
        let projected = self.project();
        let means = projected.coefficients.chunks_exact(projected.columns);
        let rows = self.coefficients.chunks_exact(self.columns);
        let deviation = rows
            .zip(means)
            .flat_map(|(row, mean)| row.iter().map(|c| (c - mean[0]).abs()))
            .fold(0.0, f64::max);
        (deviation <= 1e-14 * self.largest_coefficient()).then_some((projected, deviation))
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

    /// The mean of each row; where all of it is the same number, that.
    fn row_means(&self) -> Vec<f64> {
        self.coefficients
            .chunks_exact(self.columns)
            .map(|row| row[0] + row.iter().map(|c| c - row[0]).sum::<f64>() / row.len() as f64)
            .collect()
    }
}
