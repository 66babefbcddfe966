//! A triangle mesh to be touched from outside.

use glam::DVec3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhNode};
use parry3d_f64::query::{PointQuery, Ray};
use parry3d_f64::shape::Triangle;
use std::borrow::Borrow;
use std::ops::Range;

/// Triangles with less than this area, twice, have no normal, and are not there.
const LEAST_AREA: f64 = 1e-14;
/// A ray this close to a triangle's side, in shares of the triangle, hits it: no ray falls through
/// between two triangles.
const RIM: f64 = 1e-12;

/// Of more triangles than this, so many that lie together share a leaf: else their tree would take
/// more memory than all the rest.
const MANY: usize = 1 << 20;
const TOGETHER: usize = 8;
/// Bits of a place along each axis.
const PLACES: u32 = 16;

/// Triangles, of size about 1 about the origin, in a tree.
pub struct Mesh {
    tree: Bvh,
    /// Triangles in a leaf, one after the other.
    together: usize,
    vertices: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
    /// Twice the area of all triangles up to each.
    areas: Vec<f64>,
}

/// What a ray hits first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Along the ray.
    pub distance: f64,
    /// The number of the triangle.
    pub face: usize,
}

/// Where a ball that moves along a line is stopped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// How far its centre has come.
    pub distance: f64,
    /// The point of the mesh.
    pub point: DVec3,
}

