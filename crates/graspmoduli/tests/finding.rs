//! Synthesis, sampling and gradients from Rust: against exhaustive search, areas and differences.

use glam::DVec3;
use graspmoduli::region::Anywhere;
use graspmoduli::search::best_subsets;
use graspmoduli::synthesis::synthesize;
use graspmoduli::{
    Contact, Error, Evaluator, FrictionCone, Norm, Surface, math, on_threads, sampling,
};
use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;

fn column() -> Surface {
    let wave = |row: usize, column: usize| {
        0.4 + 0.1 * math::sin(0.9 * row as f64) + 0.04 * math::cos(2.0 * column as f64)
    };
    let coefficients = (0..96).map(|k| wave(k / 8, k % 8)).collect();
    Surface::new(-0.8, 0.8, 8, coefficients).unwrap()
}

fn square(count: u32) -> Vec<[f64; 2]> {
    (0..count)
        .map(|k| {
            [
                (f64::from(k) * 0.754_877_666) % 1.0,
                (f64::from(k) * 0.569_840_29) % 1.0,
            ]
        })
        .collect()
}

#[test]
fn samples_are_uniform_by_area() {
    let surface = column();
    let points = sampling::by_area(&surface, &square(20_000));
    // Area of the part below u, by a fine grid, against the share of points there.
    let density = |u: f64, theta: f64| {
        let placed = surface.place(u, theta);
        placed.tangents[0].cross(placed.tangents[1]).length()
    };
    let row = |u: f64| -> f64 {
        (0..64)
            .map(|k| density(u, f64::from(k) * 0.098_174_77))
            .sum()
    };
    let rows: Vec<f64> = (0..400)
        .map(|k| row((f64::from(k) + 0.5) / 400.0))
        .collect();
    let total: f64 = rows.iter().sum();
    for part in [80_usize, 200, 320] {
        let area: f64 = rows[..part].iter().sum::<f64>() / total;
        let below = points.iter().filter(|p| p[0] < part as f64 / 400.0).count();
        assert!((below as f64 / 20_000.0 - area).abs() < 3e-3, "{part}");
    }
}

#[test]
fn synthesis_beats_the_best_of_many_samples_on_any_number_of_threads() {
    let surface = column();
    let center = surface.integrals().center_of_mass;
    let cone = FrictionCone::new(0.8, 8).unwrap();
    let contacts: Vec<Contact> = sampling::by_area(&surface, &square(60))
        .into_iter()
        .map(|[u, theta]| surface.contact(u, theta))
        .collect();
    let quiet = |_: u64, _: u64| ControlFlow::Continue(());
    let best = best_subsets(&contacts, &[], center, &cone, 3, 1, 2, quiet).unwrap();
    let go = AtomicBool::new(false);
    let find = || synthesize(&surface, center, &cone, &Anywhere, 3, 8, &square(40), &go).unwrap();
    let found = on_threads(1, find);
    assert!(found[0].quality > best[0].quality, "{found:?} {best:?}");
    assert_eq!(found, on_threads(3, find));
    let at = found[0]
        .coordinates
        .map(|[u, theta]| surface.contact(u, theta));
    assert_eq!(Evaluator::new(&cone).quality(&at, center), found[0].quality);
}

#[test]
fn gradients_are_those_of_finite_differences_for_any_fingers() {
    let contacts: Vec<Contact> = [(0.1, 0.2), (2.0, -0.3), (4.1, 0.1), (5.2, 0.4)]
        .map(|(angle, height): (f64, f64)| {
            let (sin, cos) = math::sin_cos(angle);
            let normal = -DVec3::new(cos, sin, 0.4 * height).normalize();
            Contact::new(DVec3::new(cos, 0.8 * sin, height), normal).unwrap()
        })
        .to_vec();
    let cone = FrictionCone::new(0.7, 8).unwrap();
    let center = DVec3::new(0.05, -0.02, 0.1);
    for cone in [
        cone.clone(),
        cone.clone().soft(0.2).unwrap(),
        cone.clone().with_norm(Norm::Each),
    ] {
        for contacts in [&contacts[..3], &contacts[..]] {
            let mut evaluator = Evaluator::new(&cone);
            let gradient = evaluator.gradient(contacts, center);
            assert!(gradient.value > 0.01);
            for finger in 0..contacts.len() {
                for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                    let mut at = |step: f64| {
                        let mut moved = contacts.to_vec();
                        moved[finger].point += axis * step;
                        evaluator.quality(&moved, center)
                    };
                    let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
                    let wanted = gradient.contacts[finger].dot(axis);
                    assert!((difference - wanted).abs() < 1e-6, "{difference} {wanted}");
                }
            }
        }
    }
}

#[test]
fn contacts_are_checked() {
    let nan = Contact::new(DVec3::new(f64::NAN, 0.0, 0.0), DVec3::X);
    assert!(matches!(nan, Err(Error::Point { .. })));
    let long = Contact::new(DVec3::X, 2.0 * DVec3::X);
    assert_eq!(
        long.unwrap_err().to_string(),
        "normals must have length 1, got 2"
    );
}
