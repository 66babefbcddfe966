//! Force closure of grasps on lattices, as boxes and hand-written examples have them, against a
//! decision with twice as many digits; and Q in every order of the contacts.
//!
//! `LATTICE_GRASPS=1000000 cargo test --release --test force_closure` looks at more of them.

use glam::DVec3;
use graspmoduli::contact::{Contact, FrictionCone};
use graspmoduli::quality::Evaluator;
use std::ops::{Add, Mul, Neg, Sub};

/// A number with about 32 digits, the unevaluated sum of two.
#[derive(Clone, Copy, Debug)]
struct Long(f64, f64);

impl Long {
    /// a + b exactly.
    fn sum(a: f64, b: f64) -> Self {
        let s = a + b;
        let t = s - a;
        Self(s, (a - (s - t)) + (b - t))
    }

    fn over(self, divisor: f64) -> Self {
        let quotient = self.0 / divisor;
        let left = self - Self(quotient, 0.0) * Self(divisor, 0.0);
        Self::sum(quotient, (left.0 + left.1) / divisor)
    }

    fn abs(self) -> Self {
        if self.0 < 0.0 { -self } else { self }
    }
}

impl From<f64> for Long {
    fn from(a: f64) -> Self {
        Self(a, 0.0)
    }
}

impl Add for Long {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let Self(s, e) = Self::sum(self.0, other.0);
        let Self(t, f) = Self::sum(self.1, other.1);
        let Self(s, e) = Self::sum(s, e + t);
        Self::sum(s, e + f)
    }
}

impl Neg for Long {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl Sub for Long {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Long {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let p = self.0 * other.0;
        let e = self.0.mul_add(other.0, -p);
        Self::sum(p, e + (self.0 * other.1 + self.1 * other.0))
    }
}

/// (cos, sin) of 2πj/l by Taylor's series.
fn turn(j: usize, l: usize) -> [Long; 2] {
    // 2π to 32 digits.
    let tau = Long(std::f64::consts::TAU, 2.449_293_598_294_706_4e-16);
    // The nearest turn to 0, where the series is short.
    let signed = if 2 * j > l {
        j as f64 - l as f64
    } else {
        j as f64
    };
    let x = (tau * Long::from(signed)).over(l as f64);
    let (mut term, mut sums) = (Long::from(1.0), [Long::from(0.0); 2]);
    for n in 0..60 {
        let sign = if n % 4 < 2 { term } else { -term };
        sums[n % 2] = sums[n % 2] + sign;
        term = (term * x).over((n + 1) as f64);
    }
    sums
}

type Vector = [Long; 3];

fn vector(v: DVec3) -> Vector {
    v.to_array().map(Long::from)
}

fn dot(a: Vector, b: Vector) -> Long {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}

fn add(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| a[i] + b[i])
}

fn times(a: Vector, factor: Long) -> Vector {
    a.map(|c| c * factor)
}

/// What is this much smaller than the lattice is 0; nothing may lie between that and the other.
const ZERO: f64 = 1e-22;
const CLEAR: f64 = 1e-9;

fn sign(x: Long) -> i32 {
    let size = x.0.abs();
    assert!(!(ZERO..CLEAR).contains(&size), "{x:?} is no lattice's");
    if size < ZERO { 0 } else { x.0.signum() as i32 }
}

/// About its largest component, so that [`sign`] can tell.
fn tame(v: Vector) -> Vector {
    let largest = v.iter().fold(0.0_f64, |a, c| a.max(c.0.abs()));
    if largest < ZERO {
        v
    } else {
        v.map(|c| c.over(largest))
    }
}

/// The rotation of the paper that takes e₃ to an axis.
fn tangents(normal: DVec3) -> [DVec3; 2] {
    match normal.to_array().map(|c| c as i32) {
        [1, 0, 0] => [DVec3::NEG_Z, DVec3::Y],
        [-1, 0, 0] => [DVec3::Z, DVec3::Y],
        [0, 1, 0] => [DVec3::X, DVec3::NEG_Z],
        [0, -1, 0] => [DVec3::X, DVec3::Z],
        [0, 0, 1] => [DVec3::X, DVec3::Y],
        _ => [DVec3::X, DVec3::NEG_Y],
    }
}