fn to_parry(v: DVec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

impl Mesh {
    /// From vertices and triples of their numbers, each less than the number of vertices. Of more
    /// than a million triangles the numbers are by place.
    pub fn new(vertices: &[[f64; 3]], faces: impl IntoIterator<Item: Borrow<[usize; 3]>>) -> Self {
        let mut mesh = Self {
            tree: Bvh::new(),
            together: 1,
            vertices: vertices.iter().map(|&vertex| vertex.into()).collect(),
            faces: Vec::new(),
            areas: Vec::new(),
        };
        for face in faces {
            let face = face.borrow().map(|vertex| vertex as u32);
            if mesh.across(face).length() > LEAST_AREA {
                mesh.faces.push(face);
            }
        }
        if mesh.len() > MANY {
            mesh.together = TOGETHER;
            mesh.sort_by_place();
        }
        let mut total = 0.0;
        mesh.areas.reserve_exact(mesh.len());
        for face in 0..mesh.len() {
            total += mesh.across(mesh.faces[face]).length();
            mesh.areas.push(total);
        }
        let leaves = (0..mesh.len().div_ceil(mesh.together)).map(|leaf| {
            let corners = mesh.leaf(leaf as u32).flat_map(|face| mesh.triangle(face));
            let (low, high) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| {
                (l.min(p), h.max(p))
            });
            // Of flat boxes rounding would lose rays.
            let rim = Vector::splat(RIM);
            Aabb::new(to_parry(low) - rim, to_parry(high) + rim)
        });
        mesh.tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &leaves.collect::<Vec<_>>());
        mesh
    }

    /// Neighbours get neighbouring numbers: by their middles' places on a Z-curve (G. Morton, 1966).
    fn sort_by_place(&mut self) {
        let low = self
            .vertices
            .iter()
            .copied()
            .fold(DVec3::INFINITY, DVec3::min);
        let high = self
            .vertices
            .iter()
            .copied()
            .fold(DVec3::NEG_INFINITY, DVec3::max);
        let steps = f64::from((1 << PLACES) - 1) / (high - low).max_element();
        let place = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|vertex| self.vertices[vertex as usize]);
            let at = ((a + b + c) / 3.0 - low) * steps;
            at.to_array()
                .iter()
                .enumerate()
                .fold(0, |code, (axis, &x)| code | (spaced(x as u64) << axis))
        };
        let mut keyed: Vec<_> = self.faces.iter().map(|face| (place(face), *face)).collect();
        keyed.sort_unstable();
        // So do their corners, that few places in memory are visited for a leaf.
        let mut number = vec![u32::MAX; self.vertices.len()];
        let mut vertices = Vec::with_capacity(self.vertices.len());
        self.faces.clear();
        self.faces.extend(keyed.into_iter().map(|(_, face)| {
            face.map(|vertex| {
                let new = &mut number[vertex as usize];
                if *new == u32::MAX {
                    *new = vertices.len() as u32;
                    vertices.push(self.vertices[vertex as usize]);
                }
                *new
            })
        }));
        self.vertices = vertices;
    }

    /// Number of triangles that have an area.
    pub fn len(&self) -> usize {
        self.faces.len()
    }

    /// Has no triangle an area?
    pub fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    fn triangle(&self, face: usize) -> [DVec3; 3] {
        self.faces[face].map(|vertex| self.vertices[vertex as usize])
    }

    /// Normal to a triangle, as long as twice its area.
    fn across(&self, face: [u32; 3]) -> DVec3 {
        let [a, b, c] = face.map(|vertex| self.vertices[vertex as usize]);
        (b - a).cross(c - a)
    }

    /// The triangles in a leaf of the tree.
    fn leaf(&self, leaf: u32) -> Range<usize> {
        let first = leaf as usize * self.together;
        first..(first + self.together).min(self.len())
    }

    /// The unit normal of a triangle, on the side from which it is wound counterclockwise.
    pub fn normal(&self, face: usize) -> DVec3 {
        let across = self.across(self.faces[face]);
        across / across.length()
    }

    /// The unit normal of a triangle that points along a direction.
    pub fn normal_along(&self, face: usize, way: DVec3) -> DVec3 {
        let normal = self.normal(face);
        if normal.dot(way) < 0.0 {
            -normal
        } else {
            normal
        }
    }

    /// The first triangle that a ray hits, from either side.
    pub fn ray(&self, start: DVec3, way: DVec3) -> Option<Hit> {
        let ray = Ray::new(to_parry(start), to_parry(way));
        let reach = |node: &BvhNode, best: f64| node.cast_ray(&ray, best);
        let hit = |leaf: u32, _: f64| {
            first(self.leaf(leaf).filter_map(|face| {
                crossing(&self.triangle(face), start, way).map(|distance| (distance, face))
            }))
        };
        let found = self.tree.find_best(f64::MAX, reach, hit);
        found.map(|(_, (distance, face))| Hit { distance, face })
    }

    /// Where a ball that starts clear of the mesh and moves along a unit vector first touches it.
    pub fn sweep(&self, start: DVec3, way: DVec3, radius: f64) -> Option<Touch> {
        let ray = Ray::new(to_parry(start), to_parry(way));
        let grown = |node: &BvhNode, best: f64| {
            let room = Aabb::new(
                node.mins() - Vector::splat(radius),
                node.maxs() + Vector::splat(radius),
            );
            parry3d_f64::query::RayCast::cast_local_ray(&room, &ray, best, true).unwrap_or(f64::MAX)
        };
        let stop = |leaf: u32, _: f64| {
            first(self.leaf(leaf).filter_map(|face| {
                let normal = self.normal(face);
                ball_stop(&self.triangle(face), normal, start, way, radius)
            }))
        };
        let found = self.tree.find_best(f64::MAX, grown, stop);
        found.map(|(_, (_, touch))| touch)
    }

    /// The point of the mesh nearest to one, and its triangle.
    pub fn nearest(&self, point: DVec3) -> Option<(DVec3, usize)> {
        let at = to_parry(point);
        let reach = |node: &BvhNode, _: f64| node.aabb().distance_to_local_point(at, true);
        let near = |leaf: u32, _: f64| {
            first(self.leaf(leaf).map(|face| {
                let [a, b, c] = self.triangle(face).map(to_parry);
                let near = Triangle::new(a, b, c).project_local_point(at, true).point;
                (near.distance(at), (near, face))
            }))
        };
        let found = self.tree.find_best(f64::MAX, reach, near);
        found.map(|(_, (_, (near, face)))| (DVec3::new(near.x, near.y, near.z), face))
    }

    /// The point at a share of the area of all triangles, and at (a, b) of the unit square in its
    /// triangle; and the number of that.
    pub fn at_area(&self, share: f64, [a, b]: [f64; 2]) -> (DVec3, usize) {
        let wanted = share * self.areas[self.areas.len() - 1];
        let face = self.areas.partition_point(|&area| area < wanted);
        let face = face.min(self.len() - 1);
        let (a, b) = if a + b > 1.0 {
            (1.0 - a, 1.0 - b)
        } else {
            (a, b)
        };
        let [p, q, r] = self.triangle(face);
        (p + (q - p) * a + (r - p) * b, face)
    }
}

