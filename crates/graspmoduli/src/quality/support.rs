//! Convex hulls in R⁶ that are known by their farthest points only, and the levels at which these
//! count.

use super::r6::Twist;

/// A convex hull by its farthest points.
pub(super) trait Support {
    /// A point of the hull with the greatest ⟨x, p⟩, and a number that identifies it.
    fn farthest(&self, x: &Twist) -> (Twist, u64);
    /// A point in the interior of the hull, relative to its dimension, in general position; other
    /// levels give another.
    fn inside(&self, levels: Levels) -> Twist;
    /// About how far the hull reaches from the origin; not less.
    fn size(&self) -> f64;
}

/// The levels 1 + ε_p at which points count.
#[derive(Debug, Clone, Copy)]
pub(super) struct Levels {
    pub epsilon: f64,
    /// Tells one attempt's levels from another's.
    pub salt: u64,
}

impl Levels {
    /// The level of the point with this key.
    #[inline]
    pub fn of(self, key: u64) -> f64 {
        1.0 + self.epsilon * self.spread(key)
    }

    /// Numbers in [0.5, 1] that no relation among the points knows of.
    #[inline]
    pub fn spread(self, key: u64) -> f64 {
        0.5 + 0.5 * (mix(key ^ self.salt) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// The finaliser of SplitMix64.
pub(super) fn mix(key: u64) -> u64 {
    let mut z = key.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
