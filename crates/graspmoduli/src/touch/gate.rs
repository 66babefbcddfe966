//! What of a grasp is true: what rays, balls and badly aimed fingers find at its contacts.

use super::OUTSIDE;
use super::mesh::Mesh;
use super::press::{ALIKE, ASIDE, Tip, around, land_along};
use crate::contact::{Contact, Frame};
use crate::math;
use crate::places::{Place, Wanted};
use crate::quality::Evaluator;
use glam::DVec3;
use std::f64::consts::TAU;

/// With exact normals, and by the ball, this share of the quality must be left.
const LEFT: f64 = 0.1;
/// A ball must touch this close to the contact, over its radius.
const BESIDE: f64 = 0.6;
/// Where a finger aims that is to press at a place: there, or beside it.
const AIMS: usize = 1 + ASIDE;
/// Errors of aim: how many combinations are tried; and how many tell of any two fingers all.
const DRAWS: usize = 2 * PAIRS;
const PAIRS: usize = AIMS * AIMS;
/// Force closure of less quality is none.
const LEAST: f64 = 1e-9;
/// Rings about the axis of a finger, over the tip's radius, and rays on each.
const ROOM: [f64; 5] = [1.0, 1.5, 2.0, 3.0, 4.0];
const AROUND: usize = 12;

/// What the mesh says of a grasp.
#[derive(Debug, Clone, PartialEq)]
pub struct Checked {
    /// Q_l with the normals of the triangles on which rays land.
    pub exact: f64,
    /// Q_l of balls of the tip's radius: where they touch first, and the directions there.
    pub ball: f64,
    /// Share of combinations of errors of aim under which the grasp is force closure.
    pub holds: f64,
    /// Q_l that nine of ten of these reach.
    pub low: f64,
    /// For each contact.
    pub contacts: Vec<CheckedContact>,
}

/// What the mesh says of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckedContact {
    /// From the nearest point of the mesh.
    pub distance: f64,
    /// Cosine of the angle between the normal felt and that of the triangle.
    pub cosine: f64,
    /// Radius about the finger's axis within which nothing stands in its way.
    pub clearance: f64,
}

/// The checks, or `None` if the grasp is not true: if a ray or a ball does not land at a contact,
/// if the triangle there is turned by more than 30°, or if there is no force closure with the exact
/// normals or by the balls.
pub fn check(
    mesh: &Mesh,
    tip: &Tip,
    places: &[Place],
    quality: f64,
    wanted: &Wanted<'_>,
    evaluator: &mut Evaluator,
) -> Option<Checked> {
    if quality <= 0.0 {
        return None;
    }
    let mut exact = Vec::new();
    let mut touched = Vec::new();
    let mut contacts = Vec::new();
    for place in places {
        let landing = land_along(mesh, place.point, place.normal)?;
        let cosine = landing.normal.dot(place.normal);
        // The contact is where such a ray landed before.
        if (landing.point - place.point).length() > 1e-6 || cosine < ALIKE {
            return None;
        }
        exact.push(wanted.contact(landing.point, landing.normal));
        let start = place.point - place.normal * OUTSIDE;
        let touch = mesh.sweep(start, place.normal, tip.radius())?;
        if (touch.point - place.point).length() > BESIDE * tip.radius() {
            return None;
        }
        let middle = start + place.normal * touch.distance;
        let normal = (touch.point - middle) / tip.radius();
        touched.push(wanted.contact(touch.point, normal.normalize()));
        let (near, _) = mesh.nearest(place.point)?;
        contacts.push(CheckedContact {
            distance: (near - place.point).length(),
            cosine,
            clearance: clearance(mesh, tip, place),
        });
    }
    let exact = evaluator.quality(&exact, DVec3::ZERO);
    let ball = evaluator.quality(&touched, DVec3::ZERO);
    if exact < LEFT * quality || ball < LEFT * quality {
        return None;
    }
    let (holds, low) = under_errors(mesh, tip, places, wanted, evaluator);
    Some(Checked {
        exact,
        ball,
        holds,
        low,
        contacts,
    })
}

/// The widest ring about the axis in which no ray is stopped a tip's radius before the contact.
fn clearance(mesh: &Mesh, tip: &Tip, place: &Place) -> f64 {
    let [x, y] = Frame::new(place.normal).tangents;
    let mut free = 0.0;
    for ring in ROOM {
        let radius = ring * tip.radius();
        let open = (0..AROUND).all(|k| {
            let (sin, cos) = math::sin_cos(TAU * k as f64 / AROUND as f64);
            let start = place.point + (x * cos + y * sin) * radius - place.normal * OUTSIDE;
            mesh.ray(start, place.normal)
                .is_none_or(|hit| hit.distance > OUTSIDE - tip.radius())
        });
        if !open {
            break;
        }
        free = radius;
    }
    free
}

/// What a finger touches that aims at a place or beside it; `None` where it misses.
pub(super) type Aims = [Option<Contact>; AIMS];

/// What a finger touches that is to press at a place.
pub(super) fn aims(mesh: &Mesh, tip: &Tip, place: &Place, wanted: &Wanted<'_>) -> Aims {
    let beside = around(place.point, place.normal, wanted.errors);
    std::array::from_fn(|k| {
        let aim = if k == 0 { place.point } else { beside[k - 1] };
        let pressed = tip.press(mesh, aim, place.normal)?;
        let landing = pressed.landing?;
        Some(wanted.contact(landing.point, pressed.felt))
    })
}

/// Share of force closures among fingers that aim beside their contacts, and the quality that nine
/// of ten reach. A finger that misses has none.
fn under_errors(
    mesh: &Mesh,
    tip: &Tip,
    places: &[Place],
    wanted: &Wanted<'_>,
    evaluator: &mut Evaluator,
) -> (f64, f64) {
    let aims: Vec<_> = places
        .iter()
        .map(|place| aims(mesh, tip, place, wanted))
        .collect();
    let mut values: Vec<f64> = (0..DRAWS)
        .map(|draw| {
            drawn(aims.iter(), draw)
                .map_or(0.0, |contacts| evaluator.quality(&contacts, DVec3::ZERO))
        })
        .collect();
    values.sort_by(f64::total_cmp);
    let lost = values.partition_point(|&value| value <= 0.0);
    (1.0 - lost as f64 / DRAWS as f64, values[DRAWS / 10])
}

/// In how many errors of aim force closure is lost, as soon as it is more than `most`.
pub(super) fn lost(aims: &[&Aims], most: usize, evaluator: &mut Evaluator) -> usize {
    let mut lost = 0;
    for draw in 0..PAIRS {
        let holds = drawn(aims.iter().copied(), draw)
            .is_some_and(|contacts| evaluator.is_at_least(&contacts, DVec3::ZERO, LEAST));
        lost += usize::from(!holds);
        if lost > most {
            break;
        }
    }
    lost
}

fn drawn<'a>(aims: impl Iterator<Item = &'a Aims>, draw: usize) -> Option<Vec<Contact>> {
    aims.enumerate()
        .map(|(finger, own)| own[choice(draw, finger)])
        .collect()
}

/// Which of its aims a finger takes: any two fingers, of up to thirteen, all pairs equally often
/// (orthogonal arrays of strength 2, R. Bose, K. Bush, 1952).
fn choice(draw: usize, finger: usize) -> usize {
    let (one, other, more) = (draw % AIMS, draw / AIMS % AIMS, draw / PAIRS);
    match finger {
        0 => one,
        _ => (other + (finger - 1) * (one + 5 * more)) % AIMS,
    }
}
