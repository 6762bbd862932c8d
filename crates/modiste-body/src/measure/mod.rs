//! Body measurements on the mesh of this project, fast enough to be solved for (well below a millisecond).
//!
//! Landmarks are vertices of the topology, so they lie at the same place on every body; girths are convex hulls of
//! plane sections, arms cut off by part, as a tape measures. The definitions follow ANSUR II.

mod level;
mod quantity;
mod section;

use modiste_core::{Topology, Vec3, volume};

use level::{Level, chain, distance, floor, give, mean, mean_point, minus, plus, scaled, stature};
pub use quantity::{Measurements, Quantity};
use section::{Section, SectionGradient};

use crate::Part;

/// The derivative of a measurement by vertex positions; a vertex may occur more than once.
pub type SparseGradient = Vec<(u32, Vec3)>;

/// Density that turns volume into body mass (kg/m³), as in the sources.
pub const BODY_DENSITY: f64 = 1000.0;

/// Vertices of MakeHuman's topology whose mean is the landmark.
mod landmark {
    pub(super) const NAVEL: &[u32] = &[4121];
    pub(super) const BUST_POINTS: &[u32] = &[1787, 8459];
    pub(super) const CROTCH: &[u32] = &[4374, 6431];
    pub(super) const CERVICALE: &[u32] = &[858];
    pub(super) const NECK_FRONT: u32 = 797;
    pub(super) const NECK_BACK: u32 = 855;
    pub(super) const ACROMION_LEFT: &[u32] = &[8275];
    pub(super) const ELBOW_LEFT: &[u32] = &[10032, 10040, 10059, 10052];
    pub(super) const WRIST_LEFT: &[u32] = &[10438, 10548, 10555, 10582];
    pub(super) const KNEECAP_LEFT: &[u32] = &[11249, 11250];
    pub(super) const CALF_LEFT: &[u32] = &[11335, 11339];
    pub(super) const LARGEST: u32 = 11339;
}

/// How far below the crotch the thigh is measured (m).
const THIGH_BELOW_CROTCH: f64 = 0.02;

/// Length over which the most protruding vertices of the buttocks share their height (m): small against their size,
/// large enough that the height moves smoothly from vertex to vertex.
const BUTTOCK_SOFTNESS: f64 = 0.004;

/// Why a mesh cannot be measured.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum MeasureError {
    /// The mesh has another topology.
    #[error("measuring wants a mesh of {wanted} vertices in the topology of this project, found {found}")]
    VertexCount {
        /// Vertices of the topology.
        wanted: usize,
        /// Vertices found.
        found: usize,
    },
    /// A vertex is infinite or not a number.
    #[error("vertex {vertex} is not finite")]
    NotFinite {
        /// The vertex at fault.
        vertex: usize,
    },
}

/// The regions whose sections are measured.
#[derive(Debug, Clone, Copy)]
enum Region {
    Chest,
    Waist,
    Hip,
    Neck,
    LeftThigh,
    LeftCalf,
    LeftUpperArm,
    LeftWrist,
}

impl Region {
    const COUNT: usize = 8;

    fn parts(self) -> &'static [Part] {
        match self {
            Self::Chest => &[Part::Abdomen, Part::Chest, Part::LeftShoulder, Part::RightShoulder],
            Self::Waist => &[Part::Pelvis, Part::Abdomen, Part::Chest],
            Self::Hip => &[Part::Pelvis, Part::Abdomen, Part::LeftThigh, Part::RightThigh],
            Self::Neck => &[Part::Neck, Part::Head],
            Self::LeftThigh => &[Part::LeftThigh, Part::Pelvis],
            Self::LeftCalf => &[Part::LeftShin],
            Self::LeftUpperArm => &[Part::LeftUpperArm],
            Self::LeftWrist => &[Part::LeftForearm, Part::LeftHand],
        }
    }

    const ALL: [Self; Self::COUNT] = [
        Self::Chest,
        Self::Waist,
        Self::Hip,
        Self::Neck,
        Self::LeftThigh,
        Self::LeftCalf,
        Self::LeftUpperArm,
        Self::LeftWrist,
    ];
}

