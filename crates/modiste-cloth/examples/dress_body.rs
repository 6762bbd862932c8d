//! Dresses a body and draws it: `cargo run --release -p modiste-cloth --example dress_body -- BODY.safetensors GARMENT OUT.png
//! [β,β,…]`.

use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

use modiste_body::ScapeModel;
use modiste_cloth::dress::{Carrier, Mannequin, Tailor, TailorOptions};
use modiste_cloth::pattern::builtin;
use modiste_core::Vec3;
use modiste_core::render::{Camera, Figure, Paint, contact_sheet, picture};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, garment, out, rest @ ..] = &arguments[..] else {
        return Err("body model, garment and picture are wanted".into());
    };
    let model = ScapeModel::load(model)?;
    let shape = |text: &str| text.split(',').map(str::parse).collect::<Result<Vec<f64>, _>>();
    let pattern = builtin(garment, model.gender()).ok_or("no such garment")??;
    let vertex_count = std::env::var("VERTICES").map_or(Ok(4500), |v| v.parse())?;
    let mut options = TailorOptions { vertex_count, ..TailorOptions::default() };
    if let Ok(v) = std::env::var("ITER") { options.solver.max_iterations = v.parse()?; }
    if let Ok(v) = std::env::var("SUB") { options.solver.substeps = v.parse()?; }
    if let Ok(v) = std::env::var("CONTACT") { options.solver.contact_stiffness = v.parse()?; }
    if let Ok(v) = std::env::var("TOL") { options.solver.tolerance = v.parse()?; }
    if let Ok(v) = std::env::var("THICK") { options.solver.thickness = v.parse()?; }
    if let Ok(v) = std::env::var("DAMP") { options.solver.damping = v.parse()?; }
    let tailor = Tailor::new(Arc::new(pattern), options)?;
    let mean = Mannequin::from(&model.body(&[])?);
    eprintln!("{} vertices, girths {:?}", tailor.cut().topology().vertex_count(), mean.girths());
    let clock = Instant::now();
    let mut dressed = tailor.dress(&mean)?;
    let mut body = mean.clone();
    eprintln!("{:.1} s", clock.elapsed().as_secs_f64());
    describe(&tailor, &dressed);
    if let Some(text) = rest.first() {
        let clock = Instant::now();
        body = Mannequin::from(&model.body(&shape(text)?)?);
        let carrier = Carrier::new(&dressed.state.positions, &mean.vertices);
        dressed = tailor.redress(&carrier, &dressed, &mean, &body)?;
        eprintln!("{:.1} s, girths {:?}", clock.elapsed().as_secs_f64(), body.girths());
        describe(&tailor, &dressed);
    }
    draw(&tailor, &dressed.state.positions, &body, garment == "shorts", out)
}

fn describe(tailor: &Tailor, dressed: &modiste_cloth::dress::Dressed) {
    let size = &tailor.cut().pattern().sizes[dressed.size];
    let widest = 1e3 * dressed.widest_seam;
    eprintln!("size {}, seams {widest:.2} mm, speed {:.4} m/s, {:?}", size.name, dressed.speed, dressed.quality);
}

fn draw(tailor: &Tailor, cloth: &[Vec3], body: &Mannequin, lower: bool, out: &str) -> Result<(), Box<dyn Error>> {
    let figures = [
        Figure::new(&body.topology, &body.vertices, Paint::Solid([0.85, 0.68, 0.58])),
        Figure::new(tailor.cut().topology(), cloth, Paint::Solid([0.30, 0.45, 0.75])),
    ];
    let (low, high) = cloth.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    let margin = Vec3::splat(0.03);
    let views: &[(f64, f64)] =
        if lower { &[(0.0, 0.0), (0.9, 0.1), (1.57, 0.0), (3.14, 0.0), (0.3, -0.5), (3.4, 0.5)] }
        else { &[(0.0, 0.05), (0.8, 0.3), (1.57, 0.0), (3.14, 0.05), (0.5, -0.5), (3.8, 0.5)] };
    let images: Vec<_> = views
        .iter()
        .map(|&(turn, pitch)| {
            let camera = Camera::framing([low - margin, high + margin], turn, pitch, 1.0);
            picture(700, 700, &camera, &figures)
        })
        .collect();
    let sheet = contact_sheet(&images, 3);
    modiste_io::png::write(out, sheet.width, sheet.height, &sheet.rgb)?;
    Ok(())
}
