//! Meshes in motion as other programs write them: an npz, a PC2 point cache, or one OBJ a frame.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use modiste_core::Vec3;

use crate::npz::Reader;
use crate::{IoError, exists, list_folder, obj, pc2, read_bytes};

/// The files of one sequence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SequenceFiles {
    /// Its name: that of the file without its endings, or of the OBJ files without their numbers.
    pub name: String,
    /// One npz or PC2, or the OBJ files in the order of their numbers.
    pub files: Vec<PathBuf>,
}

/// A sequence that was opened. Frames of OBJ files are read when asked for.
#[derive(Debug)]
pub struct MeshSequence {
    file: String,
    vertex_count: usize,
    faces: Option<Vec<[u32; 3]>>,
    fps: Option<f64>,
    frames: Frames,
}

#[derive(Debug)]
enum Frames {
    Objs(Vec<PathBuf>),
    Points(Vec<[f32; 3]>),
}

/// Sorts files into sequences: folders are looked into, OBJ files that differ in their last number belong together.
///
/// # Errors
/// A file of another kind, two sequences of one name, or a number that is missing between two OBJ files.
pub fn gather(paths: &[PathBuf]) -> Result<Vec<SequenceFiles>, IoError> {
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() {
            files.extend(list_folder(path)?.into_iter().filter(|path| Kind::of(path).is_some()));
        } else {
            files.push(path.clone());
        }
    }
    let mut sequences: BTreeMap<(PathBuf, String), Vec<(Option<u64>, PathBuf)>> = BTreeMap::new();
    for path in files {
        let file = path.display().to_string();
        let Some(kind) = Kind::of(&path) else {
            return Err(IoError::field(&file, "name", "a file that ends in .npz, .pc2, .obj or .bvh", "another"));
        };
        if !exists(&path) {
            read_bytes(&path)?;
        }
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let stem = stem(&path);
        let (name, number) = if kind == Kind::Obj { split_number(&stem, &folder) } else { (stem, None) };
        sequences.entry((folder, name)).or_default().push((number, path));
    }
    let mut gathered: Vec<SequenceFiles> = Vec::new();
    for ((_, name), mut files) in sequences {
        files.sort();
        files.dedup();
        check_numbers(&name, &files)?;
        let files: Vec<PathBuf> = files.into_iter().map(|(_, path)| path).collect();
        if let Some(other) = gathered.iter().find(|other| other.name == name) {
            let found = format!("also {}", other.files[0].display());
            return Err(IoError::field(&files[0].display().to_string(), "name", "a name of its own", found));
        }
        gathered.push(SequenceFiles { name, files });
    }
    gathered.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(gathered)
}

/// The frames of a sequence follow each other in steps of one length, and there is one file each.
fn check_numbers(name: &str, files: &[(Option<u64>, PathBuf)]) -> Result<(), IoError> {
    let wrong = |at: usize, wanted: String, found: String| {
        Err(IoError::field(&files[at].1.display().to_string(), format!("sequence \"{name}\""), wanted, found))
    };
    let Some(numbers) = files.iter().map(|(number, _)| *number).collect::<Option<Vec<u64>>>() else {
        return match files {
            [_] => Ok(()),
            [_, (_, second), ..] => {
                wrong(0, "one file or numbered OBJ files".into(), format!("also {}", second.display()))
            }
            [] => Ok(()),
        };
    };
    let step = numbers.get(1).map_or(1, |second| second.saturating_sub(numbers[0]));
    for at in 1..numbers.len() {
        if numbers[at] - numbers[at - 1] != step || step == 0 {
            let wanted = format!("frame {} after frame {}", numbers[at - 1] + step.max(1), numbers[at - 1]);
            return wrong(at, wanted, format!("frame {}", numbers[at]));
        }
    }
    Ok(())
}

/// The kinds of files that hold frames, or (BVH) say how a body moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Npz,
    Pc2,
    Obj,
    Bvh,
}

