//! A triangle mesh to be touched from outside.

use glam::DVec3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhNode};
use parry3d_f64::query::{PointQuery, Ray};
use parry3d_f64::shape::Triangle;

/// Triangles with less than this area, twice, have no normal, and are not there.
const LEAST_AREA: f64 = 1e-14;
/// A ray this close to a triangle's side, in shares of the triangle, hits it: no ray falls through
/// between two triangles.
const RIM: f64 = 1e-12;

/// Triangles, of size about 1 about the origin, in a tree.
pub struct Mesh {
    tree: Bvh,
    triangles: Vec<[DVec3; 3]>,
    normals: Vec<DVec3>,
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
    /// From vertices and triples of their numbers, each less than the number of vertices.
    pub fn new(vertices: &[[f64; 3]], faces: &[[usize; 3]]) -> Self {
        let mut triangles = Vec::with_capacity(faces.len());
        let mut normals = Vec::with_capacity(faces.len());
        let mut areas = Vec::with_capacity(faces.len());
        let mut total = 0.0;
        for face in faces {
            let triangle = face.map(|vertex| DVec3::from(vertices[vertex]));
            let [a, b, c] = triangle;
            let across = (b - a).cross(c - a);
            let area = across.length();
            if area > LEAST_AREA {
                total += area;
                triangles.push(triangle);
                normals.push(across / area);
                areas.push(total);
            }
        }
        let boxes: Vec<_> = triangles
            .iter()
            .map(|[a, b, c]: &[DVec3; 3]| {
                // Of flat boxes rounding would lose rays.
                let low = to_parry(a.min(*b).min(*c)) - Vector::splat(RIM);
                Aabb::new(low, to_parry(a.max(*b).max(*c)) + Vector::splat(RIM))
            })
            .collect();
        Self {
            tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes),
            triangles,
            normals,
            areas,
        }
    }

    /// Number of triangles that have an area.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Has no triangle an area?
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The unit normal of a triangle, on the side from which it is wound counterclockwise.
    pub fn normal(&self, face: usize) -> DVec3 {
        self.normals[face]
    }

    /// The unit normal of a triangle that points along a direction.
    pub fn normal_along(&self, face: usize, way: DVec3) -> DVec3 {
        let normal = self.normals[face];
        if normal.dot(way) < 0.0 {
            -normal
        } else {
            normal
        }
    }

    /// The first triangle that a ray hits, from either side.
    pub fn ray(&self, start: DVec3, way: DVec3) -> Option<Hit> {
        let ray = Ray::new(to_parry(start), to_parry(way));
        let hit = self.tree.cast_ray(&ray, f64::MAX, |leaf, _| {
            crossing(&self.triangles[leaf as usize], start, way)
        });
        hit.map(|(leaf, distance)| Hit {
            distance,
            face: leaf as usize,
        })
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
            let leaf = leaf as usize;
            ball_stop(
                &self.triangles[leaf],
                self.normals[leaf],
                start,
                way,
                radius,
            )
        };
        let found = self.tree.find_best(f64::MAX, grown, stop);
        found.map(|(_, (_, touch))| touch)
    }

    /// The point of the mesh nearest to one, and its triangle.
    pub fn nearest(&self, point: DVec3) -> Option<(DVec3, usize)> {
        let at = to_parry(point);
        let found = self.tree.project_point(at, f64::MAX, |leaf, _| {
            let [a, b, c] = self.triangles[leaf as usize].map(to_parry);
            Some(Triangle::new(a, b, c).project_local_point(at, true))
        });
        found.map(|(leaf, (_, near))| {
            let near = near.point;
            (DVec3::new(near.x, near.y, near.z), leaf as usize)
        })
    }

    /// The point at a share of the area of all triangles, and at (a, b) of the unit square in its
    /// triangle; and the number of that.
    pub fn at_area(&self, share: f64, [a, b]: [f64; 2]) -> (DVec3, usize) {
        let wanted = share * self.areas[self.areas.len() - 1];
        let face = self.areas.partition_point(|&area| area < wanted);
        let face = face.min(self.triangles.len() - 1);
        let (a, b) = if a + b > 1.0 {
            (1.0 - a, 1.0 - b)
        } else {
            (a, b)
        };
        let [p, q, r] = self.triangles[face];
        (p + (q - p) * a + (r - p) * b, face)
    }
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
