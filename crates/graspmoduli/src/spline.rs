//! Uniform cubic B-splines on [0, 1], clamped or periodic.

/// Value, first and second derivative of the four basis functions that do not vanish at a point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Local {
    /// Index of the first of the four; with a periodic basis the others may wrap around.
    pub first: usize,
    pub value: [f64; 4],
    pub slope: [f64; 4],
    pub bend: [f64; 4],
}

/// A basis of uniform cubic B-splines.
#[derive(Debug, Clone)]
pub(crate) struct Basis {
    intervals: usize,
    periodic: bool,
    /// Per interval, the four basis functions as polynomials in the local coordinate in [0, 1].
    /// One entry if all intervals are alike, as they are in a periodic basis.
    polynomials: Vec<[[f64; 4]; 4]>,
}

impl Basis {
    /// With `count` functions: a clamped basis has `count − 3` intervals, a periodic one `count`.
    pub fn new(count: usize, periodic: bool) -> Self {
        let intervals = if periodic { count } else { count - 3 };
        let distinct = if periodic { 1 } else { intervals };
        Self {
            intervals,
            periodic,
            polynomials: (0..distinct)
                .map(|i| polynomials(|k| knot(k, intervals, periodic) - i as f64, i))
                .collect(),
        }
    }

    pub fn intervals(&self) -> usize {
        self.intervals
    }

    /// Bernstein coefficients of the four functions that do not vanish on an interval.
    pub fn bezier(&self, interval: usize) -> [[f64; 4]; 4] {
        let basis = &self.polynomials[if self.periodic { 0 } else { interval }];
        basis.map(|[c0, c1, c2, c3]| {
            [
                c0,
                c0 + c1 / 3.0,
                c0 + (2.0 * c1 + c2) / 3.0,
                c0 + c1 + c2 + c3,
            ]
        })
    }

    /// The four functions that do not vanish at `t`: in [0, 1], or any real if periodic.
    #[inline]
    pub fn at(&self, t: f64) -> Local {
        let n = self.intervals as f64;
        let t = if self.periodic {
            (t - t.floor()) * n
        } else {
            t.clamp(0.0, 1.0) * n
        };
        let first = (t as usize).min(self.intervals - 1);
        let s = t - first as f64;
        let basis = &self.polynomials[if self.periodic { 0 } else { first }];
        let mut local = Local {
            first,
            value: [0.0; 4],
            slope: [0.0; 4],
            bend: [0.0; 4],
        };
        for (k, &[c0, c1, c2, c3]) in basis.iter().enumerate() {
            local.value[k] = c0 + s * (c1 + s * (c2 + s * c3));
            local.slope[k] = n * (c1 + s * (2.0 * c2 + s * 3.0 * c3));
            local.bend[k] = n * n * (2.0 * c2 + s * 6.0 * c3);
        }
        local
    }

    /// Coefficients, on a grid `factor` times as fine, of the same spline: exact, by blossoming.
    /// Coefficient j of a cubic spline is its polar form at the knots j+1, j+2, j+3.
    pub fn refine(&self, factor: usize, coefficients: &[f64]) -> Vec<f64> {
        let fine = self.intervals * factor;
        let count = if self.periodic { fine } else { fine + 3 };
        let scale = 1.0 / factor as f64;
        (0..count)
            .map(|j| {
                let at = |k: usize| knot(k, fine, self.periodic) * scale;
                // Any interval between the coefficient's knots will do; take a non-empty one.
                let middle = (1..4)
                    .map(|k| (at(j + k), at(j + k + 1)))
                    .find(|(low, high)| low < high)
                    .map_or(at(j), |(low, high)| 0.5 * (low + high));
                let interval = middle.floor().clamp(0.0, (self.intervals - 1) as f64);
                let interval = if self.periodic {
                    middle.floor()
                } else {
                    interval
                };
                self.blossom(interval, [at(j + 1), at(j + 2), at(j + 3)], coefficients)
            })
            .collect()
    }

