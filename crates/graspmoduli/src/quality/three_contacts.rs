//! Exact Q_l of three contacts in closed form.
//!
//! Let P = {x ∈ R⁶ : ⟨x, w_ij⟩ ≤ 1} be the polar of the wrench hull. If 0 is interior to the
//! hull, Q_l = 1 / max{‖x‖ : x ∈ P}: the longest admissible twist x = (v, ω), v the velocity of
//! the centre of mass. The condition on contact i is that its velocity
//! y_i = v + ω × r_i lies in n_i + C_i°, with C_i° the polar of friction cone i, spanned by rays.
//! Six constraints are active at a vertex of P, counted as 3 for the apex of a cone, 2 for a ray,
//! 1 for a face; generically that is ray–ray–ray or apex–ray–face. Every candidate of either kind
//! is a 3×3 system, and a vertex exactly when its three multipliers are not negative.
//!
//! The loops below only propose twists; [`Kernel::offer`] divides each by its support h(x) = max
//! ⟨x, w_ij⟩, which puts it on the boundary of P whatever rounding did. So every value found is
//! an upper bound of Q_l, and degenerate candidates (0/0) can do no harm. What could do harm are
//! wrong signs: of force closure, which are told from rounding ([`Plane::closure`]), and of
//! multipliers, where the triangle of contacts is flat or far from the centre of mass. Whatever is
//! not clear beyond rounding is left to the expanding polytope.

use super::apex_ray_face::Bounds;
use super::instructions::instructions;
use super::lanes::{dot, greatest};
use super::plane::{Closure, LANES, Lanes, Plane, Table, at, zeros};
use super::r6::Twist;
use super::ray_ray_ray::Forms;
use crate::contact::{Contact, FrictionCone};
use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};
use std::ops::ControlFlow;

/// Lever arms that are longer than this many times the shortest side or height of the triangle of
/// contacts: the polytope errs less.
const LONG_LEVERS: f64 = 1e3;
/// Multipliers above minus this count as not negative: they are products of unit vectors.
pub(super) const SLACK: f64 = 1e-13;
/// Added to the squared determinant of a system: candidates with a determinant below 1e-14 are
/// rounding noise unless their twist is huge all the same.
pub(super) const TINY: f64 = 1e-28;
/// Candidates this close to the longest so far (relative, by their squares) are looked at again:
/// the quadratic forms that compare them cancel where the contacts are nearly collinear.
pub(super) const TIE: f64 = 1e-6;

/// The constraints that meet in a vertex of P, by contact and ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Active {
    /// y_i on ray j_i of its cone, for all three.
    Rays([usize; 3]),
    /// y of the first contact at the apex, of the second on a ray, of the third on the face
    /// orthogonal to an edge.
    Apex {
        apex: usize,
        ray: (usize, usize),
        edge: (usize, usize),
    },
}

/// A vertex of P, or a point on an edge or face of P that rounding took for one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Vertex {
    /// (v, ω) in the object frame, on the boundary of P.
    pub twist: Twist,
    /// ‖x‖².
    pub norm_squared: f64,
    /// Did the candidate satisfy all constraints to rounding before it was scaled?
    pub exact: bool,
    pub active: Active,
}

impl Vertex {
    /// Distance of its facet from the origin.
    #[inline]
    pub fn quality(&self) -> f64 {
        1.0 / self.norm_squared.sqrt()
    }
}

/// The closed form cannot tell beyond rounding: the expanding polytope must.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Unclear;

/// What to look for in P.
#[derive(Debug, Clone, Copy)]
pub(super) enum Question {
    /// The longest twist.
    Longest,
    /// The longest, or any one that shows Q to be below this.
    LongestUpTo(f64),
    /// The longest that is longer than this (by its square).
    LongerThan(f64),
    /// All that are longer than this (by its square), but not more than so many.
    All(f64, usize),
}

/// Working memory for the exact quality of grasps with three contacts.
#[derive(Debug, Clone)]
pub(crate) struct Kernel {
    arch: Arch,
    /// For the planar test.
    narrow: Arch,
    pub(super) plane: Plane,
    /// Per ray of contacts 1 and 2: components along two sides of the triangle; see
    /// [`Kernel::rays`].
    pub(super) pairs: [Table<2>; 2],
    /// Per ray of contact 3: components b, c along two sides and z out of the plane as b, c, b²,
    /// bc, c², bz, cz, z².
    pub(super) third: Table<8>,
    pub(super) bounds: [Bounds; 3],
    /// ‖x‖² of candidates; see [`Kernel::apexes`].
    pub(super) squares: Vec<Lanes>,
    pub(super) forms: Forms,
    found: Vec<Vertex>,
}

