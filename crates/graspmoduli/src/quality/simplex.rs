//! Small linear programs by the simplex method, for the least cost of a combination.

/// What is left over by less than this, relative to the weights, is rounding.
pub(super) const BALANCED: f64 = 1e-11;
/// A price or a pivot below this, relative to what it is made of, is rounding.
const ROUNDING: f64 = 1e-12;
/// After so many pivots the least index enters, which cannot cycle.
const STEEPEST: usize = 200;

/// A basis, its inverse and its point.
pub(super) struct Simplex<'a> {
    /// Column by column.
    columns: &'a [f64],
    costs: &'a [f64],
    rows: usize,
    target: Vec<f64>,
    /// Columns of the basis; from the number of columns on, artificial ones, ± a unit vector.
    basis: Vec<usize>,
    signs: Vec<f64>,
    /// Row-major.
    inverse: Vec<f64>,
    point: Vec<f64>,
}

impl<'a> Simplex<'a> {
    /// For the least ⟨costs, α⟩ over columns · α = target, α ≥ 0.
    pub fn new(columns: &'a [f64], costs: &'a [f64], target: Vec<f64>) -> Self {
        let rows = target.len();
        let signs: Vec<f64> = target
            .iter()
            .map(|&x| if x < 0.0 { -1.0 } else { 1.0 })
            .collect();
        let mut inverse = vec![0.0; rows * rows];
        for (k, sign) in signs.iter().enumerate() {
            inverse[k * rows + k] = *sign;
        }
        let count = costs.len();
        Self {
            columns,
            costs,
            rows,
            point: target.iter().map(|x| x.abs()).collect(),
            target,
            basis: (count..count + rows).collect(),
            signs,
            inverse,
        }
    }

    fn column(&self, k: usize) -> &[f64] {
        &self.columns[k * self.rows..(k + 1) * self.rows]
    }

    fn is_artificial(&self, k: usize) -> bool {
        k >= self.costs.len()
    }

    /// To a point where artificial columns weigh nothing; false if there is none.
    pub fn first_phase(&mut self) -> bool {
        self.pivot(|simplex, k| if simplex.is_artificial(k) { 1.0 } else { 0.0 });
        let pressed: f64 = self.point.iter().sum();
        let left: f64 = (0..self.rows)
            .filter(|&r| self.is_artificial(self.basis[r]))
            .map(|r| self.point[r])
            .sum();
        left <= BALANCED * (1.0 + pressed)
    }

    pub fn second_phase(&mut self) {
        self.pivot(|simplex, k| simplex.costs.get(k).copied().unwrap_or(0.0));
    }

    /// Pivots until no column costs less than the basis would pay for it.
    fn pivot(&mut self, cost: impl Fn(&Self, usize) -> f64) {
        let rows = self.rows;
        for step in 0..100 * STEEPEST {
            let mut prices = vec![0.0; rows];
            for r in 0..rows {
                let own = cost(self, self.basis[r]);
                if own != 0.0 {
                    for (price, x) in prices.iter_mut().zip(&self.inverse[r * rows..]) {
                        *price += own * x;
                    }
                }
            }
            let mut entering = None;
            let mut steepest = 0.0;
            for k in 0..self.costs.len() {
                let (mut paid, mut size) = (0.0, 1.0);
                for (price, x) in prices.iter().zip(self.column(k)) {
                    paid += price * x;
                    size += (price * x).abs();
                }
                let excess = cost(self, k) - paid;
                if excess < -ROUNDING * size && excess < steepest && !self.basis.contains(&k) {
                    entering = Some(k);
                    steepest = excess;
                    if step >= STEEPEST {
                        break;
                    }
                }
            }
            let Some(entering) = entering else {
                return;
            };
            let column = self.column(entering);
            let change: Vec<f64> = (0..rows)
                .map(|r| dot(&self.inverse[r * rows..(r + 1) * rows], column))
                .collect();
            let largest = change.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
            let mut leaving: Option<(f64, usize)> = None;
            for r in 0..rows {
                let idle = self.is_artificial(self.basis[r]) && self.point[r] <= BALANCED;
                // An artificial column that weighs nothing must not come back.
                let falls = if idle { change[r].abs() } else { change[r] };
                if falls <= 1e-11 * largest {
                    continue;
                }
                let share = if idle {
                    0.0
                } else {
                    self.point[r].max(0.0) / falls
                };
                let better = leaving.is_none_or(|(least, other)| {
                    share < least * (1.0 - ROUNDING)
                        || (share <= least * (1.0 + ROUNDING)
                            && if step >= STEEPEST {
                                self.basis[r] < self.basis[other]
                            } else {
                                falls > change[other].abs()
                            })
                });
                if better {
                    leaving = Some((share, r));
                }
            }
            let Some((_, leaving)) = leaving else {
                return;
            };
            self.exchange(leaving, entering, &change);
        }
    }

