//! Grasps of any number of fingers, hard or soft, on a surface and within limits.
//!
//! Of contacts all over the surface the best subsets of those that are farthest from each other
//! climb from place to place ([`crate::places`]) and then on the surface itself
//! ([`crate::bundle`]), for as long as the limits are kept.

use crate::bundle::{Coordinates, Ground};
use crate::contact::FrictionCone;
use crate::error::Error;
use crate::limits::Limits;
use crate::parallel::*;
use crate::places::search::{MANY, candidates};
use crate::places::{Place, Wanted};
use crate::quality::{Evaluator, Twist};
use crate::region::Region;
use crate::sampling::by_area;
use crate::surface::Surface;
use crate::turned::different;
use glam::DVec3;
use std::sync::atomic::{AtomicBool, Ordering};

/// Two grasps whose contacts all lie closer than this, by the object's radius, are one.
const APART: f64 = 0.15;

/// What is looked for.
#[derive(Clone)]
#[expect(missing_debug_implementations, reason = "regions have none")]
pub struct Request<'a> {
    /// The fingers' friction cones.
    pub cone: &'a FrictionCone,
    /// Contacts of a grasp.
    pub fingers: usize,
    /// How many grasps.
    pub top: usize,
    /// Where contacts may lie on the surface.
    pub region: &'a dyn Region,
    /// Where fingers may go.
    pub limits: &'a Limits,
    /// Loads that the grasp is for; none if it is for all.
    pub task: &'a [Twist],
    /// Are grasps improved on the surface itself?
    pub polished: bool,
}

/// Different grasps, best first, and how good they are, Q_l or how much of the task they can do: of those that differ but by a turn of a surface of
/// revolution one, and further ones only where there are too few. `square` holds points of the unit
/// square to sample the surface with.
pub fn grasps(
    surface: &Surface,
    center_of_mass: DVec3,
    request: &Request<'_>,
    square: &[[f64; 2]],
    threads: usize,
    stop: &AtomicBool,
) -> Result<Vec<(Coordinates, f64)>, Error> {
    let limits = request.limits;
    let (mut samples, mut map) = (Vec::new(), Vec::new());
    for [u, theta] in by_area(surface, square) {
        let contact = surface.contact(u, theta);
        if request.region.allows(u, theta) && limits.allows(contact.point, contact.normal) {
            samples.push([u, theta]);
            map.push(Place::flat(contact.point, contact.normal));
        }
    }
    if map.len() < request.fingers || request.top == 0 {
        return Ok(Vec::new());
    }
    let wanted = Wanted {
        cone: request.cone,
        center: center_of_mass,
        scale: 1.0,
        fingers: request.fingers,
        top: request.top,
        apart: APART * surface.radius_about(center_of_mass, 16),
        errors: 0.0,
        task: request.task,
        rounds: 0,
        limits,
    };
    let starts: Vec<Coordinates> = candidates(&map, &wanted, &MANY, threads, stop)?
        .iter()
        .map(|grasp| {
            let own = |place| map.iter().position(|other| other == place);
            grasp.iter().filter_map(own).map(|k| samples[k]).collect()
        })
        .collect();
    let ground = Ground {
        surface,
        center: center_of_mass,
        region: request.region,
        limits,
        task: request.task,
        cone: request.cone,
    };
    let mut found: Vec<(Coordinates, f64)> = starts
        .par_iter()
        .map(|start| {
            let mut evaluator = Evaluator::new(request.cone);
            if request.polished && !stop.load(Ordering::Relaxed) {
                ground.climb(&mut evaluator, start)
            } else {
                (start.clone(), ground.value(&mut evaluator, start))
            }
        })
        .filter(|found| found.1 > 0.0)
        .collect();
    if stop.load(Ordering::Relaxed) {
        return Err(Error::Interrupted);
    }
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    Ok(different(surface, found, &wanted))
}
