use modiste_body::{ScapeModel, motion::generate};
use modiste_core::Vec3;
use modiste_core::render::*;
use modiste_hair::model::*;
use modiste_hair::training::*;
use modiste_hair::*;
struct P;
impl modiste_core::Progress for P {
    fn start(&self, s: &str, n: usize) {
        eprintln!("{s} {n}");
    }
    fn advance(&self, _s: &str, _n: usize) {}
    fn warn(&self, s: &str) {
        eprintln!("{s}");
    }
    fn finish(&self, s: &str) {
        eprintln!("{s} done");
    }
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let model = ScapeModel::load("assets/body-female.safetensors").unwrap();
    let body = model.body(&[]).unwrap();
    let recipe: Recipe = modiste_io::json::read(format!("{}/manifest.json", a[1])).unwrap();
    let dims: usize = a[2].parse().unwrap();
    let (style, guides, cells) = (recipe.style, recipe.guides, recipe.cells.clone());
    let folder = TrainingFolder::open(&a[1], recipe).unwrap();
    let mut names: Vec<String> = vec![];
    for f in modiste_io::list_folder(&a[1]).unwrap() {
        let f = f.file_name().unwrap().to_str().unwrap().to_owned();
        if let Some(n) = f.strip_suffix(".body.safetensors") {
            if cells.iter().all(|c| modiste_io::exists(format!("{}/{n}.{}.safetensors", a[1], c.name()))) {
                names.push(n.to_owned());
            }
        }
    }
    println!("{names:?}");
    let roots = Groom::grow(&body, style, 1.0, guides, 1).unwrap().roots;
    let t = std::time::Instant::now();
    if a.len() > 3 {
        let mut sim_v = Vec::new();
        let groom = Groom::grow(&body, style, 1.0, guides, 1).unwrap();
        let st = generate::stand(&body);
        body.pose(&st, &mut sim_v);
        let mut tiles = Vec::new();
        for soft in [0.0, 1.0] {
            let mut sim = rod::Simulation::new(
                &body,
                &sim_v,
                &groom,
                rod::Material::of_softness(soft).unwrap(),
                rod::SimulationOptions::default(),
            )
            .unwrap();
            for _ in 0..60 {
                sim.step(&sim_v, &rod::Wind::still());
            }
            let g = sim.positions();
            let full = FullHair::new(&body, &groom.roots, &g, 4000, 3).unwrap();
            let pts = full.points(model.topology(), &sim_v, &g);
            let c = g[0];
            for az in [0.0, 0.6, 1.57, 3.14] {
                let mut canvas = Canvas::new(360, 400);
                let cam =
                    Camera::framing([c + Vec3::new(-0.16, -0.42, -0.16), c + Vec3::new(0.16, 0.02, 0.2)], az, 0.1, 0.9);
                canvas.draw(&cam, model.topology(), &sim_v, &Paint::Solid([0.8, 0.63, 0.54]));
                canvas.draw_strands(
                    &cam,
                    &modiste_core::render::Strands {
                        points: &pts,
                        points_per_strand: POINTS,
                        colours: &[[0.35, 0.2, 0.1]],
                        width: 0.0015,
                    },
                );
                tiles.push(canvas.finish());
            }
        }
        let sheet = contact_sheet(&tiles, 4);
        modiste_io::png::write("/tmp/sim.png", sheet.width, sheet.height, &sheet.rgb).unwrap();
        if a[3] == "only" {
            return;
        }
    }
    let learned =
        learn(&folder, &names, &body, &roots, &LearnOptions { hair_dimensions: dims, bust_dimensions: 10 }, &P)
            .unwrap();
    println!(
        "learned {:?} energy {} frames {} ridge {:?}",
        t.elapsed(),
        learned.energy,
        learned.frames,
        learned.model.ridge()
    );
    learned.model.save("/tmp/hair.safetensors", &Provenance::default()).unwrap();
    let hair = HairModel::load("/tmp/hair.safetensors").unwrap().shared();
    for e in evaluate(&hair, &folder, &names, &P).unwrap() {
        println!("{e:?}");
    }
    println!("{:?}", hair.stability(2).unwrap());
    let motion = generate::walk(&body, 4.0).unwrap();
    let mut tiles = Vec::new();
    for f in [
        Factors::new(1.0, 1.0),
        Factors::new(0.0, 0.5),
        Factors::new(1.35, 1.0),
        Factors { wind: [1.0, 0.0], ..Factors::default() },
    ] {
        let Ok(mut worn) = WornHair::new(&hair, &body, f) else { continue };
        let mut v = Vec::new();
        let mut strands: Option<FullHair> = None;
        let mut times = Vec::new();
        let mut pen = collision::Penetration::default();
        for (i, pose) in motion.frames.iter().enumerate() {
            body.pose(pose, &mut v);
            let t = worn.step(pose, &v, &[]).unwrap();
            times.push(t);
            if i == 60 {
                let s = Bust::new(&model).unwrap().surface(&v);
                for (k, p) in worn.points().iter().enumerate() {
                    if let Some(c) = s.contact(*p, 0.12, None)
                        && c.distance < 0.0
                        && k % POINTS != 0
                    {
                        println!(
                            "{k} {p} {:?} bust part {:?}",
                            c,
                            model.vertex_parts()[Bust::new(&model).unwrap().vertices()
                                [s.topology().faces()[c.at.face as usize][0] as usize]
                                as usize]
                        );
                    }
                }
            }
            pen = pen.join(collision::penetration_exact(worn.points(), &Bust::new(&model).unwrap().surface(&v)));
            if i % 30 == 20 {
                let strands =
                    strands.get_or_insert_with(|| FullHair::new(&body, &roots, worn.points(), 4000, 3).unwrap());
                let pts = strands.points(model.topology(), &v, worn.points());
                let c = worn.points()[0];
                for az in [0.5, 3.6] {
                    let mut canvas = Canvas::new(360, 400);
                    let cam = Camera::framing(
                        [c + Vec3::new(-0.16, -0.42, -0.16), c + Vec3::new(0.16, 0.02, 0.2)],
                        az,
                        0.1,
                        0.9,
                    );
                    canvas.draw(&cam, model.topology(), &v, &Paint::Solid([0.8, 0.63, 0.54]));
                    canvas.draw_strands(
                        &cam,
                        &modiste_core::render::Strands {
                            points: &pts,
                            points_per_strand: POINTS,
                            colours: &[[0.35, 0.2, 0.1]],
                            width: 0.0015,
                        },
                    );
                    tiles.push(canvas.finish());
                }
            }
        }
        times.sort_by_key(|t| t.total());
        println!("{f:?} {:?} {:?}", times[times.len() / 2], pen);
    }
    let sheet = contact_sheet(&tiles, 8);
    modiste_io::png::write("/tmp/hair.png", sheet.width, sheet.height, &sheet.rgb).unwrap();
}
