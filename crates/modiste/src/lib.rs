//! The one door of Modiste for applications: a [`Job`] in, a stream of [`Event`]s and an [`Outcome`] out.
//!
//! [`run`] works on the calling thread and hands events to a closure; [`start`] works in the background and is an iterator
//! of events. Both check the request first, and leave either the whole result or nothing.

mod assets;
mod error;
mod event;
mod jobs;
mod limits;
mod sources;
mod stream;

pub use assets::{ASSETS_VARIABLE, Assets};
pub use error::JobError;
pub use event::{Event, Listener};
pub use jobs::{
    Action, BenchDress, BenchHair, BenchHairRow, BenchRow, BenchedDress, BenchedHair, BodyChoice, BodyMake,
    BodyMeasure, BodyPopulation, BodyTrain, Character, Check, Checked, Crowd, CrowdReport, DesignChoice, Dress,
    Dressed, EvaluatedGarment, GarmentEvaluate, GarmentImport, GarmentLearn, GarmentSimulate, GarmentTrain, HairChoice,
    HairLearn, Job, LearnedGarment, LearnedHair, Length, MadeBody, MadeCrowd, MadePopulation, MeasuredBody,
    MotionChoice, Outcome, Resolution, SimulatedGarment, TrainedBody, TrainedGarment, UpAxis, run,
};
pub use limits::{LONGEST_SECONDS, limits};
pub use modiste_body::{Gender, measure::Measurements, measure::Quantity};
pub use modiste_garment::check;
pub use modiste_hair::training::WindDirection;
pub use modiste_hair::{Region as HairRegion, Style as HairStyle};
pub use modiste_scene::{FlaggedFrames, Format, Region, Report};
pub use sources::Sources;
pub use stream::{Events, Update, start};
