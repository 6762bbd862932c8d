//! `cargo xtask report`: what the project claims, measured, as tables, plots and figures.

mod cloth;
mod contact;
mod fit;
mod garment_shape;
mod garments;
mod hair;
mod make;
mod page;
mod penetration;
mod physics;
mod plot;
mod population;
mod scape;
mod speed;
mod timing;
mod trials;
mod wrinkles;

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use modiste_scene::Machine;
use serde::{Deserialize, Serialize};

use crate::shell::{sentence, workspace_root};
use page::Page;

/// What to measure.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Which report.
    #[arg(value_enum)]
    report: Which,
    /// Measure only these sections, with commas between; the others keep their figures.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Stop measuring what goes on where it was stopped after so many minutes, and report what was done.
    #[arg(long, value_name = "NUMBER")]
    minutes: Option<f64>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Which {
    /// The main job, end to end.
    Main,
    /// Every learned garment against physics on bodies and motions that it was not learned from.
    Garments,
    /// The simulation that garments are learned from: fabrics, convergence, wear and cost.
    Physics,
    /// Learned hair beside the figures of Guan's chapter 6.
    Hair,
    /// What a frame costs beside DRAPE's table 1 and our own physics, and how that grows.
    Speed,
    /// What is left inside the body over many motions and bodies; a long run, which goes on where it was stopped.
    Penetration,
}

impl Which {
    /// Name of the report, of its command and of its folder.
    fn name(self) -> &'static str {
        match self {
            Self::Main => "main",
            Self::Garments => "garments",
            Self::Physics => "physics",
            Self::Hair => "hair",
            Self::Speed => "speed",
            Self::Penetration => "penetration",
        }
    }

    fn title(self) -> &'static str {
        match self {
            Self::Main => "What the main job shows",
            Self::Garments => "What the learned garments are worth",
            Self::Physics => "Whether the simulation behaves like cloth",
            Self::Hair => "What learned hair is worth",
            Self::Speed => "What a frame costs",
            Self::Penetration => "Whether anything shows through",
        }
    }

    /// What it says of bodies and motions.
    fn held_out(self) -> &'static str {
        match self {
            Self::Main | Self::Garments | Self::Physics | Self::Hair => " Bodies and motions here were not trained on.",
            // The sections say which motions they take.
            Self::Speed | Self::Penetration => "",
        }
    }

    fn sections(self) -> &'static [Section] {
        match self {
            Self::Main => &MAIN,
            Self::Garments => &GARMENTS,
            Self::Physics => &PHYSICS,
            Self::Hair => &HAIR,
            Self::Speed => &SPEED,
            Self::Penetration => &PENETRATION,
        }
    }
}

/// One topic: its name, which is also its file's, and what measures it.
struct Section {
    name: &'static str,
    measure: Measure,
}

/// How a section is measured.
#[derive(Clone, Copy)]
enum Measure {
    /// As a whole.
    Whole(fn() -> Result<Page>),
    /// Bit by bit, for as long as there is time; what was done before counts.
    Long(fn(Option<Duration>) -> Result<Page>),
}

const GARMENTS: [Section; 1] = [Section { name: "garments", measure: Measure::Whole(garments::measure) }];

const PHYSICS: [Section; 4] = [
    Section { name: "fabrics", measure: Measure::Whole(cloth::fabrics::measure) },
    Section { name: "convergence", measure: Measure::Whole(cloth::convergence::measure) },
    Section { name: "wear", measure: Measure::Whole(cloth::wear::measure) },
    Section { name: "cost", measure: Measure::Whole(cloth::cost::measure) },
];

const HAIR: [Section; 3] = [
    Section { name: "errors", measure: Measure::Whole(hair::errors) },
    Section { name: "collision", measure: Measure::Whole(hair::collision) },
    Section { name: "times", measure: Measure::Whole(hair::times) },
];

const SPEED: [Section; 4] = [
    Section { name: "frames", measure: Measure::Whole(speed::frames::measure) },
    Section { name: "physics", measure: Measure::Whole(speed::physics::measure) },
    Section { name: "growth", measure: Measure::Whole(speed::growth::measure) },
    Section { name: "crowd", measure: Measure::Whole(speed::crowd::measure) },
];

