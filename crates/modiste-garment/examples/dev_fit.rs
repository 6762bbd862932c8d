//! Development harness (not committed).
use std::sync::Arc;
use modiste_body::*;
use modiste_core::*;
use modiste_garment::drape::*;
use modiste_garment::refine::*;
use modiste_garment::*;

struct LbsBody { topology: Arc<Topology>, rest: Vec<Vec3>, joints: [Vec3; Part::COUNT], weights: Vec<Vec<(Part, f64)>>, face_parts: Vec<Part>, vertex_parts: Vec<Part> }

fn pose_points(rest: &[Vec3], weights: &[Vec<(Part, f64)>], joints: &[Vec3; Part::COUNT], pose: &Pose) -> Vec<Vec3> {
    let world = pose.world_rotations();
    let posed = pose.joints(joints);
    rest.iter().zip(weights).map(|(p, w)| w.iter().map(|(part, w)| *w * (posed[part.index()] + world[part.index()] * (*p - joints[part.index()]))).sum::<Vec3>()).collect()
}

fn motion(seed: u64, frames: usize, scale: f64) -> Motion {
    let mut rng = seeded_rng(seed);
    let draws: Vec<[f64; 3]> = (0..60).map(|_| [normal(&mut rng), normal(&mut rng), normal(&mut rng)]).collect();
    let wave = |c: usize, t: f64| { let [a, b, d] = draws[c]; a * (0.1 * (2.0 + b) * t + d).sin() };
    let pose = |f: usize| {
        let t = f as f64;
        let mut pose = Pose::template(Vec3::new(0.1 * wave(0, t), 0.95, 0.1 * wave(1, t)));
        let mut set = |part: Part, v: Vec3| pose.rotations[part.index()] = scale * v;
        set(Part::Pelvis, Vec3::new(0.1 * wave(2, t), 0.3 * wave(3, t), 0.05 * wave(4, t)));
        set(Part::Abdomen, Vec3::new(0.15 * wave(5, t), 0.1 * wave(6, t), 0.1 * wave(7, t)));
        set(Part::Chest, Vec3::new(0.15 * wave(8, t), 0.1 * wave(9, t), 0.1 * wave(10, t)));
        set(Part::LeftUpperArm, Vec3::new(0.5 * wave(11, t), 0.2 * wave(12, t), 0.5 * wave(13, t)));
        set(Part::RightUpperArm, Vec3::new(0.5 * wave(14, t), 0.2 * wave(15, t), 0.5 * wave(16, t)));
        set(Part::LeftThigh, Vec3::new(0.5 * wave(17, t), 0.1 * wave(18, t), 0.1 * wave(19, t)));
        set(Part::RightThigh, Vec3::new(0.5 * wave(20, t), 0.1 * wave(21, t), 0.1 * wave(22, t)));
        set(Part::LeftForearm, Vec3::new(0.0, -0.3 * wave(23, t).abs(), 0.0));
        pose
    };
    Motion { fps: 30.0, frames: (0..frames).map(pose).collect() }
}

fn subdivide(x: &mut Vec<Vec3>, w: &mut Vec<Vec<(Part, f64)>>, faces: &[[u32; 3]], parts: &[Part]) -> (Vec<[u32; 3]>, Vec<Part>) {
    let mut mids = std::collections::HashMap::new();
    let mut out = Vec::new(); let mut op = Vec::new();
    for (f, p) in faces.iter().zip(parts) {
        let mut mid = |a: u32, b: u32| *mids.entry((a.min(b), a.max(b))).or_insert_with(|| {
            x.push(0.5 * (x[a as usize] + x[b as usize]));
            let mut m: Vec<(Part, f64)> = w[a as usize].iter().chain(&w[b as usize]).map(|(p, v)| (*p, 0.5 * v)).collect();
            m.sort_by_key(|e| e.0); w.push(m); x.len() as u32 - 1 });
        let [a, b, c] = *f; let (ab, bc, ca) = (mid(a, b), mid(b, c), mid(c, a));
        out.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]); op.extend([*p; 4]);
    }
    (out, op)
}

