//! Ascent of Q_l over the contacts of a grasp on a fixed surface.
//!
//! Q is the smallest of the distances q_k from the origin to the hull's facets, each smooth in
//! p = (u₁, θ₁, u₂, θ₂, u₃, θ₃). At a maximum several are equal, so following the gradient of the
//! nearest alone zigzags. A step here is the shortest d that lifts the linear models of *all*
//! facets nearby to Q + η, ⟨∇q_k, d⟩ ≥ Q + η − q_k; the gain η that is asked for adapts to the
//! gain that comes. No step with q_k + ⟨∇q_k, d⟩ > Q for all k: a maximum.

use crate::math;
use crate::nnls::shortest_step;
use crate::quality::Evaluator;
use crate::surface::Surface;
use glam::DVec3;
use std::f64::consts::TAU;

/// Contact coordinates (u_i, θ_i) of a grasp.
pub type Coordinates = [[f64; 2]; 3];

/// Facets looked at per step: more than ever meet in a point.
const MOST_FACETS: usize = 8;

/// Where contacts may lie.
pub trait Region: Sync {
    /// Is a contact at (u, θ) allowed?
    fn allows(&self, u: f64, theta: f64) -> bool;

    /// The nearest allowed contact, if any; a unit of u and one of θ are as long as given.
    fn nearest(&self, at: [f64; 2], lengths: [f64; 2]) -> Option<[f64; 2]>;
}

/// The ascent stops after so many steps, or when it asks for less than a relative gain.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Effort {
    pub steps: usize,
    pub gain: f64,
}

/// A surface to climb on.
pub(crate) struct Climber<'a> {
    pub surface: &'a Surface,
    pub center: DVec3,
    pub region: &'a dyn Region,
    /// Is it a surface of revolution, nearly?
    pub round: bool,
}

/// A grasp with the linear models of the facets near the origin.
struct Model {
    at: Coordinates,
    quality: f64,
    /// Distances and their gradients by arc length along u and θ.
    facets: Vec<(f64, [f64; 6])>,
    /// Lengths of t₁ and t₂ at each contact.
    scale: [f64; 6],
}

