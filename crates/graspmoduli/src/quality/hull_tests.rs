//! Hulls of listed points against the polytope that knows their farthest points only.

use super::enough::Enough;
use super::hull::Hull;
use super::metric::Metric;
use super::polytope::Distance;
use super::polytope::Polytope;
use super::wrenches::Wrenches;
use crate::contact::{Contact, FrictionCone, Norm};
use crate::math::sin_cos;
use glam::DVec3;
use pulp::Arch;

/// Random numbers, uniform in [−1, 1).
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn whole(&mut self, below: u64) -> u64 {
        ((self.next() + 1.0) * 0.5 * below as f64) as u64
    }

    fn ball(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(self.next(), self.next(), self.next());
            if v.length_squared() < 1.0 {
                return v;
            }
        }
    }

    fn axis(&mut self) -> DVec3 {
        let axis = [DVec3::X, DVec3::Y, DVec3::Z][self.whole(3) as usize];
        axis * if self.next() < 0.0 { 1.0 } else { -1.0 }
    }

    /// Uniform in D(1).
    fn uniform(&mut self, m: usize) -> (Vec<Contact>, DVec3) {
        let contacts = (0..m).map(|_| Contact {
            point: self.ball(),
            normal: self.ball().normalize(),
        });
        (contacts.collect(), self.ball())
    }

    /// On a lattice with normals along axes, on the sides of a box, or a regular polygon.
    fn degenerate(&mut self, m: usize) -> (Vec<Contact>, DVec3) {
        let kind = self.whole(3);
        let tilt = self.whole(4) as f64 * 0.25;
        let contacts: Vec<Contact> = (0..m)
            .map(|k| match kind {
                0 => {
                    let half = |draw: &mut Self| (draw.whole(7) as f64 - 3.0) / 2.0;
                    let point = DVec3::new(half(self), half(self), half(self));
                    let normal = self.axis();
                    Contact { point, normal }
                }
                1 => {
                    let normal = self.axis();
                    let own = DVec3::new(self.next(), self.next(), self.next());
                    let point = own - normal * (own.dot(normal) + 1.0);
                    Contact { point, normal }
                }
                _ => {
                    let turn = std::f64::consts::TAU * k as f64 / m as f64;
                    let (sin, cos) = sin_cos(turn);
                    let point = DVec3::new(cos, sin, tilt * f64::from(k as u32 % 2));
                    Contact {
                        point,
                        normal: -DVec3::new(cos, sin, 0.0),
                    }
                }
            })
            .collect();
        // Far away, or tiny.
        match self.whole(4) {
            0 => (contacts, DVec3::Z * 100.0),
            1 => {
                let tiny = |c: Contact| Contact {
                    point: c.point * 1e-6,
                    ..c
                };
                (contacts.into_iter().map(tiny).collect(), DVec3::ZERO)
            }
            2 => (contacts, self.ball()),
            _ => (contacts, DVec3::ZERO),
        }
    }
}

fn wrenches(contacts: &[Contact], cone: &FrictionCone) -> Wrenches {
    let mut wrenches = Wrenches::new();
    let order: Vec<usize> = (0..contacts.len()).collect();
    wrenches.set(contacts, &order, cone);
    wrenches.list();
    wrenches
}

/// By the polytope, of which [`Hull`] must know nothing but the points.
fn twin(wrenches: &Wrenches, metric: Metric) -> Distance {
    Polytope::default().distance(wrenches, metric, |_, _| false)
}

/// `FUZZ=100 cargo test --release -p graspmoduli hull -- --nocapture` asks a hundred times as
/// many.
fn factor() -> usize {
    std::env::var("FUZZ").map_or(1, |text| text.parse().unwrap())
}

/// Compares with the twin; the share of hulls that were unclear, and the worst difference
/// relative to the distance, or to `floor` where that is less.
fn compare(
    cone: &FrictionCone,
    grasps: impl Iterator<Item = (Vec<Contact>, DVec3)>,
    tolerance: f64,
    floor: f64,
) -> (f64, f64) {
    let mut hull = Hull::new();
    let (mut count, mut unclear, mut worst) = (0, 0, 0.0_f64);
    for (contacts, center) in grasps {
        let mut wrenches = wrenches(&contacts, cone);
        if wrenches.reference.is_point() {
            continue;
        }
        let metric = Metric::new(wrenches.reference, center);
        let norm = wrenches.norm;
        count += 1;
        let Some(found) = hull.distance(&mut wrenches.points, norm, metric, Enough::Never) else {
            unclear += 1;
            continue;
        };
        assert!(found.converged);
        let wanted = twin(&wrenches, metric);
        assert_eq!(
            found.upper > 0.0,
            wanted.upper > 0.0,
            "{found:?} {wanted:?} {contacts:?} {center}"
        );
        if found.upper > 0.0 {
            let off = (found.upper - wanted.upper).abs() / (wanted.upper + floor);
            worst = worst.max(off);
            assert!(
                off < tolerance,
                "{found:?} {wanted:?} {contacts:?} {center}"
            );
        }
    }
    (unclear as f64 / count as f64, worst)
}