    /// Polar form of the polynomial on one interval, by de Boor's algorithm.
    fn blossom(&self, interval: f64, at: [f64; 3], coefficients: &[f64]) -> f64 {
        let n = coefficients.len() as i64;
        let first = interval as i64;
        let mut d: [f64; 4] =
            std::array::from_fn(|k| coefficients[(first + k as i64).rem_euclid(n) as usize]);
        let knot = |k: i64| {
            let value = k as f64;
            if self.periodic {
                value
            } else {
                value.clamp(0.0, self.intervals as f64)
            }
        };
        for (level, &x) in at.iter().enumerate() {
            for k in (level + 1..4).rev() {
                // Knots in units of intervals: that of index i is i − 3.
                let low = knot(first + k as i64 - 3);
                let high = knot(first + k as i64 - level as i64);
                let share = (x - low) / (high - low);
                d[k] = (1.0 - share) * d[k - 1] + share * d[k];
            }
        }
        d[3]
    }
}

/// Knot k in units of intervals: −3, −2, … if periodic, else with the ends repeated.
fn knot(k: usize, intervals: usize, periodic: bool) -> f64 {
    let value = k as f64 - 3.0;
    if periodic {
        value
    } else {
        value.clamp(0.0, intervals as f64)
    }
}

/// The functions first…first+3 on their common interval, by the Cox–de Boor recursion carried out
/// on polynomials; knots relative to the interval's left end.
fn polynomials(knot: impl Fn(usize) -> f64, first: usize) -> [[f64; 4]; 4] {
    let mut previous = [[0.0; 4]; 5];
    previous[3] = [1.0, 0.0, 0.0, 0.0];
    for degree in 1..=3 {
        let mut next = [[0.0; 4]; 5];
        for k in 3 - degree..4 {
            let mut add = |at: f64, other: f64, polynomial: [f64; 4]| {
                // (s − at)/(other − at) times the polynomial; an empty span contributes nothing.
                if at != other {
                    for power in 0..4 {
                        next[k][power] -= at * polynomial[power] / (other - at);
                        if power > 0 {
                            next[k][power] += polynomial[power - 1] / (other - at);
                        }
                    }
                }
            };
            let i = first + k;
            add(knot(i), knot(i + degree), previous[k]);
            add(knot(i + degree + 1), knot(i + 1), previous[k + 1]);
        }
        previous = next;
    }
    [previous[0], previous[1], previous[2], previous[3]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn evaluate(basis: &Basis, coefficients: &[f64], t: f64) -> f64 {
        let local = basis.at(t);
        (0..4)
            .map(|k| local.value[k] * coefficients[(local.first + k) % coefficients.len()])
            .sum()
    }

    #[test]
    fn basis_functions_are_positive_and_sum_to_one() {
        for (count, periodic) in [(4, false), (5, false), (9, false), (4, true), (7, true)] {
            let basis = Basis::new(count, periodic);
            for i in 0..=100 {
                let local = basis.at(i as f64 / 100.0);
                assert!((local.value.iter().sum::<f64>() - 1.0).abs() < 1e-14);
                assert!(local.slope.iter().sum::<f64>().abs() < 1e-12);
                assert!(local.bend.iter().sum::<f64>().abs() < 1e-10);
                assert!(local.value.iter().all(|&v| v >= -1e-15));
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_finite_differences() {
        for periodic in [false, true] {
            let basis = Basis::new(8, periodic);
            for i in 0..40 {
                let t = (i as f64 + 0.5) / 40.0;
                let h = 1e-6;
                let (low, mid, high) = (basis.at(t - h), basis.at(t), basis.at(t + h));
                if low.first != high.first {
                    continue;
                }
                for k in 0..4 {
                    let slope = (high.value[k] - low.value[k]) / (2.0 * h);
                    let bend = (high.slope[k] - low.slope[k]) / (2.0 * h);
                    assert!((slope - mid.slope[k]).abs() < 1e-7);
                    assert!((bend - mid.bend[k]).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn a_refined_spline_is_the_same_function() {
        for (count, periodic) in [(4, false), (5, false), (9, false), (4, true), (7, true)] {
            let basis = Basis::new(count, periodic);
            let coefficients: Vec<f64> = (0..count)
                .map(|i| crate::math::sin(7.3 * i as f64) + 2.0)
                .collect();
            for factor in [1, 2, 3, 5] {
                let fine = basis.refine(factor, &coefficients);
                let refined = Basis::new(fine.len(), periodic);
                for i in 0..=200 {
                    let t = i as f64 / 200.0;
                    let difference =
                        evaluate(&basis, &coefficients, t) - evaluate(&refined, &fine, t);
                    assert!(difference.abs() < 1e-14, "{count} {periodic} {factor} {t}");
                }
            }
        }
    }
}
