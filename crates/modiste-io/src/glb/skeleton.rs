//! Bones found from the motion itself, so that morph targets need to carry only what does not turn with a limb.
//!
//! Smooth skinning decomposition in the manner of Le and Deng (2012): vertices that move alike share a rigid bone, and
//! every vertex follows up to four bones with convex weights. Deterministic; no knowledge of the body is needed.

use modiste_core::{Mat3, Matrix, Quat, SolveError, Vec3, solve_spd};

use super::{AnimatedMesh, Fault, spread};
use crate::IoError;
use crate::animated::FrameSource;

/// Vertices (of all meshes together) that the bones are found from.
const SAMPLE_VERTICES: usize = 600;
/// Frames that the bones and weights are found from.
const SAMPLE_FRAMES: usize = 48;
/// Rounds of assigning and refitting after each new bone.
const ROUNDS: usize = 3;
/// Fewest samples that a bone is fitted to: below four a rotation may be arbitrary.
const FEWEST: usize = 4;
/// Bones that are tried for each vertex, the best ones by themselves.
const CANDIDATES: usize = 6;
/// Bones that a vertex may follow in the file.
const INFLUENCES: usize = 4;
/// A blend of rotations that shrinks volume by more than this is not inverted; the vertex follows one bone instead.
const SMALLEST_DETERMINANT: f64 = 0.1;

/// A rigid bone: takes the rest shape (the first frame) to every frame.
#[derive(Debug, Clone)]
pub(super) struct Bone {
    /// A point of the rest shape about which the bone turns (m).
    pub(super) centre: Vec3,
    /// Rotation in each frame; neighbouring frames lie on the same side of the sphere of quaternions.
    pub(super) rotations: Vec<Quat>,
    /// Where the centre is in each frame (m).
    pub(super) positions: Vec<Vec3>,
}

/// `turn x + shift`: a rigid motion or a blend of several.
#[derive(Debug, Clone, Copy)]
struct Motion {
    turn: Mat3,
    shift: Vec3,
}

/// The bones that the vertices of a mesh follow.
#[derive(Debug)]
pub(super) struct Influences {
    pub(super) joints: Vec<[u8; 4]>,
    /// Non-negative, with a sum of one.
    pub(super) weights: Vec<[f32; 4]>,
}

/// All bones with their motions laid out for evaluation.
#[derive(Debug)]
pub(super) struct Skeleton {
    pub(super) bones: Vec<Bone>,
    /// One row of bones per frame.
    motions: Vec<Vec<Motion>>,
}

fn point(vertex: [f32; 3]) -> Vec3 {
    Vec3::from(vertex.map(f64::from))
}

