//! Ascent of Q_l over the contacts of a grasp on a fixed surface.
//!
//! Q is the smallest of the distances q_k from the origin to the hull's facets, each smooth in
//! p = (u₁, θ₁, u₂, θ₂, u₃, θ₃) for as long as the facet keeps its wrenches. At a maximum several
//! are equal, so following the gradient of the nearest alone zigzags. A step here is the shortest d
//! that lifts the linear models of *all* facets nearby to Q + η, ⟨∇q_k, d⟩ ≥ Q + η − q_k; the gain
//! η that is asked for adapts to the gain that comes.
//!
//! [`Climber::climb`] ends where the models of the facets nearby promise less than a small gain
//! within reach: there is a convex combination of their gradients, and of the normals of what
//! bounds the contacts, that is 0 to that tolerance. [`Climber::to_maximum`] goes on from there
//! until no hop to a little way off leads to a better end.

use crate::nnls::shortest_step;
use crate::quality::Evaluator;
use crate::region::Region;
use crate::surface::Surface;
use glam::DVec3;
use std::f64::consts::TAU;

/// Contact coordinates (u_i, θ_i) of a grasp.
pub type Coordinates = [[f64; 2]; 3];

/// Facets looked at per step: more than ever meet in a point.
const MOST_FACETS: usize = 8;

/// The ascent stops after so many steps, or where it is promised less than a relative gain.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Effort {
    pub steps: usize,
    pub gain: f64,
}

/// To a point without a direction of ascent. The steps are a guard: a few dozen are usual.
const ARRIVAL: Effort = Effort {
    steps: 1000,
    gain: 1e-13,
};
/// A better end must be better by this, relative to Q.
const NOTICEABLE: f64 = 1e-6;

/// To tell whether a hop leads anywhere.
const LOOK: Effort = Effort {
    steps: 4,
    gain: 1e-3,
};
/// After a look only ends with this share of Q are followed.
const PROMISING: f64 = 0.97;
/// Hops from an end, and how far they go in (u, θ): long ones to maxima nearby, short ones to the
/// other side of a kink where a wrench crosses a facet.
const HOPS: [(usize, f64); 2] = [(12, 0.1), (4, 1e-3)];
/// A guard: ends that are hopped from.
const MOST_ENDS: usize = 100;

