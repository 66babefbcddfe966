//! Where fingers may go.

use crate::vectors;
use graspmoduli::glam::DVec3;
use graspmoduli::limits::{self, Zone};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

/// Is it a box, and its corners; else a point and the normal of a half-space.
type ZoneRow = (bool, [f64; 3], [f64; 3]);

/// Opening, distance of the tips' middles, their radius and way, direction and cosine of the
/// approach, obstacles, wanted and unwanted zones.
pub struct Limits(pub limits::Limits);

impl<'a, 'py> FromPyObject<'a, 'py> for Limits {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        type Given = (
            [f64; 2],
            f64,
            f64,
            f64,
            Option<([f64; 3], f64)>,
            Vec<ZoneRow>,
            Vec<ZoneRow>,
            Vec<ZoneRow>,
        );
        let (opening, apart, radius, way, approach, obstacles, wanted, unwanted): Given =
            given.extract()?;
        Ok(Self(limits::Limits {
            opening,
            apart,
            radius,
            way,
            approach: approach.map(|(direction, cosine)| (direction.into(), cosine)),
            obstacles: zones(obstacles),
            wanted: zones(wanted),
            unwanted: zones(unwanted),
        }))
    }
}

fn zones(rows: Vec<ZoneRow>) -> Vec<Zone> {
    rows.into_iter()
        .map(|(is_box, one, other)| {
            if is_box {
                Zone::Box {
                    low: one.into(),
                    high: other.into(),
                }
            } else {
                Zone::HalfSpace {
                    point: one.into(),
                    normal: other.into(),
                }
            }
        })
        .collect()
}

/// Which fingers may press at points along normals, (n, 3) each, by themselves.
#[pyfunction]
pub fn places_allowed<'py>(
    py: Python<'py>,
    limits: Limits,
    points: PyReadonlyArray2<'py, f64>,
    normals: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let pressed = pressed(points.as_slice()?, normals.as_slice()?);
    let allowed = pressed.iter().map(|&(p, n)| limits.0.allows(p, n));
    Ok(PyArray1::from_iter(py, allowed))
}

/// Which pairs of them may be in a grasp together: 1 or 0, (n, n).
#[pyfunction]
pub fn pairs_allowed<'py>(
    py: Python<'py>,
    limits: Limits,
    points: PyReadonlyArray2<'py, f64>,
    normals: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<bool>>> {
    let pressed = pressed(points.as_slice()?, normals.as_slice()?);
    let row = |i: usize| -> Vec<bool> {
        (0..pressed.len())
            .map(|j| i != j && limits.0.allows_pair(pressed[i], pressed[j]))
            .collect()
    };
    let rows: Vec<_> = (0..pressed.len()).map(row).collect();
    Ok(PyArray2::from_vec2(py, &rows)?)
}

fn pressed(points: &[f64], normals: &[f64]) -> Vec<(DVec3, DVec3)> {
    let pairs = vectors(points).iter().zip(vectors(normals));
    pairs.map(|(&p, &n)| (p.into(), n.into())).collect()
}
