//! The drape test: a disc of cloth held over a smaller plate (Cusick 1968, BS 5058).

use std::sync::Arc;
use std::time::Instant;

use modiste_core::{Topology, Vec2, Vec3, normal, seeded_rng};
use serde::Serialize;

use super::sheet::FRAME;
use crate::{BodyCollider, ClothError, ClothModel, ClothState, Fabric, Solver, SolverOptions};

/// Radii of the disc and of the plate (m).
const DISC: f64 = 0.15;
const PLATE: f64 = 0.09;

/// Rings of the disc that are held: three of five.
const RINGS_OF_PLATE: [usize; 2] = [3, 5];

/// Side of a pixel of the shadow (m).
const PIXEL: f64 = 0.0005;

/// Roughness of the flat disc (m): folds must begin somewhere.
const ROUGHNESS: f64 = 1e-4;

/// Drag of the air on the disc (N·s/m³, as in [`SolverOptions`]), more than on garments: it hangs still sooner, and in the same way.
const AIR_DRAG: f64 = 0.5;

/// Most frames until the disc hangs, and the speed (m/s) below which it does. Folds that begin alike all around may stand for a
/// moment before they join, so that there is no rest before three seconds.
const FRAMES: usize = 600;
const LEAST_FRAMES: usize = 90;
const AT_REST: f64 = 0.002;

/// How exactly each step is solved, and the iterations that may take. With 0.1 and 200 a disc of 3.75 mm edges crept for 20
/// seconds and stopped where no rest was, its rim 2 mm too high.
const TOLERANCE: f64 = 0.003;
const MAX_ITERATIONS: usize = 3000;

/// Frames without motion that count as rest.
const QUIET: usize = 8;

/// A disc that was draped.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DrapeRun {
    /// The fabric.
    pub fabric: String,
    /// Number of vertices.
    pub vertices: usize,
    /// Mean length of an edge (m).
    pub edge_length: f64,
    /// Steps per frame.
    pub substeps: usize,
    /// Area of the shadow over that of the flat disc, both less the plate.
    pub coefficient: f64,
    /// Number of folds: maxima of the rim's distance from the middle.
    pub folds: usize,
    /// Mean height of the rim below the plate (m).
    pub drop: f64,
    /// Whether it hung still within 20 seconds.
    pub at_rest: bool,
    /// Frames that it took.
    pub frames: usize,
    /// Time of a frame on this machine (s), in the mean.
    pub frame_seconds: f64,
}

/// How a disc is draped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct DrapeOptions {
    /// Rings of vertices, a multiple of five.
    pub rings: usize,
    /// Steps per frame.
    pub substeps: usize,
    /// Whether the fabric is changed to what the mesh can show, as in garments: [`Fabric::resolved_by`] the edges.
    pub resolved: bool,
    /// Seed of the roughness from which folds begin.
    pub seed: u64,
}

/// Drapes a disc over the plate, from flat to rest.
///
/// # Errors
/// What the solver refuses.
pub fn drape(fabric: &Fabric, options: DrapeOptions) -> Result<DrapeRun, ClothError> {
    let DrapeOptions { rings, substeps, resolved, seed } = options;
    let edge_length = DISC / rings as f64;
    let (flat, topology) = disc(rings);
    let resolved = if resolved { fabric.resolved_by(edge_length, 9.81) } else { fabric.clone() };
    let rest = topology.faces().iter().map(|face| face.map(|v| flat[v as usize])).collect();
    let mut model = ClothModel::new(Arc::clone(&topology), rest, &resolved)?;
    let held = 1 + 3 * pinned_rings(rings) * (pinned_rings(rings) + 1);
    model.pins = (0..held as u32).collect();
    let mut rng = seeded_rng(seed);
    let lifted = |(v, p): (usize, &Vec2)| {
        let height = if v < held { 0.0 } else { ROUGHNESS * normal(&mut rng) };
        Vec3::new(p.x, height, -p.y)
    };
    let mut state = ClothState::at_rest(flat.iter().enumerate().map(lifted).collect());
    let options = SolverOptions {
        substeps,
        tolerance: TOLERANCE,
        max_iterations: MAX_ITERATIONS,
        air_drag: AIR_DRAG,
        ..SolverOptions::default()
    };
    let mut solver = Solver::new(&model, options);
    let clock = Instant::now();
    let (mut frames, mut quiet) = (0, 0);
    while frames < LEAST_FRAMES || frames < FRAMES && quiet < QUIET {
        let report = solver.step(&model, &mut state, &mut BodyCollider::none(), FRAME)?;
        quiet = if report.max_speed < AT_REST { quiet + 1 } else { 0 };
        frames += 1;
    }
    let frame_seconds = clock.elapsed().as_secs_f64() / frames as f64;
    let plate = std::f64::consts::PI * PLATE * PLATE;
    let whole = std::f64::consts::PI * DISC * DISC;
    let rim = &state.positions[flat.len() - 6 * rings..];
    Ok(DrapeRun {
        fabric: fabric.name.clone(),
        vertices: flat.len(),
        edge_length,
        substeps,
        coefficient: (shadow(&topology, &state.positions) - plate) / (whole - plate),
        folds: folds(rim),
        drop: -rim.iter().map(|x| x.y).sum::<f64>() / rim.len() as f64,
        at_rest: quiet >= QUIET,
        frames,
        frame_seconds,
    })
}

fn pinned_rings(rings: usize) -> usize {
    rings * RINGS_OF_PLATE[0] / RINGS_OF_PLATE[1]
}

