//! Why a person cannot be animated or exported.

use modiste_body::BodyError;
use modiste_garment::GarmentError;
use modiste_hair::HairError;
use modiste_io::IoError;

/// Why a person cannot be animated or exported.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file cannot be written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A garment cannot be worn.
    #[error(transparent)]
    Garment(#[from] GarmentError),
    /// The body cannot be measured.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The fit of a garment cannot be mapped, because its pattern is not known.
    #[error("the fit of {garment} cannot be mapped against its pattern: {reason}")]
    NoPattern {
        /// The garment.
        garment: String,
        /// Why not.
        reason: String,
    },
    /// Hair cannot be worn.
    #[error(transparent)]
    Hair(#[from] HairError),
    /// The motion has no frames.
    #[error("the motion has no frames")]
    NoFrames,
    /// The motion has another rate than the garments were learned at.
    #[error("the garments move at {wanted} frames per second, the motion at {found}")]
    OtherRate {
        /// Frames per second of the garments.
        wanted: f64,
        /// Frames per second of the motion.
        found: f64,
    },
    /// Two garments of one person have the same name.
    #[error("{garment} is worn twice")]
    WornTwice {
        /// The garment.
        garment: String,
    },
    /// A garment that was learned for other bodies.
    #[error("{garment} was learned for {garment_gender} bodies, the body is {body_gender}")]
    OtherBody {
        /// The garment.
        garment: String,
        /// The bodies that it was learned for.
        garment_gender: &'static str,
        /// The body at hand.
        body_gender: &'static str,
    },
}
