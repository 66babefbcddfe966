//! The domain D(r) of Sec. III and IV.A: random grasps in it and near each other.
//!
//! Random numbers are counter-based (ChaCha8): the seed and the number of a stream name them, and
//! only arithmetic that rounds alike everywhere turns them into grasps, so a piece of work gives the
//! same bits on any machine.

use crate::contact::{Contact, Frame, FrictionCone};
use crate::error::Error;
use crate::quality::Evaluator;
use glam::DVec3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// (c_1, c_2, c_3, n_1, n_2, n_3, z).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Configuration {
    /// Contacts.
    pub contacts: [Contact; 3],
    /// Centre of mass.
    pub center: DVec3,
}

/// A stream of random grasps.
#[derive(Debug, Clone)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// Stream `number` of a seed: independent of all others.
    pub fn new(seed: u64, number: u64) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(number);
        Self(generator)
    }

    /// Uniform in [−1, 1), a multiple of 2⁻⁵².
    fn signed(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1u64 << 52) as f64) - 1.0
    }

    /// Uniform in the unit ball.
    fn ball(&mut self) -> DVec3 {
        loop {
            let point = DVec3::new(self.signed(), self.signed(), self.signed());
            if point.length_squared() <= 1.0 {
                return point;
            }
        }
    }

    /// Uniform in the unit disc, with the square of the distance from its centre.
    fn disc(&mut self) -> (f64, f64, f64) {
        loop {
            let (a, b) = (self.signed(), self.signed());
            let square = a * a + b * b;
            if square <= 1.0 {
                return (a, b, square);
            }
        }
    }

    /// Uniform on the unit sphere (Marsaglia 1972).
    fn sphere(&mut self) -> DVec3 {
        let (a, b, square) = self.disc();
        let across = 2.0 * (1.0 - square).sqrt();
        DVec3::new(a * across, b * across, 1.0 - 2.0 * square).normalize()
    }

    /// Uniform on the spherical cap of the unit vectors within `chord` of one.
    ///
    /// On a sphere area goes with height: with (a, b) uniform in the disc, a² + b² is uniform in
    /// [0, 1], 1 − cos φ = ε²(a² + b²)/2, and the direction across is that of (a, b).
    fn cap(&mut self, axis: DVec3, chord: f64) -> DVec3 {
        let (a, b, square) = self.disc();
        let lower = chord * chord * square;
        let across = chord * (1.0 - 0.25 * lower).sqrt();
        Frame::new(axis)
            .turn([a * across, b * across, 1.0 - 0.5 * lower])
            .normalize()
    }

    /// Uniform in D(1).
    pub fn grasp(&mut self) -> Configuration {
        let contacts = [(); 3].map(|()| Contact {
            point: self.ball(),
            normal: self.sphere(),
        });
        Configuration {
            contacts,
            center: self.ball(),
        }
    }

    /// Uniform in N_ε(g) = {g' : d(g, g') ≤ ε}, ε ≤ 2.
    pub fn near(&mut self, grasp: &Configuration, epsilon: f64) -> Configuration {
        let contacts = grasp.contacts.map(|contact| Contact {
            point: contact.point + epsilon * self.ball(),
            normal: self.cap(contact.normal, epsilon),
        });
        Configuration {
            contacts,
            center: grasp.center + epsilon * self.ball(),
        }
    }
}

/// Numbers of a configuration of m contacts: c_1, …, c_m, n_1, …, n_m, z.
pub const fn numbers(m: usize) -> usize {
    6 * m + 3
}

impl Stream {
    /// Uniform in D(r), any number of contacts: fills a row of [`numbers`]. Three contacts in D(1)
    /// are those of [`Stream::grasp`].
    pub fn configuration(&mut self, radius: f64, row: &mut [f64]) {
        let m = row.len() / 6;
        for i in 0..m {
            let (point, normal) = (self.ball(), self.sphere());
            put(row, i, radius * point);
            put(row, m + i, normal);
        }
        put(row, 2 * m, radius * self.ball());
    }

