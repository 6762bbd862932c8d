//! Several garments on one body: synthesis, then the fit from the inside out (DRAPE §5, Guan ch. 5 §4).

use std::sync::Arc;
use std::time::Instant;

use modiste_body::{Body, Gender, Part, Pose};
use modiste_core::{Topology, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::refine::{Below, Cover, ExactReport, Fit, FitOptions, Left, MOST, Obstacle, upper_body};
use crate::{DrapeModel, GarmentError, GarmentFlags, Synthesis, Wrinkles};

/// Distance from the faces of an inner garment at which the outside begins for those over it (m).
const CLOTH_THICKNESS: f64 = 0.0015;

/// What an outfit needs to know of a body.
#[derive(Debug, Clone, Copy)]
pub struct Wearer<'a> {
    /// Which body model it belongs to.
    pub gender: Gender,
    /// Body shape in standard deviations, β.
    pub shape: &'a [f64],
    /// Its triangles.
    pub topology: &'a Arc<Topology>,
    /// The part of each face.
    pub face_parts: &'a [Part],
    /// The part of each vertex.
    pub vertex_parts: &'a [Part],
    /// Its vertices in the template pose (m).
    pub template_vertices: &'a [Vec3],
    /// The pose in which it has them.
    pub template_pose: &'a Pose,
}

/// What happened to one garment in one frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct LayerReport {
    /// Vertices inside a surface below after the paper's iterations.
    pub inside_before: usize,
    /// Depth of the deepest of them (m).
    pub depth_before: f64,
    /// Vertices that are left inside a surface below.
    pub inside_after: usize,
    /// Depth of the deepest of them (m).
    pub depth_after: f64,
    /// Vertices caught between parts of the body that pass through each other.
    pub pinched: usize,
    /// Rounds of exact pushing.
    pub rounds: usize,
    /// Triangles that could not be moved out of what they cross.
    pub left: Left,
    /// Time of its synthesis (s); others may have been made at the same time.
    pub synthesis_seconds: f64,
    /// Time of the fit (s).
    pub fit_seconds: f64,
}

/// What happened in one frame.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameReport {
    /// Time to pose the body, where that was left to [`Outfit::step_with`] (s).
    pub body_seconds: f64,
    /// Time beyond that until the body is taken in and all garments are made, side by side (s).
    pub prepare_seconds: f64,
    /// Time to find how the garments lie to the body (s).
    pub approach_seconds: f64,
    /// One report for each garment, from the inside out.
    pub layers: Vec<LayerReport>,
}

impl LayerReport {
    /// What could not be done.
    pub fn flags(&self) -> GarmentFlags {
        let Left { crossings, folds } = self.left;
        GarmentFlags { caught: self.pinched, inside: self.inside_after, crossing: crossings, folded: folds }
    }
}

impl FrameReport {
    /// Whether anything could not be done for a garment.
    pub fn is_flagged(&self) -> bool {
        self.layers.iter().any(|layer| layer.flags().is_flagged())
    }

    /// Time of the whole frame (s).
    pub fn seconds(&self) -> f64 {
        self.body_seconds
            + self.prepare_seconds
            + self.approach_seconds
            + self.layers.iter().map(|layer| layer.fit_seconds).sum::<f64>()
    }
}

/// One garment of an outfit.
#[derive(Debug, Clone)]
struct Layer {
    synthesis: Synthesis,
    fit: Fit,
    vertices: Vec<Vec3>,
    /// The garment as a surface for those above it; `None` for the outermost.
    surface: Option<Obstacle>,
    /// All of its vertices, as members of the combined vertex set.
    members: Vec<u32>,
    /// The vertices of the body in its combined vertex set.
    body_members: Vec<u32>,
    /// Whether it lies on a face of the body.
    covered_faces: Vec<bool>,
}

/// A body's garments, frame after frame.
#[derive(Debug, Clone)]
pub struct Outfit {
    body: Obstacle,
    layers: Vec<Layer>,
    /// How thick the garments that were fitted so far lie on the body.
    cover: Cover,
    report: FrameReport,
}

