//! One grasp after the other: which kernel answers, and in which order it looks at the contacts.

use super::enough::Enough;
use super::gradient::{self, Gradient};
use super::hull::Hull;
use super::metric::Metric;
use super::plane::Three;
use super::polytope::{Distance, Polytope};
use super::r6::{self, Twist};
use super::three_contacts::Kernel;
use super::wrenches::{Circular, Reference, Wrenches};
use crate::contact::{Contact, FrictionCone, Norm};
use glam::DVec3;
use std::cmp::Ordering;

/// Beyond so many edges per cone the expanding polytope is faster than the closed form.
const MOST_EDGES: usize = 36;

/// Working memory that evaluates grasps one after the other without allocating.
///
/// Contacts may come in any order: they are looked at in an order of their own, so that the same
/// grasp has the same quality to the bit.
#[derive(Debug, Clone)]
pub struct Evaluator {
    cone: FrictionCone,
    kernel: Kernel,
    hull: Hull,
    polytope: Polytope,
    wrenches: Wrenches,
    /// The order in which contacts are looked at.
    order: Vec<usize>,
    evaluations: usize,
    unconverged: Option<[f64; 2]>,
}

/// A grasp's quality with the direction in which it is least.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weakest {
    /// Q.
    pub quality: f64,
    /// The unit wrench (force, torque) that the grasp can apply least of: the normal of the facet
    /// nearest to the origin. If Q = 0, the normal of a plane through the origin that the hull does
    /// not reach beyond.
    pub direction: Twist,
}

impl Evaluator {
    /// For grasps with the given friction cones.
    pub fn new(cone: &FrictionCone) -> Self {
        Self {
            cone: cone.clone(),
            kernel: Kernel::new(cone),
            hull: Hull::new(),
            polytope: Polytope::default(),
            wrenches: Wrenches::new(),
            order: Vec::new(),
            evaluations: 0,
            unconverged: None,
        }
    }

    /// How many grasps were evaluated so far, for their value, gradient or facets.
    pub fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Bounds of the last quality that could not be computed, if there was one since this was
    /// asked: its value was the lower bound. Such grasps are rare, and those that are known have
    /// coefficients of friction of 1e5 and more.
    pub fn take_unconverged(&mut self) -> Option<[f64; 2]> {
        self.unconverged.take()
    }

    /// Gives the contacts of the grasps that follow friction coefficients of their own, finite and
    /// not negative.
    pub(crate) fn set_frictions(&mut self, frictions: &[f64]) {
        self.cone.set_frictions(frictions);
    }

    /// Exact Q_l, or Q'_l of fingers with a limit each; 0 if the origin is not in the interior of the wrench hull.
    #[inline]
    pub fn quality(&mut self, contacts: &[Contact], center_of_mass: DVec3) -> f64 {
        self.evaluations += 1;
        if let Some((three, _)) = self.closed_form(contacts)
            && let Ok(longest) = self.kernel.longest(three, center_of_mass)
        {
            return longest.map_or(0.0, |vertex| vertex.quality());
        }
        self.expanded(contacts, center_of_mass, Enough::Never)
    }

    /// Is Q_l ≥ `threshold`? The same as comparing, but ends as soon as it is known.
    #[inline]
    pub fn is_at_least(
        &mut self,
        contacts: &[Contact],
        center_of_mass: DVec3,
        threshold: f64,
    ) -> bool {
        threshold <= 0.0 || self.quality_up_to(contacts, center_of_mass, threshold) >= threshold
    }

    /// Q_l if it is at least `threshold`, else some number between Q_l and `threshold`, which is
    /// below it.
    #[inline]
    pub(crate) fn quality_up_to(
        &mut self,
        contacts: &[Contact],
        center_of_mass: DVec3,
        threshold: f64,
    ) -> f64 {
        if let Some((three, _)) = self.closed_form(contacts)
            && let Ok(longest) = self.kernel.longest_up_to(three, center_of_mass, threshold)
        {
            return longest.map_or(0.0, |vertex| vertex.quality());
        }
        self.expanded(contacts, center_of_mass, Enough::Below(threshold))
    }

