//! Rotations: exponential and logarithm, nearest rotation, swing and twist.

use crate::{Mat3, Quat, Vec3};

/// The rotation matrix of a rotation vector (axis times angle, rad).
///
/// Rodrigues' formula `R = I + sin(a)/a K + (1 - cos(a))/a² K²`, with series for the two fractions at small angles.
pub fn rotation_from_vector(v: Vec3) -> Mat3 {
    let squared = v.length_squared();
    let (first, second) = if squared < 1e-8 {
        (1.0 - squared / 6.0, 0.5 - squared / 24.0)
    } else {
        let angle = squared.sqrt();
        let half = (0.5 * angle).sin();
        (angle.sin() / angle, 2.0 * half * half / squared)
    };
    let k = cross_matrix(v);
    Mat3::IDENTITY + first * k + second * (k * k)
}

/// The matrix `K` with `K x = v × x`.
pub fn cross_matrix(v: Vec3) -> Mat3 {
    Mat3::from_cols(Vec3::new(0.0, v.z, -v.y), Vec3::new(-v.z, 0.0, v.x), Vec3::new(v.y, -v.x, 0.0))
}

/// The rotation vector (rad) of a rotation matrix, of length at most π.
///
/// Through the quaternion, which keeps full accuracy near 0 and near π, where the formula by the trace loses it.
pub fn vector_from_rotation(r: Mat3) -> Vec3 {
    vector_from_quat(Quat::from_mat3(&r))
}

/// The unit quaternion of a rotation vector (rad).
pub fn quat_from_vector(v: Vec3) -> Quat {
    let angle = v.length();
    // sin(a/2)/a, whose series is exact to rounding below 1e-4.
    let scale = if angle < 1e-4 { 0.5 - angle * angle / 48.0 } else { (0.5 * angle).sin() / angle };
    let axis = scale * v;
    Quat::from_xyzw(axis.x, axis.y, axis.z, (0.5 * angle).cos()).normalize()
}

/// The rotation vector (rad) of a quaternion, of length at most π; the quaternion need not have unit length.
pub fn vector_from_quat(q: Quat) -> Vec3 {
    let axis = Vec3::new(q.x, q.y, q.z);
    // q and -q are the same rotation; the one with w >= 0 turns by at most π.
    let (axis, w) = if q.w < 0.0 { (-axis, -q.w) } else { (axis, q.w) };
    let sine = axis.length();
    if sine < 1e-9 * w {
        // atan2(s, w)/s tends to 1/w.
        return 2.0 / w * axis;
    }
    if sine <= 0.0 {
        return Vec3::ZERO;
    }
    2.0 * sine.atan2(w) / sine * axis
}

/// The angle (rad, 0 to π) between two rotations.
pub fn angle_between(a: Mat3, b: Mat3) -> f64 {
    vector_from_rotation(a.transpose() * b).length()
}

/// The rotation nearest to a matrix in the Frobenius norm, which maximises `tr(Rᵀ M)`.
///
/// For `M = U S Vᵀ` it is `U diag(1, 1, det(U Vᵀ)) Vᵀ`: a proper rotation also when `M` mirrors. Where it is not
/// unique (rank below two) one of the nearest is returned. A matrix that is not finite or zero gives the identity.
///
/// Found as the largest eigenvector of Horn's 4×4 quaternion matrix (1987), by Jacobi rotations, which are accurate for
/// any rank.
pub fn nearest_rotation(m: Mat3) -> Mat3 {
    let scale = m.to_cols_array().iter().fold(0.0f64, |largest, entry| largest.max(entry.abs()));
    if !m.is_finite() || scale <= 0.0 {
        return Mat3::IDENTITY;
    }
    // s[i][j] = sum over points of a_i b_j in Horn's notation, where b = R a: the transpose of m.
    let s = |i: usize, j: usize| m.col(i)[j] / scale;
    let horn = [
        [s(0, 0) + s(1, 1) + s(2, 2), s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0)],
        [0.0, s(0, 0) - s(1, 1) - s(2, 2), s(0, 1) + s(1, 0), s(2, 0) + s(0, 2)],
        [0.0, 0.0, -s(0, 0) + s(1, 1) - s(2, 2), s(1, 2) + s(2, 1)],
        [0.0, 0.0, 0.0, -s(0, 0) - s(1, 1) + s(2, 2)],
    ];
    let [w, x, y, z] = largest_eigenvector(horn);
    Mat3::from_quat(Quat::from_xyzw(x, y, z, w).normalize())
}

