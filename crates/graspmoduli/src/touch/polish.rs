//! Ascent of a grasp's quality on the mesh itself: every step is a tip pressed anew.

use super::map::place;
use super::mesh::Mesh;
use super::press::Tip;
use crate::contact::Frame;
use crate::math;
use crate::places::{Place, Wanted};
use crate::quality::Evaluator;
use std::f64::consts::TAU;

/// Rounds, each over all fingers.
pub const ROUNDS: usize = 12;
/// Directions in which a finger is tried.
const DIRECTIONS: usize = 8;
/// The first step, over the object's size: about the distance between the places of a map.
const STEP: f64 = 0.02;
/// Steps become shorter by this where none helps.
const SHORTER: f64 = 0.5;

/// The grasp moved finger by finger while its quality grows, over places that are at least as flat
/// as `limit` asks, and steady if all were.
pub fn polish(
    mesh: &Mesh,
    tip: &Tip,
    grasp: &[Place],
    limit: f64,
    rounds: usize,
    wanted: &Wanted<'_>,
    evaluator: &mut Evaluator,
) -> Vec<Place> {
    let steady = grasp.iter().all(|place| place.steady);
    let mut at = grasp.to_vec();
    let mut best = wanted.value(evaluator, &at);
    let mut step = STEP;
    for _ in 0..rounds {
        let before = best;
        for finger in 0..at.len() {
            let [x, y] = Frame::new(at[finger].normal).tangents;
            let from = at[finger];
            for k in 0..DIRECTIONS {
                let (sin, cos) = math::sin_cos(TAU * k as f64 / DIRECTIONS as f64);
                let aim = from.point + (x * cos + y * sin) * step;
                let Some(felt) = tip.press(mesh, aim, from.normal) else {
                    continue;
                };
                let Some(landing) = felt.landing else {
                    continue;
                };
                // Half of the rays are saved where it would be no gain.
                let hopeful = Place {
                    point: landing.point,
                    normal: felt.felt,
                    ..from
                };
                let trial = with(&at, finger, hopeful);
                if wanted.better(evaluator, &trial, best).is_none() {
                    continue;
                }
                let Some(new) = place(mesh, tip, landing.point, felt.felt) else {
                    continue;
                };
                if new.off > limit || (steady && !new.steady) {
                    continue;
                }
                let trial = with(&at, finger, new);
                if !wanted.allow_one(&trial, finger) {
                    continue;
                }
                if let Some(quality) = wanted.better(evaluator, &trial, best) {
                    (best, at) = (quality, trial);
                }
            }
        }
        if best <= before * (1.0 + 1e-4) {
            step *= SHORTER;
        }
    }
    at
}

fn with(places: &[Place], finger: usize, place: Place) -> Vec<Place> {
    let mut other = places.to_vec();
    other[finger] = place;
    other
}
