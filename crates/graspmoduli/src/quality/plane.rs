//! Three contacts seen from the plane through them, and the planar force-closure test.
//!
//! In the contact plane the first contact is the origin, the second lies on the x axis and the
//! third above it. Equilibrium forces of three points lie in this plane, and the rigidity of
//! three velocities concerns only their components in it, so both the test and the kernel are
//! planar problems.

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

/// Lengths relative to the triangle's longest side, and products of unit vectors, below which a
/// configuration counts as degenerate (collinear, or with the origin on the hull's boundary).
const DEGENERATE: f64 = 1e-12;

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
fn padded(vectors: &[[f64; 2]], height: f64) -> Table<3> {
    let mut table = zeros(vectors.len());
    for (index, [x, y]) in vectors.iter().enumerate() {
        for (row, value) in table[index / LANES].iter_mut().zip([*x, *y, height]) {
            row[index % LANES] = value;
        }
    }
    table
}

/// Working memory for grasps of three contacts with one kind of friction cone.
#[derive(Debug, Clone)]
pub(super) struct Plane {
    pub edges: usize,
    friction: f64,
    edge_table: Table<3>,
    ray_table: Table<3>,
    /// Columns: the plane's axes in the object frame.
    pub basis: DMat3,
    /// Centre of mass in the frame of the plane.
    pub center: DVec3,
    pub sides: [Side; 3],
    /// Unit vectors along the triangle's sides 12, 13, 23, and their lengths.
    along: [DVec2; 3],
    length: [f64; 3],
    pub velocity: Velocity<f64>,
}

impl Plane {
    pub fn new(cone: &FrictionCone) -> Self {
        Self {
            edges: cone.len(),
            friction: cone.friction(),
            edge_table: padded(&cone.edges, 1.0),
            ray_table: padded(&cone.rays, cone.ray_height),
            basis: DMat3::IDENTITY,
            center: DVec3::ZERO,
            sides: std::array::from_fn(|_| Side::new(cone.len())),
            along: [DVec2::ZERO; 3],
            length: [0.0; 3],
            velocity: Velocity::default(),
        }
    }

    /// Sets up the plane of the contacts and their cones' edges in it.
    ///
    /// Returns false, and leaves the rest undefined, where the contacts are collinear to
    /// rounding or some cone does not reach to both sides of the plane: then the grasp is not
    /// force closure.
    #[inline(always)]
    pub fn set_up(&mut self, contacts: &[Contact; 3]) -> bool {
        let origin = contacts[0].point;
        let (first, second) = (contacts[1].point - origin, contacts[2].point - origin);
        let normal = first.cross(second);
        // The circular cone reaches to both sides of the plane where |n·z| < μ √(1 − (n·z)²); the
        // polygonal one lies within it. Half of all grasps end here, before any division; where
        // this overflows, the same test below decides.
        let steepest = self.friction / (1.0 + self.friction * self.friction).sqrt();
        let bar = steepest * steepest * normal.length_squared() * (1.0 + DEGENERATE);
        let rises = [0, 1, 2].map(|i| contacts[i].normal.dot(normal));
        if rises
            .into_iter()
            .fold(false, |steep, rise| steep | (rise * rise > bar))
        {
            return false;
        }
        let longest = first
            .length_squared()
            .max(second.length_squared())
            .max((second - first).length_squared());
        let area = normal.length();
        // Negated, so that overflow to NaN counts as degenerate too.
        if !(area > DEGENERATE * longest && longest.is_finite()) {
            return false;
        }
        let z = normal / area;
        if contacts.iter().any(|c| c.normal.dot(z).abs() >= steepest) {
            return false;
        }
        let x = first.normalize();
        let y = z.cross(x);
        self.basis = DMat3::from_cols(x, y, z);
        let planar = |v: DVec3| DVec2::new(v.dot(x), v.dot(y));
        let points = [DVec2::ZERO, planar(first), planar(second)];
        for (side, (contact, point)) in self.sides.iter_mut().zip(contacts.iter().zip(points)) {
            let frame = Frame::new(contact.normal);
            let local = |v: DVec3| DVec3::new(v.dot(x), v.dot(y), v.dot(z));
            side.point = point;
            side.normal = local(frame.normal);
            side.tangents = frame.tangents.map(local);
            side.turn(&self.edge_table, false);
        }
        for (row, (from, to)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
            let side = self.sides[to].point - self.sides[from].point;
            self.length[row] = side.length();
            self.along[row] = side / self.length[row];
        }
        true
    }

    /// Sets up what the kernel needs beyond the planar test.
    #[inline(always)]
    pub fn set_up_rays(&mut self, contacts: &[Contact; 3], center_of_mass: DVec3) {
        self.center = self
            .basis
            .transpose()
            .mul_vec3(center_of_mass - contacts[0].point);
        for side in &mut self.sides {
            side.turn(&self.ray_table, true);
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
    #[inline(always)]
    pub fn force_closure(&self) -> bool {
        let [e12, e13, e23] = self.along;
        // Coordinates of a force at each contact: (t12, t13), (t23, t12), (t13, t23).
        let coordinates = [[e13, -e12], [-e12, -e23], [-e23, e13]];
        // The rays of the wedges, mirrored into the first quadrant from each of the four.
        let mut rays = [[0.0; 12]; 4];
        for contact in 0..3 {
            let Some(wedge) = self.wedge(contact) else {
                return false;
            };
            let [p, q] = coordinates[contact];
            let [a, b] = wedge.map(|f| DVec2::new(f.perp_dot(p), f.perp_dot(q)));
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
        let mut closed = 0u32;
        for octant in 0..8 {
            let below = low_y[octant] < low_x[octant] * (1.0 - DEGENERATE);
            let above = high_y[octant] * (1.0 - DEGENERATE) > high_x[octant];
            closed |= u32::from(below & above);
        }
        closed != 0
    }

    /// The two directions, of any length, in which the boundary of a cone crosses the plane,
    /// counterclockwise.
    #[inline(always)]
    fn wedge(&self, contact: usize) -> Option<[DVec2; 2]> {
        let table = &self.sides[contact].edge;
        let last = self.edges - 1;
        let mut below = u32::from(at(table, last)[2] < 0.0);
        // Where the boundary comes up through the plane, and where it goes down.
        let (mut ups, mut downs) = (0, 0);
        let (mut up_to, mut down_to) = (0, 0);
        let (mut above_somewhere, mut below_somewhere) = (0, 0);
        for (block, [_, _, row]) in table.iter().enumerate() {
            let (mut negative, mut high, mut low) = (0u32, 0u32, 0u32);
            for lane in 0..LANES {
                negative |= u32::from(row[lane] < 0.0) << lane;
                high |= u32::from(row[lane] > DEGENERATE) << lane;
                low |= u32::from(row[lane] < -DEGENERATE) << lane;
            }
            // The padding's zeros are neither.
            above_somewhere |= high;
            below_somewhere |= low;
            let count = LANES.min(self.edges - block * LANES);
            let before = negative << 1 | below;
            let valid = (1 << count) - 1;
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
            return None;
        }
        let crossing = |to: usize| {
            let from = if to == 0 { last } else { to - 1 };
            let ([x0, y0, z0], [x1, y1, z1]) = (at(table, from), at(table, to));
            DVec2::new(x0, y0) * z1.abs() + DVec2::new(x1, y1) * z0.abs()
        };
        let (a, b) = (crossing(up_to), crossing(down_to));
        Some(if a.perp_dot(b) < 0.0 { [b, a] } else { [a, b] })
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
