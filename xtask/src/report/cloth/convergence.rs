//! What the length of the step and the size of the mesh do to a drape.

use anyhow::Result;
use modiste_cloth::Fabric;
use modiste_cloth::validate::{DrapeOptions, convergence};

use super::discs::{DISCS, Discs, hang, with_error};
use crate::report::page::{Page, rounded};

/// Rings of the disc: edges of 15, 7.5 and 3.75 mm.
const RINGS: [usize; 3] = [10, 20, 40];
/// Steps per frame; garments take the first.
const SUBSTEPS: [usize; 3] = [8, 16, 32];
/// Rings of the disc on which steps are halved.
const RINGS_OF_STEPS: usize = 10;
/// Movement that needs not shrink further: of the rim (mm), and of the drape coefficient (%).
const SMALL: [f64; 2] = [0.5, 1.0];

pub(crate) fn measure() -> Result<Page> {
    let mut page = Page::new("Convergence");
    page.paragraph(format!(
        "The drape test of a disc of 30 cm over a plate of 18 cm with halved edges and with halved steps. A disc has several ways to \
         hang: which folds form is decided by a roughness of a tenth of a millimetre, as it is in the laboratory by how the \
         cloth is laid down, where the mean of several drapes is taken for that reason. So each row is the mean of {DISCS} discs \
         that differ in this roughness, with the standard error of that mean, and a halving is held to move the mean less than \
         the one before, or by no more than twice the standard error of the difference. All discs hang until nothing moves \
         by 2 mm/s, or for 20 seconds, and every step is solved to three digits: solved as loosely as in garments, fine meshes \
         come to a stop before they hang."
    ));
    page.paragraph(
        "The fabrics are as measured here, on every mesh. In garments a fabric is stiffened where its mesh is too coarse for its folds, \
         and slackened against compression; both end as the mesh gets finer, so that this moves the drape by design. The last \
         rows show by how much, at the edges of garments.",
    );
    let fabrics = [Fabric::denim(), Fabric::ponte(), Fabric::jersey()];
    let of = |rings, substeps, resolved| DrapeOptions { rings, substeps, resolved, seed: 0 };
    let meshes = RINGS.map(|rings| of(rings, SUBSTEPS[0], false));
    let steps = SUBSTEPS.map(|substeps| of(RINGS_OF_STEPS, substeps, false));
    let kinds = [&meshes[..], &steps[1..], &[of(RINGS[0], SUBSTEPS[0], true)]].concat();
    let asked: Vec<(&Fabric, DrapeOptions)> =
        kinds.iter().flat_map(|&kind| fabrics.iter().map(move |fabric| (fabric, kind))).collect();
    let discs = asked.iter().map(|(fabric, options)| hang(fabric, *options)).collect::<Result<Vec<Discs>>>()?;
    let header = [
        "fabric",
        "as in garments",
        "edge (mm)",
        "steps per frame",
        "drape coefficient (%)",
        "rim below the plate (mm)",
        "folds",
        "at rest",
    ];
    page.table(&header, discs.iter().map(row));
    for fabric in &fabrics {
        let found = |options: &DrapeOptions| discs.iter().find(|d| d.fabric == fabric.name && d.options == *options);
        halved(&mut page, &format!("{}: halving the edges", fabric.name), &meshes.each_ref().map(found));
        halved(&mut page, &format!("{}: halving the steps", fabric.name), &steps.each_ref().map(found));
    }
    page.figures("drapes", &discs)?;
    swing(&mut page)?;
    Ok(page)
}

fn row(discs: &Discs) -> [String; 8] {
    [
        discs.fabric.clone(),
        if discs.options.resolved { "yes" } else { "no" }.to_owned(),
        rounded(1e3 * discs.runs[0].edge_length),
        discs.options.substeps.to_string(),
        with_error(discs.coefficient),
        with_error(discs.rim),
        discs.folds(),
        discs.at_rest(),
    ]
}

/// How much the mean drape moves with each halving; the second time it must be less, or within the scatter of the discs, or
/// next to nothing.
fn halved(page: &mut Page, what: &str, discs: &[Option<&Discs>; 3]) {
    let [Some(a), Some(b), Some(c)] = discs else { return };
    type Figure = fn(&Discs) -> [f64; 2];
    let figures: [(&str, &str, Figure); 2] =
        [("rim of the drape", "mm", |d| d.rim), ("drape coefficient", "%", |d| d.coefficient)];
    for ((name, unit, of), small) in figures.into_iter().zip(SMALL) {
        let moved = |a: &Discs, b: &Discs| (of(b)[0] - of(a)[0]).abs();
        let (first, second) = (moved(a, b), moved(b, c));
        let scatter = 2.0 * of(b)[1].hypot(of(c)[1]);
        page.claim(
            &format!("{what} moves the {name} less each time"),
            format!("the second time by less, or by at most {small} {unit}, or {} {unit} of scatter", rounded(scatter)),
            format!("{} {unit}, then {} {unit}", rounded(first), rounded(second)),
            second < first || second <= small.max(scatter),
        );
    }
}

fn swing(page: &mut Page) -> Result<()> {
    let found = convergence()?;
    page.paragraph(
        "And motion: a square that swings from two corners, after half a second, against a run with 160 steps a frame. \
         A method of first order leaves half of the error with each halving.",
    );
    let rows = found.distances.iter().map(|(substeps, distance)| [substeps.to_string(), rounded(1e3 * distance)]);
    page.table(&["steps per frame", "a swinging square is off by (mm)"], rows);
    let ratios = found.distances.windows(2).map(|pair| pair[1].1 / pair[0].1);
    page.at_most("what halving the steps leaves of the error of a swing", ratios.fold(0.0, f64::max), 0.8, "");
    page.figures("swing", &found)
}
