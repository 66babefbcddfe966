//! Vertices of P with one velocity at the apex of its cone, one on a ray and one on a face.

use super::lanes::{LANES, Lane, Lanes, Number, at, dot, load, splat_each, store};
use super::plane::Plane;
use super::r6::Twist;
use super::vertex::{Active, Found, LEVEL, Question, SLACK, TIE, ray};
use glam::DVec2;
use pulp::Simd;
use std::ops::ControlFlow;

/// Which contact is at the apex, which on a ray, which on a face.
const ROLES: [[usize; 3]; 6] = [
    [0, 1, 2],
    [1, 0, 2],
    [0, 2, 1],
    [2, 0, 1],
    [1, 2, 0],
    [2, 1, 0],
];
/// Edges of one contact as bounds on the height h of y − n over its planar part w: from above or
/// below, h = ⟨slope, w⟩.
#[derive(Debug, Clone, Default)]
struct Bounds {
    above: Vec<(DVec2, usize)>,
    below: Vec<(DVec2, usize)>,
}

impl Bounds {
    fn new(edges: usize) -> Self {
        Self {
            above: Vec::with_capacity(edges),
            below: Vec::with_capacity(edges),
        }
    }
}

/// Fills the bounds of each contact: ⟨f, (w, h)⟩ ≤ 0 solved for h.
#[inline(always)]
fn set_bounds(plane: &Plane, bounds: &mut [Bounds; 3]) {
    for (side, bounds) in plane.sides.iter().zip(bounds) {
        bounds.above.clear();
        bounds.below.clear();
        for j in 0..plane.edges {
            let [x, y, z] = at(&side.edge, j);
            let slope = DVec2::new(x, y) * (-1.0 / z);
            if z > LEVEL {
                bounds.above.push((slope, j));
            } else if z < -LEVEL {
                bounds.below.push((slope, j));
            }
        }
    }
}

/// The motions that are left when y of one contact is at the apex and that of another on a ray.
struct Held {
    /// Planar velocity of the third contact, less its normal.
    offset: DVec2,
    /// The twist with the third contact's normal as its velocity out of the plane.
    base: Twist,
}

/// Working memory for candidates with an apex.
#[derive(Debug, Clone)]
pub(super) struct Apexes {
    bounds: [Bounds; 3],
    /// ‖x‖² of candidates; see [`Apexes::look`].
    squares: Vec<Lanes>,
}

impl Apexes {
    pub fn new(edges: usize) -> Self {
        Self {
            bounds: std::array::from_fn(|_| Bounds::new(edges)),
            squares: vec![Lanes::default(); 12 * edges.div_ceil(LANES)],
        }
    }

    /// apex–ray–face: y_i = n_i, y_k = n_k + ρ ray_kj with ρ from the rigidity of the pair; these
    /// two fix the planar velocity w of contact m. Over w the polar cone of m is an interval of
    /// heights, and its ends are the vertices. A lane per ray of contact k.
    #[inline(always)]
    pub fn look<S: Simd>(
        &mut self,
        simd: S,
        plane: &Plane,
        question: Question,
        limit: &mut f64,
        found: &mut Found,
    ) -> ControlFlow<()> {
        set_bounds(plane, &mut self.bounds);
        let blocks = plane.edges.div_ceil(LANES);
        for (roles, index) in ROLES.into_iter().zip(0..) {
            for block in 0..blocks {
                let row = 2 * (index * blocks + block);
                self.heights(simd, plane, roles, block, row);
            }
        }
        if let Question::All(..) = question {
            for row in 0..self.squares.len() {
                for lane in 0..LANES {
                    if self.squares[row][lane] > *limit * (1.0 - TIE) {
                        self.offer_end(plane, row, lane, question, limit, found)?;
                    }
                }
            }
            return ControlFlow::Continue(());
        }
        // The longest first: it leaves little to do for the others.
        loop {
            let longest = self.longest_square(simd);
            if longest <= *limit * (1.0 - TIE) {
                return ControlFlow::Continue(());
            }
            let place = self.squares.iter().enumerate().find_map(|(row, squares)| {
                let lane = squares.iter().position(|&square| square == longest)?;
                Some((row, lane))
            });
            let Some((row, lane)) = place else {
                return ControlFlow::Continue(());
            };
            self.squares[row][lane] = 0.0;
            self.offer_end(plane, row, lane, question, limit, found)?;
        }
    }

    /// The greatest of `squares`.
    #[inline(always)]
    fn longest_square<S: Simd>(&self, simd: S) -> f64 {
        let mut greatest = [Lanes::default()];
        for v in 0..LANES / S::F64_LANES {
            let mut longest = Lane::splat(simd, 0.0);
            for row in &self.squares {
                let [squares] = load(simd, std::array::from_ref(row), v);
                longest = longest.max(squares);
            }
            store::<S, 1>(&mut greatest, v, [longest]);
        }
        let [a, b, c, d, e, f, g, h] = greatest[0].0;
        a.max(b).max(c.max(d)).max(e.max(f).max(g.max(h)))
    }

