//! Grasp quality: `graspmoduli/quality.py` and `wrench_space.py`.

use crate::pool::{detached, interruptible};
use crate::{Cone, raise, table, vectors};
use graspmoduli::contact::{Contact, Frame, FrictionCone};
use graspmoduli::error::Error;
use graspmoduli::guarantees;
use graspmoduli::quality::{Batch, Evaluator, Gradient, of_each, of_plane_wrenches, of_wrenches};
use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyReadonlyArray3, PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyInt, PyString};
use std::cell::RefCell;

/// n grasps of m contacts each, from a tuple: contacts and normals (n, m, 3), centres of mass
/// (n, 3) and, where contacts differ, friction coefficients (n, m).
#[derive(FromPyObject)]
pub struct Grasps<'py>(
    PyReadonlyArray3<'py, f64>,
    PyReadonlyArray3<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    Option<PyReadonlyArray2<'py, f64>>,
);

impl Grasps<'_> {
    fn batch(&self) -> PyResult<Batch<'_>> {
        Ok(Batch {
            points: vectors(self.0.as_slice()?),
            normals: vectors(self.1.as_slice()?),
            centers: vectors(self.2.as_slice()?),
            frictions: match &self.3 {
                Some(each) => each.as_slice()?,
                None => &[],
            },
            stop: None,
        })
    }
}

/// Batches of so many grasps, three contacts each, take less time than to start a thread is worth.
const SHORT: usize = 2000;

