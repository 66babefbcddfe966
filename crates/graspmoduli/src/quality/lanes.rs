//! Formulas written once for one number and for a vector register of them, and rows of numbers as
//! registers take them.

use pulp::Simd;
use std::ops::{Add, Deref, DerefMut, Div, Mul, Sub};

/// Numbers in a row.
pub(super) const LANES: usize = 8;
/// A row of numbers, one per ray or edge of a cone: a cache line, and the widest register.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub(super) struct Lanes(pub [f64; LANES]);

impl Deref for Lanes {
    type Target = [f64; LANES];

    #[inline(always)]
    fn deref(&self) -> &[f64; LANES] {
        &self.0
    }
}

impl DerefMut for Lanes {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64; LANES] {
        &mut self.0
    }
}

/// Vectors by their components, a lane each; block after block.
pub(super) type Table<const N: usize> = Vec<[Lanes; N]>;

pub(super) fn zeros<const N: usize>(edges: usize) -> Table<N> {
    vec![[Lanes::default(); N]; edges.div_ceil(LANES)]
}

/// One vector of a table.
#[inline(always)]
pub(super) fn at<const N: usize>(table: &Table<N>, index: usize) -> [f64; N] {
    let block = &table[index / LANES];
    std::array::from_fn(|axis| block[axis][index % LANES])
}

/// Vectors (x, y, height) about e₃, padded with zeros to whole lanes.
pub(super) fn padded(
    vectors: impl Iterator<Item = [f64; 2]>,
    count: usize,
    height: f64,
) -> Table<3> {
    let mut table = zeros(count);
    for (index, [x, y]) in vectors.enumerate() {
        for (row, value) in table[index / LANES].iter_mut().zip([x, y, height]) {
            row[index % LANES] = value;
        }
    }
    table
}

/// What the kernel's formulas need of a number.
///
/// Where multiply-add is fused it is so by name, on every instruction set: all give the same bits.
pub(super) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// self · factor + addend, rounded once.
    fn mul_add(self, factor: Self, addend: Self) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        f64::mul_add(self, factor, addend)
    }
}

/// A vector register of numbers.
#[derive(Clone, Copy)]
pub(super) struct Lane<S: Simd> {
    simd: S,
    pub value: S::f64s,
}

impl<S: Simd> Lane<S> {
    #[inline(always)]
    pub fn new(simd: S, value: S::f64s) -> Self {
        Self { simd, value }
    }

    #[inline(always)]
    pub fn splat(simd: S, value: f64) -> Self {
        Self::new(simd, simd.splat_f64s(value))
    }

    /// Negated where the other's sign bit is set.
    #[inline(always)]
    pub fn signed_by(self, other: Self) -> Self {
        let sign = self.simd.and_f64s(other.value, self.simd.splat_f64s(-0.0));
        Self::new(self.simd, self.simd.xor_f64s(self.value, sign))
    }

    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.min_f64s(self.value, other.value))
    }

    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.max_f64s(self.value, other.value))
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        Self::new(self.simd, self.simd.abs_f64s(self.value))
    }

    /// 0 in the lanes in which `other` ≥ `low` does not hold.
    #[inline(always)]
    pub fn where_at_least(self, other: Self, low: Self) -> Self {
        let simd = self.simd;
        let mask = simd.greater_than_or_equal_f64s(other.value, low.value);
        Self::new(
            simd,
            simd.select_f64s(mask, self.value, simd.splat_f64s(0.0)),
        )
    }

    /// Is `self` ≥ `low` and `other` > 0 in any lane?
    #[inline(always)]
    pub fn any_at_least(self, low: Self, other: Self) -> bool {
        let simd = self.simd;
        let first = simd.greater_than_or_equal_f64s(self.value, low.value);
        let second = simd.greater_than_f64s(other.value, simd.splat_f64s(0.0));
        simd.first_true_m64s(simd.and_m64s(first, second)) < S::F64_LANES
    }
}

impl<S: Simd> Add for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.add_f64s(self.value, other.value))
    }
}

impl<S: Simd> Sub for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.sub_f64s(self.value, other.value))
    }
}

impl<S: Simd> Mul for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.mul_f64s(self.value, other.value))
    }
}

impl<S: Simd> Div for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.div_f64s(self.value, other.value))
    }
}

impl<S: Simd> Number for Lane<S> {
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        let simd = self.simd;
        Self::new(
            simd,
            simd.mul_add_f64s(self.value, factor.value, addend.value),
        )
    }
}

/// Without the care for NaN that `f64::max` takes: one instruction.
#[inline(always)]
pub(super) fn greatest(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// ⟨a, b⟩ in R⁶.
#[inline(always)]
pub(super) fn dot<T: Number>(a: &[T; 6], b: &[T; 6]) -> T {
    let first = a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]));
    let second = a[3].mul_add(b[3], a[4].mul_add(b[4], a[5] * b[5]));
    first + second
}

// Loops, where a closure would be shorter: a closure is compiled without the instruction set.

#[inline(always)]
pub(super) fn splat_each<S: Simd, const N: usize>(simd: S, values: [f64; N]) -> [Lane<S>; N] {
    let mut out = [Lane::splat(simd, 0.0); N];
    for i in 0..N {
        out[i] = Lane::splat(simd, values[i]);
    }
    out
}

/// One lane of each row, in all lanes.
#[inline(always)]
pub(super) fn splat_all<S: Simd, const N: usize>(
    simd: S,
    rows: &[Lanes; N],
    lane: usize,
) -> [Lane<S>; N] {
    let mut out = [Lane::splat(simd, 0.0); N];
    for i in 0..N {
        out[i] = Lane::splat(simd, rows[i][lane]);
    }
    out
}

/// Vector `v` of each row.
#[inline(always)]
pub(super) fn load<S: Simd, const N: usize>(simd: S, rows: &[Lanes; N], v: usize) -> [Lane<S>; N] {
    let mut out = [Lane::splat(simd, 0.0); N];
    for i in 0..N {
        out[i] = Lane::new(simd, S::as_simd_f64s(&rows[i].0).0[v]);
    }
    out
}

/// Sets vector `v` of each row.
#[inline(always)]
pub(super) fn store<S: Simd, const N: usize>(
    rows: &mut [Lanes; N],
    v: usize,
    values: [Lane<S>; N],
) {
    for i in 0..N {
        S::as_mut_simd_f64s(&mut rows[i].0).0[v] = values[i].value;
    }
}
