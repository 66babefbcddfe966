//! Fingertips pressed on triangle meshes of size 1 about the origin.

use crate::limits::Limits;
use crate::pool::{detached, interruptible};
use crate::{Cone, table, vectors};
use graspmoduli::contact::FrictionCone;
use graspmoduli::places::{Place, Wanted};
use graspmoduli::touch::map;
use graspmoduli::touch::mesh;
use graspmoduli::touch::polish;
use graspmoduli::touch::press::{Pressed, Tip};
use graspmoduli::touch::search::{self, Found};
use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;

/// A point, a normal, the share of the pad that is off, that which bears, and is it steady.
type PlaceRow = [f64; 9];

/// A grasp: places (m, 9); Q_l as felt, by exact normals, by balls, held share and low quantile
/// under errors; distance, cosine and clearance of each contact, (m, 3).
type FoundGrasp<'py> = (
    Bound<'py, PyArray2<f64>>,
    [f64; 5],
    Bound<'py, PyArray2<f64>>,
);

/// What grasps are looked for: cone, centre of mass, size over length scale, fingers, how many,
/// how far they are apart, errors of aim, are
/// they polished, where fingers may go, the task.
#[derive(FromPyObject)]
pub struct Request(
    Cone,
    [f64; 3],
    f64,
    usize,
    usize,
    f64,
    f64,
    bool,
    Limits,
    Vec<[f64; 6]>,
);

impl Request {
    fn wanted<'a>(&'a self, cone: &'a FrictionCone) -> Wanted<'a> {
        Wanted {
            cone,
            center: self.1.into(),
            scale: self.2,
            fingers: self.3,
            top: self.4,
            apart: self.5,
            errors: self.6,
            rounds: if self.7 { polish::ROUNDS } else { 0 },
            limits: &self.8.0,
            task: &self.9,
        }
    }
}

/// A triangle mesh that can be touched from outside.
#[pyclass(frozen)]
pub struct Mesh(mesh::Mesh);

#[pymethods]
impl Mesh {
    #[new]
    fn new(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        faces: PyReadonlyArray2<'_, i64>,
    ) -> PyResult<Self> {
        let vertices = vectors(vertices.as_slice()?);
        let faces: &[[i64; 3]] = faces.as_slice()?.as_chunks().0;
        Ok(Self(py.detach(|| {
            let faces = faces.iter().map(|face| face.map(|v| v as usize));
            mesh::Mesh::new(vertices, faces)
        })))
    }

    /// Number of triangles that have an area.
    fn __len__(&self) -> usize {
        self.0.len()
    }