/// Is the origin in the interior of the wrench hull? Forces in balance lie in the plane of the
/// contacts, in the wedges in which it cuts the cones, and along the sides of the triangle: six
/// half-spaces of R³, which must have a common interior.
fn is_closed(contacts: &[Contact; 3], friction: Long, turns: &[[Long; 2]]) -> bool {
    let points = contacts.map(|c| vector(c.point));
    let way = |i: usize, k: usize| add(points[k], times(points[i], Long::from(-1.0)));
    let normal = cross(way(0, 1), way(0, 2));
    if normal.iter().all(|&c| sign(c) == 0) {
        return false;
    }
    let mut halves: Vec<Vector> = Vec::new();
    for i in 0..3 {
        let [first, second] = tangents(contacts[i].normal).map(vector);
        let edges: Vec<Vector> = turns
            .iter()
            .map(|[c, s]| {
                let across = add(times(first, *c), times(second, *s));
                add(vector(contacts[i].normal), times(across, friction))
            })
            .collect();
        let heights: Vec<Long> = edges.iter().map(|f| dot(*f, normal)).collect();
        let mut planar = Vec::new();
        let (mut above, mut below) = (false, false);
        for (f, &h) in edges.iter().zip(&heights) {
            match sign(h) {
                0 => planar.push(*f),
                1 => {
                    above = true;
                    for (g, &k) in edges.iter().zip(&heights) {
                        if sign(k) < 0 {
                            planar.push(add(times(*f, k.abs()), times(*g, h)));
                        }
                    }
                }
                _ => below = true,
            }
        }
        if !(above && below) {
            return false;
        }
        // Sides of the wedge: all others are on one side of them.
        let turned = |a: Vector, b: Vector| sign(dot(cross(tame(a), tame(b)), normal));
        let (mut right, mut left) = (planar[0], planar[0]);
        for &d in &planar {
            if turned(d, right) > 0 {
                right = d;
            }
            if turned(left, d) > 0 {
                left = d;
            }
        }
        assert!(turned(right, left) > 0, "a wedge without interior");
        // The force as a function of (t₁₂, t₁₃, t₂₃).
        let none = [Long::from(0.0); 3];
        let force = match i {
            0 => [way(0, 1), way(0, 2), none],
            1 => [way(1, 0), none, way(1, 2)],
            _ => [none, way(2, 0), way(2, 1)],
        };
        halves.push(tame(force.map(|f| dot(cross(right, f), normal))));
        halves.push(tame(force.map(|f| dot(cross(f, left), normal))));
    }
    // The sum of the cone's extreme rays is in its interior, if there is one.
    let mut middle = [Long::from(0.0); 3];
    for (i, &g) in halves.iter().enumerate() {
        for &h in &halves[..i] {
            let ray = cross(g, h);
            if ray.iter().all(|&c| sign(c) == 0) {
                continue;
            }
            for ray in [tame(ray), times(tame(ray), Long::from(-1.0))] {
                if halves.iter().all(|&half| sign(dot(half, ray)) >= 0) {
                    middle = add(middle, ray);
                }
            }
        }
    }
    halves.iter().all(|&half| sign(dot(half, middle)) > 0)
}

struct Draw(u64);

impl Draw {
    fn below(&mut self, count: u64) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 33) % count
    }

    /// On halves, from −1.5 to 1.5.
    fn point(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| self.below(7) as f64 / 2.0 - 1.5))
    }

    fn axis(&mut self) -> DVec3 {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        axes[self.below(3) as usize] * (self.below(2) as f64 * 2.0 - 1.0)
    }
}

const ORDERS: [[usize; 3]; 6] = [
    [0, 1, 2],
    [0, 2, 1],
    [1, 0, 2],
    [1, 2, 0],
    [2, 0, 1],
    [2, 1, 0],
];

