//! What can go wrong in a solve.

/// Why a numerical problem has no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SolveError {
    /// Sizes that must agree do not.
    #[error("{what}: wanted {wanted}, found {found}")]
    Size {
        /// Which size.
        what: &'static str,
        /// What it must be.
        wanted: usize,
        /// What it is.
        found: usize,
    },
    /// An index lies outside the matrix.
    #[error("entry ({row}, {column}) lies outside a {rows} x {columns} matrix")]
    IndexOutOfRange {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// Rows of the matrix.
        rows: usize,
        /// Columns of the matrix.
        columns: usize,
    },
    /// A Cholesky factorisation met a pivot that is not positive.
    #[error("the {size} x {size} matrix is not positive definite")]
    NotPositiveDefinite {
        /// Number of rows.
        size: usize,
    },
    /// Input holds an infinity or not-a-number.
    #[error("{what} holds a number that is not finite at index {index}")]
    NotFinite {
        /// Which input.
        what: &'static str,
        /// Where, in storage order.
        index: usize,
    },
    /// Input that must not be negative is.
    #[error("{what} holds a negative number at index {index}")]
    Negative {
        /// Which input.
        what: &'static str,
        /// Where, in storage order.
        index: usize,
    },
    /// There is nothing to solve.
    #[error("{what} is empty")]
    Empty {
        /// Which input.
        what: &'static str,
    },
    /// An iteration did not reach its tolerance.
    #[error("{what} did not converge{}", after(*iterations))]
    NoConvergence {
        /// Which iteration.
        what: &'static str,
        /// How many were made; 0 where the library does not say.
        iterations: usize,
    },
    /// Memory ran out.
    #[error("not enough memory for {what}")]
    OutOfMemory {
        /// For what.
        what: &'static str,
    },
}

/// How many iterations, for a message.
fn after(iterations: usize) -> String {
    if iterations == 0 { String::new() } else { format!(" in {iterations} iterations") }
}

/// Returns an error unless every value is finite.
pub(crate) fn check_finite<'a>(
    what: &'static str,
    values: impl IntoIterator<Item = &'a f64>,
) -> Result<(), SolveError> {
    match values.into_iter().position(|value| !value.is_finite()) {
        Some(index) => Err(SolveError::NotFinite { what, index }),
        None => Ok(()),
    }
}

/// Returns an error unless the two sizes agree.
pub(crate) fn check_size(what: &'static str, wanted: usize, found: usize) -> Result<(), SolveError> {
    if wanted == found { Ok(()) } else { Err(SolveError::Size { what, wanted, found }) }
}