    fn exchange(&mut self, leaving: usize, entering: usize, change: &[f64]) {
        let rows = self.rows;
        let by = 1.0 / change[leaving];
        let pivot: Vec<f64> = self.inverse[leaving * rows..(leaving + 1) * rows]
            .iter()
            .map(|x| x * by)
            .collect();
        let weight = self.point[leaving] * by;
        for r in 0..rows {
            if r != leaving {
                for (x, p) in self.inverse[r * rows..(r + 1) * rows]
                    .iter_mut()
                    .zip(&pivot)
                {
                    *x -= change[r] * p;
                }
                self.point[r] -= change[r] * weight;
            }
        }
        self.inverse[leaving * rows..(leaving + 1) * rows].copy_from_slice(&pivot);
        self.point[leaving] = weight;
        self.basis[leaving] = entering;
    }

    /// Weights of the columns, prices of the rows and the least effort, from the basis alone: what
    /// the pivots have lost to rounding does not enter.
    pub fn solved(&self) -> (Vec<f64>, Vec<f64>, f64) {
        let rows = self.rows;
        let count = self.costs.len();
        let mut matrix = vec![0.0; rows * rows];
        for (c, &k) in self.basis.iter().enumerate() {
            for r in 0..rows {
                matrix[r * rows + c] = if k < count {
                    self.columns[k * rows + r]
                } else if k - count == r {
                    self.signs[r]
                } else {
                    0.0
                };
            }
        }
        let costs: Vec<f64> = self
            .basis
            .iter()
            .map(|&k| self.costs.get(k).copied().unwrap_or(0.0))
            .collect();
        let refined = |transposed: bool, right: &[f64], start: Vec<f64>| -> Vec<f64> {
            let mut x = start;
            for _ in 0..3 {
                let left: Vec<f64> = (0..rows)
                    .map(|r| {
                        let sum: f64 = (0..rows)
                            .map(|c| {
                                let at = if transposed {
                                    c * rows + r
                                } else {
                                    r * rows + c
                                };
                                matrix[at] * x[c]
                            })
                            .sum();
                        right[r] - sum
                    })
                    .collect();
                for (r, x) in x.iter_mut().enumerate() {
                    *x += (0..rows)
                        .map(|c| {
                            let at = if transposed {
                                c * rows + r
                            } else {
                                r * rows + c
                            };
                            self.inverse[at] * left[c]
                        })
                        .sum::<f64>();
                }
            }
            x
        };
        let point = refined(false, &self.target, self.point.clone());
        let prices = refined(true, &costs, vec![0.0; rows]);
        let mut weights = vec![0.0; count];
        let mut effort = 0.0;
        for ((&k, &weight), cost) in self.basis.iter().zip(&point).zip(&costs) {
            if k < count {
                weights[k] = weight.max(0.0);
            }
            effort += weight * cost;
        }
        (weights, prices, effort)
    }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
