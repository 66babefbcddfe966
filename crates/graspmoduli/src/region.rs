//! Where on a surface contacts may lie.

use crate::math;
use std::f64::consts::TAU;

/// Where contacts may lie.
pub trait Region: Sync {
    /// Is a contact at (u, θ) allowed?
    fn allows(&self, u: f64, theta: f64) -> bool;

    /// The nearest allowed contact, if any; a unit of u and one of θ are as long as given.
    fn nearest(&self, at: [f64; 2], lengths: [f64; 2]) -> Option<[f64; 2]>;

    /// How far an allowed contact may move along u and along θ by itself, at most a turn: backward
    /// and forward, neither negative.
    fn room(&self, at: [f64; 2]) -> [[f64; 2]; 2];
}

/// Every contact is allowed.
#[derive(Debug, Clone, Copy)]
pub struct Anywhere;

impl Region for Anywhere {
    fn allows(&self, _: f64, _: f64) -> bool {
        true
    }

    fn nearest(&self, at: [f64; 2], _: [f64; 2]) -> Option<[f64; 2]> {
        Some(at)
    }

    fn room(&self, [u, _]: [f64; 2]) -> [[f64; 2]; 2] {
        [[u, 1.0 - u], [TAU, TAU]]
    }
}

/// Contacts are allowed in some cells of a grid: row-major, rows over u, columns over θ. A grid
/// without cells allows none.
#[derive(Debug, Clone, Copy)]
pub struct Cells<'a> {
    /// Whether each cell is allowed.
    pub allowed: &'a [bool],
    /// Cells per row.
    pub columns: usize,
}

impl Cells<'_> {
    fn rows(&self) -> usize {
        self.allowed.len().checked_div(self.columns).unwrap_or(0)
    }

    /// Row and column of the cell that holds (u, θ), of a grid that has cells.
    fn cell(&self, u: f64, theta: f64) -> [usize; 2] {
        let cell = |share: f64, count: usize| ((share * count as f64) as usize).min(count - 1);
        [
            cell(u, self.rows()),
            cell(theta.rem_euclid(TAU) / TAU, self.columns),
        ]
    }
}

/// Contacts stop this share of a cell before its edge, which belongs to the next.
const BEFORE_THE_EDGE: f64 = 1e-9;

impl Region for Cells<'_> {
    fn allows(&self, u: f64, theta: f64) -> bool {
        if self.rows() == 0 {
            return false;
        }
        let [row, column] = self.cell(u, theta);
        self.allowed[row * self.columns + column]
    }

    fn nearest(&self, at: [f64; 2], lengths: [f64; 2]) -> Option<[f64; 2]> {
        if self.allows(at[0], at[1]) {
            return Some(at);
        }
        let rows = self.rows();
        let far = |to: &[f64; 2]| {
            let turn = (to[1] - at[1]).rem_euclid(TAU);
            math::hypot(
                lengths[0] * (to[0] - at[0]),
                lengths[1] * turn.min(TAU - turn),
            )
        };
        self.allowed
            .iter()
            .take(rows * self.columns)
            .enumerate()
            .filter(|&(_, &allowed)| allowed)
            .map(|(cell, _)| {
                let (row, column) = (cell / self.columns, cell % self.columns);
                [
                    (row as f64 + 0.5) / rows as f64,
                    (column as f64 + 0.5) * TAU / self.columns as f64,
                ]
            })
            .min_by(|a, b| far(a).total_cmp(&far(b)))
    }

    fn room(&self, [u, theta]: [f64; 2]) -> [[f64; 2]; 2] {
        if !self.allows(u, theta) {
            return [[0.0; 2]; 2];
        }
        let (rows, columns) = (self.rows(), self.columns);
        let [row, column] = self.cell(u, theta);
        let free = |row: usize, column: usize| self.allowed[row * columns + column];
        let below = (0..row).rev().take_while(|&r| free(r, column)).count();
        let above = (row + 1..rows).take_while(|&r| free(r, column)).count();
        let left = (1..columns)
            .take_while(|k| free(row, (column + columns - k) % columns))
            .count();
        let right = (1..columns)
            .take_while(|k| free(row, (column + k) % columns))
            .count();
        // Within the cell, in cells.
        let up = u * rows as f64 - row as f64;
        let along = theta.rem_euclid(TAU) / TAU * columns as f64 - column as f64;
        let sides = |within: f64, before: usize, after: usize, size: f64| {
            [before as f64 + within, after as f64 + 1.0 - within]
                .map(|cells| (cells - BEFORE_THE_EDGE).max(0.0) * size)
        };
        [
            sides(up, below, above, 1.0 / rows as f64),
            sides(along, left, right, TAU / columns as f64),
        ]
    }
}

// What is tested does not hang on the last bit.
