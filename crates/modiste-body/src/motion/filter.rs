//! Cleaning of captured motion: one-frame spikes, noise, change of rate. All filters are without phase shift.

use modiste_core::{Quat, Vec3};

use crate::{Motion, Part, Pose};

/// A sudden change of one part's relative rotation that [`remove_spikes`] could not bridge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// The part.
    pub part: Part,
    /// The frame before the change.
    pub frame: usize,
    /// Angle between this frame and the next (radians).
    pub angle: f64,
}

/// Angle (radians) between two orientations, in `[0, π]`.
pub fn angle_between(a: Quat, b: Quat) -> f64 {
    2.0 * (a.conjugate() * b).xyz().length().atan2(a.dot(b).abs())
}

/// The relative rotations of one part over time, each quaternion in the hemisphere of the one before it.
fn track(motion: &Motion, part: Part) -> Vec<Quat> {
    let mut track: Vec<Quat> = motion.frames.iter().map(|pose| pose.rotation(part)).collect();
    for frame in 1..track.len() {
        if track[frame].dot(track[frame - 1]) < 0.0 {
            track[frame] = -track[frame];
        }
    }
    track
}

/// Bridges spikes: runs of at most `longest` seconds that leave the track faster than `max_speed` (rad/s) and come
/// back to it. Returns the steps that do not come back.
pub fn remove_spikes(motion: &mut Motion, max_speed: f64, longest: f64) -> Vec<Step> {
    let limit = max_speed / motion.fps;
    let window = ((longest * motion.fps).round() as usize).max(1);
    let mut steps = Vec::new();
    for part in Part::ALL {
        let mut rotations = track(motion, part);
        let mut frame = 0;
        while frame + 1 < rotations.len() {
            let angle = angle_between(rotations[frame], rotations[frame + 1]);
            if angle <= limit {
                frame += 1;
                continue;
            }
            let last = (frame + 1 + window).min(rotations.len() - 1);
            let back = (frame + 2..=last).find(|&j| {
                angle_between(rotations[frame], rotations[j]) <= limit.max(0.35 * angle)
                    && settled(&rotations, j, limit)
            });
            if let Some(back) = back {
                let (from, to) = (rotations[frame], rotations[back]);
                for between in frame + 1..back {
                    rotations[between] = from.slerp(to, (between - frame) as f64 / (back - frame) as f64);
                }
                frame = back;
            } else {
                steps.push(Step { part, frame, angle });
                frame += 1;
            }
        }
        for (pose, rotation) in motion.frames.iter_mut().zip(&rotations) {
            pose.set_rotation(part, *rotation);
        }
    }
    steps.sort_by_key(|step| (step.frame, step.part));
    steps
}

/// Whether the track moves slower than the limit just after `frame`.
fn settled(rotations: &[Quat], frame: usize, limit: f64) -> bool {
    rotations.get(frame + 1).is_none_or(|next| angle_between(rotations[frame], *next) <= limit)
}

/// Gaussian weights of a low-pass whose gain falls to 1/√2 at `cutoff` (Hz), for offsets `0..=reach` frames.
fn gaussian(cutoff: f64, fps: f64) -> Vec<f64> {
    let sigma = std::f64::consts::LN_2.sqrt() / (std::f64::consts::TAU * cutoff) * fps;
    let reach = (4.0 * sigma).ceil() as usize;
    (0..=reach).map(|offset| (-0.5 * (offset as f64 / sigma).powi(2)).exp()).collect()
}

/// Smooths every rotation and the root by a symmetric Gaussian with its −3 dB point at `cutoff` (Hz).
///
/// Rotations are averaged as quaternions of one hemisphere and normalised; at the ends the kernel is cut and
/// normalised anew. A constant motion stays as it is.
pub fn low_pass(motion: &mut Motion, cutoff: f64) {
    let weights = gaussian(cutoff, motion.fps);
    let count = motion.frames.len();
    for part in Part::ALL {
        let rotations = track(motion, part);
        for frame in 0..count {
            let mut sum = rotations[frame] * weights[0];
            for (offset, &weight) in weights.iter().enumerate().skip(1) {
                for other in symmetric(frame, offset, count) {
                    sum += rotations[other] * weight;
                }
            }
            // Neighbours within the kernel are less than a half turn apart, so the sum cannot vanish; a degenerate
            // track keeps its value.
            if sum.length_squared() > 1e-12 {
                motion.frames[frame].set_rotation(part, sum.normalize());
            }
        }
    }
    let roots: Vec<Vec3> = motion.frames.iter().map(|pose| pose.root_translation).collect();
    let smooth = smooth_points(&roots, &weights);
    for (pose, root) in motion.frames.iter_mut().zip(smooth) {
        pose.root_translation = root;
    }
}