fn garment(body: &LbsBody, name: &str, keep: impl Fn(Part, Vec3) -> bool, offset: f64) -> (Garment, Vec<Vec<(Part, f64)>>) {
    let normals = vertex_normals(&body.topology, &body.rest);
    let mut map = vec![u32::MAX; body.rest.len()]; let mut old = Vec::new();
    let mut faces = Vec::new(); let mut parts = Vec::new();
    for (f, p) in body.topology.faces().iter().zip(&body.face_parts) {
        let c = f.iter().map(|v| body.rest[*v as usize]).sum::<Vec3>() / 3.0;
        if !keep(*p, c) { continue; }
        faces.push(f.map(|v| { if map[v as usize] == u32::MAX { map[v as usize] = old.len() as u32; old.push(v); } map[v as usize] })); parts.push(*p);
    }
    let mut x: Vec<Vec3> = old.iter().map(|v| body.rest[*v as usize] + offset * normals[*v as usize]).collect();
    let mut w: Vec<_> = old.iter().map(|v| body.weights[*v as usize].clone()).collect();
    let (faces, parts) = if faces.len() < 5000 { subdivide(&mut x, &mut w, &faces, &parts) } else { (faces, parts) };
    let topology = Topology::new(x.len(), faces).unwrap();
    for _ in 0..10 { x = (0..x.len()).map(|i| { let n = topology.neighbours(i); 0.5 * x[i] + 0.5 * n.iter().map(|j| x[*j as usize]).sum::<Vec3>() / n.len().max(1) as f64 }).collect(); }
    let top = x.iter().map(|v| v.y).fold(f64::MIN, f64::max);
    let waist: Vec<u32> = if name == "shorts" { (0..x.len() as u32).filter(|i| x[*i as usize].y > top - 0.02).collect() } else { vec![] };
    let anchors = (0..old.len() as u32).filter(|i| body.rest[old[*i as usize] as usize].y > top - 0.05).map(|i| [i, old[i as usize]]).collect();
    let uv = vec![[[0.0; 2]; 3]; topology.face_count()];
    println!("{name}: {} vertices {} faces, {} waist", x.len(), topology.face_count(), waist.len());
    (Garment { name: name.into(), gender: Gender::Female, topology: Arc::new(topology), face_parts: parts, template: x, waist_band: waist, anchors, uv }, w)
}

fn shaped(x: &[Vec3], shape: &[f64]) -> Vec<Vec3> {
    let s = |i: usize| shape.get(i).copied().unwrap_or(0.0);
    x.iter().map(|p| { let bump = (-(p.y - 1.1).powi(2) / 0.03).exp(); let hip = (-(p.y - 0.85).powi(2) / 0.02).exp();
        Vec3::new(p.x * (1.0 + 0.06 * s(0) + 0.05 * s(2) * hip), p.y * (1.0 + 0.02 * s(1)), p.z * (1.0 + 0.08 * s(0) + 0.08 * s(2) * hip) + 0.015 * s(3) * bump * (p.z > 0.0) as i32 as f64) }).collect()
}

fn train(body: &LbsBody, g: Garment, w: &[Vec<(Part, f64)>]) -> Arc<DrapeModel> {
    let mut rng = seeded_rng(3);
    let shapes = (0..40).map(|_| { let shape: Vec<f64> = (0..20).map(|_| normal(&mut rng)).collect(); ShapeSample { vertices: shaped(&g.template, &shape), shape } }).collect();
    let phase: Vec<f64> = g.template.iter().map(|p| 60.0 * p.y + 25.0 * p.x).collect();
    let sequences: Vec<_> = (0..10).map(|seed| {
        let m = motion(seed, 60, 0.7);
        let frames = m.frames.iter().map(|pose| {
            let mut x = pose_points(&g.template, w, &body.joints, pose);
            let n = vertex_normals(&g.topology, &x);
            let bend = pose.rotations[2].x + pose.rotations[1].z;
            for i in 0..x.len() { x[i] += n[i] * (0.01 + 0.01 * (phase[i] + 5.0 * bend).sin()); }
            x
        }).collect();
        PoseSequence { name: format!("s{seed}"), motion: m, frames }
    }).collect();
    let set = TrainingSet { garment: g, shapes, sequences, seed: 1, sources: vec![] };
    let t = std::time::Instant::now();
    let (model, report) = DrapeModel::train(&set, &TrainOptions::default(), &Silent).unwrap();
    println!("{}: trained in {:.1} s, {} wrinkles {:.3} explained, {report:?}", model.garment().name, t.elapsed().as_secs_f64(), model.wrinkle().count(), model.wrinkle().explained_variance());
    println!("  bytes {}", model.to_bytes("x").unwrap().len());
    Arc::new(model)
}

