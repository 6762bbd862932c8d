//! The main job at a small size, through the front door.

use std::path::Path;

use modiste::{
    Action, BodyChoice, Dress, Event, Gender, Job, JobError, Length, MotionChoice, Outcome, Update, run, start,
};

fn job(out: &Path) -> Dress {
    Dress { length: Some(Length::Frames(6)), out: out.to_path_buf(), ..Dress::default() }
}

#[test]
fn the_same_request_gives_the_same_bytes_and_another_body_gives_others() {
    let folder = tempfile::tempdir().unwrap();
    let arrays = |name: &str, body: BodyChoice| {
        let out = folder.path().join(name);
        run(&Job::Dress(Dress { body, ..job(&out) }), &|_| {}).unwrap();
        modiste_io::read_bytes(out.join("dressed.npz")).unwrap()
    };
    let first = arrays("first", BodyChoice::Average);
    assert_eq!(first, arrays("second", BodyChoice::Average));
    assert_ne!(first, arrays("third", BodyChoice::Shape(vec![2.0])));
}

#[test]
fn a_background_job_tells_of_every_frame_and_ends_with_its_result() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let motion = MotionChoice::Action(Action::RaiseArms);
    let updates: Vec<Update> = start(Job::Dress(Dress { gender: Gender::Male, motion, ..job(&out) })).collect();
    let is_frame =
        |update: &&Update| matches!(update, Update::Event(Event::Advanced { stage, .. }) if stage == "dress");
    assert_eq!(updates.iter().filter(is_frame).count(), 6);
    let (last, before) = updates.split_last().unwrap();
    assert!(before.iter().all(|update| matches!(update, Update::Event(_))));
    let Update::Ended(result) = last else { panic!("the job has not ended: {last:?}") };
    let Ok(Outcome::Dressed(found)) = &**result else { panic!("{result:?}") };
    assert_eq!(found.report.frames, 6);
    assert!(found.files.iter().all(|file| file.starts_with(&out) && file.is_file()));
    let garments: Vec<&str> = found.report.penetration.iter().map(|fit| fit.garment.as_str()).collect();
    assert_eq!(garments, ["shorts", "tshirt"], "the shirt is worn over the shorts whatever the order of the request");
}

#[test]
fn a_longer_animation_starts_like_a_shorter_one() {
    let folder = tempfile::tempdir().unwrap();
    let frames = |count: usize| {
        let out = folder.path().join(count.to_string());
        run(&Job::Dress(Dress { length: Some(Length::Frames(count)), ..job(&out) }), &|_| {}).unwrap();
        modiste_io::npz::Reader::open(out.join("dressed.npz")).unwrap().f32("tshirt").unwrap().data
    };
    let (short, long) = (frames(4), frames(8));
    assert_eq!(short[..], long[..short.len()], "no frame knows the future");
}

#[test]
fn what_cannot_be_is_refused_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let bad = [
        Dress { body: BodyChoice::Shape(vec![f64::NAN]), ..job(&out) },
        Dress { garments: vec!["cape".to_owned()], ..job(&out) },
        Dress { motion: MotionChoice::File("absent.bvh".into()), ..job(&out) },
        Dress { length: Some(Length::Frames(0)), ..job(&out) },
    ];
    for request in bad {
        let error: JobError = run(&Job::Dress(request.clone()), &|_| {}).unwrap_err();
        assert_eq!(error.to_string().lines().count(), 1, "{error}");
        assert!(modiste_io::list_folder(folder.path()).unwrap().is_empty(), "{request:?} left something");
    }
}
