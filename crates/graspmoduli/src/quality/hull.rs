//! Hulls of listed points, or sums of such hulls: compiled for each instruction set and chosen at run
//! time.

use super::enough::Enough;
use super::facets::{EPSILON, Facets};
use super::instructions::instructions;
use super::metric::Metric;
use super::pivots::{First, first_simplex};
use super::points::Points;
use super::polytope::Distance;
use super::support::Levels;
use crate::contact::Norm;
use pulp::{Arch, Simd, WithSimd};

/// Of more lists than this a sum has so many corners that the polytope is as fast.
const MOST_EACH: usize = 5;

/// Working memory for the distance of such a hull's boundary from the origin.
#[derive(Debug, Clone)]
pub(super) struct Hull {
    arch: Arch,
    facets: Facets,
}

impl Hull {
    pub fn new() -> Self {
        Self::on(instructions())
    }

    pub fn on(arch: Arch) -> Self {
        Self {
            arch,
            facets: Facets::default(),
        }
    }

    /// The distance from the origin to the boundary of the hull by a metric, or bounds of it that
    /// are enough; `None` where it is not clear beyond rounding.
    pub fn distance(
        &mut self,
        points: &mut Points,
        norm: Norm,
        metric: Metric,
        enough: Enough,
    ) -> Option<Distance> {
        if !metric.is_tame() || (norm == Norm::Each && points.groups() > MOST_EACH) {
            return None;
        }
        self.arch.dispatch(Ask {
            facets: &mut self.facets,
            points,
            norm,
            metric,
            enough,
        })
    }
}

struct Ask<'a> {
    facets: &'a mut Facets,
    points: &'a mut Points,
    norm: Norm,
    metric: Metric,
    enough: Enough,
}

impl WithSimd for Ask<'_> {
    type Output = Option<Distance>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<Distance> {
        let Self {
            facets,
            points,
            norm,
            metric,
            enough,
        } = self;
        let levels = Levels {
            epsilon: EPSILON,
            salt: 0,
        };
        match first_simplex(simd, points, norm, levels) {
            First::Separated(x) => Some(Distance::zero(x)),
            First::Unclear => None,
            First::About(first) => {
                facets.distance(simd, &first, points, norm, levels, metric, enough)
            }
        }
    }
}
