//! How much of a task a grasp can do: the largest t such that t times each of some wrenches is
//! resisted with the given normal forces.
//!
//! For one load b it is 1 / s with s the least Σ α over W α = −b, α ≥ 0, or the least largest
//! Σ_j α_ij of a finger. A linear program in six rows (and one per finger), by the simplex method;
//! of the prices y at its end, ds = −⟨y, dW α⟩.

use super::Batch;
use super::effort::{Found, Program};
use super::gradient::{Gradient, differentiate};
use super::r6::Twist;
use crate::contact::{Contact, FrictionCone};
use crate::error::Error;
use crate::parallel::*;
use glam::DVec3;
use std::cell::Cell;
use std::sync::atomic::Ordering;

/// The largest multiple of all loads, forces and torques about the centre of mass that act on the
/// object; 0 if some load cannot be resisted.
pub fn task_quality(
    contacts: &[Contact],
    center: DVec3,
    cone: &FrictionCone,
    loads: &[Twist],
) -> f64 {
    let program = Program::new(contacts, center, cone);
    loads
        .iter()
        .map(|load| program.effort(load).map_or(0.0, |found| 1.0 / found.effort))
        .fold(f64::INFINITY, f64::min)
}

thread_local! {
    /// Which load was resisted least the last time: it most often is again.
    static WORST: Cell<usize> = const { Cell::new(0) };
}

/// The same if it is more than `bar`; else any load that shows that it is not will do.
pub(crate) fn task_quality_above(
    contacts: &[Contact],
    center: DVec3,
    cone: &FrictionCone,
    loads: &[Twist],
    bar: f64,
) -> Option<f64> {
    let program = Program::new(contacts, center, cone);
    let first = WORST.get() % loads.len().max(1);
    let (before, after) = loads.split_at(first);
    let mut least = f64::INFINITY;
    for (k, load) in after.iter().chain(before).enumerate() {
        let value = program.effort(load).map_or(0.0, |found| 1.0 / found.effort);
        if value < least {
            least = value;
            WORST.set((first + k) % loads.len());
        }
        if least <= bar {
            return None;
        }
    }
    Some(least)
}

/// The same with its derivatives, those of the load that is resisted least; all 0 if it is 0.
pub fn task_gradient(
    contacts: &[Contact],
    center: DVec3,
    cone: &FrictionCone,
    loads: &[Twist],
) -> Gradient {
    let mut row = vec![0.0; Gradient::width(contacts.len())];
    gradient_row(contacts, center, cone, loads, &mut row);
    Gradient::from_row(&row)
}

fn gradient_row(
    contacts: &[Contact],
    center: DVec3,
    cone: &FrictionCone,
    loads: &[Twist],
    row: &mut [f64],
) {
    let program = Program::new(contacts, center, cone);
    row.fill(0.0);
    let mut worst: Option<Found> = None;
    for load in loads {
        let Some(found) = program.effort(load) else {
            return;
        };
        if worst
            .as_ref()
            .is_none_or(|other| found.effort > other.effort)
        {
            worst = Some(found);
        }
    }
    if let Some(found) = worst {
        let value = 1.0 / found.effort;
        let direction = found.prices.map(|y| y * value * value);
        let shares: Vec<_> = (0..contacts.len())
            .map(|i| {
                let own = &found.weights[i * program.each..(i + 1) * program.each];
                let (mut force, mut spin) = ([0.0; 3], 0.0);
                for (k, weight) in own.iter().enumerate() {
                    let (local, turn) = cone.generator(i, k);
                    for c in 0..3 {
                        force[c] += weight * local[c];
                    }
                    spin += weight * turn;
                }
                (force, spin)
            })
            .collect();
        differentiate(&direction, value, contacts, center, &shares, row);
    }
}

impl Batch<'_> {
    /// The largest multiple of its own `each` loads that every grasp resists, in parallel.
    pub fn task(
        &self,
        cone: &FrictionCone,
        loads: &[Twist],
        each: usize,
        out: &mut [f64],
    ) -> Result<(), Error> {
        self.of_loads(
            cone,
            loads,
            each,
            1,
            out,
            |contacts, center, cone, own, slot| {
                slot[0] = task_quality(contacts, center, cone, own);
            },
        )
    }

    /// The same with its gradient, a row of [`Gradient::width`] each.
    pub fn task_gradient(
        &self,
        cone: &FrictionCone,
        loads: &[Twist],
        each: usize,
        out: &mut [f64],
    ) -> Result<(), Error> {
        let width = Gradient::width(self.contacts_per_grasp()?);
        self.of_loads(cone, loads, each, width, out, gradient_row)
    }

    fn of_loads(
        &self,
        cone: &FrictionCone,
        loads: &[Twist],
        each: usize,
        width: usize,
        out: &mut [f64],
        evaluate: impl Fn(&[Contact], DVec3, &FrictionCone, &[Twist], &mut [f64]) + Sync,
    ) -> Result<(), Error> {
        let m = self.contacts_per_grasp()?;
        if loads.len() != self.centers.len() * each {
            return Err(Error::Count {
                name: "loads",
                wanted: self.centers.len() * each,
                got: loads.len(),
            });
        }
        let of_grasp = |(index, slot): (usize, &mut [f64])| {
            if self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
                return Err(Error::Interrupted);
            }
            let own = index * m..(index + 1) * m;
            let pairs = self.points[own.clone()]
                .iter()
                .zip(&self.normals[own.clone()]);
            let contacts: Vec<_> = pairs
                .map(|(&point, &normal)| Contact {
                    point: point.into(),
                    normal: normal.into(),
                })
                .collect();
            let mut cone = cone.clone();
            if !self.frictions.is_empty() {
                cone.set_frictions(&self.frictions[own]);
            }
            let own = &loads[index * each..(index + 1) * each];
            evaluate(&contacts, self.centers[index].into(), &cone, own, slot);
            Ok(())
        };
        out.par_chunks_mut(width).enumerate().try_for_each(of_grasp)
    }
}