/// Work on a batch, interruptible if it is long.
fn computed<R: Send>(
    py: Python<'_>,
    batch: Batch<'_>,
    work: impl FnOnce(Batch<'_>) -> Result<R, Error> + Send,
) -> PyResult<R> {
    let many = if batch.points.len() == 3 * batch.centers.len() {
        SHORT
    } else {
        SHORT / 50
    };
    if batch.centers.len() <= many {
        return detached(py, || work(batch)).map_err(raise);
    }
    interruptible(py, |stop| {
        work(Batch {
            stop: Some(stop),
            ..batch
        })
    })
}

/// Is a coordinate 0, or of a size whose powers are numbers? NaN is neither.
#[inline(always)]
fn is_usable(x: f64) -> bool {
    (x.abs() <= 1e60) & ((x == 0.0) | (x.abs() >= 1e-60))
}

/// Is a normal unit to rounding?
#[inline(always)]
fn is_unit([x, y, z]: &[f64; 3]) -> bool {
    (x * x + y * y + z * z - 1.0).abs() < 2e-15
}

fn are_clean(points: &[f64], normals: &[f64], centers: &[f64]) -> bool {
    // Without branches this is as fast as memory.
    let usable = |values: &[f64]| values.iter().fold(true, |all, &x| all & is_usable(x));
    let unit = vectors(normals)
        .iter()
        .fold(true, |all, n| all & is_unit(n));
    unit && usable(points) && usable(centers)
}

/// Are all lengths usable and all normals unit to rounding? If not, Python looks more closely.
#[pyfunction]
pub fn is_clean(
    py: Python<'_>,
    points: PyReadonlyArrayDyn<'_, f64>,
    normals: PyReadonlyArrayDyn<'_, f64>,
    centers: PyReadonlyArrayDyn<'_, f64>,
) -> PyResult<bool> {
    let arrays = (points.as_slice()?, normals.as_slice()?, centers.as_slice()?);
    if arrays.0.len() < 1 << 12 {
        return Ok(are_clean(arrays.0, arrays.1, arrays.2));
    }
    Ok(py.detach(|| are_clean(arrays.0, arrays.1, arrays.2)))
}

thread_local! {
    /// The evaluator of the last single grasp, for the next one with the same cones.
    static LAST: RefCell<Option<([f64; 3], bool, Evaluator)>> = const { RefCell::new(None) };
}

/// Q of one grasp, if everything is as the kernel wants it, down to the types; otherwise `None`,
/// and Python does it with care: checks, converts, broadcasts, or says what is wrong.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "those of the public function")]
pub fn quality_of_one(
    py: Python<'_>,
    contacts: &Bound<'_, PyAny>,
    normals: &Bound<'_, PyAny>,
    center_of_mass: &Bound<'_, PyAny>,
    friction: &Bound<'_, PyAny>,
    edges: &Bound<'_, PyAny>,
    torsion: &Bound<'_, PyAny>,
    norm: &Bound<'_, PyAny>,
    length_scale: &Bound<'_, PyAny>,
) -> PyResult<Option<f64>> {
    let given = || {
        let points = triples(contacts)?;
        let normals = triples(normals)?;
        let center = triple(center_of_mass)?;
        let scale = plain(length_scale, 1.0)?;
        let (friction, edges) = (plain(friction, 1.0)?, whole(edges, 8)?);
        let torsion = plain(torsion, 0.0)? / scale;
        let each = !norm.is_none() && norm.cast::<PyString>().ok()?.to_str().ok()? != "sum";
        let fine = (3..=1 << 12).contains(&edges)
            && (0.0..=1e6).contains(&friction)
            && torsion >= 0.0
            && is_usable(torsion)
            && (!each || norm.eq("each").ok()?)
            && scale > 0.0
            && points.len() == normals.len()
            && !points.is_empty()
            && normals.iter().all(is_unit);
        let by = |v: [f64; 3]| v.map(|x| x / scale);
        let usable = |v: &[f64; 3]| v.iter().all(|&x| is_usable(x) && is_usable(x / scale));
        let clean = fine && usable(&center) && points.iter().all(usable);
        clean.then(|| {
            let contacts: Vec<_> = points
                .into_iter()
                .zip(normals)
                .map(|(point, normal)| Contact {
                    point: by(point).into(),
                    normal: normal.into(),
                })
                .collect();
            (
                contacts,
                by(center),
                [friction, edges as f64, torsion],
                each,
            )
        })
    };
    let Some((contacts, center, cone, each)) = given() else {
        return Ok(None);
    };
    let [friction, edges, torsion] = cone;
    let run = || -> PyResult<Option<f64>> {
        LAST.with_borrow_mut(|last| {
            let mut evaluator = match last.take() {
                Some((known, its, evaluator)) if known == cone && its == each => evaluator,
                _ => Evaluator::new(&Cone::new(&[friction], edges as usize, torsion, each)?.0),
            };
            let value = evaluator.quality(&contacts, center.into());
            // An error with its sentence is the careful way's, too.
            let known = evaluator.take_unconverged().is_none();
            *last = Some((cone, each, evaluator));
            Ok(known.then_some(value))
        })
    };
    // The closed form of few edges is over before the interpreter would be given away.
    let short = contacts.len() == 3 && torsion == 0.0 && edges <= 16.0 && !each;
    if short { run() } else { py.detach(run) }
}

/// A contiguous float64 array of shape (m, 3).
fn triples(value: &Bound<'_, PyAny>) -> Option<Vec<[f64; 3]>> {
    let array = value
        .cast_exact::<PyArray2<f64>>()
        .ok()?
        .try_readonly()
        .ok()?;
    // A slice there is of Fortran's order, too.
    let wanted = array.is_c_contiguous() && array.as_array().ncols() == 3;
    wanted.then(|| Some(vectors(array.as_slice().ok()?).to_vec()))?
}

/// A contiguous float64 array of shape (3,), or a list of three numbers.
fn triple(value: &Bound<'_, PyAny>) -> Option<[f64; 3]> {
    if let Ok(array) = value.cast_exact::<PyArray1<f64>>() {
        return array.try_readonly().ok()?.as_slice().ok()?.try_into().ok();
    }
    let list = value.cast_exact::<pyo3::types::PyList>().ok()?;
    let all = list.iter().map(|x| plain_number(&x));
    all.collect::<Option<Vec<_>>>()?.try_into().ok()
}

/// A Python number, or what `None` stands for.
fn plain(value: &Bound<'_, PyAny>, default: f64) -> Option<f64> {
    if value.is_none() {
        Some(default)
    } else {
        plain_number(value)
    }
}

fn plain_number(value: &Bound<'_, PyAny>) -> Option<f64> {
    let is_number =
        value.is_exact_instance_of::<PyFloat>() || value.is_exact_instance_of::<PyInt>();
    is_number.then(|| value.extract().ok())?
}

fn whole(value: &Bound<'_, PyAny>, default: usize) -> Option<usize> {
    if value.is_none() {
        Some(default)
    } else {
        value.cast_exact::<PyInt>().ok()?.extract().ok()
    }
}

/// Exact Q_l of n grasps, or Q'_l.
#[pyfunction]
pub fn quality<'py>(
    py: Python<'py>,
    grasps: Grasps<'py>,
    cone: Cone,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (cone, batch) = (cone.0, grasps.batch()?);
    let mut out = vec![0.0; batch.centers.len()];
    computed(py, batch, |batch| batch.quality(&cone, &mut out))?;
    Ok(PyArray1::from_vec(py, out))
}

