//! Fingertips pressed on meshes: against slow twins, moved and scaled, and on what is no mesh.
#![cfg(feature = "objects")]

use glam::{DMat3, DVec3};
use graspmoduli::contact::FrictionCone;
use graspmoduli::limits::Limits;
use graspmoduli::places::{Place, Wanted};
use graspmoduli::touch::map::map;
use graspmoduli::touch::mesh::Mesh;
use graspmoduli::touch::polish::ROUNDS;
use graspmoduli::touch::press::Tip;
use graspmoduli::touch::search::grasps;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use std::sync::atomic::AtomicBool;

struct Random(ChaCha8Rng);

impl Random {
    fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    fn number(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn numbers(&mut self, count: usize) -> Vec<[f64; 3]> {
        (0..count)
            .map(|_| [self.number(), self.number(), self.number()])
            .collect()
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(self.number(), self.number(), self.number()) * 2.0 - 1.0;
            if v.length() > 0.1 && v.length() < 1.0 {
                return v.normalize();
            }
        }
    }

    fn rotation(&mut self) -> DMat3 {
        let x = self.direction();
        let y = x.cross(self.direction()).normalize();
        DMat3::from_cols(x, y, x.cross(y))
    }
}

type Faces = Vec<[usize; 3]>;

/// An ellipsoid of triangles.
fn ellipsoid(rows: usize, columns: usize, radii: [f64; 3]) -> (Vec<[f64; 3]>, Faces) {
    let (mut vertices, mut faces) = (vec![], vec![]);
    for row in 0..=rows {
        let (s, c) = graspmoduli::math::sin_cos(std::f64::consts::PI * row as f64 / rows as f64);
        for column in 0..columns {
            let turn = std::f64::consts::TAU * column as f64 / columns as f64;
            let (sin, cos) = graspmoduli::math::sin_cos(turn);
            vertices.push([radii[0] * s * cos, radii[1] * s * sin, radii[2] * c]);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let next = (column + 1) % columns;
            let (a, b) = (row * columns, (row + 1) * columns);
            faces.push([a + column, b + column, a + next]);
            faces.push([a + next, b + column, b + next]);
        }
    }
    (vertices, faces)
}

/// A box with two triangles a side.
fn cuboid([x, y, z]: [f64; 3]) -> (Vec<[f64; 3]>, Faces) {
    let vertices = (0..8)
        .map(|k| {
            [
                if k & 1 == 0 { -x } else { x },
                if k & 2 == 0 { -y } else { y },
                if k & 4 == 0 { -z } else { z },
            ]
        })
        .collect();
    let quads = [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ];
    let faces = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    (vertices, faces)
}

/// A heap of triangles at random.
fn heap(count: usize, seed: u64) -> (Vec<[f64; 3]>, Faces) {
    let mut random = Random::new(seed);
    let (mut vertices, mut faces) = (vec![], vec![]);
    for k in 0..count {
        let middle = DVec3::from(random.numbers(1)[0]) - 0.5;
        for _ in 0..3 {
            vertices.push((middle + random.direction() * 0.2 * random.number()).to_array());
        }
        faces.push([3 * k, 3 * k + 1, 3 * k + 2]);
    }
    (vertices, faces)
}

/// The smallest distance at which a ray crosses any triangle: by solving for its plane's
/// coordinates.
fn slow_ray(vertices: &[[f64; 3]], faces: &Faces, start: DVec3, way: DVec3) -> Option<f64> {
    let mut best: Option<f64> = None;
    for face in faces {
        let [a, b, c] = face.map(|v| DVec3::from(vertices[v]));
        let system = DMat3::from_cols(b - a, c - a, -way);
        if system.determinant().abs() < 1e-15 {
            continue;
        }
        let found = system.inverse() * (start - a);
        let inside = found.x >= 0.0 && found.y >= 0.0 && found.x + found.y <= 1.0;
        if inside && found.z >= 0.0 && best.is_none_or(|t| found.z < t) {
            best = Some(found.z);
        }
    }
    best
}

