//! modiste-io
