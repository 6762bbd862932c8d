//! Points that are linear in a few coefficients, and what they may not pass.

use modiste_core::{Matrix, QuantisedBasis, Vec3};
use rayon::prelude::*;

use crate::HairError;
use crate::surface::Surface;

/// How far the surface is looked for around a point (m): hair that the model has put deepest into a shoulder must find it.
const REACH: f64 = 0.12;

/// Some points of a sequence as linear functions of its coefficients: `p_i(y) = Q_i y + μ_i`.
///
/// Roots, where there are any, are points that should be at known places.
#[derive(Debug, Clone)]
pub struct Subspace {
    count: usize,
    /// Index of each point in the whole.
    points: Vec<usize>,
    mean: Vec<Vec3>,
    /// Three rows of `count` numbers per point.
    rows: Vec<f32>,
    /// Index of each root in the whole, and its mean and rows.
    roots: Vec<usize>,
    root_mean: Vec<Vec3>,
    root_rows: Vec<f32>,
    /// `Σ Q_rᵀ Q_r` over the roots.
    root_gram: Matrix,
    /// Mean square length of the components over all points: 1, unless points were added between those that were learned.
    size: f64,
}

/// A point with the vertex of the surface nearest to it (the set C of the text).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correspondence {
    /// Place of the point among those of the subspace.
    pub point: usize,
    /// Where the vertex is (m), b_j.
    pub at: Vec3,
    /// Its unit normal, n.
    pub normal: Vec3,
}

impl Subspace {
    /// The points and roots with these indices of a basis with `mean` (three numbers a point).
    ///
    /// # Errors
    /// A basis and mean that do not agree, or an index beyond them.
    pub fn new(
        mean: &[f32],
        basis: &QuantisedBasis<i8>,
        points: Vec<usize>,
        roots: Vec<usize>,
    ) -> Result<Self, HairError> {
        let (n, count) = (basis.dimensions(), basis.count());
        if mean.len() != n || n % 3 != 0 {
            return Err(HairError::data("mean of the subspace", format!("{n} numbers, three a point"), mean.len()));
        }
        if let Some(&index) = points.iter().chain(&roots).find(|&&index| 3 * index >= n) {
            return Err(HairError::data("point of the subspace", format!("below {}", n / 3), index));
        }
        let gather = |points: &[usize]| {
            let at = |i: usize| Vec3::new(f64::from(mean[i]), f64::from(mean[i + 1]), f64::from(mean[i + 2]));
            let mean: Vec<Vec3> = points.iter().map(|&point| at(3 * point)).collect();
            let mut rows = Vec::with_capacity(3 * points.len() * count);
            for &point in points {
                for axis in 0..3 {
                    let place = 3 * point + axis;
                    rows.extend((0..count).map(|k| basis.scales()[k] * f32::from(basis.values()[k * n + place])));
                }
            }
            (mean, rows)
        };
        let square = |row: &[i8]| row.iter().map(|&q| f64::from(q).powi(2)).sum::<f64>();
        let squares = basis.values().chunks_exact(n.max(1)).zip(basis.scales());
        let size =
            squares.map(|(row, &scale)| f64::from(scale).powi(2) * square(row)).sum::<f64>() / count.max(1) as f64;
        let (point_mean, rows) = gather(&points);
        let (root_mean, root_rows) = gather(&roots);
        let mut root_gram = Matrix::zeros(count, count);
        for row in root_rows.chunks_exact(count.max(1)) {
            add_outer(&mut root_gram, row, 1.0);
        }
        Ok(Self { count, points, mean: point_mean, rows, roots, root_mean, root_rows, root_gram, size })
    }

    /// Number of coefficients.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Number of points.
    pub fn point_count(&self) -> usize {
        self.points.len()
    }

    /// Index in the whole of each root.
    pub fn roots(&self) -> &[usize] {
        &self.roots
    }

    /// Where a point is (m).
    pub fn position(&self, point: usize, y: &[f64]) -> Vec3 {
        self.mean[point] + self.product(&self.rows, point, y)
    }