/// The distance of a triangle by ternary search.
fn slow_distance([a, b, c]: [DVec3; 3], p: DVec3) -> f64 {
    // Convex in the triangle's own coordinates.
    let along = |s: f64| {
        let (q, r) = (a + (b - a) * s, (c - a) * (1.0 - s));
        let at = |t: f64| (q + r * t - p).length();
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let (one, two) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if at(one) < at(two) {
                high = two;
            } else {
                low = one;
            }
        }
        at(0.5 * (low + high))
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let (one, two) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if along(one) < along(two) {
            high = two;
        } else {
            low = one;
        }
    }
    along(0.5 * (low + high))
}

#[test]
fn rays_are_those_of_all_triangles_one_by_one() {
    let (vertices, faces) = heap(300, 1);
    let mesh = Mesh::new(&vertices, &faces);
    let mut random = Random::new(2);
    let mut hits = 0;
    for _ in 0..2000 {
        let way = random.direction();
        let start = DVec3::from(random.numbers(1)[0]) - 0.5 - way * 2.0;
        let fast = mesh.ray(start, way);
        let slow = slow_ray(&vertices, &faces, start, way);
        assert_eq!(fast.is_some(), slow.is_some());
        if let (Some(fast), Some(slow)) = (fast, slow) {
            assert!(
                (fast.distance - slow).abs() < 1e-12 * 4.0,
                "{} {slow}",
                fast.distance
            );
            hits += 1;
        }
    }
    assert!(hits > 500);
}

#[test]
fn no_ray_falls_through_between_triangles() {
    let (vertices, faces) = ellipsoid(20, 30, [0.5, 0.4, 0.3]);
    let mut random = Random::new(3);
    for _ in 0..20 {
        let turn = random.rotation();
        let moved: Vec<_> = vertices
            .iter()
            .map(|&v| (turn * DVec3::from(v)).to_array())
            .collect();
        let mesh = Mesh::new(&moved, &faces);
        for face in faces.iter().filter(|face| face[0] != face[1]) {
            let [a, b, _] = face.map(|v| DVec3::from(moved[v]));
            // Through the middle of a side, and through a corner.
            for target in [(a + b) / 2.0, a] {
                let way = -target.normalize();
                let hit = mesh.ray(target - way * 2.0, way);
                assert!(hit.is_some_and(|hit| (hit.distance - 2.0).abs() < 1e-9));
            }
        }
    }
}

/// Of more than a million triangles several share a leaf; of either half none do.
#[test]
fn what_millions_of_triangles_say_is_what_their_halves_say() {
    let (vertices, faces) = ellipsoid(760, 760, [0.5, 0.4, 0.3]);
    let mesh = Mesh::new(&vertices, &faces);
    assert!(mesh.len() > 1 << 20);
    let (one, other) = faces.split_at(faces.len() / 2);
    let halves = [one, other].map(|half| Mesh::new(&vertices, half));
    let least = |values: [Option<f64>; 2]| values.into_iter().flatten().reduce(f64::min);
    let mut random = Random::new(11);
    for _ in 0..300 {
        let way = random.direction();
        let start = DVec3::from(random.numbers(1)[0]) - 0.5 - way * 2.0;
        let hits = halves
            .each_ref()
            .map(|half| half.ray(start, way).map(|hit| hit.distance));
        let hit = mesh.ray(start, way);
        assert_eq!(hit.map(|hit| hit.distance), least(hits));
        let near = |mesh: &Mesh| mesh.nearest(start).map(|(near, _)| (near - start).length());
        assert_eq!(near(&mesh), least(halves.each_ref().map(near)));
        if let Some(hit) = hit {
            let [x, y, z] = (start + way * hit.distance).to_array();
            let normal = DVec3::new(x / 0.25, y / 0.16, z / 0.09).normalize();
            assert!(mesh.normal(hit.face).dot(normal).abs() > 0.9999);
        }
    }
    for _ in 0..20 {
        let way = random.direction();
        let start = DVec3::from(random.numbers(1)[0]) - 0.5 - way * 2.0;
        let stop = |mesh: &Mesh| mesh.sweep(start, way, 0.01).map(|touch| touch.distance);
        assert_eq!(stop(&mesh), least(halves.each_ref().map(stop)));
    }
}

