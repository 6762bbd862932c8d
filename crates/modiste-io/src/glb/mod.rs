//! Animated meshes as one binary glTF 2.0 file.
//!
//! Every mesh carries a bounded number of morph targets, the principal components of its frames, with positions and
//! normals; one animation drives their weights with a linear keyframe at every frame. The targets carry what is left
//! after the motion through space, which goes to the translation of a common parent node if that is enough to be within
//! the tolerance, and otherwise to the bones of a skeleton that all meshes share and that is found from their motion.
//! The file opens in three.js and Blender alike and hardly grows with the number of frames.

mod document;
mod morph;
mod skeleton;

use std::io::Write;
use std::path::Path;

use crate::{IoError, write_atomically};
use document::{Carrier, Document};
use modiste_core::SolveError;
use morph::Morph;
use skeleton::{Influences, Skeleton};

/// A mesh in motion with its looks.
#[derive(Debug, Clone, Copy)]
pub struct AnimatedMesh<'a> {
    /// Name of the mesh.
    pub name: &'a str,
    /// Triangles, counter-clockwise seen from outside.
    pub faces: &'a [[u32; 3]],
    /// Vertices in world (m) in each frame; a single frame makes a mesh at rest.
    pub frames: &'a [Vec<[f32; 3]>],
    /// Base colour, linear red, green, blue and opacity from 0 to 1.
    pub colour: [f32; 4],
    /// Roughness from 0 (mirror) to 1 (matt).
    pub roughness: f32,
    /// Whether both sides are seen, as of cloth.
    pub double_sided: bool,
}

/// How closely the morph targets follow the frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Targets are added until no vertex in any frame is further off than this (m).
    pub tolerance: f64,
    /// The most targets a mesh gets, whatever the tolerance.
    pub max_targets: usize,
    /// The most bones that all meshes share; at most 255, none leaves everything to the targets.
    pub max_bones: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { tolerance: 0.0005, max_targets: 48, max_bones: 32 }
    }
}

/// What became of one mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshSummary {
    /// Name of the mesh.
    pub name: String,
    /// Number of morph targets.
    pub targets: usize,
    /// Largest distance of a vertex in the file from the given one, over all frames (m).
    pub max_error: f64,
    /// Root mean square of that distance (m).
    pub rms_error: f64,
}

/// What was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// One entry a mesh, in order.
    pub meshes: Vec<MeshSummary>,
    /// Number of bones, none if the targets were enough by themselves.
    pub bones: usize,
    /// Size of the file (bytes).
    pub bytes: usize,
}

