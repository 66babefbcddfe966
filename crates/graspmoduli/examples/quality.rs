//! How good is a grasp, what does it resist least, and where should a finger go?

use graspmoduli::glam::DVec3;
use graspmoduli::guarantees::certified_radius;
use graspmoduli::{Contact, Error, Evaluator, FrictionCone, Norm, math};

fn main() -> Result<(), Error> {
    let mut contacts = Vec::new();
    for degrees in [0.0_f64, 100.0, 230.0] {
        let (sin, cos) = math::sin_cos(degrees.to_radians());
        contacts.push(Contact::new(
            DVec3::new(cos, sin, 0.0),
            -DVec3::new(cos, sin, 0.0),
        )?);
    }
    let cone = FrictionCone::new(1.0, 8)?;
    let mut evaluator = Evaluator::new(&cone);
    println!("Q_8  {:.6}", evaluator.quality(&contacts, DVec3::ZERO));
    println!(
        "proven to hold within {:.4}",
        certified_radius(&contacts, &cone)
    );

    let weakest = evaluator.weakest(&contacts, DVec3::ZERO);
    println!("resists least: force and torque {:.3?}", weakest.direction);
    let slope = evaluator.gradient(&contacts, DVec3::ZERO);
    println!("the first finger should go along {:.3}", slope.contacts[0]);

    // Soft fingers, and fingers with a limit each.
    let soft = Evaluator::new(&cone.clone().soft(0.1)?).quality(&contacts, DVec3::ZERO);
    let each = Evaluator::new(&cone.with_norm(Norm::Each)).quality(&contacts, DVec3::ZERO);
    println!("soft {soft:.6}, a limit each {each:.6}");
    Ok(())
}
