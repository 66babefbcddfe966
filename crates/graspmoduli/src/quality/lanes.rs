//! Formulas written once for one number and for a vector register of them.

use super::plane::Lanes;
use pulp::Simd;
use std::ops::{Add, Div, Mul, Sub};

/// What the kernel's formulas need of a number.
///
/// No fused multiply-add: every instruction set gives the same bits.
pub(super) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
}

impl Number for f64 {}

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

impl<S: Simd> Number for Lane<S> {}

/// ⟨a, b⟩ in R⁶.
#[inline(always)]
pub(super) fn dot<T: Number>(a: &[T; 6], b: &[T; 6]) -> T {
    let pair = |i: usize| a[i] * b[i];
    ((pair(0) + pair(1)) + (pair(2) + pair(3))) + (pair(4) + pair(5))
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

/// Vector `v` of a block of each table.
#[inline(always)]
pub(super) fn load<S: Simd, const N: usize>(
    simd: S,
    tables: &[Vec<Lanes>; N],
    block: usize,
    v: usize,
) -> [Lane<S>; N] {
    let mut out = [Lane::splat(simd, 0.0); N];
    for i in 0..N {
        out[i] = Lane::new(simd, vectors::<S>(&tables[i][block])[v]);
    }
    out
}

#[inline(always)]
fn vectors<S: Simd>(row: &Lanes) -> &[S::f64s] {
    S::as_simd_f64s(row).0
}

#[inline(always)]
pub(super) fn vectors_mut<S: Simd>(row: &mut Lanes) -> &mut [S::f64s] {
    S::as_mut_simd_f64s(row).0
}
