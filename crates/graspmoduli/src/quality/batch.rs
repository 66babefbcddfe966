//! Many grasps at once, in parallel.

use super::evaluator::Evaluator;
use super::gradient::Gradient;
use crate::contact::{Contact, FrictionCone};
use crate::error::Error;
use crate::parallel::*;
use glam::DVec3;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Grasps in one piece of memory: of grasp g, contact i is `points[g·m + i]`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Batch<'a> {
    /// Contact points, m per grasp.
    pub points: &'a [[f64; 3]],
    /// Unit normals pointing into the object, m per grasp.
    pub normals: &'a [[f64; 3]],
    /// Centre of mass, one per grasp.
    pub centers: &'a [[f64; 3]],
    /// Friction coefficients, m per grasp; if empty, those of the friction cone.
    pub frictions: &'a [f64],
    /// Set to true it ends the work before the next grasp, with [`Error::Interrupted`].
    pub stop: Option<&'a AtomicBool>,
}

/// Grasps per unit of parallel work: long enough to pay for its start, short enough to share.
const CHUNK: usize = 256;

impl Batch<'_> {
    /// Exact Q_l or Q'_l of every grasp, in parallel on the current rayon pool.
    pub fn quality(&self, cone: &FrictionCone, out: &mut [f64]) -> Result<(), Error> {
        self.each(cone, out, 1, |evaluator, contacts, center, slot| {
            slot[0] = evaluator.quality(contacts, center);
        })
    }

    /// Exact Q_l and gradient of every grasp, a row of [`Gradient::width`] each, in parallel.
    pub fn gradient(&self, cone: &FrictionCone, out: &mut [f64]) -> Result<(), Error> {
        let width = Gradient::width(self.contacts_per_grasp()?);
        self.each(cone, out, width, Evaluator::gradient_row)
    }

    /// Whether Q_l ≥ `threshold` of every grasp, in parallel.
    pub fn is_at_least(
        &self,
        cone: &FrictionCone,
        threshold: f64,
        out: &mut [bool],
    ) -> Result<(), Error> {
        self.each(cone, out, 1, |evaluator, contacts, center, slot| {
            slot[0] = evaluator.is_at_least(contacts, center, threshold);
        })
    }

    /// Bounds of the quality with circular cones of every grasp, in parallel.
    pub fn circular(
        &self,
        cone: &FrictionCone,
        tolerance: f64,
        out: &mut [[f64; 2]],
    ) -> Result<(), Error> {
        self.each(cone, out, 1, |evaluator, contacts, center, slot| {
            slot[0] = evaluator.circular(contacts, center, tolerance).into();
        })
    }

    /// Index and Q_l of the best grasp, the first among equals, in parallel: a grasp is given up
    /// as soon as it is known to be worse than the best so far. `None` if there are no grasps.
    pub fn largest(&self, cone: &FrictionCone) -> Result<Option<(usize, f64)>, Error> {
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
    pub fn smallest(&self, cone: &FrictionCone) -> Result<Option<(usize, f64)>, Error> {
        let bar = AtomicU64::new(f64::MAX.to_bits());
        let worst = self.first(cone, |evaluator, contacts, center| {
            // Not below the bar only if above it: equal ones are told apart by their index.
            let threshold = f64::from_bits(bar.load(Ordering::Relaxed)).next_up();
            let quality = evaluator.quality_below(contacts, center, threshold);
            bar.fetch_min(quality.to_bits(), Ordering::Relaxed);
            -quality
        })?;
        Ok(worst.map(|(index, negated)| (index, -negated)))
    }

    /// Index and value of the grasp with the greatest value, the first among equals.
    fn first(
        &self,
        cone: &FrictionCone,
        value: impl Fn(&mut Evaluator, &[Contact], DVec3) -> f64 + Sync,
    ) -> Result<Option<(usize, f64)>, Error> {
        let m = self.contacts_per_grasp()?;
        let better = |a: (usize, f64), b: (usize, f64)| {
            if a.1 > b.1 || (a.1 == b.1 && a.0 < b.0) {
                a
            } else {
                b
            }
        };
        let best_of_chunk = |worker: &mut Worker, chunk: usize| {
            let end = self.centers.len().min((chunk + 1) * CHUNK);
            let mut best: Option<(usize, f64)> = None;
            for index in chunk * CHUNK..end {
                let value = worker.on(self, index, &value)?;
                best = Some(best.map_or((index, value), |best| better(best, (index, value))));
            }
            Ok(best)
        };
        (0..self.centers.len().div_ceil(CHUNK))
            .into_par_iter()
            .map_init(|| Worker::new(cone, m), best_of_chunk)
            .try_reduce(
                || None,
                |a, b| {
                    Ok(match (a, b) {
                        (Some(a), Some(b)) => Some(better(a, b)),
                        (a, b) => a.or(b),
                    })
                },
            )
    }

    /// m, if the parts of the batch fit each other.
    pub(super) fn contacts_per_grasp(&self) -> Result<usize, Error> {
        let (points, grasps) = (self.points.len(), self.centers.len());
        let m = points / grasps.max(1);
        let fits = |length: usize| length == m * grasps;
        if fits(points)
            && fits(self.normals.len())
            && (self.frictions.is_empty() || fits(self.frictions.len()))
        {
            return Ok(m);
        }
        Err(Error::Batch {
            points,
            normals: self.normals.len(),
            centers: grasps,
            frictions: self.frictions.len(),
        })
    }

    fn each<T: Send>(
        &self,
        cone: &FrictionCone,
        out: &mut [T],
        width: usize,
        evaluate: impl Fn(&mut Evaluator, &[Contact], DVec3, &mut [T]) + Sync,
    ) -> Result<(), Error> {
        let m = self.contacts_per_grasp()?;
        if out.len() != self.centers.len() * width {
            return Err(Error::Count {
                name: "out",
                wanted: self.centers.len() * width,
                got: out.len(),
            });
        }
        let run = |worker: &mut Worker, chunk: usize, out: &mut [T]| {
            for (offset, slot) in out.chunks_exact_mut(width).enumerate() {
                worker.on(
                    self,
                    chunk * CHUNK + offset,
                    |evaluator, contacts, center| {
                        evaluate(evaluator, contacts, center, slot);
                    },
                )?;
            }
            Ok(())
        };
        if out.len() <= CHUNK * width {
            run(&mut Worker::new(cone, m), 0, out)
        } else {
            out.par_chunks_mut(CHUNK * width)
                .enumerate()
                .map_init(
                    || Worker::new(cone, m),
                    |worker, (chunk, out)| run(worker, chunk, out),
                )
                .collect()
        }
    }
}

