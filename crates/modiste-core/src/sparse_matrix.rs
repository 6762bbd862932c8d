//! Sparse matrices by compressed rows.

use crate::{SolveError, Vec3};

/// A sparse matrix by compressed rows; within a row the columns ascend and none repeats.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseMatrix {
    columns: usize,
    row_starts: Vec<usize>,
    column_indices: Vec<u32>,
    values: Vec<f64>,
}

impl SparseMatrix {
    /// Builds the matrix from `(row, column, value)`; values at the same place are added.
    ///
    /// # Errors
    /// An index outside the matrix, or a value that is not finite.
    pub fn from_triplets(rows: usize, columns: usize, triplets: &[(usize, usize, f64)]) -> Result<Self, SolveError> {
        let mut starts = vec![0usize; rows + 1];
        for (index, &(row, column, value)) in triplets.iter().enumerate() {
            if row >= rows || column >= columns {
                return Err(SolveError::IndexOutOfRange { row, column, rows, columns });
            }
            if !value.is_finite() {
                return Err(SolveError::NotFinite { what: "sparse matrix", index });
            }
            starts[row + 1] += 1;
        }
        for row in 0..rows {
            starts[row + 1] += starts[row];
        }
        let mut fill = starts.clone();
        let mut entries = vec![(0u32, 0.0); triplets.len()];
        for &(row, column, value) in triplets {
            entries[fill[row]] = (column as u32, value);
            fill[row] += 1;
        }
        let mut matrix = Self {
            columns,
            row_starts: Vec::with_capacity(rows + 1),
            column_indices: Vec::with_capacity(triplets.len()),
            values: Vec::with_capacity(triplets.len()),
        };
        matrix.row_starts.push(0);
        for row in 0..rows {
            let entries = &mut entries[starts[row]..starts[row + 1]];
            entries.sort_by_key(|&(column, _)| column);
            let row_start = matrix.values.len();
            for &(column, value) in entries.iter() {
                if matrix.values.len() > row_start && matrix.column_indices.last() == Some(&column) {
                    *matrix.values.last_mut().expect("the row has an entry") += value;
                } else {
                    matrix.column_indices.push(column);
                    matrix.values.push(value);
                }
            }
            matrix.row_starts.push(matrix.values.len());
        }
        Ok(matrix)
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.row_starts.len() - 1
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of stored entries.
    pub fn entry_count(&self) -> usize {
        self.values.len()
    }

    /// The `(column, value)` entries of one row, columns ascending.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.row_starts[row]..self.row_starts[row + 1];
        self.column_indices[range.clone()].iter().map(|&column| column as usize).zip(self.values[range].iter().copied())
    }

    /// All entries as `(row, column, value)`, row by row.
    pub fn triplets(&self) -> Vec<(usize, usize, f64)> {
        (0..self.rows()).flat_map(|row| self.row(row).map(move |(column, value)| (row, column, value))).collect()
    }

    /// `A x`.
    ///
    /// # Panics
    /// If `x` does not have one number per column.
    pub fn mul(&self, x: &[f64]) -> Vec<f64> {
        assert_eq!(x.len(), self.columns, "one number per column");
        (0..self.rows()).map(|row| self.row(row).map(|(column, value)| value * x[column]).sum()).collect()
    }

    /// `A x` for a column of points.
    ///
    /// # Panics
    /// If `x` does not have one point per column.
    pub fn mul_points(&self, x: &[Vec3]) -> Vec<Vec3> {
        assert_eq!(x.len(), self.columns, "one point per column");
        (0..self.rows()).map(|row| self.row(row).map(|(column, value)| value * x[column]).sum()).collect()
    }

    /// `Aᵀ`.
    pub fn transpose(&self) -> Self {
        let mut row_starts = vec![0usize; self.columns + 1];
        for &column in &self.column_indices {
            row_starts[column as usize + 1] += 1;
        }
        for column in 0..self.columns {
            row_starts[column + 1] += row_starts[column];
        }
        let mut fill = row_starts.clone();
        let mut column_indices = vec![0u32; self.values.len()];
        let mut values = vec![0.0; self.values.len()];
        for row in 0..self.rows() {
            for (column, value) in self.row(row) {
                column_indices[fill[column]] = row as u32;
                values[fill[column]] = value;
                fill[column] += 1;
            }
        }
        Self { columns: self.rows(), row_starts, column_indices, values }
    }

    /// `AᵀA` as triplets (both halves), the matrix of the normal equations; places may repeat.
    pub fn gram(&self) -> Vec<(usize, usize, f64)> {
        let mut triplets = Vec::new();
        for row in 0..self.rows() {
            for (i, a) in self.row(row) {
                triplets.extend(self.row(row).map(|(j, b)| (i, j, a * b)));
            }
        }
        triplets
    }
}

#[cfg(test)]
mod tests {
    use super::SparseMatrix;
    use crate::SolveError;

    fn example() -> SparseMatrix {
        SparseMatrix::from_triplets(2, 3, &[(1, 2, 4.0), (0, 0, 1.0), (1, 0, 3.0), (0, 0, 1.0), (0, 1, -1.0)]).unwrap()
    }

    #[test]
    fn repeated_places_are_added_and_columns_sorted() {
        let a = example();
        assert_eq!(a.triplets(), [(0, 0, 2.0), (0, 1, -1.0), (1, 0, 3.0), (1, 2, 4.0)]);
        assert_eq!(a.mul(&[1.0, 2.0, 3.0]), [0.0, 15.0]);
        assert_eq!(a.transpose().mul(&[1.0, 1.0]), [5.0, -1.0, 4.0]);
        assert_eq!(a.transpose().transpose(), a);
    }

    #[test]
    fn gram_is_the_transpose_times_the_matrix() {
        let a = example();
        let gram = SparseMatrix::from_triplets(3, 3, &a.gram()).unwrap();
        let x = [0.5, -2.0, 5.0];
        assert_eq!(gram.mul(&x), a.transpose().mul(&a.mul(&x)));
    }

    #[test]
    fn bad_entries_are_refused() {
        assert!(matches!(
            SparseMatrix::from_triplets(2, 2, &[(0, 2, 1.0)]),
            Err(SolveError::IndexOutOfRange { column: 2, .. })
        ));
        assert!(matches!(
            SparseMatrix::from_triplets(2, 2, &[(0, 1, f64::NAN)]),
            Err(SolveError::NotFinite { index: 0, .. })
        ));
    }
}
