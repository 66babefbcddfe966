//! Three contacts seen from the plane through them, and the planar force-closure test.
//!
//! In the contact plane the first contact is the origin, the second lies on the x axis and the
//! third above it. Equilibrium forces of three points lie in this plane, and the rigidity of
//! three velocities concerns only their components in it, so both the test and the kernel are
//! planar problems.

use crate::contact::{Contact, Frame, FrictionCone};
use glam::{DMat3, DVec2, DVec3};

pub(super) const LANES: usize = 8;
/// A row of numbers, one per ray or edge of a cone, in a vector register's worth of lanes.
pub(super) type Lanes = [f64; LANES];

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
    pub edge: [Vec<Lanes>; 3],
    /// The same for the rays of the polar cone.
    pub ray: [Vec<Lanes>; 3],
}

impl Side {
    fn new(edges: usize) -> Self {
        let zeros = vec![[0.0; LANES]; edges.div_ceil(LANES)];
        let three = || [zeros.clone(), zeros.clone(), zeros.clone()];
        Self {
            edge: three(),
            ray: three(),
            ..Self::default()
        }
    }

    /// Component `axis` of `table` turned by the contact frame, plus `height` along the normal.
    #[inline(always)]
    fn turn(&mut self, table: &Padded, is_ray: bool) {
        let rows = if is_ray {
            &mut self.ray
        } else {
            &mut self.edge
        };
        for axis in 0..3 {
            let (a, b, c) = (
                self.tangents[0][axis],
                self.tangents[1][axis],
                self.normal[axis],
            );
            for (row, (x, (y, z))) in rows[axis]
                .iter_mut()
                .zip(table.x.iter().zip(table.y.iter().zip(&table.z)))
            {
                for lane in 0..LANES {
                    row[lane] = a * x[lane] + b * y[lane] + c * z[lane];
                }
            }
        }
    }
}

/// Vectors about e₃, padded to whole lanes.
#[derive(Debug, Clone)]
struct Padded {
    x: Vec<Lanes>,
    y: Vec<Lanes>,
    z: Vec<Lanes>,
}

impl Padded {
    fn new(vectors: &[[f64; 2]], height: f64) -> Self {
        let pad = |value: &dyn Fn(&[f64; 2]) -> f64| {
            vectors
                .chunks(LANES)
                .map(|chunk| std::array::from_fn(|lane| chunk.get(lane).map_or(0.0, value)))
                .collect()
        };
        Self {
            x: pad(&|v| v[0]),
            y: pad(&|v| v[1]),
            z: pad(&|_| height),
        }
    }
}

/// Working memory for grasps of three contacts with one kind of friction cone.
#[derive(Debug, Clone)]
pub(super) struct Plane {
    pub edges: usize,
    friction: f64,
    edge_table: Padded,
    ray_table: Padded,
    /// Columns: the plane's axes in the object frame.
    pub basis: DMat3,
    /// Centre of mass in the frame of the plane.
    pub center: DVec3,
    pub sides: [Side; 3],
    /// Unit vectors along the triangle's sides 12, 13, 23, and their lengths.
    pub along: [DVec2; 3],
    pub length: [f64; 3],
}

impl Plane {
    pub fn new(cone: &FrictionCone) -> Self {
        Self {
            edges: cone.len(),
            friction: cone.friction(),
            edge_table: Padded::new(&cone.edges, 1.0),
            ray_table: Padded::new(&cone.rays, cone.ray_height),
            basis: DMat3::IDENTITY,
            center: DVec3::ZERO,
            sides: std::array::from_fn(|_| Side::new(cone.len())),
            along: [DVec2::ZERO; 3],
            length: [0.0; 3],
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
        // The circular cone reaches to both sides where |n·z| < μ √(1 − (n·z)²); the polygonal
        // one lies within it. Half of all grasps end here.
        let steepest = self.friction / (1.0 + self.friction * self.friction).sqrt();
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
        let coordinates: [&dyn Fn(DVec2) -> DVec2; 3] = [
            &|f| DVec2::new(f.perp_dot(e13), e12.perp_dot(f)),
            &|f| DVec2::new(e12.perp_dot(f), -f.perp_dot(e23)),
            &|f| DVec2::new(-f.perp_dot(e23), -e13.perp_dot(f)),
        ];
        let mut bounds = [[None; 4]; 3];
        for contact in 0..3 {
            let Some(wedge) = self.wedge(contact) else {
                return false;
            };
            let wedge = wedge.map(coordinates[contact]);
            for (quadrant, slot) in bounds[contact].iter_mut().enumerate() {
                *slot = ratio_bounds(wedge, sign(quadrant & 1), sign(quadrant >> 1));
            }
        }
        (0..8).any(|octant| {
            let (s12, s13, s23) = (octant & 1, (octant >> 1) & 1, octant >> 2);
            let quadrants = [s12 | s13 << 1, s23 | s12 << 1, s13 | s23 << 1];
            let mut low = DVec2::ONE;
            let mut high = DVec2::ONE;
            for (contact, quadrant) in quadrants.into_iter().enumerate() {
                let Some((lower, upper)) = bounds[contact][quadrant] else {
                    return false;
                };
                low *= lower;
                high *= upper;
            }
            // Ratios as (denominator, numerator).
            low.y < low.x * (1.0 - DEGENERATE) && high.y * (1.0 - DEGENERATE) > high.x
        })
    }

    /// The two directions in which the boundary of a cone crosses the plane, counterclockwise.
    #[inline(always)]
    fn wedge(&self, contact: usize) -> Option<[DVec2; 2]> {
        let [xs, ys, zs] = self.sides[contact]
            .edge
            .each_ref()
            .map(|v| v.as_flattened());
        let mut crossings = [DVec2::ZERO; 2];
        let (mut ups, mut downs) = (0, 0);
        let mut from = self.edges - 1;
        for to in 0..self.edges {
            let (low, high) = (zs[from], zs[to]);
            let up = low < 0.0 && high >= 0.0;
            if up || (low >= 0.0 && high < 0.0) {
                let point = DVec2::new(xs[from], ys[from]) * high.abs()
                    + DVec2::new(xs[to], ys[to]) * low.abs();
                crossings[usize::from(!up)] = point / (low.abs() + high.abs());
                ups += usize::from(up);
                downs += usize::from(!up);
            }
            from = to;
        }
        let highest = zs[..self.edges]
            .iter()
            .fold(f64::NEG_INFINITY, |a, &b| a.max(b));
        let lowest = zs[..self.edges]
            .iter()
            .fold(f64::INFINITY, |a, &b| a.min(b));
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
/// with these signs of x and y, each as (denominator, numerator); `None` where they do not meet.
#[inline(always)]
fn ratio_bounds(wedge: [DVec2; 2], sx: f64, sy: f64) -> Option<(DVec2, DVec2)> {
    let flip = DVec2::new(sx, sy);
    let [mut a, mut b] = wedge.map(|ray| ray * flip);
    if sx * sy < 0.0 {
        std::mem::swap(&mut a, &mut b);
    }
    // The wedge is narrower than π, so a direction d is within it where a × d > 0 and d × b > 0.
    let lower = if a.x > 0.0 && a.y >= 0.0 {
        a
    } else if a.y < 0.0 && b.y > 0.0 {
        DVec2::X
    } else {
        return None;
    };
    let upper = if b.y > 0.0 && b.x >= 0.0 {
        b
    } else if a.x > 0.0 && b.x < 0.0 {
        DVec2::Y
    } else {
        return None;
    };
    (lower.perp_dot(upper) > 0.0).then_some((lower, upper))
}
