//! Carrying a grasp from one surface to another along (1 − t) S + t S' (Sec. IV.D).

use crate::ascent::{Climber, Coordinates, Effort, noticeably};
use crate::contact::{Contact, FrictionCone};
use crate::error::Error;
use crate::parallel::*;
use crate::quality::{Evaluator, Gradient};
use crate::region::{Anywhere, Region};
use crate::surface::Surface;
use glam::DVec3;
use std::f64::consts::TAU;
use std::sync::atomic::{AtomicBool, Ordering};

/// Steps of Simpson's rule for the centres of mass between the two ends, as in Sec. IV.E.
const SIMPSON: usize = 20;

/// The surfaces (1 − t) S + t S', on one grid, so that they cost no more than their coefficients.
#[derive(Debug, Clone)]
pub struct Deformation {
    source: Surface,
    target: Surface,
}

/// A grasp that was carried, by its contact coordinates (u_i, θ_i).
#[derive(Debug, Clone, PartialEq)]
pub struct Carried {
    /// On the target.
    pub coordinates: Vec<[f64; 2]>,
    /// (t, Q_l) on the way, from 0 to 1.
    pub path: Vec<[f64; 2]>,
    /// How many times Q_l, its gradient or its facets were computed.
    pub evaluations: usize,
}

/// The paper's gradient method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Schedule {
    /// N₁: surfaces on the way.
    pub surfaces: usize,
    /// N₂: gradient steps on each.
    pub steps: usize,
    /// δ: a step is δ∇Q.
    pub length: f64,
    /// h of forward differences in place of exact derivatives.
    pub difference: Option<f64>,
}

impl Deformation {
    /// From `source` to `target`.
    pub fn new(source: &Surface, target: &Surface) -> Result<Self, Error> {
        let (source, target) = source.on_common_grid(target)?;
        Ok(Self { source, target })
    }

    /// The surface at t and its centre of mass, exact at the ends.
    fn at(&self, t: f64) -> (Surface, DVec3) {
        let surface = self.source.towards(&self.target, t);
        let center = if t == 0.0 || t == 1.0 {
            surface.integrals().center_of_mass
        } else {
            surface.integrals_by_simpson(SIMPSON).center_of_mass
        };
        (surface, center)
    }

    fn stages(&self, count: usize) -> Vec<(Surface, DVec3)> {
        (0..=count)
            .into_par_iter()
            .map(|s| self.at(s as f64 / count as f64))
            .collect()
    }

    /// The naïve transfer (Def. III.4): the coordinates stay, Q_l is sampled at `samples` + 1
    /// values of t. `stop`, set to true, ends this and the other methods with
    /// [`Error::Interrupted`].
    pub fn naive(
        &self,
        grasps: &[Vec<[f64; 2]>],
        cone: &FrictionCone,
        samples: usize,
        stop: &AtomicBool,
    ) -> Result<Vec<Carried>, Error> {
        let still = Schedule {
            surfaces: samples,
            steps: 0,
            length: 0.0,
            difference: None,
        };
        self.by_gradient(grasps, cone, still, stop)
    }

    /// The gradient method of Sec. IV.D: on each of N₁ surfaces N₂ steps x + δ∇Q(x), then the naïve
    /// transfer to the next; u stays in [0, 1].
    pub fn by_gradient(
        &self,
        grasps: &[Vec<[f64; 2]>],
        cone: &FrictionCone,
        schedule: Schedule,
        stop: &AtomicBool,
    ) -> Result<Vec<Carried>, Error> {
        let stages = self.stages(schedule.surfaces);
        let carry = |evaluator: &mut Evaluator, start: &Vec<[f64; 2]>| {
            let mut at = start.clone();
            let mut path = Vec::with_capacity(stages.len());
            let mut evaluations = 0;
            for (index, (surface, center)) in stages.iter().enumerate() {
                // The way ends with the naïve transfer to the target.
                let last = index + 1 == stages.len();
                go_on(stop)?;
                for _ in 0..if last { 0 } else { schedule.steps } {
                    let slope = match schedule.difference {
                        Some(h) => {
                            evaluations += 2 * at.len() + 1;
                            differences(evaluator, surface, *center, &at, h)
                        }
                        None => {
                            evaluations += 1;
                            slope(evaluator, surface, *center, &at)
                        }
                    };
                    for (point, slope) in at.iter_mut().zip(slope) {
                        point[0] = (point[0] + schedule.length * slope[0]).clamp(0.0, 1.0);
                        point[1] = (point[1] + schedule.length * slope[1]).rem_euclid(TAU);
                    }
                }
                evaluations += 1;
                let quality = evaluator.quality(&contacts(surface, &at), *center);
                path.push([index as f64 / (stages.len() - 1) as f64, quality]);
            }
            Ok(Carried {
                coordinates: at,
                path,
                evaluations,
            })
        };
        grasps
            .par_iter()
            .map_init(|| Evaluator::new(cone), carry)
            .collect()
    }

