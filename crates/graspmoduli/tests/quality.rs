//! Q_l over adversarial and random grasps.

use glam::DVec3;
use graspmoduli::contact::{Contact, Frame, FrictionCone, Norm};
use graspmoduli::math;
use graspmoduli::quality::{Batch, Evaluator, Gradient};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Coordinates of every size, with many exact coincidences.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -1.0..1.0,
        1 => prop::sample::select(vec![0.0, 1.0, -1.0, 0.5, 1e-9, -1e-9, 1e-300, 5e-324]),
        1 => prop::sample::select(vec![1e4, -1e4, 1e150, -1e150, 1e300, f64::MAX]),
    ]
}

fn vector() -> impl Strategy<Value = DVec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(DVec3::from_array)
}

fn normal() -> impl Strategy<Value = DVec3> {
    let axes = vec![DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::Z, DVec3::NEG_Z];
    prop_oneof![
        3 => [-1.0..1.0, -1.0..1.0, -1.0..1.0f64]
            .prop_map(|v| DVec3::from_array(v).normalize_or(DVec3::NEG_Z)),
        2 => prop::sample::select(axes),
        1 => (-1e-7..1e-7f64, -1e-7..1e-7f64).prop_map(|(x, y)| DVec3::new(x, y, -1.0).normalize()),
    ]
}

fn tame() -> impl Strategy<Value = DVec3> {
    [-1.0..1.0, -1.0..1.0, -1.0..1.0f64].prop_map(DVec3::from_array)
}

fn grasp<P: Strategy<Value = DVec3>>(
    point: impl Fn() -> P,
) -> impl Strategy<Value = ([Contact; 3], DVec3)> {
    let contact = || (point(), normal()).prop_map(|(point, normal)| Contact { point, normal });
    ([contact(), contact(), contact()], point())
}

/// The largest ⟨v, w⟩ over all wrenches.
fn support(cone: &FrictionCone, contacts: &[Contact], center: DVec3, v: [DVec3; 2]) -> f64 {
    let mut largest = f64::NEG_INFINITY;
    for contact in contacts {
        let frame = Frame::new(contact.normal);
        for j in 0..cone.len() {
            let force = cone.edge(0, &frame, j);
            let torque = (contact.point - center).cross(force);
            largest = largest.max(v[0].dot(force) + v[1].dot(torque));
        }
    }
    largest
}

fn cones() -> impl Strategy<Value = FrictionCone> {
    let friction = prop::sample::select(vec![1e-3, 0.2, 1.0, 7.0]);
    (friction, 3..18usize).prop_map(|(mu, l)| FrictionCone::new(mu, l).unwrap())
}

/// Grasps of one to six contacts.
fn hand<P: Strategy<Value = DVec3> + 'static>(
    point: impl Fn() -> P,
) -> impl Strategy<Value = (Vec<Contact>, DVec3)> {
    let contact = (point(), normal()).prop_map(|(point, normal)| Contact { point, normal });
    (prop::collection::vec(contact, 1..7), point())
}

/// `FUZZ=100 cargo test --release --test quality` tries a hundred times as many.
fn cases(cases: u32) -> ProptestConfig {
    let factor = std::env::var("FUZZ").map_or(Ok(1), |text| text.parse());
    ProptestConfig {
        cases: cases * factor.unwrap_or(1),
        failure_persistence: None,
        // The same cases everywhere; to look for others, change the seed.
        rng_seed: RngSeed::Fixed(2013),
        ..ProptestConfig::default()
    }
}

/// The largest distance between corresponding wrenches.
/// Evaluates with a limit for every finger.
fn each_of(cone: &FrictionCone) -> Evaluator {
    Evaluator::new(&cone.clone().with_norm(Norm::Each))
}

fn displacement(cone: &FrictionCone, a: &[Contact], b: &[Contact], center: DVec3) -> f64 {
    let mut largest = 0.0_f64;
    for (one, other) in a.iter().zip(b) {
        let (before, after) = (Frame::new(one.normal), Frame::new(other.normal));
        for j in 0..cone.len() {
            let (f, g) = (cone.edge(0, &before, j), cone.edge(0, &after, j));
            let torque = (one.point - center).cross(f) - (other.point - center).cross(g);
            largest = largest.max((f.distance_squared(g) + torque.length_squared()).sqrt());
        }
    }
    largest
}