/// What measuring needs to know of the topology: which edges belong to which region. Constant.
#[derive(Debug, Clone)]
pub struct MeasureTemplate {
    topology: std::sync::Arc<Topology>,
    edges: [Vec<[u32; 2]>; Region::COUNT],
    buttock_candidates: Vec<u32>,
}

impl MeasureTemplate {
    /// From the topology of this project and the part of each of its faces.
    ///
    /// # Errors
    /// When the topology has too few vertices to carry the landmarks or `face_parts` is not one per face.
    pub fn new(topology: &std::sync::Arc<Topology>, face_parts: &[Part]) -> Result<Self, MeasureError> {
        let found = topology.vertex_count();
        if found <= landmark::LARGEST as usize || face_parts.len() != topology.face_count() {
            return Err(MeasureError::VertexCount { wanted: crate::makehuman::BODY_VERTEX_COUNT, found });
        }
        let edges = Region::ALL.map(|region| region_edges(topology, face_parts, region));
        let mut buttock_candidates: Vec<u32> = topology
            .faces()
            .iter()
            .zip(face_parts)
            .filter(|(_, part)| matches!(part, Part::Pelvis | Part::LeftThigh | Part::RightThigh))
            .flat_map(|(face, _)| *face)
            .collect();
        buttock_candidates.sort_unstable();
        buttock_candidates.dedup();
        Ok(Self { topology: std::sync::Arc::clone(topology), edges, buttock_candidates })
    }

    /// The topology that can be measured.
    pub fn topology(&self) -> &std::sync::Arc<Topology> {
        &self.topology
    }

    /// Measures a body in the template pose, after checking that it is one of this topology.
    ///
    /// # Errors
    /// When the number of vertices is another or a vertex is not finite.
    pub fn measure(&self, vertices: &[Vec3]) -> Result<Measurements, MeasureError> {
        let wanted = self.topology.vertex_count();
        if vertices.len() != wanted {
            return Err(MeasureError::VertexCount { wanted, found: vertices.len() });
        }
        if let Some(vertex) = vertices.iter().position(|p| !p.is_finite()) {
            return Err(MeasureError::NotFinite { vertex });
        }
        Ok(measure(self, vertices))
    }

    /// One quantity (m or kg) and its derivative by the vertices of the topology (dense for the body mass).
    ///
    /// The tilt of the planes across neck, upper arm and wrist is held fixed in the derivative.
    pub fn quantity_with_gradient(&self, quantity: Quantity, vertices: &[Vec3]) -> (f64, SparseGradient) {
        let mut gradient = SparseGradient::new();
        let value = self.evaluate(quantity, vertices, Some(&mut gradient));
        (value, gradient)
    }

