//! When a search for a distance may end with bounds of it.

/// When the search may end before the distance is known.
#[derive(Debug, Clone, Copy)]
pub(super) enum Enough {
    Never,
    /// The distance is below this.
    Below(f64),
    /// The distance is at least this.
    AtLeast(f64),
}

impl Enough {
    /// Are these bounds enough?
    #[inline(always)]
    pub fn are(self, lower: f64, upper: f64) -> bool {
        match self {
            Enough::Never => false,
            Enough::Below(threshold) => upper < threshold,
            Enough::AtLeast(threshold) => lower >= threshold,
        }
    }
}
