//! What can go wrong with cloth, each with the value at fault.

/// Why a cloth model, a fabric or a simulation step was refused.
#[derive(Debug, thiserror::Error)]
pub enum ClothError {
    /// An array has the wrong number of items.
    #[error("{array}: {want} items wanted, {found} found")]
    Count {
        /// The array at fault.
        array: &'static str,
        /// How many items it should have.
        want: usize,
        /// How many it has.
        found: usize,
    },
    /// An index names something that does not exist.
    #[error("{array}: index {index} is out of range (there are {count})")]
    Index {
        /// The array that holds the index.
        array: &'static str,
        /// The index at fault.
        index: u32,
        /// How many things there are.
        count: usize,
    },
    /// A face has (almost) no area in panel space, or its corners run clockwise there.
    #[error(
        "face {face} has a rest area of {area:.3e} m² in panel space; counter-clockwise corners with positive area wanted"
    )]
    DegenerateFace {
        /// The face at fault.
        face: usize,
        /// Its signed rest area (m²).
        area: f64,
    },
    /// A number is outside its range or not finite.
    #[error("{field} = {found} is not {want}")]
    Value {
        /// The field at fault.
        field: &'static str,
        /// What would be right.
        want: &'static str,
        /// What was found.
        found: f64,
    },
    /// The simulation produced positions that are not finite.
    #[error("the simulation diverged: vertex {vertex} is not finite")]
    Diverged {
        /// The first vertex at fault.
        vertex: usize,
    },
}

/// Refuses an array with the wrong number of items.
pub(crate) fn check_count(array: &'static str, want: usize, found: usize) -> Result<(), ClothError> {
    if want == found { Ok(()) } else { Err(ClothError::Count { array, want, found }) }
}

/// Refuses an index that is out of range.
pub(crate) fn check_index(array: &'static str, index: u32, count: usize) -> Result<(), ClothError> {
    if (index as usize) < count { Ok(()) } else { Err(ClothError::Index { array, index, count }) }
}

/// Refuses a number that is not finite and positive.
pub(crate) fn check_positive(field: &'static str, found: f64) -> Result<(), ClothError> {
    if found.is_finite() && found > 0.0 {
        Ok(())
    } else {
        Err(ClothError::Value { field, want: "a positive number", found })
    }
}

/// Refuses a number that is negative or not finite.
pub(crate) fn check_not_negative(field: &'static str, found: f64) -> Result<(), ClothError> {
    if found.is_finite() && found >= 0.0 {
        Ok(())
    } else {
        Err(ClothError::Value { field, want: "zero or a positive number", found })
    }
}
