//! Bytes to checked plain tables and back: the one crate of Modiste that touches files.
//!
//! Every reader has a `parse` that works on bytes and a `read` that works on a path; gzipped files are unpacked
//! whatever their name. Bad input of any kind is an [`IoError`] that names the file, the place in it, what was wanted
//! and what was found. Every writer writes beside the file and renames, so nothing half-written is left behind.

mod error;
mod file;
mod hash;
mod npy;
pub mod npz;

pub use error::IoError;
pub use file::{
    FileWriter, create_folder, exists, file_size, list_folder, read_bytes, read_text, remove_file, unpacked,
    write_atomically, write_bytes,
};
pub use hash::hash;
