//! Vertices of P with all three velocities on rays of their cones.

use super::lanes::{
    LANES, Lane, Lanes, Number, Table, at, dot, load, splat_all, splat_each, store, zeros,
};
use super::plane::Plane;
use super::vertex::{Active, Found, LEVEL, Question, SLACK, TIE, TINY, ray};
use glam::DVec2;
use pulp::Simd;
use std::ops::{ControlFlow, Range};

/// What the kernel's rows need, for a block of rays of contact 1 and one of contact 2; see
/// [`Triples::look`] and [`Triples::forms`]. A lane per ray.
#[derive(Debug, Clone, Default)]
struct Forms {
    first: First,
    second: Second,
    /// Per ray of contact 1; lanes over rays of contact 2.
    rows: [Form; LANES],
}

/// What belongs to a ray of contact 1.
#[derive(Debug, Clone, Default)]
struct First {
    a: [Lanes; 6],
    n2: [Lanes; 2],
    scalars: [Lanes; 14],
}

/// What belongs to a ray of contact 2.
#[derive(Debug, Clone, Default)]
struct Second {
    b: [Lanes; 6],
    n1: [Lanes; 2],
    scalars: [Lanes; 8],
}

/// Coefficients of D, N₃ and of the quadratic form ‖D·x‖² − limit·D².
#[derive(Debug, Clone, Copy, Default)]
struct Form {
    d: [Lanes; 2],
    n3: Lanes,
    squares: [Lanes; 6],
    /// Rays of contact 2 that can go with this one of contact 1, as bits.
    open: u32,
}

/// Working memory for candidates on three rays.
#[derive(Debug, Clone)]
pub(super) struct Triples {
    /// Per ray of contacts 1 and 2: components along two sides of the triangle; see
    /// [`Triples::look`].
    pairs: [Table<2>; 2],
    /// Per ray of contact 3: components b, c along two sides and z out of the plane as b, c, b²,
    /// bc, c², bz, cz, z².
    third: Table<8>,
    forms: Forms,
}

impl Triples {
    pub fn new(edges: usize) -> Self {
        Self {
            pairs: [zeros(edges), zeros(edges)],
            third: zeros(edges),
            forms: Forms::default(),
        }
    }

