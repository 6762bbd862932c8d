use modiste_body::ScapeModel;
use modiste_core::Vec3;
use modiste_core::render::*;
use modiste_hair::*;
fn main() {
    let model = ScapeModel::load("assets/body-female.safetensors").unwrap();
    let body = model.body(&[]).unwrap();
    let mut tiles = Vec::new();
    for style in Style::ALL {
        for length in [0.0, 1.0] {
            let t = std::time::Instant::now();
            let groom = Groom::grow(&body, style, length, 962, 1).unwrap();
            println!("{style:?} {:?}", t.elapsed());
            for az in [0.5, 1.57, 3.14] {
                let mut canvas = Canvas::new(360, 400);
                let cam = Camera::framing([Vec3::new(-0.16, 1.2, -0.16), Vec3::new(0.16, 1.66, 0.2)], az, 0.1, 0.9);
                canvas.draw(&cam, model.topology(), body.rest_vertices(), &Paint::Solid([0.8, 0.63, 0.54]));
                canvas.draw_strands(&cam, &Strands { points: &groom.guides.points, points_per_strand: POINTS, colours: &[[0.35, 0.2, 0.1]], width: 0.003 });
                tiles.push(canvas.finish());
            }
        }
    }
    let sheet = contact_sheet(&tiles, 6);
    modiste_io::png::write("/tmp/groom.png", sheet.width, sheet.height, &sheet.rgb).unwrap();
}
