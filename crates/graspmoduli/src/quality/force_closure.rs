//! Is a grasp of three contacts force closure? Decided in the plane of the contacts, with the error
//! of every sign that is taken.

use super::lanes::{LANES, at};
use super::plane::{Closure, Plane, Three};
use glam::DVec2;

/// The least angle, in radians, that is not taken for rounding; see [`Plane::force_closure`].
const ANGLE: f64 = 1e-10;
/// A ratio this near to 0 or to infinity is looked at with care; see [`Plane::force_closure`].
const NEAR: f64 = 1e-3;
/// More than six ratios away from there change by [`ANGLE`].
const MARGIN: f64 = 1e-6;
/// Edges of cones, by their components out of the plane, that may as well lie in it.
const IN_PLANE: f64 = 1e-7;
/// Friction for which wedges are neither all of a half-plane nor nothing to rounding.
const USUAL_FRICTION: std::ops::RangeInclusive<f64> = 1e-4..=1e4;

impl Plane {
    /// Is the grasp force closure? Sets up the plane of the contacts and their cones' edges in it,
    /// which is left undefined if the answer is no.
    #[inline(always)]
    pub fn closure(&mut self, contacts: Three) -> Closure {
        match self.set_up(contacts) {
            Closure::Yes => self.force_closure(),
            other => other,
        }
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
        let [e12, e13, e23] = self.along();
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