    /// ‖x‖² at the ends of the interval of heights above each ray of a block: two rows of
    /// `squares`, zero where there is no such vertex.
    #[inline(always)]
    fn heights<S: Simd>(
        &mut self,
        simd: S,
        plane: &Plane,
        [apex, other, face]: [usize; 3],
        block: usize,
        row: usize,
    ) {
        let sides = &plane.sides;
        let (along, distance) = plane.way(apex, other);
        let fixed = sides[apex].normal.truncate();
        let gap = Lane::splat(simd, along.dot(fixed - sides[other].normal.truncate()));
        let lever = sides[face].point - sides[apex].point;
        let rest = fixed - sides[face].normal.truncate();
        let [ax, ay] = splat_each(simd, along.to_array());
        let turn = splat_each(simd, (along / distance).to_array());
        let [fx, fy] = splat_each(simd, fixed.to_array());
        let [px, py] = splat_each(simd, sides[apex].point.to_array());
        let [lx, ly] = splat_each(simd, lever.to_array());
        let [rest_x, rest_y] = splat_each(simd, rest.to_array());
        let normal = splat_each(simd, sides[other].normal.to_array());
        let velocity = plane.velocity;
        let lift = velocity.lift(face);
        let lift_squared = Lane::splat(simd, dot(&lift, &lift));
        let lift = splat_each(simd, lift);
        let velocity = velocity.splat(simd);
        let slack = Lane::splat(simd, -SLACK);
        let zero = Lane::splat(simd, 0.0);
        let two = Lane::splat(simd, 2.0);
        for v in 0..LANES / S::F64_LANES {
            let [x, y, z] = load(simd, &sides[other].ray[block], v);
            let slope = ax * x + ay * y;
            let rho = gap / slope;
            let moved_z = normal[2] + z * rho;
            let spin = turn[0] * (normal[1] + y * rho - fy) - turn[1] * (normal[0] + x * rho - fx);
            let mut heights = [
                velocity.normal[0][2],
                velocity.normal[1][2],
                velocity.normal[2][2],
            ];
            heights[other] = moved_z;
            let base = velocity.rigid([fx + py * spin, fy - px * spin], spin, heights);
            let (wx, wy) = (rest_x - ly * spin, rest_y + lx * spin);
            let bounds = &self.bounds[face];
            let mut top = Lane::splat(simd, f64::MAX);
            for (slope, _) in &bounds.above {
                let [sx, sy] = splat_each(simd, slope.to_array());
                top = top.min(sx.mul_add(wx, sy * wy));
            }
            let mut bottom = Lane::splat(simd, f64::MIN);
            for (slope, _) in &bounds.below {
                let [sx, sy] = splat_each(simd, slope.to_array());
                bottom = bottom.max(sx.mul_add(wx, sy * wy));
            }
            // An interval that is empty by no more than rounding is a ray.
            let room = top - bottom + (top.abs() + bottom.abs()) * Lane::splat(simd, 1e-13);
            let square = dot(&base, &base);
            let mixed = two * dot(&base, &lift);
            for (end, height) in [top, bottom].into_iter().enumerate() {
                let length = height.mul_add(height.mul_add(lift_squared, mixed), square);
                let length = length
                    .where_at_least(gap * slope, slack)
                    .where_at_least(room, zero)
                    .where_at_least(length, zero);
                store::<S, 1>(
                    std::array::from_mut(&mut self.squares[row + end]),
                    v,
                    [length],
                );
            }
        }
    }

    /// The motions left when y of contact `apex` is at the apex and that of another on a ray.
    #[inline(always)]
    fn hold(plane: &Plane, [apex, other, face]: [usize; 3], j: usize) -> Held {
        let sides = &plane.sides;
        let (along, distance) = plane.way(apex, other);
        let fixed = sides[apex].normal.truncate();
        let gap = along.dot(fixed - sides[other].normal.truncate());
        let direction = ray(plane, other, j);
        let slope = along.dot(direction.truncate());
        let moved = sides[other].normal + direction * (gap / slope);
        let spin = along.perp_dot(moved.truncate() - fixed) / distance;
        let lever = sides[face].point - sides[apex].point;
        let mut heights = sides.each_ref().map(|side| side.normal.z);
        heights[other] = moved.z;
        let origin = fixed - sides[apex].point.perp() * spin;
        let velocity = plane.velocity;
        Held {
            offset: fixed + lever.perp() * spin - sides[face].normal.truncate(),
            base: velocity.rigid(origin.to_array(), spin, heights),
        }
    }

    /// The candidate of one of `squares`, computed as in [`Apexes::heights`].
    #[inline(always)]
    fn offer_end(
        &self,
        plane: &Plane,
        row: usize,
        lane: usize,
        question: Question,
        limit: &mut f64,
        found: &mut Found,
    ) -> ControlFlow<()> {
        let blocks = plane.edges.div_ceil(LANES);
        let roles = ROLES[row / (2 * blocks)];
        let j = row / 2 % blocks * LANES + lane;
        let top = row.is_multiple_of(2);
        let [apex, other, face] = roles;
        let held = Self::hold(plane, roles, j);
        let bounds = &self.bounds[face];
        let (edges, sign) = if top {
            (&bounds.above, 1.0)
        } else {
            (&bounds.below, -1.0)
        };
        let (mut rise, mut edge) = (f64::INFINITY, 0);
        for (slope, j) in edges {
            let height = sign * slope.dot(held.offset);
            if height < rise {
                (rise, edge) = (height, *j);
            }
        }
        let lift = plane.velocity.lift(face);
        let twist = std::array::from_fn(|i| held.base[i] + lift[i] * (sign * rise));
        let active = Active::Apex {
            apex,
            ray: (other, j),
            edge: (face, edge),
        };
        found.offer(plane, twist, active, question, limit)
    }
}
