//! The grasp quality Q_l (Sec. II): distance from the origin to the boundary of the wrench hull.

mod apex_ray_face;
mod gradient;
mod lanes;
mod plane;
mod ray_ray_ray;
mod three_contacts;
mod velocity;

pub use gradient::Gradient;
pub(crate) use three_contacts::{Kernel, Vertex};

use crate::contact::{Contact, FrictionCone};
use crate::error::Error;
use glam::DVec3;
use rayon::prelude::*;

/// A twist (v, ω) or a wrench (force, torque).
pub type Twist = [f64; 6];

/// Working memory that evaluates grasps one after the other without allocating.
#[derive(Debug, Clone)]
pub struct Evaluator {
    cone: FrictionCone,
    pub(crate) kernel: Kernel,
}

impl Evaluator {
    /// For grasps with the given friction cones.
    pub fn new(cone: &FrictionCone) -> Self {
        Self {
            cone: cone.clone(),
            kernel: Kernel::new(cone),
        }
    }

    /// Exact Q_l; 0 if the origin is not in the interior of the wrench hull.
    pub fn quality(&mut self, contacts: &[Contact; 3], center_of_mass: DVec3) -> f64 {
        self.kernel
            .longest(contacts, center_of_mass)
            .map_or(0.0, quality_of)
    }

    /// Q_l with its exact gradient. Where several facets of the hull are nearest to the origin, Q
    /// is not differentiable and the gradient is that of the distance to one of them.
    pub fn gradient(&mut self, contacts: &[Contact; 3], center_of_mass: DVec3) -> Gradient {
        self.kernel
            .longest(contacts, center_of_mass)
            .and_then(|vertex| gradient::of_facet(&vertex, contacts, center_of_mass, &self.cone))
            .unwrap_or(Gradient::ZERO)
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
        let cone = &self.cone;
        let vertices = self
            .kernel
            .within(contacts, center_of_mass, distance, most)?;
        let gradients: Vec<Gradient> = vertices
            .iter()
            .filter_map(|vertex| gradient::of_facet(vertex, contacts, center_of_mass, cone))
            .collect();
        (!gradients.is_empty()).then_some(gradients)
    }
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
    fn contacts_per_grasp(&self) -> usize {
        self.points.len() / self.centers.len().max(1)
    }

    fn grasp(&self, index: usize) -> ([Contact; 3], DVec3) {
        let contacts = std::array::from_fn(|i| Contact {
            point: self.points[3 * index + i].into(),
            normal: self.normals[3 * index + i].into(),
        });
        (contacts, self.centers[index].into())
    }

    /// Exact Q_l of every grasp, in parallel on the current rayon pool.
    ///
    /// One or two contacts cannot resist a twist about a common line: their quality is exactly 0.
    pub fn quality(&self, cone: &FrictionCone, out: &mut [f64]) -> Result<(), Error> {
        self.each(cone, out, |evaluator, contacts, center| {
            evaluator.quality(contacts, center)
        })
    }

    /// Exact Q_l and gradient of every grasp, in parallel on the current rayon pool.
    pub fn gradient(&self, cone: &FrictionCone, out: &mut [Gradient]) -> Result<(), Error> {
        self.each(cone, out, |evaluator, contacts, center| {
            evaluator.gradient(contacts, center)
        })
    }

    fn each<T: Send>(
        &self,
        cone: &FrictionCone,
        out: &mut [T],
        evaluate: impl Fn(&mut Evaluator, &[Contact; 3], DVec3) -> T + Sync,
    ) -> Result<(), Error> {
        match self.contacts_per_grasp() {
            // `out` comes filled with zeros.
            0..=2 => return Ok(()),
            3 => {}
            more => return Err(Error::Contacts(more)),
        }
        let run = |evaluator: &mut Evaluator, chunk: usize, out: &mut [T]| {
            for (offset, slot) in out.iter_mut().enumerate() {
                let (contacts, center) = self.grasp(chunk * CHUNK + offset);
                *slot = evaluate(evaluator, &contacts, center);
            }
        };
        if out.len() <= CHUNK {
            run(&mut Evaluator::new(cone), 0, out);
        } else {
            out.par_chunks_mut(CHUNK).enumerate().for_each_init(
                || Evaluator::new(cone),
                |evaluator, (chunk, out)| run(evaluator, chunk, out),
            );
        }
        Ok(())
    }
}