impl Skeleton {
    /// Finds at most `most` bones for meshes that all have the same number of frames.
    pub(super) fn find(meshes: &[&AnimatedMesh<'_>], most: usize) -> Result<Self, IoError> {
        let vertices: Vec<(usize, usize)> = meshes
            .iter()
            .enumerate()
            .flat_map(|(mesh, data)| (0..data.vertex_count()).map(move |vertex| (mesh, vertex)))
            .collect();
        let samples: Vec<_> = spread(vertices.len(), SAMPLE_VERTICES).into_iter().map(|at| vertices[at]).collect();
        let mut read = vec![Vec::new(); meshes.len()];
        let mut sample = |frame: usize| -> Result<Vec<Vec3>, IoError> {
            for (mesh, vertices) in meshes.iter().zip(&mut read) {
                mesh.frames.read(frame, vertices)?;
            }
            Ok(samples.iter().map(|&(mesh, vertex)| point(read[mesh][vertex])).collect())
        };
        let frame_count = meshes[0].frames.frame_count();
        let coarse = spread(frame_count, SAMPLE_FRAMES).into_iter().map(&mut sample).collect::<Result<Vec<_>, _>>()?;
        let mut bones: Vec<(Vec<usize>, Bone)> = cluster(&coarse, most)
            .into_iter()
            .map(|members| (members.clone(), Bone::at_rest(&coarse[0], &members)))
            .collect();
        for frame in 0..frame_count {
            let points = sample(frame)?;
            for (members, bone) in &mut bones {
                bone.follow(&coarse[0], &points, members);
            }
        }
        let bones: Vec<Bone> = bones.into_iter().map(|(_, bone)| bone).collect();
        let motions = (0..frame_count).map(|frame| bones.iter().map(|bone| bone.motion(frame)).collect()).collect();
        Ok(Self { bones, motions })
    }

    /// The bones that each vertex of a mesh follows, by least squares over some of the frames.
    pub(super) fn influences(&self, frames: &dyn FrameSource) -> Result<Influences, Fault> {
        let chosen = spread(frames.frame_count(), SAMPLE_FRAMES);
        let mut samples = vec![Vec::new(); chosen.len()];
        for (&frame, vertices) in chosen.iter().zip(&mut samples) {
            frames.read(frame, vertices)?;
        }
        let mut influences = Influences { joints: Vec::new(), weights: Vec::new() };
        for (vertex, rest) in samples[0].iter().enumerate() {
            let rest = point(*rest);
            let wanted: Vec<Vec3> = samples.iter().map(|frame| point(frame[vertex])).collect();
            let placed = |bone: usize| chosen.iter().map(move |&frame| self.motions[frame][bone].apply(rest));
            let error = |bone: usize| placed(bone).zip(&wanted).map(|(x, y)| x.distance_squared(*y)).sum::<f64>();
            let mut ranking: Vec<(f64, usize)> = (0..self.bones.len()).map(|bone| (error(bone), bone)).collect();
            ranking.sort_by(|a, b| a.0.total_cmp(&b.0));
            let candidates: Vec<usize> = ranking.iter().take(CANDIDATES).map(|&(_, bone)| bone).collect();
            let tracks: Vec<Vec<Vec3>> = candidates.iter().map(|&bone| placed(bone).collect()).collect();
            let mut blend: Vec<(u8, f64)> = convex_weights(&tracks, &wanted)?
                .into_iter()
                .map(|(at, weight)| (candidates[at] as u8, weight))
                .collect();
            let flat = |frame: usize| self.blend(frame, &blend).turn.determinant() < SMALLEST_DETERMINANT;
            if (0..self.motions.len()).any(flat) {
                blend = vec![(candidates[0] as u8, 1.0)];
            }
            influences.push(&blend);
        }
        Ok(influences)
    }

    /// Carries the vertices of a frame back to the rest shape by the inverse of the skinning.
    pub(super) fn unpose(&self, frame: usize, influences: &Influences, shape: &mut [[f32; 3]]) {
        for (vertex, x) in shape.iter_mut().enumerate() {
            let motion = self.blend(frame, &influences.of(vertex));
            *x = (motion.turn.inverse() * (point(*x) - motion.shift)).as_vec3().to_array();
        }
    }

    /// The unit normals of the rest shape that a viewer, which turns normals by the blended rotations, shows as these.
    pub(super) fn unpose_normals(&self, frame: usize, influences: &Influences, normals: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let back = |(vertex, normal): (usize, &[f32; 3])| {
            let turn = self.blend(frame, &influences.of(vertex)).turn;
            (turn.inverse() * point(*normal)).normalize_or(Vec3::Y).as_vec3().to_array()
        };
        normals.iter().enumerate().map(back).collect()
    }

    /// Skins a shape in place.
    pub(super) fn pose(&self, frame: usize, influences: &Influences, shape: &mut [[f32; 3]]) {
        for (vertex, x) in shape.iter_mut().enumerate() {
            *x = self.blend(frame, &influences.of(vertex)).apply(point(*x)).as_vec3().to_array();
        }
    }

    fn blend(&self, frame: usize, weights: &[(u8, f64)]) -> Motion {
        let mut sum = Motion { turn: Mat3::ZERO, shift: Vec3::ZERO };
        for &(bone, weight) in weights {
            let motion = &self.motions[frame][usize::from(bone)];
            sum.turn += motion.turn * weight;
            sum.shift += motion.shift * weight;
        }
        sum
    }
}

impl Influences {
    fn push(&mut self, blend: &[(u8, f64)]) {
        let (mut joints, mut weights) = ([0; INFLUENCES], [0.0f32; INFLUENCES]);
        for (at, &(joint, weight)) in blend.iter().enumerate() {
            (joints[at], weights[at]) = (joint, weight as f32);
        }
        // The first takes up the rounding, so that the sum is one.
        weights[0] = 1.0 - weights[1..].iter().sum::<f32>();
        self.joints.push(joints);
        self.weights.push(weights);
    }

