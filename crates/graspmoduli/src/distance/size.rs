//! Bounds that keep apart how large two numbers are and how different.

use glam::DVec2;
use std::ops::{Add, Mul};

/// Bounds over a cell for a quantity x of one surface and x' of the other.
#[derive(Debug, Clone, Copy)]
pub struct Size {
    /// Of |x| and |x'|.
    pub largest: f64,
    /// Of |x − x'|.
    pub change: f64,
}

impl Add for Size {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            largest: self.largest + other.largest,
            change: self.change + other.change,
        }
    }
}

/// xy − x'y' = (x − x') y + x' (y − y').
impl Mul for Size {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self {
            largest: self.largest * other.largest,
            change: self.change * other.largest + self.largest * other.change,
        }
    }
}

impl Mul<f64> for Size {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self {
            largest: self.largest * factor,
            change: self.change * factor,
        }
    }
}

/// Of a vector, from its two components.
pub fn length(a: Size, b: Size) -> Size {
    Size {
        largest: DVec2::new(a.largest, b.largest).length(),
        change: DVec2::new(a.change, b.change).length(),
    }
}
