//! The rows of DRAPE table 1.

use anyhow::{Context, Result};
use modiste::{BenchDress, BenchRow, Resolution};

use crate::report::page::{Page, rounded};
use crate::shell::{cargo, output};

/// Outfits with a target: their garments from the inside out.
const DEMANDED: [&str; 2] = ["shorts+tshirt", "pants+longsleeve"];

pub(crate) fn measure() -> Result<Page> {
    let mut page = Page::new("The rows of DRAPE table 1");
    let rows = rows()?;
    let subdivided = rows.iter().any(|row| row.subdivided);
    page.paragraph(format!(
        "One character who walks, one frame at a time, from the pose in to the vertices out, body included. On two threads \
         garments are made while the body is posed; then synthesis is what is left to wait for. {}Start is the time from the \
         model files to the first frame. The paper's seconds are of Matlab on one core of 2012, at the vertices of the finer \
         rows.",
        if subdivided {
            "Garments marked * were not learned at the paper's resolution on this machine (`cargo xtask assets --paper`): they \
             are the built-in ones, subdivided to its numbers of vertices. "
        } else {
            ""
        }
    ));
    let header = [
        "outfit",
        "vertices",
        "threads",
        "body (ms)",
        "synthesis (ms)",
        "fit (ms)",
        "total (ms)",
        "95 % below (ms)",
        "start (ms)",
        "peak (MB)",
        "paper: synthesis, fit, total (s)",
        "times faster",
    ];
    page.table(&header, rows.iter().map(table_row));
    for row in rows.iter().filter(|row| DEMANDED.contains(&row.outfit.as_str())) {
        claims(&mut page, row);
    }
    let most = |of: fn(&BenchRow) -> f64| rows.iter().map(of).fold(0.0, f64::max);
    page.at_most("peak memory of any outfit", most(|row| row.peak_mb), 200.0, "MB");
    page.at_most("from the model files to the first frame, any outfit", most(|row| row.start_ms), 1000.0, "ms");
    page.figures("rows", &rows)?;
    Ok(page)
}

/// Every row by a program of its own, so that its memory is not that of those before it.
fn rows() -> Result<Vec<BenchRow>> {
    let mut rows = Vec::new();
    for resolution in ["built-in", "paper"] {
        for outfit in BenchDress::outfits() {
            for threads in ["1", "2"] {
                println!("  {outfit}, {resolution}, {threads} thread(s)");
                let words =
                    ["run", "--quiet", "--release", "--package", "modiste-cli", "--", "bench", "dress", "--json"];
                let choice = ["--outfit", &outfit, "--resolution", resolution, "--threads", threads];
                let printed = output(&mut cargo(&[&words[..], &choice[..]].concat()))?;
                let found: Vec<BenchRow> = serde_json::from_str(&printed).context("rows of the bench")?;
                rows.extend(found);
            }
        }
    }
    Ok(rows)
}

fn table_row(row: &BenchRow) -> Vec<String> {
    let times =
        [row.body_ms, row.synthesis_ms, row.fit_ms, row.total_ms_p50, row.total_ms_p95, row.start_ms, row.peak_mb];
    let paper = match row.resolution {
        Resolution::Paper => [row.paper_s.map(rounded).join(", "), rounded(1e3 * row.paper_s[2] / row.total_ms_p50)],
        Resolution::BuiltIn => ["–".to_owned(), "–".to_owned()],
    };
    let vertices = format!("{}{}", row.vertices, if row.subdivided { "*" } else { "" });
    let first = [row.outfit.clone(), vertices, row.threads.to_string()];
    first.into_iter().chain(times.map(rounded)).chain(paper).collect()
}

fn claims(page: &mut Page, row: &BenchRow) {
    let what = |what: &str| format!("{}, {} vertices, {} thread(s): {what}", row.outfit, row.vertices, row.threads);
    match (row.resolution, row.threads) {
        (Resolution::Paper, 2) => {
            page.at_most(&what("median of a frame"), row.total_ms_p50, 33.0, "ms");
            page.at_most(&what("95 % of the frames below"), row.total_ms_p95, 50.0, "ms");
        }
        (Resolution::Paper, 1) => page.at_most(&what("median of a frame"), row.total_ms_p50, 60.0, "ms"),
        (Resolution::BuiltIn, 2) => page.at_most(&what("median of a frame"), row.total_ms_p50, 12.0, "ms"),
        _ => {}
    }
}
