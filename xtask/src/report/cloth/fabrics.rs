//! The ten measured fabrics: strips pulled and bent beside what their tables say, and how three of them drape.

use anyhow::{Context, Result};
use modiste_cloth::Fabric;
use modiste_cloth::validate::{BendTest, Cut, DrapeRun, StripTest, bend_test, drape, strip_test};
use rayon::prelude::*;
use serde::Serialize;

use crate::report::page::{Page, rounded};
use crate::shell::workspace_root;

/// Stretches at which strips are pulled: where the first row of the tables holds, and where the others do.
const STRETCHES: [f64; 2] = [1.01, 7.0 / 6.0];
/// Difference (%) from the table that is allowed at the first and at the second of them.
const FORCE_LIMITS: [f64; 2] = [10.0, 20.0];
/// Difference (%) from the elastica that is allowed.
const SAG_LIMIT: f64 = 10.0;
/// Fabrics that are draped, the stiffest first.
const DRAPED: [&str; 3] = ["11oz-black-denim", "ivory-rib-knit", "gray-interlock"];
/// Rings of the draped disc: edges of 5 mm.
const RINGS: usize = 30;

/// All tests of one fabric.
#[derive(Debug, Serialize)]
struct Tested {
    fabric: String,
    strips: Vec<StripTest>,
    bends: Vec<BendTest>,
}

pub(crate) fn measure() -> Result<Page> {
    let mut page = Page::new("Fabrics");
    let folder = workspace_root().join("../shared/data/materials");
    page.paragraph(
        "The fabrics of Wang, Ramamoorthi and O'Brien 2011, as their files have them. Strips of 5 cm × 20 cm are pulled by \
         clamped ends; the force per width is compared with the moduli of the file at the stretch of the middle third, which go \
         in proportion from its first row, at no strain, to that of the direction, at 7/6. The file looks moduli up by strain and \
         so has no energy; our law has one, in which weft, warp and bias stiffen each by itself. Its stiffening along the bias is \
         fitted to cloth that is kept from narrowing. A strip is not: there most fabrics come out too stiff along the bias. \
         Garments lock at 4.5 % beside that, which is left out here.",
    );
    let files: Vec<_> = modiste_io::list_folder(&folder)
        .with_context(|| format!("the measured fabrics in {}", folder.display()))?
        .into_iter()
        .filter(|path| path.extension().is_some_and(|ending| ending == "json"))
        .collect();
    let tested = files.par_iter().map(|path| test(path)).collect::<Result<Vec<(Fabric, Tested)>>>()?;
    strips(&mut page, &tested);
    bends(&mut page, &tested);
    page.figures("fabrics", &tested.iter().map(|(_, tested)| tested).collect::<Vec<_>>())?;
    let draped = DRAPED
        .into_par_iter()
        .map(|name| {
            let fabric = tested.iter().find(|(fabric, _)| fabric.name == name).map(|(fabric, _)| fabric);
            Ok(drape(fabric.with_context(|| format!("{name}.json is not there"))?, RINGS, 8)?)
        })
        .collect::<Result<Vec<DrapeRun>>>()?;
    drapes(&mut page, &draped)?;
    Ok(page)
}

fn test(path: &std::path::Path) -> Result<(Fabric, Tested)> {
    let measured = modiste_io::fabric::read(path)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let fabric = Fabric::from_tables(&name, measured.density, &measured.stretching, &measured.bending)?;
    let mut tested = Tested { fabric: name, strips: Vec::new(), bends: Vec::new() };
    for cut in Cut::ALL {
        for stretch in STRETCHES {
            tested.strips.push(strip_test(&fabric, &measured.stretching, cut, stretch)?);
        }
        tested.bends.push(bend_test(&fabric, cut)?);
    }
    Ok((fabric, tested))
}

fn strips(page: &mut Page, tested: &[(Fabric, Tested)]) {
    let row = |fabric: &str, strip: &StripTest| {
        [
            fabric.to_owned(),
            strip.cut.name().to_owned(),
            rounded(100.0 * (strip.stretch - 1.0)),
            rounded(strip.force.measured),
            rounded(strip.force.expected),
            rounded(100.0 * (strip.force.measured / strip.force.expected - 1.0)),
        ]
    };
    let rows = tested.iter().flat_map(|(_, tested)| tested.strips.iter().map(|strip| row(&tested.fabric, strip)));
    let header = ["fabric", "cut along", "stretch (%)", "simulated (N/m)", "file (N/m)", "difference (%)"];
    page.table(&header, rows);
    for (index, limit) in FORCE_LIMITS.into_iter().enumerate() {
        for (name, is_bias) in [("weft or warp", false), ("the bias", true)] {
            let errors: Vec<f64> = tested
                .iter()
                .flat_map(|(_, tested)| tested.strips.iter().skip(index).step_by(2))
                .filter(|strip| (strip.cut == Cut::Bias) == is_bias)
                .map(|strip| 100.0 * strip.force.relative_error)
                .collect();
            let percent = 100.0 * (STRETCHES[index] - 1.0);
            let what =
                format!("force along {name} at {percent:.0} % against the file, median of {} strips", errors.len());
            page.at_most(&what, median(&errors), limit, "%");
        }
    }
}

fn bends(page: &mut Page, tested: &[(Fabric, Tested)]) {
    page.paragraph(
        "Strips of twice their bending length (B / w)^(1/3), held level at one end, against the heavy elastica of the file's \
         rigidity: its mean over curvature, a quarter of the number in the file.",
    );
    let row = |fabric: &str, bend: &BendTest| {
        [
            fabric.to_owned(),
            bend.cut.name().to_owned(),
            rounded(1e3 * bend.bending_length),
            rounded(1e3 * bend.sag.measured),
            rounded(1e3 * bend.sag.expected),
            rounded(100.0 * (bend.sag.measured / bend.sag.expected - 1.0)),
        ]
    };
    let rows = tested.iter().flat_map(|(_, tested)| tested.bends.iter().map(|bend| row(&tested.fabric, bend)));
    let header =
        ["fabric", "cut along", "bending length (mm)", "sag, simulated (mm)", "elastica (mm)", "difference (%)"];
    page.table(&header, rows);
    let errors: Vec<f64> =
        tested.iter().flat_map(|(_, tested)| tested.bends.iter().map(|bend| 100.0 * bend.sag.relative_error)).collect();
    page.at_most("sag of a strip against the elastica, median", median(&errors), SAG_LIMIT, "%");
}

fn drapes(page: &mut Page, draped: &[DrapeRun]) -> Result<()> {
    page.paragraph(
        "The drape test: a disc of 30 cm over a plate of 18 cm. The coefficient is the area of the shadow over that of the \
         flat disc, both less the plate: 100 % for a board, the less the limper.",
    );
    let row = |run: &DrapeRun| {
        [
            run.fabric.clone(),
            rounded(100.0 * run.coefficient),
            run.folds.to_string(),
            rounded(1e3 * run.drop),
            run.vertices.to_string(),
        ]
    };
    page.table(
        &["fabric", "drape coefficient (%)", "folds", "rim below the plate (mm)", "vertices"],
        draped.iter().map(row),
    );
    for pair in draped.windows(2) {
        let what =
            format!("drape coefficient of {} less that of {}, which bends easier", pair[0].fabric, pair[1].fabric);
        page.at_least(&what, 100.0 * (pair[0].coefficient - pair[1].coefficient), 1.0, "%");
    }
    page.figures("drapes", &draped)
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}