    /// ray–ray–ray: with unit vectors e_ik along the sides, rigidity is
    ///   a₁ρ₁ − a₂ρ₂ = k₁₂,  b₁ρ₁ − b₃ρ₃ = k₁₃,  c₂ρ₂ − c₃ρ₃ = k₂₃,
    /// a_i = e₁₂·ray_i, b_i = e₁₃·ray_i, c_i = e₂₃·ray_i, k_ij = e_ij·(n_j − n_i).
    /// Cramer's rule gives ρ = N/D. D, N₁, N₂ are linear in (b₃, c₃) and N₃ does not depend on
    /// them, so D·x is linear in (b₃, c₃, N₃ z₃), z₃ the component of ray 3 out of the plane, and
    /// ‖D·x‖² − limit·D² is a quadratic form in what belongs to contact 3 alone. Its coefficients
    /// are computed for all rays of contact 2 at once, and so are its values and the signs of ρ with
    /// one ray of contact 3 after the other.
    #[inline(always)]
    pub fn look<S: Simd>(
        &mut self,
        simd: S,
        plane: &Plane,
        question: Question,
        limit: &mut f64,
        found: &mut Found,
    ) -> ControlFlow<()> {
        self.project_rays(plane);
        let blocks = plane.edges.div_ceil(LANES);
        let tie = Self::tie(plane);
        for block1 in 0..blocks {
            for block2 in 0..blocks {
                let mut bar = *limit * (1.0 - tie);
                self.forms(simd, plane, block1, block2, bar);
                let mut row = 0;
                while row < LANES.min(plane.edges - block1 * LANES) {
                    let at = [block1, row, block2];
                    self.row(simd, plane, at, tie, bar, question, limit, found)?;
                    row += 1;
                    // A longer twist found: the rows after this one can refuse more.
                    if *limit * (1.0 - tie) > 2.0 * bar {
                        bar = *limit * (1.0 - tie);
                        self.forms(simd, plane, block1, block2, bar);
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// The rays of contacts 2 and 3 that go with one ray of contact 1; a lane per ray of contact 2.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "inlined: the state of the loop")]
    fn row<S: Simd>(
        &self,
        simd: S,
        plane: &Plane,
        [block1, lane1, block2]: [usize; 3],
        tie: f64,
        bar: f64,
        question: Question,
        limit: &mut f64,
        found: &mut Found,
    ) -> ControlFlow<()> {
        let slack = Lane::splat(simd, -SLACK);
        let minus_tiny = Lane::splat(simd, -TINY * bar);
        let n2 = splat_all(simd, &self.forms.first.n2, lane1);
        for v in 0..LANES / S::F64_LANES {
            let lanes = v * S::F64_LANES..(v + 1) * S::F64_LANES;
            if self.forms.rows[lane1].open >> lanes.start & ((1 << S::F64_LANES) - 1) == 0 {
                continue;
            }
            let form = &self.forms.rows[lane1];
            let d = load(simd, &form.d, v);
            let n1 = load(simd, &self.forms.second.n1, v);
            let [n3] = load(simd, std::array::from_ref(&form.n3), v);
            let q = load(simd, &form.squares, v);
            for j3 in 0..plane.edges {
                let third = &self.third[j3 / LANES];
                let [b, c, bb, bc, cc, bz, cz, zz] = splat_all(simd, third, j3 % LANES);
                let det = d[0].mul_add(b, d[1] * c);
                let first = n1[0].mul_add(b, n1[1] * c).signed_by(det);
                let second = n2[0].mul_add(b, n2[1] * c).signed_by(det);
                let worst = first.min(second).min(n3.signed_by(det));
                let excess = q[0].mul_add(bb, q[1].mul_add(bc, q[2] * cc))
                    + q[3].mul_add(bz, q[4].mul_add(cz, q[5].mul_add(zz, minus_tiny)));
                if worst.any_at_least(slack, excess) {
                    let at = [block1 * LANES + lane1, block2, j3];
                    self.offer_rays(plane, at, lanes.clone(), tie, question, limit, found)?;
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Relative rounding error to allow for in the quadratic forms: they cancel where the
    /// triangle of contacts is low or the centre of mass far.
    #[inline(always)]
    fn tie(plane: &Plane) -> f64 {
        let [first, second, third] = plane.length();
        let longest = first.max(second).max(third);
        let reach = plane.center.length();
        let shape = longest * longest / (first * plane.sides[2].point.y)
            * (1.0 + reach.min(reach / longest));
        (1e-14 * shape * shape).clamp(TIE, 1.0)
    }

    /// k₁₂, k₁₃, k₂₃.
    #[inline(always)]
    fn gaps(plane: &Plane) -> [f64; 3] {
        let [e12, e13, e23] = plane.along();
        let normals = plane.sides.each_ref().map(|side| side.normal);
        let k = |e: DVec2, from: usize, to: usize| e.dot((normals[to] - normals[from]).truncate());
        [k(e12, 0, 1), k(e13, 0, 2), k(e23, 1, 2)]
    }

    /// Fills `pairs` and `third`.
    #[inline(always)]
    fn project_rays(&mut self, plane: &Plane) {
        let [e12, e13, e23] = plane.along();
        for (contact, directions) in [[e12, e13], [e12, e23]].into_iter().enumerate() {
            for (pair, [x, y, _]) in self.pairs[contact]
                .iter_mut()
                .zip(&plane.sides[contact].ray)
            {
                for (out, e) in pair.iter_mut().zip(directions) {
                    for lane in 0..LANES {
                        out[lane] = e.x * x[lane] + e.y * y[lane];
                    }
                }
            }
        }
        for (out, [x, y, z]) in self.third.iter_mut().zip(&plane.sides[2].ray) {
            for lane in 0..LANES {
                let b = e13.x * x[lane] + e13.y * y[lane];
                let c = e23.x * x[lane] + e23.y * y[lane];
                let z = z[lane];
                for (row, value) in [b, c, b * b, b * c, c * c, b * z, c * z, z * z]
                    .into_iter()
                    .enumerate()
                {
                    out[row][lane] = value;
                }
            }
        }
    }

    /// Coefficients that do not depend on the ray of contact 3.
    ///
    /// With X the twist of the normals and A, B, L those of ray 1, ray 2 and a lift of contact 3,
    ///   D·x = D X + N₁ A + N₂ B + N₃ z₃ L = b₃ P + c₃ R + N₃ z₃ L,
    ///   P = c₂ G + a₂ H + t B,  G = a₁X + k₁₂A,  H = k₂₃A,  t = a₁k₂₃,
    ///   R = a₂ G' + u B,  G' = −b₁X − k₁₃A,  u = k₁₂b₁ − a₁k₁₃.
    /// D is b₃c₂a₁ − c₃a₂b₁, so −bar·D² only changes ⟨G, G⟩, ⟨G, G'⟩ and ⟨G', G'⟩.
    #[inline(always)]
    fn forms<S: Simd>(&mut self, simd: S, plane: &Plane, block1: usize, block2: usize, bar: f64) {
        let gaps = Self::gaps(plane);
        let Self {
            pairs,
            forms:
                Forms {
                    first,
                    second,
                    rows,
                },
            ..
        } = &mut *self;
        let velocity = plane.velocity;
        let lift = velocity.lift(2);
        let [n1, n2, n3] = velocity.normal;
        let x = velocity.twist(n1, n2[1], n2[2], n3[2]);
        let xx = Lane::splat(simd, dot(&x, &x));
        let xl = Lane::splat(simd, dot(&x, &lift));
        let lift_squared = Lane::splat(simd, dot(&lift, &lift));
        let x = splat_each(simd, x);
        let lift = splat_each(simd, lift);
        let velocity = velocity.splat(simd);
        let [k12, k13, k23] = splat_each(simd, gaps);
        let limit = Lane::splat(simd, bar);
        let zero = Lane::splat(simd, 0.0);
        let two = Lane::splat(simd, 2.0);
        for v in 0..LANES / S::F64_LANES {
            let [a1, b1] = load(simd, &pairs[0][block1], v);
            let ray1 = load(simd, &plane.sides[0].ray[block1], v);
            let a = velocity.twist(ray1, zero, zero, zero);
            let (xa, aa, al) = (dot(&x, &a), dot(&a, &a), dot(&a, &lift));
            let u = k12 * b1 - a1 * k13;
            // ⟨G, ·⟩ and ⟨G', ·⟩ with X and A.
            let (gx, ga) = (a1 * xx + k12 * xa, a1 * xa + k12 * aa);
            let (hx, ha) = (b1 * xx + k13 * xa, b1 * xa + k13 * aa);
            let scalars = [
                a1,
                zero - b1,
                a1 * k23,
                u,
                b1 * k23,
                a1 * gx + k12 * ga - limit * a1 * a1,
                two * k23 * ga,
                k23 * k23 * aa,
                limit * a1 * b1 - (a1 * hx + k12 * ha),
                zero - k23 * ha,
                b1 * hx + k13 * ha - limit * b1 * b1,
                a1 * xl + k12 * al,
                k23 * al,
                zero - (b1 * xl + k13 * al),
            ];
            store::<S, 6>(&mut first.a, v, a);
            store::<S, 2>(&mut first.n2, v, [a1 * k23, u]);
            store::<S, 14>(&mut first.scalars, v, scalars);

            let [a2, c2] = load(simd, &pairs[1][block2], v);
            let [_, y2, z2] = load(simd, &plane.sides[1].ray[block2], v);
            let b = velocity.twist([zero, zero, zero], y2, z2, zero);
            let scalars = [
                a2,
                c2,
                a2 * a2,
                a2 * c2,
                c2 * c2,
                dot(&x, &b),
                dot(&b, &b),
                dot(&b, &lift),
            ];
            store::<S, 6>(&mut second.b, v, b);
            store::<S, 2>(&mut second.n1, v, [k12 * c2 + k23 * a2, zero - k13 * a2]);
            store::<S, 8>(&mut second.scalars, v, scalars);
        }
        let edges = plane.edges;
        // ρ₁, ρ₂ ≥ 0 solve the first equation only where a₁ or −a₂ has the sign of k₁₂.
        let sign = gaps[0].signum();
        let mut with_any = 0;
        for lane in 0..LANES.min(edges - block2 * LANES) {
            with_any |= 1 << lane;
        }
        let mut with_some = 0;
        for lane in 0..LANES {
            with_some |= u32::from(sign * second.scalars[0][lane] < 0.0) << lane;
        }
        for (lane1, form) in rows.iter_mut().enumerate() {
            let any2 = sign * first.scalars[0][lane1] > 0.0 || gaps[0].abs() < LEVEL;
            form.open = if any2 { with_any } else { with_some & with_any };
            let a = splat_all(simd, &first.a, lane1);
            let [
                a1,
                minus_b1,
                t,
                u,
                b1k23,
                gg,
                gh,
                hh,
                gr,
                hr,
                rr,
                gl,
                hl,
                rl,
            ] = splat_all(simd, &first.scalars, lane1);
            for v in 0..LANES / S::F64_LANES {
                let b = load(simd, &second.b, v);
                let [n11, n12] = load(simd, &second.n1, v);
                let [a2, c2, aa, ac, cc, xb, bb, bl] = load(simd, &second.scalars, v);
                let d = [a1 * c2, minus_b1 * a2];
                let n3 = b1k23.mul_add(a2, u * c2);
                let ab = dot(&a, &b);
                let left = d[0].mul_add(xb, n11 * ab);
                let right = d[1].mul_add(xb, n12 * ab);
                let (tbb, ubb) = (t * bb, u * bb);
                let pp = two.mul_add(left, tbb).mul_add(t, hh * aa);
                let pr = gr.mul_add(ac, hr * aa) + u.mul_add(left, t * (right + ubb));
                let twice = two * n3;
                let squares = [
                    gg.mul_add(cc, gh.mul_add(ac, pp)),
                    two * pr,
                    two.mul_add(right, ubb).mul_add(u, rr * aa),
                    twice * c2.mul_add(gl, a2.mul_add(hl, t * bl)),
                    twice * a2.mul_add(rl, u * bl),
                    n3 * n3 * lift_squared,
                ];
                store::<S, 2>(&mut form.d, v, d);
                store::<S, 1>(std::array::from_mut(&mut form.n3), v, [n3]);
                store::<S, 6>(&mut form.squares, v, squares);
            }
        }
    }

    /// The same tests as in [`Triples::row`], one ray of contact 2 after the other.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "inlined: the state of the loop")]
    fn offer_rays(
        &self,
        plane: &Plane,
        [j1, block2, j3]: [usize; 3],
        lanes: Range<usize>,
        tie: f64,
        question: Question,
        limit: &mut f64,
        found: &mut Found,
    ) -> ControlFlow<()> {
        let lane1 = j1 % LANES;
        let velocity = plane.velocity;
        let normals = plane.sides.each_ref().map(|side| side.normal);
        let (ray1, ray3) = (ray(plane, 0, j1), ray(plane, 2, j3));
        let [b, c, ..] = at(&self.third, j3);
        let along = |row: [f64; 2]| row[0].mul_add(b, row[1] * c);
        let n2 = along(self.forms.first.n2.map(|row| row[lane1]));
        for lane2 in lanes {
            let form = &self.forms.rows[lane1];
            if form.open >> lane2 & 1 == 0 {
                continue;
            }
            let det = along(form.d.map(|row| row[lane2]));
            let n1 = along(self.forms.second.n1.map(|row| row[lane2]));
            let n3 = form.n3[lane2];
            let sign = 1.0_f64.copysign(det);
            if det == 0.0 || [n1, n2, n3].iter().any(|n| n * sign < -SLACK) {
                continue;
            }
            let j2 = block2 * LANES + lane2;
            let ray2 = ray(plane, 1, j2);
            let first = normals[0] + ray1 * (n1 / det);
            let twist = velocity.twist(
                first.to_array(),
                normals[1].y + ray2.y * (n2 / det),
                normals[1].z + ray2.z * (n2 / det),
                normals[2].z + ray3.z * (n3 / det),
            );
            // As in the quadratic form, a vanishing determinant counts as 1e-14.
            if dot(&twist, &twist) * det * det > *limit * (1.0 - tie) * (det * det + TINY) {
                found.offer(plane, twist, Active::Rays([j1, j2, j3]), question, limit)?;
            }
        }
        ControlFlow::Continue(())
    }
}
