//! What is proven of grasps that move: a radius within which every grasp holds, and how far the naïve
//! transfer moves one (Sec. III; proofs on the mathematics page).

use crate::contact::{Contact, FrictionCone};
use crate::distance::surface_distance;
use crate::error::Error;
use crate::math;
use crate::quality::Evaluator;
use crate::surface::Surface;
use glam::DVec3;
use std::ops::ControlFlow;

/// Units of length tried for torques, in lever arms.
const UNITS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
/// How far the bounds of the circular quality are driven together, relative to the upper one.
const TOLERANCE: f64 = 1e-2;

/// A ρ such that every grasp is force closure whose contacts and normals are each within ρ of these,
/// wherever their centre of mass; 0 where the grasp is not force closure even with the circular
/// cones inscribed in the polygonal ones.
///
/// Round cones of friction μ′ = μ cos(π/l) lie in every polygon, however R(n) turns it. Their
/// quality about the contacts' centre, torques over a length λ, falls by at most
/// √(1 + μ′²) √(1 + ((1 + reach)/λ)²) ρ; the best of several λ counts.
///
/// ```
/// use graspmoduli::glam::DVec3;
/// use graspmoduli::guarantees::certified_radius;
/// use graspmoduli::{Contact, FrictionCone};
///
/// let x = Contact::new(DVec3::X, -DVec3::X)?;
/// let y = Contact::new(DVec3::Y, -DVec3::Y)?;
/// let across = DVec3::new(-1.0, -1.0, 0.0).normalize();
/// let z = Contact::new(across, -across)?;
/// let radius = certified_radius(&[x, y, z], &FrictionCone::new(1.0, 8)?);
/// assert!(radius > 0.05);
/// # Ok::<(), graspmoduli::Error>(())
/// ```
pub fn certified_radius(contacts: &[Contact], cone: &FrictionCone) -> f64 {
    let inscribed = cone.inscribed();
    let share = 1.0 / contacts.len() as f64;
    let center: DVec3 = contacts.iter().map(|contact| contact.point * share).sum();
    let levers = contacts
        .iter()
        .map(|contact| contact.point.distance(center));
    let reach = levers.fold(0.0, f64::max);
    let steepest = inscribed.steepest();
    let mut evaluator = Evaluator::new(&inscribed);
    let mut best = 0.0_f64;
    for length in UNITS.map(|unit| unit * reach) {
        let scaled: Vec<Contact> = contacts
            .iter()
            .map(|contact| Contact {
                point: (contact.point - center) / length,
                ..*contact
            })
            .collect();
        if !scaled.iter().all(|contact| contact.point.is_finite()) {
            continue;
        }
        let (lower, _) = evaluator.circular(&scaled, DVec3::ZERO, TOLERANCE);
        let speed = math::hypot(1.0, steepest) * math::hypot(1.0, (1.0 + reach) / length);
        best = best.max(lower / speed);
    }
    // Rounding, in the bounds and in the division.
    best * (1.0 - 1e-9)
}

/// No contact, normal or centre of mass of a grasp moves further than this from `source` to `target`
/// by the naïve transfer (Lemma III.5, with the centre of mass): the larger of d(S, T), with its
/// error, and ‖z_S − z_T‖.
///
/// `tolerance` and `progress` are those of [`surface_distance`].
///
/// ```
/// use graspmoduli::Surface;
/// use graspmoduli::guarantees::transfer_bound;
/// use std::ops::ControlFlow;
///
/// let can = Surface::new(-0.5, 0.5, 4, vec![0.3; 16])?;
/// let wider = Surface::combine(&[(1.01, &can)])?;
/// let bound = transfer_bound(&can, &wider, 1e-6, || ControlFlow::Continue(()))?;
/// assert!(bound > 0.005 && bound < 0.01);
/// # Ok::<(), graspmoduli::Error>(())
/// ```
pub fn transfer_bound(
    source: &Surface,
    target: &Surface,
    tolerance: f64,
    progress: impl FnMut() -> ControlFlow<()>,
) -> Result<f64, Error> {
    let apart = surface_distance(source, target, tolerance, progress)?;
    let centers = [source, target].map(|surface| surface.integrals().center_of_mass);
    let moved = centers[0].distance(centers[1]);
    let apart = apart.value + apart.error;
    let extent = [source, target].map(|surface| {
        let heights = surface.bottom().abs().max(surface.top().abs());
        heights + surface.largest_coefficient()
    });
    // Rounding of the points and normals that a grasp is placed with.
    let placed = if apart > 0.0 {
        4e-15 * extent[0].max(extent[1])
    } else {
        0.0
    };
    Ok(apart.max(moved) * (1.0 + 1e-12) + placed)
}
