//! `modiste check`.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use modiste::check::Finding;
use modiste::{Check, Checked};

/// Check a dressed result: vertices inside the body, triangles that cross and how deep. Exit status 1 where the guarantee
/// does not hold.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  modiste check out/dress/dressed.npz --json")]
pub(crate) struct CheckArguments {
    /// The npz file: `body` (F, V, 3), `body_faces`, and the same for each garment, the innermost first.
    file: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl CheckArguments {
    pub(crate) fn job(&self) -> Check {
        Check { file: self.file.clone() }
    }
}

/// One line for each kind of finding.
pub(crate) fn text(checked: &Checked) -> String {
    let report = &checked.report;
    let mut text = format!("{} frames of {}", report.frames, checked.file.display());
    let mut line = |what: String, unit: &str, finding: &Finding| {
        let _always_ok = write!(text, "\n{what}: {} {unit}", finding.count);
        if let Some(frame) = finding.worst_frame {
            let frames = finding.frame_count();
            let _always_ok = write!(text, " in {frames} frames, deepest {:.2} mm in frame {frame}", finding.worst_mm);
        }
        if !finding.too_deep.is_empty() {
            let _always_ok = write!(text, "; too deep in frames {}", runs(&finding.too_deep));
        }
    };
    for found in &report.garments {
        let name = &found.garment;
        line(format!("{name} inside the body"), "vertices", &found.inside_body);
        line(format!("{name} pinched between parts of the body"), "vertices", &found.pinched);
        line(format!("{name} crossing the body"), "pairs of triangles", &found.crossing_body);
        line(format!("{name} crossing it where its parts are in each other"), "pairs of triangles", &found.caught);
        line(format!("{name} crossing itself"), "pairs of triangles", &found.crossing_itself);
    }
    for found in &report.layers {
        let pair = (&found.outer, &found.inner);
        line(format!("{} below {}", pair.0, pair.1), "vertices", &found.below);
        line(format!("{} crossing {}", pair.0, pair.1), "pairs of triangles", &found.crossing);
    }
    line("body in itself".to_owned(), "vertices", &report.body_in_itself);
    let limit = report.limits.crossing_mm;
    let verdict = if report.holds { "holds" } else { "does not hold" };
    let _always_ok = write!(
        text,
        "\nthe guarantee {verdict}: no vertex inside the body, nothing in the body or in a garment below by more than {limit} mm, but where parts of the body are in each other"
    );
    text
}

/// Runs of frames, the first few of them.
fn runs(runs: &[[usize; 2]]) -> String {
    const SHOWN: usize = 12;
    let name = |[first, last]: &[usize; 2]| if first == last { first.to_string() } else { format!("{first}-{last}") };
    let mut names: Vec<String> = runs.iter().take(SHOWN).map(name).collect();
    if runs.len() > SHOWN {
        names.push("…".to_owned());
    }
    names.join(", ")
}
