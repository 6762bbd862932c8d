//! How the population compares with ANSUR II.

use anyhow::Result;
use modiste::Sources;
use modiste_body::population::{self, Person, Population, PopulationStatistics, soft_directions, statistics};
use modiste_body::registration::ScanShapes;
use modiste_body::{Gender, MakeHumanModel, Quantity};

use super::Page;
use super::page::rounded;
use super::plot::{Series, points};

/// How far the mean of a quantity may be from ANSUR II's, as a share of it.
const MEAN_TOLERANCE: f64 = 0.01;
/// The same of its standard deviation.
const DEVIATION_TOLERANCE: f64 = 0.10;
const CORRELATION_TOLERANCE: f64 = 0.1;
/// How far (mm RMS) the soft directions may be from those that they were carried from.
const CARRIED_LIMIT: f64 = 3.0;

pub(super) fn measure() -> Result<Page> {
    let mut page = Page::new("Population");
    page.paragraph(
        "Each body is solved to one subject of ANSUR II. Its twin is solved to the same figures by the artist's morphs \
         alone, without the soft directions learned from scans.",
    );
    let sources = Sources::default().population()?;
    let files = modiste_io::makehuman::open(&sources.makehuman)?;
    if let Some(scans) = &sources.scans {
        carried(&mut page, &MakeHumanModel::new(&files, Gender::Male)?, &ScanShapes::read(scans)?)?;
    }
    for gender in Gender::ALL {
        let population = read(gender)?;
        let model = MakeHumanModel::new(&files, gender)?;
        let found = statistics(&model, &population)?;
        describe(&mut page, &found)?;
        claims(&mut page, &found);
        page.plot(
            &format!("population-{}", gender.name()),
            &format!("Stature and mass of the {} subjects and of their bodies", gender.name()),
            scatter(&population)?,
        );
        let name = gender.name();
        page.at_most(&format!("{name}: self-intersecting bodies"), found.self_intersecting as f64, 0.0, "");
        page.at_most(&format!("{name}: degenerate bodies"), found.degenerate as f64, 0.0, "");
        page.at_least(&format!("{}: bodies", gender.name()), found.count as f64, 1000.0, "");
        page.figures(gender.name(), &found)?;
    }
    Ok(page)
}

/// How near the soft directions on our mesh come to theirs.
fn carried(page: &mut Page, model: &MakeHumanModel, scans: &ScanShapes) -> Result<()> {
    let (_, found) = soft_directions(model, scans)?;
    page.at_most("soft directions at ±2 on torso and limbs, worst RMS", 1e3 * found.worst_rms, CARRIED_LIMIT, "mm");
    page.figures("carried", &found)
}

/// The population of a gender, as `cargo xtask assets` makes it.
pub(super) fn read(gender: Gender) -> Result<Population> {
    Ok(population::read(crate::assets::population_file(gender), gender)?)
}

/// What a body was solved for; not a number where the quantity is not one of them.
pub(super) fn target(person: &Person, quantity: Quantity) -> f64 {
    let place = population::ANSUR_QUANTITIES.iter().position(|q| q.quantity == quantity);
    place.map_or(f64::NAN, |index| person.targets[index])
}

fn describe(page: &mut Page, found: &PopulationStatistics) -> Result<()> {
    page.paragraph(format!("### {}: {} bodies, {} held out", found.gender.name(), found.count, found.held_out));
    let rows = found.quantities.iter().map(|q| {
        // Lengths in millimetres, mass in kilograms.
        let scale = if q.quantity.unit() == "kg" { 1.0 } else { 1e3 };
        let unit = if q.quantity.unit() == "kg" { "kg" } else { "mm" };
        let number = |value: f64| rounded(scale * value);
        [
            format!("{} ({unit})", q.quantity.title()),
            format!("{} ± {}", number(q.mean), number(q.std_dev)),
            format!("{} ± {}", number(q.survey_mean), number(q.survey_std_dev)),
            number(q.residual.rms),
            number(q.residual.percentile_95),
            number(q.residual_without_soft.rms),
        ]
    });
    page.table(&["quantity", "bodies", "ANSUR II", "residual RMS", "95%", "twin's RMS"], rows);
    Ok(())
}

fn claims(page: &mut Page, found: &PopulationStatistics) {
    let gender = found.gender.name();
    let counted = found.quantities.iter().filter(|q| found.correlated.contains(&q.quantity));
    for q in counted {
        let what = format!("{gender}: {}", q.quantity.title());
        page.at_most(&format!("{what}, error of the mean"), 100.0 * q.mean_error, 100.0 * MEAN_TOLERANCE, "%");
        let tolerance = 100.0 * DEVIATION_TOLERANCE;
        page.at_most(&format!("{what}, error of the standard deviation"), 100.0 * q.std_dev_error, tolerance, "%");
    }
    let what = format!("{gender}: error of the correlations of stature, mass, chest, waist and hip");
    page.at_most(&what, found.worst_correlation_error, CORRELATION_TOLERANCE, "");
}

fn scatter(population: &Population) -> Result<String> {
    let people = || population.persons.iter();
    let bodies = people().map(|person| (person.achieved.stature, person.achieved.body_mass)).collect();
    let subjects =
        people().map(|person| (target(person, Quantity::Stature), target(person, Quantity::BodyMass))).collect();
    let series = [Series::new("subjects", subjects), Series::new("bodies", bodies)];
    points(["stature (m)", "body mass (kg)"], &series, None)
}
