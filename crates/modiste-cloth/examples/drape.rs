//! Development bench: drapes cloth, prints times, writes pictures.
use modiste_cloth::*;
use modiste_core::render::{Camera, Figure, Image, Paint, contact_sheet, picture_on};
use modiste_core::{Quat, Topology, Vec2, Vec3};
use std::sync::Arc;

fn grid(n: usize, m: usize, size: (f64, f64), wrap: bool) -> (Vec<[u32; 3]>, Vec<[Vec2; 3]>, usize) {
    // n columns (x), m rows (y) of vertices
    let cols = if wrap { n } else { n - 1 };
    let (dx, dy) = (size.0 / cols as f64, size.1 / (m - 1) as f64);
    let mut faces = vec![];
    let mut rest = vec![];
    for j in 0..m - 1 {
        for i in 0..cols {
            let id = |a: usize, b: usize| (b * n + a % n) as u32;
            let p = |a: usize, b: usize| Vec2::new(a as f64 * dx, b as f64 * dy);
            let q = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            let t: [[usize; 3]; 2] = if (i + j) % 2 == 0 { [[0, 1, 2], [0, 2, 3]] } else { [[0, 1, 3], [1, 2, 3]] };
            for f in t {
                faces.push(f.map(|k| id(q[k].0, q[k].1)));
                rest.push(f.map(|k| p(q[k].0, q[k].1)));
            }
        }
    }
    (faces, rest, n * m)
}

fn sphere(radius: f64) -> (Topology, Vec<Vec3>) {
    let (n, m) = (64, 33);
    let mut x = vec![];
    let mut faces = vec![];
    x.push(Vec3::Y * radius);
    for j in 1..m - 1 {
        for i in 0..n {
            let (t, p) = (std::f64::consts::PI * j as f64 / (m - 1) as f64, std::f64::consts::TAU * i as f64 / n as f64);
            x.push(Vec3::new(t.sin() * p.sin(), t.cos(), t.sin() * p.cos()) * radius);
        }
    }
    x.push(-Vec3::Y * radius);
    let id = |i: usize, j: usize| (1 + (j - 1) * n + i % n) as u32;
    for i in 0..n {
        faces.push([0, id(i, 1), id(i + 1, 1)]);
        faces.push([(x.len() - 1) as u32, id(i + 1, m - 2), id(i, m - 2)]);
        for j in 1..m - 2 {
            faces.push([id(i, j), id(i, j + 1), id(i + 1, j + 1)]);
            faces.push([id(i, j), id(i + 1, j + 1), id(i + 1, j)]);
        }
    }
    (Topology::new(x.len(), faces).unwrap(), x)
}

fn body() -> (Topology, Vec<Vec3>) {
    let path = std::env::var("BODY").unwrap();
    let (x, faces) = modiste_io::obj::read(path).unwrap();
    let faces: Vec<_> = faces.into_iter().filter(|f| f.iter().all(|&v| v < 13380)).collect();
    let x = x[..13380].iter().map(|p| *p * 0.1).collect();
    (Topology::new(13380, faces).unwrap(), x)
}

fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    text.split_whitespace().next().unwrap().parse::<f64>().unwrap() * 1e-9
}

fn show(name: &str, tiles: &[Image], columns: usize) {
    let image = contact_sheet(tiles, columns);
    modiste_io::png::write(format!("{}/{name}.png", std::env::temp_dir().display()), image.width, image.height, &image.rgb).unwrap();
}

fn options() -> SolverOptions {
    let mut o = SolverOptions::default();
    let var = |name: &str| std::env::var(name).ok().map(|v| v.parse::<f64>().unwrap());
    if let Some(v) = var("SUBSTEPS") { o.substeps = v as usize; }
    if let Some(v) = var("TOL") { o.tolerance = v; }
    if let Some(v) = var("ITERS") { o.max_iterations = v as usize; }
    if let Some(v) = var("KC") { o.contact_stiffness = v; }
    if let Some(v) = var("SELF") { o.self_contact = v > 0.0; }
    o
}