#[test]
fn a_ball_stops_where_it_touches_and_not_before() {
    let (vertices, faces) = heap(25, 4);
    let mesh = Mesh::new(&vertices, &faces);
    let mut random = Random::new(5);
    let mut stopped = 0;
    for _ in 0..60 {
        let way = random.direction();
        let start = DVec3::from(random.numbers(1)[0]) - 0.5 - way * 2.0;
        let radius = 0.02 + 0.1 * random.number();
        let gap = |t: f64| {
            let distances = faces.iter().map(|face| {
                let corners = face.map(|v| DVec3::from(vertices[v]));
                slow_distance(corners, start + way * t)
            });
            distances.fold(f64::INFINITY, f64::min) - radius
        };
        match mesh.sweep(start, way, radius) {
            Some(touch) => {
                stopped += 1;
                assert!(gap(touch.distance).abs() < 1e-7, "{}", gap(touch.distance));
                let middle = start + way * touch.distance;
                assert!(((touch.point - middle).length() - radius).abs() < 1e-12);
                for share in [0.6, 0.9, 0.97, 0.999] {
                    assert!(gap(touch.distance * share) > 0.0);
                }
            }
            None => {
                for k in 0..20 {
                    assert!(gap(0.2 * f64::from(k)) > 0.0);
                }
            }
        }
    }
    assert!(stopped > 15);
}

#[test]
fn the_nearest_point_is_that_of_all_triangles() {
    let (vertices, faces) = heap(30, 6);
    let mesh = Mesh::new(&vertices, &faces);
    for point in Random::new(7).numbers(30) {
        let point = DVec3::from(point) * 2.0 - 1.0;
        let slow = faces
            .iter()
            .map(|face| slow_distance(face.map(|v| DVec3::from(vertices[v])), point))
            .fold(f64::INFINITY, f64::min);
        let (near, _) = mesh.nearest(point).unwrap();
        assert!(((near - point).length() - slow).abs() < 1e-7);
    }
}

#[test]
fn a_tip_on_a_plane_feels_the_plane() {
    let (vertices, faces) = cuboid([0.4, 0.4, 0.1]);
    let mesh = Mesh::new(&vertices, &faces);
    let tip = Tip::new(0.05);
    let mut random = Random::new(8);
    for _ in 0..50 {
        let aim = DVec3::new(random.number() - 0.5, random.number() - 0.5, 0.2) * 0.5;
        let pressed = tip.press(&mesh, aim, DVec3::NEG_Z).unwrap();
        assert!((pressed.felt - DVec3::NEG_Z).length() < 1e-14);
        assert!(pressed.blocked.abs() < 1e-12 && pressed.off == 0.0);
        assert!((pressed.landing.unwrap().point.z - 0.1).abs() < 1e-12);
        // Beyond 0.8 of the radius the ball is farther away than its pad is deep.
        assert!((pressed.bearing - 19.0 / 37.0).abs() < 1e-12 || pressed.bearing == 1.0);
    }
    // Past the edge it bears on a part, and far from it on nothing.
    assert!(
        tip.press(&mesh, DVec3::new(0.4, 0.0, 0.1), DVec3::NEG_Z)
            .unwrap()
            .bearing
            < 0.7
    );
    assert!(
        tip.press(&mesh, DVec3::new(0.6, 0.0, 0.1), DVec3::NEG_Z)
            .is_none()
    );
}

