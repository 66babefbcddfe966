//! Exact gradients of Q_l.
//!
//! Let v be the unit normal of the facet of the wrench hull that is nearest to the origin, and
//! Q v = Σ α_k w_k its foot point in terms of active wrenches, Σ α_k = 1, α ≥ 0. Then
//! dQ = Σ α_k ⟨v, dw_k⟩. With F_i = Σ α f the contact forces of the foot point, s_i its torsional
//! torques and V_i the velocity of contact i under v: ∂Q/∂c_i = F_i × v_ω, ∂Q/∂z = −Σ ∂Q/∂c_i, and
//! ∂Q/∂n_i is the gradient of ⟨V_i, R(n_i) g_i⟩ + s_i ⟨v_ω, n_i⟩ with g_i = R(n_i)ᵀ F_i held fixed.

use super::r6::{Twist, dot, solve};
use super::vertex::{Active, Vertex};
use super::wrenches::Wrenches;
use crate::contact::{Contact, Frame, FrictionCone, Norm};
use crate::nnls::nonnegative;
use glam::DVec3;

/// Wrenches this near to the facet (relative to its distance) take part in its foot point.
const ON_THE_FACET: f64 = 1e-9;
/// Weights above minus this are not negative but for rounding.
const NEGATIVE: f64 = 1e-9;

/// Q_l of a grasp and its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradient {
    /// Q_l.
    pub value: f64,
    /// ∂Q/∂c_i.
    pub contacts: Vec<DVec3>,
    /// ∂Q/∂n_i, tangent to the sphere at n_i.
    pub normals: Vec<DVec3>,
    /// ∂Q/∂z.
    pub center_of_mass: DVec3,
}

impl Gradient {
    /// Numbers per gradient of a grasp with m contacts in one piece of memory: value, contacts,
    /// normals, centre of mass.
    pub fn width(m: usize) -> usize {
        6 * m + 4
    }

    pub(super) fn from_row(row: &[f64]) -> Self {
        let vectors: Vec<DVec3> = row[1..].as_chunks().0.iter().map(|&v| v.into()).collect();
        let m = vectors.len() / 2;
        Self {
            value: row[0],
            contacts: vectors[..m].to_vec(),
            normals: vectors[m..2 * m].to_vec(),
            center_of_mass: vectors[2 * m],
        }
    }
}

/// Forces in the contact frame and torsional torques of a foot point, per contact.
type Share = ([f64; 3], f64);

/// Distance of the facet that belongs to a vertex of P and its gradient, into `row`; false if the
/// foot point is not in the span of the facet to rounding.
///
/// `order` are the places of the vertex's contacts among `contacts`. `nearest` says that the facet
/// is the nearest to the origin: then weights that came out negative, because more wrenches than
/// six are active, are found anew among all of them.
#[inline(always)]
pub(super) fn of_vertex(
    vertex: &Vertex,
    order: [usize; 3],
    contacts: &[Contact],
    center: DVec3,
    cone: &FrictionCone,
    nearest: bool,
    row: &mut [f64],
) -> bool {
    let l = cone.len();
    let value = vertex.quality();
    let direction = vertex.twist.map(|x| x * value);
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
    }
    .map(|(place, j)| (order[place], j));
    let frames: [Frame; 3] = std::array::from_fn(|i| Frame::new(contacts[i].normal));
    let wrenches = active.map(|(i, j)| {
        let force = cone.edge(i, &frames[i], j);
        let torque = (contacts[i].point - center).cross(force);
        [force.x, force.y, force.z, torque.x, torque.y, torque.z]
    });
    let rows = std::array::from_fn(|c| wrenches.map(|w| w[c]));
    let mut shares: [Share; 3] = Default::default();
    let weights = solve(rows, direction.map(|x| x * value));
    if let Some(weights) = weights {
        for ((i, j), weight) in active.into_iter().zip(weights) {
            let [x, y, z] = cone.local_edge(i, j);
            let force = &mut shares[i].0;
            *force = [
                force[0] + x * weight,
                force[1] + y * weight,
                force[2] + z * weight,
            ];
        }
    }
    // The apex's three edges may have negative weights while its force is within the cone.
    let within =
        weights.is_some() && (!nearest || (0..3).all(|i| cone.excess(i, shares[i].0) <= NEGATIVE));
    if !within {
        let mut all = Wrenches::new();
        let found = nearest && {
            all.set(contacts, &order, cone);
            all.list();
            foot_point(&all, &direction, value, center, cone, &mut shares)
        };
        // Weights that left the cone are no element of the generalised gradient.
        if !found && (nearest || weights.is_none()) {
            return false;
        }
    }
    differentiate(&direction, value, contacts, center, &shares, row);
    true
}