    /// A method of our own, for three contacts: on surfaces as near to each other as keeps the grasp
    /// good, an ascent by all facets near the origin (see [`crate::ascent`]); in few steps, in many
    /// and at once, and from the best of these to a local maximum on the target.
    ///
    /// On the target contacts lie in `region`: from elsewhere they move to its nearest part. Where it
    /// allows none the grasp is lost, and ends with quality 0 at the coordinates that it came with.
    pub fn by_ascent(
        &self,
        grasps: &[Coordinates],
        cone: &FrictionCone,
        region: &dyn Region,
        stop: &AtomicBool,
    ) -> Result<Vec<Carried>, Error> {
        let (surface, center) = self.at(1.0);
        let target = Climber {
            surface: &surface,
            center,
            region,
            round: false,
        };
        grasps
            .par_iter()
            .map_init(
                || Evaluator::new(cone),
                |evaluator, start| self.ascend(evaluator, *start, &target, stop),
            )
            .collect()
    }

    /// The best of three ways, in few long steps, in many short ones and at once, and on to a local
    /// maximum.
    fn ascend(
        &self,
        evaluator: &mut Evaluator,
        start: Coordinates,
        target: &Climber,
        stop: &AtomicBool,
    ) -> Result<Carried, Error> {
        let before = evaluator.evaluations();
        let (mut at, mut path) = self.ascend_in_steps(evaluator, start, target, 0.25, stop)?;
        for longest in [1.0 / 12.0, 1.0] {
            let other = self.ascend_in_steps(evaluator, start, target, longest, stop)?;
            if noticeably(reached(&other.1), reached(&path)) {
                (at, path) = other;
            }
        }
        if reached(&path) > 0.0
            && let Some((better, quality)) = target.to_maximum(evaluator, at)
        {
            at = better;
            path.pop();
            path.push([1.0, quality]);
        }
        Ok(Carried {
            coordinates: at.to_vec(),
            path,
            evaluations: evaluator.evaluations() - before,
        })
    }

    /// Where a grasp comes to, and (t, Q_l) on the way.
    fn ascend_in_steps(
        &self,
        evaluator: &mut Evaluator,
        start: Coordinates,
        target: &Climber,
        longest: f64,
        stop: &AtomicBool,
    ) -> Result<(Coordinates, Vec<[f64; 2]>), Error> {
        const SHORTEST: f64 = 1.0 / 64.0;
        /// The next surface is near enough if the grasp keeps this share of its quality there.
        const KEPT: f64 = 0.5;
        const ON_THE_WAY: Effort = Effort {
            steps: 2,
            gain: 1e-2,
        };
        let mut at = start;
        let (surface, center) = self.at(0.0);
        let mut quality = evaluator.quality(&contacts(&surface, &at), center);
        let mut path = vec![[0.0, quality]];
        let (mut t, mut step) = (0.0, longest);
        while t < 1.0 {
            go_on(stop)?;
            let next = if t + 1.01 * step >= 1.0 {
                1.0
            } else {
                t + step
            };
            let arrived = next == 1.0;
            let stage = (!arrived).then(|| self.at(next));
            let climber = match &stage {
                Some((surface, center)) => &Climber {
                    surface,
                    center: *center,
                    region: &Anywhere,
                    round: false,
                },
                None => target,
            };
            let Some(landing) = landing(&at, climber) else {
                // Nothing of the target may be touched.
                path.push([1.0, 0.0]);
                break;
            };
            let carried = evaluator.quality(&contacts(climber.surface, &landing), climber.center);
            if carried < KEPT * quality && step > SHORTEST && longest < 1.0 {
                step *= 0.5;
                continue;
            }
            (at, quality) = (landing, carried);
            let climbed = if arrived {
                climber.arrive(evaluator, at)
            } else {
                climber.climb(evaluator, at, ON_THE_WAY)
            };
            if let Some(better) = climbed {
                (at, quality) = better;
            }
            t = next;
            path.push([t, quality]);
            step = (1.5 * step).min(longest);
        }
        Ok((at, path))
    }
}

