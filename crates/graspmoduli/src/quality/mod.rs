//! The grasp quality Q_l (Sec. II): distance from the origin to the boundary of the wrench hull.
//!
//! Three hard contacts have a closed form ([`three_contacts`]); any other grasp, norm or cone goes
//! by an expanding polytope ([`polytope`]) that needs no more than the hull's farthest points.

mod apex_ray_face;
mod gradient;
mod lanes;
mod plane;
mod polytope;
mod ray_ray_ray;
mod three_contacts;
mod velocity;
mod wrenches;

pub use gradient::Gradient;
pub(crate) use three_contacts::{Kernel, Vertex};
pub use wrenches::Norm;

use crate::contact::{Contact, FrictionCone};
use glam::DVec3;
use polytope::{Distance, Polytope};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use wrenches::{Circular, Wrenches};

/// A twist (v, ω) or a wrench (force, torque).
pub type Twist = [f64; 6];

/// Working memory that evaluates grasps one after the other without allocating.
#[derive(Debug, Clone)]
pub struct Evaluator {
    cone: FrictionCone,
    pub(crate) kernel: Kernel,
    polytope: Polytope,
    wrenches: Wrenches,
    evaluations: usize,
}

/// A grasp's quality with the direction in which it is least.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weakest {
    /// Q.
    pub quality: f64,
    /// The unit wrench (force, torque) that the grasp can apply least of: the normal of the facet
    /// nearest to the origin. If Q = 0, the normal of a plane through the origin that the hull does
    /// not reach beyond.
    pub direction: Twist,
}

impl Evaluator {
    /// For grasps with the given friction cones.
    pub fn new(cone: &FrictionCone) -> Self {
        Self {
            cone: cone.clone(),
            kernel: Kernel::new(cone),
            polytope: Polytope::default(),
            wrenches: Wrenches::new(),
            evaluations: 0,
        }
    }

    /// How many grasps were evaluated so far, for their value, gradient or facets.
    pub fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Exact Q_l; 0 if the origin is not in the interior of the wrench hull.
    #[inline]
    pub fn quality(&mut self, contacts: &[Contact], center_of_mass: DVec3) -> f64 {
        self.evaluations += 1;
        match self.closed_form(contacts) {
            Some(three) => self
                .kernel
                .longest(three, center_of_mass)
                .map_or(0.0, quality_of),
            None => {
                self.distance(contacts, center_of_mass, Norm::Sum, never)
                    .upper
            }
        }
    }

    /// Exact Q'_l: every finger's normal force is at most 1, instead of their sum.
    pub fn quality_of_each(&mut self, contacts: &[Contact], center_of_mass: DVec3) -> f64 {
        self.distance(contacts, center_of_mass, Norm::Each, never)
            .upper
    }

    /// Is Q_l ≥ `threshold`? The same as comparing, but ends as soon as it is known.
    #[inline]
    pub fn is_at_least(
        &mut self,
        contacts: &[Contact],
        center_of_mass: DVec3,
        threshold: f64,
    ) -> bool {
        threshold <= 0.0 || self.quality_up_to(contacts, center_of_mass, threshold) >= threshold
    }

    /// Q_l if it is at least `threshold`, else some number between Q_l and `threshold`.
    #[inline]
    fn quality_up_to(
        &mut self,
        contacts: &[Contact],
        center_of_mass: DVec3,
        threshold: f64,
    ) -> f64 {
        match self.closed_form(contacts) {
            Some(three) => self
                .kernel
                .longest_up_to(three, center_of_mass, threshold)
                .map_or(0.0, quality_of),
            None => {
                let below = |_, upper| upper < threshold;
                self.distance(contacts, center_of_mass, Norm::Sum, below)
                    .upper
            }
        }
    }

    /// As [`Evaluator::weakest`] if Q_l is at least `threshold`; else some unit direction in which
    /// the hull reaches less far than that. `None` where Q_l = 0 and no direction is known.
    pub(crate) fn weakest_up_to(
        &mut self,
        contacts: &[Contact],
        center_of_mass: DVec3,
        threshold: f64,
    ) -> Option<Weakest> {
        let Some(three) = self.closed_form(contacts) else {
            let below = |_, upper| upper < threshold;
            let distance = self.distance(contacts, center_of_mass, Norm::Sum, below);
            return (distance != Distance::ZERO).then(|| self.unscaled(&distance));
        };
        let vertex = self
            .kernel
            .longest_up_to(three, center_of_mass, threshold)?;
        let quality = quality_of(vertex);
        Some(Weakest {
            quality,
            direction: vertex.twist.map(|x| x * quality),
        })
    }

