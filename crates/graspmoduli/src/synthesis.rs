//! Grasp synthesis by deformation from the surface of revolution π(S) (Sec. IV.E).
//!
//! 1. On π(S), grasps at a few heights in two arrangements about the axis: the paper's, one finger
//!    against two in a plane through the axis, and three fingers evenly around it.
//! 2. The best of them, turned to several angles about the axis and judged by their naïve transfer
//!    to S, start on π(S) and climb in Q while the surface deforms along (1 − t) π(S) + t S.
//! 3. On S itself each climbs on; the best different ones climb to a local maximum.
//!
//! Objects are often symmetric, so many grasps are equally good but for rounding. Rounding must not
//! choose among them: the starts are moved off symmetric places by a fixed small amount, and equal
//! grasps come in a fixed order.

use crate::ascent::{Climber, Coordinates, Effort, grains, order};
use crate::contact::{Contact, FrictionCone};
use crate::error::Error;
use crate::parallel::*;
use crate::quality::Evaluator;
use crate::region::Region;
use crate::sampling::by_area;
use crate::search::{Ranked, best_of, best_subsets};
use crate::surface::Surface;
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

/// Equally spaced heights of the heuristic: 10·C(10, 2) = 450 evaluations, as the paper counts.
const HEIGHTS: usize = 10;
/// Angles about the axis to which an arrangement is turned.
const TURNS: usize = 8;
/// Surfaces between π(S) and S on which grasps climb: more cost time and end no better.
const STAGES: usize = 1;
/// Two grasps whose contacts all lie closer than this, by the object's radius, are one.
const APART: f64 = 0.15;
/// With fewer different grasps than this (or than were asked for), sampled contacts are tried too.
const ENOUGH: usize = 3;
/// On the way from π(S) to S.
const ON_THE_WAY: Effort = Effort {
    steps: 1,
    gain: 1e-2,
};
/// On S, to tell good starts from bad ones.
const APPROACH: Effort = Effort {
    steps: 3,
    gain: 1e-2,
};
/// Qualities this near to each other, relatively, are equal.
const TIE: f64 = 1e-6;
/// Starts are moved by this in (u, θ): much more than rounding, much less than what matters.
const NUDGE: [f64; 6] = [7e-4, -1e-3, -5e-4, 6e-4, 3e-4, 9e-4];

/// A grasp with its Q_l.
type Found = (Coordinates, f64);

/// A grasp on a surface by its contact coordinates, and its Q_l.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Synthesized {
    /// (u_i, θ_i).
    pub coordinates: Coordinates,
    /// Q_l.
    pub quality: f64,
}

/// The `top` best grasps found, best first, equal ones in the order of their contacts, no two at the
/// same place. Contacts come in ascending order of u, or, where the cone has friction for each of
/// them, in its order.
///
/// At most `most_starts` grasps of the heuristic are followed.
/// If the deformation from π(S) finds fewer than three grasps, the ascent also starts from the best
/// triples of area-uniform samples; `square` holds points of the unit square to make them of.
/// `stop`, set to true, ends the search with [`Error::Interrupted`].
#[expect(clippy::too_many_arguments, reason = "what to look for, and where")]
pub fn synthesize(
    surface: &Surface,
    center_of_mass: DVec3,
    cone: &FrictionCone,
    region: &dyn Region,
    top: usize,
    most_starts: usize,
    square: &[[f64; 2]],
    stop: &AtomicBool,
) -> Result<Vec<Synthesized>, Error> {
    // Within the thread pool from the start: entering it once per stage costs as much as a stage.
    entered(|| {
        within_pool(
            surface,
            center_of_mass,
            cone,
            region,
            top,
            most_starts,
            square,
            stop,
        )
    })
}