    /// As [`Evaluator::weakest`] if Q_l is at least `threshold`; else some unit direction in which
    /// the hull reaches less far than that. `None` where Q_l = 0 and no direction is known.
    pub(crate) fn weakest_up_to(
        &mut self,
        contacts: &[Contact],
        center_of_mass: DVec3,
        threshold: f64,
    ) -> Option<Weakest> {
        if let Some((three, _)) = self.closed_form(contacts)
            && let Ok(longest) = self.kernel.longest_up_to(three, center_of_mass, threshold)
        {
            let vertex = longest?;
            let quality = vertex.quality();
            return Some(Weakest {
                quality,
                direction: vertex.twist.map(|x| x * quality),
            });
        }
        let distance = self.distance(contacts, center_of_mass, Enough::Below(threshold))?;
        let metric = Metric::new(self.wrenches.reference, center_of_mass);
        Some(Weakest {
            quality: self.value(&distance),
            direction: metric.direction(&distance.direction),
        })
    }

    /// Q_l if it is below `threshold`, else `threshold`.
    #[inline]
    pub(crate) fn quality_below(
        &mut self,
        contacts: &[Contact],
        center_of_mass: DVec3,
        threshold: f64,
    ) -> f64 {
        let quality = if let Some((three, _)) = self.closed_form(contacts)
            && let Ok(longest) = self.kernel.longest_above(three, center_of_mass, threshold)
        {
            longest.map_or(0.0, |vertex| {
                vertex.map_or(threshold, |vertex| vertex.quality())
            })
        } else {
            self.expanded(contacts, center_of_mass, Enough::AtLeast(threshold))
        };
        quality.min(threshold)
    }

    /// Q_l with its exact gradient. Where several facets of the hull are nearest to the origin, Q
    /// is not differentiable, and the gradient is that of the distance to one of them, with
    /// multipliers that are not negative: an element of Clarke's generalised gradient. Fingers with a
    /// limit each may be [`MOST_EACH`](super::MOST_EACH); of more the derivatives are left at 0.
    pub fn gradient(&mut self, contacts: &[Contact], center_of_mass: DVec3) -> Gradient {
        let mut row = vec![0.0; Gradient::width(contacts.len())];
        self.gradient_row(contacts, center_of_mass, &mut row);
        Gradient::from_row(&row)
    }

    /// [`Evaluator::gradient`] into memory that is laid out as [`Gradient::width`] says.
    #[inline]
    pub(super) fn gradient_row(&mut self, contacts: &[Contact], center: DVec3, row: &mut [f64]) {
        self.evaluations += 1;
        row.fill(0.0);
        if let Some((three, order)) = self.closed_form(contacts)
            && let Ok(longest) = self.kernel.longest(three, center)
        {
            if let Some(vertex) = longest
                && !gradient::of_vertex(&vertex, order, contacts, center, &self.cone, true, row)
            {
                // The value is right all the same.
                row[0] = vertex.quality();
            }
            return;
        }
        let weakest = self.weakest(contacts, center);
        self.foot_point_row(&weakest, contacts, center, row);
    }

    /// Value and gradient of the nearest facet, by all wrenches that lie on it.
    fn foot_point_row(
        &mut self,
        weakest: &Weakest,
        contacts: &[Contact],
        center: DVec3,
        row: &mut [f64],
    ) {
        let Weakest { quality, direction } = *weakest;
        row[0] = quality;
        if quality > 0.0 {
            self.wrenches.list();
            let mut shares = vec![Default::default(); contacts.len()];
            let (wrenches, cone) = (&self.wrenches, &self.cone);
            if gradient::foot_point(wrenches, &direction, quality, center, cone, &mut shares) {
                gradient::differentiate(&direction, quality, contacts, center, &shares, row);
            }
        }
    }

