//! Fingertips pressed on a triangle mesh, and the best true grasps of it.

use graspmoduli::glam::DVec3;
use graspmoduli::limits::Limits;
use graspmoduli::places::Wanted;
use graspmoduli::touch::map::map;
use graspmoduli::touch::mesh::Mesh;
use graspmoduli::touch::polish::ROUNDS;
use graspmoduli::touch::press::Tip;
use graspmoduli::touch::search::grasps;
use graspmoduli::{Error, FrictionCone};
use std::sync::atomic::AtomicBool;

fn main() -> Result<(), Error> {
    // A box around the origin whose largest extent is 1, as all of `touch` wants it.
    let corner = |k: usize| {
        let sign = |bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
        [0.3 * sign(0), 0.2 * sign(1), 0.5 * sign(2)]
    };
    let vertices: Vec<[f64; 3]> = (0..8).map(corner).collect();
    let sides = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let faces: Vec<[usize; 3]> = sides
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    let mesh = Mesh::new(&vertices, &faces);
    let tip = Tip::new(0.05);

    // Any numbers in the unit cube, here of a lattice, choose the places that are tried.
    let random: Vec<[f64; 3]> = (0..1000)
        .map(|k| [0.819_173, 0.671_044, 0.549_700].map(|step| (f64::from(k) * step) % 1.0))
        .collect();
    let places = map(&mesh, &tip, &random);
    println!(
        "a tip may press at {} of {} places",
        places.len(),
        random.len()
    );

    let cone = FrictionCone::new(0.8, 8)?;
    let wanted = Wanted {
        cone: &cone,
        center: DVec3::ZERO,
        scale: 2.0,
        fingers: 3,
        top: 3,
        apart: 0.1,
        errors: 0.025,
        task: &[],
        rounds: ROUNDS,
        limits: &Limits::none(),
    };
    let go = AtomicBool::new(false);
    for found in grasps(&mesh, &tip, &places, &wanted, 2, &go)?
        .iter()
        .take(3)
    {
        let points: Vec<DVec3> = found.places.iter().map(|place| place.point).collect();
        let holds = 100.0 * found.checked.holds;
        println!(
            "Q = {:.4}, holds under {holds:.0} % of bad aim, at {points:.2?}",
            found.quality
        );
    }
    Ok(())
}