#[expect(clippy::too_many_arguments, reason = "those of the public function")]
fn within_pool(
    surface: &Surface,
    center_of_mass: DVec3,
    cone: &FrictionCone,
    region: &dyn Region,
    top: usize,
    most_starts: usize,
    square: &[[f64; 2]],
    stop: &AtomicBool,
) -> Result<Vec<Synthesized>, Error> {
    if top == 0 {
        return Ok(Vec::new());
    }
    let target = Climber {
        surface,
        center: center_of_mass,
        region,
        round: surface.is_round(),
    };
    let apart = APART * surface.radius_about(center_of_mass, 16);
    let starts = starts(&target, cone, most_starts);
    let stages = stages(surface, center_of_mass);
    // Every start by itself, so that the result does not depend on the number of threads.
    let stopped = || stop.load(Ordering::Relaxed);
    let approach = |evaluator: &mut Evaluator, start: &Coordinates| {
        if stopped() {
            return None;
        }
        let mut at = *start;
        for (stage, center) in &stages {
            let climber = Climber {
                surface: stage,
                center: *center,
                region,
                round: target.round,
            };
            if let Some((better, _)) = climber.climb(evaluator, at, ON_THE_WAY) {
                at = better;
            }
        }
        // Where the deformation lost the grasp, its naïve transfer may still hold.
        target
            .climb(evaluator, at, APPROACH)
            .or_else(|| target.climb(evaluator, *start, APPROACH))
    };
    let mut found: Vec<Found> = starts
        .par_iter()
        .map_init(|| Evaluator::new(cone), approach)
        .flatten()
        .collect();
    if truly_different(&target, found.clone(), apart, top).len() < top.min(ENOUGH) {
        let samples: Vec<[f64; 2]> = by_area(surface, square)
            .into_iter()
            .filter(|&[u, theta]| region.allows(u, theta))
            .collect();
        let contacts: Vec<Contact> = samples
            .iter()
            .map(|&[u, theta]| surface.contact(u, theta))
            .collect();
        let triples = best_subsets(
            &contacts,
            &[],
            center_of_mass,
            &cone.least_friction(),
            3,
            top.saturating_mul(8).min(triples_of(contacts.len())),
            1,
            |_, _| match stopped() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            },
        )?;
        let triples = triples
            .into_iter()
            .map(|ranked| (three(&ranked).map(|i| samples[i]), ranked.quality))
            .collect();
        let triples = different(&target, triples, apart, top);
        found.par_extend(
            triples
                .par_iter()
                .map_init(
                    || Evaluator::new(cone),
                    |evaluator, (at, _)| target.climb(evaluator, *at, APPROACH),
                )
                .flatten(),
        );
    }
    // Grasps that are different so far may still climb to the same place.
    let candidates = different(&target, found, apart, top.saturating_add(top.min(3)));
    let arrived = climbed(cone, candidates, |evaluator, at| {
        (!stopped()).then(|| target.arrive(evaluator, at)).flatten()
    });
    let mut first = different(&target, arrived, apart, usize::MAX);
    let others = first.split_off(top.min(first.len()));
    let settle = |grasps| {
        climbed(cone, grasps, |evaluator, at| {
            (!stopped())
                .then(|| target.to_maximum(evaluator, at))
                .flatten()
        })
    };
    let mut settled = settle(first);
    let mut best = different(&target, settled.clone(), apart, top);
    if best.len() < top {
        settled.extend(settle(others));
        best = different(&target, settled, apart, top);
    }
    if stopped() {
        return Err(Error::Interrupted);
    }
    let mut evaluator = Evaluator::new(cone);
    Ok(best
        .into_iter()
        .map(|(at, _)| {
            // Fingers with friction of their own keep their numbers.
            let coordinates = if cone.is_uniform() { in_order(at) } else { at };
            let contacts = coordinates.map(|[u, theta]| surface.contact(u, theta));
            Synthesized {
                coordinates,
                quality: evaluator.quality(&contacts, center_of_mass),
            }
        })
        .collect())
}

/// How many sets of three there are among so many.
fn triples_of(count: usize) -> usize {
    (0..3).fold(1usize, |product, i| {
        product.saturating_mul(count.saturating_sub(i)) / (i + 1)
    })
}

/// Where grasps come to, in parallel; those that do not hold stay where they are.
fn climbed(
    cone: &FrictionCone,
    grasps: Vec<Found>,
    climb: impl Fn(&mut Evaluator, Coordinates) -> Option<Found> + Sync,
) -> Vec<Found> {
    grasps
        .into_par_iter()
        .map_init(
            || Evaluator::new(cone),
            |evaluator, grasp| climb(evaluator, grasp.0).unwrap_or(grasp),
        )
        .collect()
}

