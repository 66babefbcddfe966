//! Three contacts seen from the plane through them, and the planar force-closure test.
//!
//! In the contact plane the first contact is the origin, the second lies on the x axis and the
//! third above it. Equilibrium forces of three points lie in this plane, and the rigidity of
//! three velocities concerns only their components in it, so both the test and the kernel are
//! planar problems.

use super::lanes::greatest;
use super::velocity::Velocity;
use crate::contact::{Contact, Frame, FrictionCone};
use glam::{DMat3, DVec2, DVec3};
use std::ops::{Deref, DerefMut};

pub(super) const LANES: usize = 8;
/// A row of numbers, one per ray or edge of a cone: a cache line, and the widest register.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub(super) struct Lanes(pub [f64; LANES]);

impl Deref for Lanes {
    type Target = [f64; LANES];

    #[inline(always)]
    fn deref(&self) -> &[f64; LANES] {
        &self.0
    }
}

impl DerefMut for Lanes {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64; LANES] {
        &mut self.0
    }
}

/// Vectors by their components, a lane each; block after block.
pub(super) type Table<const N: usize> = Vec<[Lanes; N]>;

pub(super) fn zeros<const N: usize>(edges: usize) -> Table<N> {
    vec![[Lanes::default(); N]; edges.div_ceil(LANES)]
}

/// One vector of a table.
#[inline(always)]
pub(super) fn at<const N: usize>(table: &Table<N>, index: usize) -> [f64; N] {
    let block = &table[index / LANES];
    std::array::from_fn(|axis| block[axis][index % LANES])
}

/// Triangles flatter than this (twice the area over the longest side's square) have no plane that
/// is known well enough.
const FLAT: f64 = 1e-5;
/// The least angle, in radians, that is not taken for rounding; see [`Plane::force_closure`].
const ANGLE: f64 = 1e-10;
/// A ratio this near to 0 or to infinity is looked at with care; see [`Plane::force_closure`].
const NEAR: f64 = 1e-3;
/// More than six ratios away from there change by [`ANGLE`].
const MARGIN: f64 = 1e-6;
/// Added to the squared sine of a cone's half angle before a normal counts as too steep.
const STEEP: f64 = 1e-9;
/// Edges of cones, by their components out of the plane, that may as well lie in it.
const IN_PLANE: f64 = 1e-7;
/// Friction for which wedges are neither all of a half-plane nor nothing to rounding.
const USUAL_FRICTION: std::ops::RangeInclusive<f64> = 1e-4..=1e4;

/// Is a grasp force closure?
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Closure {
    /// Yes, beyond rounding.
    Yes,
    /// No, beyond rounding.
    No,
    /// Too close to tell in the plane: the expanding polytope must.
    Unclear,
}

/// One contact in the frame of the plane. Arrays over edges or rays are padded with zeros.
#[derive(Debug, Clone, Default)]
pub(super) struct Side {
    pub point: DVec2,
    pub normal: DVec3,
    tangents: [DVec3; 2],
    /// Components of the edges f_j along the plane's x, y and its normal.
    pub edge: Table<3>,
    /// The same for the rays of the polar cone.
    pub ray: Table<3>,
}

impl Side {
    fn new(edges: usize) -> Self {
        Self {
            edge: zeros(edges),
            ray: zeros(edges),
            ..Self::default()
        }
    }

    /// The vectors of a table turned by the contact frame.
    #[inline(always)]
    fn turn(&mut self, table: &Table<3>, is_ray: bool) {
        let turned = if is_ray {
            &mut self.ray
        } else {
            &mut self.edge
        };
        for ([x, y, z], rows) in table.iter().zip(turned) {
            for axis in 0..3 {
                let (a, b, c) = (
                    self.tangents[0][axis],
                    self.tangents[1][axis],
                    self.normal[axis],
                );
                for lane in 0..LANES {
                    rows[axis][lane] = a * x[lane] + b * y[lane] + c * z[lane];
                }
            }
        }
    }
}

/// Vectors (x, y, height) about e₃, padded with zeros to whole lanes.
fn padded(vectors: impl Iterator<Item = [f64; 2]>, count: usize, height: f64) -> Table<3> {
    let mut table = zeros(count);
    for (index, [x, y]) in vectors.enumerate() {
        for (row, value) in table[index / LANES].iter_mut().zip([x, y, height]) {
            row[index % LANES] = value;
        }
    }
    table
}

