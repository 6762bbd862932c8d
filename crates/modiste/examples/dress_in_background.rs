//! Dresses a squatting man in the background and listens to what is going on.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use modiste::{Action, BodyChoice, Dress, Event, Gender, Job, Length, MotionChoice, Outcome, Update, start};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let job = Job::Dress(Dress {
        gender: Gender::Male,
        body: BodyChoice::Shape(vec![1.5, -0.7]),
        motion: MotionChoice::Action(Action::Squat),
        length: Some(Length::Frames(12)),
        out: folder.path().join("squat"),
        ..Dress::default()
    });
    let mut steps = 0;
    for update in start(job) {
        match update {
            Update::Event(Event::Started { stage, total }) => println!("{stage}: {total} steps"),
            Update::Event(Event::Advanced { .. }) => steps += 1,
            Update::Event(_) => {}
            Update::Ended(result) => {
                let Outcome::Dressed(dressed) = (*result)? else { return Err("another job was done".into()) };
                println!("{} files", dressed.files.len());
                assert_eq!(dressed.report.frames, 12);
                assert!(dressed.files.iter().all(|file| file.is_file()));
                for fit in &dressed.report.penetration {
                    assert!(fit.after.deepest_mm <= 0.5, "{} lies {} mm deep", fit.garment, fit.after.deepest_mm);
                }
            }
        }
    }
    assert!(steps >= 12, "every frame is told");
    Ok(())
}