    /// The distance with its direction in the object frame.
    fn unscaled(&self, distance: &Distance) -> Weakest {
        let scale = self.wrenches.scale;
        let [a, b, c, d, e, f] = distance.direction;
        let direction = [a, b, c, d / scale, e / scale, f / scale];
        let length = polytope::dot(&direction, &direction).sqrt();
        Weakest {
            quality: distance.upper,
            direction: direction.map(|x| x / length),
        }
    }

    /// Q_l if it is below `threshold`, else `threshold`.
    #[inline]
    pub(crate) fn quality_below(
        &mut self,
        contacts: &[Contact],
        center_of_mass: DVec3,
        threshold: f64,
    ) -> f64 {
        let quality = match self.closed_form(contacts) {
            Some(three) => self
                .kernel
                .longest_above(three, center_of_mass, threshold)
                .map_or(0.0, |vertex| vertex.map_or(threshold, quality_of)),
            None => {
                let above = |lower, _| lower >= threshold;
                self.distance(contacts, center_of_mass, Norm::Sum, above)
                    .upper
            }
        };
        quality.min(threshold)
    }

    /// Q_l with its exact gradient. Where several facets of the hull are nearest to the origin, Q
    /// is not differentiable, and the gradient is that of the distance to one of them, with
    /// multipliers that are not negative: an element of Clarke's generalised gradient.
    pub fn gradient(&mut self, contacts: &[Contact], center_of_mass: DVec3) -> Gradient {
        let mut row = vec![0.0; Gradient::width(contacts.len())];
        self.gradient_row(contacts, center_of_mass, &mut row);
        Gradient::from_row(&row)
    }

    /// [`Evaluator::gradient`] into memory that is all 0, laid out as [`Gradient::width`] says.
    #[inline]
    fn gradient_row(&mut self, contacts: &[Contact], center: DVec3, row: &mut [f64]) {
        self.evaluations += 1;
        if let Some(three) = self.closed_form(contacts) {
            if let Some(vertex) = self.kernel.longest(three, center) {
                row[0] = quality_of(vertex);
                gradient::of_vertex(&vertex, three, center, &self.cone, true, row);
            }
            return;
        }
        let weakest = self.weakest(contacts, center, Norm::Sum);
        if weakest.quality > 0.0 {
            row[0] = weakest.quality;
            let Weakest { quality, direction } = weakest;
            let mut shares = vec![Default::default(); contacts.len()];
            let (wrenches, cone) = (&self.wrenches, &self.cone);
            if gradient::foot_point(wrenches, &direction, quality, cone, &mut shares) {
                gradient::differentiate(&direction, quality, contacts, center, &shares, row);
            }
        }
    }

    /// The quality by the expanding polytope, whatever the number of contacts, with the direction in
    /// which the grasp is weakest.
    pub fn weakest(&mut self, contacts: &[Contact], center: DVec3, norm: Norm) -> Weakest {
        self.wrenches.set(contacts, center, &self.cone, norm);
        let scale = self.wrenches.scale;
        if !usable(scale) {
            // All contacts at the centre of mass, or infinitely far: there is no torque.
            return Weakest {
                quality: 0.0,
                direction: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
            };
        }
        let distance = self.polytope.distance(&self.wrenches, scale, never);
        let mut weakest = self.unscaled(&distance);
        if self.too_few(contacts) {
            weakest.quality = 0.0;
        }
        weakest
    }

    /// Lower and upper bound of the quality with exact circular cones, which meet to `tolerance`
    /// relative to the upper one; both 0 where the grasp is not force closure.
    pub fn circular(
        &mut self,
        contacts: &[Contact],
        center_of_mass: DVec3,
        tolerance: f64,
    ) -> (f64, f64) {
        let scale = wrenches::scale(contacts, center_of_mass, 0.0);
        if self.too_few(contacts) || !usable(scale) {
            return (0.0, 0.0);
        }
        let hull = Circular {
            contacts,
            center: center_of_mass,
            friction: self.cone.friction(),
            scale,
        };
        let met = |lower, upper| upper - lower <= tolerance * upper;
        let distance = self.polytope.distance(&hull, scale, met);
        (distance.lower, distance.upper)
    }

