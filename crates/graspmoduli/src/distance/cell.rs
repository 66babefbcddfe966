//! Rectangles of (u, θ) on which both radii are polynomials.

use super::net::Net;
use glam::DVec2;

/// Which of the two distances, of points or of normals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Distance {
    Points,
    Normals,
}

#[derive(Debug, Clone, Copy)]
pub struct Cell {
    /// The distance that is bounded on it.
    pub of: Distance,
    /// Of both radii and of their difference, which is subdivided by itself: differences of nets
    /// would be rounding.
    pub nets: [Net; 3],
    /// How far the nets' points are from the exact ones.
    pub net_errors: [f64; 3],
    /// The smallest coefficients of both radii about the patch: they are no smaller.
    pub lowest: [f64; 2],
    /// Half the width of the nets' cell.
    pub span: DVec2,
    pub center: DVec2,
    /// The same as `span`, or 0 along u where only the edge at an end of the surfaces is left, and
    /// along θ where both surfaces are of revolution.
    pub half: DVec2,
    /// Bounds of the second derivatives uu, uθ, θθ of δ on the cell or on one that it is part of.
    pub bends: [f64; 3],
    /// Second derivatives bound δ no better than the ranges of the first ones.
    pub is_rough: bool,
    /// How often its patch was halved.
    pub depth: u32,
    /// How far the value and the derivatives of δ by u and θ at a point may be from the exact ones.
    pub noise: Noise,
}

#[derive(Debug, Clone, Copy)]
pub struct Noise {
    pub value: f64,
    pub slope: DVec2,
}

impl Cell {
    /// Both halves, by de Casteljau's algorithm.
    pub fn halves(&self, along_u: bool) -> [Self; 2] {
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
