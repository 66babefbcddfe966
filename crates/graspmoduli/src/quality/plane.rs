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
        let mut low = [[DVec2::ZERO; 4]; 3];
        let mut high = [[DVec2::ZERO; 4]; 3];
        for contact in 0..3 {
            let Some(wedge) = self.wedge(contact) else {
                return false;
            };
            let [p, q] = coordinates[contact];
            let wedge = wedge.map(|f| DVec2::new(f.perp_dot(p), f.perp_dot(q)));
            for quadrant in 0..4 {
                let (sx, sy) = (sign(quadrant & 1), sign(quadrant >> 1));
                (low[contact][quadrant], high[contact][quadrant]) = ratio_bounds(wedge, sx, sy);
            }
        }
        let mut closed = false;
        for octant in 0..8 {
            let (s12, s13, s23) = (octant & 1, (octant >> 1) & 1, octant >> 2);
            let (i, j, k) = (s12 | s13 << 1, s23 | s12 << 1, s13 | s23 << 1);
            // Ratios as (denominator, numerator).
            let low = low[0][i] * low[1][j] * low[2][k];
            let high = high[0][i] * high[1][j] * high[2][k];
            closed |= (low.y < low.x * (1.0 - DEGENERATE)) & (high.y * (1.0 - DEGENERATE) > high.x);
        }
        closed
    }

    /// The two directions in which the boundary of a cone crosses the plane, counterclockwise.
    #[inline(always)]
    fn wedge(&self, contact: usize) -> Option<[DVec2; 2]> {
        let table = &self.sides[contact].edge;
        let last = self.edges - 1;
        let mut below = u32::from(at(table, last)[2] < 0.0);
        let mut crossings = [DVec2::ZERO; 2];
        let (mut ups, mut downs) = (0, 0);
        // The padding's zeros change neither.
        let (mut highest, mut lowest) = (0.0, 0.0);
        for (block, [_, _, row]) in table.iter().enumerate() {
            let mut negative = 0u32;
            for lane in 0..LANES {
                negative |= u32::from(row[lane] < 0.0) << lane;
                highest = if row[lane] > highest {
                    row[lane]
                } else {
                    highest
                };
                lowest = if row[lane] < lowest {
                    row[lane]
                } else {
                    lowest
                };
            }
            let count = LANES.min(self.edges - block * LANES);
            let before = negative << 1 | below;
            let valid = (1 << count) - 1;
            let up = before & !negative & valid;
            let mut changes = (before ^ negative) & valid;
            ups += up.count_ones();
            downs += (changes & !up).count_ones();
            while changes != 0 {
                let lane = changes.trailing_zeros() as usize;
                changes &= changes - 1;
                let to = block * LANES + lane;
                let from = if to == 0 { last } else { to - 1 };
                let ([x0, y0, z0], [x1, y1, z1]) = (at(table, from), at(table, to));
                let (low, high) = (z0.abs(), z1.abs());
                let point = DVec2::new(x0, y0) * high + DVec2::new(x1, y1) * low;
                crossings[usize::from(up >> lane & 1 == 0)] = point / (low + high);
            }
            below = negative >> (count - 1);
        }
        if ups != 1 || downs != 1 || highest <= DEGENERATE || lowest >= -DEGENERATE {
            return None;
        }
        if crossings[0].perp_dot(crossings[1]) < 0.0 {
            crossings.swap(0, 1);
        }
        Some(crossings)
    }
}

fn sign(bit: usize) -> f64 {
    if bit == 0 { 1.0 } else { -1.0 }
}

/// Bounds on |y/x| within a wedge (given by its rays, counterclockwise) and the open quadrant
/// with these signs of x and y, each as (denominator, numerator); where they do not meet, the
/// lower bound is infinite. Without branches: they would be mispredicted.
#[inline(always)]
fn ratio_bounds(wedge: [DVec2; 2], sx: f64, sy: f64) -> (DVec2, DVec2) {
    let flip = DVec2::new(sx, sy);
    let [mut a, mut b] = wedge.map(|ray| ray * flip);
    if sx * sy < 0.0 {
        std::mem::swap(&mut a, &mut b);
    }
    let choose = |one: bool, first: DVec2, second: DVec2| {
        let x = if one { first.x } else { second.x };
        let y = if one { first.y } else { second.y };
        DVec2::new(x, y)
    };
    // The wedge is narrower than π, so a direction d is within it where a × d > 0 and d × b > 0.
    let from_a = (a.x > 0.0) & (a.y >= 0.0);
    let from_x = (a.y < 0.0) & (b.y > 0.0);
    let lower = choose(from_a, a, DVec2::X);
    let to_b = (b.y > 0.0) & (b.x >= 0.0);
    let to_y = (a.x > 0.0) & (b.x < 0.0);
    let upper = choose(to_b, b, DVec2::Y);
    let meet = (from_a | from_x) & (to_b | to_y) & (lower.perp_dot(upper) > 0.0);
    (choose(meet, lower, DVec2::Y), upper)
}