/// Working memory for grasps of three contacts with friction cones of one number of edges.
#[derive(Debug, Clone)]
pub(super) struct Plane {
    pub edges: usize,
    frictions: [f64; 3],
    /// The squared sines of the steepest normals over the plane; see [`Plane::set_up`].
    steepest: [f64; 3],
    edge_tables: [Table<3>; 3],
    /// Of unit length.
    ray_tables: [Table<3>; 3],
    /// Columns: the plane's axes in the object frame.
    pub basis: DMat3,
    /// Centre of mass in the frame of the plane.
    pub center: DVec3,
    pub sides: [Side; 3],
    /// Unit vectors along the triangle's sides 12, 13, 23, and their lengths.
    along: [DVec2; 3],
    length: [f64; 3],
    /// How well directions in the plane are known: units of rounding over the triangle's flatness.
    rounding: f64,
    pub velocity: Velocity<f64>,
}

impl Plane {
    pub fn new(cone: &FrictionCone) -> Self {
        let mut plane = Self {
            edges: cone.len(),
            frictions: [f64::NAN; 3],
            steepest: [0.0; 3],
            edge_tables: Default::default(),
            ray_tables: Default::default(),
            basis: DMat3::IDENTITY,
            center: DVec3::ZERO,
            sides: std::array::from_fn(|_| Side::new(cone.len())),
            along: [DVec2::ZERO; 3],
            length: [0.0; 3],
            rounding: 0.0,
            velocity: Velocity::default(),
        };
        plane.set_frictions(cone, [cone.friction(0); 3]);
        plane
    }

    /// Gives each contact its coefficient of friction.
    #[inline]
    pub fn set_frictions(&mut self, cone: &FrictionCone, frictions: [f64; 3]) {
        for (i, friction) in frictions.into_iter().enumerate() {
            if friction == self.frictions[i] {
                continue;
            }
            self.steepest[i] = friction * friction / (1.0 + friction * friction) + STEEP;
            let edges = cone.edges.iter().map(|[x, y]| [friction * x, friction * y]);
            self.edge_tables[i] = padded(edges, cone.len(), 1.0);
            let height = -friction * cone.inner;
            let length = (1.0 + height * height).sqrt();
            let rays = cone.rays.iter().map(|[x, y]| [x / length, y / length]);
            self.ray_tables[i] = padded(rays, cone.len(), height / length);
        }
        self.frictions = frictions;
    }

    /// Is the grasp force closure? Sets up the plane of the contacts and their cones' edges in it,
    /// which is left undefined if the answer is no.
    #[inline(always)]
    pub fn closure(&mut self, contacts: &[Contact; 3]) -> Closure {
        match self.set_up(contacts) {
            Closure::Yes => self.force_closure(),
            other => other,
        }
    }

    /// `Yes` if there is a plane and each cone may reach to both of its sides.
    #[inline(always)]
    fn set_up(&mut self, contacts: &[Contact; 3]) -> Closure {
        let origin = contacts[0].point;
        let (first, second) = (contacts[1].point - origin, contacts[2].point - origin);
        let third = second - first;
        let normal = first.cross(second);
        let longest = greatest(
            first.length_squared(),
            greatest(second.length_squared(), third.length_squared()),
        );
        let square = normal.length_squared();
        // Negated, so that NaN from overflow is unclear too, and so is what underflows.
        if !(square >= FLAT * FLAT * longest * longest && longest > 1e-60 && longest < 1e60) {
            return Closure::Unclear;
        }
        // The circular cone reaches to both sides of the plane where |n·z| < μ/√(1 + μ²); the
        // polygonal one lies within it. Half of all grasps end here, before any division.
        let mut steep = false;
        for (contact, steepest) in contacts.iter().zip(self.steepest) {
            let rise = contact.normal.dot(normal);
            steep |= rise * rise > steepest * square;
        }
        if steep {
            return Closure::No;
        }
        let area = square.sqrt();
        self.rounding = 4.0 * f64::EPSILON * longest / area;
        let z = normal / area;
        let x = first.normalize();
        let y = z.cross(x);
        self.basis = DMat3::from_cols(x, y, z);
        let planar = |v: DVec3| DVec2::new(v.dot(x), v.dot(y));
        let points = [DVec2::ZERO, planar(first), planar(second)];
        for (i, (contact, point)) in contacts.iter().zip(points).enumerate() {
            let frame = Frame::new(contact.normal);
            let local = |v: DVec3| DVec3::new(v.dot(x), v.dot(y), v.dot(z));
            let side = &mut self.sides[i];
            side.point = point;
            side.normal = local(frame.normal);
            side.tangents = frame.tangents.map(local);
            side.turn(&self.edge_tables[i], false);
        }
        for (row, side) in [points[1], points[2], planar(third)]
            .into_iter()
            .enumerate()
        {
            self.length[row] = side.length();
            self.along[row] = side / self.length[row];
        }
        Closure::Yes
    }