fn main() {
    let files = modiste_io::makehuman::open("/work/shared/data/bodies/makehuman_cc0_subset.tar.xz").unwrap();
    let mh = MakeHumanModel::new(&files, Gender::Female).unwrap();
    let (rest, joints) = mh.vertices_and_joints(&mh.default_parameters());
    let body = LbsBody { topology: mh.topology().clone(), rest, joints, weights: mh.skin_weights().to_vec(), face_parts: mh.face_parts().to_vec(), vertex_parts: mh.vertex_parts().to_vec() };
    let span = bounds(&body.rest).unwrap(); println!("body {span:?} pelvis {}", joints[0]);
    let hip = joints[0].y;
    let arm = |p: Vec3| p.x.abs() < joints[Part::LeftUpperArm.index()].x.abs() + 0.14;
    let (shirt, sw) = garment(&body, "tshirt", |p, c| match p { Part::Chest | Part::Abdomen | Part::LeftShoulder | Part::RightShoulder => true, Part::Pelvis => c.y > hip - 0.05, Part::LeftUpperArm | Part::RightUpperArm => arm(c), _ => false }, 0.008);
    let (shorts, hw) = garment(&body, "shorts", |p, c| match p { Part::Pelvis => c.y < hip + 0.08, Part::Abdomen => c.y < hip + 0.08, Part::LeftThigh | Part::RightThigh => c.y > hip - 0.3, _ => false }, 0.005);
    let (shirt, shorts) = (train(&body, shirt, &sw), train(&body, shorts, &hw));
    let mut args = std::env::args().skip(1);
    let scale: f64 = args.next().map_or(1.0, |a| a.parse().unwrap());
    if std::env::args().len() > 2 { profile(&body, &shorts, &shirt); return; }
    for shape in [vec![0.0; 4], vec![2.0, 1.0, 2.0, 2.0], vec![3.0, 0.0, 3.0, 3.0], vec![-2.0, 1.0, -2.0, 0.0]] {
        let rest = shaped(&body.rest, &shape);
        let js: Vec<Vec3> = shaped(&body.joints, &shape);
        let joints: [Vec3; Part::COUNT] = js.try_into().unwrap();
        let tp = Pose::template(joints[0]);
        let wearer = Wearer { gender: Gender::Female, shape: &shape, topology: &body.topology, face_parts: &body.face_parts, vertex_parts: &body.vertex_parts, template_vertices: &rest, template_pose: &tp };
        let garments = [shorts.clone(), shirt.clone()];
        let mut outfit = Outfit::on(&wearer, &garments, &FitOptions::default()).unwrap();
        let mut paper = Outfit::on(&wearer, &garments, &FitOptions::paper_only()).unwrap();
        let motion = motion(77, 60, scale);
        let mut total = [[Penetration::default(); 3]; 2]; let mut times = vec![]; let mut cpus = vec![]; let mut stages = vec![vec![]; 5]; let mut rounds = 0; let mut pinched = 0; let mut own = (0, 0.0f64); let mut over = Penetration::default();
        for (f, pose) in motion.frames.iter().enumerate() {
            let posed = pose_points(&rest, &body.weights, &joints, pose);
            let c0 = cpu(); let r = outfit.step(pose, &posed).clone(); cpus.push(cpu() - c0);
            paper.step(pose, &posed);
            times.push(r.seconds());
            stages[0].push(r.body_seconds);
            for l in 0..2 { stages[1 + 2 * l].push(r.layers[l].synthesis_seconds); stages[2 + 2 * l].push(r.layers[l].fit_seconds); rounds += r.layers[l].rounds; pinched += r.layers[l].pinched; own.0 += r.layers[l].inside_after; own.1 = own.1.max(r.layers[l].depth_after); }
            if f % 6 == 0 {
                let tree = TriangleBvh::new(&body.topology, &posed);
                for l in 0..2 {
                    for (k, x) in [outfit.predicted(l), paper.vertices(l), outfit.vertices(l)].into_iter().enumerate() {
                        total[l][k] = total[l][k].join(penetration::measure_with(&tree, &posed, x));
                    }
                }
                let _ = &mut over;
            }
            if f % 20 == 0 { draw(&format!("/tmp/garment_dev/{}_{f}.png", shape[0]), &body.topology, &posed, &outfit); }
        }
        let med = |v: &mut Vec<f64>| { v.sort_by(f64::total_cmp); (1e3 * v[v.len() / 2], 1e3 * v[v.len() * 95 / 100]) };
        println!("shape {shape:?}: rounds {rounds}, pinched {pinched}, own {own:?}");
        for l in 0..2 { println!("   {}: predicted {:?}\n        paper {:?}\n        fitted {:?}", garments[l].garment().name, total[l][0], total[l][1], total[l][2]); }
        println!("   CPU {:?} ms", med(&mut cpus)); println!("   total {:?} ms; body {:?} syn {:?} fit {:?} syn {:?} fit {:?}", med(&mut times), med(&mut stages[0]), med(&mut stages[1]), med(&mut stages[2]), med(&mut stages[3]), med(&mut stages[4]));
    }
}