    /// Uniform in N_ε of a configuration given as such a row. Three contacts are those of
    /// [`Stream::near`]. The chord of two unit vectors is at most 2, whatever ε.
    pub fn nearby(&mut self, given: &[f64], epsilon: f64, row: &mut [f64]) {
        let m = given.len() / 6;
        for i in 0..m {
            let point = take(given, i) + epsilon * self.ball();
            let normal = self.cap(take(given, m + i), epsilon.min(2.0));
            put(row, i, point);
            put(row, m + i, normal);
        }
        put(row, 2 * m, take(given, 2 * m) + epsilon * self.ball());
    }
}

fn take(row: &[f64], number: usize) -> DVec3 {
    DVec3::from_slice(&row[3 * number..])
}

fn put(row: &mut [f64], number: usize, vector: DVec3) {
    vector.write_to_slice(&mut row[3 * number..]);
}

/// What was found of uniform grasps in D(1).
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Grasps with Q_l = 0.
    pub unstable: u64,
    /// Of these, those that have the origin strictly outside of the wrench hull.
    pub outside: u64,
    /// Grasps with Q_l ≥ each threshold.
    pub at_least: Vec<u64>,
    /// Grasps with Q_l > 0 by bins of equal width; beyond the last bin in the last.
    pub histogram: Vec<u64>,
    /// The largest Q_l.
    pub largest: f64,
}

/// Q_l of the first `count` grasps of a stream, counted in at least one bin.
pub fn survey(
    stream: &mut Stream,
    count: usize,
    cone: &FrictionCone,
    thresholds: &[f64],
    bins: usize,
    width: f64,
) -> Result<Survey, Error> {
    if bins == 0 {
        return Err(Error::Bins { got: bins });
    }
    let mut evaluator = Evaluator::new(cone);
    let mut found = Survey {
        unstable: 0,
        outside: 0,
        at_least: vec![0; thresholds.len()],
        histogram: vec![0; bins],
        largest: 0.0,
    };
    for _ in 0..count {
        let Configuration { contacts, center } = stream.grasp();
        let quality = evaluator.quality(&contacts, center);
        if quality == 0.0 {
            found.unstable += 1;
            found.outside += u64::from(!two_contacts_balance(&contacts, cone));
            continue;
        }
        for (number, threshold) in found.at_least.iter_mut().zip(thresholds) {
            *number += u64::from(quality >= *threshold);
        }
        found.histogram[((quality / width) as usize).min(bins - 1)] += 1;
        found.largest = found.largest.max(quality);
    }
    Ok(found)
}

/// Do two of the contacts squeeze or stretch along their line, within their friction cones? For
/// contacts in general position that is the only way in which the origin is on the boundary of the
/// wrench hull.
fn two_contacts_balance(contacts: &[Contact; 3], cone: &FrictionCone) -> bool {
    [(0, 1), (0, 2), (1, 2)].into_iter().any(|(i, k)| {
        let line = contacts[k].point - contacts[i].point;
        let [n, m] = [contacts[i].normal, contacts[k].normal];
        let (along, against) = (line.dot(n), -line.dot(m));
        if along * against <= 0.0 {
            return false;
        }
        let force = if along > 0.0 { line } else { -line };
        holds(cone, i, n, force) && holds(cone, k, m, -force)
    })
}

/// Is a force in the friction cone of a contact with this normal?
fn holds(cone: &FrictionCone, contact: usize, normal: DVec3, force: DVec3) -> bool {
    let [x, y] = Frame::new(normal)
        .tangents
        .map(|tangent| tangent.dot(force));
    cone.excess(contact, [x, y, normal.dot(force)]) <= 0.0
}

