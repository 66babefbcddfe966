//! Q_l over adversarial and random grasps.

use glam::DVec3;
use graspmoduli::contact::{Contact, Frame, FrictionCone};
use graspmoduli::quality::{Batch, Evaluator, Gradient, Norm};
use proptest::prelude::*;

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
fn support(cone: &FrictionCone, contacts: &[Contact; 3], center: DVec3, v: [DVec3; 2]) -> f64 {
    let mut largest = f64::NEG_INFINITY;
    for contact in contacts {
        let frame = Frame::new(contact.normal);
        for j in 0..cone.len() {
            let force = cone.edge(&frame, j);
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

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 4000,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn any_finite_grasp_has_a_finite_quality(
        (contacts, center) in grasp(vector), cone in cones()
    ) {
        let mut evaluator = Evaluator::new(&cone);
        let quality = evaluator.quality(&contacts, center);
        prop_assert!(quality.is_finite() && quality >= 0.0, "{quality}");
        let gradient = evaluator.gradient(&contacts, center);
        prop_assert!(gradient.value.is_finite());
        let vectors = gradient.contacts.iter().chain(&gradient.normals);
        prop_assert!(vectors.chain([&gradient.center_of_mass]).all(|v| v.is_finite()));
    }

    #[test]
    fn the_expanding_polytope_agrees_with_the_closed_form(
        (contacts, center) in grasp(tame), cone in cones()
    ) {
        let mut evaluator = Evaluator::new(&cone);
        let wanted = evaluator.quality(&contacts, center);
        let expanded = evaluator.weakest(&contacts, center, Norm::Sum).quality;
        prop_assert!((wanted - expanded).abs() <= 1e-11, "{wanted} {expanded}");
    }

    #[test]
    fn no_direction_is_resisted_less(
        (contacts, center) in grasp(tame), cone in cones(),
        linear in tame(), angular in tame(),
    ) {
        let quality = Evaluator::new(&cone).quality(&contacts, center);
        let length = (linear.length_squared() + angular.length_squared()).sqrt();
        let v = [linear / length, angular / length];
        if quality > 0.0 {
            prop_assert!(support(&cone, &contacts, center, v) >= quality * (1.0 - 1e-9));
        }
    }

    #[test]
    fn the_order_of_contacts_does_not_matter(
        (contacts, center) in grasp(tame), cone in cones()
    ) {
        let mut evaluator = Evaluator::new(&cone);
        let [a, b, c] = contacts;
        let quality = evaluator.quality(&contacts, center);
        for order in [[b, a, c], [c, b, a], [b, c, a]] {
            let other = evaluator.quality(&order, center);
            prop_assert!((quality - other).abs() <= 1e-11 * (1.0 + quality), "{quality} {other}");
        }
    }

    #[test]
    fn a_mirror_image_through_a_plane_of_the_cones_is_as_good(
        (contacts, center) in grasp(tame), cone in cones()
    ) {
        // y → −y maps the edges 2πj/l to 2π(l − j)/l.
        let flip = DVec3::new(1.0, -1.0, 1.0);
        let mirrored = contacts.map(|c| Contact { point: c.point * flip, normal: c.normal * flip });
        let mut evaluator = Evaluator::new(&cone);
        let (one, other) =
            (evaluator.quality(&contacts, center), evaluator.quality(&mirrored, center * flip));
        prop_assert!((one - other).abs() <= 1e-11 * (1.0 + one), "{one} {other}");
    }
}

#[test]
fn batches_agree_with_single_grasps() {
    let cone = FrictionCone::new(1.0, 8).unwrap();
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / 3.0;
    let points: Vec<[f64; 3]> = (0..3)
        .map(|i| [angle(i).cos(), angle(i).sin(), 0.0])
        .collect();
    let normals: Vec<[f64; 3]> = points.iter().map(|p| p.map(|x| -x)).collect();
    let many = Batch {
        points: &points.repeat(1000),
        normals: &normals.repeat(1000),
        centers: &[[0.0; 3]].repeat(1000),
    };
    let mut out = vec![0.0; 1000];
    many.quality(&cone, Norm::Sum, &mut out);
    assert!(out.iter().all(|q| (q - 0.544232186874).abs() < 5e-13));
    let width = Gradient::width(3);
    let mut gradients = vec![0.0; 1000 * width];
    many.gradient(&cone, &mut gradients);
    assert!(gradients.chunks(width).all(|row| row[0] == out[0]));
}