    fn evaluate(&self, quantity: Quantity, x: &[Vec3], gradient: Option<&mut SparseGradient>) -> f64 {
        match quantity {
            Quantity::Stature => stature(x, gradient),
            Quantity::BodyMass => self.body_mass(x, gradient),
            Quantity::ChestGirth => self.girth(Region::Chest, x, gradient),
            Quantity::WaistGirth => self.girth(Region::Waist, x, gradient),
            Quantity::HipGirth => self.girth(Region::Hip, x, gradient),
            Quantity::NeckGirth => self.girth(Region::Neck, x, gradient),
            Quantity::ThighGirth => self.girth(Region::LeftThigh, x, gradient),
            Quantity::CalfGirth => self.girth(Region::LeftCalf, x, gradient),
            Quantity::UpperArmGirth => self.girth(Region::LeftUpperArm, x, gradient),
            Quantity::WristGirth => self.girth(Region::LeftWrist, x, gradient),
            Quantity::ShoulderBreadth => {
                // The body is symmetric: twice the distance of the left acromion from the plane of the cervicale.
                let level = minus(mean(landmark::ACROMION_LEFT, x, Vec3::X), mean(landmark::CERVICALE, x, Vec3::X));
                give(Level { value: 2.0 * level.value, gradient: scaled(level.gradient, 2.0) }, gradient)
            }
            Quantity::UpperArmLength => give(distance(landmark::ACROMION_LEFT, landmark::ELBOW_LEFT, x), gradient),
            Quantity::LowerArmLength => give(distance(landmark::ELBOW_LEFT, landmark::WRIST_LEFT, x), gradient),
            Quantity::ArmLength => {
                let upper = distance(landmark::ACROMION_LEFT, landmark::ELBOW_LEFT, x);
                let lower = distance(landmark::ELBOW_LEFT, landmark::WRIST_LEFT, x);
                give(plus(upper, lower), gradient)
            }
            Quantity::InsideLegLength => give(minus(mean(landmark::CROTCH, x, Vec3::Y), floor(x)), gradient),
            Quantity::KneeHeight => give(minus(mean(landmark::KNEECAP_LEFT, x, Vec3::Y), floor(x)), gradient),
            Quantity::HipHeight => give(minus(self.buttock_level(x), floor(x)), gradient),
            Quantity::WaistHeight => give(minus(mean(landmark::NAVEL, x, Vec3::Y), floor(x)), gradient),
            Quantity::BustHeight => give(minus(mean(landmark::BUST_POINTS, x, Vec3::Y), floor(x)), gradient),
            Quantity::BackNeckHeight => give(minus(mean(landmark::CERVICALE, x, Vec3::Y), floor(x)), gradient),
            Quantity::ChestDepth => self.extent(Region::Chest, Vec3::Z, x, gradient),
            Quantity::WaistBreadth => self.extent(Region::Waist, Vec3::X, x, gradient),
            Quantity::WaistDepth => self.extent(Region::Waist, Vec3::Z, x, gradient),
            Quantity::HipBreadth => self.extent(Region::Hip, Vec3::X, x, gradient),
            Quantity::HipDepth => self.extent(Region::Hip, Vec3::Z, x, gradient),
        }
    }

    fn body_mass(&self, x: &[Vec3], gradient: Option<&mut SparseGradient>) -> f64 {
        if let Some(gradient) = gradient {
            let mut dense = vec![Vec3::ZERO; x.len()];
            for &[a, b, c] in self.topology.faces() {
                let (pa, pb, pc) = (x[a as usize], x[b as usize], x[c as usize]);
                dense[a as usize] += pb.cross(pc);
                dense[b as usize] += pc.cross(pa);
                dense[c as usize] += pa.cross(pb);
            }
            let sixth = BODY_DENSITY / 6.0;
            gradient.extend((0u32..).zip(dense).map(|(vertex, g)| (vertex, sixth * g)));
        }
        BODY_DENSITY * volume(&self.topology, x)
    }

    /// The plane of a region: unit normal, and the level of the plane along it.
    fn plane(&self, region: Region, x: &[Vec3]) -> (Vec3, Level) {
        let across = |from: &[u32], to: &[u32]| {
            (mean_point(to, x) - mean_point(from, x)).normalize_or(Vec3::new(1.0, -1.0, 0.0).normalize())
        };
        match region {
            Region::Chest => (Vec3::Y, mean(landmark::BUST_POINTS, x, Vec3::Y)),
            Region::Waist => (Vec3::Y, mean(landmark::NAVEL, x, Vec3::Y)),
            Region::Hip => (Vec3::Y, self.buttock_level(x)),
            Region::LeftThigh => {
                let crotch = mean(landmark::CROTCH, x, Vec3::Y);
                (Vec3::Y, Level { value: crotch.value - THIGH_BELOW_CROTCH, ..crotch })
            }
            Region::LeftCalf => (Vec3::Y, mean(landmark::CALF_LEFT, x, Vec3::Y)),
            Region::Neck => {
                let ends = [landmark::NECK_FRONT, landmark::NECK_BACK];
                let forwards = x[ends[0] as usize] - x[ends[1] as usize];
                let normal = forwards.cross(Vec3::X).normalize_or(Vec3::Y);
                (normal, mean(&ends, x, normal))
            }
            Region::LeftUpperArm => {
                let normal = across(landmark::ACROMION_LEFT, landmark::ELBOW_LEFT);
                let ends = [mean(landmark::ACROMION_LEFT, x, normal), mean(landmark::ELBOW_LEFT, x, normal)];
                let [near, far] = ends;
                let middle = plus(near, far);
                (normal, Level { value: 0.5 * middle.value, gradient: scaled(middle.gradient, 0.5) })
            }
            Region::LeftWrist => {
                let normal = across(landmark::ELBOW_LEFT, landmark::WRIST_LEFT);
                (normal, mean(landmark::WRIST_LEFT, x, normal))
            }
        }
    }