proptest! {
    #![proptest_config(cases(4000))]

    #[test]
    fn any_finite_grasp_has_a_finite_quality(
        (contacts, center) in hand(vector), cone in cones(), torsion in 0.0..0.3_f64
    ) {
        for cone in [cone.clone(), cone.soft(torsion).unwrap()] {
            let mut evaluator = Evaluator::new(&cone);
            let quality = evaluator.quality(&contacts, center);
            prop_assert!(quality.is_finite() && quality >= 0.0, "{quality}");
            let gradient = evaluator.gradient(&contacts, center);
            prop_assert!(gradient.value.is_finite());
            let vectors = gradient.contacts.iter().chain(&gradient.normals);
            prop_assert!(vectors.chain([&gradient.center_of_mass]).all(|v| v.is_finite()));
            let each = each_of(&cone).quality(&contacts, center);
            prop_assert!(each.is_finite() && each >= 0.0, "{each}");
            let weakest = evaluator.weakest(&contacts, center).direction;
            prop_assert!(weakest.iter().all(|x| x.is_finite()), "{weakest:?}");
        }
    }

    #[test]
    fn the_expanding_polytope_agrees_with_the_closed_form(
        (contacts, center) in grasp(tame), cone in cones()
    ) {
        let mut evaluator = Evaluator::new(&cone);
        let wanted = evaluator.quality(&contacts, center);
        let expanded = evaluator.weakest(&contacts, center).quality;
        prop_assert!((wanted - expanded).abs() <= 1e-11, "{wanted} {expanded}");
    }

    #[test]
    fn no_direction_is_resisted_less(
        (contacts, center) in hand(tame), cone in cones(),
        linear in tame(), angular in tame(),
    ) {
        let mut evaluator = Evaluator::new(&cone);
        let quality = evaluator.quality(&contacts, center);
        let length = (linear.length_squared() + angular.length_squared()).sqrt();
        let v = [linear / length, angular / length];
        let weakest = evaluator.weakest(&contacts, center).direction;
        let worst = [0, 3].map(|i| DVec3::new(weakest[i], weakest[i + 1], weakest[i + 2]));
        if quality > 0.0 {
            prop_assert!(support(&cone, &contacts, center, v) >= quality * (1.0 - 1e-9));
            let least = support(&cone, &contacts, center, worst);
            prop_assert!((least - quality).abs() <= 1e-9, "{least} {quality}");
        } else {
            prop_assert!(support(&cone, &contacts, center, worst) <= 1e-8);
        }
    }

    #[test]
    fn the_order_of_contacts_does_not_matter(
        (contacts, center) in hand(tame), cone in cones()
    ) {
        let mut evaluator = Evaluator::new(&cone);
        let quality = evaluator.quality(&contacts, center);
        let mut other = contacts.clone();
        for _ in 0..3 {
            other.rotate_left(1);
            let last = other.len() - 1;
            other.swap(0, last);
            let turned = evaluator.quality(&other, center);
            let flat = if contacts.len() == 3 { 0.0 } else { 5e-9 };
            prop_assert!((quality - turned).abs() <= 1e-11 * (1.0 + quality) + flat, "{quality} {turned}");
        }
    }

    #[test]
    fn motions_that_map_the_cones_to_themselves_change_nothing(
        (contacts, center) in hand(tame), cone in cones(), shift in tame(), turns in 0..18usize
    ) {
        // At −e₃ the frame is not continuous.
        let upright = |c: &Contact| Contact {
            normal: if c.normal.z > -0.999 { c.normal } else { -c.normal },
            ..*c
        };
        let contacts: Vec<Contact> = contacts.iter().map(upright).collect();
        // Turns about e₃ by multiples of 2π/l, a mirror image y → −y, and any translation.
        let angle = std::f64::consts::TAU * turns as f64 / cone.len() as f64;
        let flip = DVec3::new(1.0, if turns % 2 == 0 { -1.0 } else { 1.0 }, 1.0);
        let (sin, cos) = math::sin_cos(angle);
        let move_vector = |v: DVec3| {
            let v = v * flip;
            DVec3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z)
        };
        let moved: Vec<Contact> = contacts
            .iter()
            .map(|c| Contact {
                point: move_vector(c.point) + shift,
                normal: move_vector(c.normal),
            })
            .collect();
        let mut evaluator = Evaluator::new(&cone);
        let one = evaluator.quality(&contacts, center);
        let other = evaluator.quality(&moved, move_vector(center) + shift);
        // A hull that surrounds the origin by less than 1e-9 of the lever arms counts as flat.
        let flat = if contacts.len() == 3 { 0.0 } else { 5e-9 };
        prop_assert!((one - other).abs() <= 1e-10 * (1.0 + one) + flat, "{one} {other}");
    }

    #[test]
    fn another_contact_never_hurts(
        (contacts, center) in hand(tame), cone in cones()
    ) {
        let mut evaluator = Evaluator::new(&cone);
        let more = evaluator.quality(&contacts, center);
        let fewer = evaluator.quality(&contacts[1..], center);
        prop_assert!(fewer <= more + 5e-9, "{fewer} {more}");
    }

    #[test]
    fn quality_changes_by_no_more_than_the_wrenches_move(
        (contacts, center) in hand(tame), cone in cones(), size in 1e-6..0.3_f64,
        moves in prop::collection::vec((tame(), tame()), 6),
    ) {
        let moved: Vec<Contact> = contacts
            .iter()
            .zip(moves)
            .map(|(c, (dc, dn))| Contact {
                point: c.point + dc * size,
                normal: (c.normal + dn * size).normalize(),
            })
            .collect();
        let mut evaluator = Evaluator::new(&cone);
        let (one, other) =
            (evaluator.quality(&contacts, center), evaluator.quality(&moved, center));
        let bound = displacement(&cone, &contacts, &moved, center);
        prop_assert!((one - other).abs() <= bound + 5e-9, "{one} {other} {bound}");
    }

    #[test]
    fn more_friction_never_hurts_and_helps_in_proportion(
        (contacts, center) in hand(tame), l in 3..18usize, mu in 0.05..2.0_f64, share in 0.1..1.0_f64
    ) {
        let quality = |mu: f64| {
            let cone = FrictionCone::new(mu, l).unwrap();
            Evaluator::new(&cone).quality(&contacts, center)
        };
        let (low, high) = (quality(share * mu), quality(mu));
        prop_assert!(low <= high + 5e-9, "{low} {high}");
        // Only tangential forces change, by (1 − share) μ, and the torques that they make.
        let lever = contacts.iter().map(|c| c.point.distance(center)).fold(0.0, f64::max);
        let bound = (1.0 - share) * mu * (1.0 + lever * lever).sqrt();
        prop_assert!(high - low <= bound + 5e-9, "{low} {high} {bound}");
    }

    #[test]
    fn threshold_questions_agree_with_the_value(
        (contacts, center) in hand(tame), cone in cones(), share in 0.5..1.5_f64
    ) {
        let mut evaluator = Evaluator::new(&cone);
        let quality = evaluator.quality(&contacts, center);
        for threshold in [quality, quality * share, share - 0.5] {
            let answer = evaluator.is_at_least(&contacts, center, threshold);
            prop_assert_eq!(answer, quality >= threshold, "{} {}", quality, threshold);
        }
    }
}

