//! Contact of the cloth with the moving body and with itself.

mod body;
mod closest;
mod collider;
mod groups;
mod tree;

pub(crate) use body::{BodyContacts, ContactLaw};
pub use collider::{BodyCollider, BodyPoint};
pub use groups::CollisionGroups;
