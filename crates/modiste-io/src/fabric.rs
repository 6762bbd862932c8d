//! Measured fabrics of Wang, Ramamoorthi and O'Brien (2011), as the ARCSim JSON files hold them.

use std::path::Path;

use serde::Deserialize;

use crate::{IoError, json, read_bytes};

/// A measured fabric, numbers as published.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct MeasuredFabric {
    /// Mass per area (kg/m²).
    pub density: f64,
    /// Stretching stiffness (N/m): one row per strain sample and direction, columns C11, C12, C22, C33.
    ///
    /// The fitted C12 (coupling) and C33 (shear) are below zero in places; a solver has to clamp them.
    pub stretching: [[f64; 4]; 6],
    /// Bending stiffness (N·m): rows for warp, bias and weft directions, columns for growing curvature.
    pub bending: [[f64; 5]; 3],
}

/// Reads a fabric.
///
/// # Errors
/// [`IoError`] naming the file and the field.
pub fn read(path: impl AsRef<Path>) -> Result<MeasuredFabric, IoError> {
    let path = path.as_ref();
    parse(&read_bytes(path)?, &path.display().to_string())
}

/// Reads from bytes; `name` stands for the file in errors.
///
/// # Errors
/// [`IoError`] naming the field: missing, of another size, or not a positive number.
pub fn parse(bytes: &[u8], name: &str) -> Result<MeasuredFabric, IoError> {
    let fabric: MeasuredFabric = json::parse(bytes, name)?;
    let positive = |field: &str, value: f64| {
        if value.is_finite() && value > 0.0 {
            return Ok(());
        }
        Err(IoError::field(name, field, "a number above 0", value))
    };
    positive("density", fabric.density)?;
    for (row, numbers) in fabric.stretching.iter().enumerate() {
        for (column, &value) in numbers.iter().enumerate() {
            if column == 0 || column == 2 {
                positive(&format!("stretching[{row}][{column}]"), value)?;
            } else if !value.is_finite() {
                return Err(IoError::field(name, format!("stretching[{row}][{column}]"), "a finite number", value));
            }
        }
    }
    for (row, numbers) in fabric.bending.iter().enumerate() {
        for (column, &value) in numbers.iter().enumerate() {
            positive(&format!("bending[{row}][{column}]"), value)?;
        }
    }
    Ok(fabric)
}

#[cfg(test)]
mod tests {
    use super::{parse, read};
    use crate::fuzz::survives_damage;

    const FABRIC: &str = r#"{"density": 0.22, "stretching": [[9,1,9,9],[9,1,9,9],[9,1,9,9],[9,1,9,9],[9,-1,9,9],[9,1,9,8]],
        "bending": [[1e-6,2e-6,3e-6,4e-6,5e-6],[1e-6,1e-6,1e-6,1e-6,1e-6],[1e-6,1e-6,1e-6,1e-6,7e-6]]}"#;

    #[test]
    fn tables_keep_their_order() {
        let fabric = parse(FABRIC.as_bytes(), "f.json").unwrap();
        assert_eq!(fabric.stretching.last(), Some(&[9.0, 1.0, 9.0, 8.0]));
        assert_eq!(fabric.bending[2].last(), Some(&7e-6));
    }

    #[test]
    fn errors_name_the_field() {
        let message =
            |from: &str, to: &str| parse(FABRIC.replacen(from, to, 1).as_bytes(), "f.json").unwrap_err().to_string();
        assert_eq!(message("0.22", "-1"), "f.json, density: wanted a number above 0, found -1");
        assert!(message("9,1,9,8", "9,1,0,8").contains("stretching[5][2]"));
        assert!(message("9,1,9,8", "9,1,9").contains("line 1"));
        assert!(message("bending", "banding").contains("bending"));
        assert!(message("7e-6", "7e999").contains("f.json"));
    }

    #[test]
    fn damage_never_panics() {
        survives_damage(FABRIC.as_bytes(), |bytes| drop(parse(bytes, "damaged.json")));
    }

    #[test]
    fn all_measured_fabrics_read() {
        let Some(folder) = crate::shared_data("materials") else { return };
        let paths = crate::list_folder(folder).unwrap();
        let fabrics = paths.iter().filter(|path| path.extension().is_some_and(|ending| ending == "json"));
        assert_eq!(fabrics.map(|path| read(path).unwrap()).filter(|fabric| fabric.density < 1.0).count(), 10);
    }
}