    /// Sets up what the kernel needs beyond the planar test.
    #[inline(always)]
    pub fn set_up_rays(&mut self, contacts: &[Contact; 3], center_of_mass: DVec3) {
        self.center = self
            .basis
            .transpose()
            .mul_vec3(center_of_mass - contacts[0].point);
        for (side, table) in self.sides.iter_mut().zip(&self.ray_tables) {
            side.turn(table, true);
        }
        self.velocity = Velocity::new(self);
    }

    /// Unit vectors along the sides 12, 13 and 23.
    #[inline(always)]
    pub fn along(&self) -> [DVec2; 3] {
        self.along
    }

    /// Lengths of the sides 12, 13 and 23.
    #[inline(always)]
    pub fn length(&self) -> [f64; 3] {
        self.length
    }

    /// The least height of the triangle, which is less than any of its sides.
    #[inline(always)]
    pub fn narrowest(&self) -> f64 {
        let [first, second, third] = self.length;
        self.length[0] * self.sides[2].point.y / first.max(second).max(third)
    }

    /// The unit vector from one contact to another, and their distance.
    #[inline(always)]
    pub fn way(&self, from: usize, to: usize) -> (DVec2, f64) {
        let side = from + to - 1;
        let sign = if from < to { 1.0 } else { -1.0 };
        (self.along[side] * sign, self.length[side])
    }

    /// Is 0 in the interior of the wrench hull? (Sec. 2 of the mathematics page, "Is 0 interior?")
    ///
    /// Equilibrium forces are t₁₂e₁₂ + t₁₃e₁₃ at contact 1, −t₁₂e₁₂ + t₂₃e₂₃ at 2 and
    /// −t₁₃e₁₃ − t₂₃e₂₃ at 3. For fixed signs of (t₁₂, t₁₃, t₂₃) the wedge in which a cone cuts
    /// the plane bounds one ratio per contact, |t₁₃/t₁₂|, |t₁₂/t₂₃| and |t₂₃/t₁₃|. Their product
    /// is 1, and nothing else ties them: a strict solution exists exactly when, for some signs,
    /// the product of the lower bounds is below 1 and that of the upper bounds above.
    ///
    /// The answer is no if wedges opened by more than the rounding error of their sides have no
    /// solution, yes if wedges closed by as much have one, and else unclear: all signs that are
    /// taken on the way are then right, or do not matter.
    #[inline(always)]
    fn force_closure(&self) -> Closure {
        if self.frictions.iter().any(|mu| !USUAL_FRICTION.contains(mu)) {
            return Closure::Unclear;
        }
        let mut wedges = [Wedge::default(); 3];
        for (contact, wedge) in wedges.iter_mut().enumerate() {
            match self.wedge(contact) {
                Ok(found) => *wedge = found,
                Err(closure) => return closure,
            }
        }
        // Away from the axes of the coordinates below, where a small angle changes a ratio by
        // little, rounding cannot change a product by as much as the margin.
        if !self.near_axes(&wedges) {
            match self.balances(&wedges.map(|wedge| wedge.sides), MARGIN) {
                (true, _) => return Closure::Yes,
                (_, false) => return Closure::No,
                _ => {}
            }
        }
        if !self.balances(&wedges.map(|wedge| wedge.opened(1.0)), 0.0).1 {
            return Closure::No;
        }
        let closed = wedges.map(|wedge| wedge.opened(-1.0));
        let proper = closed.iter().all(|[a, b]| a.perp_dot(*b) > 0.0);
        if proper && self.balances(&closed, 0.0).0 {
            Closure::Yes
        } else {
            Closure::Unclear
        }
    }

