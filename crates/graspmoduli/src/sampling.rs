//! Points distributed uniformly by area (Arvo's method, reference 2 of the paper).

use crate::parallel::*;
use crate::surface::{Surface, simpson};
use std::f64::consts::TAU;

/// Bisection steps per inverted coordinate, as in the paper (IV.B).
const BISECTIONS: usize = 30;

/// The integral of a density known at an odd number of equally spaced points of [0, 1],
/// by the parabolas of Simpson's rule.
struct Cumulative {
    values: Vec<f64>,
    /// Integral up to every second point.
    sums: Vec<f64>,
}

impl Cumulative {
    fn new(values: Vec<f64>) -> Self {
        let mut sums = vec![0.0];
        for panel in values.windows(3).step_by(2) {
            sums.push(sums[sums.len() - 1] + (panel[0] + 4.0 * panel[1] + panel[2]) / 6.0);
        }
        Self { values, sums }
    }

    /// The point up to which the share `target` of the whole integral lies.
    fn invert(&self, target: f64) -> f64 {
        let panels = self.sums.len() - 1;
        let target = target * self.sums[panels];
        let panel = self.sums.partition_point(|&s| s <= target).clamp(1, panels) - 1;
        let [a, b, c] = [0, 1, 2].map(|i| self.values[2 * panel + i]);
        // The parabola through the three values at 0, ½, 1, integrated from 0 to s.
        let (linear, square) = (-3.0 * a + 4.0 * b - c, 2.0 * a - 4.0 * b + 2.0 * c);
        let integral = |s: f64| s * (a + s * (linear / 2.0 + s * square / 3.0));
        let rest = target - self.sums[panel];
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if integral(middle) < rest {
                low = middle;
            } else {
                high = middle;
            }
        }
        (panel as f64 + 0.5 * (low + high)) / panels as f64
    }
}

/// Maps points of the unit square to (u, θ) so that equal areas go to equal areas, to the accuracy
/// of Simpson's rule with two steps per spline interval: u from the marginal distribution of the
/// area density ‖t₁ × t₂‖, θ from the conditional one.
pub fn by_area(surface: &Surface, square: &[[f64; 2]]) -> Vec<[f64; 2]> {
    // At least the paper's 60 steps, and two per spline interval.
    let (rows, columns) = surface.shape();
    let u_steps = (2 * rows).max(60).next_multiple_of(2);
    let theta_steps = (2 * columns).max(60).next_multiple_of(2);
    let angles = surface.angles(theta_steps + 1);
    let marginal = (0..=u_steps)
        .map(|i| {
            let densities = surface.densities(i as f64 / u_steps as f64, &angles);
            densities
                .iter()
                .zip(simpson(theta_steps))
                .map(|(d, w)| d * w)
                .sum()
        })
        .collect();
    let marginal = Cumulative::new(marginal);
    square
        .par_iter()
        .with_min_len(16)
        .map(|&[first, second]| {
            let u = marginal.invert(first);
            let conditional = Cumulative::new(surface.densities(u, &angles));
            [u, TAU * conditional.invert(second)]
        })
        .collect()
}
