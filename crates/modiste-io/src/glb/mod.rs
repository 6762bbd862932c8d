//! Animated meshes as one binary glTF 2.0 file.
//!
//! Every mesh carries a bounded number of morph targets, the principal components of its frames, with positions and
//! normals; one animation drives their weights with a linear keyframe at every frame. The targets carry what is left
//! after the motion through space, which goes to the translation of a common parent node if that is enough to be within
//! the tolerance, and otherwise to the bones of a skeleton that all meshes share and that is found from their motion.
//! The file opens in three.js and Blender alike and hardly grows with the number of frames.
//!
//! Targets, bones and their weights are learned from at most [`SAMPLE_FRAMES`] frames, spread evenly, and all frames are
//! then expressed by them, one after the other: memory does not grow with the length but by a row of weights a frame.

mod document;
mod morph;
mod skeleton;

use std::io::Write;
use std::path::Path;

pub use crate::animated::AnimatedMesh;
use crate::animated::{check, normals};
use crate::{IoError, write_atomically};
use document::{Arrays, Carrier, Document};
use modiste_core::SolveError;
use morph::Morph;
use skeleton::{Influences, Skeleton};

/// Frames that targets and bones are learned from.
const SAMPLE_FRAMES: usize = 192;

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
    let encoded = encode(meshes, frame_count, options).map_err(|fault| match fault {
        Fault::Io(error) => error,
        Fault::Solve(error) => IoError::field(&file, "the meshes", "frames that can be analysed", error),
    })?;
    let times: Vec<f32> = (0..frame_count).map(|frame| (frame as f64 / fps) as f32).collect();
    let mut document = Document::new(&times, &encoded.carrier);
    let arrays: Vec<Arrays> = meshes.iter().zip(&encoded.meshes).map(|(mesh, coded)| Arrays::of(mesh, coded)).collect();
    for (mesh, arrays) in meshes.iter().zip(&arrays) {
        document.add(mesh, arrays);
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

/// Why an animation cannot be expressed.
#[derive(Debug)]
enum Fault {
    Io(IoError),
    Solve(SolveError),
}

impl From<IoError> for Fault {
    fn from(error: IoError) -> Self {
        Self::Io(error)
    }
}

impl From<SolveError> for Fault {
    fn from(error: SolveError) -> Self {
        Self::Solve(error)
    }
}

fn encode(meshes: &[AnimatedMesh<'_>], frame_count: usize, options: Options) -> Result<Encoded, Fault> {
    let translations = common_translations(meshes, frame_count)?;
    let carried = meshes.iter().map(|mesh| CodedMesh::carried(mesh, &translations, options));
    let meshes_alone = carried.collect::<Result<Vec<_>, _>>()?;
    let close_enough = meshes_alone.iter().all(|coded| coded.summary.max_error <= options.tolerance);
    if close_enough || options.max_bones == 0 {
        return Ok(Encoded { carrier: Carrier::translation(translations), skeleton: None, meshes: meshes_alone });
    }
    let moving: Vec<&AnimatedMesh<'_>> = meshes.iter().filter(|mesh| mesh.frames.frame_count() > 1).collect();
    let skeleton = Skeleton::find(&moving, options.max_bones.min(255))?;
    let skinned = meshes.iter().zip(meshes_alone).map(|(mesh, alone)| {
        if mesh.frames.frame_count() > 1 { CodedMesh::skinned(mesh, &skeleton, options) } else { Ok(alone) }
    });
    let skinned = skinned.collect::<Result<Vec<_>, _>>()?;
    Ok(Encoded { carrier: Carrier::skeleton(&skeleton), skeleton: Some(skeleton), meshes: skinned })
}

impl CodedMesh {
    /// Morph targets on top of the common translations (m, one per frame).
    fn carried(mesh: &AnimatedMesh<'_>, translations: &[[f32; 3]], options: Options) -> Result<Self, Fault> {
        let shift = |shape: &mut [[f32; 3]], by: [f32; 3], sign: f32| {
            shape.iter_mut().for_each(|v| *v = std::array::from_fn(|axis| v[axis] + sign * by[axis]));
        };
        let at_rest = mesh.frames.frame_count() == 1;
        let back = |frame: usize, shape: &mut [[f32; 3]]| {
            if !at_rest {
                shift(shape, translations[frame], -1.0);
            }
        };
        let morph = learn(mesh, options, back, |_, normals| normals)?;
        let place = |frame: usize, shape: &mut [[f32; 3]]| {
            if !at_rest {
                shift(shape, translations[frame], 1.0);
            }
        };
        let summary = MeshSummary::of(mesh, &morph, place)?;
        Ok(Self { morph, influences: None, summary })
    }

    /// Morph targets in the rest shape under the skinning of a skeleton.
    fn skinned(mesh: &AnimatedMesh<'_>, skeleton: &Skeleton, options: Options) -> Result<Self, Fault> {
        let influences = skeleton.influences(mesh.frames)?;
        let back = |frame: usize, shape: &mut [[f32; 3]]| skeleton.unpose(frame, &influences, shape);
        let morph = learn(mesh, options, back, |frame, normals| skeleton.unpose_normals(frame, &influences, &normals))?;
        let summary = MeshSummary::of(mesh, &morph, |frame, shape| skeleton.pose(frame, &influences, shape))?;
        Ok(Self { morph, influences: Some(influences), summary })
    }
}

/// Learns morph targets from some frames and gives the weights of all; `back` and `normals_back` take off the motion of the
/// nodes that carry the mesh.
fn learn(
    mesh: &AnimatedMesh<'_>,
    options: Options,
    back: impl Fn(usize, &mut [[f32; 3]]),
    normals_back: impl Fn(usize, Vec<[f32; 3]>) -> Vec<[f32; 3]>,
) -> Result<Morph, Fault> {
    let (mut shapes, mut shape_normals) = (Vec::new(), Vec::new());
    let chosen = spread(mesh.frames.frame_count(), SAMPLE_FRAMES);
    let mut vertices = Vec::new();
    for &frame in &chosen {
        mesh.frames.read(frame, &mut vertices)?;
        shape_normals.push(normals_back(frame, normals(mesh.faces, &vertices)));
        back(frame, &mut vertices);
        shapes.push(vertices.clone());
    }
    let basis = morph::Basis::learn(&shapes, options)?;
    drop(shapes);
    let mut coefficients = Vec::with_capacity(mesh.frames.frame_count());
    for frame in 0..mesh.frames.frame_count() {
        mesh.frames.read(frame, &mut vertices)?;
        back(frame, &mut vertices);
        coefficients.push(basis.coefficients(&vertices));
    }
    Ok(basis.morph(&coefficients, &chosen, &shape_normals)?)
}

impl MeshSummary {
    /// Compares what the file shows, the morphed shape after `place`, with the given frames.
    fn of(mesh: &AnimatedMesh<'_>, morph: &Morph, place: impl Fn(usize, &mut [[f32; 3]])) -> Result<Self, IoError> {
        let (mut largest, mut sum, mut count) = (0.0f64, 0.0f64, 0usize);
        mesh.for_each_frame(|index, wanted| {
            let mut shape = morph.shape(index);
            place(index, &mut shape);
            for (x, y) in shape.iter().zip(wanted) {
                let square = (0..3).map(|axis| f64::from(x[axis] - y[axis]).powi(2)).sum::<f64>();
                largest = largest.max(square);
                sum += square;
                count += 1;
            }
            Ok::<(), IoError>(())
        })?;
        Ok(Self {
            name: mesh.name.to_owned(),
            targets: morph.targets.len(),
            max_error: largest.sqrt(),
            rms_error: (sum / count as f64).sqrt(),
        })
    }
}

/// At most `most` of the numbers below `count`, evenly spaced, the first among them.
fn spread(count: usize, most: usize) -> Vec<usize> {
    let taken = count.min(most);
    (0..taken).map(|index| index * count / taken).collect()
}

/// How the moving meshes as a whole have moved since the first frame (m), frame by frame.
fn common_translations(meshes: &[AnimatedMesh<'_>], frame_count: usize) -> Result<Vec<[f32; 3]>, IoError> {
    let moving = || meshes.iter().filter(|mesh| mesh.frames.frame_count() == frame_count);
    let mut vertices = Vec::new();
    let mut centres = Vec::with_capacity(frame_count);
    for frame in 0..frame_count {
        let (mut sum, mut count) = ([0.0f64; 3], 0usize);
        for mesh in moving() {
            mesh.frames.read(frame, &mut vertices)?;
            count += vertices.len();
            for vertex in &vertices {
                for axis in 0..3 {
                    sum[axis] += f64::from(vertex[axis]);
                }
            }
        }
        centres.push(sum.map(|sum| sum / count as f64));
    }
    let first = centres[0];
    Ok(centres.iter().map(|now| std::array::from_fn(|axis| (now[axis] - first[axis]) as f32)).collect())
}

#[cfg(test)]
mod tests {
    use super::{AnimatedMesh, Options, write_animation, write_animation_with};
    use crate::animated::FrameSource;
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

    fn ball<'a>(faces: &'a [[u32; 3]], frames: &'a dyn FrameSource) -> AnimatedMesh<'a> {
        AnimatedMesh {
            name: "ball",
            faces,
            frames,
            uv: None,
            vertex_colours: None,
            colour: [0.5, 0.2, 0.2, 1.0],
            roughness: 0.9,
            double_sided: true,
        }
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
        assert!(weights.iter().all(|weight| (0.0..=1.0).contains(weight)));
        assert_eq!(
            root.meshes[0].weights.as_ref().unwrap()[..],
            weights[..targets.len()],
            "the first frame is shown at rest"
        );
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
    fn long_animations_are_learned_from_some_frames_and_played_in_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.glb");
        let (faces, frames) = wobbling_ball(3 * super::SAMPLE_FRAMES + 7);
        let summary = write_animation(&path, 30.0, &[ball(&faces, &frames)]).unwrap();
        assert!(summary.meshes[0].targets <= 4, "{summary:?}");
        assert!(summary.meshes[0].max_error < 0.001, "{summary:?}");
    }

    #[test]
    fn texture_coordinates_part_vertices_at_seams_and_colours_follow() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("uv.glb");
        // Two triangles of a square whose shared edge is a seam.
        let faces = [[0, 1, 2], [0, 2, 3]];
        let uv = [[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], [[0.0, 0.0], [0.5, 1.0], [0.0, 1.0]]];
        let colours = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.5]];
        let square = |x: f32| vec![[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x + 1.0, 1.0, x * x], [x, 1.0, 0.0]];
        let frames = vec![square(0.0), square(0.5), square(1.0)];
        let mesh = AnimatedMesh { uv: Some(&uv), vertex_colours: Some(&colours), ..ball(&faces, &frames) };
        write_animation(&path, 30.0, &[mesh]).unwrap();
        let glb = crate::read_bytes(&path).unwrap();
        let (root, binary) = split(&glb);
        let attributes = &root.meshes[0].primitives[0].attributes;
        let of = |wanted: gltf_json::mesh::Semantic| {
            let found =
                attributes.iter().find(|(name, _)| **name == gltf_json::validation::Checked::Valid(wanted.clone()));
            floats(&root, binary, found.unwrap().1.value())
        };
        use gltf_json::mesh::Semantic;
        // Of the seam's two vertices one has two places on the cloth.
        assert_eq!(of(Semantic::Positions).len(), 5 * 3);
        assert_eq!(of(Semantic::TexCoords(0)).len(), 5 * 2);
        let colours = of(Semantic::Colors(0));
        assert_eq!((colours.len(), colours[2 * 3 + 2], colours[4 * 3 + 2]), (5 * 3, 1.0, 1.0));
        let places = of(Semantic::TexCoords(0));
        assert_eq!(places[2 * 2..3 * 2], [1.0, 0.0], "V runs downwards in glTF");
        assert_eq!(places[4 * 2..5 * 2], [0.5, 0.0], "the further place of the vertex comes last");
        let target = root.meshes[0].primitives[0].targets.as_ref().unwrap()[0].positions.unwrap();
        assert_eq!(floats(&root, binary, target.value()).len(), 5 * 3);
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
        let two = frames[..2].to_vec();
        let message = |fps, meshes: &[AnimatedMesh<'_>]| write_animation(&path, fps, meshes).unwrap_err().to_string();
        assert!(message(0.0, &[ball(&faces, &frames)]).contains("fps"));
        assert!(message(30.0, &[]).contains("at least one mesh"));
        assert!(message(30.0, &[ball(&faces, &frames), ball(&faces, &two)]).contains("3 frames, or 1, found 2"));
        assert!(message(30.0, &[ball(&[[0, 1, 900]], &frames)]).contains("vertex 900"));
        frames[2][5][1] = f32::INFINITY;
        assert!(message(30.0, &[ball(&faces, &frames)]).contains("mesh \"ball\": wanted finite vertices"));
        frames[2].pop();
        assert!(message(30.0, &[ball(&faces, &frames)]).contains("vertices in frame 2"));
        assert!(!path.exists());
    }
}