    /// Coordinates of forces at each contact: (t12, t13), (t23, t12), (t13, t23) are their products
    /// across these.
    #[inline(always)]
    fn coordinates(&self) -> [[DVec2; 2]; 3] {
        let [e12, e13, e23] = self.along;
        [[e13, -e12], [-e12, -e23], [-e23, e13]]
    }

    /// Is any side of a wedge near an axis of its coordinates, or not known well?
    #[inline(always)]
    fn near_axes(&self, wedges: &[Wedge; 3]) -> bool {
        let mut near = false;
        for (wedge, [p, q]) in wedges.iter().zip(self.coordinates()) {
            for (side, angle) in wedge.sides.into_iter().zip(wedge.angles) {
                let (x, y) = (side.perp_dot(p).abs(), side.perp_dot(q).abs());
                near |= (x < NEAR * y) | (y < NEAR * x) | (angle > 2.0 * ANGLE);
            }
        }
        near
    }

    /// Are there strict equilibria with forces in these wedges, each given by its sides
    /// counterclockwise, even if products of ratios are off by `margin`? And if they may be?
    #[inline(always)]
    fn balances(&self, wedges: &[[DVec2; 2]; 3], margin: f64) -> (bool, bool) {
        let coordinates = self.coordinates();
        // The rays of the wedges, mirrored into the first quadrant from each of the four.
        let mut rays = [[0.0; 12]; 4];
        for contact in 0..3 {
            let [p, q] = coordinates[contact];
            let [a, b] = wedges[contact].map(|f| DVec2::new(f.perp_dot(p), f.perp_dot(q)));
            // Mirroring once turns counterclockwise into clockwise: the rays swap places.
            let mirrored = [
                [a.x, -b.x, b.x, -a.x],
                [a.y, b.y, -b.y, -a.y],
                [b.x, -a.x, a.x, -b.x],
                [b.y, a.y, -a.y, -b.y],
            ];
            for (row, values) in rays.iter_mut().zip(mirrored) {
                row[4 * contact..4 * contact + 4].copy_from_slice(&values);
            }
        }
        let bounds = ratio_bounds(&rays);
        let mut products = [[1.0; 8]; 4];
        for row in 0..4 {
            for octant in 0..8 {
                let mut product = 1.0;
                for contact in 0..3 {
                    product *= bounds[row][4 * contact + QUADRANTS[contact][octant]];
                }
                products[row][octant] = product;
            }
        }
        let [low_x, low_y, high_x, high_y] = products;
        let (mut surely, mut maybe) = (0u32, 0u32);
        for octant in 0..8 {
            let (low, high) = (low_y[octant], high_x[octant]);
            let (above_low, below_high) = (low_x[octant], high_y[octant]);
            surely |= u32::from(
                (low < above_low * (1.0 - margin)) & (below_high * (1.0 - margin) > high),
            );
            maybe |= u32::from(
                (low * (1.0 - margin) < above_low) & (below_high > high * (1.0 - margin)),
            );
        }
        (surely != 0, maybe != 0)
    }

