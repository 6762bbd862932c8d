//! modiste-cloth