/// The frames `offset` before and after `frame`, or neither where one of them is outside.
///
/// Dropping both keeps the kernel symmetric, so a straight line stays a straight line up to its ends.
fn symmetric(frame: usize, offset: usize, count: usize) -> impl Iterator<Item = usize> {
    let inside = frame >= offset && frame + offset < count;
    [frame.wrapping_sub(offset), frame + offset].into_iter().filter(move |_| inside)
}

fn smooth_points(points: &[Vec3], weights: &[f64]) -> Vec<Vec3> {
    (0..points.len())
        .map(|frame| {
            let (mut sum, mut total) = (points[frame] * weights[0], weights[0]);
            for (offset, &weight) in weights.iter().enumerate().skip(1) {
                for other in symmetric(frame, offset, points.len()) {
                    sum += points[other] * weight;
                    total += weight;
                }
            }
            sum / total
        })
        .collect()
}

/// Smooths a scalar track like [`low_pass`] does.
pub(crate) fn smooth_scalars(values: &[f64], cutoff: f64, fps: f64) -> Vec<f64> {
    let points: Vec<Vec3> = values.iter().map(|&value| Vec3::new(value, 0.0, 0.0)).collect();
    smooth_points(&points, &gaussian(cutoff, fps)).into_iter().map(|point| point.x).collect()
}

/// Smooths a track of points or rotation vectors like [`low_pass`] does.
pub(crate) fn smooth_vectors(values: &[Vec3], cutoff: f64, fps: f64) -> Vec<Vec3> {
    smooth_points(values, &gaussian(cutoff, fps))
}

/// Replaces sudden steps of single parts by an eased turn that takes `reach` seconds on either side.
pub fn soften_steps(motion: &mut Motion, steps: &[Step], reach: f64) {
    let half = ((reach * motion.fps).round() as usize).max(1);
    for step in steps {
        let rotations = track(motion, step.part);
        let first = (step.frame + 1).saturating_sub(half);
        let last = (step.frame + half).min(rotations.len().saturating_sub(1));
        if last <= first {
            continue;
        }
        let (from, to) = (rotations[first], rotations[last]);
        for frame in first..=last {
            let t = (frame - first) as f64 / (last - first) as f64;
            let eased = t * t * (3.0 - 2.0 * t);
            motion.frames[frame].set_rotation(step.part, from.slerp(to, eased));
        }
    }
}

/// The same motion at another rate, by spherical linear interpolation; starts with the same first frame.
pub fn resample(motion: &Motion, fps: f64) -> Motion {
    let count = motion.frames.len();
    if count < 2 {
        return Motion { fps, frames: motion.frames.clone() };
    }
    let frames = (motion.duration() * fps + 1e-9).floor() as usize + 1;
    let sample = |frame: usize| -> Pose {
        let at = frame as f64 * motion.fps / fps;
        let before = (at.floor() as usize).min(count - 2);
        motion.frames[before].interpolate(&motion.frames[before + 1], at - before as f64)
    };
    Motion { fps, frames: (0..frames).map(sample).collect() }
}

#[cfg(test)]
mod tests {
    use modiste_core::{Quat, Vec3};

    use super::{angle_between, low_pass, remove_spikes, resample, soften_steps};
    use crate::{Motion, Part, Pose};

    /// A swing of one elbow at `hertz`, with the root moving at a constant speed.
    fn swing(fps: f64, seconds: f64, hertz: f64) -> Motion {
        let frames = (0..=(fps * seconds) as usize)
            .map(|frame| {
                let time = frame as f64 / fps;
                let mut pose = Pose::template(Vec3::new(0.0, 1.0, 1.2 * time));
                pose.rotations[Part::LeftForearm.index()] = Vec3::X * (std::f64::consts::TAU * hertz * time).sin();
                pose
            })
            .collect();
        Motion { fps, frames }
    }

