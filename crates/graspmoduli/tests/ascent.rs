//! Ascents, synthesis and transfers: do they end at maxima, the same ones whatever the last bit?

// What is tested does not hang on the last bit.
#![allow(clippy::disallowed_methods)]

use graspmoduli::ascent::Coordinates;
use graspmoduli::contact::FrictionCone;
use graspmoduli::error::Error;
use graspmoduli::quality::Evaluator;
use graspmoduli::region::{Anywhere, Cells, Region};
use graspmoduli::surface::Surface;
use graspmoduli::synthesis::{Synthesized, synthesize};
use graspmoduli::transfer::{Carried, Deformation};
use std::f64::consts::TAU;
use std::sync::atomic::AtomicBool;

/// What neither random steps nor a second ascent may gain, relative to Q.
const NOTHING: f64 = 1e-5;

struct Draws(u64);

impl Draws {
    /// Uniform in [0, 1).
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Nobody stops these.
static GO: AtomicBool = AtomicBool::new(false);

/// Radii (1 + bump · wave) at the knots, stretched across x by `flat`.
fn surface(flat: f64, bump: f64, seed: u64, noise: f64) -> Surface {
    let (rows, columns) = (9, 16);
    let mut draws = Draws(seed);
    let coefficients = (0..rows * columns)
        .map(|k| {
            let (row, column) = (k / columns, k % columns);
            let angle = TAU * column as f64 / columns as f64;
            let ellipse = 0.4 / (angle.cos().powi(2) + (angle.sin() / flat).powi(2)).sqrt();
            let height = row as f64 / (rows - 1) as f64;
            let wave = (5.0 * height + 1.0).sin() * (2.0 * angle + 1.0).cos();
            ellipse * (1.0 + bump * wave) * (1.0 + noise * (2.0 * draws.next() - 1.0))
        })
        .collect();
    Surface::new(-0.7, 0.8, columns, coefficients).unwrap()
}

/// Of revolution, symmetric about two planes, and without symmetry.
fn surfaces() -> [Surface; 3] {
    [(1.0, 0.0), (0.6, 0.0), (0.8, 0.15)].map(|(flat, bump)| surface(flat, bump, 1, 0.0))
}

fn cone() -> FrictionCone {
    FrictionCone::new(1.0, 8).unwrap()
}

fn square() -> Vec<[f64; 2]> {
    let mut draws = Draws(3);
    (0..40).map(|_| [draws.next(), draws.next()]).collect()
}

fn found(surface: &Surface, region: &dyn Region, top: usize, starts: usize) -> Vec<Synthesized> {
    let center = surface.integrals().center_of_mass;
    synthesize(
        surface,
        center,
        &cone(),
        region,
        top,
        starts,
        &square(),
        &GO,
    )
    .unwrap()
}

fn carried(from: &Surface, to: &Surface, at: Coordinates, region: &dyn Region) -> Carried {
    let way = Deformation::new(from, to).unwrap();
    way.by_ascent(&[at], &cone(), region, &GO)
        .unwrap()
        .remove(0)
}

fn three(at: &[[f64; 2]]) -> Coordinates {
    [at[0], at[1], at[2]]
}

/// The best of random steps from a grasp, of every size, within the region.
fn best_step(surface: &Surface, at: &Coordinates, region: &dyn Region, steps: usize) -> f64 {
    let center = surface.integrals().center_of_mass;
    let mut evaluator = Evaluator::new(&cone());
    let mut draws = Draws(at[0][0].to_bits());
    let mut best = 0.0;
    for _ in 0..steps {
        let mut step: [f64; 6] = std::array::from_fn(|_| 2.0 * draws.next() - 1.0);
        let length = step.iter().map(|x| x * x).sum::<f64>().sqrt();
        let size = 10f64.powf(-6.0 + 5.0 * draws.next());
        step = step.map(|x| x * size / length);
        let there: Coordinates = std::array::from_fn(|i| {
            [
                (at[i][0] + step[2 * i]).clamp(0.0, 1.0),
                (at[i][1] + step[2 * i + 1]).rem_euclid(TAU),
            ]
        });
        if there.iter().all(|&[u, theta]| region.allows(u, theta)) {
            let contacts = there.map(|[u, theta]| surface.contact(u, theta));
            best = evaluator.quality(&contacts, center).max(best);
        }
    }
    best
}

#[test]
fn nothing_near_a_synthesised_grasp_is_better() {
    for surface in surfaces() {
        let grasps = found(&surface, &Anywhere, 3, 4);
        assert!(grasps.len() >= 2);
        for grasp in grasps {
            let most = grasp.quality * (1.0 + NOTHING);
            assert!(best_step(&surface, &grasp.coordinates, &Anywhere, 10_000) <= most);
            let again = carried(&surface, &surface, grasp.coordinates, &Anywhere);
            assert!(again.path.last().unwrap()[1] <= most);
        }
    }
}

#[test]
fn nothing_near_the_end_of_a_transfer_is_better() {
    let all = surfaces();
    for from in &all {
        let start = found(from, &Anywhere, 1, 2)[0].coordinates;
        for to in &all {
            let end = carried(from, to, start, &Anywhere);
            let (at, quality) = (three(&end.coordinates), end.path.last().unwrap()[1]);
            let contacts = at.map(|[u, theta]| to.contact(u, theta));
            let center = to.integrals().center_of_mass;
            let own = Evaluator::new(&cone()).quality(&contacts, center);
            assert!((own - quality).abs() < 1e-12);
            assert!(quality > 0.0);
            assert!(best_step(to, &at, &Anywhere, 10_000) <= quality * (1.0 + NOTHING));
            let again = carried(to, to, at, &Anywhere).path.last().unwrap()[1];
            assert!(again <= quality * (1.0 + NOTHING), "{quality} {again}");
        }
    }
}

#[test]
fn nothing_allowed_near_a_grasp_in_allowed_cells_is_better() {
    let (rows, columns) = (12, 18);
    let mut at_edges = 0;
    for surface in surfaces() {
        // Not where it would be best: contacts end at the edges.
        let best = found(&surface, &Anywhere, 1, 2)[0].coordinates;
        let forbidden = |row: usize, column: usize| {
            best.iter().any(|[u, theta]| {
                let across = (column as f64 + 0.5) * TAU / columns as f64 - theta;
                let turn = across.rem_euclid(TAU);
                (u - (row as f64 + 0.5) / rows as f64).abs() < 0.1 && turn.min(TAU - turn) < 0.5
            })
        };
        let allowed: Vec<bool> = (0..rows * columns)
            .map(|cell| !forbidden(cell / columns, cell % columns))
            .collect();
        let region = Cells {
            allowed: &allowed,
            columns,
        };
        let grasps = found(&surface, &region, 3, 4);
        assert!(!grasps.is_empty());
        for grasp in grasps {
            let at = grasp.coordinates;
            assert!(at.iter().all(|&[u, theta]| region.allows(u, theta)));
            at_edges += at
                .iter()
                .flat_map(|&contact| region.room(contact))
                .flatten()
                .filter(|room| *room < 1e-6)
                .count();
            let most = grasp.quality * (1.0 + NOTHING);
            assert!(best_step(&surface, &at, &region, 10_000) <= most);
        }
    }
    assert!(at_edges > 0);
}

#[test]
fn the_last_bits_of_a_surface_do_not_choose_another_grasp() {
    for (flat, bump) in [(1.0, 0.0), (0.6, 0.0), (0.8, 0.15)] {
        let plain = found(&surface(flat, bump, 1, 0.0), &Anywhere, 4, 5);
        for seed in 1..4 {
            let other = found(&surface(flat, bump, seed, 1e-14), &Anywhere, 4, 5);
            assert_eq!(plain.len(), other.len());
            for (a, b) in plain.iter().zip(&other) {
                assert!((a.quality - b.quality).abs() < 1e-8, "{plain:?} {other:?}");
                for (one, two) in a.coordinates.iter().zip(&b.coordinates) {
                    let turn = (one[1] - two[1]).rem_euclid(TAU);
                    // Where Q is flat the place is less certain than the quality.
                    assert!((one[0] - two[0]).abs().max(turn.min(TAU - turn)) < 1e-4);
                }
            }
        }
    }
}

#[test]
fn contacts_come_in_order() {
    for surface in surfaces() {
        for grasp in found(&surface, &Anywhere, 4, 5) {
            let [a, b, c] = grasp.coordinates.map(|[u, _]| u);
            assert!(a < b + 1e-3 && b < c + 1e-3);
        }
    }
}

#[test]
fn any_number_of_grasps_and_starts_can_be_asked_for() {
    let surface = surface(0.6, 0.0, 1, 0.0);
    assert_eq!(found(&surface, &Anywhere, 0, 4), []);
    // Without a start of the heuristic there are the samples.
    assert!(!found(&surface, &Anywhere, 1, 0).is_empty());
    let many = found(&surface, &Anywhere, 1 << 61, 2);
    assert!(many.len() > found(&surface, &Anywhere, 2, 2).len());
    assert!(!found(&surface, &Anywhere, 1, 1 << 63).is_empty());
}

#[test]
fn where_nothing_is_allowed_there_is_no_grasp() {
    let surface = surface(0.6, 0.0, 1, 0.0);
    let start = found(&surface, &Anywhere, 1, 2)[0].coordinates;
    for (allowed, columns) in [
        (vec![false; 12], 4),
        (vec![true; 12], 0),
        (vec![true; 3], 4),
        (vec![], 4),
        (vec![], 0),
    ] {
        let region = Cells {
            allowed: &allowed,
            columns,
        };
        assert!(!region.allows(0.3, 1.0));
        assert_eq!(region.nearest([0.3, 1.0], [1.0; 2]), None);
        assert_eq!(region.room([0.3, 1.0]), [[0.0; 2]; 2]);
        assert_eq!(found(&surface, &region, 2, 3), []);
        let end = carried(&surface, &surface, start, &region);
        assert_eq!(end.path.last(), Some(&[1.0, 0.0]));
        assert_eq!(three(&end.coordinates), start);
    }
}

#[test]
fn room_is_how_far_one_can_walk() {
    let (rows, columns) = (7, 5);
    let mut draws = Draws(9);
    for _ in 0..200 {
        let allowed: Vec<bool> = (0..rows * columns).map(|_| draws.next() < 0.7).collect();
        let region = Cells {
            allowed: &allowed,
            columns,
        };
        let at = [draws.next(), TAU * draws.next()];
        let room = region.room(at);
        for (axis, sides) in room.iter().enumerate() {
            for (room, sign) in sides.iter().zip([-1.0, 1.0]) {
                let end = |by: f64| {
                    let mut to = at;
                    to[axis] += sign * by;
                    to
                };
                if !region.allows(at[0], at[1]) {
                    assert_eq!(*room, 0.0);
                    continue;
                }
                for share in 0..=50 {
                    let [u, theta] = end(room * share as f64 / 50.0);
                    assert!(region.allows(u, theta));
                }
                // No further, but for the ends of u and a ring without a gap.
                let [u, theta] = end(room + 1e-6);
                assert!(
                    !region.allows(u, theta)
                        || !(0.0..=1.0).contains(&u)
                        || room + sides.iter().sum::<f64>() > TAU
                );
            }
        }
    }
}

#[test]
fn a_stop_is_heard() {
    let surface = surface(0.8, 0.15, 1, 0.0);
    let stop = AtomicBool::new(true);
    let center = surface.integrals().center_of_mass;
    let found = synthesize(
        &surface,
        center,
        &cone(),
        &Anywhere,
        5,
        16,
        &square(),
        &stop,
    );
    assert_eq!(found, Err(Error::Interrupted));
    let way = Deformation::new(&surface, &surface).unwrap();
    let at = [[0.5, 0.1], [0.45, 2.2], [0.55, 4.3]];
    let carried = way.by_ascent(&[at], &cone(), &Anywhere, &stop);
    assert_eq!(carried, Err(Error::Interrupted));
}

#[test]
fn fingers_with_friction_of_their_own_keep_their_numbers() {
    let surface = surface(0.8, 0.15, 1, 0.0);
    let center = surface.integrals().center_of_mass;
    for frictions in [[0.3, 0.9, 0.9], [0.9, 0.9, 0.3], [0.7, 0.7, 0.7]] {
        let cone = FrictionCone::each(&frictions, 8).unwrap();
        let found = synthesize(&surface, center, &cone, &Anywhere, 3, 12, &square(), &GO).unwrap();
        assert!(!found.is_empty());
        for grasp in found {
            let contacts = grasp
                .coordinates
                .map(|[u, theta]| surface.contact(u, theta));
            let quality = Evaluator::new(&cone).quality(&contacts, center);
            assert_eq!(quality, grasp.quality);
            // As good as any other way to share out the fingers' places.
            let swapped = [contacts[1], contacts[0], contacts[2]];
            assert!(Evaluator::new(&cone).quality(&swapped, center) <= 1.05 * quality);
        }
    }
}
