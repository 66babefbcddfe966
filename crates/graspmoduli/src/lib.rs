//! Exact grasp quality, and grasps on families of shapes.
//!
//! Fingers touch an object at points $c_i$ with unit normals $n_i$ that point inward; $z$ is the
//! centre of mass. By Coulomb's law a finger can apply any force in a cone about $n_i$, here
//! a polygonal one with edges $f_{ij}$, $\langle f_{ij}, n_i\rangle = 1$. The *grasp quality*
//! $$Q_l = \operatorname{dist}(0, \partial S) \text{ if } 0 \in \operatorname{int} S
//!   \text{, else } 0, \qquad
//!   S = \operatorname{conv}\{(f_{ij}, (c_i - z) \times f_{ij})\} \subset \mathbb{R}^6$$
//! is the largest disturbance, in any direction, that fingers pressing with total normal force 1
//! resist. Objects are surfaces in cylindrical coordinates
//! $$S_{f,a,b} = \{(f(u,\theta)\cos\theta, f(u,\theta)\sin\theta, (1-u)a + ub)\},$$
//! which form a convex cone, so that shapes and the grasps on them deform continuously.
//!
//! The mathematics is that of F. T. Pokorny, K. Hang, D. Kragic, *Grasp Moduli Spaces*, RSS 2013.
//!
//! | module | contents |
//! |---|---|
//! | [`contact`] | contact frames, friction cones |
//! | [`quality`] | exact $Q_l$ and its gradient |
//! | [`surface`] | spline surfaces: points, normals, integrals, convex-cone operations |
//! | [`interpolation`] | splines through given values, banded systems |
//! | [`sampling`] | area-uniform points |
//! | [`search`] | the best of all subsets of contacts |
//! | [`region`] | where on a surface contacts may lie |
//! | [`ascent`] | ascent of $Q_l$ on a surface |
//! | [`synthesis`] | grasps from scratch, by deformation from a surface of revolution |
//! | [`distance`] | the distance between two surfaces, with a proven error bound |
//! | [`guarantees`] | how far a grasp may move and is still proven to hold |
//! | `domain` | random grasps in the domain D(1), and near each other: with the feature `rand` |
//! | [`transfer`] | carrying grasps from one surface to another |
//! | `touch` | fingertips pressed on triangle meshes, and grasps of them: with the feature `objects` |
//! | [`math`] | sine, cosine and the like, the same on every processor |
//! | [`error`] | what can be wrong with a request |
//!
//! No global state: random numbers are arguments, and so are threads: what runs in parallel does so on
//! those of the caller, see [`on_threads`].
//!
//! ```
//! use graspmoduli::glam::DVec3;
//! use graspmoduli::{Contact, Evaluator, FrictionCone};
//!
//! // Three fingers around a disc of radius 1, pressing towards its centre.
//! let contacts = [0.0_f64, 120.0, 240.0].map(|degrees| {
//!     let (sin, cos) = graspmoduli::math::sin_cos(degrees.to_radians());
//!     Contact::new(DVec3::new(cos, sin, 0.0), DVec3::new(-cos, -sin, 0.0))
//! });
//! let [a, b, c] = contacts;
//! let contacts = [a?, b?, c?];
//! let cone = FrictionCone::new(1.0, 8)?;
//! let quality = Evaluator::new(&cone).quality(&contacts, DVec3::ZERO);
//! assert!((quality - 0.544232187).abs() < 1e-9);
//! # Ok::<(), graspmoduli::Error>(())
//! ```

// Such links are for those who read the sources.
#![allow(rustdoc::private_intra_doc_links)]

pub mod ascent;
mod bundle;
pub mod contact;
pub mod distance;
#[cfg(feature = "rand")]
pub mod domain;
pub mod error;
pub mod guarantees;
pub mod interpolation;
pub mod limits;
pub mod many_fingers;
pub mod math;
mod nnls;
mod parallel;
pub mod places;
pub mod quality;
pub mod region;
pub mod sampling;
pub mod search;
mod spline;
pub mod surface;
pub mod synthesis;
#[cfg(feature = "objects")]
pub mod touch;
pub mod transfer;
mod turned;
mod zone;

pub use contact::{Contact, FrictionCone, Norm};
pub use error::Error;
pub use glam;
#[cfg(feature = "rayon")]
pub use parallel::on_threads;
pub use quality::{Batch, Evaluator, Gradient, Weakest};
pub use surface::Surface;

// What the README shows runs, too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