impl Outfit {
    /// Puts garments on a body, the innermost first.
    ///
    /// # Errors
    /// A garment of the other body model, or one whose waist does not part the body under another garment.
    pub fn new(body: &Body, garments: &[Arc<DrapeModel>], options: &FitOptions) -> Result<Self, GarmentError> {
        let model = body.model();
        let wearer = Wearer {
            gender: model.gender(),
            shape: body.shape(),
            topology: model.topology(),
            face_parts: model.face_parts(),
            vertex_parts: model.vertex_parts(),
            template_vertices: body.rest_vertices(),
            template_pose: &body.template_pose(),
        };
        Self::on(&wearer, garments, options)
    }

    /// [`Self::new`] for a body given by its parts.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn on(wearer: &Wearer<'_>, garments: &[Arc<DrapeModel>], options: &FitOptions) -> Result<Self, GarmentError> {
        let worn: Vec<Part> = Part::ALL
            .into_iter()
            .filter(|&part| garments.iter().any(|model| covers(&model.garment().face_parts, part)))
            .collect();
        let body = Obstacle::body(wearer.topology.clone(), wearer.face_parts, &worn, wearer.template_vertices);
        let mut body_members: Vec<u32> = (0..wearer.topology.vertex_count() as u32).collect();
        let mut layers: Vec<Layer> = Vec::with_capacity(garments.len());
        for (index, model) in garments.iter().enumerate() {
            let garment = model.garment();
            if garment.gender != wearer.gender {
                let wanted = format!("{} as the body", wearer.gender.name());
                return Err(GarmentError::data(format!("gender of {}", garment.name), wanted, garment.gender.name()));
            }
            let mut synthesis = Synthesis::new(model.clone(), wearer.shape, wearer.topology.vertex_count())?;
            let vertices = synthesis.step(wearer.template_pose, wearer.template_vertices).to_vec();
            synthesis.restart();
            let own_members = body_members.clone();
            let is_outermost = index + 1 == garments.len();
            if !is_outermost && !garment.waist_band.is_empty() {
                let band: Vec<Vec3> = garment.waist_band.iter().map(|&vertex| vertices[vertex as usize]).collect();
                let upper = upper_body(wearer.topology, wearer.vertex_parts, wearer.template_vertices, &band)?;
                body_members.retain(|vertex| upper.binary_search(vertex).is_ok());
            }
            layers.push(Layer {
                synthesis,
                fit: Fit::new(&garment.topology, &garment.waist_band, options.clone()).worn(
                    &vertices,
                    garment.topology.faces(),
                    &garment.face_parts,
                    2.0 * CLOTH_THICKNESS * (garments.len() - 1 - index) as f64,
                ),
                surface: (!is_outermost)
                    .then(|| Obstacle::garment(garment.topology.clone(), &vertices, CLOTH_THICKNESS)),
                members: (0..garment.topology.vertex_count() as u32).collect(),
                body_members: own_members,
                covered_faces: wearer.face_parts.iter().map(|&part| covers(&garment.face_parts, part)).collect(),
                vertices,
            });
        }
        let report = FrameReport { layers: vec![LayerReport::default(); layers.len()], ..FrameReport::default() };
        Ok(Self { body, layers, cover: Cover::default(), report })
    }

    /// Chooses the wrinkles of all garments.
    #[must_use]
    pub fn with_wrinkles(mut self, wrinkles: Wrinkles) -> Self {
        for layer in &mut self.layers {
            layer.synthesis = layer.synthesis.clone().with_wrinkles(wrinkles);
        }
        self
    }

    /// Forgets the past: the next frame is the first.
    pub fn restart(&mut self) {
        self.layers.iter_mut().for_each(|layer| layer.synthesis.restart());
    }

    /// Number of garments.
    pub fn count(&self) -> usize {
        self.layers.len()
    }

    /// The model of one garment, counted from the inside.
    pub fn model(&self, layer: usize) -> &Arc<DrapeModel> {
        self.layers[layer].synthesis.model()
    }

    /// The vertices (m, world) of one garment in the last frame, counted from the inside.
    pub fn vertices(&self, layer: usize) -> &[Vec3] {
        &self.layers[layer].vertices
    }

    /// The vertices (m, world) of one garment in the last frame as they were predicted, before the fit.
    pub fn predicted(&self, layer: usize) -> &[Vec3] {
        self.layers[layer].synthesis.vertices()
    }

    /// What happened in the last frame.
    pub fn report(&self) -> &FrameReport {
        &self.report
    }

    /// The next frame: `body` are the vertices of the body in `pose`. Frames follow each other at the rate of the models.
    pub fn step(&mut self, pose: &Pose, body: &[Vec3]) -> &FrameReport {
        self.step_with(pose, || body)
    }

    /// [`Self::step`] with a body that `pose_body` poses meanwhile, as most of a garment is made without it.
    pub fn step_with<'a>(&mut self, pose: &Pose, pose_body: impl FnOnce() -> &'a [Vec3] + Send) -> &FrameReport {
        // From outside of a thread pool each of the many small tasks of a frame would have to be handed over to it.
        rayon::join(|| self.step_in_pool(pose, pose_body), || ());
        &self.report
    }

    fn step_in_pool<'a>(&mut self, pose: &Pose, pose_body: impl FnOnce() -> &'a [Vec3] + Send) {
        let Self { body: surface, layers, cover, report } = self;
        cover.clear();
        let started = Instant::now();
        let take_in = || {
            let body = pose_body();
            let posed = started.elapsed().as_secs_f64();
            surface.update(body);
            (body, posed)
        };
        let make = || {
            layers.par_iter_mut().zip(&mut report.layers).for_each(|(layer, report)| {
                let started = Instant::now();
                layer.synthesis.make(pose);
                report.synthesis_seconds = started.elapsed().as_secs_f64();
            });
        };
        let ((body, posed), ()) = rayon::join(take_in, make);
        layers.par_iter_mut().for_each(|layer| layer.vertices.copy_from_slice(layer.synthesis.place(body)));
        report.body_seconds = posed;
        report.prepare_seconds = started.elapsed().as_secs_f64() - posed;
        let started = Instant::now();
        layers.par_iter_mut().for_each(|Layer { fit, vertices, .. }| fit.approach(surface, vertices));
        report.approach_seconds = started.elapsed().as_secs_f64();
        for (index, report) in report.layers.iter_mut().enumerate() {
            let (inner, rest) = layers.split_at_mut(index);
            let Layer { fit, vertices, surface: own_surface, body_members, covered_faces, .. } = &mut rest[0];
            let started = Instant::now();
            let body = Below { obstacle: surface, members: body_members };
            let worn = inner
                .iter()
                .filter_map(|layer| layer.surface.as_ref().map(|obstacle| Below { obstacle, members: &layer.members }));
            let (mut below, mut count) = ([body; MOST], 0);
            for (place, surface) in below.iter_mut().zip(std::iter::once(body).chain(worn)) {
                *place = surface;
                count += 1;
            }
            let exact = fit.fit(&below[..count], cover, vertices);
            if let Some(own) = own_surface {
                let fit = &*fit;
                rayon::join(
                    || fit.update_surface(vertices, own),
                    || fit.lay_on(surface, covered_faces, cover, CLOTH_THICKNESS),
                );
            }
            *report = layer_report(exact, report.synthesis_seconds, started.elapsed().as_secs_f64());
        }
    }
}

