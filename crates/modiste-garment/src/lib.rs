//! modiste-garment
