//! What is left inside the body, over many motions, bodies and outfits.

pub(crate) mod flicker;
mod motions;
mod run;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Result;
use modiste::Assets;
use modiste_body::Gender;

use super::page::{Page, rounded};
use crate::shell::workspace_root;
use motions::Clip;
use run::{Run, Who, perform};

/// Motions, bodies of both genders, and frames of each run.
const MOTIONS: usize = 20;
const BODIES: usize = 20;
pub(crate) const FRAMES: usize = 50;
/// What is worn, from the inside out.
const OUTFITS: [[&str; 2]; 3] = [["shorts", "tshirt"], ["pants", "longsleeve"], ["skirt", "tshirt"]];
/// The judge of crossing triangles is asked about every so many frames.
const JUDGED_EVERY: usize = 10;
/// Where finished runs are kept.
const FOLDER: &str = "training/penetration";

fn folder() -> PathBuf {
    workspace_root().join(FOLDER)
}

/// Goes on with the run, for as long as there is time, and reports on all that was done.
pub(crate) fn measure(time: Option<Duration>) -> Result<Page> {
    let clips = motions::clips(MOTIONS)?;
    let stamp = stamp()?;
    let (mut done, mut left) = (Vec::new(), Vec::new());
    // Bodies change slowest, so that a run that is stopped early has seen all motions.
    for body in 0..BODIES {
        for clip in &clips {
            for outfit in OUTFITS {
                let who = Who { clip: clip.clone(), body, outfit };
                match Run::load(&who.file(&folder()), &stamp) {
                    Some(run) => done.push(run),
                    None => left.push(who),
                }
            }
        }
    }
    let all = done.len() + left.len();
    let program = modiste_io::hash(&modiste_io::read_bytes(std::env::current_exe()?)?);
    let started = Instant::now();
    for (index, who) in left.iter().enumerate() {
        if time.is_some_and(|time| started.elapsed() >= time) {
            break;
        }
        let run = perform(who, &stamp, &program)?;
        run.save(&who.file(&folder()))?;
        done.push(run);
        let seconds = started.elapsed().as_secs_f64() / (index + 1) as f64 * (left.len() - index - 1) as f64;
        println!("  {} of {all} runs, {:.1} h left: {}", done.len(), seconds / 3600.0, who.name());
    }
    page(&done, all, &clips)
}

/// The models that a result depends on; which builds of the program made it is told in the report.
fn stamp() -> Result<String> {
    let assets = Assets::find()?;
    let mut bytes = Vec::new();
    for gender in Gender::ALL {
        bytes.extend(modiste_io::read_bytes(assets.body(gender))?);
        for garment in OUTFITS.as_flattened() {
            bytes.extend(modiste_io::read_bytes(assets.garment(gender, garment)?)?);
        }
    }
    Ok(modiste_io::hash(&bytes))
}

fn page(done: &[Run], all: usize, clips: &[Clip]) -> Result<Page> {
    let mut page = Page::new("What is left inside the body");
    let sum = |of: fn(&Run) -> usize| done.iter().map(of).sum::<usize>();
    let (frames, judged) = (sum(|run| run.frames), sum(|run| run.judged));
    let captured = clips.iter().filter(|clip| clip.file.is_some()).count();
    let held_out = clips.iter().filter(|clip| clip.file.is_some() && !clip.trained).count();
    page.paragraph(format!(
        "{} of {all} runs of {FRAMES} frames: {MOTIONS} motions ({captured} captured, {held_out} of them from clips that no \
         garment was learned from; the others were made) × {BODIES} bodies of both genders, one leading coefficient of each at \
         ±3 standard deviations × {} outfits, each frame through the run-time object from pose to vertices. Vertices are inside \
         where the winding number of the body says so; every frame is measured. Triangles that cross are looked for by the \
         judge of `modiste check` in every {JUDGED_EVERY}th frame: {judged} of {frames} frames.",
        done.len(),
        OUTFITS.len()
    ));
    let rows = OUTFITS.map(|outfit| {
        let of: Vec<&Run> = done.iter().filter(|run| run.outfit == outfit.join("+")).collect();
        let sum = |of_run: fn(&Run) -> usize| of.iter().map(|run| of_run(run)).sum::<usize>();
        let most = |of_run: fn(&Run) -> f64| of.iter().map(|run| of_run(run)).fold(0.0, f64::max);
        let counts = [
            sum(|run| run.frames),
            sum(|run| run.inside_vertices),
            sum(|run| run.inside_frames),
            sum(|run| run.pinched_frames),
            sum(|run| run.flagged_frames),
            sum(|run| run.judged),
            sum(|run| run.crossing_frames),
            sum(|run| run.layer_frames),
            sum(|run| run.itself_frames),
        ];
        let depths = [most(|run| run.inside_mm), most(|run| run.crossing_mm), most(|run| run.layer_mm)];
        let cells = counts.map(|count| count.to_string()).into_iter().chain(depths.map(rounded));
        std::iter::once(outfit.join("+")).chain(cells).collect::<Vec<_>>()
    });
    let header = [
        "outfit",
        "frames",
        "vertices inside",
        "frames with them",
        "frames pinched",
        "frames flagged by the fit",
        "frames judged",
        "with cloth > 0.5 mm in the body",
        "with outer > 0.5 mm in inner",
        "with cloth > 2 mm in itself",
        "deepest vertex (mm)",
        "deepest triangle (mm)",
        "deepest in inner (mm)",
    ];
    page.table(&header, rows);
    let programs: std::collections::BTreeSet<&str> = done.iter().map(|run| run.program.as_str()).collect();
    page.paragraph(format!("The runs were made by {} build(s) of the program.", programs.len()));
    page.paragraph(
        "Pinched is a frame in which parts of the body pass through each other around a vertex, so that it has no outside where \
         it is; the fit takes it to the rim of the crossing. A frame is flagged by the fit when it says so, or when it leaves a \
         vertex inside.",
    );
    claims(&mut page, done);
    page.figures("runs", &done)?;
    Ok(page)
}

fn claims(page: &mut Page, done: &[Run]) {
    let sum = |of: fn(&Run) -> usize| done.iter().map(of).sum::<usize>();
    let most = |of: fn(&Run) -> f64| done.iter().map(of).fold(0.0, f64::max);
    let (frames, judged) = (sum(|run| run.frames), sum(|run| run.judged));
    let share = |count: usize, of: usize| 100.0 * count as f64 / of.max(1) as f64;
    page.at_least("frames measured", frames as f64, (MOTIONS * BODIES * OUTFITS.len() * FRAMES) as f64, "");
    page.at_most("vertices inside the body", sum(|run| run.inside_vertices) as f64, 0.0, "");
    page.at_most("vertices inside the body that the fit has not flagged", sum(|run| run.unflagged) as f64, 0.0, "");
    page.at_most(
        "judged frames with cloth deeper than 0.5 mm in the body",
        share(sum(|run| run.crossing_frames), judged),
        0.0,
        "%",
    );
    page.at_most(
        "judged frames with an outer garment deeper than 0.5 mm in an inner one",
        share(sum(|run| run.layer_frames), judged),
        0.0,
        "%",
    );
    page.at_most(
        "judged frames with a garment deeper than 2 mm in itself",
        share(sum(|run| run.itself_frames), judged),
        0.0,
        "%",
    );
    page.at_most("deepest vertex inside", most(|run| run.inside_mm), 0.0, "mm");
}
