//! Fingertips pressed on triangle meshes: where they touch, what they feel, grasps of them.
//!
//! A mesh comes as files hold them: open shells, holes, triangles wound either way, parts laid
//! into each other. So nothing here asks for an inside. A tip comes from outside along a
//! direction, and what it meets first is what it touches, on either side of a triangle.
//!
//! | file | contents |
//! |---|---|
//! | [`mesh`] | triangles in a tree: rays, sweeps of a ball, nearest points |
//! | [`press`] | one tip at one place: the normal that it feels, is it blocked, how flat is it there |
//! | [`map`] | many places all over the object |
//! | [`search`] | the best grasps of a map, by [`crate::places`], polished and true |
//! | [`polish`] | ascent on the mesh itself, every step pressed anew |
//! | [`gate`] | what of a grasp is true: exact normals, a ball, errors of aim |
//! | `steady` | grasps that errors of aim do not lose, where they lose the best |
//!
//! The mesh is of size 1 about the origin: its caller sees to that.

pub mod gate;
pub mod map;
pub mod mesh;
pub mod polish;
pub mod press;
pub mod search;
mod steady;

/// Farther than the mesh from the origin, whose size is 1: from there tips start.
pub(crate) const OUTSIDE: f64 = 2.0;
