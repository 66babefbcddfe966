//! What is looked for among places, and when two grasps are different.

use super::Place;
use crate::contact::{Contact, FrictionCone};
use crate::limits::Limits;
use crate::quality::{Evaluator, Twist, task_quality, task_quality_above};
use glam::DVec3;

/// A step must raise the quality by this share of it.
const GAIN: f64 = 1e-9;

/// What is looked for, and with which fingers.
#[derive(Debug, Clone)]
pub struct Wanted<'a> {
    /// The fingers' friction cones.
    pub cone: &'a FrictionCone,
    /// The object's centre of mass.
    pub center: DVec3,
    /// The size of the object over the length by which torques are divided.
    pub scale: f64,
    /// Contacts of a grasp.
    pub fingers: usize,
    /// How many grasps.
    pub top: usize,
    /// Of any two grasps at least one contact differs by this much.
    pub apart: f64,
    /// Errors of aim, a length, under which grasps are tried.
    pub errors: f64,
    /// Loads that the grasp is for, forces and torques on the object about its centre of mass,
    /// torques over the length scale; none if it is for all.
    pub task: &'a [Twist],
    /// Rounds of the ascent on the mesh itself.
    pub rounds: usize,
    /// Where fingers may go.
    pub limits: &'a Limits,
}

impl Wanted<'_> {
    /// A contact as the quality sees it.
    pub(crate) fn contact(&self, point: DVec3, normal: DVec3) -> Contact {
        Contact {
            point: (point - self.center) * self.scale,
            normal,
        }
    }

    pub(crate) fn contacts(&self, places: &[Place]) -> Vec<Contact> {
        places
            .iter()
            .map(|place| self.contact(place.point, place.normal))
            .collect()
    }

    /// Q_l of fingers that press at places.
    pub(crate) fn quality(&self, evaluator: &mut Evaluator, places: &[Place]) -> f64 {
        evaluator.quality(&self.contacts(places), DVec3::ZERO)
    }

    /// How good a grasp is: Q_l, or how much of the task it can do.
    pub(crate) fn value(&self, evaluator: &mut Evaluator, places: &[Place]) -> f64 {
        if self.task.is_empty() {
            self.quality(evaluator, places)
        } else {
            task_quality(&self.contacts(places), DVec3::ZERO, self.cone, self.task)
        }
    }

    /// How good it is, if that is more than `best`.
    pub(crate) fn better(
        &self,
        evaluator: &mut Evaluator,
        places: &[Place],
        best: f64,
    ) -> Option<f64> {
        let bar = best * (1.0 + GAIN);
        if !self.task.is_empty() {
            let contacts = self.contacts(places);
            return task_quality_above(&contacts, DVec3::ZERO, self.cone, self.task, bar);
        }
        let quality = evaluator.quality_up_to(&self.contacts(places), DVec3::ZERO, bar);
        (quality > bar).then_some(quality)
    }

    /// May fingers press at places together?
    pub fn allow(&self, places: &[Place]) -> bool {
        self.limits.allow(&pressed(places))
    }

    /// May one of the fingers be where it is, if the others may?
    pub(crate) fn allow_one(&self, places: &[Place], finger: usize) -> bool {
        self.limits.allow_one(&pressed(places), finger)
    }

    /// How many grasps are polished.
    pub(crate) fn candidates(&self) -> usize {
        2 * self.top + 2
    }

    /// Do two grasps differ, in whatever order their contacts are compared?
    pub(crate) fn differ(&self, one: &[Place], other: &[Place]) -> bool {
        !matched(one, other, self.apart, &mut vec![false; other.len()])
    }
}

fn pressed(places: &[Place]) -> Vec<(DVec3, DVec3)> {
    places.iter().map(|p| (p.point, p.normal)).collect()
}

/// Can contacts be paired so that no pair is `apart`?
fn matched(one: &[Place], other: &[Place], apart: f64, taken: &mut [bool]) -> bool {
    let Some((first, rest)) = one.split_first() else {
        return true;
    };
    for k in 0..other.len() {
        if !taken[k] && (first.point - other[k].point).length() <= apart {
            taken[k] = true;
            if matched(rest, other, apart, taken) {
                return true;
            }
            taken[k] = false;
        }
    }
    false
}
