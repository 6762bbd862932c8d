//! Behaviour of the renderer as seen from its public door.

use super::{Camera, Canvas, Figure, Image, Paint, bounds, contact_sheet, picture, picture_on};
use crate::{Topology, Vec3};

/// A unit sphere by latitude and longitude, radius `radius`, centre at `centre`.
fn sphere(rings: usize, sectors: usize, radius: f64, centre: Vec3) -> (Topology, Vec<Vec3>) {
    let mut vertices = vec![centre + radius * Vec3::Y, centre - radius * Vec3::Y];
    for ring in 1..rings {
        let polar = std::f64::consts::PI * ring as f64 / rings as f64;
        for sector in 0..sectors {
            let around = std::f64::consts::TAU * sector as f64 / sectors as f64;
            let out = Vec3::new(polar.sin() * around.sin(), polar.cos(), polar.sin() * around.cos());
            vertices.push(centre + radius * out);
        }
    }
    let at = |ring: usize, sector: usize| (2 + (ring - 1) * sectors + sector % sectors) as u32;
    let mut faces = Vec::new();
    for sector in 0..sectors {
        faces.push([0, at(1, sector), at(1, sector + 1)]);
        faces.push([1, at(rings - 1, sector + 1), at(rings - 1, sector)]);
        for ring in 1..rings - 1 {
            faces.push([at(ring, sector), at(ring + 1, sector), at(ring + 1, sector + 1)]);
            faces.push([at(ring, sector), at(ring + 1, sector + 1), at(ring, sector + 1)]);
        }
    }
    (Topology::new(vertices.len(), faces).unwrap(), vertices)
}

fn is_red(pixel: [u8; 3]) -> bool {
    pixel[0] > pixel[1].saturating_add(40)
}

#[test]
fn a_sphere_covers_the_pixels_that_geometry_says() {
    let (topology, vertices) = sphere(48, 96, 1.0, Vec3::ZERO);
    let camera = Camera::orthographic(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 4.0);
    let mut canvas = Canvas::new(200, 200);
    canvas.draw(&camera, &topology, &vertices, &Paint::Solid([0.9, 0.1, 0.1]));
    let image = canvas.finish();
    let covered = (0..200 * 200).filter(|&i| is_red(image.pixel(i % 200, i / 200))).count() as f64;
    // Radius 1 m at 50 pixels a metre.
    let disc = std::f64::consts::PI * 50.0 * 50.0;
    assert!((covered - disc).abs() < 0.015 * disc, "{covered} pixels, wanted about {disc}");
}

#[test]
fn the_nearer_surface_hides_the_farther_in_any_order() {
    let topology = Topology::new(4, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    let square = |z: f64| [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, z));
    let (near, far) = (square(0.1), square(-0.1));
    let (red, blue) = (Paint::Solid([0.9, 0.1, 0.1]), Paint::Solid([0.1, 0.1, 0.9]));
    for camera in [
        Camera::look_at(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 0.5),
        Camera::orthographic(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 2.0),
    ] {
        let render = |first: (&[Vec3], &Paint), second: (&[Vec3], &Paint)| {
            let mut canvas = Canvas::new(32, 32);
            canvas.draw(&camera, &topology, first.0, first.1);
            canvas.draw(&camera, &topology, second.0, second.1);
            canvas.finish()
        };
        let one = render((&near, &red), (&far, &blue));
        let other = render((&far, &blue), (&near, &red));
        assert_eq!(one, other);
        assert!(is_red(one.pixel(16, 16)));
    }
}

#[test]
fn right_is_right_and_up_is_up() {
    let (topology, right) = sphere(12, 24, 0.2, Vec3::new(0.6, 0.6, 0.0));
    for (azimuth, wanted) in [(0.0, (true, true)), (std::f64::consts::PI, (false, true))] {
        let camera = Camera::framing([Vec3::splat(-1.0), Vec3::splat(1.0)], azimuth, 0.0, 1.0);
        let mut canvas = Canvas::new(64, 64);
        canvas.draw(&camera, &topology, &right, &Paint::Solid([0.9, 0.1, 0.1]));
        let image = canvas.finish();
        let index = (0..64 * 64).find(|&i| is_red(image.pixel(i % 64, i / 64))).unwrap();
        assert_eq!((index % 64 > 32, index / 64 < 32), wanted, "azimuth {azimuth}");
    }
}

#[test]
fn framing_shows_the_whole_box_and_wastes_little() {
    let corners = [Vec3::new(-0.4, 0.0, -0.2), Vec3::new(0.4, 1.7, 0.3)];
    for (azimuth, elevation, aspect) in [(0.0, 0.0, 0.66), (0.7, 0.3, 0.66), (2.0, -0.4, 1.5)] {
        for camera in [
            Camera::framing(corners, azimuth, elevation, aspect),
            Camera::framing_orthographic(corners, azimuth, elevation, aspect),
        ] {
            let (height, width) = (1000usize, (1000.0 * aspect) as usize);
            let mut fill = 0.0f64;
            for index in 0..8 {
                let pick = |axis: usize| corners[index >> axis & 1][axis];
                let at = camera.project(Vec3::new(pick(0), pick(1), pick(2)), width, height);
                let x = (2.0 * f64::from(at.x) / width as f64 - 1.0).abs();
                let y = (2.0 * f64::from(at.y) / height as f64 - 1.0).abs();
                fill = fill.max(x).max(y);
            }
            assert!(fill < 1.0 && fill > 0.85, "fills {fill}");
        }
    }
}

