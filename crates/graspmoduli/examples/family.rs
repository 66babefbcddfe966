//! A grasp carried from one shape to another, and what is proven on the way.

use graspmoduli::guarantees::{certified_radius, transfer_bound};
use graspmoduli::region::Anywhere;
use graspmoduli::transfer::Deformation;
use graspmoduli::{Error, FrictionCone, Surface};
use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;

fn main() -> Result<(), Error> {
    let can = Surface::new(-0.5, 0.5, 4, vec![0.4; 16])?;
    let slopes = [0.3, 0.35, 0.45, 0.5, 0.5, 0.4];
    let vase = Surface::new(-0.6, 0.6, 4, slopes.iter().flat_map(|&r| [r; 4]).collect())?;
    let cone = FrictionCone::new(1.0, 8)?;
    let grasp = [[0.5, 0.0], [0.5, 2.1], [0.5, 4.2]];
    let contacts = grasp.map(|[u, theta]| can.contact(u, theta));

    println!(
        "proven to hold within {:.4}",
        certified_radius(&contacts, &cone)
    );
    let bound = transfer_bound(&can, &vase, 1e-6, || ControlFlow::Continue(()))?;
    println!("the naïve transfer moves nothing by more than {bound:.4}");

    let way = Deformation::new(&can, &vase)?;
    let go = AtomicBool::new(false);
    let naive = &way.naive(&[grasp.to_vec()], &cone, 10, &go)?[0];
    let climbed = &way.by_ascent(&[grasp], &cone, &Anywhere, &go)?[0];
    for [t, quality] in &naive.path {
        println!("t = {t:.1}: Q = {quality:.4}");
    }
    let end = climbed.path.last().map_or(0.0, |last| last[1]);
    println!("with an ascent on the way: Q = {end:.4}");
    Ok(())
}