impl Kernel {
    pub fn new(cone: &FrictionCone) -> Self {
        let plane = Plane::new(cone);
        let edges = cone.len();
        let arch = instructions();
        Self {
            arch,
            narrow: narrow(arch),
            plane,
            pairs: [zeros(edges), zeros(edges)],
            third: zeros(edges),
            bounds: std::array::from_fn(|_| Bounds::new(edges)),
            squares: vec![Lanes::default(); 12 * edges.div_ceil(LANES)],
            forms: Forms::default(),
            found: Vec::new(),
        }
    }

    /// Gives each contact its coefficient of friction.
    #[inline]
    pub fn set_frictions(&mut self, cone: &FrictionCone, frictions: [f64; 3]) {
        self.plane.set_frictions(cone, frictions);
    }

    /// The longest admissible twist, or `None` where the grasp is not force closure (Q = 0).
    #[inline]
    pub fn longest(
        &mut self,
        contacts: &[Contact; 3],
        center: DVec3,
    ) -> Result<Option<Vertex>, Unclear> {
        let closed = self.ask(contacts, center, Question::Longest)?;
        Ok(closed.then(|| self.found[0]))
    }

    /// As [`Kernel::longest`], but content with any twist longer than 1/`threshold`: one such is
    /// the proof that Q < `threshold`.
    #[inline]
    pub fn longest_up_to(
        &mut self,
        contacts: &[Contact; 3],
        center: DVec3,
        threshold: f64,
    ) -> Result<Option<Vertex>, Unclear> {
        let closed = self.ask(contacts, center, Question::LongestUpTo(threshold))?;
        Ok(closed.then(|| self.found[0]))
    }

    /// The longest twist if it is longer than 1/`threshold`, or about as long: `Some(None)` if Q is
    /// not below the threshold, `None` where the grasp is not force closure.
    #[inline]
    pub fn longest_above(
        &mut self,
        contacts: &[Contact; 3],
        center: DVec3,
        threshold: f64,
    ) -> Result<Option<Option<Vertex>>, Unclear> {
        // A little less, so that rounding in the square does not decide what Q should.
        let limit = (1.0 - 1e-14) / (threshold * threshold);
        let closed = self.ask(contacts, center, Question::LongerThan(limit))?;
        Ok(closed.then(|| self.found.first().copied()))
    }

    /// Vertices of P that belong to the facets of the hull within `distance` of the origin, at
    /// most `most`, the nearest first and always among them; `None` where the grasp is not force
    /// closure.
    pub fn within(
        &mut self,
        contacts: &[Contact; 3],
        center: DVec3,
        distance: f64,
        most: usize,
    ) -> Result<Option<&[Vertex]>, Unclear> {
        let limit = 1.0 / (distance * distance);
        // Nothing within the distance is unclear only to this question.
        let closed = self.ask(contacts, center, Question::All(limit, most));
        if matches!(closed, Ok(false)) {
            return Ok(None);
        }
        self.found.retain(|vertex| vertex.exact);
        if self.found.is_empty() && !self.ask(contacts, center, Question::Longest)? {
            return Ok(None);
        }
        self.sort_found(most);
        Ok(Some(&self.found))
    }

    /// Longest first, the `most` longest.
    fn sort_found(&mut self, most: usize) {
        self.found
            .sort_by(|a, b| b.norm_squared.total_cmp(&a.norm_squared));
        self.found.truncate(most);
    }

    /// Fills `found`; false where the grasp is not force closure.
    #[inline]
    fn ask(
        &mut self,
        contacts: &[Contact; 3],
        center: DVec3,
        question: Question,
    ) -> Result<bool, Unclear> {
        self.found.clear();
        let plane = &mut self.plane;
        match self.narrow.dispatch(Closed { plane, contacts }) {
            Closure::No => return Ok(false),
            Closure::Unclear => return Err(Unclear),
            Closure::Yes => {}
        }
        let levers = contacts.map(|contact| contact.point.distance_squared(center));
        let reach = levers.into_iter().fold(0.0, greatest);
        let least = self.plane.narrowest() * LONG_LEVERS;
        if reach > least * least {
            return Err(Unclear);
        }
        self.arch.dispatch(Ask {
            kernel: self,
            contacts,
            center,
            question,
        });
        // Of a grasp that is force closure there is a longest twist, unless rounding hid it.
        match question {
            Question::Longest | Question::LongestUpTo(_) if self.found.is_empty() => Err(Unclear),
            _ => Ok(true),
        }
    }