proptest! {
    #![proptest_config(cases(400))]

    #[test]
    fn measures_are_in_their_order(
        (contacts, center) in hand(tame), mu in 0.1..1.5_f64, l in 4..17usize, torsion in 0.01..0.3_f64
    ) {
        let cone = FrictionCone::new(mu, l).unwrap();
        let around = FrictionCone::new(mu / math::cos(std::f64::consts::PI / l as f64), l).unwrap();
        let mut evaluator = Evaluator::new(&cone);
        let quality = evaluator.quality(&contacts, center);
        let (lower, upper) = evaluator.circular(&contacts, center, 1e-2);
        prop_assert!(lower <= upper && upper <= lower / (1.0 - 1e-2) + 1e-9, "{lower} {upper}");
        prop_assert!(quality <= upper + 1e-9, "{quality} {upper}");
        let outside = Evaluator::new(&around).quality(&contacts, center);
        prop_assert!(lower <= outside + 1e-9, "{lower} {outside}");
        let each = each_of(&cone).quality(&contacts, center);
        prop_assert!(quality <= each + 1e-9, "{quality} {each}");
        prop_assert!(each <= quality * contacts.len() as f64 + 1e-9, "{quality} {each}");
        let soft = Evaluator::new(&cone.soft(torsion).unwrap()).quality(&contacts, center);
        prop_assert!(quality <= soft + 1e-9, "{quality} {soft}");
    }
}

