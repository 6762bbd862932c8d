//! Bases of deformation gradients, stored as moves of the vertices.

use modiste_core::{GradientReconstruction, SolveError};
use modiste_core::{Mat3, Matrix, QuantisedBasis, Topology, Vec3, corners, symmetric_eigen};
use rayon::prelude::*;

use super::gradient::{PER_FACE, TangentFrames};

/// Components of deformation gradients (flat rows of [`TangentFrames`]) in a quarter of their numbers.
///
/// The gradients of DRAPE are those of a mesh, up to what the rotation of the parts puts between them; so a component is
/// stored as the move of the vertices whose gradients come nearest to it, three numbers a vertex where the paper has nine a
/// face. What no move has (where limbs bend, `Q = Rᵀ A` is not the gradient of anything) is the same few patterns in all
/// components: these are stored as gradients, and how much of each a component has.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GradientBasis {
    faces: Vec<FaceInverse>,
    still: Vec<f32>,
    moves: QuantisedBasis<i8>,
    /// One row per component, one column per pattern of `rest`.
    mixing: Matrix,
    rest: QuantisedBasis<i8>,
}

/// From the moves of a face's corners to the change of its gradient along the two vectors of its tangent frame.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FaceInverse {
    vertices: [u32; 3],
    /// One over the length of the first edge (1/m); zero for a face without area, whose gradient is the identity.
    along: f32,
    /// How far the second edge leans along the first, over its height: taken off for the second vector.
    lean: f32,
    /// One over the height of the face on its first edge (1/m).
    up: f32,
}

/// Memory that expanding needs.
#[derive(Debug, Clone, Default)]
pub(crate) struct BasisScratch {
    moves: Vec<f32>,
    rest: Vec<f64>,
}

impl GradientBasis {
    /// Stores `count` rows of gradients. The components vary by `std_devs`; `patterns` is how many of those that no move has
    /// are kept.
    pub(crate) fn new(
        (topology, template): (&Topology, &[Vec3]),
        rows: &[f32],
        std_devs: &[f64],
        patterns: usize,
    ) -> Result<Self, SolveError> {
        let faces = face_inverses(topology, template);
        let reconstruction = GradientReconstruction::new(topology, template)?;
        let frames = TangentFrames::new(topology, template);
        let width = PER_FACE * topology.face_count();
        let moves: Vec<Vec<f32>> = rows
            .par_chunks(width.max(1))
            .map(|row| {
                let gradients: Vec<Mat3> = frames.in_plane(row);
                let mut moves = vec![Vec3::ZERO; template.len()];
                reconstruction.reconstruct(&gradients, &mut moves);
                moves.iter().flat_map(|x| x.as_vec3().to_array()).collect()
            })
            .collect();
        let moves = QuantisedBasis::from_f32(&moves.concat(), std_devs.len(), 3 * template.len())?;
        let still = vec![0.0; 3 * template.len()];
        let mut basis =
            Self { faces, still, moves, mixing: Matrix::zeros(std_devs.len(), 0), rest: QuantisedBasis::default() };
        basis.add_rest(rows, std_devs, patterns)?;
        Ok(basis)
    }