    fn of(&self, vertex: usize) -> [(u8, f64); INFLUENCES] {
        std::array::from_fn(|at| (self.joints[vertex][at], f64::from(self.weights[vertex][at])))
    }
}

impl Bone {
    /// A bone before the first frame.
    fn at_rest(rest: &[Vec3], members: &[usize]) -> Self {
        Self { centre: mean(rest, members), rotations: Vec::new(), positions: Vec::new() }
    }

    /// Adds the motion of the members to the next frame.
    fn follow(&mut self, rest: &[Vec3], frame: &[Vec3], members: &[usize]) {
        let position = mean(frame, members);
        let mut covariance = Mat3::ZERO;
        for &sample in members {
            let (from, to) = (rest[sample] - self.centre, frame[sample] - position);
            covariance += Mat3::from_cols(to * from.x, to * from.y, to * from.z);
        }
        let start = self.rotations.last().copied().unwrap_or(Quat::IDENTITY);
        self.rotations.push(nearest_rotation(&covariance, start));
        self.positions.push(position);
    }

    fn motion(&self, frame: usize) -> Motion {
        let turn = Mat3::from_quat(self.rotations[frame]);
        Motion { turn, shift: self.positions[frame] - turn * self.centre }
    }
}

impl Motion {
    fn apply(&self, x: Vec3) -> Vec3 {
        self.turn * x + self.shift
    }
}

/// Groups the columns of `tracks` (frames of sample points) by rigid motion: splits the worst group until there are enough.
fn cluster(tracks: &[Vec<Vec3>], most: usize) -> Vec<Vec<usize>> {
    let rest = &tracks[0];
    let mut groups: Vec<Vec<usize>> = vec![(0..rest.len()).collect()];
    let mut bones = vec![fit(tracks, &groups[0])];
    let mut errors = vec![f64::INFINITY; rest.len()];
    assign(tracks, &bones, &mut groups, &mut errors);
    while bones.len() < most {
        let total = |group: &Vec<usize>| group.iter().map(|&sample| errors[sample]).sum::<f64>();
        let Some(worst) =
            groups.iter().filter(|group| group.len() >= 2 * FEWEST).max_by(|a, b| total(a).total_cmp(&total(b)))
        else {
            break;
        };
        if total(worst) <= f64::EPSILON {
            break;
        }
        let seed = worst.iter().copied().max_by(|&a, &b| errors[a].total_cmp(&errors[b])).unwrap_or(worst[0]);
        let mut near = worst.clone();
        near.sort_by(|&a, &b| rest[a].distance_squared(rest[seed]).total_cmp(&rest[b].distance_squared(rest[seed])));
        near.truncate((near.len() / 4).max(FEWEST));
        bones.push(fit(tracks, &near));
        for _ in 0..ROUNDS {
            assign(tracks, &bones, &mut groups, &mut errors);
            for (bone, group) in bones.iter_mut().zip(&groups) {
                if group.len() >= FEWEST {
                    *bone = fit(tracks, group);
                }
            }
        }
        assign(tracks, &bones, &mut groups, &mut errors);
    }
    groups.retain(|group| group.len() >= FEWEST);
    if groups.is_empty() {
        groups.push((0..rest.len()).collect());
    }
    groups
}

/// Puts every sample into the group of the bone that places it best.
fn assign(tracks: &[Vec<Vec3>], bones: &[Bone], groups: &mut Vec<Vec<usize>>, errors: &mut [f64]) {
    groups.clear();
    groups.resize(bones.len(), Vec::new());
    let motions: Vec<Vec<Motion>> =
        bones.iter().map(|bone| (0..tracks.len()).map(|frame| bone.motion(frame)).collect()).collect();
    for (sample, rest) in tracks[0].iter().enumerate() {
        let error = |motions: &Vec<Motion>| {
            motions
                .iter()
                .zip(tracks)
                .map(|(motion, frame)| motion.apply(*rest).distance_squared(frame[sample]))
                .sum::<f64>()
        };
        let best = motions.iter().map(error).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        let (bone, error) = best.unwrap_or((0, 0.0));
        groups[bone].push(sample);
        errors[sample] = error;
    }
}

/// The rigid motion of the members from the first frame to each (least squares).
fn fit(tracks: &[Vec<Vec3>], members: &[usize]) -> Bone {
    let mut bone = Bone::at_rest(&tracks[0], members);
    for frame in tracks {
        bone.follow(&tracks[0], frame, members);
    }
    bone
}

fn mean(points: &[Vec3], members: &[usize]) -> Vec3 {
    members.iter().map(|&sample| points[sample]).sum::<Vec3>() / members.len() as f64
}

/// The rotation closest to a matrix, found by turning from `start` (Müller et al. 2016): works for singular matrices too.
fn nearest_rotation(matrix: &Mat3, start: Quat) -> Quat {
    const MOST_TURNS: usize = 100;
    let mut rotation = start;
    for _ in 0..MOST_TURNS {
        let now = Mat3::from_quat(rotation);
        let torque =
            now.x_axis.cross(matrix.x_axis) + now.y_axis.cross(matrix.y_axis) + now.z_axis.cross(matrix.z_axis);
        let grip = now.x_axis.dot(matrix.x_axis) + now.y_axis.dot(matrix.y_axis) + now.z_axis.dot(matrix.z_axis);
        let turn = torque / (grip.abs() + 1e-12);
        if turn.length_squared() < 1e-20 {
            break;
        }
        rotation = (Quat::from_scaled_axis(turn) * rotation).normalize();
    }
    rotation
}

/// Non-negative weights with a sum of one for which the blend of the tracks comes closest to `wanted`, at most
/// [`INFLUENCES`] of them: least squares, dropping the smallest weight until all conditions hold.
fn convex_weights(tracks: &[Vec<Vec3>], wanted: &[Vec3]) -> Result<Vec<(usize, f64)>, SolveError> {
    let mut active: Vec<usize> = (0..tracks.len()).collect();
    loop {
        let Some((&last, others)) = active.split_last() else { return Ok(vec![(0, 1.0)]) };
        if others.is_empty() {
            return Ok(vec![(last, 1.0)]);
        }
        // With the sum fixed the last weight follows from the others: minimise |Σ w_i (t_i - t_last) - (x - t_last)|².
        let dot = |a: &dyn Fn(usize) -> Vec3, b: &dyn Fn(usize) -> Vec3| {
            (0..wanted.len()).map(|f| a(f).dot(b(f))).sum::<f64>()
        };
        let towards = |track: usize| move |frame: usize| tracks[track][frame] - tracks[last][frame];
        let target = |frame: usize| wanted[frame] - tracks[last][frame];
        let mut gram =
            Matrix::from_fn(others.len(), others.len(), |i, j| dot(&towards(others[i]), &towards(others[j])));
        let right = Matrix::from_fn(others.len(), 1, |i, _| dot(&towards(others[i]), &target));
        let trace: f64 = (0..others.len()).map(|i| gram[(i, i)]).sum();
        for i in 0..others.len() {
            gram[(i, i)] += 1e-6 * trace + 1e-12; // Bones that move alike share their weight.
        }
        let solved = solve_spd(&gram, &right)?;
        let mut weights: Vec<f64> = (0..others.len()).map(|i| solved[(i, 0)]).collect();
        weights.push(1.0 - weights.iter().sum::<f64>());
        let smallest = (0..active.len()).min_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap_or(0);
        if weights[smallest] >= 0.0 && active.len() <= INFLUENCES {
            let mut pairs: Vec<(usize, f64)> =
                active.into_iter().zip(weights).filter(|pair| pair.1 as f32 > 0.0).collect();
            pairs.sort_by(|a, b| b.1.total_cmp(&a.1));
            return Ok(pairs);
        }
        active.remove(smallest);
    }
}

#[cfg(test)]
mod tests {
    use super::{Skeleton, convex_weights, nearest_rotation};
    use crate::glb::AnimatedMesh;
    use modiste_core::{Mat3, Quat, Vec3};

