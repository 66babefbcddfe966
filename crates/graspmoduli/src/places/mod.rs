//! Places where fingers may press, on meshes and on surfaces, and the best grasps among them.
//!
//! | file | contents |
//! |---|---|
//! | [`search`] | the best subsets of some places, climbed from place to place over all |
//! | [`wanted`] | what is looked for, within which limits, and when two grasps are different |

pub(crate) mod search;
pub mod wanted;

pub use wanted::Wanted;

use glam::DVec3;

/// A place where a tip may press.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Where the middle of the tip lands.
    pub point: DVec3,
    /// How the tip comes: a unit vector into the object, the normal that it feels there.
    pub normal: DVec3,
    /// Share of what lies under the pad that is turned from what it feels.
    pub off: f64,
    /// Share of the whole pad that bears.
    pub bearing: f64,
    /// Does the tip touch, and like here, if it aims half a radius beside?
    pub steady: bool,
}

impl Place {
    /// Where the whole pad bears.
    pub(crate) fn flat(point: DVec3, normal: DVec3) -> Self {
        Self {
            point,
            normal,
            off: 0.0,
            bearing: 1.0,
            steady: true,
        }
    }
}
