//! The best subsets of contacts against all of them.

use glam::DVec3;
use graspmoduli::contact::{Contact, FrictionCone};
use graspmoduli::error::Error;
use graspmoduli::quality::Evaluator;
use graspmoduli::search::{Ranked, best_subsets};
use std::ops::ControlFlow;

struct Draw(u64);

impl Draw {
    fn number(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn vector(&mut self) -> DVec3 {
        loop {
            let v = DVec3::from_array([(); 3].map(|()| 2.0 * self.number() - 1.0));
            if (0.01..1.0).contains(&v.length_squared()) {
                return v;
            }
        }
    }

    /// About on a sphere, pressing about inward.
    fn contact(&mut self) -> Contact {
        let point = self.vector().normalize();
        Contact {
            point,
            normal: (0.5 * self.vector() - point).normalize(),
        }
    }
}

fn go(_: u64, _: u64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// All subsets one after the other.
fn all(contacts: &[Contact], frictions: &[f64], l: usize, size: usize, top: usize) -> Vec<Ranked> {
    let mut ranked = Vec::new();
    let mut indices: Vec<usize> = (0..size).collect();
    loop {
        let grasp: Vec<Contact> = indices.iter().map(|&i| contacts[i]).collect();
        let own: Vec<f64> = indices.iter().map(|&i| frictions[i]).collect();
        let cone = FrictionCone::each(&own, l).unwrap();
        let quality = Evaluator::new(&cone).quality(&grasp, DVec3::ZERO);
        if quality > 0.0 {
            let indices = indices.clone();
            ranked.push(Ranked { quality, indices });
        }
        let Some(place) = (0..size).rfind(|&k| indices[k] < contacts.len() - size + k) else {
            break;
        };
        indices[place] += 1;
        for k in place + 1..size {
            indices[k] = indices[k - 1] + 1;
        }
    }
    ranked.sort_by(|a, b| {
        let qualities = b.quality.total_cmp(&a.quality);
        qualities.then_with(|| a.indices.cmp(&b.indices))
    });
    ranked.truncate(top);
    ranked
}

#[test]
fn the_best_subsets_are_those_of_all_with_any_friction_and_threads() {
    let mut draw = Draw(11);
    for (size, count, l) in [(3, 24, 8), (3, 14, 40), (4, 12, 8), (5, 9, 5)] {
        let contacts: Vec<Contact> = (0..count).map(|_| draw.contact()).collect();
        for each in [false, true] {
            let frictions: Vec<f64> = (0..count)
                .map(|_| if each { 0.3 + draw.number() } else { 0.8 })
                .collect();
            let given = if each { &frictions[..] } else { &[] };
            let slow = all(&contacts, &frictions, l, size, 7);
            assert!(slow.len() > 2, "{size} of {count}: {}", slow.len());
            let cone = FrictionCone::new(0.8, l).unwrap();
            for threads in [1, 3] {
                let fast = best_subsets(&contacts, given, DVec3::ZERO, &cone, size, 7, threads, go);
                assert_eq!(fast.unwrap(), slow, "{size} of {count}");
            }
        }
    }
}

#[test]
fn equal_grasps_come_by_their_indices_whatever_the_threads() {
    // A hexagon: its two triangles, and turned ones of every other kind, are equal.
    let contacts: Vec<Contact> = [0.0, 0.5, 1.0]
        .into_iter()
        .flat_map(|height| {
            [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]].map(|[x, y]| Contact {
                point: DVec3::new(x, y, height),
                normal: DVec3::new(-x, -y, 0.0),
            })
        })
        .collect();
    let cone = FrictionCone::new(1.0, 8).unwrap();
    let center = DVec3::new(0.0, 0.0, 0.5);
    let slow = best_subsets(&contacts, &[], center, &cone, 3, 30, 1, go).unwrap();
    assert!(
        slow.windows(2)
            .any(|pair| pair[0].quality == pair[1].quality)
    );
    for threads in [2, 3, 4, 5] {
        for _ in 0..5 {
            let fast = best_subsets(&contacts, &[], center, &cone, 3, 30, threads, go).unwrap();
            assert_eq!(fast, slow);
        }
    }
}

#[test]
fn friction_for_other_contacts_is_refused_and_a_stop_is_heard() {
    let mut draw = Draw(3);
    let contacts: Vec<Contact> = (0..10).map(|_| draw.contact()).collect();
    let cone = FrictionCone::new(0.8, 8).unwrap();
    let few = best_subsets(&contacts, &[1.0; 3], DVec3::ZERO, &cone, 3, 1, 1, go);
    assert!(matches!(
        few,
        Err(Error::Count {
            wanted: 10,
            got: 3,
            ..
        })
    ));
    let stopped = best_subsets(&contacts, &[], DVec3::ZERO, &cone, 3, 1, 2, |_, _| {
        ControlFlow::Break(())
    });
    assert_eq!(stopped, Err(Error::Interrupted));
}