/// Whether a garment of these parts lies on a part of the body: its own, and the trunk, on which all garments end or hang.
fn covers(garment_parts: &[Part], part: Part) -> bool {
    matches!(part, Part::Pelvis | Part::Abdomen | Part::Chest) || garment_parts.contains(&part)
}

fn layer_report(exact: ExactReport, synthesis_seconds: f64, fit_seconds: f64) -> LayerReport {
    LayerReport {
        inside_before: exact.inside_before,
        depth_before: exact.depth_before,
        inside_after: exact.inside_after,
        depth_after: exact.depth_after,
        pinched: exact.pinched,
        rounds: exact.rounds,
        left: exact.left,
        synthesis_seconds,
        fit_seconds,
    }
}

#[cfg(test)]
mod tests {
    use super::{Outfit, Wearer};
    use crate::drape::synthetic::{PELVIS, bend, motion, training_set_of, tube};
    use crate::drape::{DynamicsOptions, TrainOptions, WrinkleOptions};
    use crate::refine::{FitOptions, Obstacle, penetration};
    use crate::{DrapeModel, GarmentError};
    use modiste_body::{Gender, Part, Pose};
    use modiste_core::shapes::icosphere;
    use modiste_core::{Mesh, Silent, Vec3};
    use std::sync::Arc;

