//! Meshes in motion, read a frame at a time, so that an animation may be longer than memory.

use std::fs::File;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use crate::IoError;

/// The frames of a mesh, in memory or in a file.
pub trait FrameSource: Send + Sync + std::fmt::Debug {
    /// Number of frames.
    fn frame_count(&self) -> usize;

    /// Number of vertices of a frame.
    fn vertex_count(&self, frame: usize) -> usize;

    /// Puts the vertices (m, world) of a frame into `out`.
    ///
    /// # Errors
    /// A file that cannot be read.
    fn read(&self, frame: usize, out: &mut Vec<[f32; 3]>) -> Result<(), IoError>;
}

impl FrameSource for &[Vec<[f32; 3]>] {
    fn frame_count(&self) -> usize {
        self.len()
    }

    fn vertex_count(&self, frame: usize) -> usize {
        self[frame].len()
    }

    fn read(&self, frame: usize, out: &mut Vec<[f32; 3]>) -> Result<(), IoError> {
        out.clear();
        out.extend_from_slice(&self[frame]);
        Ok(())
    }
}

impl FrameSource for Vec<Vec<[f32; 3]>> {
    fn frame_count(&self) -> usize {
        self.len()
    }

    fn vertex_count(&self, frame: usize) -> usize {
        self[frame].len()
    }

    fn read(&self, frame: usize, out: &mut Vec<[f32; 3]>) -> Result<(), IoError> {
        self.as_slice().read(frame, out)
    }
}

/// A mesh in motion with its looks.
#[derive(Debug, Clone, Copy)]
pub struct AnimatedMesh<'a> {
    /// Name of the mesh.
    pub name: &'a str,
    /// Triangles, counter-clockwise seen from outside.
    pub faces: &'a [[u32; 3]],
    /// Vertices in world (m) in each frame; a single frame makes a mesh at rest.
    pub frames: &'a dyn FrameSource,
    /// Texture coordinates of the corners of each face, V upwards.
    pub uv: Option<&'a [[[f32; 2]; 3]]>,
    /// Linear red, green and blue of each vertex, which the base colour is multiplied by.
    pub vertex_colours: Option<&'a [[f32; 3]]>,
    /// Base colour, linear red, green, blue and opacity from 0 to 1.
    pub colour: [f32; 4],
    /// Roughness from 0 (mirror) to 1 (matt).
    pub roughness: f32,
    /// Whether both sides are seen, as of cloth.
    pub double_sided: bool,
}

impl<'a> AnimatedMesh<'a> {
    /// White, matt and seen from outside: for forms that keep no looks.
    pub fn plain(name: &'a str, faces: &'a [[u32; 3]], frames: &'a dyn FrameSource) -> Self {
        Self {
            name,
            faces,
            frames,
            uv: None,
            vertex_colours: None,
            colour: [1.0; 4],
            roughness: 1.0,
            double_sided: false,
        }
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.frames.vertex_count(0)
    }

    /// Calls `visit` with every frame in order.
    ///
    /// # Errors
    /// A frame that cannot be read, or what `visit` refuses.
    pub fn for_each_frame<E: From<IoError>>(
        &self,
        mut visit: impl FnMut(usize, &[[f32; 3]]) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut vertices = Vec::new();
        for frame in 0..self.frames.frame_count() {
            self.frames.read(frame, &mut vertices)?;
            visit(frame, &vertices)?;
        }
        Ok(())
    }
}