    /// Where the boundary of a cone crosses the plane; or the answer, where it may not.
    #[inline(always)]
    fn wedge(&self, contact: usize) -> Result<Wedge, Closure> {
        let table = &self.sides[contact].edge;
        let size = 1.0 + self.frictions[contact];
        let bar = IN_PLANE * size;
        let sure = ANGLE.max(self.rounding) * size;
        let last = self.edges - 1;
        let mut below = u32::from(at(table, last)[2] < 0.0);
        // Where the boundary comes up through the plane, and where it goes down.
        let (mut ups, mut downs) = (0, 0);
        let (mut up_to, mut down_to) = (0, 0);
        let (mut above_somewhere, mut below_somewhere) = (0, 0);
        let (mut not_under, mut not_over) = (0, 0);
        for (block, [_, _, row]) in table.iter().enumerate() {
            let (mut negative, mut high, mut low) = (0u32, 0u32, 0u32);
            let (mut over, mut under) = (0u32, 0u32);
            for lane in 0..LANES {
                negative |= u32::from(row[lane] < 0.0) << lane;
                high |= u32::from(row[lane] > bar) << lane;
                low |= u32::from(row[lane] < -bar) << lane;
                over |= u32::from(row[lane] > -sure) << lane;
                under |= u32::from(row[lane] < sure) << lane;
            }
            let count = LANES.min(self.edges - block * LANES);
            let valid = (1 << count) - 1;
            // The padding's zeros are neither high nor low.
            above_somewhere |= high;
            below_somewhere |= low;
            not_under |= over & valid;
            not_over |= under & valid;
            let before = negative << 1 | below;
            let (up, down) = (before & !negative & valid, !before & negative & valid);
            ups += up.count_ones();
            downs += down.count_ones();
            if up != 0 {
                up_to = block * LANES + up.trailing_zeros() as usize;
            }
            if down != 0 {
                down_to = block * LANES + down.trailing_zeros() as usize;
            }
            below = negative >> (count - 1);
        }
        if (ups != 1) | (downs != 1) | (above_somewhere == 0) | (below_somewhere == 0) {
            return Err(if (not_under == 0) | (not_over == 0) {
                Closure::No
            } else {
                Closure::Unclear
            });
        }
        let crossing = |to: usize| {
            let from = if to == 0 { last } else { to - 1 };
            let ([x0, y0, z0], [x1, y1, z1]) = (at(table, from), at(table, to));
            let side = DVec2::new(x0, y0) * z1.abs() + DVec2::new(x1, y1) * z0.abs();
            // Errors of the heights turn the crossing, the more the flatter the face.
            let angle = self.rounding * (1.0 + size * size / (z0.abs() + z1.abs()));
            (side, ANGLE + angle)
        };
        let ([a, b], [to_a, to_b]) = {
            let (up, down) = (crossing(up_to), crossing(down_to));
            ([up.0, down.0], [up.1, down.1])
        };
        Ok(if a.perp_dot(b) < 0.0 {
            Wedge {
                sides: [b, a],
                angles: [to_b, to_a],
            }
        } else {
            Wedge {
                sides: [a, b],
                angles: [to_a, to_b],
            }
        })
    }
}

/// The forces of a cone in the plane: between two directions, of any length, counterclockwise.
#[derive(Debug, Clone, Copy, Default)]
struct Wedge {
    sides: [DVec2; 2],
    /// Errors of the directions, in radians.
    angles: [f64; 2],
}

impl Wedge {
    /// The sides turned outward by so many times their errors.
    #[inline(always)]
    fn opened(self, times: f64) -> [DVec2; 2] {
        let [a, b] = self.sides;
        [
            a - a.perp() * (times * self.angles[0]),
            b + b.perp() * (times * self.angles[1]),
        ]
    }
}

/// The quadrant of each contact's coordinates (bit 0: x < 0, bit 1: y < 0) for each choice of signs
/// of (t₁₂, t₁₃, t₂₃), bit 0 to bit 2.
const QUADRANTS: [[usize; 8]; 3] = [
    [0, 1, 2, 3, 0, 1, 2, 3],
    [0, 2, 0, 2, 1, 3, 1, 3],
    [0, 0, 1, 1, 2, 2, 3, 3],
];

/// Bounds on y/x within wedges and the open first quadrant: denominator and numerator of the lower
/// bound and of the upper one. Where they do not meet, the lower bound is infinite.
///
/// A wedge is given by its rays a and b, counterclockwise, as rows a_x, a_y, b_x, b_y. Written
/// without branches, which would be mispredicted, for registers.
#[inline(always)]
fn ratio_bounds(rays: &[[f64; 12]; 4]) -> [[f64; 12]; 4] {
    let mut bounds = [[0.0; 12]; 4];
    for i in 0..12 {
        let [ax, ay, bx, by] = [rays[0][i], rays[1][i], rays[2][i], rays[3][i]];
        // The wedge is narrower than π: a direction d is within it where a × d > 0 and d × b > 0.
        let from_a = (ax > 0.0) & (ay >= 0.0);
        let from_x = (ay < 0.0) & (by > 0.0);
        let (low_x, low_y) = (if from_a { ax } else { 1.0 }, if from_a { ay } else { 0.0 });
        let to_b = (by > 0.0) & (bx >= 0.0);
        let to_y = (ax > 0.0) & (bx < 0.0);
        let (high_x, high_y) = (if to_b { bx } else { 0.0 }, if to_b { by } else { 1.0 });
        let meet = (from_a | from_x) & (to_b | to_y) & (low_x * high_y > low_y * high_x);
        bounds[0][i] = if meet { low_x } else { 0.0 };
        bounds[1][i] = if meet { low_y } else { 1.0 };
        bounds[2][i] = high_x;
        bounds[3][i] = high_y;
    }
    bounds
}
