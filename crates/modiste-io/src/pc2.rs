//! Point caches (`.pc2`): the vertices of a mesh in every frame, as Blender's Mesh Cache modifier reads them.

use std::io::Write;
use std::path::Path;

use crate::animated::{AnimatedMesh, check};
use crate::{IoError, write_atomically};

/// Writes the frames of a mesh, little-endian: "POINTCACHE2\0", version 1, vertices, first frame and step (f32), frames, then
/// three f32 a vertex, frame after frame. Metres, Y up, in the order of the mesh's vertices.
///
/// # Errors
/// [`IoError`] naming the mesh and what is wrong with it, or the file.
pub fn write(path: impl AsRef<Path>, mesh: &AnimatedMesh<'_>) -> Result<(), IoError> {
    let path = path.as_ref();
    let frame_count = check(30.0, std::slice::from_ref(mesh), &path.display().to_string())?;
    let mut unread = None;
    let written = write_atomically(path, |file| {
        file.write_all(b"POINTCACHE2\0")?;
        file.write_all(&1i32.to_le_bytes())?;
        file.write_all(&(mesh.vertex_count() as i32).to_le_bytes())?;
        file.write_all(&0.0f32.to_le_bytes())?;
        file.write_all(&1.0f32.to_le_bytes())?;
        file.write_all(&(frame_count as i32).to_le_bytes())?;
        let mut vertices = Vec::new();
        for frame in 0..frame_count {
            keep(&mut unread, mesh.frames.read(frame, &mut vertices))?;
            file.write_all(bytemuck::cast_slice(&vertices))?;
        }
        Ok(())
    });
    unread.map_or(written, Err)
}

/// Lets an error of reading through [`write_atomically`], which knows only those of writing.
pub(crate) fn keep<T>(unread: &mut Option<IoError>, read: Result<T, IoError>) -> std::io::Result<T> {
    read.map_err(|error| {
        let stop = std::io::Error::other(error.to_string());
        *unread = Some(error);
        stop
    })
}

#[cfg(test)]
mod tests {
    use super::write;
    use crate::animated::AnimatedMesh;

    #[test]
    fn the_layout_is_that_of_the_format() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pc2");
        let frames: Vec<Vec<[f32; 3]>> = (0..4).map(|frame| vec![[frame as f32, 0.5, -2.0]; 3]).collect();
        let mut mesh = AnimatedMesh {
            name: "a",
            faces: &[[0, 1, 2]],
            frames: &frames,
            uv: None,
            vertex_colours: None,
            colour: [1.0; 4],
            roughness: 1.0,
            double_sided: false,
        };
        write(&path, &mesh).unwrap();
        let bytes = crate::read_bytes(&path).unwrap();
        assert_eq!(bytes.len(), 32 + 4 * 3 * 12);
        assert_eq!(&bytes[..12], b"POINTCACHE2\0");
        let word = |at: usize| i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!([12, 16, 28].map(word), [1, 3, 4]);
        let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!([20, 24, 32 + 36, 32 + 36 + 8].map(float), [0.0, 1.0, 1.0, -2.0]);
        mesh.faces = &[[0, 1, 5]];
        assert!(write(&path, &mesh).unwrap_err().to_string().contains("vertex 5"));
    }
}