    fn amplitude(motion: &Motion) -> f64 {
        let middle = motion.frames.len() / 4..3 * motion.frames.len() / 4;
        motion.frames[middle].iter().map(|pose| pose.rotations[Part::LeftForearm.index()].x.abs()).fold(0.0, f64::max)
    }

    #[test]
    fn low_pass_keeps_slow_and_stops_fast_without_delay() {
        let (mut slow, mut edge, mut fast) = (swing(120.0, 4.0, 0.5), swing(120.0, 4.0, 6.0), swing(120.0, 4.0, 30.0));
        let before = slow.clone();
        for motion in [&mut slow, &mut edge, &mut fast] {
            low_pass(motion, 6.0);
        }
        assert!(amplitude(&slow) > 0.99);
        assert!((amplitude(&edge) - 0.5f64.sqrt()).abs() < 0.03, "{}", amplitude(&edge));
        assert!(amplitude(&fast) < 0.01);
        for (a, b) in slow.frames.iter().zip(&before.frames) {
            assert!(a.rotations[Part::LeftForearm.index()].distance(b.rotations[Part::LeftForearm.index()]) < 0.02);
            assert!(a.root_translation.distance(b.root_translation) < 1e-9, "a straight line stays");
        }
    }

    #[test]
    fn low_pass_crosses_the_half_turn_without_swinging_back() {
        let frames = (0..120)
            .map(|frame| {
                let mut pose = Pose::template(Vec3::ZERO);
                pose.set_rotation(Part::Pelvis, Quat::from_rotation_y(frame as f64 * 0.1));
                pose
            })
            .collect();
        let mut spin = Motion { fps: 120.0, frames };
        low_pass(&mut spin, 6.0);
        for frame in 0..119 {
            let step =
                angle_between(spin.frames[frame].rotation(Part::Pelvis), spin.frames[frame + 1].rotation(Part::Pelvis));
            assert!((step - 0.1).abs() < 1e-6, "frame {frame}: {step}");
        }
    }

    #[test]
    fn spikes_go_and_steps_are_reported() {
        let clean = swing(120.0, 2.0, 0.5);
        let mut motion = clean.clone();
        motion.frames[50].rotations[Part::LeftFoot.index()] = Vec3::X * 1.2;
        motion.frames[51].rotations[Part::LeftFoot.index()] = Vec3::X * 1.3;
        for pose in &mut motion.frames[100..] {
            pose.rotations[Part::RightThigh.index()] = Vec3::Y * 3.0;
        }
        let steps = remove_spikes(&mut motion, 20.0, 0.1);
        assert!(motion.frames[50].rotations[Part::LeftFoot.index()].length() < 1e-9);
        assert_eq!(steps.len(), 1);
        assert_eq!((steps[0].part, steps[0].frame), (Part::RightThigh, 99));
        assert!((steps[0].angle - 3.0).abs() < 1e-9);
        soften_steps(&mut motion, &steps, 0.25);
        let speed = motion
            .frames
            .windows(2)
            .map(|pair| angle_between(pair[0].rotation(Part::RightThigh), pair[1].rotation(Part::RightThigh)));
        assert!(speed.fold(0.0, f64::max) < 0.1);
    }

    #[test]
    fn resampling_keeps_times() {
        let slow = resample(&swing(120.0, 2.0, 0.5), 30.0);
        let direct = swing(30.0, 2.0, 0.5);
        assert_eq!(slow.frames.len(), direct.frames.len());
        for (a, b) in slow.frames.iter().zip(&direct.frames) {
            assert!(a.root_translation.distance(b.root_translation) < 1e-9);
            assert!(a.rotations[Part::LeftForearm.index()].distance(b.rotations[Part::LeftForearm.index()]) < 1e-9);
        }
        let odd = resample(&swing(100.0, 1.0, 0.5), 30.0);
        assert_eq!(odd.frames.len(), 31);
    }
}
