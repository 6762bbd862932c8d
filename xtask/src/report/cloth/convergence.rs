//! What the length of the step and the size of the mesh do to a drape.

use anyhow::Result;
use modiste_cloth::Fabric;
use modiste_cloth::validate::{DrapeRun, convergence, drape};
use rayon::prelude::*;

use crate::report::page::{Page, rounded};

/// Rings of the disc: edges of 15, 7.5 and 3.75 mm.
const RINGS: [usize; 3] = [10, 20, 40];
/// Steps per frame; garments take the first.
const SUBSTEPS: [usize; 3] = [8, 16, 32];
/// Rings of the disc on which steps are halved.
const RINGS_OF_STEPS: usize = 10;

pub(crate) fn measure() -> Result<Page> {
    let mut page = Page::new("Convergence");
    page.paragraph(
        "The drape test of a disc of 30 cm over a plate of 18 cm with halved edges and with halved steps, every fabric as \
         garments are simulated: on a mesh too coarse for its folds it is stiffened until it is not. How deep \
         the rim hangs is held to shrinking differences; the shadow depends on how many folds there are, of which a disc has \
         several stable numbers, and jumps between them. And a square that swings \
         from two corners, after half a second, against a run with 160 steps a frame.",
    );
    let fabrics = [Fabric::denim(), Fabric::ponte(), Fabric::jersey()];
    let meshes = fabrics.iter().flat_map(|fabric| RINGS.map(|rings| (fabric, rings, SUBSTEPS[0])));
    let steps = fabrics.iter().flat_map(|fabric| SUBSTEPS[1..].iter().map(move |&n| (fabric, RINGS_OF_STEPS, n)));
    let asked: Vec<(&Fabric, usize, usize)> = meshes.chain(steps).collect();
    let runs = asked
        .par_iter()
        .with_max_len(1)
        .map(|&(fabric, rings, substeps)| Ok(drape(fabric, rings, substeps)?))
        .collect::<Result<Vec<DrapeRun>>>()?;
    let row = |run: &DrapeRun| {
        [
            run.fabric.clone(),
            rounded(1e3 * run.edge_length),
            run.substeps.to_string(),
            rounded(100.0 * run.coefficient),
            rounded(1e3 * run.drop),
            run.folds.to_string(),
        ]
    };
    let header =
        ["fabric", "edge (mm)", "steps per frame", "drape coefficient (%)", "rim below the plate (mm)", "folds"];
    page.table(&header, runs.iter().map(row));
    for fabric in &fabrics {
        let of = |rings: usize, substeps: usize| {
            let vertices = 1 + 3 * rings * (rings + 1);
            runs.iter().find(|run| run.fabric == fabric.name && run.vertices == vertices && run.substeps == substeps)
        };
        halved(&mut page, &format!("{}: halving the edges", fabric.name), &RINGS.map(|n| of(n, SUBSTEPS[0])));
        halved(&mut page, &format!("{}: halving the steps", fabric.name), &SUBSTEPS.map(|n| of(RINGS_OF_STEPS, n)));
    }
    page.figures("drapes", &runs)?;
    swing(&mut page)?;
    Ok(page)
}

/// Movement of the rim (mm) that needs not shrink further.
const SMALL: f64 = 0.5;

/// How much the rim of the drape moves with each halving; the second time it must be less, or next to nothing.
fn halved(page: &mut Page, what: &str, runs: &[Option<&DrapeRun>; 3]) {
    let [Some(a), Some(b), Some(c)] = runs else { return };
    let moved = |a: &DrapeRun, b: &DrapeRun| 1e3 * (b.drop - a.drop).abs();
    let (first, second) = (moved(a, b), moved(b, c));
    page.claim(
        &format!("{what} moves the rim of the drape less each time"),
        format!("the second time by less, or by at most {SMALL} mm"),
        format!("{} mm, then {} mm", rounded(first), rounded(second)),
        second < first || second <= SMALL,
    );
}

fn swing(page: &mut Page) -> Result<()> {
    let found = convergence()?;
    let rows = found.distances.iter().map(|(substeps, distance)| [substeps.to_string(), rounded(1e3 * distance)]);
    page.table(&["steps per frame", "a swinging square is off by (mm)"], rows);
    let ratios = found.distances.windows(2).map(|pair| pair[1].1 / pair[0].1);
    page.at_most("what halving the steps leaves of the error of a swing", ratios.fold(0.0, f64::max), 0.8, "");
    page.figures("swing", &found)
}
