//! Solves the populations of both genders from the shared data: `population <count> <out folder>`.
use std::path::Path;
use modiste_body::population::{BodySpace, PopulationOptions, SoftDirections, ansur_subjects, choose, solve, statistics, write};
use modiste_body::{Gender, MakeHumanModel, MeasureTemplate};
use modiste_core::Silent;
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let count: usize = args[1].parse()?;
    let data = Path::new("../../shared/data/bodies");
    let data = if data.exists() { data } else { Path::new("../shared/data/bodies") };
    let t = std::time::Instant::now();
    let files = modiste_io::makehuman::open(data.join("makehuman_cc0_subset.tar.xz"))?;
    for gender in Gender::ALL {
        if args.len() > 3 && args[3] != gender.name() { continue }
        let model = MakeHumanModel::new(&files, gender)?;
        eprintln!("model {:?}", t.elapsed());
        let template = MeasureTemplate::new(model.topology(), model.face_parts())?;
        let soft = SoftDirections::default();
        let space = BodySpace::new(&model, &soft);
        let table = modiste_io::ansur::read(data.join(format!("ansur2_{}.csv.gz", gender.name())))?;
        let subjects = choose(ansur_subjects(&table)?, count, 2012)?;
        let population = solve(&space, &template, &subjects, &PopulationOptions::default(), &Silent)?;
        eprintln!("solved {:?}", t.elapsed());
        write(format!("{}/population-{}.npz", args[2], gender.name()), &population)?;
        let s = statistics(&population)?;
        for q in &s.quantities {
            println!("{:18} mean {:.4} sd {:.4} target {:.4} {:.4} survey {:.4} {:.4} | bias {:+.4} rms {:.4} p95 {:.4} worst {:.4} | twin rms {:.4}", q.quantity.name(), q.mean, q.std_dev, q.target_mean, q.target_std_dev, q.survey_mean, q.survey_std_dev, q.residual.bias, q.residual.rms, q.residual.percentile_95, q.residual.worst, q.residual_without_soft.rms);
        }
        println!("corr {:.3}", s.worst_correlation_error);
    }
    Ok(())
}
