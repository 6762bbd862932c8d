//! modiste-scene
