//! The best grasps among the places of a map: by exact search over some, then climbed over all.

use super::gate::{self, Checked};
use super::mesh::Mesh;
use super::polish::polish;
use super::press::Tip;
use super::steady::steadied;
use crate::error::Error;
use crate::parallel::*;
use crate::places::search::{MANY, candidates};
use crate::places::{Place, Wanted};
use crate::quality::Evaluator;
use std::sync::atomic::{AtomicBool, Ordering};

/// Shares of a pad that may differ from what it feels, the flattest first.
const LIMITS: [f64; 6] = [0.0, 0.1, 0.2, 0.35, 0.5, 1.0];
/// The flattest pads are taken whose best grasp has this share of the best of all.
const SHARE: f64 = 0.8;
/// Fewer steady places than this are not enough to choose among.
const FEW: usize = 30;
/// Places that are not steady are taken where steady ones do not hold either and have grasps worse
/// by this factor.
const MUCH: f64 = 2.0;
/// A grasp that holds in this share of errors of aim is not lost by them.
const SURE: f64 = 0.99;
/// It comes before others of up to so many times its quality: this share of theirs.
const HALF: f64 = 0.5;

/// A grasp of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Where the fingers press.
    pub places: Vec<Place>,
    /// Q_l with the normals that they feel.
    pub quality: f64,
    /// How good it is for what is wanted: Q_l, or how much of a task it can do.
    pub value: f64,
    /// What the mesh says of it.
    pub checked: Checked,
}

/// Different grasps among the places of a map, true ones by what [`gate`] asks, best first; more
/// than are wanted, so that they can be ranked by something else.
pub fn grasps(
    mesh: &Mesh,
    tip: &Tip,
    map: &[Place],
    wanted: &Wanted<'_>,
    threads: usize,
    stop: &AtomicBool,
) -> Result<Vec<Found>, Error> {
    let allowed = |place: &&Place| wanted.limits.allows(place.point, place.normal);
    let map: &[Place] = &map.iter().filter(allowed).copied().collect::<Vec<_>>();
    let steady: Vec<_> = map.iter().copied().filter(|place| place.steady).collect();
    if steady.len() >= map.len() {
        return true_grasps(mesh, tip, map, wanted, threads, stop);
    }
    let found = if steady.len() >= FEW {
        true_grasps(mesh, tip, &steady, wanted, threads, stop)?
    } else {
        Vec::new()
    };
    if found.iter().any(|grasp| grasp.checked.holds >= SURE) {
        return Ok(found);
    }
    // Bad aim loses what steady places offer: then others must offer much more.
    let others = true_grasps(mesh, tip, map, wanted, threads, stop)?;
    let best = |grasps: &[Found]| grasps.first().map_or(0.0, |grasp| grasp.value);
    let half = HALF * best(&found).max(best(&others));
    // Where aims beside a place land all the same, whatever the normal is there.
    let landing: Vec<_> = map
        .iter()
        .copied()
        .filter(|place| {
            tip.fan(mesh, place.point, place.normal)
                .iter()
                .all(Option::is_some)
        })
        .collect();
    let starts = if landing.len() >= wanted.fingers {
        candidates(&landing, wanted, &MANY, threads, stop)?
    } else {
        Vec::new()
    };
    let sought = steadied(mesh, tip, &landing, &starts, half, wanted);
    if stop.load(Ordering::Relaxed) {
        return Err(Error::Interrupted);
    }
    let mut sure: Vec<_> = sought
        .iter()
        .filter_map(|grasp| climbed(mesh, tip, grasp, 1.0, 0, wanted))
        .filter(|grasp| grasp.checked.holds >= SURE && grasp.value >= half)
        .collect();
    sure.sort_by(|a, b| b.value.total_cmp(&a.value));
    let kept = if best(&found) > 0.0 && best(&others) < MUCH * best(&found) {
        found
    } else {
        others
    };
    let mut all: Vec<Found> = Vec::new();
    for grasp in sure.into_iter().chain(kept) {
        let mut others = all.iter();
        if others.all(|other| wanted.differ(&grasp.places, &other.places)) {
            all.push(grasp);
        }
    }
    all.sort_by(|a, b| b.value.total_cmp(&a.value));
    Ok(surest_first(all))
}

