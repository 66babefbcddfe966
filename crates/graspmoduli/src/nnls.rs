//! Small least-squares problems with inequalities (Lawson & Hanson, Solving Least Squares
//! Problems, 1974, ch. 23), for a few dozen columns of fixed short length.

/// Below this, relative to the columns' length, a residual or multiplier is rounding.
const TOLERANCE: f64 = 1e-12;

/// The shortest d ∈ R^D with ⟨rows_k, d⟩ ≥ lower_k for all k; `None` if there is no such d.
///
/// Least distance programming: with E = [rowsᵀ; lowerᵀ] and f = e_{D+1}, the residual
/// r = Eλ − f of the non-negative least-squares problem gives d = −r_{1…D} / r_{D+1}.
/// N is D + 1.
pub(crate) fn shortest_step<const D: usize, const N: usize>(
    rows: &[[f64; D]],
    lower: &[f64],
) -> Option<[f64; D]> {
    // Rows of very different length would make the tolerance mean different things.
    let columns: Vec<[f64; N]> = rows
        .iter()
        .zip(lower)
        .map(|(row, &bound)| {
            let column: [f64; N] = std::array::from_fn(|i| if i < D { row[i] } else { bound });
            let length = dot(&column, &column).sqrt().max(f64::MIN_POSITIVE);
            column.map(|x| x / length)
        })
        .collect();
    let mut target = [0.0; N];
    target[D] = 1.0;
    let residual = residual(&columns, &nonnegative(&columns, target), target);
    (residual[D] < -1e-10).then(|| std::array::from_fn(|i| -residual[i] / residual[D]))
}

/// Eλ − f.
fn residual<const N: usize>(columns: &[[f64; N]], weights: &[f64], target: [f64; N]) -> [f64; N] {
    let mut r = target.map(|x| -x);
    for (column, weight) in columns.iter().zip(weights) {
        for i in 0..N {
            r[i] += column[i] * weight;
        }
    }
    r
}