/// The eigenvector of the largest eigenvalue of a symmetric 4×4 matrix given by its upper half (cyclic Jacobi).
fn largest_eigenvector(mut a: [[f64; 4]; 4]) -> [f64; 4] {
    let mut v = [[0.0; 4]; 4];
    for i in 0..4 {
        v[i][i] = 1.0;
        for j in 0..i {
            a[i][j] = a[j][i];
        }
    }
    // Convergence is quadratic; five sweeps suffice in practice.
    for _ in 0..12 {
        let off: f64 = (0..4).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| a[i][j] * a[i][j]).sum();
        if off < 1e-34 {
            break;
        }
        for p in 0..3 {
            for q in p + 1..4 {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
                let c = t.hypot(1.0).recip();
                let s = t * c;
                for k in 0..4 {
                    let (first, second) = (a[k][p], a[k][q]);
                    a[k][p] = c * first - s * second;
                    a[k][q] = s * first + c * second;
                }
                for k in 0..4 {
                    let (first, second) = (a[p][k], a[q][k]);
                    a[p][k] = c * first - s * second;
                    a[q][k] = s * first + c * second;
                }
                for row in &mut v {
                    let (first, second) = (row[p], row[q]);
                    row[p] = c * first - s * second;
                    row[q] = s * first + c * second;
                }
            }
        }
    }
    let largest = (1..4).fold(0, |best, i| if a[i][i] > a[best][best] { i } else { best });
    v.map(|row| row[largest])
}

/// `M = R S` with a rotation `R`, the nearest one, and symmetric `S = Rᵀ M`.
pub fn polar_decomposition(m: Mat3) -> (Mat3, Mat3) {
    let r = nearest_rotation(m);
    let s = r.transpose() * m;
    (r, 0.5 * (s + s.transpose()))
}

/// The rotation that turns direction `from` into direction `to` the shortest way; the identity if either is zero.
///
/// For opposite directions it turns by π about some axis across them.
pub fn rotation_between(from: Vec3, to: Vec3) -> Mat3 {
    match (from.try_normalize(), to.try_normalize()) {
        (Some(from), Some(to)) => Mat3::from_quat(Quat::from_rotation_arc(from, to)),
        _ => Mat3::IDENTITY,
    }
}

/// Splits a rotation into `swing · twist`: the twist turns about the unit vector `axis`, the swing across it.
///
/// Where the swing is by π the twist is not determined; then it is the identity.
pub fn swing_twist(rotation: Quat, axis: Vec3) -> (Quat, Quat) {
    let along = Vec3::new(rotation.x, rotation.y, rotation.z).dot(axis);
    let twist = Quat::from_xyzw(along * axis.x, along * axis.y, along * axis.z, rotation.w);
    let length = twist.length();
    let twist = if length < 1e-12 { Quat::IDENTITY } else { twist / length };
    (rotation * twist.inverse(), twist)
}

/// The mean of rotations in the least-squares sense of their matrices; the identity if there are none.
pub fn mean_rotation(rotations: &[Mat3]) -> Mat3 {
    let sum = rotations.iter().fold(Mat3::ZERO, |sum, &rotation| sum + rotation);
    nearest_rotation(sum)
}

