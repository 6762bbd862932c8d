//! Computes `data/ansur2_statistics.json` from the public ANSUR II files: `ansur_statistics [folder]`, to standard
//! output.

use std::path::PathBuf;

use modiste_body::Gender;
use modiste_body::population::AnsurStatistics;

#[expect(clippy::print_stdout, reason = "the figures are what this program is for")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("../shared/data/bodies"), PathBuf::from);
    let mut genders = Vec::new();
    for gender in Gender::ALL {
        let table = modiste_io::ansur::read(folder.join(format!("ansur2_{}.csv.gz", gender.name())))?;
        genders.push(AnsurStatistics::of(&table)?);
    }
    println!("{}", AnsurStatistics::committed_text(&genders[0], &genders[1])?);
    Ok(())
}