    /// An egg with head and foot, and the part of each vertex.
    fn body() -> (Mesh, Vec<Part>) {
        let mesh = icosphere(5);
        let vertices: Vec<Vec3> =
            mesh.vertices.iter().map(|v| Vec3::new(0.135, 0.6, 0.108) * *v + 1.1 * Vec3::Y).collect();
        let part = |y: f64| match y {
            y if y > 1.55 => Part::Head,
            y if y < 0.6 => Part::LeftFoot,
            y if y < 0.9 => Part::Pelvis,
            _ => Part::Chest,
        };
        let parts = vertices.iter().map(|vertex| part(vertex.y)).collect();
        (Mesh { vertices, ..mesh }, parts)
    }

    /// Tubes of these radii learned as garments, the first with a waist band.
    fn garments(body: &Mesh, radii: [f64; 2]) -> Vec<Arc<DrapeModel>> {
        let options = TrainOptions {
            wrinkle: WrinkleOptions { min_count: 4, max_count: 8, ..WrinkleOptions::default() },
            dynamics: DynamicsOptions { ridges: vec![1e-3, 1e-1], ..DynamicsOptions::default() },
            ..TrainOptions::default()
        };
        let learn = |(index, radius): (usize, f64)| {
            let mut garment = tube(["shorts", "shirt"][index], radius, PELVIS);
            let top = garment.template.len() as u32 - 16;
            if index == 0 {
                garment.waist_band = (top..top + 16).collect();
            }
            for [on_garment, on_body] in &mut garment.anchors {
                let point = garment.template[*on_garment as usize];
                let distance = |vertex: &u32| body.vertices[*vertex as usize].distance(point);
                let all = 0..body.vertices.len() as u32;
                *on_body = all.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
            }
            Arc::new(DrapeModel::train(&training_set_of(garment), &options, &Silent).unwrap().0)
        };
        radii.into_iter().enumerate().map(learn).collect()
    }

    fn with_outfit(radii: [f64; 2], check: impl FnOnce(Result<Outfit, GarmentError>, &Mesh), gender: Gender) {
        let (mesh, vertex_parts) = body();
        let face_parts: Vec<Part> = mesh.topology.faces().iter().map(|face| vertex_parts[face[0] as usize]).collect();
        let wearer = Wearer {
            gender,
            shape: &[0.5, -0.5],
            topology: &mesh.topology,
            face_parts: &face_parts,
            vertex_parts: &vertex_parts,
            template_vertices: &mesh.vertices,
            template_pose: &Pose::template(PELVIS * Vec3::Y),
        };
        check(Outfit::on(&wearer, &garments(&mesh, radii), &FitOptions::default()), &mesh);
    }

    #[test]
    fn two_layers_end_outside_the_body_and_in_their_order() {
        // The shirt is learned narrower than the shorts, so that the order has to be made.
        let check = |outfit: Result<Outfit, GarmentError>, mesh: &Mesh| {
            let mut outfit = outfit.unwrap();
            let mut found_inside = 0;
            for pose in &motion(41, 15).frames {
                let posed: Vec<Vec3> = mesh.vertices.iter().map(|vertex| bend(*vertex, pose)).collect();
                let report = outfit.step(pose, &posed).clone();
                assert!(report.seconds() > 0.0 && report.layers.len() == 2);
                found_inside += penetration::measure(&mesh.topology, &posed, outfit.predicted(0)).count;
                for layer in 0..2 {
                    let after = penetration::measure(&mesh.topology, &posed, outfit.vertices(layer));
                    assert_eq!(after.count, 0, "layer {layer}");
                    assert_eq!(report.layers[layer].inside_after, 0);
                }
                let shorts = Obstacle::single(outfit.model(0).garment().topology.clone(), outfit.vertices(0));
                for vertex in outfit.vertices(1) {
                    let contact = shorts.contact(*vertex, 0.05, &mut u32::MAX.clone());
                    assert!(contact.is_none_or(|contact| contact.distance > 0.001), "{contact:?}");
                }
            }
            assert!(found_inside > 0, "the fit had something to do");
        };
        with_outfit([0.14, 0.135], check, Gender::Female);
    }

    #[test]
    fn garments_of_the_other_model_are_refused() {
        let check = |outfit: Result<Outfit, GarmentError>, _: &Mesh| {
            let refusal = outfit.unwrap_err().to_string();
            assert_eq!(refusal, "gender of shorts: wanted male as the body, found female");
        };
        with_outfit([0.14, 0.15], check, Gender::Male);
    }
}