impl Kind {
    fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?.to_ascii_lowercase();
        let name = name.strip_suffix(".gz").unwrap_or(&name);
        [(".npz", Self::Npz), (".pc2", Self::Pc2), (".obj", Self::Obj), (".bvh", Self::Bvh)]
            .into_iter()
            .find_map(|(ending, kind)| name.ends_with(ending).then_some(kind))
    }
}

/// The name of a file without its endings.
fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = if name.to_ascii_lowercase().ends_with(".gz") { &name[..name.len() - 3] } else { &name };
    name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_owned()
}

/// `walk_0012` is frame 12 of `walk`; `0012` that of its folder.
fn split_number(stem: &str, folder: &Path) -> (String, Option<u64>) {
    let name = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    let number = stem[name.len()..].parse().ok();
    let name = name.trim_end_matches(['_', '-', '.', ' ']);
    match number {
        None => (stem.to_owned(), None),
        Some(_) if name.is_empty() => {
            (folder.file_name().map_or_else(|| stem.to_owned(), |name| name.to_string_lossy().into_owned()), number)
        }
        Some(_) => (name.to_owned(), number),
    }
}

impl SequenceFiles {
    /// The first file, which errors name.
    pub fn file(&self) -> &Path {
        &self.files[0]
    }

    /// Whether it is a motion rather than meshes.
    pub fn is_bvh(&self) -> bool {
        Kind::of(self.file()) == Some(Kind::Bvh)
    }

    /// Opens it. Of an npz the first of `names` that is there is taken, with its faces in `<name>_faces` or `faces`.
    ///
    /// # Errors
    /// A file that cannot be read, or does not hold frames of three coordinates a vertex.
    pub fn open(&self, names: &[&str]) -> Result<MeshSequence, IoError> {
        let path = self.file();
        let file = path.display().to_string();
        match Kind::of(path) {
            Some(Kind::Npz) => open_npz(path, file, names),
            Some(Kind::Pc2) => {
                let cache = pc2::read(path)?;
                let (vertex_count, frames) = (cache.point_count, Frames::Points(cache.points));
                Ok(MeshSequence { file, vertex_count, faces: None, fps: None, frames })
            }
            Some(Kind::Obj) => {
                let (vertices, faces) = obj::read(path)?;
                let (vertex_count, frames) = (vertices.len(), Frames::Objs(self.files.clone()));
                // What stands in a file without faces are points, whose mesh another file may give.
                let faces = Some(faces).filter(|faces| !faces.is_empty());
                Ok(MeshSequence { file, vertex_count, faces, fps: None, frames })
            }
            _ => Err(IoError::field(&file, "frames", "a file that ends in .npz, .pc2 or .obj", "another")),
        }
    }

    /// The bytes of all its files, for a hash.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn bytes(&self) -> Result<Vec<u8>, IoError> {
        let mut bytes = Vec::new();
        for file in &self.files {
            bytes.extend(read_bytes(file)?);
        }
        Ok(bytes)
    }
}

fn open_npz(path: &Path, file: String, names: &[&str]) -> Result<MeshSequence, IoError> {
    let reader = Reader::open(path)?;
    let Some(name) = names.iter().find(|name| reader.contains(name)) else {
        let wanted = format!("an array \"{}\" of shape (frames, vertices, 3)", names.join("\" or \""));
        return Err(IoError::field(&file, "arrays", wanted, format!("only {:?}", reader.names())));
    };
    let array = reader.f32(name)?;
    // One frame may stand alone.
    let shape = if array.shape.len() == 2 { [&[1], &array.shape[..]].concat() } else { array.shape.clone() };
    reader.check_shape(name, &shape, &[None, None, Some(3)])?;
    if shape[0] == 0 || shape[1] == 0 {
        let wanted = "at least one frame of at least one vertex";
        return Err(IoError::field(&file, format!("array \"{name}\""), wanted, format!("shape {:?}", array.shape)));
    }
    let own = format!("{name}_faces");
    let faces = [own.as_str(), "faces"].into_iter().find(|faces| reader.contains(faces));
    let faces = faces.map(|faces| reader.triangles(faces)).transpose()?;
    let fps = if reader.contains("fps") { Some(reader.scalar("fps")?) } else { None };
    let points = array.data.as_chunks::<3>().0.to_vec();
    Ok(MeshSequence { file, vertex_count: shape[1], faces, fps, frames: Frames::Points(points) })
}