/// What is pressed, one ray after the other: all triangles, by the recipe's formulas.
#[test]
fn a_press_is_that_of_its_rays() {
    let (vertices, faces) = heap(300, 9);
    let mesh = Mesh::new(&vertices, &faces);
    let radius = 0.06;
    let tip = Tip::new(radius);
    let mut random = Random::new(10);
    let mut pressed = 0;
    for _ in 0..60 {
        let way = random.direction();
        let aim = DVec3::from(random.numbers(1)[0]) - 0.5;
        let frame = graspmoduli::contact::Frame::new(way);
        let mut rays = vec![];
        for (ring, count) in [(0.0, 1), (0.3, 6), (0.6, 12), (0.9, 18)] {
            for k in 0..count {
                let turn = std::f64::consts::TAU * f64::from(k) / f64::from(count);
                let (sin, cos) = graspmoduli::math::sin_cos(turn);
                let rho: f64 = ring * radius;
                let at = aim + (frame.tangents[0] * cos + frame.tangents[1] * sin) * rho;
                let Some(t) = slow_ray(&vertices, &faces, at - way * 2.0, way) else {
                    continue;
                };
                let hit = mesh.ray(at - way * 2.0, way).unwrap();
                let depth = t + radius - (radius * radius - rho * rho).sqrt();
                rays.push((
                    k == 0 && ring == 0.0,
                    depth,
                    mesh.normal_along(hit.face, way),
                ));
            }
        }
        let Some(found) = tip.press(&mesh, aim, way) else {
            assert!(rays.is_empty());
            continue;
        };
        pressed += 1;
        let front = rays.iter().map(|r| r.1).fold(f64::INFINITY, f64::min);
        let felt: DVec3 = rays
            .iter()
            .map(|&(_, depth, n)| n * (1.0 - (depth - front) / (0.25 * radius)).max(0.0))
            .sum();
        assert!((felt.normalize() - found.felt).length() < 1e-9);
        let under: Vec<_> = rays.iter().filter(|r| r.1 - front < 0.6 * radius).collect();
        let off = under
            .iter()
            .filter(|r| r.2.dot(found.felt) <= 0.75_f64.sqrt());
        assert!((off.count() as f64 / under.len() as f64 - found.off).abs() < 1e-12);
        match rays.iter().find(|r| r.0) {
            Some(middle) => {
                assert!(((middle.1 - front) / radius - found.blocked).abs() < 1e-9);
            }
            None => assert!(found.blocked.is_infinite() && found.landing.is_none()),
        }
    }
    assert!(pressed > 30);
}