/// Checks everything that comes from outside and returns the number of frames; meshes at rest may have one.
pub(crate) fn check(fps: f64, meshes: &[AnimatedMesh<'_>], file: &str) -> Result<usize, IoError> {
    if !(fps > 0.0 && fps <= 1000.0) {
        return Err(IoError::field(file, "fps", "frames a second above 0 and up to 1000", fps));
    }
    let frame_count = meshes.iter().map(|mesh| mesh.frames.frame_count()).max().unwrap_or(0);
    if frame_count == 0 {
        return Err(IoError::field(file, "the scene", "at least one mesh with a frame", "none"));
    }
    for mesh in meshes {
        check_mesh(mesh, frame_count, file)?;
    }
    Ok(frame_count)
}

fn check_mesh(mesh: &AnimatedMesh<'_>, frame_count: usize, file: &str) -> Result<(), IoError> {
    let wrong =
        |wanted: &str, found: String| Err(IoError::field(file, format!("mesh \"{}\"", mesh.name), wanted, found));
    let own_count = mesh.frames.frame_count();
    if own_count != 1 && own_count != frame_count {
        return wrong(&format!("{frame_count} frames, or 1"), own_count.to_string());
    }
    let vertex_count = mesh.vertex_count();
    if vertex_count == 0 || mesh.faces.is_empty() {
        return wrong("vertices and faces", "none".to_owned());
    }
    if let Some(vertex) = mesh.faces.as_flattened().iter().find(|&&vertex| vertex as usize >= vertex_count) {
        return wrong(&format!("faces of {vertex_count} vertices"), format!("vertex {vertex}"));
    }
    if !mesh.colour.iter().chain([&mesh.roughness]).all(|value| (0.0..=1.0).contains(value)) {
        return wrong("colour and roughness from 0 to 1", format!("{:?} and {}", mesh.colour, mesh.roughness));
    }
    if let Some(uv) = mesh.uv
        && (uv.len() != mesh.faces.len() || !uv.as_flattened().as_flattened().iter().all(|x| x.is_finite()))
    {
        return wrong(&format!("finite texture coordinates of {} faces", mesh.faces.len()), uv.len().to_string());
    }
    if let Some(colours) = mesh.vertex_colours
        && (colours.len() != vertex_count || !colours.as_flattened().iter().all(|x| (0.0..=1.0).contains(x)))
    {
        return wrong(&format!("colours from 0 to 1 of {vertex_count} vertices"), colours.len().to_string());
    }
    for index in 0..own_count {
        if mesh.frames.vertex_count(index) != vertex_count {
            let found = mesh.frames.vertex_count(index).to_string();
            return wrong(&format!("{vertex_count} vertices in frame {index}"), found);
        }
    }
    mesh.for_each_frame(|index, vertices| match vertices.iter().find(|vertex| vertex.iter().any(|x| !x.is_finite())) {
        Some(vertex) => wrong("finite vertices", format!("{vertex:?} in frame {index}")),
        None => Ok(()),
    })
}

/// Unit vertex normals, weighted by the area of the faces around; up where there is no area.
pub(crate) fn normals(faces: &[[u32; 3]], vertices: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let mut sums = vec![[0.0f64; 3]; vertices.len()];
    for face in faces {
        let [a, b, c] = face.map(|vertex| vertices[vertex as usize].map(f64::from));
        let u: [f64; 3] = std::array::from_fn(|axis| b[axis] - a[axis]);
        let v: [f64; 3] = std::array::from_fn(|axis| c[axis] - a[axis]);
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        for vertex in face {
            for axis in 0..3 {
                sums[*vertex as usize][axis] += cross[axis];
            }
        }
    }
    let unit = |sum: &[f64; 3]| {
        let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 { sum.map(|x| (x / length) as f32) } else { [0.0, 1.0, 0.0] }
    };
    sums.iter().map(unit).collect()
}

/// Frames in a file without a name, which goes when this does: what is written in one go is read in any order.
pub struct Spool {
    file: Mutex<File>,
    place: String,
    vertex_count: usize,
    frame_count: usize,
}

/// A [`Spool`] that is being written.
#[derive(Debug)]
pub struct SpoolWriter {
    file: BufWriter<File>,
    place: String,
    vertex_count: usize,
    frame_count: usize,
}

impl std::fmt::Debug for Spool {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Spool").field("place", &self.place).field("frames", &self.frame_count).finish_non_exhaustive()
    }
}

impl SpoolWriter {
    /// Opens a spool in a folder, for a mesh of so many vertices.
    ///
    /// # Errors
    /// [`IoError`] when the folder cannot be written.
    pub fn new(folder: impl AsRef<Path>, vertex_count: usize) -> Result<Self, IoError> {
        let folder = folder.as_ref();
        let file = tempfile::tempfile_in(folder).map_err(|source| IoError::file("write", folder, source))?;
        let place = folder.display().to_string();
        Ok(Self { file: BufWriter::with_capacity(1 << 18, file), place, vertex_count, frame_count: 0 })
    }

