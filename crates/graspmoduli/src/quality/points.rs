//! Points of a hull in R⁶ as registers take them, and the farthest of them in a direction.

use super::lanes::{LANES, Lane, Lanes, Table, load, splat_each};
use super::r6::Twist;
use super::support::Levels;
use crate::contact::Norm;
use pulp::Simd;

/// Points in groups that begin at a block of lanes, one per contact; the rest of a group's last
/// block repeats its first point.
#[derive(Debug, Clone, Default)]
pub(super) struct Points {
    pub table: Table<6>,
    /// The weight of each point in [`Points::inside`]; of repeated ones 0.
    weights: Vec<Lanes>,
    /// Points in a group, and groups, of which the weights are.
    shape: (usize, usize),
    /// ⟨x, p⟩ of all points for the last x.
    heights: Vec<Lanes>,
}

/// A farthest point of a hull.
pub(super) struct Farthest {
    pub point: Twist,
    /// ⟨x, point⟩.
    pub height: f64,
    /// Identifies it.
    pub key: u64,
}

impl Points {
    /// Room for some groups of so many points each.
    pub fn shape(&mut self, group: usize, groups: usize) {
        if self.shape == (group, groups) {
            return;
        }
        self.shape = (group, groups);
        let blocks = self.blocks() * groups;
        self.table.resize(blocks, [Lanes::default(); 6]);
        self.heights.resize(blocks, Lanes::default());
        self.weights.clear();
        self.weights.resize(blocks, Lanes::default());
        let plain = Levels {
            epsilon: 0.0,
            salt: 0,
        };
        for key in 0..group * groups {
            let (block, lane) = self.place(key / group, key % group);
            self.weights[block][lane] = plain.spread(key as u64);
        }
    }

    /// How many groups there are.
    pub fn groups(&self) -> usize {
        self.shape.1
    }

    /// Blocks per group.
    pub fn blocks(&self) -> usize {
        self.shape.0.div_ceil(LANES)
    }

    #[inline(always)]
    fn place(&self, group: usize, index: usize) -> (usize, usize) {
        (group * self.blocks() + index / LANES, index % LANES)
    }

    /// Sets a point of a group.
    #[inline(always)]
    pub fn set(&mut self, group: usize, index: usize, point: &Twist) {
        let (block, lane) = self.place(group, index);
        for i in 0..6 {
            self.table[block][i][lane] = point[i];
        }
    }

    /// Repeats the first point of a group in the rest of its last block.
    #[inline(always)]
    pub fn fill(&mut self, group: usize) {
        let first = self.point(group * self.blocks(), 0);
        for index in self.shape.0..self.blocks() * LANES {
            self.set(group, index, &first);
        }
    }

    #[inline(always)]
    pub fn point(&self, block: usize, lane: usize) -> Twist {
        let rows = &self.table[block];
        std::array::from_fn(|i| rows[i][lane])
    }

    /// Which of all points that is.
    #[inline(always)]
    pub fn key(&self, block: usize, lane: usize) -> u64 {
        let (group, own) = (block / self.blocks(), block % self.blocks());
        (group * self.shape.0 + own * LANES + lane) as u64
    }

    /// The points themselves, group after group.
    pub fn list(&self, all: &mut Vec<Twist>) {
        let (group, groups) = self.shape;
        all.clear();
        for number in 0..groups {
            all.extend((0..group).map(|index| {
                let (block, lane) = self.place(number, index);
                self.point(block, lane)
            }));
        }
    }

    /// A weighted mean of all points: in the interior of their hull, relative to its dimension, and
    /// in general position.
    #[inline(always)]
    pub fn inside(&self) -> Twist {
        // Lane by lane whatever the registers: the sum is the same to the bit.
        let (mut sums, mut total) = ([Lanes::default(); 6], Lanes::default());
        for (rows, weights) in self.table.iter().zip(&self.weights) {
            for lane in 0..LANES {
                total[lane] += weights[lane];
            }
            for i in 0..6 {
                for lane in 0..LANES {
                    sums[i][lane] += weights[lane] * rows[i][lane];
                }
            }
        }
        let share = 1.0 / sum(&total);
        let mut mean = [0.0; 6];
        for i in 0..6 {
            mean[i] = sum(&sums[i]) * share;
        }
        mean
    }