    /// Finds the patterns of what the moves leave of the rows: the principal components of the remainders, each as large as its
    /// component varies.
    fn add_rest(&mut self, rows: &[f32], std_devs: &[f64], patterns: usize) -> Result<(), SolveError> {
        let (count, width) = (std_devs.len(), PER_FACE * self.faces.len());
        let patterns = patterns.min(count);
        let mut left = self.to_f32();
        left.par_iter_mut().zip(rows).for_each(|(made, wanted)| *made = wanted - *made);
        let row = |k: usize| &left[k * width..(k + 1) * width];
        let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(&a, &b)| f64::from(a) * f64::from(b)).sum::<f64>();
        let lower: Vec<Vec<f64>> =
            (0..count).into_par_iter().map(|i| (0..=i).map(|j| dot(row(i), row(j))).collect()).collect();
        let gram = Matrix::from_fn(count, count, |i, j| std_devs[i] * std_devs[j] * lower[i.max(j)][i.min(j)]);
        let (values, vectors) = symmetric_eigen(&gram)?;
        let kept = values.iter().take(patterns).take_while(|&&value| value > 1e-12 * values[0].max(0.0)).count();
        let mut rest = vec![0.0f32; kept * width];
        for (k, pattern) in rest.chunks_mut(width.max(1)).enumerate() {
            for i in 0..count {
                let share = (vectors[(i, k)] * std_devs[i] / values[k].sqrt()) as f32;
                pattern.iter_mut().zip(row(i)).for_each(|(sum, &value)| *sum += share * value);
            }
        }
        self.mixing = Matrix::from_fn(count, kept, |i, k| dot(row(i), &rest[k * width..(k + 1) * width]));
        self.rest = QuantisedBasis::from_f32(&rest, kept, width)?;
        Ok(())
    }

    /// Puts stored parts together.
    pub(crate) fn from_parts(
        (topology, template): (&Topology, &[Vec3]),
        moves: QuantisedBasis<i8>,
        mixing: Matrix,
        rest: QuantisedBasis<i8>,
    ) -> Self {
        Self { faces: face_inverses(topology, template), still: vec![0.0; moves.dimensions()], moves, mixing, rest }
    }

    /// Number of components.
    pub(crate) fn count(&self) -> usize {
        self.moves.count()
    }

    /// The moves of the vertices (m), one row per component.
    pub(crate) fn moves(&self) -> &QuantisedBasis<i8> {
        &self.moves
    }

    /// How much of each pattern that no move has is in each component.
    pub(crate) fn mixing(&self) -> &Matrix {
        &self.mixing
    }

    /// The patterns that no move has, as gradients.
    pub(crate) fn rest(&self) -> &QuantisedBasis<i8> {
        &self.rest
    }

    /// Writes `mean + sum_k c_k basis_k` as a flat row; missing coefficients are 0.
    pub(crate) fn expand(&self, mean: &[f32], coefficients: &[f64], scratch: &mut BasisScratch, out: &mut [f32]) {
        scratch.moves.resize(self.still.len(), 0.0);
        scratch.rest.clear();
        scratch.rest.resize(self.rest.count(), 0.0);
        for (row, &coefficient) in coefficients.iter().take(self.count()).enumerate() {
            let shares = scratch.rest.iter_mut().zip(self.mixing.row(row));
            shares.for_each(|(sum, share)| *sum += coefficient * share);
        }
        if self.rest.count() == 0 {
            out.copy_from_slice(mean);
        } else {
            self.rest.expand(mean, &scratch.rest, out);
        }
        self.moves.expand(&self.still, coefficients, &mut scratch.moves);
        self.add_gradients(&scratch.moves, out);
    }

    /// Adds the gradients of moves (m) to a flat row.
    fn add_gradients(&self, moves: &[f32], out: &mut [f32]) {
        let moves = moves.as_chunks::<3>().0;
        for (face, out) in self.faces.iter().zip(out.as_chunks_mut::<PER_FACE>().0) {
            let [a, b, c] = face.vertices.map(|vertex| &moves[vertex as usize]);
            for axis in 0..3 {
                let first = b[axis] - a[axis];
                out[axis] += face.along * first;
                out[3 + axis] += face.up * (c[axis] - a[axis]) - face.lean * first;
            }
        }
    }

    /// All components as flat rows of gradients.
    pub(crate) fn to_f32(&self) -> Vec<f32> {
        let width = PER_FACE * self.faces.len();
        let mean = vec![0.0; width];
        let mut rows = vec![0.0f32; self.count() * width];
        rows.par_chunks_mut(width.max(1)).enumerate().for_each(|(k, row)| {
            let mut unit = vec![0.0; self.count()];
            unit[k] = 1.0;
            self.expand(&mean, &unit, &mut BasisScratch::default(), row);
        });
        rows
    }
}

