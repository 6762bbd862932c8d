//! The fit of one garment: the paper's three iterations, then the exact push-out.

use std::sync::Arc;

use modiste_body::Part;
use modiste_core::{Topology, Vec3};

use super::band::Band;
use super::contacts::MOST;
use super::cover::{Cover, Ground};
use super::exact::{ExactOptions, ExactPush, ExactReport};
use super::home::homes;
use super::obstacle::Obstacle;
use super::paper::{CombinedVertices, Correspondence, PaperMemory, PaperOptions, push_out};
use super::warp::Warp;

/// Which parts of the fit run, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct FitOptions {
    /// The paper's iterations; `None` leaves them out. Alone they find correspondences as the paper does, between vertices;
    /// before the exact push-out they take the nearest points of triangles, which that needs in any case.
    pub paper: Option<PaperOptions>,
    /// The exact push-out; `None` leaves it out.
    pub exact: Option<ExactOptions>,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { paper: Some(PaperOptions::default()), exact: Some(ExactOptions::default()) }
    }
}

impl FitOptions {
    /// The fit that also parts triangles which cross a surface between their corners; not for real time.
    pub fn careful() -> Self {
        let exact = ExactOptions { fold_rounds: 4, crossing_rounds: 1, ..ExactOptions::default() };
        Self { exact: Some(exact), ..Self::default() }
    }

    /// The paper's three iterations alone.
    pub fn paper_only() -> Self {
        Self { exact: None, ..Self::default() }
    }
}

/// A surface under a garment.
#[derive(Debug, Clone, Copy)]
pub struct Below<'a> {
    /// The surface.
    pub obstacle: &'a Obstacle,
    /// Its vertices that belong to the combined vertex set of the paper's correspondences.
    pub members: &'a [u32],
}

/// Fits one garment frame by frame. Holds what is constant for the garment and all memory that a frame needs.
#[derive(Debug, Clone)]
pub struct Fit {
    options: FitOptions,
    waist_band: Vec<u32>,
    solver: Warp,
    combined: CombinedVertices,
    correspondences: Vec<Option<Correspondence>>,
    memory: PaperMemory,
    exact: Option<ExactPush>,
    band: Band,
    /// The garment as it was handed in (m).
    predicted: Vec<Vec3>,
}

impl Fit {
    /// Prepares the fit of a garment; `waist_band` are the vertices that are held tight, if any.
    pub fn new(topology: &Arc<Topology>, waist_band: &[u32], options: FitOptions) -> Self {
        Self {
            waist_band: waist_band.to_vec(),
            solver: Warp::new(topology),
            combined: CombinedVertices::default(),
            correspondences: Vec::new(),
            memory: PaperMemory::default(),
            exact: options.exact.map(|exact| ExactPush::new(topology, exact)),
            band: Band::new(topology, waist_band),
            predicted: Vec::new(),
            options,
        }
    }

    /// The same, for a garment that is worn like this (m) on the body at rest, each face on a part of it: the vertices leave
    /// other limbs on the side of what they are worn on, and leave `above` (m) for the garments over them.
    #[must_use]
    pub fn worn(mut self, rest: &[Vec3], faces: &[[u32; 3]], face_parts: &[Part], above: f64) -> Self {
        if let Some(exact) = &mut self.exact {
            exact.wear(homes(rest, faces, face_parts), above);
        }
        self
    }

    /// Finds how the garment as it was predicted (m, world) lies to the body. Garments can do so side by side, before one is
    /// fitted after the other.
    pub(crate) fn approach(&mut self, body: &Obstacle, garment: &[Vec3]) {
        self.predicted.clear();
        self.predicted.extend_from_slice(garment);
        if let Some(exact) = &mut self.exact {
            exact.approach(body, garment);
        }
    }