const PENETRATION: [Section; 2] = [
    Section { name: "penetration", measure: Measure::Long(penetration::measure) },
    Section { name: "flicker", measure: Measure::Whole(penetration::flicker::measure) },
];

const MAIN: [Section; 9] = [
    Section { name: "population", measure: Measure::Whole(population::measure) },
    Section { name: "scape", measure: Measure::Whole(scape::measure) },
    Section { name: "contact", measure: Measure::Whole(contact::measure) },
    Section { name: "make", measure: Measure::Whole(make::measure) },
    Section { name: "physics", measure: Measure::Whole(physics::measure) },
    Section { name: "shape", measure: Measure::Whole(garment_shape::measure) },
    Section { name: "wrinkles", measure: Measure::Whole(wrinkles::measure) },
    Section { name: "fit", measure: Measure::Whole(fit::measure) },
    Section { name: "timing", measure: Measure::Whole(timing::measure) },
];

/// `report.json`: the figures of all sections.
#[derive(Debug, Serialize, Deserialize)]
struct Report {
    machine: Machine,
    sections: BTreeMap<String, Page>,
}

/// Measures, and writes `calibration/<report>/`.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let which = arguments.report;
    let sections = which.sections();
    for name in &arguments.only {
        let known = || sections.iter().map(|section| section.name).collect::<Vec<_>>().join(", ");
        ensure!(
            sections.iter().any(|section| section.name == name),
            "there is no section `{name}`; known: {}",
            known()
        );
    }
    let folder = workspace_root().join("calibration").join(which.name());
    let wanted = |name: &str| arguments.only.is_empty() || arguments.only.iter().any(|only| only == name);
    let time = arguments.minutes.map(|minutes| Duration::try_from_secs_f64(60.0 * minutes)).transpose();
    let time = time.context("--minutes")?;
    let mut failures = Vec::new();
    for section in sections.iter().filter(|section| wanted(section.name)) {
        println!("measuring {}", section.name);
        let measured = match section.measure {
            Measure::Whole(measure) => measure(),
            Measure::Long(measure) => measure(time),
        };
        match measured.with_context(|| format!("section {}", section.name)) {
            Ok(page) => {
                page.print();
                keep(which, &folder, section.name, page)?;
            }
            Err(error) => failures.push(sentence(&error)),
        }
    }
    println!("wrote {}", folder.join("report.md").display());
    let hint = if modiste_io::exists(workspace_root().join("training")) {
        ""
    } else {
        "; populations and training sets are made by `cargo xtask assets --fresh`"
    };
    ensure!(failures.is_empty(), "{}{hint}", failures.join("; "));
    Ok(())
}

/// Puts a section among those of earlier runs, as soon as it is measured: a long run that is stopped loses nothing.
fn keep(which: Which, folder: &Path, name: &str, page: Page) -> Result<()> {
    let file = folder.join("report.json");
    let mut sections: BTreeMap<String, Page> =
        if modiste_io::exists(&file) { modiste_io::json::read::<Report>(&file)?.sections } else { BTreeMap::new() };
    for (name, svg) in &page.plots {
        modiste_io::write_bytes(folder.join(name), svg.as_bytes())?;
    }
    sections.insert(name.to_owned(), page);
    let report = Report { machine: Machine::this(), sections };
    modiste_io::json::write(&file, &report)?;
    modiste_io::write_bytes(folder.join("report.md"), markdown(which, &report).as_bytes())?;
    Ok(())
}

/// The report as a page: all claims first, then the sections in their order.
fn markdown(which: Which, report: &Report) -> String {
    let mut text = format!(
        "# {}\n\nWritten by `cargo xtask report {}`; the figures are in `report.json`.{}\n\n",
        which.title(),
        which.name(),
        which.held_out()
    );
    text += &format!(
        "Machine: {}, {} threads, {}.\n\n",
        report.machine.processor, report.machine.threads, report.machine.system
    );
    text += "| claim | target | found | met |\n|---|---|---|---|\n";
    let pages = || which.sections().iter().filter_map(|section| report.sections.get(section.name));
    for claim in pages().flat_map(|page| &page.claims) {
        let met = if claim.met { "yes" } else { "**no**" };
        text += &format!("| {} | {} | {} | {met} |\n", claim.what, claim.target, claim.found);
    }
    for page in pages() {
        text += &format!("\n## {}\n\n{}", page.title, page.text);
    }
    text
}
