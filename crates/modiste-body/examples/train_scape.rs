//! Learns the SCAPE models from solved populations and says how good they are:
//! `train_scape <makehuman archive> <folder of population-*.npz> <out folder> [gender]`.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use modiste_body::scape::Provenance;
use modiste_body::scape::evaluate::{held_out_poses, make_errors, pose_errors, shape_errors};
use modiste_body::scape::train::{LICENCE, TrainOptions, TrainingBodies, train};
use modiste_body::{Gender, MakeHumanModel, population};
use modiste_core::Silent;

#[expect(clippy::print_stdout, reason = "an example shows its figures")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [archive, folder, out, rest @ ..] = arguments.as_slice() else {
        return Err("wanted: <makehuman archive> <folder of population-*.npz> <out folder> [gender]".into());
    };
    let files = modiste_io::makehuman::open(archive)?;
    modiste_io::create_folder(out)?;
    for gender in Gender::ALL {
        if rest.first().is_some_and(|wanted| wanted != gender.name()) {
            continue;
        }
        let started = Instant::now();
        let source = format!("population-{}.npz", gender.name());
        let path = Path::new(folder).join(&source);
        let people = population::read(&path, gender)?;
        let model = MakeHumanModel::new(&files, gender)?;
        let bodies = TrainingBodies::from_population(&people, &model, false);
        let held_out = TrainingBodies::from_population(&people, &model, true);
        println!("{}: {} bodies, {} held out", gender.name(), bodies.vertices.len(), held_out.vertices.len());

        let components = 60.min(bodies.vertices.len().saturating_sub(1));
        let wide = train(&bodies, &TrainOptions { shape_count: components, ..TrainOptions::default() }, &Silent)?;
        println!("  trained in {:.1} s", started.elapsed().as_secs_f64());
        let errors = shape_errors(&wide.model, &wide.shape_space, &held_out.vertices)?;
        for k in [1, 2, 5, 10, 15, 20, 30, 40, 60] {
            if let Some(error) = errors.get(k - 1) {
                println!(
                    "  {k:2} coefficients: mean {:.2} mm, p95 {:.2}, largest {:.1}",
                    error.mean, error.p95, error.largest
                );
            }
        }
        let poses = held_out_poses(wide.skin.joints(), 20);
        let report = |name: &str, errors: &[modiste_body::scape::evaluate::VertexError]| {
            let mean = errors.iter().map(|e| e.mean).sum::<f64>() / errors.len() as f64;
            let p95 = errors.iter().map(|e| e.p95).sum::<f64>() / errors.len() as f64;
            let largest = errors.iter().map(|e| e.largest).fold(0.0, f64::max);
            println!("  pose, {name}: mean {mean:.2} mm, p95 {p95:.2}, largest {largest:.1}");
        };
        let few = TrainOptions { shape_count: 2, ..TrainOptions::default() };
        report("blended R and Q", &pose_errors(&wide.model, &wide.skin, &poses)?);
        for (name, blend_rotations, learn_pose_deformation) in
            [("plain SCAPE", false, true), ("blended R alone", true, false), ("rigid R alone", false, false)]
        {
            let other = train(
                &bodies.first(3),
                &TrainOptions { blend_rotations, learn_pose_deformation, ..few.clone() },
                &Silent,
            )?;
            report(name, &pose_errors(&other.model, &other.skin, &poses)?);
        }

        let trained = wide.with_shape_count(20)?;
        let provenance = Provenance {
            seed: TrainOptions::default().seed,
            sources: BTreeMap::from([(source, modiste_io::hash(&modiste_io::read_bytes(&path)?))]),
            licence: LICENCE.to_owned(),
            command: "train_scape".to_owned(),
        };
        trained.save(Path::new(out).join(format!("body-{}.safetensors", gender.name())), &provenance)?;
        use modiste_body::Quantity::{BodyMass, ChestGirth, HipGirth, Stature, WaistGirth};
        let wishes = [Stature, BodyMass, ChestGirth, WaistGirth, HipGirth];
        let (met, misfits) = make_errors(&trained, &held_out.vertices, &wishes)?;
        println!("  make: {:.1}% within 5 mm and 0.5 kg; 95th percentiles {misfits:.4?}", 100.0 * met);
        let body = trained.body(&[])?;
        let mut vertices = Vec::new();
        let started = Instant::now();
        for pose in &poses {
            body.pose(pose, &mut vertices);
        }
        println!("  one pose takes {:.2} ms", 1e3 * started.elapsed().as_secs_f64() / poses.len() as f64);
    }
    Ok(())
}
