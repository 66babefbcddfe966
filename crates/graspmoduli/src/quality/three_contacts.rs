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
//! The loops below only propose twists; [`Found::offer`] divides each by its support h(x) = max
//! ⟨x, w_ij⟩, which puts it on the boundary of P whatever rounding did. So every value found is
//! an upper bound of Q_l, and degenerate candidates (0/0) can do no harm. What could do harm are
//! wrong signs: of force closure, which are told from rounding ([`Plane::closure`]), and of
//! multipliers, where the triangle of contacts is flat or far from the centre of mass. Whatever is
//! not clear beyond rounding is left to the expanding polytope.

use super::apex_ray_face::Apexes;
use super::instructions::instructions;
use super::lanes::greatest;
use super::plane::{Closure, Plane, Three};
use super::ray_ray_ray::Triples;
use super::vertex::{Found, Question, Vertex};
use crate::contact::FrictionCone;
use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};

/// Lever arms that are longer than this many times the shortest side or height of the triangle of
/// contacts: the polytope errs less.
const LONG_LEVERS: f64 = 1e3;
/// The closed form cannot tell beyond rounding: the expanding polytope must.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Unclear;

/// Working memory for the exact quality of grasps with three contacts.
#[derive(Debug, Clone)]
pub(crate) struct Kernel {
    arch: Arch,
    /// For the planar test.
    narrow: Arch,
    plane: Plane,
    apexes: Apexes,
    triples: Triples,
    found: Found,
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
            apexes: Apexes::new(edges),
            triples: Triples::new(edges),
            found: Found::default(),
        }
    }

    /// Gives each contact its coefficient of friction.
    #[inline]
    pub fn set_frictions(&mut self, cone: &FrictionCone, frictions: [f64; 3]) {
        self.plane.set_frictions(cone, frictions);
    }

    /// The longest admissible twist, or `None` where the grasp is not force closure (Q = 0).
    #[inline]
    pub fn longest(&mut self, contacts: Three, center: DVec3) -> Result<Option<Vertex>, Unclear> {
        let closed = self.ask(contacts, center, Question::Longest)?;
        Ok(closed.then(|| self.found.vertices[0]))
    }

    /// As [`Kernel::longest`], but content with any twist longer than 1/`threshold`: one such is
    /// the proof that Q < `threshold`.
    #[inline]
    pub fn longest_up_to(
        &mut self,
        contacts: Three,
        center: DVec3,
        threshold: f64,
    ) -> Result<Option<Vertex>, Unclear> {
        let closed = self.ask(contacts, center, Question::LongestUpTo(threshold))?;
        Ok(closed.then(|| self.found.vertices[0]))
    }

    /// The longest twist if it is longer than 1/`threshold`, or about as long: `Some(None)` if Q is
    /// not below the threshold, `None` where the grasp is not force closure.
    #[inline]
    pub fn longest_above(
        &mut self,
        contacts: Three,
        center: DVec3,
        threshold: f64,
    ) -> Result<Option<Option<Vertex>>, Unclear> {
        // A little less, so that rounding in the square does not decide what Q should.
        let limit = (1.0 - 1e-14) / (threshold * threshold);
        let closed = self.ask(contacts, center, Question::LongerThan(limit))?;
        Ok(closed.then(|| self.found.vertices.first().copied()))
    }

    /// Vertices of P that belong to the facets of the hull within `distance` of the origin, at
    /// most `most`, the nearest first and always among them; `None` where the grasp is not force
    /// closure.
    pub fn within(
        &mut self,
        contacts: Three,
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
        self.found.vertices.retain(|vertex| vertex.exact);
        if self.found.vertices.is_empty() && !self.ask(contacts, center, Question::Longest)? {
            return Ok(None);
        }
        self.found.sort(most);
        Ok(Some(&self.found.vertices))
    }

    /// Fills `found`; false where the grasp is not force closure.
    #[inline]
    fn ask(&mut self, contacts: Three, center: DVec3, question: Question) -> Result<bool, Unclear> {
        self.found.vertices.clear();
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
            Question::Longest | Question::LongestUpTo(_) if self.found.vertices.is_empty() => {
                Err(Unclear)
            }
            _ => Ok(true),
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
    contacts: Three<'a>,
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
    contacts: Three<'a>,
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
        let Kernel {
            plane,
            apexes,
            triples,
            found,
            ..
        } = kernel;
        let apexes = apexes.look(simd, plane, question, &mut limit, found);
        if apexes.is_continue() {
            let _ = triples.look(simd, plane, question, &mut limit, found);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Contact;

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
                let wanted = portable.longest(contacts.each_ref(), center);
                for kernel in &mut others {
                    assert_eq!(kernel.longest(contacts.each_ref(), center), wanted);
                }
            }
        }
    }
}