/// The rigid motion `(R, t)` that minimises `sum |R source_i + t - target_i|²` (Horn 1987); identity without points.
pub fn align_rigid(source: &[Vec3], target: &[Vec3]) -> (Mat3, Vec3) {
    let (from, to) = (crate::centroid(source), crate::centroid(target));
    let mut covariance = Mat3::ZERO;
    for (&a, &b) in source.iter().zip(target) {
        let (a, b) = (a - from, b - to);
        covariance += Mat3::from_cols(a.x * b, a.y * b, a.z * b);
    }
    let rotation = nearest_rotation(covariance);
    (rotation, to - rotation * from)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::{
        align_rigid, angle_between, nearest_rotation, polar_decomposition, quat_from_vector, rotation_between,
        rotation_from_vector, swing_twist, vector_from_quat, vector_from_rotation,
    };
    use crate::{Mat3, Quat, Rng, Vec3, normal, seeded_rng, thin_svd};

    fn random_vector(rng: &mut Rng) -> Vec3 {
        Vec3::new(normal(rng), normal(rng), normal(rng))
    }

    #[test]
    fn logarithm_undoes_the_exponential_at_every_angle() {
        let mut rng = seeded_rng(1);
        for angle in [0.0, 1e-300, 1e-12, 1e-8, 1e-5, 1e-4, 1e-3, 0.1, 1.0, 3.0, PI - 1e-4, PI - 1e-8, PI - 1e-12] {
            for _ in 0..20 {
                let v = angle * random_vector(&mut rng).normalize();
                let r = rotation_from_vector(v);
                assert!((r.transpose() * r).abs_diff_eq(Mat3::IDENTITY, 1e-14));
                assert!((r.determinant() - 1.0).abs() < 1e-14);
                assert!(vector_from_rotation(r).distance(v) < 1e-14 + 2e-12 * angle, "{angle}");
                assert!(vector_from_quat(quat_from_vector(v)).distance(v) < 1e-14 * (1.0 + angle), "{angle}");
                assert!(Mat3::from_quat(quat_from_vector(v)).abs_diff_eq(r, 1e-14));
            }
        }
    }

    #[test]
    fn at_a_half_turn_either_axis_is_right() {
        let axis = Vec3::new(2.0, -1.0, 0.5).normalize();
        let r = Mat3::from_axis_angle(axis, PI);
        let v = vector_from_rotation(r);
        assert!((v.length() - PI).abs() < 1e-12);
        assert!(rotation_from_vector(v).abs_diff_eq(r, 1e-12));
    }

    #[test]
    fn the_derivative_of_the_exponential_at_zero_is_the_cross_product() {
        let (v, x, h) = (Vec3::new(0.3, -0.2, 0.9), Vec3::new(1.0, 2.0, 3.0), 1e-6);
        let difference = (rotation_from_vector(h * v) * x - rotation_from_vector(-h * v) * x) / (2.0 * h);
        assert!(difference.distance(v.cross(x)) < 1e-9);
    }

    #[test]
    fn nearest_rotation_agrees_with_the_singular_value_decomposition() {
        let mut rng = seeded_rng(2);
        for _ in 0..200 {
            let columns = [0, 1, 2].map(|_| random_vector(&mut rng));
            let m = Mat3::from_cols_array_2d(&columns.map(|column| column.to_array()));
            let rows = [0, 1, 2].map(|i| m.row(i).to_array());
            let svd = thin_svd(&crate::Matrix::from_rows(&rows)).unwrap();
            let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
            let product = svd.u.matmul(&crate::Matrix::from_diagonal(&[1.0, 1.0, sign])).matmul(&svd.v.transpose());
            let r = nearest_rotation(m);
            assert!((r.determinant() - 1.0).abs() < 1e-12);
            for i in 0..3 {
                for j in 0..3 {
                    assert!((r.row(i)[j] - product[(i, j)]).abs() < 1e-7, "{m}");
                }
            }
        }
    }

    #[test]
    fn degenerate_matrices_still_give_rotations() {
        let flat = Mat3::from_cols(Vec3::X, Vec3::Y, Vec3::ZERO);
        assert!(nearest_rotation(flat).abs_diff_eq(Mat3::IDENTITY, 1e-12));
        let line = Mat3::from_cols(Vec3::new(0.0, 2.0, 0.0), Vec3::ZERO, Vec3::ZERO);
        assert!((nearest_rotation(line) * Vec3::X).distance(Vec3::Y) < 1e-12);
        for m in [Mat3::ZERO, Mat3::NAN] {
            assert_eq!(nearest_rotation(m), Mat3::IDENTITY);
        }
        let tiny = 1e-200 * rotation_from_vector(Vec3::new(0.1, 0.2, 0.3));
        assert!(nearest_rotation(tiny).abs_diff_eq(rotation_from_vector(Vec3::new(0.1, 0.2, 0.3)), 1e-12));
    }

    #[test]
    fn polar_decomposition_gives_rotation_and_stretch_back() {
        let rotation = rotation_from_vector(Vec3::new(0.7, -1.1, 2.0));
        let stretch = Mat3::from_cols_array(&[2.0, 0.1, 0.2, 0.1, 1.0, -0.3, 0.2, -0.3, 0.5]);
        let (r, s) = polar_decomposition(rotation * stretch);
        assert!(r.abs_diff_eq(rotation, 1e-12) && s.abs_diff_eq(stretch, 1e-12));
    }

    #[test]
    fn rotation_between_turns_one_direction_into_the_other() {
        let mut rng = seeded_rng(3);
        for _ in 0..100 {
            let (from, to) = (random_vector(&mut rng), random_vector(&mut rng));
            let r = rotation_between(from, to);
            assert!((r * from.normalize()).distance(to.normalize()) < 1e-12);
            assert!((angle_between(Mat3::IDENTITY, r) - from.angle_between(to)).abs() < 1e-7);
        }
        assert!((rotation_between(Vec3::X, -Vec3::X) * Vec3::X).distance(-Vec3::X) < 1e-12);
        assert_eq!(rotation_between(Vec3::ZERO, Vec3::X), Mat3::IDENTITY);
    }

    #[test]
    fn swing_and_twist_make_up_the_rotation() {
        let mut rng = seeded_rng(4);
        for _ in 0..100 {
            let (rotation, axis) = (quat_from_vector(random_vector(&mut rng)), random_vector(&mut rng).normalize());
            let (swing, twist) = swing_twist(rotation, axis);
            assert!((swing * twist).abs_diff_eq(rotation, 1e-12));
            assert!((twist * axis).distance(axis) < 1e-12);
            assert!(Vec3::new(swing.x, swing.y, swing.z).dot(axis).abs() < 1e-12);
        }
        let (_, twist) = swing_twist(Quat::from_axis_angle(Vec3::X, PI), Vec3::Y);
        assert!(twist.is_finite());
    }

    #[test]
    fn alignment_finds_a_rigid_motion() {
        let mut rng = seeded_rng(5);
        let source: Vec<Vec3> = (0..10).map(|_| random_vector(&mut rng)).collect();
        let (rotation, shift) = (rotation_from_vector(Vec3::new(2.0, 1.0, -1.0)), Vec3::new(3.0, 4.0, 5.0));
        let target: Vec<Vec3> = source.iter().map(|&p| rotation * p + shift).collect();
        let (r, t) = align_rigid(&source, &target);
        assert!(r.abs_diff_eq(rotation, 1e-12) && t.distance(shift) < 1e-12);
    }
}
