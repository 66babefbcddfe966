//! Splines through given values, and penalised least squares: banded systems solved in one fixed
//! order of operations, so that the same numbers give the same bits on every processor.

use crate::spline::Basis;

/// Coefficients of the spline surface with given radii: a row of `columns` values, at the angles
/// 2πj/columns, per Greville site of the clamped basis.
///
/// `values` holds at least four rows and `columns` is at least four.
pub fn interpolate(columns: usize, values: &[f64]) -> Vec<f64> {
    let mut coefficients = values.to_vec();
    interpolate_along(columns, &mut coefficients);
    for row in coefficients.chunks_exact_mut(columns) {
        interpolate_around(row);
    }
    coefficients
}

/// The Greville sites of the clamped basis with `count` functions, in [0, 1].
pub fn greville(count: usize) -> Vec<f64> {
    let intervals = (count - 3) as f64;
    let knot = |k: usize| (k as f64 - 3.0).clamp(0.0, intervals);
    (0..count)
        .map(|i| (knot(i + 1) + knot(i + 2) + knot(i + 3)) / (3.0 * intervals))
        .collect()
}

/// In u: the system has two diagonals on either side of the main one. Collocation matrices of
/// splines are totally positive, so elimination needs no pivots (C. de Boor, A. Pinkus, Backward
/// error analysis for totally positive linear systems, 1977).
fn interpolate_along(columns: usize, values: &mut [f64]) {
    let count = values.len() / columns;
    let basis = Basis::new(count, false);
    let mut system: Vec<[f64; 5]> = greville(count)
        .into_iter()
        .enumerate()
        .map(|(row, site)| {
            let mut band = [0.0; 5];
            let local = basis.at(site);
            for (k, value) in local.value.into_iter().enumerate() {
                // What falls beside the band is 0: the outermost functions at the two ends.
                if let Some(slot) = band.get_mut((local.first + k + 2).wrapping_sub(row)) {
                    *slot = value;
                }
            }
            band
        })
        .collect();
    for pivot in 0..count {
        for row in pivot + 1..count.min(pivot + 3) {
            let factor = system[row][2 + pivot - row] / system[pivot][2];
            for column in pivot..count.min(pivot + 3) {
                system[row][2 + column - row] -= factor * system[pivot][2 + column - pivot];
            }
            let (upper, lower) = values.split_at_mut(row * columns);
            let upper = &upper[pivot * columns..][..columns];
            for (value, above) in lower[..columns].iter_mut().zip(upper) {
                *value -= factor * above;
            }
        }
    }
    for row in (0..count).rev() {
        let (upper, lower) = values.split_at_mut((row + 1) * columns);
        let own = &mut upper[row * columns..];
        for next in row + 1..count.min(row + 3) {
            let below = &lower[(next - row - 1) * columns..][..columns];
            for (value, known) in own.iter_mut().zip(below) {
                *value -= system[row][2 + next - row] * known;
            }
        }
        for value in own {
            *value /= system[row][2];
        }
    }
}

/// In θ: (c_j + 4 c_{j+1} + c_{j+2})/6 = value_j, by two recursive filters with the root of
/// z² + 4z + 1 (M. Unser, A. Aldroubi, M. Eden, B-spline signal processing, 1993).
fn interpolate_around(values: &mut [f64]) {
    let count = values.len();
    let root = 3.0_f64.sqrt() - 2.0;
    let mut power = 1.0;
    let mut forward = 0.0;
    let mut backward = 0.0;
    for step in 0..count {
        forward += power * values[(count - step) % count];
        power *= root;
    }
    let all = 1.0 - power;
    values[0] = forward / all;
    for j in 1..count {
        values[j] += root * values[j - 1];
    }
    power = 1.0;
    for step in 0..count {
        backward += power * values[(count - 1 + step) % count];
        power *= root;
    }
    values[count - 1] = -root * backward / all;
    for j in (0..count - 1).rev() {
        values[j] = root * (values[j + 1] - values[j]);
    }
    for value in values.iter_mut() {
        *value *= 6.0;
    }
    values.rotate_right(1);
}

/// The normal equations of a regression, as [`solve_banded`] takes them: the lower band of
/// Σ w f fᵀ, of rows of `stride` entries, and Σ w y f.
///
/// Point i has weight `weights[i]`, value `values[i]` and, of the 16 functions `cells[16 i..]`, the
/// values `design[16 i..]`. Two functions that meet are less than `stride` apart.
pub fn normal_equations(
    count: usize,
    stride: usize,
    cells: &[u32],
    design: &[f64],
    weights: &[f64],
    values: &[f64],
) -> (Vec<f64>, Vec<f64>) {
    let (mut band, mut right) = (vec![0.0; count * stride], vec![0.0; count]);
    let (cells, _) = cells.as_chunks::<16>();
    let (design, _) = design.as_chunks::<16>();
    for (((cells, design), &weight), &value) in cells.iter().zip(design).zip(weights).zip(values) {
        if weight == 0.0 {
            continue;
        }
        for (&row, &f) in cells.iter().zip(design) {
            let (row, scaled) = (row as usize, weight * f);
            right[row] += scaled * value;
            let own = &mut band[row * stride..][..stride];
            for (&column, &g) in cells.iter().zip(design) {
                let column = column as usize;
                if column <= row {
                    own[column + stride - 1 - row] += scaled * g;
                }
            }
        }
    }
    (band, right)
}