/// A surface to climb on.
pub(crate) struct Climber<'a> {
    pub surface: &'a Surface,
    pub center: DVec3,
    pub region: &'a dyn Region,
    /// Is it known to be a surface of revolution, nearly?
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
        let mut model = self.model(evaluator, start, None, reach)?;
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
            let target = self.moved(&model.at, &per_unit(&step, &model.scale));
            // Facets that the next step could meet.
            let bar = model.quality + asked + steepest * length;
            let trial = self.model(evaluator, target, Some(bar), reach);
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

    /// From a grasp with Q > 0 to a local maximum that is at least as good; `None` if Q = 0 there.
    ///
    /// Climbing from the end again, or hopping from it, comes to nothing better: that is what ends
    /// it, so that an ascent from the end stays where it is.
    pub fn to_maximum(
        &self,
        evaluator: &mut Evaluator,
        start: Coordinates,
    ) -> Option<(Coordinates, f64)> {
        let mut end = self.arrive(evaluator, start)?;
        for _ in 0..MOST_ENDS {
            let Some(better) = hops().find_map(|hop| self.hop(evaluator, end, hop)) else {
                break;
            };
            end = better;
        }
        Some(end)
    }

    /// Climbs until climbing again, with the long steps with which it starts, gains nothing.
    pub fn arrive(
        &self,
        evaluator: &mut Evaluator,
        start: Coordinates,
    ) -> Option<(Coordinates, f64)> {
        let mut end = self.climb(evaluator, start, ARRIVAL)?;
        for _ in 0..MOST_ENDS {
            let again = self.climb(evaluator, end.0, ARRIVAL)?;
            if !noticeably(again.1, end.1) {
                break;
            }
            end = again;
        }
        Some(end)
    }

    /// A better end by way of a place some way off, if there is one.
    fn hop(
        &self,
        evaluator: &mut Evaluator,
        (at, quality): (Coordinates, f64),
        hop: [f64; 6],
    ) -> Option<(Coordinates, f64)> {
        let start = self.moved(&at, &by_rank(&at, &hop));
        let (looked, reached) = self.climb(evaluator, start, LOOK)?;
        if reached < PROMISING * quality {
            return None;
        }
        let (better, reached) = self.climb(evaluator, looked, ARRIVAL)?;
        if !noticeably(reached, quality) {
            return None;
        }
        self.arrive(evaluator, better)
    }

    /// The mean distance of the contacts from the centre of mass.
    fn reach(&self, at: &Coordinates) -> f64 {
        at.iter()
            .map(|&[u, theta]| self.surface.contact(u, theta).point.distance(self.center))
            .sum::<f64>()
            / 3.0
    }

    /// The facets nearer than `bar`; without one, those that a first step could meet.
    fn model(
        &self,
        evaluator: &mut Evaluator,
        at: Coordinates,
        bar: Option<f64>,
        reach: f64,
    ) -> Option<Model> {
        let placed = at.map(|[u, theta]| self.surface.place(u, theta));
        let contacts = placed.map(|p| p.contact);
        let bar = bar.unwrap_or_else(|| 1.5 * evaluator.quality(&contacts, self.center) + reach);
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
        let mut rows: Vec<[f64; 6]> = model.facets.iter().map(|(_, slopes)| *slopes).collect();
        let facets = rows.len();
        let mut lower = vec![0.0; facets];
        for (contact, &at) in model.at.iter().enumerate() {
            let room = self.region.room(at).into_iter().flatten();
            for (side, room) in room.enumerate() {
                let axis = 2 * contact + side / 2;
                // Far from the ends the constraint cannot matter.
                if room * model.scale[axis] < 2.0 * reach {
                    let mut row = [0.0; 6];
                    row[axis] = if side % 2 == 0 { 1.0 } else { -1.0 };
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

    /// Moved along u, then along θ, each as far as the region lets it.
    pub fn moved(&self, at: &Coordinates, step: &[f64; 6]) -> Coordinates {
        std::array::from_fn(|i| {
            let [u, theta] = at[i];
            let [[back, forth], _] = self.region.room(at[i]);
            let u = (u + step[2 * i].clamp(-back, forth)).clamp(0.0, 1.0);
            let [_, [back, forth]] = self.region.room([u, theta]);
            [
                u,
                (theta + step[2 * i + 1].clamp(-back, forth)).rem_euclid(TAU),
            ]
        })
    }
}

/// Better by more than what ascents to the same place differ by.
pub(crate) fn noticeably(better: f64, quality: f64) -> bool {
    better > quality * (1.0 + NOTICEABLE)
}

/// Steps in fixed directions in (u, θ), without any symmetry of contacts or axes.
fn hops() -> impl Iterator<Item = [f64; 6]> {
    // The additive sequence of the root of x⁷ = x + 1 fills the cube evenly.
    const ROOT: f64 = 1.112_775_684_278_705_5;
    let sizes = HOPS
        .into_iter()
        .flat_map(|(count, size)| std::iter::repeat_n(size, count));
    sizes.enumerate().map(|(k, size)| {
        let mut share = (k + 1) as f64;
        let direction = [0.0; 6].map(|_| {
            share /= ROOT;
            share.fract() - 0.5
        });
        let length = norm(&direction);
        direction.map(|x| size / length * x)
    })
}

/// The first pair of numbers for the contact of the least u, and so on: where a hop leads does not
/// depend on the order of the contacts.
fn by_rank(at: &Coordinates, hop: &[f64; 6]) -> [f64; 6] {
    let mut moved = [0.0; 6];
    for (rank, contact) in order(at).into_iter().enumerate() {
        moved[2 * contact..][..2].copy_from_slice(&hop[2 * rank..][..2]);
    }
    moved
}

/// Coordinates are compared in units of 1/3840 and of 1/3840 turn. That is much more than what ascents
/// to the same place differ by, and halves, thirds, fifths and eighths of a turn are whole.
const GRAINS: f64 = 3840.0;

/// The contacts in ascending order of u, of θ where that is equal.
pub(crate) fn order(at: &Coordinates) -> [usize; 3] {
    let mut order = [0, 1, 2];
    order.sort_by_key(|&contact| grains(at[contact]));
    order
}

/// u and θ in whole units.
pub(crate) fn grains([u, theta]: [f64; 2]) -> [i64; 2] {
    let whole = |share: f64| (share * GRAINS).round() as i64;
    [whole(u), whole(theta / TAU) % GRAINS as i64]
}

/// A step by arc length in (u, θ).
fn per_unit(step: &[f64; 6], scale: &[f64; 6]) -> [f64; 6] {
    std::array::from_fn(|i| step[i] / scale[i])
}

fn norm(v: &[f64; 6]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
#[allow(clippy::disallowed_methods)]
mod tests {
    use super::*;
    use crate::contact::FrictionCone;
    use crate::nnls::nonnegative;
    use crate::region::Anywhere;

    fn bumpy(bump: f64) -> Surface {
        let (rows, columns) = (9, 12);
        let coefficients = (0..rows * columns)
            .map(|k| {
                let (row, column) = (k / columns, k % columns);
                0.5 + bump * (row as f64).sin() * (column as f64 * TAU / 6.0).cos()
            })
            .collect();
        Surface::new(-0.6, 0.7, columns, coefficients).unwrap()
    }

    /// The slow twin of the end of an ascent: 0 is a convex combination of the gradients of all
    /// facets that touch the ball of radius Q, and of the normals of the constraints on u. Where a
    /// wrench crosses such a facet that is not enough: nothing close by is better either.
    #[test]
    fn an_ascent_ends_where_the_generalised_gradient_holds_zero() {
        let cone = FrictionCone::new(1.0, 8).unwrap();
        let mut evaluator = Evaluator::new(&cone);
        let mut ends = 0;
        let mut at_an_end_of_the_surface = 0;
        for bump in [0.0, 0.05, 0.1, 0.2] {
            let surface = bumpy(bump);
            let center = surface.integrals().center_of_mass;
            let climber = Climber {
                surface: &surface,
                center,
                region: &Anywhere,
                round: false,
            };
            for k in 0..12 {
                let turn = 0.5 * f64::from(k) + 0.1;
                let start = [[0.5, turn], [0.2, turn + 3.0], [0.8, turn + 3.3]];
                let Some((at, quality)) = climber.to_maximum(&mut evaluator, start) else {
                    continue;
                };
                ends += 1;
                let near = (1.0 + 1e-6) * quality;
                for hop in 0..3000 {
                    let size = 10f64.powf(-8.0 + 6.0 * f64::from(hop % 100) / 100.0);
                    let step = std::array::from_fn(|i| {
                        size * (f64::from(hop * (2 * i as i32 + 3)) * 0.618_034 + i as f64).sin()
                    });
                    let there = climber.moved(&at, &step);
                    let contacts = there.map(|[u, theta]| surface.contact(u, theta));
                    let around = evaluator.quality(&contacts, center);
                    assert!(
                        around <= quality * (1.0 + 1e-6),
                        "{bump} {k} {around} {quality}"
                    );
                }
                let model = climber.model(&mut evaluator, at, Some(near), 0.0).unwrap();
                let steepest = model
                    .facets
                    .iter()
                    .map(|(_, g)| norm(g))
                    .fold(0.0, f64::max);
                // Columns (∇q/‖∇q‖, 1) and (±e, 0); the target (0, 1).
                let mut columns: Vec<[f64; 7]> = model
                    .facets
                    .iter()
                    .map(|(_, g)| {
                        std::array::from_fn(|i| if i < 6 { g[i] / steepest } else { 1.0 })
                    })
                    .collect();
                for (contact, [u, _]) in at.into_iter().enumerate() {
                    let mut normal = [0.0; 7];
                    if u.min(1.0 - u) < 1e-9 {
                        normal[2 * contact] = 1.0 - 2.0 * u.round();
                        columns.push(normal);
                        at_an_end_of_the_surface += 1;
                    }
                }
                let mut target = [0.0; 7];
                target[6] = 1.0;
                let weights = nonnegative(&columns, target);
                for i in 0..7 {
                    let sum: f64 = columns.iter().zip(&weights).map(|(c, w)| c[i] * w).sum();
                    assert!((sum - target[i]).abs() < 1e-4, "{bump} {k} {i} {sum}");
                }
            }
        }
        assert!(ends >= 24 && at_an_end_of_the_surface >= 6);
    }

    #[test]
    fn hops_have_their_lengths_and_go_with_the_contact_not_its_number() {
        let at = [[0.7, 1.0], [0.2, 3.0], [0.9, 5.0]];
        let turned = [at[2], at[0], at[1]];
        for hop in hops() {
            assert!(
                HOPS.iter()
                    .any(|(_, size)| (norm(&hop) - size).abs() < 1e-15)
            );
            let (one, two) = (by_rank(&at, &hop), by_rank(&turned, &hop));
            assert_eq!(one[0..4], two[2..6]);
            assert_eq!(one[4..6], two[0..2]);
        }
        assert_eq!(order(&at), [1, 0, 2]);
    }
}