    /// The quality by an expanding polytope, whatever the number of contacts, with the direction in
    /// which the grasp is weakest.
    pub fn weakest(&mut self, contacts: &[Contact], center: DVec3) -> Weakest {
        self.set_wrenches(contacts);
        if self.wrenches.reference.is_point() {
            // All contacts in one place: no force works along a turn about it.
            let v = (self.wrenches.reference.point - center).cross(DVec3::X);
            return Weakest {
                quality: 0.0,
                direction: r6::unit(&[v.x, v.y, v.z, 1.0, 0.0, 0.0]).0,
            };
        }
        let metric = Metric::new(self.wrenches.reference, center);
        let distance = self.distance_by(metric, Enough::Never);
        let quality = self.value(&distance);
        Weakest {
            quality: if self.too_few(contacts) { 0.0 } else { quality },
            direction: metric.direction(&distance.direction),
        }
    }

    /// Lower and upper bound of the quality with exact circular cones, which meet to `tolerance`
    /// relative to the upper one; both 0 where the grasp is not force closure.
    pub fn circular(
        &mut self,
        contacts: &[Contact],
        center_of_mass: DVec3,
        tolerance: f64,
    ) -> (f64, f64) {
        self.evaluations += 1;
        if self.too_few(contacts) {
            return (0.0, 0.0);
        }
        self.sort(contacts);
        let reference = Reference::new(contacts, &self.order, self.cone.torsion());
        if reference.is_point() {
            return (0.0, 0.0);
        }
        let hull = Circular {
            contacts,
            order: &self.order,
            cone: &self.cone,
            reference,
        };
        let met = |lower, upper| upper - lower <= tolerance * upper;
        let metric = Metric::new(reference, center_of_mass);
        let distance = self.polytope.distance(&hull, metric, met);
        if !distance.upper.is_finite() {
            self.unconverged = Some([distance.lower, distance.upper]);
        }
        (distance.lower, distance.upper)
    }

