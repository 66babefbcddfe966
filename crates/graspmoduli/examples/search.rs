//! The best three of 100 places on a shape, out of 161,700 triples, and the best grasp anywhere on it.

use graspmoduli::region::Anywhere;
use graspmoduli::search::best_subsets;
use graspmoduli::synthesis::synthesize;
use graspmoduli::{Error, FrictionCone, Surface, math, sampling};
use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;

fn main() -> Result<(), Error> {
    // A wavy column: coefficients row by row, from the bottom up, each row around the axis.
    let wave = |row: usize, column: usize| {
        0.4 + 0.1 * math::sin(0.9 * row as f64) + 0.04 * math::cos(2.0 * column as f64)
    };
    let coefficients = (0..96).map(|k| wave(k / 8, k % 8)).collect();
    let column = Surface::new(-0.8, 0.8, 8, coefficients)?;
    let center = column.integrals().center_of_mass;
    let cone = FrictionCone::new(0.8, 8)?;

    // Any points of the unit square, here of a lattice, become points uniform by area.
    let square: Vec<[f64; 2]> = (0..100)
        .map(|k| {
            [
                (f64::from(k) * 0.754_877) % 1.0,
                (f64::from(k) * 0.569_840) % 1.0,
            ]
        })
        .collect();
    let contacts: Vec<_> = sampling::by_area(&column, &square)
        .into_iter()
        .map(|[u, theta]| column.contact(u, theta))
        .collect();
    let found = best_subsets(&contacts, &[], center, &cone, 3, 1, 2, |_, _| {
        ControlFlow::Continue(())
    })?;
    println!(
        "best of all triples: {:.4} at {:?}",
        found[0].quality, found[0].indices
    );

    let go = AtomicBool::new(false);
    let best = synthesize(&column, center, &cone, &Anywhere, 3, 8, &square, &go)?;
    for grasp in best {
        println!(
            "synthesized: {:.4} at (u, θ) {:.3?}",
            grasp.quality, grasp.coordinates
        );
    }
    Ok(())
}