fn go_on(stop: &AtomicBool) -> Result<(), Error> {
    if stop.load(Ordering::Relaxed) {
        return Err(Error::Interrupted);
    }
    Ok(())
}

/// The allowed contacts nearest to these, if there are any.
fn landing(at: &Coordinates, climber: &Climber) -> Option<Coordinates> {
    let mut landing = *at;
    for contact in &mut landing {
        let [u, theta] = *contact;
        let lengths = climber.surface.place(u, theta).tangents.map(DVec3::length);
        *contact = climber.region.nearest(*contact, lengths)?;
    }
    Some(landing)
}

fn reached(path: &[[f64; 2]]) -> f64 {
    path.last().map_or(0.0, |last| last[1])
}

fn contacts(surface: &Surface, at: &[[f64; 2]]) -> Vec<Contact> {
    at.iter()
        .map(|&[u, theta]| surface.contact(u, theta))
        .collect()
}

/// ∂Q/∂u_i and ∂Q/∂θ_i on a fixed surface.
fn slope(
    evaluator: &mut Evaluator,
    surface: &Surface,
    center: DVec3,
    at: &[[f64; 2]],
) -> Vec<[f64; 2]> {
    let placed: Vec<_> = at
        .iter()
        .map(|&[u, theta]| surface.place(u, theta))
        .collect();
    let contacts: Vec<Contact> = placed.iter().map(|p| p.contact).collect();
    let Gradient {
        contacts: by_point,
        normals: by_normal,
        ..
    } = evaluator.gradient(&contacts, center);
    placed
        .iter()
        .zip(by_point.iter().zip(&by_normal))
        .map(|(placed, (by_point, by_normal))| {
            [0, 1].map(|axis| {
                by_point.dot(placed.tangents[axis]) + by_normal.dot(placed.normal_slopes[axis])
            })
        })
        .collect()
}

/// The same by forward differences; backward where u + h would leave the surface.
fn differences(
    evaluator: &mut Evaluator,
    surface: &Surface,
    center: DVec3,
    at: &[[f64; 2]],
    h: f64,
) -> Vec<[f64; 2]> {
    let here = contacts(surface, at);
    let value = evaluator.quality(&here, center);
    at.iter()
        .enumerate()
        .map(|(i, &[u, theta])| {
            let mut at_step = |u: f64, theta: f64, step: f64| {
                let mut moved = here.clone();
                moved[i] = surface.contact(u, theta);
                (evaluator.quality(&moved, center) - value) / step
            };
            let step = if u + h > 1.0 { -h } else { h };
            [at_step(u + step, theta, step), at_step(u, theta + h, h)]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bumpy cylinder.
    fn surface(height: f64, bump: f64) -> Surface {
        let (rows, columns) = (7, 8);
        let coefficients = (0..rows * columns)
            .map(|k| {
                let (row, column) = (k / columns, k % columns);
                0.5 + bump * ((row * row + 3 * column) % 5) as f64 / 5.0
            })
            .collect();
        Surface::new(-height, height, columns, coefficients).unwrap()
    }

    #[test]
    fn exact_and_finite_differences_go_the_same_way() {
        let cone = FrictionCone::new(1.0, 8).unwrap();
        let way = Deformation::new(&surface(0.6, 0.05), &surface(0.8, 0.2)).unwrap();
        let go = AtomicBool::new(false);
        let grasps = vec![vec![[0.5, 0.1], [0.45, 2.2], [0.55, 4.3]]];
        let schedule = Schedule {
            surfaces: 10,
            steps: 5,
            length: 1e-3,
            difference: None,
        };
        let exact = way.by_gradient(&grasps, &cone, schedule, &go).unwrap();
        let difference = Some(1e-7);
        let finite = way.by_gradient(
            &grasps,
            &cone,
            Schedule {
                difference,
                ..schedule
            },
            &go,
        );
        let finite = finite.unwrap();
        assert_eq!(exact[0].path.len(), 11);
        assert_eq!(exact[0].evaluations, 50 + 11);
        assert_eq!(finite[0].evaluations, 350 + 11);
        for (a, b) in exact[0].path.iter().zip(&finite[0].path) {
            assert!((a[1] - b[1]).abs() < 1e-4, "{a:?} {b:?}");
        }
        let still = way.naive(&grasps, &cone, 10, &go).unwrap();
        assert_eq!(still[0].coordinates, grasps[0]);
        assert!(exact[0].path[10][1] > still[0].path[10][1]);
        let stopped = way.naive(&grasps, &cone, 10, &AtomicBool::new(true));
        assert_eq!(stopped, Err(Error::Interrupted));
    }
}
