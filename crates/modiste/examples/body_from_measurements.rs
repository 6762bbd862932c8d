//! Makes a body from three measurements and measures it again.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use modiste::{BodyChoice, BodyMake, Gender, Job, Outcome, Quantity, run};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let wanted = vec![(Quantity::Stature, 1.65), (Quantity::BodyMass, 60.0), (Quantity::WaistGirth, 0.75)];
    let job = Job::BodyMake(BodyMake {
        gender: Gender::Female,
        body: BodyChoice::Measurements(wanted.clone()),
        out: folder.path().join("body.obj"),
    });
    let Outcome::MadeBody(made) = run(&job, &|_| {})? else { return Err("another job was done".into()) };
    println!("{}", made.measurements);
    for (quantity, value) in wanted {
        let tolerance = if quantity == Quantity::BodyMass { 0.5 } else { 0.005 };
        assert!((made.measurements.get(quantity) - value).abs() < tolerance, "{}", quantity.title());
    }
    assert!(made.file.is_file());
    Ok(())
}