/// The smallest Q_l near good grasps: how many of the first `count` grasps of a stream have
/// Q_l ≥ `threshold`, and for each neighbourhood the smallest of `samples` grasps in each N_ε.
///
/// A neighbourhood is ε with a stream of its own, so that each result is that of the neighbourhood
/// alone; once 0 is found in one there is nothing smaller, and the rest of it is left out.
pub fn smallest_nearby(
    stream: &mut Stream,
    count: usize,
    cone: &FrictionCone,
    threshold: f64,
    samples: usize,
    neighbourhoods: &mut [(f64, Stream)],
) -> (u64, Vec<f64>) {
    let mut evaluator = Evaluator::new(cone);
    let mut smallest = vec![f64::INFINITY; neighbourhoods.len()];
    let mut number = 0;
    for _ in 0..count {
        let grasp = stream.grasp();
        if !evaluator.is_at_least(&grasp.contacts, grasp.center, threshold) {
            continue;
        }
        number += 1;
        for (least, (epsilon, stream)) in smallest.iter_mut().zip(&mut *neighbourhoods) {
            for _ in 0..samples {
                if *least == 0.0 {
                    break;
                }
                let near = stream.near(&grasp, *epsilon);
                *least = evaluator.quality_below(&near.contacts, near.center, *least);
            }
        }
    }
    (number, smallest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_are_reproducible_and_differ() {
        let first = |seed, number| Stream::new(seed, number).grasp();
        assert_eq!(first(1, 2), first(1, 2));
        assert_ne!(first(1, 2), first(1, 3));
        assert_ne!(first(1, 2), first(2, 2));
        // The bits themselves: they must not change between versions or machines.
        let grasp = first(1, 2);
        let bits = grasp.center.to_array().map(f64::to_bits);
        assert_eq!(
            bits,
            [
                13826104993011131924,
                13825333901593816236,
                13809088191485145856
            ]
        );
    }

    #[test]
    fn rows_of_three_contacts_are_the_grasps() {
        let flat = |grasp: &Configuration| {
            let points = grasp.contacts.map(|c| c.point.to_array());
            let normals = grasp.contacts.map(|c| c.normal.to_array());
            [points, normals, [grasp.center.to_array(); 3]].concat()[..7].concat()
        };
        let (mut one, mut other) = (Stream::new(4, 9), Stream::new(4, 9));
        let mut row = vec![0.0; numbers(3)];
        for epsilon in [0.01, 0.5, 2.0] {
            let grasp = one.grasp();
            other.configuration(1.0, &mut row);
            assert_eq!(row, flat(&grasp));
            let given = row.clone();
            other.nearby(&given, epsilon, &mut row);
            assert_eq!(row, flat(&one.near(&grasp, epsilon)));
        }
    }

    #[test]
    fn neighbours_are_near_and_everywhere_near() {
        let mut stream = Stream::new(3, 0);
        for epsilon in [1e-3, 0.1, 1.0, 2.0] {
            let grasp = stream.grasp();
            let mut largest = [0.0_f64; 3];
            for _ in 0..2000 {
                let near = stream.near(&grasp, epsilon);
                largest[2] = largest[2].max(near.center.distance(grasp.center));
                for (a, b) in near.contacts.iter().zip(&grasp.contacts) {
                    assert!((a.normal.length() - 1.0).abs() < 1e-14);
                    largest[0] = largest[0].max(a.point.distance(b.point));
                    largest[1] = largest[1].max(a.normal.distance(b.normal));
                }
            }
            for distance in largest {
                assert!(distance <= epsilon * (1.0 + 1e-9), "{distance} {epsilon}");
                assert!(distance > 0.98 * epsilon);
            }
        }
    }

    #[test]
    fn the_smallest_nearby_is_that_of_all_values() {
        let cone = FrictionCone::new(1.0, 8).unwrap();
        let epsilons = [0.01, 0.1];
        let mut streams: Vec<_> = epsilons
            .iter()
            .enumerate()
            .map(|(k, &epsilon)| (epsilon, Stream::new(5, 10 + k as u64)))
            .collect();
        let mut slow = streams.clone();
        let (number, smallest) =
            smallest_nearby(&mut Stream::new(5, 0), 3000, &cone, 0.1, 20, &mut streams);
        let mut evaluator = Evaluator::new(&cone);
        let mut stream = Stream::new(5, 0);
        let good: Vec<_> = (0..3000)
            .map(|_| stream.grasp())
            .filter(|g| evaluator.quality(&g.contacts, g.center) >= 0.1)
            .collect();
        assert_eq!(number, good.len() as u64);
        assert!(number > 10);
        for ((epsilon, stream), smallest) in slow.iter_mut().zip(smallest) {
            let least = good
                .iter()
                .flat_map(|grasp| {
                    (0..20)
                        .map(|_| stream.near(grasp, *epsilon))
                        .collect::<Vec<_>>()
                })
                .map(|near| evaluator.quality(&near.contacts, near.center))
                .fold(f64::INFINITY, f64::min);
            assert_eq!(least, smallest);
        }
    }
}
