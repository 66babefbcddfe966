//! Ascent of a grasp's quality over the contacts on a fixed surface, for any number of fingers,
//! hard or soft, by a bundle of facets.
//!
//! As in [`crate::ascent`] a step is the shortest that lifts the linear models of all facets
//! nearby, but the facets come one at a time: Q's gradient is that of one of the nearest, and where
//! a step meets another, that one joins the bundle and the step is taken anew. Models are moved
//! along with the grasp, and dropped when they are old.

use crate::contact::FrictionCone;
use crate::limits::Limits;
use crate::nnls::shortest_step;
use crate::quality::{Evaluator, Twist, task_gradient, task_quality};
use crate::region::Region;
use crate::surface::{Placed, Surface};
use glam::DVec3;
use std::f64::consts::TAU;

/// Contact coordinates (u_i, θ_i) of a grasp.
pub(crate) type Coordinates = Vec<[f64; 2]>;

/// A guard: a few dozen steps are usual.
const STEPS: usize = 300;
/// The ascent ends where less than this is promised, relative to Q.
const GAIN: f64 = 1e-7;
/// A facet is forgotten after so many steps.
const AGE: usize = 12;
/// The reach of a step, as a share of the lever arms.
const REACH: f64 = 0.2;
/// Limits within so many reaches are looked at.
const NEAR: f64 = 2.0;

/// Where to climb.
pub(crate) struct Ground<'a> {
    pub surface: &'a Surface,
    pub center: DVec3,
    pub region: &'a dyn Region,
    pub limits: &'a Limits,
    /// The task, if the grasp is for one, and the fingers' friction cones.
    pub task: &'a [Twist],
    pub cone: &'a FrictionCone,
}

/// A facet's distance from the origin, linear in a step by arc length along u and θ.
struct Facet<const D: usize> {
    value: f64,
    slopes: [f64; D],
    age: usize,
}