impl Climber<'_> {
    /// Q_l at the given coordinates, 0 outside of the region; anything up to `bar` if it is not
    /// above.
    pub fn quality_up_to(&self, evaluator: &mut Evaluator, at: &Coordinates, bar: f64) -> f64 {
        if !self.allowed(at) {
            return 0.0;
        }
        let contacts = at.map(|[u, theta]| self.surface.contact(u, theta));
        evaluator.quality_up_to(&contacts, self.center, bar)
    }

    fn allowed(&self, at: &Coordinates) -> bool {
        at.iter().all(|&[u, theta]| self.region.allows(u, theta))
    }

    /// From a grasp with Q > 0 to one that is at least as good; `None` if Q = 0 there.
    pub fn climb(
        &self,
        evaluator: &mut Evaluator,
        start: Coordinates,
        effort: Effort,
    ) -> Option<(Coordinates, f64)> {
        // The reach of the first step, as a share of the lever arms.
        let reach = 0.2 * self.reach(&start);
        let mut model = self.model(evaluator, start, |quality| 1.5 * quality + reach)?;
        let mut ask = 0.25 * model.quality;
        for _ in 0..effort.steps {
            let Some((step, asked)) = self.step(&model, ask, effort.gain * model.quality, reach)
            else {
                break;
            };
            let length = step.iter().map(|d| d * d).sum::<f64>().sqrt();
            let steepest = model
                .facets
                .iter()
                .map(|(_, g)| norm(g))
                .fold(0.0, f64::max);
            let target = self.moved(&model, &step);
            // Facets that the next step could meet.
            let bar = model.quality + asked + steepest * length;
            let trial = self
                .allowed(&target)
                .then(|| self.model(evaluator, target, |_| bar))
                .flatten();
            ask = match trial {
                Some(trial) if trial.quality > model.quality => {
                    let gain = trial.quality - model.quality;
                    model = trial;
                    if gain > 0.7 * asked {
                        2.0 * asked
                    } else {
                        gain.max(0.3 * asked)
                    }
                }
                _ => 0.2 * asked,
            };
            if ask < effort.gain * model.quality {
                break;
            }
        }
        Some((model.at, model.quality))
    }

    /// The mean distance of the contacts from the centre of mass.
    fn reach(&self, at: &Coordinates) -> f64 {
        at.iter()
            .map(|&[u, theta]| self.surface.contact(u, theta).point.distance(self.center))
            .sum::<f64>()
            / 3.0
    }

    fn model(
        &self,
        evaluator: &mut Evaluator,
        at: Coordinates,
        bar: impl Fn(f64) -> f64,
    ) -> Option<Model> {
        let placed = at.map(|[u, theta]| self.surface.place(u, theta));
        let contacts = placed.map(|p| p.contact);
        // A bar that depends on the quality costs one more evaluation.
        let bar = match bar(0.0) {
            fixed if bar(1.0) == fixed => fixed,
            _ => bar(evaluator.quality(&contacts, self.center)),
        };
        let facets = evaluator.facets_within(&contacts, self.center, bar, MOST_FACETS)?;
        let scale: [f64; 6] = std::array::from_fn(|i| placed[i / 2].tangents[i % 2].length());
        let facets: Vec<(f64, [f64; 6])> = facets
            .iter()
            .map(|gradient| {
                let slopes = std::array::from_fn(|i| {
                    let (contact, axis) = (i / 2, i % 2);
                    (gradient.contacts[contact].dot(placed[contact].tangents[axis])
                        + gradient.normals[contact].dot(placed[contact].normal_slopes[axis]))
                        / scale[i]
                });
                (gradient.value, slopes)
            })
            .collect();
        Some(Model {
            at,
            quality: facets[0].0,
            facets,
            scale,
        })
    }

    /// The shortest step to the gain `ask`, or to the largest smaller one that can be had within
    /// `reach`; `None` if not even `least` can.
    fn step(&self, model: &Model, mut ask: f64, least: f64, reach: f64) -> Option<([f64; 6], f64)> {
        // u stays in [0, 1].
        let mut rows: Vec<[f64; 6]> = model.facets.iter().map(|(_, slopes)| *slopes).collect();
        let facets = rows.len();
        let mut lower = vec![0.0; facets];
        for (contact, &[u, _]) in model.at.iter().enumerate() {
            let axis = 2 * contact;
            for (sign, room) in [(1.0, u), (-1.0, 1.0 - u)] {
                // Far from the ends the constraint cannot matter.
                if room * model.scale[axis] < 2.0 * reach {
                    let mut row = [0.0; 6];
                    row[axis] = sign;
                    rows.push(row);
                    lower.push(-room * model.scale[axis]);
                }
            }
        }
        while ask >= least {
            for (bound, (value, _)) in lower.iter_mut().zip(&model.facets) {
                *bound = model.quality + ask - value;
            }
            match shortest_step::<6, 7>(&rows, &lower) {
                Some(step) if norm(&step) <= reach => return Some((step, ask)),
                Some(step) => ask *= (0.9 * reach / norm(&step)).min(0.7),
                None => ask *= 0.3,
            }
        }
        None
    }

    fn moved(&self, model: &Model, step: &[f64; 6]) -> Coordinates {
        std::array::from_fn(|i| {
            let [u, theta] = model.at[i];
            [
                (u + step[2 * i] / model.scale[2 * i]).clamp(0.0, 1.0),
                (theta + step[2 * i + 1] / model.scale[2 * i + 1]).rem_euclid(TAU),
            ]
        })
    }
}

fn norm(v: &[f64; 6]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Every contact is allowed.
#[derive(Debug, Clone, Copy)]
pub struct Anywhere;

impl Region for Anywhere {
    fn allows(&self, _: f64, _: f64) -> bool {
        true
    }

    fn nearest(&self, at: [f64; 2], _: [f64; 2]) -> Option<[f64; 2]> {
        Some(at)
    }
}

/// Contacts are allowed in some cells of a grid: row-major, rows over u, columns over θ.
#[derive(Debug, Clone, Copy)]
pub struct Cells<'a> {
    /// Whether each cell is allowed.
    pub allowed: &'a [bool],
    /// Cells per row.
    pub columns: usize,
}

impl Region for Cells<'_> {
    fn allows(&self, u: f64, theta: f64) -> bool {
        let rows = self.allowed.len() / self.columns;
        let cell = |share: f64, count: usize| ((share * count as f64) as usize).min(count - 1);
        let row = cell(u, rows);
        let column = cell(theta.rem_euclid(TAU) / TAU, self.columns);
        self.allowed[row * self.columns + column]
    }

    fn nearest(&self, at: [f64; 2], lengths: [f64; 2]) -> Option<[f64; 2]> {
        if self.allows(at[0], at[1]) {
            return Some(at);
        }
        let rows = self.allowed.len() / self.columns;
        let far = |to: &[f64; 2]| {
            let turn = (to[1] - at[1]).rem_euclid(TAU);
            math::hypot(
                lengths[0] * (to[0] - at[0]),
                lengths[1] * turn.min(TAU - turn),
            )
        };
        self.allowed
            .iter()
            .enumerate()
            .filter(|&(_, &allowed)| allowed)
            .map(|(cell, _)| {
                let (row, column) = (cell / self.columns, cell % self.columns);
                [
                    (row as f64 + 0.5) / rows as f64,
                    (column as f64 + 0.5) * TAU / self.columns as f64,
                ]
            })
            .min_by(|a, b| far(a).total_cmp(&far(b)))
    }
}