    fn section(&self, region: Region, x: &[Vec3]) -> (Section, Level) {
        let (normal, level) = self.plane(region, x);
        let mut section = Section::new(&self.edges[region as usize], x, normal, level.value);
        if let Region::LeftThigh = region {
            let middle = mean(landmark::CROTCH, x, Vec3::X).value;
            section.retain(|point| point.x > middle);
        }
        (section, level)
    }

    fn girth(&self, region: Region, x: &[Vec3], gradient: Option<&mut SparseGradient>) -> f64 {
        let (section, level) = self.section(region, x);
        let Some(gradient) = gradient else { return section.girth(x, None) };
        let mut own = SectionGradient::default();
        let girth = section.girth(x, Some(&mut own));
        chain(own, level, gradient);
        girth
    }

    fn extent(&self, region: Region, direction: Vec3, x: &[Vec3], gradient: Option<&mut SparseGradient>) -> f64 {
        let (section, level) = self.section(region, x);
        let Some(gradient) = gradient else { return section.extent(direction, x, None) };
        let mut own = SectionGradient::default();
        let extent = section.extent(direction, x, Some(&mut own));
        chain(own, level, gradient);
        extent
    }

    /// Height of the greatest protrusion of the buttocks: `Σ w y / Σ w` with `w = exp(-z / softness)`, between crotch
    /// and navel.
    fn buttock_level(&self, x: &[Vec3]) -> Level {
        let (low, high) = (mean(landmark::CROTCH, x, Vec3::Y).value, mean(landmark::NAVEL, x, Vec3::Y).value);
        let between = |vertex: &&u32| (low..high).contains(&x[**vertex as usize].y);
        let candidates = || self.buttock_candidates.iter().filter(between);
        let rear = candidates().map(|&vertex| x[vertex as usize].z).fold(f64::INFINITY, f64::min);
        let weight = |vertex: u32| (-(x[vertex as usize].z - rear) / BUTTOCK_SOFTNESS).exp();
        let (mut total, mut sum) = (0.0, 0.0);
        for &vertex in candidates() {
            total += weight(vertex);
            sum += weight(vertex) * x[vertex as usize].y;
        }
        if total <= 0.0 {
            return Level { value: 0.5 * (low + high), gradient: SparseGradient::new() };
        }
        let height = sum / total;
        let gradient = candidates()
            .filter(|&&vertex| weight(vertex) > 1e-6)
            .map(|&vertex| {
                let share = weight(vertex) / total;
                (vertex, Vec3::new(0.0, share, -share * (x[vertex as usize].y - height) / BUTTOCK_SOFTNESS))
            })
            .collect();
        Level { value: height, gradient }
    }
}

/// All measurements of a body in the template pose and the topology of `template`.
pub fn measure(template: &MeasureTemplate, vertices: &[Vec3]) -> Measurements {
    let mut measurements = Measurements::default();
    for quantity in Quantity::ALL {
        measurements.set(quantity, template.evaluate(quantity, vertices, None));
    }
    measurements
}

fn region_edges(topology: &Topology, face_parts: &[Part], region: Region) -> Vec<[u32; 2]> {
    let parts = region.parts();
    let inside = |face: Option<u32>| face.is_some_and(|face| parts.contains(&face_parts[face as usize]));
    topology
        .edges()
        .iter()
        .filter(|edge| edge.faces.iter().any(|&face| inside(face)))
        .map(|edge| edge.vertices)
        .collect()
}

#[cfg(test)]
mod tests {
    use modiste_core::Vec3;

    use super::{MeasureError, MeasureTemplate, Quantity, measure};
    use crate::Gender;
    use crate::makehuman::tests::model;

