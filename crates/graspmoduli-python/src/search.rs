//! Grasps that are looked for.

use crate::limits::Limits;
use crate::pool::interruptible;
use crate::quality;
use crate::surfaces::Surface;
use crate::{Cone, raise, table, vectors};
use graspmoduli::error::Error;
use graspmoduli::many_fingers;
use graspmoduli::region::{Anywhere, Cells, Region};
use graspmoduli::search;
use graspmoduli::synthesis;
use numpy::{PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use std::ops::ControlFlow;

/// The best of all subsets of `size` of n contacts: indices and qualities. `progress` is called with
/// the numbers of subsets done and in all.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the kernel's arguments, flat")]
pub fn best_subsets<'py>(
    py: Python<'py>,
    contacts: PyReadonlyArray2<'py, f64>,
    normals: PyReadonlyArray2<'py, f64>,
    frictions: Option<PyReadonlyArray1<'py, f64>>,
    center_of_mass: [f64; 3],
    cone: Cone,
    size: usize,
    top: usize,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<(Vec<usize>, f64)>> {
    let Cone(cone) = cone;
    let frictions = match &frictions {
        Some(each) => each.as_slice()?,
        None => &[],
    };
    let contacts = quality::contacts(vectors(contacts.as_slice()?), vectors(normals.as_slice()?));
    let mut failure = None;
    let result = py.detach(|| {
        let report = |done, total| {
            let outcome = Python::attach(|py| {
                py.check_signals()?;
                progress
                    .as_ref()
                    .map_or(Ok(()), |call| call.call1(py, (done, total)).map(drop))
            });
            match outcome {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    failure = Some(error);
                    ControlFlow::Break(())
                }
            }
        };
        let center = center_of_mass.into();
        search::best_subsets(
            &contacts, frictions, center, &cone, size, top, threads, report,
        )
    });
    match (result, failure) {
        (Ok(ranked), _) => Ok(ranked.into_iter().map(|r| (r.indices, r.quality)).collect()),
        (Err(_), Some(error)) => Err(error),
        (Err(Error::Interrupted), None) => Err(PyKeyboardInterrupt::new_err(())),
        (Err(error), None) => Err(raise(error)),
    }
}

/// Synthesized grasps, best first: per row u₁, θ₁, u₂, θ₂, u₃, θ₃, quality.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the kernel's arguments, flat")]
pub fn synthesize<'py>(
    py: Python<'py>,
    surface: &Surface,
    center_of_mass: [f64; 3],
    cone: Cone,
    top: usize,
    starts: usize,
    square: PyReadonlyArray2<'py, f64>,
    allowed: Option<PyReadonlyArray2<'py, bool>>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let Cone(cone) = cone;
    let square = square.as_slice()?.as_chunks().0;
    let cells = cells(allowed.as_ref())?;
    let found = interruptible(py, |stop| {
        synthesis::synthesize(
            &surface.0,
            center_of_mass.into(),
            &cone,
            region(cells.as_ref()),
            top,
            starts,
            square,
            stop,
        )
    })?;
    let rows = found.into_iter().map(|grasp| {
        let [[u1, t1], [u2, t2], [u3, t3]] = grasp.coordinates;
        [u1, t1, u2, t2, u3, t3, grasp.quality]
    });
    table(py, rows.collect())
}

pub fn cells<'a>(allowed: Option<&'a PyReadonlyArray2<'_, bool>>) -> PyResult<Option<Cells<'a>>> {
    let Some(allowed) = allowed else {
        return Ok(None);
    };
    Ok(Some(Cells {
        allowed: allowed.as_slice()?,
        columns: allowed.as_array().ncols(),
    }))
}

pub fn region<'a>(cells: Option<&'a Cells<'a>>) -> &'a dyn Region {
    cells.map_or(&Anywhere, |cells| cells)
}

/// Grasps of any number of fingers within limits, best first: per row u₁, θ₁, …, quality.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the kernel's arguments, flat")]
pub fn synthesize_many<'py>(
    py: Python<'py>,
    surface: &Surface,
    center_of_mass: [f64; 3],
    cone: Cone,
    fingers: usize,
    top: usize,
    square: PyReadonlyArray2<'py, f64>,
    allowed: Option<PyReadonlyArray2<'py, bool>>,
    limits: Limits,
    task: Vec<[f64; 6]>,
    polished: bool,
    threads: usize,
) -> PyResult<Vec<Vec<f64>>> {
    let square: &[[f64; 2]] = square.as_slice()?.as_chunks().0;
    let cells = cells(allowed.as_ref())?;
    let request = many_fingers::Request {
        cone: &cone.0,
        fingers,
        top,
        region: region(cells.as_ref()),
        limits: &limits.0,
        task: &task,
        polished,
    };
    let center = center_of_mass.into();
    let found = interruptible(py, |stop| {
        many_fingers::grasps(&surface.0, center, &request, square, threads, stop)
    })?;
    let row = |(at, quality): (Vec<[f64; 2]>, f64)| {
        let mut row = at.into_flattened();
        row.push(quality);
        row
    };
    Ok(found.into_iter().map(row).collect())
}