/// A grasp on a real surface that eight edges cannot hold and seven or nine can: two contacts
/// press against the third along a line that meets the edges of their cones.
#[test]
fn a_grasp_of_a_surface_on_the_boundary_is_on_it() {
    let contact = |p: [f64; 3], n: [f64; 3]| Contact {
        point: DVec3::from_array(p),
        normal: DVec3::from_array(n).normalize(),
    };
    let contacts = [
        contact(
            [
                0.19177546385390062,
                0.37669178746686743,
                -0.24864023379471864,
            ],
            [
                -0.03582085457749526,
                -0.9983504000466381,
                0.04487031428523293,
            ],
        ),
        contact(
            [
                0.27850465753675996,
                0.3661831969726993,
                -0.19975285405254165,
            ],
            [
                -0.3105137398901884,
                -0.9477254055398634,
                0.07346953813459078,
            ],
        ),
        contact(
            [
                -0.3713321186642678,
                -0.29956112025196907,
                0.2729418766624606,
            ],
            [0.42765153623844193, 0.9031048386020716, -0.0389334566462703],
        ),
    ];
    let center = DVec3::new(-0.0021448374584608354, 0.0, 0.0);
    for (l, wanted) in [
        (7, 0.00112167241),
        (8, 0.0),
        (9, 0.00153230913),
        (16, 0.00158956646),
    ] {
        let mut evaluator = Evaluator::new(&FrictionCone::new(1.0, l).unwrap());
        let quality = evaluator.quality(&contacts, center);
        assert!(evaluator.take_unconverged().is_none());
        assert!((quality - wanted).abs() < 1e-10, "{l} {quality}");
    }
}

#[test]
fn grasps_on_lattices_are_force_closure_exactly_where_they_are() {
    let wanted = std::env::var("LATTICE_GRASPS").map_or(Ok(25_000), |text| text.parse());
    let wanted: usize = wanted.expect("LATTICE_GRASPS must be a number");
    let mut settings = Vec::new();
    // Tenths, as exact as the decision: as doubles, 0.2 is a little more than a fifth.
    for tenths in [2.0, 5.0, 10.0, 20.0] {
        let friction = Long::from(tenths).over(10.0);
        for l in [3, 4, 7, 8, 16] {
            let turns: Vec<_> = (0..l).map(|j| turn(j, l)).collect();
            let evaluator = Evaluator::new(&FrictionCone::new(friction.0, l).unwrap());
            settings.push((friction, l, turns, evaluator));
        }
    }
    let mut draw = Draw(7);
    let mut closed = 0;
    for number in 0..wanted {
        let setting = number % settings.len();
        let (friction, l, turns, evaluator) = &mut settings[setting];
        let contacts = [(); 3].map(|()| Contact {
            point: draw.point(),
            normal: draw.axis(),
        });
        let center = draw.point();
        let truth = is_closed(&contacts, *friction, turns);
        closed += usize::from(truth);
        let quality = evaluator.quality(&contacts, center);
        let grasp = format!(
            "{contacts:?} about {center}, friction {}, {l} edges",
            friction.0
        );
        assert_eq!(quality > 0.0, truth, "quality {quality} of {grasp}");
        // A positive quality on a lattice is not rounding.
        assert!(!truth || quality > 1e-6, "{quality} of {grasp}");
        for order in ORDERS {
            let other = evaluator.quality(&order.map(|i| contacts[i]), center);
            assert_eq!(quality.to_bits(), other.to_bits(), "{order:?} of {grasp}");
        }
        assert!(evaluator.take_unconverged().is_none(), "{grasp}");
        // Thresholds agree with values.
        if truth {
            assert!(evaluator.is_at_least(&contacts, center, quality), "{grasp}");
            assert!(
                !evaluator.is_at_least(&contacts, center, quality.next_up()),
                "{grasp}"
            );
            let gradient = evaluator.gradient(&contacts, center);
            assert_eq!(gradient.value.to_bits(), quality.to_bits(), "{grasp}");
        }
    }
    assert!(
        closed * 50 > wanted,
        "only {closed} of {wanted} are force closure"
    );
}