/// Grasps of the heuristic on π(S), turned about the axis: the `most` best on the target.
fn starts(target: &Climber, cone: &FrictionCone, most: usize) -> Vec<Coordinates> {
    // There are no more than this.
    let most = most.min(2 * HEIGHTS.pow(3) * TURNS);
    if most == 0 {
        return Vec::new();
    }
    let round = target.surface.project();
    let center = round.integrals_by_simpson(20).center_of_mass;
    // Angles of the three contacts; the second and third are interchangeable. Where fingers have
    // friction of their own it matters which of them is where.
    let mut arrangements = vec![[0.0, PI, PI], [0.0, TAU / 3.0, 2.0 * TAU / 3.0]];
    if !cone.is_uniform() {
        arrangements.extend([
            [PI, 0.0, PI],
            [PI, PI, 0.0],
            [0.0, 2.0 * TAU / 3.0, TAU / 3.0],
        ]);
    }
    let turned: Vec<Vec<Found>> = arrangements
        .par_iter()
        .map(|angles| {
            let heights = best_heights(&round, center, cone, *angles, most);
            best_turns(target, cone, *angles, &heights, most)
        })
        .collect();
    let mut best = Best::new(most);
    for (at, quality) in turned.into_iter().flatten() {
        best.insert(at, quality, |_, _| false);
    }
    best.entries
        .into_iter()
        .map(|(at, _)| target.moved(&at, &NUDGE))
        .collect()
}

fn three(ranked: &Ranked) -> [usize; 3] {
    std::array::from_fn(|i| ranked.indices[i])
}

fn height(index: usize) -> f64 {
    index as f64 / (HEIGHTS - 1) as f64
}

/// The best heights on π(S) for contacts at these angles.
fn best_heights(
    round: &Surface,
    center: DVec3,
    cone: &FrictionCone,
    angles: [f64; 3],
    most: usize,
) -> Vec<[f64; 3]> {
    let together = angles[1] == angles[2];
    let contacts: Vec<Contact> = angles
        .into_iter()
        .flat_map(|theta| (0..HEIGHTS).map(move |i| round.contact(height(i), theta)))
        .collect();
    // Three fingers evenly around can be numbered by height.
    let alike = cone.is_uniform();
    let wanted = |&[a, b, c]: &[usize; 3]| match (alike, together) {
        (false, _) => true,
        (true, true) => b < c,
        (true, false) => a <= b && b <= c,
    };
    let own = if alike { 0 } else { contacts.len() };
    let frictions: Vec<f64> = (0..own).map(|i| cone.friction(i / HEIGHTS)).collect();
    // From the middle heights outward: the best are there, and raise the bar for the others.
    let triples = outward()
        .flat_map(|a| outward().flat_map(move |b| outward().map(move |c| [a, b, c])))
        .filter(wanted)
        .map(|[a, b, c]| [a, HEIGHTS + b, 2 * HEIGHTS + c]);
    let mut found: Vec<([usize; 3], f64)> =
        best_of(&contacts, &frictions, center, cone, 3 * most, triples)
            .iter()
            .map(|ranked| (three(ranked).map(|i| i % HEIGHTS), ranked.quality))
            .collect();
    equals_by(&mut found, |levels| *levels);
    let mut best: Best<[f64; 3]> = Best::new(most);
    for (levels, quality) in found {
        // Grasps at neighbouring heights climb to the same place.
        best.insert(levels.map(height), quality, |x, y| {
            (0..3).all(|i| (x[i] - y[i]).abs() < 1.5 / (HEIGHTS - 1) as f64)
        });
    }
    best.entries
        .into_iter()
        .map(|(heights, _)| heights)
        .collect()
}

/// The best grasps on the target with contacts at these heights and, but for a turn, angles.
fn best_turns(
    target: &Climber,
    cone: &FrictionCone,
    angles: [f64; 3],
    heights: &[[f64; 3]],
    most: usize,
) -> Vec<Found> {
    let mut evaluator = Evaluator::new(cone);
    let mut best: Best<Coordinates> = Best::new(most);
    for heights in heights {
        for turn in 0..TURNS {
            let start = TAU * turn as f64 / TURNS as f64;
            let at = [0, 1, 2].map(|i| [heights[i], (angles[i] + start) % TAU]);
            let quality = target.quality_up_to(&mut evaluator, &at, best.bar());
            best.insert(at, quality, |_, _| false);
        }
    }
    best.entries
}

/// Indices of the heights, from the middle outward.
fn outward() -> impl Iterator<Item = usize> {
    (0..HEIGHTS / 2).flat_map(|i| [HEIGHTS / 2 - 1 - i, HEIGHTS / 2 + i])
}

