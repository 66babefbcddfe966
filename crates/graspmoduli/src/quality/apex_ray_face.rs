//! Vertices of P with one velocity at the apex of its cone, one on a ray and one on a face.

use super::Twist;
use super::lanes::{Lane, dot, load, splat_each, vectors_mut};
use super::plane::{LANES, Lanes};
use super::three_contacts::{Active, Kernel, Question, SLACK, TIE, TINY, at, ray};
use super::velocity::Velocity;
use glam::DVec2;
use pulp::Simd;
use std::ops::ControlFlow;

/// What is left to move when the velocities of two contacts are held; see [`Kernel::hold`].
struct Held {
    apex: usize,
    ray: (usize, usize),
    face: usize,
    /// Planar velocity of the third contact, less its normal.
    offset: DVec2,
    /// The twist with the third contact's normal as its velocity out of the plane, and the one
    /// that lifts it.
    base: Twist,
    lift: Twist,
}

/// [`Held`] for all rays of a contact: whether ρ ≥ 0, the offset, ‖base‖² and 2⟨base, lift⟩.
#[derive(Debug, Clone, Default)]
struct Holds {
    sign: Lanes,
    offset: [Lanes; 2],
    square: Lanes,
    mixed: Lanes,
}

impl Kernel {
    /// apex–ray–face: y_i = n_i, y_k = n_k + ρ ray_kj with ρ from the rigidity of the pair; these
    /// two fix the planar velocity of contact m, and y_m − n_m = α ray_mj' + β ray_m,j'+1 follows
    /// from its two planar components; a lane per face of contact m.
    #[inline(always)]
    pub(super) fn apexes<S: Simd>(
        &mut self,
        simd: S,
        question: Question,
        limit: &mut f64,
    ) -> ControlFlow<()> {
        let edges = self.plane.edges;
        let blocks = edges.div_ceil(LANES);
        let slack = Lane::splat(simd, -SLACK);
        let velocity = Velocity::new(&self.plane);
        let mut holds = Holds::default();
        for face in 0..3 {
            let lift = velocity.lift(face);
            let lift_squared = Lane::splat(simd, dot(&lift, &lift));
            let (left, right) = ((face + 1) % 3, (face + 2) % 3);
            for (apex, other) in [(left, right), (right, left)] {
                for held_block in 0..blocks {
                    self.hold_all(simd, &mut holds, [apex, other, face], held_block);
                    for lane in 0..LANES.min(edges - held_block * LANES) {
                        // A ray at right angles to the side gives infinities, which `offer`
                        // refuses.
                        if holds.sign[lane] < -SLACK {
                            continue;
                        }
                        let wx = Lane::splat(simd, holds.offset[0][lane]);
                        let wy = Lane::splat(simd, holds.offset[1][lane]);
                        let mixed = Lane::splat(simd, holds.mixed[lane]);
                        for block in 0..blocks {
                            let bar = *limit * (1.0 - TIE);
                            let square = Lane::splat(simd, holds.square[lane] - bar);
                            let tiny = Lane::splat(simd, TINY * bar);
                            let mut any = false;
                            for v in 0..LANES / S::F64_LANES {
                                let [x, y, z] = load(simd, &self.plane.sides[face].ray, block, v);
                                let [next_x, next_y, next_z, scale] =
                                    load(simd, &self.faces[face], block, v);
                                let alpha = wx * next_y - wy * next_x;
                                let beta = wy * x - wx * y;
                                let rise = alpha * z + beta * next_z;
                                let worst = alpha.signed_by(scale).min(beta.signed_by(scale));
                                let excess = (square * scale + mixed * rise) * scale
                                    + lift_squared * rise * rise
                                    - tiny;
                                any |= worst.any_at_least(slack, excess);
                            }
                            if any {
                                let ray = (other, held_block * LANES + lane);
                                let held = self.hold(apex, ray, face);
                                self.offer_faces(&held, block, question, limit)?;
                            }
                        }
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Fills `faces`: of each contact, rays j + 1 and their cross products with rays j.
    #[inline(always)]
    pub(super) fn project_faces(&mut self) {
        let edges = self.plane.edges;
        for (side, faces) in self.plane.sides.iter().zip(&mut self.faces) {
            for j in 0..edges {
                let (block, lane) = (j / LANES, j % LANES);
                for axis in 0..3 {
                    faces[axis][block][lane] = at(&side.ray[axis], (j + 1) % edges);
                }
            }
            let [next_x, next_y, _, cross] = faces;
            for block in 0..cross.len() {
                let (x, y) = (&side.ray[0][block], &side.ray[1][block]);
                for lane in 0..LANES {
                    cross[block][lane] =
                        x[lane] * next_y[block][lane] - y[lane] * next_x[block][lane];
                }
            }
        }
    }

    /// [`Kernel::hold`] for a block of rays of contact `other`.
    #[inline(always)]
    fn hold_all<S: Simd>(
        &self,
        simd: S,
        holds: &mut Holds,
        [apex, other, face]: [usize; 3],
        block: usize,
    ) {
        let sides = &self.plane.sides;
        let offset = sides[other].point - sides[apex].point;
        let distance = offset.length();
        let along = offset / distance;
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
        let velocity = Velocity::new(&self.plane);
        let lift = splat_each(simd, velocity.lift(face));
        let velocity = velocity.splat(simd);
        let two = Lane::splat(simd, 2.0);
        for v in 0..LANES / S::F64_LANES {
            let [x, y, z] = load(simd, &sides[other].ray, block, v);
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
            let rows = [
                (&mut holds.sign, gap * slope),
                (&mut holds.square, dot(&base, &base)),
                (&mut holds.mixed, two * dot(&base, &lift)),
            ];
            for (row, value) in rows {
                vectors_mut::<S>(row)[v] = value.value;
            }
            vectors_mut::<S>(&mut holds.offset[0])[v] = (rest_x - ly * spin).value;
            vectors_mut::<S>(&mut holds.offset[1])[v] = (rest_y + lx * spin).value;
        }
    }

    /// The motions left when y of contact `apex` is at the apex and that of another on a ray.
    #[inline(always)]
    fn hold(&self, apex: usize, (other, j): (usize, usize), face: usize) -> Held {
        let sides = &self.plane.sides;
        let offset = sides[other].point - sides[apex].point;
        let distance = offset.length();
        let along = offset / distance;
        let fixed = sides[apex].normal.truncate();
        let gap = along.dot(fixed - sides[other].normal.truncate());
        let direction = ray(&self.plane, other, j);
        let slope = along.dot(direction.truncate());
        let moved = sides[other].normal + direction * (gap / slope);
        let spin = along.perp_dot(moved.truncate() - fixed) / distance;
        let lever = sides[face].point - sides[apex].point;
        let mut heights = sides.each_ref().map(|side| side.normal.z);
        heights[other] = moved.z;
        let origin = fixed - sides[apex].point.perp() * spin;
        let velocity = Velocity::new(&self.plane);
        Held {
            apex,
            ray: (other, j),
            face,
            offset: fixed + lever.perp() * spin - sides[face].normal.truncate(),
            base: velocity.rigid(origin.to_array(), spin, heights),
            lift: velocity.lift(face),
        }
    }

    /// The same tests as in [`Kernel::apexes`], one face after the other.
    #[inline(always)]
    fn offer_faces(
        &mut self,
        held: &Held,
        block: usize,
        question: Question,
        limit: &mut f64,
    ) -> ControlFlow<()> {
        let edges = self.plane.edges;
        for j in block * LANES..edges.min((block + 1) * LANES) {
            let here = ray(&self.plane, held.face, j);
            let next = ray(&self.plane, held.face, (j + 1) % edges);
            let scale = here.truncate().perp_dot(next.truncate());
            let sign = 1.0_f64.copysign(scale);
            let alpha = held.offset.perp_dot(next.truncate());
            let beta = here.truncate().perp_dot(held.offset);
            if scale == 0.0 || alpha * sign < -SLACK || beta * sign < -SLACK {
                continue;
            }
            let rise = (alpha * here.z + beta * next.z) / scale;
            let twist = std::array::from_fn(|i| held.base[i] + held.lift[i] * rise);
            let active = Active::Apex {
                apex: held.apex,
                ray: held.ray,
                face: (held.face, j),
            };
            if dot(&twist, &twist) > *limit * (1.0 - TIE) {
                self.offer(twist, active, question, limit)?;
            }
        }
        ControlFlow::Continue(())
    }
}