/// The one with the least distance; of equals the first.
fn first<T>(found: impl Iterator<Item = (f64, T)>) -> Option<(f64, T)> {
    found.min_by(|one, other| one.0.total_cmp(&other.0))
}

/// The bits of a number, with room for two others' between each two.
fn spaced(number: u64) -> u64 {
    (0..PLACES).fold(0, |code, bit| code | ((number >> bit) & 1) << (3 * bit))
}

/// Where a ray crosses a triangle (T. Möller, B. Trumbore, Fast minimum storage ray-triangle
/// intersection, 1997).
fn crossing([a, b, c]: &[DVec3; 3], start: DVec3, way: DVec3) -> Option<f64> {
    let (one, two) = (b - a, c - a);
    let p = way.cross(two);
    let det = one.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = start - a;
    let u = s.dot(p) / det;
    if !(-RIM..=1.0 + RIM).contains(&u) {
        return None;
    }
    let q = s.cross(one);
    let v = way.dot(q) / det;
    if !(v >= -RIM && u + v <= 1.0 + RIM) {
        return None;
    }
    let distance = two.dot(q) / det;
    (distance >= 0.0).then_some(distance)
}

/// Where a moving ball is stopped by a triangle: by its inside, or one of its sides or corners.
///
/// In closed form: the general sweep of shapes in parry takes fifteen times as long and more.
fn ball_stop(
    corners: &[DVec3; 3],
    normal: DVec3,
    start: DVec3,
    way: DVec3,
    radius: f64,
) -> Option<(f64, Touch)> {
    let slope = normal.dot(way);
    if slope != 0.0 {
        // The side that looks at the ball.
        let outward = if slope > 0.0 { -normal } else { normal };
        let distance = ((corners[0] - start).dot(outward) + radius) / outward.dot(way);
        let point = start + way * distance - outward * radius;
        let inside = (0..3).all(|k| {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            (b - a).cross(point - a).dot(normal) >= 0.0
        });
        // A face is met before its sides.
        if inside && distance >= 0.0 {
            return Some((distance, Touch { distance, point }));
        }
    }
    let mut best: Option<Touch> = None;
    let mut offer = |distance: f64, point: DVec3| {
        if distance >= 0.0 && best.is_none_or(|touch| distance < touch.distance) {
            best = Some(Touch { distance, point });
        }
    };
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let side = b - a;
        let length = side.length();
        let along = side / length;
        let off = start - a;
        let across = way - along * way.dot(along);
        if let Some(distance) = closes(across, off - along * off.dot(along), radius) {
            let share = (off + way * distance).dot(along);
            if share >= 0.0 && share <= length {
                offer(distance, a + along * share);
            }
        }
        if let Some(distance) = closes(way, off, radius) {
            offer(distance, a);
        }
    }
    best.map(|touch| (touch.distance, touch))
}

/// The first t with |off + t way| = radius.
fn closes(way: DVec3, off: DVec3, radius: f64) -> Option<f64> {
    let a = way.length_squared();
    let b = way.dot(off);
    let root = b * b - a * (off.length_squared() - radius * radius);
    (a > 0.0 && root >= 0.0).then(|| (-b - root.sqrt()) / a)
}