/// The λ ≥ 0 that makes Eλ − f shortest; at most N are positive. Columns should be about as long
/// as one another and as f.
pub(crate) fn nonnegative<const N: usize>(columns: &[[f64; N]], target: [f64; N]) -> Vec<f64> {
    let mut weights = vec![0.0; columns.len()];
    let mut passive: Vec<usize> = Vec::with_capacity(N);
    // Columns that depend on the passive ones, and so cannot lower the residual beside them.
    let mut dependent: Vec<usize> = Vec::new();
    // Each round lowers the residual; the bound only guards against cycling by rounding.
    for _ in 0..4 * (columns.len() + N) {
        let r = residual(columns, &weights, target);
        let candidate = (0..columns.len())
            .filter(|k| !passive.contains(k) && !dependent.contains(k))
            .map(|k| (k, -dot(&columns[k], &r)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((entering, slope)) = candidate else {
            return weights;
        };
        if slope <= TOLERANCE || passive.len() == N {
            return weights;
        }
        passive.push(entering);
        let Some(mut trial) = least_squares(columns, &passive, target) else {
            passive.pop();
            dependent.push(entering);
            continue;
        };
        dependent.clear();
        loop {
            // As far towards the trial as all weights stay positive.
            let mut share = 1.0;
            let mut leaving = None;
            for (position, &k) in passive.iter().enumerate() {
                if trial[position] <= 0.0 {
                    // A weight that enters may be 0 and stay 0.
                    let limit = if weights[k] > 0.0 {
                        weights[k] / (weights[k] - trial[position])
                    } else {
                        0.0
                    };
                    if leaving.is_none() || limit < share {
                        share = limit;
                        leaving = Some(position);
                    }
                }
            }
            for (position, &k) in passive.iter().enumerate() {
                weights[k] += share * (trial[position] - weights[k]);
            }
            let Some(position) = leaving else {
                break;
            };
            weights[passive.swap_remove(position)] = 0.0;
            // Fewer columns than independent ones are independent too, but for rounding.
            match least_squares(columns, &passive, target) {
                Some(fewer) => trial = fewer,
                None => break,
            }
        }
    }
    weights
}

/// Least squares on the chosen columns, by modified Gram–Schmidt; `None` if they are dependent.
fn least_squares<const N: usize>(
    columns: &[[f64; N]],
    chosen: &[usize],
    mut target: [f64; N],
) -> Option<Vec<f64>> {
    let count = chosen.len();
    let mut basis: Vec<[f64; N]> = Vec::with_capacity(count);
    let mut upper = vec![0.0; count * count];
    let mut right = vec![0.0; count];
    for (j, &k) in chosen.iter().enumerate() {
        let mut q = columns[k];
        for (i, b) in basis.iter().enumerate() {
            let along = dot(b, &q);
            upper[i * count + j] = along;
            for x in 0..N {
                q[x] -= along * b[x];
            }
        }
        let length = dot(&q, &q).sqrt();
        if length < TOLERANCE {
            return None;
        }
        upper[j * count + j] = length;
        let q = q.map(|x| x / length);
        right[j] = dot(&q, &target);
        for x in 0..N {
            target[x] -= right[j] * q[x];
        }
        basis.push(q);
    }
    for j in (0..count).rev() {
        let known: f64 = (j + 1..count)
            .map(|i| upper[j * count + i] * right[i])
            .sum();
        right[j] = (right[j] - known) / upper[j * count + j];
    }
    Some(right)
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_step_onto_one_half_space_is_the_perpendicular() {
        let step = shortest_step::<2, 3>(&[[3.0, 4.0]], &[10.0]).unwrap();
        assert!((step[0] - 1.2).abs() < 1e-12 && (step[1] - 1.6).abs() < 1e-12);
    }

    #[test]
    fn the_shortest_step_into_a_corner_ends_in_it() {
        let rows = [[1.0, 0.0], [1.0, 1.0], [0.0, -1.0]];
        let step = shortest_step::<2, 3>(&rows, &[1.0, 3.0, -1.0]).unwrap();
        assert!((step[0] - 2.0).abs() < 1e-12 && (step[1] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn satisfied_constraints_need_no_step_and_contradictory_ones_have_none() {
        assert_eq!(
            shortest_step::<2, 3>(&[[1.0, 0.0]], &[-1.0]),
            Some([0.0, 0.0])
        );
        assert_eq!(shortest_step::<1, 2>(&[[1.0], [-1.0]], &[1.0, 1.0]), None);
    }

    #[test]
    fn a_dependent_column_does_not_keep_the_others_out() {
        // The second is the first but for rounding, and longer: the largest slope, and no use.
        let columns = [[1.0, 0.0, 1e-3], [2.0, 1e-13, 2e-3], [0.0, 1.0, 0.0]];
        let target = [1.0, 0.5, 0.0];
        let weights = nonnegative(&columns, target);
        let r = residual(&columns, &weights, target);
        for column in &columns {
            assert!(dot(column, &r) > -1e-9, "{weights:?}");
        }
    }

    #[test]
    fn random_steps_are_feasible_and_stationary() {
        let mut state = 7u64;
        let mut draw = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        for _ in 0..500 {
            // A point that satisfies all constraints guarantees that there is a step.
            let inside: [f64; 6] = std::array::from_fn(|_| 4.0 * draw());
            let rows: Vec<[f64; 6]> = (0..20).map(|_| std::array::from_fn(|_| draw())).collect();
            let lower: Vec<f64> = rows.iter().map(|row| dot(row, &inside) - 0.1).collect();
            let step = shortest_step::<6, 7>(&rows, &lower).unwrap();
            let mut multipliers_used = false;
            for (row, bound) in rows.iter().zip(&lower) {
                let slack = dot(row, &step) - bound;
                assert!(slack > -1e-9);
                multipliers_used |= slack < 1e-9;
            }
            assert!(multipliers_used || dot(&step, &step) == 0.0);
            assert!(dot(&step, &step) <= dot(&inside, &inside) + 1e-9);
        }
    }
}
