//! From the predicted garment to one that is worn: outside the body, over other garments (DRAPE §5).

pub mod anchors;
