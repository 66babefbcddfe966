//! Rows of a matrix made orthonormal, however nearly they depend on each other.

use super::r6::Twist;
use super::simplex::dot;

/// Rows of which less than this is left are combinations of others.
const FLAT: f64 = 1e-12;

/// Makes the rows orthonormal, one after the other; the factors, and the rows that are none of the
/// others' combinations.
pub(super) fn orthonormal(rows: &mut [Vec<f64>]) -> ([Twist; 6], Vec<usize>) {
    let mut lower = [[0.0; 6]; 6];
    let mut spanning: Vec<usize> = Vec::new();
    for row in 0..6 {
        let before = dot(&rows[row], &rows[row]).sqrt();
        // Twice is enough.
        for _ in 0..2 {
            for &other in &spanning {
                let along = dot(&rows[row], &rows[other]);
                lower[row][other] += along;
                let (one, two) = rows.split_at_mut(row);
                for (x, q) in two[0].iter_mut().zip(&one[other]) {
                    *x -= along * q;
                }
            }
        }
        let length = dot(&rows[row], &rows[row]).sqrt();
        if length > FLAT * before {
            lower[row][row] = length;
            for x in &mut rows[row] {
                *x /= length;
            }
            spanning.push(row);
        }
    }
    (lower, spanning)
}
