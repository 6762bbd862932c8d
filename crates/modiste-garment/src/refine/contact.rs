//! How a point lies to a surface.

use modiste_core::{SurfacePoint, Vec3};

/// Barycentric coordinates below this count as zero when the feature of a closest point is told.
const ON_FEATURE: f64 = 1e-9;

/// What a surface says about a point near it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Contact {
    /// Distance from the outside (m), negative inside.
    pub(crate) distance: f64,
    /// Unit direction in which the distance grows fastest.
    pub(crate) normal: Vec3,
    /// The nearest face.
    pub(crate) face: u32,
    /// Whether the surface nearest to the point is buried: the point lies between parts that pass through each other.
    pub(crate) pinched: bool,
    /// Where on the face the nearest point is.
    pub(crate) barycentric: [f64; 3],
    /// How much further the surface itself is (m), where garments lie on it that count as part of it.
    pub(crate) raised: f64,
    /// Whether the sign is beyond doubt, as far as the surface around is concerned (see [`Obstacle::holds`]). Near buried
    /// surface it is told to the size of a triangle.
    pub(crate) certain: bool,
    /// Whether no other part of the surface is nearer: then none holds a point that is outside of this one.
    pub(crate) nearest: bool,
    /// How much room there is from where it begins (m), where that is the middle between another limb and the skin that the
    /// point is worn on; infinite elsewhere.
    pub(crate) room: f64,
}

impl Contact {
    /// Where there is none.
    pub(crate) const NONE: Self = Self {
        distance: 0.0,
        normal: Vec3::ZERO,
        face: 0,
        barycentric: [0.0; 3],
        raised: 0.0,
        pinched: false,
        certain: false,
        nearest: false,
        room: f64::INFINITY,
    };

    pub(crate) fn at(at: &SurfacePoint, distance: f64, normal: Vec3) -> Self {
        let SurfacePoint { face, barycentric, .. } = *at;
        Self { distance, normal, face, barycentric, certain: true, ..Self::NONE }
    }
}

/// Where on the mesh a closest point lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Feature {
    Face,
    /// The edge opposite this corner.
    Edge(usize),
    /// This corner.
    Vertex(usize),
}

/// Where on a face a point lies.
pub(crate) fn feature(barycentric: [f64; 3]) -> Feature {
    let zero = barycentric.map(|value| value < ON_FEATURE);
    match zero {
        [false, true, true] => Feature::Vertex(0),
        [true, false, true] => Feature::Vertex(1),
        [true, true, false] => Feature::Vertex(2),
        [true, false, false] => Feature::Edge(0),
        [false, true, false] => Feature::Edge(1),
        [false, false, true] => Feature::Edge(2),
        _ => Feature::Face,
    }
}