    /// Per ray: distance to the first hit and its triangle's normal; NaN where there is none.
    fn rays<'py>(
        &self,
        py: Python<'py>,
        starts: PyReadonlyArray2<'py, f64>,
        ways: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let pairs = pairs(starts.as_slice()?, ways.as_slice()?);
        let rows = detached(py, || {
            let row = |&(start, way): &([f64; 3], [f64; 3])| {
                let Some(hit) = self.0.ray(start.into(), way.into()) else {
                    return [f64::NAN; 4];
                };
                let normal = self.0.normal(hit.face);
                [hit.distance, normal.x, normal.y, normal.z]
            };
            pairs.par_iter().map(row).collect()
        });
        table(py, rows)
    }

    /// Per ball that comes along a way: distance until it is stopped, and the point that stops it.
    fn sweeps<'py>(
        &self,
        py: Python<'py>,
        radius: f64,
        starts: PyReadonlyArray2<'py, f64>,
        ways: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let pairs = pairs(starts.as_slice()?, ways.as_slice()?);
        let rows = detached(py, || {
            let row = |&(start, way): &([f64; 3], [f64; 3])| {
                let Some(touch) = self.0.sweep(start.into(), way.into(), radius) else {
                    return [f64::NAN; 4];
                };
                let point = touch.point;
                [touch.distance, point.x, point.y, point.z]
            };
            pairs.par_iter().map(row).collect()
        });
        table(py, rows)
    }

    /// Per point: the nearest of the mesh.
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = vectors(points.as_slice()?);
        let rows = detached(py, || {
            let row = |&point: &[f64; 3]| {
                let found = self.0.nearest(point.into());
                found.map_or([f64::NAN; 3], |(near, _)| near.to_array())
            };
            points.par_iter().map(row).collect()
        });
        table(py, rows)
    }

    /// Per tip pressed at a point along a way: where its middle lands and the normal there, the
    /// normal felt, blocked, off, bearing; NaN where nothing is touched.
    fn press<'py>(
        &self,
        py: Python<'py>,
        radius: f64,
        aims: PyReadonlyArray2<'py, f64>,
        ways: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let pairs = pairs(aims.as_slice()?, ways.as_slice()?);
        let rows = detached(py, || {
            let tip = Tip::new(radius);
            let row = |&(aim, way): &([f64; 3], [f64; 3])| {
                let pressed = tip.press(&self.0, aim.into(), way.into());
                pressed.map_or([f64::NAN; 12], pressed_row)
            };
            pairs.par_iter().map(row).collect()
        });
        table(py, rows)
    }

    /// Tips at points along ways, turned to what they feel: places, NaN where they may not press.
    fn settle<'py>(
        &self,
        py: Python<'py>,
        radius: f64,
        aims: PyReadonlyArray2<'py, f64>,
        ways: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let pairs = pairs(aims.as_slice()?, ways.as_slice()?);
        let rows = detached(py, || {
            let tip = Tip::new(radius);
            let row = |&(aim, way): &([f64; 3], [f64; 3])| {
                let place = map::settle(&self.0, &tip, aim.into(), way.into());
                place.map_or([f64::NAN; 9], |place| place_row(&place))
            };
            pairs.par_iter().map(row).collect()
        });
        table(py, rows)
    }

    /// Places all over the mesh from random numbers (n, 3).
    fn map<'py>(
        &self,
        py: Python<'py>,
        radius: f64,
        random: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let random = vectors(random.as_slice()?);
        let places = detached(py, || map::map(&self.0, &Tip::new(radius), random));
        table(py, places.iter().map(place_row).collect())
    }

    /// Different grasps among places (n, 9), polished and true, best first.
    fn grasps<'py>(
        &self,
        py: Python<'py>,
        radius: f64,
        places: PyReadonlyArray2<'py, f64>,
        request: Request,
        threads: usize,
    ) -> PyResult<Vec<FoundGrasp<'py>>> {
        let cone = &request.0.0;
        let wanted = request.wanted(cone);
        let places = places_of(places.as_slice()?);
        let found = interruptible(py, |stop| {
            search::grasps(&self.0, &Tip::new(radius), &places, &wanted, threads, stop)
        })?;
        found.into_iter().map(|found| grasp(py, found)).collect()
    }

    /// A grasp of m places (m, 9), polished on pads as flat as they are; none if it is not true.
    fn climb<'py>(
        &self,
        py: Python<'py>,
        radius: f64,
        places: PyReadonlyArray2<'py, f64>,
        request: Request,
    ) -> PyResult<Option<FoundGrasp<'py>>> {
        let cone = &request.0.0;
        let wanted = request.wanted(cone);
        let places = places_of(places.as_slice()?);
        let limit = places.iter().map(|place| place.off).fold(0.0, f64::max);
        let found = detached(py, || {
            let tip = Tip::new(radius);
            search::climbed(&self.0, &tip, &places, limit, wanted.rounds, &wanted)
        });
        found.map(|found| grasp(py, found)).transpose()
    }
}

fn pairs(first: &[f64], second: &[f64]) -> Vec<([f64; 3], [f64; 3])> {
    let (first, second) = (vectors(first), vectors(second));
    first.iter().copied().zip(second.iter().copied()).collect()
}

fn place_row(place: &Place) -> PlaceRow {
    let mut row = [0.0; 9];
    row[..3].copy_from_slice(&place.point.to_array());
    row[3..6].copy_from_slice(&place.normal.to_array());
    row[6] = place.off;
    row[7] = place.bearing;
    row[8] = f64::from(u8::from(place.steady));
    row
}

fn places_of(rows: &[f64]) -> Vec<Place> {
    let rows: &[PlaceRow] = rows.as_chunks().0;
    rows.iter()
        .map(|&[x, y, z, a, b, c, off, bearing, steady]| Place {
            point: [x, y, z].into(),
            normal: [a, b, c].into(),
            off,
            bearing,
            steady: steady != 0.0,
        })
        .collect()
}

fn pressed_row(pressed: Pressed) -> [f64; 12] {
    let mut row = [f64::NAN; 12];
    if let Some(landing) = pressed.landing {
        row[..3].copy_from_slice(&landing.point.to_array());
        row[3..6].copy_from_slice(&landing.normal.to_array());
    }
    row[6..9].copy_from_slice(&pressed.felt.to_array());
    row[9..].copy_from_slice(&[pressed.blocked, pressed.off, pressed.bearing]);
    row
}

fn grasp(py: Python<'_>, found: Found) -> PyResult<FoundGrasp<'_>> {
    let checked = found.checked;
    let contacts = checked.contacts.iter();
    let contacts = contacts.map(|c| [c.distance, c.cosine, c.clearance]);
    Ok((
        table(py, found.places.iter().map(place_row).collect())?,
        [
            found.quality,
            checked.exact,
            checked.ball,
            checked.holds,
            checked.low,
        ],
        table(py, contacts.collect())?,
    ))
}