/// The best so far, best first.
struct Best<T> {
    most: usize,
    entries: Vec<(T, f64)>,
}

impl<T> Best<T> {
    fn new(most: usize) -> Self {
        Self {
            most,
            entries: Vec::new(),
        }
    }

    /// What a further entry must exceed.
    fn bar(&self) -> f64 {
        if self.entries.len() < self.most {
            0.0
        } else {
            self.entries[self.most - 1].1
        }
    }

    /// Of entries that are near each other only the best is kept, of equal ones the first.
    fn insert(&mut self, entry: T, quality: f64, near: impl Fn(&T, &T) -> bool) {
        let better = |q: f64| q >= quality * (1.0 - TIE);
        if quality <= self.bar() * (1.0 + TIE)
            || self
                .entries
                .iter()
                .any(|(other, q)| better(*q) && near(other, &entry))
        {
            return;
        }
        self.entries.retain(|(other, _)| !near(other, &entry));
        let place = self.entries.partition_point(|(_, q)| better(*q));
        self.entries.insert(place, (entry, quality));
        self.entries.truncate(self.most);
    }
}

/// The surfaces (1 − t) π(S) + t S, 0 < t < 1, with centres of mass that end in the target's.
fn stages(surface: &Surface, center_of_mass: DVec3) -> Vec<(Surface, DVec3)> {
    // A given centre of mass need not be the surface's: approach it with t.
    let offset = center_of_mass - surface.integrals().center_of_mass;
    (1..=STAGES)
        .map(|s| {
            let t = s as f64 / (STAGES + 1) as f64;
            let stage = surface.from_projection(t);
            let own = stage.integrals_by_simpson(20).center_of_mass;
            (stage, own + offset * t)
        })
        .collect()
}

/// The best `most` grasps, best first, no two at the same place: their contacts do not pair up
/// with all distances below `apart`.
///
/// On a surface of revolution those that are the same after a turn about the axis come in only
/// where too few others are found.
fn different(target: &Climber, grasps: Vec<Found>, apart: f64, most: usize) -> Vec<Found> {
    let mut kept = truly_different(target, grasps.clone(), apart, most);
    add_different(target, grasps, apart, most, false, &mut kept);
    rank(&mut kept);
    kept
}

/// As [`different`], but without those that are the same after a turn.
fn truly_different(target: &Climber, grasps: Vec<Found>, apart: f64, most: usize) -> Vec<Found> {
    let mut kept = Vec::new();
    add_different(target, grasps, apart, most, target.round, &mut kept);
    kept
}

fn add_different(
    target: &Climber,
    mut grasps: Vec<Found>,
    apart: f64,
    most: usize,
    turned: bool,
    kept: &mut Vec<Found>,
) {
    rank(&mut grasps);
    for grasp in grasps {
        let near = |other: &Found| alike(target.surface, &grasp.0, &other.0, apart, turned);
        if kept.len() < most && !kept.iter().any(near) {
            kept.push(grasp);
        }
    }
}

/// Best first, equal ones in the order of their contacts.
fn rank(grasps: &mut [Found]) {
    grasps.sort_by(|a, b| b.1.total_cmp(&a.1));
    equals_by(grasps, |at| in_order(*at).map(grains));
}

/// Of entries that come best first, equal ones are put in the order of their keys.
fn equals_by<T, K: Ord>(entries: &mut [(T, f64)], key: impl Fn(&T) -> K) {
    for equal in entries.chunk_by_mut(|a, b| a.1 - b.1 <= TIE * a.1) {
        equal.sort_by_cached_key(|(entry, _)| key(entry));
    }
}

/// The contacts in ascending order of u, of θ where that is equal.
fn in_order(at: Coordinates) -> Coordinates {
    order(&at).map(|contact| at[contact])
}

fn alike(surface: &Surface, a: &Coordinates, b: &Coordinates, apart: f64, turned: bool) -> bool {
    const ORDERS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    let points = a.map(|[u, theta]| surface.contact(u, theta).point);
    ORDERS.iter().any(|order| {
        let b = order.map(|i| b[i]);
        let turn = if turned { a[0][1] - b[0][1] } else { 0.0 };
        (0..3).all(|i| {
            let [u, theta] = b[i];
            surface.contact(u, theta + turn).point.distance(points[i]) < apart
        })
    })
}