impl Ground<'_> {
    /// From a grasp that is allowed and holds to one that is at least as good, and its quality.
    pub fn climb(&self, evaluator: &mut Evaluator, start: &[[f64; 2]]) -> (Coordinates, f64) {
        match start.len() {
            0..=3 => self.climb_in::<6, 7>(evaluator, start),
            4..=5 => self.climb_in::<10, 11>(evaluator, start),
            6..=8 => self.climb_in::<16, 17>(evaluator, start),
            9..=16 => self.climb_in::<32, 33>(evaluator, start),
            _ => (start.to_vec(), self.value(evaluator, start)),
        }
    }

    /// Q_l, or how much of the task can be done.
    pub fn value(&self, evaluator: &mut Evaluator, at: &[[f64; 2]]) -> f64 {
        let contacts: Vec<_> = at
            .iter()
            .map(|&[u, theta]| self.surface.contact(u, theta))
            .collect();
        if self.task.is_empty() {
            evaluator.quality(&contacts, self.center)
        } else {
            task_quality(&contacts, self.center, self.cone, self.task)
        }
    }

    fn placed(&self, at: &[[f64; 2]]) -> Vec<Placed> {
        at.iter()
            .map(|&[u, theta]| self.surface.place(u, theta))
            .collect()
    }

    /// Is every contact where it may be, by itself and with the others?
    fn allows(&self, at: &[[f64; 2]], placed: &[Placed]) -> bool {
        let pressed: Vec<_> = placed
            .iter()
            .map(|p| (p.contact.point, p.contact.normal))
            .collect();
        at.iter().all(|&[u, theta]| self.region.allows(u, theta)) && self.limits.allow(&pressed)
    }

    fn climb_in<const D: usize, const N: usize>(
        &self,
        evaluator: &mut Evaluator,
        start: &[[f64; 2]],
    ) -> (Coordinates, f64) {
        let mut at = start.to_vec();
        let mut placed = self.placed(&at);
        let levers = placed
            .iter()
            .map(|p| p.contact.point.distance(self.center))
            .sum::<f64>();
        let reach = REACH * levers / at.len() as f64;
        let mut facets: Vec<Facet<D>> = vec![self.facet(evaluator, &placed)];
        let mut quality = facets[0].value;
        let mut ask = 0.25 * quality;
        for _ in 0..STEPS {
            if quality <= 0.0 {
                break;
            }
            let least = GAIN * quality;
            let found = self.step::<D, N>(&at, &placed, &facets, quality, ask, least, reach);
            let Some((step, asked)) = found else {
                break;
            };
            let target = self.moved(&at, &placed, &step);
            let there = self.placed(&target);
            if !self.allows(&target, &there) {
                ask = 0.3 * asked;
                if ask < least {
                    break;
                }
                continue;
            }
            let mut met: Facet<D> = self.facet(evaluator, &there);
            let gain = met.value - quality;
            if gain > 0.0 {
                for facet in &mut facets {
                    facet.value = (facet.value + dot(&facet.slopes, &step)).max(met.value);
                    facet.age += 1;
                }
                facets.retain(|facet| facet.age <= AGE);
                (at, placed, quality) = (target, there, met.value);
                ask = if gain > 0.7 * asked {
                    2.0 * asked
                } else {
                    gain.max(0.3 * asked)
                };
            } else {
                // Q is the smallest of all distances: none is below it here.
                met.value = (met.value - dot(&met.slopes, &step)).max(quality);
                ask = 0.4 * asked;
            }
            facets.push(met);
            if ask < least {
                break;
            }
        }
        (at, quality)
    }

    /// One of the nearest facets.
    fn facet<const D: usize>(&self, evaluator: &mut Evaluator, placed: &[Placed]) -> Facet<D> {
        let contacts: Vec<_> = placed.iter().map(|p| p.contact).collect();
        let gradient = if self.task.is_empty() {
            evaluator.gradient(&contacts, self.center)
        } else {
            task_gradient(&contacts, self.center, self.cone, self.task)
        };
        let mut slopes = [0.0; D];
        for (k, own) in placed.iter().enumerate() {
            for axis in 0..2 {
                let tangent = own.tangents[axis];
                slopes[2 * k + axis] = (gradient.contacts[k].dot(tangent)
                    + gradient.normals[k].dot(own.normal_slopes[axis]))
                    / tangent.length();
            }
        }
        Facet {
            value: gradient.value,
            slopes,
            age: 0,
        }
    }

    /// The shortest step to the gain `ask`, or to the largest smaller one that can be had within
    /// `reach`; `None` if not even `least` can.
    #[expect(
        clippy::too_many_arguments,
        reason = "a grasp, its models and the gain"
    )]
    fn step<const D: usize, const N: usize>(
        &self,
        at: &[[f64; 2]],
        placed: &[Placed],
        facets: &[Facet<D>],
        quality: f64,
        mut ask: f64,
        least: f64,
        reach: f64,
    ) -> Option<([f64; D], f64)> {
        let mut rows: Vec<[f64; D]> = facets.iter().map(|facet| facet.slopes).collect();
        let mut lower = vec![0.0; rows.len()];
        self.bounds(at, placed, reach, &mut rows, &mut lower);
        while ask >= least {
            for (bound, facet) in lower.iter_mut().zip(facets) {
                *bound = quality + ask - facet.value;
            }
            match shortest_step::<D, N>(&rows, &lower) {
                Some(step) => {
                    let length = dot(&step, &step).sqrt();
                    if length <= reach {
                        return Some((step, ask));
                    }
                    ask *= (0.9 * reach / length).min(0.7);
                }
                None => ask *= 0.3,
            }
        }
        None
    }

    /// The region's ends, and the pairs' distances, as far as a step could meet them.
    fn bounds<const D: usize>(
        &self,
        at: &[[f64; 2]],
        placed: &[Placed],
        reach: f64,
        rows: &mut Vec<[f64; D]>,
        lower: &mut Vec<f64>,
    ) {
        for (k, own) in placed.iter().enumerate() {
            let room = self.region.room(at[k]).into_iter().flatten();
            for (side, room) in room.enumerate() {
                let axis = side / 2;
                let room = room * own.tangents[axis].length();
                if room < NEAR * reach {
                    let mut row = [0.0; D];
                    row[2 * k + axis] = if side % 2 == 0 { 1.0 } else { -1.0 };
                    rows.push(row);
                    lower.push(-room);
                }
            }
        }
        if !self.limits.pairs_matter() {
            return;
        }
        let [low, high] = self.limits.opening;
        let low = low.max(self.limits.apart);
        for k in 1..placed.len() {
            for j in 0..k {
                let between = placed[k].contact.point - placed[j].contact.point;
                let distance = between.length();
                if distance == 0.0 {
                    continue;
                }
                let mut row = [0.0; D];
                for axis in 0..2 {
                    for (finger, sign) in [(k, 1.0), (j, -1.0)] {
                        let tangent = placed[finger].tangents[axis].normalize();
                        row[2 * finger + axis] = sign * between.dot(tangent) / distance;
                    }
                }
                // A little inside, as distances bend.
                if distance - low < NEAR * reach {
                    rows.push(row);
                    lower.push((low - distance) * (1.0 - 1e-3));
                }
                if high - distance < NEAR * reach {
                    rows.push(row.map(|x| -x));
                    lower.push((distance - high) * (1.0 - 1e-3));
                }
            }
        }
    }

    /// Moved along u, then along θ, each as far as the region lets it.
    fn moved(&self, at: &[[f64; 2]], placed: &[Placed], step: &[f64]) -> Coordinates {
        at.iter()
            .zip(placed)
            .enumerate()
            .map(|(k, (&[u, theta], own))| {
                let by = |axis: usize| step[2 * k + axis] / own.tangents[axis].length();
                let [[back, forth], _] = self.region.room([u, theta]);
                let u = (u + by(0).clamp(-back, forth)).clamp(0.0, 1.0);
                let [_, [back, forth]] = self.region.room([u, theta]);
                [u, (theta + by(1).clamp(-back, forth)).rem_euclid(TAU)]
            })
            .collect()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
