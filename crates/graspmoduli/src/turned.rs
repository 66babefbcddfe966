//! When grasps on a surface are different, and not one turned about a surface of revolution.

use crate::bundle::Coordinates;
use crate::math;
use crate::places::{Place, Wanted};
use crate::surface::Surface;
use glam::DVec3;

/// Of grasps that come best first those that differ, best first and no more than are wanted; turned
/// copies of a grasp on a surface of revolution only where there are too few others.
pub(crate) fn different(
    surface: &Surface,
    found: Vec<(Coordinates, f64)>,
    wanted: &Wanted<'_>,
) -> Vec<(Coordinates, f64)> {
    let mut kept: Vec<(Coordinates, f64)> = Vec::new();
    let turns = if surface.is_round() {
        [true, false].as_slice()
    } else {
        &[false]
    };
    for &turned in turns {
        for grasp in &found {
            let near =
                |other: &(Coordinates, f64)| alike(surface, &grasp.0, &other.0, wanted, turned);
            if kept.len() < wanted.top && !kept.iter().any(near) {
                kept.push(grasp.clone());
            }
        }
    }
    kept.sort_by(|a, b| b.1.total_cmp(&a.1));
    kept
}

/// Are two grasps the same, perhaps after a turn about the axis?
fn alike(
    surface: &Surface,
    one: &[[f64; 2]],
    other: &[[f64; 2]],
    wanted: &Wanted<'_>,
    turned: bool,
) -> bool {
    let places = |at: &[[f64; 2]], turn: f64| -> Vec<Place> {
        let (sin, cos) = math::sin_cos(turn);
        at.iter()
            .map(|&[u, theta]| {
                let DVec3 { x, y, z } = surface.contact(u, theta).point;
                let point = DVec3::new(x * cos - y * sin, x * sin + y * cos, z);
                Place::flat(point, DVec3::Z)
            })
            .collect()
    };
    let there = places(other, 0.0);
    if !turned {
        return !wanted.differ(&places(one, 0.0), &there);
    }
    other
        .iter()
        .any(|at| !wanted.differ(&places(one, at[1] - one[0][1]), &there))
}
