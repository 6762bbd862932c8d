//! Results judged, and crowds made, through the front door.

use modiste::{Check, Crowd, Dress, Format, Job, Length, Outcome, run};
use modiste_io::animated::AnimatedMesh;
use modiste_io::dressed;

fn checked(file: &std::path::Path) -> modiste::check::CheckReport {
    let Ok(Outcome::Checked(checked)) = run(&Job::Check(Check { file: file.to_path_buf() }), &|_| {}) else {
        panic!("{} cannot be checked", file.display())
    };
    checked.report
}

#[test]
fn a_dressed_result_is_judged_and_a_shrunk_shirt_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let job =
        Dress { length: Some(Length::Frames(3)), formats: vec![Format::Npz], out: out.clone(), ..Dress::default() };
    run(&Job::Dress(job), &|_| {}).unwrap();
    let file = out.join("dressed.npz");
    let report = checked(&file);
    assert_eq!(report.frames, 3);
    let names: Vec<&str> = report.garments.iter().map(|garment| garment.garment.as_str()).collect();
    assert_eq!(names, ["shorts", "tshirt"]);
    assert!(report.garments.iter().all(|garment| garment.inside_body.count == 0), "{report:?}");

    // The same with the shirt narrower by a fifth.
    let contents = dressed::read_contents(&file).unwrap();
    let mut frames: Vec<Vec<Vec<[f32; 3]>>> = vec![Vec::new(); contents.meshes.len()];
    dressed::for_each_frame(&file, &contents, |_, meshes| {
        for (track, (mesh, vertices)) in frames.iter_mut().zip(contents.meshes.iter().zip(meshes)) {
            let narrow = |[x, y, z]: [f32; 3]| if mesh.name == "tshirt" { [0.8 * x, y, z] } else { [x, y, z] };
            track.push(vertices.iter().map(|&p| narrow(p)).collect());
        }
        Ok::<(), modiste_io::IoError>(())
    })
    .unwrap();
    let meshes: Vec<_> = contents
        .meshes
        .iter()
        .zip(&frames)
        .map(|(mesh, frames)| AnimatedMesh::plain(&mesh.name, &mesh.faces, frames))
        .collect();
    let narrow = folder.path().join("narrow.npz");
    dressed::write(&narrow, contents.fps, &meshes).unwrap();
    let report = checked(&narrow);
    assert!(!report.holds);
    let shirt = &report.garments[1];
    assert!(shirt.inside_body.count > 300 && shirt.inside_body.worst_mm > 5.0, "{:?}", shirt.inside_body);
    assert_eq!(shirt.inside_body.frames, [[0, 2]]);
    assert!(shirt.crossing_body.worst_mm >= shirt.inside_body.worst_mm);
}

#[test]
fn files_that_are_no_result_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.npz");
    let refused = |job: &Job| run(job, &|_| {}).unwrap_err().to_string();
    let job = Job::Check(Check { file: file.clone() });
    assert!(refused(&job).contains("a.npz"));
    modiste_io::write_bytes(&file, b"no archive").unwrap();
    assert!(refused(&job).contains("a.npz"));
    let crowd = Crowd { out: folder.path().join("crowd"), ..Crowd::default() };
    assert!(refused(&Job::Crowd(Crowd { count: 0, ..crowd.clone() })).contains("number of people"));
    let absent = Crowd { motions: Some(folder.path().to_path_buf()), ..crowd };
    assert!(refused(&Job::Crowd(absent)).contains("wanted BVH files, found none"));
    assert!(!modiste_io::exists(folder.path().join("crowd")));
}

#[test]
fn the_seed_decides_a_crowd_and_a_larger_one_begins_alike() {
    let folder = tempfile::tempdir().unwrap();
    let crowd = |name: &str, count: usize| {
        let out = folder.path().join(name);
        let job = Crowd {
            count,
            length: Length::Frames(2),
            formats: vec![Format::Npz],
            out: out.clone(),
            ..Crowd::default()
        };
        let Ok(Outcome::MadeCrowd(made)) = run(&Job::Crowd(job), &|_| {}) else { panic!("no crowd") };
        assert!(made.files.iter().all(modiste_io::exists));
        (made.report, modiste_io::read_bytes(out.join("0001/dressed.npz")).unwrap())
    };
    let (one, first) = crowd("one", 1);
    let (two, again) = crowd("two", 2);
    assert_eq!(one.characters[0].shape, two.characters[0].shape);
    assert_ne!(two.characters[0].shape, two.characters[1].shape);
    assert_eq!(two.characters[1].frames, 2);
    assert_eq!(one.characters[0].garments, two.characters[0].garments);
    assert_eq!(first, again, "the first of two is the one");
    assert_eq!(again, crowd("again", 2).1);
}
