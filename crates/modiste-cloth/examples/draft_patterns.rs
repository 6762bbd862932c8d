//! Writes the project's patterns: `cargo run --release -p modiste-cloth --example draft_patterns -- DIR`.

use std::error::Error;
use std::path::PathBuf;

use modiste_body::Gender;
use modiste_cloth::pattern::{GARMENTS, draft};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("name the folder to write to")?);
    for gender in Gender::ALL {
        for pattern in GARMENTS.into_iter().filter_map(|garment| draft(garment, gender)) {
            pattern.check()?;
            let path = folder.join(format!("{}-{}.json", pattern.gender, pattern.garment));
            modiste_io::write_bytes(&path, pattern.to_json().as_bytes())?;
        }
    }
    Ok(())
}
