//! Random grasps in the domain D(1) and near each other.

use crate::{Cone, raise, table};
use graspmoduli::contact::Contact;
use graspmoduli::domain::{self, Configuration, Stream};
use numpy::{
    PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray2, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

/// c_1, c_2, c_3, n_1, n_2, n_3, z.
fn row(grasp: &Configuration) -> [f64; 21] {
    let points = grasp.contacts.map(|c| c.point);
    let normals = grasp.contacts.map(|c| c.normal);
    let mut row = [0.0; 21];
    let vectors = points.iter().chain(&normals).chain([&grasp.center]);
    for (slot, vector) in row.chunks_exact_mut(3).zip(vectors) {
        slot.copy_from_slice(&vector.to_array());
    }
    row
}

/// The first `count` grasps of a stream, uniform in D(1): a row each.
#[pyfunction]
pub fn random_grasps(
    py: Python<'_>,
    seed: u64,
    number: u64,
    count: usize,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let rows = py.detach(|| {
        let mut stream = Stream::new(seed, number);
        (0..count).map(|_| row(&stream.grasp())).collect()
    });
    table(py, rows)
}

/// `samples` grasps of N_ε of every row, one row after the other.
#[pyfunction]
pub fn grasps_near<'py>(
    py: Python<'py>,
    grasps: PyReadonlyArray2<'py, f64>,
    epsilon: f64,
    samples: usize,
    seed: u64,
    number: u64,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rows: &[[f64; 21]] = grasps.as_slice()?.as_chunks().0;
    let near = py.detach(|| {
        let mut stream = Stream::new(seed, number);
        let mut near = Vec::with_capacity(rows.len() * samples);
        for values in rows {
            let v: &[[f64; 3]] = values.as_chunks().0;
            let grasp = Configuration {
                contacts: [0, 1, 2].map(|i| Contact {
                    point: v[i].into(),
                    normal: v[3 + i].into(),
                }),
                center: v[6].into(),
            };
            near.extend((0..samples).map(|_| row(&stream.near(&grasp, epsilon))));
        }
        near
    });
    table(py, near)
}

/// Fills rows c_1, …, c_m, n_1, …, n_m, z with configurations uniform in D(r).
#[pyfunction]
pub fn fill_configurations(
    py: Python<'_>,
    mut rows: PyReadwriteArray2<'_, f64>,
    radius: f64,
    seed: u64,
) -> PyResult<()> {
    let width = rows.shape()[1];
    let rows = rows.as_slice_mut()?;
    py.detach(|| {
        let mut stream = Stream::new(seed, 0);
        for row in rows.chunks_exact_mut(width) {
            stream.configuration(radius, row);
        }
    });
    Ok(())
}

/// The stream of neighbours, apart from those of the configurations.
const NEARBY: u64 = u64::MAX;

/// Fills rows with configurations uniform in N_ε of a given one.
#[pyfunction]
pub fn fill_nearby(
    py: Python<'_>,
    given: PyReadonlyArray1<'_, f64>,
    epsilon: f64,
    mut rows: PyReadwriteArray2<'_, f64>,
    seed: u64,
) -> PyResult<()> {
    let given = given.as_slice()?;
    let rows = rows.as_slice_mut()?;
    py.detach(|| {
        let mut stream = Stream::new(seed, NEARBY);
        for row in rows.chunks_exact_mut(given.len()) {
            stream.nearby(given, epsilon, row);
        }
    });
    Ok(())
}

/// Of the first `count` grasps of a stream: unstable ones, those strictly outside, numbers at or
/// above thresholds, histogram, largest Q_l.
type Surveyed = (u64, u64, Vec<u64>, Vec<u64>, f64);

#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the kernel's arguments, flat")]
pub fn survey(
    py: Python<'_>,
    seed: u64,
    number: u64,
    count: usize,
    friction: f64,
    edges: usize,
    thresholds: Vec<f64>,
    bins: usize,
    width: f64,
) -> PyResult<Surveyed> {
    let Cone(cone) = Cone::new(&[friction], edges, 0.0, false)?;
    let found = py.detach(|| {
        let mut stream = Stream::new(seed, number);
        domain::survey(&mut stream, count, &cone, &thresholds, bins, width)
    });
    let found = found.map_err(raise)?;
    Ok((
        found.unstable,
        found.outside,
        found.at_least,
        found.histogram,
        found.largest,
    ))
}

/// The smallest Q_l near the grasps of a stream with Q_l ≥ `threshold`, for every neighbourhood
/// (ε, number of its stream).
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the kernel's arguments, flat")]
pub fn smallest_nearby(
    py: Python<'_>,
    seed: u64,
    number: u64,
    count: usize,
    friction: f64,
    edges: usize,
    threshold: f64,
    samples: usize,
    neighbourhoods: Vec<(f64, u64)>,
) -> PyResult<(u64, Vec<f64>)> {
    let Cone(cone) = Cone::new(&[friction], edges, 0.0, false)?;
    Ok(py.detach(|| {
        let mut streams: Vec<_> = neighbourhoods
            .into_iter()
            .map(|(epsilon, number)| (epsilon, Stream::new(seed, number)))
            .collect();
        let mut stream = Stream::new(seed, number);
        domain::smallest_nearby(&mut stream, count, &cone, threshold, samples, &mut streams)
    }))
}