/// The solution of a symmetric positive definite system, by Cholesky's factorisation; None if the
/// matrix is not positive.
///
/// Row i of `band` holds the matrix's entries (i, i − width) … (i, i), those that exist.
pub fn solve_banded(width: usize, mut band: Vec<f64>, mut right: Vec<f64>) -> Option<Vec<f64>> {
    let (stride, count) = (width + 1, right.len());
    for i in 0..count {
        let first = i.saturating_sub(width);
        let (above, own) = band.split_at_mut(i * stride);
        for j in first..=i {
            // Both rows from the first column that they have in common.
            let common = first.max(j.saturating_sub(width));
            let left = common + width - i;
            let product = if j < i {
                let other = &above[j * stride..][common + width - j..width];
                dot(&own[left..left + j - common], other)
            } else {
                dot(&own[left..width], &own[left..width])
            };
            let entry = own[j + width - i] - product;
            own[j + width - i] = if j < i {
                entry / above[j * stride + width]
            } else if entry > 0.0 {
                entry.sqrt()
            } else {
                return None;
            };
        }
        let row = &own[first + width - i..width];
        right[i] = (right[i] - dot(row, &right[first..i])) / own[width];
    }
    for i in (0..count).rev() {
        let first = i.saturating_sub(width);
        let row = &band[i * stride..][first + width - i..=width];
        right[i] /= row[i - first];
        let value = right[i];
        for (entry, factor) in right[first..i].iter_mut().zip(row) {
            *entry -= factor * value;
        }
    }
    Some(right)
}

/// In eight sums: vectors of any width then give the same bits.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, a_rest) = a.as_chunks::<8>();
    let (b, b_rest) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (x, y) in a.iter().zip(b) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    let [p, q, r, s, t, u, v, w] = sums;
    ((p + t) + (q + u)) + ((r + v) + (s + w)) + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math;
    use crate::surface::Surface;

    #[test]
    fn the_spline_passes_through_its_values() {
        for (rows, columns) in [(4, 4), (5, 7), (6, 5), (11, 8), (67, 32), (515, 9)] {
            let values: Vec<f64> = (0..rows * columns)
                .map(|i| 3.0 + math::sin(7.3 * i as f64))
                .collect();
            // A spline through positive values need not be positive: lift it.
            let found = interpolate(columns, &values);
            let lifted = found.iter().map(|c| c + 100.0).collect();
            let surface = Surface::new(0.0, 1.0, columns, lifted).unwrap();
            for (i, u) in greville(rows).into_iter().enumerate() {
                for j in 0..columns {
                    let theta = std::f64::consts::TAU * j as f64 / columns as f64;
                    let radius = surface.radius(u, theta).value - 100.0;
                    let wanted = values[i * columns + j];
                    assert!((radius - wanted).abs() < 1e-12, "{rows} {columns} {i} {j}");
                }
            }
        }
    }

    #[test]
    fn banded_systems_are_solved() {
        for (count, width) in [(1, 0), (5, 0), (6, 2), (40, 7), (40, 60), (90, 19)] {
            let entry = |i: usize, j: usize| {
                let apart = i.abs_diff(j);
                let away = math::sin((i + j + 3 * apart) as f64);
                match apart {
                    0 => 2.0 * width as f64 + 1.0,
                    _ if apart <= width => away,
                    _ => 0.0,
                }
            };
            let wanted: Vec<f64> = (0..count).map(|i| math::cos(i as f64)).collect();
            let right = (0..count)
                .map(|i| (0..count).map(|j| entry(i, j) * wanted[j]).sum())
                .collect();
            let mut band = vec![f64::NAN; count * (width + 1)];
            for i in 0..count {
                for j in i.saturating_sub(width)..=i {
                    band[i * (width + 1) + j + width - i] = entry(i, j);
                }
            }
            let found = solve_banded(width, band.clone(), right).unwrap();
            for (x, y) in found.iter().zip(&wanted) {
                assert!((x - y).abs() < 1e-12, "{count} {width}");
            }
            band[(count - 1) * (width + 1) + width] = -1.0;
            assert_eq!(solve_banded(width, band, vec![0.0; count]), None);
        }
    }
}