/// The foot point of the nearest facet, with normal `direction` in the object frame, in terms of
/// all wrenches on it.
pub(super) fn foot_point(
    wrenches: &Wrenches,
    direction: &Twist,
    value: f64,
    center: DVec3,
    cone: &FrictionCone,
    shares: &mut [Share],
) -> bool {
    let reference = wrenches.reference;
    let twist = reference.of_twist(*direction, center);
    let foot = reference.of_wrench(direction.map(|x| x * value), center);
    let found = match wrenches.norm {
        Norm::Sum => of_one_hull(wrenches, &twist, value, foot),
        // Least squares in as many rows as are needed, about.
        Norm::Each => match shares.len() {
            0..=10 => of_a_sum_of_hulls::<16>(wrenches, &twist, value, foot),
            11..=26 => of_a_sum_of_hulls::<32>(wrenches, &twist, value, foot),
            27..=MOST_EACH => of_a_sum_of_hulls::<128>(wrenches, &twist, value, foot),
            _ => None,
        },
    };
    let Some((active, weights)) = found else {
        return false;
    };
    let active: Vec<_> = active.into_iter().map(|k| wrenches.origin(k)).collect();
    shares.fill(Share::default());
    for ((i, k), weight) in active.into_iter().zip(weights) {
        let ([x, y, z], spin) = cone.generator(i, k);
        let (force, torque) = &mut shares[i];
        *force = [
            force[0] + x * weight,
            force[1] + y * weight,
            force[2] + z * weight,
        ];
        *torque += spin * weight;
    }
    true
}

/// Wrenches by index, and their weights in a point of a facet.
type Weighted = (Vec<usize>, Vec<f64>);

/// The foot point as a convex combination of the wrenches on the facet.
fn of_one_hull(wrenches: &Wrenches, twist: &Twist, value: f64, foot: Twist) -> Option<Weighted> {
    let all = wrenches.all.iter().enumerate();
    let (active, columns): (Vec<_>, Vec<_>) = all
        .filter(|(_, wrench)| dot(wrench, twist) >= value * (1.0 - ON_THE_FACET))
        .unzip();
    let weights = nonnegative(&columns, foot);
    let total: f64 = weights.iter().sum();
    ((total - 1.0).abs() <= 1e-6).then_some((active, weights))
}

/// Most contacts with a limit each whose gradient is found.
pub const MOST_EACH: usize = 122;

/// The foot point as a sum over the contacts: of a convex combination of those wrenches of each
/// that go farthest along the twist and, where these do not help, of less than that. A row for each
/// component of the foot point, then one for each contact.
fn of_a_sum_of_hulls<const ROWS: usize>(
    wrenches: &Wrenches,
    twist: &Twist,
    value: f64,
    foot: Twist,
) -> Option<Weighted> {
    let (mut active, mut columns) = (Vec::new(), Vec::new());
    let mut target = [0.0; ROWS];
    target[..6].copy_from_slice(&foot);
    let mut index = 0;
    for (contact, own) in wrenches.by_contact().enumerate() {
        let row = 6 + contact;
        *target.get_mut(row)? = 1.0;
        let farthest = own.iter().map(|w| dot(w, twist)).fold(0.0, f64::max);
        let near = farthest - value * ON_THE_FACET;
        let mut offer = |wrench: &Twist, index: usize| {
            let mut column = [0.0; ROWS];
            column[..6].copy_from_slice(wrench);
            column[row] = 1.0;
            columns.push(column);
            active.push(index);
        };
        for (k, wrench) in own.iter().enumerate() {
            if dot(wrench, twist) >= near {
                offer(wrench, index + k);
            }
        }
        if near <= 0.0 {
            // It may press less.
            offer(&[0.0; 6], usize::MAX);
        }
        index += own.len();
    }
    let mut weights = nonnegative(&columns, target);
    let off = |row: usize| {
        let sum: f64 = columns.iter().zip(&weights).map(|(c, w)| c[row] * w).sum();
        (sum - target[row]).abs()
    };
    if !(0..ROWS).all(|row| off(row) <= 1e-6) {
        return None;
    }
    let mut keep = active.iter().map(|&k| k != usize::MAX);
    weights.retain(|_| keep.next() == Some(true));
    active.retain(|&k| k != usize::MAX);
    Some((active, weights))
}

/// dQ = Σ α ⟨v, dw⟩ into `row`, whose layout is that of [`Gradient::width`].
#[inline(always)]
pub(super) fn differentiate(
    direction: &Twist,
    value: f64,
    contacts: &[Contact],
    center: DVec3,
    shares: &[Share],
    row: &mut [f64],
) {
    let m = contacts.len();
    let linear = DVec3::new(direction[0], direction[1], direction[2]);
    let angular = DVec3::new(direction[3], direction[4], direction[5]);
    let mut total = DVec3::ZERO;
    row[0] = value;
    let vectors = row[1..].as_chunks_mut::<3>().0;
    for (i, (contact, (local, spin))) in contacts.iter().zip(shares).enumerate() {
        let frame = Frame::new(contact.normal);
        let velocity = linear + angular.cross(contact.point - center);
        let along = frame.turn(*local).cross(angular);
        let free = angular * *spin;
        let spinning = free - contact.normal * free.dot(contact.normal);
        vectors[i] = along.to_array();
        vectors[m + i] = (frame.gradient(velocity, *local) + spinning).to_array();
        total -= along;
    }
    vectors[2 * m] = total.to_array();
}