/// Writes an animation with the default [`Options`].
///
/// # Errors
/// [`IoError`] naming the mesh and what is wrong with it, or the file that cannot be written.
pub fn write_animation(path: impl AsRef<Path>, fps: f64, meshes: &[AnimatedMesh<'_>]) -> Result<Summary, IoError> {
    write_animation_with(path, fps, meshes, Options::default())
}

/// Writes an animation.
///
/// # Errors
/// [`IoError`] as [`write_animation`].
pub fn write_animation_with(
    path: impl AsRef<Path>,
    fps: f64,
    meshes: &[AnimatedMesh<'_>],
    options: Options,
) -> Result<Summary, IoError> {
    let path = path.as_ref();
    let file = path.display().to_string();
    let frame_count = check(fps, meshes, &file)?;
    let encoded = encode(meshes, frame_count, options)
        .map_err(|error| IoError::field(&file, "the meshes", "frames that can be analysed", error))?;
    let times: Vec<f32> = (0..frame_count).map(|frame| (frame as f64 / fps) as f32).collect();
    let mut document = Document::new(&times, &encoded.carrier);
    for (mesh, coded) in meshes.iter().zip(&encoded.meshes) {
        document.add(mesh, &coded.morph, coded.influences.as_ref());
    }
    let (header, pieces) = document.finish().map_err(|error| IoError::field(&file, "the scene", "JSON", error))?;
    let bytes = header.len() + pieces.iter().map(|piece| piece.len()).sum::<usize>();
    if u32::try_from(bytes).is_err() {
        return Err(IoError::field(&file, "the scene", "at most 4 GiB, the limit of GLB", format!("{bytes} bytes")));
    }
    write_atomically(path, |writer| {
        writer.write_all(&header)?;
        pieces.iter().try_for_each(|piece| writer.write_all(piece))
    })?;
    let bones = encoded.skeleton.as_ref().map_or(0, |skeleton| skeleton.bones.len());
    Ok(Summary { meshes: encoded.meshes.into_iter().map(|coded| coded.summary).collect(), bones, bytes })
}

/// All meshes in the form in which they go to the file.
struct Encoded {
    carrier: Carrier,
    skeleton: Option<Skeleton>,
    meshes: Vec<CodedMesh>,
}

struct CodedMesh {
    morph: Morph,
    influences: Option<Influences>,
    summary: MeshSummary,
}

fn encode(meshes: &[AnimatedMesh<'_>], frame_count: usize, options: Options) -> Result<Encoded, SolveError> {
    let translations = common_translations(meshes, frame_count);
    let carried = meshes.iter().map(|mesh| CodedMesh::carried(mesh, &translations, options));
    let meshes_alone = carried.collect::<Result<Vec<_>, _>>()?;
    let close_enough = meshes_alone.iter().all(|coded| coded.summary.max_error <= options.tolerance);
    if close_enough || options.max_bones == 0 {
        return Ok(Encoded { carrier: Carrier::translation(translations), skeleton: None, meshes: meshes_alone });
    }
    let moving: Vec<&AnimatedMesh<'_>> = meshes.iter().filter(|mesh| mesh.frames.len() > 1).collect();
    let skeleton = Skeleton::find(&moving, options.max_bones.min(255));
    let skinned = meshes.iter().zip(meshes_alone).map(|(mesh, alone)| {
        if mesh.frames.len() > 1 { CodedMesh::skinned(mesh, &skeleton, options) } else { Ok(alone) }
    });
    let skinned = skinned.collect::<Result<Vec<_>, _>>()?;
    Ok(Encoded { carrier: Carrier::skeleton(&skeleton), skeleton: Some(skeleton), meshes: skinned })
}

impl CodedMesh {
    /// Morph targets on top of the common translations (m, one per frame).
    fn carried(mesh: &AnimatedMesh<'_>, translations: &[[f32; 3]], options: Options) -> Result<Self, SolveError> {
        let shift = |frame: &mut [[f32; 3]], by: [f32; 3], sign: f32| {
            frame.iter_mut().for_each(|v| *v = std::array::from_fn(|axis| v[axis] + sign * by[axis]));
        };
        let mut local = mesh.frames.to_vec();
        if local.len() > 1 {
            local.iter_mut().zip(translations).for_each(|(frame, by)| shift(frame, *by, -1.0));
        }
        let normals: Vec<_> = mesh.frames.iter().map(|frame| morph::normals(mesh.faces, frame)).collect();
        let morph = morph::encode(&local, &normals, options)?;
        let summary = MeshSummary::of(mesh, &morph, |frame, shape| shift(shape, translations[frame], 1.0));
        Ok(Self { morph, influences: None, summary })
    }

    /// Morph targets in the rest shape under the skinning of a skeleton.
    fn skinned(mesh: &AnimatedMesh<'_>, skeleton: &Skeleton, options: Options) -> Result<Self, SolveError> {
        let influences = skeleton.influences(mesh.frames)?;
        let rest = skeleton.unpose(mesh.frames, &influences);
        let normals = mesh.frames.iter().enumerate().map(|(frame, vertices)| {
            skeleton.unpose_normals(frame, &influences, &morph::normals(mesh.faces, vertices))
        });
        let morph = morph::encode(&rest, &normals.collect::<Vec<_>>(), options)?;
        let summary = MeshSummary::of(mesh, &morph, |frame, shape| skeleton.pose(frame, &influences, shape));
        Ok(Self { morph, influences: Some(influences), summary })
    }
}

impl MeshSummary {
    /// Compares what the file shows, the morphed shape after `place`, with the given frames.
    fn of(mesh: &AnimatedMesh<'_>, morph: &Morph, place: impl Fn(usize, &mut [[f32; 3]])) -> Self {
        let (mut largest, mut sum, mut count) = (0.0f64, 0.0f64, 0usize);
        for (index, wanted) in mesh.frames.iter().enumerate() {
            let mut shape = morph.shape(index);
            place(index, &mut shape);
            for (x, y) in shape.iter().zip(wanted) {
                let square = (0..3).map(|axis| f64::from(x[axis] - y[axis]).powi(2)).sum::<f64>();
                largest = largest.max(square);
                sum += square;
                count += 1;
            }
        }
        Self {
            name: mesh.name.to_owned(),
            targets: morph.targets.len(),
            max_error: largest.sqrt(),
            rms_error: (sum / count as f64).sqrt(),
        }
    }
}

/// Checks everything that comes from outside and returns the number of frames.
fn check(fps: f64, meshes: &[AnimatedMesh<'_>], file: &str) -> Result<usize, IoError> {
    if !(fps > 0.0 && fps <= 1000.0) {
        return Err(IoError::field(file, "fps", "frames a second above 0 and up to 1000", fps));
    }
    let frame_count = meshes.iter().map(|mesh| mesh.frames.len()).max().unwrap_or(0);
    if frame_count == 0 {
        return Err(IoError::field(file, "the scene", "at least one mesh with a frame", "none"));
    }
    for mesh in meshes {
        let wrong =
            |wanted: &str, found: String| Err(IoError::field(file, format!("mesh \"{}\"", mesh.name), wanted, found));
        if mesh.frames.len() != 1 && mesh.frames.len() != frame_count {
            return wrong(&format!("{frame_count} frames, or 1"), mesh.frames.len().to_string());
        }
        let vertex_count = mesh.frames[0].len();
        if vertex_count == 0 || mesh.faces.is_empty() {
            return wrong("vertices and faces", "none".to_owned());
        }
        for (index, frame) in mesh.frames.iter().enumerate() {
            if frame.len() != vertex_count {
                return wrong(&format!("{vertex_count} vertices in frame {index}"), frame.len().to_string());
            }
            if let Some(vertex) = frame.iter().find(|vertex| vertex.iter().any(|x| !x.is_finite())) {
                return wrong("finite vertices", format!("{vertex:?} in frame {index}"));
            }
        }
        if let Some(vertex) = mesh.faces.as_flattened().iter().find(|&&vertex| vertex as usize >= vertex_count) {
            return wrong(&format!("faces of {vertex_count} vertices"), format!("vertex {vertex}"));
        }
        if !mesh.colour.iter().chain([&mesh.roughness]).all(|value| (0.0..=1.0).contains(value)) {
            return wrong("colour and roughness from 0 to 1", format!("{:?} and {}", mesh.colour, mesh.roughness));
        }
    }
    Ok(frame_count)
}

/// How the moving meshes as a whole have moved since the first frame (m), frame by frame.
fn common_translations(meshes: &[AnimatedMesh<'_>], frame_count: usize) -> Vec<[f32; 3]> {
    let moving = || meshes.iter().filter(|mesh| mesh.frames.len() == frame_count);
    let centre = |frame: usize| {
        let mut sum = [0.0f64; 3];
        for vertex in moving().flat_map(|mesh| &mesh.frames[frame]) {
            for axis in 0..3 {
                sum[axis] += f64::from(vertex[axis]);
            }
        }
        let count = moving().map(|mesh| mesh.frames[frame].len()).sum::<usize>();
        sum.map(|sum| sum / count as f64)
    };
    let first = centre(0);
    (0..frame_count)
        .map(|frame| {
            let now = centre(frame);
            std::array::from_fn(|axis| (now[axis] - first[axis]) as f32)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{AnimatedMesh, Options, write_animation, write_animation_with};
    use gltf_json::validation::Validate;
    use modiste_core::shapes::icosphere;

    /// A ball that walks along X, wobbles and spins: three components beside the translation.
    fn wobbling_ball(frame_count: usize) -> (Vec<[u32; 3]>, Vec<Vec<[f32; 3]>>) {
        let ball = icosphere(2);
        let frame = |frame: usize| {
            let time = frame as f64 / 10.0;
            let (sin, cos) = (0.7 * time).sin_cos();
            let place = |v: &modiste_core::Vec3| {
                let y = v.y * (1.0 + 0.2 * (2.0 * time).sin());
                [(v.x * cos + v.z * sin + time) as f32, y as f32, (v.z * cos - v.x * sin) as f32]
            };
            ball.vertices.iter().map(place).collect()
        };
        (ball.topology.faces().to_vec(), (0..frame_count).map(frame).collect())
    }

    fn ball<'a>(faces: &'a [[u32; 3]], frames: &'a [Vec<[f32; 3]>]) -> AnimatedMesh<'a> {
        AnimatedMesh { name: "ball", faces, frames, colour: [0.5, 0.2, 0.2, 1.0], roughness: 0.9, double_sided: true }
    }

    /// Splits a GLB by the specification (section 4.4) into its JSON and its binary part.
    fn split(glb: &[u8]) -> (gltf_json::Root, &[u8]) {
        let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&glb[..4], word(4), word(8)), (&b"glTF"[..], 2, glb.len()));
        let json_length = word(12);
        assert_eq!((&glb[16..20], json_length % 4), (&b"JSON"[..], 0));
        let start = 20 + json_length;
        assert_eq!(&glb[start + 4..start + 8], b"BIN\0");
        let binary = &glb[start + 8..];
        assert_eq!((binary.len(), binary.len() % 4), (word(start), 0));
        (gltf_json::deserialize::from_slice(&glb[20..start]).unwrap(), binary)
    }

    fn floats(root: &gltf_json::Root, binary: &[u8], accessor: usize) -> Vec<f32> {
        let view = &root.buffer_views[root.accessors[accessor].buffer_view.unwrap().value()];
        let start = view.byte_offset.map_or(0, |offset| offset.0 as usize);
        let bytes = &binary[start..start + view.byte_length.0 as usize];
        bytes.chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect()
    }

    #[test]
    fn the_file_is_valid_and_plays_the_frames() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ball.glb");
        let (faces, frames) = wobbling_ball(40);
        let summary = write_animation(&path, 30.0, &[ball(&faces, &frames)]).unwrap();
        let glb = crate::read_bytes(&path).unwrap();
        assert_eq!(summary.bytes, glb.len());
        let (root, binary) = split(&glb);
        let mut faults = Vec::new();
        root.validate(&root, gltf_json::Path::new, &mut |path: &dyn Fn() -> gltf_json::Path, error| {
            faults.push(format!("{}: {error}", path()));
        });
        assert!(faults.is_empty(), "{faults:?}");

        // Play it as a viewer does: base + Σ weight · target + translation of the parent.
        let primitive = &root.meshes[0].primitives[0];
        let targets = primitive.targets.as_ref().unwrap();
        assert_eq!(targets.len(), summary.meshes[0].targets);
        assert!(targets.len() <= 4, "three components are enough, not {}", targets.len());
        let base = floats(&root, binary, primitive.attributes.values().next().unwrap().value());
        let positions: Vec<_> = targets.iter().map(|t| floats(&root, binary, t.positions.unwrap().value())).collect();
        let samplers = &root.animations[0].samplers;
        let [translations, weights] = [0, 1].map(|index| floats(&root, binary, samplers[index].output.value()));
        let mut worst = 0.0f32;
        for (index, frame) in frames.iter().enumerate() {
            for (at, wanted) in frame.as_flattened().iter().enumerate() {
                let row = &weights[index * targets.len()..][..targets.len()];
                let moved: f32 = row.iter().zip(&positions).map(|(weight, target)| weight * target[at]).sum();
                worst = worst.max((base[at] + moved + translations[3 * index + at % 3] - wanted).abs());
            }
        }
        let rounding = 1e-6; // of single precision at these coordinates (m)
        assert!(f64::from(worst) <= summary.meshes[0].max_error + rounding, "{worst}");
        assert_eq!(summary.bones, 0);
        assert!(summary.meshes[0].max_error < Options::default().tolerance);
        assert!(weights.iter().all(|weight| weight.abs() <= 1.0));
        assert!((floats(&root, binary, samplers[0].input.value())[39] - 1.3).abs() < 1e-6);
    }

    #[test]
    fn the_bound_on_targets_holds_and_the_error_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ball.glb");
        let (faces, frames) = wobbling_ball(40);
        let options = Options { tolerance: 0.0, max_targets: 1, max_bones: 0 };
        let summary = write_animation_with(&path, 30.0, &[ball(&faces, &frames)], options).unwrap();
        assert_eq!(summary.meshes[0].targets, 1);
        assert!(summary.meshes[0].max_error > 0.1 && summary.meshes[0].rms_error < summary.meshes[0].max_error);
    }

    #[test]
    fn bones_take_over_where_the_targets_are_not_enough() {
        // One target cannot carry the turn of the ball, one bone can.
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ball.glb");
        let (faces, frames) = wobbling_ball(40);
        let options = Options { tolerance: 0.002, max_targets: 1, max_bones: 1 };
        let summary = write_animation_with(&path, 30.0, &[ball(&faces, &frames)], options).unwrap();
        assert_eq!((summary.bones, summary.meshes[0].targets), (1, 1));
        assert!(summary.meshes[0].max_error < 0.002, "{summary:?}");
        let glb = crate::read_bytes(&path).unwrap();
        let (root, binary) = split(&glb);
        let mut faults = Vec::new();
        root.validate(&root, gltf_json::Path::new, &mut |path: &dyn Fn() -> gltf_json::Path, error| {
            faults.push(format!("{}: {error}", path()));
        });
        assert!(faults.is_empty(), "{faults:?}");
        // The joint's keyframes turn and move as the ball does.
        let samplers = &root.animations[0].samplers;
        let [turns, places] = [0, 1].map(|index| floats(&root, binary, samplers[index].output.value()));
        let last =
            modiste_core::Quat::from_slice(&turns[4 * 39..].iter().map(|&x| f64::from(x)).collect::<Vec<_>>()[..4]);
        let wanted = modiste_core::Quat::from_rotation_y(0.7 * 3.9);
        assert!(last.angle_between(wanted) < 0.01 || last.angle_between(-wanted) < 0.01, "{last}");
        assert!((places[3 * 39] - 3.9).abs() < 0.01);
    }

    #[test]
    fn a_single_triangle_and_a_mesh_that_never_moves_are_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("small.glb");
        let wild = |frame: usize| {
            let x = (frame * frame % 7) as f32;
            vec![[x, 0.0, 1.0], [1.0, 2.0 - x, x], [0.5 * x, x, 3.0]]
        };
        let frames: Vec<_> = (0..9).map(wild).collect();
        let options = Options { tolerance: 0.0, max_targets: 1, max_bones: 4 };
        let summary = write_animation_with(&path, 30.0, &[ball(&[[0, 1, 2]], &frames)], options).unwrap();
        assert!(summary.meshes[0].max_error.is_finite());
        let still = vec![wild(1); 9];
        let summary = write_animation(&path, 30.0, &[ball(&[[0, 1, 2]], &still)]).unwrap();
        assert_eq!((summary.bones, summary.meshes[0].targets), (0, 0));
    }

    #[test]
    fn meshes_at_rest_need_no_animation() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("still.glb");
        let (faces, frames) = wobbling_ball(1);
        let summary = write_animation(&path, 30.0, &[ball(&faces, &frames)]).unwrap();
        assert_eq!(summary.meshes[0].targets, 0);
        let glb = crate::read_bytes(&path).unwrap();
        let (root, _) = split(&glb);
        assert!(root.animations.is_empty() && root.meshes[0].primitives[0].targets.is_none());
    }

    #[test]
    fn bad_input_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bad.glb");
        let (faces, mut frames) = wobbling_ball(3);
        let message = |fps, meshes: &[AnimatedMesh<'_>]| write_animation(&path, fps, meshes).unwrap_err().to_string();
        assert!(message(0.0, &[ball(&faces, &frames)]).contains("fps"));
        assert!(message(30.0, &[]).contains("at least one mesh"));
        assert!(
            message(30.0, &[ball(&faces, &frames), ball(&faces, &frames[..2])]).contains("3 frames, or 1, found 2")
        );
        assert!(message(30.0, &[ball(&[[0, 1, 900]], &frames)]).contains("vertex 900"));
        frames[2][5][1] = f32::INFINITY;
        assert!(message(30.0, &[ball(&faces, &frames)]).contains("mesh \"ball\": wanted finite vertices"));
        frames[2].pop();
        assert!(message(30.0, &[ball(&faces, &frames)]).contains("vertices in frame 2"));
        assert!(!path.exists());
    }
}
