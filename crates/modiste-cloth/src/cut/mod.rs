//! From a pattern to cloth: panels meshed once in the template size, every other size aligned to it, and the seams.

mod align;
mod garment;
mod panel_mesh;
mod propagate;

pub use align::{AlignQuality, align_panel};
pub use garment::{CutError, CutGarment, RibEdge};
pub use panel_mesh::{MIN_ANGLE_DEGREES, PanelMesh, mesh_panel};
pub use propagate::propagate;
