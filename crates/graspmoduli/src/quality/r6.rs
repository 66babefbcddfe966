//! Vectors of R⁶: twists (v, ω) and wrenches (force, torque).

/// A twist (v, ω) or a wrench (force, torque).
pub type Twist = [f64; 6];

/// ⟨a, b⟩, without the fused operations of the closed form, which cost a call where they are not
/// native.
#[inline(always)]
pub(super) fn dot(a: &Twist, b: &Twist) -> f64 {
    ((a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])) + (a[4] * b[4] + a[5] * b[5])
}

/// a + share · b.
#[inline(always)]
pub(super) fn add(a: &Twist, share: f64, b: &Twist) -> Twist {
    std::array::from_fn(|i| a[i] + share * b[i])
}

/// The vector over its length, and that length.
pub(super) fn unit(x: &Twist) -> (Twist, f64) {
    // Divided by the largest component first, so that no square overflows or vanishes.
    let largest = x.iter().fold(0.0_f64, |largest, c| largest.max(c.abs()));
    let tame = x.map(|c| c / largest);
    let length = dot(&tame, &tame).sqrt();
    (tame.map(|c| c / length), largest * length)
}

/// The x with ⟨rows_k, x⟩ = right_k, by Gaussian elimination with partial pivoting; `None` if the
/// rows are dependent.
#[inline(always)]
pub(super) fn solve(rows: [Twist; 6], right: Twist) -> Option<Twist> {
    let mut rows: [[f64; 7]; 6] =
        std::array::from_fn(|r| std::array::from_fn(|c| if c < 6 { rows[r][c] } else { right[r] }));
    for step in 0..6 {
        let mut pivot = step;
        for row in step + 1..6 {
            if rows[row][step].abs() > rows[pivot][step].abs() {
                pivot = row;
            }
        }
        rows.swap(step, pivot);
        let head = rows[step];
        // Torques carry the unit of length, so only an exact zero is independent of it.
        if head[step] == 0.0 {
            return None;
        }
        for row in &mut rows[step + 1..] {
            let factor = row[step] / head[step];
            for c in step..7 {
                row[c] -= factor * head[c];
            }
        }
    }
    let mut x = [0.0; 6];
    for step in (0..6).rev() {
        let known: f64 = (step + 1..6).map(|c| rows[step][c] * x[c]).sum();
        x[step] = (rows[step][6] - known) / rows[step][step];
    }
    x.iter().all(|x| x.is_finite()).then_some(x)
}
