//! Vertices of P with all three velocities on rays of their cones.

use super::lanes::{Lane, dot, load, splat_all, splat_each, vectors_mut};
use super::plane::{LANES, Lanes};
use super::three_contacts::{Active, Kernel, Question, SLACK, TIE, TINY, at, ray};
use super::velocity::Velocity;
use glam::DVec2;
use pulp::Simd;
use std::ops::ControlFlow;

/// Coefficients of D, N₁, N₃ and of the quadratic form ‖D·x‖² − limit·D²; a lane per ray of
/// contact 2. See [`Kernel::rays`].
#[derive(Debug, Clone, Default)]
struct Form {
    d: [Lanes; 2],
    n1: [Lanes; 2],
    n3: Lanes,
    squares: [Lanes; 6],
}

impl Kernel {
    /// ray–ray–ray: with unit vectors e_ik along the sides, rigidity is
    ///   a₁ρ₁ − a₂ρ₂ = k₁₂,  b₁ρ₁ − b₃ρ₃ = k₁₃,  c₂ρ₂ − c₃ρ₃ = k₂₃,
    /// a_i = e₁₂·ray_i, b_i = e₁₃·ray_i, c_i = e₂₃·ray_i, k_ij = e_ij·(n_j − n_i).
    /// Cramer's rule gives ρ = N/D. D, N₁, N₂ are linear in (b₃, c₃) and N₃ does not depend on
    /// them, so D·x is linear in (b₃, c₃, N₃ z₃), z₃ the component of ray 3 out of the plane, and
    /// ‖D·x‖² − limit·D² is a quadratic form in what belongs to contact 3 alone. Its coefficients
    /// are computed for all rays of contact 2 at once; its values, and the signs of ρ, for all
    /// rays of contact 3 at once.
    #[inline(always)]
    pub(super) fn rays<S: Simd>(
        &mut self,
        simd: S,
        question: Question,
        limit: &mut f64,
    ) -> ControlFlow<()> {
        let k = self.gaps();
        self.project_rays();
        let edges = self.plane.edges;
        let blocks = edges.div_ceil(LANES);
        let slack = Lane::splat(simd, -SLACK);
        let mut form = Form::default();
        for j1 in 0..edges {
            for block2 in 0..blocks {
                let bar = *limit * (1.0 - TIE);
                self.form(simd, &mut form, j1, block2, k, bar);
                let [a1, b1] = self.pairs[0].each_ref().map(|row| at(row, j1));
                let n2 = [a1 * k[2], k[0] * b1 - a1 * k[1]];
                let n2_lanes = [Lane::splat(simd, n2[0]), Lane::splat(simd, n2[1])];
                let tiny = Lane::splat(simd, TINY * bar);
                for lane2 in 0..LANES.min(edges - block2 * LANES) {
                    let d = splat_all(simd, &form.d, lane2);
                    let n1 = splat_all(simd, &form.n1, lane2);
                    let n3 = Lane::splat(simd, form.n3[lane2]);
                    let q = splat_all(simd, &form.squares, lane2);
                    for block3 in 0..blocks {
                        let mut any = false;
                        for v in 0..LANES / S::F64_LANES {
                            let [b, c] = load(simd, &self.pairs[2], block3, v);
                            let p = load(simd, &self.products, block3, v);
                            let det = d[0] * b + d[1] * c;
                            let first = (n1[0] * b + n1[1] * c).signed_by(det);
                            let second = (n2_lanes[0] * b + n2_lanes[1] * c).signed_by(det);
                            let worst = first.min(second).min(n3.signed_by(det));
                            let excess = ((q[0] * p[0] + q[1] * p[1])
                                + (q[2] * p[2] + q[3] * p[3]))
                                + ((q[4] * p[4] + q[5] * p[5]) - tiny);
                            any |= worst.any_at_least(slack, excess);
                        }
                        if any {
                            let at = [j1, block2 * LANES + lane2, block3];
                            self.offer_rays(&form, n2, at, question, limit)?;
                        }
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// k₁₂, k₁₃, k₂₃.
    #[inline(always)]
    fn gaps(&self) -> [f64; 3] {
        let [e12, e13, e23] = self.plane.along;
        let normals = self.plane.sides.each_ref().map(|side| side.normal);
        let k = |e: DVec2, from: usize, to: usize| e.dot((normals[to] - normals[from]).truncate());
        [k(e12, 0, 1), k(e13, 0, 2), k(e23, 1, 2)]
    }

    /// Fills `pairs` and `products`.
    #[inline(always)]
    fn project_rays(&mut self) {
        let [e12, e13, e23] = self.plane.along;
        for (contact, directions) in [[e12, e13], [e12, e23], [e13, e23]].into_iter().enumerate() {
            let [x, y, _] = &self.plane.sides[contact].ray;
            for (pair, e) in self.pairs[contact].iter_mut().zip(directions) {
                for (out, (x, y)) in pair.iter_mut().zip(x.iter().zip(y)) {
                    for lane in 0..LANES {
                        out[lane] = e.x * x[lane] + e.y * y[lane];
                    }
                }
            }
        }
        for block in 0..self.products[0].len() {
            let [b, c] = self.pairs[2].each_ref().map(|rows| rows[block]);
            let z = self.plane.sides[2].ray[2][block];
            let rows = [(b, b), (b, c), (c, c), (b, z), (c, z), (z, z)];
            for (products, (left, right)) in self.products.iter_mut().zip(rows) {
                for lane in 0..LANES {
                    products[block][lane] = left[lane] * right[lane];
                }
            }
        }
    }

    /// The coefficients that do not depend on the ray of contact 3.
    #[inline(always)]
    fn form<S: Simd>(
        &self,
        simd: S,
        form: &mut Form,
        j1: usize,
        block2: usize,
        [k12, k13, k23]: [f64; 3],
        bar: f64,
    ) {
        let splat = |x: f64| Lane::splat(simd, x);
        let velocity = Velocity::new(&self.plane);
        let lift = velocity.lift(2);
        let lift_squared = splat(dot(&lift, &lift));
        let lift = splat_each(simd, lift);
        let velocity = velocity.splat(simd);
        let (a1, b1) = (at(&self.pairs[0][0], j1), at(&self.pairs[0][1], j1));
        let ray1 = splat_each(simd, ray(&self.plane, 0, j1).to_array());
        let n2 = [splat(a1 * k23), splat(k12 * b1 - a1 * k13)];
        let third = splat(k12 * b1 - k13 * a1);
        let (a1, b1, b1k23) = (splat(a1), splat(-b1), splat(b1 * k23));
        let (k12, k13, k23) = (splat(k12), splat(-k13), splat(k23));
        let (bar, two) = (splat(bar), splat(2.0));
        for v in 0..LANES / S::F64_LANES {
            let [a2, c2] = load(simd, &self.pairs[1], block2, v);
            let [_, y2, z2] = load(simd, &self.plane.sides[1].ray, block2, v);
            let d = [a1 * c2, b1 * a2];
            let n1 = [k12 * c2 + k23 * a2, k13 * a2];
            let n3 = b1k23 * a2 + third * c2;
            let x = velocity.scaled(d[0], ray1, n1[0], [y2, z2], n2[0]);
            let y = velocity.scaled(d[1], ray1, n1[1], [y2, z2], n2[1]);
            let twice = two * n3;
            let rows = [
                dot(&x, &x) - bar * d[0] * d[0],
                two * (dot(&x, &y) - bar * d[0] * d[1]),
                dot(&y, &y) - bar * d[1] * d[1],
                twice * dot(&x, &lift),
                twice * dot(&y, &lift),
                n3 * n3 * lift_squared,
            ];
            for h in 0..2 {
                vectors_mut::<S>(&mut form.d[h])[v] = d[h].value;
                vectors_mut::<S>(&mut form.n1[h])[v] = n1[h].value;
            }
            vectors_mut::<S>(&mut form.n3)[v] = n3.value;
            for row in 0..6 {
                vectors_mut::<S>(&mut form.squares[row])[v] = rows[row].value;
            }
        }
    }

    /// The same tests as in [`Kernel::rays`], one ray of contact 3 after the other.
    #[inline(always)]
    fn offer_rays(
        &mut self,
        form: &Form,
        n2: [f64; 2],
        [j1, j2, block3]: [usize; 3],
        question: Question,
        limit: &mut f64,
    ) -> ControlFlow<()> {
        let lane2 = j2 % LANES;
        let velocity = Velocity::new(&self.plane);
        let normals = self.plane.sides.each_ref().map(|side| side.normal);
        let (ray1, ray2) = (ray(&self.plane, 0, j1), ray(&self.plane, 1, j2));
        let n3 = form.n3[lane2];
        for j3 in block3 * LANES..self.plane.edges.min((block3 + 1) * LANES) {
            let [b, c] = self.pairs[2].each_ref().map(|row| at(row, j3));
            let along = |row: [f64; 2]| row[0] * b + row[1] * c;
            let det = along(form.d.map(|row| row[lane2]));
            let n1 = along(form.n1.map(|row| row[lane2]));
            let n2 = along(n2);
            let sign = 1.0_f64.copysign(det);
            if det == 0.0 || [n1, n2, n3].iter().any(|n| n * sign < -SLACK) {
                continue;
            }
            let first = normals[0] + ray1 * (n1 / det);
            let twist = velocity.twist(
                first.to_array(),
                normals[1].y + ray2.y * (n2 / det),
                normals[1].z + ray2.z * (n2 / det),
                normals[2].z + ray(&self.plane, 2, j3).z * (n3 / det),
            );
            // As in the quadratic form, a vanishing determinant counts as 1e-14.
            if dot(&twist, &twist) * det * det > *limit * (1.0 - TIE) * (det * det + TINY) {
                self.offer(twist, Active::Rays([j1, j2, j3]), question, limit)?;
            }
        }
        ControlFlow::Continue(())
    }
}