proptest! {
    #![proptest_config(cases(1500))]

    #[test]
    fn the_order_of_the_contacts_does_not_change_a_bit(
        (contacts, center) in hand(tame), cone in cones(), turns in 0..6usize, torsion in 0.0..0.3_f64
    ) {
        let mut other = contacts.clone();
        other.rotate_left(turns % contacts.len());
        let last = other.len() - 1;
        other.swap(0, last);
        for cone in [cone.clone(), cone.soft(torsion).unwrap()] {
            let mut evaluator = Evaluator::new(&cone);
            let mut bits = |contacts: &[Contact]| [
                evaluator.quality(contacts, center),
                each_of(&cone).quality(contacts, center),
                evaluator.circular(contacts, center, 0.1).0,
                evaluator.gradient(contacts, center).value,
            ].map(f64::to_bits);
            prop_assert_eq!(bits(&contacts), bits(&other));
        }
    }

    #[test]
    fn friction_of_each_contact_is_that_of_all_where_it_is_the_same(
        (contacts, center) in grasp(tame), mu in 0.1..2.0_f64, l in 3..40usize
    ) {
        let mut one = Evaluator::new(&FrictionCone::new(mu, l).unwrap());
        let mut each = Evaluator::new(&FrictionCone::each(&[mu; 3], l).unwrap());
        prop_assert_eq!(one.quality(&contacts, center), each.quality(&contacts, center));
        prop_assert_eq!(one.gradient(&contacts, center), each.gradient(&contacts, center));
    }

    #[test]
    fn friction_goes_with_its_contact(
        (contacts, center) in grasp(tame), frictions in [0.1..2.0_f64, 0.1..2.0, 0.1..2.0], l in 3..12usize
    ) {
        let cone = FrictionCone::each(&frictions, l).unwrap();
        let mut evaluator = Evaluator::new(&cone);
        let quality = evaluator.quality(&contacts, center);
        // Among wrenches of all sorts the polytope sees no contacts: the same hull with each
        // contact's edges as contacts without friction.
        let edges: Vec<Contact> = contacts.iter().enumerate().flat_map(|(i, contact)| {
            let (frame, cone) = (Frame::new(contact.normal), cone.clone());
            (0..l).map(move |j| Contact { point: contact.point, normal: cone.edge(i, &frame, j) })
        }).collect();
        let hull = Evaluator::new(&FrictionCone::new(0.0, 3).unwrap()).quality(&edges, center);
        prop_assert!((quality - hull).abs() < 1e-12, "{} {}", quality, hull);
        // And in another order of both.
        let swapped = FrictionCone::each(&[frictions[2], frictions[0], frictions[1]], l).unwrap();
        let other = [contacts[2], contacts[0], contacts[1]];
        prop_assert_eq!(quality, Evaluator::new(&swapped).quality(&other, center));
        let gradient = evaluator.gradient(&contacts, center);
        prop_assert_eq!(gradient.value, quality);
        if quality > 0.01 {
            let h = 1e-7;
            for i in 0..3 {
                let mut slope = DVec3::ZERO;
                for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                    let mut moved = |sign: f64| {
                        let mut moved = contacts;
                        moved[i].point += axis * (sign * h);
                        evaluator.quality(&moved, center)
                    };
                    let (right, left) = (moved(1.0) - quality, quality - moved(-1.0));
                    // Where the two differ there is a kink.
                    if (right - left).abs() < 1e-5 * h {
                        slope += axis * ((right + left) / (2.0 * h));
                        prop_assert!((gradient.contacts[i].dot(axis) - slope.dot(axis)).abs() < 1e-5);
                    }
                }
            }
        }
    }

    #[test]
    fn thresholds_are_decided_in_q((contacts, center) in grasp(tame), cone in cones()) {
        let mut evaluator = Evaluator::new(&cone);
        let quality = evaluator.quality(&contacts, center);
        if quality > 0.0 {
            prop_assert!(evaluator.is_at_least(&contacts, center, quality));
            prop_assert!(!evaluator.is_at_least(&contacts, center, quality.next_up()));
        }
    }

    #[test]
    fn long_levers_flat_triangles_and_many_edges_cost_no_digits(
        (contacts, center) in grasp(tame), far in 0..8usize, flat in 0..9usize, many in any::<bool>()
    ) {
        // The same hull, once as three contacts and once as four.
        let mut contacts = contacts;
        let line = contacts[1].point - contacts[0].point;
        let middle = contacts[0].point + line * 0.3;
        contacts[2].point = middle + (contacts[2].point - middle) * [1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8][flat];
        let center = center * [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7][far];
        let cone = FrictionCone::new(1.0, if many { 40 } else { 8 }).unwrap();
        let mut evaluator = Evaluator::new(&cone);
        let three = evaluator.quality(&contacts, center);
        let four = evaluator.quality(&[contacts[0], contacts[1], contacts[2], contacts[0]], center);
        prop_assert!((three - four).abs() <= 1e-9 * four + 1e-13, "{three:e} {four:e}");
        prop_assert!(evaluator.take_unconverged().is_none());
    }
}