fn found(mesh: &Mesh, random: &[[f64; 3]], threads: usize) -> Vec<(Vec<Place>, f64)> {
    let tip = Tip::new(0.05);
    let cone = FrictionCone::new(1.0, 8).unwrap();
    let wanted = Wanted {
        cone: &cone,
        center: DVec3::ZERO,
        scale: 2.0,
        fingers: 3,
        top: 3,
        apart: 0.075,
        errors: 0.025,
        task: &[],
        rounds: ROUNDS,
        limits: &Limits::none(),
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    pool.install(|| {
        let places = map(mesh, &tip, random);
        grasps(
            mesh,
            &tip,
            &places,
            &wanted,
            threads,
            &AtomicBool::new(false),
        )
        .unwrap()
        .into_iter()
        .map(|grasp| (grasp.places, grasp.quality))
        .collect()
    })
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let (vertices, faces) = ellipsoid(16, 24, [0.5, 0.3, 0.2]);
    let mesh = Mesh::new(&vertices, &faces);
    let random = Random::new(11).numbers(400);
    let one = found(&mesh, &random, 1);
    assert!(one.len() >= 3 && one[0].1 > 0.1);
    for threads in [2, 5] {
        assert_eq!(found(&mesh, &random, threads), one);
    }
}

#[test]
fn winding_does_not_matter() {
    let (vertices, faces) = ellipsoid(16, 24, [0.5, 0.3, 0.2]);
    let mut random = Random::new(12);
    let other: Faces = faces
        .iter()
        .map(|&[a, b, c]| {
            if random.number() < 0.5 {
                [a, c, b]
            } else {
                [a, b, c]
            }
        })
        .collect();
    let tip = Tip::new(0.05);
    for _ in 0..100 {
        let (way, aim) = (random.direction(), DVec3::from(random.numbers(1)[0]) - 0.5);
        let one = tip.press(&Mesh::new(&vertices, &faces), aim, way);
        let two = tip.press(&Mesh::new(&vertices, &other), aim, way);
        assert_eq!(one.is_some(), two.is_some());
        if let (Some(one), Some(two)) = (one, two) {
            assert!((one.felt - two.felt).length() < 1e-12);
            assert_eq!((one.off, one.bearing), (two.off, two.bearing));
            assert!(one.blocked == two.blocked || (one.blocked - two.blocked).abs() < 1e-9);
        }
    }
}

#[test]
fn a_turned_object_is_pressed_alike() {
    let (vertices, faces) = cuboid([0.5, 0.3, 0.2]);
    let mesh = Mesh::new(&vertices, &faces);
    let tip = Tip::new(0.05);
    let mut random = Random::new(13);
    let places = map(&mesh, &tip, &random.numbers(300));
    assert!(places.len() > 100);
    for _ in 0..5 {
        let turn = random.rotation();
        let moved: Vec<_> = vertices
            .iter()
            .map(|&v| (turn * DVec3::from(v)).to_array())
            .collect();
        let other = Mesh::new(&moved, &faces);
        for place in &places {
            let pressed = tip
                .press(&other, turn * place.point, turn * place.normal)
                .unwrap();
            // On a face the tip feels the face, wherever its rays are.
            assert!((pressed.felt - turn * place.normal).length() < 1e-12);
            let landing = pressed.landing.unwrap();
            assert!((landing.point - turn * place.point).length() < 1e-12);
        }
    }
}

#[test]
fn what_is_no_surface_gives_no_places() {
    let tip = Tip::new(0.05);
    let random = Random::new(14).numbers(100);
    let flat = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
    for faces in [vec![], vec![[0, 1, 2]], vec![[0, 0, 0], [1, 1, 2]]] {
        let mesh = Mesh::new(&flat, &faces);
        assert!(mesh.is_empty());
        assert!(map(&mesh, &tip, &random).is_empty());
        assert!(mesh.ray(DVec3::Z, DVec3::NEG_Z).is_none());
        assert!(mesh.sweep(DVec3::Z, DVec3::NEG_Z, 0.1).is_none());
        assert!(mesh.nearest(DVec3::Z).is_none());
        assert!(found(&mesh, &random, 1).is_empty());
    }
}

#[test]
fn one_triangle_plates_and_needles_do_not_fail() {
    let random = Random::new(15).numbers(300);
    let single = Mesh::new(
        &[[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0]],
        [[0, 1, 2], [0, 0, 1]],
    );
    assert_eq!(single.len(), 1);
    found(&single, &random, 1);
    for shape in [[0.5, 0.5, 1e-6], [0.5, 1e-3, 1e-3], [0.5, 0.5, 0.5]] {
        let (vertices, faces) = cuboid(shape);
        for (places, quality) in found(&Mesh::new(&vertices, &faces), &random, 1) {
            assert!(quality > 0.0);
            for place in places {
                let surface = (0..3).map(|k| (place.point[k].abs() - shape[k]).abs());
                assert!(surface.fold(f64::INFINITY, f64::min) < 1e-12);
            }
        }
    }
}

#[test]
fn a_box_is_held_at_its_faces() {
    let (vertices, faces) = cuboid([0.29, 0.29, 0.29]);
    let grasps = found(
        &Mesh::new(&vertices, &faces),
        &Random::new(16).numbers(1000),
        2,
    );
    assert!(grasps.len() >= 3);
    for (places, quality) in grasps {
        assert!(quality > 0.3);
        for place in places {
            let away = place.point.abs();
            assert_eq!(
                (0..3).filter(|&k| away[k] > 0.29 - 0.02).count(),
                1,
                "{away}"
            );
        }
    }
}