    /// Takes a proposed twist (in the frame of the plane) if, once it is on the boundary of P, it
    /// is longer than the limit.
    #[inline(always)]
    pub(super) fn offer(
        &mut self,
        twist: Twist,
        active: Active,
        question: Question,
        limit: &mut f64,
    ) -> ControlFlow<()> {
        let velocity = DVec3::new(twist[0], twist[1], twist[2]);
        let omega = DVec3::new(twist[3], twist[4], twist[5]);
        // The padding's zeros do no harm: the support is positive.
        let mut supports = [0.0; LANES];
        for side in &self.plane.sides {
            let v = velocity + omega.cross(side.point.extend(0.0) - self.plane.center);
            for [x, y, z] in &side.edge {
                for lane in 0..LANES {
                    let along = x[lane] * v.x + y[lane] * v.y + z[lane] * v.z;
                    supports[lane] = greatest(along, supports[lane]);
                }
            }
        }
        let support = supports.into_iter().fold(0.0, greatest);
        let norm_squared = dot(&twist, &twist) / (support * support);
        // Negated so that NaN, from overflow, is refused; a support of 0 contradicts the test.
        if !(support > 0.0 && norm_squared > *limit && norm_squared.is_finite()) {
            return ControlFlow::Continue(());
        }
        let linear = self.plane.basis.mul_vec3(velocity / support);
        let angular = self.plane.basis.mul_vec3(omega / support);
        let vertex = Vertex {
            twist: [
                linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
            ],
            norm_squared,
            exact: (support - 1.0).abs() < 1e-9,
            active,
        };
        if let Question::All(_, most) = question {
            self.found.push(vertex);
            if self.found.len() == 4 * most {
                self.sort_found(2 * most);
                *limit = self.found[2 * most - 1].norm_squared;
            }
            return ControlFlow::Continue(());
        }
        self.found.clear();
        self.found.push(vertex);
        *limit = norm_squared;
        match question {
            Question::LongestUpTo(threshold) if vertex.quality() < threshold => {
                ControlFlow::Break(())
            }
            _ => ControlFlow::Continue(()),
        }
    }
}

/// Wide masks make the planar test, all of it short vectors, half as fast again.
fn narrow(arch: Arch) -> Arch {
    #[cfg(target_arch = "x86_64")]
    if let Arch::V4(_) = arch {
        return pulp::x86::V3::try_new().map_or(arch, Arch::V3);
    }
    arch
}

/// Is the grasp force closure? Compiled for each instruction set and chosen at run time.
struct Closed<'a> {
    plane: &'a mut Plane,
    contacts: &'a [Contact; 3],
}

impl WithSimd for Closed<'_> {
    type Output = Closure;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Closure {
        self.plane.closure(self.contacts)
    }
}

/// The kernel for grasps that are, likewise.
struct Ask<'a> {
    kernel: &'a mut Kernel,
    contacts: &'a [Contact; 3],
    center: DVec3,
    question: Question,
}

impl WithSimd for Ask<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            kernel,
            contacts,
            center,
            question,
        } = self;
        kernel.plane.set_up_rays(contacts, center);
        let mut limit = match question {
            Question::All(limit, _) | Question::LongerThan(limit) => limit,
            _ => 0.0,
        };
        if kernel.apexes(simd, question, &mut limit).is_continue() {
            let _ = kernel.rays(simd, question, &mut limit);
        }
    }
}

#[inline(always)]
pub(super) fn ray(plane: &Plane, contact: usize, index: usize) -> DVec3 {
    at(&plane.sides[contact].ray, index).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform in the ball of radius 1 and on the sphere.
    fn grasps(count: usize) -> Vec<([Contact; 3], DVec3)> {
        let mut state = 1u64;
        let mut draw = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
        };
        let mut ball = || loop {
            let v = DVec3::new(draw(), draw(), draw());
            if v.length_squared() < 1.0 {
                return v;
            }
        };
        (0..count)
            .map(|_| {
                let contacts = [0; 3].map(|_| Contact {
                    point: ball(),
                    normal: ball().normalize(),
                });
                (contacts, ball())
            })
            .collect()
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let mut sets = vec![Arch::Scalar];
        #[cfg(target_arch = "x86_64")]
        {
            sets.extend(pulp::x86::V3::try_new().map(Arch::V3));
            sets.extend(pulp::x86::V4::try_new().map(Arch::V4));
        }
        for (friction, edges) in [(1.0, 8), (0.4, 3), (0.7, 13), (1.0, 16)] {
            let cone = FrictionCone::new(friction, edges).unwrap();
            let mut kernels = sets.iter().map(|&arch| Kernel {
                arch,
                narrow: arch,
                ..Kernel::new(&cone)
            });
            let mut portable = kernels.next().unwrap();
            let mut others: Vec<Kernel> = kernels.collect();
            for (contacts, center) in grasps(2000) {
                let wanted = portable.longest(&contacts, center);
                for kernel in &mut others {
                    assert_eq!(kernel.longest(&contacts, center), wanted);
                }
            }
        }
    }
}