    fn product(&self, rows: &[f32], point: usize, y: &[f64]) -> Vec3 {
        let rows = &rows[3 * point * self.count..][..3 * self.count];
        let (x, rest) = rows.split_at(self.count);
        let (v, z) = rest.split_at(self.count);
        let mut sums = [0.0; 3];
        for k in 0..self.count {
            sums[0] += f64::from(x[k]) * y[k];
            sums[1] += f64::from(v[k]) * y[k];
            sums[2] += f64::from(z[k]) * y[k];
        }
        Vec3::from_array(sums)
    }

    /// `Q_iᵀ n`: how the distance of a point along a normal follows from the coefficients.
    pub(super) fn along(&self, point: usize, normal: Vec3, out: &mut [f64]) {
        let rows = &self.rows[3 * point * self.count..][..3 * self.count];
        let (x, rest) = rows.split_at(self.count);
        let (y, z) = rest.split_at(self.count);
        for (k, value) in out.iter_mut().enumerate() {
            *value = normal.x * f64::from(x[k]) + normal.y * f64::from(y[k]) + normal.z * f64::from(z[k]);
        }
    }

    /// Mean square length of the components over all points, by which distances of coefficients are those of points.
    pub(super) fn size(&self) -> f64 {
        self.size
    }

    /// Where all points are (m).
    pub fn positions(&self, y: &[f64]) -> Vec<Vec3> {
        (0..self.points.len()).into_par_iter().with_min_len(64).map(|point| self.position(point, y)).collect()
    }

    /// The nearest vertex of a surface to each point that is near it, at coefficients `y`.
    pub fn correspondences(&self, y: &[f64], surface: &Surface) -> Vec<Correspondence> {
        self.nearest_vertices(&self.positions(y), surface, |_| Some(u32::MAX))
    }

    /// The same for points at known places (m), of those that `likely` gives a face to try first for.
    ///
    /// Found as the nearest corner of the nearest face, which is exact but for needles of faces. Points that look past the
    /// rim of the surface have none.
    pub(crate) fn nearest_vertices(
        &self,
        positions: &[Vec3],
        surface: &Surface,
        likely: impl Fn(Vec3) -> Option<u32> + Sync,
    ) -> Vec<Correspondence> {
        positions
            .par_iter()
            .enumerate()
            .with_min_len(64)
            .filter_map(|(point, &p)| {
                let (vertex, normal) = surface.nearest_vertex(p, REACH, likely(p)?)?;
                Some(Correspondence { point, at: surface.vertices()[vertex as usize], normal })
            })
            .collect()
    }

    /// `s(y)` of eq. 31 as its matrix and, for these places of the roots (m), its right-hand side.
    pub(super) fn root_terms(&self, places: &[Vec3]) -> (&Matrix, Vec<f64>) {
        let mut right = vec![0.0; self.count];
        for (root, place) in places.iter().enumerate().take(self.roots.len()) {
            let off = (*place - self.root_mean[root]).to_array();
            let rows = &self.root_rows[3 * root * self.count..][..3 * self.count];
            for axis in 0..3 {
                for k in 0..self.count {
                    right[k] += off[axis] * f64::from(rows[axis * self.count + k]);
                }
            }
        }
        (&self.root_gram, right)
    }

    /// `s(y)`: squared distances of the roots from their places, and its gradient is added to `gradient` times `weight`.
    pub(super) fn root_error(&self, y: &[f64], places: &[Vec3], weight: f64, gradient: &mut [f64]) -> f64 {
        let mut sum = 0.0;
        for (root, place) in places.iter().enumerate().take(self.roots.len()) {
            let off = self.root_mean[root] + self.product(&self.root_rows, root, y) - *place;
            sum += off.length_squared();
            let rows = &self.root_rows[3 * root * self.count..][..3 * self.count];
            for (axis, off) in off.to_array().into_iter().enumerate() {
                for k in 0..self.count {
                    gradient[k] += 2.0 * weight * off * f64::from(rows[axis * self.count + k]);
                }
            }
        }
        sum
    }
}

/// Adds `weight * v vᵀ` to the lower triangle and the diagonal.
fn add_outer(matrix: &mut Matrix, v: &[f32], weight: f64) {
    for i in 0..v.len() {
        let scaled = weight * f64::from(v[i]);
        for (entry, &other) in matrix.row_mut(i)[..=i].iter_mut().zip(v) {
            *entry += scaled * f64::from(other);
        }
    }
}