fn cpu() -> f64 { std::fs::read_to_string("/proc/thread-self/schedstat").unwrap().split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-9 }

fn draw(path: &str, topology: &Topology, body: &[Vec3], outfit: &Outfit) {
    use modiste_core::render::*;
    let figures = [Figure::new(topology, body, Paint::Solid([0.85, 0.65, 0.55])),
        Figure::new(&outfit.model(0).garment().topology, outfit.vertices(0), Paint::Solid([0.2, 0.35, 0.7])),
        Figure::new(&outfit.model(1).garment().topology, outfit.vertices(1), Paint::Solid([0.75, 0.75, 0.3]))];
    let tiles: Vec<_> = [0.0, 1.57, 3.14].into_iter().map(|a| picture(500, 700, &Camera::framing(bounds(&figures[1..]), a, 0.1, 500.0 / 700.0), &figures)).collect();
    let sheet = contact_sheet(&tiles, 3);
    modiste_io::png::write(path, sheet.width, sheet.height, &sheet.rgb).unwrap();
}

fn profile(body: &LbsBody, shorts: &Arc<DrapeModel>, shirt: &Arc<DrapeModel>) {
    let shape = vec![1.0, 1.0, 1.0, 1.0];
    let rest = shaped(&body.rest, &shape);
    let joints: [Vec3; Part::COUNT] = shaped(&body.joints, &shape).try_into().unwrap();
    let motion = motion(77, 60, 0.7);
    let frames: Vec<Vec<Vec3>> = motion.frames.iter().map(|p| pose_points(&rest, &body.weights, &joints, p)).collect();
    let mut lap = cpu();
    let mut tick = |name: &str| { let now = cpu(); println!("{name}: {:.2} ms", (now - lap) / 60.0 * 1e3); lap = cpu(); };
    let mut ob = Obstacle::body(body.topology.clone(), &body.face_parts, &rest);
    tick("build/60");
    for f in &frames { ob.update(f); }
    tick("update");
    for (name, m) in [("shorts", shorts), ("shirt", shirt)] {
        let mut syn = Synthesis::new(m.clone(), &shape, rest.len()).unwrap();
        let mut outs = vec![];
        tick("-");
        for (p, f) in motion.frames.iter().zip(&frames) { outs.push(syn.step(p, f).to_vec()); }
        tick(&format!("{name} synthesis"));
        let all: Vec<u32> = (0..rest.len() as u32).collect();
        let mut paper = Fit::new(&m.garment().topology, &m.garment().waist_band, FitOptions::paper_only());
        let mut exact = Fit::new(&m.garment().topology, &[], FitOptions { paper: None, ..FitOptions::default() });
        let mut none = Fit::new(&m.garment().topology, &[], FitOptions { paper: Some(PaperOptions { iterations: vec![], ..PaperOptions::default() }), exact: None });
        let mut zero = Fit::new(&m.garment().topology, &[], FitOptions { paper: None, exact: Some(ExactOptions { rounds: 0, final_rounds: 0, ..ExactOptions::default() }) });
        let mut inside = 0;
        let mut fitted = outs.clone();
        for (fit, label) in [(&mut none, "correspond"), (&mut paper, "paper"), (&mut zero, "contacts"), (&mut exact, "exact after paper")] {
            let mut spent = 0.0; let mut rounds = 0;
            for (f, x) in frames.iter().zip(&mut fitted) { ob.update(f); let c = cpu(); let r = fit.fit(&[Below { obstacle: &ob, members: &all }], x); spent += cpu() - c; rounds += r.rounds; inside += r.inside_before; }
            println!("  {name} {label}: {:.2} ms, rounds {:.1}", spent / 60.0 * 1e3, rounds as f64 / 60.0);
        }
        println!("  {inside}");
        tick("-");
    }
}
