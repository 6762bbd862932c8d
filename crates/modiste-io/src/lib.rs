//! Bytes to checked plain tables and back: the one crate of Modiste that touches files.
//!
//! Every reader has a `parse` that works on bytes and a `read` that works on a path; gzipped files are unpacked
//! whatever their name. Bad input of any kind is an [`IoError`] that names the file, the place in it, what was wanted
//! and what was found. Every writer writes beside the file and renames, so nothing half-written is left behind.

pub mod animated;
pub mod ansur;
pub mod bvh;
pub mod curves;
pub mod dressed;
mod error;
pub mod fabric;
mod file;
#[cfg(test)]
mod fuzz;
pub mod glb;
mod hash;
pub mod json;
pub mod makehuman;
pub mod model;
mod npy;
pub mod npz;
pub mod obj;
pub mod pattern;
pub mod pc2;
pub mod ply;
pub mod png;
pub mod sequence;
mod staged;
pub mod table;
mod text;
pub mod usd;

pub use bvh::{BvhClip, BvhJoint, Channel};
pub use error::IoError;
pub use file::{
    FileWriter, check_writable, create_folder, exists, file_size, list_folder, read_bytes, read_text, remove_file,
    unpacked, write_atomically, write_bytes, write_in_place,
};
pub use hash::hash;
pub use staged::{StagedFolder, TemporaryFolder};

/// A folder of the shared data beside the repository, for tests; says so and gives `None` where it is absent.
#[cfg(test)]
pub(crate) fn shared_data(folder: &str) -> Option<std::path::PathBuf> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(folder);
    let path = path.is_dir().then_some(path);
    if path.is_none() {
        use std::io::Write;
        drop(writeln!(std::io::stderr(), "skipped: there is no ../shared/data/{folder}"));
    }
    path
}
