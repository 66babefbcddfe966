//! Exact gradients of Q_l.
//!
//! Let v be the unit normal of the facet of the wrench hull that is nearest to the origin, and
//! Q v = Σ α_k w_k its foot point in terms of active wrenches, Σ α_k = 1. Then
//! dQ = Σ α_k ⟨v, dw_k⟩. With F_i = Σ α f the contact forces of the foot point and V_i the
//! velocity of contact i under v: ∂Q/∂c_i = F_i × v_ω, ∂Q/∂z = −Σ ∂Q/∂c_i, and ∂Q/∂n_i is the
//! gradient of ⟨V_i, R(n_i) g_i⟩ with g_i = R(n_i)ᵀ F_i held fixed.

use super::Twist;
use super::three_contacts::{Active, Vertex};
use crate::contact::{Contact, Frame, FrictionCone};
use glam::DVec3;

/// Q_l of a grasp with three contacts, and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gradient {
    /// Q_l.
    pub value: f64,
    /// ∂Q/∂c_i.
    pub contacts: [DVec3; 3],
    /// ∂Q/∂n_i, tangent to the sphere at n_i.
    pub normals: [DVec3; 3],
    /// ∂Q/∂z.
    pub center_of_mass: DVec3,
}

impl Gradient {
    /// Of a grasp that is not force closure: Q is 0, and so is the gradient that is reported.
    pub const ZERO: Self = Self {
        value: 0.0,
        contacts: [DVec3::ZERO; 3],
        normals: [DVec3::ZERO; 3],
        center_of_mass: DVec3::ZERO,
    };
}

/// Gradient of the distance from the origin to the facet that belongs to a vertex of P.
///
/// Where several facets are nearest, this is the derivative of one of them. `None` where the six
/// active wrenches are dependent to rounding.
pub(crate) fn of_facet(
    vertex: &Vertex,
    contacts: &[Contact; 3],
    center: DVec3,
    cone: &FrictionCone,
) -> Option<Gradient> {
    let l = cone.len();
    let value = 1.0 / vertex.norm_squared.sqrt();
    let direction = vertex.twist.map(|x| x * value);
    let frames = contacts.map(|contact| Frame::new(contact.normal));
    // The apex of a cone activates all its edges; any three of them span the force.
    let active = match vertex.active {
        Active::Rays(j) => std::array::from_fn(|k| (k / 2, (j[k / 2] + k % 2) % l)),
        Active::Apex { apex, ray, edge } => [
            (apex, 0),
            (apex, l / 3),
            (apex, 2 * l / 3),
            ray,
            (ray.0, (ray.1 + 1) % l),
            edge,
        ],
    };
    let wrenches = active.map(|(i, j)| {
        let force = cone.edge(&frames[i], j);
        let torque = (contacts[i].point - center).cross(force);
        [force.x, force.y, force.z, torque.x, torque.y, torque.z]
    });
    let weights = solve(&wrenches, direction.map(|x| x * value))?;
    let mut local = [DVec3::ZERO; 3];
    for ((i, j), weight) in active.into_iter().zip(weights) {
        let [x, y] = cone.edges[j];
        local[i] += DVec3::new(x, y, 1.0) * weight;
    }
    let linear = DVec3::new(direction[0], direction[1], direction[2]);
    let angular = DVec3::new(direction[3], direction[4], direction[5]);
    let mut gradient = Gradient {
        value,
        ..Gradient::ZERO
    };
    for i in 0..3 {
        let Frame {
            tangents: [t1, t2],
            normal,
            ..
        } = frames[i];
        let force = t1 * local[i].x + t2 * local[i].y + normal * local[i].z;
        let velocity = linear + angular.cross(contacts[i].point - center);
        gradient.contacts[i] = force.cross(angular);
        gradient.center_of_mass -= gradient.contacts[i];
        gradient.normals[i] = frames[i].gradient(velocity, local[i].to_array());
    }
    Some(gradient)
}

/// Σ_k weights_k columns_k = right, by Gaussian elimination with partial pivoting.
fn solve(columns: &[Twist; 6], right: Twist) -> Option<Twist> {
    let mut rows: [[f64; 7]; 6] = std::array::from_fn(|r| {
        std::array::from_fn(|c| if c < 6 { columns[c][r] } else { right[r] })
    });
    for step in 0..6 {
        let pivot =
            (step..6).max_by(|&a, &b| rows[a][step].abs().total_cmp(&rows[b][step].abs()))?;
        rows.swap(step, pivot);
        let head = rows[step];
        // Torques carry the unit of length, so only an exact zero is independent of it.
        if head[step] == 0.0 {
            return None;
        }
        for row in &mut rows[step + 1..] {
            let factor = row[step] / head[step];
            for c in step..7 {
                row[c] -= factor * head[c];
            }
        }
    }
    let mut weights = [0.0; 6];
    for step in (0..6).rev() {
        let known: f64 = (step + 1..6).map(|c| rows[step][c] * weights[c]).sum();
        weights[step] = (rows[step][6] - known) / rows[step][step];
    }
    weights.iter().all(|w| w.is_finite()).then_some(weights)
}