    /// The contacts of a grasp that has a closed form.
    #[inline]
    fn closed_form<'a>(&self, contacts: &'a [Contact]) -> Option<&'a [Contact; 3]> {
        if self.cone.torsion() > 0.0 {
            return None;
        }
        contacts.try_into().ok()
    }

    /// Two hard contacts cannot resist a twist about their line, one of any kind cannot pull, and
    /// without friction it takes seven wrenches to surround the origin of R⁶: else Q is exactly 0.
    fn too_few(&self, contacts: &[Contact]) -> bool {
        let fewest = match (self.cone.torsion() > 0.0, self.cone.friction() > 0.0) {
            (true, true) => 2,
            (false, true) => 3,
            (true, false) => 4,
            (false, false) => 7,
        };
        contacts.len() < fewest
    }

    fn distance(
        &mut self,
        contacts: &[Contact],
        center: DVec3,
        norm: Norm,
        enough: impl FnMut(f64, f64) -> bool,
    ) -> Distance {
        self.wrenches.set(contacts, center, &self.cone, norm);
        let scale = self.wrenches.scale;
        if self.too_few(contacts) || !usable(scale) {
            return Distance::ZERO;
        }
        self.polytope.distance(&self.wrenches, scale, enough)
    }

    /// Gradients of the distances to the facets within `distance` of the origin, at most `most`,
    /// the nearest first and always among them; `None` where Q_l = 0.
    pub(crate) fn facets_within(
        &mut self,
        contacts: &[Contact; 3],
        center_of_mass: DVec3,
        distance: f64,
        most: usize,
    ) -> Option<Vec<Gradient>> {
        self.evaluations += 1;
        let cone = &self.cone;
        let vertices = self
            .kernel
            .within(contacts, center_of_mass, distance, most)?;
        let mut row = [0.0; 22];
        let mut gradients = Vec::new();
        for vertex in vertices {
            if gradient::of_vertex(vertex, contacts, center_of_mass, cone, false, &mut row) {
                gradients.push(Gradient::from_row(&row));
            }
        }
        (!gradients.is_empty()).then_some(gradients)
    }
}

/// Lever arms whose squares are numbers.
fn usable(scale: f64) -> bool {
    scale * scale > 0.0 && (scale * scale).is_finite()
}

fn never(_: f64, _: f64) -> bool {
    false
}

/// Q_l of a grasp from its longest admissible twist.
pub(crate) fn quality_of(vertex: Vertex) -> f64 {
    1.0 / vertex.norm_squared.sqrt()
}

/// Grasps in one piece of memory: of grasp g, contact i is `points[g·m + i]`.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a> {
    /// Contact points, m per grasp.
    pub points: &'a [[f64; 3]],
    /// Unit normals pointing into the object, m per grasp.
    pub normals: &'a [[f64; 3]],
    /// Centre of mass, one per grasp.
    pub centers: &'a [[f64; 3]],
}

/// Grasps per unit of parallel work: long enough to pay for its start, short enough to share.
const CHUNK: usize = 256;