    /// Moves the vertices of the garment (m, world) out of all surfaces below it, the body first, after [`Self::approach`];
    /// `cover` says how thick other garments lie on the body. Without a body nothing is done.
    ///
    /// # Panics
    /// If there is not one vertex for each of the garment's topology.
    pub(crate) fn fit(&mut self, below: &[Below<'_>], cover: &Cover, garment: &mut [Vec3]) -> ExactReport {
        if below.is_empty() {
            return ExactReport::default();
        }
        match (&mut self.exact, &self.options.paper) {
            (Some(exact), paper) => {
                let mut grounds: [_; MOST] = std::array::from_fn(|index| {
                    let surface = below[index.min(below.len() - 1)];
                    Ground { obstacle: surface.obstacle, cover: None }
                });
                grounds[0].cover = Some(cover).filter(|cover| !cover.is_empty());
                let first = (paper.as_ref(), &mut self.band);
                exact.run(&mut self.solver, &grounds[..below.len().min(MOST)], first, &self.predicted, garment)
            }
            (None, Some(paper)) => {
                let surfaces: Vec<(&Obstacle, &[u32])> =
                    below.iter().map(|surface| (surface.obstacle, surface.members)).collect();
                self.combined.fill(&surfaces);
                self.combined.correspond(&surfaces, garment, &mut self.correspondences);
                let memory = &mut self.memory;
                push_out(&mut self.solver, paper, &self.correspondences, &self.waist_band, garment, memory);
                ExactReport::default()
            }
            (None, None) => ExactReport::default(),
        }
    }

    /// Moves the surface of the garment to where it was fitted last, its outside away from the body.
    pub(crate) fn update_surface(&self, vertices: &[Vec3], surface: &mut Obstacle) {
        match &self.exact {
            Some(exact) => surface.update_worn(vertices, exact.outward()),
            None => surface.update(vertices),
        }
    }

    /// Lays the garment as it was fitted last on the faces of the body that it covers, for those above it; `thickness` in
    /// metres.
    pub(crate) fn lay_on(&self, body: &Obstacle, covered: &[bool], cover: &mut Cover, thickness: f64) {
        if let Some(exact) = &self.exact {
            let contacts = exact.body_contacts().filter(|contact| covered[contact.face as usize]);
            cover.lay(body.topology(), body.vertices(), contacts, thickness);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Below, Cover, ExactReport, Fit, FitOptions};
    use crate::refine::obstacle::Obstacle;
    use crate::refine::penetration::measure;
    use modiste_core::shapes::icosphere;
    use modiste_core::{Mesh, Quat, Vec3};

    /// Fits a garment to what is below it, all at once.
    fn put_on(mut fit: Fit, below: &[Below<'_>], garment: &mut [Vec3]) -> ExactReport {
        fit.approach(below[0].obstacle, garment);
        fit.fit(below, &Cover::default(), garment)
    }

    /// A sphere of 0.2 m for a body, and the members of its vertex set.
    fn body() -> (Mesh, Obstacle, Vec<u32>) {
        let mut sphere = icosphere(4);
        sphere.vertices.iter_mut().for_each(|v| *v *= 0.2);
        let members = (0..sphere.vertices.len() as u32).collect();
        let obstacle = Obstacle::single(sphere.topology.clone(), &sphere.vertices);
        (sphere, obstacle, members)
    }

    /// A ball of cloth around the body, pushed in near one pole.
    fn cloth(radius: f64, dent: f64) -> Mesh {
        let mut sphere = icosphere(4);
        // In no plane of symmetry of the body, where two faces may be equally near.
        let turn = Quat::from_rotation_y(0.1) * Quat::from_rotation_z(0.07);
        for vertex in &mut sphere.vertices {
            let inward = dent * (-(*vertex - Vec3::X).length_squared() / 0.1).exp();
            *vertex = turn * ((radius - inward) * *vertex);
        }
        sphere
    }

    #[test]
    fn nothing_stays_inside_and_far_vertices_stay_where_they_are() {
        let (sphere, obstacle, members) = body();
        let garment = cloth(0.21, 0.03);
        let mut fitted = garment.vertices.clone();
        let below = [Below { obstacle: &obstacle, members: &members }];
        let before = measure(&sphere.topology, &sphere.vertices, &garment.vertices);
        assert!(before.count > 50 && before.worst_depth > 0.015, "{before:?}");
        let report = put_on(Fit::new(&garment.topology, &[], FitOptions::default()), &below, &mut fitted);
        let after = measure(&sphere.topology, &sphere.vertices, &fitted);
        assert_eq!((after.count, report.inside_after), (0, 0));
        let still = garment.vertices.iter().zip(&fitted).filter(|(before, _)| before.x < 0.0);
        assert!(still.clone().count() > 1000);
        assert!(still.into_iter().all(|(before, after)| before == after));
        // Smooth: no vertex is moved much further than its dent asks for.
        let furthest = garment.vertices.iter().zip(&fitted).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(furthest < 0.03, "{furthest}");
        // No vertex of the body shows.
        let shows = measure(&garment.topology, &fitted, &sphere.vertices);
        assert_eq!(shows.count, sphere.vertices.len(), "all of the body is inside the cloth");
    }

    #[test]
    fn the_papers_iterations_alone_leave_less_than_they_found() {
        let (sphere, obstacle, members) = body();
        let garment = cloth(0.205, 0.02);
        let mut fitted = garment.vertices.clone();
        let below = [Below { obstacle: &obstacle, members: &members }];
        put_on(Fit::new(&garment.topology, &[], FitOptions::paper_only()), &below, &mut fitted);
        let before = measure(&sphere.topology, &sphere.vertices, &garment.vertices);
        let after = measure(&sphere.topology, &sphere.vertices, &fitted);
        assert!(after.worst_depth < 0.2 * before.worst_depth, "{before:?} {after:?}");
    }

    #[test]
    fn the_fit_turns_with_the_world() {
        let (sphere, obstacle, members) = body();
        let garment = cloth(0.205, 0.02);
        let turn = Quat::from_rotation_x(0.4) * Quat::from_rotation_y(-1.0) * Quat::from_rotation_z(2.0);
        let shift = Vec3::new(1.0, -2.0, 0.5);
        let moved = |x: &[Vec3]| -> Vec<Vec3> { x.iter().map(|v| turn * *v + shift).collect() };
        let run = |obstacle: &Obstacle, mut vertices: Vec<Vec3>| {
            let below = [Below { obstacle, members: &members }];
            put_on(Fit::new(&garment.topology, &[], FitOptions::default()), &below, &mut vertices);
            vertices
        };
        let plain = run(&obstacle, garment.vertices.clone());
        let turned = Obstacle::single(sphere.topology.clone(), &moved(&sphere.vertices));
        let turned = run(&turned, moved(&garment.vertices));
        for (a, b) in moved(&plain).iter().zip(&turned) {
            assert!(a.distance(*b) < 1e-6, "{a} {b}");
        }
    }

    #[test]
    fn an_outer_layer_ends_outside_the_inner() {
        let (sphere, obstacle, members) = body();
        let inner = cloth(0.21, 0.0);
        let inner_surface = Obstacle::single(inner.topology.clone(), &inner.vertices);
        let inner_members: Vec<u32> = (0..inner.vertices.len() as u32).collect();
        let outer = cloth(0.215, 0.02);
        let mut fitted = outer.vertices.clone();
        let below = [
            Below { obstacle: &obstacle, members: &members[..0] },
            Below { obstacle: &inner_surface, members: &inner_members },
        ];
        assert!(measure(&inner.topology, &inner.vertices, &outer.vertices).count > 20);
        put_on(Fit::new(&outer.topology, &[], FitOptions::default()), &below, &mut fitted);
        assert_eq!(measure(&inner.topology, &inner.vertices, &fitted).count, 0);
        assert_eq!(measure(&sphere.topology, &sphere.vertices, &fitted).count, 0);
    }

    #[test]
    fn a_band_that_stands_off_the_body_does_not_show_through_the_layer_over_it() {
        // Nearly flat, so that only the end of the inner layer asks for a look around.
        let ball = |subdivisions: usize, radius: f64| {
            let mut ball = icosphere(subdivisions);
            ball.vertices.iter_mut().for_each(|v| *v *= radius);
            ball
        };
        let body = ball(5, 1.0);
        let members: Vec<u32> = (0..body.vertices.len() as u32).collect();
        let obstacle = Obstacle::single(body.topology.clone(), &body.vertices);
        // The lower half of a ball of cloth, 8 mm off the body: its rim is the band.
        let ball_of_cloth = ball(5, 1.008);
        let is_low = |face: &&[u32; 3]| face.iter().all(|&v| ball_of_cloth.vertices[v as usize].y < 0.01);
        let faces: Vec<[u32; 3]> = ball_of_cloth.topology.faces().iter().filter(is_low).copied().collect();
        let mut low: Vec<u32> = faces.as_flattened().to_vec();
        low.sort_unstable();
        low.dedup();
        let inner = std::sync::Arc::new(modiste_core::Topology::new(ball_of_cloth.vertices.len(), faces).unwrap());
        let inner_surface = Obstacle::single(inner, &ball_of_cloth.vertices);
        let below =
            [Below { obstacle: &obstacle, members: &members }, Below { obstacle: &inner_surface, members: &low }];
        // The layer over it is coarser, and close to the body.
        let outer = ball(4, 1.003);
        let mut fitted = outer.vertices.clone();
        put_on(Fit::new(&outer.topology, &[], FitOptions::default()), &below, &mut fitted);
        let places: Vec<_> = low.iter().map(|&v| ball_of_cloth.vertices[v as usize]).collect();
        let covered = measure(&outer.topology, &fitted, &places).count;
        assert_eq!(covered, low.len(), "all of the inner layer is under the outer one");
    }

    #[test]
    fn the_waist_band_is_drawn_to_the_body() {
        let (_, obstacle, members) = body();
        let garment = cloth(0.23, 0.0);
        let band: Vec<u32> =
            (0u32..).zip(&garment.vertices).filter(|(_, v)| v.y.abs() < 0.02).map(|(vertex, _)| vertex).collect();
        let below = [Below { obstacle: &obstacle, members: &members }];
        let mut fitted = garment.vertices.clone();
        put_on(Fit::new(&garment.topology, &band, FitOptions::default()), &below, &mut fitted);
        let mean = |x: &[Vec3]| band.iter().map(|&v| x[v as usize].length() - 0.2).sum::<f64>() / band.len() as f64;
        assert!(mean(&fitted) < 0.6 * mean(&garment.vertices), "{} {}", mean(&fitted), mean(&garment.vertices));
    }
}
