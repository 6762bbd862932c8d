//! A spring between two points: seams, elastic bands, attachments.

use glam::Mat3A;
use modiste_core::Vec3;

/// A linear spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spring {
    /// Rest length (m); zero pulls together.
    pub(crate) rest_length: f64,
    /// Stiffness (N/m).
    pub(crate) stiffness: f64,
    /// Whether it only pulls, as a thread does.
    pub(crate) tension_only: bool,
}

/// Force on the first end (N; the second gets the opposite) and the definite stiffness block, or `None` where slack.
pub(crate) fn spring_force(spring: &Spring, from_second_to_first: Vec3) -> Option<(Vec3, Mat3A)> {
    let length = from_second_to_first.length();
    let stretch = length - spring.rest_length;
    if spring.tension_only && stretch <= 0.0 {
        return None;
    }
    if length < 1e-12 {
        return Some((Vec3::ZERO, Mat3A::from_diagonal(glam::Vec3::splat(single(spring.stiffness)))));
    }
    let along = from_second_to_first / length;
    // k (d dᵀ + (1 - rest/length)(I - d dᵀ)), the second part only under tension.
    let across = (stretch / length).max(0.0);
    let direction = along.as_vec3a();
    let outer = Mat3A::from_cols(direction * direction.x, direction * direction.y, direction * direction.z);
    let block = outer * single(spring.stiffness * (1.0 - across)) + Mat3A::IDENTITY * single(spring.stiffness * across);
    Some((along * (-spring.stiffness * stretch), block))
}

#[expect(clippy::cast_possible_truncation, reason = "the inner solve runs in f32")]
fn single(value: f64) -> f32 {
    value as f32
}

#[cfg(test)]
mod tests {
    use super::{Spring, spring_force};
    use modiste_core::Vec3;

    #[test]
    fn force_and_block_are_derivatives_of_half_k_stretch_squared() {
        let spring = Spring { rest_length: 0.02, stiffness: 55.0, tension_only: false };
        let at = Vec3::new(0.02, -0.013, 0.007);
        let (force, block) = spring_force(&spring, at).unwrap();
        let energy = |d: Vec3| 0.5 * spring.stiffness * (d.length() - spring.rest_length).powi(2);
        let step = 1e-7;
        for axis in 0..3 {
            let shift = Vec3::AXES[axis] * step;
            let slope = (energy(at + shift) - energy(at - shift)) / (2.0 * step);
            assert!((slope + force[axis]).abs() < 1e-7);
            let column = (spring_force(&spring, at - shift).unwrap().0 - spring_force(&spring, at + shift).unwrap().0)
                / (2.0 * step);
            assert!((column - block.col(axis).as_dvec3()).length() < 1e-4 * column.length());
        }
    }

    #[test]
    fn a_thread_does_not_push() {
        let spring = Spring { rest_length: 0.02, stiffness: 55.0, tension_only: true };
        assert!(spring_force(&spring, Vec3::X * 0.01).is_none());
    }
}
