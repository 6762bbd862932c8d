//! The patterns that ship with the program.

use modiste_body::Gender;

use super::{GradedPattern, PatternError, draft_longsleeve, draft_pants, draft_shorts, draft_skirt, draft_tshirt};

/// Names of the garments that have a pattern, for women and for men.
pub const GARMENTS: [&str; 5] = ["tshirt", "longsleeve", "shorts", "pants", "skirt"];

/// The pattern of a garment for a gender; `None` where there is no such garment.
///
/// # Errors
/// [`PatternError`] if the text in the program is damaged.
pub fn builtin(garment: &str, gender: Gender) -> Option<Result<GradedPattern, PatternError>> {
    let name = format!("{}-{garment}", gender.name());
    let text = FILES.iter().find(|(file, _)| *file == name)?.1;
    Some(GradedPattern::from_json(&name, text))
}

/// As [`builtin`], for a name that somebody typed.
///
/// # Errors
/// [`PatternError::Unknown`] lists the names that there are.
pub fn known(garment: &str, gender: Gender) -> Result<GradedPattern, PatternError> {
    let unknown = || PatternError::Unknown { name: garment.to_owned(), known: GARMENTS.join(", ") };
    builtin(garment, gender).ok_or_else(unknown)?
}

/// Names the files of these garments, with their text.
macro_rules! files {
    ($($name:literal),*) => { [$(($name, include_str!(concat!("../../patterns/", $name, ".json")))),*] };
}

const FILES: [(&str, &str); 10] = files!(
    "female-tshirt",
    "female-longsleeve",
    "female-shorts",
    "female-pants",
    "female-skirt",
    "male-tshirt",
    "male-longsleeve",
    "male-shorts",
    "male-pants",
    "male-skirt"
);

/// The draft that the file of a garment is written from; `None` where there is no such garment.
pub fn draft(garment: &str, gender: Gender) -> Option<GradedPattern> {
    let draft = match garment {
        "tshirt" => draft_tshirt,
        "longsleeve" => draft_longsleeve,
        "shorts" => draft_shorts,
        "pants" => draft_pants,
        "skirt" => draft_skirt,
        _ => return None,
    };
    Some(draft(gender))
}

#[cfg(test)]
mod tests {
    use super::{GARMENTS, builtin, draft};
    use modiste_body::Gender;

    /// The files are what the drafts give: `cargo run --release -p modiste-cloth --example draft_patterns`.
    #[test]
    fn the_files_are_the_drafts() {
        for gender in Gender::ALL {
            for garment in GARMENTS {
                let pattern = builtin(garment, gender).unwrap().unwrap();
                assert_eq!(pattern.to_json(), draft(garment, gender).unwrap().to_json(), "{} {garment}", gender.name());
            }
        }
        assert!(builtin("cape", Gender::Male).is_none());
    }
}