/// Evaluates grasps of a batch one after the other.
struct Worker {
    evaluator: Evaluator,
    contacts: Vec<Contact>,
}

impl Worker {
    fn new(cone: &FrictionCone, m: usize) -> Self {
        let contact = Contact {
            point: DVec3::ZERO,
            normal: DVec3::Z,
        };
        Self {
            evaluator: Evaluator::new(cone),
            contacts: vec![contact; m],
        }
    }

    #[inline]
    fn on<T>(
        &mut self,
        batch: &Batch,
        index: usize,
        evaluate: impl FnOnce(&mut Evaluator, &[Contact], DVec3) -> T,
    ) -> Result<T, Error> {
        if batch.stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
            return Err(Error::Interrupted);
        }
        let m = self.contacts.len();
        let own = index * m..(index + 1) * m;
        let pairs = batch.points[own.clone()]
            .iter()
            .zip(&batch.normals[own.clone()]);
        for (contact, (&point, &normal)) in self.contacts.iter_mut().zip(pairs) {
            contact.point = point.into();
            contact.normal = normal.into();
        }
        if !batch.frictions.is_empty() {
            self.evaluator.set_frictions(&batch.frictions[own]);
        }
        let value = evaluate(
            &mut self.evaluator,
            &self.contacts,
            batch.centers[index].into(),
        );
        match self.evaluator.take_unconverged() {
            None => Ok(value),
            Some([lower, upper]) => Err(Error::NotConverged {
                grasp: index,
                lower,
                upper,
            }),
        }
    }
}
