//! The least effort of fingers against a load, as a linear program in six rows, and one per finger
//! with a limit of its own.

use super::orthonormal::orthonormal;
use super::r6::Twist;
use super::simplex::{BALANCED, Simplex};
use crate::contact::{Contact, Frame, FrictionCone, Norm};
use glam::DVec3;

/// The linear program of a grasp. However flat its wrenches are, its first rows are orthonormal.
pub(super) struct Program {
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
    pub each: usize,
    wrenches: usize,
    /// By what torques are divided.
    reach: f64,
}

/// The least effort against a load.
pub(super) struct Found {
    pub effort: f64,
    /// Of each wrench.
    pub weights: Vec<f64>,
    /// What a unit of the load costs.
    pub prices: Twist,
}

impl Program {
    pub fn new(contacts: &[Contact], center: DVec3, cone: &FrictionCone) -> Self {
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
        let mut table: Vec<Vec<f64>> = (0..6).map(|_| Vec::with_capacity(wrenches)).collect();
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
    pub fn effort(&self, load: &Twist) -> Option<Found> {
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