    /// The contacts of a grasp that has a closed form in their order, and the order; sets the
    /// kernel's friction.
    #[inline]
    fn closed_form<'a>(&mut self, contacts: &'a [Contact]) -> Option<(Three<'a>, [usize; 3])> {
        let three: &[Contact; 3] = contacts.try_into().ok()?;
        let hard = self.cone.torsion() == 0.0 && self.cone.norm() == Norm::Sum;
        if !hard || self.cone.len() > MOST_EDGES {
            return None;
        }
        let [a, b, c] = three;
        // Bit by bit, as each is as likely as not: branches would be mispredicted.
        let key = usize::from(before(b, a))
            | usize::from(before(c, b)) << 1
            | usize::from(before(c, a)) << 2;
        let order = BY_COMPARISON[key];
        if !self.cone.is_uniform() {
            let frictions = order.map(|i| self.cone.friction(i));
            self.kernel.set_frictions(&self.cone, frictions);
        }
        Some((order.map(|i| &three[i]), order))
    }

    /// Two hard contacts cannot resist a twist about their line, one of any kind cannot pull, and
    /// without friction it takes seven wrenches to surround the origin of R⁶: else Q is exactly 0.
    fn too_few(&self, contacts: &[Contact]) -> bool {
        let fewest = match (self.cone.torsion() > 0.0, self.cone.is_rough()) {
            (true, true) => 2,
            (false, true) => 3,
            (true, false) => 4,
            (false, false) => 7,
        };
        contacts.len() < fewest
    }

    /// Puts the contacts into their order.
    fn sort(&mut self, contacts: &[Contact]) {
        self.order.clear();
        self.order.extend(0..contacts.len());
        let cone = &self.cone;
        self.order.sort_by(|&a, &b| {
            compare(&contacts[a], &contacts[b])
                .then_with(|| cone.friction(a).total_cmp(&cone.friction(b)))
        });
    }

    fn set_wrenches(&mut self, contacts: &[Contact]) {
        self.sort(contacts);
        self.wrenches.set(contacts, &self.order, &self.cone);
    }

    /// By the expanding polytope; `None` where Q = 0 for want of contacts or of lever arms.
    fn distance(
        &mut self,
        contacts: &[Contact],
        center: DVec3,
        enough: Enough,
    ) -> Option<Distance> {
        self.set_wrenches(contacts);
        if self.too_few(contacts) || self.wrenches.reference.is_point() {
            return None;
        }
        let metric = Metric::new(self.wrenches.reference, center);
        Some(self.distance_by(metric, enough))
    }

    /// The distance of the wrenches' hull by the facets in lanes or, where these cannot tell, by the
    /// polytope.
    fn distance_by(&mut self, metric: Metric, enough: Enough) -> Distance {
        let Wrenches { points, norm, .. } = &mut self.wrenches;
        let found = self.hull.distance(points, *norm, metric, enough);
        found.unwrap_or_else(|| {
            self.wrenches.list();
            let enough = |lower, upper| enough.are(lower, upper);
            self.polytope.distance(&self.wrenches, metric, enough)
        })
    }

    /// The value by the expanding polytope.
    fn expanded(&mut self, contacts: &[Contact], center: DVec3, enough: Enough) -> f64 {
        match self.distance(contacts, center, enough) {
            Some(distance) => self.value(&distance),
            None => 0.0,
        }
    }

    /// The distance, or its lower bound if it is not known, which is remembered.
    fn value(&mut self, distance: &Distance) -> f64 {
        if distance.converged {
            return distance.upper;
        }
        self.unconverged = Some([distance.lower, distance.upper]);
        distance.lower
    }

    /// Gradients of the distances to the facets within `distance` of the origin, at most `most`,
    /// the nearest first and always among them; `None` where Q_l = 0.
    pub(crate) fn facets_within(
        &mut self,
        contacts: &[Contact; 3],
        center_of_mass: DVec3,
        distance: f64,
        most: usize,
    ) -> Option<Vec<Gradient>> {
        self.evaluations += 1;
        let mut row = [0.0; 22];
        let mut gradients = Vec::new();
        if let Some((three, order)) = self.closed_form(contacts)
            && let Ok(vertices) = self.kernel.within(three, center_of_mass, distance, most)
        {
            let cone = &self.cone;
            for vertex in vertices? {
                if gradient::of_vertex(
                    vertex,
                    order,
                    contacts,
                    center_of_mass,
                    cone,
                    false,
                    &mut row,
                ) {
                    gradients.push(Gradient::from_row(&row));
                }
            }
        } else {
            // Of grasps at the limit of what the closed form can tell, the nearest facet only.
            let weakest = self.weakest(contacts, center_of_mass);
            self.foot_point_row(&weakest, contacts, center_of_mass, &mut row);
            gradients.extend((weakest.quality > 0.0).then(|| Gradient::from_row(&row)));
        }
        (!gradients.is_empty()).then_some(gradients)
    }
}

/// The order of three contacts, by whether the second comes before the first (bit 0), the third
/// before the second (bit 1) and the third before the first (bit 2).
const BY_COMPARISON: [[usize; 3]; 8] = [
    [0, 1, 2],
    [1, 0, 2],
    [0, 2, 1],
    [2, 1, 0],
    [0, 1, 2],
    [1, 2, 0],
    [2, 0, 1],
    [2, 1, 0],
];

/// Does a contact come before another in the order of [`compare`]?
#[inline(always)]
fn before(a: &Contact, b: &Contact) -> bool {
    if a.point.x == b.point.x {
        compare(a, b).is_lt()
    } else {
        a.point.x < b.point.x
    }
}

/// Contacts by their points and then by their normals, coordinate by coordinate.
fn compare(a: &Contact, b: &Contact) -> Ordering {
    let keys = |c: &Contact| [c.point, c.normal].map(|v| v.to_array());
    keys(a).partial_cmp(&keys(b)).unwrap_or(Ordering::Equal)
}
