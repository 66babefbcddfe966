//! Which contacts may be in a grasp together.

/// A bit for each pair of contacts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Together {
    words: usize,
    bits: Vec<u64>,
}

impl Together {
    /// For `count` contacts, asked of each pair once.
    pub fn new(count: usize, allows: impl Fn(usize, usize) -> bool) -> Self {
        let words = count.div_ceil(64);
        let mut bits = vec![0; count * words];
        for i in 0..count {
            for j in 0..i {
                if allows(j, i) {
                    bits[i * words + j / 64] |= 1 << (j % 64);
                    bits[j * words + i / 64] |= 1 << (i % 64);
                }
            }
        }
        Self { words, bits }
    }

    /// How many pairs may be together.
    pub fn pairs(&self) -> u64 {
        self.bits
            .iter()
            .map(|word| u64::from(word.count_ones()))
            .sum::<u64>()
            / 2
    }

    /// May two different contacts be together?
    pub(super) fn allows(&self, i: usize, j: usize) -> bool {
        self.bits[i * self.words + j / 64] >> (j % 64) & 1 == 1
    }

    /// May all of the contacts be together?
    pub(super) fn allow_all(&self, indices: &[usize]) -> bool {
        indices
            .iter()
            .enumerate()
            .all(|(k, &i)| indices[..k].iter().all(|&j| self.allows(i, j)))
    }

    /// The first contact from `from` on that may be with all of the chosen ones.
    pub(super) fn next(&self, chosen: &[usize], from: usize) -> Option<usize> {
        (from / 64..self.words).find_map(|word| {
            let mut open = u64::MAX;
            for &i in chosen {
                open &= self.bits[i * self.words + word];
            }
            if word == from / 64 {
                open &= u64::MAX << (from % 64);
            }
            (open != 0).then(|| word * 64 + open.trailing_zeros() as usize)
        })
    }
}
