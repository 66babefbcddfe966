//! Which facets of a simplicial polytope in R⁶ are neighbours, by masks of their points.

/// Points at a time: bits of a mask.
pub(super) const MOST_POINTS: usize = 64;
/// Six points of those that are inserted, a bit each.
pub(super) type Mask = u64;

/// For each point those of up to 64 facets that are without it, a bit each.
pub(super) struct Missing([u64; MOST_POINTS]);

impl Missing {
    /// Of those facets that `part` lists.
    #[inline(always)]
    pub fn of(masks: &[Mask], part: &[u32]) -> Self {
        let mut missing = [u64::MAX; MOST_POINTS];
        for (bit, &facet) in part.iter().enumerate() {
            let mut rest = masks[facet as usize];
            for _ in 0..6 {
                missing[rest.trailing_zeros() as usize % MOST_POINTS] &= !(1 << bit);
                rest &= rest.wrapping_sub(1);
            }
        }
        Self(missing)
    }

    /// Which of them lack just one point of another facet: its neighbours, a bit each.
    #[inline(always)]
    pub fn neighbors(&self, mut mask: Mask) -> u64 {
        let (mut once, mut twice) = (0, 0);
        for _ in 0..6 {
            let missing = self.0[mask.trailing_zeros() as usize % MOST_POINTS];
            mask &= mask.wrapping_sub(1);
            twice |= once & missing;
            once |= missing;
        }
        once & !twice
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbors_share_all_points_but_one() {
        let masks = [0b0011_1111, 0b0111_1110, 0b1111_1100, 0b0111_1011];
        let missing = Missing::of(&masks, &[0, 1, 2, 3]);
        for (k, &mask) in masks.iter().enumerate() {
            let wanted = (0..4).filter(|&other| (masks[other] & mask).count_ones() == 5);
            let wanted = wanted.fold(0, |bits, other| bits | 1 << other);
            assert_eq!(missing.neighbors(mask), wanted, "{k}");
        }
        assert_eq!(missing.neighbors(0b1_1111 << 59 | 1), 0);
    }
}