    #[test]
    fn average_bodies_measure_as_people_do() {
        for gender in Gender::ALL {
            let Some(model) = model(gender) else { return };
            let template = MeasureTemplate::new(model.topology(), model.face_parts()).expect("our topology");
            let measured = template.measure(&model.vertices(&model.default_parameters())).expect("finite");
            // Every length of MakeHuman's average body is within a quarter of its subjects' mean, mass within a third.
            let survey = crate::population::AnsurStatistics::committed(gender).expect("figures");
            for (q, mean) in crate::population::ANSUR_QUANTITIES.iter().zip(&survey.means) {
                let ratio = measured.get(q.quantity) / mean;
                let slack = if q.quantity == Quantity::BodyMass { 0.34 } else { 0.25 };
                assert!((ratio - 1.0).abs() < slack, "{gender:?} {:?}: {ratio}", q.quantity);
            }
            let arms = measured.upper_arm_length + measured.lower_arm_length;
            assert!((measured.arm_length - arms).abs() < 1e-12);
        }
    }

    #[test]
    fn measurements_do_not_depend_on_place_and_scale_with_the_body() {
        let Some(model) = model(Gender::Female) else { return };
        let template = MeasureTemplate::new(model.topology(), model.face_parts()).expect("our topology");
        let vertices = model.vertices(&model.default_parameters());
        let plain = measure(&template, &vertices);
        let moved: Vec<Vec3> = vertices.iter().map(|p| *p + Vec3::new(3.0, 1.0, -2.0)).collect();
        let moved = measure(&template, &moved);
        for quantity in Quantity::ALL {
            assert!((plain.get(quantity) - moved.get(quantity)).abs() < 1e-9, "{quantity:?}");
        }
        let larger: Vec<Vec3> = vertices.iter().map(|p| 1.1 * *p).collect();
        let larger = measure(&template, &larger);
        assert!((larger.waist_girth - 1.1 * plain.waist_girth).abs() < 1e-9);
        assert!((larger.body_mass - 1.331 * plain.body_mass).abs() < 1e-6);
    }

    #[test]
    fn gradients_agree_with_finite_differences_along_a_smooth_deformation() {
        let Some(model) = model(Gender::Male) else { return };
        let template = MeasureTemplate::new(model.topology(), model.face_parts()).expect("our topology");
        let vertices = model.vertices(&model.default_parameters());
        // Smooth and asymmetric; a little of it first, so that no two vertices tie for an extreme.
        let field: Vec<Vec3> = vertices
            .iter()
            .map(|p| Vec3::new((3.0 * p.y + p.x).sin(), (2.0 * p.x + p.z).cos(), (4.0 * p.y + 1.0).cos()))
            .collect();
        let vertices: Vec<Vec3> = vertices.iter().zip(&field).map(|(p, d)| *p + 0.003 * *d).collect();
        let at = |step: f64| -> Vec<Vec3> { vertices.iter().zip(&field).map(|(p, d)| *p + step * *d).collect() };
        let step = 1e-6;
        let (above, below) = (measure(&template, &at(step)), measure(&template, &at(-step)));
        for quantity in Quantity::ALL {
            let (value, gradient) = template.quantity_with_gradient(quantity, &vertices);
            assert!((value - measure(&template, &vertices).get(quantity)).abs() < 1e-12);
            let analytic: f64 = gradient.iter().map(|(vertex, g)| g.dot(field[*vertex as usize])).sum();
            let numeric = (above.get(quantity) - below.get(quantity)) / (2.0 * step);
            // The tilt of these planes is held fixed in the derivative.
            let tilted = matches!(quantity, Quantity::NeckGirth | Quantity::UpperArmGirth | Quantity::WristGirth);
            let slack = if tilted { 0.15 * (1.0 + numeric.abs()) } else { 1e-4 * (1.0 + numeric.abs()) };
            assert!((analytic - numeric).abs() < slack, "{quantity:?}: {analytic} {numeric}");
        }
    }

    #[test]
    fn another_topology_is_refused() {
        let Some(model) = model(Gender::Male) else { return };
        let template = MeasureTemplate::new(model.topology(), model.face_parts()).expect("our topology");
        let wanted = MeasureError::VertexCount { wanted: 13_380, found: 5 };
        assert_eq!(template.measure(&[Vec3::ZERO; 5]), Err(wanted));
        let mut vertices = model.vertices(&model.default_parameters());
        vertices[77].y = f64::NAN;
        assert_eq!(template.measure(&vertices), Err(MeasureError::NotFinite { vertex: 77 }));
    }
}
