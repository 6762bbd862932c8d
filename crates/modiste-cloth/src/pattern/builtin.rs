//! The patterns that ship with the program.

use modiste_body::Gender;

use super::{GradedPattern, PatternError};

/// Names of the garments that have a pattern, for women and for men.
pub const GARMENTS: [&str; 2] = ["tshirt", "shorts"];

/// The pattern of a garment for a gender; `None` where there is no such garment.
///
/// # Errors
/// [`PatternError`] if the text in the program is damaged.
pub fn builtin(garment: &str, gender: Gender) -> Option<Result<GradedPattern, PatternError>> {
    let (name, text) = match (garment, gender) {
        ("tshirt", Gender::Female) => ("female-tshirt", include_str!("../../patterns/female-tshirt.json")),
        ("tshirt", Gender::Male) => ("male-tshirt", include_str!("../../patterns/male-tshirt.json")),
        ("shorts", Gender::Female) => ("female-shorts", include_str!("../../patterns/female-shorts.json")),
        ("shorts", Gender::Male) => ("male-shorts", include_str!("../../patterns/male-shorts.json")),
        _ => return None,
    };
    Some(GradedPattern::from_json(name, text))
}

#[cfg(test)]
mod tests {
    use super::{GARMENTS, builtin};
    use crate::pattern::{draft_shorts, draft_tshirt};
    use modiste_body::Gender;

    /// The files are what the drafts give: `cargo run --release -p modiste-cloth --example draft_patterns`.
    #[test]
    fn the_files_are_the_drafts() {
        for gender in Gender::ALL {
            for garment in GARMENTS {
                let pattern = builtin(garment, gender).unwrap().unwrap();
                let draft = if garment == "tshirt" { draft_tshirt(gender) } else { draft_shorts(gender) };
                assert_eq!(pattern.to_json(), draft.to_json(), "{} {garment}", gender.name());
            }
        }
        assert!(builtin("cape", Gender::Male).is_none());
    }
}
