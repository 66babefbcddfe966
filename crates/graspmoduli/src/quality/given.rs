//! The quality of wrenches that are given themselves: cones of any kind, suction, limits of force.

use super::Twist;
use super::enough::Enough;
use super::hull::Hull;
use super::metric::Metric;
use super::points::Points;
use super::polytope::Polytope;
use super::r6::dot;
use super::support::{Levels, Support};
use super::wrenches::{Reference, mean};
use crate::contact::Norm;
use crate::error::Error;
use crate::parallel::*;
use glam::DVec3;
use std::sync::atomic::{AtomicBool, Ordering};

/// The convex hull of some wrenches.
struct Given(Vec<Twist>);

impl Support for Given {
    fn farthest(&self, x: &Twist) -> (Twist, u64) {
        let (mut index, mut height) = (0, f64::NEG_INFINITY);
        for (k, wrench) in self.0.iter().enumerate() {
            let own = dot(x, wrench);
            if own > height {
                (index, height) = (k, own);
            }
        }
        (self.0[index], index as u64)
    }

    fn inside(&self, levels: Levels) -> Twist {
        mean((0..).zip(&self.0).map(|(key, w)| (levels.spread(key), *w)))
    }

    fn size(&self) -> f64 {
        self.0.iter().map(|w| dot(w, w)).fold(0.0, f64::max).sqrt()
    }
}

/// What one of the functions below says of each of many hulls of `count` wrenches, in parallel.
pub fn of_each<const N: usize>(
    one: impl Fn(&[[f64; N]]) -> Result<f64, Error> + Sync,
    wrenches: &[[f64; N]],
    count: usize,
    stop: &AtomicBool,
) -> Result<Vec<f64>, Error> {
    (0..wrenches.len() / count.max(1))
        .into_par_iter()
        .map(|hull| {
            if stop.load(Ordering::Relaxed) {
                return Err(Error::Interrupted);
            }
            one(&wrenches[hull * count..][..count]).map_err(|error| match error {
                Error::NotConverged { lower, upper, .. } => Error::NotConverged {
                    grasp: hull,
                    lower,
                    upper,
                },
                error => error,
            })
        })
        .collect()
}

/// The distance from the origin to the boundary of the wrenches' convex hull; 0 if the origin is not
/// in its interior. Wrenches are finite; lengths are those of their own coordinates.
///
/// It does not depend on the order of the wrenches, to the bit.
pub fn of_wrenches(wrenches: &[Twist]) -> Result<f64, Error> {
    let longest = |from: usize| {
        let squares = wrenches
            .iter()
            .map(|w| w[from..from + 3].iter().map(|c| c * c).sum::<f64>());
        squares.fold(0.0, f64::max).sqrt()
    };
    let (force, torque) = (longest(0), longest(3));
    if force == 0.0 || torque == 0.0 {
        return Ok(0.0);
    }
    // Forces and torques of about 1 each: what is flat, is flat whatever the unit.
    let mut scaled: Vec<Twist> = wrenches
        .iter()
        .map(|w| std::array::from_fn(|i| w[i] / if i < 3 { force } else { torque }))
        .collect();
    scaled.sort_unstable_by(|a, b| {
        let unequal = a.iter().zip(b).map(|(a, b)| a.total_cmp(b));
        unequal.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
    });
    scaled.dedup();
    let reference = Reference {
        point: DVec3::ZERO,
        scale: torque / force,
    };
    let metric = Metric::new(reference, DVec3::ZERO);
    let mut points = Points::default();
    points.shape(scaled.len(), 1);
    for (index, point) in scaled.iter().enumerate() {
        points.set(0, index, point);
    }
    points.fill(0);
    let found = Hull::new()
        .distance(&mut points, Norm::Sum, metric, Enough::Never)
        .unwrap_or_else(|| Polytope::default().distance(&Given(scaled), metric, |_, _| false));
    if found.converged {
        return Ok(found.upper * force);
    }
    Err(Error::NotConverged {
        grasp: 0,
        lower: found.lower * force,
        upper: found.upper * force,
    })
}

/// As [`of_wrenches`], of forces (f_x, f_y) and torques in the plane.
///
/// Three dimensions are added in which the hull reaches as far as its longest wrench w along either
/// sense of each axis. Its support function is the larger one of both then, and the least on the
/// unit sphere is d = h/√(1 + 3h²/w²) for the h of the plane, which grows with h.
pub fn of_plane_wrenches(wrenches: &[[f64; 3]]) -> Result<f64, Error> {
    let square = |w: &[f64; 3]| w.iter().map(|c| c * c).sum::<f64>();
    let longest = wrenches.iter().map(square).fold(0.0, f64::max).sqrt();
    if longest == 0.0 {
        return Ok(0.0);
    }
    // The torque counts as a force of the first three, so that one scale serves all.
    let mut all: Vec<Twist> = wrenches
        .iter()
        .map(|&[x, y, t]| [x / longest, y / longest, t / longest, 0.0, 0.0, 0.0])
        .collect();
    for axis in 3..6 {
        for sign in [1.0, -1.0] {
            all.push(std::array::from_fn(|i| if i == axis { sign } else { 0.0 }));
        }
    }
    let d = of_wrenches(&all)?;
    Ok(longest * d / (1.0 - 3.0 * d * d).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cross-polytope of radius 1.
    fn cross<const N: usize>() -> Vec<[f64; N]> {
        let unit = |k: usize, sign: f64| std::array::from_fn(|i| if i == k { sign } else { 0.0 });
        (0..N).flat_map(|k| [unit(k, 1.0), unit(k, -1.0)]).collect()
    }

    #[test]
    fn the_cross_polytope_is_that_far() {
        assert!((of_wrenches(&cross::<6>()).unwrap() - 1.0 / 6f64.sqrt()).abs() < 1e-14);
        assert!((of_plane_wrenches(&cross::<3>()).unwrap() - 1.0 / 3f64.sqrt()).abs() < 1e-14);
    }

    #[test]
    fn without_the_origin_inside_it_is_zero() {
        let mut half = cross::<6>();
        half.pop();
        assert_eq!(of_wrenches(&half), Ok(0.0));
        assert_eq!(of_wrenches(&[]), Ok(0.0));
        assert_eq!(
            of_plane_wrenches(&[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]),
            Ok(0.0)
        );
    }
}