impl Batch<'_> {
    /// Exact Q_l or Q'_l of every grasp, in parallel on the current rayon pool.
    pub fn quality(&self, cone: &FrictionCone, norm: Norm, out: &mut [f64]) {
        match norm {
            Norm::Sum => self.each(cone, out, 1, |evaluator, contacts, center, slot| {
                slot[0] = evaluator.quality(contacts, center);
            }),
            Norm::Each => self.each(cone, out, 1, |evaluator, contacts, center, slot| {
                slot[0] = evaluator.quality_of_each(contacts, center);
            }),
        }
    }

    /// Exact Q_l and gradient of every grasp, a row of [`Gradient::width`] each, in parallel. `out`
    /// comes filled with zeros.
    pub fn gradient(&self, cone: &FrictionCone, out: &mut [f64]) {
        let width = Gradient::width(self.contacts_per_grasp());
        self.each(cone, out, width, Evaluator::gradient_row);
    }

    /// Whether Q_l ≥ `threshold` of every grasp, in parallel.
    pub fn is_at_least(&self, cone: &FrictionCone, threshold: f64, out: &mut [bool]) {
        self.each(cone, out, 1, |evaluator, contacts, center, slot| {
            slot[0] = evaluator.is_at_least(contacts, center, threshold);
        });
    }

    /// Bounds of the quality with circular cones of every grasp, in parallel.
    pub fn circular(&self, cone: &FrictionCone, tolerance: f64, out: &mut [[f64; 2]]) {
        self.each(cone, out, 1, |evaluator, contacts, center, slot| {
            slot[0] = evaluator.circular(contacts, center, tolerance).into();
        });
    }

    /// Index and Q_l of the best grasp, the first among equals, in parallel: a grasp is given up
    /// as soon as it is known to be worse than the best so far. `None` if there are no grasps.
    pub fn largest(&self, cone: &FrictionCone) -> Option<(usize, f64)> {
        // Bits of numbers that are not negative order as the numbers do.
        let bar = AtomicU64::new(0);
        self.first(cone, |evaluator, contacts, center| {
            let threshold = f64::from_bits(bar.load(Ordering::Relaxed));
            let quality = evaluator.quality_up_to(contacts, center, threshold);
            bar.fetch_max(quality.to_bits(), Ordering::Relaxed);
            quality
        })
    }

    /// Index and Q_l of the worst grasp, the first among equals, in parallel: a grasp is given up
    /// as soon as it is known not to be worse than the worst so far. `None` if there are no grasps.
    pub fn smallest(&self, cone: &FrictionCone) -> Option<(usize, f64)> {
        let bar = AtomicU64::new(f64::MAX.to_bits());
        let (index, negated) = self.first(cone, |evaluator, contacts, center| {
            // Not below the bar only if above it: equal ones are told apart by their index.
            let threshold = f64::from_bits(bar.load(Ordering::Relaxed)).next_up();
            let quality = evaluator.quality_below(contacts, center, threshold);
            bar.fetch_min(quality.to_bits(), Ordering::Relaxed);
            -quality
        })?;
        Some((index, -negated))
    }

    /// Index and value of the grasp with the greatest value, the first among equals.
    fn first(
        &self,
        cone: &FrictionCone,
        value: impl Fn(&mut Evaluator, &[Contact], DVec3) -> f64 + Sync,
    ) -> Option<(usize, f64)> {
        let better = |a: (usize, f64), b: (usize, f64)| {
            if a.1 > b.1 || (a.1 == b.1 && a.0 < b.0) {
                a
            } else {
                b
            }
        };
        (0..self.centers.len().div_ceil(CHUNK))
            .into_par_iter()
            .map_init(
                || (Evaluator::new(cone), self.blank()),
                |(evaluator, contacts), chunk| {
                    let end = self.centers.len().min((chunk + 1) * CHUNK);
                    (chunk * CHUNK..end)
                        .map(|index| {
                            let center = self.grasp(index, contacts);
                            (index, value(evaluator, contacts, center))
                        })
                        .reduce(better)
                },
            )
            .flatten()
            .reduce_with(better)
    }

    fn contacts_per_grasp(&self) -> usize {
        self.points.len() / self.centers.len().max(1)
    }

    /// Grasp `index`, its contacts written over the m in `contacts`.
    #[inline]
    fn grasp(&self, index: usize, contacts: &mut [Contact]) -> DVec3 {
        let own = index * contacts.len()..(index + 1) * contacts.len();
        let pairs = self.points[own.clone()].iter().zip(&self.normals[own]);
        for (contact, (&point, &normal)) in contacts.iter_mut().zip(pairs) {
            contact.point = point.into();
            contact.normal = normal.into();
        }
        self.centers[index].into()
    }

    fn blank(&self) -> Vec<Contact> {
        let contact = Contact {
            point: DVec3::ZERO,
            normal: DVec3::Z,
        };
        vec![contact; self.contacts_per_grasp()]
    }

    fn each<T: Send>(
        &self,
        cone: &FrictionCone,
        out: &mut [T],
        width: usize,
        evaluate: impl Fn(&mut Evaluator, &[Contact], DVec3, &mut [T]) + Sync,
    ) {
        let run = |evaluator: &mut Evaluator, chunk: usize, out: &mut [T]| {
            let mut contacts = self.blank();
            for (offset, slot) in out.chunks_exact_mut(width).enumerate() {
                let center = self.grasp(chunk * CHUNK + offset, &mut contacts);
                evaluate(evaluator, &contacts, center, slot);
            }
        };
        if out.len() <= CHUNK * width {
            run(&mut Evaluator::new(cone), 0, out);
        } else {
            out.par_chunks_mut(CHUNK * width).enumerate().for_each_init(
                || Evaluator::new(cone),
                |evaluator, (chunk, out)| run(evaluator, chunk, out),
            );
        }
    }
}