/// Radius (m) of a ring of the disc. The bend at the last held ring stands for half an edge before and behind it, so that the cloth
/// is clamped half an edge within: there the plate ends. With the ring itself on the plate's rim, a coarse disc hangs over
/// by half an edge more.
fn radius(ring: usize, rings: usize) -> f64 {
    let held = pinned_rings(rings);
    let outer = (DISC - PLATE) / ((rings - held) as f64 + 0.5);
    let last_held = PLATE + 0.5 * outer;
    if ring <= held { last_held * ring as f64 / held as f64 } else { last_held + outer * (ring - held) as f64 }
}

/// A flat disc (m): a middle and rings of 6, 12, 18 … vertices, the rim last.
fn disc(rings: usize) -> (Vec<Vec2>, Arc<Topology>) {
    let mut points = vec![Vec2::ZERO];
    for ring in 1..=rings {
        for side in 0..6 * ring {
            let angle = std::f64::consts::TAU * side as f64 / (6 * ring) as f64;
            points.push(radius(ring, rings) * Vec2::from_angle(angle));
        }
    }
    let first = |ring: usize| if ring == 0 { 0 } else { 1 + 3 * ring * (ring - 1) };
    let vertex = |ring: usize, side: usize| (first(ring) + side % (6 * ring).max(1)) as u32;
    let mut faces = Vec::new();
    for ring in 1..=rings {
        for sector in 0..6 {
            for step in 0..ring {
                let (outer, inner) = (sector * ring + step, sector * (ring - 1) + step);
                faces.push([vertex(ring - 1, inner), vertex(ring, outer), vertex(ring, outer + 1)]);
                if step + 1 < ring {
                    faces.push([vertex(ring - 1, inner), vertex(ring, outer + 1), vertex(ring - 1, inner + 1)]);
                }
            }
        }
    }
    let topology = Topology::new(points.len(), faces);
    (points, Arc::new(topology.unwrap_or_else(|_| unreachable!("rings are joined by their own vertices"))))
}

/// Area (m²) of the shadow of a mesh under light from above.
fn shadow(topology: &Topology, x: &[Vec3]) -> f64 {
    let side = (2.2 * DISC / PIXEL) as usize;
    let mut dark = vec![false; side * side];
    let centre = |index: usize| (index as f64 + 0.5) * PIXEL - 1.1 * DISC;
    let index = |coordinate: f64| ((coordinate + 1.1 * DISC) / PIXEL).floor().clamp(0.0, side as f64 - 1.0) as usize;
    for face in topology.faces() {
        let [a, b, c] = face.map(|v| Vec2::new(x[v as usize].x, x[v as usize].z));
        let area = (b - a).perp_dot(c - a);
        if area == 0.0 {
            continue;
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        for row in index(low.y)..=index(high.y) {
            for column in index(low.x)..=index(high.x) {
                let p = Vec2::new(centre(column), centre(row));
                let is_left = |a: Vec2, b: Vec2| (b - a).perp_dot(p - a) * area.signum() >= 0.0;
                dark[row * side + column] |= is_left(a, b) && is_left(b, c) && is_left(c, a);
            }
        }
    }
    dark.iter().filter(|dark| **dark).count() as f64 * PIXEL * PIXEL
}

/// Number of maxima of the rim's distance from the middle that stand out by a twentieth of its range.
fn folds(rim: &[Vec3]) -> usize {
    let distance: Vec<f64> = rim.iter().map(|x| x.x.hypot(x.z)).collect();
    let (low, high) = distance.iter().fold((f64::INFINITY, 0.0f64), |(l, h), &d| (l.min(d), h.max(d)));
    let (up, down) = (low + 0.55 * (high - low), low + 0.45 * (high - low));
    // Crossings of a band about the middle, so that ripples do not count.
    let mut state = None;
    let mut count = 0;
    for &d in distance.iter().chain(&distance) {
        if d > up && state == Some(false) {
            count += 1;
        }
        state = if d > up {
            Some(true)
        } else if d < down {
            Some(false)
        } else {
            state
        };
    }
    // Twice around; the first time may begin within a fold.
    count / 2 + count % 2
}

#[cfg(test)]
mod tests {
    use super::{DISC, DrapeOptions, disc, drape, folds, shadow};
    use crate::{Bend, Fabric};
    use modiste_core::Vec3;

    #[test]
    fn a_flat_disc_shades_its_own_area_and_a_wavy_rim_has_folds() {
        let (flat, topology) = disc(10);
        assert_eq!(flat.len(), 331);
        let x: Vec<Vec3> = flat.iter().map(|p| Vec3::new(p.x, 0.0, -p.y)).collect();
        let area = std::f64::consts::PI * DISC * DISC;
        assert!((shadow(&topology, &x) / area - 1.0).abs() < 0.005);
        let wavy = |angle: f64| {
            let radius = 0.1 + 0.02 * (7.0 * angle).sin();
            Vec3::new(radius * angle.cos(), 0.0, radius * angle.sin())
        };
        let rim: Vec<Vec3> = (0..200).map(|i| wavy(std::f64::consts::TAU * f64::from(i) / 200.0)).collect();
        assert_eq!(folds(&rim), 7);
    }

    #[test]
    fn a_stiff_disc_stays_out_and_a_limp_one_falls() {
        let coarse = |rings| DrapeOptions { rings, substeps: 8, resolved: true, seed: 1968 };
        let stiff = Fabric { bend: Bend::isotropic(1e-2), ..Fabric::jersey() };
        let stays = drape(&stiff, coarse(5)).unwrap();
        assert!(stays.coefficient > 0.95, "{stays:?}");
        let falls = drape(&Fabric::jersey(), coarse(10)).unwrap();
        assert!(falls.coefficient < 0.8 && falls.drop > 0.02, "{falls:?}");
    }
}
