//! The grasp quality Q_l (Sec. II): distance from the origin to the boundary of the wrench hull.
//!
//! Three hard contacts have a closed form ([`three_contacts`]); any other grasp or norm goes by an
//! expanding polytope in lanes ([`hull`]). What that leaves unclear, and smooth cones, go by one
//! ([`polytope`]) that needs no more than the hull's farthest points.

mod apex_ray_face;
mod batch;
mod effort;
mod enough;
mod evaluator;
mod facets;
mod force_closure;
mod given;
mod gradient;
mod hull;
#[cfg(test)]
mod hull_tests;
mod instructions;
mod lanes;
mod metric;
mod neighbors;
mod orthonormal;
mod pivots;
mod plane;
mod points;
mod polytope;
mod r6;
mod ray_ray_ray;
mod simplex;
mod support;
mod surround;
mod task;
mod three_contacts;
mod velocity;
mod vertex;
mod wrenches;

pub use batch::Batch;
pub use evaluator::{Evaluator, Weakest};
pub use given::{of_each, of_plane_wrenches, of_wrenches};
pub use gradient::{Gradient, MOST_EACH};
pub use instructions::instructions_name;
pub(crate) use polytope::LARGEST_ERROR;
pub use r6::Twist;
pub(crate) use task::task_quality_above;
pub use task::{task_gradient, task_quality};
