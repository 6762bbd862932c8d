//! Contact of the cloth with the moving body and with itself.

mod body;
mod bumps;
mod closest;
mod cloth;
mod collider;
mod groups;
mod surface;
mod tree;

pub(crate) use body::BodyContacts;
pub(crate) use bumps::BumpContacts;
pub(crate) use cloth::SelfContacts;
pub use collider::{BodyCollider, BodyPoint};
pub use groups::CollisionGroups;
pub(crate) use surface::ContactLaw;
pub(crate) use tree::FaceTree;