/// Without those before the first that bad aim does not lose, if there is any that is half as good.
fn surest_first(mut grasps: Vec<Found>) -> Vec<Found> {
    let half = grasps.first().map_or(0.0, |grasp| HALF * grasp.value);
    let sure = |grasp: &Found| grasp.checked.holds >= SURE && grasp.value >= half;
    if let Some(first) = grasps.iter().position(sure) {
        grasps.drain(..first);
    }
    grasps
}

/// The best grasps among places, on pads that are as flat as they may be.
fn true_grasps(
    mesh: &Mesh,
    tip: &Tip,
    map: &[Place],
    wanted: &Wanted<'_>,
    threads: usize,
    stop: &AtomicBool,
) -> Result<Vec<Found>, Error> {
    let (flat, limit) = flattest(map, wanted, threads, stop)?;
    let mut found = checked(mesh, tip, &flat, limit, wanted, stop)?;
    if found.is_empty() && limit < 1.0 {
        // What the flattest pads promise may fail at the gate.
        let all = candidates(map, wanted, &MANY, threads, stop)?;
        found = checked(mesh, tip, &all, 1.0, wanted, stop)?;
    }
    Ok(found)
}

/// Candidates on the flattest places that are good enough, and how flat these are.
fn flattest(
    map: &[Place],
    wanted: &Wanted<'_>,
    threads: usize,
    stop: &AtomicBool,
) -> Result<(Vec<Vec<Place>>, f64), Error> {
    let mut evaluator = Evaluator::new(wanted.cone);
    let mut best = |places: &[Place]| -> Result<f64, Error> {
        let grasps = candidates(places, wanted, &MANY[..1], threads, stop)?;
        let values = grasps.iter().map(|g| wanted.value(&mut evaluator, g));
        Ok(values.fold(0.0, f64::max))
    };
    let bar = SHARE * best(map)?;
    let mut tried = 0;
    for limit in LIMITS {
        let flat: Vec<_> = map.iter().copied().filter(|p| p.off <= limit).collect();
        // No more places than before are no better.
        if flat.len() > tried && (flat.len() == map.len() || best(&flat)? >= bar) {
            return Ok((candidates(&flat, wanted, &MANY, threads, stop)?, limit));
        }
        tried = flat.len();
    }
    Ok((Vec::new(), LIMITS[LIMITS.len() - 1]))
}

/// The candidates polished, as far as they are true and differ; and where these are too few, some
/// as they were.
fn checked(
    mesh: &Mesh,
    tip: &Tip,
    candidates: &[Vec<Place>],
    limit: f64,
    wanted: &Wanted<'_>,
    stop: &AtomicBool,
) -> Result<Vec<Found>, Error> {
    let mut kept: Vec<Found> = Vec::new();
    for rounds in [wanted.rounds, 0] {
        let found: Vec<_> = candidates
            .par_iter()
            .map(|grasp| {
                if stop.load(Ordering::Relaxed) {
                    return None;
                }
                climbed(mesh, tip, grasp, limit, rounds, wanted)
            })
            .collect();
        if stop.load(Ordering::Relaxed) {
            return Err(Error::Interrupted);
        }
        let mut found: Vec<_> = found.into_iter().flatten().collect();
        found.sort_by(|a, b| b.value.total_cmp(&a.value));
        for grasp in found {
            let mut others = kept.iter();
            if others.all(|other| wanted.differ(&grasp.places, &other.places)) {
                kept.push(grasp);
            }
        }
        if kept.len() >= wanted.top {
            break;
        }
    }
    kept.sort_by(|a, b| b.value.total_cmp(&a.value));
    Ok(surest_first(kept))
}

/// A grasp after some rounds of polishing, or as it is if only that is true; `None` if neither is.
pub fn climbed(
    mesh: &Mesh,
    tip: &Tip,
    grasp: &[Place],
    limit: f64,
    rounds: usize,
    wanted: &Wanted<'_>,
) -> Option<Found> {
    let mut evaluator = Evaluator::new(wanted.cone);
    let polished = polish(mesh, tip, grasp, limit, rounds, wanted, &mut evaluator);
    [polished, grasp.to_vec()].into_iter().find_map(|places| {
        // A grasp that is brought here from elsewhere need not be allowed.
        if !wanted.allow(&places) {
            return None;
        }
        let quality = wanted.quality(&mut evaluator, &places);
        let checked = gate::check(mesh, tip, &places, quality, wanted, &mut evaluator)?;
        Some(Found {
            value: wanted.value(&mut evaluator, &places),
            places,
            quality,
            checked,
        })
    })
}