    #[test]
    fn nearest_rotation_of_a_stretched_rotation_is_the_rotation() {
        let wanted = Quat::from_scaled_axis(Vec3::new(0.7, -1.1, 0.4));
        let stretched = Mat3::from_quat(wanted) * Mat3::from_diagonal(Vec3::new(3.0, 0.5, 1e-6));
        assert!(nearest_rotation(&stretched, Quat::IDENTITY).angle_between(wanted) < 1e-5);
        assert_eq!(nearest_rotation(&Mat3::ZERO, Quat::IDENTITY), Quat::IDENTITY);
    }

    #[test]
    fn weights_are_convex_and_exact_where_that_is_possible() {
        let line = |direction: Vec3| (0..5).map(|frame| direction * f64::from(frame)).collect::<Vec<_>>();
        let tracks = [line(Vec3::X), line(Vec3::Y), line(Vec3::Z)];
        let weights = convex_weights(&tracks, &line(Vec3::new(0.25, 0.75, 0.0))).unwrap();
        assert_eq!(weights.iter().map(|pair| pair.0).take(2).collect::<Vec<_>>(), [1, 0]);
        assert!((weights[0].1 - 0.75).abs() < 1e-4);
        let outside = convex_weights(&tracks, &line(Vec3::new(-5.0, 1.0, 0.0))).unwrap();
        assert!(outside.iter().all(|pair| pair.1 >= 0.0));
        assert!((outside.iter().map(|pair| pair.1).sum::<f64>() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn an_elbow_is_two_bones_and_unposing_undoes_posing() {
        // A bar of points along X whose outer half bends about its middle, weights blending in between.
        let bar: Vec<Vec3> = (0..200)
            .map(|i| Vec3::new(f64::from(i / 4) * 0.02, f64::from(i % 2) * 0.1, f64::from(i / 2 % 2) * 0.1))
            .collect();
        let frames: Vec<Vec<[f32; 3]>> = (0..30)
            .map(|frame| {
                let bend = Quat::from_rotation_z(f64::from(frame) * 0.05);
                let elbow = Vec3::new(0.5, 0.0, 0.0);
                let place = |x: &Vec3| {
                    let weight = ((x.x - 0.4) / 0.2).clamp(0.0, 1.0);
                    let bent = elbow + bend * (*x - elbow);
                    (x.lerp(bent, weight) + Vec3::Y * f64::from(frame) * 0.1).as_vec3().to_array()
                };
                bar.iter().map(place).collect()
            })
            .collect();
        let mesh = AnimatedMesh::plain("bar", &[], &frames);
        let skeleton = Skeleton::find(&[&mesh], 2).unwrap();
        assert_eq!(skeleton.bones.len(), 2);
        let influences = skeleton.influences(&frames).unwrap();
        let mut largest_offset = 0.0f64;
        for (frame, given) in frames.iter().enumerate() {
            let mut shape = given.clone();
            skeleton.unpose(frame, &influences, &mut shape);
            let mut posed = shape.clone();
            skeleton.pose(frame, &influences, &mut posed);
            for (at, wanted) in frames[frame].iter().enumerate() {
                assert!(super::point(posed[at]).distance(super::point(*wanted)) < 1e-5);
                largest_offset = largest_offset.max(super::point(shape[at]).distance(super::point(frames[0][at])));
            }
        }
        // What is left for the morph targets is small beside the motion of 3 m.
        assert!(largest_offset < 0.05, "{largest_offset}");
    }
}