impl MeshSequence {
    /// The first file, which errors name.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Number of vertices in every frame.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// The triangles, where the file has them.
    pub fn faces(&self) -> Option<&[[u32; 3]]> {
        self.faces.as_deref()
    }

    /// Frames a second, where the file says so.
    pub fn fps(&self) -> Option<f64> {
        self.fps
    }

    /// Number of frames, at least one.
    pub fn frame_count(&self) -> usize {
        match &self.frames {
            Frames::Objs(files) => files.len(),
            Frames::Points(points) => points.len() / self.vertex_count,
        }
    }

    /// The vertices of one frame, in the unit of the file.
    ///
    /// # Errors
    /// No such frame, or an OBJ file that cannot be read or has other vertices or faces than the first.
    pub fn frame(&self, index: usize) -> Result<Vec<Vec3>, IoError> {
        let wrong = |file: &str, wanted: String, found: String| Err(IoError::field(file, "mesh", wanted, found));
        if index >= self.frame_count() {
            return wrong(&self.file, format!("a frame {index}"), format!("{} frames", self.frame_count()));
        }
        match &self.frames {
            Frames::Points(points) => {
                let frame = &points[index * self.vertex_count..][..self.vertex_count];
                Ok(frame.iter().map(|x| Vec3::from_array(x.map(f64::from))).collect())
            }
            Frames::Objs(files) => {
                let (vertices, faces) = obj::read(&files[index])?;
                let file = files[index].display().to_string();
                if vertices.len() != self.vertex_count {
                    let wanted = format!("{} vertices as in {}", self.vertex_count, self.file);
                    return wrong(&file, wanted, vertices.len().to_string());
                }
                if Some(&faces[..]).filter(|faces| !faces.is_empty()) != self.faces() {
                    let wanted = format!("the faces of {}", self.file);
                    return wrong(&file, wanted, format!("{} others", faces.len()));
                }
                Ok(vertices)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{SequenceFiles, gather};
    use crate::animated::AnimatedMesh;
    use crate::npz::Writer;
    use crate::{obj, pc2, write_bytes};
    use modiste_core::Vec3;
    use std::path::{Path, PathBuf};

    const FACES: [[u32; 3]; 1] = [[0, 1, 2]];

    fn frames() -> Vec<Vec<Vec3>> {
        (0..3).map(|i| [Vec3::X, Vec3::Y, Vec3::Z].map(|x| x * (f64::from(i) + 0.5)).to_vec()).collect()
    }

    fn points() -> Vec<[f32; 3]> {
        frames().concat().iter().map(|x| x.as_vec3().to_array()).collect()
    }

    fn names(sequences: &[SequenceFiles]) -> Vec<(&str, usize)> {
        sequences.iter().map(|sequence| (sequence.name.as_str(), sequence.files.len())).collect()
    }

    fn touch(folder: &Path, names: &[&str]) -> Vec<PathBuf> {
        let paths: Vec<PathBuf> = names.iter().map(|name| folder.join(name)).collect();
        paths.iter().for_each(|path| write_bytes(path, b"v 0 0 0\n").unwrap());
        paths
    }

    #[test]
    fn numbered_files_belong_together_in_the_order_of_their_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let paths = touch(
            folder.path(),
            &["walk_9.obj", "walk_10.obj", "walk_8.obj", "kick.npz", "a.pc2", "run/2.obj", "run/1.obj"],
        );
        let found = gather(&paths).unwrap();
        assert_eq!(names(&found), [("a", 1), ("kick", 1), ("run", 2), ("walk", 3)]);
        assert!(found[3].file().ends_with("walk_8.obj") && found[3].files[2].ends_with("walk_10.obj"));
        assert_eq!(names(&gather(&[folder.path().join("run")]).unwrap()), [("run", 2)]);
        let lifted = touch(folder.path(), &["v.1.bvh.gz", "dress.obj"]);
        assert_eq!(names(&gather(&lifted).unwrap()), [("dress", 1), ("v.1", 1)]);
    }

    #[test]
    fn files_that_make_no_sequence_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let message = |names: &[&str]| gather(&touch(folder.path(), names)).unwrap_err().to_string();
        assert!(message(&["w_1.obj", "w_2.obj", "w_4.obj"]).contains("frame 3 after frame 2, found frame 4"));
        assert!(message(&["w_1.obj", "w_01.obj"]).contains("frame 2 after frame 1, found frame 1"));
        assert!(message(&["a.npz", "b/a.npz"]).contains("a name of its own"));
        assert!(message(&["a.npz", "a.pc2"]).contains("one file or numbered OBJ files"));
        assert!(message(&["a.fbx"]).contains("ends in .npz, .pc2, .obj or .bvh"));
        assert!(gather(&[folder.path().join("absent.npz")]).unwrap_err().to_string().contains("absent.npz"));
    }

    #[test]
    fn all_kinds_hold_the_same_frames() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        Writer::new()
            .add_f32("vertices", &[3, 3, 3], points().into_flattened())
            .add_triangles("faces", &FACES)
            .add_f32("fps", &[], vec![24.0])
            .save(path("npz/a.npz"))
            .unwrap();
        let single: Vec<Vec<[f32; 3]>> = points().chunks(3).map(<[_]>::to_vec).collect();
        pc2::write(path("pc2/a.pc2"), &AnimatedMesh::plain("a", &FACES, &single)).unwrap();
        for (index, frame) in frames().iter().enumerate() {
            obj::write(path(&format!("obj/a_{index}.obj")), frame, &FACES).unwrap();
        }
        for (kind, faces, fps) in [("npz", true, Some(24.0)), ("pc2", false, None), ("obj", true, None)] {
            let sequence = gather(&[path(kind)]).unwrap()[0].open(&["garment", "vertices"]).unwrap();
            assert_eq!((sequence.vertex_count(), sequence.frame_count(), sequence.fps()), (3, 3, fps), "{kind}");
            assert_eq!(sequence.faces(), faces.then_some(&FACES[..]), "{kind}");
            for (index, frame) in frames().iter().enumerate() {
                assert_eq!(&sequence.frame(index).unwrap(), frame, "{kind}");
            }
            assert!(sequence.frame(3).is_err());
        }
    }