    /// A point of the hull with the greatest ⟨x, p⟩: of all points, the first among equals; or the
    /// sum over groups of each one's, as far as they help.
    #[inline(always)]
    pub fn farthest<S: Simd>(&mut self, simd: S, norm: Norm, x: &Twist) -> Farthest {
        match norm {
            Norm::Sum => {
                let blocks = 0..self.table.len();
                let (block, lane, height) = self.farthest_of(simd, blocks, x);
                Farthest {
                    point: self.point(block, lane),
                    height,
                    key: self.key(block, lane),
                }
            }
            Norm::Each => {
                let (mut point, mut total, mut key) = ([0.0; 6], 0.0, 0u64);
                let own = self.blocks();
                for group in 0..self.shape.1 {
                    let blocks = group * own..(group + 1) * own;
                    let (block, lane, height) = self.farthest_of(simd, blocks, x);
                    key = key.wrapping_mul(self.shape.0 as u64 + 1);
                    if height > 0.0 {
                        let index = (block - group * own) * LANES + lane;
                        key = key.wrapping_add(index as u64 + 1);
                        let rows = &self.table[block];
                        for i in 0..6 {
                            point[i] += rows[i][lane];
                        }
                        total += height;
                    }
                }
                Farthest {
                    point,
                    height: total,
                    key,
                }
            }
        }
    }

    /// Block and lane of the farthest point of some blocks, the first among equals, and its height.
    #[inline(always)]
    fn farthest_of<S: Simd>(
        &mut self,
        simd: S,
        blocks: std::ops::Range<usize>,
        x: &Twist,
    ) -> (usize, usize, f64) {
        let x = splat_each(simd, *x);
        let mut most = Lane::splat(simd, f64::NEG_INFINITY);
        let (rows, heights) = (
            &self.table[blocks.clone()],
            &mut self.heights[blocks.clone()],
        );
        for (rows, out) in rows.iter().zip(&mut *heights) {
            for v in 0..LANES / S::F64_LANES {
                let height = dot(&x, &load(simd, rows, v));
                most = most.max(height);
                S::as_mut_simd_f64s(&mut out.0).0[v] = height.value;
            }
        }
        let height = simd.reduce_max_f64s(most.value);
        let (block, lane) = first_equal(heights, height);
        (blocks.start + block, lane, height)
    }

    /// Block and lane of the point that is deepest within a cone, all of whose sides' heights
    /// Σ rows[i][k]·p_i, k < 6, are to be negative: the least of their depths, times a share of each.
    #[inline(always)]
    pub fn deepest<S: Simd>(
        &mut self,
        simd: S,
        rows: &[Lanes; 6],
        shares: &[f64; 6],
    ) -> (usize, usize, f64) {
        let mut most = Lane::splat(simd, f64::NEG_INFINITY);
        let zero = Lane::splat(simd, 0.0);
        for (points, out) in self.table.iter().zip(&mut self.heights) {
            for v in 0..LANES / S::F64_LANES {
                let point = load(simd, points, v);
                let mut least = Lane::splat(simd, f64::INFINITY);
                for side in 0..6 {
                    let mut normal = [zero; 6];
                    for i in 0..6 {
                        normal[i] = Lane::splat(simd, rows[i][side]);
                    }
                    least =
                        least.min((zero - dot(&normal, &point)) * Lane::splat(simd, shares[side]));
                }
                most = most.max(least);
                S::as_mut_simd_f64s(&mut out.0).0[v] = least.value;
            }
        }
        let depth = simd.reduce_max_f64s(most.value);
        let (block, lane) = first_equal(&self.heights, depth);
        (block, lane, depth)
    }
}

/// ⟨a, b⟩ as in [`super::r6::dot`], lane by lane.
#[inline(always)]
pub(super) fn dot<S: Simd>(a: &[Lane<S>; 6], b: &[Lane<S>; 6]) -> Lane<S> {
    ((a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])) + (a[4] * b[4] + a[5] * b[5])
}

/// The sum over a row, in one order.
#[inline(always)]
fn sum(row: &Lanes) -> f64 {
    ((row[0] + row[1]) + (row[2] + row[3])) + ((row[4] + row[5]) + (row[6] + row[7]))
}

/// Block and lane of the first number that equals a value; where there is none, the first.
#[inline(always)]
pub(super) fn first_equal(rows: &[Lanes], value: f64) -> (usize, usize) {
    for (block, row) in rows.iter().enumerate() {
        let mut flags = [0; LANES];
        for lane in 0..LANES {
            flags[lane] = u8::from(row[lane] == value);
        }
        let flags = u64::from_le_bytes(flags);
        if flags != 0 {
            return (block, lane_of(flags));
        }
    }
    (0, 0)
}

/// The first lane whose byte is not 0.
#[inline(always)]
pub(super) fn lane_of(flags: u64) -> usize {
    flags.trailing_zeros() as usize / 8
}