#[test]
fn uniform_grasps_are_as_the_polytope_says() {
    let mut draw = Draw(1);
    for (m, friction, edges) in [(4, 1.0, 8), (5, 1.0, 8), (8, 1.0, 8), (4, 0.3, 5)] {
        let cone = FrictionCone::new(friction, edges).unwrap();
        for cone in [cone.clone(), cone.soft(0.1).unwrap()] {
            let grasps = (0..1000 * factor()).map(|_| draw.uniform(m));
            let (unclear, worst) = compare(&cone, grasps, 1e-11, 1e-3);
            println!(
                "{m} contacts, {edges} edges, torsion {}: unclear {unclear:.6}, off by {worst:.1e}",
                cone.torsion()
            );
            assert!(unclear < 0.005);
        }
    }
}

#[test]
fn limits_of_every_finger_are_as_the_polytope_says() {
    let mut draw = Draw(3);
    let cone = FrictionCone::new(1.0, 8).unwrap().with_norm(Norm::Each);
    for m in [3, 4, 5] {
        let grasps = (0..300 * factor()).map(|_| draw.uniform(m));
        let (unclear, worst) = compare(&cone, grasps, 1e-11, 1e-3);
        println!("{m} contacts, a limit each: unclear {unclear:.6}, off by {worst:.1e}");
        let grasps = (0..300 * factor()).map(|_| draw.degenerate(m));
        let (unclear, worst) = compare(&cone, grasps, 1e-9, 0.0);
        println!("{m} contacts, a limit each, degenerate: {unclear:.6}, off by {worst:.1e}");
    }
}

#[test]
fn degenerate_grasps_are_as_the_polytope_says() {
    let mut draw = Draw(2);
    for m in [3, 4, 5, 8] {
        let cone = FrictionCone::new(1.0, 8).unwrap();
        let grasps = (0..1000 * factor()).map(|_| draw.degenerate(m));
        let (unclear, worst) = compare(&cone, grasps, 1e-9, 0.0);
        assert!(unclear < 0.1);
        println!("{m} contacts, degenerate: unclear {unclear:.4}, off by {worst:.1e}");
    }
}

#[test]
fn a_search_that_ends_early_is_right_about_its_threshold() {
    let mut draw = Draw(4);
    let cone = FrictionCone::new(1.0, 8).unwrap();
    let (mut hull, mut below, mut above) = (Hull::new(), 0, 0);
    for norm in [Norm::Sum, Norm::Each] {
        let cone = cone.clone().with_norm(norm);
        for _ in 0..500 * factor() {
            let (contacts, center) = draw.uniform(4);
            let mut wrenches = wrenches(&contacts, &cone);
            let wanted = twin(&wrenches, Metric::new(wrenches.reference, center)).upper;
            let metric = Metric::new(wrenches.reference, center);
            let mut ask = |enough| hull.distance(&mut wrenches.points, norm, metric, enough);
            for threshold in [0.05, 0.2, wanted * 0.999, wanted * 1.001] {
                if let Some(found) = ask(Enough::Below(threshold)) {
                    assert_eq!(found.upper < threshold, wanted < threshold);
                    assert!(found.upper >= wanted * (1.0 - 1e-11));
                    below += usize::from(found.upper > wanted * (1.0 + 1e-9));
                }
                if let Some(found) = ask(Enough::AtLeast(threshold)) {
                    assert_eq!(found.upper < threshold, wanted < threshold);
                    assert!(found.lower <= wanted * (1.0 + 1e-11));
                    above += usize::from(found.lower < wanted * (1.0 - 1e-8));
                }
            }
        }
    }
    // Many did end early.
    assert!(below > 200 && above > 200, "{below} {above}");
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let mut sets = vec![Arch::Scalar];
    #[cfg(target_arch = "x86_64")]
    {
        sets.extend(pulp::x86::V3::try_new().map(Arch::V3));
        sets.extend(pulp::x86::V4::try_new().map(Arch::V4));
    }
    let mut draw = Draw(5);
    let cone = FrictionCone::new(0.8, 7).unwrap().soft(0.05).unwrap();
    for norm in [Norm::Sum, Norm::Each] {
        let cone = cone.clone().with_norm(norm);
        for turn in 0..400 {
            let (contacts, center) = match turn % 2 {
                0 => draw.uniform(4),
                _ => draw.degenerate(5),
            };
            let mut wrenches = wrenches(&contacts, &cone);
            let metric = Metric::new(wrenches.reference, center);
            let mut found = sets.iter().map(|&arch| {
                Hull::on(arch).distance(&mut wrenches.points, norm, metric, Enough::Never)
            });
            let wanted = found.next().unwrap();
            assert!(found.all(|other| other == wanted), "{contacts:?} {center}");
        }
    }
}