/// The inverses of all faces.
fn face_inverses(topology: &Topology, template: &[Vec3]) -> Vec<FaceInverse> {
    let inverse = |&vertices: &[u32; 3]| {
        let [a, b, c] = corners(vertices, template);
        let (first, second) = (b - a, c - a);
        let length = first.length();
        let doubled = first.cross(second).length();
        let [along, lean, up] = if doubled > 0.0 {
            [1.0 / length, first.dot(second) / (length * doubled), length / doubled]
        } else {
            [0.0; 3]
        };
        FaceInverse { vertices, along: along as f32, lean: lean as f32, up: up as f32 }
    };
    topology.faces().iter().map(inverse).collect()
}

#[cfg(test)]
mod tests {
    use super::{BasisScratch, GradientBasis};
    use crate::drape::gradient::TangentFrames;
    use crate::drape::synthetic::{PELVIS, tube};
    use modiste_core::{Vec3, deformation_gradients, normal, seeded_rng};

    /// How far the rows that come back are from those that went in, over their size.
    fn loss(basis: &GradientBasis, rows: &[f32]) -> f64 {
        let square = |values: &mut dyn Iterator<Item = f32>| values.map(|x| f64::from(x) * f64::from(x)).sum::<f64>();
        let back = basis.to_f32();
        (square(&mut back.iter().zip(rows).map(|(a, b)| a - b)) / square(&mut rows.iter().copied())).sqrt()
    }

    #[test]
    fn gradients_of_meshes_are_moves_of_vertices() {
        let garment = tube("tube", 0.15, PELVIS);
        let mesh = (garment.topology.as_ref(), garment.template.as_slice());
        let frames = TangentFrames::new(mesh.0, mesh.1);
        let flat = |x: &[Vec3]| frames.flatten(&deformation_gradients(mesh.0, mesh.1, x));
        let rest = flat(&garment.template);
        let mut rng = seeded_rng(3);
        let mut moved = || -> Vec<f32> {
            let jitter = |x: &Vec3| *x + 0.01 * Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
            let x: Vec<Vec3> = garment.template.iter().map(jitter).collect();
            flat(&x).iter().zip(&rest).map(|(a, b)| a - b).collect()
        };
        let rows = [moved(), moved(), moved()].concat();
        let basis = GradientBasis::new(mesh, &rows, &[3.0, 2.0, 1.0], 0).unwrap();
        assert!(basis.rest().count() == 0 && loss(&basis, &rows) < 0.02, "{}", loss(&basis, &rows));
        // Expanding is the plain sum.
        let coefficients = [0.4, -1.2, 0.7];
        let mut made = vec![0.0; rest.len()];
        basis.expand(&rest, &coefficients, &mut BasisScratch::default(), &mut made);
        let back = basis.to_f32();
        for (at, made) in made.iter().enumerate() {
            let sum = (0..3).map(|k| coefficients[k] as f32 * back[k * rest.len() + at]).sum::<f32>();
            assert!((made - rest[at] - sum).abs() < 1e-4);
        }
    }

    #[test]
    fn what_no_mesh_has_is_kept_in_patterns() {
        let garment = tube("tube", 0.15, PELVIS);
        let mesh = (garment.topology.as_ref(), garment.template.as_slice());
        let width = 6 * garment.topology.face_count();
        let mut rng = seeded_rng(5);
        let rows: Vec<f32> = (0..4 * width).map(|_| normal(&mut rng) as f32).collect();
        let losses: Vec<f64> = [0, 2, 4]
            .map(|patterns| loss(&GradientBasis::new(mesh, &rows, &[1.0; 4], patterns).unwrap(), &rows))
            .to_vec();
        assert!(losses[0] > 0.3 && losses[1] < losses[0] && losses[2] < 0.02, "{losses:?}");
    }
}
