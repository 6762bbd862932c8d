//! Frames of a mesh as a base shape, morph targets and weights.

use modiste_core::{Matrix, Pca, SolveError, ridge};

use super::Options;

/// A base shape and what to add to it.
#[derive(Debug)]
pub(super) struct Morph {
    pub(super) base: Vec<[f32; 3]>,
    /// Unit normals that those of the targets are added to.
    pub(super) base_normals: Vec<[f32; 3]>,
    pub(super) targets: Vec<Target>,
    /// One row of weights per frame, one weight per target, within [0, 1].
    pub(super) weights: Vec<f32>,
}

impl Morph {
    /// The shape that the weights of a frame give.
    pub(super) fn shape(&self, frame: usize) -> Vec<[f32; 3]> {
        let mut shape = self.base.clone();
        let row = self.weights.iter().skip(frame * self.targets.len());
        for (target, weight) in self.targets.iter().zip(row) {
            for (x, d) in shape.as_flattened_mut().iter_mut().zip(target.positions.as_flattened()) {
                *x += weight * d;
            }
        }
        shape
    }
}

/// What a weight of 1 adds to positions (m) and normals.
#[derive(Debug)]
pub(super) struct Target {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
}

/// Keeps the normals' targets small where the weights can hardly tell them apart.
const NORMAL_RIDGE: f64 = 1e-4;
/// A base normal shorter than this has no direction.
const SHORTEST_NORMAL: f32 = 0.05;

/// What the shapes of a mesh are made of.
pub(super) struct Basis {
    /// `None` for a mesh at rest.
    pca: Option<Pca>,
    count: usize,
    rest: Vec<[f32; 3]>,
}

impl Basis {
    /// Learns from shapes from which the motion of the carrying nodes has been taken off.
    pub(super) fn learn(shapes: &[Vec<[f32; 3]>], options: Options) -> Result<Self, SolveError> {
        let rest = shapes[0].clone();
        if shapes.len() == 1 {
            return Ok(Self { pca: None, count: 0, rest });
        }
        let samples: Vec<&[f32]> = shapes.iter().map(|shape| shape.as_flattened()).collect();
        let pca = Pca::fit(&samples, options.max_targets)?;
        let coefficients: Vec<Vec<f64>> = samples.iter().map(|sample| pca.project(sample)).collect();
        let count = sufficient_count(&pca, &samples, &coefficients, options.tolerance);
        Ok(Self { pca: Some(pca), count, rest })
    }

    /// How much of each component a shape has.
    pub(super) fn coefficients(&self, shape: &[[f32; 3]]) -> Vec<f64> {
        let mut row = self.pca.as_ref().map_or_else(Vec::new, |pca| pca.project(shape.as_flattened()));
        row.truncate(self.count);
        row
    }

    /// The morph targets, from the coefficients of all frames, the first of them the base, and the unit normals of those
    /// that were chosen.
    pub(super) fn morph(
        self,
        coefficients: &[Vec<f64>],
        chosen: &[usize],
        normals: &[Vec<[f32; 3]>],
    ) -> Result<Morph, SolveError> {
        let Some(pca) = &self.pca else {
            let base_normals = normals[0].clone();
            return Ok(Morph { base: self.rest, base_normals, targets: Vec::new(), weights: Vec::new() });
        };
        let count = self.count;
        let mut base = vec![[0.0; 3]; self.rest.len()];
        // Weights count from the smallest of all frames and stay within [0, 1]: Blender cuts off what is outside.
        let extreme = |pick: fn(f64, f64) -> f64, k: usize| coefficients.iter().map(|row| row[k]).reduce(pick);
        let lows: Vec<f64> = (0..count).map(|k| extreme(f64::min, k).unwrap_or(0.0)).collect();
        let scales: Vec<f64> = (0..count)
            .map(|k| extreme(f64::max, k).unwrap_or(0.0) - lows[k])
            .map(|scale| if scale > 0.0 { scale } else { 1.0 })
            .collect();
        pca.expand(&lows, base.as_flattened_mut());
        let weights: Vec<f32> = coefficients
            .iter()
            .flat_map(|row| (0..count).map(|k| ((row[k] - lows[k]) / scales[k]).clamp(0.0, 1.0) as f32))
            .collect();
        let scaled = |k: usize| pca.component(k).iter().map(|&x| (f64::from(x) * scales[k]) as f32).collect();
        let positions: Vec<Vec<f32>> = (0..count).map(scaled).collect();
        let chosen_weights: Vec<f32> =
            chosen.iter().flat_map(|&frame| weights[frame * count..][..count].iter().copied()).collect();
        let mut normal_targets = fit_normals(normals, &chosen_weights, count)?;
        let base_normals = base_under(&normals[0], &chosen_weights[..count], &mut normal_targets);
        let targets = positions
            .into_iter()
            .zip(normal_targets)
            .map(|(positions, normals)| Target { positions: points(&positions), normals })
            .collect();
        Ok(Morph { base, base_normals, targets, weights })
    }
}