/// Distances of the origin from the boundaries of n hulls of k wrenches, (n, k, 6) or (n, k, 3).
#[pyfunction]
pub fn quality_of_wrenches<'py>(
    py: Python<'py>,
    wrenches: PyReadonlyArray3<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (count, width) = (wrenches.shape()[1], wrenches.shape()[2]);
    let all = wrenches.as_slice()?;
    let out = interruptible(py, |stop| {
        if width == 3 {
            of_each(of_plane_wrenches, all.as_chunks().0, count, stop)
        } else {
            of_each(of_wrenches, all.as_chunks().0, count, stop)
        }
    })?;
    Ok(PyArray1::from_vec(py, out))
}

/// Exact Q_l of n grasps and its gradient: per row value, contacts, normals, centre of mass.
#[pyfunction]
pub fn quality_gradient<'py>(
    py: Python<'py>,
    grasps: Grasps<'py>,
    cone: Cone,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (cone, batch) = (cone.0, grasps.batch()?);
    let width = Gradient::width(grasps.0.as_array().shape()[1]);
    let mut out = vec![0.0; batch.centers.len() * width];
    computed(py, batch, |batch| batch.gradient(&cone, &mut out))?;
    PyArray1::from_vec(py, out).reshape([batch.centers.len(), width])
}

/// Whether Q_l ≥ threshold, of n grasps.
#[pyfunction]
pub fn quality_at_least<'py>(
    py: Python<'py>,
    grasps: Grasps<'py>,
    cone: Cone,
    threshold: f64,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let (cone, batch) = (cone.0, grasps.batch()?);
    let mut out = vec![false; batch.centers.len()];
    computed(py, batch, |batch| {
        batch.is_at_least(&cone, threshold, &mut out)
    })?;
    Ok(PyArray1::from_vec(py, out))
}

/// Index and Q_l of the best of n grasps, or of the worst.
#[pyfunction]
pub fn extreme_quality(
    py: Python<'_>,
    grasps: Grasps<'_>,
    cone: Cone,
    largest: bool,
) -> PyResult<Option<(usize, f64)>> {
    let (cone, batch) = (cone.0, grasps.batch()?);
    computed(py, batch, |batch| {
        if largest {
            batch.largest(&cone)
        } else {
            batch.smallest(&cone)
        }
    })
}

/// Bounds of the quality with circular cones of n grasps.
#[pyfunction]
pub fn circular_quality<'py>(
    py: Python<'py>,
    grasps: Grasps<'py>,
    cone: Cone,
    tolerance: f64,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (cone, batch) = (cone.0, grasps.batch()?);
    let mut out = vec![[0.0; 2]; batch.centers.len()];
    computed(py, batch, |batch| {
        batch.circular(&cone, tolerance, &mut out)
    })?;
    table(py, out)
}