    /// Adds the next frame.
    ///
    /// # Errors
    /// [`IoError`] when the disk is full, or the frame has another number of vertices.
    pub fn push(&mut self, vertices: &[[f32; 3]]) -> Result<(), IoError> {
        if vertices.len() != self.vertex_count {
            let field = format!("frame {}", self.frame_count);
            return Err(IoError::field(&self.place, field, format!("{} vertices", self.vertex_count), vertices.len()));
        }
        self.frame_count += 1;
        let written = self.file.write_all(bytemuck::cast_slice(vertices));
        written.map_err(|source| IoError::file("write", Path::new(&self.place), source))
    }

    /// Ends the writing.
    ///
    /// # Errors
    /// [`IoError`] when the disk is full.
    pub fn finish(self) -> Result<Spool, IoError> {
        let Self { file, place, vertex_count, frame_count } = self;
        let file =
            file.into_inner().map_err(|unwritten| IoError::file("write", Path::new(&place), unwritten.into_error()))?;
        Ok(Spool { file: Mutex::new(file), place, vertex_count, frame_count })
    }
}

impl FrameSource for Spool {
    fn frame_count(&self) -> usize {
        self.frame_count
    }

    fn vertex_count(&self, _frame: usize) -> usize {
        self.vertex_count
    }

    fn read(&self, frame: usize, out: &mut Vec<[f32; 3]>) -> Result<(), IoError> {
        out.resize(self.vertex_count, [0.0; 3]);
        let start = frame as u64 * size_of_val(out.as_slice()) as u64;
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let bytes = bytemuck::cast_slice_mut(out.as_mut_slice());
        let read = file.seek(SeekFrom::Start(start)).and_then(|_| file.read_exact(bytes));
        read.map_err(|source| IoError::file("read", Path::new(&self.place), source))
    }
}

#[cfg(test)]
mod tests {
    use super::{FrameSource, SpoolWriter, normals};
    use modiste_core::shapes::icosphere;

    #[test]
    fn a_spool_gives_back_its_frames_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let frames: Vec<Vec<[f32; 3]>> = (0..5).map(|frame| vec![[frame as f32, 0.5, -1.0]; 7]).collect();
        let mut writer = SpoolWriter::new(folder.path(), 7).unwrap();
        for frame in &frames {
            writer.push(frame).unwrap();
        }
        assert!(writer.push(&[[0.0; 3]; 6]).unwrap_err().to_string().contains("frame 5: wanted 7 vertices, found 6"));
        let spool = writer.finish().unwrap();
        assert_eq!((spool.frame_count(), spool.vertex_count(0)), (5, 7));
        let (mut read, mut wanted) = (Vec::new(), Vec::new());
        for frame in [3, 0, 4, 1, 2] {
            spool.read(frame, &mut read).unwrap();
            frames.read(frame, &mut wanted).unwrap();
            assert_eq!(read, wanted);
        }
        assert!(spool.read(5, &mut read).is_err());
        drop(spool);
        assert!(crate::list_folder(folder.path()).unwrap().is_empty());
        assert!(SpoolWriter::new(folder.path().join("absent"), 1).unwrap_err().to_string().contains("absent"));
    }

    #[test]
    fn normals_of_a_ball_point_outward() {
        let ball = icosphere(2);
        let vertices: Vec<[f32; 3]> = ball.vertices.iter().map(|v| v.as_vec3().to_array()).collect();
        for (normal, vertex) in normals(ball.topology.faces(), &vertices).iter().zip(&ball.vertices) {
            let along: f64 = (0..3).map(|axis| f64::from(normal[axis]) * vertex[axis]).sum::<f64>() / vertex.length();
            assert!(along > 0.999, "{along}");
        }
        assert_eq!(normals(&[], &[[1.0; 3]]), [[0.0, 1.0, 0.0]]);
    }
}