/// How many components bring every vertex of every frame within the tolerance, or all there are.
fn sufficient_count(pca: &Pca, samples: &[&[f32]], coefficients: &[Vec<f64>], tolerance: f64) -> usize {
    let mut residuals: Vec<Vec<f32>> =
        samples.iter().map(|sample| sample.iter().zip(&pca.mean).map(|(x, mean)| x - mean).collect()).collect();
    let worst = |residuals: &[Vec<f32>]| {
        let squares = residuals.iter().flat_map(|frame| frame.chunks_exact(3));
        squares.map(|r| r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).fold(0.0f32, f32::max).sqrt()
    };
    for count in 0..pca.count() {
        if f64::from(worst(&residuals)) <= tolerance {
            return count;
        }
        let component = pca.component(count);
        for (residual, row) in residuals.iter_mut().zip(coefficients) {
            let coefficient = row[count] as f32;
            for (r, b) in residual.iter_mut().zip(component) {
                *r -= coefficient * b;
            }
        }
    }
    pca.count()
}

/// The unit normals from which the targets at the weights of the first frame lead to its normals.
///
/// Viewers bring sums of normals to unit length, so each base normal and its targets may be scaled alike.
fn base_under(first: &[[f32; 3]], weights: &[f32], targets: &mut [Vec<[f32; 3]>]) -> Vec<[f32; 3]> {
    let mut base = first.to_vec();
    for (vertex, normal) in base.iter_mut().enumerate() {
        for (target, weight) in targets.iter().zip(weights) {
            *normal = std::array::from_fn(|axis| normal[axis] - weight * target[vertex][axis]);
        }
        let length = normal.iter().map(|x| x * x).sum::<f32>().sqrt();
        if length > SHORTEST_NORMAL {
            *normal = normal.map(|x| x / length);
            for target in targets.iter_mut() {
                target[vertex] = target[vertex].map(|x| x / length);
            }
        } else {
            *normal = first[vertex];
        }
    }
    base
}

/// The normal targets for which those of the first frame + Σ (weight - first weight) · target come closest to all (least
/// squares).
fn fit_normals(normals: &[Vec<[f32; 3]>], weights: &[f32], count: usize) -> Result<Vec<Vec<[f32; 3]>>, SolveError> {
    if count == 0 {
        return Ok(Vec::new());
    }
    let regressors =
        Matrix::from_fn(normals.len(), count, |frame, k| f64::from(weights[frame * count + k] - weights[k]));
    let base = normals[0].as_flattened();
    let mut wanted = Matrix::zeros(normals.len(), base.len());
    for (index, frame) in normals.iter().enumerate() {
        for (out, (normal, base)) in wanted.row_mut(index).iter_mut().zip(frame.as_flattened().iter().zip(base)) {
            *out = f64::from(normal - base);
        }
    }
    let fitted = ridge(&regressors, &wanted, NORMAL_RIDGE * normals.len() as f64)?;
    Ok((0..count).map(|k| points(&fitted.row(k).iter().map(|&x| x as f32).collect::<Vec<_>>())).collect())
}

fn points(flat: &[f32]) -> Vec<[f32; 3]> {
    flat.as_chunks::<3>().0.to_vec()
}

#[cfg(test)]
mod tests {
    use super::{Basis, Options};
    use crate::animated::normals;
    use modiste_core::shapes::icosphere;

    #[test]
    fn morphed_normals_follow_a_turn() {
        // A ball turning by 90°: two components carry positions and normals exactly.
        let ball = icosphere(2);
        let frames: Vec<Vec<[f32; 3]>> = (0..10)
            .map(|frame| {
                let turn = modiste_core::Mat3::from_rotation_y(f64::from(frame) * std::f64::consts::FRAC_PI_2 / 9.0);
                ball.vertices.iter().map(|v| (turn * *v).as_vec3().to_array()).collect()
            })
            .collect();
        let faces = ball.topology.faces();
        let turned: Vec<_> = frames.iter().map(|frame| normals(faces, frame)).collect();
        let basis = Basis::learn(&frames, Options { tolerance: 1e-4, max_targets: 9, max_bones: 0 }).unwrap();
        let coefficients: Vec<_> = frames.iter().map(|frame| basis.coefficients(frame)).collect();
        let chosen: Vec<usize> = (0..frames.len()).collect();
        let morph = basis.morph(&coefficients, &chosen, &turned).unwrap();
        assert_eq!(morph.targets.len(), 2);
        let count = morph.targets.len();
        for (index, normals) in turned.iter().enumerate() {
            for (vertex, wanted) in normals.iter().enumerate() {
                let shown: [f32; 3] = std::array::from_fn(|axis| {
                    let moved =
                        (0..count).map(|k| morph.weights[index * count + k] * morph.targets[k].normals[vertex][axis]);
                    morph.base_normals[vertex][axis] + moved.sum::<f32>()
                });
                let length = shown.iter().map(|x| x * x).sum::<f32>().sqrt();
                let cosine: f32 = (0..3).map(|axis| shown[axis] * wanted[axis]).sum::<f32>() / length;
                assert!(cosine > 0.9999, "frame {index}: {cosine}");
            }
        }
        let shown = morph.shape(9);
        assert!(shown.as_flattened().iter().zip(frames[9].as_flattened()).all(|(x, y)| (x - y).abs() < 1e-4));
    }
}