#[test]
fn batches_refuse_parts_that_do_not_fit() {
    let cone = FrictionCone::new(1.0, 8).unwrap();
    let (points, normals) = ([[0.0; 3]; 5], [[0.0, 0.0, 1.0]; 6]);
    let batch = Batch {
        points: &points,
        normals: &normals,
        centers: &[[0.0; 3]; 2],
        frictions: &[],
        stop: None,
    };
    assert!(batch.quality(&cone, &mut [0.0; 2]).is_err());
    let batch = Batch {
        points: &normals,
        ..batch
    };
    assert!(batch.quality(&cone, &mut [0.0; 3]).is_err());
    assert!(batch.quality(&cone, &mut [0.0; 2]).is_ok());
    let batch = Batch {
        frictions: &[1.0; 3],
        ..batch
    };
    assert!(batch.smallest(&cone).is_err());
}

#[test]
fn batches_agree_with_single_grasps() {
    let cone = FrictionCone::new(1.0, 8).unwrap();
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / 3.0;
    let points: Vec<[f64; 3]> = (0..3)
        .map(|i| [math::cos(angle(i)), math::sin(angle(i)), 0.0])
        .collect();
    let normals: Vec<[f64; 3]> = points.iter().map(|p| p.map(|x| -x)).collect();
    let many = Batch {
        frictions: &[],
        stop: None,
        points: &points.repeat(1000),
        normals: &normals.repeat(1000),
        centers: &[[0.0; 3]].repeat(1000),
    };
    let mut out = vec![0.0; 1000];
    many.quality(&cone, &mut out).unwrap();
    assert!(out.iter().all(|q| (q - 0.544232186874).abs() < 5e-13));
    let width = Gradient::width(3);
    let mut gradients = vec![0.0; 1000 * width];
    many.gradient(&cone, &mut gradients).unwrap();
    assert!(gradients.chunks(width).all(|row| row[0] == out[0]));
}

#[test]
fn nearly_collinear_grasps_are_answered() {
    let mut state = 3u64;
    let mut draw = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    };
    let mut positive = 0;
    for m in [3, 4] {
        for off in [1e-8, 1e-9, 1e-10, 1e-11, 3e-12, 1e-12, 1e-13] {
            for _ in 0..500 {
                let mut vector = || DVec3::new(draw(), draw(), draw());
                let (a, b) = (vector(), vector());
                let contacts: Vec<Contact> = (0..m)
                    .map(|_| Contact {
                        point: a + (b - a) * vector().x + vector() * off,
                        normal: vector().normalize(),
                    })
                    .collect();
                let mut evaluator = Evaluator::new(&FrictionCone::new(1.0, 8).unwrap());
                let quality = evaluator.quality(&contacts, DVec3::ZERO);
                let unconverged = evaluator.take_unconverged();
                assert!(unconverged.is_none(), "{off} {unconverged:?} {contacts:?}");
                positive += usize::from(quality > 0.0);
                // No farther than the contacts are off the line.
                assert!(quality < 100.0 * off, "{off} {quality}");
            }
        }
    }
    assert!(positive > 1000, "{positive}");
}

#[test]
fn any_friction_and_many_edges_are_answered() {
    // About a pentagon.
    let corners = [
        [1.0, 0.0],
        [0.31, 0.95],
        [-0.81, 0.59],
        [-0.81, -0.59],
        [0.31, -0.95],
    ];
    for m in [3, 4, 5] {
        let contacts: Vec<Contact> = (0..m)
            .map(|i| {
                let [x, y] = corners[i];
                let point = DVec3::new(x, y, 0.1 * i as f64);
                Contact {
                    point,
                    normal: -point.normalize(),
                }
            })
            .collect();
        for friction in [1e-6, 1e-3, 0.3, 3.0, 10.0, 100.0, 1e4, 1e5, 1e6] {
            for l in [3, 8, 40, 4096] {
                if l > 40 && friction > 1e4 {
                    continue;
                }
                let cone = FrictionCone::new(friction, l).unwrap();
                let mut evaluator = Evaluator::new(&cone);
                let quality = evaluator.quality(&contacts, DVec3::ZERO);
                assert!(evaluator.take_unconverged().is_none(), "{m} {friction} {l}");
                assert!(
                    quality <= 2.0 * (1.0 + friction),
                    "{m} {friction} {l} {quality}"
                );
                if l < 40 {
                    let mut evaluator = each_of(&cone);
                    evaluator.quality(&contacts, DVec3::ZERO);
                    assert!(evaluator.take_unconverged().is_none(), "{m} {friction} {l}");
                }
            }
        }
    }
}
