//! Units and axes of meshes from other programs: what the body among them tells.

use modiste_body::ScapeModel;
use modiste_core::{Topology, Vec3, surface_area};

use super::UpAxis;
use crate::JobError;
use crate::jobs::design_choice::UNITS;

/// A body of ours has a surface whose square root is within these shares of the mean body's.
const SIZES: std::ops::Range<f64> = 0.75..1.33;

/// How the coordinates of files become ours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    /// Name of the unit.
    pub(super) unit: &'static str,
    metres: f64,
    up: UpAxis,
}

impl Frame {
    /// Metres.
    pub(super) fn metres(up: UpAxis) -> Self {
        let (unit, metres) = UNITS[0];
        Self { unit, metres, up }
    }

    /// The unit in which `vertices` are a body of the model, in whatever pose.
    ///
    /// # Errors
    /// A surface that is that of no body in any unit.
    pub(super) fn of_body(model: &ScapeModel, vertices: &[Vec3], up: UpAxis, file: &str) -> Result<Self, JobError> {
        let size = |topology: &Topology, x: &[Vec3]| surface_area(topology, x).sqrt();
        let found = size(model.topology(), vertices) / size(model.topology(), model.template());
        match UNITS.into_iter().find(|(_, metres)| SIZES.contains(&(metres * found))) {
            Some((unit, metres)) => Ok(Self { unit, metres, up }),
            None => Err(JobError::Request(format!(
                "{file}: wanted a body in metres, decimetres, centimetres, millimetres or inches, found one {found:.3} times \
                 as large as the mean body in metres"
            ))),
        }
    }

    /// A point of a file in metres, Y up.
    pub(super) fn world(self, x: Vec3) -> Vec3 {
        self.metres
            * match self.up {
                UpAxis::Y => x,
                UpAxis::Z => Vec3::new(x.x, x.z, -x.y),
            }
    }

    /// Points of a file in metres, Y up.
    pub(super) fn all(self, mut x: Vec<Vec3>) -> Vec<Vec3> {
        x.iter_mut().for_each(|x| *x = self.world(*x));
        x
    }
}
