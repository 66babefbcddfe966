//! The best grasps among places: by exact search over some, then climbed over all.

use super::{Place, Wanted};
use crate::error::Error;
use crate::parallel::*;
use crate::quality::Evaluator;
use crate::search::{Together, best_subsets_together};
use glam::DVec3;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

/// About so many subsets are searched, and of more than three fingers.
const SUBSETS: u64 = 170_000;
const SUBSETS_OF_MANY: u64 = 25_000;
/// Of so many places at most; and where few pairs may be together.
const PLACES: usize = 100;
const MOST_PLACES: usize = 400;
/// Neighbours of a place on the map.
const NEIGHBOURS: usize = 16;
/// How many of the best subsets are looked at for each grasp that is wanted; then, if they are too
/// much alike.
/// The same, for a task: what is best for all loads need not be best for a few.
const OF_A_TASK: usize = 1_000;
pub(crate) const MANY: [usize; 2] = [40, 200];

/// Different grasps on a map that no step to a neighbour improves, best first.
pub(crate) fn candidates(
    map: &[Place],
    wanted: &Wanted<'_>,
    tries: &[usize],
    threads: usize,
    stop: &AtomicBool,
) -> Result<Vec<Vec<Place>>, Error> {
    let (spread, together) = farthest(map, wanted);
    let contacts: Vec<_> = spread
        .iter()
        .map(|&k| wanted.contact(map[k].point, map[k].normal))
        .collect();
    // Fingers that differ are handed out when it is known where they go.
    let cone = wanted.cone.least_friction();
    let mut starts = Vec::new();
    for many in tries {
        let heed = |_, _| {
            if stop.load(Ordering::Relaxed) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let ranked = best_subsets_together(
            &contacts,
            &[],
            DVec3::ZERO,
            &cone,
            wanted.fingers,
            if wanted.task.is_empty() {
                many * wanted.top.max(5)
            } else {
                OF_A_TASK.max(many * wanted.top)
            },
            threads,
            together.as_ref(),
            heed,
        )?;
        let mut grasps: Vec<Vec<Place>> = ranked
            .iter()
            .map(|r| r.indices.iter().map(|&k| map[spread[k]]).collect())
            .collect();
        if !wanted.task.is_empty() {
            let valued = grasps.into_par_iter().map(|grasp| {
                let mut evaluator = Evaluator::new(wanted.cone);
                (wanted.value(&mut evaluator, &grasp), grasp)
            });
            grasps = best_first(valued.collect()).collect();
        }
        starts = different(grasps.into_iter(), 6 * wanted.top, wanted);
        if starts.len() >= wanted.candidates() {
            break;
        }
    }
    let neighbours = neighbours(map);
    let climbed: Vec<_> = starts
        .par_iter()
        .map(|start| {
            let mut evaluator = Evaluator::new(wanted.cone);
            climb(map, &neighbours, start, &[], wanted, &mut evaluator)
        })
        .collect();
    let mut kept = different(best_first(climbed), wanted.candidates(), wanted);
    // Where many climb to the same place, some stop short of it.
    let mut evaluator = Evaluator::new(wanted.cone);
    for start in &starts {
        if kept.len() >= wanted.candidates() {
            break;
        }
        if kept.iter().all(|other| wanted.differ(start, other)) {
            let (_, grasp) = climb(map, &neighbours, start, &kept, wanted, &mut evaluator);
            kept.push(grasp);
        }
    }
    Ok(kept)
}

/// By quality; equal ones stay in their order.
fn best_first(mut grasps: Vec<(f64, Vec<Place>)>) -> impl Iterator<Item = Vec<Place>> {
    grasps.sort_by(|a, b| b.0.total_cmp(&a.0));
    grasps.into_iter().map(|(_, grasp)| grasp)
}

/// The first `most` that differ from all before them.
fn different(
    grasps: impl Iterator<Item = Vec<Place>>,
    most: usize,
    wanted: &Wanted<'_>,
) -> Vec<Vec<Place>> {
    let mut kept: Vec<Vec<Place>> = Vec::new();
    for grasp in grasps {
        if kept.len() == most {
            break;
        }
        if kept.iter().all(|other| wanted.differ(&grasp, other)) {
            kept.push(grasp);
        }
    }
    kept
}

/// So many places that all their subsets can be searched, each the farthest from those before it;
/// and, if that matters, which of them fingers may press at together.
fn farthest(map: &[Place], wanted: &Wanted<'_>) -> (Vec<usize>, Option<Together>) {
    let fingers = wanted.fingers;
    // Of many fingers a grasp has more ways to climb, and takes longer to look at.
    let budget = if fingers > 3 {
        SUBSETS_OF_MANY
    } else {
        SUBSETS
    };
    let most_of = |share: f64, limit: usize| {
        // Where few pairs may be together, so may few subsets, and more places can be searched. Of
        // a triple two pairs count: near places have the same neighbours.
        let pairs = fingers.saturating_sub(1);
        let allowed =
            |n: usize| (0..pairs).fold(subsets(n, fingers) as f64, |count, _| count * share);
        let mut most = fingers;
        while most < limit && allowed(most + 1) <= budget as f64 {
            most += 1;
        }
        most
    };
    let chosen = spread(map, most_of(1.0, PLACES));
    if !wanted.limits.pairs_matter() {
        return (chosen, None);
    }
    let together = |chosen: &[usize]| {
        Together::new(chosen.len(), |i, j| {
            let [one, other] = [i, j].map(|k| map[chosen[k]]);
            let limits = wanted.limits;
            limits.allows_pair((one.point, one.normal), (other.point, other.normal))
        })
    };
    let pairs = together(&chosen).pairs() as f64;
    let share = pairs / subsets(chosen.len(), 2).max(1) as f64;
    let chosen = spread(map, most_of(share.max(1e-3), MOST_PLACES));
    let pairs = together(&chosen);
    (chosen, Some(pairs))
}

/// Indices of places, each the farthest from those before it.
fn spread(map: &[Place], most: usize) -> Vec<usize> {
    let mut chosen = Vec::new();
    // Opposite sides of a thin wall are different places.
    let mut away = vec![f64::INFINITY; map.len()];
    let mut next = 0;
    while chosen.len() < most.min(map.len()) {
        chosen.push(next);
        away[next] = f64::NEG_INFINITY;
        let place = map[next];
        let mut far = f64::NEG_INFINITY;
        for (k, other) in map.iter().enumerate() {
            away[k] = away[k].min(gap(&place, other));
            if away[k] > far {
                (next, far) = (k, away[k]);
            }
        }
    }
    chosen
}

fn subsets(n: usize, m: usize) -> u64 {
    if m > n {
        return 0;
    }
    (0..m as u64).fold(1, |product, k| product * (n as u64 - k) / (k + 1))
}

/// How far two places are from each other: in space, and by a tenth for opposite normals.
fn gap(one: &Place, other: &Place) -> f64 {
    (one.point - other.point).length_squared()
        + 0.0025 * (one.normal - other.normal).length_squared()
}

/// The nearest places of each.
pub(crate) fn neighbours(map: &[Place]) -> Vec<Vec<usize>> {
    map.par_iter()
        .enumerate()
        .map(|(k, place)| {
            let mut near: Vec<_> = (0..map.len())
                .filter(|&j| j != k)
                .map(|j| (gap(place, &map[j]), j))
                .collect();
            let order =
                |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
            if near.len() > NEIGHBOURS {
                near.select_nth_unstable_by(NEIGHBOURS, order);
                near.truncate(NEIGHBOURS);
            }
            near.sort_by(order);
            near.into_iter().map(|(_, j)| j).collect()
        })
        .collect()
}

/// From place to neighbouring place, one finger at a time, while the quality grows; not to where
/// the grasp no longer differs from others.
fn climb(
    map: &[Place],
    neighbours: &[Vec<usize>],
    start: &[Place],
    others: &[Vec<Place>],
    wanted: &Wanted<'_>,
    evaluator: &mut Evaluator,
) -> (f64, Vec<Place>) {
    let index = |place: &Place| map.iter().position(|other| other == place).unwrap_or(0);
    let mut at: Vec<usize> = start.iter().map(index).collect();
    let grasp = |at: &[usize]| at.iter().map(|&k| map[k]).collect::<Vec<_>>();
    let mut best = wanted.value(evaluator, &grasp(&at));
    if !wanted.cone.is_uniform() {
        // Which finger goes where.
        for order in permutations(at.len()) {
            let other: Vec<_> = order.iter().map(|&k| at[k]).collect();
            let quality = wanted.value(evaluator, &grasp(&other));
            if quality > best {
                (best, at) = (quality, other);
            }
        }
    }
    loop {
        let mut step = None;
        for finger in 0..at.len() {
            for &k in &neighbours[at[finger]] {
                let mut trial = at.clone();
                trial[finger] = k;
                let places = grasp(&trial);
                let Some(quality) = wanted.better(evaluator, &places, best) else {
                    continue;
                };
                if wanted.allow_one(&places, finger)
                    && others.iter().all(|other| wanted.differ(&places, other))
                {
                    best = quality;
                    step = Some(trial);
                }
            }
        }
        match step {
            Some(trial) => at = trial,
            None => return (best, grasp(&at)),
        }
    }
}

/// All orders of up to four fingers; of more, all turns.
fn permutations(count: usize) -> Vec<Vec<usize>> {
    if count > 4 {
        return (0..count)
            .map(|turn| (0..count).map(|k| (k + turn) % count).collect())
            .collect();
    }
    let mut all = vec![vec![]];
    for _ in 0..count {
        all = all
            .iter()
            .flat_map(|order: &Vec<usize>| {
                (0..count)
                    .filter(|k| !order.contains(k))
                    .map(|k| [order.as_slice(), &[k]].concat())
            })
            .collect();
    }
    all
}