fn run(name: &str, n_frames: usize, model: &ClothModel, state: &mut ClothState, col: &mut BodyCollider, mut motion: impl FnMut(usize) -> Option<Vec<Vec3>>, every: usize, az: f64) {
    let mut solver = Solver::new(model, options());
    let mut tiles = vec![];
    let mut times = vec![];
    let mut p99: f64 = 0.0;
    let mut tot = StepReport::default();
    for frame in 0..n_frames {
        if let Some(x) = motion(frame) { col.advance_to(&x); }
        let t = cpu();
        let r = solver.step(model, state, col, 1.0 / 30.0).unwrap();
        times.push((cpu() - t) * 1e3);
        let s = state.edge_stretch(model);
        p99 = p99.max(s.percentile_99);
        tot.iterations += r.iterations; tot.unconverged += r.unconverged; tot.projected += r.projected; tot.deepest = tot.deepest.max(r.deepest); tot.inside += r.inside; tot.slowed += r.slowed;
        if frame % every == every - 1 {
            println!("{name} {frame}: {:.1} ms it {} unconv {} contacts {} proj {} deep {:.4} inside {} vmax {:.2} stretch med {:.4} p99 {:.4} max {:.4} E {:.4}", times[frame], r.iterations, r.unconverged, r.contacts, r.projected, r.deepest, r.inside, r.max_speed, s.median, s.percentile_99, s.largest, model.energy(&state.positions, Vec3::Y * -9.81));
            let figures = [
                Figure::new(col.topology(), col.positions(), Paint::Solid([0.8, 0.65, 0.55])),
                Figure::new(model.topology(), &state.positions, Paint::Solid([0.3, 0.45, 0.7])),
            ];
            let b = modiste_core::render::bounds_of(state.positions.iter());
            let camera = Camera::framing(b, az, 0.2, 1.0);
            tiles.push(picture_on(420, 420, &camera, &figures, b[0].y - 0.01));
        }
    }
    times.sort_by(f64::total_cmp);
    println!("{name}: median {:.1} ms, p95 {:.1} ms, max p99 stretch {p99:.4}, iterations/frame {} unconv {} projected {} deepest {:.4} inside {} slowed {}", times[times.len() / 2], times[times.len() * 95 / 100], tot.iterations / n_frames, tot.unconverged, tot.projected, tot.deepest, tot.inside, tot.slowed);
    show(name, &tiles, 4);
}

fn main() {
    let mode = std::env::args().nth(1).unwrap_or_default();
    let n: usize = std::env::args().nth(2).map_or(71, |v| v.parse().unwrap());
    let fabric = Fabric::from_name(&std::env::args().nth(3).unwrap_or("jersey".into())).unwrap();
    match mode.as_str() {
        "sphere" => {
            let (faces, rest, count) = grid(n, n, (1.0, 1.0), false);
            let t = Arc::new(Topology::new(count, faces).unwrap());
            let model = ClothModel::new(t.clone(), rest, &fabric).unwrap();
            let s = 1.0 / (n - 1) as f64;
            let x = (0..count).map(|i| Vec3::new((i % n) as f64 * s - 0.5, 0.26, 0.5 - (i / n) as f64 * s)).collect();
            let mut state = ClothState::at_rest(x);
            let (bt, bx) = sphere(0.25);
            let mut col = BodyCollider::new(Arc::new(bt), &bx).unwrap();
            run(&format!("sphere-{}", fabric.name), 96, &model, &mut state, &mut col, |_| None, 12, 0.3);
        }
        "tube" => {
            let (bt, bx) = body();
            let m = n * 5 / 9;
            let (faces, rest, count) = grid(n, m, (1.23, 0.62), true);
            let t = Arc::new(Topology::new(count, faces).unwrap());
            let mut model = ClothModel::new(t.clone(), rest, &fabric).unwrap();
            let top: Vec<[u32; 2]> = (0..n).map(|i| [((m - 1) * n + i) as u32, ((m - 1) * n + (i + 1) % n) as u32]).collect();
            model.add_elastic_band(&top, 0.55, 8.0).unwrap();
            let top2: Vec<[u32; 2]> = (0..n).map(|i| [((m - 2) * n + i) as u32, ((m - 2) * n + (i + 1) % n) as u32]).collect();
            model.add_elastic_band(&top2, 0.55, 8.0).unwrap();
            let x = (0..count).map(|i| {
                let a = std::f64::consts::TAU * (i % n) as f64 / n as f64;
                let y = -0.36 + 0.62 * (i / n) as f64 / (m - 1) as f64;
                Vec3::new(0.22 * a.sin(), y, 0.17 * a.cos() + 0.03)
            }).collect();
            let mut state = ClothState::at_rest(x);
            let mut col = BodyCollider::new(Arc::new(bt), &bx).unwrap();
            let rest_body = bx.clone();
            run(&format!("tube-{}", fabric.name), std::env::var("FRAMES").map_or(150, |v| v.parse().unwrap()), &model, &mut state, &mut col, |f| {
                let time = f as f64 / 30.0;
                if time < 1.0 { return None; }
                let w = 6.0;
                let twist = 0.9 * (w * (time - 1.0)).sin();
                let bend = 0.4 * (0.7 * w * (time - 1.0)).sin();
                Some(rest_body.iter().map(|p| {
                    let h = ((p.y + 0.1) / 0.5).clamp(-1.0, 1.5);
                    let q = Quat::from_rotation_y(twist * h) * Quat::from_rotation_z(bend * h);
                    q * *p + Vec3::new(0.25 * (w * (time - 1.0)).sin(), 0.0, 0.0)
                }).collect())
            }, std::env::var("EVERY").map_or(12, |v| v.parse().unwrap()), 0.4);
        }
        _ => {}
    }
}
