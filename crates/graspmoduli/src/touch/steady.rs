//! Grasps that bad aim does not lose, where it loses the best.

use super::gate::{self, Aims};
use super::mesh::Mesh;
use super::press::Tip;
use crate::parallel::*;
use crate::places::search::neighbours;
use crate::places::{Place, Wanted};
use crate::quality::Evaluator;
use std::sync::OnceLock;

/// So many steps at most.
const STEPS: usize = 25;

/// Grasps that bad aim does not lose, from others among the places of a map: from place to
/// neighbouring place, one finger at a time, while fewer errors of aim lose force closure, or as few
/// and the quality grows. The quality stays at least `least`.
pub(super) fn steadied(
    mesh: &Mesh,
    tip: &Tip,
    map: &[Place],
    starts: &[Vec<Place>],
    least: f64,
    wanted: &Wanted<'_>,
) -> Vec<Vec<Place>> {
    let neighbours = neighbours(map);
    // Of most places nobody asks.
    let aims: Vec<OnceLock<Aims>> = map.iter().map(|_| OnceLock::new()).collect();
    starts
        .par_iter()
        .filter_map(|start| {
            let mut evaluator = Evaluator::new(wanted.cone);
            let index = |place: &Place| map.iter().position(|other| other == place);
            let mut at = start.iter().map(index).collect::<Option<Vec<_>>>()?;
            let lost = |at: &[usize], most: usize, evaluator: &mut Evaluator| {
                let own: Vec<_> = at
                    .iter()
                    .map(|&k| aims[k].get_or_init(|| gate::aims(mesh, tip, &map[k], wanted)))
                    .collect();
                gate::lost(&own, most, evaluator)
            };
            let places = |at: &[usize]| at.iter().map(|&k| map[k]).collect::<Vec<_>>();
            let mut best = (lost(&at, usize::MAX, &mut evaluator), least);
            for _ in 0..STEPS {
                let mut step = None;
                for finger in 0..at.len() {
                    for &k in &neighbours[at[finger]] {
                        let mut trial = at.clone();
                        trial[finger] = k;
                        let pressed = places(&trial);
                        if !wanted.allow_one(&pressed, finger) {
                            continue;
                        }
                        let quality = wanted.value(&mut evaluator, &pressed);
                        if quality < least {
                            continue;
                        }
                        let lost = lost(&trial, best.0, &mut evaluator);
                        if lost < best.0 || (lost == best.0 && quality > best.1) {
                            best = (lost, quality);
                            step = Some(trial);
                        }
                    }
                }
                match step {
                    Some(trial) => at = trial,
                    None => break,
                }
            }
            Some(places(&at))
        })
        .collect()
}