    #[test]
    fn frames_of_another_mesh_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = |index: usize| folder.path().join(format!("a_{index}.obj"));
        let frame = &frames()[0];
        obj::write(path(0), frame, &FACES).unwrap();
        obj::write(path(1), frame, &[[0, 2, 1]]).unwrap();
        obj::write(path(2), &frame[..2], &[]).unwrap();
        let sequence = gather(&[folder.path().to_owned()]).unwrap()[0].open(&[]).unwrap();
        let message = |index: usize| sequence.frame(index).unwrap_err().to_string();
        assert!(message(1).contains("a_1.obj, mesh: wanted the faces of"), "{}", message(1));
        assert!(message(2).contains("a_2.obj, mesh: wanted 3 vertices"), "{}", message(2));
    }

    #[test]
    fn arrays_that_are_no_frames_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let message = |name: &str, shape: &[usize]| {
            let path = folder.path().join("a.npz");
            Writer::new().add_f32(name, shape, vec![0.0; shape.iter().product()]).save(&path).unwrap();
            gather(&[path]).unwrap()[0].open(&["body", "vertices"]).unwrap_err().to_string()
        };
        assert!(message("other", &[1, 1, 3]).contains("an array \"body\" or \"vertices\""));
        assert!(message("vertices", &[2, 2]).contains("shape [any, any, 3]"), "{}", message("vertices", &[2, 2]));
        assert!(message("vertices", &[2, 3, 4]).contains("shape [any, any, 3]"));
        assert!(message("vertices", &[0, 3, 3]).contains("at least one frame"));
        assert!(message("body", &[2, 0, 3]).contains("at least one vertex"));
    }
}
