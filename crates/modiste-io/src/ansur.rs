//! ANSUR II anthropometry: one subject a row, 93 measurements each.

use std::collections::BTreeMap;
use std::path::Path;

use crate::error::quote;
use crate::{IoError, read_bytes};

/// A measured person.
#[derive(Debug, Clone, PartialEq)]
pub struct Subject {
    /// Subject number of the survey.
    pub id: u32,
    /// Measurements by the survey's column name: metres, except `weightkg` in kilograms.
    pub measurements: BTreeMap<String, f64>,
    /// Age (years).
    pub age: u32,
}

/// The other columns of the file: not measurements.
const NOT_MEASURED: [&str; 15] = [
    "subjectid",
    "gender",
    "date",
    "installation",
    "component",
    "branch",
    "primarymos",
    "subjectsbirthlocation",
    "subjectnumericrace",
    "ethnicity",
    "dodrace",
    "age",
    "heightin",
    "weightlbs",
    "writingpreference",
];

/// Number of measurements of each subject.
const MEASUREMENT_COUNT: usize = 93;

/// Reads the survey's CSV, plain or gzipped; it is in Latin-1 with lengths in millimetres and `weightkg` in 0.1 kg.
///
/// # Errors
/// [`IoError`] naming the file, the line and the column.
pub fn read(path: impl AsRef<Path>) -> Result<Vec<Subject>, IoError> {
    let path = path.as_ref();
    parse(&read_bytes(path)?, &path.display().to_string())
}

/// Reads from bytes; `name` stands for the file in errors.
///
/// # Errors
/// [`IoError`] naming the line and the column.
pub fn parse(bytes: &[u8], name: &str) -> Result<Vec<Subject>, IoError> {
    let text: String = bytes.iter().map(|&byte| char::from(byte)).collect(); // Latin-1 bytes are code points
    let mut rows = csv::Reader::from_reader(text.as_bytes());
    let broken = |error: csv::Error| {
        let line = error.position().map_or(1, csv::Position::line) as usize;
        IoError::line(name, line, "a table with as many cells in each row as in the first", error)
    };
    let header: Vec<String> =
        rows.headers().map_err(broken)?.iter().map(|cell| cell.trim().to_ascii_lowercase()).collect();
    let column = |wanted: &str| {
        let at = header.iter().position(|cell| cell == wanted);
        at.ok_or_else(|| IoError::field(name, format!("column \"{wanted}\""), "it to be there", "other columns"))
    };
    let (id_column, age_column) = (column("subjectid")?, column("age")?);
    column("weightkg")?;
    let measured: Vec<usize> = (0..header.len()).filter(|&at| !NOT_MEASURED.contains(&header[at].as_str())).collect();
    if measured.len() != MEASUREMENT_COUNT {
        return Err(IoError::line(name, 1, format!("{MEASUREMENT_COUNT} measurements"), measured.len()));
    }
    let mut subjects = Vec::new();
    for row in rows.records() {
        let row = row.map_err(broken)?;
        let line = row.position().map_or(0, csv::Position::line) as usize;
        let number = |at: usize| {
            let value: Option<f64> = row.get(at).and_then(|cell| cell.trim().parse().ok());
            value.filter(|value| value.is_finite() && *value > 0.0).ok_or_else(|| {
                let wanted = format!("a number above 0 in column \"{}\"", header[at]);
                IoError::line(name, line, wanted, quote(row.get(at).unwrap_or_default()))
            })
        };
        let measurement = |&at: &usize| {
            let units_per_stored = if header[at] == "weightkg" { 0.1 } else { 0.001 };
            Ok((header[at].clone(), number(at)? * units_per_stored))
        };
        let measurements = measured.iter().map(measurement).collect::<Result<_, IoError>>()?;
        subjects.push(Subject { id: number(id_column)? as u32, measurements, age: number(age_column)? as u32 });
    }
    if subjects.is_empty() {
        return Err(IoError::line(name, 2, "at least one subject", "none"));
    }
    Ok(subjects)
}

/// One measurement of all subjects, in order.
///
/// # Errors
/// [`IoError`] when there is no measurement of that name.
pub fn column(subjects: &[Subject], name: &str) -> Result<Vec<f64>, IoError> {
    let value = |subject: &Subject| subject.measurements.get(name).copied();
    subjects
        .iter()
        .map(value)
        .collect::<Option<Vec<f64>>>()
        .ok_or_else(|| IoError::field("ANSUR II", format!("measurement \"{name}\""), "it to be there", "none"))
}

#[cfg(test)]
mod tests {
    use super::{column, parse, read};
    use crate::fuzz::survives_damage;

    fn table() -> String {
        let names: Vec<String> = (0..92).map(|index| format!("length{index}")).collect();
        let row =
            |id: u32, stature: &str| format!("{id},{},{},Female,31,Cura\u{e7}ao\n", vec![stature; 92].join(","), 720);
        format!(
            "SubjectId,{},weightkg,Gender,Age,SubjectsBirthLocation\n{}{}",
            names.join(","),
            row(7, "1647"),
            row(8, "9")
        )
    }

    fn latin_1(text: &str) -> Vec<u8> {
        text.chars().map(|letter| letter as u8).collect()
    }

    #[test]
    fn millimetres_become_metres_and_tenths_kilograms() {
        let subjects = parse(&latin_1(&table()), "a.csv").unwrap();
        assert_eq!(subjects.len(), 2);
        assert_eq!((subjects[0].id, subjects[0].age), (7, 31));
        assert!((subjects[0].measurements["length5"] - 1.647).abs() < 1e-12);
        assert!((column(&subjects, "weightkg").unwrap()[1] - 72.0).abs() < 1e-12);
        assert!(column(&subjects, "hatsize").unwrap_err().to_string().contains("hatsize"));
    }

    #[test]
    fn errors_name_line_and_column() {
        let message = |text: String| parse(&latin_1(&text), "a.csv").unwrap_err().to_string();
        let wanted = "a.csv, line 2: wanted a number above 0 in column \"length0\", found \"x\"";
        assert_eq!(message(table().replacen("7,1647", "7,x", 1)), wanted);
        assert!(message(table().replacen("length3,", "", 1)).contains("line 1: wanted 93 measurements, found 92"));
        assert!(message(table().replacen("7,1647", "1647", 1)).contains("line 2: wanted a table"));
        assert!(message(table().replacen("SubjectId", "Who", 1)).contains("column \"subjectid\""));
        assert!(message(table().lines().next().unwrap().to_owned()).contains("at least one subject"));
        assert!(message(String::new()).contains("a.csv"));
    }

    #[test]
    fn damage_never_panics() {
        survives_damage(&latin_1(&table()), |bytes| drop(parse(bytes, "damaged.csv")));
    }

    #[test]
    fn the_survey_has_its_published_means() {
        let Some(folder) = crate::shared_data("bodies") else { return };
        // Means of ANSUR II, as in the data's README: count, stature (m), weight (kg).
        for (gender, count, stature, weight) in [("female", 1986, 1.629, 67.8), ("male", 4082, 1.756, 85.5)] {
            let subjects = read(folder.join(format!("ansur2_{gender}.csv.gz"))).unwrap();
            assert_eq!(subjects.len(), count);
            let mean = |name| column(&subjects, name).unwrap().iter().sum::<f64>() / count as f64;
            assert!((mean("stature") - stature).abs() < 0.001, "{}", mean("stature"));
            assert!((mean("weightkg") - weight).abs() < 0.1, "{}", mean("weightkg"));
        }
    }
}
