//! Three contacts seen from the plane through them.
//!
//! In the contact plane the first contact is the origin, the second lies on the x axis and the
//! third above it. Equilibrium forces of three points lie in this plane, and the rigidity of
//! three velocities concerns only their components in it, so both the force-closure test
//! and the kernel are planar problems.

use super::lanes::{LANES, Table, greatest, padded, zeros};
use super::velocity::Velocity;
use crate::contact::{Contact, Frame, FrictionCone};
use glam::{DMat3, DVec2, DVec3};

/// Triangles flatter than this (twice the area over the longest side's square) have no plane that
/// is known well enough.
const FLAT: f64 = 1e-5;
/// Added to the squared sine of a cone's half angle before a normal counts as too steep.
const STEEP: f64 = 1e-9;
/// The contacts of a grasp, in the order in which they are looked at.
pub(super) type Three<'a> = [&'a Contact; 3];

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

/// Working memory for grasps of three contacts with friction cones of one number of edges.
#[derive(Debug, Clone)]
pub(super) struct Plane {
    pub edges: usize,
    pub frictions: [f64; 3],
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
    pub rounding: f64,
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

    /// `Yes` if there is a plane and each cone may reach to both of its sides.
    #[inline(always)]
    pub fn set_up(&mut self, contacts: Three) -> Closure {
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
    pub fn set_up_rays(&mut self, contacts: Three, center_of_mass: DVec3) {
        self.center = self
            .basis
            .transpose()
            .mul_vec3(center_of_mass - contacts[0].point);
        for (side, table) in self.sides.iter_mut().zip(&self.ray_tables) {
            side.turn(table, true);
        }
        let third = self.sides[2].point;
        let normals = self.sides.each_ref().map(|side| side.normal);
        self.velocity = Velocity::new(normals, self.length[0], third, self.center);
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
}