#[test]
fn a_ray_through_a_projected_point_meets_the_point() {
    let point = Vec3::new(0.3, 0.9, -0.2);
    for camera in [
        Camera::look_at(Vec3::new(1.0, 2.0, 4.0), Vec3::new(0.0, 1.0, 0.0), 0.6),
        Camera::orthographic(Vec3::new(1.0, 2.0, 4.0), Vec3::new(0.0, 1.0, 0.0), 2.0),
    ] {
        let at = camera.project(point, 640, 480);
        let (origin, along) = camera.ray(f64::from(at.x), f64::from(at.y), 640, 480);
        let miss = (point - origin).cross(along.normalize()).length();
        assert!(miss < 1e-5, "misses by {miss} m");
    }
}

#[test]
fn feet_darken_the_ground_and_the_sky_stays() {
    let (topology, vertices) = sphere(24, 48, 0.5, Vec3::new(0.0, 0.5, 0.0));
    let figures = [Figure::new(&topology, &vertices, Paint::Solid([0.8, 0.8, 0.8]))];
    let camera = Camera::framing([Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 1.2, 1.0)], 0.0, 0.2, 1.0);
    let with = picture_on(200, 200, &camera, &figures, 0.0);
    let without = picture_on(200, 200, &camera, &[], 0.0);
    let at = camera.project(Vec3::new(0.0, 0.0, 0.3), 200, 200);
    let (x, y) = (at.x as usize, at.y as usize);
    assert!(with.pixel(x, y)[1] < 200, "ground under the sphere is {:?}", with.pixel(x, y));
    assert!(without.pixel(x, y)[1] > 220);
    assert_eq!(with.pixel(5, 3), without.pixel(5, 3));
}

#[test]
fn meshes_that_are_not_finite_or_behind_the_eye_draw_nothing() {
    let topology = Topology::new(3, vec![[0, 1, 2]]).unwrap();
    let camera = Camera::look_at(Vec3::new(0.0, 0.0, 2.0), Vec3::ZERO, 0.6);
    let empty = Canvas::new(40, 40).finish();
    for vertices in [
        [Vec3::NAN, Vec3::X, Vec3::Y],
        [Vec3::new(0.0, 0.0, 9.0), Vec3::new(1.0, 0.0, 9.0), Vec3::new(0.0, 1.0, 9.0)],
        [Vec3::X, Vec3::X, Vec3::X],
    ] {
        let mut canvas = Canvas::new(40, 40);
        canvas.draw(&camera, &topology, &vertices, &Paint::Solid([1.0, 0.0, 0.0]));
        canvas.draw_ground(&camera, -50.0, &[Figure::new(&topology, &vertices, Paint::Solid([1.0; 3]))]);
        assert_eq!(canvas.finish(), empty);
    }
}

#[test]
fn sheets_keep_reading_order_and_labels_leave_dots() {
    let tiles = [[250, 0, 0], [0, 250, 0], [0, 0, 250]].map(|colour| Image::filled(10, 20, colour));
    let sheet = contact_sheet(&tiles, 2);
    assert_eq!((sheet.width, sheet.height), (2 * 16 + 6, 2 * 26 + 6));
    assert_eq!(sheet.pixel(8, 8), [250, 0, 0]);
    assert_eq!(sheet.pixel(8 + 16, 8), [0, 250, 0]);
    assert_eq!(sheet.pixel(8, 8 + 26), [0, 0, 250]);
    let mut page = Image::filled(80, 20, [255; 3]);
    page.label(1, 1, "I1é", [0; 3], 2);
    let dots = page.rgb.chunks(3).filter(|pixel| *pixel == [0; 3]).count();
    // I has 11 dots, 1 has 10 and the unknown letter is a box of 20; each dot is 2 × 2 pixels.
    assert_eq!(dots, 4 * (11 + 10 + 20));
}

#[test]
fn a_dressed_body_sized_scene_is_drawn_in_time() {
    let (body, skin) = sphere(90, 148, 0.9, Vec3::new(0.0, 0.9, 0.0));
    let (cloth, shirt) = sphere(60, 80, 0.92, Vec3::new(0.0, 0.9, 0.0));
    let figures = [
        Figure::new(&body, &skin, Paint::Solid([0.8, 0.6, 0.5])),
        Figure::new(&cloth, &shirt, Paint::Solid([0.2, 0.4, 0.7])),
        Figure::new(&cloth, &shirt, Paint::Solid([0.2, 0.2, 0.3])),
    ];
    let camera = Camera::framing(bounds(&figures), 0.4, 0.1, 600.0 / 900.0);
    let best = (0..5)
        .map(|_| {
            let start = std::time::Instant::now();
            let image = picture(600, 900, &camera, &figures);
            assert_eq!(image.width, 600);
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min);
    eprintln!("13k-vertex body and two garments at 600 x 900: {:.1} ms", 1e3 * best);
    assert!(best < 0.5, "took {best} s");
}