/// Q_l or Q'_l of the first grasp by the expanding polytope, and the normal of the nearest facet.
#[pyfunction]
pub fn weakest(py: Python<'_>, grasps: Grasps<'_>, cone: Cone) -> PyResult<(f64, [f64; 6])> {
    let (cone, batch) = (cone.0, grasps.batch()?);
    let weakest = py.detach(|| {
        let contacts = contacts(batch.points, batch.normals);
        Evaluator::new(&cone).weakest(&contacts, batch.centers[0].into())
    });
    Ok((weakest.quality, weakest.direction))
}

/// A proven radius of the first grasp.
#[pyfunction]
pub fn certified_radius(py: Python<'_>, grasps: Grasps<'_>, cone: Cone) -> PyResult<f64> {
    let (cone, batch) = (cone.0, grasps.batch()?);
    Ok(py.detach(|| guarantees::certified_radius(&contacts(batch.points, batch.normals), &cone)))
}

pub fn contacts(points: &[[f64; 3]], normals: &[[f64; 3]]) -> Vec<Contact> {
    points
        .iter()
        .zip(normals)
        .map(|(&point, &normal)| Contact {
            point: point.into(),
            normal: normal.into(),
        })
        .collect()
}

/// The largest multiple of each grasp's own k loads that it resists: n grasps, loads (n, k, 6).
#[pyfunction]
pub fn task_quality<'py>(
    py: Python<'py>,
    grasps: Grasps<'py>,
    cone: Cone,
    loads: PyReadonlyArray3<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (cone, batch) = (cone.0, grasps.batch()?);
    let each = loads.as_array().shape()[1];
    let loads: &[[f64; 6]] = loads.as_slice()?.as_chunks().0;
    let mut out = vec![0.0; batch.centers.len()];
    computed(py, batch, |batch| batch.task(&cone, loads, each, &mut out))?;
    Ok(PyArray1::from_vec(py, out))
}

/// The same with its gradient: rows as those of [`quality_gradient`].
#[pyfunction]
pub fn task_gradient<'py>(
    py: Python<'py>,
    grasps: Grasps<'py>,
    cone: Cone,
    loads: PyReadonlyArray3<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (cone, batch) = (cone.0, grasps.batch()?);
    let each = loads.as_array().shape()[1];
    let loads: &[[f64; 6]] = loads.as_slice()?.as_chunks().0;
    let width = Gradient::width(grasps.0.as_array().shape()[1]);
    let mut out = vec![0.0; batch.centers.len() * width];
    computed(py, batch, |batch| {
        batch.task_gradient(&cone, loads, each, &mut out)
    })?;
    PyArray1::from_vec(py, out).reshape([batch.centers.len(), width])
}

/// R(n) e₁ and R(n) e₂ of n unit normals. Shape (n, 2, 3).
#[pyfunction]
pub fn tangents<'py>(
    py: Python<'py>,
    normals: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let normals = vectors(normals.as_slice()?);
    let tangents = normals
        .iter()
        .flat_map(|&normal| Frame::new(normal.into()).tangents)
        .flat_map(|tangent| tangent.to_array());
    PyArray1::from_iter(py, tangents).reshape([normals.len(), 2, 3])
}

/// f_ij: the edges of the friction cones of m contacts. Shape (m, l, 3).
#[pyfunction]
pub fn contact_forces<'py>(
    py: Python<'py>,
    normals: PyReadonlyArray2<'py, f64>,
    friction: PyReadonlyArray1<'py, f64>,
    edges: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let normals = vectors(normals.as_slice()?);
    let mut forces = Vec::with_capacity(normals.len() * edges * 3);
    for (&normal, &friction) in normals.iter().zip(friction.as_slice()?) {
        let cone = FrictionCone::new(friction, edges).map_err(raise)?;
        let frame = Frame::new(normal.into());
        forces.extend((0..edges).flat_map(|j| cone.edge(0, &frame, j).to_array()));
    }
    PyArray1::from_vec(py, forces).reshape([normals.len(), edges, 3])
}
