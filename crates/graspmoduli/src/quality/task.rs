//! How much of a task a grasp can do: the largest t such that t times each of some wrenches is
//! resisted with the given normal forces.
//!
//! For one load b it is 1 / s with s the least Σ α over W α = −b, α ≥ 0, or the least largest
//! Σ_j α_ij of a finger. A linear program in six rows (and one per finger), by the simplex method;
//! of the prices y at its end, ds = −⟨y, dW α⟩.

use super::Batch;
use super::gradient::{Gradient, differentiate};
use super::r6::Twist;
use super::simplex::{BALANCED, Simplex, dot};
use crate::contact::{Contact, Frame, FrictionCone, Norm};
use crate::error::Error;
use crate::parallel::*;
use glam::DVec3;
use std::cell::Cell;
use std::sync::atomic::Ordering;

/// Rows of which less than this is left are combinations of others.
const FLAT: f64 = 1e-12;

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
        out.par_chunks_mut(width)
            .enumerate()
            .map(of_grasp)
            .collect()
    }
}

/// The linear program of a grasp. However flat its wrenches are, its first rows are orthonormal.
struct Program {
    /// Rows: as many as the wrenches span, up to six, and one per finger with a limit of its own.
    rows: usize,
    /// W = L Q with orthonormal rows of Q for those rows of W that do not depend on others; the
    /// lower triangle L row by row, that of dependent rows, too.
    lower: [Twist; 6],
    /// Which rows of W these are.
    spanning: Vec<usize>,
    /// Wrenches, then slacks and the largest force if fingers have limits; column by column.
    columns: Vec<f64>,
    costs: Vec<f64>,
    /// Wrenches per contact, and of all.
    each: usize,
    wrenches: usize,
    /// By what torques are divided.
    reach: f64,
}

/// The least effort against a load.
struct Found {
    effort: f64,
    /// Of each wrench.
    weights: Vec<f64>,
    /// What a unit of the load costs.
    prices: Twist,
}

impl Program {
    fn new(contacts: &[Contact], center: DVec3, cone: &FrictionCone) -> Self {
        let each = cone.generators();
        let wrenches = each * contacts.len();
        let longest = contacts
            .iter()
            .map(|c| (c.point - center).length())
            .fold(cone.torsion(), f64::max);
        let reach = if longest > 0.0 { longest } else { 1.0 };
        let fingers = match cone.norm() {
            Norm::Sum => 0,
            Norm::Each => contacts.len(),
        };
        let mut table: Vec<Vec<f64>> = vec![Vec::with_capacity(wrenches); 6];
        for (i, contact) in contacts.iter().enumerate() {
            let frame = Frame::new(contact.normal);
            for k in 0..each {
                let (local, spin) = cone.generator(i, k);
                let force = frame.turn(local);
                let lever = (contact.point - center) / reach;
                let torque = lever.cross(force) + contact.normal * (spin / reach);
                let wrench = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
                for (row, x) in table.iter_mut().zip(wrench) {
                    row.push(x);
                }
            }
        }
        let (lower, spanning) = orthonormal(&mut table);
        let rows = spanning.len() + fingers;
        let mut columns = Vec::with_capacity(rows * (wrenches + fingers + 1));
        for k in 0..wrenches {
            columns.extend(spanning.iter().map(|&row| table[row][k]));
            columns.extend((0..fingers).map(|f| if f == k / each { 1.0 } else { 0.0 }));
        }
        let mut costs = vec![1.0; wrenches];
        if fingers > 0 {
            costs.fill(0.0);
            // What each finger could press more, and the most that one presses.
            for i in 0..fingers {
                columns.extend(vec![0.0; spanning.len()]);
                columns.extend((0..fingers).map(|f| if f == i { 1.0 } else { 0.0 }));
            }
            columns.extend(vec![0.0; spanning.len()]);
            columns.extend((0..fingers).map(|_| -1.0));
            costs.extend(vec![0.0; fingers]);
            costs.push(1.0);
        }
        Self {
            rows,
            lower,
            spanning,
            columns,
            costs,
            each,
            wrenches,
            reach,
        }
    }

    /// The least effort against a load; `None` if no forces balance it.
    fn effort(&self, load: &Twist) -> Option<Found> {
        let mut load = *load;
        for (k, x) in load.iter_mut().enumerate() {
            *x = if k < 3 { -*x } else { -*x / self.reach };
        }
        let given = load.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        // By forward substitution; what is left over of dependent rows no forces balance.
        let mut target = vec![0.0; self.rows];
        let mut place = 0;
        for row in 0..6 {
            let known = self.spanning[..place].iter().zip(&target);
            let left = load[row] - known.map(|(&k, x)| self.lower[row][k] * x).sum::<f64>();
            if self.spanning.get(place) == Some(&row) {
                target[place] = left / self.lower[row][row];
                place += 1;
            } else if left.abs() > BALANCED * given {
                return None;
            }
        }
        let size = target.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        if size == 0.0 {
            return None;
        }
        for x in &mut target {
            *x /= size;
        }
        let mut simplex = Simplex::new(&self.columns, &self.costs, target);
        simplex.first_phase().then(|| {
            simplex.second_phase();
            let (weights, own, effort) = simplex.solved();
            // By backward substitution.
            let mut prices = [0.0; 6];
            for (place, &row) in self.spanning.iter().enumerate().rev() {
                let after = &self.spanning[place + 1..];
                let known: f64 = after.iter().map(|&k| self.lower[k][row] * prices[k]).sum();
                prices[row] = (own[place] - known) / self.lower[row][row];
            }
            for price in &mut prices[3..] {
                *price /= self.reach;
            }
            Found {
                effort: effort * size,
                weights: weights[..self.wrenches].iter().map(|w| w * size).collect(),
                prices,
            }
        })
    }
}

/// Makes the rows orthonormal, one after the other; the factors, and the rows that are none of the
/// others' combinations.
fn orthonormal(rows: &mut [Vec<f64>]) -> ([Twist; 6], Vec<usize>) {
    let mut lower = [[0.0; 6]; 6];
    let mut spanning: Vec<usize> = Vec::new();
    for row in 0..6 {
        let before = dot(&rows[row], &rows[row]).sqrt();
        // Twice is enough.
        for _ in 0..2 {
            for &other in &spanning {
                let along = dot(&rows[row], &rows[other]);
                lower[row][other] += along;
                let (one, two) = rows.split_at_mut(row);
                for (x, q) in two[0].iter_mut().zip(&one[other]) {
                    *x -= along * q;
                }
            }
        }
        let length = dot(&rows[row], &rows[row]).sqrt();
        if length > FLAT * before {
            lower[row][row] = length;
            for x in &mut rows[row] {
                *x /= length;
            }
            spanning.push(row);
        }
    }
    (lower, spanning)
}
