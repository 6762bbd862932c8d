//! Words that several commands share.

mod body_choice;
mod count;
mod formats;
mod gender;
mod hair_choice;
mod region;
mod sources;
mod wind;

pub(crate) use body_choice::BodyArguments;
pub(crate) use count::count;
pub(crate) use formats::{FormatName, formats};
pub(crate) use gender::GenderName;
pub(crate) use hair_choice::HairArguments;
pub(crate) use region::region_length;
pub(crate) use sources::{SourceArguments, sources};
pub(crate) use wind::wind;
