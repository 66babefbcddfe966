//! Where fingertips may press.

use super::mesh::Mesh;
use super::press::{ALIKE, Pressed, Tip, land_along};
use crate::parallel::*;
use crate::places::Place;
use glam::DVec3;

/// A sample is seen from outside if the ray along its normal lands this close to it.
const SEEN: f64 = 3e-3;
/// A tip that is stopped farther than this before its middle touches, over its radius, is blocked.
const BLOCKED: f64 = 0.35;
/// Farther from where it aimed no tip may land.
const NEAR: f64 = 0.03;
/// cos 20°: what a tip feels must be so close to how it comes.
const STRAIGHT: f64 = 0.939_692_620_785_908_4;

/// The places found from samples of the area, a row of three random numbers in [0, 1) for each; the
/// same for any number of threads.
pub fn map(mesh: &Mesh, tip: &Tip, random: &[[f64; 3]]) -> Vec<Place> {
    if mesh.is_empty() {
        return Vec::new();
    }
    let count = random.len() as f64;
    random
        .par_iter()
        .enumerate()
        .flat_map_iter(|(k, &[jitter, a, b])| {
            let (point, face) = mesh.at_area((k as f64 + jitter) / count, [a, b]);
            let normal = mesh.normal(face);
            // The winding is not to be trusted.
            [normal, -normal]
                .into_iter()
                .filter(move |&way| is_seen(mesh, point, way))
                .filter_map(move |way| settle(mesh, tip, point, way))
        })
        .collect()
}

fn is_seen(mesh: &Mesh, point: DVec3, way: DVec3) -> bool {
    land_along(mesh, point, way).is_some_and(|l| (l.point - point).length() < SEEN)
}

/// A tip aimed at a point, turned twice to what it feels; `None` where it may not press.
pub fn settle(mesh: &Mesh, tip: &Tip, aim: DVec3, way: DVec3) -> Option<Place> {
    let first = tip.press(mesh, aim, way)?;
    let second = tip.press(mesh, aim, first.felt)?;
    place(mesh, tip, aim, second.felt)
}

/// The place where a tip lands, if it may press there.
pub fn place(mesh: &Mesh, tip: &Tip, aim: DVec3, way: DVec3) -> Option<Place> {
    let pressed = tip.press(mesh, aim, way)?;
    let landing = pressed.landing?;
    if !is_fit(&pressed, way) || (landing.point - aim).length() >= NEAR {
        return None;
    }
    let room = NEAR + 0.5 * tip.radius();
    let steady = tip.fan(mesh, landing.point, way).iter().all(|beside| {
        beside.is_some_and(|l| {
            (l.point - landing.point).dot(way).abs() < room && l.normal.dot(way) > ALIKE
        })
    });
    Some(Place {
        point: landing.point,
        normal: way,
        off: pressed.off,
        bearing: pressed.bearing,
        steady,
    })
}

fn is_fit(pressed: &Pressed, way: DVec3) -> bool {
    pressed.blocked < BLOCKED && pressed.felt.dot(way) > STRAIGHT
}
